"""Subset simulation: a small probability as a product of larger conditional ones, level by level.

Au and Beck (2001). The joints of level 0 are drawn from the tolerances. The share p0 of them with the largest loads are
the seeds of level 1: Markov chains started from them sample the tolerances conditional on a load beyond the threshold,
which all seeds exceed. The largest loads of level 1 are the next seeds, and so on until the threshold reaches the
limit. A chain moves in the space of the independent standard normal scores of the errors: it proposes
sqrt(1 - s^2) z + s xi, which preserves the normal distribution, and stays at z if the load of the proposal is not
beyond the threshold (conditional sampling: Papaioannou, Betz, Zwirglmaier and Straub 2015). The step s is the same for
a whole level and is adapted to the acceptance of the level before, so that no chain's path affects its own transitions.

The variance of the logarithm of the product is estimated from the influence of each state on its level's share. States
of one family (descendants of one chain two levels before) are dependent, families are independent: the variance is that
of the families' sums, including covariances of levels up to `LAG` apart (fixed lag: Olsson and Douc 2019). A region of
large loads that contains no seed is not found, and the variance does not show it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.binomial import clopper_pearson, half_width
from tolstat.common.loads import FloatArray

FIRST_STEP = 0.6
"""Step of level 1 (Papaioannou et al. 2015)."""
ACCEPTANCE = 0.44
"""Target share of accepted moves (same source)."""
LAG = 2
"""Number of levels back that families reach: with more, too few families are left to estimate a variance."""
FAMILIES = 5
"""Seeds per degree of freedom of the variance: from its scatter, measured over seeds (docs/notes/coverage.md)."""
LEAST = 1e-12
"""Probability below which no further level starts: normal scores reach the end of double precision not far from it."""


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
    """Statistics of a completed level.

    Attributes
    ----------
    threshold : float
        Load that all its joints exceed; -inf at level 0.
    share : float
        Share of them beyond the next threshold, or beyond the limit at the last level.
    deviation : float
        Coefficient of variation of `share`, with the dependence of joints within a chain.
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
    """Estimated probability of a load above the limit.

    Attributes
    ----------
    probability, lower, upper : float
        Unbiased estimate and its interval. If the limit was not reached: NaN, 0 and an upper bound.
    deviation : float
        Coefficient of variation, with the dependence within chains and families; NaN if the limit was not reached.
    """

    probability: float
    lower: float
    upper: float
    deviation: float


class _States(NamedTuple):
    """States of a level, in the order of their chains' steps.

    `families`, (n, 1 to 1 + LAG): numbers of the chains that a state descends from at this level, the one before, ...;
    `first`: number of the joint of level 0 that it descends from.
    """

    scores: FloatArray
    loads: FloatArray
    number: NDArray[np.intp]
    families: NDArray[np.intp]
    first: NDArray[np.intp]

    def part(self, rows: slice | NDArray[np.bool_]) -> _States:
        """Some of the states."""
        return _States._make(field[rows] for field in self)


class Walk:
    """State of a subset simulation: it provides the joints to simulate next, and takes their loads.

    The joints depend on these numbers, the noise and the loads taken so far only. To resume a simulation, take its
    stored loads again.

    Parameters
    ----------
    n : int
        Joints a level.
    p0 : float
        Share of them that seeds the next level; ``n * p0`` is a whole number.
    limit : float
        Load whose exceedance is estimated, in the unit of the loads.
    noise : callable
        (level, first, m) -> independent standard normal numbers, (m, d): rows `first` and following of the level.

    Attributes
    ----------
    levels : list of Level
        Levels that are complete.
    done : bool
        Whether the last level is complete.
    reached : bool
        Whether the last level ends at the limit. Otherwise the threshold did not rise any more, or the probability is
        below `LEAST`.
    last : ndarray of int, shape (n,)
        Numbers of the joints that are the states of the last complete level; a joint can be several.
    ancestors : int
        Number of joints of level 0 that those of them beyond the last threshold descend from.

    Examples
    --------
    How often is the sum of four standard normal numbers above 8, four standard deviations?

    >>> streams = [np.random.default_rng([1, level]) for level in range(9)]
    >>> walk = Walk(1000, 0.1, 8.0, lambda level, first, m: streams[level].standard_normal((m, 4)))
    >>> while not walk.done:
    ...     walk.take(walk.next.scores.sum(axis=1))
    >>> found = walk.estimate()
    >>> found.lower < 3.167e-5 < found.upper, len(walk.levels)
    (True, 5)
    """

    def __init__(self, n: int, p0: float, limit: float, noise: Callable[[int, int, int], FloatArray]) -> None:
        self.n, self.seeds, self.limit, self._noise = n, round(n * p0), limit, noise
        self.levels: list[Level] = []
        self.done = self.reached = False
        self._taken = self._simulated = self._accepted = 0
        self._threshold, self._step = -math.inf, math.nan
        self._start: _States | None = None
        self._parts: list[_States] = []
        self._sums: list[list[FloatArray]] = []
        self._variance = 0.0
        self.last, self.ancestors = np.empty(0, np.intp), 0
        self.next = Candidates(0, noise(0, 0, n), np.full(n, -1))

    def take(self, loads: FloatArray) -> None:
        """Take the loads of the joints `next`, (m,), in the unit of the limit, not NaN; update `next` unless `done`."""
        numbers = self._taken + np.arange(loads.size)
        here = _States(self.next.scores, loads, numbers, np.arange(loads.size)[:, None], numbers)
        self._taken += loads.size
        self._simulated += loads.size
        if self._start is not None:
            before = self._start.part(slice(loads.size))
            moved = loads > self._threshold
            self._accepted += int(moved.sum())
            scores = np.where(moved[:, None], here.scores, before.scores)
            loads, numbers = np.where(moved, loads, before.loads), np.where(moved, numbers, before.number)
            self._start = here = before._replace(scores=scores, loads=loads, number=numbers)
        self._parts.append(here)
        if sum(part.loads.size for part in self._parts) == self.n:
            self._finish_level()
        if not self.done:
            assert self._start is not None
            first = sum(part.loads.size for part in self._parts)
            start = self._start.part(slice(self.n - first))
            noise = self._noise(len(self.levels), self._simulated, start.loads.size)
            scores = math.sqrt(1.0 - self._step**2) * start.scores + self._step * noise
            self.next = Candidates(len(self.levels), scores, start.number)

    def _finish_level(self) -> None:
        states = _States(*map(np.concatenate, zip(*self._parts, strict=True)))
        ordered = np.sort(states.loads)[::-1]
        middle = 0.5 * (ordered[self.seeds - 1] + ordered[self.seeds])
        # infinite loads (joints without a valid one) have no midpoint
        threshold = min(self.limit, middle if math.isfinite(middle) else ordered[self.seeds])
        beyond = states.loads > threshold
        self.last, self.ancestors = states.number, int(np.unique(states.first[beyond]).size)
        tried = self._simulated if self.levels else 0
        acceptance = self._accepted / tried if tried else math.nan
        share = float(beyond.mean())
        self._add_variance(beyond, share, states.families)
        error = math.sqrt(float((self._sums[-1][0] ** 2).sum()))
        self.levels.append(Level(self._threshold, share, error, self._simulated, acceptance, self._step))
        self.reached = threshold >= self.limit
        self.done = self.reached or self.probability < LEAST or threshold <= self._threshold
        if self.done:
            return
        step = FIRST_STEP if math.isnan(acceptance) else self._step * math.exp(acceptance - ACCEPTANCE)
        self._step, self._threshold = min(1.0, step), threshold
        self._simulated = self._accepted = 0
        seeds = states.part(beyond)
        chains = np.arange(seeds.loads.size)[:, None]
        self._start = seeds._replace(families=np.hstack([chains, seeds.families[:, :LAG]]))
        self._parts = [self._start]

    def _add_variance(self, beyond: NDArray[np.bool_], share: float, families: NDArray[np.intp]) -> None:
        """Add a level's part of the variance of the logarithm, with covariances within families."""
        if not share:
            self._sums.append([np.array([math.inf])])
            return
        influence = (beyond - share) / (beyond.size * share)
        self._sums.append([np.bincount(family, influence).astype(float) for family in families.T])
        lag = families.shape[1] - 1
        influence_of_chains = self._sums[-1][lag]
        self._variance += float((influence_of_chains**2).sum())
        for back in range(1, lag + 1):
            related = self._sums[-1 - back][lag - back]
            most = min(related.size, influence_of_chains.size)  # the last chains may have no descendants
            self._variance += 2.0 * float((related[:most] * influence_of_chains[:most]).sum())
        self._variance = max(self._variance, 0.0)

    @property
    def probability(self) -> float:
        """Product of the shares of the levels so far."""
        return math.prod(level.share for level in self.levels)

    def estimate(self, confidence: float = 0.95) -> Estimate:
        """Estimate of the probability that a load is above the limit, from the levels that are complete.

        The interval is Student's on the logarithm, with one degree of freedom per `FAMILIES` seeds, centred at the
        logarithm plus half its variance: the product is unbiased, so its logarithm is biased low by that much.
        """
        share = math.prod(level.share for level in self.levels if level.share)
        freedom = max(1.0, self.seeds / FAMILIES)
        half = float(half_width(confidence, freedom)) * math.sqrt(self._variance)
        lower, upper = (min(1.0, share * math.exp(0.5 * self._variance + sign * half)) for sign in (-1, 1))
        if not self.reached:
            return Estimate(math.nan, 0.0, upper, math.nan)
        if len(self.levels) == 1:  # independent joints
            ends = clopper_pearson(round(share * self.n), self.n, confidence)
            lower, upper = (float(end) for end in ends)
        return Estimate(share, lower, upper, math.sqrt(self._variance))
