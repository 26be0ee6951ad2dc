"""Exact distribution over the stops of a campaign with a stop rule, with SciPy alone: a check of `analysis.binomial`.

The probability of a pair (look, count above) is the number of paths to it that stop nowhere before, times
p^count (1 - p)^others (Chen and Chen 2013). Paths more than `REACH` standard deviations from their mean are left out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from scipy.stats import beta, binom

REACH = 7.5
LEAST_BESIDE = 10


def grid(n: int, growth: float = 1.05) -> list[int]:
    """Numbers of joints of the looks: from 20 on, each `growth` times the one before; the last is n."""
    steps = range(math.ceil(math.log(n / 20) / math.log(growth))) if n > 20 else ()
    return [*sorted({math.ceil(20 * growth**k) for k in steps} - {n}), n]


class Rule:
    """Stop at the first look whose Clopper-Pearson interval is narrower than `width`, with ten joints on each side.

    At the last look each count stops.
    """

    def __init__(self, width: float, looks: Sequence[int], confidence: float) -> None:
        self.looks: list[int] = []
        self.lower, self.upper, self.stop = [], [], []
        for n in looks:
            count = np.arange(n + 1)
            lower = np.concatenate([[0.0], beta.ppf((1 - confidence) / 2, count[1:], n - count[1:] + 1)])
            upper = 1.0 - lower[::-1]
            stop = (upper - lower < width) & (count >= LEAST_BESIDE) & (n - count >= LEAST_BESIDE)
            if n == looks[-1]:
                stop[:] = True
            if stop.any():  # looks at which no count stops change nothing
                self.looks.append(n)
                self.lower.append(lower)
                self.upper.append(upper)
                self.stop.append(stop)

    def stops(self, p: float) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
        """Yield for each look its index, the counts that stop there, and their probabilities."""
        counts, mass, seen = np.zeros(1, int), np.ones(1), 0
        for look, n in enumerate(self.looks):
            more, seen = n - seen, n
            spread = REACH * math.sqrt(more * p * (1 - p)) + REACH**2 / 3
            new = np.arange(max(0, math.floor(more * p - spread)), min(more, math.ceil(more * p + spread)) + 1)
            counts = np.arange(counts[0] + new[0], counts[-1] + new[-1] + 1)
            mass = np.convolve(mass, binom.pmf(new, more, p))
            stop = self.stop[look][counts]
            yield look, counts[stop], mass[stop]
            mass[stop] = 0.0
            kept = np.flatnonzero(mass > 1e-18)
            if not kept.size or mass.sum() < 1e-12:
                return
            counts, mass = counts[kept[0] : kept[-1] + 1], mass[kept[0] : kept[-1] + 1]

    def misses(self, p: float) -> tuple[float, float]:
        """Probability that the interval at the stop lies above a share p of all joints, and below it.

        An interval that ends at p counts as a miss: of the two limits of p to an end of intervals, the larger.
        """
        above = below = 0.0
        for look, counts, mass in self.stops(p):
            above += mass[self.lower[look][counts] >= p].sum()
            below += mass[self.upper[look][counts] <= p].sum()
        return float(above), float(below)

    def coverage(self, p: float) -> float:
        """Probability that the interval at the stop contains a share p of all joints."""
        return 1.0 - sum(self.misses(p))

    def joints(self, p: float) -> float:
        """Expected number of joints at the stop."""
        return float(sum(self.looks[look] * mass.sum() for look, _, mass in self.stops(p)))

    def bias(self, p: float) -> float:
        """Relative bias of count over joints at the stop."""
        return float(sum((counts * mass).sum() / self.looks[look] for look, counts, mass in self.stops(p))) / p - 1.0

    def ends(self, most: int) -> np.ndarray:
        """Ends of the intervals of stops: between two of them each miss is monotone in the share.

        Of more than `most`, those of small and large shares, and of others spread evenly.
        """
        pairs = [(low[stop], high[stop]) for low, high, stop in zip(self.lower, self.upper, self.stop, strict=True)]
        found = np.unique(np.concatenate([np.concatenate(pair) for pair in pairs]))
        found = found[(found > 0) & (found < 1)]
        if found.size <= most:
            return found
        edge = most // 4
        ranks = np.linspace(edge, found.size - edge - 1, most - 2 * edge).round().astype(int)
        return np.concatenate([found[:edge], found[ranks], found[-edge:]])
