"""Did it change anything? Differences between the joints of two studies, B less A, with intervals.

Joints that share their random numbers are compared one by one (*paired*): the scatter that both of a pair have in
common cancels, so the difference is known much better than either side. The interval of a difference of independent
estimates is recovered from the intervals of both sides, with separate lengths below and above the estimate (method of
variance estimates recovery, Newcombe 1998, Zou and Donner 2008), so rare or skew quantities are not taken as normal.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.analysis.binomial import clopper_pearson
from tolstat.analysis.design import Design
from tolstat.analysis.estimates import Column, Estimate, Quantile
from tolstat.analysis.sample import Sample
from tolstat.common.late import special
from tolstat.common.loads import FloatArray

RESAMPLES = 500
"""Number of resamples in the bootstrap of paired quantiles."""
BEYOND = 50
"""Minimum number of pairs on either side of a quantile for the bootstrap, which with fewer repeats the same values."""
_REACH = 6.0
"""Half width of the ranks among which a resampled quantile is searched, in standard deviations of its rank."""
_SEED = 20


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


class Difference(NamedTuple):
    """A statistic in two studies: its values `a` and `b`, `estimate` = b - a, and the interval of that."""

    a: float
    b: float
    estimate: float
    lower: float
    upper: float


def shares(a: Sample, b: Sample, levels: ArrayLike, paired: bool, confidence: float = 0.95) -> ShareDifference:
    """Difference of the shares of joints above levels.

    Parameters
    ----------
    a, b : Sample
        Load of the joints in the two studies. Paired: of as many joints, in the same order.
    levels : array_like, shape (m,)
        Levels, in the unit of the loads.
    paired : bool
        Whether joint i has the same random numbers in both studies.
    confidence : float
        Confidence level of the intervals.

    Returns
    -------
    ShareDifference
        The interval is recovered from the intervals of the two shares, as their designs have them; with pairs, from
        Clopper and Pearson's of the shares of pairs above the level in A only and in B only.

    Raises
    ------
    ValueError
        When a side has no valid load.

    Examples
    --------
    >>> a = Sample.of([650.0, 690.0, 705.0, 640.0], [1] * 4)
    >>> b = Sample.of([660.0, 710.0, 720.0, 650.0], [1] * 4)
    >>> found = shares(a, b, [700.0], paired=True)
    >>> found.only_a.tolist(), found.only_b.tolist(), found.estimate.tolist(), found.p.tolist()
    ([0], [1], [0.25], [1.0])
    """
    _valid(a, b, paired)
    level = np.atleast_1d(np.asarray(levels, dtype=float))
    kind = _pairs if paired else _apart
    sides = (a.value, b.value), (a.upper, b.lower), (a.lower, b.upper)
    fields, least, most = (kind(x, y, a.design, b.design, level, confidence) for x, y in sides)
    p = np.full(level.shape, np.nan)
    if paired and a.design.independent and b.design.independent:
        only_a, only_b = fields[3:5]
        p = np.minimum(2.0 * special.bdtr(np.minimum(only_a, only_b) + 0.0, np.maximum(only_a + only_b, 1), 0.5), 1.0)
    return ShareDifference._make((*fields, p, least[5], most[5], least[6], most[7]))


def quantiles(a: Sample, b: Sample, share: float, paired: bool, confidence: float = 0.95) -> Difference:
    """Difference of the loads that a share of the joints stays at or below.

    Parameters
    ----------
    a, b, paired, confidence
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
    a, b = _valid(a, b, paired)
    x, y = a.values, b.values
    of_a, of_b = (side.quantile(share, confidence) for side in (a, b))
    estimate = of_b.estimate - of_a.estimate
    lower, upper = np.nan, np.nan
    known = all(side.design.independent if paired else side.design.is_sample for side in (a, b))
    if known and paired and min(share, 1.0 - share) * x.size >= BEYOND:
        tail = 0.5 * (1.0 - max(a.design.level(confidence), b.design.level(confidence)))
        resampled = np.quantile(_resampled(x, y, share), [tail, 1.0 - tail], method="inverted_cdf")
        lower, upper = min(float(resampled[0]), estimate), max(float(resampled[1]), estimate)
    elif known:
        with np.errstate(divide="ignore", invalid="ignore"):  # NaN where all are below a quantile
            rho = np.nan_to_num(np.corrcoef(x <= of_a.estimate, y <= of_b.estimate)[0, 1]) if paired else 0.0
        below, above = _recovered(_lengths(of_b), _lengths(of_a), rho)
        lower, upper = estimate - float(below), estimate + float(above)
    return Difference(of_a.estimate, of_b.estimate, estimate, lower, upper)


def _valid(a: Sample, b: Sample, paired: bool) -> tuple[Sample, Sample]:
    """Joints with a valid load; of pairs, those that have one in both studies."""
    of_a, of_b = a.is_valid, b.is_valid
    if paired:
        of_a = of_b = of_a & of_b
    if not (of_a.any() and of_b.any()):
        raise ValueError("there is no joint with a valid load to compare")
    return a.only(of_a), b.only(of_b)


def _pairs(x: Column, y: Column, a: Design, b: Design, level: FloatArray, confidence: float) -> tuple[Any, ...]:
    """Fields of `ShareDifference` up to the interval, of pairs."""
    both, confidence = ~np.isnan(x.values) & ~np.isnan(y.values), max(a.level(confidence), b.level(confidence))
    of_a, of_b = x.values[both], y.values[both]
    n, up, down = of_a.size, of_b > of_a, of_b < of_a
    only_b = Column(of_b[up]).above(level) - Column(of_a[up]).above(level)
    only_a = Column(of_a[down]).above(level) - Column(of_b[down]).above(level)
    (lower_p, upper_p), (lower_q, upper_q) = (clopper_pearson(count, n, confidence) for count in (only_a, only_b))
    p, q = only_a / n, only_b / n
    with np.errstate(divide="ignore", invalid="ignore"):  # multinomial counts: negatively correlated
        correlation = -np.nan_to_num(np.sqrt(p * q / ((1.0 - p) * (1.0 - q))))
    lower, upper = _recovered((q - lower_q, upper_q - q), (p - lower_p, upper_p - p), correlation)
    if not (a.independent and b.independent):
        lower = upper = np.full(level.shape, np.nan)
    shares = Column(of_a).above(level) / n, Column(of_b).above(level) / n
    return *shares, n, only_a, only_b, q - p, q - p - lower, q - p + upper


def _apart(x: Column, y: Column, a: Design, b: Design, level: FloatArray, confidence: float) -> tuple[Any, ...]:
    """Fields of `ShareDifference` up to the interval, of joints that are no pairs."""
    p, q = a.shares(x, level, confidence), b.shares(y, level, confidence)
    lower, upper = _recovered(_lengths(q), _lengths(p), 0.0)
    d = q.estimate - p.estimate
    return p.estimate, q.estimate, min(x.n, y.n), x.above(level), y.above(level), d, d - lower, d + upper


def _lengths(x: Quantile | Estimate[FloatArray]) -> tuple[ArrayLike, ArrayLike]:
    """Lengths of an interval below and above its estimate."""
    return x.estimate - x.lower, x.upper - x.estimate


def _recovered(
    of_b: tuple[ArrayLike, ArrayLike], of_a: tuple[ArrayLike, ArrayLike], rho: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Lengths of the interval of b - a below and above the estimate, from those of b and of a, correlated by `rho`."""
    ends = []
    for length_b, length_a in ((of_b[0], of_a[1]), (of_b[1], of_a[0])):
        i, j = np.asarray(length_b, dtype=float), np.asarray(length_a, dtype=float)
        with np.errstate(invalid="ignore"):
            length = np.sqrt(np.maximum(i**2 + j**2 - 2.0 * np.asarray(rho) * i * j, 0.0))
        ends.append(np.where(np.isinf(i) | np.isinf(j), np.inf, length))
    return ends[0], ends[1]


def _resampled(x: FloatArray, y: FloatArray, share: float) -> FloatArray:
    """Differences of the quantiles of resampled pairs, (RESAMPLES,).

    A resampled quantile is one of the values whose rank is near the quantile's. Only pairs with such a value in A or B
    are resampled one by one; of the other pairs, only the numbers resampled below and above the quantile in A and B.
    """
    n = x.size
    rank = int(np.ceil(n * share * (1.0 - 4e-16)))
    reach = int(np.ceil(_REACH * np.sqrt(n * share * (1.0 - share)))) + 1
    ranks = np.empty((2, n), dtype=np.intp)
    for rank_of, values in zip(ranks, (x, y), strict=True):
        rank_of[np.argsort(values, kind="stable")] = np.arange(1, n + 1)
    near = (np.abs(ranks - rank) <= reach).any(axis=0)
    below = ranks[:, ~near] < rank
    cells = np.bincount(2 * below[0] + below[1], minlength=4)
    k = int(near.sum())
    shares = np.concatenate([np.full(k, 1.0 / n), cells / n])
    drawn = np.random.default_rng(_SEED).multinomial(n, shares, size=RESAMPLES)
    resampled = []
    for values, far in ((x[near], drawn[:, k + 2] + drawn[:, k + 3]), (y[near], drawn[:, k + 1] + drawn[:, k + 3])):
        order = np.argsort(values, kind="stable")
        reached = far[:, None] + np.cumsum(drawn[:, order], axis=1) >= rank
        resampled.append(values[order][np.argmax(reached, axis=1)])
    return np.asarray(resampled[1] - resampled[0])
