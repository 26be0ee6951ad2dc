"""Which load does a given share of the joints stay below? Quantiles with distribution-free intervals.

The interval's ends are order statistics (Wilks 1941): the inverse of the Clopper–Pearson interval, so that both tables
of a report agree. An end is infinite if there are too few joints for it.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tolstat.analysis.exceedance import FloatArray
from tolstat.analysis.sorted_loads import Sample, sort_out
from tolstat.common.shown import shown


@shown
class Quantile(NamedTuple):
    """Load that a share of the joints stays at or below.

    Attributes
    ----------
    share : float
        Share of the joints, between 0 and 1.
    n, n_failed, n_unsettled : int
        As in `exceedance.Exceedance`.
    estimate : float
        Smallest value that at least `share` of the valid joints do not exceed; NaN when none is valid.
    lower, upper : float
        Two-sided interval from the valid joints, ±inf when they are too few; NaN for dependent samples.
    bound_lower, bound_upper : float
        The estimate with every unresolved joint below all valid ones, and above all of them; ±inf if the quantile
        falls among the unresolved joints.
    """

    share: float
    n: int
    n_failed: int
    n_unsettled: int
    estimate: float
    lower: float
    upper: float
    bound_lower: float
    bound_upper: float


def quantile(
    values: ArrayLike, status: ArrayLike, share: float, confidence: float = 0.95, iid: bool = True
) -> Quantile:
    """Quantile of a load over the joints.

    Parameters
    ----------
    values, status : array_like, shape (n,)
        Load and `tables.Status` of each joint; leave the nominal joint out.
    share : float
        Share of the joints that stay at or below the quantile, 0 < share < 1.
    confidence : float
        Confidence level of the interval.
    iid : bool
        Whether the joints are independent samples; the interval is NaN when they are not.

    Returns
    -------
    Quantile
        Estimate, interval and bounds, in the unit of the values.

    Raises
    ------
    ValueError
        When `share` or `confidence` is not between 0 and 1, or the shapes differ.

    Examples
    --------
    >>> found = quantile(range(1, 101), [1] * 100, share=0.9)
    >>> found.estimate, found.lower, found.upper
    (90.0, 84.0, 96.0)
    """
    return of_sample(sort_out(values, status), share, confidence, iid)


def of_sample(sample: Sample, share: float, confidence: float = 0.95, iid: bool = True) -> Quantile:
    """Quantile of a load from loads that are sorted already; other parameters and errors raised as in `quantile`."""
    if not (0.0 < share < 1.0 and 0.0 < confidence < 1.0):
        raise ValueError(f"share {share} and confidence {confidence} must lie between 0 and 1")
    x, missing = sample.valid, sample.n_unresolved
    low, high = _interval_ranks(x.size, share, confidence) if iid else (0, 0)
    return Quantile(
        share,
        sample.n,
        sample.n_failed,
        sample.n_unsettled,
        _order(x, _rank(x.size, share)) if x.size else np.nan,
        _order(x, low) if iid else np.nan,
        _order(x, high) if iid else np.nan,
        _order(x, _rank(sample.n, share) - missing) if sample.n else -np.inf,
        _order(x, _rank(sample.n, share)),
    )


def wilks(share: float, confidence: float = 0.95) -> int:
    """Return the least number of joints whose largest load bounds the quantile from above (Wilks 1941, first order).

    With that many independent joints the largest of them exceeds the quantile with probability
    1 - share^n >= confidence.

    Parameters
    ----------
    share : float
        Share of the joints that stay at or below the quantile, 0 < share < 1.
    confidence : float
        Confidence level of the bound.

    Raises
    ------
    ValueError
        When `share` or `confidence` is not between 0 and 1.

    Examples
    --------
    >>> wilks(0.95), wilks(0.99)
    (59, 299)
    """
    if not (0.0 < share < 1.0 and 0.0 < confidence < 1.0):
        raise ValueError(f"share {share} and confidence {confidence} must lie between 0 and 1")
    return max(1, int(np.ceil(np.log1p(-confidence) / np.log(share))))


def _rank(n: int, share: float) -> int:
    """Rank (from 1) of the quantile in the empirical distribution, with slack for the rounding of ``n * share``."""
    return max(1, int(np.ceil(n * share * (1.0 - 4e-16))))


def _order(x: FloatArray, rank: int) -> float:
    """Value of a rank counted from 1; ±inf for a rank outside the sample."""
    if rank < 1:
        return -np.inf
    return float(x[rank - 1]) if rank <= x.size else np.inf


def _interval_ranks(n: int, share: float, confidence: float) -> tuple[int, int]:
    """Ranks l, u with P(x_l > q) and P(x_u < q) at most half the error probability each.

    With B ~ binomial(n, share) the number of joints at or below the quantile q, x_l > q means B < l and
    x_u < q means B >= u (continuous values; ties only widen the coverage).
    """
    from scipy.special import bdtr

    tail = 0.5 * (1.0 - confidence)
    if n == 0:
        return 0, 1

    def cdf(k: int) -> float:
        """P(B <= k), which rises with k = 0 .. n-1."""
        return float(bdtr(k, n, share))

    return bisect_right(range(n), tail, key=cdf), bisect_left(range(n), 1.0 - tail, key=cdf) + 1
