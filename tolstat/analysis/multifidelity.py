"""Two-fidelity estimation: statistics of the high fidelity from few joints at high and many at low fidelity.

The high-fidelity estimate from m joints is corrected by the difference of the low-fidelity estimates from all n >= m
joints and from the same m (control variate, common random numbers). It estimates the high fidelity whatever the low one
is: a poor low fidelity only gains nothing. The optimal numbers of joints follow from costs and correlation (Ng and
Willcox 2014; Peherstorfer, Willcox and Gunzburger 2016, two models).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.analysis.exceedance import FloatArray, clopper_pearson
from tolstat.common.shown import shown

GRID, NEAR = 400, 0.1
"""Low-fidelity loads among which a quantile is searched, and half width of the shares that they span."""


LEAST_LEFT = 1e-3
"""Lower bound of 1 - rho^2 in `allocate`: a pilot does not estimate smaller values, and shares and quantiles need more
pairs than means."""


@shown
class Allocation(NamedTuple):
    """Gain of two fidelities, and optimal split of the work between them.

    Attributes
    ----------
    rho : float
        Correlation of the two.
    ratio : float
        Optimal number of low-fidelity joints per high-fidelity joint; 1 where there is no gain.
    gain : float
        Variance of the high fidelity alone over that of both together, at the same cost; 1 or less: no gain.
    """

    rho: float
    ratio: float
    gain: float

    def joints(self, budget: float, cost_high: float, cost_low: float, least: int = 1) -> tuple[int, int]:
        """Numbers of high- and low-fidelity joints, at least `least` each, for a budget in the unit of the costs."""
        high = max(least, int(budget / (cost_high + self.ratio * cost_low)))
        return high, max(high, int((budget - high * cost_high) / cost_low))


@shown
class Estimate(NamedTuple):
    """A statistic of the high fidelity.

    Attributes
    ----------
    estimate, lower, upper : float
        Two-fidelity estimate and its interval.
    alone, alone_lower, alone_upper : float
        Estimate and interval from the high-fidelity joints alone.
    rho : float
        Correlation of the averaged quantity at both fidelities; NaN where one of the two does not scatter.
    gain : float
        Variance of the high fidelity alone, at the same total cost, over that of the estimate.
    """

    estimate: float
    lower: float
    upper: float
    alone: float
    alone_lower: float
    alone_upper: float
    rho: float
    gain: float


class Pairs(NamedTuple):
    """Loads of joints at both fidelities.

    Attributes
    ----------
    high : ndarray, shape (m,)
        High-fidelity loads of the first m joints; NaN without a valid load.
    low : ndarray, shape (n,)
        Low-fidelity loads of all joints, the same m first; NaN without a valid load.
    cost_high, cost_low : float
        Cost of a joint at each fidelity, in one unit.
    """

    high: FloatArray
    low: FloatArray
    cost_high: float
    cost_low: float

    @property
    def relative_cost(self) -> float:
        """Total cost, as a number of high-fidelity joints."""
        return self.high.size + self.low.size * self.cost_low / self.cost_high

    def control(self) -> FloatArray:
        """Low-fidelity loads mapped to high-fidelity ones by equal ranks among the m joints, (n,); invalid: -inf."""
        low = self.low[: self.high.size]
        both = np.isfinite(self.high) & np.isfinite(low)
        known = np.isfinite(self.low)
        found = np.full(self.low.size, -np.inf)
        x, y = np.sort(low[both]), np.sort(self.high[both])
        if not x.size or x[0] == x[-1]:
            found[known] = self.low[known]
            return found
        slope = (y[-1] - y[0]) / (x[-1] - x[0])
        beyond = np.minimum(self.low - x[0], 0.0) + np.maximum(self.low - x[-1], 0.0)
        found[known] = (np.interp(self.low, x, y) + slope * beyond)[known]
        return found


def allocate(high: ArrayLike, low: ArrayLike, cost_high: float, cost_low: float) -> Allocation:
    """Split the work optimally between two fidelities.

    Parameters
    ----------
    high, low : array_like, shape (m,)
        Quantity to be averaged, of the same joints: loads, or whether they are above a level.
    cost_high, cost_low : float
        Cost of a joint at each fidelity, in one unit.

    Returns
    -------
    Allocation
        n / m = sqrt(c_h rho^2 / (c_l (1 - rho^2))), gain (sqrt(1 - rho^2) + sqrt(rho^2 c_l / c_h))^-2.
    """
    rho = _correlation(np.asarray(high, dtype=float), np.asarray(low, dtype=float))
    if math.isnan(rho):
        return Allocation(rho, 1.0, 1.0)
    left, cheap = max(1.0 - rho**2, LEAST_LEFT), cost_low / cost_high
    ratio = math.sqrt(rho**2 / (left * cheap))
    gain = (math.sqrt(left) + math.sqrt(rho**2 * cheap)) ** -2
    return Allocation(rho, ratio, gain) if ratio > 1.0 and gain > 1.0 else Allocation(rho, 1.0, min(gain, 1.0))


def mean(pairs: Pairs, confidence: float = 0.95) -> Estimate:
    """Mean load of the high fidelity, over joints with a valid load.

    Parameters
    ----------
    pairs : Pairs
        The loads; a joint without a valid load at one fidelity is left out.
    confidence : float
        Confidence level of the intervals, Student's (regression in double sampling: Cochran 1977, 12.6).

    Returns
    -------
    Estimate

    Raises
    ------
    ValueError
        When fewer than four joints have both loads.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> low = rng.normal(10.0, 2.0, 4000)
    >>> high = 1.1 * low[:100] + rng.normal(0.0, 0.2, 100)
    >>> found = mean(Pairs(high, low, cost_high=1.0, cost_low=0.02))
    >>> found.lower < 11.0 < found.upper, found.upper - found.lower < 0.3 * (found.alone_upper - found.alone_lower)
    (True, True)
    """
    from scipy.special import stdtrit

    m = pairs.high.size
    both = np.isfinite(pairs.high) & np.isfinite(pairs.low[:m])
    h, low = pairs.high[both], pairs.low[:m][both]
    every = pairs.low[np.isfinite(pairs.low)]
    if h.size < 4:
        raise ValueError(f"{h.size} joints with both loads: give four or more")
    rho = _correlation(h, low)
    explained = 0.0 if math.isnan(rho) else rho**2
    slope = 0.0 if math.isnan(rho) else rho * h.std() / low.std()
    variance = h.var(ddof=1)
    alone, estimate = float(h.mean()), float(h.mean() + slope * (every.mean() - low.mean()))
    own = variance * ((1.0 - explained) * (h.size - 1) / (h.size - 2) / h.size + explained / every.size)
    half = float(stdtrit(h.size - 2, 0.5 * (1.0 + confidence))) * math.sqrt(own)
    half_alone = float(stdtrit(h.size - 1, 0.5 * (1.0 + confidence))) * math.sqrt(variance / h.size)
    gain = variance / pairs.relative_cost / own if own > 0 else math.nan
    ends = (estimate - half, estimate + half)
    return Estimate(estimate, *ends, alone, alone - half_alone, alone + half_alone, rho, float(gain))


def share_above(pairs: Pairs, level: float, confidence: float = 0.95) -> Estimate:
    """Share of the joints whose load of the high fidelity is above a level.

    Parameters
    ----------
    pairs : Pairs
        The loads. Joints without a valid high-fidelity load count as below the level at the lower end and as above it
        at the upper end. Joints without a valid low-fidelity load count as below, which a control variate allows.
    level : float
        Level, in the unit of the loads; the low fidelity is evaluated at the level of equal rank, `Pairs.control`.
    confidence : float
        Confidence level. The Clopper–Pearson intervals of the three shares in the estimate are combined by MOVER (Zou
        and Donner 2008); the high fidelity alone has a Clopper–Pearson interval.

    Returns
    -------
    Estimate
        The estimate is NaN where no pair is above the level at the low fidelity: P(high | low) is unknown then.
    """
    table = _shares(pairs, np.array([level]), confidence)
    return Estimate(*(float(column[0]) for column in table))


def quantile(pairs: Pairs, share: float, confidence: float = 0.95) -> Estimate:
    """Load of the high fidelity that a share of the joints stays at or below.

    Parameters
    ----------
    pairs, confidence
        As in `share_above`, whose intervals are inverted (Woodruff 1952).
    share : float
        Between 0 and 1.

    Returns
    -------
    Estimate
        An end that the joints cannot support is infinite; `rho` and `gain` are those of the share above the estimate.
    """
    x = _grid(pairs, share)
    table = _shares(pairs, x, confidence)
    left = (1.0 - share) * (1.0 + 1e-12)
    ends = [_where(x, estimate, lower, upper, left) for estimate, lower, upper in (table[:3], table[3:6])]
    own, alone = ends
    at = int(np.searchsorted(x, own[0])) if math.isfinite(own[0]) else x.size - 1
    return Estimate(*own, *alone, float(table[6][at]), float(table[7][at]))


def _where(
    x: FloatArray, estimate: FloatArray, lower: FloatArray, upper: FloatArray, left: float
) -> tuple[float, float, float]:
    """Smallest load with a share above of at most `left`, and the loads between which its interval contains `left`."""
    reached, least, most = (np.flatnonzero(found) for found in (estimate <= left, lower <= left, upper >= left))
    low = float(x[least[0]]) if least.size and least[0] > 0 else -math.inf
    high = float(x[most[-1] + 1]) if most.size and most[-1] + 1 < x.size else math.inf
    return float(x[reached[0]]) if reached.size else math.inf, low, high


def _grid(pairs: Pairs, share: float) -> FloatArray:
    """Loads among which a quantile is searched: all of the high fidelity, and mapped low-fidelity ones near it."""
    control = np.sort(pairs.control())
    near = np.linspace(max(0.0, share - NEAR), min(1.0, share + NEAR), GRID) * (control.size - 1)
    loads = np.concatenate([pairs.high, control[near.astype(np.intp)]])
    return np.unique(loads[np.isfinite(loads)])


def _shares(pairs: Pairs, x: FloatArray, confidence: float) -> tuple[FloatArray, ...]:
    """Columns of `Estimate` for many levels, (k,) each."""
    m, n = pairs.high.size, pairs.low.size
    low, lost = pairs.control(), ~np.isfinite(pairs.high)

    def above(loads: FloatArray) -> NDArray[np.intp]:
        return loads.size - np.searchsorted(np.sort(loads), x, side="right")

    low_all, low_pairs = above(low), above(low[:m])
    ends = []
    for instead in (-np.inf, np.inf):
        high = np.where(lost, instead, pairs.high)
        both = above(np.minimum(high, low[:m]))
        ends.append((above(high), *_mover(low_all, n, both, low_pairs, above(high) - both, m, confidence)))
    (counted, _, lower, _), (most, _, _, upper) = ends
    valid = m - int(lost.sum())
    high = pairs.high[~lost]
    both = above(np.minimum(high, low[:m][~lost]))
    share_low = above(low[:m][~lost])
    estimate = _mover(low_all, n, both, share_low, above(high) - both, valid, confidence)[0]
    alone = counted / valid if valid else np.full(x.shape, np.nan)
    lower_alone, upper_alone = clopper_pearson(counted, m, confidence)[0], clopper_pearson(most, m, confidence)[1]
    with np.errstate(invalid="ignore", divide="ignore"):
        p, q = counted / m, low_pairs / m
        rho = (above(np.minimum(np.where(lost, -np.inf, pairs.high), low[:m])) / m - p * q) / np.sqrt(
            p * (1 - p) * q * (1 - q)
        )
        gain = m / pairs.relative_cost / (1.0 - (1.0 - m / n) * rho**2)
    return estimate, lower, upper, alone, lower_alone, upper_alone, rho, gain


def _mover(
    low_all: NDArray[np.intp],
    n: int,
    both: NDArray[np.intp],
    low_pairs: NDArray[np.intp],
    only_high: NDArray[np.intp],
    m: int,
    confidence: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """P(low) P(high | low) + P(not low) P(high | not low), and its interval."""
    with np.errstate(invalid="ignore", divide="ignore"):
        p, a, b = low_all / n, both / low_pairs, only_high / (m - low_pairs)
    b = np.where(low_pairs == m, 0.0, b)
    known = low_pairs > 0
    a = np.where(known, a, 0.5)
    (p_low, p_high), (a_low, a_high), (b_low, b_high) = (
        clopper_pearson(count, of, confidence)
        for count, of in ((low_all, n), (both, low_pairs), (only_high, m - low_pairs))
    )
    estimate = p * a + (1.0 - p) * b
    down, up = np.where(a >= b, p - p_low, p_high - p), np.where(a >= b, p_high - p, p - p_low)
    lower = estimate - np.sqrt(((a - b) * down) ** 2 + (p * (a - a_low)) ** 2 + ((1 - p) * (b - b_low)) ** 2)
    upper = estimate + np.sqrt(((a - b) * up) ** 2 + (p * (a_high - a)) ** 2 + ((1 - p) * (b_high - b)) ** 2)
    return np.where(known, estimate, np.nan), np.maximum(lower, 0.0), np.minimum(upper, 1.0)


def _correlation(high: FloatArray, low: FloatArray) -> float:
    """Pearson's correlation; NaN where one of the two does not scatter."""
    if high.size < 2 or np.ptp(high) == 0 or np.ptp(low) == 0:
        return math.nan
    return float(np.clip(np.corrcoef(high, low)[0, 1], -1.0, 1.0))
