"""Capability as text: columns of its tables, and notes."""

from __future__ import annotations

import math

import pandas as pd

from tolstat.display import text
from tolstat.display.table import Column, Row
from tolstat.questions.capability.query import TOGETHER


def _with_ends(row: Row, key: str, form: str) -> str:
    low, high = row[f"{key}_lower"], row[f"{key}_upper"]
    return "-" if math.isnan(low) else f"{low:{form}} .. {high:{form}}"


def _number(value: float, form: str) -> str:
    return "-" if math.isnan(value) else f"{value:{form}}"


LIMITS = (
    Column("load", lambda row: str(row["load"])),
    Column("limit", lambda row: "-" if row["load"] == TOGETHER else text.value(row["limit"], row["unit"])),
    Column("above", lambda row: f"{row['count']} of {row['n'] - row['n_failed'] - row['n_unsettled']}"),
    Column("yield", lambda row: text.percent(row["good"])),
    Column("interval of yield", lambda row: text.span(row["good_lower"], row["good_upper"])),
    Column("ppm", lambda row: text.number(row["ppm"]), rank=1),
    Column("interval of ppm", lambda row: text.span_of(row["ppm_lower"], row["ppm_upper"], "1"), rank=2),
    Column("Cpk", lambda row: _number(row["cpk"], ".2f")),
    Column("interval of Cpk", lambda row: _with_ends(row, "cpk", ".2f")),
    Column("Cpk if normal", lambda row: _number(row["cpk_normal"], ".2f"), rank=4),
)
"""Columns of the table `query.limits`."""

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


def together(table: pd.DataFrame) -> str:
    """Sentence on the joints that keep all limits, from the last row of `query.limits`."""
    row = table.iloc[-1]
    valid = int(row["n"] - row["n_failed"] - row["n_unsettled"])
    count, what = valid - int(row["count"]), "all limits" if len(table) > 2 else "the limit"
    interval = text.span(row["good_lower"], row["good_upper"])
    return f"yield, {what}: {text.percent(row['good'])} (95 %: {interval}), {count} of {valid} joints"


def note(table: pd.DataFrame) -> str:
    """Notes to the table: definitions, unresolved joints, restrictions."""
    lines = ["limits are upper limits: Cpk is Cpu, of median and 99.865 % quantile (ISO 22514-2), and there is no Cp"]
    unresolved = int((table["n_failed"] + table["n_unsettled"]).iloc[0])
    if unresolved:
        lines.append(f"{unresolved} joints without a valid load: in the intervals of ppm both ways, in no Cpk")
    if (table["cpk_lower"] == 0).any():
        lines.append(f"lower ends of Cpk need {table['needed'].iloc[0]} valid joints")
    if (table["normal_p"] < 0.01).any():
        lines.append("loads are not normal: do not use the column 'Cpk if normal' (p < 0.01)")
    if table["ppm_lower"].isna().all():
        lines.append("no intervals: they hold for independent samples only; run replicates of other seeds")
    return "\n".join(lines)
