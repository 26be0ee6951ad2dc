"""Lives of a campaign's bearings in tables: quantiles, share below the required life, how bearings are loaded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
import pandas as pd

from tolstat.analysis.sample import Sample, total_interval
from tolstat.common.load_kinds import PINS
from tolstat.common.tables import LIFE_EXPONENT, Mode
from tolstat.display import text
from tolstat.joint.bearing import FOR_LIFE
from tolstat.questions.bearing_life.lives import PLACES, Lives, bearing_of, keeps_loads, lives_of
from tolstat.store import points
from tolstat.store.view import View

SHARES = (0.5, 0.9, 0.99)
"""Shares of the joints that reach a life."""
ANY = "any"
"""At least one of the four bearings."""
MOSTLY = 0.5
"""Share of a revolution above which a bearing counts as loaded in a mode."""
LOADED = {"one_end": Mode.ONE_POINT, "opposite_ends": Mode.TWO_POINT, "along": Mode.UNIFORM}
"""Contact mode of each way to load a bearing."""


def quantiles(lives: Lives, shares: Sequence[float] = SHARES, confidence: float = 0.95) -> pd.DataFrame:
    """Life that a share of the joints reaches, and the equivalent load that it stays below.

    Parameters
    ----------
    lives : Lives
        Lives of the joints.
    shares : sequence of float
        Shares of the joints, each between 0 and 1.
    confidence : float
        Confidence level of the intervals.

    Returns
    -------
    DataFrame
        One row per place of `PLACES` and share: ``place``, ``share``; lives in h: ``nominal``, ``estimate``, ``lower``,
        ``upper``, ``bound_lower``, ``bound_upper`` (joints without a life among the shortest, the longest); ``rating``
        (N, load rating C with which the share reaches the required life) with ``_lower`` and ``_upper``;
        ``nominal_load`` and ``load`` (N, equivalent load that the share of the joints stays at or below; NaN for the
        joint); ``n``, ``n_failed`` (those without a rating included), ``n_unsettled``, ``confidence``. Ends are 0 or
        infinite where the joints are too few.
    """
    rows = []
    for place in PLACES:
        rate = lives.rate(place)
        for share in shares:
            q = rate.quantile(share, confidence)
            load = lives.load(place) if place in PINS else None
            rows.append(
                {
                    "place": place,
                    "share": share,
                    "nominal": _life(rate.nominal),
                    "estimate": _life(q.estimate),
                    "lower": _life(q.upper),
                    "upper": _life(q.lower),
                    "bound_lower": _life(q.bound_upper),
                    "bound_upper": _life(q.bound_lower),
                    "rating": _rating(q.estimate, lives),
                    "rating_lower": _rating(q.lower, lives),
                    "rating_upper": _rating(q.upper, lives),
                    "nominal_load": load.nominal if load else np.nan,
                    "load": load.quantile(share).estimate if load else np.nan,
                    "n": q.n,
                    "n_failed": q.n_failed,
                    "n_unsettled": q.n_unsettled,
                    "confidence": confidence,
                }
            )
    return pd.DataFrame(rows)


def _rating(rate: float, lives: Lives) -> float:
    """Load rating, N, of bearings with which a life of so many 1/h becomes the required one."""
    return float(lives.bearing.C * (max(rate, 0.0) * lives.required) ** (1.0 / LIFE_EXPONENT))


def _life(rate: float) -> float:
    """Reciprocal, h; a rate of zero or of no joint (-inf) is an infinite life."""
    return np.inf if rate <= 0.0 else 1.0 / rate


def below(lives: Lives, confidence: float = 0.95) -> pd.DataFrame:
    """Share of the joints whose life is below the required one.

    Returns
    -------
    DataFrame
        One row per place of `PLACES`: ``place``, ``required`` (h), the fields of `analysis.estimates.Exceedance` but
        its level (``count`` are the joints below the required life; bounds have joints without a life above and
        below), ``total_lower`` and ``total_upper`` (cover sampling, joints without a life and, if known, the numerical
        error), ``confidence``. No rows without a required life.
    """
    rows = []
    for place in PLACES if np.isfinite(lives.required) else ():
        rate, level = lives.rate(place), 1.0 / lives.required
        found = asdict(rate.above(level, confidence))
        low, high = total_interval(_with_error(rate, lives.load_error), level, confidence)
        del found["level"]
        head = {"place": place, "required": lives.required}
        rows.append(head | found | {"total_lower": low, "total_upper": high, "confidence": confidence})
    return pd.DataFrame(rows)


def _with_error(rate: Sample, error: float) -> tuple[Sample, ...]:
    """Rates, and those with equivalent loads reduced and increased by their numerical error if it is known."""
    if np.isnan(error):
        return (rate,)
    factors = (max(0.0, 1.0 - error) ** LIFE_EXPONENT, (1.0 + error) ** LIFE_EXPONENT)
    return rate, *(rate.shifted((factor - 1.0) * rate.values) for factor in factors)


def contacts(view: View, confidence: float = 0.95) -> pd.DataFrame:
    """Share of the joints in which a bearing is mostly loaded at one end, at opposite ends, or along its length.

    Of several operating points each counts by its share of the revolutions.

    Returns
    -------
    DataFrame
        One row per pin, and one for `ANY` of them: ``place``; ``one_end``, ``opposite_ends`` and ``along``, shares of
        the joints in which this holds for more than `MOSTLY` of a revolution, with ``_lower`` and ``_upper``.
        No rows if the study does not keep the contact modes.
    """
    if sum(column.field == "mode_share" for column in view.columns) < len(PINS) * len(Mode):
        return pd.DataFrame()
    modes = [part.read_results(("mode_share",))["mode_share"] for part in view.parts]
    spent = np.tensordot(points.shares_of_revolutions(view), np.stack(modes), 1)
    rows = []
    for place in (*PINS, ANY):
        own = spent[:, [PINS.index(place)]] if place in PINS else spent
        row: dict[str, Any] = {"place": place}
        for name, mode in LOADED.items():
            values = own[:, :, mode].max(axis=1)
            found = Sample.of(values, view.status, view.design).above(MOSTLY, confidence)
            row |= {name: found.estimate, f"{name}_lower": found.lower, f"{name}_upper": found.upper}
        rows.append(row)
    return pd.DataFrame(rows)


def summary(view: View, confidence: float) -> dict[str, Any]:
    """JSON value ``bearing_life`` with the rows of `quantiles`, `below` and `contacts`; empty without bearings."""
    bearing = bearing_of(view)
    if bearing is None or bearing.lacking(FOR_LIFE) or not (view.sampled and keeps_loads(view)):
        return {}
    lives = lives_of(view)
    return {
        "bearing_life": {
            "symbol": lives.bearing.symbol,
            "critical_amplitude": lives.bearing.critical_amplitude,
            "unrated": lives.unrated,
            "load_error": None if np.isnan(lives.load_error) else lives.load_error,
            "lives": text.records(quantiles(lives, confidence=confidence)),
            "below_required": text.records(below(lives, confidence)),
            "contacts": text.records(contacts(view, confidence)),
        }
    }
