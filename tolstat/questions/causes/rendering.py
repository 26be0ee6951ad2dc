"""Causes of a load and the worst joints: text and JSON."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import pandas as pd

from tolstat.common.loads import unit_text
from tolstat.display.table import Column, Row, Rows, has
from tolstat.display.text import ends, records

if TYPE_CHECKING:
    from tolstat.questions.causes.query import Causes
    from tolstat.questions.causes.tail import Tail

SIGNIFICANT = 0.05
"""p-value below which a table marks an error of the tail."""
SHOWN = 10
"""Number of errors shown for each load on the page."""
ERRORS = 5
"""Number of errors of a joint that the table of the worst joints shows."""


def largest(causes: Causes, shown: int) -> pd.DataFrame:
    """Rows of the `shown` errors with the largest first-order indices, and of those with an effect on the tail."""
    table = causes.table
    marked = (table["direction_p"] < SIGNIFICANT) | (table["size_p"] < SIGNIFICANT)
    return table[(table.index < shown) | marked]


def columns(causes: Causes) -> list[Column]:
    """Columns of the table of the causes.

    Shares of the variance in per cent and rank coefficients, with intervals; probability that a joint of the tail has
    the larger error (``direction``) and the error farther from the middle (``size``), where ``*`` marks
    p < `SIGNIFICANT`.
    """
    if causes.from_design:
        total = Column("in all, %", partial(_interval, name="total", factor=100), shown=has("total"))
    else:  # given data yield bounds only
        total = Column("in all, %", partial(_ends, name="total", factor=100), shown=_has_narrow_bounds, rank=3)
    return [
        Column("error", lambda row: str(row["error"])),
        Column("alone, %", partial(_interval, name="first", factor=100), shown=has("first")),
        total,
        Column("rank coefficient", partial(_interval, name="srrc"), shown=has("srrc")),
        Column("tail: larger", partial(_tail, name="direction"), shown=has("direction"), rank=2),
        Column("tail: farther out", partial(_tail, name="size"), shown=has("size"), rank=1),
    ]


def has_narrow_bounds(table: pd.DataFrame) -> bool:
    """Whether the bounds of the total indices tell something: median width of the first `SHOWN` below 0.5."""
    part = table.head(SHOWN)
    return bool((part["total_upper"] - part["total_lower"]).median() < 0.5)  # false without bounds (NaN)


def _has_narrow_bounds(rows: Rows) -> bool:
    return bool(rows) and has_narrow_bounds(pd.DataFrame(rows))


def heading(causes: Causes) -> str:
    """Line above the table where another one stands before it: what the shares are of."""
    return f"scatter of {causes.load} over all joints, not of exceeding a limit:"


def note(causes: Causes, log: bool = False, exchanged: bool = False) -> str:
    """Notes to the table: joints, explained variance, restrictions; `exchanged`: whether shares of lines are given."""
    unit = unit_text(causes.unit)
    std = f"{causes.std:.4g}, of the logarithm" if log else f"{causes.std:.4g} {unit}".rstrip()
    if causes.from_design:
        what, ranks, tail = "groups of errors", "", "from a pick-freeze design"
    else:
        what, ranks = "errors", f", ranks {100 * causes.r2:.0f} %"
        tail = f"tail: {causes.above} joints above {causes.level:.5g} {unit}".rstrip()
    lines = [
        f"{causes.load}: {causes.joints} joints, {causes.without_load} without a valid load left out; "
        f"standard deviation {std}",
        f"{what} alone explain {100 * causes.additive:.0f} % of the variance{ranks}; {tail}",
    ]
    if causes.used < causes.joints:
        lines.append(
            f"shares and ranks are from the first {causes.used} joints, the tail from at most as many on either side"
        )
    if causes.table["total"].isna().all():
        lines.append("errors are correlated: shares overlap, and shares in all are not given")
    elif not causes.from_design and not has_narrow_bounds(causes.table):
        remedy = "" if exchanged else "; tolstat causes --run gives them"
        lines.append(f"no shares in all: given joints bound them too widely{remedy}")
    if causes.table["first_lower"].isna().all():
        lines.append("no intervals: they hold for independent samples only")
    return "\n".join(lines)


def values(causes: Causes) -> dict[str, Any]:
    """JSON values of the causes of a load, with all errors."""
    found = causes._asdict() | {"table": records(causes.table)}
    return found | {"r2": None if causes.from_design else causes.r2}


def worst_columns(tail: Tail) -> list[Column]:
    """Columns of `worst_rows`: the largest errors of each joint, each in a column of its own."""
    unit = f" [{tail.unit}]" if tail.unit != "1" else ""

    def error(place: int) -> Column:
        head = ("largest error in σ", "second", "third", "fourth", "fifth")[place]
        return Column(head, lambda row: row["errors"][place] if place < len(row["errors"]) else "-", True, rank=place)

    return [
        Column("row", lambda row: str(row["row"])),
        Column(f"{tail.by}{unit}", lambda row: f"{row['value']:.6g}"),
        *([Column("at", lambda row: str(row["point"]), words=True)] if any(j.point for j in tail.joints) else []),
        Column("status", lambda row: str(row["status"]), words=True),
        *(error(place) for place in range(ERRORS)),
    ]


def worst_rows(tail: Tail) -> pd.DataFrame:
    """One row per joint: ``row``, ``value``, ``point``, ``status``, and its `ERRORS` largest errors in words."""
    return pd.DataFrame(
        {
            "row": [joint.row for joint in tail.joints],
            "value": [joint.value for joint in tail.joints],
            "point": [joint.point for joint in tail.joints],
            "status": [joint.status.label for joint in tail.joints],
            "errors": [
                [f"{name} {z:+.2f}" for name, z in list(joint.scores.items())[:ERRORS]] for joint in tail.joints
            ],
        }
    )


def worst_values(tail: Tail) -> dict[str, Any]:
    """JSON values of the worst joints, with all errors."""
    joints = [joint._asdict() | {"status": joint.status.label} for joint in tail.joints]
    return {"by": tail.by, "unit": tail.unit, "joints": joints}


def _interval(row: Row, name: str, factor: float = 1.0) -> str:
    value = row[name]
    if math.isnan(value):
        return "-"
    # estimates of shares may scatter beyond 0 and 1, where no share is
    own = f"{factor * min(max(value, 0.0), 1.0):.1f}" if factor > 1 else f"{value:+.2f}"
    return own if math.isnan(row[f"{name}_lower"]) else f"{own} ({_ends(row, name, factor)})"


def _ends(row: Row, name: str, factor: float = 1.0) -> str:
    return ends(factor * row[f"{name}_lower"], factor * row[f"{name}_upper"], ".1f" if factor > 1 else "+.2f")


def _tail(row: Row, name: str) -> str:
    star = "*" if row[f"{name}_p"] < SIGNIFICANT else " "
    return "-" if math.isnan(row[name]) else f"{row[name]:.2f}{star}"
