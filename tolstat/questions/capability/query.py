"""Capability of a production against the limits of its study, and its rare loads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from tolstat.analysis import binomial, capability, extreme
from tolstat.analysis.prediction import DELIVERY
from tolstat.analysis.sample import total_interval
from tolstat.common.loads import ANY_LIMIT
from tolstat.common.once import once
from tolstat.display import text
from tolstat.store import error_budget
from tolstat.store.view import View

if TYPE_CHECKING:
    import pandas as pd

NOT_NORMAL = 0.01
"""p-value of the test of normality below which the index of a normal load tells no share above the limit."""


def limits(view: View, confidence: float = 0.95, delivery: int = DELIVERY) -> pd.DataFrame:
    """Capability against each limit, and against all limits together.

    Parameters
    ----------
    view : View
        A campaign of a study with limits.
    confidence : float
        Confidence level of the intervals.
    delivery : int
        Number of joints of the next delivery.

    Returns
    -------
    DataFrame
        One row per limit: ``load``, ``unit``, ``limit``, ``n``, ``n_failed``, ``n_unsettled``, ``count`` (above);
        ``good`` and ``ppm`` with ``_lower`` and ``_upper``, total intervals: they cover sampling, unresolved joints
        and, if known, the numerical error; ``cpk`` (from quantiles) and ``cpk_normal`` with their ends, ``normal_p``,
        ``needed``; ``next_lower`` and ``next_upper``, prediction interval for the joints above the limit in the
        delivery. The last row, `ANY_LIMIT`, is for the largest ratio of load to limit of each joint. ``cpk_normal`` is
        NaN where the load has a long tail (`capability.LONGEST_TAIL`), both indices where unresolved joints matter
        (`analysis.binomial.unresolved_matter`).
    """
    import pandas as pd

    return pd.DataFrame(limit_rows(view, confidence, delivery))


def limit_rows(view: View, confidence: float = 0.95, delivery: int = DELIVERY) -> Sequence[Mapping[str, Any]]:
    """Rows of the table `limits`."""
    rows = []
    for load in [*view.loads(list(view.limits)), view.load(ANY_LIMIT)]:
        row = dict(good(view, load.name, confidence, delivery))
        c = capability.of_sample(load, row["limit"], confidence)
        names = [f"{key}{end}" for key in ("cpk", "cpk_normal") for end in ("", "_lower", "_upper")]
        row |= {key: getattr(c, key) for key in (*names, "normal_p", "needed")}
        if binomial.unresolved_matter(row["count"], row["n"], row["n_failed"] + row["n_unsettled"]):
            row |= dict.fromkeys(names, np.nan)
        rows.append(row)
    return rows


@once
def good(view: View, name: str = ANY_LIMIT, confidence: float = 0.95, delivery: int = DELIVERY) -> Mapping[str, Any]:
    """Yield, joints above in a million, and in the next delivery: the columns of `limits` that are no indices."""
    load = view.load(name)
    assert load.limit is not None
    loads, above = error_budget.with_error(view, load), load.above(load.limit, confidence)
    row = {"load": load.name, "unit": load.unit, "limit": load.limit, "n": above.n}
    row |= {key: getattr(above, key) for key in ("n_failed", "n_unsettled", "count")}
    low, high = total_interval(loads, load.limit, confidence)
    row |= {"good": 1.0 - above.estimate, "good_lower": 1.0 - high, "good_upper": 1.0 - low}
    row |= {"ppm": 1e6 * above.estimate, "ppm_lower": 1e6 * low, "ppm_upper": 1e6 * high}
    return row | error_budget.delivery(loads, load.limit, delivery, confidence)


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
        ``shape``, ``shape_lower``, ``shape_upper``, ``p`` (goodness of fit), ``n_above``, ``refusal`` (why the
        tail is not extrapolated, see `extreme.Tail`; else empty). SI units. Loads and shape are NaN where it is not.

    Raises
    ------
    ValueError
        When the tail has too few joints (`TooThinError`), or N is too small to lie in it.
    """
    import pandas as pd

    rows = []
    for name in names:
        load = view.load(name)
        tail = extreme.fit(load, None, confidence)
        for number in one_in:
            row: dict[str, object] = {"load": name, "unit": load.unit, "one_in": number}
            row |= tail.level(1.0 / number)._asdict()
            row["bound_lower"], row["bound_upper"] = tail.bounds(1.0 / number)
            row |= dict(zip(("fleet", "fleet_lower", "fleet_upper"), tail.largest(int(number)), strict=True))
            row |= dict(zip(("shape", "shape_lower", "shape_upper"), tail.shape, strict=True))
            if tail.refusal:
                row |= dict.fromkeys(list(row)[3:], np.nan)
            rows.append({**row, "p": tail.p, "n_above": tail.n_above, "refusal": tail.refusal})
    return pd.DataFrame(rows)


def summary(view: View, confidence: float) -> dict[str, Any]:
    """JSON value: ``capability``, the rows of `limits`; empty without limits and for joints of different weight."""
    counted = bool(view.limits) and view.design.refuses("index") is None
    return {"capability": text.records(limits(view, confidence)) if counted else []}
