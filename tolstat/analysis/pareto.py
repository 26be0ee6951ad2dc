"""The generalised Pareto distribution of excesses, 1 - F(x) = (1 + k x / sigma)^(-1/k): estimates and likelihood.

k > 0 is a heavy tail, k = 0 the exponential, k < 0 a tail that ends at -sigma / k.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.common.late import special
from tolstat.common.loads import FloatArray

STRAIGHT = 1e-8
"""``|k|`` below which the tail counts as exponential."""
LEAST_SHAPE = -0.5
"""Smallest k of a fit by maximum likelihood: below it the asymptotic theory does not hold (Smith 1985)."""
FEWEST_WEIGHTS = 50
"""Minimum number of positive weights for the shape of their tail."""


def fit(excesses: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Estimate k and sigma of many samples (Zhang and Stephens 2009: a mean over the profile likelihood).

    Parameters
    ----------
    excesses : array_like, shape (..., n)
        Positive excesses, n of each sample, at least 2.

    Returns
    -------
    k, sigma : ndarray, shape (...)
        Shape, and scale in the unit of the excesses.
    """
    m = 30 + int(np.sqrt(np.shape(excesses)[-1]))
    x, b = _grid(excesses, (np.arange(1, m + 1) - 0.5) / m)
    likelihood = _profile(x, b)[1]
    weight = np.exp(likelihood - likelihood.max(axis=-1, keepdims=True))
    mean = (b * weight).sum(axis=-1) / weight.sum(axis=-1)
    shape = np.log1p(-mean[..., None] * x).mean(axis=-1)
    return shape, -shape / mean


def most_likely(excesses: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Estimate k and sigma of many samples by maximum likelihood, k not below `LEAST_SHAPE`.

    The likelihood is that of b = -k / sigma alone, with k = mean(log(1 - b x)) (Grimshaw 1993), on the grid of `fit`,
    then on finer ones about its maximum.

    Parameters
    ----------
    excesses : array_like, shape (..., n)
        Positive excesses, n of each sample, at least 2.

    Returns
    -------
    k, sigma : ndarray, shape (...)
        Shape, and scale in the unit of the excesses.
    """
    part = np.linspace(0.0, 1.0, 12)
    x, b = _grid(excesses, np.linspace(1e-3, 0.999, 20)[::-1])
    for _ in range(4):
        b = np.where(np.abs(b) * x[..., -1:] < STRAIGHT, -STRAIGHT / x[..., -1:], b)
        k, likelihood = _profile(x, b)
        best = np.argmax(np.where(k >= LEAST_SHAPE, likelihood, -np.inf), axis=-1)[..., None]
        at = [np.take_along_axis(b, np.clip(best + step, 0, b.shape[-1] - 1), axis=-1) for step in (-1, 1)]
        shape, most_likely_b = (np.take_along_axis(values, best, axis=-1)[..., 0] for values in (k, b))
        b = at[0] + (at[1] - at[0]) * part
    return shape, -shape / most_likely_b


def _grid(excesses: ArrayLike, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Excesses ascending, (..., n), and values of b = -k / sigma over the range of high likelihood, (..., m).

    They go from the end of the tail at the largest excess to one far beyond: equal steps `u` of a root.
    """
    x = np.sort(np.asarray(excesses, dtype=float), axis=-1)
    quartile = x[..., int(x.shape[-1] / 4 + 0.5) - 1, None]
    return x, 1.0 / x[..., -1:] + (1.0 - np.sqrt(1.0 / u)) / (3.0 * quartile)


def _profile(x: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Most likely k given b = -k / sigma, and the log-likelihood, (..., m) each."""
    k = np.stack([np.log1p(-b[..., j, None] * x).mean(axis=-1) for j in range(b.shape[-1])], axis=-1)
    return k, x.shape[-1] * (np.log(-b / k) - k - 1.0)


def log_likelihood(excesses: FloatArray, k: ArrayLike, sigma: ArrayLike) -> FloatArray:
    """Log-likelihood of one sample; -inf where an excess is beyond the end of the tail.

    Parameters
    ----------
    excesses : ndarray, shape (n,)
        Excesses.
    k, sigma : array_like
        Parameters, broadcast together.

    Returns
    -------
    ndarray
        Of the shape of the broadcast.
    """
    shape = np.asarray(k, dtype=float)
    shape = np.where(np.abs(shape) < STRAIGHT, STRAIGHT, shape)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.atleast_1d(shape / sigma)
        sums = np.stack([np.log1p(row[..., None] * excesses).sum(axis=-1) for row in ratio])  # row by row, for memory
        loss = (1.0 + 1.0 / shape) * sums.reshape(np.broadcast_shapes(shape.shape, np.shape(sigma)))
    return np.where(np.isnan(loss), -np.inf, -excesses.size * np.log(sigma) - loss)


def upper_share(x: ArrayLike, k: ArrayLike, sigma: ArrayLike) -> FloatArray:
    """1 - F(x), broadcast."""
    with np.errstate(invalid="ignore"):  # NaN beyond the end of the tail
        return np.nan_to_num(1.0 / special.inv_boxcox(np.divide(x, sigma), k))


def quantile(share_above: ArrayLike, k: ArrayLike, sigma: ArrayLike) -> FloatArray:
    """Excess x with 1 - F(x) = `share_above`, broadcast."""
    return np.asarray(-np.asarray(sigma) * special.boxcox(np.asarray(share_above, dtype=float), np.negative(k)))


def anderson_darling(excesses: FloatArray, k: ArrayLike, sigma: ArrayLike) -> FloatArray:
    """Anderson–Darling distance of samples (..., n) from the distribution, shape (...); emphasises both ends."""
    n = excesses.shape[-1]
    above = upper_share(np.sort(excesses, axis=-1), np.asarray(k)[..., None], np.asarray(sigma)[..., None])
    above = np.clip(above, 1e-300, 1.0 - 1e-16)
    odd: NDArray[np.int64] = 2 * np.arange(1, n + 1) - 1
    terms = odd * (np.log1p(-above) + np.log(above[..., ::-1]))
    return np.asarray(-n - terms.sum(axis=-1) / n)


def shape_of_weights(weights: ArrayLike) -> float:
    """Shape k of the tail of weights (Vehtari, Simpson, Gelman, Yao and Gabry 2024): 1 / k of their moments are finite.

    Parameters
    ----------
    weights : array_like, shape (n,)
        Not negative.

    Returns
    -------
    float
        k of the largest min(n / 5, 3 sqrt(n)) positive weights, drawn towards 1/2 as by ten observations; -inf if all
        weights are equal, NaN if fewer than `FEWEST_WEIGHTS` are positive.
    """
    w = np.sort(np.asarray(weights, dtype=float))
    w = w[w > 0]
    if w.size < FEWEST_WEIGHTS:
        return np.nan
    if w[0] == w[-1]:
        return -np.inf
    m = min(w.size // 5, int(np.ceil(3.0 * np.sqrt(w.size))))
    tail = w[-m:] - w[-m - 1]
    if not tail[0] > 0:  # equal weights at the threshold: of those above it, as many as there are
        tail = tail[tail > 0]
    return float((fit(tail)[0] * tail.size + 0.5 * 10.0) / (tail.size + 10.0)) if tail.size >= 5 else 0.5
