"""Distribution of the diameters of parts that are accepted by the maximum material requirement."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tolstat.common.late import special
from tolstat.study.bonus import Bonus
from tolstat.study.tolerances.distributions import Array, Distribution, score

END, CELLS = 9.0, 3600
"""Range of scores, and number of cells of the table, in which the accepted share is constant."""
FAR = 40.0
"""Score beyond the smallest and the largest that double precision has a probability for."""


def scores_among(every: Distribution, accepted: Callable[[Array], Array]) -> tuple[Array, Array, float]:
    """Distribution among some parts, of which a share is accepted that depends on the value.

    Parameters
    ----------
    every : Distribution
        Distribution among all parts.
    accepted : callable
        Share of the parts of each value that are accepted, elementwise.

    Returns
    -------
    z : ndarray, (CELLS + 1,)
        Scores among all parts.
    own : ndarray, (CELLS + 1,)
        Scores among the accepted parts of the same values.
    share : float
        Share of accepted parts.
    """
    z = np.linspace(-END, END, CELLS + 1)
    weight = accepted(every.ppf(special.ndtr(0.5 * (z[1:] + z[:-1]))))
    below, above = np.diff(special.ndtr(z)), -np.diff(special.ndtr(-z))  # each half from its own tail
    mass = weight * np.where(z[1:] <= 0.0, below, above)
    low, high = np.append(0.0, np.cumsum(mass)), np.append(np.cumsum(mass[::-1])[::-1], 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        own = np.where(low <= high, special.ndtri(low / low[-1]), -special.ndtri(high / low[-1]))
    own = np.clip(own, -FAR, FAR)  # where no part is accepted on one side
    own[[0, -1]] = np.minimum(own[1] - 1.0, -END), np.maximum(own[-2] + 1.0, END)
    return z, own, float(low[-1])


@dataclass(frozen=True)
class Accepted(Distribution):
    """Distribution of a diameter among the accepted parts.

    Attributes
    ----------
    every : Distribution
        Distribution among all parts.
    bonus : Bonus
        What accepts a part.
    """

    every: Distribution
    bonus: Bonus

    @cached_property
    def _table(self) -> tuple[Array, Array, float]:
        return scores_among(self.every, self.bonus.accepted)

    @property
    def share(self) -> float:
        """Share of accepted parts."""
        return self._table[2]

    def ppf(self, u: Array) -> Array:
        """See `Distribution.ppf`."""
        z, own, _ = self._table
        among_all = special.ndtr(np.interp(special.ndtri(u), own, z))
        return self.every.ppf(np.where((u > 0.0) & (u < 1.0), among_all, u))

    def cdf(self, x: Array) -> Array:
        """See `Distribution.cdf`."""
        z, own, _ = self._table
        return np.asarray(special.ndtr(np.interp(score(self.every, x), z, own)))

    def logpdf(self, x: Array) -> Array:
        """See `Distribution.logpdf`."""
        return self.every.logpdf(x) + np.log(self.bonus.accepted(x)) - math.log(self.share)

    def describe(self) -> dict[str, Any]:
        """See `Distribution.describe`."""
        return {"distribution": "accepted", "every": self.every.describe()}
