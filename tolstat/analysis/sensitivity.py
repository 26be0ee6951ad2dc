"""Which errors make the loads scatter? Sobol' indices from the joints of a campaign, without further runs.

The errors must be independent of each other for shares of variance to add up. *First order*: the expected reduction of
the variance when an error is fixed. *Total*: the expected variance that remains when all other errors are fixed. Total
indices of fifty errors cannot be estimated from a thousand joints without an assumption; they are bounded here: from
below by effects of one and two errors, from above by adding all variance that these do not explain.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.analysis.binomial import half_width
from tolstat.analysis.ranks import ranks
from tolstat.common.loads import FloatArray

WIDER = 1.2
"""Factor on standard errors of shares of a variance, which are too small (measured)."""
FEW = 16.0
"""Standard errors are taken 1 + 16/m times as large if effectively m joints make up a load's variance (measured)."""
FEWEST = 50
"""Minimum number of joints for an index."""
DEGREE = 3
"""Degree in each error of the polynomials that model the interaction of two errors."""
MOST = 20_000
"""Maximum number of joints used for interactions: memory is some 3 kB a joint and error, and more joints add little."""


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


class Total(NamedTuple):
    """Shares of a load's variance in which each error takes part.

    Attributes
    ----------
    estimate : ndarray, shape (d,)
        Effects of the error and of its pairs with the others: the part of the total index that can be estimated.
    lower, upper : ndarray, shape (d,)
        Interval of the total index: from the lower end of `estimate` to the upper end of `estimate` with `rest`.
    pairs : ndarray, shape (d, d)
        Share of each interaction of two errors, corrected for chance; NaN on the diagonal.
    rest : float
        Share that no error and no pair explains: interactions of three and more errors, and lack of fit.
    """

    estimate: FloatArray
    lower: FloatArray
    upper: FloatArray
    pairs: FloatArray
    rest: float


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
    errors, loads = _checked(x, y)
    e = loads - loads.mean()
    share, chance = np.full((2, errors.shape[1]), np.nan)
    influence = np.full(errors.shape, np.nan)
    for i, column in enumerate(errors.T):
        if np.ptp(column) > 0 and e.var() > 0:
            fit = _fit(column, e)
            share[i], influence[:, i], chance[i] = fit.share, fit.influence, fit.chance
    return _with_ends(share, influence, chance, e, confidence, iid)


def first_and_total(x: ArrayLike, y: ArrayLike, confidence: float = 0.95, iid: bool = True) -> tuple[FirstOrder, Total]:
    """First-order indices, and bounds of the total Sobol' indices, from given data.

    Interactions of two errors are expanded in products of Legendre polynomials of their ranks (high-dimensional model
    representation, Li, Wang and Rabitz 2002), estimated from the residual of the effects of single errors. Their shares
    are corrected for chance by leaving the squares out of the double sums (U-statistics). Interactions of more errors
    are not estimated: they make up between none and all of the rest, so the interval is one of bounds. Lack of fit
    widens it, but does not invalidate it.

    Parameters
    ----------
    x : array_like, shape (n, d)
        Errors of the joints, independent of each other; of more than `MOST` joints the first are taken.
    y : array_like, shape (n,)
        Load of each joint.
    confidence, iid
        As in `first_order`.

    Returns
    -------
    first : FirstOrder
        As of `first_order`, of these joints.
    total : Total
        Indices of each error.

    Raises
    ------
    ValueError
        As `first_order`, or when an error or the load does not scatter.
    """
    errors, loads = _checked(np.asarray(x)[:MOST], np.asarray(y)[:MOST])
    if loads.ndim != 1 or np.ptp(loads) == 0 or (np.ptp(errors, axis=0) == 0).any():
        raise ValueError("give one load and errors that scatter")
    e = loads - loads.mean()
    fits = [_fit(column, e) for column in errors.T]
    first = np.array([fit.share for fit in fits])
    influence = np.column_stack([fit.influence for fit in fits])
    chance = np.array([fit.chance for fit in fits])
    wider = _wider(e**2)
    alone = _with_ends(first, influence, chance, e, confidence, iid)
    # subtract significant effects of single errors, which would be noise in the estimates of pairs
    main = sum((fit.mean for fit, s, c in zip(fits, first, chance, strict=True) if s > 2 * c**0.5), 0.0 * e)
    pairs, of_pairs, chance_of_pairs = _interactions(errors, e - main, e.var())
    influence_of_pairs = of_pairs - pairs.sum(axis=1) * (e**2 / e.var())[:, None]
    estimate = first + pairs.sum(axis=1)
    of_error = influence + influence_of_pairs
    everything = influence.sum(axis=1) + 0.5 * influence_of_pairs.sum(axis=1)
    rest = 1.0 - first.sum() - 0.5 * pairs.sum()
    errors_lower = _error(of_error, chance + chance_of_pairs.sum(axis=1)) * wider
    without = chance.sum() - chance + 0.5 * chance_of_pairs.sum() - chance_of_pairs.sum(axis=1)
    errors_upper = _error(of_error - everything[:, None], without) * wider
    z = half_width(confidence) if iid else np.nan
    np.fill_diagonal(pairs, np.nan)
    lower = np.clip(estimate - z * errors_lower, 0, 1)
    upper = np.clip(np.maximum(estimate + rest + z * errors_upper, estimate + z * errors_lower), 0, 1)
    return alone, Total(estimate, lower, upper, pairs, float(rest))


def _with_ends(
    estimate: FloatArray, influence: FloatArray, chance: FloatArray, e: FloatArray, confidence: float, iid: bool
) -> FirstOrder:
    """First-order indices and their sum with intervals, from influence functions, (n, d), and deviations, (n,)."""
    z = WIDER * half_width(confidence) * _wider(e**2) if iid else np.nan
    half, known = z * _error(influence, chance), np.isfinite(estimate)
    of_sum = z * float(_error(influence[:, known].sum(axis=1), float(chance[known].sum())))
    additive = float(estimate[known].sum())
    low, high = (float(np.clip(additive + sign * of_sum, 0, 1)) for sign in (-1.0, 1.0))
    lower, upper = (np.clip(estimate + sign * half, 0, 1) for sign in (-1.0, 1.0))
    return FirstOrder(estimate, lower, upper, float(e.var()), (additive, low, high))


def _checked(x: ArrayLike, y: ArrayLike) -> tuple[FloatArray, FloatArray]:
    errors, loads = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    if len(loads) < FEWEST:
        raise ValueError(f"{len(loads)} joints are too few: give {FEWEST} or more")
    return errors, loads


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


def _interactions(errors: FloatArray, left: FloatArray, variance: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Shares of the pairs, (d, d), influence functions of their sums by error, (n, d), and chance variances, (d, d).

    A share is a sum of squared coefficients c = E[left p_a(x_i) p_b(x_j)] over the variance, `left` being the residual
    of single errors. The influence functions lack the term of the estimated variance.
    """
    n, d = errors.shape
    u = 2.0 * (ranks(errors) - 0.5) / n - 1.0
    basis = [np.sqrt(2 * k + 1) * np.polynomial.Legendre.basis(k)(u) for k in range(1, DEGREE + 1)]
    p = np.stack(basis, axis=2).reshape(n, d * DEGREE)
    c = (p * left[:, None]).T @ p / n
    square = p**2
    spread = (square * (left**2)[:, None]).T @ square / n
    del square  # as large as p
    same = np.kron(np.eye(d, dtype=bool), np.ones((DEGREE, DEGREE), dtype=bool))
    c[same] = spread[same] = 0.0
    blocks = (d, DEGREE, d, DEGREE)
    pairs = ((n * c**2 - spread) / (n - 1)).reshape(blocks).sum(axis=(1, 3)) / variance
    products = p @ c
    products *= p
    of_pairs = 2.0 * left[:, None] * products.reshape(n, d, DEGREE).sum(axis=2) / variance
    chance: FloatArray = 2.0 * (spread**2).reshape(blocks).sum(axis=(1, 3)) / (n * variance) ** 2
    return pairs, of_pairs, chance


def _error(influence: FloatArray, chance: FloatArray | float) -> NDArray[np.float64]:
    """Standard errors. The influence function of noisy coefficients counts chance variance twice: subtract it once."""
    plain = influence.var(axis=0) / len(influence)
    return np.asarray(np.sqrt(np.maximum(plain - chance, chance)))


def _wider(square: FloatArray) -> float:
    """Factor on standard errors, by squared deviations of loads, (n,): large for few joints and skew loads.

    Effectively (sum of squares)² / sum of their squares joints make up a variance, a third of them if loads are normal.
    """
    return 1.0 + FEW * float((square**2).sum() / square.sum() ** 2) if square.any() else math.nan
