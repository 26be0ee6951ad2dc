"""Distribution of the diameters of parts that are accepted by the maximum material requirement."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tolstat.study.bonus import Bonus
from tolstat.study.tolerances.distributions import Array, Distribution

END, CELLS = 9.0, 3600
"""Range of scores, and number of cells of the table, in which the accepted share is constant."""


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
        """Scores among all parts, scores among the accepted parts of the same values, and share of accepted parts."""
        from scipy.special import ndtr, ndtri

        z = np.linspace(-END, END, CELLS + 1)
        weight = self.bonus.accepted(self.every.ppf(ndtr(0.5 * (z[1:] + z[:-1]))))
        below, above = np.diff(ndtr(z)), -np.diff(ndtr(-z))  # each half from its own tail
        mass = weight * np.where(z[1:] <= 0.0, below, above)
        low, high = np.append(0.0, np.cumsum(mass)), np.append(np.cumsum(mass[::-1])[::-1], 0.0)
        with np.errstate(divide="ignore"):
            own = np.where(low <= high, ndtri(low / low[-1]), -ndtri(high / low[-1]))
        own[[0, -1]] = np.minimum(own[1] - 1.0, -END), np.maximum(own[-2] + 1.0, END)
        return z, own, float(low[-1])

    @property
    def share(self) -> float:
        """Share of accepted parts."""
        return self._table[2]

    def ppf(self, u: Array) -> Array:
        """See `Distribution.ppf`."""
        from scipy.special import ndtr, ndtri

        z, own, _ = self._table
        among_all = ndtr(np.interp(ndtri(u), own, z))
        return self.every.ppf(np.where((u > 0.0) & (u < 1.0), among_all, u))

    def logpdf(self, x: Array) -> Array:
        """See `Distribution.logpdf`."""
        return self.every.logpdf(x) + np.log(self.bonus.accepted(x)) - math.log(self.share)

    def describe(self) -> dict[str, Any]:
        """See `Distribution.describe`."""
        return {"distribution": "accepted", "every": self.every.describe()}
