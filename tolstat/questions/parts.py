"""What measured parts leave open of the shares above the limits."""

from __future__ import annotations

import math
from typing import Any

from tolstat.analysis.sample import CONFIDENCE
from tolstat.common.loads import ANY_LIMIT
from tolstat.display import drawing, style, text
from tolstat.display.answer import Answer, Axes, Column, Panel, Panels, Part, Row, Rows, Sentence, Table
from tolstat.questions import shares
from tolstat.store import error_budget
from tolstat.store.view import View

DRAWN = 6
"""Maximum number of shares in the picture."""
LEAST = 1e-5
"""Smallest share that the picture shows."""
INTERVALS = {
    "joints": ("lower", "upper", style.COLOURS[0]),
    "parts": ("parts_lower", "parts_upper", style.COLOURS[1]),
    "both": ("both_lower", "both_upper", style.INK),
}
"""Keys of the ends of each interval and its colour, from the top of a row of the picture."""
OF_BOTH = ("expected", "parts_lower", "parts_upper", "both_lower", "both_upper", "unsupported")
"""Keys of a row for the fields of `known_share.KnownShare`."""
COLUMNS = (
    Column("load > limit", text.limit),
    Column("share as stated", shares.share("estimate")),
    Column("joints", shares.shares("lower", "upper")),
    Column("parts", shares.shares("parts_lower", "parts_upper")),
    Column("both", shares.shares("both_lower", "both_upper")),
    Column("next joint", shares.share("expected"), rank=1),
    Column("not supported", shares.share("unsupported"), rank=2),
)
EXPLANATION = (
    "Joints: the tolerances are as stated, and the joints are a sample. Parts: the process may be any that the "
    "parts make likely. Both: the verdict's, with joints without a valid load and the numerical error. Grey line: "
    "the share at the tolerances as stated."
)


def known_parts(view: View) -> Answer:
    """Estimate what measured parts leave open of each share.

    Parameters
    ----------
    view : View
        A campaign of a study with limits, some of whose tolerances are known from measured parts.

    Returns
    -------
    Answer
        Table ``intervals``, one row for `ANY_LIMIT`, if there are several limits, and for each limit, those exceeded
        most first: ``load``, ``unit``, ``level``; ``estimate``, ``lower``, ``upper``, share at the tolerances as stated
        with the interval of the joints; the fields of `known_share.KnownShare`, the last two ends with ``both_`` before
        them.

    Raises
    ------
    NotApplicable
        When the study takes its tolerances as exact or has no limits, or no joint is simulated.
    """
    process = error_budget.known_parts(view)
    if process is None or not view.counts.done:
        remedy = "give an entry of [tolerances] known_from, and the study [limits]"
        raise shares.inapplicable(view, "has no share that measured parts leave open", remedy)
    rows = [_known(view, process, name) for name in (*view.limits, *([ANY_LIMIT] if len(view.limits) > 1 else []))]
    rows.sort(key=lambda row: (row["load"] != ANY_LIMIT, -row["estimate"]))
    drawn = [row for row in rows if not math.isnan(row["both_upper"])][:DRAWN]
    entries = ", ".join(f"{entry.pattern} from {entry.parts}" for entry in process.entries)
    words = (f"Mean and deviation are estimated from measured parts: {entries}.", EXPLANATION)
    parts: list[Part] = [Panels([_intervals(drawn)], beside=list(map(Sentence, words)))] if drawn else []
    parts.append(Table("intervals", "Shares above the limits, with what leaves them open", COLUMNS, rows))
    if len(drawn) < min(len(rows), DRAWN):
        most = text.percent(max(row["unsupported"] for row in rows))
        parts.append(Sentence(f"The joints do not support {most} of the likely processes. {process.remedy}.", "lead"))
    return Answer("known_parts", "Tolerances known from measured parts", parts)


def _known(view: View, process: error_budget.KnownParts, name: str) -> Row:
    load = view.load(name)
    assert load.limit is not None
    above = load.above(load.limit)
    row = {"load": name, "unit": load.unit, "level": load.limit}
    row |= {key: getattr(above, key) for key in ("estimate", "lower", "upper")}
    return row | dict(zip(OF_BOTH, process.share(name, CONFIDENCE), strict=True))


def _intervals(rows: Rows) -> Panel:
    """Picture of the three intervals of some shares."""

    def draw(ax: Axes) -> None:
        """Draw the three intervals of each share, below each other; shares on a logarithmic axis."""
        ends = [row[end] for row in rows for low, high, _ in INTERVALS.values() for end in (low, high)]
        low = max(0.7 * min(end for end in ends if end > LEAST), LEAST)
        style.share_axis(ax, low, "x", min(1.3 * max(ends), 1.0))
        for i, row in enumerate(rows):
            for k, (label, (lower, upper, colour)) in enumerate(INTERVALS.items()):
                look: Any = {"color": colour, "lw": 3.0, "solid_capstyle": "butt", "label": label}
                ax.plot([max(row[lower], 0.1 * low), row[upper]], [i + 0.24 * (k - 1)] * 2, **look)
            if row["estimate"] > low:
                ax.plot([row["estimate"]] * 2, [i - 0.36, i + 0.36], color=style.FAINT, lw=1.2)
        ax.set_xlabel("share of the joints above the limit, 95 % intervals")

    labels, size = [text.limit(row) for row in rows], (drawing.WIDTH, 0.47 * len(rows) + drawing.BOTTOM + 0.38)
    spans = "; ".join(f"{row['load']}: {text.span(row['both_lower'], row['both_upper'])}" for row in rows)
    words = f"Intervals of both: {spans}"
    return Panel("intervals", "What joints and parts leave open", words, draw, size, rows=labels)
