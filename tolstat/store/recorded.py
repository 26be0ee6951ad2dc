"""Study, joints, operating points, solver options and sampling design of a campaign, from its result file."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.clustered import Clustered
from tolstat.analysis.design import Design, Independent, Listed, Looked
from tolstat.common.errors import Fault, InputError
from tolstat.common.strict import validate
from tolstat.common.tables import Options, from_names, tables
from tolstat.common.wording import Wording
from tolstat.joint import MEANS, SPLINE, Joint, Operation, OperationOfLinkage, operating, perturb, varied
from tolstat.joint.bearing import FOR_LIFE
from tolstat.joint.derived import get
from tolstat.joint.model import leaves, nested
from tolstat.joint.sections import RIGID, mounting_and_law
from tolstat.solver import fidelity
from tolstat.store.hdf5 import BLOCK, pick, store_error
from tolstat.store.reader import Reader
from tolstat.study import Study, load, mounting, subset_of
from tolstat.study.design import KEYS
from tolstat.study.model import Solver

_OPERATION = tuple(f"operation.{name}" for name in MEANS)


def wording_of(store: Reader) -> Wording:
    """Wording of what is said of the rows of a file."""
    return Wording.of(store.mechanism, store.study_text, (store.study_name, store.path.stem, *store.case_names))


def joint_of(store: Reader, row: int) -> Joint:
    """Nominal joint of file slot `row`: the study's, or that of the slot's variant.

    Raises
    ------
    InputError
        When this version cannot read the joint in the file.
    """
    nominal = validate(Joint, store.joint, f"{store.path}: joint")
    return varied(nominal, _values(store, row))


def description(store: Reader) -> str:
    """What the file says of the linkage, or of the joint; of a drive shaft of unlike joints what it says of both."""
    operation = next(iter(store.points.values())).operation
    if isinstance(operation, OperationOfLinkage):
        return operation.linkage.description
    first, joint2 = joint_of(store, 0).description, operation.joint2
    if joint2 is None or joint2.description == first:
        return first
    own = {"joint 1": first, "joint 2": joint2.description}
    return "; ".join(f"{name}: {text}" for name, text in own.items() if text)


def joints_at(store: Reader, row: int) -> tuple[Joint, ...]:
    """Joints that are simulated together in file slot `row`: one, or both of a drive shaft."""
    joint = joint_of(store, row)
    return (joint, joint2_of(store) or joint) if store.mechanism.is_shaft else (joint,)


def joint2_of(store: Reader) -> Joint | None:
    """Joint 2 of drive shafts, the same at all operating points, if it is another than joint 1."""
    return next((point.operation.joint2 for point in store.points.values()), None)


def operation_of(store: Reader, row: int) -> Operation:
    """Operating point of file slot `row`: that of the store, or of the slot's variant; see `joint.operating`."""
    values = {key.removeprefix("operation."): value for key, value in _values(store, row).items() if key in _OPERATION}
    return store.operation.model_copy(update=values)


def operating_points(store: Reader, slots: slice = slice(None)) -> dict[str, NDArray[np.float64]]:
    """Values that the joints of a slice of file slots have at the operating point, (m,) each; see `joint.operating`.

    Linkages have a speed and a torque.
    """
    sticks, known = store.mechanism.spline, tables(store.mechanism).ERROR.names or ()
    varying = [name for name in MEANS if f"operation.{name}" in known]
    errors = store.errors(slots, [*(f"operation.{name}" for name in varying), *[SPLINE] * sticks])

    def at(row: int, errors: NDArray[np.void]) -> dict[str, NDArray[np.float64]]:
        return operating(operation_of(store, row), errors, joints_at(store, row)[-1].shaft.spline if sticks else None)

    if not store.variants:
        return {name: values for name, values in at(0, errors).items() if name in varying}
    first, last, _ = slots.indices(store.n)
    each = [at(row, errors[row - first : row - first + 1]) for row in range(first, last)]
    return {name: np.concatenate([point[name] for point in each]) for name in varying}


def options_of(store: Reader, row: int, attempt: int) -> Options:
    """Solver options of file slot `row` in its `attempt`: the study's, its variant's, or those of that retry.

    Raises
    ------
    InputError
        When the settings of the variant cannot be used.
    """
    changed = {key: value for key, value in _values(store, row).items() if key.startswith("solver.")}
    if changed and not attempt:
        written = {key: value for key, value in store.identity.items() if key.startswith("solver.")} | changed
        if written.get("solver.fidelity") != "auto":
            written.pop("solver.error_budget", None)  # identity holds its default; studies give it with "auto" only
        solver = validate(Solver, nested(written)["solver"], f"{store.path}: solver")
        return settings(solver, store.fidelity)
    return from_names(store.retries[attempt - 1]["options"] if attempt else store.options)


def settings(solver: Solver, choice: dict[str, Any]) -> Options:
    """Solver options for the kernel; for ``auto``, fidelity and steps are taken from the record `choice`."""
    options = solver.options()
    return fidelity.apply(options, choice) if solver.fidelity == "auto" else options


def swept(store: Reader) -> dict[str, NDArray[np.float64]]:
    """Dimensions that a sweep varies: dotted key to the value of every joint, (n,), in the unit of `swept.KEYS`.

    NaN where a joint has a word in place of a value: ``shaft.axial`` of one that is rigid.
    """
    names = [name for names, *_ in store.identity.get("sweep", []) for name in names if name in KEYS]
    if not names:
        return {}
    nominal, number = validate(Joint, store.joint, f"{store.path}: joint"), store.design["variant"]
    joints = [varied(nominal, variant.values) for variant in store.variants]
    values = {name: [get(joint, name) for joint in joints] for name in names}
    return {
        name: np.array([np.nan if isinstance(value, str) else value for value in of_variants], float)[number]
        for name, of_variants in values.items()
    }


def in_words(store: Reader) -> str:
    """What is simulated and by which contact law, see `mounting_and_law`; raises as `mountings`."""
    axial, laws = mountings(store)
    operation = next(iter(store.points.values())).operation
    if isinstance(operation, OperationOfLinkage):
        own = [leaves(pair.joint) for pair in operation.linkage.pair.values()]
        laws = [keys.get("contact.law", law) for law in laws for keys in own]
        return f"{operation.linkage.in_words}{mounting_and_law([], laws)}"
    return mounting_and_law(axial, laws)


def mountings(store: Reader) -> tuple[list[float | str], list[str]]:
    """``shaft.axial`` and ``contact.law`` of each variant whose joints are in the file, for `mounting_and_law`.

    Raises
    ------
    InputError
        When this version cannot read the joint in the file.
    """
    nominal = validate(Joint, store.joint, f"{store.path}: joint")
    numbers = np.unique(store.design["variant"]) if store.variants else ()
    changed = [store.variants[number].values for number in numbers] or [{}]
    laws = [values.get("contact.law", nominal.contact.law) for values in changed]
    if joint2 := joint2_of(store):
        return [joint2.shaft.axial], [*laws, joint2.contact.law]
    return [values.get("shaft.axial", nominal.shaft.axial) or RIGID for values in changed], laws


def bearings_in_words(store: Reader) -> str:
    """``needle bearings`` where the contact law is that of needles or a bearing has what a life needs, else ``plain``.

    Without an adjective where joints differ.
    """
    laws = mountings(store)[1]
    joints = [joint_of(store, 0)] * len(laws)
    if joint2 := joint2_of(store):
        joints[-1] = joint2
    rolling = {
        law == "needles" or (joint.bearing is not None and not joint.bearing.lacking(FOR_LIFE))
        for law, joint in zip(laws, joints, strict=True)
    }
    return "bearings" if len(rolling) > 1 else "needle bearings" if True in rolling else "plain bearings"


def note_on_mounting(store: Reader) -> str:
    """Note where rigid shafts meet errors along them, see `mounting.note_on_shafts`; empty for other files."""
    names = {".".join(key.split(".")[1:3]) for key in store.identity if key.startswith("tolerances.")}
    joint, name = joint_of(store, 0), store.study_name
    command = mounting.with_free_shaft(f"{name}.toml", name, joint)
    return mounting.note_on_shafts(names, mountings(store)[0], store.mechanism, command)


def parameters(store: Reader, rows: NDArray[np.intp]) -> NDArray[np.void]:
    """Parameters of the joints in file slots `rows`, ascending, (m,) table PARAM."""
    params, errors = np.empty(len(rows), tables(store.mechanism).PARAM), pick(store.errors, rows)
    number = store.design["variant"][rows] if store.variants else np.zeros(len(rows), np.intp)
    for variant in np.unique(number):
        here = number == variant
        first = int(rows[here][0])
        params[here] = perturb(joint_of(store, first), operation_of(store, first), errors[here])
    return params


MISFIT = "a pin is larger than its hole"
"""Why a joint of `misfits` has no result."""


def misfits(store: Reader, rows: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Which of the joints in file slots `rows`, ascending, cannot be assembled, (m,): see `MISFIT`."""
    parts = (rows[first : first + BLOCK] for first in range(0, len(rows), BLOCK))
    none = np.zeros(0, dtype=bool)
    return np.concatenate([none, *((parameters(store, part)["clearance"] < 0.0).any(axis=1) for part in parts)])


def perturbed(study: Study, rows: NDArray[np.intp], errors: NDArray[np.void]) -> NDArray[np.void]:
    """Parameters of `rows` of the campaign, (m,) table PARAM, each computed from the joint and point of its variant."""
    return parameters_of(study, variants(study, rows), errors)


def parameters_of(study: Study, variant: NDArray[np.integer], errors: NDArray[np.void]) -> NDArray[np.void]:
    """Parameters of joints, (m,) table PARAM, from their errors and the index of the variant of each, (m,)."""
    params = np.empty(len(errors), tables(study.mechanism).PARAM)
    for number in np.unique(variant):
        here = variant == number
        params[here] = perturb(study.joints[number], study.operations[number], errors[here])
    return params


def variants(study: Study, rows: NDArray[np.intp]) -> NDArray[np.integer]:
    """Index of the variant of each of `rows` of the campaign, (m,)."""
    return study.design["variant"][rows] if len(study.joints) > 1 else np.zeros(len(rows), np.intp)


def _values(store: Reader, row: int) -> dict[str, Any]:
    """Values that define the variant of file slot `row`; empty if all rows have the study's joint."""
    return store.variants[store.design["variant"][row]].values if store.variants else {}


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
    joints = store.sampling["n"]
    source = path if path is not None else store.path.parent / f"{Path(store.study_name).name}.toml"
    text = None if path is not None else store.study_text
    joint = None if path is not None or store.variants else joint_of(store, 0)
    joint2 = None if path is not None else joint2_of(store)
    try:
        study = load(source, n=joints, text=text, joint=joint, joint2=joint2)
    except InputError as error:
        if path is not None:
            raise
        found = "holds the text of this study; what the text names is looked for in the folder of the result file"
        remedy = "give the study file, if the command has this option: --study STUDY"
        raise InputError([*error.faults, Fault(str(store.path), found, remedy)]) from error
    if store.sampling["method"] == "subset":
        study = subset_of(study, store.sampling)
    study = _at_point(store, study)
    differing = differing_keys(store.identity, study.identity())
    if differing:
        found = "\n    ".join(["does not match the study that was read for it", *differing])
        raise store_error(store.path, found, "give the study file of the campaign: --study STUDY")
    if n is None:
        return study
    return _at_point(store, load(source, n=n, text=text, joint=joint, joint2=joint2))


def mentions(table: Mapping[str, Any], keys: Collection[str]) -> bool:
    """Whether a section of a study, as it is written, has one of some keys, at any depth."""
    return any(key in keys or (isinstance(inner, Mapping) and mentions(inner, keys)) for key, inner in table.items())


def _at_point(store: Reader, study: Study) -> Study:
    """Study at the point of a file with one operating point that was made from a study with several."""
    if len(study.points) > 1 and len(store.points) == 1:
        point_of_file = next((point for point in study.points if point.operation == store.operation), None)
        return study if point_of_file is None else study.at(point_of_file.name)
    return study


def differing_keys(in_file: Mapping[str, Any], wanted: Mapping[str, Any]) -> list[str]:
    """Compare two identities of studies.

    Returns
    -------
    list of str
        ``"solver.steps_per_rev: 90 in the file, 180 in the study"`` for every key that differs.
    """
    lines = []
    for key in sorted(in_file.keys() | wanted.keys()):
        if key not in wanted or key not in in_file or in_file[key] != wanted[key]:
            sides = (f"{side[key]!r}" if key in side else "nothing" for side in (in_file, wanted))
            lines.append("{}: {} in the file, {} in the study".format(key, *sides))
    return lines


def design_of(store: Reader) -> Design:
    """Sampling design of a file: how its joints were drawn."""
    method, size = str(store.sampling["method"]), int(store.sampling.get("joints_per_lot", 1))
    if size > 1:
        return Clustered(np.asarray(store.samples) // size)
    if method != "random":
        return Listed(method)
    return Looked() if store.stop else Independent()
