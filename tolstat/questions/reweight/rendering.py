"""Statistics for other tolerances, as columns of a table."""

from __future__ import annotations

from collections.abc import Callable

import pandas as pd

from tolstat.display import text
from tolstat.display.table import Column, Row, has


def columns(table: pd.DataFrame) -> tuple[Column, ...]:
    """Columns of the table `Reweighted.table`: shares above limits, or quantiles of a study without limits."""
    limits = "level" in table

    def head(row: Row) -> str:
        return text.limit(row) if limits else f"{row['load']}, {100 * row['share']:g} % stay below"

    def value(key: str) -> Callable[[Row], str]:
        return lambda row: text.percent(row[key]) if limits else text.value(row[key], row["unit"])

    def ends(row: Row) -> str:
        low, high = row["lower"], row["upper"]
        return text.span(low, high) if limits else text.span_of(low, high, row["unit"])

    shown = (
        Column("load > limit" if limits else "quantile", head),
        Column("before", value("before")),
        Column("after", value("estimate")),
        Column("95 % interval", ends),
        Column("counts as joints", lambda row: text.formed(row["ess"], ".0f"), rank=1),
    )
    unresolved = Column(
        "with unresolved joints",
        lambda row: text.span(row["bound_lower"], row["bound_upper"]),
        shown=lambda rows: any(row["bound_upper"] > row["bound_lower"] for row in rows),
        rank=2,
    )
    total = Column(
        "with numerical error",
        lambda row: text.span(row["total_lower"], row["total_upper"]),
        shown=has("total_lower"),
        rank=1,
    )
    more = (
        Column("ppm", lambda row: text.ppm(row["estimate"]), rank=2),
        Column("above in delivery", text.delivery, rank=3),
    )
    return (*shown, total, unresolved, *more) if limits else shown
