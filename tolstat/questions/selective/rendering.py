"""Selective assembly as text and as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tolstat.common import units
from tolstat.display import drawing, style, text
from tolstat.display.table import Column
from tolstat.questions.selective.query import Assembled
from tolstat.study.selective import KINDS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLUMNS = (
    Column("classes", lambda row: f"{row['classes']:.0f}"),
    Column("unmatched", lambda row: text.percent(row["unmatched"])),
    Column("clearance, sigma", lambda row: units.shown(float(f"{row['clearance']:.3g}"), "m")),
    Column("yield", lambda row: text.percent(row["good"])),
    Column("total interval", lambda row: text.span(row["good_lower"], row["good_upper"])),
    Column("of all crosses", lambda row: text.percent(row["of_all"])),
)
"""Columns of the table of `query.assembled`."""
NOTE = (
    "yield: of the assembled joints; of all crosses: yield times the matched share\n"
    "a cross is in the class of its largest measured pin, a fork in that of its smallest measured hole"
)


def _edge(value: float) -> str:
    return "-" if np.isinf(value) else units.shown(float(f"{value:.4g}"), "m")


CLASSES = (
    Column("class", lambda row: f"{row['class']:.0f}"),
    Column("pin up to", lambda row: _edge(row["pins"])),
    Column("hole up to", lambda row: _edge(row["holes"])),
    *(Column(kind.name, lambda row, name=kind.name: text.percent(row[name])) for kind in KINDS),  # type: ignore[misc]
    Column("matched", lambda row: text.percent(row["matched"])),
)
"""Columns of the table of `query.parts`."""
YIELD, UNMATCHED, ALL = "yield of the assembled joints", "parts without a partner", "crosses in a good joint"


def draw(ax: Axes, found: Assembled) -> None:
    """Draw yield with its interval, unmatched share, and share of all crosses in a good joint, over the classes."""
    table = found.table
    x = table["classes"].to_numpy()
    lines = []
    for k, (name, label) in enumerate((("good", YIELD), ("unmatched", UNMATCHED), ("of_all", ALL))):
        y = 100.0 * table[name].to_numpy()
        lines += ax.plot(x, y, marker="o", ms=4.5, color=style.COLOURS[k], ls=style.DASHES[k], label=label)
    ax.vlines(x, 100.0 * table["good_lower"], 100.0 * table["good_upper"], color=style.COLOURS[0], lw=1.2)
    drawing.legend_above(ax, lines, [YIELD, UNMATCHED, ALL])
    ax.set(xlabel="classes", ylabel="share [%]", ylim=(-2.0, 102.0), xticks=x)
