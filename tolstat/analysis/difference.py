"""Did it change anything? Differences between the joints of two studies, B less A, with intervals.

Joints that share their random numbers are compared one by one (*paired*): the scatter that both of a pair have in
common cancels, so the difference is known much better than either side. The interval of a difference of independent
estimates is recovered from the intervals of both sides, with separate lengths below and above the estimate (method of
variance estimates recovery, Newcombe 1998, Zou and Donner 2008), so rare or skew quantities are not taken as normal.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.analysis import quantile
from tolstat.analysis.exceedance import FloatArray, clopper_pearson
from tolstat.common.shown import shown

RESAMPLES = 500
"""Number of resamples in the bootstrap of paired quantiles."""
BEYOND = 50
"""Minimum number of pairs on either side of a quantile for the bootstrap, which with fewer repeats the same values."""
_REACH = 6.0
"""Half width of the ranks among which a resampled quantile is searched, in standard deviations of its rank."""
_SEED = 20


@shown
class ShareDifference(NamedTuple):
    """Share of the joints above levels in two studies; arrays of shape (m,), one value a level.

    Attributes
    ----------
    a, b : ndarray
        Shares in A and in B; with pairs, of the joints that have a valid load in both studies.
    n : int
        Number of pairs; without pairs, number of joints of the smaller side.
    only_a, only_b : ndarray of int
        Pairs above the level in A only, and in B only; without pairs, joints of A, and of B, above the level.
    estimate, lower, upper : ndarray
        Share of B less that of A and its interval, pointwise; NaN ends for dependent samples.
    p : ndarray
        p-value of McNemar's test (1947), exact; NaN without pairs and for dependent samples.
    bound_lower, bound_upper : ndarray
        Estimate with each joint without a valid load counted above the level in A and below it in B, and vice versa.
    outer_lower, outer_upper : ndarray
        Lower end of the interval of `bound_lower`, upper end of the interval of `bound_upper`.
    """

    a: FloatArray
    b: FloatArray
    n: int
    only_a: NDArray[np.intp]
    only_b: NDArray[np.intp]
    estimate: FloatArray
    lower: FloatArray
    upper: FloatArray
    p: FloatArray
    bound_lower: FloatArray
    bound_upper: FloatArray
    outer_lower: FloatArray
    outer_upper: FloatArray


@shown
class Difference(NamedTuple):
    """A statistic in two studies: its values `a` and `b`, `estimate` = b - a, and the interval of that."""

    a: float
    b: float
    estimate: float
    lower: float
    upper: float


def shares(
    a: ArrayLike, b: ArrayLike, levels: ArrayLike, paired: bool, confidence: float = 0.95, iid: bool = True
) -> ShareDifference:
    """Difference of the shares of joints above levels.

    Parameters
    ----------
    a, b : array_like, shape (n,) and (k,)
        Load of each joint in the two studies, NaN where a joint has no valid load. Paired: n = k, in the same order.
    levels : array_like, shape (m,)
        Levels, in the unit of the loads.
    paired : bool
        Whether joint i has the same random numbers in both studies.
    confidence : float
        Confidence level of the intervals.
    iid : bool
        Whether the joints of each study are independent samples.

    Returns
    -------
    ShareDifference
        The interval is recovered from Clopper and Pearson's intervals of the two shares; with pairs, of the shares of
        pairs above the level in A only and in B only.

    Raises
    ------
    ValueError
        When the lengths of pairs differ or a side has no valid load.

    Examples
    --------
    >>> a = [650.0, 690.0, 705.0, 640.0]
    >>> b = [660.0, 710.0, 720.0, 650.0]
    >>> found = shares(a, b, [700.0], paired=True)
    >>> found.only_a.tolist(), found.only_b.tolist(), found.estimate.tolist(), found.p.tolist()
    ([0], [1], [0.25], [1.0])
    """
    x, y = _sides(a, b, paired)
    level = np.atleast_1d(np.asarray(levels, dtype=float))
    found = _interval(*_valid(x, y, paired), level, paired, confidence)
    least = _interval(np.nan_to_num(x, nan=np.inf), np.nan_to_num(y, nan=-np.inf), level, paired, confidence)
    most = _interval(np.nan_to_num(x, nan=-np.inf), np.nan_to_num(y, nan=np.inf), level, paired, confidence)
    none = np.full(level.shape, np.nan)
    p = _mcnemar(found.only_a, found.only_b) if paired and iid else none
    found = found._replace(p=p, bound_lower=least.estimate, bound_upper=most.estimate)
    if not iid:
        return found._replace(lower=none, upper=none, outer_lower=none, outer_upper=none)
    return found._replace(outer_lower=least.lower, outer_upper=most.upper)


def quantiles(
    a: ArrayLike, b: ArrayLike, share: float, paired: bool, confidence: float = 0.95, iid: bool = True
) -> Difference:
    """Difference of the loads that a share of the joints stays at or below.

    Parameters
    ----------
    a, b, paired, confidence, iid
        As in `shares`.
    share : float
        Between 0 and 1.

    Returns
    -------
    Difference
        With `BEYOND` or more pairs on either side of the quantile, the interval is the percentile bootstrap over pairs
        (Efron 1979); else it is recovered from the order-statistic intervals of both quantiles: wide for pairs, and
        infinite where there are too few joints.

    Raises
    ------
    ValueError
        As `shares`.
    """
    x, y = _valid(*_sides(a, b, paired), paired)
    of_a, of_b = (quantile.quantile(side, np.ones(side.size, int), share, confidence) for side in (x, y))
    estimate = of_b.estimate - of_a.estimate
    lower, upper = np.nan, np.nan
    if iid and paired and min(share, 1.0 - share) * x.size >= BEYOND:
        tail = 0.5 * (1.0 - confidence)
        resampled = np.quantile(_resampled(x, y, share), [tail, 1.0 - tail], method="inverted_cdf")
        lower, upper = min(float(resampled[0]), estimate), max(float(resampled[1]), estimate)
    elif iid:
        rho = _correlation(x <= of_a.estimate, y <= of_b.estimate) if paired else 0.0
        below, above = _recovered(
            (of_b.estimate - of_b.lower, of_b.upper - of_b.estimate),
            (of_a.estimate - of_a.lower, of_a.upper - of_a.estimate),
            rho,
        )
        lower, upper = estimate - float(below), estimate + float(above)
    return Difference(of_a.estimate, of_b.estimate, estimate, lower, upper)


def means(a: ArrayLike, b: ArrayLike, paired: bool, confidence: float = 0.95, iid: bool = True) -> Difference:
    """Difference of the mean loads, with Student's interval for paired differences, else Welch's (1947).

    Parameters
    ----------
    a, b, paired, confidence, iid
        As in `shares`.

    Returns
    -------
    Difference
        The interval assumes nearly normal means: loads whose mean is dominated by a few joints need more joints.

    Raises
    ------
    ValueError
        As `shares`.
    """
    from scipy.special import stdtrit

    x, y = _valid(*_sides(a, b, paired), paired)
    of_a, of_b = float(x.mean()), float(y.mean())
    if not iid or min(x.size, y.size) < 2:
        return Difference(of_a, of_b, of_b - of_a, np.nan, np.nan)
    if paired:
        error, degrees = float(np.std(y - x, ddof=1) / np.sqrt(x.size)), x.size - 1.0
    else:
        parts = np.array([x.var(ddof=1) / x.size, y.var(ddof=1) / y.size])
        error = float(np.sqrt(parts.sum()))
        weights = (parts**2 / np.array([x.size - 1.0, y.size - 1.0])).sum()
        degrees = parts.sum() ** 2 / weights if weights else x.size + y.size - 2.0
    half = float(stdtrit(degrees, 0.5 * (1.0 + confidence))) * error
    return Difference(of_a, of_b, of_b - of_a, of_b - of_a - half, of_b - of_a + half)


def _sides(a: ArrayLike, b: ArrayLike, paired: bool) -> tuple[FloatArray, FloatArray]:
    x, y = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    if x.ndim != 1 or y.ndim != 1 or (paired and x.shape != y.shape):
        raise ValueError(f"loads {x.shape} and {y.shape} are not those of pairs")
    return x, y


def _valid(x: FloatArray, y: FloatArray, paired: bool) -> tuple[FloatArray, FloatArray]:
    in_x, in_y = np.isfinite(x), np.isfinite(y)
    if paired:
        in_x = in_y = in_x & in_y
    if not (in_x.any() and in_y.any()):
        raise ValueError("there is no joint with a valid load to compare")
    return x[in_x], y[in_y]


def _interval(x: FloatArray, y: FloatArray, level: FloatArray, paired: bool, confidence: float) -> ShareDifference:
    """Shares, counts, estimate and interval for loads without NaN; the other fields are NaN."""
    a, b = _above(x, level), _above(y, level)
    only_a, only_b, correlation = a, b, np.zeros(level.shape)
    if paired:
        up, down = y > x, y < x
        only_b = _above(y[up], level) - _above(x[up], level)
        only_a = _above(x[down], level) - _above(y[down], level)
        one, other = only_a / x.size, only_b / x.size
        with np.errstate(divide="ignore", invalid="ignore"):  # multinomial counts: negatively correlated
            correlation = -np.nan_to_num(np.sqrt(one * other / ((1.0 - one) * (1.0 - other))))
    (p, q), (n, m) = (only_a / x.size, only_b / y.size), (x.size, y.size)
    (lower_p, upper_p), (lower_q, upper_q) = (
        clopper_pearson(only_a, n, confidence),
        clopper_pearson(only_b, m, confidence),
    )
    lower, upper = _recovered((q - lower_q, upper_q - q), (p - lower_p, upper_p - p), correlation)
    d, none = q - p, np.full(level.shape, np.nan)
    return ShareDifference(
        a / x.size, b / y.size, min(n, m), only_a, only_b, d, d - lower, d + upper, none, none, none, none, none
    )


def _above(values: FloatArray, level: FloatArray) -> NDArray[np.intp]:
    return np.asarray(values.size - np.searchsorted(np.sort(values), level, side="right"))


def _recovered(
    of_b: tuple[ArrayLike, ArrayLike], of_a: tuple[ArrayLike, ArrayLike], rho: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Lengths of the interval of b - a below and above the estimate, from those of b and of a, correlated by `rho`."""
    ends = []
    for one, other in ((of_b[0], of_a[1]), (of_b[1], of_a[0])):
        i, j = np.asarray(one, dtype=float), np.asarray(other, dtype=float)
        infinite = np.isinf(i) | np.isinf(j)
        i, j = np.where(infinite, 0.0, i), np.where(infinite, 0.0, j)
        length = np.sqrt(np.maximum(i**2 + j**2 - 2.0 * np.asarray(rho) * i * j, 0.0))
        ends.append(np.where(infinite, np.inf, length))
    return ends[0], ends[1]


def _correlation(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> float:
    if one.all() or other.all():
        return 0.0
    return float(np.corrcoef(one, other)[0, 1])


def _mcnemar(only_a: NDArray[np.intp], only_b: NDArray[np.intp]) -> FloatArray:
    from scipy.special import bdtr

    least, both = np.minimum(only_a, only_b), only_a + only_b
    found: FloatArray = np.minimum(2.0 * bdtr(least.astype(float), np.maximum(both, 1), 0.5), 1.0)
    return np.where(both > 0, found, 1.0)


def _resampled(x: FloatArray, y: FloatArray, share: float) -> FloatArray:
    """Differences of the quantiles of resampled pairs, (RESAMPLES,).

    A resampled quantile is one of the values whose rank is near the quantile's. Only pairs with such a value in A or B
    are resampled one by one; of the other pairs, only the numbers resampled below and above the quantile in A and B.
    """
    n = x.size
    rank = int(np.ceil(n * share * (1.0 - 4e-16)))
    reach = int(np.ceil(_REACH * np.sqrt(n * share * (1.0 - share)))) + 1
    ranks = np.empty((2, n), dtype=np.intp)
    for own, values in zip(ranks, (x, y), strict=True):
        own[np.argsort(values, kind="stable")] = np.arange(1, n + 1)
    near = (np.abs(ranks - rank) <= reach).any(axis=0)
    below = ranks[:, ~near] < rank
    cells = np.bincount(2 * below[0] + below[1], minlength=4)
    k = int(near.sum())
    shares = np.concatenate([np.full(k, 1.0 / n), cells / n])
    drawn = np.random.default_rng(_SEED).multinomial(n, shares, size=RESAMPLES)
    found = []
    for values, far in ((x[near], drawn[:, k + 2] + drawn[:, k + 3]), (y[near], drawn[:, k + 1] + drawn[:, k + 3])):
        order = np.argsort(values, kind="stable")
        reached = far[:, None] + np.cumsum(drawn[:, order], axis=1) >= rank
        found.append(values[order][np.argmax(reached, axis=1)])
    return np.asarray(found[1] - found[0])
