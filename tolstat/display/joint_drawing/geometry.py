"""What drawings of a joint are made from, in plain numbers; directions of view, and outlines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

KINDS = ("offset_e", "offset_t", "offset_z", "tilt_t", "tilt_z", "diameter")
"""Kinds of errors of a pin or hole."""
WALL = 0.12
"""Wall around a hole, relative to its diameter: the model has no such dimension, and drawings need one."""


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
    centres, markers : ndarray, shape (8, 3)
        Middles of pins 1 to 4 and holes 1 to 4; markers of the bushings cross1 to cross4 and fork1 to fork4. Ground
        axes, m.
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
    centres: Array
    markers: Array
    arm_of_pin: tuple[int, ...]

    @property
    def clearance(self) -> float:
        """Radial clearance, m."""
        return 0.5 * (self.hole - self.pin)

    @property
    def end(self) -> float:
        """Distance of the outer end of a pin from O, m."""
        return self.R + 0.5 * self.z

    @property
    def eye(self) -> float:
        """Outer radius that an arm is drawn with around its hole, m."""
        return (0.5 + WALL) * max(self.hole, self.pin)


class Feature(NamedTuple):
    """Axis of a pin or hole in its triad: coordinates along e, t, z.

    Attributes
    ----------
    point : ndarray, shape (3,)
        Shift of the axis' point from the ideal middle, m.
    axis : ndarray, shape (3,)
        Direction of the axis; (1, 0, 0) without tilt.
    diameter : float
        m.
    """

    point: Array
    axis: Array
    diameter: float


class Pair(NamedTuple):
    """A pin and the hole that it turns in, with their errors.

    Attributes
    ----------
    names : tuple of str
        ``("pin1", "hole4")``.
    pin, hole : Feature
        Their axes, in the triad that pin and arm have in common.
    clearance : float
        Radial clearance, m.
    errors : tuple of mapping
        Errors of pin and hole by kind, SI.
    """

    names: tuple[str, str]
    pin: Feature
    hole: Feature
    clearance: float
    errors: tuple[Mapping[str, float], Mapping[str, float]]


class View(NamedTuple):
    """Direction of view: the axes that point to the right and upwards on the drawing; the third is towards the reader.

    Attributes
    ----------
    right, up : tuple of float
        Unit vectors.
    """

    right: tuple[float, float, float]
    up: tuple[float, float, float]

    def of(self, points: Array) -> Array:
        """Coordinates on the drawing, (..., 2), of points (..., 3)."""
        return np.asarray(np.asarray(points, float) @ np.array([self.right, self.up]).T)

    @property
    def towards(self) -> Array:
        """Unit vector towards the reader."""
        return np.cross(self.right, self.up)


FRONT = View((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
"""Ground x to the right, y upwards: along the input shaft, from the output side."""
SIDE = View((0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
"""Ground z, the input shaft, to the right, x upwards: both shafts lie in this plane."""
ALONG_Z = View((0.0, -1.0, 0.0), (1.0, 0.0, 0.0))
"""For points in a triad (e, t, z): e upwards, t to the left, z towards the reader."""
ALONG_T = View((0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
"""For points in a triad (e, t, z): e upwards, z to the right, t towards the reader."""


def bar(a: Array, b: Array, width: float) -> Array:
    """Corners (4, 2) of a bar of some width whose axis runs from `a` to `b` on the drawing."""
    along = np.asarray(b, float) - a
    across = 0.5 * width * np.array([-along[1], along[0]]) / np.hypot(*along)
    return np.array([a + across, b + across, b - across, a - across])


def around(centre: Array, e: Array, length: float, diameter: float) -> Array:
    """Corners (4, 2) of a cylinder on the drawing: its middle, its axis as a unit vector, length and diameter."""
    return bar(centre - 0.5 * length * e, centre + 0.5 * length * e, diameter)


def walls(centre: Array, e: Array, length: float, diameter: float, wall: float) -> tuple[Array, Array]:
    """Section through a hole: corners (4, 2) of the wall on either side of its axis, which is a unit vector."""
    across = 0.5 * (diameter + wall) * np.array([-e[1], e[0]])
    left, right = (around(centre + side * across, e, length, wall) for side in (1.0, -1.0))
    return left, right


def circle(centre: Array, radius: float) -> Array:
    """Points (n, 2) of a circle."""
    angle = np.linspace(0.0, 2.0 * np.pi, 97)[:-1]
    return np.asarray(centre) + radius * np.column_stack([np.cos(angle), np.sin(angle)])


def round_number(x: float) -> float:
    """Largest of 1, 2, 5, 10, 20, ... and of 0.5, 0.2, ... that is not above x."""
    power = 10.0 ** np.floor(np.log10(x))
    return float(max(step * power for step in (1.0, 2.0, 5.0) if step * power <= x * (1.0 + 1e-9)))
