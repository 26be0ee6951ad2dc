"""Laws of loads with known answers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from tolstat.analysis.exceedance import FloatArray, clopper_pearson


class Law(NamedTuple):
    """A distribution of a load.

    Attributes
    ----------
    name : str
        As in the table.
    ppf, sf : callable
        Quantile of a share, and share above a level, elementwise.
    """

    name: str
    ppf: Callable[[Any], Any]
    sf: Callable[[Any], Any]

    def draw(self, rng: np.random.Generator, n: int) -> FloatArray:
        """N independent loads."""
        return np.asarray(self.ppf(rng.random(n)), dtype=float)

    def fresh_quantile(self, n: int, share: float) -> float:
        """Typical width of the interval of a quantile from n joints: that of its share, through the law."""
        lower, upper = clopper_pearson(n * share, n)
        return float(self.ppf(upper) - self.ppf(lower))


def fresh_share(n: int, share: float) -> float:
    """Width of the Clopper–Pearson interval of n joints, of which `share` are above the level."""
    lower, upper = clopper_pearson(n * share, n)
    return float(upper - lower)


def laws() -> dict[str, Law]:
    """Laws by name: symmetric, skew, bounded, with a heavy tail, and with ties."""
    from scipy import stats

    own = {
        "normal": stats.norm(),
        "lognormal": stats.lognorm(1.0),
        "uniform": stats.uniform(),
        "exponential": stats.expon(),
        "gamma of shape 3": stats.gamma(3.0),
        "Pareto tail, k = 0.2": stats.genpareto(0.2),
        "slightly skew": stats.lognorm(0.25),
    }
    found = {name: Law(name, law.ppf, law.sf) for name, law in own.items()}
    # loads that are rounded to half a standard deviation: many joints have the same
    found["rounded"] = Law(
        "rounded",
        lambda p: np.round(2.0 * stats.norm.ppf(p)) / 2.0,
        lambda x: stats.norm.sf((np.floor(2.0 * np.asarray(x) + 1e-9) + 0.5) / 2.0),
    )
    return found
