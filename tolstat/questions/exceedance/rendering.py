"""Load exceedance as text: tables of limits and quantiles, notes."""

from __future__ import annotations

import math
from typing import Any

from tolstat.common.tables import VALID, Status
from tolstat.display import text
from tolstat.display.table import Column, Row, Rows, has, has_unresolved
from tolstat.questions.exceedance.query import SHARES
from tolstat.store.view import View


def _outer(row: Row) -> str:
    kind = "bound" if math.isnan(row["outer_lower"]) else "outer"
    return text.span(row[f"{kind}_lower"], row[f"{kind}_upper"])


def _unsearched(row: Row) -> str:
    return text.percent(row["unsearched_upper"])


def _is_known(rows: Rows) -> bool:
    return bool(rows) and "both_lower" in rows[0]


def _both(row: Row) -> str:
    return text.span(row["both_lower"], row["both_upper"])


def above(row: Row) -> str:
    """Joints above a limit, and of how many with a valid load."""
    return f"{row['count']} of {row['n'] - row['n_failed'] - row['n_unsettled']}"


LIMITS = (
    Column("load", lambda row: str(row["load"])),
    Column("limit", lambda row: text.value(row["level"], row["unit"])),
    Column("nominal", lambda row: text.value(row["nominal"], row["unit"]), rank=1),
    Column("above", above),
    Column("share", lambda row: text.percent(row["estimate"])),
    Column("95 % interval", lambda row: text.span(row["lower"], row["upper"])),
    Column("with unresolved joints", _outer, shown=has_unresolved, rank=2),
    Column(
        "total interval",
        lambda row: text.span(row["total_lower"], row["total_upper"]),
        shown=has("numerical_error"),
        rank=3,
    ),
    Column("with measured parts", _both, shown=_is_known, rank=1),
    Column("at most, if ways are missed", _unsearched, shown=has("unsearched_upper")),
)
"""Columns of the table `query.limits`. Joints above are counted among the valid ones, as the share is; the last two
columns count failed and unsettled joints below, then above the limit, and shift every load by the numerical error."""


def at_points(view: View) -> tuple[Column, ...]:
    """Columns of the table `query.at_points`: the share above each limit at each operating point."""

    def share(point: str) -> Column:
        return Column(point, lambda row: text.percent(row[point]))

    head = (Column("load", lambda row: str(row["load"])), Column("limit", lambda r: text.value(r["level"], r["unit"])))
    return (*head, *map(share, view.points))


AT_POINTS = "share of the joints above each limit at each operating point"
"""Title of the table `query.at_points`."""


def _numerical(row: Row) -> str:
    return text.percent(max(abs(row[f"numerical_{end}"] - row["estimate"]) for end in ("lower", "upper")))


BUDGET = (
    Column("limit", text.limit),
    Column("share", lambda row: text.percent(row["estimate"])),
    Column("sampling, ±", lambda row: text.percent(0.5 * (row["upper"] - row["lower"]))),
    Column("numerical error, up to", _numerical),
    Column("failed and unsettled, width", lambda row: text.percent(row["bound_upper"] - row["bound_lower"])),
)
"""Contributions to the uncertainty of each share above a limit, from the table `query.limits`."""


def quantile_columns(tolerance: dict[str, float] | None = None) -> tuple[Column, ...]:
    """Columns of the table `by_load`: quantiles with intervals and, if given, tolerance limits by load."""

    def limit(row: Row) -> str:
        upper = (tolerance or {})[row["load"]]
        return "needs more joints" if math.isinf(upper) else text.value(upper, row["unit"])

    def quantile(share: float) -> Column:
        def cell(row: Row) -> str:
            own, lower, upper = row[share]
            size = text.multiple(own, row["unit"])[0]
            ends = f" ({text.number(lower / size)} .. {text.number(upper / size)})"
            ends = ends if tolerance and not math.isnan(lower) else ""
            return text.value(own, row["unit"]) + ends

        rank = {SHARES[-1]: 0, SHARES[0]: 0}.get(share, 3)
        return Column(f"{100 * share:g} %" + (" stay below" if tolerance else ""), cell, rank=rank)

    def interval(row: Row) -> str:
        _, lower, upper = row[SHARES[-1]]
        return text.span_of(lower, upper, row["unit"])

    head = (
        Column("load", lambda row: str(row["load"])),
        Column("nominal", lambda r: text.value(r["nominal"], r["unit"]), rank=1),
    )
    last = Column(f"95 % interval of {100 * SHARES[-1]:g} %", interval) if tolerance is None else None
    last = last or Column("tolerance limit 99 % / 95 %", limit)
    return (*head, *(quantile(share) for share in SHARES), last)


def by_load(quantiles: Rows) -> Rows:
    """One row per load of `query.quantile_rows`: for each share (estimate, lower, upper)."""
    rows: dict[str, dict[Any, Any]] = {}
    for row in quantiles:
        own = rows.setdefault(row["load"], {name: row[name] for name in ("load", "unit", "nominal")})
        own[row["share"]] = (row["estimate"], row["lower"], row["upper"])
    return list(rows.values())


def note(view: View) -> str:
    """Sentence on what the intervals cover."""
    doubts = [(name, view.load(name).doubt(level)) for name, level in view.limits.items()]
    poor = [f"{name} ({doubt})" for name, doubt in doubts if doubt]
    text = view.design.covers
    text += f"; no share, needs more joints or other proposals: {', '.join(poor)}" if poor else ""
    text += f"; {view.design.caveat}" if view.design.caveat else ""
    if view.count(*VALID, Status.PENDING) < view.n:
        text += "; light bands: with the others counted below and above every x"
    return text
