"""Rank regression: effect of each error on a load, independent of units and of any monotone nonlinearity."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.analysis.binomial import half_width
from tolstat.analysis.ranks import from_places, places
from tolstat.common.loads import FloatArray

GROUPS = 20
"""Number of groups in the delete-a-group jackknife."""


class RankRegression(NamedTuple):
    """Standardised rank regression coefficients (SRRC).

    Attributes
    ----------
    estimate, lower, upper : ndarray, shape (d,)
        Change of the load's rank per change of an error's rank, the other errors fixed, both in standard deviations;
        the sign is the direction. The interval is NaN for dependent samples.
    r2 : float
        Share of the variance of the load's ranks that all errors together explain; where it is small, the load is not
        monotone in the errors and the coefficients mean little.
    """

    estimate: FloatArray
    lower: FloatArray
    upper: FloatArray
    r2: float


def ranks(x: ArrayLike, y: ArrayLike, confidence: float = 0.95, iid: bool = True) -> RankRegression:
    """Regress the ranks of a load on those of the errors (Iman and Conover 1979).

    The intervals are those of the delete-a-group jackknife with Student's t (Kott 2001): each group of joints is left
    out in turn, and the others are ranked anew.

    Parameters
    ----------
    x : array_like, shape (n, d)
        Errors of the joints, any units; each must scatter.
    y : array_like, shape (n,)
        Load of each joint, valid joints only.
    confidence : float
        Confidence level of the intervals.
    iid : bool
        Whether the joints are independent samples.

    Returns
    -------
    RankRegression
        Coefficients and intervals.

    Raises
    ------
    ValueError
        When there are fewer than d + 2 `GROUPS` joints, or an error does not scatter.
    """
    errors, load = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    if len(load) < errors.shape[1] + 2 * GROUPS:
        found = f"{len(load)} joints are too few for {errors.shape[1]} errors"
        raise ValueError(f"{found}: give {errors.shape[1] + 2 * GROUPS} or more")
    if (np.ptp(errors, axis=0) == 0).any() or np.ptp(load) == 0:
        raise ValueError("give a load and errors that scatter")
    place = places(np.column_stack([errors, load]))
    estimate, r2 = _coefficients(place)
    if not iid:
        return RankRegression(estimate, np.full_like(estimate, np.nan), np.full_like(estimate, np.nan), r2)
    group = np.arange(len(load)) % GROUPS
    without = np.array([_coefficients(place[:, group != g])[0] for g in range(GROUPS)])
    spread = np.sqrt((GROUPS - 1) / GROUPS * ((without - estimate) ** 2).sum(axis=0))
    half = half_width(confidence, GROUPS - 1) * spread
    return RankRegression(estimate, estimate - half, estimate + half, r2)


def _coefficients(place: NDArray[np.intp]) -> tuple[FloatArray, float]:
    """Coefficients and R^2 of joints whose places, (d + 1, m), are given: those of the errors, then of the load."""
    correlation: FloatArray = np.asarray(np.corrcoef(from_places(place)))
    slopes: FloatArray = np.asarray(np.linalg.lstsq(correlation[:-1, :-1], correlation[:-1, -1], rcond=None)[0])
    return slopes, float(slopes @ correlation[:-1, -1])
