"""Exceedance and quantiles under importance sampling.

The weight of a joint is the density of its errors under the tolerances over that under the proposal. Shares are ratios
of sums of weights; their variance is that of such a ratio. The interval is Clopper and Pearson's for the effective
number of joints (Korn and Graubard 1998). Each end is computed with one joint added on the side that moves it outward,
with the largest weight on that side (after Fay and Feuer 1997). With equal weights the
interval is exactly Clopper and Pearson's. Where fewer than twenty effective joints are on a side, the joint added has
the largest weight that a joint can have or, if no bound is known, that any joint has.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.analysis import extreme
from tolstat.analysis.design import Claim, Design, Independent
from tolstat.analysis.estimates import Column, Estimate
from tolstat.common.bisection import first
from tolstat.common.late import special
from tolstat.common.loads import FloatArray

LEAST_EFFECTIVE = 20.0
"""Minimum effective number of joints above a level for a trusted share."""
LARGEST_SHAPE = 0.7
"""Shape of the tail of the weights, from which on a share is not trusted."""


class Split(NamedTuple):
    """Weights of the joints above each of m levels (row 0 of each array), and of the others (row 1).

    Attributes
    ----------
    total, squares : ndarray, shape (2, m)
        Sum of the weights, and of their squares.
    added : ndarray, shape (2, m)
        Weight of the joint added where an end moves outward to this side.
    """

    total: FloatArray
    squares: FloatArray
    added: FloatArray

    @classmethod
    def of(cls, sums: Iterable[FloatArray], heaviest: ArrayLike) -> Split:
        """Make a split of total, squares and the largest weight on each side; `heaviest` is that of any joint."""
        split = cls(*sums)
        return split._replace(added=np.where(split.effective < LEAST_EFFECTIVE, heaviest, split.added))

    @classmethod
    def at(cls, first: NDArray[np.intp], weights: FloatArray, heaviest: float) -> Split:
        """Count weights from index `first` on as above the level, earlier ones as below."""
        sides = []
        for w, number in ((weights[::-1], weights.size - first), (weights, first)):
            sums = w.cumsum(), (w**2).cumsum(), np.maximum.accumulate(w)
            sides.append([np.insert(total, 0, 0.0)[number] for total in sums])
        heaviest_of_any = heaviest if np.isfinite(heaviest) else weights.max(initial=0.0)
        return cls.of(np.swapaxes(sides, 0, 1), heaviest_of_any)

    @classmethod
    def by(cls, is_above: NDArray[np.bool_], weights: FloatArray) -> Split:
        """Split by a mask, (n,), in place of a level."""
        sides = np.where([is_above, ~is_above], weights, 0.0)
        sums = sides.sum(axis=1), (sides**2).sum(axis=1), sides.max(axis=1, initial=0.0)
        return cls.of([total[:, None] for total in sums], weights.max(initial=0.0))

    @property
    def effective(self) -> FloatArray:
        """Effective number of joints on each side, (2, m) (Kish 1965)."""
        return np.asarray(np.square(self.total) / np.where(self.total > 0, self.squares, 1.0))

    @property
    def share(self) -> FloatArray:
        """Share above, (m,); NaN where no joint has any weight."""
        with np.errstate(invalid="ignore"):
            return np.asarray(self.total[0] / self.total.sum(axis=0))

    def interval(self, confidence: float, least: float = 0.0) -> tuple[FloatArray, FloatArray]:
        """Ends of the interval of the share.

        Parameters
        ----------
        confidence : float
            Confidence level.
        least : float
            Effective number of joints on a side below which the share is withheld. Shares that are given are then those
            with many joints there; the end on the other side is that of the distribution of such shares alone: the
            share at which as many as found have the probability of the tail, if only cases with `least` or more are
            looked at.
        """
        tail = 0.5 * (1.0 - confidence)
        inside, outside = self.far()

        def beyond(share: FloatArray) -> NDArray[np.bool_]:
            looked_at = special.betainc(least, np.maximum(inside + outside - least, 1.0), 1.0 - share)
            return np.asarray(special.betainc(outside, inside, 1.0 - share) / looked_at <= tail)

        with np.errstate(invalid="ignore"):
            ends = special.betaincinv(inside, outside, 1.0 - tail)
            if least:
                ends = np.where(outside > least, first(beyond, ends, 1.0, 50), 1.0)
        ends = np.where((self.total[::-1] == 0) | np.isnan(ends), 1.0, ends)
        return 1.0 - ends[1], ends[0]

    def far(self) -> tuple[FloatArray, FloatArray]:
        """Effective joints on its own side and on the other, (2, m), for the upper end of the share on each side.

        They are the parameters of the beta distribution that the end is a quantile of; NaN where no joint has weight.
        """
        other = self.total[::-1]
        # add one joint on the side that this end enlarges
        first, squares = self.total + self.added, self.squares + self.added**2
        with np.errstate(invalid="ignore", divide="ignore"):
            share = first / (first + other)
            variance = ((1.0 - share) ** 2 * squares + share**2 * self.squares[::-1]) / (first + other) ** 2
            effective = share * (1.0 - share) / variance
            return share * effective, (1.0 - share) * effective


class Weighted(Design):
    """Independent joints that count differently.

    Parameters
    ----------
    weights : array_like, shape (n,)
        Weight of each joint, mean 1.
    heaviest : float
        Largest weight that a joint can have; inf if no bound is known.
    from_tolerances : ndarray of bool, shape (n,), optional
        Joints that were drawn from the tolerances themselves, where proposals may leave out ways to a limit.
    withheld : float
        Effective number of joints on a side of a level below which shares are withheld; see `Split.interval`.

    Raises
    ------
    ValueError
        When a weight is negative or not finite.
    """

    claims = frozenset(("share", "quantile", "delivery", "reweighting"))
    interval = "Clopper–Pearson's"
    covers = (
        "joints counted by their weights; bands: pointwise 95 % Clopper–Pearson intervals of as many equal joints as "
        "would be as sure"
    )
    counting = "Joints are counted by their weights."
    ranks_at_once = 200

    def __init__(
        self,
        weights: ArrayLike,
        heaviest: float = np.inf,
        from_tolerances: NDArray[np.bool_] | None = None,
        withheld: float = 0.0,
    ) -> None:
        self.weights: FloatArray = np.asarray(weights, dtype=float)
        if not (np.isfinite(self.weights) & (self.weights >= 0)).all():
            raise ValueError("a weight is negative or no number")
        self.heaviest, self.from_tolerances, self._withheld = heaviest, from_tolerances, withheld
        if from_tolerances is not None:
            self.caveat = (
                "intervals hold if the proposals reach every way to the limit, the last column, from the joints of the "
                "tolerances alone, whatever they miss"
            )

    def shares(self, x: Column, levels: FloatArray, confidence: float) -> Estimate[FloatArray]:
        """See `Design.shares` and the head of this file."""
        split = self._split(x, levels)
        return Estimate(split.share, *split.interval(confidence, self._withheld))

    def estimate(self, x: Column, levels: FloatArray) -> FloatArray:
        """See `Design.estimate`."""
        return self._split(x, levels).share

    def _split(self, x: Column, levels: FloatArray) -> Split:
        values = x.values
        counts = np.flatnonzero(~np.isnan(values))
        order = counts[np.argsort(values[counts], kind="stable")]
        first = np.searchsorted(values[order], levels, side="right")
        return Split.at(first, self.weights[order], self.heaviest)

    def only(self, joints: NDArray[np.intp] | NDArray[np.bool_]) -> Weighted:
        """See `Design.only`."""
        drawn = None if self.from_tolerances is None else self.from_tolerances[joints]
        return Weighted(self.weights[joints], self.heaviest, drawn, self._withheld)

    def refuses(self, claim: Claim) -> tuple[str, str] | None:
        """See `Design.refuses`: only shares and quantiles take the weights into account."""
        if claim in self.claims:
            return None
        remedy = 'use tolstat report {path}, or write sampling.method = "random" in the study'
        return "holds weighted joints (importance sampling), which this statistic does not support", remedy

    def counts_as(self, n: int) -> FloatArray:
        """See `Design.counts_as`."""
        return self.weights

    def doubt(self, x: Column, level: float) -> str:
        """See `Design.doubt`: too few effective joints for weights without a bound, or too heavy a tail of weights."""
        w = self.weights[x.values > level]
        effective = float(w.sum() ** 2 / (w**2).sum()) if w.any() else 0.0
        k = extreme.shape_of_weights(w)
        if (effective >= LEAST_EFFECTIVE or np.isfinite(self.heaviest)) and not k >= LARGEST_SHAPE:
            return ""
        tail = "" if np.isnan(k) else f", Pareto k {k:.2f}, {LARGEST_SHAPE:g} allowed"
        return f"few joints have most of the weight: {effective:.0f} effective{tail}"

    def upper_if_missed(self, x: Column, level: float, confidence: float) -> float:
        """See `Design.upper_if_missed`: that of the joints drawn from the tolerances themselves."""
        if self.from_tolerances is None:
            return np.nan
        drawn = Column(x.values[self.from_tolerances])
        return float(Independent().shares(drawn, np.array([level]), confidence).upper[0])

    def smallest(self, n: int, shares: FloatArray) -> float:
        """See `Design.smallest`: the smallest that is not zero."""
        return float(shares[shares > 0].min(initial=1.0))
