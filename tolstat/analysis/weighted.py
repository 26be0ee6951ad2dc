"""Exceedance and quantiles under importance sampling.

The weight of a joint is the density of its errors under the tolerances over that under the proposal. Shares are ratios
of sums of weights; their variance is that of such a ratio. The interval is Clopper and Pearson's for the effective
number of joints (Korn and Graubard 1998). Each end is computed with one joint added on the side that moves it outward,
with the largest weight on that side, or among the outermost twenty (after Fay and Feuer 1997). With equal weights the
interval is exactly Clopper and Pearson's; if no joint is above, the joint added has the largest weight of all.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import betaincinv

from tolstat.analysis.exceedance import CURVE, Ends, Exceedance, FloatArray, Table, clopper_pearson, split
from tolstat.analysis.quantile import Quantile
from tolstat.analysis.reweight import smooth
from tolstat.common.shown import shown

LEAST_EFFECTIVE = 20.0
"""Minimum effective number of joints above a level for a trusted share."""


@shown
class Trust(NamedTuple):
    """Diagnostics of the weights above a level.

    Attributes
    ----------
    effective : float
        Effective number of joints above the level, (sum of weights)^2 / sum of squares (Kish 1965).
    k : float
        Shape of the tail of their weights (Vehtari et al. 2024); NaN below 25 joints, -inf with equal weights.
    usable : bool
        Whether `effective` is at least `LEAST_EFFECTIVE` and k, if known, is below 0.7.
    """

    effective: float
    k: float
    usable: bool


class _Sums(NamedTuple):
    """Sum, sum of squares and maximum of the weights of the joints above each level, and of the others.

    With fewer than `LEAST_EFFECTIVE` joints on a side, the maximum is that of the outermost `LEAST_EFFECTIVE` joints.
    """

    above: FloatArray
    below: FloatArray

    @classmethod
    def at(cls, first: NDArray[np.intp], weights: FloatArray, below: FloatArray, above: FloatArray) -> _Sums:
        """Count weights from index `first` on, and `above`, as above the level; earlier ones, and `below`, as below."""
        parts = []
        for w, rest, number in ((weights[::-1], above, weights.size - first), (weights, below, first)):
            sums, squares, largest = (
                np.insert(f, 0, 0.0) for f in (w.cumsum(), (w**2).cumsum(), np.maximum.accumulate(w))
            )
            most = largest[np.clip(number, min(int(LEAST_EFFECTIVE), w.size), None)]
            own = sums[number] + rest.sum(), squares[number] + (rest**2).sum(), np.maximum(most, rest.max(initial=0.0))
            parts.append(np.array(own))
        return cls(*parts)

    @property
    def share(self) -> FloatArray:
        """Share above; NaN where no joint has any weight."""
        with np.errstate(invalid="ignore"):
            return np.asarray(self.above[0] / (self.above[0] + self.below[0]))

    def interval(self, confidence: float) -> tuple[FloatArray, FloatArray]:
        """Ends of the interval of the share."""
        tail = 0.5 * (1.0 - confidence)
        none_above, none_below = self.above[0] == 0, self.below[0] == 0
        most = np.maximum(self.above[2], self.below[2])
        ends = []
        for end, own, other, empty in ((1.0 - tail, *self, none_above), (1.0 - tail, *self[::-1], none_below)):
            # add one joint on the side that this end enlarges, with the largest weight there, or of all if it is empty
            one = np.where(empty, most, own[2])
            first, squares = own[0] + one, own[1] + one**2
            with np.errstate(invalid="ignore", divide="ignore"):
                share = first / (first + other[0])
                variance = ((1.0 - share) ** 2 * squares + share**2 * other[1]) / (first + other[0]) ** 2
                effective = share * (1.0 - share) / variance
                ends.append(betaincinv(share * effective, (1.0 - share) * effective, end))
        upper = np.where(none_below | np.isnan(ends[0]), 1.0, ends[0])
        lower = np.where(none_above | np.isnan(ends[1]), 0.0, 1.0 - ends[1])
        return lower, upper


class Sample(NamedTuple):
    """One load of the simulated joints with their weights, sorted once; see `sort_out`.

    Attributes
    ----------
    loads, weights : ndarray, shape (m,)
        Loads of the valid joints, ascending, and their weights.
    lower, upper : tuple of ndarray, shape (m,)
        Ends of the intervals of these loads, ascending, and the weights in the same order.
    failed, unsettled : ndarray
        Weights of the joints without a valid load.
    """

    loads: FloatArray
    weights: FloatArray
    lower: tuple[FloatArray, FloatArray]
    upper: tuple[FloatArray, FloatArray]
    failed: FloatArray
    unsettled: FloatArray


def curve(
    values: ArrayLike,
    status: ArrayLike,
    weights: ArrayLike,
    levels: ArrayLike | None = None,
    confidence: float = 0.95,
    ends: Ends | None = None,
) -> Table:
    """Share of the joints above each of many levels, see `exceedance.curve`.

    Parameters
    ----------
    values, status, levels, confidence, ends
        As in `exceedance.curve`.
    weights : array_like, shape (n,)
        Weight of each joint; independent draws, mean 1.

    Returns
    -------
    ndarray of CURVE, shape (m,)
        ``count``, ``n``, ``n_failed`` and ``n_unsettled`` are numbers of joints; all shares are weighted.

    Raises
    ------
    ValueError
        When the shapes differ, a weight is negative or not finite, or a level is NaN.
    """
    return curve_of(sort_out(values, status, weights, ends), levels, confidence)


def curve_of(sample: Sample, levels: ArrayLike | None = None, confidence: float = 0.95) -> Table:
    """Share of the joints above each of many levels, from loads that are sorted already; see `curve`."""
    x = np.unique(sample.loads) if levels is None else np.atleast_1d(np.asarray(levels, dtype=float))
    if np.isnan(x).any():
        raise ValueError("a level is NaN")
    first, w = np.searchsorted(sample.loads, x, side="right"), sample.weights
    lost, none = np.concatenate([sample.failed, sample.unsettled]), np.empty(0)
    table = np.zeros(x.shape, CURVE)
    table["level"], table["count"] = x, w.size - first
    table["n"], table["n_failed"], table["n_unsettled"] = w.size + lost.size, sample.failed.size, sample.unsettled.size
    valid, least, most = (
        _Sums.at(np.searchsorted(loads, x, side="right"), own, *rest)
        for (loads, own), rest in (
            ((sample.loads, w), (none, none)),
            (sample.lower, (lost, none)),
            (sample.upper, (none, lost)),
        )
    )
    table["estimate"], (table["lower"], table["upper"]) = valid.share, valid.interval(confidence)
    table["bound_lower"], (table["outer_lower"], _) = least.share, least.interval(confidence)
    table["bound_upper"], (_, table["outer_upper"]) = most.share, most.interval(confidence)
    return table


def weighted_exceedance(
    values: ArrayLike, status: ArrayLike, weights: ArrayLike, level: float, confidence: float = 0.95
) -> Exceedance:
    """Share of the joints above one level; parameters and errors raised as in `curve`.

    Returns
    -------
    Exceedance
        Estimate, interval and bounds.

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
    return Exceedance(*curve(values, status, weights, [level], confidence)[0].tolist())


def trust(values: ArrayLike, status: ArrayLike, weights: ArrayLike, level: float) -> Trust:
    """Diagnose whether the share above a level can be trusted; parameters as in `weighted_exceedance`."""
    return trust_of(sort_out(values, status, weights), level)


def trust_of(sample: Sample, level: float) -> Trust:
    """Diagnose whether the share above a level can be trusted, from loads that are sorted already."""
    w = sample.weights[sample.loads > level]
    w = w[w > 0]
    effective = float(w.sum() ** 2 / (w**2).sum()) if w.size else 0.0
    k = smooth(np.log(w)).k if w.size >= 25 else np.nan
    return Trust(effective, k, effective >= LEAST_EFFECTIVE and not k >= 0.7)


def quantile(
    values: ArrayLike, status: ArrayLike, weights: ArrayLike, share: float, confidence: float = 0.95
) -> Quantile:
    """Load that a share of the joints stays at or below, its interval by Woodruff (1952).

    Parameters
    ----------
    values, status, weights, confidence
        As in `curve`.
    share : float
        Between 0 and 1.

    Returns
    -------
    Quantile
        As from `quantile.quantile`, which is for equal weights.
    """
    return quantile_of(sort_out(values, status, weights), share, confidence)


def quantile_of(sample: Sample, share: float, confidence: float = 0.95) -> Quantile:
    """Load that a share of the joints stays at or below, from loads that are sorted already; see `quantile`."""
    loads, below = sample.loads, np.cumsum(sample.weights)
    n_failed, n_unsettled = sample.failed.size, sample.unsettled.size
    lost = sample.failed.sum() + sample.unsettled.sum()
    numbers = (share, loads.size + n_failed + n_unsettled, n_failed, n_unsettled)
    if not loads.size:
        return Quantile(*numbers, np.nan, -np.inf, np.inf, -np.inf, np.inf)
    total = below[-1]

    def load_at(part: float) -> float:
        """Smallest load at or below which joints have the weight `part`; infinite where there is none."""
        if part <= 0:
            return -np.inf
        rank = int(np.searchsorted(below, part * (1 - 1e-12)))
        return float(loads[rank]) if rank < loads.size else np.inf

    estimate = load_at(share * total)
    spread = np.where(loads <= estimate, 1.0 - share, share) * sample.weights
    effective = share * (1.0 - share) * total**2 / (spread**2).sum()
    low, high = clopper_pearson(share * effective, effective, confidence)
    bounds = load_at(share * (total + lost) - lost), load_at(share * (total + lost))
    # as for order statistics: no finite upper end if it falls within the weight of the largest load
    ends = load_at(low * total), load_at(high * total) if high < 1.0 - sample.weights[-1] / total else np.inf
    return Quantile(*numbers, estimate, *ends, *bounds)


def sort_out(values: ArrayLike, status: ArrayLike, weights: ArrayLike, ends: Ends | None = None) -> Sample:
    """Split the simulated joints into valid (sorted ascending), failed and unsettled, see `exceedance.sort_out`.

    Raises
    ------
    ValueError
        When the shapes differ, or a weight is negative or not finite.
    """
    load, state, w = np.asarray(values, dtype=float), np.asarray(status), np.asarray(weights, dtype=float)
    if load.ndim != 1 or not load.shape == state.shape == w.shape:
        raise ValueError(f"values {load.shape}, status {state.shape} and weights {w.shape} must be of one length")
    if not (np.isfinite(w) & (w >= 0)).all():
        raise ValueError("a weight is negative or no number")
    valid, failed, unsettled = split(load, state)
    exact, lower, upper = (
        _ascending(np.where(np.isfinite(end), end, load)[valid], w[valid]) for end in (load, *(ends or (load, load)))
    )
    return Sample(*exact, lower, upper, w[failed], w[unsettled])


def _ascending(loads: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    order = np.argsort(loads, kind="stable")
    return loads[order], weights[order]
