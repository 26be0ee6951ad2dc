"""What a study assumes: values that nobody measured, or that few parts tell; and values that are hardly meant."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, NamedTuple

from tolstat.common import units
from tolstat.common.error_fields import error_units
from tolstat.common.errors import Fault, InputError, input_error
from tolstat.common.mechanism import Mechanism, features
from tolstat.joint import Joint, Operation, derived
from tolstat.joint.contact import Contact
from tolstat.joint.derived import get
from tolstat.joint.model import Assumed, leaves, merged, nested
from tolstat.joint.operation import having, shaft_of
from tolstat.joint.reading import with_keys
from tolstat.study.measured import left_open, of_entries
from tolstat.study.selection import excludes
from tolstat.study.study import Study
from tolstat.study.tolerances.zones import short_axes

_AXES = {"positions": ("offset_e", "offset_t", "offset_z"), "angles": ("tilt_t", "tilt_z"), "diameters": ("diameter",)}
"""Errors of a pin or hole by what they are about."""
_OF_CARDAN = "cross", "hub", "shaft"
"""Sections of the joint that linkages do not have."""


OF_JOINT2 = "shaft.joint2."
"""What stands before the keys of joint 2 of a drive shaft, where that is from a file of its own."""


class Assumption(NamedTuple):
    """Values of the joint, or of a process, that are assumed, and others that they may have.

    Attributes
    ----------
    name : str
        What is assumed, such as ``contact law``.
    values : tuple of mapping
        Other values, each dotted keys of the joint with their values as written: ``{"contact.law": "sliced"}``, of
        joint 2 of a drive shaft with `OF_JOINT2` before them; or keys of `measured.left_open`.
    because : str
        Why the value is not known.
    varied : bool
        Whether it is varied unless it is asked for by name; False where it is said to move nothing.
    """

    name: str
    values: tuple[Mapping[str, Any], ...]
    because: str
    varied: bool


def assumptions(study: Study) -> tuple[Assumption, ...]:
    """Assumptions that hold for the joints of a study: those of joint files, those of the study, and measured parts.

    An assumption of a joint file is left out if it is `given`, and replaced by one of the study of the same name, which
    is about joint 1 of a drive shaft. Of a linkage those that are about `_OF_CARDAN` alone are left out, too.
    """
    first, *others = _owners(study)
    out = {*given(study), *(entry.name for entry in study.assumed)}
    of_files = [(owner, entry) for owner in (first, *others) for entry in owner.joint.assumed]
    of_files = [(owner, entry) for owner, entry in of_files if owner.named(entry) not in out]
    if study.mechanism.placed:
        of_files = [both for both in of_files if not set(nested(both[1].values[0])) <= set(_OF_CARDAN)]
    of_values = [
        Assumption(owner.named(entry), tuple(map(owner.written, entry.values)), entry.because, entry.varied)
        for owner, entry in (*of_files, *((first, entry) for entry in study.assumed))
    ]
    of_parts = [
        Assumption(_process(key), tuple({key: end} for end in ends), f"{entry.parts} parts measured", True)
        for entry in study.known
        for key, ends in left_open(entry).items()
    ]
    return (*of_values, *of_parts)


def _process(key: str) -> str:
    """Name of what measured parts leave open: ``spread of pin*.tilt_t``."""
    pattern, _, field = key.rpartition(".")
    return f"{field} of {pattern}"


def given(study: Study) -> tuple[str, ...]:
    """Names of the assumptions of joint files that the study gives: its ``[joint]`` or fit sets one of their keys.

    A key that follows from one that the study sets is given, too: it no longer has the value of the joint file.
    Beside a spline so is ``shaft.axial``, since a second part that slides would hold nothing.
    """
    replaced = {entry.name for entry in study.assumed}
    splined = {"shaft.axial"} if study.mechanism.spline and study.mechanism.is_shaft else set()
    return tuple(
        owner.named(entry)
        for owner in _owners(study)
        for keys in [derived.changed({*leaves(owner.keys), *splined}, leaves(owner.joint.given("json")))]
        for entry in owner.joint.assumed
        if owner.named(entry) not in replaced and any(keys.intersection(leaves(value)) for value in entry.values)
    )


class _Owner(NamedTuple):
    """A joint from a file of its own: what stands before its keys and behind names; keys that the study sets."""

    before: str
    behind: str
    joint: Joint
    keys: Mapping[str, Any]

    def named(self, entry: Assumed) -> str:
        """Name of an assumption of its file."""
        return f"{entry.name}{self.behind}"

    def written(self, value: Mapping[str, Any]) -> dict[str, Any]:
        """Dotted keys of a value of such an assumption."""
        return {f"{self.before}{key}": text for key, text in leaves(value).items()}

    def own(self, keys: Mapping[str, Any]) -> dict[str, Any]:
        """Those of some keys that are of this joint, without `before`."""
        of_2 = {key.removeprefix(OF_JOINT2): value for key, value in keys.items() if key.startswith(OF_JOINT2)}
        return of_2 if self.before else {key: value for key, value in keys.items() if not key.startswith(OF_JOINT2)}


def _owners(study: Study) -> list[_Owner]:
    """The joint, and joint 2 of a drive shaft if that is another."""
    data, joint2 = tomllib.loads(study.text), study.operation.joint2
    diameters = {} if study.fit is None else {"contact": study.fit.diameters}
    found = [_Owner("", "", study.joint, merged(_without_base(data["joint"]), diameters))]
    if joint2 is not None:
        keys = merged(_without_base(data["shaft"]["joint2"]), diameters)
        found.append(_Owner(OF_JOINT2, " of joint 2", joint2, keys))
    return found


def _without_base(table: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in table.items() if key != "base"}


def with_value(study: Study, keys: Mapping[str, Any]) -> Study:
    """Study with some keys of its joints set, as if written in its ``[joint]``; what follows is computed anew.

    Keys of `measured.left_open` change what the entries draw.

    Parameters
    ----------
    study : Study
        The study, which is not modified.
    keys : mapping
        Values of an `Assumption` by their keys.

    Returns
    -------
    Study
        With the same seed and sampling, so that row by row its errors have the scores of those of `study`. Its text
        stays, and so do axial forces that have no effect on the changed joint.

    Raises
    ------
    InputError
        When the keys make no valid joint, or one that does not go with the study's settings; when the joints of the
        study have dimensions of their own.
    """
    if study.variants:
        found = "has joints with dimensions of their own: they are no variations of one joint"
        raise input_error(study.path, found, "vary the joint of a study with tolerances")
    of_joints = _of_joint(study, keys)
    joint, *others = (
        with_keys(owner.joint.given("json"), owner.keys, nested(owner.own(of_joints)), f"{study.path}: {place}")
        for owner, place in zip(_owners(study), ("joint", "shaft.joint2"), strict=False)
    )
    points = study.points
    for joint2 in others:
        points = tuple(point._replace(operation=_with_joint2(point.operation, joint2)) for point in points)
    tolerances = study.tolerances | of_entries(study, keys)
    changed = replace(study, joint=joint, points=points, operation=points[0].operation, tolerances=tolerances)
    changed.check_mounting(idle_forces=True)
    return changed


def _with_joint2(operation: Operation, joint2: Joint) -> Operation:
    shaft = shaft_of(operation)
    return operation.model_copy(update={"shaft": shaft.model_copy(update={"joint2": joint2})}) if shaft else operation


def is_drawn(study: Study, keys: Mapping[str, Any]) -> bool:
    """Whether the joint of a study has these values already: as a variation they would tell nothing."""
    with suppress(InputError):
        joints, others = (
            [owner.joint.model_dump() for owner in _owners(of)] for of in (study, with_value(study, keys))
        )
        return joints == others and _of_joint(study, keys) == keys
    return False


def together(study: Study, values: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Keys of several values at once, for `with_value`.

    A key that a value names only so that it stays gives way where it follows from a key of another value: a value of
    the clearance that keeps the contact coefficients leaves those that follow from ``contact.H`` to a value of that.

    Parameters
    ----------
    study : Study
        The study.
    values : sequence of mapping
        Values of several assumptions; of a key that several change, the last counts.
    """
    joined: dict[str, Any] = {}
    changed = [_owners(with_value(study, value)) for value in values]
    for at, owner in enumerate(_owners(study)):
        own = [owner.own(value) for value in values]
        changing = [
            {key for key in _of_joint(study, value) if get(owners[at].joint, key) != get(owner.joint, key)}
            for value, owners in zip(own, changed, strict=True)
        ]
        keys_of_joint = leaves(owner.joint.given("json"))
        for number, value in enumerate(own):
            others = set().union(*changing[:number], *changing[number + 1 :])
            following = derived.changed(others, keys_of_joint)
            kept = {key: text for key, text in value.items() if key in changing[number] or key not in following}
            joined |= {f"{owner.before}{key}": text for key, text in kept.items()}
    return joined


def _of_joint(study: Study, keys: Mapping[str, Any]) -> dict[str, Any]:
    """Those of some keys that are of the joint, not of what measured parts leave open."""
    of_parts = {key for entry in study.known for key in left_open(entry)}
    return {key: value for key, value in keys.items() if key not in of_parts}


def unselected(study: Study) -> tuple[str, ...]:
    """Errors of pins and holes that no entry of ``[tolerances]`` selects, nor any other section: taken as exact.

    Returns
    -------
    tuple of str
        Groups of errors in words, ``pin positions along the pin axes``; empty for a study without tolerances.
    """
    if not study.tolerances:
        return ()
    meanings = (meaning for entry in study.entries for site, model in entry.models for meaning in model.meaning(site))
    named = {name for meaning in meanings for name in meaning.errors} | study.errors.keys()
    instead = excludes(study.mechanism)
    named |= {other for name in named for other in instead.get(name, ()) if name.endswith(".clearance")}
    return tuple(_groups([name for name in error_units(study.mechanism) if name not in named], study.mechanism))


def _groups(names: Sequence[str], mechanism: Mechanism) -> Iterator[str]:
    """Describe errors of pins and holes, those of alike features together."""
    pins = {pair.pin for pair in mechanism.pairs}
    for part in ("pin", "hole"):
        every = [feature for feature in features(mechanism) if (feature in pins) == (part == "pin")]
        for noun, keys in _AXES.items():
            lacking = {feature: tuple(key for key in keys if f"{feature}.{key}" in names) for feature in every}
            for alike in filter(None, dict.fromkeys(lacking.values())):
                those = [feature for feature in every if lacking[feature] == alike]
                whole = len(those) == len(every)
                listed = " and ".join(", ".join(those).rsplit(", ", 1))
                what = f"{part} {noun}" if whole else f"{noun} of {listed}"
                axes = f"the {part} axes" if whole else "their axes" if len(those) > 1 else "its axis"
                yield what if alike == keys else f"{what} {_along(alike, axes)}"


def _along(keys: Sequence[str], axes: str) -> str:
    """Direction of some of the errors of an axis, in words."""
    across = f"across {axes}"
    words = {("offset_e",): f"along {axes}", ("offset_t", "offset_z"): across}
    direction = {"offset": "along", "tilt": "about"}[keys[0].partition("_")[0]]
    return words.get(tuple(keys), f"{direction} {' and '.join(key[-1] for key in keys)}")


WIDE = 10.0
"""Standard deviation of an error of position over the radial clearance, at which nearly every pin binds."""
LEAST_CLEARANCE = 1e-5
"""Clearance (m) that errors are compared with where a joint has less: pins without clearance are preloaded."""
FAST = 30_000.0
"""Speed times misalignment, rpm deg, beyond what makers of joint shafts allow."""
ROUNDING = 1e-9
"""Relative error of a product of converted quantities: 2500 rpm at 12 deg is not beyond 30000."""


def warnings(study: Study) -> Iterator[Fault]:
    """Warnings about a study: short axes, errors far wider than the clearance, speeds far too high, idle shafts."""
    yield from (study.fault(*warning) for warning in short_axes(study.entries, lambda name: _contact(study, name).z))
    yield from _wide_bands(study)
    yield from _fast_points(study)
    if study.operation.joint2 is not None:
        yield from _idle_ends(study)


def _idle_ends(study: Study) -> Iterator[Fault]:
    """Keys of a study for an outer shaft that is the other joint's."""
    data = leaves(tomllib.loads(study.text))
    for key, end, section, owner in (
        ("output", "output", "joint", "shaft.joint2"),
        ("unbalance", "output", "joint", "shaft.joint2"),
        ("input", "input", "shaft.joint2", "joint"),
    ):
        if any(name.startswith(f"{section}.shaft.{key}.") for name in data):
            found, remedy = f"has no effect: the {end} shaft is that of [{owner}]", f"write it as {owner}.shaft.{key}"
            yield study.fault(f"{section}.shaft.{key}", found, remedy)


def _contact(study: Study, name: str) -> Contact:
    """Contact of the joint that a name is about."""
    return having(name, study.joint, study.operation).contact


def _wide_bands(study: Study) -> Iterator[Fault]:
    """Entries whose positions and angles across a pin leave no room for it in its hole."""
    for entry in study.entries:
        sizes = [(0.0, 0.0, 0.0)]
        for site, model in entry.models:
            contact = _contact(study, site.name)
            for meaning in model.meaning(site):
                keys = {name.rpartition(".")[2] for name in meaning.errors}
                size = meaning.sigma if keys & {"offset_t", "offset_z"} else 0.0
                size = 0.5 * contact.z * meaning.sigma if keys & {"tilt_t", "tilt_z"} else size
                sizes.append((size / max(contact.clearance, LEAST_CLEARANCE), size, contact.clearance))
        ratio, size, clearance = max(sizes)
        if ratio > WIDE:
            room = units.shown(clearance, "m")
            found = f"moves the end of a pin by {units.shown(size, 'm')} (standard deviation), {ratio:.0f} times "
            found += f"the radial clearance of {room}: nearly every pin binds"
            remedy = "check its unit, and contact.clearance of the joint"
            yield study.fault(f"tolerances.{entry.pattern}", found, remedy)


def _fast_points(study: Study) -> Iterator[Fault]:
    """Warn once of operating points whose speed is far beyond that of any joint shaft at their misalignment."""
    fast = []
    for number, point in enumerate(study.points):
        rpm, alpha = point.operation.speed * 30.0 / math.pi, math.degrees(max(point.operation.alphas, default=0.0))
        product = abs(rpm) * alpha
        if product > FAST * (1.0 + ROUNDING):
            at = f" at {point.name}" if point.name else ""
            found = f"{rpm:.4g} rpm at {alpha:.3g} deg{at}: speed times angle, {product:.0f} rpm deg, is beyond the "
            found += f"{FAST:g} that makers of joint shafts allow"
            fast.append((product, found, f"operation[{number}].speed" if point.name else "operation.speed"))
    if fast:
        _, found, key = max(fast)
        others = len(fast) - 1
        found += f", as at {others} other point{'s' if others > 1 else ''}" if others else ""
        yield study.fault(key, found, "check it and alpha, and their units")
