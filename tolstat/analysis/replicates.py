"""Intervals for Sobol' points and Latin hypercubes: independent replicates of the whole campaign.

The joints of such a campaign are not independent of each other, so formulas for independent samples do not give the
uncertainty of its estimates. Campaigns of different seeds are independent, and so are the replicates of one file, which
are consecutive blocks of its joints.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tolstat.analysis import exceedance
from tolstat.analysis.exceedance import FloatArray, Table
from tolstat.analysis.quantile import Quantile
from tolstat.analysis.quantile import of_sample as quantile_of_sample
from tolstat.analysis.sorted_loads import Sample

FEW = 20
"""Number of joints on a side of a level below which shares of replicates are too skew for Student's t alone."""


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
    values = np.asarray(estimates, dtype=float)
    n = len(values) if values.ndim else 0
    if n < 2:
        raise ValueError(f"{n} replicates: give two or more, of different sampling.seed")
    if n * values[0].size > 2 and (values == values[0]).all() and not np.isin(values[0], (least, most)).all():
        raise ValueError("the replicates are all equal: give campaigns of different sampling.seed")
    return _students_t(values, confidence, least, most)


def _students_t(values: FloatArray, confidence: float, least: float, most: float) -> Replicated:
    from scipy.special import stdtrit

    n, mean = len(values), values.mean(axis=0)
    half = stdtrit(n - 1, 0.5 * (1.0 + confidence)) * values.std(axis=0, ddof=1) / np.sqrt(n)
    return Replicated(mean, np.maximum(mean - half, least), np.minimum(mean + half, most), n)


def curve_of(
    whole: Sample, parts: Sequence[Sample], levels: ArrayLike | None = None, confidence: float = 0.95
) -> Table:
    """Share of the joints above each of many levels, with Student's t interval over replicates.

    With fewer than `FEW` joints on a side of a level the interval contains that of as many independent joints (Clopper
    and Pearson), too: no joint above in any replicate does not mean that none can be.

    Parameters
    ----------
    whole : Sample
        A load of all joints.
    parts : sequence of Sample
        The same load of the joints of each replicate.
    levels, confidence
        As in `exceedance.curve`.

    Returns
    -------
    ndarray of exceedance.CURVE, shape (m,)
        As from `exceedance.curve`.
    """
    independent = exceedance.curve_of(whole, levels, confidence)
    table = independent.copy()
    each = [exceedance.curve_of(part, table["level"], confidence, iid=False) for part in parts]
    ends = {"estimate": ("lower", "upper"), "bound_lower": ("outer_lower", ""), "bound_upper": ("", "outer_upper")}
    few = np.minimum(table["count"], whole.valid.size - table["count"]) < FEW
    for name, (low, high) in ends.items():
        found = _students_t(np.array([own[name] for own in each]), confidence, 0.0, 1.0)
        for end, value, outermost in ((low, found.lower, np.fmin), (high, found.upper, np.fmax)):
            if end:
                own = outermost(value, table[name])
                table[end] = np.where(few, outermost(own, independent[end]), own)
    return table


def quantile_of(whole: Sample, parts: Sequence[Sample], share: float, confidence: float = 0.95) -> Quantile:
    """Load that a share of the joints stays at or below; its interval inverts that of `curve_of`.

    Quantiles of single replicates have a bias, which more replicates do not reduce; shares have none.
    """
    found = quantile_of_sample(whole, share, confidence, iid=False)
    loads = np.unique(whole.valid)
    if not loads.size:
        return found._replace(lower=-np.inf, upper=np.inf)
    table = curve_of(whole, parts, np.concatenate([[np.nextafter(loads[0], -np.inf)], loads]), confidence)
    above, below = np.flatnonzero(table["upper"][1:] <= 1.0 - share), np.flatnonzero(table["lower"][:-1] >= 1.0 - share)
    upper = float(loads[above[0]]) if above.size else np.inf
    return found._replace(lower=float(loads[below[-1]]) if below.size else -np.inf, upper=upper)
