"""Interval of a mean of values between 0 and 1, for every distribution and every number of values."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from tolstat.common.bisection import first
from tolstat.common.loads import FloatArray

STAKE = 0.75
"""Maximum share of the capital that one value can cost: with 1, one value of 0 would ruin the gambler."""


def interval(values: ArrayLike, confidence: float = 0.95) -> tuple[float, float]:
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
    >>> lower, upper = interval([0.001] * 1000)
    >>> round(lower, 4), round(upper, 4)
    (0.0, 0.0059)
    """
    x = np.asarray(values, dtype=float)
    if not x.size:
        return 0.0, 1.0
    return _lower(x, confidence), 1.0 - _lower(1.0 - x, confidence)


def _lower(x: FloatArray, confidence: float) -> float:
    gain = math.log(2.0 / (1.0 - confidence))
    mean, n = float(x.mean()), np.arange(1, x.size + 1)
    # each bet by mean and variance of the values before it (predictable plug-in of the source)
    deviations = np.cumsum((x - (0.5 + np.cumsum(x)) / (n + 1)) ** 2)
    before = np.append(0.25, (0.25 + deviations[:-1]) / n[1:])
    bets = np.sqrt(2.0 * gain / (x.size * before))

    def rejected(m: float) -> bool:
        return bool(np.log1p(np.minimum(bets, STAKE / m) * (x - m)).sum() >= gain)

    return mean - float(first(lambda less: rejected(mean - float(less)), 0.0, mean, halvings=40))
