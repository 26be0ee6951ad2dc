"""Statistics from two fidelities, as columns of a table."""

from __future__ import annotations

from tolstat.display import text
from tolstat.display.table import Column, Row


def _statistic(row: Row) -> str:
    if row["statistic"] == "share above":
        return text.limit({**row, "level": row["at"]})
    return f"{row['load']} mean" if row["statistic"] == "mean" else f"{row['load']} {100 * row['at']:g} % below"


def _value(row: Row, key: str) -> str:
    return text.percent(row[key]) if row["statistic"] == "share above" else text.value(row[key], row["unit"])


def _ends(row: Row, key: str) -> str:
    low, high = row[f"{key}lower"], row[f"{key}upper"]
    return text.span(low, high) if row["statistic"] == "share above" else text.span_of(low, high, row["unit"])


TABLE = (
    Column("statistic", _statistic),
    Column("estimate", lambda row: _value(row, "estimate")),
    Column("95 % interval", lambda row: _ends(row, "")),
    Column("high fidelity alone", lambda row: _value(row, "alone"), rank=1),
    Column("95 % interval of it", lambda row: _ends(row, "alone_"), rank=3),
    Column("correlation", lambda row: f"{row['rho']:.4f}".replace("nan", "-"), rank=2),
    Column("gain", lambda row: text.formed(row["gain"])),
)
"""Columns of the table `TwoFidelities.table`."""
