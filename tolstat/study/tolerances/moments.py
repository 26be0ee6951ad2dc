"""Standard deviation of a distribution and its share outside a band, from the inverse of its distribution function."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from tolstat.study.tolerances.distributions import Array, Distribution, Measured, score

NODES = np.linspace(-8.5, 8.5, 6801)
"""Standard normal scores of the trapezoidal rule, which converges faster than any power of the step here."""
NEGLIGIBLE = 1e-12
"""Shares below this are rounding errors of `distributions.score` at the ends of a bounded distribution."""


def standard_deviation(found: Distribution) -> float:
    """Return the standard deviation of a distribution, SI."""
    return math.sqrt(mean_square(found) - mean(found) ** 2)


def mean(found: Distribution) -> float:
    """Return the mean of a distribution, SI."""
    return average(found, lambda values: values)


def mean_square(found: Distribution) -> float:
    """Return the mean of the square of a distributed quantity, SI."""
    return average(found, np.square)


def outside(found: Distribution, lower: float, upper: float) -> float:
    """Return the share of a distribution outside the band from `lower` to `upper`, both SI."""
    from scipy.special import ndtr

    below, above = score(found, np.array([lower, upper]))
    share = float(ndtr(below) + ndtr(-above))
    return share if share > NEGLIGIBLE else 0.0


def average(found: Distribution, function: Callable[[Array], Array]) -> float:
    """Return the mean of a function of a distributed quantity."""
    if isinstance(found, Measured):
        return float(np.mean(function(found.values)))
    from scipy.special import ndtr

    weights: Array = np.exp(-0.5 * NODES**2)
    # the upper half from its own tail would need a survival function: beyond a score of 8 ndtr rounds to 1
    values = found.ppf(np.minimum(ndtr(NODES), 1.0 - 2.0**-53))
    return float((function(values) * weights).sum() / weights.sum())
