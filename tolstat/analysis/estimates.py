"""Loads of the joints in a column, and what is estimated of them: a number with its interval."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.common.loads import FloatArray

FEW_LEVELS = 8
"""Number of levels up to which joints are counted without sorting, which takes less time and no memory."""

Mask = NDArray[np.bool_]
T = TypeVar("T")
ArrayT = TypeVar("ArrayT", bound=NDArray[Any])


class Estimate(NamedTuple, Generic[T]):
    """A number, or an array of them, and its interval; NaN ends for dependent samples."""

    estimate: T
    lower: T
    upper: T


@dataclass(frozen=True)
class Exceedance:
    """Share of the joints whose load is above a level.

    Attributes
    ----------
    level : float
        Load level, in the unit of the values.
    n : int
        Joints simulated, the unresolved ones included.
    n_failed, n_unsettled : int
        Joints without a valid load: the solution failed, or had not settled at ``solver.max_revs``.
    count : int
        Valid joints above the level.
    estimate : float
        Share of the valid joints above the level; NaN when none is valid.
    lower, upper : float
        Interval of that share; NaN when the design gives none.
    bound_lower, bound_upper : float
        Share of all `n` joints above the level with every undecided joint counted below it, and above it. Undecided
        are the unresolved joints, and stationary ones whose interval contains the level.
    outer_lower, outer_upper : float
        Lower end of the interval of ``bound_lower`` and upper end of that of ``bound_upper``: cover both uncertainties.
    """

    level: float
    n: int
    n_failed: int
    n_unsettled: int
    count: int
    estimate: float
    lower: float
    upper: float
    bound_lower: float
    bound_upper: float
    outer_lower: float
    outer_upper: float


CURVE = np.dtype([(f.name, "i8" if f.type == "int" else "f8") for f in fields(Exceedance)])
"""A row of a curve: the fields of `Exceedance`."""


class Quantile(NamedTuple):
    """Load that a share of the joints stays at or below.

    Attributes
    ----------
    share : float
        Share of the joints, between 0 and 1.
    n, n_failed, n_unsettled : int
        As in `Exceedance`.
    estimate : float
        Smallest value that at least `share` of the valid joints do not exceed; NaN when none is valid.
    lower, upper : float
        Two-sided interval from the valid joints, ±inf when they are too few; NaN when the design gives none.
    bound_lower, bound_upper : float
        The estimate with the lower and with the upper end of every load; ±inf if it falls among unresolved joints.
    """

    share: float
    n: int
    n_failed: int
    n_unsettled: int
    estimate: float
    lower: float
    upper: float
    bound_lower: float
    bound_upper: float


def frozen(array: ArrayT) -> ArrayT:
    """Return an array that is kept for later readers, and cannot be written to from now on."""
    array.flags.writeable = False
    return array


class Column:
    """Numbers of n joints; NaN for a joint that does not count.

    Parameters
    ----------
    values : array_like, shape (n,)
        The numbers; they may be infinite.
    """

    def __init__(self, values: ArrayLike) -> None:
        self.values: FloatArray = np.asarray(values, dtype=float)

    @cached_property
    def n(self) -> int:
        """Number of joints that count."""
        return int(self.values.size - np.count_nonzero(np.isnan(self.values)))

    @cached_property
    def ascending(self) -> FloatArray:
        """Numbers of the joints that count, ascending, (`n`,)."""
        return frozen(np.sort(self.values)[: self.n])  # NaN is sorted last

    def above(self, levels: FloatArray) -> NDArray[np.intp]:
        """Count the joints above each level, (m,)."""
        if levels.size <= FEW_LEVELS and "ascending" not in vars(self):
            return np.array([np.count_nonzero(self.values > level) for level in levels], dtype=np.intp)
        return np.asarray(self.n - np.searchsorted(self.ascending, levels, side="right"))

    def shares(self, levels: FloatArray) -> FloatArray:
        """Share of the joints above each level, (m,); NaN without joints."""
        with np.errstate(invalid="ignore"):
            return np.asarray(self.above(levels) / np.float64(self.n))

    def replaced(self, joints: NDArray[np.intp], values: FloatArray) -> Column:
        """Return the column with other numbers for some joints; what is sorted already is not sorted again."""
        return _Replaced(self, joints, values) if joints.size else self


class _Replaced(Column):
    """Column with other numbers for some joints: counts are those of the whole, less the old, plus the new."""

    def __init__(self, base: Column, joints: NDArray[np.intp], values: FloatArray) -> None:
        self.base, self._joints = base, joints
        self._old, self._new = Column(base.values[joints]), Column(values)

    @property
    def values(self) -> FloatArray:  # type: ignore[override]
        """The numbers, (n,), in a new array."""
        values = self.base.values.copy()
        values[self._joints] = self._new.values
        return frozen(values)

    @property
    def n(self) -> int:
        """Number of joints that count."""
        return self.base.n - self._old.n + self._new.n

    @property
    def ascending(self) -> FloatArray:
        """Numbers of the joints that count, ascending, in a new array."""
        whole, old, new = self.base.ascending, self._old.ascending, self._new.ascending
        # equal numbers are replaced one by one
        replaced = np.searchsorted(whole, old) + np.arange(old.size) - np.searchsorted(old, old)
        kept = np.delete(whole, replaced)
        return frozen(np.insert(kept, np.searchsorted(kept, new), new))

    def above(self, levels: FloatArray) -> NDArray[np.intp]:
        """Count the joints above each level, (m,)."""
        return np.asarray(self.base.above(levels) - self._old.above(levels) + self._new.above(levels))


class Inexact(NamedTuple):
    """Joints whose load is no single number.

    Attributes
    ----------
    joints : ndarray of int, shape (k,)
        Indices of these joints, ascending.
    lower, upper : ndarray, shape (k,)
        Ends of their loads: an interval (stationary), -inf and inf (failed or unsettled), NaN (pending).
    """

    joints: NDArray[np.intp]
    lower: FloatArray
    upper: FloatArray

    def of(self, joints: NDArray[np.intp], values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Ends of the loads of some joints, all of these among them, (m,) each; `values` are all loads."""
        lower, upper = values[joints], values[joints]
        index = np.searchsorted(joints, self.joints)
        lower[index], upper[index] = self.lower, self.upper
        return lower, upper


def largest(loads: Iterable[tuple[Column, Inexact]]) -> tuple[Column, Inexact]:
    """Largest of several loads of each joint, and of their ends; taken one after the other to save memory."""
    each = iter(loads)
    column, inexact = next(each)
    values = column.values.copy()
    for other, other_inexact in each:
        joints = np.union1d(inexact.joints, other_inexact.joints)
        ends = zip(inexact.of(joints, values), other_inexact.of(joints, other.values), strict=True)
        inexact = Inexact(joints, *(np.maximum(*pair) for pair in ends))
        np.maximum(values, other.values, out=values)
    return Column(frozen(values)), inexact
