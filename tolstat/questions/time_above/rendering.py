"""Time above levels within a revolution: table, CSV and picture."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from tolstat.common.loads import unit_text
from tolstat.display import style
from tolstat.display.table import Column, Row
from tolstat.display.text import csv, limit

if TYPE_CHECKING:
    import pandas as pd

    from tolstat.questions.time_above.query import TimeAbove

MAX_LOADS = 4
"""Maximum number of loads in the picture."""
_LINES = {
    "time": "mean joint",
    "time_50": "median joint",
    "time_90": "90 % of the joints below",
    "time_99": "99 % below",
}


def _share(name: str) -> Callable[[Row], str]:
    def cell(row: Row) -> str:
        own, low, high = (100.0 * row[name + end] for end in ("", "_lower", "_upper"))
        return f"{own:.3g} %" if math.isnan(low) else f"{own:.3g} ({low:.3g} .. {high:.3g}) %"

    return cell


LEVELS = (
    Column("load > level", limit),
    Column("joints above", _share("joints_above")),
    Column("mean time above", _share("time")),
    Column("median", _share("time_50"), rank=3),
    Column("90 % below", _share("time_90"), rank=2),
    Column("99 % below", _share("time_99"), rank=1),
)
"""Columns of the table `TimeAbove.table`; shares in per cent."""


def note(found: TimeAbove) -> str:
    """Notes to the table: number of joints, restrictions."""
    counts = f"{found.joints} joints, {found.left_out} without a settled revolution left out"
    lines = [f"{counts}; time: share of a revolution"]
    if found.table["time_lower"].isna().all():
        lines.append("no intervals: they hold for independent samples only")
    return "\n".join(lines)


def write(found: TimeAbove, stem: Path) -> list[Path]:
    """Write ``STEM_time_above.csv``, ``.png`` and ``.svg``.

    Parameters
    ----------
    found : TimeAbove
        Result with curves.
    stem : Path
        Folder, and beginning of all file names.

    Returns
    -------
    list of Path
        The files.
    """
    files = [csv(found.curves, stem, "time_above")]
    return files + style.save(figure(found), stem.with_name(f"{stem.name}_time_above"))


def figure(found: TimeAbove) -> Figure:
    """Draw the curves of at most `MAX_LOADS` loads: share of the joints (upper row), of the revolution (lower)."""
    loads = list(dict.fromkeys(found.curves["load"]))[:MAX_LOADS]
    with style.settings():
        page = Figure(figsize=(max(4.2 * len(loads), 6.5), 6.6))
        axes = page.subplots(2, len(loads), squeeze=False, sharex="col", sharey="row")
        for (upper, lower), name in zip(axes.T, loads, strict=True):
            part = found.curves[found.curves["load"] == name]
            unit = part["unit"].iloc[0]
            upper.set_title(name)
            _curve(upper, part, "joints_above", style.COLOURS[0], "-", band=True)
            for line, colour, dash in zip(_LINES, style.COLOURS, style.DASHES, strict=True):
                _curve(lower, part, line, colour, dash, band=line == "time")
            for level in found.table.loc[found.table["load"] == name, "level"]:
                for ax in (upper, lower):
                    ax.axvline(float(level), color=style.FAINT, lw=1.0, ls=style.DASHES[2])
            lower.set_xlabel(f"x [{unit_text(unit)}]")
        axes[0, 0].set_ylabel("joints that exceed x, %")
        axes[1, 0].set_ylabel("time above x, % of a revolution")
        handles: list[Artist] = [
            Line2D([], [], color=c, ls=d) for c, d in zip(style.COLOURS, style.DASHES, strict=True)
        ]
        margin = 0.75 / page.get_figwidth()
        page.subplots_adjust(left=margin, right=0.985, top=0.93, bottom=0.17, wspace=0.12, hspace=0.09)
        style.legend(page, handles, list(_LINES.values()))
    return page


def _curve(ax: Axes, part: pd.DataFrame, name: str, colour: str, dash: style.Dash, band: bool) -> None:
    ax.plot(part["level"], 100.0 * part[name], color=colour, ls=dash)
    if band and part[f"{name}_lower"].notna().all():
        ax.fill_between(
            part["level"], 100.0 * part[f"{name}_lower"], 100.0 * part[f"{name}_upper"], color=colour, alpha=0.2, lw=0
        )
