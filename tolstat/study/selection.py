"""A file that is being read, and names of errors and results in it: ``"pin*.offset_t"`` selects an error of all pins.

In TOML a name may be written as one quoted key or dotted: ``pin1.tilt_z = "0.5 deg"`` arrives as nested tables.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from pydantic_core import PydanticCustomError

from tolstat.common import strict
from tolstat.common.cardan import PARTS
from tolstat.common.error_fields import error_units, given_units
from tolstat.common.errors import Fault, InputError, gather, input_error
from tolstat.common.mechanism import Mechanism, prefixes
from tolstat.common.strict import did_you_mean, dotted, read_text, read_toml
from tolstat.common.units import to_si
from tolstat.joint.linked import linkage_mechanism
from tolstat.joint.model import giving
from tolstat.joint.reading import is_joint
from tolstat.joint.shaft import by_keys
from tolstat.study import signals
from tolstat.study.axes import alike, columns_of, compatible, is_pair, is_zone, own, zone_of, zone_units
from tolstat.study.parts import Parts

ModelT = TypeVar("ModelT", bound=strict.Strict)


@cache
def toleranced_units(mechanism: Mechanism) -> dict[str, str]:
    """SI unit of all that ``[tolerances]`` can select: errors, and zones that stand for several of them."""
    return error_units(mechanism) | zone_units(mechanism)


@cache
def excludes(mechanism: Mechanism) -> dict[str, tuple[str, ...]]:
    """Errors that say in another way what an error says: the clearance of a pin, and the diameters of pin and hole."""
    diameters = {f"{pair.pin}.clearance": (f"{pair.pin}.diameter", f"{pair.hole}.diameter") for pair in mechanism.pairs}
    return diameters | {of: (name,) for name, both in diameters.items() for of in both}


class Entry(NamedTuple):
    """One entry of a table keyed by error names.

    Attributes
    ----------
    pattern : str
        The name or pattern, dotted.
    path : tuple of str and int
        Key path in the file.
    value : object
        Value as parsed from the file.
    """

    pattern: str
    path: tuple[int | str, ...]
    value: Any


@cache
def joints(mechanism: Mechanism) -> set[str]:
    """Names of the joints that stand before those of features; empty where there is one joint."""
    return {prefix.rstrip(".") for prefix in prefixes(mechanism)} - {""}


def entries(table: Mapping[str, Any], mechanism: Mechanism, *section: int | str) -> Iterator[Entry]:
    """Entries of the table at the key path `section` whose keys are names, written quoted or dotted.

    A table with ``distribution`` is itself an entry, of ``[tolerances]``, whose name lacks its second half.
    """
    for key, value in table.items():
        if key in joints(mechanism) and isinstance(value, Mapping):
            for entry in entries(value, mechanism, *section, key):
                yield entry._replace(pattern=f"{key}.{entry.pattern}")
        elif key.isidentifier() and isinstance(value, Mapping) and "distribution" not in value:
            for name, inner in value.items():
                yield Entry(f"{key}.{name}", (*section, key, name), inner)
        else:
            yield Entry(key, (*section, key), value)


def quantity(entry: Entry, unit: str, place: str) -> float:
    """Value of an entry in `unit`.

    Raises
    ------
    InputError
        When the value is not a quantity that can be converted to `unit`.
    """
    try:
        return to_si(entry.value, unit)
    except PydanticCustomError as error:
        context = error.context or {}
        raise input_error(f"{place}: {dotted(entry.path)}", context["found"], context["remedy"]) from error


def select(pattern: str, names: Iterable[str]) -> list[str]:
    """Return those of `names` that a pattern selects; ``*`` does not match across a dot.

    A zone, and each quantity that it draws, is selected by its full key only: ``"pin1.offset_*"`` means the offsets
    along e, t, z. A pair is selected by a pattern with an underscore before the dot, such as ``"*_holes.position"``.
    """
    feature, key = halves(pattern)
    return [name for name in names if _matches(feature, halves(name)[0]) and _is_key(key, name)]


def halves(name: str) -> tuple[str, str]:
    """Feature and key of a name or pattern: of ``joint1.pin1.tilt_t`` ``joint1.pin1`` and ``tilt_t``."""
    feature, dot, key = name.rpartition(".")
    return (feature, key) if dot else (key, "")


def _matches(pattern: str, feature: str) -> bool:
    parts = list(zip(feature.split("."), pattern.split("."), strict=False))
    agree = feature.count(".") == pattern.count(".") and all(fnmatchcase(*part) for part in parts)
    return agree and (not is_pair(feature) or "_" in own(pattern))


def _is_key(pattern: str, name: str) -> bool:
    if not is_zone(name):
        return fnmatchcase(halves(name)[1], pattern)
    return pattern in (own(name), own(zone_of(name)))


def resolve(entry: Entry, units: Mapping[str, str], place: str) -> list[str]:
    """Names that an entry selects: at least one, all of one kind of quantity.

    Parameters
    ----------
    entry : Entry
        Entry of a table keyed by names or patterns.
    units : mapping
        The names to select from, and the unit of each.
    place : str
        File name shown in faults.

    Returns
    -------
    list of str
        In the order of `units`.

    Raises
    ------
    InputError
        When the entry selects nothing or names of different units.
    """
    selected = select(entry.pattern, units)
    where = f"{place}: {dotted(entry.path)}"
    if not selected:
        raise input_error(where, "selects nothing", suggestion(entry.pattern, list(units)))
    kinds = sorted({units[name] for name in selected})
    if len(kinds) > 1:
        found = f"selects quantities of different kinds ({', '.join(kinds)})"
        raise input_error(where, found, "write one entry for each kind")
    return selected


def suggestion(pattern: str, names: Sequence[str]) -> str:
    """Remedy for a pattern that selects nothing: what it is if the half of it that is wrong is mended."""
    if remedy := without_joint(pattern, names):
        return remedy
    if key := giving(pattern):
        of_tube, sticks = pattern.startswith("tube"), key == "shaft.spline" and "shaft.offset" in names
        key = "shaft.tube.unbalance" if of_tube else key if sticks else f"joint.{key}"
        return f"only {'shafts' if of_tube or sticks else 'joints'} with {key} have it: add that, or remove this entry"
    every = list(dict.fromkeys(halves(name)[0] for name in names))
    feature, key = (pattern, "") if pattern in every else halves(pattern)
    known = [name for name in every if _matches(feature, name)]
    if not known:
        rest = pattern.partition(".")[2]
        is_whole = rest in every or select(rest, names)
        return f"did you mean {rest!r}?" if is_whole else did_you_mean(feature, every, "", pattern[len(feature) :])
    return did_you_mean(key, [halves(name)[1] for name in names if halves(name)[0] == known[0]], f"{feature}.")


def without_joint(pattern: str, names: Sequence[str]) -> str:
    """Remedy for a pattern that lacks the joint before it; empty for others."""
    feature = halves(pattern)[0]
    of_joints = [name for name in names if "." in halves(name)[0]]
    found = select(f"*.{pattern}", of_joints) or [name for name in of_joints if _matches(feature, own(halves(name)[0]))]
    if not found:
        return ""
    joint = found[0].partition(".")[0]
    return f"write the joint before it: {joint}.{pattern}, or {alike(joint)}.{pattern} for all joints"


class Assignments:
    """Record of the entry that sets each error; a second entry for the same error is a fault that names both."""

    def __init__(self, place: str, mechanism: Mechanism) -> None:
        self._place, self._excludes = place, excludes(mechanism)
        self._owner: dict[str, list[tuple[Entry, str]]] = {}

    def claim(self, entry: Entry, names: Iterable[str]) -> None:
        """Record that `entry` sets `names`; a zone sets several columns, and several zones of an axis share them.

        Raises
        ------
        InputError
            When an earlier entry sets one of them, or the clearance of a pin is set beside one of its two diameters.
        """
        clashes: dict[tuple[int | str, ...], str] = {}
        both: dict[tuple[int | str, ...], tuple[str, str]] = {}
        for name in names:
            for column in self._columns(entry, name):
                owners = self._owner.setdefault(column, [])
                clashes |= {setter.path: column for setter, other in owners if not compatible(name, other)}
                owners.append((entry, name))
                for other in self._excludes.get(column, ()):
                    for setter, _ in self._owner.get(other, ())[:1]:
                        both.setdefault(setter.path, (column, other))
        if clashes or both:
            where = f"{self._place}: {dotted(entry.path)}"
            remedy = "remove one of the two, or narrow the pattern"
            texts = [f"{column} is set by {dotted(path)} already" for path, column in clashes.items()]
            texts += [f"{c} is given beside {other} of {dotted(path)}" for path, (c, other) in both.items()]
            raise InputError([Fault(where, text, remedy) for text in texts])

    @staticmethod
    def _columns(entry: Entry, name: str) -> tuple[str, ...]:
        """Columns that an entry sets: a zone between two planes bounds one tilt of a feature."""
        about = entry.value.get("about") if isinstance(entry.value, Mapping) and is_zone(name) else None
        if about not in ("t", "z") or is_pair(halves(name)[0]):
            return columns_of(name)
        return tuple(column for column in columns_of(name) if column.endswith(f"tilt_{about}"))


class Reading(Parts):
    """A study or case file that is being read: its tables, what was made of them, and the faults found so far.

    Parameters
    ----------
    path : Path
        The file; paths in it start from its folder.
    text : str or None
        TOML to read instead of the file's content.
    sections : iterable of str
        Top-level keys that it may have.

    Attributes
    ----------
    text : str
        TOML with mean and orders in place of measured signals, and errors in place of measured joints.
    data : dict
        Its tables as parsed.
    place : str
        What stands before the key path in the place of a fault.
    faults : list of Fault
        Those found so far.
    claims : Assignments
        Entries that set errors.

    Raises
    ------
    InputError
        When the file is not readable TOML, or a joint file.
    """

    def __init__(self, path: Path, text: str | None, sections: Iterable[str]) -> None:
        self.path, self.place, self.folder = path, str(path), path.parent
        self._source, self._has_lines = read_text(path) if text is None else text, text is None
        self.text, self.data = self._source, read_toml(path, self._source)
        self.faults: list[Fault] = []
        self.claims = Assignments(self.place, self.mechanism)
        if is_joint(self.data):
            remedy = f'name it in a study, base = "{path.name}" under [joint]; tolstat new writes one'
            raise input_error(self.place, "is a joint file, not a study or case", remedy)
        if "file" in self.text:
            self.text, self.notes = signals.replaced(self.text, self.data, path, self.faults)
            self.data = read_toml(path, self.text)
        for key in self.data:
            if key not in sections:
                self.fault(key, "unknown key", did_you_mean(key, list(sections)))

    @property
    def mechanism(self) -> Mechanism:
        """What it is about; while no joint is read, with all that a joint may have."""
        first, second = (joint.parts if joint else PARTS for joint in (self.joint, self.joint2))
        if self.linkage is not None:
            return linkage_mechanism(self.linkage, first)
        return by_keys(self.data.get("shaft"), first, second)

    def fault(self, key: str | Sequence[int | str], found: str, remedy: str) -> None:
        """Note a fault of a key or key path, once: several parts may read one section."""
        fault = Fault(f"{self.place}: {key if isinstance(key, str) else dotted(key)}", found, remedy)
        if fault not in self.faults:
            self.faults.append(fault)

    def finish(self, from_command_line: str = "") -> None:
        """Raise an error if faults were found.

        Parameters
        ----------
        from_command_line : str
            Key whose value is not from the file.

        Raises
        ------
        InputError
            With every fault; those of the file have its lines.
        """
        if self.faults:
            other = [fault for fault in self.faults if fault.place == f"{self.place}: {from_command_line}"]
            of_file = [fault for fault in self.faults if fault not in other]
            lined = strict.with_lines(of_file, self.place, self._source) if self._has_lines else of_file
            raise InputError([*other, *lined])

    def table(self, section: str) -> Mapping[str, Any]:
        """Section that is a table; empty if it is missing or something else."""
        table = self.data.get(section, {})
        if isinstance(table, Mapping):
            return table
        self.fault(section, f"{table!r} is not a table", f"write [{section}]")
        return {}

    def tables(self, section: str) -> list[Any]:
        """Section that is a list of tables; empty if it is missing or something else."""
        tables = self.data.get(section, [])
        if isinstance(tables, list):
            return tables
        self.fault(section, "is not a list of tables", f"write [[{section}]]")
        return []

    def entries(self, section: str) -> Iterator[Entry]:
        """Entries of a section whose keys are names."""
        return entries(self.table(section), self.mechanism, section)

    def model(self, model: type[ModelT], data: object, *path: int | str, **context: Any) -> ModelT:
        """Read the table at a key path.

        Raises
        ------
        InputError
            With its faults.
        """
        return strict.validate(model, data, self.place, prefix=path, context=context)

    def models(self, section: str, model: type[ModelT]) -> list[ModelT]:
        """Tables of a section that are valid."""
        valid = []
        for number, item in enumerate(self.tables(section)):
            with gather(self.faults):
                valid.append(self.model(model, item, section, number))
        return valid


def fixed_errors(
    file: Reading, table: Mapping[str, Any], section: Sequence[int | str], claims: Assignments
) -> dict[str, float]:
    """Read a table of errors that are given, not drawn.

    Parameters
    ----------
    file : Reading
        The file, to which faults are added.
    table : mapping
        Names or patterns to quantities.
    section : sequence
        Key path of the table in the file.
    claims : Assignments
        Errors that earlier entries set; those of this table are added.

    Returns
    -------
    dict
        Error name to deviation (SI).
    """
    fixed: dict[str, float] = {}
    units = given_units(file.mechanism)
    for entry in entries(table, file.mechanism, *section):
        if entry.pattern.startswith("operation."):
            file.fault(entry.path, "is not an error", f"set {entry.path[-1]} in [operation]")
            continue
        with gather(file.faults):
            selected = resolve(entry, units, file.place)
            value = quantity(entry, units[selected[0]], file.place)
            claims.claim(entry, selected)
            fixed |= dict.fromkeys(selected, value)
    return fixed
