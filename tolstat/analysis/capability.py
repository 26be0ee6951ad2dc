"""How well does the population of joints stay below a limit? Yield, ppm and Ppk with intervals.

A load has an upper limit only. So there is no Pp, which compares a two-sided band with the scatter, and Ppk equals
Ppu = (limit - median) / (q(99.865 %) - median): a performance index of ISO 22514-2, for any distribution. Indices of
capability, Cpk, are of a process that is shown to be under control, which simulated joints do not show. Yield and ppm
assume no distribution either.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tolstat.analysis import binomial
from tolstat.analysis.estimates import Estimate, Exceedance
from tolstat.analysis.sample import Sample

REFERENCE = 0.9986501019683699
"""Share of a normal distribution below mean + 3 sigma."""
LEAST = math.ceil(1.0 / (1.0 - REFERENCE))
"""Minimum number of joints for an estimate, 741: the largest of fewer ones lies below that quantile more often than
not, and stands for it, so that the index would be too large."""
NONE = Estimate(np.nan, np.nan, np.nan)


class Performance(NamedTuple):
    """How the joints stand against the upper limit of a load.

    Attributes
    ----------
    above : Exceedance
        Share of the joints above the limit; yield and ppm are read from it.
    ppk : Estimate
        Ppk of the valid joints. The estimate is NaN for fewer than `LEAST` joints. The interval is conservative: it
        covers with at least the given confidence. With fewer joints than `needed` the lower end is at most 0; the
        interval is NaN where those of both quantiles overlap, so that any index is possible, and where joints are not
        independent. All three are NaN without scatter.
    needed : int
        Minimum number of joints for a finite upper end of the interval of the 99.865 % quantile.
    """

    above: Exceedance
    ppk: Estimate[float]
    needed: int


def of_sample(sample: Sample, limit: float, confidence: float = 0.95) -> Performance:
    """Share above the limit of one load, and its Ppk.

    Parameters
    ----------
    sample : Sample
        Load of joints that count equally.
    limit : float
        Upper limit, in the unit of the load.
    confidence : float
        Confidence level of the intervals.

    Examples
    --------
    >>> import numpy as np
    >>> load = np.random.default_rng(1).normal(650.0, 10.0, 5000)  # N
    >>> found = of_sample(Sample.of(load, [1] * 5000), limit=690.0)
    >>> round(found.ppk.estimate, 1), found.above.count, found.needed
    (1.3, 0, 3244)
    """
    # Bonferroni over two quantiles with two ends each: a quarter of the error probability for this upper end
    needed = binomial.wilks(REFERENCE, 1.0 - 0.25 * (1.0 - confidence))
    scatters = sample.valid.size > 1 and np.ptp(sample.valid) > 0
    index = _ppk(sample, limit, confidence) if scatters else NONE
    return Performance(sample.above(limit, confidence), index, needed)


def _ppk(sample: Sample, limit: float, confidence: float) -> Estimate[float]:
    """Ppk; interval from those of both quantiles, half the error probability each (Bonferroni)."""
    # quantiles that lie as often above the true ones as below (Hyndman and Fan 1996)
    index = _index(limit, *np.quantile(sample.valid, (0.5, REFERENCE), method="median_unbiased").tolist())
    estimate = index if sample.valid.size >= LEAST else np.nan
    each = 0.5 * (1.0 + confidence)
    middle, high = (sample.quantile(share, each) for share in (0.5, REFERENCE))
    if not (sample.design.independent and middle.upper < high.lower):
        return NONE._replace(estimate=estimate)
    # the index is monotone in each quantile with the other fixed: its extremes are at the corners
    corners = [_index(limit, m, h) for m in (middle.lower, middle.upper) for h in (high.lower, high.upper)]
    return Estimate(estimate, min(corners), max(corners))


def _index(limit: float, middle: float, high: float) -> float:
    if np.isinf(high):
        return 0.0
    if np.isinf(middle):  # limit of the index as the median goes to -inf
        return 1.0
    return (limit - middle) / (high - middle) if high > middle else np.nan
