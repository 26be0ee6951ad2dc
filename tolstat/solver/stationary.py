"""Stationary joints: their motion never repeats, but the distribution of their largest loads does not change.

Such a joint is watched for some revolutions. The largest loads of each revolution (block maxima) predict the
largest of ``solver.duration`` revolutions: values above a threshold follow a generalised Pareto distribution
(Pickands 1975), fitted by probability-weighted moments (Hosking and Wallis 1987). Heavy tails are excluded from the
fit: a driven joint with losses has bounded loads. Few revolutions do not tell how far the bound is: unless they show
that the tail is not exponential, the upper end is that of an exponential one if it is larger.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.estimates import Estimate
from tolstat.common.cardan import CARDAN
from tolstat.common.load_kinds import kinds, measure_of
from tolstat.common.loads import FloatArray
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import VALID, Status

DISCARDED_SHARE = 1 / 3
"""Share of the revolutions watched that is discarded at their beginning."""
MIN_REVOLUTIONS = 16
"""Minimum number of revolutions, without those discarded, to call a joint stationary."""
MAX_STANDARD_ERRORS, MAX_SPREAD_RATIO = 3.5, 3.0
"""Halves are alike when their means differ by no more than the first number of standard errors, or `NEGLIGIBLE`, and
when the ratio of their standard deviations is no more than the second, or these are negligible."""
NEGLIGIBLE = 0.01
"""Relative difference of a load that does not matter."""
TAIL_SHARE = 0.4
"""Share of the revolutions, those with the largest loads, that the tail's distribution is fitted to."""
DRAWS, SEED = 400, 5
"""Number of bootstrap samples, and the seed: one joint's interval is the same wherever it is computed."""
CONFIDENCE = 0.95
"""Probability that the interval contains the largest load."""
SHOWN_BOUNDED = 0.0005
"""Probability that an exponential tail is taken for a bounded one."""
PIVOTS = 40_000
"""Number of draws from which the constants of an exponential tail are computed."""
STEP_ERROR = 0.01
"""Relative error of a load that the time steps may cause: no interval is narrower on either side."""

Table = NDArray[np.void]


def classify(results: Table, blocks: Table, duration: int, mechanism: Mechanism = CARDAN) -> None:
    """Set the status of stationary joints; write their largest loads and, by kind of load, the widest interval.

    Parameters
    ----------
    results : ndarray of RESULT, shape (n,)
        Joints; written.
    blocks : ndarray of RESULT, shape (n, revolutions)
        Statistics of their last revolutions, revolution r at r modulo their number.
    duration : int
        Number of revolutions whose largest loads are predicted.
    mechanism : Mechanism
        What the joints are.
    """
    for i in np.flatnonzero(results["status"] == Status.NOT_SETTLED):
        if results["period"][i] > 1:
            results["status"][i] = Status.STATIONARY
            continue
        made = int(results["revolutions"][i])
        stored = min(made, blocks.shape[1])
        watched = blocks[i, np.arange(made - stored, made) % blocks.shape[1]][int(DISCARDED_SHARE * stored) :]
        if len(watched) < MIN_REVOLUTIONS or not is_stationary(watched, mechanism):
            continue
        results["status"][i] = Status.STATIONARY
        for kind in kinds(mechanism):
            loads = results[f"{kind}_max"]
            median, lower, upper = largest(watched[f"{kind}_max"].reshape(len(watched), -1), duration)
            loads[i] = median.reshape(loads[i].shape)
            size = np.where(median > 0, median, 1.0)
            results[f"{kind}_lower"][i], results[f"{kind}_upper"][i] = (lower / size).min(), (upper / size).max()


def fill_intervals(results: Table, mechanism: Mechanism = CARDAN) -> None:
    """Write the interval ends of joints that repeat, 1 (no uncertainty), and of joints without a valid load, NaN.

    Parameters
    ----------
    results : ndarray of RESULT, shape (n,)
        Joints; ends of stationary ones that never repeat are left as they are.
    mechanism : Mechanism
        What the joints are.
    """
    never = (results["status"] == Status.STATIONARY) & (results["period"] <= 1)
    for kind in kinds(mechanism):
        for end in ("lower", "upper"):
            ends = results[f"{kind}_{end}"]
            ends[~never] = np.where(np.isin(results["status"][~never], VALID), 1.0, np.nan)


def is_stationary(watched: Table, mechanism: Mechanism = CARDAN) -> bool:
    """Whether the largest loads of both halves of the revolutions watched are alike, in mean and in spread.

    Parameters
    ----------
    watched : ndarray of RESULT, shape (revolutions,)
        Statistics of successive revolutions.
    mechanism : Mechanism
        What the joint is.
    """
    return all(
        _alike(_largest(watched, kind.key), float(_largest(watched, measure_of(kind).key).max()))
        for kind in kinds(mechanism).values()
        if kind.decides
    )


def _largest(watched: Table, key: str) -> FloatArray:
    """Largest load of a kind in each revolution, (revolutions,)."""
    return np.asarray(watched[f"{key}_max"].max(axis=1))


def _alike(series: FloatArray, size: float) -> bool:
    half = len(series) // 2
    first, second = series[:half], series[-half:]
    small = NEGLIGIBLE * size
    spreads = np.array([first.std(ddof=1), second.std(ddof=1)])
    error = float(np.sqrt((spreads**2).sum() / half))
    level = abs(float(first.mean() - second.mean())) <= max(MAX_STANDARD_ERRORS * error, small)
    return level and bool(spreads.max() <= max(MAX_SPREAD_RATIO * spreads.min(), small))


def largest(values: FloatArray, duration: int) -> Estimate[FloatArray]:
    """Predict the largest of `duration` further revolutions from the largest loads of each of those watched.

    Parameters
    ----------
    values : ndarray, shape (n, m)
        m loads of n revolutions.
    duration : int
        Number of revolutions of the prediction.

    Returns
    -------
    Estimate
        Median, (m,), and ends between which the largest lies with `CONFIDENCE`; the uncertainty of the fit is included
        by fits to samples of the fitted distribution (parametric bootstrap). Upper end: see above.
    """
    n, m = values.shape
    count = max(3, round(TAIL_SHARE * n))
    ordered = np.sort(values, axis=0)
    threshold = ordered[n - count - 1]
    excesses = ordered[n - count :] - threshold
    scale, shape = _pareto(excesses)
    rng = np.random.default_rng(SEED)
    again = np.sort(_quantile(rng.random((DRAWS, count, m)), scale, shape), axis=1)
    scales, shapes = _pareto(again.swapaxes(0, 1))
    above = np.maximum(1, rng.binomial(duration, rng.beta(count + 0.5, n - count + 0.5, DRAWS)))[:, None]
    drawn = threshold + _quantile(rng.random((DRAWS, m)) ** (1 / above), scales, shapes)
    tail = 0.5 * (1 - CONFIDENCE)
    lower, median, upper = np.quantile(drawn, [tail, 0.5, 1 - tail], axis=0)
    shown, times = _of_exponential_tails(n, count, duration)
    exponential = threshold + times * excesses.mean(axis=0)
    upper = np.where(shape < shown, upper, np.maximum(upper, exponential))
    off = STEP_ERROR * np.abs(median)
    return Estimate(median, lower - off, upper + off)


@lru_cache
def _of_exponential_tails(n: int, count: int, duration: int) -> tuple[float, float]:
    """Shape below which a tail is shown to be bounded, and upper end of the largest load, for `n` revolutions.

    Both are quantiles of numbers whose distribution is the same for every exponential tail: the shape that is fitted to
    `count` excesses, and the largest excess of `duration` further revolutions over the mean of these.
    """
    rng = np.random.default_rng(SEED)
    excesses = np.sort(rng.standard_exponential((count, PIVOTS)), axis=0)
    above = np.maximum(1, rng.binomial(duration, rng.beta(count + 1, n - count, PIVOTS)))
    largest = -np.log1p(-(rng.random(PIVOTS) ** (1 / above)))
    shown = np.quantile(_pareto(excesses)[1], SHOWN_BOUNDED)
    return float(shown), float(np.quantile(largest / excesses.mean(axis=0), 0.5 * (1 + CONFIDENCE)))


def _pareto(excesses: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Scale and shape (negative: bounded) of the generalised Pareto distribution; excesses ascend along axis 0."""
    k = excesses.shape[0]
    plotting_position = (np.arange(1, k + 1) - 0.35) / k
    mean = excesses.mean(axis=0)
    moment = np.tensordot(1 - plotting_position, excesses, axes=(0, 0)) / k
    ratio = np.divide(mean, mean - 2 * moment, out=np.full_like(mean, 2.0), where=mean > 2 * moment * (1 + 1e-12))
    shape = np.clip(2 - ratio, -6.0, 0.0)
    return mean * (1 - shape), shape


def _quantile(p: FloatArray, scale: FloatArray, shape: FloatArray) -> FloatArray:
    """Quantiles of the generalised Pareto distribution."""
    safe = np.where(shape < -1e-9, shape, -1.0)
    bounded = scale / -safe * (1 - (1 - p) ** -safe)
    return np.asarray(np.where(shape < -1e-9, bounded, -scale * np.log1p(-p)))
