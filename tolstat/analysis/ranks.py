"""Errors that are over-represented above a limit: what their ranks tell.

Variance describes all joints; the few above a limit may have other causes. For each error, a random joint above the
limit is compared with one not above it: which has the larger error (*direction*), and which has the error farther from
the middle of its distribution (*size*)? The answer is a probability: 1/2 if the error does not affect the tail.

Ranks of a table's columns, and of parts of its rows, are from one sort; ties share their mean rank.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.analysis.binomial import half_width
from tolstat.common.late import special, stats
from tolstat.common.loads import FloatArray

FEWEST = 10
"""Joints needed on either side of the limit."""
WIDER = 4.0
"""Standard errors are taken 1 + 4/m times as large, m joints on the side with fewer: probabilities near 1 are means of
skew values, whose scatter few joints show too small (measured)."""


class Part(NamedTuple):
    """Over-representation of each error in the tail; each array has the shape (d,).

    Attributes
    ----------
    estimate, lower, upper : ndarray
        Probability that a joint above the limit has the larger value, and its interval, valid for each error by itself
        (NaN for dependent samples).
    p : ndarray
        p-value of the Wilcoxon–Mann–Whitney test (normal, corrected for ties and continuity), adjusted by Holm's method
        (1979) for both questions and all errors: when none plays a part, the probability that any is below 0.05 is at
        most 0.05.
    """

    estimate: FloatArray
    lower: FloatArray
    upper: FloatArray
    p: FloatArray


class Overrepresentation(NamedTuple):
    """Answers of `tail`: the errors' direction, and their size."""

    direction: Part
    size: Part


def places(values: ArrayLike) -> NDArray[np.intp]:
    """Place of each value among the distinct values of its column, ascending from 0.

    Parameters
    ----------
    values : array_like, shape (n, d)
        Table of finite values.

    Returns
    -------
    ndarray, shape (d, n)
        Row j has the places of column j.
    """
    columns = np.ascontiguousarray(np.asarray(values, dtype=float).T)
    return np.array([np.unique(column, return_inverse=True)[1] for column in columns]).reshape(columns.shape)


def from_places(numbers: NDArray[np.intp]) -> FloatArray:
    """Ranks, from 1, of columns whose `places` are given, or of some of their rows.

    Parameters
    ----------
    numbers : ndarray, shape (d, m)
        Places of m rows among all.

    Returns
    -------
    ndarray, shape (d, m)
        Ranks among these m rows, the same as those of `scipy.stats.rankdata` for each column.
    """
    ranks = np.empty(numbers.shape)
    for column, out in zip(numbers, ranks, strict=True):
        alike = np.bincount(column)
        out[:] = (np.cumsum(alike) - 0.5 * (alike - 1))[column]
    return ranks


def ranks(values: ArrayLike) -> FloatArray:
    """Ranks of each column of a table (n, d), as its columns: (n, d)."""
    return from_places(places(values)).T


def tail(scores: ArrayLike, above: ArrayLike, confidence: float = 0.95, iid: bool = True) -> Overrepresentation:
    """Compare the errors of the joints above a limit with those of the others.

    Parameters
    ----------
    scores : array_like, shape (n, d)
        Errors of the valid joints, in standard scores: 0 is the middle of each distribution.
    above : array_like of bool, shape (n,)
        Which joints are above the limit.
    confidence : float
        Confidence level of the intervals.
    iid : bool
        Whether the joints are independent samples.

    Returns
    -------
    Overrepresentation
        Probabilities, intervals and p-values.

    Raises
    ------
    ValueError
        When fewer than `FEWEST` joints are on one side of the limit, or an error does not scatter.
    """
    z, over = np.asarray(scores, dtype=float), np.asarray(above, dtype=bool)
    n = int(over.sum())
    if min(n, over.size - n) < FEWEST:
        raise ValueError(f"{n} of {over.size} joints are above the limit: {FEWEST} are needed on either side")
    if (np.ptp(z, axis=0) == 0).any():
        raise ValueError("give errors that scatter")
    both = places(np.concatenate([z, np.abs(z)], axis=1))
    p = np.asarray(stats.mannwhitneyu(both[:, over], both[:, ~over], axis=1, method="asymptotic").pvalue)
    order = np.argsort(p)
    adjusted = np.empty_like(p)
    adjusted[order] = np.minimum(np.maximum.accumulate(p[order] * np.arange(p.size, 0, -1)), 1.0)  # Holm
    compared = Part(*_larger(both, over, confidence), adjusted)
    if not iid:
        compared = compared._replace(lower=np.full(len(both), np.nan), upper=np.full(len(both), np.nan))
    d = z.shape[1]
    return Overrepresentation(Part(*(part[:d] for part in compared)), Part(*(part[d:] for part in compared)))


def _larger(
    numbers: NDArray[np.intp], over: NDArray[np.bool_], confidence: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """P(value of one above > of one not above), ties count half, with DeLong's (1988) interval on the logit scale.

    The quantile is Student's, with Welch's (1947) degrees of freedom. `numbers` has the `places` of all joints,
    (d, n).
    """
    m, k = int(over.sum()), int((~over).sum())
    joint = from_places(numbers)
    of_above = (joint[:, over] - from_places(numbers[:, over])) / k  # share of the others that each one surpasses
    of_others = 1.0 - (joint[:, ~over] - from_places(numbers[:, ~over])) / m
    estimate = of_above.mean(axis=1)
    least = 0.5 / (m * k)
    var_above, var_others = of_above.var(axis=1, ddof=1) / m + least**2, of_others.var(axis=1, ddof=1) / k
    error = np.sqrt(var_above + var_others) * (1.0 + WIDER / min(m, k))
    degrees = (var_above + var_others) ** 2 / (var_above**2 / (m - 1) + var_others**2 / (k - 1))
    inside = np.clip(estimate, least, 1.0 - least)
    half = half_width(confidence, degrees) * error / (inside * (1.0 - inside))
    return estimate, special.expit(special.logit(inside) - half), special.expit(special.logit(inside) + half)
