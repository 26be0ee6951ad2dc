"""Picture of the share above the limits as drawn, and with each value of what is assumed."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from tolstat.display import drawing, style, text
from tolstat.display.blocks import Panel
from tolstat.display.mpl import markers
from tolstat.display.table import Rows
from tolstat.questions.assumptions.sentences import KEPT
from tolstat.questions.assumptions.variations import Standing

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DRAWN = "as drawn"
_LONGEST = 30
"""Number of letters of a label from which on it has two lines."""
_ACCEPTED: dict[str, Any] = {"color": style.COLOURS[2], "lw": 1.4, "ls": (0.0, (6.0, 2.0))}
"""Style of the accepted share."""


def bars(found: Standing) -> Panel:
    """Share as drawn, then with each value that moves it, on one axis with the accepted share."""
    rows = found.moving
    said = "; ".join(f"{row['label']} {text.percent(row['share'])}" for row in rows)
    labels = [DRAWN, *map(_label, rows)]
    return Panel(
        "assumptions",
        "Share of the joints above a limit, with other values of what is assumed",
        f"As drawn {text.percent(found.drawn[0])}. {said or 'Nothing that is assumed moves it'}",
        partial(_bars, found=found, rows=rows, labels=labels),
        (drawing.WIDTH, 0.27 * (len(labels) + 1) + drawing.BOTTOM + 0.3),
        drawing.rows_left([part for label in labels for part in label.split("\n")]),
    )


def _label(row: Any) -> str:
    words = f"{row['label']}: {KEPT[row['side']]}" if row["turns"] else str(row["label"])
    return words.replace(" (", "\n(") if len(words) > _LONGEST else words


def _bars(ax: Axes, found: Standing, rows: Rows, labels: list[str]) -> None:
    share, lower, upper = found.drawn
    accepted = found.accepted
    ends = [lower, upper, *(row[f"share{end}"] for row in rows for end in ("", "_lower", "_upper"))]
    shown = np.array([share, accepted, *ends])
    known = shown[shown >= 0.5 / max(found.n, 1)]
    floor, high = 0.6 * float(known.min(initial=0.1)), min(1.2 * float(known.max(initial=0.1)), 1.0)
    drawing.rows(ax, labels)
    ax.set_ylim(len(labels) - 0.4, -1.3)  # a row above, for the accepted share in words
    style.share_axis(ax, floor, "x", high)
    drawn = max(share, floor)
    ax.axvline(drawn, color=style.INK, lw=1.0)
    if not np.isnan(lower):
        ax.plot([max(lower, floor), max(upper, floor)], [0, 0], color=style.INK, lw=1.6)
    ax.plot(drawn, 0, "o" if share >= floor else markers.CARETLEFT, color=style.INK, ms=6.0, clip_on=False)
    for place, row in enumerate(rows, 1):
        own = max(row["share"], floor)
        ax.barh(place, own - drawn, 0.62, left=drawn, color=style.COLOURS[row["change"] > 0.0], zorder=2)
        low, top = (max(row[f"share_{end}"], floor) for end in ("lower", "upper"))
        ax.plot([low, top], [place, place], color=style.INK, lw=1.2, zorder=3)
        if row["share_lower"] < floor:
            ax.plot(floor, place, marker=markers.CARETLEFT, color=style.INK, ms=5.0, zorder=4, clip_on=False)
    if accepted > 0.0:
        ax.axvline(accepted, **_ACCEPTED)
        words: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 8.0, "backgroundcolor": "white"}
        ax.text(accepted, -0.9, f"accepted {text.percent(accepted)}", **words)
    ax.set_xlabel("share of the joints that exceed a limit")
