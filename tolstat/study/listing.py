"""Reading ``[grid]``, ``[[case]]`` and ``[[variant]]`` of a study whose joints are listed one by one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path
from typing import Any, Literal, NamedTuple, Self

from pydantic import Field, model_validator

from tolstat import joint
from tolstat.common import strict, units
from tolstat.common.errors import Fault, InputError, gather
from tolstat.common.notation import DIAMETER
from tolstat.common.strict import Strict, refuse
from tolstat.common.tables import Variant
from tolstat.joint import Joint, Operation
from tolstat.joint.model import TOLD
from tolstat.joint.overrides import laid_over, nested
from tolstat.study import selection
from tolstat.study.design import IDEAL, Design, cube, flat, table
from tolstat.study.model import MAX_ROWS, Solver
from tolstat.study.selection import UNITS, Assignments, Entry

Section = tuple[int | str, ...]


class CaseEntry(Strict):
    """A joint with these errors; the joint without errors is always run, too."""

    name: str = Field(min_length=1, examples=["tilt"])
    """name of the case"""
    errors: dict[str, Any] = Field(
        min_length=1, json_schema_extra={"x-table": "errors"}, examples=[{"pin1.tilt_z": "0.5 deg"}]
    )
    """errors by name or pattern, as in [errors]"""


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


class Nominal(NamedTuple):
    """Base of the variants: ``[joint]``, ``[operation]`` and ``[solver]`` of the study."""

    joint: Joint
    operation: Operation
    solver: Solver


class Listed(NamedTuple):
    """A variant, its joint, operating point and settings, and the indices of the cases that are run with it."""

    variant: Variant
    joint: Joint
    operation: Operation
    solver: Solver
    run: list[int]


def read(data: Mapping[str, Any], nominal: Nominal | None, place: str, folder: Path) -> Design | None:
    """Read the three sections.

    Parameters
    ----------
    data : mapping
        The study's file.
    nominal : Nominal, optional
        Joint, operating point and settings of the study; variants are not read if it is None.
    place : str
        File name shown in faults.
    folder : Path
        Folder that the path of a joint file is relative to.

    Returns
    -------
    Design
        None where there is no `nominal`.

    Raises
    ------
    InputError
        With every fault of the sections.
    """
    faults: list[Fault] = []
    axes: list[Axis] = []
    cases: dict[str, dict[str, float]] = {IDEAL: {}}
    variants: list[Listed] = []
    with gather(faults):
        axes = list(_grid(data.get("grid", {}), place, faults))
    with gather(faults):
        cases |= _cases(data.get("case", []), axes, place, faults)
    if nominal is not None:
        with gather(faults):
            variants = Variants(data["joint"], nominal, place, folder).read(data.get("variant", []), list(cases))
            faults += _clashes(data.get("variant", []), axes, place)
    points = tuple(_points(axes))
    rows = len(points) * sum(len(one.run) for one in variants)
    if rows > MAX_ROWS:
        faults.append(Fault(f"{place}: variant", f"gives {rows} joints", f"give at most {MAX_ROWS}"))
    if faults:
        raise InputError(faults)
    if nominal is None:
        return None
    names, joints, operations, solvers, runs = zip(*variants, strict=True)
    return Design(names, joints, operations, solvers, cases, points, table(runs, len(points)))


def _grid(section: Any, place: str, faults: list[Fault]) -> Iterator[Axis]:
    if not isinstance(section, Mapping):
        raise InputError([Fault(f"{place}: grid", "is not a table", "write [grid]")])
    claims = Assignments(place)
    for entry in selection.entries(section, "grid"):
        with gather(faults):
            names = selection.resolve(entry, UNITS, place)
            claims.claim(entry, names)
            yield Axis(entry, names, list(_values(entry, UNITS[names[0]], place, faults)))


def _values(entry: Entry, unit: str, place: str, faults: list[Fault]) -> Iterator[float]:
    if not isinstance(entry.value, list) or not entry.value:
        where = f"{place}: {strict.dotted(entry.path)}"
        raise InputError([Fault(where, f"{entry.value!r} is not a list of values", 'write ["0 deg", "15 deg"]')])
    for number, value in enumerate(entry.value):
        with gather(faults):
            yield selection.quantity(Entry(entry.pattern, (*entry.path, number), value), unit, place)


def _points(axes: list[Axis]) -> Iterator[dict[str, float]]:
    """Points of the product grid, the last axis varying fastest; one empty point without axes."""
    for values in product(*(axis.values for axis in axes)):
        yield {name: value for axis, value in zip(axes, values, strict=True) for name in axis.names}


def _cases(section: Any, axes: list[Axis], place: str, faults: list[Fault]) -> dict[str, dict[str, float]]:
    """Errors of each case; empty for a case with faults, so that variants can refer to it."""
    cases: dict[str, dict[str, float]] = {}
    for number, item in enumerate(_tables(section, "case", place)):
        name = item.get("name") if isinstance(item, Mapping) else None
        if isinstance(name, str):
            if name in cases or name == IDEAL:
                remedy = "remove it: it is always run" if name == IDEAL else "give each case its own name"
                faults.append(Fault(f"{place}: case[{number}].name", f"a case {name!r} exists already", remedy))
            cases[name] = {}
        with gather(faults):
            entry = strict.validate(CaseEntry, item, place, prefix=("case", number))
            claims = Assignments(place)
            for axis in axes:
                claims.claim(axis.entry, axis.names)
            cases[entry.name] = selection.fixed_errors(entry.errors, ("case", number, "errors"), place, claims)
    return cases


def _clashes(section: list[Any], axes: list[Axis], place: str) -> list[Fault]:
    """Keys of the operating point that a variant and the grid both give."""
    taken = {name for axis in axes for name in axis.names}
    return [
        Fault(f"{place}: variant[{number}].operation.{key}", "is set by grid already", "remove one of the two")
        for number, item in enumerate(section)
        for key in item.get("operation", {})
        if f"operation.{key}" in taken
    ]


class Variants:
    """``[[variant]]``: joints made from the study's joint by the keys of each entry.

    Parameters
    ----------
    study : mapping
        ``[joint]`` of the study.
    nominal : Nominal
        Joint, operating point and settings of the study.
    place, folder
        As in `read`.
    """

    def __init__(self, study: Mapping[str, Any], nominal: Nominal, place: str, folder: Path) -> None:
        self._study = study
        self._nominal = nominal
        self._place = place
        self._folder = folder

    def read(self, section: Any, cases: list[str]) -> list[Listed]:
        """Variants in the order of the file, families expanded."""
        everything = list(range(len(cases)))
        entries = _tables(section, "variant", self._place)
        if not entries:
            return [Listed(Variant("joint", {}), *self._nominal, everything)]
        faults: list[Fault] = []
        variants = []
        for number, item in enumerate(entries):
            with gather(faults):
                at: Section = ("variant", number)
                entry = strict.validate(VariantEntry, item, self._place, prefix=at)
                run = everything if entry.cases is None else [0]
                with gather(faults):
                    run = sorted({*run, *self._numbers(entry.cases or [], cases, at)})
                variants += self._expanded(entry, run, at)
        if faults:
            raise InputError(faults)
        return variants

    def _numbers(self, names: list[str], cases: list[str], at: Section) -> list[int]:
        where = f"{self._place}: {strict.dotted((*at, 'cases'))}"
        unknown = [name for name in names if name not in cases]
        if unknown:
            raise InputError([Fault(where, f"no case {name!r}", strict.did_you_mean(name, cases)) for name in unknown])
        return [cases.index(name) for name in names]

    def _expanded(self, entry: VariantEntry, run: list[int], at: Section) -> list[Listed]:
        keys = laid_over(self._study, entry.joint)
        made = [self._loaded(keys, (*at, "joint"))]
        ranges = dict(_ranges(entry.vary, (*at, "vary"), self._place))
        if ranges:
            members = self._members(entry, keys, ranges, (*at, "vary"))
            made = [self._loaded(laid_over(keys, own), (*at, "vary")) for own in members]
        operation, solver = self._settings(entry, at)
        own = {f"operation.{key}": getattr(operation, key) for key in entry.operation}
        own |= {f"solver.{key}": getattr(solver, key) for key in entry.solver}
        written = [key for key, _ in flat(entry.joint)] + list(ranges)
        return [
            Listed(Variant(entry.name, self._values(joint, written) | own, entry.note), joint, operation, solver, run)
            for joint in made
        ]

    def _settings(self, entry: VariantEntry, at: Section) -> tuple[Operation, Solver]:
        """Operating point and numerical settings of a variant: those of the study, with keys replaced by the entry."""
        faults: list[Fault] = []
        operation, solver = self._nominal.operation, self._nominal.solver
        with gather(faults):
            keys = operation.model_dump(mode="json", by_alias=True) | entry.operation
            operation = strict.validate(Operation, keys, self._place, prefix=(*at, "operation"))
        if entry.solver.get("fidelity") == "auto":
            where = f"{self._place}: {strict.dotted((*at, 'solver', 'fidelity'))}"
            faults.append(Fault(where, "'auto' cannot be set for one variant", "write it in [solver]"))
        with gather(faults):
            keys = solver.model_dump(exclude_unset=True) | entry.solver
            solver = strict.validate(Solver, keys, self._place, prefix=(*at, "solver"))
        if faults:
            raise InputError(faults)
        return operation, solver

    def _members(
        self, entry: VariantEntry, keys: Mapping[str, Any], ranges: Mapping[str, Range], at: Section
    ) -> list[dict[str, Any]]:
        """Keys of each joint of a family, as a joint file writes them."""
        assert entry.points is not None
        ends = [{key: getattr(r, end) for key, r in ranges.items()} for end in ("start", "stop")]
        start, stop = (self._loaded(laid_over(keys, nested(end)), at) for end in ends)
        low, high = dict(flat(start.model_dump())), dict(flat(stop.model_dump()))
        faults = []
        for key in ranges:
            where = f"{self._place}: {strict.dotted(at)}.{key}"
            words = [end[key] for end in (low, high) if not isinstance(end[key], float)]
            if words:
                faults.append(
                    Fault(where, f"{words[0]!r} is not a quantity that can vary", "write one variant for each value")
                )
            elif low[key] == high[key]:
                faults.append(Fault(where, "from and to are equal", "write a constant value in joint"))
        if faults:
            raise InputError(faults)
        text = dict(flat(start.model_dump(mode="json")))
        shares = cube(entry.design, entry.points, len(ranges), entry.seed)
        values = [
            {key: low[key] + s * (high[key] - low[key]) for key, s in zip(ranges, row, strict=True)} for row in shares
        ]
        return [
            nested({key: _written(value, text[key], ranges[key].start) for key, value in own.items()}) for own in values
        ]

    def swept(self, point: Mapping[str, Any]) -> tuple[Variant, Joint]:
        """Variant at a point of a sweep, from dotted keys with values as a file writes them, and its joint."""
        joint = self._loaded(laid_over(self._study, nested(point)), ("sweep",))
        return Variant("sweep", self._values(joint, list(point))), joint

    def _loaded(self, keys: Mapping[str, Any], at: Section) -> Joint:
        overrides = {key: value for key, value in keys.items() if key != "base"}
        return joint.load(keys["base"], overrides, self._place, self._folder, strict.dotted(at))

    def _values(self, made: Joint, written: list[str]) -> dict[str, Any]:
        """Return the keys `written` and all others in which a joint differs from the study's, see `Variant.values`."""
        nominal, values = (dict(flat(joint.given())) for joint in (self._nominal.joint, made))
        keys = [key for key in nominal | values if key not in TOLD]
        return {key: values.get(key) for key in keys if key in written or nominal.get(key) != values.get(key)}


def _tables(section: Any, name: str, place: str) -> list[Any]:
    if not isinstance(section, list):
        raise InputError([Fault(f"{place}: {name}", "is not a list of tables", f"write [[{name}]]")])
    return section


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
    own, text = units.written(value, unit, users, 15), f"{value!r} {unit}"
    return own if units.to_si(own, unit, DIAMETER) == units.to_si(text, unit) else text
