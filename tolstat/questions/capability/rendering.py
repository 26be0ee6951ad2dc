"""Capability as text: columns of its tables, and notes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from tolstat.analysis.binomial import unresolved_matter
from tolstat.analysis.prediction import DELIVERY
from tolstat.common.loads import ANY_LIMIT
from tolstat.display import text
from tolstat.display.table import Column, Row
from tolstat.questions.capability.query import NOT_NORMAL

if TYPE_CHECKING:
    import pandas as pd


def _with_ends(row: Row, key: str, form: str) -> str:
    return text.ends(row[f"{key}_lower"], row[f"{key}_upper"], form)


LIMITS = (
    Column("load", lambda row: str(row["load"])),
    Column("limit", lambda row: "-" if row["load"] == ANY_LIMIT else text.value(row["limit"], row["unit"])),
    Column("above", lambda row: f"{row['count']} of {row['n'] - row['n_failed'] - row['n_unsettled']}"),
    Column("yield", lambda row: text.percent(row["good"])),
    Column("total interval", lambda row: text.span(row["good_lower"], row["good_upper"])),
    Column("ppm", lambda row: text.number(row["ppm"]), rank=1),
    Column("interval of ppm", lambda row: text.span_of(row["ppm_lower"], row["ppm_upper"], "1"), rank=2),
    Column("above in delivery", text.delivery, rank=3),
    Column("Cpk", lambda row: text.formed(row["cpk"], ".2f")),
    Column("interval of Cpk", lambda row: _with_ends(row, "cpk", ".2f")),
    Column("Cpk by sigma", lambda row: text.formed(row["cpk_normal"], ".2f"), rank=4),
)
"""Columns of the table `query.limits`; the total interval is that of the yield."""

RETURNS = (
    Column("load", lambda row: str(row["load"])),
    Column("one joint in", lambda row: f"{row['one_in']:,.0f}".replace(",", " ")),
    Column("exceeds", lambda row: text.value(row["estimate"], row["unit"])),
    Column("95 % interval", lambda row: text.span_of(row["lower"], row["upper"], row["unit"])),
    Column("largest of so many", lambda row: text.value(row["fleet"], row["unit"])),
    Column("interval of it", lambda row: text.span_of(row["fleet_lower"], row["fleet_upper"], row["unit"]), rank=2),
    Column("fit, p", lambda row: f"{row['p']:.2g}", rank=1),
)
"""Columns of the table `query.returns`; the largest of N joints is the median of it over fleets of N."""


WIDEST = 0.5
"""Total interval of a yield, or its bounds without one, from which on it says too little for a verdict."""


class Yield(NamedTuple):
    """Yield of all limits together, in words.

    Attributes
    ----------
    value : str
        The estimate, or the interval where joints without a valid load matter.
    words : str
        What it is the share of, number of joints, total interval.
    decides : bool
        Whether the interval is narrower than `WIDEST`.
    """

    value: str
    words: str
    decides: bool


def together(row: Row, limits: int) -> Yield:
    """Share of the joints that keep all of some limits, from `query.good`."""
    n, above = int(row["n"]), int(row["count"])
    unresolved = int(row["n_failed"] + row["n_unsettled"])
    valid, low, high = n - unresolved, row["good_lower"], row["good_upper"]
    keep = f"keep all {limits} limits" if limits > 1 else "keep the limit"
    kind, known = "total interval", not math.isnan(low)
    if not known:
        low, high = ((valid - above) / n, 1.0 - above / n) if n else (0.0, 1.0)
    counted = f"{valid - above} of {valid}" + (" with a valid load" if unresolved else "")
    if unresolved_matter(above, n, unresolved):
        covers = kind if known else "bounds"
        return Yield(text.span(low, high), f"of the joints {keep} ({counted}; {covers})", high - low < WIDEST)
    interval = f"{kind} {text.span(low, high)}" if known else "no interval"
    return Yield(text.percent(row["good"]), f"of the joints {keep} ({counted}; {interval})", high - low < WIDEST)


def delivery(row: Row, limits: int) -> str:
    """What `query.good` predicts of the next `DELIVERY` joints; empty without an interval."""
    exceeded = "at least one limit" if limits > 1 else "the limit"
    return "" if math.isnan(row["next_lower"]) else f"of the next {DELIVERY} joints exceed {exceeded}"


def note(table: pd.DataFrame) -> str:
    """Notes to the table: definitions, unresolved joints, restrictions."""
    lines = ["limits are upper limits: Cpk is Cpu, of median and 99.865 % quantile (ISO 22514-2), and there is no Cp"]
    unresolved = int((table["n_failed"] + table["n_unsettled"]).iloc[0])
    if unresolved:
        of = f"{unresolved} of {table['n'].iloc[0]} joints without a valid load"
        lines.append(f"{of}: in the intervals of yield and ppm both ways, in no Cpk")
    if unresolved and table["cpk"].isna().any():
        lines.append("no Cpk where joints without a valid load make a share as uncertain as sampling does")
    if (table["cpk_lower"] == 0).any():
        lines.append(f"lower ends of Cpk need {table['needed'].iloc[0]} valid joints")
    if (table["normal_p"] < NOT_NORMAL).any():
        lines.append(f"'Cpk by sigma' tells no share above of a load that is not normal (p < {NOT_NORMAL:g})")
    if table["ppm_lower"].isna().all():
        lines.append("no intervals: they hold for independent samples only; run replicates of other seeds")
    return "\n".join(lines)


def no_tail(table: pd.DataFrame) -> str:
    """Sentence on the loads of `query.returns` whose tail cannot be extrapolated; empty if there are none."""
    refused = table[table["refusal"] != ""].drop_duplicates("load")
    parts = [f"{', '.join(rows['load'])}: {reason}" for reason, rows in refused.groupby("refusal", sort=False)]
    return f"{'; '.join(parts)}: not extrapolated" if parts else ""
