"""Maximum material requirement of a position: the zone grows as the pin gets thinner or the hole wider.

A part is acceptable if its axis lies in the grown zone: its surface then stays within the virtual condition. What is
drawn are the ends of the axis in the zone without bonus, independently of the diameter; `Bonus.shift` takes them to the
grown zone of the part's own diameter. With the rule ``fills`` all offsets grow in proportion to the zone. With
``reject`` the process stays as it is, and each end keeps its probability under the condition that it is in the grown
zone; the diameters of accepted parts then have a distribution of their own, `Bonus.accepted` times that of all parts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

REJECT, FILLS = "reject", "fills"
LEAST = 1e-9
"""Smallest factor on a zone: zero would lose where in the zone the axis is."""


@dataclass(frozen=True)
class Bonus:
    """Bonus of the position of one pin or hole.

    Attributes
    ----------
    rule : str
        ``"reject"`` or ``"fills"``.
    diameter : str
        Name of the error of the feature's diameter.
    limit : float
        This error at maximum material, m: the upper limit of a pin, the lower limit of a hole.
    radius : float
        Radius of the zone without bonus, m.
    sigma : float
        Standard deviation of a coordinate of an end before any part is rejected, m; infinite if the process is uniform
        in the zone without bonus.
    """

    rule: str
    diameter: str
    limit: float
    radius: float
    sigma: float

    def growth(self, deviation: Array) -> Array:
        """Radius of the zone over that without bonus, from the error of the diameter (m); both (n,)."""
        side = 1.0 if self.diameter.startswith("pin") else -1.0
        return np.maximum(1.0 + side * (self.limit - deviation) / (2.0 * self.radius), LEAST)

    def inside(self, growth: Array) -> Array:
        """Share of the process's ends that lie in a zone grown by this factor."""
        if math.isinf(self.sigma):
            return np.minimum(growth, 1.0) ** 2
        return np.asarray(-np.expm1(-0.5 * (growth * self.radius / self.sigma) ** 2))

    def accepted(self, deviation: Array) -> Array:
        """Share of the parts with this error of the diameter that are not rejected: both ends are in the zone."""
        if self.rule == FILLS:
            return np.ones_like(deviation)
        return self.inside(self.growth(deviation)) ** 2

    def shift(self, vector: Array, deviation: Array) -> Array:
        """Take an end from the zone without bonus to the grown zone; vectors (2, n), m."""
        growth = self.growth(deviation)
        return vector * self._ratio(np.hypot(*vector), growth, self.inside(growth) / self.inside(np.ones(1)))

    def unshift(self, vector: Array, deviation: Array) -> Array:
        """Inverse of `shift`."""
        growth = self.growth(deviation)
        return vector * self._ratio(np.hypot(*vector), 1.0 / growth, self.inside(np.ones(1)) / self.inside(growth))

    def _ratio(self, radius: Array, growth: Array, share: Array) -> Array:
        """Factor on a radius whose probability, under the condition that it is in the zone, stays the same.

        `growth` and `share` are those of the zone's radius and of the ends inside.
        """
        if self.rule == FILLS:
            return growth
        if math.isinf(self.sigma):
            return np.sqrt(share)
        inside = -np.expm1(-0.5 * (radius / self.sigma) ** 2) * share
        moved = self.sigma * np.sqrt(-2.0 * np.log1p(-np.minimum(inside, 1.0 - 2.0**-53)))
        return np.divide(moved, radius, out=np.sqrt(share) * np.ones_like(radius), where=radius > 1e-6 * self.sigma)

    def mean_square(self, deviation: Array) -> Array:
        """Mean square of the radius of an end, m^2, for parts with this error of the diameter that are accepted."""
        growth = self.growth(deviation)
        own = np.ones_like(growth) if self.rule == FILLS else growth
        if math.isinf(self.sigma):
            square = 0.5 * (self.radius * np.minimum(own, 1.0)) ** 2
        else:
            half = 0.5 * (own * self.radius / self.sigma) ** 2
            square = 2.0 * self.sigma**2 * (1.0 - half * np.exp(-half) / self.inside(own))
        return square * growth**2 if self.rule == FILLS else square
