"""Estimates: a number with its interval; of one load the share above a level, and the load that a share stays below."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Generic, NamedTuple, TypeVar

import numpy as np

T = TypeVar("T")


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
