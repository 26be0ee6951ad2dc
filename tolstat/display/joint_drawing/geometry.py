"""What drawings of a joint are made from, in plain numbers; directions of view, and outlines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MEANINGS = {
    "offset_e": "axis moved along e, outwards",
    "offset_t": "axis moved along t",
    "offset_z": "axis moved along z",
    "tilt_t": "axis turned about t",
    "tilt_z": "axis turned about z",
    "diameter": "pin thicker, hole wider",
}
"""Kinds of errors of a pin or hole, and what a positive value does."""
WALL = 0.12
"""Wall around a hole, relative to its diameter: the model has no such dimension, and drawings need one."""
FRONT = np.array([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
"""Directions of view are the axes that point to the right and upwards. Ground x and y: from the output side."""
SIDE = np.array([(0.0, 0.0, 1.0), (1.0, 0.0, 0.0)])
"""Ground z, the input shaft, to the right, x upwards: both shafts lie in this plane."""
ALONG_Z = np.array([(0.0, -1.0, 0.0), (1.0, 0.0, 0.0)])
"""For points in a triad (e, t, z): e upwards, t to the left, z towards the reader."""
ALONG_T = np.array([(0.0, 0.0, 1.0), (1.0, 0.0, 0.0)])
"""For points in a triad (e, t, z): e upwards, z to the right, t towards the reader."""


class Dimensions(NamedTuple):
    """Dimensions of the nominal joint (m, rad), and the pose in which its ideal parts are at the input angle 0.

    Attributes
    ----------
    R, r_b, l_f : float
        Centre O to the middle of pin and hole; O to the marker of a cross bushing; middle of the hole to the marker of
        a fork bushing, along the shaft.
    root, neck : float
        Distance from O at which a pin's beam is clamped, and diameter of the beam.
    pin, hole, z : float
        Diameters of pin and hole; length of the contact.
    arm : tuple of float
        Width of an arm's beam along t, and its thickness along e.
    alpha : float
        Misalignment of the shafts.
    triads : ndarray, shape (8, 3, 3)
        Rows e, t, z of pins 1 to 4 and arms 1 to 4, in ground axes.
    markers : ndarray, shape (8, 3)
        Markers of the bushings cross1 to cross4 and fork1 to fork4, in ground axes, m.
    arm_of_pin : tuple of int
        Arm, 0 to 3, in whose hole each pin turns.
    """

    R: float
    r_b: float
    l_f: float
    root: float
    neck: float
    pin: float
    hole: float
    z: float
    arm: tuple[float, float]
    alpha: float
    triads: Array
    markers: Array
    arm_of_pin: tuple[int, ...]

    @property
    def end(self) -> float:
        """Distance of the outer end of a pin from O, m."""
        return self.R + 0.5 * self.z

    @property
    def eye(self) -> float:
        """Outer radius that an arm is drawn with around its hole, m."""
        return (0.5 + WALL) * max(self.hole, self.pin)


class Feature(NamedTuple):
    """A pin or hole, with its errors.

    Attributes
    ----------
    name : str
        ``"pin1"``, ``"hole4"``.
    diameter : float
        m.
    point : ndarray, shape (3,)
        Shift of the axis' point from the ideal middle, along e, t, z, m.
    axis : ndarray, shape (3,)
        Direction of the axis, along e, t, z; (1, 0, 0) without tilt.
    errors : mapping
        Its errors by kind, SI.
    """

    name: str
    diameter: float
    point: Array = np.zeros(3)
    axis: Array = np.eye(3)[0]
    errors: Mapping[str, float] = {}

    def ends(self, length: float, factor: float = 1.0) -> Array:
        """Ends of the axis, (2, 3), at -length/2 and length/2 along e, the deviation from the ideal axis enlarged."""
        middle, e = np.outer((-0.5 * length, 0.5 * length), self.axis / self.axis[0]), np.eye(3)[0]
        ideal = np.outer((-0.5 * length, 0.5 * length), e)
        return np.asarray(ideal + factor * (middle - ideal + self.point))


Pair = tuple[Feature, Feature]
"""A pin and the hole that it turns in."""


def clearance(pair: Pair) -> float:
    """Radial clearance of a pin in its hole, m."""
    return 0.5 * (pair[1].diameter - pair[0].diameter)


def strip(a: Array, b: Array, low: float, high: float, across: Array | None = None) -> Array:
    """Corners (4, 2) of a strip along the line from `a` to `b`, at distances from `low` to `high` to its left.

    With `across`, a vector on the drawing, distances are along it.
    """
    way = np.asarray(b) - a
    across = np.array([-way[1], way[0]]) / np.hypot(*way) if across is None else across
    return np.array([a + low * across, b + low * across, b + high * across, a + high * across])


def circle(centre: Array, radius: float) -> Array:
    """Points (n, 2) of a circle."""
    angle = np.linspace(0.0, 2.0 * np.pi, 97)[:-1]
    return np.asarray(centre) + radius * np.column_stack([np.cos(angle), np.sin(angle)])
