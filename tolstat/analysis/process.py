"""What measured parts tell of a process: its mean and deviation are estimated from n parts, not known.

A score is the error less the mean of the parts, over their standard deviation. With the reference prior, of density
1 / sigma, n parts leave deviation b and mean a of the scores of the process unknown: b^2 is (n - 1) over a
chi-squared number of n - 1 degrees of freedom, and a is normal about 0 with the deviation b / sqrt(n) (Gelman, Carlin,
Stern, Dunson, Vehtari and Rubin 2013, section 3.2). The scores of d errors of one process then follow a multivariate
Student distribution with n - 1 degrees of freedom and the scale matrix I + 11'/n: the posterior predictive.
"""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

import numpy as np

from tolstat.analysis.estimates import frozen
from tolstat.common.late import special, stats
from tolstat.common.loads import FloatArray

LEAST_PARTS, MOST_PARTS = 5, 100_000
"""Fewest and most parts that a process may be known from."""
DRAWS = 1024
"""Number of likely processes; a power of two, as Sobol' points need."""
SEED = 1908
"""Seed of the scrambling of their Sobol' points."""
NODES = 48
"""Number of Gauss nodes, in each of two directions, of the mean square of a density ratio."""


class Known(NamedTuple):
    """A process that `errors` errors of a joint come from, each with its own part, known from `parts` parts."""

    parts: int
    errors: int


class Draws(NamedTuple):
    """Likely processes, one of each entry in a row: means and deviations of scores, (K, entries) each."""

    mean: FloatArray
    deviation: FloatArray


class Sums(NamedTuple):
    """Sum, and sum of squares, of the scores of an entry's errors in each joint, (n,) each."""

    total: FloatArray
    squares: FloatArray


def deviation(u: FloatArray, parts: int) -> FloatArray:
    """Deviation b of the scores of a process with the probability `u` in (0, 1), (n,); it grows with `u`.

    The mean is normal about 0 with the deviation b / sqrt(parts).
    """
    return np.asarray(np.sqrt((parts - 1) / special.chdtri(parts - 1, u)))


@cache
def draws(parts: tuple[int, ...]) -> Draws:
    """`DRAWS` likely processes of entries known from so many parts each, at scrambled Sobol' points."""
    points = stats.qmc.Sobol(2 * len(parts), seed=np.random.default_rng(SEED)).random(DRAWS)
    points = np.clip(points, 0.5 / DRAWS, 1.0 - 0.5 / DRAWS)
    b = np.column_stack([deviation(u, n) for u, n in zip(points.T[::2], parts, strict=True)])
    return Draws(frozen(b * special.ndtri(points[:, 1::2]) / np.sqrt(parts)), frozen(b))


def log_student(sums: Sums, known: Known) -> FloatArray:
    """Logarithm of the density of the posterior predictive over that of standard normal scores, (n,)."""
    d, m, free = known.errors, known.parts, known.parts - 1
    inside = sums.squares - np.square(sums.total) / (m + d)
    return _log_constant(known) + 0.5 * sums.squares - 0.5 * (free + d) * np.log1p(inside / free)


def _log_constant(known: Known) -> float:
    """Logarithm of the ratio of both densities where all scores are zero."""
    d, free = known.errors, known.parts - 1
    gamma = math.lgamma(0.5 * (free + d)) - math.lgamma(0.5 * free)
    return gamma - 0.5 * d * math.log(0.5 * free) - 0.5 * math.log1p(d / known.parts)


def log_ratios(sums: Sums, errors: int, mean: FloatArray, deviation: FloatArray) -> FloatArray:
    """Logarithm of the density under likely processes over that of standard normal scores.

    Parameters
    ----------
    sums : Sums
        Scores of n joints.
    errors : int
        Number of errors of the entry.
    mean, deviation : ndarray, (k,)
        The processes.

    Returns
    -------
    ndarray, (n, k)
    """
    inner = 0.5 / np.square(deviation)
    constant = -errors * (np.log(deviation) + inner * np.square(mean))
    rows = np.column_stack([np.ones_like(sums.total), sums.total, sums.squares])
    return rows @ np.stack([constant, 2.0 * inner * mean, 0.5 - inner])


def log_mean_square(drawn: Draws, known: tuple[Known, ...], over: tuple[int | None, ...]) -> FloatArray:
    """Logarithm of the mean square of the density ratio of likely processes over what the joints were drawn from.

    n joints count, reweighted to the process, as n over the mean square.

    Parameters
    ----------
    drawn : Draws
        The processes.
    known : tuple of Known
        Their entries.
    over : tuple of int or None
        What the errors of each entry were drawn from: the posterior predictive of so many parts; None: the tolerances.

    Returns
    -------
    ndarray, (K,)
        Infinite where the mean square is.
    """
    total = np.zeros(len(drawn.mean))
    for a, b, entry, parts in zip(drawn.mean.T, drawn.deviation.T, known, over, strict=True):
        if parts is None:
            room = 2.0 - b**2
            with np.errstate(invalid="ignore", divide="ignore"):
                square = entry.errors * (a**2 / room - np.log(b) - 0.5 * np.log(room))
            total = total + np.where(room > 0.0, square, np.inf)
        else:
            total = total + _over_student(a, b, Known(parts, entry.errors))
    return total


def _over_student(a: FloatArray, b: FloatArray, known: Known) -> FloatArray:
    """The same of one entry drawn from a posterior predictive, by Gauss quadrature along and across the mean, (K,)."""
    d, free = known.errors, known.parts - 1
    x, along = np.polynomial.hermite.hermgauss(NODES)
    r, across = special.roots_genlaguerre(NODES, 0.5 * (d - 1) - 1.0) if d > 1 else (np.zeros(1), np.ones(1))
    # the square of the normal density is a normal density of variance b^2 / 2; x and r are its standard numbers
    v = math.sqrt(d) * a[:, None] + b[:, None] * x
    inside = (known.parts / (known.parts + d)) * np.square(v)[:, :, None] + np.square(b)[:, None, None] * r
    logs = 0.5 * (free + d) * np.log1p(inside / free)
    top = logs.max(axis=(1, 2))
    weights = (along / along.sum())[:, None] * (across / across.sum())
    mean = np.log((np.exp(logs - top[:, None, None]) * weights).sum(axis=(1, 2))) + top
    constant = _log_constant(known) - 0.5 * d * math.log(2.0 * math.pi)
    return np.asarray(mean - constant - 0.5 * d * np.log(4.0 * math.pi * b**2))
