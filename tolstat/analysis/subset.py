"""Subset simulation: a small probability as a product of larger ones, level by level.

Au and Beck (2001). The joints of level 0 are drawn from the tolerances. The share p0 of them with the largest loads are
the seeds of level 1: chains that start from them walk among all joints beyond the threshold that the seeds have passed,
as often in each place as the tolerances make it there. The largest loads of these are the next seeds, until the limit
asked about is no farther than the threshold. A chain moves in the space of independent standard normal scores that the
errors are made from: from z to sqrt(1 - s^2) z + s xi, which leaves the normal distribution as it is, and stays where
it was if the load there is not beyond the threshold (conditional sampling: Papaioannou, Betz, Zwirglmaier and Straub
2015). The step s is the same for a whole level and follows the acceptance of the level before, so that no chain's own
path decides about its law.

The logarithm of the product is a sum over the levels of what each of their states adds to it. States of one family
(those that descend from one chain two levels before) are not independent of each other, families are: the variance is
that of the families' sums, those of adjacent levels together (fixed lag: Olsson and Douc 2019). A region of large loads
that no seed lies in is not found, and no variance tells of it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.exceedance import FloatArray, clopper_pearson

Noise = Callable[[int, int, int], FloatArray]
FIRST_STEP = 0.6
"""Step of level 1 (Papaioannou et al. 2015)."""
ACCEPTANCE = 0.44
"""Share of the moves that should be accepted (same)."""
LAG = 2
"""Levels over which relationship counts: more of them leave too few families to tell a variance by."""
FAMILIES = 5
"""Seeds for a degree of freedom of the variance: its scatter, measured over seeds (docs/rare_events.md)."""
LEAST = 1e-12
"""Probability below which the levels end: normal scores are at the end of double precision not far from it."""


class Settings(NamedTuple):
    """What is asked, and of how many joints.

    Attributes
    ----------
    n : int
        Joints a level.
    p0 : float
        Share of them that is carried to the next level; ``n * p0`` is a whole number.
    limit : float
        The load, in the unit of the loads.
    """

    n: int
    p0: float
    limit: float


class Candidates(NamedTuple):
    """Joints to be simulated next.

    Attributes
    ----------
    level : int
        Level that they belong to.
    scores : ndarray, shape (m, d)
        Standard normal scores of their errors.
    parent : ndarray, shape (m,)
        Number of the joint that each was moved from, -1 at level 0; joints are numbered as they are taken.
    """

    level: int
    scores: FloatArray
    parent: NDArray[np.intp]


class Level(NamedTuple):
    """What came of a level.

    Attributes
    ----------
    threshold : float
        Load that all its joints exceed; -inf at level 0.
    share : float
        Share of them beyond the next threshold, or beyond the limit at the last level.
    deviation : float
        Coefficient of variation of `share`, joints of one chain not being independent.
    joints : int
        Joints simulated for it.
    acceptance : float
        Share of the moves accepted; NaN at level 0.
    step : float
        Size of the moves; NaN at level 0.
    """

    threshold: float
    share: float
    deviation: float
    joints: int
    acceptance: float
    step: float


class Estimate(NamedTuple):
    """The probability asked for.

    Attributes
    ----------
    probability, lower, upper : float
        Estimate, without bias, and interval. Where the limit was not reached: NaN, 0 and what is left at most.
    deviation : float
        Coefficient of variation, chains and families included; NaN where the limit was not reached.
    """

    probability: float
    lower: float
    upper: float
    deviation: float


class _States(NamedTuple):
    """States of a level, in the order of their chains' steps.

    `families`, (n, 1 to 1 + LAG): numbers of the chains that a state descends from at this level, the one before, ...
    """

    scores: FloatArray
    loads: FloatArray
    number: NDArray[np.intp]
    families: NDArray[np.intp]

    def part(self, rows: slice | NDArray[np.bool_]) -> _States:
        """Some of the states."""
        return _States(self.scores[rows], self.loads[rows], self.number[rows], self.families[rows])


class Walk:
    """A subset simulation under way: it says which joints to simulate next, and takes their loads.

    What it says depends on the settings, the noise and the loads taken so far only. Whoever keeps the loads can go on
    where another stopped, by taking them again.

    Parameters
    ----------
    settings : Settings
        What is asked.
    noise : callable
        (level, first, m) -> independent standard normal numbers, (m, d), number `first` and following of the level.

    Attributes
    ----------
    levels : list of Level
        Levels that are complete.
    done : bool
        Whether the last one is.
    reached : bool
        Whether it ends at the limit. Otherwise no joint went beyond the threshold any more, or the probability is
        below `LEAST`.

    Examples
    --------
    How often is the sum of four standard normal numbers above 8, four standard deviations?

    >>> streams = [np.random.default_rng([1, level]) for level in range(9)]
    >>> walk = Walk(Settings(1000, 0.1, 8.0), lambda level, first, m: streams[level].standard_normal((m, 4)))
    >>> while not walk.done:
    ...     walk.take(walk.next.scores.sum(axis=1))
    >>> found = walk.estimate()
    >>> found.lower < 3.167e-5 < found.upper, len(walk.levels)
    (True, 5)
    """

    def __init__(self, settings: Settings, noise: Noise) -> None:
        self.settings, self._noise = settings, noise
        self.levels: list[Level] = []
        self.done = self.reached = False
        self._taken = self._simulated = self._accepted = 0
        self._threshold, self._step = -math.inf, math.nan
        self._start: _States | None = None
        self._parts: list[_States] = []
        self._sums: list[list[FloatArray]] = []
        self._variance = 0.0
        self.next = Candidates(0, noise(0, 0, settings.n), np.full(settings.n, -1))

    def take(self, loads: FloatArray) -> None:
        """Take the loads of the joints `next`, (m,), in the unit of the limit, and renew `next` unless all is done.

        Raises
        ------
        ValueError
            When they are not as many, one of them is NaN, or all is done.
        """
        loads = np.asarray(loads, dtype=float)
        if self.done or loads.shape != self.next.parent.shape or np.isnan(loads).any():
            raise ValueError(f"{loads.shape} loads, NaN among them or not, for {self.next.parent.shape} joints")
        numbers = self._taken + np.arange(loads.size)
        here = _States(self.next.scores, loads, numbers, np.arange(loads.size)[:, None])
        self._taken += loads.size
        self._simulated += loads.size
        if self._start is not None:
            before = self._start.part(slice(loads.size))
            moved = loads > self._threshold
            self._accepted += int(moved.sum())
            here = _States(
                np.where(moved[:, None], here.scores, before.scores),
                np.where(moved, loads, before.loads),
                np.where(moved, numbers, before.number),
                before.families,
            )
            self._start = here
        self._parts.append(here)
        if sum(part.loads.size for part in self._parts) == self.settings.n:
            self._finish_level()
        if not self.done:
            self.next = self._move()

    def _move(self) -> Candidates:
        assert self._start is not None
        first = sum(part.loads.size for part in self._parts)
        count = min(self._start.loads.size, self.settings.n - first)
        noise = self._noise(len(self.levels), self._simulated, count)
        scores = math.sqrt(1.0 - self._step**2) * self._start.scores[:count] + self._step * noise
        return Candidates(len(self.levels), scores, self._start.number[:count])

    def _finish_level(self) -> None:
        scores, loads, number, families = zip(*self._parts, strict=True)
        states = _States(*map(np.concatenate, (scores, loads, number, families)))
        n, limit = self.settings.n, self.settings.limit
        seeds = round(n * self.settings.p0)
        ordered = np.sort(states.loads)[::-1]
        middle = 0.5 * (ordered[seeds - 1] + ordered[seeds])
        # between infinite loads (joints without one) there is no middle
        threshold = min(limit, middle if math.isfinite(middle) else ordered[seeds])
        beyond = states.loads > threshold
        tried = self._simulated if self.levels else 0
        acceptance = self._accepted / tried if tried else math.nan
        share = float(beyond.mean())
        self._add_variance(beyond, share, states.families)
        own = math.sqrt(float((self._sums[-1][0] ** 2).sum()))
        self.levels.append(Level(self._threshold, share, own, self._simulated, acceptance, self._step))
        self.reached = threshold >= limit
        self.done = self.reached or self.probability < LEAST or threshold <= self._threshold
        if self.done:
            return
        step = FIRST_STEP if math.isnan(acceptance) else self._step * math.exp(acceptance - ACCEPTANCE)
        self._step, self._threshold = min(1.0, step), threshold
        self._simulated = self._accepted = 0
        kept = states.part(beyond)
        chains = np.arange(kept.loads.size)[:, None]
        self._start = kept._replace(families=np.hstack([chains, kept.families[:, :LAG]]))
        self._parts = [self._start]

    def _add_variance(self, beyond: NDArray[np.bool_], share: float, families: NDArray[np.intp]) -> None:
        """Add what a level does to the variance of the logarithm, related states together."""
        if not share:
            self._sums.append([np.array([math.inf])])
            return
        influence = (beyond - share) / (beyond.size * share)
        self._sums.append([np.bincount(family, influence).astype(float) for family in families.T])
        lag = families.shape[1] - 1
        own = self._sums[-1][lag]
        self._variance += float((own**2).sum())
        for back in range(1, lag + 1):
            related = self._sums[-1 - back][lag - back]
            most = min(related.size, own.size)  # the last chains may have no descendants
            self._variance += 2.0 * float((related[:most] * own[:most]).sum())
        self._variance = max(self._variance, 0.0)

    @property
    def probability(self) -> float:
        """Product of the shares of the levels so far."""
        return math.prod(level.share for level in self.levels)

    def estimate(self, confidence: float = 0.95) -> Estimate:
        """Estimate of the probability that a load is above the limit, from the levels that are complete.

        The logarithm's interval is Student's, with a degree of freedom for every `FAMILIES` seeds, about the logarithm
        and half its variance: the product is without bias, so its logarithm is low by that.
        """
        from scipy.special import stdtrit

        share = math.prod(level.share for level in self.levels if level.share)
        freedom = max(1.0, self.settings.n * self.settings.p0 / FAMILIES)
        half = float(stdtrit(freedom, 0.5 * (1.0 + confidence))) * math.sqrt(self._variance)
        lower, upper = (min(1.0, share * math.exp(0.5 * self._variance + sign * half)) for sign in (-1, 1))
        if not self.reached:
            return Estimate(math.nan, 0.0, upper, math.nan)
        if len(self.levels) == 1:  # independent joints
            n = self.settings.n
            lower, upper = (float(end) for end in clopper_pearson(round(share * n), n, confidence))
        return Estimate(share, lower, upper, math.sqrt(self._variance))
