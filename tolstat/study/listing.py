"""Reading ``[sweep]``; ``[grid]``, ``[[case]]`` and ``[[variant]]`` of a study whose joints are listed one by one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from tolstat import joint
from tolstat.common import strict, units
from tolstat.common.error_fields import error_units
from tolstat.common.errors import Fault, collected, gather, raise_all
from tolstat.common.notation import DIAMETER
from tolstat.common.strict import Strict, refuse
from tolstat.common.tables import DESIGN, Variant
from tolstat.joint import Joint, Operation
from tolstat.joint.model import TOLD, laid_over, leaves, nested
from tolstat.study import crosses, rewriting, selection
from tolstat.study.design import IDEAL, KEYS, MAX_JOINTS, Design, cube
from tolstat.study.model import MAX_ROWS, Solver, SweepAxis, SweepEntry
from tolstat.study.selection import Assignments, Entry, Reading
from tolstat.study.tolerances.entry import Site

Section = tuple[int | str, ...]


class CaseEntry(Strict):
    """A joint with these errors; the joint without errors is always run, too."""

    name: str = Field(min_length=1, examples=["tilt"])
    """name of the case"""
    errors: dict[str, Any] = Field(
        default_factory=dict, json_schema_extra={"x-table": "errors"}, examples=[{"pin1.tilt_z": "0.5 deg"}]
    )
    """errors by name or pattern, as in [errors]; needed without `file`"""
    file: str | None = Field(default=None, examples=["cross.csv"])
    """in place of `errors`: text table of a measured joint, one row, with a column for each error that was measured"""

    @model_validator(mode="after")
    def _given_once(self) -> Self:
        if self.file is None and not self.errors:
            raise refuse("has neither errors nor file", 'give errors = { ... }, or file = "cross.csv"')
        if self.file is not None and self.errors:
            raise refuse("has errors beside file", "remove one of the two")
        return self


class Range(Strict):
    """One entry of ``vary``: a key of the joint goes from `start` to `stop`, given as in the file."""

    start: Any = Field(alias="from", examples=["76.0 mm"])
    """value of the first joint, a quantity of the key's unit"""
    stop: Any = Field(alias="to", examples=["75.6 mm"])
    """value of the last joint, a quantity of the key's unit"""


def _keys_of(table: str, example: dict[str, Any]) -> Any:
    """Field of a table that may be left out; its JSON schema has a name."""
    return Field(default_factory=dict, json_schema_extra={"x-table": table}, examples=[example])


class VariantEntry(Strict):
    """Another joint, or a family of them."""

    name: str = Field(min_length=1, examples=["clearance"])
    """name of the family; entries of one name make one family"""
    joint: dict[str, Any] = _keys_of("overrides", {"contact": {"law": "point"}})
    """keys in place of those of [joint], which may name another `base`, too"""
    points: int | None = Field(default=None, strict=True, ge=2, le=10_000, examples=[21])
    """number of joints of a family; needed with `vary`"""
    design: Literal["line", "sobol"] = Field(default="line", examples=["sobol"])
    """`line`: all keys of `vary` go from one end to the other together; `sobol`: a scrambled Sobol' sequence fills the
    box"""
    seed: int = Field(default=0, strict=True, ge=0, lt=2**63, examples=[2021])
    """seed of the scrambling of `sobol`"""
    vary: dict[str, Any] = _keys_of("vary", {"cross.R": {"from": "60 mm", "to": "90 mm"}})
    """keys of the joint that the family varies, each with its range"""
    cases: list[str] | None = Field(default=None, examples=[["tilt"]])
    """names of the cases to run; all by default; the joint without errors is always run"""
    operation: dict[str, Any] = _keys_of("operation", {"torque": "0 N*m"})
    """keys in place of those of [operation]"""
    solver: dict[str, Any] = _keys_of("solver", {"steps_per_rev": 720})
    """keys in place of those of [solver]"""
    note: str = Field(default="", examples=["long free flight"])
    """note for the reader of the report"""

    @model_validator(mode="after")
    def _family(self) -> Self:
        if bool(self.vary) != (self.points is not None):
            given, lacking = ("vary", "points") if self.vary else ("points", "vary")
            raise refuse(f"{given} without {lacking}", f"add {lacking}")
        if self.seed and self.design != "sobol":
            raise refuse("seed without a random design", 'remove it, or write design = "sobol"')
        return self


class Axis(NamedTuple):
    """One entry of ``[grid]``: the errors that it names take each of the values."""

    entry: Entry
    names: list[str]
    values: list[float]


Nominal = tuple[Joint, Operation, Solver]
"""Joint, operating point and settings."""
Listed = tuple[Variant, Joint, Operation, Solver, list[int]]
"""A variant, its joint, operating point and settings, and the indices of the cases that are run with it."""


def nominal_of(file: Reading) -> Nominal | None:
    """Base of the variants: ``[joint]``, ``[operation]`` and ``[solver]``; None if one of them has faults."""
    nominal: tuple[Any, ...] = file.joint, file.operation, file.solver
    return None if None in nominal else nominal


def design(file: Reading) -> Design | None:
    """Read ``[grid]``, ``[[case]]`` and ``[[variant]]``: the joints that a study lists.

    Returns
    -------
    Design
        None where there are faults, or no nominal joint: variants are not read then.
    """
    before, nominal = len(file.faults), nominal_of(file)
    axes: list[Axis] = []
    variants: list[Listed] = []
    with gather(file.faults):
        axes += _grid(file)
    cases: dict[str, dict[str, float]] = {IDEAL: {}} | _cases(file, axes)
    if nominal is not None:
        so_far = len(file.faults)
        variants = _variants(file, nominal, list(cases))
        if len(file.faults) == so_far:
            _note_clashes(file, axes)
    values = product(*(axis.values for axis in axes))  # one empty point without axes
    points = tuple({name: value for axis, value in zip(axes, at, strict=True) for name in axis.names} for at in values)
    rows = len(points) * sum(len(run) for *_, run in variants)
    if rows > MAX_ROWS:
        file.fault("variant", f"gives {rows} joints", f"give at most {MAX_ROWS}")
    if nominal is None or len(file.faults) > before:
        return None
    names, joints, operations, solvers, runs = zip(*variants, strict=True)
    # for each variant, for each point of the grid, for each of its cases
    numbers = [
        (variant, case, variant * len(points) + point)
        for variant, run in enumerate(runs)
        for point in range(len(points))
        for case in run
    ]
    return Design(names, joints, operations, solvers, cases, points, np.array(numbers, DESIGN))


def axes_of_sweep(file: Reading) -> tuple[SweepAxis, ...]:
    """Read ``[sweep]``: the axes of a grid."""
    axes = []
    for entry in file.entries("sweep"):
        with gather(file.faults):
            units_of = error_units(file.mechanism)
            if not selection.select(entry.pattern, units_of):
                units_of = units_of | KEYS
            names = selection.resolve(entry, units_of, file.place)
            with gather(file.faults):
                file.claims.claim(entry, names)
            site = Site(names[0], units_of[names[0]], 0.0, file.folder)
            read = file.model(SweepEntry, entry.value, *entry.path, site=site)
            axes.append(SweepAxis(tuple(names), read.start, read.stop, read.points))
    return tuple(axes)


def swept(file: Reading) -> Design | None:
    """Joints of a sweep: the study's, then one for each point of the axes of dimensions, the last varying fastest.

    Returns
    -------
    Design
        None if no axis is a dimension of the joint, and for other sampling methods.
    """
    nominal, axes = nominal_of(file), file.sweep or ()
    dimensions = [number for number, axis in enumerate(axes) if axis.names[0] in KEYS]
    if file.sampling is None or file.sampling.method != "sweep" or nominal is None or not dimensions:
        return None
    shape = [axes[number].points for number in dimensions]
    if np.prod(shape) > MAX_JOINTS:
        file.fault("sweep", f"gives {np.prod(shape)} joints with dimensions of their own", f"give at most {MAX_JOINTS}")
        return None
    joints, variants = [nominal[0]], [Variant("joint", {})]
    for values in product(*(np.linspace(axes[k].start, axes[k].stop, axes[k].points).tolist() for k in dimensions)):
        point = {name: value for k, value in zip(dimensions, values, strict=True) for name in axes[k].names}
        keys = nested({key: units.Quantity(KEYS[key]).written(value) for key, value in point.items()})
        joints.append(_joint(file, laid_over(file.data["joint"], keys), ("sweep",)))
        variants.append(Variant("sweep", _values(nominal[0], joints[-1], list(point))))
    all_points, first = [axis.points for axis in axes], file.sampling.first_sample
    index = np.unravel_index(np.arange(np.prod(all_points)), all_points)
    number = 1 + np.ravel_multi_index([index[k] for k in dimensions], shape)
    rows = np.zeros(first + len(number), DESIGN)
    rows["variant"][first:] = number
    rows["group"] = np.arange(len(rows))
    count = len(joints)
    return Design(tuple(variants), tuple(joints), nominal[1:2] * count, nominal[2:] * count, {}, (), rows)


def _grid(file: Reading) -> Iterator[Axis]:
    section = file.data.get("grid", {})
    if not isinstance(section, Mapping):
        return file.fault("grid", "is not a table", "write [grid]")
    claims, units_of = Assignments(file.place, file.mechanism), error_units(file.mechanism)
    for entry in selection.entries(section, file.mechanism, "grid"):
        with gather(file.faults):
            names = selection.resolve(entry, units_of, file.place)
            claims.claim(entry, names)
            if not isinstance(entry.value, list) or not entry.value:
                file.fault(entry.path, f"{entry.value!r} is not a list of values", 'write ["0 deg", "15 deg"]')
                continue
            values = []
            for number, value in enumerate(entry.value):
                with gather(file.faults):
                    item = Entry(entry.pattern, (*entry.path, number), value)
                    values.append(selection.quantity(item, units_of[names[0]], file.place))
            yield Axis(entry, names, values)


def _cases(file: Reading, axes: list[Axis]) -> dict[str, dict[str, float]]:
    """Errors of each case; empty for a case with faults, so that variants can refer to it."""
    cases: dict[str, dict[str, float]] = {}
    for number, item in enumerate(file.tables("case")):
        name = item.get("name") if isinstance(item, Mapping) else None
        if isinstance(name, str):
            if name in cases or name == IDEAL:
                remedy = "remove it: it is always run" if name == IDEAL else "give each case its own name"
                file.fault(("case", number, "name"), f"a case {name!r} exists already", remedy)
            cases[name] = {}
        with gather(file.faults):
            entry = file.model(CaseEntry, item, "case", number)
            claims = Assignments(file.place, file.mechanism)
            for axis in axes:
                claims.claim(axis.entry, axis.names)
            errors = entry.errors if entry.file is None else _measured(file, entry.file, number)
            cases[entry.name] = selection.fixed_errors(file, errors, ("case", number, "errors"), claims)
    return cases


def _measured(file: Reading, name: str, number: int) -> dict[str, Any]:
    """Errors of a measured joint as a study writes them; they take the place of the file in the study's text."""
    measured, notes = crosses.of_one(file.folder / name, file.mechanism, file.errors or {})
    units_of = error_units(file.mechanism)
    errors = {key: f"{value!r} {units_of[key]}" for key, value in measured.items()}
    file.notes = (*file.notes, *notes)
    keys = {"file": None, "errors": errors}
    file.text = rewriting.with_keys(file.text, {("case", number): keys}, file.place)
    return errors


def _note_clashes(file: Reading, axes: list[Axis]) -> None:
    """Note keys of the operating point that a variant and the grid both give."""
    taken = {name for axis in axes for name in axis.names}
    for number, item in enumerate(file.tables("variant")):
        for key in item.get("operation", {}):
            if f"operation.{key}" in taken:
                file.fault(("variant", number, "operation", key), "is set by grid already", "remove one of the two")


def _variants(file: Reading, nominal: Nominal, cases: list[str]) -> list[Listed]:
    """Variants without faults in the order of the file, families expanded."""
    all_cases = list(range(len(cases)))
    entries = file.tables("variant")
    if not entries:
        return [(Variant("joint", {}), *nominal, all_cases)]
    variants = []
    for number, item in enumerate(entries):
        with gather(file.faults):
            entry = file.model(VariantEntry, item, "variant", number)
            unknown = [name for name in entry.cases or () if name not in cases]
            for name in unknown:
                file.fault(f"variant[{number}].cases", f"no case {name!r}", strict.did_you_mean(name, cases))
            run = all_cases if entry.cases is None else sorted({0, *map(cases.index, set(entry.cases) - set(unknown))})
            variants += _expanded(file, entry, run, nominal, ("variant", number))
    return variants


def _expanded(file: Reading, entry: VariantEntry, run: list[int], nominal: Nominal, at: Section) -> list[Listed]:
    keys = laid_over(file.data["joint"], entry.joint)
    joints = [_joint(file, keys, (*at, "joint"))]
    ranges = dict(_ranges(entry.vary, (*at, "vary"), file.place))
    if ranges:
        members = _members(file, entry, keys, ranges, (*at, "vary"))
        joints = [_joint(file, laid_over(keys, member), (*at, "vary")) for member in members]
    operation, solver = _settings(file, entry, nominal, at)
    values = {f"operation.{key}": getattr(operation, key) for key in entry.operation}
    values |= {f"solver.{key}": getattr(solver, key) for key in entry.solver}
    written = [*leaves(entry.joint), *ranges]
    variants = [Variant(entry.name, _values(nominal[0], made, written) | values, entry.note) for made in joints]
    return [(*pair, operation, solver, run) for pair in zip(variants, joints, strict=True)]


def _settings(file: Reading, entry: VariantEntry, nominal: Nominal, at: Section) -> tuple[Operation, Solver]:
    """Operating point and numerical settings of a variant: those of the study, with keys replaced by the entry."""
    _, operation, solver = nominal
    with collected() as faults:
        with gather(faults):
            keys = operation.model_dump(mode="json", by_alias=True) | entry.operation
            operation = file.model(type(operation), keys, *at, "operation")
        if entry.solver.get("fidelity") == "auto":
            where = f"{file.place}: {strict.dotted((*at, 'solver', 'fidelity'))}"
            faults.append(Fault(where, "'auto' cannot be set for one variant", "write it in [solver]"))
        with gather(faults):
            solver = file.model(Solver, solver.model_dump(exclude_unset=True) | entry.solver, *at, "solver")
    return operation, solver


def _members(
    file: Reading, entry: VariantEntry, keys: Mapping[str, Any], ranges: Mapping[str, Range], at: Section
) -> list[dict[str, Any]]:
    """Keys of each joint of a family, as a joint file writes them."""
    assert entry.points is not None
    ends = [{key: getattr(r, end) for key, r in ranges.items()} for end in ("start", "stop")]
    start, stop = (_joint(file, laid_over(keys, nested(end)), at) for end in ends)
    low, high = leaves(start.model_dump()), leaves(stop.model_dump())
    faults = []
    for key in ranges:
        where = f"{file.place}: {strict.dotted((*at, key))}"
        words = [end[key] for end in (low, high) if not isinstance(end[key], float)]
        if words:
            found = f"{words[0]!r} is not a quantity that can vary"
            faults.append(Fault(where, found, "write one variant for each value"))
        elif low[key] == high[key]:
            faults.append(Fault(where, "from and to are equal", "write a constant value in joint"))
    raise_all(faults)
    text = leaves(start.model_dump(mode="json"))
    members = []
    for shares in cube(entry.design, entry.points, len(ranges), entry.seed):
        values = {key: low[key] + s * (high[key] - low[key]) for key, s in zip(ranges, shares, strict=True)}
        members.append(nested({key: _written(values[key], text[key], ranges[key].start) for key in ranges}))
    return members


def _joint(file: Reading, keys: Mapping[str, Any], at: Section) -> Joint:
    return joint.load(keys["base"], keys, file.place, file.folder, strict.dotted(at))


def _values(nominal: Joint, made: Joint, written: list[str]) -> dict[str, Any]:
    """Return the keys `written` and all others in which a joint differs from the study's, see `Variant.values`."""
    before, values = (leaves(joint.given()) for joint in (nominal, made))
    keys = [key for key in before | values if key not in TOLD]
    return {key: values.get(key) for key in keys if key in written or before.get(key) != values.get(key)}


def _ranges(section: Mapping[str, Any], at: Section, place: str, before: str = "") -> Iterator[tuple[str, Range]]:
    """Entries of ``vary`` by dotted key of the joint, whether quoted or dotted in the file."""
    for key, value in section.items():
        if isinstance(value, Mapping) and not value.keys() & {"from", "to"}:
            yield from _ranges(value, (*at, key), place, f"{before}{key}.")
        else:
            yield f"{before}{key}", strict.validate(Range, value, place, prefix=(*at, key))


def _written(value: float, like: str | float, users: object) -> str | float:
    """`value` (SI) with the unit of the user's text, or of `like`, a quantity of a joint's JSON dump.

    Rounded to fifteen digits, so that values as users write them are reproduced: 0.076, not 0.07600000000000001. The
    user's unit is for faults; it is used where it gives the same number.
    """
    value = float(f"{value:.15g}")
    if not isinstance(like, str):
        return value
    unit = like.partition(" ")[2]
    as_user, text = units.written(value, unit, users, 15), f"{value!r} {unit}"
    return as_user if units.to_si(as_user, unit, DIAMETER) == units.to_si(text, unit) else text
