"""Capability of a campaign against its study's limits, and its rare loads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from tolstat.analysis import capability, extreme
from tolstat.analysis.exceedance import FloatArray
from tolstat.display.text import align
from tolstat.store.view import Campaign, ends, load

TOGETHER = "all limits"
BLOCK = 1 << 16


def limits(campaign: Campaign, confidence: float = 0.95) -> pd.DataFrame:
    """Capability against each limit, and against all limits together.

    Parameters
    ----------
    campaign : Campaign
        A campaign of a study with limits.
    confidence : float
        Confidence level of the intervals.

    Returns
    -------
    DataFrame
        One row per limit: ``load``, ``unit``, ``limit``, ``n``, ``n_failed``, ``n_unsettled``, ``count`` (above);
        ``good`` and ``ppm`` with ``_lower`` and ``_upper``, which count unresolved joints below and above the limit;
        ``cpk`` (from quantiles) and ``cpk_normal`` with their ends, ``normal_p``, ``needed``. The last row,
        `TOGETHER`, is for the largest ratio of load to limit of each joint.
    """
    status, table = campaign.results["status"], campaign.results
    columns = {name: load(campaign.results, name) for name in campaign.limits}
    intervals = {name: ends(table, name) for name in columns}
    asked = [(name, unit, values, intervals[name], campaign.limits[name]) for name, (values, unit) in columns.items()]
    utilization = _utilization([values for values, _ in columns.values()], campaign)
    least, most = (_utilization([both[k] for both in intervals.values()], campaign) for k in (0, 1))
    asked.append((TOGETHER, "1", utilization, (least, most), 1.0))
    rows = []
    for name, unit, loads, interval, limit in asked:
        c = capability.at(loads, status, limit, confidence, campaign.iid, interval)
        row = {"load": name, "unit": unit, "limit": limit, "n": c.above.n}
        row |= {key: getattr(c.above, key) for key in ("n_failed", "n_unsettled", "count")}
        for key in ("good", "ppm"):
            row |= dict(zip((key, f"{key}_lower", f"{key}_upper"), getattr(c, key), strict=True))
        names = [f"{key}{end}" for key in ("cpk", "cpk_normal") for end in ("", "_lower", "_upper")]
        row |= {key: getattr(c, key) for key in (*names, "normal_p", "needed")}
        rows.append(row)
    return pd.DataFrame(rows)


def _utilization(columns: Sequence[FloatArray], campaign: Campaign) -> FloatArray:
    """Largest ratio of load to limit of each joint; computed in blocks to save memory."""
    levels, blocks = list(campaign.limits.values()), range(0, len(campaign.results), BLOCK)
    parts = (np.column_stack([values[first : first + BLOCK] for values in columns]) for first in blocks)
    return np.concatenate([np.empty(0), *(capability.utilization(part, levels) for part in parts)])


def returns(
    campaign: Campaign, names: Sequence[str], one_in: Sequence[float], confidence: float = 0.95
) -> pd.DataFrame:
    """Return loads, "1 in N joints", and the median of the largest of a fleet of N, from generalised Pareto tails.

    Parameters
    ----------
    campaign : Campaign
        The campaign.
    names : sequence of str
        Loads.
    one_in : sequence of float
        Numbers of joints N, so large that the load exceeded by one joint in N lies in the fitted tail.
    confidence : float
        Confidence level of the intervals.

    Returns
    -------
    DataFrame
        One row per load and N: ``load``, ``unit``, ``one_in``, ``estimate``, ``lower``, ``upper``, ``bound_lower`` and
        ``bound_upper`` (unresolved joints counted below, above), ``fleet``, ``fleet_lower``, ``fleet_upper``,
        ``shape``, ``shape_lower``, ``shape_upper``, ``p`` (goodness of fit), ``n_above``. SI units.

    Raises
    ------
    ValueError
        When the tail has too few joints (`TooThinError`), or N is too small to lie in it.
    """
    rows = []
    for name in names:
        values, unit = load(campaign.results, name)
        tail = extreme.fit(values, campaign.results["status"], None, confidence, campaign.iid)
        for number in one_in:
            row: dict[str, object] = {"load": name, "unit": unit, "one_in": number}
            row |= tail.level(1.0 / number)._asdict()
            row["bound_lower"], row["bound_upper"] = tail.bounds(1.0 / number)
            row |= dict(zip(("fleet", "fleet_lower", "fleet_upper"), tail.largest(int(number)), strict=True))
            row |= dict(zip(("shape", "shape_lower", "shape_upper"), tail.shape, strict=True))
            rows.append({**row, "p": tail.p, "n_above": tail.n_above})
    return pd.DataFrame(rows)


def text(table: pd.DataFrame) -> str:
    """Text of `limits`: one line per limit."""
    rows = [["load", "limit", "joints", "above", "ppm", "95 % interval", "Cpk", "95 % interval", "if normal"]]
    for row in table.to_dict("records"):
        unit = "" if row["unit"] == "1" else f" {row['unit'].replace('*', ' ')}"
        line = [row["load"], f"{row['limit']:g}{unit}", str(row["n"]), str(row["count"])]
        line += [_number(row["ppm"], ".4g"), _ends(row, "ppm", ".4g")]
        line += [_number(row["cpk"], ".2f"), _ends(row, "cpk", ".2f"), _number(row["cpk_normal"], ".2f")]
        rows.append(line)
    return align(rows)


def note(table: pd.DataFrame) -> str:
    """Notes to the table: definitions, unresolved joints, restrictions."""
    lines = ["limits are upper limits: Cpk is Cpu, of median and 99.865 % quantile (ISO 22514-2), and there is no Cp"]
    unresolved = int((table["n_failed"] + table["n_unsettled"]).iloc[0])
    if unresolved:
        lines.append(f"{unresolved} joints without a valid load: in the intervals of ppm both ways, in no Cpk")
    if (table["cpk_lower"] == 0).any():
        lines.append(f"lower ends of Cpk need {table['needed'].iloc[0]} valid joints")
    if (table["normal_p"] < 0.01).any():
        lines.append("loads are not normal: do not use the last column (p < 0.01)")
    if table["ppm_lower"].isna().all():
        lines.append("no intervals: they hold for independent samples only; run replicates of other seeds")
    return "\n".join(lines)


def _number(value: float, form: str) -> str:
    return "-" if np.isnan(value) else f"{value:{form}}"


def _ends(row: Mapping[Any, Any], name: str, form: str) -> str:
    low, high = row[f"{name}_lower"], row[f"{name}_upper"]
    return "-" if np.isnan(low) else f"{low:{form}} .. {high:{form}}"
