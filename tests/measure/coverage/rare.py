"""Experiments on rare loads: subset simulation, and loads of joints that never repeat."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from scipy.stats import chi2, norm

from tests.measure.coverage.trial import Asked, Experiment, Found, Rng, found, fresh_share, laws
from tolstat.analysis.subset import Walk
from tolstat.common.loads import FloatArray
from tolstat.solver import stationary


def experiments() -> Iterator[Experiment]:
    """All of this file."""
    for name in _states():
        for share in (1e-3, 1e-6):
            for n in (300, 1000):
                yield _subset(name, share, n)
    for name in ("exponential", "normal", "uniform"):
        for revolutions in (16, 32, 64):
            yield _stationary(name, revolutions)


def _states() -> dict[str, tuple[int, Callable[[FloatArray], FloatArray], Callable[[float], float]]]:
    """Loads for subset simulation by name: number of errors, load, limit that a share of the joints exceeds."""
    return {
        "sum of 10 errors": (10, lambda z: z.sum(axis=1) / math.sqrt(10.0), lambda p: float(norm.isf(p))),
        "sum of 44 errors": (44, lambda z: z.sum(axis=1) / math.sqrt(44.0), lambda p: float(norm.isf(p))),
        "sphere, 10 errors": (10, lambda z: (z**2).sum(axis=1), lambda p: float(chi2.isf(p, 10))),
        "largest of 10 errors": (
            10,
            lambda z: z.max(axis=1),
            lambda p: float(norm.isf(-math.expm1(math.log1p(-p) / 10))),
        ),
    }


def _subset(name: str, share: float, n: int) -> Experiment:
    d, load, limit_of = _states()[name]
    limit = limit_of(share)

    def once(rng: Rng) -> list[Found]:
        walk = Walk(n, 0.1, limit, lambda level, first, m: rng.standard_normal((m, d)))
        while not walk.done:
            walk.take(load(walk.next.scores))
        own = walk.estimate()
        return [Found(own.lower, own.upper, share, walk.reached)]

    levels = math.ceil(-math.log10(share) - 1e-9)
    joints = round(n * (1 + 0.9 * (levels - 1)))
    return Experiment((Asked("rare share, subsets", f"{name}, {share:g}", n, fresh_share(joints, share)),), once)


def _stationary(name: str, revolutions: int, duration: int = 1000) -> Experiment:
    """Largest load of `duration` further revolutions, a random number itself: loads are 10 plus a law's."""
    law = laws()[name]

    def once(rng: Rng) -> list[Found]:
        own = stationary.largest(10.0 + law.draw(rng, revolutions)[:, None], duration)
        truth = 10.0 + float(law.draw(rng, duration).max())
        return found(own, [truth])

    return Experiment((Asked("load that never repeats", f"{name}, {duration} revolutions", revolutions),), once)
