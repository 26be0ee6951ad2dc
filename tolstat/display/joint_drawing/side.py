"""Side view: both shafts and the misalignment between them, at the input angle 0."""

from __future__ import annotations

from collections.abc import Container
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Arc

from tolstat.display.joint_drawing import ink
from tolstat.display.joint_drawing.front import HATCH
from tolstat.display.joint_drawing.geometry import SIDE, Array, Dimensions, around, bar, circle
from tolstat.display.style import INK


def draw(ax: Axes, d: Dimensions, marked: Container[str] = ()) -> None:
    """Draw input fork and pins 3 and 4 in section, output fork with pin 1 from outside, fork bushings, α, ω and T_r.

    Parameters are those of `front.draw`.
    """
    sizes = _sizes(d)
    _input_fork(ax, d, sizes, marked)
    _cross(ax, d, marked)
    along = SIDE.of(d.triads[7, 2])
    _output_fork(ax, d, sizes, along, marked)
    reach = sizes.end + 0.12 * d.R
    ink.axis(ax, np.array([-reach, 0.0]), np.array([reach, 0.0]))
    ink.axis(ax, -0.8 * d.R * along, reach * along, zorder=4)
    ink.axis(ax, np.array([0.0, -d.end - 0.1 * d.R]), np.array([0.0, d.end + 0.1 * d.R]))
    _angle(ax, d, along, reach)
    place = sizes.end - 0.12 * d.R
    _turning(ax, np.array([-place, 0.0]), np.array([1.0, 0.0]), sizes.shaft, "ω", "side.omega", -1.0)
    _turning(ax, (place + 0.1 * d.R) * along, along, sizes.shaft, "T_r", "side.torque", 1.0)  # clears the name
    _names(ax, d, marked, sizes.yoke, sizes.shaft)
    width, height = sizes.end + 0.2 * d.R, d.end + 0.56 * d.R
    ink.frame(ax, (-width, -height), (width, height))


class _Sizes(NamedTuple):
    """Sketched sizes: radius of a shaft; distance along it to a yoke, to the end of the yoke, of the drawn shaft."""

    shaft: float
    yoke: float
    bridge: float
    end: float


def _sizes(d: Dimensions) -> _Sizes:
    yoke = max(d.l_f, d.eye) + 0.1 * d.R
    return _Sizes(0.26 * d.R, yoke, yoke + 0.2 * d.R, yoke + 0.95 * d.R)


def _input_fork(ax: Axes, d: Dimensions, sizes: _Sizes, marked: Container[str]) -> None:
    """Input fork in section through its two arms; the walls of its holes are hatched."""
    eye, hole = -d.eye, -0.5 * d.hole
    inner, outer = d.R - 0.5 * d.arm[1], d.R + 0.5 * d.arm[1]
    low, high = d.R - 0.5 * d.z, d.R + 0.5 * d.z
    back = -sizes.bridge
    upper = [(-sizes.end, sizes.shaft), (back, sizes.shaft), (back, outer), (eye, outer), (eye, high), (hole, high)]
    upper += [(hole, low), (eye, low), (eye, inner), (-sizes.yoke, inner)]
    whole = np.array(upper + [(z, -x) for z, x in reversed(upper)])
    edge = ink.OUTLINED if "input" in marked else {}
    ink.part(ax, whole, ink.INPUT, "side.input_fork", zorder=1, **edge)
    for k in (0, 1):
        e = SIDE.of(d.triads[4 + k, 0])
        for i, sign in enumerate((-1.0, 1.0), 1):
            middle = SIDE.of(d.centres[4 + k]) + sign * np.array([0.5 * (d.eye + 0.5 * d.hole), 0.0])
            wall = around(middle, e, d.z, d.eye - 0.5 * d.hole)
            ink.part(ax, wall, ink.INPUT, f"side.arm{k + 1}.{i}", hatch=HATCH, zorder=1.1)


def _cross(ax: Axes, d: Dimensions, marked: Container[str]) -> None:
    for k in (2, 3):
        e = SIDE.of(d.triads[k, 0])
        if d.root < d.R - 0.5 * d.z:
            ink.part(ax, bar(d.root * e, (d.R - 0.5 * d.z) * e, d.neck), ink.CROSS, zorder=2)
        edge = ink.OUTLINED if f"pin{k + 1}" in marked else {}
        ink.part(ax, around(SIDE.of(d.centres[k]), e, d.z, d.pin), ink.CROSS, f"side.pin{k + 1}", zorder=2.1, **edge)
    h = d.root
    ink.part(ax, np.array([(-h, -h), (h, -h), (h, h), (-h, h)]), ink.CROSS, "side.hub", zorder=2)


def _output_fork(ax: Axes, d: Dimensions, sizes: _Sizes, along: Array, marked: Container[str]) -> None:
    """Arm 4, which is in front, around pin 1; arm 3 is hidden behind it."""
    beam, centre = min(d.arm[0], 2.0 * d.eye), SIDE.of(d.centres[7])
    shaft, yoke, bridge, end = sizes
    for begin, stop, width in ((0.0, yoke, beam), (bridge, end, 2.0 * shaft), (yoke, bridge, max(beam, 2.4 * shaft))):
        edge = ink.OUTLINED if "output" in marked and stop == end else {}
        ink.part(ax, bar(centre + begin * along, centre + stop * along, width), ink.OUTPUT, zorder=3, **edge)
    ink.part(ax, circle(centre, d.eye), ink.OUTPUT, "side.arm4", zorder=3.1)
    ink.part(ax, circle(centre, 0.5 * d.hole), "white", "side.hole4", zorder=3.2, linewidth=ink.THIN)
    edge = ink.OUTLINED if "pin1" in marked else {"linewidth": ink.THIN}
    ink.part(ax, circle(SIDE.of(d.centres[0]), 0.5 * d.pin), ink.CROSS, "side.pin1", zorder=3.3, **edge)


def _angle(ax: Axes, d: Dimensions, along: Array, reach: float) -> None:
    """Arc of the misalignment, from the input to the output axis, with its value."""
    degrees = float(np.degrees(np.arctan2(along[1], along[0])))
    said = f"α = {np.degrees(d.alpha):.4g}°".replace("-", "−")
    if abs(degrees) > 0.5:
        size = 2.0 * (reach - 0.02 * d.R)
        ends = sorted((0.0, degrees))
        ax.add_patch(
            Arc((0.0, 0.0), size, size, theta1=ends[0], theta2=ends[1], lw=ink.THIN, color=INK, gid="side.alpha")
        )
    covered = 1.45 * _sizes(d).shaft - (reach - 0.5 * d.R) * np.tan(np.radians(abs(degrees)))
    below = -np.sign(degrees or 1.0) * max(0.13 * d.R, covered)
    ink.label(ax, np.array([reach - 0.02 * d.R, below]), said, ha="right")


def _turning(ax: Axes, at: Array, along: Array, shaft: float, text: str, name: str, sense: float) -> None:
    """Arrow around a shaft, on its near side: `sense` 1 is the way of T_r, -1 that of a positive speed."""
    up = sense * np.array([-along[1], along[0]])
    angle = np.linspace(-0.75 * np.pi / 2, 0.75 * np.pi / 2, 30)
    arc = at + np.outer(np.sin(angle), 1.35 * shaft * up) - np.outer(np.cos(angle), 0.45 * shaft * along)
    ax.plot(arc[:, 0], arc[:, 1], color=INK, lw=ink.THICK, zorder=5)
    ink.arrow(ax, arc[-4], arc[-1], name)
    ink.label(ax, arc[-1] + 0.42 * shaft * up, text, style="italic")


def _names(ax: Axes, d: Dimensions, marked: Container[str], yoke: float, shaft: float) -> None:
    for k in (2, 3):
        ink.inscription(ax, SIDE.of(d.centres[k]), f"pin {k + 1}", f"pin{k + 1}" in marked)
    ink.inscription(ax, np.array([0.0, -0.24 * d.pin]), "pin 1", "pin1" in marked)
    for k in (0, 1):
        e, marker, name = SIDE.of(d.triads[4 + k, 0]), SIDE.of(d.markers[4 + k]), f"fork{k + 1}"
        _called(ax, marker, np.array([marker[0], 0.0]) + (d.end + 0.13 * d.R) * e, name, _look(marked, name), d.R)
        ink.bushing(ax, marker, name, 0.045 * d.R, name in marked)
        ink.label(ax, SIDE.of(d.centres[4 + k]) + np.array([d.eye + 0.06 * d.R, 0.0]), f"arm {k + 1}", ha="left")
        ink.triad(ax, (d.end + 0.15 * d.R) * e, d.triads[4 + k], SIDE, 0.25 * d.R, f"side.arm{k + 1}")
    marker, along = SIDE.of(d.markers[7]), SIDE.of(d.triads[7, 2])
    across = np.array([-along[1], along[0]])
    free = -1.0 if d.alpha >= 0.0 else 1.0  # side of the input axis that the output fork leaves free
    places = [np.array([max(d.eye + 0.16 * d.R, d.root + 0.02 * d.R), free * row * d.R]) for row in (0.53, 0.7)]
    edge = yoke * along + 0.3 * free * min(d.arm[0], 2.0 * d.eye) * across
    _called(ax, edge, places[0], "arm 4, arm 3 behind", {}, d.R)
    _called(ax, marker, places[1], "fork4, fork3 behind", _look(marked, "fork3", "fork4"), d.R)
    ink.bushing(ax, marker, "fork4", 0.045 * d.R, "fork4" in marked or "fork3" in marked)
    small: dict[str, Any] = {"fontsize": ink.SMALL}
    middle, turned = yoke + 0.5 * d.R, float(np.degrees(np.arctan2(along[1], along[0])))
    ink.label(ax, np.array([-middle, -0.5 * shaft]), "input shaft", **(small | _look(marked, "input")))
    below = middle * along - 0.5 * shaft * across
    look = small | _look(marked, "output")
    ink.label(ax, below, "output shaft", rotation=turned, rotation_mode="anchor", **look)


def _look(marked: Container[str], *names: str) -> dict[str, Any]:
    return ink.BOLD if any(name in marked for name in names) else {}


def _called(ax: Axes, point: Array, at: Array, text: str, look: dict[str, Any], scale: float) -> None:
    """Name a point from a distance, with a leader line to it."""
    ink.line(ax, point, at, lw=0.6, zorder=3.9)
    beside = at[0] != point[0]
    side = np.array([1.0, 0.0]) if beside else np.array([0.0, np.sign(at[1] - point[1])])
    va = "center" if beside else "bottom" if side[1] > 0 else "top"
    place = {"ha": "left" if beside else "center", "va": va, "fontsize": ink.SMALL}
    ink.label(ax, at + 0.03 * scale * side, text, **(place | look))
