"""Joint files: reading them, with the keys that a case, study or assumption has in place of theirs."""

from __future__ import annotations

import difflib
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from tolstat.common import strict, units
from tolstat.common.errors import Fault, InputError, input_error, raise_all
from tolstat.common.files import data_dir
from tolstat.common.notation import DIAMETER
from tolstat.common.strict import validate
from tolstat.joint import derived
from tolstat.joint.model import Assumed, Joint, affects_results, laid_over, leaves, nested, overridden

DEFAULT_JOINT = "cirelli2021"
"""Joint in ``data/joints`` whose values are the examples of the keys of a joint."""
OF_FRICTION = {"friction.mu_along", "friction.radius", "friction.slip_speed"}
NO_MU = "has no effect without friction.mu: there is no friction", "give friction.mu, too, or remove this key"


def load(
    base: object, overrides: Mapping[str, Any], place: str, relative_to: Path | None = None, section: str = "joint"
) -> Joint:
    """Read a joint file and merge a case's own keys over it.

    Parameters
    ----------
    base : str or Path
        Name of a file in ``data/joints`` without ``.toml``, or a path (it ends in ``.toml`` or has a folder); anything
        else is a fault.
    overrides : mapping
        Keys of the case's ``[joint]`` table, nested as TOML nests them; its `base` is left out.
    place : str
        Name of the case file, under which faults of `base` and `overrides` are reported.
    relative_to : Path, optional
        Folder that a relative path is taken from; the working directory by default.
    section : str
        Key path of `base` and `overrides` in the case's file.

    Returns
    -------
    Joint
        The resolved joint.

    Raises
    ------
    InputError
        With every fault: those of the joint file under its name, those of `overrides` under `place`.
    """
    overrides = {key: value for key, value in overrides.items() if key != "base"}
    path = _find(base, f"{place}: {section}.base", relative_to)
    text = strict.read_text(path)
    data = strict.read_toml(path, text)
    if "material" not in data and data.keys() & {"joint", "operation", "sampling"}:
        remedy = "give a joint file; tolstat new STUDY.toml --joint own writes one"
        raise input_error(path, "is a study or case, not a joint file", remedy)
    with strict.lines_of(path):
        faults = list(_faults_of_file(path, text))
        if "assumed" in overrides:
            remedy = "write [[assumed]] beside [joint]"
            faults.append(Fault(f"{place}: {section}.assumed", "is no key that a study or case replaces", remedy))
        try:
            joint = strict.validate(Joint, overridden(data, _without_assumed(overrides)), place, examples=examples())
        except InputError as error:
            raise InputError([*_attributed(error.faults, data, path, place, section), *faults]) from error
        if faults:
            raise InputError(faults)
    merged = leaves(overridden(data, overrides))
    given, in_file = leaves(overrides).keys(), leaves(data)
    without_mu = [] if joint.friction.mu is not None else [key for key in given | in_file if key in OF_FRICTION]
    raise_all(Fault(f"{place}: {section}.{key}", *NO_MU) for key in sorted(given & {*without_mu}))
    own = [key for key in sorted(without_mu) if in_file[key] != examples().get(key)]
    gone = derived.replaced(given, in_file)
    joint.remember(
        [
            *_inherited(joint, given, in_file, gone, path),
            *_lowered(joint, merged.get("contact.fit_load")),
            *(Fault(key, *NO_MU) for key in own),
        ],
        {key: str(in_file[key]) for key in derived.BEARING if key in in_file and key in given | gone},
    )
    return joint


def is_joint(data: Mapping[str, Any]) -> bool:
    """Whether the tables of a file are those of a joint file."""
    return "joint" not in data and len(data.keys() & {"material", "pin", "arm", "cross", "shaft", "contact"}) > 2


def _without_assumed(table: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in table.items() if key != "assumed"}


@lru_cache(maxsize=8)
def _faults_of_file(path: Path, text: str) -> tuple[Fault, ...]:
    """Faults of ``[[assumed]]`` of a joint file that is valid but for them; a sweep reads the same file often."""
    data = strict.read_toml(path, text)
    try:
        joint = strict.validate(Joint, data, str(path))
    except InputError:
        return ()
    return tuple(faults_of_assumed(joint.assumed, _without_assumed(data), {}, str(path)))


def faults_of_assumed(
    entries: Sequence[Assumed], data: Mapping[str, Any], of_study: Mapping[str, Any], place: str
) -> Iterator[Fault]:
    """Faults of assumptions whose values make no joint.

    Parameters
    ----------
    entries : sequence of Assumed
        Tables ``[[assumed]]`` of one file.
    data, of_study : mapping
        Keys of the joint, and those that the study sets, see `with_keys`.
    place : str
        File name shown in faults.
    """
    names = [entry.name for entry in entries]
    for number, entry in enumerate(entries):
        where = f"{place}: assumed[{number}]"
        if entry.name in names[:number]:
            yield Fault(f"{where}.name", f"another one is named {entry.name!r}", "give each a name of its own")
        for index, value in enumerate(entry.values):
            at = f"{where}.values[{index}]"
            for key in leaves(value):
                if not affects_results(key):
                    yield Fault(f"{at}.{key}", "affects no result", "remove it")
            try:
                with_keys(data, of_study, value, at)
            except InputError as error:
                yield from _under(at, error.faults)


def _under(at: str, faults: Iterable[Fault]) -> Iterator[Fault]:
    """Faults with the place `at` as the table that their keys are in."""
    for fault in faults:
        key = fault.place.removeprefix(f"{at}: ")
        yield Fault(f"{at}.{key}" if key != fault.place else at, fault.found, fault.remedy)


def with_keys(data: Mapping[str, Any], of_study: Mapping[str, Any], keys: Mapping[str, Any], place: str) -> Joint:
    """Joint with some keys set beside those that a study sets, and all that follows from them computed anew.

    Parameters
    ----------
    data : mapping
        Keys of the joint as `Joint.given` returns them in mode ``json``; those of the study among them.
    of_study, keys : mapping
        Keys that the study sets, which stay; and the keys to set; nested, as a file writes them.
    place : str
        What stands before the key path in faults.

    Raises
    ------
    InputError
        When the keys make no valid joint.
    """
    return strict.validate(Joint, overridden(data, laid_over(of_study, keys)), place, examples=examples())


def with_own(joint: Joint, keys: Mapping[str, Any], place: str = "joint") -> Joint:
    """Joint with some keys of another, and all that follows from them computed anew; it warns of values that stay.

    Parameters
    ----------
    joint : Joint
        The other.
    keys : mapping
        Nested, as a file writes them.
    place : str
        Key path of the keys, for faults.

    Raises
    ------
    InputError
        When the keys make no valid joint.
    """
    return _with_own(json.dumps(joint.given("json")), json.dumps(keys), place)


@lru_cache(maxsize=256)
def _with_own(text: str, own: str, place: str) -> Joint:
    data, keys = json.loads(text), json.loads(own)
    try:
        joint = with_keys(data, {}, keys, place)
    except InputError as error:
        raise InputError([*_under(place, error.faults)]) from error
    given, others = leaves(keys).keys(), leaves(data)
    joint.remember(_inherited(joint, given, others, derived.replaced(given, others), Path("[joint]")), {})
    return joint


@cache
def examples() -> dict[str, Any]:
    """Values of the default joint by dotted key, as its file writes them: the examples of a joint's keys."""
    return leaves(strict.read_toml(data_dir() / "joints" / f"{DEFAULT_JOINT}.toml"))


def _find(base: object, place: str, relative_to: Path | None) -> Path:
    if not isinstance(base, str | Path):
        raise input_error(place, f"{base!r} is not a text", "give a name in data/joints or a path")
    path = Path(base)
    if path.suffix.lower() == ".toml" or len(path.parts) > 1:
        return (relative_to or Path()) / path
    folder = data_dir() / "joints"
    names = sorted(p.stem for p in folder.glob("*.toml"))
    if str(base) in names:
        return folder / f"{base}.toml"
    close = difflib.get_close_matches(str(base), names, n=1)
    known = f"did you mean {close[0]!r}?" if close else f"write one of {', '.join(names)}, or a path to a .toml file"
    raise input_error(place, f"no joint is named {str(base)!r}", known)


def _attributed(
    faults: tuple[Fault, ...], data: Mapping[str, Any], path: Path, place: str, section: str
) -> list[Fault]:
    """Report the faults that the joint file has without overrides under its name, the others under `place`."""
    try:
        strict.validate(Joint, data, str(path), examples=examples())
        faults_of_file = {}
    except InputError as error:
        faults_of_file = {(f.place.removeprefix(f"{path}: "), f.found): f for f in error.faults}
    attributed = []
    for f in faults:
        key = f.place.removeprefix(f"{place}: ")
        attributed.append(faults_of_file.get((key, f.found)) or Fault(f"{place}: {section}.{key}", f.found, f.remedy))
    return attributed


def _inherited(
    joint: Joint, given: Set[str], in_file: Mapping[str, Any], gone: Set[str], path: Path
) -> Iterator[Fault]:
    """Warn of values of the joint file that an override leaves, although it gives keys that they follow from."""
    changed = derived.changed(given, in_file)
    stay = in_file.keys() - changed - gone
    for key, (expected, reason, instead) in derived.expected(joint, given, changed, stay).items():
        D_P = in_file.get("contact.D_P")
        if key == "pin.d" and D_P and math.isclose(units.to_si(D_P, "m", DIAMETER), expected, rel_tol=derived.WIDE):
            continue  # the joint file has pins of two diameters itself
        inherited, value = _written(in_file[key], key, in_file[key]), _written(expected, key, in_file[key])
        remedy = f"give {instead}, from which it follows, or {key}" if instead else f"give {key}, this value or that"
        yield Fault(key, f"{inherited} is inherited from {path.stem}; {reason} {value}", remedy)
    radius = None if joint.friction.mu is None else in_file.get("friction.radius")
    if changed & {"pin.d", "contact.D_P"} and "friction.radius" not in given and radius is not None:
        half = 0.5 * joint.contact.D_P
        if not math.isclose(units.to_si(radius, "m"), half, rel_tol=1e-6):
            expected = units.written(half, "m", radius, digits=3)
            found = f"{radius} is inherited from {path.stem}; half of contact.D_P is {expected}"
            yield Fault("friction.radius", found, "give friction.radius, this value or that")
    along = in_file.get("friction.mu_along")
    if "friction.mu" in given and "friction.mu_along" not in given and along not in (None, joint.friction.mu):
        found = f"{along} along the pins is inherited from {path.stem}, beside mu = {joint.friction.mu:g} around them"
        yield Fault("friction.mu_along", found, "give friction.mu_along, this value or another")


def _lowered(joint: Joint, written: object) -> Iterator[Fault]:
    """Warn of a largest load of the fit that is smaller than the one `written`; see `Joint._stiffens`."""
    used = joint.contact.fit_load
    if written is None or used is None or math.isclose(used, units.to_si(written, "N"), rel_tol=1e-9):
        return
    text = str(units.written(used, "N", written))
    found = f"up to {written} eq. (3) gives no stiffening contact, so that k1u and k2u are fitted up to {text}"
    yield Fault("contact.fit_load", found, f'write fit_load = "{text}", or give k1u and k2u')


def _written(value: Any, key: str, like: object) -> str:
    """Text of a value as a file has it, or of an SI value in the unit of `like`; also of three values."""
    if isinstance(like, list):
        return f"[{', '.join(_written(*each) for each in zip(value, [key] * 3, like, strict=True))}]"
    return value if isinstance(value, str) else str(units.written(value, derived.UNITS[key], like, digits=3))


def varied(joint: Joint, values: Mapping[str, Any]) -> Joint:
    """Return the joint of a variant.

    Parameters
    ----------
    joint : Joint
        The joint of the study.
    values : mapping
        `Variant.values`: dotted key of the joint to SI value or string, None for a key that follows from others; keys
        of other sections are ignored.
    """
    changed = {key: value for key, value in values.items() if key.partition(".")[0] in Joint.model_fields}
    if not changed:
        return joint
    unchanged = {key: value for key, value in leaves(joint.given()).items() if key not in changed}
    new = {key: value for key, value in changed.items() if value is not None}
    return validate(Joint, laid_over(nested(unchanged), nested(new)), "joint", context={"si": True})
