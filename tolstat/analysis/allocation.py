"""Tolerance allocation: the cheapest steps of tolerances that keep loads below limits, searched on the same joints.

A design has one step for each line of a drawing, counted from its finest tolerance. Designs are compared joint by
joint. A choice among many designs by the same joints is optimistic, so `allocate` judges it by joints that the search
has not seen, at a level that holds for all looks at these.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.binomial import clopper_pearson
from tolstat.common.late import special
from tolstat.common.loads import FloatArray

EXACT = -1
"""Step of a line without any error."""
MEASURABLE = 0.05
"""Level of the test (McNemar 1947) of whether a step changes the share of joints above a limit."""
ROUNDS, LOOKS = 3, 4
"""Number of designs that are checked at most, and of looks at each, every one at twice as many joints."""
LOOK_CONFIDENCE = 1.0 - 0.05 / (ROUNDS * LOOKS)
"""Confidence of an interval at a look: all of them hold together with 95 %."""
POWER = 1.28
"""Standard deviations below the target that the search aims at, so that nine checks in ten confirm it."""

Design = tuple[int, ...]
Mask = NDArray[np.bool_]
Above = Callable[[Sequence[Design]], "list[Mask] | None"]


class Unknown(Exception):
    """Designs whose joints are not simulated."""


class Problem(NamedTuple):
    """What is searched.

    Attributes
    ----------
    costs : sequence of ndarray
        Cost of each line at each of its steps, from the finest to the coarsest.
    drawn : tuple of int
        Steps as drawn.
    above : callable
        Maps designs to which of the same joints are above each limit, (n, c) each; None where that is not known.
    targets : ndarray, shape (c,)
        Shares that must not be exceeded.
    aims : ndarray, shape (c,)
        Shares that the search goes below, see `aim`.
    """

    costs: Sequence[FloatArray]
    drawn: Design
    above: Above
    targets: FloatArray
    aims: FloatArray

    def cost(self, design: Design) -> float:
        """Cost of all lines; infinite for an exact one."""
        return float(sum(np.inf if i == EXACT else c[i] for c, i in zip(self.costs, design, strict=True)))

    def events(self, *designs: Design) -> list[Mask]:
        """Which joints of each design are above each limit.

        Raises
        ------
        Unknown
            When that is not known.
        """
        found = self.above(designs) if designs else []
        if found is None:
            raise Unknown
        return found

    def meets(self, above: Mask) -> bool:
        """Whether the shares do not exceed the aims."""
        return bool((above.mean(axis=0) <= self.aims).all())


class Step(NamedTuple):
    """A step of a search.

    Attributes
    ----------
    what : str
        ``as drawn``, ``all exact``, ``narrower``, ``wider``.
    line : int
        Number of the line that changes; -1 for none.
    design : tuple of int
        The design after it.
    cost : float
        Its cost.
    above : ndarray of bool, shape (n, c)
        Which joints of the search are above each limit.
    """

    what: str
    line: int
    design: Design
    cost: float
    above: Mask


class Search:
    """Search for the cheapest design that meets the targets.

    First lines become narrower, each time by the step with the best gain in share per cost, then wider where that costs
    no share that can be measured, then, one step at a time, wherever the aims are still met. A line whose exact case
    changes nothing is not made narrower unless all others are at their finest step.

    Attributes
    ----------
    path : list of Step
        Steps so far.
    state : str
        ``found``; ``impossible``, where even exact lines exceed a target; ``exhausted``, where all lines have their
        finest step; ``open`` where designs are not simulated yet.
    active : list of int
        Lines whose exact case changes a share.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem, self.path, self.active, self.state = problem, list[Step](), list[int](), "open"
        with suppress(Unknown):
            self.state = self._run()

    @property
    def design(self) -> Design:
        """The design of the last step that has no exact line."""
        return next(step.design for step in reversed(self.path) if EXACT not in step.design)

    @property
    def above(self) -> Mask:
        """Which joints of that design are above each limit."""
        return next(step.above for step in reversed(self.path) if EXACT not in step.design)

    def narrow(self) -> bool:
        """Take the step that gains most share per cost; returns whether there is one."""
        problem, design = self.problem, self.design
        able = [i for i, step in enumerate(design) if step > 0]
        able = [i for i in able if i in self.active] or able
        steps = [_moved(design, i, design[i] - 1) for i in able]
        masks = problem.events(*steps)
        if not steps:
            return False
        cost = problem.cost(design)
        gains = [self._height(self.above) - self._height(mask) for mask in masks]
        rates = [gain / max(problem.cost(step) - cost, 1e-12) for gain, step in zip(gains, steps, strict=True)]
        best = int(np.argmax(rates))
        self._add("narrower", able[best], steps[best], masks[best])
        return True

    def _run(self) -> str:
        problem, drawn = self.problem, self.problem.drawn
        (above,) = problem.events(drawn)
        self._add("as drawn", -1, drawn, above)
        if not problem.meets(above):
            exact = (EXACT,) * len(drawn)
            (least,) = problem.events(exact)
            self._add("all exact", -1, exact, least)
            lower, _ = clopper_pearson(least.sum(axis=0), len(least), LOOK_CONFIDENCE)
            if (lower > problem.targets).any():
                return "impossible"
            alone = problem.events(*(_moved(drawn, i, EXACT) for i in range(len(drawn))))
            self.active = [i for i, mask in enumerate(alone) if differ(above, mask)]
            while not problem.meets(self.above):
                if not self.narrow():
                    return "exhausted"
        for i in (i for i in range(len(drawn)) if i not in self.active):
            self._widen_for_nothing(i)
        self._widen()
        return "found"

    def _widen_for_nothing(self, i: int) -> None:
        """Widen a line as far as the aims are met, and the shares do not measurably rise."""
        design, before = self.design, self.above
        found: tuple[int, Mask] | None = None
        low, high = design[i], len(self.problem.costs[i]) - 1
        middle = high  # often the coarsest step is as good
        while low < high:
            (above,) = self.problem.events(_moved(design, i, middle))
            if self.problem.meets(above) and not differ(above, before):
                low, found = middle, (middle, above)
            else:
                high = middle - 1
            middle = (low + high + 1) // 2
        if found is not None:
            self._add("wider", i, _moved(design, i, found[0]), found[1])

    def _widen(self) -> None:
        """Widen lines one step at a time while the aims are met, first the one that saves most per share.

        What a step costs in share is taken from the last step of its line: a step is simulated when its turn comes.
        """
        problem, least = self.problem, 1.0 / len(self.above)
        able = [i for i, step in enumerate(self.design) if step + 1 < len(problem.costs[i])]
        masks = problem.events(*(_moved(self.design, i, self.design[i] + 1) for i in able))
        now = self._height(self.above)
        losses = {i: self._height(mask) - now for i, mask in zip(able, masks, strict=True) if problem.meets(mask)}
        while losses:
            design, now = self.design, self._height(self.above)
            savings = {i: problem.costs[i][design[i]] - problem.costs[i][design[i] + 1] for i in losses}
            best = max(losses, key=lambda i: savings[i] / max(losses[i], least))
            step = _moved(design, best, design[best] + 1)
            (mask,) = problem.events(step)
            losses[best] = self._height(mask) - now
            if problem.meets(mask):
                self._add("wider", best, step, mask)
            if not problem.meets(mask) or step[best] + 1 == len(problem.costs[best]):
                del losses[best]  # a line that is too wide stays so as others become wider

    def _height(self, above: Mask) -> float:
        """Sum of the shares above the limits, relative to their targets."""
        return float((above.mean(axis=0) / self.problem.targets).sum())

    def _add(self, what: str, line: int, design: Design, above: Mask) -> None:
        self.path.append(Step(what, line, design, self.problem.cost(design), above))


def _moved(design: Design, line: int, step: int) -> Design:
    return (*design[:line], step, *design[line + 1 :])


def differ(a: Mask, b: Mask) -> bool:
    """Whether more joints are above some limit in `a` than in `b`, (n, c), measurably, by McNemar's exact test."""
    only_a, only_b = (a & ~b).sum(axis=0), (b & ~a).sum(axis=0)
    # as many or more of the joints above on one side only are above in a
    p = special.bdtr(only_b + 0.0, np.maximum(only_a + only_b, 1), 0.5)
    return bool(((p < MEASURABLE) & (only_a > only_b)).any())


def sizes(targets: FloatArray, most: int) -> list[int]:
    """Numbers of joints of a search and of the looks of a check, each twice the one before; the first is the search's.

    A share as large as the least target has 40 joints above the limit at the first.
    """
    first = min(max(1024, 2 ** int(np.ceil(np.log2(40.0 / float(np.min(targets)))))), most)
    return list(dict.fromkeys(min(first * 2**k, most) for k in range(LOOKS)))


def aim(target: float, n: int) -> float:
    """Share whose check by `n` joints confirms the target nine times in ten."""
    counts = np.arange(0, int(target * n) + 1)
    _, upper = clopper_pearson(np.ceil(counts + POWER * np.sqrt(counts)), n, LOOK_CONFIDENCE)
    enough = np.flatnonzero(upper < target)
    return float(counts[enough[-1]]) / n if enough.size and enough[-1] > 0 else 0.5 / n


class Look(NamedTuple):
    """A look at the joints of a check.

    Attributes
    ----------
    after : int
        Number of steps of the search at the design that is checked.
    n : int
        Number of joints.
    share, lower, upper : ndarray, shape (c,)
        Shares above the limits, with intervals that hold together for all looks.
    state : str
        ``holds``, ``misses``, or ``open``.
    """

    after: int
    n: int
    share: FloatArray
    lower: FloatArray
    upper: FloatArray
    state: str


class Outcome(NamedTuple):
    """Result of search and check.

    Attributes
    ----------
    search : Search
        The search, with the steps that failed checks have asked for.
    looks : list of Look
        All looks.
    state : str
        ``impossible``; ``holds``, ``misses`` or ``open``, of the last look; ``open``, too, where joints are missing.
    """

    search: Search
    looks: list[Look]
    state: str


def allocate(problem: Problem, fresh: Callable[[Design, int, int], Mask | None], looks: Sequence[int]) -> Outcome:
    """Search, then check the design by joints that the search has not seen, and narrow it where that fails.

    Parameters
    ----------
    problem : Problem
        What is searched.
    fresh : callable
        Design, number of the round, number of joints -> which of these are above each limit, (n, c); other joints in
        each round, none of them those of the search. None where that is not known.
    looks : sequence of int
        Numbers of joints of the looks of a round, at most `LOOKS`. A round ends where the interval of a look lies on
        one side of the targets; there are at most `ROUNDS`.
    """
    search, taken = Search(problem), list[Look]()
    state = "open" if search.state in ("found", "exhausted") else search.state
    with suppress(Unknown):
        for number in range(ROUNDS if state == "open" and search.state != "open" else 0):
            for n in looks:
                mask = fresh(search.design, number, n)
                if mask is None:
                    return Outcome(search, taken, "open")
                count = mask.sum(axis=0)
                lower, upper = clopper_pearson(count, n, LOOK_CONFIDENCE)
                is_below, is_above = (upper < problem.targets).all(), (lower > problem.targets).any()
                state = "holds" if is_below else "misses" if is_above else "open"
                taken.append(Look(len(search.path), n, count / n, lower, upper, state))
                if state != "open":
                    break
            if state == "holds" or number + 1 == ROUNDS or not search.narrow():
                break
    return Outcome(search, taken, state)
