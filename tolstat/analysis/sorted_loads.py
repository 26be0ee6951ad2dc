"""One load of the simulated joints, ready to be counted: valid loads in ascending order, and how many joints have none.

The largest load of a stationary joint has an interval. Such joints are few in most campaigns, so that only their ends
are kept, beside the loads of all joints.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.common.loads import FloatArray
from tolstat.common.tables import UNSETTLED, VALID, Status

Ends = tuple[ArrayLike, ArrayLike]
"""Lower and upper end of the interval of each joint's load."""

_IS_VALID, _IS_UNSETTLED = (np.isin(np.arange(256), states) for states in (VALID, UNSETTLED))


class Intervals(NamedTuple):
    """Loads that are known within an interval only.

    Attributes
    ----------
    joints : ndarray of int, shape (k,)
        Indices of these joints, ascending; the loads of all others are exact.
    lower, upper : ndarray, shape (k,)
        Ends of their intervals.
    """

    joints: NDArray[np.intp]
    lower: FloatArray
    upper: FloatArray

    @classmethod
    def of(cls, values: FloatArray, ends: Ends) -> Intervals:
        """Find the intervals among the ends of all loads, (n,) each; an end that is not finite is the load itself."""
        lower, upper = (np.where(np.isfinite(end), end, values) for end in ends)
        joints = np.flatnonzero(np.isfinite(values) & ((lower != values) | (upper != values)))
        return cls(joints, lower[joints], upper[joints])

    def among(self, joints: NDArray[np.intp]) -> Intervals:
        """Return the intervals of a part of the joints as those of all; `joints` are the indices of the part, (m,)."""
        return self._replace(joints=joints[self.joints])

    def ends(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Both ends of all loads, (n,) each."""
        lower, upper = values.copy(), values.copy()
        lower[self.joints], upper[self.joints] = self.lower, self.upper
        return lower, upper

    def ends_of(self, joints: NDArray[np.intp], values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Both ends of the loads of some joints, all with an interval among them, (m,) each; `values` are all loads."""
        place = np.searchsorted(joints, self.joints)
        return self._replace(joints=place).ends(values[joints])


EXACT = Intervals(np.empty(0, np.intp), np.empty(0), np.empty(0))
"""No load has an interval."""


class Counted(NamedTuple):
    """Numbers of joints, and of those above some levels.

    Attributes
    ----------
    n_valid, n_failed, n_unsettled : int
        Joints with a valid load; whose solution failed; that had not settled.
    above, least, most : ndarray of int, shape (levels,)
        Valid joints above each level; the same with the lower ends of all intervals, and with the upper ends.
    """

    n_valid: int
    n_failed: int
    n_unsettled: int
    above: NDArray[np.intp]
    least: NDArray[np.intp]
    most: NDArray[np.intp]

    @property
    def n(self) -> int:
        """Joints simulated."""
        return self.n_valid + self.n_unresolved

    @property
    def n_unresolved(self) -> int:
        """Joints without a valid load."""
        return self.n_failed + self.n_unsettled


class Sample(NamedTuple):
    """One load of the simulated joints, sorted once for all shares and quantiles; see `sort_out`.

    Attributes
    ----------
    valid : ndarray, shape (m,)
        Loads of the valid joints, ascending.
    inexact, lower, upper : ndarray, shape (k,)
        Those of these loads that have an interval, and the ends of the intervals; each ascending.
    n_failed, n_unsettled : int
        Joints without a valid load.
    """

    valid: FloatArray
    inexact: FloatArray
    lower: FloatArray
    upper: FloatArray
    n_failed: int
    n_unsettled: int

    @classmethod
    def exact(cls, valid: FloatArray) -> Sample:
        """Make a sample of joints that are all valid; their loads are exact, and ascending."""
        none = np.empty(0)
        return cls(valid, none, none, none, 0, 0)

    @property
    def n(self) -> int:
        """Joints simulated."""
        return self.valid.size + self.n_unresolved

    @property
    def n_unresolved(self) -> int:
        """Joints without a valid value."""
        return self.n_failed + self.n_unsettled

    def counted(self, levels: FloatArray) -> Counted:
        """Count the joints above each level, (levels,)."""
        above, inexact, lower, upper = (
            loads.size - np.searchsorted(loads, levels, side="right")
            for loads in (self.valid, self.inexact, self.lower, self.upper)
        )
        exact = above - inexact
        return Counted(self.valid.size, self.n_failed, self.n_unsettled, above, exact + lower, exact + upper)


def sort_out(values: ArrayLike, status: ArrayLike, intervals: Intervals = EXACT) -> Sample:
    """Split the simulated joints into valid (sorted ascending), failed and unsettled.

    Parameters
    ----------
    values : array_like, shape (n,)
        Load of each joint, any unit.
    status : array_like of int, shape (n,)
        `tables.Status` of each joint. Pending joints are left out. Rows are simulated in order, so pending joints are
        the last rows and those being simulated, among which slow joints are over-represented. A value that is not
        finite counts as failed even if its status is valid.
    intervals : Intervals
        Loads that are not exact.

    Returns
    -------
    Sample
        Valid values and the counts of the others.

    Raises
    ------
    ValueError
        When the shapes differ or are not one-dimensional.
    """
    load, state = _alike(values, status)
    valid, failed, unsettled = split(load, state)
    joints, lower, upper = _valid_only(intervals, valid)
    exact, inexact, least, most = (np.sort(own) for own in (load[valid], load[joints], lower, upper))
    return Sample(exact, inexact, least, most, int(np.count_nonzero(failed)), int(np.count_nonzero(unsettled)))


def count(values: ArrayLike, status: ArrayLike, intervals: Intervals, levels: FloatArray) -> Counted:
    """Count the joints above a few levels without sorting them; parameters and exceptions as in `sort_out`."""
    load, state = _alike(values, status)
    valid, failed, unsettled = split(load, state)
    joints, lower, upper = _valid_only(intervals, valid)
    above = np.array([np.count_nonzero(valid & (load > level)) for level in levels])
    inexact, least, most = (np.count_nonzero(own[:, None] > levels, axis=0) for own in (load[joints], lower, upper))
    n_valid, n_failed, n_unsettled = (int(np.count_nonzero(mask)) for mask in (valid, failed, unsettled))
    return Counted(n_valid, n_failed, n_unsettled, above, above - inexact + least, above - inexact + most)


def split(
    load: FloatArray, status: NDArray[np.integer]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]]:
    """Which joints are valid, failed and unsettled, each (n,); pending joints are none of these."""
    state = status.astype(np.uint8, copy=False)
    unsettled, valid = _IS_UNSETTLED[state], _IS_VALID[state] & np.isfinite(load)
    return valid, ~valid & ~unsettled & (status != Status.PENDING), unsettled


def _alike(values: ArrayLike, status: ArrayLike) -> tuple[FloatArray, NDArray[np.integer]]:
    load, state = np.asarray(values, dtype=float), np.asarray(status)
    if load.ndim != 1 or load.shape != state.shape:
        raise ValueError(f"values {load.shape} and status {state.shape} must be of one length")
    return load, state


def _valid_only(intervals: Intervals, valid: NDArray[np.bool_]) -> Intervals:
    kept = valid[intervals.joints]
    return Intervals(intervals.joints[kept], intervals.lower[kept], intervals.upper[kept])
