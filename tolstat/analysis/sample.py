"""One load of the joints of a campaign: a value and two ends for each joint, and the design they were drawn by."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.analysis.design import Design, Independent
from tolstat.analysis.estimates import CURVE, Column, Exceedance, Inexact, Mask, Quantile, largest
from tolstat.common.loads import FloatArray
from tolstat.common.tables import UNSETTLED, VALID, Status, worst_status

CONFIDENCE = 0.95
LONG_TAIL = 3.0
"""Ratio of the largest load to the median above which a load has a long tail."""

_IS_VALID, _IS_UNSETTLED = (np.isin(np.arange(256), states) for states in (VALID, UNSETTLED))


@dataclass(frozen=True, eq=False, repr=False)
class Sample:
    """Largest load over the revolution of n joints.

    Two uncertainties of a share are reported separately. *Sampling*: other joints could have been drawn; an interval
    covers it. *Unresolved joints*: a joint that failed or did not settle has no valid load; counting all of them below
    the level, then all of them above it, bounds their effect. They are never dropped silently.

    Attributes
    ----------
    name, unit : str
        ``cross1.F``, and its SI unit.
    limit : float, optional
        Limit of the study, SI.
    nominal : float
        Load of the nominal joint, SI; NaN if there is none.
    value : Column
        Load of each joint, SI; NaN where it does not count.
    inexact : Inexact
        Joints without a single number.
    status : ndarray, shape (n,)
        `tables.Status` of each joint.
    design : Design
        How the joints were drawn.
    scale : float
        Value of one in `unit` as a load, SI: 1 but for ratios of load to limit.
    parts : tuple of Sample
        Loads of which this is the largest; empty for a single one. See `largest_of`.
    of_ratios : bool
        Whether this is the largest ratio of `parts` to their limits.
    """

    name: str
    unit: str
    limit: float | None
    nominal: float
    value: Column
    inexact: Inexact
    status: NDArray[np.uint8]
    design: Design
    scale: float = 1.0
    parts: tuple[Sample, ...] = ()
    of_ratios: bool = False

    @classmethod
    def of(
        cls,
        values: ArrayLike,
        status: ArrayLike,
        design: Design | None = None,
        name: str = "",
        unit: str = "1",
        nominal: float = np.nan,
    ) -> Sample:
        """Make a sample of the loads of all joints.

        Parameters
        ----------
        values : array_like, shape (n,)
            Load of each joint, any unit. A valid joint whose load is not finite counts as failed.
        status : array_like of int, shape (n,)
            `tables.Status` of each joint. Pending joints are left out.
        design : Design, optional
            How the joints were drawn; by default independently.
        name, unit, nominal
            See the attributes.

        Raises
        ------
        ValueError
            When the shapes differ or are not one-dimensional.

        Examples
        --------
        >>> load = Sample.of([640.0, 655.0, 720.0, 690.0], status=[1, 1, 1, 2], unit="N")  # the last has not settled
        >>> found = load.above(700.0)
        >>> found.count, round(found.estimate, 3), round(found.lower, 4), round(found.upper, 3)
        (1, 0.333, 0.0084, 0.906)
        >>> found.bound_lower, found.bound_upper
        (0.25, 0.5)
        """
        load, state = np.asarray(values, dtype=float), np.asarray(status).astype(np.uint8, copy=False)
        if load.ndim != 1 or load.shape != state.shape:
            raise ValueError(f"values {load.shape} and status {state.shape} must be of one length")
        valid = is_valid(load, state)
        value = load if valid.all() else np.where(valid, load, np.nan)
        lost = np.flatnonzero(~valid & (state != Status.PENDING))
        inexact = Inexact(lost, np.full(lost.size, -np.inf), np.full(lost.size, np.inf))
        return cls(name, unit, None, nominal, Column(value), inexact, state, design or Independent())

    @property
    def values(self) -> FloatArray:
        """Load of each joint, NaN where it does not count, (n,)."""
        return self.value.values

    @cached_property
    def lower(self) -> Column:
        """Lower end of the load of each joint."""
        return self.value.replaced(self.inexact.joints, self.inexact.lower)

    @cached_property
    def upper(self) -> Column:
        """Upper end of the load of each joint."""
        return self.value.replaced(self.inexact.joints, self.inexact.upper)

    @property
    def valid(self) -> FloatArray:
        """Loads of the valid joints, ascending."""
        return self.value.ascending

    @property
    def is_valid(self) -> Mask:
        """Which joints have a load, (n,)."""
        return ~np.isnan(self.values)

    @cached_property
    def unresolved(self) -> tuple[int, int]:
        """Number of joints without a load that failed, and that had not settled."""
        lost = np.flatnonzero(np.isnan(self.values) & (self.status != Status.PENDING))
        unsettled = int(np.count_nonzero(_IS_UNSETTLED[self.status[lost]]))
        return lost.size - unsettled, unsettled

    @property
    def long_tailed(self) -> bool:
        """Whether all valid loads are positive and the largest exceeds `LONG_TAIL` times the median."""
        valid = self.valid
        return bool(valid.size and valid[0] > 0 and valid[-1] > LONG_TAIL * valid[valid.size // 2])

    def each(self) -> Iterator[Sample]:
        """Yield the loads, or the ratios of load to limit, of which this is the largest."""
        for part in self.parts:
            yield part.of_limit() if self.of_ratios else part

    def curve(self, levels: ArrayLike | None = None, confidence: float = CONFIDENCE) -> NDArray[np.void]:
        """Share of the joints above each of many levels: the table of P(load > x).

        Parameters
        ----------
        levels : array_like, shape (m,), optional
            Levels in the unit of the values. By default every value that a valid joint has, ascending; between two of
            them the share does not change, so that the table is the whole step curve.
        confidence : float
            Confidence level of the intervals.

        Returns
        -------
        ndarray of CURVE, shape (m,)
            One row a level. The interval is pointwise: it holds at a level chosen beforehand, not for all levels
            jointly.

        Raises
        ------
        ValueError
            When a level is NaN, or the confidence is not between 0 and 1.
        """
        x = np.unique(self.valid) if levels is None else np.atleast_1d(np.asarray(levels, dtype=float))
        if np.isnan(x).any():
            raise ValueError("a level is NaN")
        share = self.design.shares(self.value, x, confidence)
        ends = self.lower, self.upper
        low, high = (share if end is self.value else self.design.shares(end, x, confidence) for end in ends)
        rows = np.zeros(x.shape, CURVE)
        rows["level"], rows["count"], rows["n"] = x, self.value.above(x), self.value.n + sum(self.unresolved)
        rows["n_failed"], rows["n_unsettled"] = self.unresolved
        rows["estimate"], rows["lower"], rows["upper"] = share
        rows["bound_lower"], rows["outer_lower"] = np.nan_to_num(low.estimate, nan=0.0), low.lower
        rows["bound_upper"], rows["outer_upper"] = np.nan_to_num(high.estimate, nan=1.0), high.upper
        return rows

    def above(self, level: float, confidence: float = CONFIDENCE) -> Exceedance:
        """Share of the joints above one level; see `curve`."""
        return Exceedance(*self.curve([level], confidence)[0].tolist())

    def quantile(self, share: float, confidence: float = CONFIDENCE) -> Quantile:
        """Load that a share of the joints stays at or below; its interval inverts that of `curve`.

        Raises
        ------
        ValueError
            When `share` or `confidence` is not between 0 and 1.
        """
        if not (0.0 < share < 1.0 and 0.0 < confidence < 1.0):
            raise ValueError(f"share {share} and confidence {confidence} must lie between 0 and 1")
        numbers = share, self.value.n + sum(self.unresolved), *self.unresolved
        estimate = self._at(self.value, share) if self.value.n else np.nan
        bounds = (self._at(self.lower, share), self._at(self.upper, share)) if self.upper.n else (-np.inf, np.inf)
        return Quantile(*numbers, estimate, *self._interval(share, confidence), *bounds)

    @staticmethod
    def _at(x: Column, share: float) -> float:
        """Smallest number of a column above which at most 1 - `share` of the joints are."""
        most = (1.0 - share) * (1.0 + 1e-12) + 1e-15
        return float(x.ascending[max(x.n - 1 - int(most * x.n), 0)])

    def _interval(self, share: float, confidence: float) -> tuple[float, float]:
        """Ends of the interval of a quantile."""
        loads, n = self.valid, self.value.n
        if not self.design.is_sample:
            return np.nan, np.nan
        below = np.append(np.nextafter(loads[:1], -np.inf), loads[:-1])

        def high_enough(ranks: NDArray[np.intp]) -> Mask:
            return np.asarray(self.design.shares(self.value, loads[ranks], confidence).upper <= 1.0 - share)

        def low_enough(ranks: NDArray[np.intp]) -> Mask:
            """From the largest load down: whether surely enough joints are at this load or above."""
            return np.asarray(self.design.shares(self.value, below[n - 1 - ranks], confidence).lower >= 1.0 - share)

        at_once = self.design.ranks_at_once
        upper, lower = _first(high_enough, n, at_once), n - 1 - _first(low_enough, n, at_once)
        return float(loads[lower]) if lower >= 0 else -np.inf, float(loads[upper]) if upper < n else np.inf

    def delivery(self, level: float, number: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
        """Prediction interval for the number above a level among further joints; see `Design.delivery`.

        Joints without a valid load count below the level for its lower end, above it for its upper end.
        """
        if not self.upper.n:
            return np.nan, np.nan
        return self.design.delivery(self.lower, self.upper, level, number, confidence)

    def shifted(self, by: FloatArray) -> Sample:
        """Return the load of the same joints with `by`, (n,), added; a change that is not known counts as none."""
        joints, *ends = self.inexact
        lower, upper = (end + np.nan_to_num(by[joints]) for end in ends)
        return replace(self, value=Column(self.values + by), inexact=Inexact(joints, lower, upper))

    def with_scrap(self, joints: Mask) -> Sample:
        """Return the load of the same joints, infinite for some without a valid load, (n,), which then count."""
        (lost, lower, upper), kept = self.inexact, ~joints[self.inexact.joints]
        inexact = Inexact(lost[kept], lower[kept], upper[kept])
        value, status = np.where(joints, np.inf, self.values), np.where(joints, Status.OK, self.status)
        return replace(self, value=Column(value), inexact=inexact, status=status.astype(np.uint8))

    def of_limit(self) -> Sample:
        """Return the ratio of load to limit of the same joints; its limit is 1."""
        assert self.limit is not None
        limit, (joints, lower, upper) = self.limit, self.inexact
        inexact = Inexact(joints, lower / limit, upper / limit)
        ratios = replace(self, value=Column(self.values / limit), inexact=inexact, unit="1", limit=1.0)
        return replace(ratios, nominal=self.nominal / limit, scale=self.scale * limit)

    def only(self, joints: NDArray[np.intp] | Mask) -> Sample:
        """Return the load of some of the joints."""
        value = self.values[joints]
        lower, upper = (end.values[joints] for end in (self.lower, self.upper))
        inexact = np.flatnonzero((lower != value) & ~np.isnan(lower) | (upper != value) & ~np.isnan(upper))
        parts, ends = tuple(part.only(joints) for part in self.parts), Inexact(inexact, lower[inexact], upper[inexact])
        some = replace(self, value=Column(value), inexact=ends, status=self.status[joints])
        return replace(some, design=self.design.only(joints), parts=parts)


def is_valid(load: FloatArray, status: NDArray[np.uint8]) -> Mask:
    """Which joints have a valid load, (n,)."""
    return _IS_VALID[status] & np.isfinite(load)


def total_interval(samples: Sequence[Sample], level: float, confidence: float) -> tuple[float, float]:
    """Interval of the share above a level that covers sampling, unresolved joints and numerical error.

    Parameters
    ----------
    samples : sequence of Sample
        A load as simulated and, if its numerical error is known, the load at both ends of that error.
    level, confidence : float
        As in `Sample.above`.

    Returns
    -------
    lower, upper : float
        Envelope of their intervals; NaN when the design gives none.
    """
    each = [sample.above(level, confidence) for sample in samples]
    return min(above.outer_lower for above in each), max(above.outer_upper for above in each)


def largest_of(name: str, parts: Sequence[Sample], of_ratios: bool = False) -> Sample:
    """Largest of several loads of the same joints, whose limits are equal, or largest ratio of load to limit.

    Computed load by load, and ratios are not kept, to save memory. A joint that has no load in one part and is above a
    level in another is above it: its lower end is the largest of the lower ends.
    """
    whole = replace(parts[0], parts=tuple(parts), of_ratios=of_ratios)
    value, inexact = largest((load.value, load.inexact) for load in whole.each())
    nominal = max(part.nominal / (part.limit or 1.0) if of_ratios else part.nominal for part in parts)
    load = replace(next(whole.each()), name=name, nominal=nominal, value=value, inexact=inexact)
    status = worst_status([part.status for part in parts])
    return replace(load, status=status, parts=whole.parts, of_ratios=of_ratios)


def _first(holds: Callable[[NDArray[np.intp]], Mask], n: int, at_once: int) -> int:
    """Find the first of the ranks 0 to n - 1 at which a condition holds, among `at_once` at a time; n if none."""
    begin, end = 0, n
    while begin < end:
        ranks = np.arange(begin, end, -(-(end - begin) // at_once))
        is_met = holds(ranks)
        i = int(np.argmax(is_met)) if is_met.any() else ranks.size
        begin, end = int(ranks[i - 1]) + 1 if i else begin, int(ranks[i]) if i < ranks.size else end
    return end
