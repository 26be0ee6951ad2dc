"""How capable is the production of staying below a limit? Yield, ppm and Cpk with intervals.

A load has an upper limit only. So there is no Cp, which compares a two-sided band with the scatter, and Cpk equals
Cpu = (limit - mean) / (3 sigma). Cpu determines the share of the joints above the limit only if the load is normal,
which loads of joints with clearance are not. Its interval holds for other loads too, unless their tail is long. The
quantile index, (limit - median) / (q(99.865 %) - median) (ISO 22514-2), is defined for any distribution. Yield and ppm
assume no distribution.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tolstat.analysis import binomial
from tolstat.analysis.estimates import Estimate, Exceedance
from tolstat.analysis.sample import Sample
from tolstat.common.late import special, stats
from tolstat.common.loads import FloatArray

REFERENCE = 0.9986501019683699
"""Share of a normal distribution below mean + 3 sigma."""
FEWEST_MOMENTS = 1000
"""Minimum number of joints for an interval of the index of mean and standard deviation."""
LONGEST_TAIL = 3.0
"""(q(95 %) - median) / (q(75 %) - median) from which on such an interval does not hold; 2.44 for a normal load. A rule
by quantiles: samples that pass a test of skewness or kurtosis by luck are those whose interval misses."""
NONE = Estimate(np.nan, np.nan, np.nan)
WIDER = 1.3
"""Factor on the width of such an interval: the kurtosis of few joints is too small (measured)."""


class Capability(NamedTuple):
    """Capability of a load against its upper limit.

    Attributes
    ----------
    above : Exceedance
        Share of the joints above the limit; yield and ppm are read from it.
    cpk_normal : Estimate
        (limit - mean) / (3 sigma) of the valid joints and its interval, which assumes no normal load: it covers with at
        least the given confidence. The interval is NaN for fewer than `FEWEST_MOMENTS` joints; for so many joints with
        a tail longer than `LONGEST_TAIL`, all three are.
    normal_p : float
        p-value of the normality test by skewness and kurtosis (D'Agostino and Pearson 1973); where it is small,
        `cpk_normal` does not determine the share above the limit. NaN for fewer than 20 joints.
    cpk : Estimate
        Quantile index of the valid joints. Its interval is conservative: it covers with at least the given confidence.
        With fewer joints than `needed` the lower end is at most 0; the interval is NaN where those of both quantiles
        overlap, so that any index is possible.
    needed : int
        Minimum number of joints for a finite upper end of the interval of the 99.865 % quantile.

    The intervals are NaN when the samples are not independent, the indices when there are fewer than two valid joints
    or no scatter.
    """

    above: Exceedance
    cpk_normal: Estimate[float]
    normal_p: float
    cpk: Estimate[float]
    needed: int


def of_sample(sample: Sample, limit: float, confidence: float = 0.95) -> Capability:
    """Capability of one load.

    Parameters
    ----------
    sample : Sample
        Load of joints that count equally.
    limit : float
        Upper limit, in the unit of the load.
    confidence : float
        Confidence level of the intervals; without independent joints these are NaN.

    Returns
    -------
    Capability
        Estimates and intervals.

    Examples
    --------
    >>> import numpy as np
    >>> load = np.random.default_rng(1).normal(650.0, 10.0, 5000)  # N
    >>> found = of_sample(Sample.of(load, [1] * 5000), limit=690.0)
    >>> round(found.cpk_normal.estimate, 1), found.above.count, found.needed
    (1.3, 0, 3244)
    """
    valid = sample.valid
    normal, p, general = NONE, np.nan, NONE
    if valid.size > 1 and np.ptp(valid) > 0:
        normal, general = (index(sample, limit, confidence) for index in (_normal, _of_quantiles))
        p = float(stats.normaltest(valid).pvalue) if valid.size >= 20 else np.nan
    # Bonferroni over two quantiles with two ends each: a quarter of the error probability for this upper end
    needed = binomial.wilks(REFERENCE, 1.0 - 0.25 * (1.0 - confidence))
    return Capability(sample.above(limit, confidence), normal, p, general, needed)


def cpk_interval(cpk: ArrayLike, n: int, confidence: float = 0.95) -> tuple[FloatArray, FloatArray]:
    """Exact interval of a one-sided capability index of a normal load.

    3 sqrt(n) times the estimate has a noncentral t distribution with n - 1 degrees of freedom, whose noncentrality is
    3 sqrt(n) times the true index (Kushler and Hurley 1992).

    Parameters
    ----------
    cpk : array_like
        Estimates, from mean and standard deviation (divisor n - 1) of `n` joints.
    n : int
        Joints, at least 2.
    confidence : float
        Confidence level of the interval.

    Returns
    -------
    lower, upper : ndarray
        Of the shape of `cpk`.
    """
    scale, tail = 3.0 * np.sqrt(n), 0.5 * (1.0 - confidence)
    t = scale * np.asarray(cpk, dtype=float)
    return special.nctdtrinc(n - 1, 1.0 - tail, t) / scale, special.nctdtrinc(n - 1, tail, t) / scale


def _normal(sample: Sample, limit: float, confidence: float) -> Estimate[float]:
    """Index of mean and standard deviation; interval of a normal load, widened for skewness and kurtosis.

    The factor is the ratio of standard errors from the central moments (delta method), at least 1, times `WIDER`.
    """
    valid = sample.valid
    mean, n = valid.mean(), valid.size
    index = float((limit - mean) / (3.0 * valid.std(ddof=1)))
    middle, upper, high = np.quantile(valid, (0.5, 0.75, 0.95))
    if n >= FEWEST_MOMENTS and high - middle > LONGEST_TAIL * (upper - middle):
        return NONE
    if n < FEWEST_MOMENTS or not sample.design.independent:
        return NONE._replace(estimate=index)
    scores, z = (valid - mean) / valid.std(), 3.0 * index
    skewness, kurtosis = (scores**3).mean(), (scores**4).mean()
    factor = (1.0 + z * skewness + 0.25 * z**2 * (kurtosis - 1.0)) / (1.0 + 0.5 * z**2)
    wider = WIDER * np.sqrt(max(1.0, factor))
    lower, upper = (float(end) for end in cpk_interval(index, n, confidence))
    return Estimate(index, index - wider * (index - lower), index + wider * (upper - index))


def _of_quantiles(sample: Sample, limit: float, confidence: float) -> Estimate[float]:
    """Quantile index; interval from those of both quantiles, half the error probability each (Bonferroni)."""
    each = 0.5 * (1.0 + confidence)
    middle, high = (sample.quantile(share, each) for share in (0.5, REFERENCE))
    index = float(_index(limit, middle.estimate, high.estimate))
    if not sample.design.independent:
        return NONE._replace(estimate=index)
    if not middle.upper < high.lower:
        return NONE._replace(estimate=index)
    # the index is monotone in each quantile with the other fixed: its extremes are at the corners
    corners = [_index(limit, m, h) for m in (middle.lower, middle.upper) for h in (high.lower, high.upper)]
    return Estimate(index, min(corners), max(corners))


def _index(limit: float, middle: float, high: float) -> float:
    if np.isinf(high):
        return 0.0
    if np.isinf(middle):  # limit of the index as the median goes to -inf
        return 1.0
    return (limit - middle) / (high - middle) if high > middle else np.nan
