"""Studies and cases from their files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from tolstat.common.columns import holds
from tolstat.common.errors import Fault, InputError, gather, input_error
from tolstat.common.loads import LOADS
from tolstat.common.strict import validate
from tolstat.joint import Joint
from tolstat.study import points, rewriting
from tolstat.study.file import READERS, check
from tolstat.study.model import Subset
from tolstat.study.selection import Reading
from tolstat.study.study import Case, Study
from tolstat.study.tolerances.kinds import Tolerances

OF_CASE = ("joint", "operation", "solver", "errors")
"""Sections that a case may have, too."""
SECTIONS = (
    *OF_CASE,
    *("tolerances", "correlation", "sampling", "proposal", "sweep", "grid", "case", "variant", "assumed", "reject"),
    *("limits", "fatigue", "output"),
)
"""Sections of a study, in the order of the reference."""


def load(
    path: str | Path | Mapping[str, Any], n: int | None = None, text: str | None = None, joint: Joint | None = None
) -> Study:
    """Read a study file, or make a study of its sections.

    Parameters
    ----------
    path : str, Path or mapping
        TOML file; or the sections of one as nested dictionaries, ``{"joint": {"base": "cirelli2021"}, ...}``, whose
        paths start from the working directory.
    n : int, optional
        Number of joints instead of the file's ``sampling.n``.
    text : str, optional
        TOML to read instead of the file's; `path` is then only what faults and relative paths refer to.
    joint : Joint, optional
        Nominal joint in place of that of ``[joint]``; variants and swept dimensions are read from the file still.

    Returns
    -------
    Study
        With patterns expanded, units converted and the joint file read.

    Raises
    ------
    InputError
        With every fault of the file, of the joint file and of measured data that it names.
    """
    if isinstance(path, Mapping):
        text = rewriting.as_text(path)
        path = "study.toml"
    file = Reading(Path(path), SECTIONS, text)
    if n is not None and isinstance(file.data.setdefault("sampling", {}), dict):
        file.data["sampling"]["n"] = n
    if joint is not None:
        file.parts["joint"] = joint
    _read(file, READERS)
    check(file)
    file.finish("sampling.n" if n is not None else "")
    read: Tolerances = file.scatter
    parts = {name: part for name, part in file.parts.items() if name not in ("scatter", "drawn")}
    parts |= {"tolerances": read.distributions, "entries": read.entries, "axes": read.axes, "lots": read.lots}
    study = Study(file.path, file.text, **parts)
    study.check_mounting()
    return study


def _read(file: Reading, names: Iterable[str]) -> None:
    """Make parts of the sections of a file; one that is there already stays."""
    for name in names:
        if name not in file.parts:
            with gather(file.faults):
                file.parts[name] = READERS[name](file)


def load_case(path: str | Path) -> Case:
    """Read a case file: one joint with its errors.

    Raises
    ------
    InputError
        With every fault of the file.
    """
    file = Reading(Path(path), OF_CASE)
    if "sampling" in file.data:
        raise input_error(file.place, "is a study, not a case of one joint", f"run it with: tolstat run {file.path}")
    _read(file, ["joint"])
    with gather(file.faults):
        file.parts["operation"] = points.operation(file)
    _read(file, ["solver", "errors"])
    if file.solver is not None and file.solver.fidelity == "auto":
        remedy = 'write "dynamic", "quasistatic" or "ideal"'
        file.fault("solver.fidelity", "'auto' needs the joints of a campaign, a case has one joint", remedy)
    file.finish()
    case = Case(file.path, file.text, file.joint, file.operation, file.solver, file.errors)
    case.check_mounting()
    return case


def subset_of(study: Study, sampling: Mapping[str, Any]) -> Study:
    """Make the study of a subset simulation from the study whose tolerances it uses.

    Parameters
    ----------
    study : Study
        Study with any sampling method that draws joints; its histories are not stored.
    sampling : mapping
        Fields of `model.Subset` except those that are taken from the study.

    Returns
    -------
    Study
        Study whose ``sampling`` is a `model.Subset`; it can draw the joints of level 0, which are those of a random
        campaign.

    Raises
    ------
    InputError
        When the study has no tolerances or does not store the load, and with every fault of `sampling`.
    """
    faults: list[Fault] = []
    if not study.tolerances:
        remedy = 'give a study with [tolerances] and sampling.method = "random"'
        faults.append(Fault(str(study.path), "has no tolerances to draw joints from", remedy))
    if study.sampling.is_matched:
        found = "matches diameters by classes, which a subset simulation does not draw"
        faults.append(study.fault("sampling.selective", found, "remove it"))
    for load in (LOADS[name] for name in sampling["levels"]):
        if not holds(study.output.columns, load.name):
            remedy = f"add {', '.join(load.columns)}"
            faults.append(study.fault("output.results", f"leaves out {load.name}, which --limit needs", remedy))
    kept = study.sampling.model_dump(include=set(Subset.FROM_STUDY))
    with gather(faults):
        read = validate(Subset, kept | {"n": sampling["per_level"]} | dict(sampling), "subset simulation")
    if faults:
        raise InputError(faults)
    output = study.output.model_copy(update={"histories": "none"})
    return replace(study, sampling=read, proposals=(), output=output)
