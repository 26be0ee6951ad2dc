"""Tolerances known from measured parts as a table and a picture."""

from __future__ import annotations

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from tolstat.display import drawing, style, text
from tolstat.display.table import Column

INTERVALS = (
    Column("load > limit", text.limit),
    Column("share as stated", lambda row: text.percent(row["estimate"])),
    Column("joints", lambda row: text.span(row["lower"], row["upper"])),
    Column("parts", lambda row: text.span(row["parts_lower"], row["parts_upper"])),
    Column("both", lambda row: text.span(row["both_lower"], row["both_upper"])),
    Column("next joint", lambda row: text.percent(row["expected"]), rank=1),
    Column("not supported", lambda row: text.percent(row["unsupported"]), rank=2),
)
"""Columns of the table `query.intervals`."""
PARTS = (("lower", "upper", "joints"), ("parts_lower", "parts_upper", "parts"), ("both_lower", "both_upper", "both"))
"""Columns of the ends of each interval, and its name, from the top of a row of the picture."""
COLOURS = (style.COLOURS[0], style.COLOURS[1], style.INK)
LEAST = 1e-5
"""Smallest share that the picture shows."""


def forest(ax: Axes, table: pd.DataFrame) -> None:
    """Draw the three intervals of each share, below each other; shares on a logarithmic axis."""
    rows = table.to_dict("records")
    drawing.rows(ax, [text.limit(row) for row in rows])
    ends = table[[end for low, high, _ in PARTS for end in (low, high)]].to_numpy(dtype=float)
    low, high = max(0.7 * float(ends[ends > LEAST].min()), LEAST), min(1.3 * float(ends.max()), 1.0)
    style.share_axis(ax, low, "x", high)
    for i, row in enumerate(rows):
        for k, ((lower, upper, _), colour) in enumerate(zip(PARTS, COLOURS, strict=True)):
            y = i + 0.24 * (k - 1)
            ax.plot([max(row[lower], 0.1 * low), row[upper]], [y, y], color=colour, lw=3.0, solid_capstyle="butt")
        if row["estimate"] > low:
            ax.plot([row["estimate"]] * 2, [i - 0.36, i + 0.36], color=style.FAINT, lw=1.2)
    handles = [Line2D([], [], color=colour, lw=3.0) for colour in COLOURS]
    drawing.legend_above(ax, handles, LABELS)
    ax.set_xlabel("share of the joints above the limit, 95 % intervals")


LABELS = tuple(name for *_, name in PARTS)
