"""Change keys of a study for ``tolstat change``: tolerances by pattern, joint, operating point, fixed errors.

A change is made in the text of the study, so that the study that is simulated is the one that is written.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Collection, Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Any

from tolstat.common import units
from tolstat.common.errors import Fault, InputError, collected, gather, input_error
from tolstat.common.loads import loads_of
from tolstat.common.mechanism import Mechanism
from tolstat.common.strict import did_you_mean
from tolstat.joint import Joint, varied
from tolstat.joint.derived import replaced
from tolstat.joint.model import leaves, merged
from tolstat.joint.reading import with_keys
from tolstat.study import rewriting, scaling, selection, widths
from tolstat.study.file import SECTIONS, load
from tolstat.study.scaling import REPLACED_KEYS
from tolstat.study.selection import halves, toleranced_units
from tolstat.study.study import Study
from tolstat.study.tolerances import fits

SETTABLE = ("joint", "operation", "errors")
"""Sections whose keys are changed, beside ``tolerances``, whose name is left out."""
EXAMPLE = 'write --set "*.tilt_*.cpk=1.2", --set joint.contact.law=sliced or --set "operation.alpha=12 deg"'
NONE = "none"
"""Value that takes an error out of the tolerances."""
OTHERS = f"{', '.join(SETTABLE)} and tolerances change the joints; edit the study for others, and run it"
DIGITS = 10
"""Significant digits of numbers that are compared: conversions of units agree in more."""
NUMBER = re.compile(r"\d+\.\d+(?:e[-+]\d+)?|\d+e[-+]\d+")
"""A number in JSON, or in a text there that is a quantity."""
JOINT, JOINT2 = ("joint",), ("shaft", "joint2")
"""Key paths of the joints."""
NAMED = 3
"""Largest number of loads that a fault names."""
NAMES = 2
"""Number of parts of a key of an operating point or fit, and of the name of an error of one joint: ``pin1.tilt_t``."""


def _settable(mechanism: Mechanism) -> tuple[str, ...]:
    """`SETTABLE`, and ``shaft`` of a drive shaft, ``mechanism`` of a linkage: a change makes no other mechanism."""
    if mechanism.placed:
        return *SETTABLE, "mechanism"
    return (*SETTABLE, "shaft") if mechanism.is_shaft else SETTABLE


def with_settings(study: Study, settings: Sequence[str]) -> str:
    """Text of a study with some keys changed; comments and seed are kept.

    Parameters
    ----------
    study : Study
        The study.
    settings : sequence of str
        Key and value as in TOML, quotes may be left out. ``"pin*.offset_t.plus_minus=0.05 mm"``: name or pattern of
        errors and key of their tolerances; a band given one way replaces a band given another way, and ``cpk`` replaces
        ``std``. ``"pin*.tilt_t=none"`` takes errors out of the tolerances, a table in place of ``none`` is their new
        entry. ``"fit.code=H7/e7"``; ``"joint.contact.clearance=0.15 mm"``, ``"operation.alpha=12 deg"``, of several
        operating points ``"operation.start.alpha=12 deg"``; of a drive shaft ``"shaft.alpha=8 deg"``, of a linkage
        ``"mechanism.pair.B.clearance=0.1 mm"``; ``"errors.pin1.tilt_t=0.1 deg"``. Later ones override patterns of
        earlier ones.

    Returns
    -------
    str
        TOML. An entry whose settings are for some of its errors only becomes one entry for each of its errors. Keys of
        the joint that give way to those set, such as the third of a bearing, are removed.

    Raises
    ------
    InputError
        With every fault of the settings; see `rewriting.with_keys`.
    """
    text, entries, places = study.text, _Entries(study), dict[tuple[str, ...], str]()
    with collected() as faults:
        for setting in settings:
            place = f"--set {setting!r}"
            with gather(faults):
                path, value = _parsed(setting, place, study.mechanism)
                if (other := places.setdefault(tuple(path), place)) is not place:
                    raise input_error(place, f"sets the key of {other} again", "remove one of the two")
                if path[0] in _settable(study.mechanism):
                    text = _set(text, path, value, place, study.mechanism)
                elif path[0] == fits.KEY and len(path) == NAMES:
                    text = rewriting.with_keys(text, {fits.PATH: {path[1]: value}}, place)
                else:
                    entries.set(path, value, place)
        with gather(faults):
            for joint in (JOINT, JOINT2):
                text = _without_replaced(study, text, places, joint)
    return entries.written(text)


def _without_replaced(study: Study, text: str, paths: Collection[tuple[str, ...]], joint: tuple[str, ...]) -> str:
    """Text without the keys of a joint that give way to those set: the third of a bearing, the other section.

    `joint`: its key path.
    """
    old, new = (leaves(_table(each, joint)) for each in (study.text, text))
    dotted, changed = ".".join(joint), {key for key, value in new.items() if old.get(key) != value}
    given = changed | {".".join(path[len(joint) :]) for path in paths if path[: len(joint)] == joint}
    away = replaced(given, old)
    if lost := sorted(old.keys() - new.keys() - away):
        found = f"leaves out {', '.join(lost)}, which the study sets"
        raise input_error(f"--set {dotted}", found, f"set each key by itself: --set {dotted}.contact.law=sliced")
    for key in away & new.keys():
        *tables, name = key.split(".")
        text = rewriting.with_keys(text, {(*joint, *tables): {name: None}}, f"--set {dotted}.{key}")
    return text


def _table(text: str, path: Sequence[str]) -> Mapping[str, Any]:
    table: Any = tomllib.loads(text)
    for key in path:
        table = table.get(key, {}) if isinstance(table, Mapping) else {}
    return table if isinstance(table, Mapping) else {}


def words(study: Study, text: str) -> str:
    """What a text changes: keys with their values before and after, entries that are gone, and new ones."""
    old, new = (_flat(tomllib.loads(each), study.mechanism) for each in (study.text, text))
    values = [f"{key} {old[key]} → {value}" for key, value in new.items() if key in old and old[key] != value]
    gone, added = ({_shown(key, study.mechanism) for key in a.keys() - b.keys()} for a, b in ((old, new), (new, old)))
    found = {"changed": values, "without": sorted(gone), "new": sorted(added)}
    return "; ".join(f"{word}: {', '.join(items)}" for word, items in found.items() if items)


def _flat(data: Mapping[str, Any], mechanism: Mechanism) -> dict[str, Any]:
    """Values of the sections that are changed by dotted key, without ``tolerances``."""
    points = data["operation"]
    points = {str(point["name"]): point for point in points} if isinstance(points, list) else points
    sections = {key: data.get(key, {}) for key in _settable(mechanism)} | {"operation": points}
    return leaves(sections) | leaves(data["tolerances"])


def _shown(key: str, mechanism: Mechanism) -> str:
    """Key of the joint or the operation; of a tolerance its entry."""
    path = key.split(".")
    return key if path[0] in _settable(mechanism) else ".".join(path[: _names(path, mechanism)])


def _names(path: Sequence[str], mechanism: Mechanism) -> int:
    """Number of parts of the pattern that a key begins with: a joint before feature and key is one more."""
    return NAMES + any(fnmatchcase(joint, path[0]) for joint in selection.joints(mechanism))


def read(study: Study, text: str) -> Study:
    """Study of a changed text, on the joint in hand: its file need not be there any more.

    Raises
    ------
    InputError
        With every fault; their place begins with ``--set``.
    """
    try:
        return _read(study, text)
    except InputError as error:
        own = f"{study.path}: "
        places = (f"--set: {f.place.removeprefix(own)}" if f.place.startswith(own) else f.place for f in error.faults)
        pairs = zip(places, error.faults, strict=True)
        raise InputError([Fault(place, f.found, f.remedy) for place, f in pairs]) from error


def _changed(study: Study, text: str, joint: Joint, path: Sequence[str]) -> Joint:
    """Joint at a key path of a changed text: `joint` with the keys that the text changes."""
    old, new = (leaves(_table(each, path)) for each in (study.text, text))
    keys, name = {key: value for key, value in new.items() if old.get(key) != value}, ".".join(path)
    if "base" in keys:
        raise input_error(f"--set {name}.base", "is another joint", "run a study of its own, and compare both files")
    by_fit = [f"contact.{key}" for key in (*study.fit.diameters, "clearance")] if study.fit is not None else []
    still = study.fit is not None and fits.KEY in tomllib.loads(text)["tolerances"]
    if still and (twice := [key for key in by_fit if key in keys]):
        raise InputError([Fault(f"--set {name}.{key}", *fits.BESIDE) for key in twice])
    if not keys or keys.keys() <= set(by_fit):
        return joint
    over = {key: value for key, value in _table(text, path).items() if key != "base"}
    over = merged(over, {"contact": study.fit.diameters}) if still and study.fit is not None else over
    return with_keys(joint.given("json"), {}, over, f"{study.path}: {name}")


def _read(study: Study, text: str) -> Study:
    joint2 = study.operation.joint2
    joints = [_changed(study, text, study.joint, JOINT)]
    joints += [_changed(study, text, joint2, JOINT2)] if joint2 else []
    changed = load(study.path, study.sampling.n, text, *joints)
    if changed.fit is not None and (study.fit is None or changed.fit.diameters != study.fit.diameters):
        diameters = {f"contact.{key}": units.to_si(value, "m") for key, value in changed.fit.diameters.items()}
        changed = load(study.path, study.sampling.n, text, *(varied(joint, diameters) for joint in joints))
    if len(changed.points) > len(study.points):  # the campaign is at one of several points
        every = load(study.path, study.sampling.n, study.text, study.joint, joint2).points
        number = [point.operation for point in every].index(study.operation)
        changed = changed.at(changed.points[number].name)
    if names := loads_of(changed.mechanism).keys() ^ loads_of(study.mechanism).keys():
        found = f"makes another mechanism: of the two one alone has {', '.join(sorted(names)[:NAMED])}"
        raise input_error("--set", found, "run a study of its own, and compare both files")
    return changed


def differing(study: Study, changed: Study) -> dict[str, Any]:
    """Dotted keys of what determines the joints that differ from the study's, with their JSON values; None if gone.

    Numbers have `DIGITS` significant digits, so that values that differ in their unit only are the same.
    """
    texts = (json.dumps(widths.applied(each, {}).identity()) for each in (study, changed))
    rounded = (NUMBER.sub(lambda number: str(float(f"{float(number[0]):.{DIGITS}g}")), text) for text in texts)
    old, new = map(json.loads, rounded)
    keys = sorted(key for key in old.keys() | new.keys() if old.get(key) != new.get(key))
    return {key: new.get(key) for key in keys if not key.startswith("sampling.")}


def _parsed(setting: str, place: str, mechanism: Mechanism) -> tuple[list[str], Any]:
    """Parts of the key of a setting, without ``tolerances``, and its value."""
    path, value = rewriting.parsed(setting, place, EXAMPLE)
    if path[0] in SECTIONS and path[0] not in (*_settable(mechanism), "tolerances"):
        raise input_error(place, f"is in section {path[0]!r}, which changes no joint", OTHERS)
    return path[1:] if path[0] == "tolerances" else path, value


def _set(text: str, path: Sequence[str], value: Any, place: str, mechanism: Mechanism) -> str:
    """Set a key of the joint, of an operating point or of a fixed error."""
    section = tomllib.loads(text).get(path[0])
    if path[0] == "operation" and isinstance(section, list):
        names = [str(point.get("name")) for point in section]
        if len(path) <= NAMES or path[1] not in names:
            remedy = f"write --set operation.POINT.KEY=VALUE with one of {', '.join(names)}"
            raise input_error(place, "names no operating point", remedy)
        table: tuple[int | str, ...] = ("operation", names.index(path[1]))
        return rewriting.with_keys(text, {table: {".".join(path[2:]): value}}, place)
    if path[0] == "errors":
        pattern = ".".join(path[1:])
        for entry in selection.entries(section or {}, mechanism, "errors"):
            if entry.pattern == pattern:
                return rewriting.with_keys(text, {entry.path[:-1]: {str(entry.path[-1]): value}}, place)
        return rewriting.with_path(text, ["errors", pattern], value, place)
    return rewriting.with_path(text, path, value, place)


class _Entries:
    """Entries of ``[tolerances]`` that are being changed: keys of the entry of each error or zone, by its name."""

    def __init__(self, study: Study) -> None:
        self._study = study
        self._written = {entry.pattern: dict(entry.keys) for entry in study.entries}
        self._patterns = {entry.pattern: [site.name for site, _ in entry.models] for entry in study.entries}
        self._keys = {site.name: dict(entry.keys) for entry in study.entries for site, _ in entry.models}
        self._touched: set[str] = set()
        self._new: dict[str, dict[str, Any]] = {}

    def set(self, path: Sequence[str], value: Any, place: str) -> None:
        """Change a key of some errors, or their whole entry."""
        count = _names(path, self._study.mechanism)
        pattern, key = ".".join(path[:count]), path[count:]
        known: Iterable[str] = self._keys if key or value == NONE else toleranced_units(self._study.mechanism)
        names = selection.select(pattern, known)
        if key or value == NONE:
            names += [name for name in self._of_entries(pattern) if name in self._keys and name not in names]
        if not names:
            found = "selects no error that has a tolerance" if key or value == NONE else "selects nothing"
            raise input_error(place, found, did_you_mean(pattern, list(known)))
        self._touched |= set(names)
        if key:
            for name in names:
                self._keys[name] = _with_key(self._keys[name], key, value)
        elif value == NONE or isinstance(value, Mapping):
            for name in names:
                self._keys.pop(name, None)
            self._new = {other: keys for other, keys in self._new.items() if other != pattern}
            if value != NONE:
                self._new[pattern] = dict(value)
        else:
            raise input_error(place, f"{value!r} is no entry of [tolerances]", EXAMPLE)

    def _of_entries(self, pattern: str) -> list[str]:
        """Names of the entries whose own pattern a pattern selects: ``*_holes.position`` by ``*.position``."""
        feature, key = halves(pattern)
        parts = {of_entry: halves(of_entry) for of_entry in self._patterns}
        chosen = [of_entry for of_entry, (own, its) in parts.items() if its == key and fnmatchcase(own, feature)]
        return [name for of_entry in chosen for name in self._patterns[of_entry]]

    def written(self, text: str) -> str:
        """Text with the changed entries."""
        alike: dict[str, dict[str, Any]] = {}
        parted: list[str] = []
        for pattern, names in self._patterns.items():
            if self._touched & set(names):
                each = [self._keys.get(name) for name in names]
                is_alike = each[0] is not None and all(other == each[0] for other in each)
                alike[pattern] = dict(each[0] or {}) if is_alike else self._written[pattern]
                parted += [] if is_alike else [pattern]
        if alike.keys() & set(fits.patterns(self._study.mechanism)) and _fit(text) != _fit(self._study.text):
            raise input_error("--set fit", "is given beside tolerances of diameters", "leave one of the two out")
        if alike:
            text = scaling.rewritten(self._study, alike, self._study.sampling.seed, text)
        paths = {
            entry.pattern: entry.path
            for entry in fits.entries(tomllib.loads(text)["tolerances"], None, self._study.mechanism)
        }
        changes: dict[tuple[int | str, ...], dict[str, Any]] = {("tolerances",): {}}
        for pattern in parted:
            *table, key = paths[pattern]
            changes.setdefault(tuple(table), {})[str(key)] = None
            left = (name for name in self._patterns[pattern] if name in self._keys)
            changes["tolerances",] |= {name: self._keys[name] for name in left}
        changes["tolerances",] |= self._new
        return rewriting.with_keys(text, changes, f"{self._study.name}.toml")


def _fit(text: str) -> Any:
    return tomllib.loads(text)["tolerances"].get(fits.KEY)


def _with_key(entry: Mapping[str, Any], path: Sequence[str], value: Any) -> dict[str, Any]:
    """Entry with a key, or a key of a table in it, and without those that it replaces."""
    key, *inner = path
    if inner:
        table = entry.get(key)
        return dict(entry) | {key: _with_key(table if isinstance(table, Mapping) else {}, inner, value)}
    return {k: v for k, v in entry.items() if k not in REPLACED_KEYS.get(key, ())} | {key: value}
