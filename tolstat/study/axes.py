"""Axes of single features and of pairs: the quantities that tolerance zones draw, and the errors that follow from them.

A zone quantity is a vector across the ideal axis, with components along t and z. It is drawn as radius and uniform
direction, so that two random streams belong to it: those of two columns of the table ERROR. A position is drawn as the
two ends of the axis over the toleranced length, or as its middle where the direction has a zone of its own. A direction
is drawn as a slope: how far the axis departs from the ideal one, per unit length.

The common axis of a pair is the line through the middles of its two features. Its components are along the first
feature's t and z. Coaxiality is the slope of each feature relative to that line.

Maximum material requirement of a position: the zone grows as the pin gets thinner or the hole wider. A part is
acceptable if its axis lies in the grown zone: its surface then stays within the virtual condition. What is drawn are
the ends of the axis in the zone without bonus, independently of the diameter; `Bonus.shift` takes them to the grown
zone of the part's own diameter. With the rule ``fills`` all offsets grow in proportion to the zone. With ``reject`` the
process stays as it is, and each end keeps its probability under the condition that it is in the grown zone; the
diameters of accepted parts then have a distribution of their own, `Bonus.accepted` times that of all parts.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.common.mechanism import Mechanism, features

Array = NDArray[np.float64]

REJECT, FILLS = "reject", "fills"
LEAST = 1e-9
"""Smallest factor on a zone: zero would lose where in the zone the axis is."""


@dataclass(frozen=True)
class Bonus:
    """Bonus of the position of one pin or hole.

    Attributes
    ----------
    rule : str
        ``"reject"`` or ``"fills"``.
    diameter : str
        Name of the error of the feature's diameter.
    limit : float
        This error at maximum material, m: the upper limit of a pin, the lower limit of a hole.
    radius : float
        Radius of the zone without bonus, m.
    sigma : float
        Standard deviation of a coordinate of an end before any part is rejected, m; infinite if the process is uniform
        in the zone without bonus.
    """

    rule: str
    diameter: str
    limit: float
    radius: float
    sigma: float

    def growth(self, deviation: Array) -> Array:
        """Radius of the zone over that without bonus, from the error of the diameter (m); both (n,)."""
        side = 1.0 if is_pin(self.diameter) else -1.0
        return np.maximum(1.0 + side * (self.limit - deviation) / (2.0 * self.radius), LEAST)

    def inside(self, growth: Array) -> Array:
        """Share of the process's ends that lie in a zone grown by this factor."""
        if math.isinf(self.sigma):
            return np.minimum(growth, 1.0) ** 2
        return np.asarray(-np.expm1(-0.5 * (growth * self.radius / self.sigma) ** 2))

    def accepted(self, deviation: Array) -> Array:
        """Share of the parts with this error of the diameter that are not rejected: both ends are in the zone."""
        if self.rule == FILLS:
            return np.ones_like(deviation)
        return self.inside(self.growth(deviation)) ** 2

    def shift(self, vector: Array, deviation: Array) -> Array:
        """Take an end from the zone without bonus to the grown zone; vectors (2, n), m."""
        growth = self.growth(deviation)
        return vector * self._ratio(np.hypot(*vector), growth, self.inside(growth) / self.inside(np.ones(1)))

    def unshift(self, vector: Array, deviation: Array) -> Array:
        """Inverse of `shift`."""
        growth = self.growth(deviation)
        return vector * self._ratio(np.hypot(*vector), 1.0 / growth, self.inside(np.ones(1)) / self.inside(growth))

    def _ratio(self, radius: Array, growth: Array, share: Array) -> Array:
        """Factor on a radius whose probability, under the condition that it is in the zone, stays the same.

        `growth` and `share` are those of the zone's radius and of the ends inside.
        """
        if self.rule == FILLS:
            return growth
        if math.isinf(self.sigma):
            return np.sqrt(share)
        inside = -np.expm1(-0.5 * (radius / self.sigma) ** 2) * share
        moved = self.sigma * np.sqrt(-2.0 * np.log1p(-np.minimum(inside, 1.0 - 2.0**-53)))
        return np.divide(moved, radius, out=np.sqrt(share) * np.ones_like(radius), where=radius > 1e-6 * self.sigma)

    def mean_square(self, deviation: Array) -> Array:
        """Mean square of the radius of an end, m^2, for parts with this error of the diameter that are accepted."""
        growth = self.growth(deviation)
        size = np.ones_like(growth) if self.rule == FILLS else growth
        if math.isinf(self.sigma):
            square = 0.5 * (self.radius * np.minimum(size, 1.0)) ** 2
        else:
            half = 0.5 * (size * self.radius / self.sigma) ** 2
            square = 2.0 * self.sigma**2 * (1.0 - half * np.exp(-half) / self.inside(size))
        return square * growth**2 if self.rule == FILLS else square


Table = NDArray[np.void]

PAIRS = {
    "input_pins": ("pin3", "pin4"),
    "output_pins": ("pin1", "pin2"),
    "input_holes": ("hole1", "hole2"),
    "output_holes": ("hole4", "hole3"),
}
"""Features on one ideal axis of a Cardan joint, pins of the cross or holes of a fork; e of the first one is x or y of
its frame. Where there are several joints, the name of the joint stands before each of these names: `members`."""

ORIENTATIONS = ("perpendicularity", "angularity")
RADIAL = "offset_radial"
ZONES = ("position", *ORIENTATIONS, "coaxiality")
"""Keys of zones, beside that of radial offsets."""


@cache
def zone_units(mechanism: Mechanism) -> dict[str, str]:
    """SI unit of what stands for several columns of the table ERROR: radial offsets, zones of features and of pairs."""
    single = features(mechanism)
    joints = dict.fromkeys(feature[: -len(own(feature))] for feature in single if mechanism.cardan)
    pairs = [f"{joint}{pair}" for joint in joints for pair in PAIRS]
    names = [f"{feature}.{RADIAL}" for feature in single]
    names += [f"{feature}.{key}" for feature in (*single, *pairs) for key in ("position", *ORIENTATIONS)]
    return dict.fromkeys([*names, *(f"{pair}.coaxiality" for pair in pairs)], "m")


def own(feature: str) -> str:
    """Name of a feature or pair in its joint: ``pin1`` of ``joint2.pin1``."""
    return feature.rpartition(".")[2]


def is_pair(feature: str) -> bool:
    """Whether a name is that of a pair of features."""
    return own(feature) in PAIRS


def is_pin(name: str) -> bool:
    """Whether an error is one of a pin, not of a hole."""
    feature = own(name.rpartition(".")[0])
    return feature.startswith("pin") or feature.endswith("_pin")


def members(feature: str) -> tuple[str, ...]:
    """Features of a pair; a feature itself."""
    joint = feature[: -len(own(feature))]
    return tuple(f"{joint}{name}" for name in PAIRS.get(own(feature), (own(feature),)))


def alike(feature: str) -> str:
    """Pattern of all features of the kind of one: ``pin*``, ``joint*.pin*``, of a linkage ``*_pin``."""
    return re.sub(r"^.+(?=_(?:pin|eye)$)|\d+", "*", feature)


def is_zone(name: str) -> bool:
    """Whether a name is that of a zone, or of a quantity that a zone draws."""
    return own(zone_of(name)) in (RADIAL, *ZONES)


def zone_of(name: str) -> str:
    """Name of the zone that draws a quantity: ``pin1.position`` of ``pin1.position_inner``."""
    feature, _, key = name.rpartition(".")
    return name if key == RADIAL else f"{feature}.{key.partition('_')[0]}"


def compatible(first: str, other: str) -> bool:
    """Whether two zones are tolerances of one axis that complement each other, such as position and coaxiality."""
    (a, _, key), (b, _, other_key) = first.rpartition("."), other.rpartition(".")
    roles = [next((r for r in ORIENTATIONS if k in ORIENTATIONS), k) for k in (key, other_key)]
    known = is_zone(first) and is_zone(other) and RADIAL not in roles
    return known and a == b and roles[0] != roles[1]


def ends(name: str) -> tuple[str, str]:
    """Keys of the ends of an axis at -over/2 and +over/2 along e."""
    if is_pair(name):
        first, second = PAIRS[own(name)]
        return f"position_{second}", f"position_{first}"
    return "position_inner", "position_outer"


def columns_of(name: str) -> tuple[str, ...]:
    """Columns of the table ERROR that hold a quantity or zone."""
    if not is_zone(name):
        return (name,)
    feature, _, key = name.rpartition(".")
    parts = ["offset_t", "offset_z"] if key == RADIAL else ["tilt_t", "tilt_z"]
    if is_pair(feature) or key.startswith("position"):
        parts = ["offset_t", "offset_z", "tilt_t", "tilt_z"]
    return tuple(f"{member}.{part}" for member in members(feature) for part in parts)


def streams_of(name: str) -> tuple[str, ...]:
    """Columns of the table ERROR whose random streams a quantity uses: of a vector for radius and direction."""
    if not is_zone(name):
        return (name,)
    feature, _, key = name.rpartition(".")
    first, second = members(feature)[0], members(feature)[-1]
    if key.startswith("coaxiality"):
        source, part = _member(feature, key), "tilt"
    elif key in (RADIAL, "position") or key == ends(feature)[0]:
        source, part = first, "offset"
    else:
        source, part = second, "offset" if is_pair(feature) else "tilt"
    return tuple(f"{source}.{part}_{c}" for c in (key[-1] if is_component(name) else "tz"))


def _member(pair: str, key: str) -> str:
    """Feature of a pair that a key of its coaxiality is about: ``coaxiality_pin1``."""
    return pair[: -len(own(pair))] + key.rpartition("_")[2]


def is_component(name: str) -> bool:
    """Whether a zone quantity is one component of a slope, in one plane: ``pin1.perpendicularity_z``."""
    return name.endswith(tuple(f".{key}_{about}" for key in ORIENTATIONS for about in "tz"))


@dataclass(frozen=True)
class Axis:
    """One axis with tolerance zones.

    Attributes
    ----------
    name : str
        Feature or pair.
    over : float
        Length that the position holds over, m.
    room : float
        Radius of the position's zone, m, where direction has a zone, too, and no part is outside: the middle then stays
        in the circle that keeps both ends of the tilted axis in the zone. Infinite otherwise.
    reach : float
        Distance of the features' middles from the joint's centre, m; for pairs only.
    bonus : Bonus, optional
        Maximum material requirement of the position of a pin or hole.
    """

    name: str
    over: float = math.nan
    room: float = math.inf
    reach: float = math.nan
    bonus: Bonus | None = None

    def describe(self) -> dict[str, Any]:
        """What determines the errors, besides what is drawn, as JSON values: what matters for the axis."""
        values = asdict(self) | ({} if self.bonus is None else asdict(self.bonus))
        del values["name"], values["bonus"]
        return {key: value for key, value in values.items() if isinstance(value, str) or math.isfinite(value)}

    def fill(self, table: Table, drawn: Mapping[str, Array]) -> None:
        """Set the errors.

        Parameters
        ----------
        table : ndarray, shape (n,), dtype ERROR
            Errors of joints; the columns of the axis are overwritten.
        drawn : mapping of str to ndarray, (2, n)
            Vectors by key: along t and z in m, or slopes.
        """
        if self.bonus is not None:
            deviation = table[self.bonus.diameter]
            drawn = {key: self.bonus.shift(vector, deviation) for key, vector in drawn.items()}
        middle, slope = self._line(drawn)
        if not is_pair(self.name):
            _set(table, self.name, middle, slope)
            return
        both = members(self.name)
        relatives = [drawn.get(f"coaxiality_{own(feature)}") for feature in both]
        zero = np.zeros((2, len(table)))
        common, tilt = zero if middle is None else middle, zero if slope is None else slope
        for feature, relative, side in zip(both, relatives, (1.0, -1.0), strict=True):
            shift, turned = _as_seen(common + side * self.reach * tilt, tilt, side)
            _set(table, feature, shift, turned if relative is None else turned + relative)

    def vector(self, errors: Table, key: str) -> Array:
        """Vector of one key from the errors of joints, the inverse of `fill`; (2, n), m or slope."""
        if not is_pair(self.name):
            if key == RADIAL:
                return _offset(errors, self.name)
            slope = _slope(errors, self.name)
            drawn = self._of_line(key, slope, lambda: _offset(errors, self.name))
            return drawn if self.bonus is None else self.bonus.unshift(drawn, errors[self.bonus.diameter])
        first, second = members(self.name)
        near = _offset(errors, first)
        far, _ = _as_seen(_offset(errors, second), np.zeros((2, 1)), -1.0)
        slope = (near - far) / (2.0 * self.reach)
        if key.startswith("coaxiality"):
            member = _member(self.name, key)
            return _slope(errors, member) - _as_seen(near, slope, 1.0 if member == first else -1.0)[1]
        return self._of_line(key, slope, lambda: 0.5 * (near + far))

    def _line(self, drawn: Mapping[str, Array]) -> tuple[Array | None, Array | None]:
        """Middle and slope of the axis; None for what no zone tolerances."""
        low, high = ends(self.name)
        if low in drawn:
            return 0.5 * (drawn[low] + drawn[high]), (drawn[high] - drawn[low]) / self.over
        slope = None
        for key, vector in drawn.items():
            if key.startswith(ORIENTATIONS):
                slope = vector if slope is None else slope + vector
        middle = drawn.get(RADIAL, drawn.get("position"))
        if middle is not None and slope is not None and "position" in drawn:
            middle = middle * self._share_left(slope)
        return middle, slope

    def _of_line(self, key: str, slope: Array, middle: Callable[[], Array]) -> Array:
        if not key.startswith("position"):
            return slope
        if key == "position":
            return middle() / self._share_left(slope)
        side = 0.5 if key == ends(self.name)[1] else -0.5
        return middle() + side * self.over * slope

    def _share_left(self, slope: Array) -> Array:
        """Share of the zone's radius that an axis of this slope leaves to its middle."""
        if math.isinf(self.room):
            return np.ones(slope.shape[1])
        taken: Array = np.hypot(*slope) * self.over / (2.0 * self.room)
        left: Array = np.maximum(1.0 - taken, 1e-9)  # zero would lose where in the zone the middle is
        return left


def component(name: str, vector: Array) -> Array:
    """Slope in one plane, (n,): its component that a rotation about t or about z changes."""
    return np.asarray(-vector[1] if name.endswith("_t") else vector[0])


def of_component(name: str, slope: Array) -> Array:
    """Slope vector, (2, n), of the axis with a slope in one plane: the inverse of `component`."""
    zero = np.zeros_like(slope)
    return np.array([zero, -slope] if name.endswith("_t") else [slope, zero])


def _as_seen(shift: Array, slope: Array, side: float) -> tuple[Array, Array]:
    """Shift and slope of a pair's axis along t and z of the first feature (side 1) or of the second (side -1).

    The second feature's t and e are opposite to the first's, its z is the same. A slope is per length along e.
    """
    turn = np.array([[side], [1.0]])
    return turn * shift, side * turn * slope


def _set(table: Table, feature: str, offset: Array | None, slope: Array | None) -> None:
    if offset is not None:
        table[f"{feature}.offset_t"], table[f"{feature}.offset_z"] = offset
    if slope is not None:
        # a tilt epsilon is a finite rotation: the axis departs by tan|epsilon| per unit length
        size = np.hypot(*slope)
        ratio = np.divide(np.arctan(size), size, out=np.ones_like(size), where=size > 0)
        table[f"{feature}.tilt_t"], table[f"{feature}.tilt_z"] = -ratio * slope[1], ratio * slope[0]


def _offset(errors: Table, feature: str) -> Array:
    return np.array([errors[f"{feature}.offset_t"], errors[f"{feature}.offset_z"]])


def _slope(errors: Table, feature: str) -> Array:
    about_t, about_z = errors[f"{feature}.tilt_t"], errors[f"{feature}.tilt_z"]
    angle = np.hypot(about_t, about_z)
    ratio: Any = np.divide(np.tan(angle), angle, out=np.ones_like(angle), where=angle > 0)
    return np.array([ratio * about_z, -ratio * about_t])
