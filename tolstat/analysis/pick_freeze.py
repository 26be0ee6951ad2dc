"""Sobol' indices from a pick-freeze design: what other joints it takes, no fit and no assumption on the load.

Joints A and B are independent; AB_i is A with the errors of group i from B. What A and AB_i have in common is all but
group i, what B and AB_i have in common is group i alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tolstat.analysis.exceedance import FloatArray
from tolstat.analysis.sensitivity import normal_half

FEWEST = 50
"""Points below which no index is given."""


class Index(NamedTuple):
    """An index of each group, shape (d,), with its interval."""

    estimate: FloatArray
    lower: FloatArray
    upper: FloatArray


class Indices(NamedTuple):
    """Sobol' indices.

    Attributes
    ----------
    first, total : Index
        Share of the load's variance that a group explains alone, and that it has a part in.
    variance : float
        Of the load, in its unit squared.
    points : int
        Points of which A and B are valid.
    """

    first: Index
    total: Index
    variance: float
    points: int


def indices(a: ArrayLike, b: ArrayLike, ab: ArrayLike, confidence: float = 0.95) -> Indices:
    """First-order (Saltelli et al. 2010) and total indices (Jansen 1999) of a load.

    The same estimators as those of ``scipy.stats.sobol_indices``; a joint without a valid load is left out of the
    indices that it belongs to, with no other.

    Parameters
    ----------
    a, b : array_like, shape (n,)
        Load of the joints A and B of each point, NaN without a valid one.
    ab : array_like, shape (n, d)
        Load of the joints AB_i.
    confidence : float
        Of the intervals, which are from the indices' influence functions over the points: indices are ratios of means,
        nearly normal (the percentiles of a bootstrap of 500 points of Ishigami's function cover 1 % less).

    Returns
    -------
    Indices
        Chance is not taken off: an index near 0 may come out below it.

    Raises
    ------
    ValueError
        When the lengths differ, the load does not scatter, or an index has fewer than `FEWEST` points.

    Examples
    --------
    >>> import numpy as np
    >>> a, b = np.random.default_rng(1).normal(size=(2, 4000, 2))
    >>> load = lambda x: x[..., 0] + 2.0 * x[..., 1]
    >>> mixed = np.stack([np.where([True, False], b, a), np.where([False, True], b, a)], axis=1)
    >>> indices(load(a), load(b), load(mixed)).total.estimate.round(1).tolist()
    [0.2, 0.8]
    """
    x, y, mixed = (np.asarray(v, dtype=float) for v in (a, b, ab))
    if x.ndim != 1 or x.shape != y.shape or mixed.ndim != 2 or len(mixed) != len(x):
        raise ValueError(f"loads {x.shape}, {y.shape} and {mixed.shape} are not those of one design")
    both = np.isfinite(x) & np.isfinite(y)
    x, y, mixed = x[both], y[both], mixed[both]
    valid = np.isfinite(mixed)
    if valid.sum(axis=0).min(initial=len(x)) < FEWEST:
        raise ValueError(f"{valid.sum(axis=0).min(initial=len(x))} points with valid loads are too few: give {FEWEST}")
    if np.ptp([x, y]) == 0:
        raise ValueError("the load does not scatter")
    middle = 0.5 * (x.mean() + y.mean())
    x, y = x - middle, y - middle
    square = 0.5 * (x**2 + y**2)
    moved = mixed - middle - x[:, None]
    half = normal_half(confidence)
    first, total = (_index(term, square, half) for term in (moved * y[:, None], 0.5 * moved**2))
    return Indices(first, total, float(square.mean()), len(x))


def _index(terms: FloatArray, square: FloatArray, half: float) -> Index:
    """Mean of terms (n, d), NaN where there is none, over that of the squares (n,)."""
    valid = np.isfinite(terms)
    counts = valid.sum(axis=0)
    estimate = np.where(valid, terms, 0.0).sum(axis=0) / counts / square.mean()
    influence = np.where(valid, terms - estimate * square[:, None], 0.0) / square.mean()
    error = np.sqrt((influence**2).sum(axis=0)) / counts
    return Index(estimate, estimate - half * error, estimate + half * error)
