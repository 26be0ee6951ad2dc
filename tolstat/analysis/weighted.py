"""Exceedance and quantiles under importance sampling.

The weight of a joint is the density of its errors under the tolerances over that under the proposal. Shares are ratios
of sums of weights; their variance is that of such a ratio. The interval is Clopper and Pearson's for the effective
number of joints (Korn and Graubard 1998). Each end is computed with one joint added on the side that moves it outward,
with the largest weight on that side, or among the outermost twenty (after Fay and Feuer 1997). With equal weights the
interval is exactly Clopper and Pearson's. Where fewer than twenty effective joints are on a side, the joint added has
the largest weight that a joint can have or, if no bound is known, that any joint has.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.analysis import pareto
from tolstat.analysis.exceedance import CURVE, Exceedance, FloatArray, Table
from tolstat.analysis.quantile import Quantile
from tolstat.analysis.sorted_loads import Ends, split
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
        Shape of the tail of their weights, see `pareto.shape_of_weights`.
    usable : bool
        Whether `effective` is at least `LEAST_EFFECTIVE`, or the weights have a bound, which the interval then uses;
        and k, if known, is below 0.7.
    """

    effective: float
    k: float
    usable: bool


class Side(NamedTuple):
    """Weights of the joints on one side of each of some levels.

    Attributes
    ----------
    total, squares : ndarray
        Sum of the weights, and of their squares.
    added : ndarray
        Weight of the joint added where an end moves outward to this side.
    """

    total: FloatArray
    squares: FloatArray
    added: FloatArray

    @classmethod
    def of(cls, total: ArrayLike, squares: ArrayLike, largest: ArrayLike, heaviest: float) -> Side:
        """Make a side; `largest` is the largest weight of its joints, `heaviest` that of any joint."""
        side = cls(*(np.atleast_1d(np.asarray(v, dtype=float)) for v in (total, squares, largest)))
        return side._replace(added=np.where(side.effective < LEAST_EFFECTIVE, heaviest, side.added))

    @property
    def effective(self) -> FloatArray:
        """Effective number of joints (Kish 1965)."""
        found: FloatArray = np.square(self.total) / np.where(self.total > 0, self.squares, 1.0)
        return found


class Split(NamedTuple):
    """Weights of the joints above each level, and of the others."""

    above: Side
    below: Side

    @classmethod
    def at(
        cls,
        first: NDArray[np.intp],
        weights: FloatArray,
        below: FloatArray,
        above: FloatArray,
        heaviest: float,
    ) -> Split:
        """Count weights from index `first` on, and `above`, as above the level; earlier ones, and `below`, as below.

        The largest weight of a side is that of the outermost `LEAST_EFFECTIVE` joints at least.
        """
        sides = []
        every = heaviest if np.isfinite(heaviest) else np.concatenate([weights, below, above]).max(initial=0.0)
        for w, rest, number in ((weights[::-1], above, weights.size - first), (weights, below, first)):
            sums, squares, largest = (
                np.insert(f, 0, 0.0) for f in (w.cumsum(), (w**2).cumsum(), np.maximum.accumulate(w))
            )
            most = largest[np.clip(number, min(int(LEAST_EFFECTIVE), w.size), None)]
            own = sums[number] + rest.sum(), squares[number] + (rest**2).sum(), np.maximum(most, rest.max(initial=0.0))
            sides.append(Side.of(*own, every))
        return cls(*sides)

    @classmethod
    def by(cls, is_above: NDArray[np.bool_], weights: FloatArray, heaviest: float = np.inf) -> Split:
        """Split by a mask, (n,), in place of a level."""
        every = heaviest if np.isfinite(heaviest) else weights.max(initial=0.0)
        parts = (weights[mask] for mask in (is_above, ~is_above))
        return cls(*(Side.of(w.sum(), (w**2).sum(), w.max(initial=0.0), every) for w in parts))

    def only(self, index: int) -> Split:
        """Return the split at one of the levels."""
        above, below = (Side(*(values[index : index + 1] for values in side)) for side in self)
        return Split(above, below)

    @property
    def share(self) -> FloatArray:
        """Share above; NaN where no joint has any weight."""
        with np.errstate(invalid="ignore"):
            return np.asarray(self.above.total / (self.above.total + self.below.total))

    def interval(self, confidence: float, least: float = 0.0) -> tuple[FloatArray, FloatArray]:
        """Ends of the interval of the share.

        Parameters
        ----------
        confidence : float
            Confidence level.
        least : float
            Effective number of joints on a side below which the share is withheld. Shares that are given are then those
            with many joints there; the end on the other side is that of the distribution of such shares alone.
        """
        tail = 0.5 * (1.0 - confidence)
        ends = []
        for (own, beside), (_, other) in zip(
            self.far(), ((self.above, self.below), (self.below, self.above)), strict=True
        ):
            with np.errstate(invalid="ignore"):
                end = _far_end(own, beside, tail, least)
            ends.append(np.where((other.total == 0) | np.isnan(end), 1.0, end))
        return 1.0 - ends[1], ends[0]

    def far(self) -> list[tuple[FloatArray, FloatArray]]:
        """Effective joints on its own side and on the other, for the upper end of the share above, and below.

        They are the parameters of the beta distribution that the end is a quantile of; NaN where no joint has weight.
        """
        found = []
        for own, other in ((self.above, self.below), (self.below, self.above)):
            # add one joint on the side that this end enlarges
            first, squares = own.total + own.added, own.squares + own.added**2
            with np.errstate(invalid="ignore", divide="ignore"):
                share = first / (first + other.total)
                variance = ((1.0 - share) ** 2 * squares + share**2 * other.squares) / (first + other.total) ** 2
                effective = share * (1.0 - share) / variance
                found.append((share * effective, (1.0 - share) * effective))
        return found


def _far_end(own: FloatArray, other: FloatArray, tail: float, least: float) -> FloatArray:
    """Largest share of a side of `own` effective joints, (m,), with `other` on the other side: least of these if > 0.

    It is the share at which `other` joints or more would be found with the probability `tail`, if only cases with
    `least` or more are looked at.
    """
    from scipy.special import betainc, betaincinv

    plain: FloatArray = np.asarray(betaincinv(own, other, 1.0 - tail), dtype=float)
    if not least:
        return plain
    low, high = plain, np.ones_like(plain)
    for _ in range(50):
        middle = 0.5 * (low + high)
        found = betainc(other, own, 1.0 - middle) / betainc(least, np.maximum(own + other - least, 1.0), 1.0 - middle)
        low, high = np.where(found > tail, middle, low), np.where(found > tail, high, middle)
    return np.where(other > least, high, 1.0)


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
    heaviest : float
        Largest weight that a joint can have; inf if no bound is known.
    """

    loads: FloatArray
    weights: FloatArray
    lower: tuple[FloatArray, FloatArray]
    upper: tuple[FloatArray, FloatArray]
    failed: FloatArray
    unsettled: FloatArray
    heaviest: float = np.inf


def curve(
    values: ArrayLike,
    status: ArrayLike,
    weights: ArrayLike,
    levels: ArrayLike | None = None,
    confidence: float = 0.95,
    ends: Ends | None = None,
    heaviest: float = np.inf,
) -> Table:
    """Share of the joints above each of many levels, see `exceedance.curve`.

    Parameters
    ----------
    values, status, levels, confidence, ends
        As in `exceedance.curve`.
    weights : array_like, shape (n,)
        Weight of each joint; independent draws, mean 1.
    heaviest : float
        Largest weight that a joint can have; inf if no bound is known.

    Returns
    -------
    ndarray of CURVE, shape (m,)
        ``count``, ``n``, ``n_failed`` and ``n_unsettled`` are numbers of joints; all shares are weighted.

    Raises
    ------
    ValueError
        When the shapes differ, a weight is negative or not finite, or a level is NaN.
    """
    return curve_of(sort_out(values, status, weights, ends, heaviest), levels, confidence)


def curve_of(sample: Sample, levels: ArrayLike | None = None, confidence: float = 0.95, least: float = 0.0) -> Table:
    """Share of the joints above each of many levels, from loads that are sorted already; see `curve`.

    `least` is that of `Split.interval`, for shares that are withheld below it.
    """
    x = np.unique(sample.loads) if levels is None else np.atleast_1d(np.asarray(levels, dtype=float))
    if np.isnan(x).any():
        raise ValueError("a level is NaN")
    first, w = np.searchsorted(sample.loads, x, side="right"), sample.weights
    lost, none = np.concatenate([sample.failed, sample.unsettled]), np.empty(0)
    table = np.zeros(x.shape, CURVE)
    table["level"], table["count"] = x, w.size - first
    table["n"], table["n_failed"], table["n_unsettled"] = w.size + lost.size, sample.failed.size, sample.unsettled.size
    valid, fewest, most = (
        Split.at(np.searchsorted(loads, x, side="right"), own, below, above, sample.heaviest)
        for (loads, own), below, above in (
            ((sample.loads, w), none, none),
            (sample.lower, lost, none),
            (sample.upper, none, lost),
        )
    )
    table["estimate"], (table["lower"], table["upper"]) = valid.share, valid.interval(confidence, least)
    table["bound_lower"], (table["outer_lower"], _) = fewest.share, fewest.interval(confidence, least)
    table["bound_upper"], (_, table["outer_upper"]) = most.share, most.interval(confidence, least)
    return table


def weighted_exceedance(
    values: ArrayLike,
    status: ArrayLike,
    weights: ArrayLike,
    level: float,
    confidence: float = 0.95,
    heaviest: float = np.inf,
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
    return Exceedance(*curve(values, status, weights, [level], confidence, None, heaviest)[0].tolist())


def trust(values: ArrayLike, status: ArrayLike, weights: ArrayLike, level: float, heaviest: float = np.inf) -> Trust:
    """Diagnose whether the share above a level can be trusted; parameters as in `weighted_exceedance`."""
    return trust_of(sort_out(values, status, weights, heaviest=heaviest), level)


def trust_of(sample: Sample, level: float) -> Trust:
    """Diagnose whether the share above a level can be trusted, from loads that are sorted already."""
    w = sample.weights[sample.loads > level]
    effective = float(w.sum() ** 2 / (w**2).sum()) if w.any() else 0.0
    k = pareto.shape_of_weights(w)
    enough = effective >= LEAST_EFFECTIVE or np.isfinite(sample.heaviest)
    return Trust(effective, k, bool(enough and not k >= 0.7))


def quantile(
    values: ArrayLike, status: ArrayLike, weights: ArrayLike, share: float, confidence: float = 0.95
) -> Quantile:
    """Load that a share of the joints stays at or below; its interval inverts that of shares.

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
    bounds = load_at(share * (total + lost) - lost), load_at(share * (total + lost))
    none = np.empty(0)
    splits = Split.at(np.arange(loads.size + 1), sample.weights, none, none, sample.heaviest)
    # the least load whose share above is surely at most, the largest of which that of its own and above is at least so
    high = _first(loads.size, lambda i: splits.only(i + 1).interval(confidence)[1][0] <= 1.0 - share)
    low = _first(loads.size, lambda i: splits.only(i).interval(confidence)[0][0] < 1.0 - share) - 1
    ends = float(loads[low]) if low >= 0 else -np.inf, float(loads[high]) if high < loads.size else np.inf
    return Quantile(*numbers, estimate, *ends, *bounds)


def _first(n: int, holds: Callable[[int], bool]) -> int:
    """Find by bisection the first of the numbers 0 to n - 1 for which a condition holds; n if it never does."""
    low, high = 0, n
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if holds(middle) else (middle + 1, high)
    return low


def sort_out(
    values: ArrayLike, status: ArrayLike, weights: ArrayLike, ends: Ends | None = None, heaviest: float = np.inf
) -> Sample:
    """Split the simulated joints into valid (sorted ascending), failed and unsettled, see `sorted_loads.sort_out`.

    Parameters
    ----------
    values, status, ends
        As in `exceedance.curve`.
    weights, heaviest
        As in `curve`.

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
    return Sample(*exact, lower, upper, w[failed], w[unsettled], heaviest)


def _ascending(loads: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    order = np.argsort(loads, kind="stable")
    return loads[order], weights[order]
