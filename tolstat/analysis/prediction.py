"""How many joints of the next delivery are above a limit? Prediction intervals for a number of further joints.

Both the share and the joints of the delivery are uncertain. From counts the interval is that of Thatcher (1964): exact,
the probability of a number outside it is at most 1 - confidence for every share. Else the share has an interval of half
the allowed error, and the number for each end of it too.
"""

from __future__ import annotations

import math

import numpy as np

from tolstat.analysis.binomial import log_beta_binomial
from tolstat.common.late import stats

DELIVERY = 1000
"""Joints of the next delivery, unless another number is given."""


def of_counts(least: int, most: int, n: int, number: int, confidence: float = 0.95) -> tuple[float, float]:
    """Prediction interval from counts.

    Parameters
    ----------
    least, most : int
        Joints above the limit among those observed; the same unless some are undecided.
    n : int
        Independent joints observed.
    number : int
        Further joints, drawn as those observed.
    confidence : float
        Confidence level.

    Returns
    -------
    lower, upper : float
        Whole numbers, ends included.

    Examples
    --------
    5 of 100 joints were above; how many of the next 200?

    >>> of_counts(5, 5, 100, 200)
    (2.0, 25.0)
    """
    tail = 0.5 * (1.0 - confidence)
    # beta-binomial distributions whose tails are those of the hypergeometric test
    lower = _quantile(tail, number, least, n - least + 1) if least else 0.0
    upper = _quantile(1.0 - tail, number, most + 1, n - most) if most < n else float(number)
    return lower, upper


def _quantile(share: float, number: int, a: int, b: int) -> float:
    """Quantile of the beta-binomial distribution: least count whose distribution function reaches `share`."""
    reached = np.cumsum(np.exp(log_beta_binomial(np.arange(number + 1), number, a, b)))
    return float(min(int(np.searchsorted(reached, share)), number))


def half(confidence: float) -> float:
    """Confidence of the interval of a share with which `of_share` has the confidence given."""
    return 0.5 * (1.0 + confidence)


def of_share(lower: float, upper: float, number: int, confidence: float = 0.95) -> tuple[float, float]:
    """Prediction interval from an interval of the share, whose confidence is `half` that of the prediction.

    Returns
    -------
    lower, upper : float
        Whole numbers, ends included; NaN if an end of the share is.
    """
    if math.isnan(lower) or math.isnan(upper):
        return math.nan, math.nan
    tail = 0.5 * (1.0 - half(confidence))
    return float(stats.binom.ppf(tail, number, lower)), float(stats.binom.ppf(1.0 - tail, number, upper))


def columns(ends: tuple[float, float], number: int) -> dict[str, float]:
    """Columns of a table: a prediction interval, and the number of joints that it is of."""
    return {"next_lower": ends[0], "next_upper": ends[1], "delivery": number}
