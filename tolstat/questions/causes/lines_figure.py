"""Pictures of the share above a limit with one line of the drawing changed: tornado, and curves against the width."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from tolstat.display import drawing, style, text
from tolstat.display.blocks import Panel
from tolstat.display.mpl import lines, markers, patches
from tolstat.display.table import Row
from tolstat.questions.causes.lines_shares import Lines
from tolstat.study.widths import COARSER, EXACT, HALF

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

CURVES = 4
"""Number of lines whose curve has a colour; the others are grey."""
_ACCEPTED: dict[str, Any] = {"color": style.COLOURS[2], "lw": 1.4, "ls": (0.0, (6.0, 2.0))}
"""Style of the accepted share."""
_STEPS = ("half as wide", "one step coarser", "another fit", "exact")
"""Legend of the tornado."""
_BARS = ((COARSER, style.COLOURS[1], 0.3, -0.1), (HALF, style.COLOURS[0], 0.56, 0.1))
"""Bars of the tornado: step, colour, height, and how far above the middle of the bar its whisker is."""
_FIT = style.COLOURS[3]
"""Colour of another fit."""
_EXACT: dict[str, Any] = {"ls": "", "mfc": "white", "mec": style.INK, "ms": 5.5}
"""Style of the mark of an exact line."""


def tornado(found: Lines, accepted: float) -> Panel:
    """Share above the level with each line half as wide, exact, and coarser; and with each other fit."""
    halves = "; ".join(f"{row['line']} {text.percent(row.get(HALF, np.nan))}" for row in found.by_line)
    others = "; ".join(f"{row['step']} {text.percent(row['share'])}" for row in found.other_fits)
    halves = ". ".join(words for words in (f"Half as wide: {halves}" if halves else "", others) if words)
    labels = [f"{row['line']}\n{row['size']}" if row["size"] else str(row["line"]) for row in found.by_line]
    labels += [f"{row['step']}\nin place of {row['size']}" for row in found.other_fits]
    left = drawing.rows_left([part for label in labels for part in label.split("\n")])
    top = drawing.legend_room(list(_legend(found)), left)
    return Panel(
        f"lines-{found.facts['load']}",
        f"Share of the joints with {found.event}, if one line is changed",
        f"As drawn {text.percent(found.facts['share'])}. {halves}",
        partial(_tornado, found=found, labels=labels, accepted=accepted),
        (drawing.WIDTH, 0.34 * (len(labels) + 2.2) + drawing.BOTTOM + top),
        left,
        top,
    )


def curves(found: Lines, accepted: float) -> list[Panel]:
    """Share above the level against the width of each line; none without a line whose width is changed."""
    by_line: dict[str, list[Row]] = {}
    for row in found.rows:
        if np.isfinite(row["factor"]):
            by_line.setdefault(row["line"], []).append(row)
    if not by_line:
        return []
    words = {
        line: ", ".join(f"{row['factor']:.3g} {text.percent(row['share'])}" for row in rows)
        for line, rows in by_line.items()
    }
    labels = [*list(by_line)[:CURVES], *(["the other lines"] if len(by_line) > CURVES else [])]
    labels += [f"accepted {text.percent(accepted)}"] if accepted > 0.0 else []
    panel = Panel(
        f"widths-{found.facts['load']}",
        "The share against the width of each line",
        "; ".join(f"{line}: {own}" for line, own in words.items()),
        partial(_curves, found=found, by_line=by_line, labels=labels, accepted=accepted),
        (drawing.WIDTH, 3.4 + (room := drawing.legend_room(labels))),
        top=room,
    )
    return [panel]


def _tornado(ax: Axes, found: Lines, labels: list[str], accepted: float) -> None:
    drawing.rows(ax, labels)
    ax.set_ylim(len(labels) + 0.6, -1.2)  # a row above and one below, for what the vertical lines are
    ax.tick_params(axis="y", labelsize=7.6)
    floor, drawn, lower, upper = _floor(found, accepted), *(found.facts[name] for name in ("share", "lower", "upper"))
    style.share_axis(ax, floor, "x")
    ax.set_xlim(floor, min(1.0, 1.4 * float(np.nanmax([upper, *(row["share_upper"] for row in found.rows)]))))
    ax.axvspan(max(lower, floor), upper, color=drawing.GREY, alpha=0.3, lw=0)
    ax.axvline(drawn, color=style.INK, lw=1.2)
    for place, row in enumerate(found.by_line):
        for step, colour, height, above in _BARS:
            if step in row:
                ax.barh(place, max(row[step], floor) - drawn, height, left=drawn, color=colour, zorder=2)
                _whisker(ax, place - above, row[f"{step}_lower"], row[f"{step}_upper"], floor)
        if EXACT in row:
            marker = "o" if row[EXACT] >= floor else markers.CARETLEFT
            ax.plot(max(row[EXACT], floor), place, marker=marker, zorder=4, clip_on=False, **_EXACT)
    for place, row in enumerate(found.other_fits, start=len(found.by_line)):
        ax.barh(place, max(row["share"], floor) - drawn, 0.4, left=drawn, color=_FIT, zorder=2)
        _whisker(ax, place, row["share_lower"], row["share_upper"], floor)
    words: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 8.0, "backgroundcolor": "white"}
    ax.text(drawn, -0.9, f"as drawn {text.percent(drawn)}", **words)
    if accepted > 0.0:
        ax.axvline(accepted, **_ACCEPTED)
        ax.text(accepted, len(labels) + 0.1, f"accepted {text.percent(accepted)}", **words)
    legend = _legend(found)
    drawing.legend_above(ax, list(legend.values()), list(legend))
    ax.set_xlabel(f"share of the joints above {found.limit}")


def _legend(found: Lines) -> dict[str, Artist]:
    """Legend of the tornado: what is in it, by label."""
    handles: list[Artist] = [patches.Patch(color=colour) for colour in (style.COLOURS[0], style.COLOURS[1], _FIT)]
    legend = dict(zip(_STEPS, [*handles, lines.Line2D([], [], marker="o", **_EXACT)], strict=True))
    fits, widths = bool(found.other_fits), bool(found.by_line)
    return {label: handle for label, handle in legend.items() if (fits if label == _STEPS[2] else widths)}


def _whisker(ax: Axes, y: float, low: float, high: float, floor: float) -> None:
    """Draw an interval; an arrow at the left edge stands for an end that is smaller than what the axis shows."""
    ax.plot([max(low, floor), max(high, floor)], [y, y], color=style.INK, lw=1.2, zorder=3)
    if low < floor:
        ax.plot(floor, y, marker=markers.CARETLEFT, color=style.INK, ms=5.0, zorder=4, clip_on=False)


def _curves(ax: Axes, found: Lines, by_line: dict[str, list[Row]], labels: list[str], accepted: float) -> None:
    floor = _floor(found, accepted)
    style.share_axis(ax, floor)
    top = floor
    handles: list[Artist] = []
    facts = found.facts
    drawn = {"factor": 1.0, "share": facts["share"], "share_lower": facts["lower"], "share_upper": facts["upper"]}
    for place, rows in enumerate(by_line.values()):
        own = sorted([*rows, drawn], key=lambda row: row["factor"])
        x, y, low, high = (np.array([row[name] for row in own]) for name in drawn)
        top, grey = max(top, float(y.max())), place >= CURVES
        colour = drawing.GREY if grey else style.COLOURS[place]
        dash = "-" if grey else style.DASHES[place]
        (curve,) = ax.plot(x, np.maximum(y, floor), color=colour, ls=dash, marker="o", ms=3.0, lw=1.0 if grey else 1.6)
        at_edge = np.full(int((y < floor).sum()), floor)
        ax.plot(x[y < floor], at_edge, marker=markers.CARETDOWN, ls="", color=colour, ms=5.0, clip_on=False)
        handles += [curve] if place <= CURVES else []
        if place == 0:
            ax.fill_between(x, np.maximum(low, floor), np.maximum(high, floor), color=colour, alpha=0.18, lw=0)
    ax.plot(1.0, facts["share"], "D", color=style.INK, ms=6.0, zorder=5)
    ax.set_ylim(floor, min(1.0, 2.0 * top))
    if accepted > 0.0:
        handles.append(ax.axhline(accepted, **_ACCEPTED))
    ax.set(xlabel="width of the line, relative to the drawing", ylabel=f"share above {found.limit}")
    drawing.legend_above(ax, handles, labels)


def _floor(found: Lines, accepted: float) -> float:
    """Lower end of an axis of shares: below all shares that are not zero, and below the accepted share."""
    least = [value for value in [*(row["share"] for row in found.rows), found.facts["share"], accepted] if value > 0.0]
    return float(0.6 * max(min(least, default=1.0), 0.5 / max(found.facts["n"], 1)))
