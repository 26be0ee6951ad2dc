"""Lines of a drawing with a load of known law: the largest modulus of normal errors, one a line."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq
from scipy.stats import norm

from tolstat.analysis import allocation
from tolstat.analysis.allocation import EXACT, Design, Mask, Outcome, Problem

FACTORS = 10.0 ** (np.arange(-6, 5) / 10.0)
"""Widths of a line, relative to the drawing."""
DRAWN = 6


class Lines:
    """Lines whose errors have these deviations as drawn, and the level that a share of the joints exceeds."""

    def __init__(self, deviations: Sequence[float], share: float) -> None:
        self.deviations, self.drawn = np.array(deviations), (DRAWN,) * len(deviations)
        self.level = 1.0
        self.level = float(brentq(lambda level: self._share(self.drawn, level) - share, 0.01, 20.0))

    def _scales(self, design: Design) -> np.ndarray:
        return self.deviations * [0.0 if step == EXACT else FACTORS[step] for step in design]

    def _share(self, design: Design, level: float) -> float:
        scales = self._scales(design)
        return float(1.0 - np.prod(1.0 - 2.0 * norm.sf(level / scales[scales > 0.0])))

    def share(self, design: Design) -> float:
        """Share of the joints of a design above the level."""
        return self._share(design, self.level)

    def above(self, scores: np.ndarray, design: Design) -> Mask:
        """Which joints with these scores, (n, lines), are above the level, (n, 1)."""
        return (np.abs(scores * self._scales(design)).max(axis=1) > self.level)[:, None]

    def problem(self, rng: np.random.Generator, target: float, most: int = 1 << 16) -> Problem:
        """Problem of a search on joints of this generator; each line costs 1 as drawn."""
        looks = allocation.sizes(np.array([target]), most)
        scores = rng.standard_normal((looks[0], len(self.drawn)))
        return Problem(
            costs=[1.0 / FACTORS] * len(self.drawn),
            drawn=self.drawn,
            above=lambda designs: [self.above(scores, design) for design in designs],
            targets=np.array([target]),
            aims=np.array([allocation.aim(target, looks[-1])]),
        )

    def allocate(self, rng: np.random.Generator, target: float, most: int = 1 << 16) -> Outcome:
        """Search and check, by joints of this generator."""
        looks = allocation.sizes(np.array([target]), most)
        fresh = [rng.standard_normal((looks[-1], len(self.drawn))) for _ in range(allocation.ROUNDS)]
        problem = self.problem(rng, target, most)
        return allocation.allocate(problem, lambda design, k, n: self.above(fresh[k][:n], design), looks)
