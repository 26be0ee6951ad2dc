"""Intervals for Sobol' points and Latin hypercubes: independent replicates of the whole campaign.

The joints of such a campaign are not independent of each other, so formulas for independent samples do not give the
uncertainty of its estimates. Campaigns of different seeds are independent.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tolstat.analysis.exceedance import FloatArray


class Replicated(NamedTuple):
    """Mean of the replicates' estimates.

    Attributes
    ----------
    estimate, lower, upper : ndarray, shape (...)
        Mean of the replicates and its interval, in the unit of the estimates.
    n : int
        Replicates.
    """

    estimate: FloatArray
    lower: FloatArray
    upper: FloatArray
    n: int


def interval(
    estimates: ArrayLike, confidence: float = 0.95, least: float = -np.inf, most: float = np.inf
) -> Replicated:
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
    Replicated
        Estimates and intervals.

    Raises
    ------
    ValueError
        When there are fewer than two replicates, or they agree in every digit, as replicates of one seed do.
    """
    from scipy.special import stdtrit

    values = np.asarray(estimates, dtype=float)
    n = len(values) if values.ndim else 0
    if n < 2:
        raise ValueError(f"{n} replicates: give two or more, of different sampling.seed")
    if n * values[0].size > 2 and (values == values[0]).all() and not np.isin(values[0], (least, most)).all():
        raise ValueError("the replicates are all equal: give campaigns of different sampling.seed")
    mean = values.mean(axis=0)
    half = stdtrit(n - 1, 0.5 * (1.0 + confidence)) * values.std(axis=0, ddof=1) / np.sqrt(n)
    return Replicated(mean, np.maximum(mean - half, least), np.minimum(mean + half, most), n)
