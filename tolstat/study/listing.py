"""Reading ``[grid]``, ``[[case]]`` and ``[[variant]]`` of a study whose joints are listed one by one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

from tolstat import joint, schema
from tolstat.errors import Fault, InputError, gather
from tolstat.joint import Joint
from tolstat.joint.model import merged
from tolstat.study import selection
from tolstat.study.design import IDEAL, Design, cube, flat, table
from tolstat.study.model import MAX_ROWS, CaseEntry, Range, VariantEntry
from tolstat.study.selection import UNITS, Claims, Entry
from tolstat.tables import Variant

Section = tuple[int | str, ...]


class Axis(NamedTuple):
    """One entry of ``[grid]``: the errors that it names take each of the values."""

    entry: Entry
    names: list[str]
    values: list[float]


def read(data: Mapping[str, Any], nominal: Joint | None, place: str, folder: Path) -> Design | None:
    """Read the three sections.

    Parameters
    ----------
    data : mapping
        The study's file.
    nominal : Joint, optional
        The joint of ``[joint]``; without it variants are not read.
    place : str
        File that faults name.
    folder : Path
        Folder that the path of a joint file is relative to.

    Returns
    -------
    Design
        None where there is no joint.

    Raises
    ------
    InputError
        With every fault of the sections.
    """
    faults: list[Fault] = []
    axes: list[Axis] = []
    cases: dict[str, dict[str, float]] = {IDEAL: {}}
    variants: list[tuple[Variant, Joint, list[int]]] = []
    with gather(faults):
        axes = list(_grid(data.get("grid", {}), place, faults))
    with gather(faults):
        cases |= _cases(data.get("case", []), axes, place, faults)
    if nominal is not None:
        with gather(faults):
            variants = _Variants(data["joint"], nominal, place, folder).read(data.get("variant", []), list(cases))
    points = tuple(_points(axes))
    rows = len(points) * sum(len(run) for *_, run in variants)
    if rows > MAX_ROWS:
        faults.append(Fault(f"{place}: variant", f"makes {rows} joints", f"stay below {MAX_ROWS}"))
    if faults:
        raise InputError(faults)
    if nominal is None:
        return None
    names, joints, runs = zip(*variants, strict=True)
    return Design(names, joints, cases, points, table(runs, len(points)))


def _grid(section: Any, place: str, faults: list[Fault]) -> Iterator[Axis]:
    if not isinstance(section, Mapping):
        raise InputError([Fault(f"{place}: grid", "is not a table", "write [grid]")])
    claims = Claims(place)
    for entry in selection.entries(section, "grid"):
        with gather(faults):
            names = selection.resolve(entry, UNITS, place)
            claims.claim(entry, names)
            yield Axis(entry, names, list(_values(entry, UNITS[names[0]], place, faults)))


def _values(entry: Entry, unit: str, place: str, faults: list[Fault]) -> Iterator[float]:
    if not isinstance(entry.value, list) or not entry.value:
        where = f"{place}: {schema.dotted(entry.path)}"
        raise InputError([Fault(where, f"{entry.value!r} is not a list of values", 'write ["0 deg", "15 deg"]')])
    for number, value in enumerate(entry.value):
        with gather(faults):
            yield selection.quantity(Entry(entry.pattern, (*entry.path, number), value), unit, place)


def _points(axes: list[Axis]) -> Iterator[dict[str, float]]:
    """Points of the product grid, the last axis running fastest; one empty point without axes."""
    for values in product(*(axis.values for axis in axes)):
        yield {name: value for axis, value in zip(axes, values, strict=True) for name in axis.names}


def _cases(section: Any, axes: list[Axis], place: str, faults: list[Fault]) -> dict[str, dict[str, float]]:
    """Errors of each case; none for one that has faults, so that variants can name it."""
    cases: dict[str, dict[str, float]] = {}
    for number, item in enumerate(_tables(section, "case", place)):
        name = item.get("name") if isinstance(item, Mapping) else None
        if isinstance(name, str):
            if name in cases or name == IDEAL:
                remedy = "leave it out, it is always run" if name == IDEAL else "give each case its own name"
                faults.append(Fault(f"{place}: case[{number}].name", f"there is a case {name!r} already", remedy))
            cases[name] = {}
        with gather(faults):
            entry = schema.validate(CaseEntry, item, place, prefix=("case", number))
            claims = Claims(place)
            for axis in axes:
                claims.claim(axis.entry, axis.names)
            cases[entry.name] = selection.fixed_errors(entry.errors, ("case", number, "errors"), place, claims)
    return cases


class _Variants:
    """``[[variant]]``: joints that the keys of an entry make of the study's joint.

    Parameters
    ----------
    study : mapping
        ``[joint]`` of the study.
    nominal : Joint
        The joint that it gives.
    place, folder
        As in `read`.
    """

    def __init__(self, study: Mapping[str, Any], nominal: Joint, place: str, folder: Path) -> None:
        self._study = study
        self._nominal = nominal
        self._place = place
        self._folder = folder

    def read(self, section: Any, cases: list[str]) -> list[tuple[Variant, Joint, list[int]]]:
        """Variants in the order of the file, with their joints and the cases that are run with each."""
        everything = list(range(len(cases)))
        entries = _tables(section, "variant", self._place)
        if not entries:
            return [(Variant("joint", {}), self._nominal, everything)]
        faults: list[Fault] = []
        variants = []
        for number, item in enumerate(entries):
            with gather(faults):
                at: Section = ("variant", number)
                entry = schema.validate(VariantEntry, item, self._place, prefix=at)
                run = everything if entry.cases is None else [0]
                with gather(faults):
                    run = sorted({*run, *self._numbers(entry.cases or [], cases, at)})
                variants += [(*variant, run) for variant in self._expanded(entry, at)]
        if faults:
            raise InputError(faults)
        return variants

    def _numbers(self, names: list[str], cases: list[str], at: Section) -> list[int]:
        where = f"{self._place}: {schema.dotted((*at, 'cases'))}"
        unknown = [name for name in names if name not in cases]
        if unknown:
            raise InputError([Fault(where, f"no case {name!r}", schema.did_you_mean(name, cases)) for name in unknown])
        return [cases.index(name) for name in names]

    def _expanded(self, entry: VariantEntry, at: Section) -> list[tuple[Variant, Joint]]:
        keys = merged(self._study, entry.joint)
        made = [self._joint(keys, (*at, "joint"))]
        ranges = dict(_ranges(entry.vary, (*at, "vary"), self._place))
        if ranges:
            members = self._members(entry, keys, ranges, (*at, "vary"))
            made = [self._joint(merged(keys, own), (*at, "vary")) for own in members]
        written = [key for key, _ in flat(entry.joint)] + list(ranges)
        return [(Variant(entry.name, self._values(joint, written)), joint) for joint in made]

    def _members(
        self, entry: VariantEntry, keys: Mapping[str, Any], ranges: Mapping[str, Range], at: Section
    ) -> list[dict[str, Any]]:
        """Keys of each joint of a family, as a joint file writes them."""
        assert entry.points is not None
        ends = [{key: getattr(r, end) for key, r in ranges.items()} for end in ("start", "stop")]
        start, stop = (self._joint(merged(keys, _nested(end)), at) for end in ends)
        low, high = dict(flat(start.model_dump())), dict(flat(stop.model_dump()))
        faults = []
        for key in ranges:
            where = f"{self._place}: {schema.dotted(at)}.{key}"
            if not isinstance(low[key], float):
                faults.append(Fault(where, f"{low[key]!r} is no quantity that can vary", "write one variant for each"))
            elif low[key] == high[key]:
                faults.append(Fault(where, "from and to are equal", "a value that does not move belongs to joint"))
        if faults:
            raise InputError(faults)
        text = dict(flat(start.model_dump(mode="json")))
        shares = cube(entry.design, entry.points, len(ranges), entry.seed)
        values = [
            {key: low[key] + s * (high[key] - low[key]) for key, s in zip(ranges, row, strict=True)} for row in shares
        ]
        return [_nested({key: _written(value, text[key]) for key, value in own.items()}) for own in values]

    def _joint(self, keys: Mapping[str, Any], at: Section) -> Joint:
        overrides = {key: value for key, value in keys.items() if key != "base"}
        return joint.load(keys["base"], overrides, self._place, self._folder, schema.dotted(at))

    def _values(self, made: Joint, written: list[str]) -> dict[str, Any]:
        nominal = dict(flat(self._nominal.model_dump(exclude={"description"})))
        values = dict(flat(made.model_dump(exclude={"description"})))
        return {key: value for key, value in values.items() if key in written or nominal.get(key) != value}


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
            yield f"{before}{key}", schema.validate(Range, value, place, prefix=(*at, key))


def _nested(values: Mapping[str, Any]) -> dict[str, Any]:
    """Tables in tables from dotted keys."""
    nested: dict[str, Any] = {}
    for key, value in values.items():
        *tables, name = key.split(".")
        inner: Any = value if not tables else {name: value}
        for part in reversed(tables[1:]):
            inner = {part: inner}
        nested = merged(nested, {tables[0] if tables else name: inner})
    return nested


def _written(value: float, like: str | float) -> str | float:
    """`value` (SI) with the unit of `like`, a quantity as a joint's dump writes it.

    Fifteen digits: what a user can write is met exactly, 0.076 m and not 0.07600000000000001 m.
    """
    value = float(f"{value:.15g}")
    return f"{value!r} {like.partition(' ')[2]}" if isinstance(like, str) else value
