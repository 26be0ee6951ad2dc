"""One load of the joints of a campaign, with the estimates that depend on their weights and independence."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.analysis import exceedance, lots, prediction, quantile, replicates, weighted
from tolstat.analysis.exceedance import Exceedance, FloatArray, Mask
from tolstat.analysis.quantile import Quantile
from tolstat.analysis.sorted_loads import Intervals, Sample, sort_out, split
from tolstat.common.shown import table

CONFIDENCE = 0.95
LONG_TAIL = 3.0
"""Ratio of the largest load to the median above which a load has a long tail."""


ArrayT = TypeVar("ArrayT", bound=NDArray[Any])


def frozen(array: ArrayT) -> ArrayT:
    """Return an array that is kept for later readers, and cannot be written to from now on."""
    array.flags.writeable = False
    return array


@dataclass(frozen=True, eq=False, repr=False)
class SampleLoad:
    """Largest load over the revolution of n joints.

    Attributes
    ----------
    name, unit : str
        ``cross1.F``, and its SI unit.
    limit : float, optional
        Limit of the study, SI.
    nominal : float
        Load of the nominal joint, SI; NaN if there is none.
    values : ndarray, shape (n,)
        Load of each joint, SI; NaN without a result.
    intervals : sorted_loads.Intervals
        Those of loads that are not exact, of stationary joints.
    status : ndarray, shape (n,)
        `tables.Status` of each joint.
    weights : ndarray, shape (n,), optional
        Weight of each joint; without it all joints count equally.
    iid : bool
        Whether the joints are independent samples.
    heaviest : float
        Largest weight that a joint can have; inf without a bound.
    drawn : ndarray of bool, shape (n,), optional
        Which joints of importance sampling were drawn from the tolerances themselves.
    replicates : int
        Number of independent replicates, consecutive blocks of the joints; 1 without them.
    scale : float
        Value of one in `unit` as a load, SI: 1 but for ratios of load to limit.
    lots : ndarray of int, shape (n,), optional
        Lot of each joint, where several are of one.
    parts : tuple of SampleLoad
        Loads of which this is the largest; empty for a single one. See `largest_of`.
    of_ratios : bool
        Whether this is the largest ratio of `parts` to their limits.
    """

    name: str
    unit: str
    limit: float | None
    nominal: float
    values: FloatArray
    intervals: Intervals
    status: NDArray[np.uint8]
    weights: FloatArray | None
    iid: bool
    heaviest: float = np.inf
    replicates: int = 1
    drawn: Mask | None = None
    scale: float = 1.0
    lots: NDArray[np.intp] | None = None
    parts: tuple[SampleLoad, ...] = ()
    of_ratios: bool = False

    def __repr__(self) -> str:
        valid = self.valid
        span = f", {valid[0]:.4g} to {valid[-1]:.4g} {self.unit}" if valid.size else ""
        limit = "" if self.limit is None else f", limit {self.limit:.4g} {self.unit}"
        return f"<load {self.name!r}: {valid.size} of {self.values.size} joints valid{span}{limit}>"

    def _repr_html_(self) -> str:
        shares = (0.5, 0.9, 0.99) if self.valid.size else ()
        entries = [(f"{share:.0%} quantile", f"{self.quantile(share).estimate:.4g} {self.unit}") for share in shares]
        return table(repr(self)[1:-1], [("nominal", f"{self.nominal:.4g} {self.unit}"), *entries])

    @property
    def ends(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper end of each load, (n,) each."""
        return self.intervals.ends(self.values)

    def each(self) -> Iterator[SampleLoad]:
        """Yield the loads, or the ratios of load to limit, of which this is the largest."""
        for part in self.parts:
            yield part.of_limit() if self.of_ratios else part

    @cached_property
    def sample(self) -> Sample:
        """Loads of the valid joints, ascending, and numbers of the others."""
        sample = sort_out(self.values, self.status, self.intervals)
        for array in sample[:4]:
            frozen(array)
        return sample

    @cached_property
    def _weighted(self) -> weighted.Sample:
        assert self.weights is not None
        return weighted.sort_out(self.values, self.status, self.weights, self.ends, self.heaviest)

    @cached_property
    def _parts(self) -> list[Sample]:
        """Loads of each replicate."""
        return self._sorted(np.split(np.arange(self.values.size), self.replicates))

    @cached_property
    def of_lots(self) -> list[Sample]:
        """Loads of each lot."""
        assert self.lots is not None
        changes = np.flatnonzero(np.diff(self.lots)) + 1  # joints of a lot are consecutive
        return self._sorted(np.split(np.arange(self.values.size), changes))

    def _sorted(self, blocks: Sequence[NDArray[np.intp]]) -> list[Sample]:
        (lower, upper), values = self.ends, self.values
        return [sort_out(values[b], self.status[b], Intervals.of(values[b], (lower[b], upper[b]))) for b in blocks]

    @property
    def valid(self) -> FloatArray:
        """Loads of the valid joints, ascending."""
        return self.sample.valid

    @cached_property
    def is_valid(self) -> Mask:
        """Which joints are valid, (n,)."""
        return frozen(split(self.values, self.status)[0])

    @property
    def valid_or_nan(self) -> FloatArray:
        """Load of each joint, NaN where it is not valid, (n,)."""
        return np.where(self.is_valid, self.values, np.nan)

    @property
    def long_tailed(self) -> bool:
        """Whether all valid loads are positive and the largest exceeds `LONG_TAIL` times the median."""
        valid = self.valid
        return bool(valid.size and valid[0] > 0 and valid[-1] > LONG_TAIL * valid[valid.size // 2])

    def curve(self, levels: ArrayLike | None = None, confidence: float = CONFIDENCE) -> NDArray[np.void]:
        """Share of the joints above each level, (m,) table `exceedance.CURVE`; see `exceedance.curve`."""
        if self.replicates > 1:
            return replicates.curve_of(self.sample, self._parts, levels, confidence)
        if self.lots is not None:
            return lots.curve_of(self.sample, self.of_lots, levels, confidence)
        if self.weights is None:
            return exceedance.curve_of(self.sample, levels, confidence, self.iid)
        return weighted.curve_of(self._weighted, levels, confidence)

    def above(self, level: float, confidence: float = CONFIDENCE) -> Exceedance:
        """Share of the joints above one level; see `curve`."""
        if self.weights is None and self.lots is None and self.replicates == 1 and "sample" not in vars(self):
            # not sorted yet: to count the joints above one level takes less time, and no memory
            return exceedance.above(self.values, self.status, self.intervals, level, confidence, self.iid)
        return Exceedance(*self.curve([level], confidence)[0].tolist())

    def quantile(self, share: float, confidence: float = CONFIDENCE) -> Quantile:
        """Load that a share of the joints stays at or below; see `quantile.quantile`."""
        if self.replicates > 1:
            return replicates.quantile_of(self.sample, self._parts, share, confidence)
        if self.lots is not None:
            return lots.quantile_of(self.sample, self.of_lots, share, confidence)
        if self.weights is None:
            return quantile.of_sample(self.sample, share, confidence, self.iid)
        return weighted.quantile_of(self._weighted, share, confidence)

    def trust(self, level: float) -> weighted.Trust:
        """Diagnostics of the weights above a level; see `weighted.trust`."""
        return weighted.trust_of(self._weighted, level)

    def supports(self, level: float) -> bool:
        """Whether the weights of the joints support a share above a level; equal weights always do."""
        return self.weights is None or self.trust(level).usable

    def unsearched(self, level: float, confidence: float = CONFIDENCE) -> float:
        """Upper end of the share above a level whatever the proposals of importance sampling miss.

        That of the joints drawn from the tolerances themselves; Clopper and Pearson's, with all joints without a valid
        load above the level. NaN for joints of equal weight.
        """
        if self.drawn is None:
            return np.nan
        return replace(self.only(self.drawn), weights=None, drawn=None).above(level, confidence).outer_upper

    def delivery(self, level: float, number: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
        """Prediction interval for the number above a level among further joints; see `analysis.prediction`.

        Joints without a valid load count below the level for its lower end, above it for its upper end. NaN without an
        interval, and where joints share lots, see `questions.lots`.
        """
        if self.lots is not None:
            return np.nan, np.nan
        if self.weights is None and self.replicates == 1:
            found = self.above(level, confidence)
            if np.isnan(found.lower):
                return np.nan, np.nan
            least, most = round(found.n * found.bound_lower), round(found.n * found.bound_upper)
            return prediction.of_counts(least, most, found.n, number, confidence)
        found = self.above(level, prediction.half(confidence))
        return prediction.of_share(found.outer_lower, found.outer_upper, number, confidence)

    def shifted(self, by: FloatArray) -> SampleLoad:
        """Return the load of the same joints with `by`, (n,), added to values and intervals."""
        at = by[self.intervals.joints]
        intervals = Intervals(self.intervals.joints, self.intervals.lower + at, self.intervals.upper + at)
        return replace(self, values=self.values + by, intervals=intervals)

    def scaled(self, factor: float) -> SampleLoad:
        """Return the load of the same joints with values and intervals times a factor."""
        joints, lower, upper = self.intervals
        return replace(self, values=factor * self.values, intervals=Intervals(joints, factor * lower, factor * upper))

    def of_limit(self) -> SampleLoad:
        """Return the ratio of load to limit of the same joints; its limit is 1."""
        assert self.limit is not None
        limit = self.limit
        joints, lower, upper = self.intervals
        return replace(
            self,
            values=self.values / limit,
            intervals=Intervals(joints, lower / limit, upper / limit),
            unit="1",
            limit=1.0,
            nominal=self.nominal / limit,
            scale=self.scale * limit,
        )

    def only(self, samples: NDArray[np.intp] | Mask) -> SampleLoad:
        """Return the load of some of the joints."""
        values, (lower, upper) = self.values[samples], self.ends
        return replace(
            self,
            values=values,
            intervals=Intervals.of(values, (lower[samples], upper[samples])),
            status=self.status[samples],
            replicates=1,
            weights=None if self.weights is None else self.weights[samples],
            drawn=None if self.drawn is None else self.drawn[samples],
            lots=None if self.lots is None else self.lots[samples],
            parts=tuple(part.only(samples) for part in self.parts),
        )


def largest_of(name: str, parts: Sequence[SampleLoad], of_ratios: bool = False) -> SampleLoad:
    """Largest of several loads of the same joints, whose limits are equal, or largest ratio of load to limit.

    Computed load by load, and ratios are not kept, to save memory.
    """
    joints = np.unique(np.concatenate([part.intervals.joints for part in parts]))
    loads = replace(parts[0], parts=tuple(parts), of_ratios=of_ratios).each()
    first = next(loads)
    values, nominal = first.values.copy(), first.nominal
    lower, upper = first.intervals.ends_of(joints, first.values)
    for load in loads:
        own = load.intervals.ends_of(joints, load.values)
        lower, upper = np.maximum(lower, own[0]), np.maximum(upper, own[1])
        np.maximum(values, load.values, out=values)
        nominal = max(nominal, load.nominal)
    intervals = Intervals.of(values[joints], (lower, upper)).among(joints)
    return replace(
        first,
        name=name,
        nominal=nominal,
        values=frozen(values),
        intervals=intervals,
        parts=tuple(parts),
        of_ratios=of_ratios,
    )
