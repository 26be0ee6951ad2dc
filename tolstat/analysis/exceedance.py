"""Which share of the joints exceeds a load? Estimates with exact binomial intervals.

Two uncertainties are reported separately. *Sampling*: other joints could have been drawn; the Clopper–Pearson interval
covers it, for independent samples only. *Unresolved joints*: a joint that failed or did not settle has no valid load;
counting all of them below the level, then all of them above it, bounds their effect. They are never dropped silently.
The largest load of a stationary joint has an interval; at a level inside it, that joint too counts below, then above.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.analysis.sorted_loads import EXACT, Counted, Ends, Intervals, Sample, count, sort_out
from tolstat.common.shown import shown

FloatArray = NDArray[np.float64]
Table = NDArray[np.void]
Mask = NDArray[np.bool_]


@shown
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
        ``count`` over the number of valid joints; NaN when none is valid.
    lower, upper : float
        Clopper–Pearson interval of the valid joints; NaN when the samples are not independent.
    bound_lower, bound_upper : float
        Share of all `n` joints above the level with every undecided joint counted below it, and above it. Undecided
        are the unresolved joints, and stationary ones whose interval contains the level.
    outer_lower, outer_upper : float
        Lower Clopper–Pearson end of ``bound_lower`` and upper end of ``bound_upper``: covers both uncertainties.
        NaN when the samples are not independent.
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


def clopper_pearson(count: ArrayLike, n: ArrayLike, confidence: float = 0.95) -> tuple[FloatArray, FloatArray]:
    """Two-sided exact interval of a binomial probability (Clopper and Pearson 1934).

    Parameters
    ----------
    count, n : array_like of int
        Successes and trials, broadcast together; ``0 <= count <= n``. No trial gives (0, 1).
    confidence : float
        Coverage guaranteed for every true probability.

    Returns
    -------
    lower, upper : ndarray
        Ends of the interval, shape of the broadcast.

    Raises
    ------
    ValueError
        When the confidence is not between 0 and 1, or a count is not between 0 and `n`.
    """
    from scipy.special import betaincinv

    if not 0.0 < confidence < 1.0:
        raise ValueError(f"confidence {confidence} must lie between 0 and 1")
    k, m = np.broadcast_arrays(np.asarray(count, dtype=float), np.asarray(n, dtype=float))
    if np.any(k < 0) or np.any(k > m):
        raise ValueError("count must lie between 0 and n")
    tail = 0.5 * (1.0 - confidence)
    # The beta function of order 0 does not exist; those ends are 0 and 1 by definition.
    some, others = np.where(k > 0, k, 1.0), np.where(k < m, m - k, 1.0)
    lower = np.where(k > 0, betaincinv(some, m - some + 1.0, tail), 0.0)
    upper = np.where(k < m, betaincinv(k + 1.0, others, 1.0 - tail), 1.0)
    return lower, upper


def simultaneous(n: int, confidence: float = 0.95) -> float:
    """Half width of the simultaneous band of the exceedance curve (Dvoretzky, Kiefer and Wolfowitz 1956).

    With the constant of Massart (1990): ``P(sup |estimate - truth| > e) <= 2 exp(-2 n e^2)``, for every distribution.

    Parameters
    ----------
    n : int
        Independent joints.
    confidence : float
        Coverage guaranteed for all levels together.

    Returns
    -------
    float
        Half width e, a share of the joints; at most 1.

    Raises
    ------
    ValueError
        When the confidence is not between 0 and 1.

    Examples
    --------
    >>> round(simultaneous(1024), 4)
    0.0424
    """
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"confidence {confidence} must lie between 0 and 1")
    return min(1.0, float(np.sqrt(0.5 * np.log(2.0 / (1.0 - confidence)) / max(n, 1))))


def needed(share: float, accepted: float, confidence: float = 0.95) -> float:
    """Minimum number of joints for a Clopper–Pearson interval that excludes an accepted share.

    Parameters
    ----------
    share : float
        Assumed share of the joints above the level, such as the estimate of an earlier campaign.
    accepted : float
        Accepted share, between 0 and 1.
    confidence : float
        Confidence level of the interval.

    Returns
    -------
    float
        Least number of independent joints whose interval, with exactly `share` of them above the level, excludes
        `accepted`; infinite if both shares are equal.

    Raises
    ------
    ValueError
        When `accepted` or the confidence is not between 0 and 1, or `share` not from 0 to 1.

    Examples
    --------
    >>> needed(0.0, 0.01)  # none of 368 joints
    368.0
    """
    if not (0.0 < accepted < 1.0 and 0.0 <= share <= 1.0):
        raise ValueError(f"share {share} and accepted share {accepted} must lie between 0 and 1")
    if share == accepted:
        return np.inf

    def tells(n: float) -> bool:
        lower, upper = clopper_pearson(share * n, n, confidence)
        return bool(upper <= accepted or lower > accepted)

    high = 1.0
    while not tells(high) and high < 1e15:
        high *= 2.0
    low = 0.5 * high
    while high - low > 1.0:  # bisection: with the share fixed, more joints make the interval narrower
        middle = np.floor(0.5 * (low + high))
        low, high = (low, middle) if tells(middle) else (middle, high)
    return float(high)


def unresolved_matter(count: int, n: int, n_unresolved: int, confidence: float = 0.95) -> bool:
    """Whether joints without a valid load make a share about as uncertain as sampling does, or more.

    Parameters
    ----------
    count : int
        Valid joints above the level.
    n, n_unresolved : int
        Joints simulated, and those of them without a valid load.
    confidence : float
        Confidence level of the Clopper–Pearson interval that tells how uncertain sampling makes the share.

    Returns
    -------
    bool
        Whether their share of all joints is at least half the width of the interval of the valid joints.

    Examples
    --------
    >>> unresolved_matter(0, 61, 36), unresolved_matter(75, 1024, 2)
    (True, False)
    """
    if not n_unresolved:
        return False
    lower, upper = clopper_pearson(count, n - n_unresolved, confidence)
    return bool(n_unresolved / n >= 0.5 * (upper - lower))


def exceedance(
    values: ArrayLike,
    status: ArrayLike,
    level: float,
    confidence: float = 0.95,
    iid: bool = True,
    ends: Ends | None = None,
) -> Exceedance:
    """Share of the joints whose load is above one level.

    Parameters
    ----------
    values, status : array_like, shape (n,)
        Load and `tables.Status` of each joint; leave the nominal joint out.
    level : float
        Level, in the unit of the values; a load equal to it does not exceed it.
    confidence : float
        Confidence level of the intervals.
    iid : bool
        Whether the joints are independent samples; the intervals are NaN when they are not (Sobol', Latin
        hypercube, sweep), since Clopper–Pearson holds for independent samples only.
    ends
        As in `curve`.

    Returns
    -------
    Exceedance
        Estimate, interval and bounds.

    Examples
    --------
    >>> load = [640.0, 655.0, 720.0, 690.0]  # N, the largest of each joint
    >>> found = exceedance(load, status=[1, 1, 1, 2], level=700.0)  # the last joint has not settled
    >>> found.count, round(found.estimate, 3), round(found.lower, 4), round(found.upper, 3)
    (1, 0.333, 0.0084, 0.906)
    >>> found.bound_lower, found.bound_upper
    (0.25, 0.5)
    """
    return above(values, status, _intervals(values, ends), level, confidence, iid)


def above(
    values: ArrayLike, status: ArrayLike, intervals: Intervals, level: float, confidence: float = 0.95, iid: bool = True
) -> Exceedance:
    """Share of the joints whose load is above one level, from loads that are not sorted; see `exceedance`."""
    x = _levels([level])
    row = _table(x, count(values, status, intervals, x), confidence, iid)[0]
    return Exceedance(*row.tolist())


def curve(
    values: ArrayLike,
    status: ArrayLike,
    levels: ArrayLike | None = None,
    confidence: float = 0.95,
    iid: bool = True,
    ends: Ends | None = None,
) -> NDArray[np.void]:
    """Share of the joints above each of many levels: the table of P(load > x).

    Parameters
    ----------
    values, status, confidence, iid
        As in `exceedance`.
    levels : array_like, shape (m,), optional
        Levels in the unit of the values. By default every value that a valid joint has, ascending; between
        two of them the share does not change, so that the table is the whole step curve.
    ends : tuple of array_like, shape (n,), optional
        Interval of each load; without it, and where an end is not finite, the load is exact.

    Returns
    -------
    ndarray of CURVE, shape (m,)
        One row a level. The interval is pointwise: it holds at a level chosen beforehand, not for all
        levels jointly.

    Raises
    ------
    ValueError
        As `sort_out` and `clopper_pearson`, or when a level is NaN.
    """
    return curve_of(sort_out(values, status, _intervals(values, ends)), levels, confidence, iid)


def curve_of(
    sample: Sample, levels: ArrayLike | None = None, confidence: float = 0.95, iid: bool = True
) -> NDArray[np.void]:
    """Share of the joints above each of many levels, from loads that are sorted already; see `curve`."""
    x = np.unique(sample.valid) if levels is None else _levels(levels)
    return _table(x, sample.counted(x), confidence, iid)


def _intervals(values: ArrayLike, ends: Ends | None) -> Intervals:
    return EXACT if ends is None else Intervals.of(np.asarray(values, dtype=float), ends)


def _levels(levels: ArrayLike) -> FloatArray:
    x = np.atleast_1d(np.asarray(levels, dtype=float))
    if np.isnan(x).any():
        raise ValueError("a level is NaN")
    return x


def _table(levels: FloatArray, joints: Counted, confidence: float, iid: bool) -> NDArray[np.void]:
    n, n_valid, most = joints.n, joints.n_valid, joints.most + joints.n_unresolved
    table = np.zeros(levels.shape, CURVE)
    table["level"], table["count"] = levels, joints.above
    table["n"], table["n_failed"], table["n_unsettled"] = n, joints.n_failed, joints.n_unsettled
    table["estimate"] = joints.above / n_valid if n_valid else np.nan
    table["bound_lower"] = joints.least / n if n else 0.0
    table["bound_upper"] = most / n if n else 1.0
    for name in ("lower", "upper", "outer_lower", "outer_upper"):
        table[name] = np.nan
    if iid:
        table["lower"], table["upper"] = clopper_pearson(joints.above, n_valid, confidence)
        table["outer_lower"] = clopper_pearson(joints.least, n, confidence)[0]
        table["outer_upper"] = clopper_pearson(most, n, confidence)[1]
    return table
