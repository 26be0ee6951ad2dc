"""Which errors make the loads scatter? Sobol' indices from the joints of a campaign, without further runs.

The errors must be independent of each other for shares of variance to add up. *First order*: the expected reduction of
the variance when an error is fixed. *Total*: the expected variance that remains when all other errors are fixed; those
of fifty errors cannot be told from a thousand joints, and need joints of their own (`analysis.exchanged`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.analysis.binomial import half_width
from tolstat.common.loads import FloatArray

WIDER = 1.2
"""Factor on standard errors of shares of a variance, which are too small (measured)."""
FEW = 16.0
"""Standard errors are taken 1 + 16/m times as large if effectively m joints make up a load's variance (measured)."""
FEWEST = 50
"""Minimum number of joints for an index."""


class FirstOrder(NamedTuple):
    """Shares of a load's variance that each error explains on its own.

    Attributes
    ----------
    estimate, lower, upper : ndarray, shape (d,)
        Corrected for chance: the estimate for an error without effect has the mean 0 and may be negative. The interval
        is NaN for dependent samples, an index is NaN where error or load does not scatter.
    variance : float
        Variance of the load, in its unit squared; an index times the variance is the error's contribution.
    additive : tuple of float
        Sum of the indices, and the ends of its interval.
    """

    estimate: FloatArray
    lower: FloatArray
    upper: FloatArray
    variance: float
    additive: tuple[float, float, float]


class Fit(NamedTuple):
    """Mean of a load given one error, fitted to n joints.

    Attributes
    ----------
    mean, influence : ndarray, shape (n,)
        Fitted mean less that of all joints, and influence function of the share.
    share, chance : float
        Share of the variance, and variance of its estimate in the absence of any effect.
    """

    mean: FloatArray
    influence: FloatArray
    share: float
    chance: float


def first_order(x: ArrayLike, y: ArrayLike, confidence: float = 0.95, iid: bool = True) -> FirstOrder:
    """First-order Sobol' indices from given data.

    The conditional mean of the load given one error is fitted by a continuous piecewise linear function with cbrt(n)
    pieces (8 to 32) of equally many joints (Plischke, Borgonovo and Smith 2013 use a step function; linear pieces are
    exact for a load that is linear in the error). What chance adds to its share of the variance is estimated by leaving
    out one joint at a time and subtracted (Kline, Saggio and Sølvsten 2020): joints with large errors often scatter
    more than others, and a correction for the degrees of freedom alone leaves a bias. The interval is from the index's
    influence function, with a standard error taken `WIDER` times as large.

    Parameters
    ----------
    x : array_like, shape (n, d)
        Errors of the joints, any units; joints with a valid load only.
    y : array_like, shape (n,)
        Load of each joint.
    confidence : float
        Confidence level of the interval.
    iid : bool
        Whether the joints are independent samples.

    Returns
    -------
    FirstOrder
        Indices of each error.

    Raises
    ------
    ValueError
        When there are fewer than `FEWEST` joints.

    Examples
    --------
    >>> import numpy as np
    >>> x = np.random.default_rng(1).normal(size=(4000, 2))
    >>> first_order(x, x[:, 0] + 2.0 * x[:, 1]).estimate.round(1).tolist()
    [0.2, 0.8]
    """
    errors, loads = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    if len(loads) < FEWEST:
        raise ValueError(f"{len(loads)} joints are too few: give {FEWEST} or more")
    e = loads - loads.mean()
    share, chance = np.full((2, errors.shape[1]), np.nan)
    influence = np.full(errors.shape, np.nan)
    for i, column in enumerate(errors.T):
        if np.ptp(column) > 0 and e.var() > 0:
            fit = _fit(column, e)
            share[i], influence[:, i], chance[i] = fit.share, fit.influence, fit.chance
    z = WIDER * half_width(confidence) * _wider(e**2) if iid else np.nan
    half, known = z * _error(influence, chance), np.isfinite(share)
    of_sum = z * float(_error(influence[:, known].sum(axis=1), float(chance[known].sum())))
    additive = float(share[known].sum())
    low, high = (float(np.clip(additive + sign * of_sum, 0, 1)) for sign in (-1.0, 1.0))
    lower, upper = (np.clip(share + sign * half, 0, 1) for sign in (-1.0, 1.0))
    return FirstOrder(share, lower, upper, float(e.var()), (additive, low, high))


def _fit(column: FloatArray, centred: FloatArray) -> Fit:
    """Fit the mean of a load, (n,), given one error: continuous, linear in pieces of equally many joints.

    With mean m(x), deviation e and share S = Var m / Var e, the influence function of S is
    (m² + 2 m (e - m) - S e²) / Var e.
    """
    n = len(column)
    knots = np.unique(np.quantile(column, np.linspace(0, 1, min(max(8, round(np.cbrt(n))), 32) + 1)))
    piece = np.clip(np.searchsorted(knots, column, side="right") - 1, 0, len(knots) - 2)
    part, rows = (column - knots[piece]) / np.diff(knots)[piece], np.arange(n)
    hats = np.zeros((n, len(knots)))
    hats[rows, piece], hats[rows, piece + 1] = 1.0 - part, part
    hats = hats[:, 1:] - hats[:, 1:].mean(axis=0)
    size, axes = np.linalg.eigh(hats.T @ hats)  # well conditioned: hats overlap with neighbours only
    scatters = size > 1e-12 * n
    basis, degrees = axes[:, scatters] / np.sqrt(size[scatters]), int(scatters.sum())
    directions = hats @ basis
    mean, leverage = directions @ (directions.T @ centred), (directions**2).sum(axis=1)
    variance = (centred**2).mean()
    scatter = centred * (centred - mean) / (1.0 - np.minimum(leverage + 1.0 / n, 1.0 - 1e-9))  # of each joint, squared
    share = float((mean @ mean - leverage @ scatter) / (n * variance))
    influence = (mean * (2.0 * centred - mean) - share * centred**2) / variance
    return Fit(mean, influence, share, 2.0 * degrees * ((1.0 - share) / n) ** 2)


def _error(influence: FloatArray, chance: FloatArray | float) -> NDArray[np.float64]:
    """Standard errors. The influence function of noisy coefficients counts chance variance twice: subtract it once."""
    plain = influence.var(axis=0) / len(influence)
    return np.asarray(np.sqrt(np.maximum(plain - chance, chance)))


def _wider(square: FloatArray) -> float:
    """Factor on standard errors, by squared deviations of loads, (n,): large for few joints and skew loads.

    Effectively (sum of squares)² / sum of their squares joints make up a variance, a third of them if loads are normal.
    """
    return 1.0 + FEW * float((square**2).sum() / square.sum() ** 2) if square.any() else math.nan
