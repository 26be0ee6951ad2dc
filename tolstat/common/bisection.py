"""Bisection of many brackets at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


def first(holds: Callable[[Any], Any], low: ArrayLike, high: ArrayLike, halvings: int = 60) -> NDArray[Any]:
    """Find the smallest number of each bracket at which a condition holds that also holds at all larger ones.

    Parameters
    ----------
    holds : callable
        Gets an array of numbers, one of each bracket, and returns whether the condition holds at each of them. It is
        not called at the ends of a bracket of real numbers, nor at `high` of one of integers.
    low, high : array_like, broadcast to a common shape
        Ends of the brackets; if all are integers, so are the numbers searched.
    halvings : int
        Halvings of a bracket of real numbers, fewer if no number is left between its ends. Brackets of integers are
        searched to the end.

    Returns
    -------
    ndarray, of the common shape
        Integers: from `low` to `high`, `high` if the condition holds at none before. Real numbers: upper end of the
        last bracket, at most ``(high - low) / 2**halvings`` above the number searched; `high` without any. Also `high`
        where the condition is never true because its values are NaN.

    Examples
    --------
    >>> first(lambda n: n**2 >= [10, 16, 200], 0, 10)  # 10: none of 0 to 9
    array([ 4,  4, 10])
    >>> first(lambda x: x**2 >= [2.0, 9.0], [0.0, 0.0], [3.0, 5.0]).round(12)
    array([1.41421356, 3.        ])
    >>> float(first(lambda x: x**3 >= 8.0, 0.0, 10.0))
    2.0
    """
    low, high = (np.array(end) for end in np.broadcast_arrays(low, high))
    if np.issubdtype(np.result_type(low, high), np.integer):
        last = high - 1
        while (unknown := low < high).any():
            middle = np.minimum(low + (high - low) // 2, last)
            above = np.asarray(holds(middle), dtype=bool)
            low, high = np.where(unknown & ~above, middle + 1, low), np.where(unknown & above, middle, high)
        return high
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        if ((middle <= low) | (middle >= high)).all():
            break
        above = holds(middle)
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return high
