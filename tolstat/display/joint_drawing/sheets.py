"""Drawings as panels of the page, and as a figure of their own: the joint, the kinds of errors, errors of one joint.

Coordinates are metres of the joint; gaps and arrows, which do not scale with it, are multiples of `inch`. Parts are
named, so that they are found in an SVG.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import partial
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from tolstat.display import drawing
from tolstat.display.blocks import Panel
from tolstat.display.drawing import WIDTH
from tolstat.display.joint_drawing import geometry
from tolstat.display.joint_drawing.geometry import Array, Dimensions, Feature, Pair, circle, clearance, strip
from tolstat.display.mpl import figure as figures
from tolstat.display.mpl import patches
from tolstat.display.style import COLOURS, INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NOTES = (
    "⊕ bushings: cross1–4 carry the pins, fork1–4 the arms. Their loads, the force F and the bending moment T at the "
    "root of pin or arm, act on the pin or arm; components are along and about its e, t, z.",
    "pin1.contact: force between pin 1 and the hole of arm 4. ⊙ axis towards the reader, ⊗ away from the reader.",
    "Blue: cross; orange: input fork; green: output fork.",
    "Sketched, since the model has no such dimension: walls of the holes, forks, shafts, width of the hub.",
)
"""How to read the drawing of a joint."""
ERRORS = ("Dashed: without error. e points away from the centre of the joint; every pin and hole has its own e, t, z.",)
"""How to read the drawing of the kinds of errors."""
CROSS, INPUT, OUTPUT = "#CFE4F3", "#F6DFC6", "#CDEBDD"
"""Tints of cross, input fork and output fork; names stand beside them."""
MARKED, MOVED, SOFT, HATCH = "#C04A00", COLOURS[0], "#666666", "////"
TINY, SMALL, PLAIN = 6.8, 8.5, 9.0
"""Sizes of letters, points."""
HEADS = ("e\nµm", "t\nµm", "z\nµm", "tilt t\ndeg", "tilt z\ndeg", "⌀\nµm")
COLUMNS = (0.4, 0.79, 1.17, 1.6, 2.02, 2.4)
"""Heads of the numbers of one joint, and their places: inches from the middle of the panel."""
X, Y = np.eye(2)


def joint(d: Dimensions, marked: Collection[str] = ()) -> tuple[Panel, Panel]:
    """Front and side view of a joint with its dimensions; bushings, pins and shafts in `marked` stand out."""
    said = ", ".join(f"pin {k + 1} in the hole of arm {arm + 1}" for k, arm in enumerate(d.arm_of_pin))
    said += "; bushings cross1 to cross4 of the pins, fork1 to fork4 of the arms; "
    said += ", ".join(f"{name} {_millimetres(getattr(d, name))}" for name in ("R", "r_b", "l_f", "pin", "hole", "z"))
    said += f"; misalignment {np.degrees(d.alpha):.4g} degrees."
    said += f" Marked: {', '.join(sorted(marked))}." if marked else ""
    cross, shafts = "The cross, seen from the output shaft", "Both shafts"
    front, side = partial(_front, d=d, marked=marked), partial(_side, d=d, marked=marked)
    return (
        Panel("joint-front", cross, f"{cross}: {said}", front, (WIDTH, 5.3), bare=True),
        Panel("joint-side", shafts, f"{shafts} at the input angle 0: {said}", side, (WIDTH, 4.6), bare=True),
    )


def errors(pairs: Mapping[str, Pair], d: Dimensions) -> Panel:
    """What a positive error of each kind means, from a pin and a hole that both have an error of the kind."""
    said = "; ".join(f"{kind}: {meaning}" for kind, meaning in geometry.MEANINGS.items())
    draw = partial(_kinds, pairs=pairs, d=d)
    return Panel("error-kinds", "What a positive error means", said, draw, (WIDTH, 6.3), bare=True)


def one(pairs: Sequence[Pair], d: Dimensions, title: str, key: str) -> Panel:
    """Errors of one joint, enlarged: pins 1 to 4 in their holes, while cross and forks are in their ideal place.

    Along a pin, the shift of its axis is enlarged: where pin and hole overlap, they would do so in this place. The
    largest error or clearance is drawn as a sixth to a quarter of the pin's size.
    """
    moved = [abs(feature.ends(d.z) - feature.ends(d.z, 0.0)).max() for pair in pairs for feature in pair]
    largest = max(moved + [abs(clearance(pair)) for pair in pairs])
    factor = float(f"{0.08 * (d.pin + d.z) / largest:.0e}") if largest > 0.0 else 1.0
    gaps = ", ".join(f"{pair[0].name} {1e6 * clearance(pair):.4g} µm" for pair in pairs)
    said = f"Pins in their holes, errors and clearance enlarged {factor:g} times. Clearances: {gaps}."
    return Panel(key, title, said, partial(_row, pairs=pairs, d=d, factor=factor), (WIDTH, 4.3), bare=True)


def figure(panels: Sequence[Panel], title: str, notes: Sequence[str] = (), columns: int = 1) -> Figure:
    """Put panels with their titles on one sheet, `columns` side by side, below a headline and above small print."""
    rows = [panels[i : i + columns] for i in range(0, len(panels), columns)]
    head, foot = wrap(title, 44 * columns), [line for note in notes for line in wrap(note, 62 * columns)]
    top, heights = 0.26 + 0.24 * len(head), [max(panel.size[1] for panel in row) + 0.34 for row in rows]
    width, height = columns * WIDTH, top + sum(heights) + (0.2 * len(foot) + 0.2 if foot else 0.0)
    with drawing.settings():
        sheet = figures.Figure(figsize=(width, height))
        sheet.text(0.2 / width, 1.0 - 0.15 / height, "\n".join(head), fontsize=12.5, fontweight="bold", va="top")
        for row, room in zip(rows, heights, strict=True):
            for k, panel in enumerate(row):
                sheet.text((k * WIDTH + 0.2) / width, 1.0 - (top + 0.08) / height, panel.title, fontsize=10, va="top")
                low = 1.0 - (top + 0.34 + panel.size[1]) / height
                panel.draw(sheet.add_axes((k / columns, low, 1.0 / columns, panel.size[1] / height)))
            top += room
        sheet.text(0.2 / width, 1.0 - (top + 0.1) / height, "\n".join(foot), fontsize=8.8, va="top", linespacing=1.5)
    return sheet


def _front(ax: Axes, d: Dimensions, marked: Collection[str]) -> None:
    """Section through the cross: pins in the holes of the arms, cross bushings, axes e, t, z."""
    inch = d.end / 1.75
    _frame(ax, inch, -2.9, 2.4)
    _pins(ax, d, range(4), geometry.FRONT, marked, inch)
    _axis(ax, -(d.end + 0.14 * inch) * X, (d.end + 0.14 * inch) * X)
    away = 0.17 * np.sign(0.62 * inch - d.r_b) * inch / d.r_b
    for k, marker in enumerate(d.markers[:4] @ geometry.FRONT.T):
        _bushing(ax, marker, f"cross{k + 1}", marked)
        _label(ax, (1.0 + away) * marker, f"cross{k + 1}", marked, CROSS, rotation=90 * (k > 1), fontsize=SMALL)
    radius = min(0.3 * inch, 0.8 * d.r_b)
    _turning(ax, 0.0 * X, -radius * Y, radius * X, "ω", "front.omega")
    for name, x, y, level in (("r_b", d.r_b, 0.1 * inch, 0.76), ("R", d.R, d.eye + 0.04 * inch, 0.98)):
        a, b, line = np.array([-x, -y]), -(d.end + 0.62 * inch) * Y, -(d.end + level * inch)
        _dimension(ax, a, b, (line + y) * Y, f" {name} = {_millimetres(x)}", "left")
    corner = np.array([-d.eye - 0.04 * inch, d.end])
    _dimension(ax, corner, corner - d.z * Y, -0.25 * inch * X, f"z = {_millimetres(d.z)} ", "right")
    foot, gap = np.array([0.7 * inch, d.end + 0.12 * inch]), 0.5 * (d.hole - d.pin)
    _line(ax, np.array([0.5 * d.pin + 0.5 * gap, d.R + 0.3 * d.z]), foot)
    said = f"pin ⌀ {_millimetres(d.pin)}\nhole ⌀ {_millimetres(d.hole)}\nradial clearance {_millimetres(gap)}"
    _label(ax, foot, said, ha="left", va="bottom", fontsize=SMALL)


def _pins(ax: Axes, d: Dimensions, pins: Sequence[int], view: Array, marked: Collection[str], inch: float) -> None:
    """Draw the hub, and pins in section with their holes, names and axes."""
    _part(ax, strip(-d.root * X, d.root * X, -d.root, d.root), CROSS)
    _axis(ax, -(d.end + 0.14 * inch) * Y, (d.end + 0.14 * inch) * Y)
    for k in pins:
        e, arm, name = view @ d.triads[k, 0], d.arm_of_pin[k], f"pin{k + 1}"
        colour, key = INPUT if arm < 2 else OUTPUT, "front" if view is geometry.FRONT else "side"
        low, high, upright = (d.R - 0.5 * d.z) * e, d.end * e, abs(e[1]) > 0.5
        _part(ax, strip(min(d.root, d.R - 0.5 * d.z) * e, low, -0.5 * d.neck, 0.5 * d.neck), CROSS)
        _part(ax, strip(low, high, -0.5 * d.pin, 0.5 * d.pin), CROSS, f"{key}.{name}", name in marked)
        for i, sign in enumerate((-1.0, 1.0), 1):
            wall = strip(low, high, 0.5 * sign * d.hole, sign * d.eye)
            _part(ax, wall, colour, f"{key}.arm{arm + 1}.{i}", hatch=HATCH)
        _label(ax, d.R * e, f"pin {k + 1}", marked, CROSS, rotation=0 if upright else 90)
        beside = (d.eye + 0.06 * inch) * X if upright else (d.eye + 0.1 * inch) * Y
        _label(ax, d.R * e + beside, f"arm {arm + 1}", ha="left" if upright else "center")
        _triad(ax, (d.end + 0.14 * inch) * e, d.triads[k], view, inch, f"{key}.{name}")


def _side(ax: Axes, d: Dimensions, marked: Collection[str]) -> None:
    """Input fork with pins 3 and 4 in section, output fork with pin 1 from outside, fork bushings, α, ω and T_r."""
    shaft, beam, thick = 0.26 * d.R, min(0.5 * d.arm[0], d.eye), 0.5 * d.arm[1]
    yoke = max(d.l_f, d.eye) + 0.1 * d.R
    bridge, end = yoke + 0.2 * d.R, yoke + 0.95 * d.R
    inch = max(end / 2.15, d.end / 1.65)
    _frame(ax, inch, -2.3, 2.3)
    _pins(ax, d, (2, 3), geometry.SIDE, marked, inch)
    along, wide = geometry.SIDE @ d.triads[7, 2], max(beam, 1.2 * shaft)
    turned, free = float(np.degrees(np.arctan2(along[1], along[0]))), -1.0 if d.alpha >= 0.0 else 1.0
    ends = [(d.eye, yoke, side - thick, side + thick) for side in (-d.R, d.R)]
    forks = [*ends, (yoke, bridge, -d.R - thick, d.R + thick)], [(0.0, yoke, -beam, beam), (yoke, bridge, -wide, wide)]
    for way, angle, strips, name, text in (
        (-X, 0.0, forks[0], "input", "ω"),
        (along, turned, forks[1], "output", "T_r"),
    ):
        left, colour = np.array([-way[1], way[0]]), INPUT if name == "input" else OUTPUT
        for begin, stop, low, high in (*strips, (bridge, end, -shaft, shaft)):
            _part(ax, strip(begin * way, stop * way, low, high), colour, marked=name in marked)
        _turning(ax, end * way, -0.45 * shaft * way, 1.3 * shaft * left, text, f"side.{name}")
        _axis(ax, -0.5 * end * way, (end + 0.22 * inch) * way)
        below = -0.5 * shaft * np.sign(left[1]) * left
        _label(ax, (yoke + 0.52 * d.R) * way + below, f"{name} shaft", marked, colour, rotation=angle, fontsize=SMALL)
    for radius, colour, name in (
        (d.eye, OUTPUT, "arm4"),
        (0.5 * d.hole, "white", "hole4"),
        (0.5 * d.pin, CROSS, "pin1"),
    ):
        _part(ax, circle(0.0 * X, radius), colour, f"side.{name}", name in marked)
    _label(ax, -0.24 * d.pin * Y, "pin 1", marked, CROSS)
    _axis(ax, 0.0 * X, (end + 0.22 * inch) * X)
    low = 1.25 * shaft + 0.12 * inch
    near = max(0.12 * inch, low - (end - 0.5 * inch) * np.tan(abs(d.alpha)))
    said = f"α = {np.degrees(d.alpha):.4g}°".replace("-", "−")
    _label(ax, np.array([2.4 * inch, free * near]), said, ha="right")
    size, theta = 2.0 * end + 0.4 * inch, sorted((0.0, turned))
    ax.add_patch(patches.Arc((0.0, 0.0), size, size, theta1=theta[0], theta2=theta[1], lw=0.8, color=INK))
    fork1, fork2, _, fork4 = d.markers[4:] @ geometry.SIDE.T
    rise, beside = (d.end + 0.2 * inch) * Y, max(d.eye + 0.12 * inch, d.root + 0.05 * inch) * X
    for point, place, text, ha in (
        (fork1, fork1 * X + rise, "fork1 ", "right"),
        (fork2, fork2 * X - rise, "fork2 ", "right"),
        (fork4, beside + free * (low + 0.2 * inch) * Y, " fork4, fork3 behind", "left"),
        (d.eye * np.array([0.6, 0.8 * free]), beside + free * (low + 0.37 * inch) * Y, " arm 4, arm 3 behind", "left"),
    ):
        _line(ax, point, place)
        _label(ax, place, text, marked, ha=ha, fontsize=SMALL)
        if "fork" in text:
            _bushing(ax, point, text.split(",")[0].strip(), marked)


def _kinds(ax: Axes, pairs: Mapping[str, Pair], d: Dimensions) -> None:
    """Draw a pin above a hole for each kind of errors: without error, dashed; with it; arrows from one to the other."""
    inch = max(2.0 * d.eye / 0.95, d.z / 0.36)
    _frame(ax, inch, -3.15, 3.15)
    for i, (kind, (pin, hole)) in enumerate(pairs.items()):
        view = geometry.ALONG_T if kind in ("offset_z", "tilt_t") else geometry.ALONG_Z
        at = inch * np.array([(-1.08, 1.38)[i % 2], 1.85 - 2.12 * (i // 2)])
        _label(ax, at + inch * np.array([-0.15, 1.22]), kind, fontsize=SMALL, fontweight="bold")
        _label(ax, at + inch * np.array([-0.15, 1.03]), geometry.MEANINGS[kind], fontsize=SMALL)
        _triad(ax, at - 0.88 * inch * X, np.eye(3), view, inch, kind)
        for name, feature, up in (("pin", pin, 0.42), ("hole", hole, -0.42)):
            middle = at + up * inch * Y
            _label(ax, middle + 0.78 * inch * X, name, ha="left", fontsize=SMALL)
            _moved(ax, feature, Feature(feature.name, getattr(d, name)), d.z, view, middle, f"{kind}.{name}")


def _moved(ax: Axes, feature: Feature, nominal: Feature, z: float, view: Array, middle: Array, name: str) -> None:
    """Draw a pin or hole with its error; without, dashed; and arrows from one to the other."""
    tint, hatch = (CROSS, None) if "pin" in name else (OUTPUT, HATCH)
    moved: dict[str, Any] = {"edgecolor": MOVED, "hatch": hatch}
    dashed: dict[str, Any] = {"edgecolor": SOFT, "linestyle": (0.0, (4.0, 2.0)), "linewidth": 0.9}
    tops, sides = [], []
    for state, own, look in (("moved", feature, moved), ("ideal", nominal, dashed)):
        centre, e = middle + view @ own.point, view @ own.axis
        ends, wall = centre + 0.5 * z * np.array([-e, e]), geometry.WALL * nominal.diameter
        for i, outline in enumerate(_outlines(own, ends, own.diameter, wall), 1):
            _part(ax, outline, tint if own is feature else "none", f"{name}.{state}.{i}", **look)
        tops.append(centre + (0.5 * z + 0.2 * (z + nominal.diameter)) * e)
        sides.append(middle + 0.5 * own.diameter * np.array([-X, X]))
        _axis(ax, 2.0 * centre - tops[-1], tops[-1], color=look["edgecolor"])
    tips, tails = sides if "diameter" in name else np.array(tops)[:, None]
    for i, (tail, tip) in enumerate(zip(tails, tips, strict=True), 1):
        _arrow(ax, tail, tip, f"{name}.arrow.{i}", color=MARKED, lw=1.6, mutation_scale=7.0)


def _row(ax: Axes, pairs: Sequence[Pair], d: Dimensions, factor: float) -> None:
    """Draw the pins of a joint in their holes, each seen along z and along t, with errors and clearances as numbers.

    Half widths are those of the nominal pin and enlarged deviations from it.
    """
    size = d.pin + d.z
    inch = max((0.5 * d.pin + 0.3 * size) / 0.5, (0.5 * d.z + 0.18 * size) / 0.38)
    _frame(ax, inch, -2.15, 2.15)
    for way, view, x in (("along_z", geometry.ALONG_Z, -1.85), ("along_t", geometry.ALONG_T, -0.78)):
        _triad(ax, inch * np.array([x, 1.72]), np.eye(3), view, inch, way)
        for i, (pin, hole) in enumerate(pairs):
            at = inch * np.array([x, 1.05 - 0.8 * i])
            for own, colour, look in ((hole, OUTPUT, {"hatch": HATCH}), (pin, CROSS, {"alpha": 0.85})):
                width, ends = d.pin + factor * (own.diameter - d.pin), at + own.ends(d.z, factor) @ view.T
                for k, outline in enumerate(_outlines(own, ends, width, 0.08 * size, X), 1):
                    _part(ax, outline, colour, f"{own.name}.{way}.{k}", **look)
            _axis(ax, at - 0.36 * inch * Y, at + 0.36 * inch * Y)
    for i, (pin, hole) in enumerate(pairs):
        at = inch * np.array([-0.25, 1.0 - 0.8 * i])
        said = f"{pin.name} in {hole.name}: clearance {1e6 * clearance((pin, hole)):.4g} µm".replace("-", "−")
        _label(ax, at + 0.27 * inch * Y, said, ha="left", fontsize=TINY, fontweight="bold")
        _label(ax, at, f"{pin.name}\n{hole.name}", ha="left", fontsize=TINY)
        for kind, column in zip(geometry.MEANINGS, COLUMNS, strict=True):
            unit, digits = (np.degrees(1.0), 4) if "tilt" in kind else (1e6, 1)
            text = "\n".join(f"{round(unit * own.errors[kind], digits):.4g}" for own in (pin, hole)).replace("-", "−")
            _label(ax, inch * np.array([column, 1.0 - 0.8 * i]), text, ha="right", fontsize=TINY)
    for head, column in zip(HEADS, COLUMNS, strict=True):
        _label(ax, inch * np.array([column, 1.72]), head, ha="right", fontsize=TINY)
    foot = (
        f"To scale: pin ⌀ {_millimetres(d.pin)}, contact {_millimetres(d.z)} long. Errors, clearance: × {factor:g}.\n"
    )
    foot += "Cross and forks are in their ideal place: at work they give way where pin and hole overlap."
    _label(ax, -1.97 * inch * Y, foot, fontsize=TINY)


def _outlines(own: Feature, ends: Array, diameter: float, wall: float, across: Array | None = None) -> list[Array]:
    """Outline of a pin; of a hole those of its wall on either side, of the axis that has these ends on the drawing."""
    half = 0.5 * diameter
    if own.name.startswith("pin"):
        return [strip(ends[0], ends[1], -half, half, across)]
    return [strip(ends[0], ends[1], sign * half, sign * (half + wall), across) for sign in (-1.0, 1.0)]


def _frame(ax: Axes, inch: float, low: float, high: float) -> None:
    """Show a panel's width of the drawing, at equal scales: `inch` metres an inch, heights `low` to `high` inches."""
    ax.set(xlim=(-0.5 * WIDTH * inch, 0.5 * WIDTH * inch), ylim=(low * inch, high * inch), aspect="equal")
    ax.axis("off")


def _part(ax: Axes, outline: Array, facecolor: str, name: str = "", marked: bool = False, **given: Any) -> None:
    """Fill an outline (n, 2) and draw its edge."""
    edge = {"edgecolor": MARKED, "linewidth": 2.4} if marked else {"edgecolor": INK, "linewidth": 1.2}
    look: dict[str, Any] = {"joinstyle": "round", "zorder": 2} | edge | given
    ax.add_patch(patches.Polygon(outline, closed=True, gid=name or None, facecolor=facecolor, **look))


def _line(ax: Axes, a: Array, b: Array, **given: Any) -> None:
    """Draw a straight line."""
    look: dict[str, Any] = {"color": INK, "lw": 0.6, "solid_capstyle": "butt", "zorder": 3.9} | given
    ax.plot([a[0], b[0]], [a[1], b[1]], **look)


def _axis(ax: Axes, a: Array, b: Array, color: str = SOFT) -> None:
    """Draw a centre line: long and short dashes."""
    _line(ax, a, b, ls=(0.0, (9.0, 2.5, 2.0, 2.5)), lw=0.8, color=color, zorder=2.5)


def _label(ax: Axes, at: Array, text: str, marked: Collection[str] = (), on: str = "", **given: Any) -> None:
    """Write text at a place, bold if it names what is marked; on a part of colour `on`, which covers lines below it."""
    look: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": PLAIN, "color": INK, "zorder": 6}
    look |= (
        {"color": MARKED, "fontweight": "bold"} if any(name in text.replace("pin ", "pin") for name in marked) else {}
    )
    look |= {"bbox": {"facecolor": on, "edgecolor": "none", "pad": 1.0}} if on else {}
    ax.text(at[0], at[1], text, **(look | given))


def _arrow(ax: Axes, tail: Array, tip: Array, name: str = "", **given: Any) -> None:
    """Draw an arrow between two places."""
    look: dict[str, Any] = {"arrowstyle": "-|>,head_width=0.18,head_length=0.42", "shrinkA": 0, "shrinkB": 0}
    look |= {"lw": 1.2, "color": INK, "mutation_scale": 10.0} | given
    ax.annotate("", xy=tuple(tip), xytext=tuple(tail), arrowprops=look, zorder=5).set_gid(name or None)


def _turning(ax: Axes, middle: Array, back: Array, up: Array, text: str, name: str) -> None:
    """Draw an arc with an arrow, from `middle` - up over `back` towards `middle` + up, and write `text` at its tip."""
    angle = np.radians(np.linspace(-68.0, 68.0, 30))
    arc = middle + np.outer(np.cos(angle), back) + np.outer(np.sin(angle), up)
    ax.plot(*arc.T, color=INK, lw=1.2, zorder=5)
    _arrow(ax, arc[-4], arc[-1], name)
    _label(ax, arc[-1] + 0.65 * (arc[-1] - arc[-9]), text, style="italic")


def _dimension(ax: Axes, a: Array, b: Array, away: Array, text: str, ha: str) -> None:
    """Draw a dimension of what lies between two places, its line shifted from `a` by `away`, with its text at `b`."""
    foot, tip = a + away, b + (a - b + away) @ away / (away @ away) * away
    _line(ax, a, foot, lw=0.5, color=SOFT)
    _line(ax, b, tip, lw=0.5, color=SOFT)
    _arrow(ax, foot, tip, arrowstyle="<|-|>,head_width=0.12,head_length=0.35", lw=0.7)
    _label(ax, tip, text, ha=ha, fontsize=SMALL)


def _bushing(ax: Axes, at: Array, name: str, marked: Collection[str]) -> None:
    """Draw the marker of a bushing, a quartered circle; a marked one is filled and larger."""
    stands_out = name in marked or (name == "fork4" and "fork3" in marked)
    size, face, edge, cross = (13.0, MARKED, MARKED, "white") if stands_out else (9.5, "white", INK, INK)
    ax.plot(*at, "o", ms=size, mfc=face, mec=edge, mew=1.2, zorder=4, gid=name)
    ax.plot(*at, "+", ms=size, color=cross, mew=0.8, zorder=4.1)


def _triad(ax: Axes, at: Array, axes: Array, view: Array, inch: float, name: str) -> None:
    """Draw the axes e, t, z of a part, rows of `axes` (3, 3), from a place on the drawing.

    An axis towards the reader is a circle with a point, one away from the reader a circle with a cross.
    """
    for letter, direction in zip("etz", axes, strict=True):
        way, away = view @ direction, -view @ axes.sum(axis=0)
        if np.hypot(*way) > 0.5:
            _arrow(ax, at, at + 0.3 * inch * way, f"{name}.{letter}")
            _label(ax, at + 0.38 * inch * way, letter, style="italic")
            continue
        mark, size = (".", 3.0) if np.cross(*view) @ direction > 0.0 else ("x", 4.5)
        ax.plot(*at, "o", ms=7.0, mfc="white", mec=INK, mew=0.8, zorder=5.5)
        ax.plot(*at, mark, ms=size, color=INK, mew=0.8, zorder=5.6)
        _label(ax, at + 0.13 * inch * away / np.hypot(*away), letter, style="italic")


def _millimetres(x: float) -> str:
    """Format a length, four digits."""
    return f"{1e3 * x:.4g} mm"
