"""Distributions that zones need: of a radius whose direction is uniform, and of the diameters of accepted parts."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tolstat.common.late import special
from tolstat.study.axes import Bonus
from tolstat.study.tolerances.distributions import Array, Distribution, score


@dataclass(frozen=True)
class Rayleigh(Distribution):
    """Radius of a point whose two coordinates are normal with standard deviation `sigma` each.

    With `upper`, parts beyond that radius are rejected.
    """

    sigma: float
    upper: float | None = None

    @property
    def _share(self) -> float:
        """Share that is not rejected."""
        return 1.0 if self.upper is None else -math.expm1(-0.5 * (self.upper / self.sigma) ** 2)

    def ppf(self, u: Array) -> Array:
        """See `Distribution.ppf`."""
        radius: Array = self.sigma * np.sqrt(-2 * np.log1p(-u * self._share))
        return radius if self.upper is None else np.minimum(radius, self.upper)

    def cdf(self, x: Array) -> Array:
        """See `Distribution.cdf`."""
        radius = np.clip(x, 0.0, self.upper)
        return -np.expm1(-0.5 * (radius / self.sigma) ** 2) / self._share


@dataclass(frozen=True)
class Disc(Distribution):
    """Radius of a point that is uniform by area in a circle of radius `upper`."""

    upper: float

    def ppf(self, u: Array) -> Array:
        """See `Distribution.ppf`."""
        return np.asarray(self.upper * np.sqrt(u))

    def cdf(self, x: Array) -> Array:
        """See `Distribution.cdf`."""
        return np.clip(x / self.upper, 0.0, 1.0) ** 2


def plane_scores(distribution: Distribution, vector: Array) -> Array:
    """Two independent standard normal scores of a vector with this radius and uniform direction.

    Box and Muller's transformation the other way round: a normal vector keeps its direction and gets the radius that
    has the same probability.

    Parameters
    ----------
    distribution : Distribution
        Of the radius.
    vector : ndarray, (2, n)
        Components, in the unit of the radius.

    Returns
    -------
    ndarray, (2, n)
        Components along the same directions.
    """
    radius = np.hypot(*vector)
    if isinstance(distribution, Rayleigh) and distribution.upper is None:
        return vector / distribution.sigma
    size = np.sqrt(-2.0 * np.log1p(-np.minimum(distribution.cdf(radius), 1.0 - 2.0**-53)))
    return np.divide(size * vector, radius, out=np.zeros_like(vector), where=radius > 0)


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
        among = np.where(low <= high, special.ndtri(low / low[-1]), -special.ndtri(high / low[-1]))
    among = np.clip(among, -FAR, FAR)  # where no part is accepted on one side
    among[[0, -1]] = np.minimum(among[1] - 1.0, -END), np.maximum(among[-2] + 1.0, END)
    return z, among, float(low[-1])


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
        z, among, _ = self._table
        among_all = special.ndtr(np.interp(special.ndtri(u), among, z))
        return self.every.ppf(np.where((u > 0.0) & (u < 1.0), among_all, u))

    def cdf(self, x: Array) -> Array:
        """See `Distribution.cdf`."""
        z, among, _ = self._table
        return np.asarray(special.ndtr(np.interp(score(self.every, x), z, among)))

    def describe(self) -> dict[str, Any]:
        """See `Distribution.describe`."""
        return {"distribution": "accepted", "every": self.every.describe()}
