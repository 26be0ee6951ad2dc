"""Sobol' indices from joints with exchanged errors: they need joints of their own, but no assumption on the load.

Joints A and B are independent; AB_i is A with the errors of group i from B. So A and AB_i have all errors but group i
in common, B and AB_i have group i alone in common.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.analysis.binomial import clopper_pearson, half_width
from tolstat.analysis.estimates import Estimate
from tolstat.common.loads import FloatArray

FEWEST = 50
"""Minimum number of points for an index."""
WIDER = 1.2
"""Factor on standard errors: those of few points are too small (measured)."""


class Indices(NamedTuple):
    """Sobol' indices.

    Attributes
    ----------
    first, total : Estimate of ndarray, shape (d,)
        Share of the load's variance that a group explains alone, and in which it takes part, interactions included.
    variance : float
        Variance of the load, in its unit squared.
    """

    first: Estimate[FloatArray]
    total: Estimate[FloatArray]
    variance: float


def indices(a: ArrayLike, b: ArrayLike, ab: ArrayLike, confidence: float = 0.95) -> Indices:
    """First-order (Saltelli et al. 2010) and total indices (Jansen 1999) of a load.

    The same estimators as those of ``scipy.stats.sobol_indices``. A point without valid loads of A and B is left out;
    a joint AB_i without a valid load is left out of the indices of group i only.

    Parameters
    ----------
    a, b : array_like, shape (n,)
        Load of the joints A and B of each point, NaN without a valid one.
    ab : array_like, shape (n, d)
        Load of the joints AB_i.
    confidence : float
        Confidence level of the intervals. Indices are ratios of two means over the points: intervals are Fieller's
        (1954), whose upper end is further away where the variance comes from few points. Their standard errors are
        taken `WIDER` times as large.

    Returns
    -------
    Indices
        Not corrected for chance: the estimate of an index near 0 may be negative. Intervals are within 0 to 1.

    Raises
    ------
    ValueError
        When the load does not scatter, an index has fewer than `FEWEST` points, or so few points
        make up the variance that its own interval contains zero: decompose the logarithm of such a load.

    Examples
    --------
    >>> import numpy as np
    >>> a, b = np.random.default_rng(1).normal(size=(2, 4000, 2))
    >>> load = lambda x: x[..., 0] + 2.0 * x[..., 1]
    >>> mixed = np.stack([np.where([True, False], b, a), np.where([False, True], b, a)], axis=1)
    >>> indices(load(a), load(b), load(mixed)).total.estimate.round(1).tolist()
    [0.2, 0.8]
    """
    x, y, mixed = _checked(a, b, ab)
    middle = 0.5 * (x.mean() + y.mean())
    x, y = x - middle, y - middle
    square = 0.5 * (x**2 + y**2)
    moved = mixed - middle - x[:, None]
    half = float(half_width(confidence))
    first, total = (_index(term, square, half) for term in (moved * y[:, None], 0.5 * moved**2))
    return Indices(first, total, float(square.mean()))


def of_event(a: ArrayLike, b: ArrayLike, ab: ArrayLike, confidence: float = 0.95) -> Indices:
    """Indices of an event, such as a load above its limit; parameters and errors raised as in `indices`.

    The loads are 1 where the event happens, and 0. The estimates are those of `indices`. Their numerators are sums of
    counts of points whose joint AB_i differs from A, which are few for rare events: the interval is recovered from
    those of Clopper and Pearson of these counts and of the share of the event (Zou and Donner 2008).

    Examples
    --------
    >>> import numpy as np
    >>> a, b = np.random.default_rng(1).normal(size=(2, 4000, 2))
    >>> above = lambda x: x[..., 0] + 2.0 * x[..., 1] > 3.0
    >>> mixed = np.stack([np.where([True, False], b, a), np.where([False, True], b, a)], axis=1)
    >>> of_event(above(a), above(b), above(mixed)).total.estimate.round(1).tolist()
    [0.5, 0.9]
    """
    x, y, mixed = _checked(a, b, ab)
    share = float(0.5 * (x.mean() + y.mean()))
    valid = np.isfinite(mixed)
    counts = valid.sum(axis=0)
    up, down = (valid & ((mixed - x[:, None]) == sign) for sign in (1.0, -1.0))
    with_b = (y == 1.0)[:, None]
    cells = np.array([(way & of_b).sum(axis=0) for way in (up, down) for of_b in (with_b, ~with_b)])
    signs = np.array([1.0 - share, -share, share - 1.0, share])[:, None]
    low, high = (float(end) for end in clopper_pearson(share * 2 * len(x), 2 * len(x), confidence))
    of_ends = low * (1.0 - low), high * (1.0 - high)
    variance = min(of_ends), share * (1.0 - share), 0.25 if low < 0.5 < high else max(of_ends)
    first = _recovered(cells, signs, counts, variance, confidence)
    total = _recovered((up | down).sum(axis=0)[None], np.array([[0.5]]), counts, variance, confidence)
    return Indices(first, total, variance[1])


def _checked(a: ArrayLike, b: ArrayLike, ab: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Loads of the points that have those of A and B."""
    x, y, mixed = (np.asarray(v, dtype=float) for v in (a, b, ab))
    both = np.isfinite(x) & np.isfinite(y)
    x, y, mixed = x[both], y[both], mixed[both]
    valid = np.isfinite(mixed)
    if valid.sum(axis=0).min(initial=len(x)) < FEWEST:
        raise ValueError(f"{valid.sum(axis=0).min(initial=len(x))} points with valid loads are too few: give {FEWEST}")
    if np.ptp([x, y]) == 0:
        raise ValueError("the load does not scatter")
    return x, y, mixed


def _recovered(
    cells: NDArray[np.intp],
    signs: FloatArray,
    counts: NDArray[np.intp],
    variance: tuple[float, float, float],
    confidence: float,
) -> Estimate[FloatArray]:
    """Signed sum of counts, (k, d), as shares of the points, over the variance, of which both ends are given."""
    shares = cells / counts
    low, high = clopper_pearson(cells, counts, confidence)
    least, estimate, most = variance
    index = (signs * shares).sum(axis=0) / estimate
    down, up = signs * (shares - low), signs * (high - shares)
    lengths = []
    for away, back in ((np.where(signs > 0, down, up), most), (np.where(signs > 0, up, down), least)):
        of_variance = index * (estimate / back - 1.0)
        lengths.append(np.sqrt((away**2).sum(axis=0) / estimate**2 + of_variance**2))
    return _within(index, index - lengths[0], index + lengths[1])


def _index(terms: FloatArray, square: FloatArray, half: float) -> Estimate[FloatArray]:
    """Ratio of the mean of `terms`, (n, d), NaN where missing, to the mean of `square`, (n,), with its interval.

    The interval contains each ratio r for which the mean of terms - r square is within `half` standard errors of zero.
    """
    valid = np.isfinite(terms)
    counts = valid.sum(axis=0)
    mean, variance = np.where(valid, terms, 0.0).sum(axis=0) / counts, square.mean()
    away, spread = np.where(valid, terms - mean, 0.0), np.where(valid, (square - variance)[:, None], 0.0)
    factor = (WIDER * half / counts) ** 2
    # the condition is a - 2 b r + c r^2 <= 0
    c = variance**2 - factor * (spread**2).sum(axis=0)
    b = mean * variance - factor * (away * spread).sum(axis=0)
    a = mean**2 - factor * (away**2).sum(axis=0)
    if (c <= 0).any():
        raise ValueError("few points make up the variance of the load: decompose its logarithm")
    root = np.sqrt(np.maximum(b**2 - a * c, 0.0))
    return _within(mean / variance, (b - root) / c, (b + root) / c)


def _within(index: FloatArray, lower: FloatArray, upper: FloatArray) -> Estimate[FloatArray]:
    """Index with its interval, of which the part outside 0 to 1 is cut off: no index is there."""
    return Estimate(index, np.clip(lower, 0.0, 1.0), np.clip(upper, 0.0, 1.0))
