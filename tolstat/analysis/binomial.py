"""Independent joints, counted or with a value between 0 and 1: exact intervals, numbers of joints needed, and stops.

An interval that is inspected repeatedly covers less than its confidence. Looks at a share are at numbers of joints
fixed beforehand, `GROWTH` apart, and the interval of each has the confidence `LOOK_CONFIDENCE`; the one at the stop
then covers in 95 % of campaigns at least. That is computed, not assumed: `tests/support/stops.py` has the exact
distribution over the pairs (look, count above) at which campaigns stop (Chen and Chen 2013).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.common.bisection import first
from tolstat.common.counts import POWER
from tolstat.common.late import special
from tolstat.common.loads import FloatArray

STAKE = 0.75
"""Maximum share of the capital that a value costs in `mean_interval`: with 1, one value of 0 would ruin the gambler."""
GROWTH = 1.05
"""Ratio of the numbers of joints of two looks."""
LOOK_CONFIDENCE = 0.975
"""Confidence level of the interval of one look, for 95 % at the stop."""
LEAST_BESIDE = 10
"""Minimum number of joints on each side of the level at a stop."""
BIAS = 0.11
"""Largest relative bias of count over joints at a stop: that of a share for which `LEAST_BESIDE` are above."""


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
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"confidence {confidence} must lie between 0 and 1")
    k, m = np.broadcast_arrays(np.asarray(count, dtype=float), np.asarray(n, dtype=float))
    if np.any(k < 0) or np.any(k > m):
        raise ValueError("count must lie between 0 and n")
    tail = 0.5 * (1.0 - confidence)
    # The beta function of order 0 does not exist; those ends are 0 and 1 by definition.
    some, others = np.where(k > 0, k, 1.0), np.where(k < m, m - k, 1.0)
    lower = np.where(k > 0, special.betaincinv(some, m - some + 1.0, tail), 0.0)
    upper = np.where(k < m, special.betaincinv(k + 1.0, others, 1.0 - tail), 1.0)
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

    Examples
    --------
    >>> round(simultaneous(1024), 4)
    0.0424
    """
    return min(1.0, float(np.sqrt(0.5 * np.log(2.0 / (1.0 - confidence)) / max(n, 1))))


def needed(share: float, accepted: float, confidence: float = 0.95, power: float = POWER) -> float:
    """Minimum number of joints whose Clopper–Pearson interval excludes an accepted share in most campaigns.

    Parameters
    ----------
    share : float
        True share of the joints above the level.
    accepted : float
        Accepted share, between 0 and 1.
    confidence : float
        Confidence level of the interval.
    power : float
        Share of the campaigns with that many independent joints whose interval excludes `accepted`.

    Returns
    -------
    float
        Infinite if both shares are equal.

    Examples
    --------
    >>> needed(0.0, 0.01)  # none of 368 joints
    368.0
    >>> needed(0.05, 0.1)  # 142 joints with 5 % of them above would do, but half of the campaigns have more above
    292.0
    """
    if share == accepted:
        return np.inf
    p, limit = (share, accepted) if share < accepted else (1.0 - share, 1.0 - accepted)  # of joints above, or below
    tail = 0.5 * (1.0 - confidence)

    def at_most(k: NDArray[np.intp], n: NDArray[np.intp], p: float) -> FloatArray:
        """Probability of at most k of n joints."""
        return np.asarray(special.betaincc(k + 1.0, n - k, p))

    def joints(k: NDArray[np.intp]) -> NDArray[np.intp]:
        """Least number of joints of which k may be there for an interval below the limit."""
        return first(lambda n: at_most(k, n, limit) <= tail, k + 1, 10**12)

    return float(joints(first(lambda k: at_most(k, joints(k), p) >= power, 0, 10**9)))


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


def half_width(confidence: float, freedom: float | FloatArray = np.inf) -> FloatArray:
    """Half the width of Student's interval, in standard errors; of the normal one without degrees of freedom."""
    return np.asarray(special.stdtrit(freedom, 0.5 * (1.0 + confidence)), dtype=float)


def log_beta_binomial(k: ArrayLike, n: ArrayLike, a: ArrayLike, b: ArrayLike) -> FloatArray:
    """Logarithm of the probability of k of n joints whose share is a beta variate with the parameters a and b."""
    k, n, a, b = (np.asarray(x, dtype=float) for x in (k, n, a, b))
    choose = -np.log(n + 1.0) - special.betaln(k + 1.0, n - k + 1.0)
    return np.asarray(choose + special.betaln(k + a, n - k + b) - special.betaln(a, b))


def wilks(share: float, confidence: float = 0.95) -> int:
    """Return the least number of joints whose largest load bounds the quantile from above (Wilks 1941, first order).

    With that many independent joints the largest of them exceeds the quantile with probability
    1 - share^n >= confidence.

    Parameters
    ----------
    share : float
        Share of the joints that stay at or below the quantile, 0 < share < 1.
    confidence : float
        Confidence level of the bound.

    Examples
    --------
    >>> wilks(0.95), wilks(0.99)
    (59, 299)
    """
    return max(1, int(np.ceil(np.log1p(-confidence) / np.log(share))))


def mean_interval(values: ArrayLike, confidence: float = 0.95) -> tuple[float, float]:
    """Interval of the mean of independent values between 0 and 1 (Waudby-Smith and Ramdas 2024, hedged capital).

    A mean m is rejected if a gambler who bets on each value against m, knowing the values before it only, would have
    multiplied the capital by 2 / (1 - confidence). By Markov's inequality the true mean is rejected with at most the
    probability 1 - confidence, whatever the distribution. The ends depend slightly on the order of the values.

    Parameters
    ----------
    values : array_like, shape (n,)
        Values from 0 to 1, in an order that does not depend on them.
    confidence : float
        Coverage guaranteed.

    Returns
    -------
    lower, upper : float
        Ends of the interval; 0 and 1 without values.

    Examples
    --------
    >>> lower, upper = mean_interval([0.001] * 1000)
    >>> round(lower, 4), round(upper, 4)
    (0.0, 0.0059)
    """
    x = np.asarray(values, dtype=float)
    if not x.size:
        return 0.0, 1.0
    return _lower_mean(x, confidence), 1.0 - _lower_mean(1.0 - x, confidence)


def _lower_mean(x: FloatArray, confidence: float) -> float:
    gain = np.log(2.0 / (1.0 - confidence))
    mean, n = float(x.mean()), np.arange(1, x.size + 1)
    # each bet by mean and variance of the values before it (predictable plug-in of the source)
    deviations = np.cumsum((x - (0.5 + np.cumsum(x)) / (n + 1)) ** 2)
    before = np.append(0.25, (0.25 + deviations[:-1]) / n[1:])
    bets = np.sqrt(2.0 * gain / (x.size * before))

    def rejected(less: FloatArray) -> bool:
        m = mean - float(less)
        return bool(np.log1p(np.minimum(bets, STAKE / m) * (x - m)).sum() >= gain)

    return mean - float(first(rejected, 0.0, mean, halvings=40))


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


def stop_interval(count: ArrayLike, others: ArrayLike, joints: ArrayLike) -> tuple[FloatArray, FloatArray]:
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
    lower, _ = clopper_pearson(count, joints, LOOK_CONFIDENCE)
    _, upper = clopper_pearson(np.add(count, others), joints, LOOK_CONFIDENCE)
    return lower, upper


def narrow(width: float, count: ArrayLike, others: ArrayLike, joints: ArrayLike) -> NDArray[np.bool_]:
    """Whether to stop at a look: its interval is narrower than `width`, with joints on both sides of the level."""
    lower, upper = stop_interval(count, others, joints)
    below = np.subtract(joints, np.add(count, others))
    return np.asarray((upper - lower < width) & (np.minimum(count, below) >= LEAST_BESIDE))


def next_look(width: float, planned: Sequence[int], count: int = 0, others: int = 0, joints: int = 0) -> int:
    """Return the first look after `joints` at which a stop is possible, else the last one.

    The looks before it need not be evaluated: whatever the loads of the joints between, the interval is too wide there.
    It is narrowest with the least or the largest count that a stop can have.
    """
    least = max(count, LEAST_BESIDE)
    soonest = max(joints + max(least - count, 1), least + others + LEAST_BESIDE)
    later = [look for look in planned if look >= soonest]
    most = np.minimum(count - joints, -others - LEAST_BESIDE) + later
    possible = narrow(width, least, others, later) | narrow(width, most, others, later)
    return later[int(possible.argmax())] if possible.any() else planned[-1]
