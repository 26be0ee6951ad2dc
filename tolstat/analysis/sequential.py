"""Sequential estimation of a share: look at fixed numbers of joints, stop when the interval is narrow enough.

An interval that is inspected repeatedly covers less than its confidence. Here the looks are at numbers of joints fixed
beforehand, `GROWTH` apart, and each interval is Clopper and Pearson's with the confidence `CONFIDENCE`; the one at the
stop then covers in 95 % of campaigns at least. That is computed, not assumed: `tests/support/stops.py` has the exact
distribution over the pairs (look, count above) at which campaigns stop (Chen and Chen 2013).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.analysis.binomial import clopper_pearson
from tolstat.common.loads import FloatArray

GROWTH = 1.05
"""Ratio of the numbers of joints of two looks."""
CONFIDENCE = 0.975
"""Confidence level of the interval of one look, for 95 % at the stop."""
LEAST_BESIDE = 10
"""Minimum number of joints on each side of the level at a stop."""
BIAS = 0.11
"""Largest relative bias of count over joints at a stop: that of a share for which `LEAST_BESIDE` are above."""


def looks(n: int, taken: Sequence[int] = ()) -> list[int]:
    """Return the numbers of joints at which to look: each `GROWTH` times the one before, rounded up; the last is `n`.

    Parameters
    ----------
    n : int
        Number of joints of the campaign.
    taken : sequence of int
        Looks that were taken before, when the campaign was shorter; those below `n` are looks again.

    Returns
    -------
    list of int
        Ascending.

    Examples
    --------
    >>> looks(26)
    [20, 21, 23, 24, 25, 26]
    """
    numbers, joints = set(taken), 2.0 * LEAST_BESIDE
    while joints < n:
        numbers.add(int(np.ceil(joints)))
        joints *= GROWTH
    return [*sorted(number for number in numbers if number < n), n]


def interval(count: ArrayLike, others: ArrayLike, joints: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Interval at a look, for arrays of one shape.

    Parameters
    ----------
    count, others : array_like of int
        Joints above the level; joints without a valid load, which count as below it for the lower end of the interval
        and as above it for the upper end.
    joints : array_like of int
        All joints looked at.

    Returns
    -------
    lower, upper : ndarray
    """
    lower, _ = clopper_pearson(count, joints, CONFIDENCE)
    _, upper = clopper_pearson(np.add(count, others), joints, CONFIDENCE)
    return lower, upper


def narrow(width: float, count: ArrayLike, others: ArrayLike, joints: ArrayLike) -> NDArray[np.bool_]:
    """Whether to stop at a look: its interval is narrower than `width`, with joints on both sides of the level."""
    lower, upper = interval(count, others, joints)
    below = np.subtract(joints, np.add(count, others))
    return np.asarray((upper - lower < width) & (np.minimum(count, below) >= LEAST_BESIDE))


def next_look(width: float, planned: Sequence[int], count: int = 0, others: int = 0, joints: int = 0) -> int:
    """Return the first look after `joints` at which a stop is possible, else the last one.

    The looks before it need not be evaluated: whatever the loads of the joints between, the interval is too wide there.
    It is narrowest with the least or the largest count that a stop can have.
    """
    least = max(count, LEAST_BESIDE)
    later = [
        look for look in planned if look >= joints + max(least - count, 1) and look >= least + others + LEAST_BESIDE
    ]
    most = np.minimum(count - joints, -others - LEAST_BESIDE) + later
    possible = narrow(width, least, others, later) | narrow(width, most, others, later)
    return later[int(possible.argmax())] if possible.any() else planned[-1]
