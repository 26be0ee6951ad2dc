"""Intervals for Sobol' points and Latin hypercubes: independent replicates of the whole campaign.

The joints of such a campaign are not independent of each other, so formulas for independent samples do not give the
uncertainty of its estimates. Campaigns of different seeds are independent, and so are the replicates of one file, which
are consecutive blocks of its joints.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.analysis.binomial import half_width
from tolstat.analysis.column import Column
from tolstat.analysis.design import Design, Listed, counts_by_group, or_independent
from tolstat.analysis.estimates import Estimate
from tolstat.common.loads import FloatArray


def interval(
    estimates: ArrayLike, confidence: float = 0.95, least: float = -np.inf, most: float = np.inf
) -> Estimate[FloatArray]:
    """Student's t interval of the expectation of an estimator, from independent replicates (Owen 2013, 17.4).

    The expectation is the true value for shares and means, which are unbiased. A quantile of few joints is biased, and
    more replicates do not reduce the bias. With few replicates of a skew distribution the coverage is too low.

    Parameters
    ----------
    estimates : array_like, shape (r, ...)
        Any statistics of each of r >= 2 replicates, each with its own seed and the same number of joints.
    confidence : float
        Confidence level of each interval by itself.
    least, most : float
        Bounds of the quantity, such as 0 and 1 for shares.

    Returns
    -------
    Estimate of ndarray, shape (...)
        Mean of the replicates and its interval.

    Raises
    ------
    ValueError
        When there are fewer than two replicates, or they agree in every digit, as replicates of one seed do.
    """
    values = np.asarray(estimates, dtype=float)
    n = len(values) if values.ndim else 0
    if n < 2:
        raise ValueError(f"{n} replicates: give two or more, of different sampling.seed")
    if n * values[0].size > 2 and (values == values[0]).all() and not np.isin(values[0], (least, most)).all():
        raise ValueError("the replicates are all equal: give campaigns of different sampling.seed")
    return _students_t(values, confidence, least, most)


def _students_t(values: FloatArray, confidence: float, least: float, most: float) -> Estimate[FloatArray]:
    n, mean = len(values), values.mean(axis=0)
    half = half_width(confidence, n - 1) * values.std(axis=0, ddof=1) / np.sqrt(n)
    return Estimate(mean, np.maximum(mean - half, least), np.minimum(mean + half, most))


class Replicated(Design):
    """Consecutive blocks of joints, each a set of Sobol' points or a Latin hypercube of its own.

    Parameters
    ----------
    n : int
        Number of joints.
    number : int
        Number of replicates, of equal size.
    method : str
        Sampling method.
    """

    claims = frozenset(("share", "quantile", "delivery"))
    of_quantiles = "over replicates"
    ranks_at_once = 2000
    innermost = True  # ends of shares are wider where few joints are above

    def __init__(self, n: int, number: int, method: str) -> None:
        self._blocks = np.arange(n) // (n // number)
        self._method = method
        self.interval = f"Student's t over {number} replicates"
        self.covers = f"bands: pointwise 95 % intervals of the settled joints, {self.interval}"

    def shares(self, x: Column, levels: FloatArray, confidence: float) -> Estimate[FloatArray]:
        """See `Design.shares`: Student's t over the shares of the replicates.

        It contains the share of all joints, and where few are on a side of a level (`design.FEW`) the interval of as
        many independent joints: no joint above in any replicate does not mean that none can be.
        """
        above, joints = counts_by_group(x, self._blocks, levels)
        estimate = self.estimate(x, levels)
        with np.errstate(invalid="ignore"):
            each = _students_t(above / joints[:, None], confidence, 0.0, 1.0)
        lower = np.fmin(each.lower, np.nan_to_num(estimate, nan=0.0))
        upper = np.fmax(each.upper, np.nan_to_num(estimate, nan=1.0))
        return or_independent(Estimate(estimate, lower, upper), x, levels, confidence)

    def only(self, joints: NDArray[np.intp] | NDArray[np.bool_]) -> Design:
        """See `Design.only`: parts of replicates are no replicates."""
        return Listed(self._method)
