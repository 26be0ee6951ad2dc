"""Drawings of a Cardan joint from its dimensions: front and side view, the kinds of errors, the errors of one joint.

Coordinates are metres of the joint at the input angle 0, distances of labels points. Parts are named, so that they are
found in an SVG.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from functools import partial
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.cardan import CARDAN, HOLE_OF_PIN
from tolstat.display.answer import Axes, Panel, Rows
from tolstat.display.drawing import WIDTH
from tolstat.display.style import COLOURS, INK, patches
from tolstat.joint import Joint, Operation, bodies, mechanism_of, nominal_errors, perturb, perturbation
from tolstat.joint.contact import Contact
from tolstat.joint.operation import having

Array = NDArray[np.float64]
Place = Array | tuple[float, float]
Look = dict[str, Any]

MEANINGS = {
    "offset_e": "axis moved along e, outwards",
    "offset_t": "axis moved along t",
    "offset_z": "axis moved along z",
    "tilt_t": "axis turned about t",
    "tilt_z": "axis turned about z",
    "diameter": "pin thicker, hole wider",
}
"""Kinds of errors of a pin or hole, and what a positive value does."""
HEADS = ("feature", "e [mm]", "t [mm]", "z [mm]", "tilt t [°]", "tilt z [°]", "⌀ [mm]", "gap [mm]")
FRONT = np.array([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
"""Directions of view are the axes that point to the right and upwards. Ground x and y: from the output side."""
SIDE = np.array([(0.0, 0.0, 1.0), (1.0, 0.0, 0.0)])
"""Ground z, the input shaft, to the right, x upwards: both shafts lie in this plane. In a triad (e, t, z): along t."""
ALONG_Z = np.array([(0.0, -1.0, 0.0), (1.0, 0.0, 0.0)])
"""For points in a triad (e, t, z): e upwards, t to the left, z towards the reader."""
WALL = 0.12
"""Wall around a hole, relative to its diameter: the model has no such dimension, and drawings need one."""
CROSS, INPUT, OUTPUT = "#CFE4F3", "#F6DFC6", "#CDEBDD"
"""Tints of cross, input fork and output fork; names stand beside them."""
MARKED, SOFT, HATCH = "#C04A00", "#666666", "////"
EDGE: Look = {"edgecolor": INK, "linewidth": 1.2, "zorder": 2}
LEADER: Look = {"arrowstyle": "-", "lw": 0.6, "color": INK, "shrinkA": 0, "shrinkB": 0}
ARROW = LEADER | {"arrowstyle": "<|-,head_width=0.18,head_length=0.42", "lw": 1.2}
"""Arrow with its tip at the text."""
BETWEEN = ARROW | {"arrowstyle": "<|-|>,head_width=0.12,head_length=0.35", "lw": 0.7}
ON_CROSS: Look = {"facecolor": CROSS, "edgecolor": "none", "pad": 1.0}
HEIGHT = 1.6
"""Height of a pin in its hole with what is written above it, inches."""
X, Y = np.eye(2)
AT_REST = Operation.model_construct(alpha=0.0, speed=1.0, torque=0.0)


class Feature(NamedTuple):
    """A pin or hole with its errors: diameter, shift of its axis from the ideal middle, direction of the axis.

    Lengths in m; the vectors, shape (3,), are along e, t, z; without errors the axis is (1, 0, 0). `contact` has the
    nominal diameter of the pin, and the length of both.
    """

    name: str
    diameter: float
    point: Array
    axis: Array
    contact: Contact

    def ends(self, factor: float = 1.0) -> Array:
        """Ends of the axis, (2, 3), at -z/2 and z/2 along e, the deviation from the ideal axis enlarged."""
        ideal = np.eye(3)[0]
        along = ideal + factor * (self.axis / self.axis[0] - ideal)
        return np.outer((-0.5 * self.contact.z, 0.5 * self.contact.z), along) + factor * self.point


Pair = tuple[Feature, Feature]
"""A pin and the hole that it turns in."""


Cell = tuple[str, str, Array, dict[str, tuple[Pair, Look]]]
"""Drawing of a pin in its hole: a headline, words, direction of view, pairs by name and how they look."""


def pairs(joint: Joint, operation: Operation, errors: NDArray[np.void]) -> dict[str, list[Pair]]:
    """Pins with the holes that they turn in, by name of the joint; an error of the clearance widens the hole.

    Parameters
    ----------
    joint, operation : Joint, Operation
        What is simulated.
    errors : ndarray, shape (1,), dtype ERROR
        Its errors.
    """
    mechanism, found = mechanism_of(joint, operation), dict[str, list[Pair]]()
    par = perturb(joint, operation, errors)[0]
    for i, pair in enumerate(mechanism.pairs):
        contact = having(pair.pin, joint, operation).contact
        thick = contact.D_P + float(errors[f"{pair.pin}.diameter"][0])
        wide = thick + 2.0 * float(par["clearance"][i])
        both = _feature(errors, pair.pin, thick, contact), _feature(errors, pair.hole, wide, contact)
        found.setdefault(pair.kind.rstrip(".") if mechanism.cardan else "", []).append(both)
    return found


def _feature(errors: NDArray[np.void], name: str, diameter: float, contact: Contact) -> Feature:
    point, axis = perturbation.axis(errors, name, np.eye(3))
    return Feature(name, diameter, point[0], axis[0], contact)


def positive(joint: Joint, kind: str) -> Pair:
    """Pin 1 and hole 4, both with a positive error of one kind, large enough to be drawn as it is."""
    unit, errors = 0.5 * (joint.contact.D_P + joint.contact.z), nominal_errors(1, mechanism_of(joint, AT_REST))
    sizes = {"offset": 0.26 * unit, "tilt": np.radians(15.0), "diameter": 0.4 * unit}
    for name in CARDAN.pairs[0][:2]:
        errors[f"{name}.{kind}"] = sizes[kind.partition("_")[0]]
    return pairs(joint, AT_REST, errors)[""][0]


def numbers(joint: Joint, operation: Operation, errors: NDArray[np.void]) -> Rows:
    """Errors, one row for each pin and hole, with the radial clearance of the pair; parameters as of `pairs`.

    e, t, z: offsets; ⌀: deviation of the diameter. Lengths in mm, tilts in degrees, to four decimals.
    """
    rows = []
    for pin, hole in chain.from_iterable(pairs(joint, operation, errors).values()):
        for name in (pin.name, hole.name):
            sizes = [(np.degrees(1.0) if "tilt" in kind else 1e3) * errors[f"{name}.{kind}"][0] for kind in MEANINGS]
            cells = (round(float(x), 4) for x in (*sizes, 5e2 * (hole.diameter - pin.diameter)))
            rows.append(dict(zip(HEADS, (name, *cells), strict=True)))
    return rows


def views(joint: Joint, alpha: float, marked: Collection[str] = ()) -> tuple[Panel, Panel]:
    """Front and side view of a joint with its dimensions; bushings, pins and shafts in `marked` stand out.

    Parameters
    ----------
    joint : Joint
        The nominal joint.
    alpha : float
        Misalignment, rad.
    marked : collection of str
        Names such as ``"cross1"``, ``"pin3"``, ``"output"``.
    """
    cross, shafts = "The cross, seen from the output shaft", "Both shafts"
    names = ", ".join(f"pin {k + 1} in the hole of arm {hole}" for k, hole in enumerate(HOLE_OF_PIN))
    names += f"; misalignment {np.degrees(alpha):.4g} degrees."
    names += f" Marked: {', '.join(sorted(marked))}." if marked else ""
    front, side = partial(_front, joint=joint, marked=marked), partial(_side, joint=joint, alpha=alpha, marked=marked)
    return (
        Panel("joint-front", cross, f"{cross}: {names}", front, (WIDTH, 5.3), bare=True),
        Panel("joint-side", shafts, f"{shafts} at the input angle 0: {names}", side, (WIDTH, 4.6), bare=True),
    )


def kinds_of_errors(joint: Joint) -> Panel:
    """What a positive error of each kind means, on pin 1 and hole 4."""
    description = "; ".join(f"{kind}: {meaning}" for kind, meaning in MEANINGS.items())
    solid: Look = {"edgecolor": COLOURS[0]}
    dashed: Look = {"edgecolor": SOFT, "linestyle": (0.0, (4.0, 2.0)), "linewidth": 0.9, "facecolor": "none"}
    none = nominal_errors(1, mechanism_of(joint, AT_REST))
    cells, ideal = list[Cell](), pairs(joint, AT_REST, none)[""][0]
    for kind, meaning in MEANINGS.items():
        view = SIDE if kind in ("offset_z", "tilt_t") else ALONG_Z
        both = {f"{kind}.moved": (positive(joint, kind), solid), f"{kind}.ideal": (ideal, dashed | {"hatch": None})}
        cells.append((kind, meaning, view, both))
    draw = partial(_cells, cells=cells, factor=1.0)
    return Panel("error-kinds", "What a positive error means", description, draw, (WIDTH, 3 * HEIGHT), bare=True)


def errors_of(joint: Joint, operation: Operation, errors: NDArray[np.void], title: str, key: str) -> list[Panel]:
    """Drawing of the errors of each joint, see `_errors_of`; parameters as of `pairs`."""
    panels = []
    for name, both in pairs(joint, operation, errors).items():
        of, suffix = (f"{name}: ", f"-{name}") if name else ("", "")
        panels.append(_errors_of(both, f"{of}{title}", f"{key}{suffix}"))
    return panels


def _errors_of(both: Sequence[Pair], title: str, key: str) -> Panel:
    """Errors of one joint, enlarged: pins in their holes, while the members that carry them are in their ideal place.

    Along a pin, the shift of its axis is enlarged: where pin and hole overlap, they would do so in this place. The
    largest error or clearance is drawn as a sixth to a quarter of the pin's size.
    """
    size = max(pin.contact.D_P + pin.contact.z for pin, _ in both)
    moved = [abs(feature.ends() - feature.ends(0.0)).max() for pair in both for feature in pair]
    largest = max(*moved, *(0.5 * abs(hole.diameter - pin.diameter) for pin, hole in both))
    factor = float(f"{0.08 * size / largest:.0e}") if largest > 0.0 else 1.0
    cells: list[Cell] = []
    for pair in both:
        gap = f"gap {5e5 * (pair[1].diameter - pair[0].diameter):.4g} µm, drawn × {factor:g}".replace("-", "−")
        for way, view in (("z", ALONG_Z), ("t", SIDE)):
            head, look = f"{pair[0].name} in {pair[1].name}, along {way}", {"alpha": 0.85}
            cells.append((head, gap, view, {f"along_{way}": (pair, look)}))
    description = f"Pins in their holes, errors and clearance enlarged {factor:g} times."
    draw = partial(_cells, cells=cells, factor=factor)
    return Panel(key, title, description, draw, (WIDTH, len(both) * HEIGHT), bare=True)


def _sketched(joint: Joint) -> tuple[float, float, float]:
    """Distance of the outer end of a pin from O, outer radius of an arm around its hole, half width of the hub, m."""
    R, contact = joint.cross.R, joint.contact
    return R + 0.5 * contact.z, (0.5 + WALL) * max(contact.D_H, contact.D_P), max(R - joint.pin.l, 0.1 * R)


def _front(ax: Axes, joint: Joint, marked: Collection[str]) -> None:
    """Section through the cross: pins in the holes of the arms, cross bushings, axes e, t, z, dimensions."""
    R, r_b, contact, (end, eye, _) = joint.cross.R, joint.cross.r_b, joint.contact, _sketched(joint)
    _frame(ax, 1.4 * end, -1.66 * end, 1.37 * end)
    _pins(ax, joint, range(4), FRONT, "front")
    _centre_line(ax, -1.08 * end * X, 1.08 * end * X)
    for k, e in enumerate(bodies.PIN_TRIADS[:, 0] @ FRONT.T, 1):
        offset = (12.0 if r_b < 0.35 * end else -12.0) * e
        _bushing(ax, r_b * e, f"cross{k}")
        _label(ax, r_b * e, f"cross{k}", offset, rotation=90 * (k > 2), bbox=ON_CROSS)
    left, low, gap = -eye - 0.17 * end, end - contact.z, 0.5 * (contact.D_H - contact.D_P)
    for name, x, line in (("r_b", r_b, -1.43 * end), ("R", R, -1.56 * end)):
        _dimension(ax, (-x, line), (0.0, line), f" {name} = {_millimetres(x)}", "left")
        ax.vlines([-x, 0.0], line, [-eye, -1.35 * end], color=SOFT, lw=0.5)
    _dimension(ax, (left, end), (left, low), f"z = {_millimetres(contact.z)} ", "right")
    ax.hlines([low, end], left, -eye, color=SOFT, lw=0.5)
    sizes = f"pin ⌀ {_millimetres(contact.D_P)}\nhole ⌀ {_millimetres(contact.D_H)}"
    sizes += f"\nradial clearance {_millimetres(gap)}"
    _label(ax, (0.5 * contact.D_P, R), sizes, (8.0, 45.0), ha="left", arrowprops=LEADER)
    _mark(ax, marked)


def _pins(ax: Axes, joint: Joint, pins: Iterable[int], view: Array, key: str) -> None:
    """Draw the hub, and pins in section with their holes, names and axes."""
    contact, (end, eye, root) = joint.contact, _sketched(joint)
    low, pin, hole, neck = end - contact.z, 0.5 * contact.D_P, 0.5 * contact.D_H, 0.5 * min(joint.pin.d, contact.D_P)
    _strip(ax, (-root * X, root * X), (-root, root), CROSS)
    _centre_line(ax, -1.08 * end * Y, 1.08 * end * Y)
    for k in pins:
        e, arm, name = view @ bodies.PIN_TRIADS[k, 0], HOLE_OF_PIN[k] - 1, f"{key}.pin{k + 1}"
        upright, colour = abs(e[1]) > 0.5, INPUT if arm < 2 else OUTPUT
        _strip(ax, (min(root, low) * e, low * e), (-neck, neck), CROSS)
        _strip(ax, (low * e, end * e), (-pin, pin), CROSS, gid=name)
        for i, sign in enumerate((-1.0, 1.0), 1):
            wall = f"{key}.arm{arm + 1}.{i}"
            _strip(ax, (low * e, end * e), (sign * hole, sign * eye), colour, gid=wall, hatch=HATCH)
        middle, beside = joint.cross.R * e, eye * (X if upright else Y)
        _label(ax, middle, f"pin {k + 1}", rotation=90 * (not upright), bbox=ON_CROSS)
        _label(ax, middle + beside, f"arm {arm + 1}", (22.0, 0.0) if upright else (0.0, 7.0))
        _triad(ax, 1.08 * end * e, bodies.PIN_TRIADS[k], view, name)


def _side(ax: Axes, joint: Joint, alpha: float, marked: Collection[str]) -> None:
    """Input fork with pins 3 and 4 in section, output fork with pin 1 from outside, fork bushings, α, ω and T_r."""
    R, l_f, contact, (pin_end, eye, root) = joint.cross.R, joint.arm.l_f, joint.contact, _sketched(joint)
    width, depth = (joint.arm.d or float(np.sqrt(12.0 * J / joint.arm.A)) for J in (joint.arm.Jy, joint.arm.Jx))
    shaft, beam, thick, yoke = 0.26 * R, min(0.5 * width, eye), 0.5 * depth, max(l_f, eye) + 0.1 * R
    bridge, end, wide = yoke + 0.2 * R, yoke + 0.95 * R, max(beam, 1.2 * shaft)
    along, turned, down = np.array([np.cos(alpha), np.sin(alpha)]), float(np.degrees(alpha)), 1.0 - 2.0 * (alpha >= 0.0)
    inch = max(end / 2.15, pin_end / 1.65)
    _frame(ax, 0.5 * WIDTH * inch, -2.3 * inch, 2.3 * inch)
    _pins(ax, joint, (2, 3), SIDE, "side")
    arms = [(eye, yoke, y - thick, y + thick) for y in (-R, R)]
    for way, angle, fork, name, letter, colour in (
        (-X, 0.0, [*arms, (yoke, bridge, -R - thick, R + thick)], "input", "ω", INPUT),
        (along, turned, [(0.0, yoke, -beam, beam), (yoke, bridge, -wide, wide)], "output", "T_r", OUTPUT),
    ):
        for i, (begin, stop, low, high) in enumerate([*fork, (bridge, end, -shaft, shaft)], 1):
            _strip(ax, (begin * way, stop * way), (low, high), colour, gid=f"side.{name}.{i}")
        tail, tip = (end * way + side * 1.3 * shaft * np.array([-way[1], way[0]]) for side in (-1.0, 1.0))
        look = {"textcoords": "data", "arrowprops": ARROW | {"connectionstyle": "arc3,rad=-0.2"}}
        _label(ax, tail, letter, tip, gid=f"turning.{name}", **look)
        _centre_line(ax, -0.5 * end * way, (end + 0.22 * inch) * way)
        _label(ax, (yoke + 0.56 * R) * way, f"{name} shaft", (0.0, -8.0), rotation=angle)
    circles = ((eye, OUTPUT, "arm4"), (0.5 * contact.D_H, "white", "hole4"), (0.5 * contact.D_P, CROSS, "pin1"))
    for radius, colour, name in circles:
        ax.add_patch(patches.Circle((0.0, 0.0), radius, **EDGE, facecolor=colour, gid=f"side.{name}"))
    _label(ax, -0.24 * contact.D_P * Y, "pin 1")
    _centre_line(ax, 0.0 * X, (end + 0.22 * inch) * X)
    beside, rise, low = max(eye, root) + 0.12 * inch, pin_end + 0.2 * inch, 1.25 * shaft + 0.12 * inch
    for at, foot, ha, text in (
        ((-l_f, R), (-l_f, rise), "right", "fork1 "),
        ((-l_f, -R), (-l_f, -rise), "right", "fork2 "),
        (l_f * along, (beside, down * (low + 0.2 * inch)), "left", "fork4, fork3 behind"),
        ((0.6 * eye, 0.8 * down * eye), (beside, down * (low + 0.37 * inch)), "left", "arm 4, arm 3 behind"),
    ):
        _label(ax, at, text, foot, textcoords="data", ha=ha, arrowprops=LEADER | {"relpos": (ha == "right", 0.5)})
        if "fork" in text:
            _bushing(ax, np.asarray(at), text[:5])
    near = max(0.12 * inch, low - (end - 0.5 * inch) * np.tan(abs(alpha)))
    _label(ax, (2.4 * inch, down * near), f"α = {turned:.4g}°".replace("-", "−"), ha="right")
    _mark(ax, marked)


def _mark(ax: Axes, marked: Collection[str]) -> None:
    """Let names and parts that are marked stand out; fork3 is behind fork4."""
    for text in ax.texts:
        if any(name in text.get_text().replace("pin ", "pin") for name in marked):
            text.set(color=MARKED, fontweight="bold")
    parts = {name.replace("fork3", "fork4") for name in marked}
    for artist in (*ax.patches, *ax.lines):
        if not parts.isdisjoint((artist.get_gid() or "").split(".")):
            line = {"markerfacecolor": MARKED, "markersize": 13.0}
            artist.set(**(line if artist in ax.lines else {"edgecolor": MARKED, "linewidth": 2.4}))


def _cells(ax: Axes, cells: Sequence[Cell], factor: float) -> None:
    """Draw pins in their holes, two cells side by side, with the axes e, t, z."""
    every = [feature.contact for *_, drawn in cells for pair, _ in drawn.values() for feature in pair]
    inch = max(max((1.0 + 2.0 * WALL) * contact.D_H / 0.95, contact.z / 0.36) for contact in every)
    _frame(ax, 0.5 * WIDTH * inch, -HEIGHT * (len(cells) // 2) * inch, 0.0)
    for i, (head, words, view, drawn) in enumerate(cells):
        at = inch * np.array([(-0.85, 1.55)[i % 2], -HEIGHT * (i // 2) - 1.0])
        _label(ax, at, head, (-20.0, 55.0), fontweight="bold")
        _label(ax, at, words, (-20.0, 42.0))
        _triad(ax, at - 1.05 * inch * X, np.eye(3), view, f"axes.{i}")
        for name, (pair, look) in drawn.items():
            _pair(ax, pair, at, view, name, factor, **look)


def _pair(ax: Axes, pair: Pair, at: Array, view: Array, name: str, factor: float, **look: Any) -> None:
    """Draw a pin in its hole, middle without errors at a place; deviations from the nominal pin enlarged."""
    D, across = pair[0].contact.D_P, None if factor == 1.0 else X  # enlarged tilts do not change widths
    for feature in reversed(pair):
        ends = at + feature.ends(factor) @ view.T
        half = 0.5 * (D + factor * (feature.diameter - D))
        walls = {".1": (-half, -half - WALL * D), ".2": (half, half + WALL * D)}
        for part, span in ({"": (-half, half)} if feature is pair[0] else walls).items():
            tint = {"hatch": HATCH if part else None, "gid": f"{name}.{feature.name}{part}"}
            _strip(ax, ends, span, OUTPUT if part else CROSS, across, **(tint | look))
    _centre_line(ax, *(ends + 0.6 * (ends - ends[::-1])))


def _frame(ax: Axes, half: float, low: float, high: float) -> None:
    """Show what lies up to `half` beside the middle, and from `low` to `high`, at equal scales."""
    ax.set(xlim=(-half, half), ylim=(low, high), aspect="equal")
    ax.axis("off")


def _strip(ax: Axes, ends: Any, span: tuple[float, float], colour: str, across: Any = None, **look: Any) -> None:
    """Fill a strip along a line, over a span of distances to its left, or along the vector `across`."""
    (a, b), way = ends, ends[1] - ends[0]
    left = np.array([-way[1], way[0]]) / np.hypot(*way) if across is None else across
    outline = [a + span[0] * left, b + span[0] * left, b + span[1] * left, a + span[1] * left]
    ax.add_patch(patches.Polygon(outline, **({"joinstyle": "round", "facecolor": colour} | EDGE | look)))


def _centre_line(ax: Axes, a: Array, b: Array) -> None:
    ax.plot(*np.transpose([a, b]), color=SOFT, lw=0.8, ls=(0.0, (9.0, 2.5, 2.0, 2.5)), zorder=2.5)


def _label(ax: Axes, at: Place, text: str, offset: Place = (0.0, 0.0), **given: Any) -> None:
    """Write text beside a place, at an offset in points; `arrowprops` connect it with the place."""
    look: Look = {"ha": "center", "va": "center", "fontsize": 8.5, "color": INK, "zorder": 6}
    ax.annotate(text, **(look | {"xy": at, "xytext": offset, "textcoords": "offset points"} | given))


def _dimension(ax: Axes, a: Place, b: Place, text: str, ha: str) -> None:
    """Draw a dimension line, with its text at `b`."""
    _label(ax, a, "", b, textcoords="data", arrowprops=BETWEEN)
    _label(ax, b, text, ha=ha)


def _bushing(ax: Axes, at: Array, name: str) -> None:
    """Draw the marker of a bushing, a quartered circle."""
    ax.plot(*at, "o", ms=9.5, mfc="white", mec=INK, mew=1.2, zorder=4, gid=name)
    ax.plot(*at, "+", ms=9.5, color=INK, mew=0.8, zorder=4.1)


def _triad(ax: Axes, at: Array, axes: Array, view: Array, name: str) -> None:
    """Draw the axes e, t, z of a part, rows of `axes` (3, 3), from a place on the drawing.

    An axis towards the reader is a circle with a point, one away from the reader a circle with a cross.
    """
    away = -view @ axes.sum(axis=0)
    for letter, direction in zip("etz", axes, strict=True):
        way = view @ direction
        if np.hypot(*way) > 0.5:
            _label(ax, at, letter, 27.0 * way, gid=f"{name}.{letter}", style="italic", arrowprops=ARROW)
            continue
        mark, size = (".", 3.0) if np.cross(*view) @ direction > 0.0 else ("x", 4.5)
        ax.plot(*at, "o", ms=7.0, mfc="white", mec=INK, mew=0.8, zorder=5.5)
        ax.plot(*at, mark, ms=size, color=INK, mew=0.8, zorder=5.6)
        _label(ax, at, letter, 9.0 * away / np.hypot(*away), style="italic")


def _millimetres(x: float) -> str:
    return f"{1e3 * x:.4g} mm"
