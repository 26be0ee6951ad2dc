"""Distributions of the radius of a vector across an axis, whose direction is uniform: zones and radial offsets."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tolstat.study.tolerances.distributions import Array, Described, Distribution, Moments

ROUNDING = 1.0 + 1e-9
"""A radius computed back from errors may exceed the zone's by rounding."""


@dataclass(frozen=True)
class Rayleigh(Described):
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

    def logpdf(self, x: Array) -> Array:
        """See `Distribution.logpdf`."""
        inside = (x >= 0) & (x <= (math.inf if self.upper is None else self.upper * ROUNDING))
        with np.errstate(divide="ignore"):
            radius = np.log(np.where(inside, x, 0.0))
        return radius - 0.5 * (x / self.sigma) ** 2 - 2 * math.log(self.sigma) - math.log(self._share)


@dataclass(frozen=True)
class Disc(Described):
    """Radius of a point that is uniform by area in a circle of radius `upper`."""

    upper: float

    def ppf(self, u: Array) -> Array:
        """See `Distribution.ppf`."""
        return np.asarray(self.upper * np.sqrt(u))

    def cdf(self, x: Array) -> Array:
        """See `Distribution.cdf`."""
        return np.clip(x / self.upper, 0.0, 1.0) ** 2

    def logpdf(self, x: Array) -> Array:
        """See `Distribution.logpdf`."""
        inside = (x >= 0) & (x <= self.upper * ROUNDING)
        with np.errstate(divide="ignore"):
            return np.log(np.where(inside, 2.0 * x, 0.0)) - 2.0 * math.log(self.upper)

    @property
    def moments(self) -> Moments:
        """See `Distribution.moments`."""
        return Moments(self.upper / 1.5, self.upper / math.sqrt(18.0))


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
