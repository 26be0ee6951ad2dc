"""Experiments on allocated tolerances: does a proposal hold that is said to, and is its last interval true?"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tests.measure.coverage.trial import Asked, Experiment, Found, Rng
from tests.support.lines import Lines

TARGET = 0.05
CASES = {"two lines": (1.0, 0.9, 0.01), "five lines": (1.0, 0.97, 0.95, 0.93, 0.9)}
"""Deviations of the lines of a drawing."""
MOST_SEEDS = 300
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
        share, look = lines.share(found.search.design), found.looks[-1]
        holds = Found(-np.inf, TARGET, share, found.state == "holds")
        return [holds, Found(float(look.lower[0]), float(look.upper[0]), share)]

    case = f"{name}, {drawn:g} to {TARGET:g}"
    asked = Asked("allocation holds", case, n), Asked("share, allocation", case, n)
    return Experiment(asked, once, MOST_SEEDS)
