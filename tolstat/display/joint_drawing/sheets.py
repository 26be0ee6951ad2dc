"""Drawings as panels of the page, and as a figure of their own."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import partial
from textwrap import wrap

import numpy as np
from matplotlib.figure import Figure

from tolstat.display import drawing
from tolstat.display.blocks import Panel
from tolstat.display.joint_drawing import detail, error_kinds, front, ink, one_joint, side
from tolstat.display.joint_drawing.geometry import Dimensions, Pair

WIDTH = 4.9
"""Width of a panel, inches."""
NOTES = (
    "⊕ bushings: cross1–4 carry the pins, fork1–4 the arms.",
    "Their loads F and T act on the pin or arm; components are along and about its e, t, z.",
    "pin1.contact: force between pin 1 and the hole of arm 4.",
    "⊙ axis towards the reader, ⊗ away from the reader.",
    "Blue: cross; orange: input fork; green: output fork.",
    "Sketched, since the model has no such dimension: walls of the holes, forks, shafts, width of the hub.",
)
"""How to read the drawing of a joint."""


def joint(d: Dimensions, marked: Collection[str] = ()) -> tuple[Panel, Panel, Panel]:
    """Front view, side view and detail of a joint; bushings, pins and shafts in `marked` stand out."""
    mates = ", ".join(f"pin {k + 1} in the hole of arm {arm + 1}" for k, arm in enumerate(d.arm_of_pin))
    bold = f" Marked: {', '.join(sorted(marked))}." if marked else ""
    lengths = f"R {ink.millimetres(d.R)}, r_b {ink.millimetres(d.r_b)}"
    described = f"Section through the cross, seen from the output shaft: {mates}; bushings cross1 to cross4; {lengths}."
    angle = f"Both shafts at the input angle 0, misalignment {np.degrees(d.alpha):.4g} degrees: input fork with arms 1 "
    angle += f"and 2, output fork with arms 3 and 4, bushings fork1 to fork4.{bold}"
    gap = f"Pin {ink.millimetres(d.pin)}, hole {ink.millimetres(d.hole)}, length of the contact {ink.millimetres(d.z)}"
    return (
        Panel("joint-front", "The cross, seen from the output shaft", described + bold,
              partial(front.draw, d=d, marked=marked), (WIDTH, 4.9), bare=True),
        Panel("joint-side", "Both shafts", angle, partial(side.draw, d=d, marked=marked), (WIDTH, 4.6), bare=True),
        Panel("joint-pin", "A pin in its hole", f"{gap}, clearance {ink.millimetres(d.clearance)}.",
              partial(detail.draw, d=d), (WIDTH, 2.9), bare=True),
    )  # fmt: skip


def errors(pairs: Mapping[str, Pair], d: Dimensions) -> Panel:
    """What a positive error of each kind means; `pairs` as `error_kinds.draw` takes them."""
    said = "; ".join(f"{kind}: {meaning}" for kind, meaning in error_kinds.MEANINGS.items())
    draw = partial(error_kinds.draw, pairs=pairs, nominal=(d.pin, d.hole), z=d.z)
    return Panel("error-kinds", "What a positive error means", said, draw, (WIDTH, 6.6), bare=True)


def one(pairs: Sequence[Pair], d: Dimensions, title: str, key: str) -> Panel:
    """Errors of one joint, enlarged."""
    factor = one_joint.enlargement(pairs, d.pin, d.z)
    gaps = ", ".join(f"{pair.names[0]} {1e6 * pair.clearance:.4g} µm" for pair in pairs)
    said = f"Pins in their holes, errors and clearance enlarged {factor:g} times. Clearances: {gaps}."
    return Panel(key, title, said, partial(one_joint.draw, pairs=pairs, pin=d.pin, z=d.z), (WIDTH, 4.4), bare=True)


def figure(panels: Sequence[Panel], title: str, notes: Sequence[str] = (), columns: int = 2) -> Figure:
    """Put panels on one sheet, with their titles, and notes in the last place.

    Parameters
    ----------
    panels : sequence of Panel
        The drawings, row by row.
    title : str
        Headline.
    notes : sequence of str
        Lines of small print.
    columns : int
        Number of drawings side by side.
    """
    columns = min(columns, len(panels))
    rows = [panels[i : i + columns] for i in range(0, len(panels), columns)]
    beside = bool(notes) and len(rows[-1]) < columns
    lines = [line for note in notes for line in wrap(note, 62 if beside or columns == 1 else 62 * columns)]
    foot = 0.19 * len(lines) + 0.25 if notes else 0.1
    heights = [max(panel.size[1] for panel in row) + 0.34 for row in rows]
    if beside:
        heights[-1] = max(heights[-1], foot)
    head = wrap(title, 44 * columns)
    above = 0.26 + 0.24 * len(head)
    width, height = columns * WIDTH, sum(heights) + above + (0.0 if beside else foot)
    with drawing.settings():
        sheet = Figure(figsize=(width, height))
        sheet.text(0.2 / width, 1.0 - 0.15 / height, "\n".join(head), fontsize=12.5, fontweight="bold", va="top")
        top = height - above
        for row, room in zip(rows, heights, strict=True):
            for k, panel in enumerate(row):
                left = k * WIDTH
                sheet.text((left + 0.2) / width, (top - 0.08) / height, panel.title, fontsize=10, va="top")
                place = (left / width, (top - 0.34 - panel.size[1]) / height)
                panel.draw(sheet.add_axes((*place, WIDTH / width, panel.size[1] / height)))
            if row is rows[-1] and beside:
                _write(sheet, lines, (len(row) * WIDTH + 0.2, top - 0.4))
            top -= room
        if notes and not beside:
            _write(sheet, lines, (0.2, top))
    return sheet


def _write(sheet: Figure, lines: Sequence[str], at: tuple[float, float]) -> None:
    width, height = sheet.get_size_inches()
    sheet.text(at[0] / width, at[1] / height, "\n".join(lines), fontsize=8.8, va="top", linespacing=1.5)
