"""Lots as text and as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tolstat.common.loads import ANY_LIMIT
from tolstat.display import drawing, style, text
from tolstat.display.table import Column, has
from tolstat.questions.lots.query import Lots

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLUMNS = (
    Column("load", lambda row: str(row["load"])),
    Column("limit", lambda row: "-" if row["load"] == ANY_LIMIT else text.value(row["limit"], row["unit"])),
    Column("above", lambda row: text.percent(row["estimate"])),
    Column("total interval", lambda row: text.span(row["lower"], row["upper"])),
    Column("lots without", lambda row: text.percent(row["without"]), rank=2),
    Column("median lot", lambda row: text.percent(row["median"]), rank=4),
    Column("one lot in ten", lambda row: f"> {text.percent(row['high'])}", rank=3),
    Column("worst lot", lambda row: text.percent(row["worst"]), rank=1),
    Column("correlation", lambda row: text.formed(row["correlation"], ".2f"), rank=5),
    Column("above in delivery", text.delivery),
    Column("bad deliveries", lambda row: text.percent(row["bad"]), shown=has("bad")),
)
"""Columns of the table of `query.lots_of`; bad deliveries with an accepted share."""
OBSERVED, EXPECTED, ALONE = "lots simulated", "expected of a new lot", "if joints did not depend on their lot"


def note(found: Lots, accepted: float = np.nan) -> str:
    """Notes to the table."""
    row = found.table.iloc[-1]
    lots, delivery, of = int(row["lots"]), int(row["delivery"]), int(row["from_lots"])
    lines = [f"{lots} lots, {found.joints_per_lot} joints a lot; intervals: Student's t over lots, on the logit"]
    origin = "one new lot" if of == 1 else f"{of} new lots"
    lines.append(f"delivery: {delivery} joints of {origin}, 95 % prediction interval")
    if not np.isnan(accepted):
        lines.append(f"bad deliveries: more than {text.percent(accepted)} of the joints above")
    if (found.table["n_failed"] + found.table["n_unsettled"]).any():
        lines.append("joints without a valid load: below a limit at lower ends, above it at upper ends")
    return "\n".join(lines)


def draw(ax: Axes, found: Lots) -> None:
    """Share of the lots with at most a share of bad joints: simulated, expected, and without lots."""
    from scipy.stats import binom

    own, size = found.shares, found.joints_per_lot
    share = np.sort((own[ANY_LIMIT] / own["n"]).to_numpy())
    top = max(2, int(np.ceil(size * min(1.0, share[-1] * 1.15 + 1.0 / size))))
    at = np.arange(top + 1)
    mean = float(own[ANY_LIMIT].sum() / own["n"].sum())
    expected = np.cumsum(found.law.delivery(size).probability)[at]
    alone = binom.cdf(at, size, mean)
    x = np.append(at / size, (top + 1) / size)
    for cdf, colour, dash in ((alone, style.FAINT, style.DASHES[2]), (expected, style.COLOURS[1], style.DASHES[1])):
        ax.step(x, 100.0 * np.append(cdf, cdf[-1]), where="post", color=colour, ls=dash)
    steps = 100.0 * np.arange(1, share.size + 1) / share.size
    ax.step(np.append(share, x[-1]), np.append(steps, 100.0), where="post", color=style.COLOURS[0])
    drawing.legend_above(ax, [ax.lines[2], ax.lines[1], ax.lines[0]], [OBSERVED, EXPECTED, ALONE])
    ax.set(xlim=(0.0, x[-1]), ylim=(0.0, 104.0), ylabel="lots with at most this share [%]")
    ax.xaxis.set_major_formatter(lambda value, _: f"{100.0 * value:g} %")
    ax.set_xlabel("share of the joints of a lot that exceed at least one limit")
