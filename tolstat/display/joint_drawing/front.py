"""Front view: section through the cross, seen along the input shaft from the output side."""

from __future__ import annotations

from collections.abc import Container

import numpy as np
from matplotlib.axes import Axes

from tolstat.display.joint_drawing import ink
from tolstat.display.joint_drawing.geometry import FRONT, Dimensions, around, bar, walls
from tolstat.display.style import INK

HATCH = "////"


def draw(ax: Axes, d: Dimensions, marked: Container[str] = ()) -> None:
    """Draw the cross with its four pins in the holes of the arms, cross bushings and axes e, t, z.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    d : Dimensions
        The joint.
    marked : container of str
        Names of the bushings and pins that stand out.
    """
    for k in range(4):
        _arm(ax, d, k)
    h = d.root
    for k in range(4):
        _pin(ax, d, k, f"pin{k + 1}" in marked)
    ink.part(ax, np.array([(-h, -h), (h, -h), (h, h), (-h, h)]), ink.CROSS, "front.hub", zorder=2)
    reach = d.end + 0.18 * d.R
    for way in np.eye(2):
        ink.axis(ax, -reach * way, reach * way)
    ink.label(ax, np.array([0.6, 0.72]) * h, "hub", fontsize=ink.SMALL)
    _turning(ax, 0.42 * min(h, d.r_b))
    for k in range(4):
        _names(ax, d, k, marked)
    _lengths(ax, d)
    side = d.end + 0.56 * d.R
    ink.frame(ax, (-side, -d.end - 1.1 * d.R), (side, d.end + 0.56 * d.R))


def _arm(ax: Axes, d: Dimensions, k: int) -> None:
    e = FRONT.of(d.triads[4 + k, 0])
    colour = ink.INPUT if k < 2 else ink.OUTPUT
    thick = d.eye - 0.5 * d.hole
    for i, wall in enumerate(walls(FRONT.of(d.centres[4 + k]), e / np.hypot(*e), d.z, d.hole, thick), 1):
        ink.part(ax, wall, colour, f"front.arm{k + 1}.{i}", hatch=HATCH, zorder=1.5)


def _pin(ax: Axes, d: Dimensions, k: int, marked: bool) -> None:
    e = FRONT.of(d.triads[k, 0])
    if d.root < d.R - 0.5 * d.z:
        ink.part(ax, bar(d.root * e, (d.R - 0.5 * d.z) * e, d.neck), ink.CROSS, zorder=2)
    edge = ink.OUTLINED if marked else {}
    ink.part(ax, around(FRONT.of(d.centres[k]), e, d.z, d.pin), ink.CROSS, f"front.pin{k + 1}", zorder=2.1, **edge)


def _turning(ax: Axes, radius: float) -> None:
    """Arrow of a positive input speed."""
    angle = np.radians(np.linspace(200.0, 325.0, 30))
    arc = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    ax.plot(arc[:, 0], arc[:, 1], color=INK, lw=ink.THICK, zorder=5)
    ink.arrow(ax, arc[-3], arc[-1], "front.omega")
    ink.label(ax, radius * np.array([1.15, -1.05]), "ω", style="italic")


def _names(ax: Axes, d: Dimensions, k: int, marked: Container[str]) -> None:
    """Names of pin, arm and cross bushing, and the triad beyond the outer end of the pin."""
    e, t = FRONT.of(d.triads[k, 0]), FRONT.of(d.triads[k, 1])
    arm, place = d.arm_of_pin[k] + 1, FRONT.of(d.centres[k])
    upright = abs(e[1]) > 0.5
    ink.inscription(ax, place, f"pin {k + 1}", f"pin{k + 1}" in marked, rotation=0 if upright else 90)
    ink.triad(ax, (d.end + 0.15 * d.R) * e, d.triads[k], FRONT, 0.25 * d.R, f"front.pin{k + 1}")
    if upright:
        at = place - np.sign(t[0]) * np.array([d.eye + 0.06 * d.R, 0.0])
        if _is_short(d):
            at += max(0.0, _beside(d) + 0.11 * d.R - d.R) * e
        ink.label(ax, at, f"arm {arm}", ha="right" if at[0] < 0 else "left")
    else:
        ink.label(ax, place + np.array([0.0, d.eye + 0.09 * d.R]), f"arm {arm}")
    _bushing(ax, d, k, upright, f"cross{k + 1}" in marked)


def _is_short(d: Dimensions) -> bool:
    """Whether there is no room for a name between hub and arm."""
    return d.R - 0.5 * d.z - max(d.root, d.r_b) < 0.15 * d.R


def _beside(d: Dimensions) -> float:
    """Distance from O of the name of a bushing beside the arm, clear of the hub."""
    return max(d.root, d.r_b) + 0.075 * d.R


def _bushing(ax: Axes, d: Dimensions, k: int, upright: bool, marked: bool) -> None:
    """Marker of a cross bushing, with its name beside the beam of the pin."""
    e, t = FRONT.of(d.triads[k, 0]), FRONT.of(d.triads[k, 1])
    marker = FRONT.of(d.markers[k])
    free = 0.5 * d.neck + 0.07 * d.R if upright else max(0.5 * d.neck, d.root) + 0.03 * d.R
    far = 0.5 * (max(d.root, d.r_b) + d.R - 0.5 * d.z) if upright else max(d.root, d.r_b) + 0.06 * d.R
    if upright and _is_short(d):
        free, far = d.eye + 0.06 * d.R, _beside(d)
    at = far * e - free * t
    ink.line(ax, marker, at, lw=0.6, zorder=3.9)
    ink.bushing(ax, marker, f"cross{k + 1}", 0.045 * d.R, marked)
    ha = "center" if not upright else "left" if at[0] > 0 else "right"
    va = "center" if upright else "bottom" if at[1] > 0 else "top"
    look = ink.BOLD if marked else {}
    ink.label(ax, at - 0.015 * d.R * t, f"cross{k + 1}", ha=ha, va=va, fontsize=ink.SMALL, **look)


def _lengths(ax: Axes, d: Dimensions) -> None:
    """Dimensions R and r_b below the view, along pin 3."""
    e = FRONT.of(d.triads[2, 0])
    for length, name, below in ((d.r_b, "r_b", 0.66), (d.R, "R", 0.92)):
        away = np.array([0.0, -d.end - below * d.R])
        ink.dimension(ax, 0.0 * e, length * e, away, f"{name} = {ink.millimetres(length)}", first=0.97)
