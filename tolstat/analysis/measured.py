"""What measured parts tell of a process: intervals of its standard deviation and of its mean, for a normal law."""

from __future__ import annotations

import math

from tolstat.analysis.binomial import half_width
from tolstat.common.late import special

LEAST_PARTS, MOST_PARTS = 5, 100_000
"""Fewest and most parts that a process may be known from."""
CONFIDENCE = 0.9
"""Confidence level of the intervals."""


def spreads(parts: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Ends of the interval of the deviation sigma of a process over that of its parts, s.

    (n - 1) s^2 / sigma^2 is chi-squared with n - 1 degrees of freedom.

    Examples
    --------
    >>> [round(end, 2) for end in spreads(10)]
    [0.73, 1.65]
    """
    tail, freedom = 0.5 * (1.0 - confidence), parts - 1
    low, high = (math.sqrt(freedom / float(special.chdtri(freedom, beyond))) for beyond in (tail, 1.0 - tail))
    return low, high


def means(parts: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Ends of the interval of the mean of a process less that of its parts, in deviations of the parts.

    By Student's t with n - 1 degrees of freedom.

    Examples
    --------
    >>> [round(end, 2) for end in means(10)]
    [-0.58, 0.58]
    """
    half = float(half_width(confidence, parts - 1)) / math.sqrt(parts)
    return -half, half
