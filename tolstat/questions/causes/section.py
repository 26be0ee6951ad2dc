"""Causes on the page: tornado of the indices, contribution against the shaft angle, causes of the tail."""

from __future__ import annotations

from collections.abc import Container
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from tolstat.display import drawing, style, text
from tolstat.display.blocks import Block, Panel, Panels, Section, Table, Text
from tolstat.questions.causes import angles_figure as angles
from tolstat.questions.causes import rendering as words

if TYPE_CHECKING:
    from tolstat.questions.causes.angles import AgainstAngle
    from tolstat.questions.causes.query import Causes

SHOWN = 10


def section(found: tuple[Causes, ...], against: tuple[AgainstAngle, ...], logarithmic: Container[str]) -> Section:
    """Which errors make the leading loads scatter; for `logarithmic` loads, the variance of the logarithm is used."""
    blocks: list[Block] = []
    if found:
        blocks.append(Text(_reading(found, logarithmic)))
        blocks.append(Panels([_tornado_panel(causes, _of(causes.load, logarithmic)) for causes in found]))
    for causes in found:
        rows = words.rows(causes, SHOWN)
        title = f"{_of(causes.load, logarithmic)}: share of the variance, direction, and part in the tail"
        blocks.append(Table(title, rows[0], rows[1:]))
        notes = words.note(causes, causes.load in logarithmic).splitlines()
        blocks += [Text(text.sentence(line), small=True) for line in notes]
    if against:
        pairs = [_angle_panels(angle, _of(angle.load, logarithmic)) for angle in against]
        blocks.append(Panels([panel for pair in pairs for panel in pair]))
        blocks.append(_angle_table(against))
        blocks.append(Text(angles.note(against[0], against[0].load in logarithmic), small=True))
    return Section("causes", "Which errors are the cause", blocks)


def _of(load: str, logarithmic: Container[str]) -> str:
    """Name of the decomposed quantity: the load, or its logarithm for a load with a long tail."""
    return f"log {load}" if load in logarithmic else load


def _reading(found: tuple[Causes, ...], logarithmic: Container[str]) -> str:
    said = "Bars: share of a load's variance that goes when the error is made perfect (first-order index). "
    said += "What they leave of 100 % comes from errors that act together. "
    if any(_telling(causes) for causes in found):
        said += "Grey: all in which the error has a part with others (bounds of the total index). "
    if any(causes.load in logarithmic for causes in found):
        said += "Where a few joints with large loads would make most of the variance, it is that of the logarithm."
    if found[0].table["first_lower"].isna().all():
        said += " No intervals: the samples are not independent."
    return said


def _telling(causes: Causes) -> bool:
    """Whether the bounds of the total indices are narrow enough to be shown: median width below 0.5."""
    part = causes.table.head(SHOWN)
    return bool((part["total_upper"] - part["total_lower"]).median() < 0.5)  # false without bounds (NaN)


def _tornado_panel(causes: Causes, of: str) -> Panel:
    part = causes.table.head(SHOWN)
    top = ", ".join(f"{row['error']} {100 * row['first']:.1f} %" for row in part.head(5).to_dict("records"))
    return Panel(
        f"tornado-{causes.load.replace('.', '-')}",
        f"{of}: share of the variance by error",
        f"Largest first-order indices: {top}; all errors alone {100 * causes.additive:.0f} %",
        partial(_tornado, causes=causes, of=of),
        (4.9, drawing.rows_height(len(part)) + 0.25),
        1.2,
    )


def _tornado(ax: Axes, causes: Causes, of: str) -> None:
    part = causes.table.head(SHOWN)
    place = np.arange(len(part))
    drawing.rows(ax, list(part["error"]))
    first = 100.0 * part["first"].clip(lower=0.0).to_numpy()
    ax.barh(place, first, height=0.5, color=style.COLOURS[0], zorder=2)
    handles: list[Patch | Line2D] = [Patch(color=style.COLOURS[0])]
    labels = ["alone (first order), 95 %"]
    if _telling(causes):
        low, high = (100.0 * part[f"total_{end}"].to_numpy() for end in ("lower", "upper"))
        ax.barh(place, high - low, left=low, height=0.74, color=drawing.GREY, alpha=0.45, zorder=1)
        handles.append(Patch(color=drawing.GREY, alpha=0.45))
        labels.append("in all (bounds of the total index)")
    if part["first_lower"].notna().any():
        low, high = (100.0 * part[f"first_{end}"].to_numpy() for end in ("lower", "upper"))
        ax.hlines(place, low, high, color=style.INK, lw=1.2, zorder=3)
    ax.set_xlim(0.0, None)
    drawing.legend_above(ax, handles, labels)
    ax.set_xlabel(f"share of the variance of {of} [%]")


def _angle_panels(angle: AgainstAngle, of: str) -> list[Panel]:
    key, unit = angle.load.replace(".", "-"), text.UNITS.get(angle.unit, angle.unit)
    middle = angle.spread[1]
    loads = Panel(
        f"angle-{key}",
        f"{angle.load} over the revolution",
        f"Median of the joints between {middle.min():.4g} and {middle.max():.4g} {unit} over the shaft angle; "
        f"95 % of the joints stay below {angle.spread[2].max():.4g} {unit} everywhere",
        partial(angles.loads, angle=angle),
        (4.9, 3.1),
    )
    named = zip(angle.names, angle.overall.estimate, strict=True)
    top = ", ".join(f"{name} {100 * share:.1f} %" for name, share in list(named)[: angles.LINES])
    shares = Panel(
        f"angle-shares-{key}",
        f"{of}: share of the variance against the shaft angle",
        f"Over the whole revolution: {top}",
        partial(angles.shares, angle=angle),
        (4.9, 3.1),
    )
    return [loads, shares]


def _angle_table(found: tuple[AgainstAngle, ...]) -> Table:
    head, rows = ["error"], []
    for angle in found:
        head += [f"{angle.load}, %", "95 % interval"]
    order = dict.fromkeys(name for angle in found for name in angle.names[: angles.LINES])
    for name in order:
        cells = [name]
        for angle in found:
            i = angle.names.index(name)
            estimate, low, high = (100.0 * part[i] for part in angle.overall[:3])
            cells += [f"{estimate:.1f}", "-" if np.isnan(low) else f"{low:.1f} .. {high:.1f}"]
        rows.append(cells)
    everything = [f"{100 * float(np.nansum(angle.overall.estimate)):.0f}" for angle in found]
    rows.append(["all errors alone", *(cell for share in everything for cell in (share, ""))])
    return Table("Share of the variance over the whole revolution, every angle weighted by its variance", head, rows)
