"""Likelihood-ratio reweighting of the same joints to other tolerances.

The weight of a joint is the ratio of the densities of its errors under the new tolerances and under those it was drawn
from. Where a few joints have most of the weight, the estimates are unreliable without showing it; the shape k of the
weights' tail shows it (Vehtari, Simpson, Gelman, Yao and Gabry 2024, Pareto-smoothed importance sampling). Errors where
no joint was drawn have no weight at all.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.analysis import pareto
from tolstat.analysis.exceedance import FloatArray, clopper_pearson
from tolstat.common.shown import shown

LEAST_ESS = 50
"""Minimum effective number of joints for usable weights."""


class Weights(NamedTuple):
    """Smoothed weights of joints.

    Attributes
    ----------
    values : ndarray, shape (n,)
        Weights; their sum is 1.
    ess : float
        Effective number of joints, 1 / sum of squares (Kish 1965).
    k : float
        Pareto shape of the weights' tail; -inf if all weights are equal, inf if too few are positive for a fit.
    allowed : float
        Largest k allowed, min(1 - 1 / log10(n), 0.7): with a larger one the estimates have not converged at n joints.
    """

    values: FloatArray
    ess: float
    k: float
    allowed: float

    @property
    def usable(self) -> bool:
        """Whether estimates from these weights can be trusted; otherwise new runs are needed."""
        return self.k < self.allowed and self.ess >= LEAST_ESS


@shown
class Share(NamedTuple):
    """Share of the joints above a level, under the new tolerances.

    Attributes
    ----------
    estimate, lower, upper : float
        Share and interval; NaN ends for dependent samples.
    ess : float
        Number of equally weighted joints with the same variance of the share.
    """

    estimate: float
    lower: float
    upper: float
    ess: float


def smooth(log_ratios: ArrayLike) -> Weights:
    """Weights from density ratios, the largest replaced by quantiles of a fitted generalised Pareto tail.

    Parameters
    ----------
    log_ratios : array_like, shape (n,)
        Logarithm of new density over old, up to a constant; -inf for a joint impossible under the new tolerances.

    Returns
    -------
    Weights
        Weights of all joints.

    Raises
    ------
    ValueError
        When no joint has any weight, or a ratio is NaN or +inf.

    Examples
    --------
    >>> from scipy.stats import norm
    >>> errors = norm.ppf([(k + 0.5) / 400 for k in range(400)])  # of normal tolerances, sigma 1
    >>> weights = smooth(norm.logpdf(errors, 0, 0.8) - norm.logpdf(errors))  # and for sigma 0.8
    >>> weights.usable, round(weights.ess)
    (True, 373)
    >>> [round(float(x), 3) for x in (share_above(errors, weights, 1.0).estimate, norm.sf(1.0 / 0.8))]
    [0.105, 0.106]
    """
    logs = np.asarray(log_ratios, dtype=float)
    if np.isnan(logs).any() or (logs == np.inf).any():
        raise ValueError("a ratio is not a number: the joints were not drawn from the old tolerances")
    if not np.isfinite(logs).any():
        raise ValueError("the new tolerances make none of the joints")
    n = logs.size
    raw = np.exp(logs - logs.max())
    k = -np.inf
    m = min(n // 5, int(np.ceil(3.0 * np.sqrt(n))))
    if np.ptp(raw) > 0:
        order = np.argsort(raw, kind="stable")
        tail = order[n - m :]
        cut = raw[order[n - m - 1]] if m else 0.0
        k = np.inf
        if m >= 5 and raw[tail[0]] > cut > 0:
            shape, scale = (float(v) for v in pareto.fit(raw[tail] - cut))
            k = (shape * m + 0.5 * 10.0) / (m + 10.0)  # shrunk towards 1/2 as by ten observations
            raw[tail] = np.minimum(cut + pareto.quantile(1.0 - (np.arange(1, m + 1) - 0.5) / m, k, scale), 1.0)
    weights = raw / raw.sum()
    allowed = min(1.0 - 1.0 / np.log10(max(n, 11)), 0.7)
    return Weights(weights, float(1.0 / (weights**2).sum()), float(k), float(allowed))


def share_above(values: ArrayLike, weights: Weights, level: float, confidence: float = 0.95, iid: bool = True) -> Share:
    """Share of the joints above a level.

    Parameters
    ----------
    values : array_like, shape (n,)
        Load of each joint that has a weight.
    weights : Weights
        Weights of the same joints.
    level : float
        Level, in the unit of the values.
    confidence : float
        Confidence level of Clopper and Pearson's interval for the effective joints (Korn and Graubard 1998).
    iid : bool
        Whether the joints are independent samples.

    Returns
    -------
    Share
        Estimate and interval, which is valid only if `Weights.usable`.

    Raises
    ------
    ValueError
        When the lengths differ.
    """
    loads, w = np.asarray(values, dtype=float), weights.values
    if loads.shape != w.shape:
        raise ValueError(f"loads {loads.shape} and weights {w.shape} must be of one length")
    above = loads > level
    estimate = float(np.clip((w * above).sum(), 0.0, 1.0))
    # variance of a ratio of sums; if all joints are on one side, the effective number of the weights
    variance = float(((w * (above - estimate)) ** 2).sum())
    ess = estimate * (1.0 - estimate) / variance if 0.0 < estimate < 1.0 else weights.ess
    ess = min(ess, float(loads.size))
    lower, upper = clopper_pearson(estimate * ess, ess, confidence) if iid else (np.nan, np.nan)
    return Share(estimate, float(lower), float(upper), float(ess))


def quantile(
    values: ArrayLike, weights: Weights, share: float, confidence: float = 0.95, iid: bool = True
) -> tuple[float, float, float]:
    """Load that a share of the joints stays at or below, and its interval (Woodruff 1952).

    Parameters
    ----------
    values, weights, confidence, iid
        As in `share_above`.
    share : float
        Between 0 and 1.

    Returns
    -------
    estimate, lower, upper : float
        In the unit of the values; an end that the joints cannot support is infinite, NaN for dependent samples.
    """
    loads = np.asarray(values, dtype=float)
    order = np.argsort(loads, kind="stable")
    below = np.cumsum(weights.values[order])
    estimate = loads[order][min(int(np.searchsorted(below, share * (1 - 1e-12))), loads.size - 1)]
    if not iid:
        return float(estimate), np.nan, np.nan
    found = share_above(loads, weights, float(estimate), confidence)
    low, high = clopper_pearson(share * found.ess, found.ess, confidence)
    ends: list[NDArray[np.intp]] = [np.searchsorted(below, 0.0 if s <= 0 else s) for s in (low, high)]
    lower = loads[order][ends[0]] if ends[0] < loads.size else np.inf
    upper = loads[order][ends[1]] if ends[1] < loads.size - 1 else np.inf
    return float(estimate), float(lower), float(upper)
