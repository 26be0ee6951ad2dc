"""Likelihood-ratio reweighting of the same joints to other tolerances.

The weight of a joint is the ratio of the densities of its errors under the new tolerances and under those it was drawn
from. Joints with large weights that happened not to be drawn leave no trace in the sample, so that estimates look
better than they are. A share is therefore usable under three conditions only: the mean square of the ratio, which
follows exactly from the tolerances, is small; the weights on both sides of the limit have a tail that allows it
(Vehtari, Simpson, Gelman, Yao and Gabry 2024); and enough effective joints are on both sides, or the ratio has a bound.
Errors where no joint was drawn have no weight at all. The interval is that of `weighted`.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tolstat.analysis import extreme
from tolstat.analysis.sample import Sample
from tolstat.analysis.weighted import Split, Weighted
from tolstat.common.loads import FloatArray

LEAST_ESS = 50
"""Minimum number of joints that count, by the exact mean square of the ratio; see `Ratios.needed`."""
LARGEST_SPREAD = 2.0
"""Largest mean square of the part of the ratio that has no bound."""
LEAST_BESIDE = 10.0
"""Minimum effective number of joints on each side of a level."""


class Ratios(NamedTuple):
    """Density ratios of joints, and what follows exactly from the tolerances.

    Attributes
    ----------
    values : ndarray, shape (n,)
        New density over that which each joint was drawn from; its mean over all joints that could be drawn is 1. Zero
        for a joint that is impossible under the new tolerances.
    log_mean_square : float
        Logarithm of the mean square of the ratio: 1 plus Pearson's chi-squared divergence.
    log_unbounded : float
        The same of the errors alone whose ratio has no bound; 0 without any.
    heaviest : float
        Largest ratio that a joint can have; inf without a bound.
    """

    values: FloatArray
    log_mean_square: float = 0.0
    log_unbounded: float = 0.0
    heaviest: float = np.inf

    @property
    def effective(self) -> float:
        """Number of joints of the new tolerances that the joints count as."""
        return self.values.size * math.exp(-self.log_mean_square)

    @property
    def needed(self) -> float:
        """Number of effective joints needed: in proportion to the mean square, as its tail is heavier, from 2 on."""
        return LEAST_ESS * max(1.0, 0.5 * math.exp(self.log_mean_square))

    @property
    def usable(self) -> bool:
        """Whether shares can be estimated at all; otherwise new runs are needed."""
        return self.effective >= self.needed and self.log_unbounded <= math.log(LARGEST_SPREAD)


class Support(NamedTuple):
    """How well joints support the share above a level.

    Attributes
    ----------
    ess : float
        Number of equally weighted joints with the same variance of the share.
    above, below : float
        Effective number of joints on each side, (sum of weights)^2 / sum of squares (Kish 1965).
    k : float
        Shape of the tail of the weights, the larger of both sides; NaN if unknown, see `extreme.shape_of_weights`.
    usable : bool
        Whether the share is usable: the ratios are, k is allowed, and `LEAST_BESIDE` effective joints are on both sides
        or the ratio has a bound, which the interval then uses.
    """

    ess: float
    above: float
    below: float
    k: float
    usable: bool


class Share(NamedTuple):
    """Share of the joints above a level, under the new tolerances.

    Attributes
    ----------
    estimate, lower, upper : float
        Share and interval; NaN ends for dependent samples.
    bound_lower, bound_upper : float
        Estimates with the joints without a valid load counted below, and above.
    support : Support
        Whether these numbers are usable.
    """

    estimate: float
    lower: float
    upper: float
    bound_lower: float
    bound_upper: float
    support: Support


class Load(NamedTuple):
    """Load that a share of the joints stays at or below, under the new tolerances.

    Attributes
    ----------
    estimate, lower, upper : float
        In the unit of the values; an end that the joints cannot support is infinite, NaN for dependent samples.
    ess : float
        Number of equally weighted joints with the same variance of the share below the estimate.
    usable : bool
        Whether the shares above both ends and above the estimate are usable.
    """

    estimate: float
    lower: float
    upper: float
    ess: float
    usable: bool


def share_above(load: Sample, ratios: Ratios, level: float, confidence: float = 0.95) -> Share:
    """Share of the joints above a level.

    Parameters
    ----------
    load : Sample
        Load of the joints, as they were drawn.
    ratios : Ratios
        Their density ratios.
    level : float
        Level, in the unit of the values.
    confidence : float
        Confidence level of the interval.

    Returns
    -------
    Share
        Estimate and interval, which hold only if `Support.usable`.

    Examples
    --------
    >>> from scipy.stats import norm
    >>> errors = norm.ppf([(k + 0.5) / 400 for k in range(400)])  # of a normal tolerance, sigma 1
    >>> ratio = np.exp(norm.logpdf(errors, 0, 0.8) - norm.logpdf(errors))  # and for sigma 0.8
    >>> ratios = Ratios(ratio, log_mean_square=0.0696, heaviest=1.25)
    >>> found = share_above(Sample.of(errors, [1] * 400), ratios, 1.0)
    >>> [round(float(x), 3) for x in (found.lower, found.estimate, found.upper, norm.sf(1.0 / 0.8))]
    [0.079, 0.105, 0.135, 0.106]
    >>> found.support.usable, round(found.support.ess)
    (True, 518)
    """
    withheld = 0.0 if np.isfinite(ratios.heaviest) else LEAST_BESIDE
    design = Weighted(ratios.values, ratios.heaviest, withheld=withheld)
    row = replace(load, design=design).above(level, confidence)
    ends = (row.lower, row.upper) if load.design.has_interval("reweighting") else (np.nan, np.nan)
    return Share(row.estimate, *ends, row.bound_lower, row.bound_upper, support(load, ratios, level))


def support(load: Sample, ratios: Ratios, level: float) -> Support:
    """Tell whether the share above a level is usable; parameters as in `share_above`."""
    known = load.is_valid
    w, above = ratios.values[known], load.values[known] > level
    part = w / w.sum()
    share = float(part[above].sum())
    variance = float(((part * (above - share)) ** 2).sum())
    ess = share * (1.0 - share) / variance if 0.0 < share < 1.0 and variance > 0 else ratios.effective
    effective = [float(side[0]) for side in Split.by(above, w).effective]
    k = float(np.fmax(extreme.shape_of_weights(w[above]), extreme.shape_of_weights(w[~above])))
    beside = np.isfinite(ratios.heaviest) or min(effective) >= LEAST_BESIDE
    converged = min(1.0 - 1.0 / np.log10(max(w.size, 11)), 0.7)  # largest k allowed (Vehtari et al. 2024)
    usable = ratios.usable and bool(beside) and not k > converged
    return Support(ess, effective[0], effective[1], k, usable)


def quantile(load: Sample, ratios: Ratios, share: float, confidence: float = 0.95) -> Load:
    """Load that a share of the joints stays at or below, and its interval, which inverts that of shares.

    Parameters
    ----------
    load, ratios, confidence
        As in `share_above`.
    share : float
        Between 0 and 1.

    Returns
    -------
    Load
        It holds only if `Load.usable`.
    """
    row = replace(load, design=Weighted(ratios.values, ratios.heaviest)).quantile(share, confidence)
    known = load.design.has_interval("reweighting")
    ends = (row.lower, row.upper) if known else (np.nan, np.nan)
    each = [support(load, ratios, end) for end in (row.estimate, *(ends if known else ())) if np.isfinite(end)]
    enough = len(each) == (3 if known else 1) and all(s.usable and min(s.above, s.below) >= LEAST_BESIDE for s in each)
    return Load(row.estimate, *ends, support(load, ratios, row.estimate).ess, enough)
