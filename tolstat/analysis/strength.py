"""Which share of the parts fails? Damage by an S–N line with a knee, and a population of strengths.

S is a stress range, twice an amplitude. The line is N = N_D (S/S_D)^-k, with the slope k_2 below S_D (Haibach 1970:
k_2 = 2 k - 1). The strength of a part is S_D times a lognormal factor with median 1; its line is shifted with it, the
knee stays at N_D. A part fails when its damage sum (Palmgren 1924, Miner 1945) reaches the critical one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tolstat.analysis.binomial import clopper_pearson, mean_interval
from tolstat.analysis.estimates import Mask
from tolstat.common.late import special
from tolstat.common.loads import FloatArray

DECILES = 2.5631031310892007
"""Distance between the 10 % and the 90 % quantile of the standard normal distribution."""


class SNLine(NamedTuple):
    """S–N line of a load or a part, its scatter, and its dependence on the mean stress.

    Miner's rule in its elementary form has no knee: `k_2` is `k`.

    Attributes
    ----------
    k, k_2 : float
        Slope above and below the knee.
    N_D : float
        Cycles at the knee.
    S_D : float
        Range at the knee that half of the parts survive: of a load, N or N m; of a stress at the stress ratio `R`, Pa.
    T_S : float
        Scatter: strength that 90 % of the parts fall short of over that which 10 % fall short of, at least 1.
    D_c : float
        Critical damage sum.
    M : float
        Mean-stress sensitivity between the stress ratios -inf and 0.
    R : float
        Stress ratio of `S_D`.
    """

    k: float
    k_2: float
    N_D: float
    S_D: float
    T_S: float = 1.0
    D_c: float = 1.0
    M: float = 0.0
    R: float = -1.0


class Collective(NamedTuple):
    """Stress cycles of the service life of n joints at one point, sorted once for all damage sums; see `sort_out`.

    Attributes
    ----------
    knots : ndarray, shape (n, k)
        Strength factor at which a cycle has the range of the knee, descending; 0 marks an empty place.
    above, below : ndarray, shape (n, k + 1)
        Damage at the strength factor 1 of the first i cycles by the upper slope, of the others by the lower one.
    """

    knots: FloatArray
    above: FloatArray
    below: FloatArray


class Failures(NamedTuple):
    """Share of the parts that fail in the service life.

    Attributes
    ----------
    n, n_failed, n_unsettled : int
        Joints simulated, those of them whose solution failed, and those without a revolution that repeats.
    estimate : float
        Mean over the valid joints of the probability that the part is too weak; NaN when none is valid.
    lower, upper : float
        Interval for other joints that could have been drawn; NaN when the samples are not independent.
    outer_lower, outer_upper : float
        Ends with all joints without a valid load counted as surviving, and as failing.
    """

    n: int
    n_failed: int
    n_unsettled: int
    estimate: float
    lower: float
    upper: float
    outer_lower: float
    outer_upper: float


def at_ratio(ranges: ArrayLike, means: ArrayLike, M: float, R: float = -1.0) -> FloatArray:
    """Stress ranges at one stress ratio that do the damage of cycles with any mean stress.

    The sensitivity is `M` for stress ratios from -inf to 0, a third of it from 0 to 0.5, and 0 elsewhere (FKM guideline
    2020, four ranges of the Haigh diagram).

    Parameters
    ----------
    ranges, means : array_like
        Range and mean of the cycles, Pa.
    M : float
        Mean-stress sensitivity; 0 leaves the ranges as they are.
    R : float
        Stress ratio of the result, at least -1 and below 1.

    Returns
    -------
    ndarray
        Ranges, Pa.

    Examples
    --------
    >>> at_ratio([200.0, 200.0], [0.0, 100.0], M=0.3).round(1).tolist()  # R = -1 and R = 0
    [200.0, 260.0]
    """
    amplitude, mean = 0.5 * np.asarray(ranges, dtype=float), np.asarray(means, dtype=float)
    goal = _alternating(np.ones(1), np.full(1, (1.0 + R) / (1.0 - R)), M)[0]
    return np.asarray(2.0 * _alternating(amplitude, mean, M) / goal)


def _alternating(amplitude: FloatArray, mean: FloatArray, M: float) -> FloatArray:
    """Amplitude at the stress ratio -1 with the same damage; slopes change at R = -inf, 0 and 0.5."""
    third = M / 3.0
    tension = (1.0 + M) / (1.0 + third) * (amplitude + third * np.minimum(mean, 3.0 * amplitude))
    return np.where(mean > amplitude, tension, amplitude + M * np.maximum(mean, -amplitude))


def sort_out(ranges: FloatArray, numbers: FloatArray, line: SNLine) -> Collective:
    """Sort the cycles of joints for `damage_at` and `critical_factor`.

    Parameters
    ----------
    ranges : ndarray, shape (n, k)
        Stress ranges at the stress ratio of the line, Pa; 0 marks an empty place, NaN a joint without results.
    numbers : ndarray, shape (n, k)
        Cycles of each range in the service life.
    line : SNLine
        S–N line.
    """
    order = np.argsort(-ranges, axis=1)
    knots = np.take_along_axis(ranges, order, axis=1) / line.S_D
    numbers = np.take_along_axis(numbers, order, axis=1) / line.N_D
    none = np.zeros((len(ranges), 1))
    steep = np.cumsum(numbers * knots**line.k, axis=1)
    flat = np.cumsum((numbers * knots**line.k_2)[:, ::-1], axis=1)[:, ::-1]
    return Collective(knots, np.hstack([none, steep]), np.hstack([flat, none]))


def damage_at(collective: Collective, line: SNLine, factor: float = 1.0) -> FloatArray:
    """Damage sum of each joint in a part whose strength is `factor` times the median, (n,); NaN without results."""
    i = (collective.knots >= factor).sum(axis=1)[:, None]
    above, below = (np.take_along_axis(sums, i, axis=1)[:, 0] for sums in (collective.above, collective.below))
    return np.asarray(above * factor**-line.k + below * factor**-line.k_2)


def critical_factor(collective: Collective, line: SNLine, lives: float = 1.0) -> FloatArray:
    """Strength, over the median, of the part that fails at the end of `lives` service lives.

    Parameters
    ----------
    collective : Collective
        Cycles of n joints.
    line : SNLine
        S–N line.
    lives : float
        Number of service lives, positive.

    Returns
    -------
    ndarray, shape (n,)
        Weaker parts fail; 0 for a joint without cycles, NaN for one without results.
    """
    goal = line.D_c / lives
    knots = np.where(collective.knots > 0, collective.knots, np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        sums = collective.above[:, 1:] * knots**-line.k + collective.below[:, 1:] * knots**-line.k_2
        i = (sums <= goal).sum(axis=1)[:, None]  # damage grows as the factor falls from knot to knot
        a, b = (np.take_along_axis(part, i, axis=1)[:, 0] / goal for part in (collective.above, collective.below))
        # a f^-k + b f^-k_2 = 1: convex in the logarithms, so that Newton's steps from the left do not overshoot
        u = np.maximum(np.log(a) / line.k, np.log(b) / line.k_2)
        for _ in range(10):
            first, second = a * np.exp(-line.k * u), b * np.exp(-line.k_2 * u)
            total = first + second
            u = np.where(np.isfinite(u), u + np.log(total) * total / (line.k * first + line.k_2 * second), u)
    return np.exp(u)


def weakest(places: Sequence[Collective], line: SNLine) -> Collective:
    """Cycles of each joint at the place of a part at which it fails first, in the service life.

    Parameters
    ----------
    places : sequence of Collective
        Cycles of the same n joints at each place; the strength of a part is one at all of them.
    line : SNLine
        S–N line.
    """
    worst = np.argmax(np.nan_to_num([critical_factor(place, line) for place in places]), axis=0)
    return Collective(*(np.stack(field)[worst, np.arange(len(worst))] for field in zip(*places, strict=True)))


def probability(factor: FloatArray, T_S: float) -> FloatArray:
    """Share of the parts whose strength is below `factor` times the median; see `SNLine.T_S`."""
    if T_S <= 1.0:
        return np.where(np.isnan(factor), np.nan, (factor >= 1.0).astype(float))
    with np.errstate(divide="ignore"):
        return np.asarray(special.ndtr(np.log10(factor) * DECILES / math.log10(T_S)))


def failures(
    chances: FloatArray, n_failed: int, n_unsettled: int, confidence: float = 0.95, iid: bool = True
) -> Failures:
    """Share of the parts that fail.

    Parameters
    ----------
    chances : ndarray, shape (n,)
        Probability of failure of the part in each joint, in the order in which the joints were drawn; NaN for joints
        without a valid load.
    n_failed, n_unsettled : int
        Numbers of these.
    confidence : float
        Confidence level of the intervals: Clopper and Pearson (1934) where no strength scatters, so that the
        probabilities are 0 or 1, else `binomial.mean_interval`.
    iid : bool
        Whether the joints are independent samples.

    Returns
    -------
    Failures
    """
    without = np.isnan(chances)
    valid = chances[~without]
    estimate = float(valid.mean()) if valid.size else math.nan
    if not iid:
        return Failures(chances.size, n_failed, n_unsettled, estimate, *[math.nan] * 4)
    lower, upper = outer_lower, outer_upper = _ends(valid, confidence)
    if without.any():
        outer_lower = _ends(np.where(without, 0.0, chances), confidence)[0]
        outer_upper = _ends(np.where(without, 1.0, chances), confidence)[1]
    return Failures(chances.size, n_failed, n_unsettled, estimate, lower, upper, outer_lower, outer_upper)


def _ends(chances: FloatArray, confidence: float) -> tuple[float, float]:
    counts: Mask = (chances == 0.0) | (chances == 1.0)
    if counts.all():
        lower, upper = clopper_pearson(chances.sum(), chances.size, confidence)
        return float(lower), float(upper)
    return mean_interval(chances, confidence)
