"""Which share of the joints exceeds a load, and which load is exceeded by a share? For arrays of loads.

Two uncertainties are reported separately. *Sampling*: other joints could have been drawn; an interval covers it.
*Unresolved joints*: a joint that failed or did not settle has no valid load; counting all of them below the level, then
all of them above it, bounds their effect. They are never dropped silently.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from tolstat.analysis.estimates import Exceedance, Quantile
from tolstat.analysis.listed import Listed
from tolstat.analysis.sample import Sample
from tolstat.analysis.weighted import Weighted


def exceedance(
    values: ArrayLike, status: ArrayLike, level: float, confidence: float = 0.95, iid: bool = True
) -> Exceedance:
    """Share of the joints whose load is above one level.

    Parameters
    ----------
    values, status : array_like, shape (n,)
        Load and `tables.Status` of each joint; leave the nominal joint out.
    level : float
        Level, in the unit of the values; a load equal to it does not exceed it.
    confidence : float
        Confidence level of the intervals, which are Clopper and Pearson's.
    iid : bool
        Whether the joints are independent samples; the intervals are NaN when they are not (Sobol', Latin
        hypercube, sweep), since Clopper–Pearson holds for independent samples only.

    Returns
    -------
    Exceedance
        Estimate, interval and bounds.

    Raises
    ------
    ValueError
        When the shapes differ, the level is NaN, or the confidence is not between 0 and 1.

    Examples
    --------
    >>> load = [640.0, 655.0, 720.0, 690.0]  # N, the largest of each joint
    >>> found = exceedance(load, status=[1, 1, 1, 2], level=700.0)  # the last joint has not settled
    >>> found.count, round(found.estimate, 3), round(found.lower, 4), round(found.upper, 3)
    (1, 0.333, 0.0084, 0.906)
    >>> found.bound_lower, found.bound_upper
    (0.25, 0.5)
    """
    return Sample.of(values, status, None if iid else Listed()).above(level, confidence)


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
    return Sample.of(values, status, None if iid else Listed()).quantile(share, confidence)


def weighted_exceedance(
    values: ArrayLike,
    status: ArrayLike,
    weights: ArrayLike,
    level: float,
    confidence: float = 0.95,
    heaviest: float = np.inf,
) -> Exceedance:
    """Share of the joints above one level under importance sampling, see `analysis.weighted`.

    Parameters
    ----------
    values, status, level, confidence
        As in `exceedance`.
    weights : array_like, shape (n,)
        Weight of each joint; independent draws, mean 1.
    heaviest : float
        Largest weight that a joint can have; inf if no bound is known.

    Returns
    -------
    Exceedance
        ``count``, ``n``, ``n_failed`` and ``n_unsettled`` are numbers of joints; all shares are weighted.

    Raises
    ------
    ValueError
        As `exceedance`, and when a weight is negative or not finite.

    Examples
    --------
    Normal loads drawn about 4, half of them: which share is above 4 under the standard normal distribution?

    >>> rng = np.random.default_rng(1)
    >>> loads = rng.standard_normal(4000) + 4.0 * (np.arange(4000) % 2)
    >>> weights = 1.0 / (0.5 + 0.5 * np.exp(4.0 * loads - 8.0))
    >>> found = weighted_exceedance(loads, np.ones(4000, int), weights, 4.0)
    >>> found.lower < 3.167e-5 < found.upper, f"{found.estimate:.1e}"
    (True, '3.2e-05')
    """
    if np.shape(weights) != np.shape(values):
        raise ValueError(f"values {np.shape(values)} and weights {np.shape(weights)} must be of one length")
    return Sample.of(values, status, Weighted(weights, heaviest)).above(level, confidence)
