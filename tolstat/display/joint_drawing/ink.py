"""Strokes of the drawings: parts, axes, dimensions, arrows, labels; all named, so that they are found in an SVG."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from tolstat.display.joint_drawing.geometry import Array, View, circle
from tolstat.display.style import INK

CROSS, INPUT, OUTPUT = "#CFE4F3", "#F6DFC6", "#CDEBDD"
"""Tints of cross, input fork and output fork; names stand beside them."""
MARKED = "#C04A00"
BOLD: dict[str, Any] = {"color": MARKED, "fontweight": "bold"}
"""Letters of what is marked."""
OUTLINED: dict[str, Any] = {"edgecolor": MARKED, "linewidth": 2.4}
"""Edge of what is marked."""
MOVED = "#0072B2"
THIN, THICK = 0.8, 1.2
SMALL, PLAIN = 8.5, 9.0
"""Sizes of letters, points."""


def part(ax: Axes, outline: Array, colour: str, name: str = "", **given: Any) -> None:
    """Fill an outline (n, 2) and draw its edge."""
    look: dict[str, Any] = {"facecolor": colour, "edgecolor": INK, "linewidth": THICK, "joinstyle": "round"} | given
    ax.add_patch(Polygon(outline, closed=True, gid=name or None, **look))


def line(ax: Axes, a: Array, b: Array, **given: Any) -> None:
    """Draw a straight line."""
    look: dict[str, Any] = {"color": INK, "lw": THIN, "solid_capstyle": "butt"} | given
    ax.plot([a[0], b[0]], [a[1], b[1]], **look)


def axis(ax: Axes, a: Array, b: Array, **given: Any) -> None:
    """Draw a centre line: long and short dashes."""
    look: dict[str, Any] = {"ls": (0.0, (9.0, 2.5, 2.0, 2.5)), "lw": 0.7, "color": "#666666", "zorder": 2.5} | given
    line(ax, a, b, **look)


def label(ax: Axes, at: Array, text: str, **given: Any) -> None:
    """Write text at a place."""
    look: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": PLAIN, "color": INK, "zorder": 6} | given
    ax.text(at[0], at[1], text, **look)


def inscription(ax: Axes, at: Array, text: str, marked: bool, **given: Any) -> None:
    """Write the name of a pin on it; lines below the letters are covered."""
    own = BOLD if marked else {}
    label(ax, at, text, bbox={"facecolor": CROSS, "edgecolor": "none", "pad": 1.0}, **(own | given))


def arrow(ax: Axes, tail: Array, tip: Array, name: str = "", **given: Any) -> None:
    """Draw an arrow between two places."""
    head: dict[str, Any] = {"arrowstyle": "-|>,head_width=0.18,head_length=0.42", "shrinkA": 0, "shrinkB": 0}
    look = head | {"lw": THICK, "color": INK, "mutation_scale": 10.0} | given
    drawn = ax.annotate("", xy=(tip[0], tip[1]), xytext=(tail[0], tail[1]), arrowprops=look, zorder=5)
    drawn.set_gid(name or None)


def dimension(ax: Axes, a: Array, b: Array, away: Array, text: str, first: float = 0.08) -> None:
    """Draw a dimension between two places, its line shifted by `away`, with the text beyond the line.

    `first` is the share of the way to the line at which the extension line of `a` begins.
    """
    a, b, away = (np.asarray(x, float) for x in (a, b, away))
    for end, begin in ((a, first), (b, 0.08)):
        line(ax, end + begin * away, end + 1.03 * away, lw=0.5, color="#666666")
    both: dict[str, Any] = {"arrowstyle": "<|-|>,head_width=0.12,head_length=0.35", "lw": 0.7}
    arrow(ax, a + away, b + away, **both)
    side = away / np.hypot(*away)
    middle = 0.5 * (a + b) + away
    look: dict[str, Any] = {
        "ha": "center" if abs(side[0]) < 0.5 else "left" if side[0] > 0 else "right",
        "va": "center" if abs(side[1]) < 0.5 else "bottom" if side[1] > 0 else "top",
        "fontsize": SMALL,
        "bbox": {"facecolor": "white", "edgecolor": "none", "pad": 0.6},
    }
    ax.annotate(text, tuple(middle), xytext=tuple(3.0 * side), textcoords="offset points", **look)


def bushing(ax: Axes, at: Array, name: str, size: float, marked: bool) -> None:
    """Draw the marker of a bushing, a quartered circle; a marked one is filled and larger."""
    radius = 1.35 * size if marked else size
    colour = MARKED if marked else INK
    part(ax, circle(at, radius), MARKED if marked else "white", name, edgecolor=colour, zorder=4)
    for way in ((1.0, 0.0), (0.0, 1.0)):
        span = radius * np.array(way)
        line(ax, at - span, at + span, color="white" if marked else INK, zorder=4.1)


def triad(ax: Axes, at: Array, axes: Array, view: View, length: float, name: str, size: float = 10.0) -> None:
    """Draw the axes e, t, z of a part, rows of `axes` (3, 3), from a place on the drawing.

    An axis towards the reader is a circle with a point, one away from the reader a circle with a cross.
    """
    for letter, direction in zip("etz", axes, strict=True):
        way = view.of(direction)
        if np.hypot(*way) > 0.5:
            arrow(ax, at, at + length * way, f"{name}.{letter}", mutation_scale=size)
            label(ax, at + 1.28 * length * way, letter, style="italic")
            continue
        part(ax, circle(at, 0.16 * length), "white", f"{name}.{letter}", linewidth=THIN, zorder=5.5)
        if direction @ view.towards > 0:
            part(ax, circle(at, 0.045 * length), INK, linewidth=0.0, zorder=5.6)
        else:
            for slope in (1.0, -1.0):
                half = 0.11 * length * np.array([1.0, slope])
                line(ax, at - half, at + half, zorder=5.6)
        others = -view.of(axes.sum(axis=0))
        others /= max(np.hypot(*others), 1e-9)
        label(ax, at + 0.42 * length * others, letter, style="italic")


def frame(ax: Axes, low: tuple[float, float], high: tuple[float, float]) -> None:
    """Show a rectangle of the drawing, at equal scales, without axes."""
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    ax.set_anchor("C")
    ax.axis("off")


def millimetres(x: float) -> str:
    """Format a length as drawings do: millimetres without a unit's name at every number."""
    return f"{1e3 * x:.4g} mm"
