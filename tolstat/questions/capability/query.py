"""Capability of a production against the limits of its study, and its rare loads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from tolstat.analysis import capability, extreme
from tolstat.display import text
from tolstat.store.sample_load import SampleLoad
from tolstat.store.view import View

TOGETHER = "all limits"


def limits(view: View, confidence: float = 0.95) -> pd.DataFrame:
    """Capability against each limit, and against all limits together.

    Parameters
    ----------
    view : View
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
    rows = []
    for load in [*view.loads(list(view.limits)), _utilization(view)]:
        assert load.limit is not None
        c = capability.of_sample(load.sample, load.limit, confidence, view.iid)
        row = {"load": load.name, "unit": load.unit, "limit": load.limit, "n": c.above.n}
        row |= {key: getattr(c.above, key) for key in ("n_failed", "n_unsettled", "count")}
        for key in ("good", "ppm"):
            row |= dict(zip((key, f"{key}_lower", f"{key}_upper"), getattr(c, key), strict=True))
        names = [f"{key}{end}" for key in ("cpk", "cpk_normal") for end in ("", "_lower", "_upper")]
        row |= {key: getattr(c, key) for key in (*names, "normal_p", "needed")}
        rows.append(row)
    return pd.DataFrame(rows)


def _utilization(view: View) -> SampleLoad:
    """Largest ratio of load to limit of each joint, with the limit 1; computed load by load to save memory."""
    parts = [load.of_limit() for load in view.loads(list(view.limits))]
    ends = (np.maximum.reduce([part.ends[k] for part in parts]) for k in (0, 1))
    largest = np.maximum.reduce([part.values for part in parts])
    return replace(
        parts[0], name=TOGETHER, nominal=max(part.nominal for part in parts), values=largest, ends=tuple(ends)
    )


def returns(view: View, names: Sequence[str], one_in: Sequence[float], confidence: float = 0.95) -> pd.DataFrame:
    """Return loads, "1 in N joints", and the median of the largest of a fleet of N, from generalised Pareto tails.

    Parameters
    ----------
    view : View
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
        load = view.load(name)
        tail = extreme.of_sample(load.sample, None, confidence, view.iid)
        for number in one_in:
            row: dict[str, object] = {"load": name, "unit": load.unit, "one_in": number}
            row |= tail.level(1.0 / number)._asdict()
            row["bound_lower"], row["bound_upper"] = tail.bounds(1.0 / number)
            row |= dict(zip(("fleet", "fleet_lower", "fleet_upper"), tail.largest(int(number)), strict=True))
            row |= dict(zip(("shape", "shape_lower", "shape_upper"), tail.shape, strict=True))
            rows.append({**row, "p": tail.p, "n_above": tail.n_above})
    return pd.DataFrame(rows)


def summary(view: View, confidence: float) -> dict[str, Any]:
    """JSON value: ``capability``, the rows of `limits`; empty without limits and for joints of different weight."""
    counted = bool(view.limits) and not view.weighted
    return {"capability": text.records(limits(view, confidence)) if counted else []}
