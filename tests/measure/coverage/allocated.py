"""Experiments on allocated tolerances: is a proposal that is said to hold below its target?"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tests.measure.coverage.trial import Asked, Experiment, Found, Rng
from tests.support.lines import Lines

TARGET = 0.05
CASES = {"two lines": (1.0, 0.9, 0.01), "five lines": (1.0, 0.97, 0.95, 0.93, 0.9)}
"""Deviations of the lines of a drawing."""
MOST_SEEDS = 250
"""Number of seeds: one takes a tenth of a second."""


def experiments() -> Iterator[Experiment]:
    """All of this file."""
    for name in CASES:
        for n in (2048, 8192):
            yield _allocated(name, n)


def _allocated(name: str, n: int, drawn: float = 0.1) -> Experiment:
    """Halve the share above a limit at the least cost; a proposal that is said to hold, and does not, is a miss."""
    lines = Lines(CASES[name], drawn)

    def once(rng: Rng) -> list[Found]:
        found = lines.allocate(rng, TARGET, most=n)
        return [Found(-np.inf, TARGET, lines.share(found.search.design), found.state == "holds")]

    return Experiment((Asked("allocation holds", f"{name}, {drawn:g} to {TARGET:g}", n),), once, MOST_SEEDS)
