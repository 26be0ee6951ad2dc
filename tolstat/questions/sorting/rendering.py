"""Sorting of parts and inspection of joints as tables and a picture."""

from __future__ import annotations

import math

import pandas as pd
from matplotlib.axes import Axes

from tolstat.display import drawing, style, text
from tolstat.display.table import Column, Row


def _rejected(row: Row) -> str:
    return text.percent(row["rejected"]) if row["rejected"] else "-"


def _cost(row: Row, name: str) -> str:
    return f"{row[name]:.4g}" if math.isfinite(row[name]) else "-"


STAGES = (
    Column("load > limit", text.limit),
    Column("stage", lambda row: str(row["stage"]), words=True),
    Column("above", lambda row: text.percent(row["estimate"])),
    Column("95 % interval", lambda row: text.span(row["lower"], row["upper"])),
    Column("rejected", _rejected, rank=1),
    Column("cost of a joint", lambda row: _cost(row, "cost"), rank=2),
    Column("of a good one", lambda row: _cost(row, "cost_good")),
)
"""Columns of the table `query.Sorted.stages`."""
PARTS = (
    Column("part", lambda row: str(row["part"])),
    Column("scrapped", lambda row: text.percent(row["scrapped"])),
    Column("cost of one made", lambda row: _cost(row, "cost")),
    Column("of one used", lambda row: _cost(row, "cost_used")),
)
"""Columns of the table `query.Sorted.parts`."""


def yields(ax: Axes, table: pd.DataFrame) -> None:
    """Draw the share above the limits at each stage, with its interval, and beside it what a good joint costs."""
    rows = table.to_dict("records")
    drawing.rows(ax, [str(row["stage"]) for row in rows])
    high = 1.25 * float(table["upper"].max())
    ax.set_xlim(0.0, 100.0 * high)
    for i, row in enumerate(rows):
        ax.plot([100.0 * row["lower"], 100.0 * row["upper"]], [i, i], color=style.COLOURS[0], lw=3.0)
        ax.plot(100.0 * row["estimate"], i, "o", color=style.COLOURS[0], ms=6.0)
        said = f"a good joint costs {_cost(row, 'cost_good')}"
        at, side = (row["lower"], "left") if row["lower"] < 0.5 * high else (row["upper"], "right")
        ax.text(100.0 * at, i - 0.14, said, ha=side, va="bottom", size=8.0, color=style.INK)
    ax.set_xlabel("share of the joints above a limit, per cent")
