"""What a positive error means: pin and hole as they should be, dashed, and with one error of each kind, exaggerated."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from tolstat.display.joint_drawing import ink
from tolstat.display.joint_drawing.front import HATCH
from tolstat.display.joint_drawing.geometry import ALONG_T, ALONG_Z, WALL, Array, Feature, Pair, View, around, walls

MEANINGS = {
    "offset_e": "axis moved along e, outwards",
    "offset_t": "axis moved along t",
    "offset_z": "axis moved along z",
    "tilt_t": "axis turned about t",
    "tilt_z": "axis turned about z",
    "diameter": "pin thicker, hole wider",
}
"""Kinds of errors, and what a positive value does."""
DASHED: dict[str, Any] = {
    "facecolor": "none",
    "edgecolor": "#666666",
    "linestyle": (0.0, (4.0, 2.0)),
    "linewidth": 0.9,
    "zorder": 3,
}


def view(kind: str) -> View:
    """Direction of view that shows an error of some kind: along t for what happens in the plane of e and z."""
    return ALONG_T if kind in ("offset_z", "tilt_t") else ALONG_Z


def draw(ax: Axes, pairs: Mapping[str, Pair], nominal: tuple[float, float], z: float) -> None:
    """Draw a pin and a hole with a positive error, once for each kind.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    pairs : mapping of str to Pair
        Pin and hole, both with an error of the kind that is the key.
    nominal : tuple of float
        Diameters of pin and hole without error, m.
    z : float
        Length of the contact, m.
    """
    ax.axis("off")
    for i, (kind, pair) in enumerate(pairs.items()):
        _kind(ax.inset_axes((0.5 * (i % 2), 1.0 - (i // 2 + 1) / 3.0, 0.5, 1.0 / 3.0)), kind, pair, nominal, z)


def _kind(ax: Axes, kind: str, pair: Pair, nominal: tuple[float, float], z: float) -> None:
    """Draw the pin above the hole, with the axes beside them and the meaning above."""
    unit = 0.5 * (nominal[0] + z)
    edge, apart = (0.5 + WALL) * nominal[1] + 0.3 * unit, 0.5 * z + 0.62 * unit
    for name, feature, diameter, place in (
        ("pin", pair.pin, nominal[0], apart),
        ("hole", pair.hole, nominal[1], -apart),
    ):
        middle = np.array([0.0, place])
        _feature(ax, kind, name, feature, diameter, z, middle)
        ink.label(ax, middle + np.array([edge + 0.06 * unit, 0.0]), name, ha="left", fontsize=ink.SMALL)
    ink.triad(ax, np.array([-edge - 0.55 * unit, 0.0]), np.eye(3), view(kind), 0.48 * unit, kind, size=7.0)
    tall = apart + 0.5 * z + 0.5 * unit
    for text, y, weight in ((kind, 0.99, "bold"), (MEANINGS[kind], 0.9, "normal")):
        ax.text(0.5, y, text, transform=ax.transAxes, ha="center", va="top", fontsize=ink.SMALL, fontweight=weight)
    ink.frame(ax, (-edge - 1.3 * unit, -tall), (edge + 0.9 * unit, tall + 1.0 * unit))


def _feature(ax: Axes, kind: str, name: str, feature: Feature, diameter: float, z: float, middle: Array) -> None:
    """Draw a feature without error, dashed; with its error; and an arrow from one to the other."""
    seen = view(kind)
    centre, e, up = middle + seen.of(feature.point), seen.of(feature.axis), np.array([0.0, 1.0])
    if name == "pin":
        ink.part(ax, around(centre, e, z, feature.diameter), ink.CROSS, f"{kind}.pin", edgecolor=ink.MOVED)
        ink.part(ax, around(middle, up, z, diameter), "none", **DASHED)
    else:
        wall = WALL * diameter
        for i, side in enumerate(walls(centre, e, z, feature.diameter, wall), 1):
            ink.part(ax, side, ink.OUTPUT, f"{kind}.hole.{i}", hatch=HATCH, edgecolor=ink.MOVED)
        for side in walls(middle, up, z, diameter, wall):
            ink.part(ax, side, "none", **DASHED)
    reach = 0.5 * z + 0.22 * (diameter + z)
    ink.axis(ax, middle - reach * up, middle + reach * up)
    ink.axis(ax, centre - reach * e, centre + reach * e, color=ink.MOVED, lw=1.0)
    look: dict[str, Any] = {"color": ink.MARKED, "lw": 1.6, "mutation_scale": 7.0}
    if kind == "diameter":
        edge = np.array([0.5 * diameter, 0.0])
        more = np.array([0.5 * (feature.diameter - diameter), 0.0])
        for i, sign in enumerate((-1.0, 1.0), 1):
            ink.arrow(ax, middle + sign * edge, middle + sign * (edge + more), f"{kind}.{name}.arrow.{i}", **look)
    elif kind.startswith("tilt"):
        ink.arrow(ax, middle + reach * up, middle + reach * e, f"{kind}.{name}.arrow", **look)
    else:
        ink.arrow(ax, middle, centre, f"{kind}.{name}.arrow", **look)
