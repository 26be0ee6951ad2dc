"""Errors of one joint: its four pins in their holes, with errors and clearance enlarged alike, and the numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from tolstat.display.joint_drawing import ink
from tolstat.display.joint_drawing.front import HATCH
from tolstat.display.joint_drawing.geometry import ALONG_T, ALONG_Z, KINDS, Array, Feature, Pair, View, round_number

HEADS = (("e", "µm"), ("t", "µm"), ("z", "µm"), ("tilt t", "deg"), ("tilt z", "deg"), ("⌀", "µm"))
"""Heads of the columns of numbers: names of `KINDS`, and units."""
WAYS = {"along_z": ALONG_Z, "along_t": ALONG_T}
HEAD, FOOT, VIEW = 0.12, 0.1, 0.215
"""Shares of the drawing: height of head and foot, width of a view."""
PLACES = (0.0, 0.24, 0.37, 0.5, 0.675, 0.85, 1.0)
"""Places of names and numbers, relative to the width left for them."""
SIZE = 6.8


def enlargement(pairs: Sequence[Pair], pin: float, z: float) -> float:
    """Factor on errors and clearances with which the largest of them is drawn as a quarter of the pin's size.

    Parameters
    ----------
    pairs : sequence of Pair
        The pins and holes of a joint.
    pin, z : float
        Nominal diameter of the pins, length of the contact, m.
    """
    largest = max(
        max(abs(pair.clearance), *(float(np.abs(_axis(feature, 1.0, z, True)).max()) for feature in pair[1:3]))
        for pair in pairs
    )
    return round_number(0.125 * (pin + z) / largest) if largest > 0.0 else 1.0


def draw(ax: Axes, pairs: Sequence[Pair], pin: float, z: float) -> None:
    """Draw the pins of a joint in their holes, each seen along z and along t, with errors and clearances as numbers.

    Pins and holes stand where their errors have them while cross and forks are in their ideal place. Along a pin, the
    shift of its axis is enlarged: where pin and hole overlap on the drawing, they would do so in this place.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    pairs : sequence of Pair
        Pins 1 to 4 with their holes.
    pin, z : float
        Nominal diameter of the pins, length of the contact, m.
    """
    factor = enlargement(pairs, pin, z)
    ax.axis("off")
    _head(ax.inset_axes((0.0, 1.0 - HEAD, 1.0, HEAD)))
    height = (1.0 - HEAD - FOOT) / len(pairs)
    for i, pair in enumerate(pairs):
        bottom = 1.0 - HEAD - (i + 1) * height
        for k, (way, seen) in enumerate(WAYS.items()):
            _pair(ax.inset_axes((k * VIEW, bottom, VIEW, height)), pair, pin, z, factor, way, seen)
        _numbers(ax.inset_axes((2 * VIEW, bottom, 1.0 - 2 * VIEW, height)), pair)
    foot = ax.inset_axes((0.0, 0.0, 1.0, FOOT))
    _blank(foot)
    said = f"To scale: pin ⌀ {ink.millimetres(pin)}, contact {ink.millimetres(z)} long. "
    said += f"Errors and clearance: × {factor:g}.\n"
    said += "Cross and forks are in their ideal place: at work they give way where pin and hole overlap."
    ink.label(foot, np.array([0.5, 0.5]), said, fontsize=SIZE)


def _blank(ax: Axes) -> None:
    ax.axis("off")
    ax.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))


def _head(ax: Axes) -> None:
    """Axes of both directions of view, and the heads of the columns of numbers."""
    _blank(ax)
    for k, (way, seen) in enumerate(WAYS.items()):
        cell = ax.inset_axes((k * VIEW, 0.0, VIEW, 1.0))
        ink.triad(cell, np.zeros(2), np.eye(3), seen, 1.0, way)
        ink.frame(cell, (-2.2, -0.7), (2.2, 1.5))
    cell = ax.inset_axes((2 * VIEW, 0.0, 1.0 - 2 * VIEW, 1.0))
    _blank(cell)
    for (name, unit), x in zip(HEADS, PLACES[1:], strict=True):
        ink.label(cell, np.array([x, 0.3]), f"{name}\n{unit}", ha="right", fontsize=SIZE)


def _axis(feature: Feature, factor: float, z: float, deviation: bool = False) -> Array:
    """Inner and outer end, (2, 3), of a feature's axis over the contact, with its deviation enlarged, or that alone."""
    ends = np.outer((-0.5 * z, 0.5 * z), (1.0, 0.0, 0.0))
    slope = feature.axis / feature.axis[0] - np.array([1.0, 0.0, 0.0])
    away = factor * (feature.point + np.outer((-0.5 * z, 0.5 * z), slope))
    return np.asarray(away if deviation else ends + away)


def _pair(ax: Axes, pair: Pair, pin: float, z: float, factor: float, way: str, seen: View) -> None:
    """Section through a pin and its hole; half widths are those of the nominal pin and enlarged deviations from it."""
    side = np.array([1.0, 0.0])
    half = 0.5 * pin + 0.5 * factor * (pair.pin.diameter - pin)
    inner, outer = seen.of(_axis(pair.pin, factor, z))
    a, b = seen.of(_axis(pair.hole, factor, z))
    open_half = 0.5 * pin + 0.5 * factor * (pair.hole.diameter - pin)
    wall = 0.08 * (pin + z)
    for i, sign in enumerate((-1.0, 1.0), 1):
        near, far = sign * open_half * side, sign * (open_half + wall) * side
        outline = np.array([a + near, b + near, b + far, a + far])
        ink.part(ax, outline, ink.OUTPUT, f"{pair.names[1]}.{way}.{i}", hatch=HATCH, linewidth=0.9)
    outline = np.array([inner - half * side, outer - half * side, outer + half * side, inner + half * side])
    ink.part(ax, outline, ink.CROSS, f"{pair.names[0]}.{way}", linewidth=0.9, alpha=0.85, zorder=2)
    tall, wide = 0.5 * z + 0.18 * (pin + z), 0.5 * pin + wall + 0.2 * (pin + z)
    ink.axis(ax, np.array([0.0, -tall]), np.array([0.0, tall]))
    ink.frame(ax, (-wide, -tall), (wide, tall))


def _numbers(ax: Axes, pair: Pair) -> None:
    """Names, clearance, and the errors of pin and hole in the units of `HEADS`."""
    _blank(ax)
    said = f"{pair.names[0]} in {pair.names[1]}: clearance {1e6 * pair.clearance:.4g} µm".replace("-", "−")
    ink.label(ax, np.array([0.0, 0.8]), said, ha="left", fontsize=SIZE, fontweight="bold")
    for name, errors, y in zip(pair.names, pair.errors, (0.55, 0.34), strict=True):
        cells = [name, *(_written(kind, errors[kind]) for kind in KINDS)]
        for text, x in zip(cells, PLACES, strict=True):
            ink.label(ax, np.array([x, y]), text, ha="right" if x else "left", fontsize=SIZE)


def _written(kind: str, value: float) -> str:
    if kind.startswith("tilt"):
        number = f"{np.degrees(value):.4f}"
    else:
        number = f"{1e6 * value:.{0 if abs(value) >= 1e-4 else 1}f}"
    return number.replace("-", "−") if float(number) else "0"
