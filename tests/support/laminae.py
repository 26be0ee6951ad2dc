"""Bearings after ISO/TS 16281:2008 by its letter: each lamina of each needle, for many positions of the cage."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

POSITIONS = 2000
Profile = Callable[[NDArray[np.float64]], NDArray[np.float64]]


class Needles(NamedTuple):
    """A bearing: numbers and mm, N; `profile` is the approach that it takes off at places from -1 to 1, mm."""

    Z: int = 32
    L: float = 22.0
    D: float = 4.0
    pitch: float = 42.0
    C: float = 21e3
    profile: Profile = np.zeros_like
    laminae: int = 30

    def places(self):
        return (2 * np.arange(1, self.laminae + 1) - 1) / self.laminae - 1

    def riser(self):
        """Eq. (60)."""
        k, n = np.arange(1, self.laminae + 1), self.laminae
        return np.ones(1) if n == 1 else 1 - 0.01 / np.log(1.985 * np.abs(2 * k - n - 1) / (2 * n - 2))

    def ratings(self):
        """Q_ci and Q_ce, eqs. (47) to (57)."""
        gamma = self.D / self.pitch
        ratio = 1.038 * ((1 - gamma) / (1 + gamma)) ** (143 / 108)
        inner = self.C / (0.83 * 0.378 * self.Z) * (1 + ratio**4.5) ** (2 / 9)
        return inner, self.C / (0.83 * 0.364 * self.Z) * (1 + ratio**-4.5) ** (2 / 9)

    def loads(self, r, end, turn, clearance):
        """Load of each lamina of a needle at each position, (laminae, positions), N, and the positions."""
        phi, x = 2 * np.pi * (np.arange(POSITIONS) + 0.5) / POSITIONS, self.places()
        along, across = r + x * end * np.cos(turn), x * end * np.sin(turn)
        approach = along[:, None] * np.cos(phi) + across[:, None] * np.sin(phi) - clearance
        approach -= self.profile(x)[:, None]
        return 35948 * self.L ** (8 / 9) / self.laminae * np.maximum(approach, 0) ** (10 / 9), phi

    def force(self, *place):
        q, phi = self.loads(*place)
        return self.Z * np.hypot((q * np.cos(phi)).mean(1).sum(), (q * np.sin(phi)).mean(1).sum())

    def displaced(self, force, end, turn, clearance):
        """Displacement of the middle, mm, with which a pin carries a force."""
        return brentq(lambda r: self.force(r, end, turn, clearance) - force, 0, 500, xtol=1e-13)

    def L10r(self, force, end=0.0, turn=0.0, clearance=0.0):
        """Eqs. (61) to (65), million revolutions; `end`: tilt by half the length, mm, at `turn` to the force."""
        q, _ = self.loads(self.displaced(force, end, turn, clearance), end, turn, clearance)
        q *= self.riser()[:, None]
        inner, outer = (q**4).mean(1) ** (1 / 4), (q**4.5).mean(1) ** (2 / 9)
        q_ci, q_ce = np.array(self.ratings()) * (1 / self.laminae) ** (7 / 9)
        return ((inner / q_ci) ** 4.5 + (outer / q_ce) ** 4.5).sum() ** (-8 / 9)

    def line_load(self, force, end, turn, clearance):
        """Largest load of a lamina by its length, N/mm."""
        q, _ = self.loads(self.displaced(force, end, turn, clearance), end, turn, clearance)
        return q.max() / (self.L / self.laminae)

    def equivalent(self, force, end, turn, clearance):
        """Load with the same L10r on the bearing in line and without clearance, N."""
        life = self.L10r(force, end, turn, clearance)
        return brentq(lambda P: np.log(self.L10r(P) / life), 0.1 * force, 300 * force, rtol=1e-9)
