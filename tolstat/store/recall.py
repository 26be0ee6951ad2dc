"""Restore the study of a campaign from its result file."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tolstat.common.errors import Fault, InputError, StoreError
from tolstat.common.files import only_below
from tolstat.common.strict import read_section, validate
from tolstat.store.recorded import joint_of
from tolstat.study import Study, load, subset_of
from tolstat.study.model import Solver

if TYPE_CHECKING:
    from tolstat.store.reader import Reader


def recall(store: Reader, n: int | None = None, path: Path | None = None) -> Study:
    """Read the study that a result file was made from.

    Parameters
    ----------
    store : Reader
        The file, which holds the text of its study and the nominal joint. Relative paths in the text, of measured data
        or of a joint file with variants, are resolved from the result file's folder.
    n : int, optional
        Number of joints instead of the campaign's.
    path : Path, optional
        The study file to read instead of the text.

    Returns
    -------
    Study

    Raises
    ------
    InputError
        When the study can no longer be read.
    StoreError
        When the study does not have the identity of the campaign in the file.
    """
    held = store.sampling["n"]
    source = path if path is not None else store.path.parent / f"{Path(store.study_name).name}.toml"
    text = None if path is not None else store.study_text
    joint = None if path is not None or store.variants else joint_of(store, 0)
    try:
        with nullcontext() if path is not None else only_below(store.path.parent):
            study = load(source, n=held, text=text, joint=joint)
    except InputError as error:
        if path is not None:
            raise
        own = [fault for fault in error.faults if fault.place.startswith(f"{source}: ")]
        found = "holds the text of this study; what the text names is looked for in the folder of the result file"
        remedy = "give the study file, if the command has this option: --study STUDY"
        raise InputError([*own, Fault(str(store.path), found, remedy)]) from error
    if store.sampling["method"] == "subset":
        study = subset_of(study, {key: value for key, value in store.sampling.items() if key != "dimensions"})
    if path is None:
        study = replace(study, solver=_solver(store, study))
    study = _at_point(store, study)
    differing = differing_keys(store.identity, json.loads(json.dumps(study.identity())))
    if differing:
        lines = ["does not match the study that was read for it", *differing]
        found = "\n    ".join(lines)
        raise StoreError(str(Fault(str(store.path), found, "give the study file of the campaign: --study STUDY")))
    if n is None:
        return study
    with nullcontext() if path is not None else only_below(store.path.parent):
        larger = load(source, n=n, text=text, joint=joint)
    return replace(_at_point(store, larger), solver=study.solver)


def mentions(store: Reader, keys: Collection[str], section: str) -> bool:
    """Whether a section of a file's study, as it is written, has one of some keys; the study itself is not read."""
    return _has(read_section(store.path, store.study_text, section), keys)


def _has(table: Mapping[str, Any], keys: Collection[str]) -> bool:
    return any(key in keys or (isinstance(inner, Mapping) and _has(inner, keys)) for key, inner in table.items())


def _at_point(store: Reader, study: Study) -> Study:
    """Study at the point of a file with one operating point that was made from a study with several."""
    if len(study.points) > 1 and len(store.points) == 1:
        own = next((point for point in study.points if point.operation == store.operation), None)
        return study if own is None else study.at(own.name)
    return study


def differing_keys(held: Mapping[str, Any], wanted: Mapping[str, Any]) -> list[str]:
    """Compare two identities of studies.

    Returns
    -------
    list of str
        ``"solver.steps_per_rev: 90 in the file, 180 in the study"`` for every key that differs.
    """
    lines = []
    for key in sorted(held.keys() | wanted.keys()):
        if key not in wanted or key not in held or held[key] != wanted[key]:
            sides = (f"{side[key]!r}" if key in side else "nothing" for side in (held, wanted))
            lines.append("{}: {} in the file, {} in the study".format(key, *sides))
    return lines


def _solver(store: Reader, study: Study) -> Solver:
    """Solver settings of the file; they differ from those in the study's text in campaigns at two fidelities."""
    held = {key.removeprefix("solver."): value for key, value in store.identity.items() if key.startswith("solver.")}
    own = study.solver.model_dump()
    changed = {key: value for key, value in held.items() if key in own and own[key] != value}
    given = study.solver.model_dump(exclude_unset=True) | changed
    return validate(Solver, given, f"{store.path}: solver") if changed else study.solver
