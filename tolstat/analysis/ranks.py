"""Ranks of values in each column of a table, and of parts of its rows, from one sort; ties share their mean rank."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.common.loads import FloatArray


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


def from_places(found: NDArray[np.intp]) -> FloatArray:
    """Ranks, from 1, of columns whose `places` are given, or of some of their rows.

    Parameters
    ----------
    found : ndarray, shape (d, m)
        Places of m rows among all.

    Returns
    -------
    ndarray, shape (d, m)
        Ranks among these m rows, the same as those of `scipy.stats.rankdata` for each column.
    """
    ranks = np.empty(found.shape)
    for own, out in zip(found, ranks, strict=True):
        alike = np.bincount(own)
        out[:] = (np.cumsum(alike) - 0.5 * (alike - 1))[own]
    return ranks


def ranks(values: ArrayLike) -> FloatArray:
    """Ranks of each column of a table (n, d), as its columns: (n, d)."""
    return from_places(places(values)).T
