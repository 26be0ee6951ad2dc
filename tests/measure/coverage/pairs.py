"""Experiments on two sides: comparison, what if."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr

from tests.measure.coverage.trial import NUMBERS, Asked, Experiment, Found, Law, Rng, found, laws, sample_of
from tolstat.analysis import difference
from tolstat.analysis.design import Independent
from tolstat.common.loads import FloatArray
from tolstat.questions import change
from tolstat.questions.shares import ChangedJoints


class Two(NamedTuple):
    """Two loads whose normal scores are correlated by `rho`; B is `to_b` of a load of the law, `from_b` its inverse."""

    name: str
    law: Law
    to_b: Callable[[FloatArray], FloatArray]
    from_b: Callable[[float], float]
    rho: float

    def draw(self, rng: Rng, n: int) -> tuple[FloatArray, FloatArray]:
        """Loads A and B of n joints."""
        z, own = rng.standard_normal((2, n))
        other = self.rho * z + np.sqrt(1.0 - self.rho**2) * own
        return np.asarray(self.law.ppf(ndtr(z))), self.to_b(np.asarray(self.law.ppf(ndtr(other))))

    def share_of_b(self, level: float) -> float:
        """Share of B above a level."""
        return float(self.law.sf(self.from_b(level)))

    def added(self, shares: ArrayLike) -> FloatArray:
        """Quantiles of B less those of A."""
        of_a = np.asarray(self.law.ppf(shares), dtype=float)
        return np.asarray(self.to_b(of_a) - of_a)


def sides(rho: float) -> list[Two]:
    """Loads to compare: B is larger by a factor, is shifted, is bent."""
    known = laws()
    return [
        Two("normal, moved by 0.2", known["normal"], lambda a: a + 0.2, lambda b: b - 0.2, rho),
        Two("lognormal, 1.2 times", known["lognormal"], lambda a: 1.2 * a, lambda b: b / 1.2, rho),
        Two("uniform, squared", known["uniform"], np.square, np.sqrt, rho),
    ]


def experiments() -> Iterator[Experiment]:
    """All of this file."""
    for rho in (0.9, 0.999, 0.0):
        for two in sides(rho):
            for n in NUMBERS:
                yield _compared(two, n, paired=rho > 0)
    for rho in (0.9, 0.99):
        for two in sides(rho):
            for n in NUMBERS:
                yield _with_lost(two, n)
    normal = laws()["normal"]
    little = Two("normal, moved by 0.02", normal, lambda a: a + 0.02, lambda b: b - 0.02, 0.99)
    none = Two("normal, not moved", normal, lambda a: a, lambda b: b, 0.99)
    for two in (*sides(0.99), little, none):
        yield _at_a_stop(two)


def _compared(two: Two, n: int, paired: bool) -> Experiment:
    how = f"pairs correlated by {two.rho:g}" if paired else "not paired"
    levels = [float(two.law.ppf(1.0 - share)) for share in (0.5, 0.05)]
    name = f"{two.name}, {how}"
    asked = [Asked("difference of shares", f"{name}, {share:g}", n) for share in (0.5, 0.05)]
    asked += [Asked("difference of quantiles", f"{name}, {share} %", n) for share in (50, 90)]
    of_shares = [two.share_of_b(level) - float(two.law.sf(level)) for level in levels]
    of_quantiles = {share: float(two.added(share)) for share in (0.5, 0.9)}

    def once(rng: Rng) -> list[Found]:
        a, b = (sample_of(side) for side in two.draw(rng, n))
        own = found(difference.shares(a, b, levels, paired), of_shares)
        for share, truth in of_quantiles.items():
            own += found(difference.quantiles(a, b, share, paired), [truth])
        return own

    return Experiment(tuple(asked), once)


def _with_lost(two: Two, n: int) -> Experiment:
    """What if: change of a share; two of a hundred joints have no valid load, of those above the limit one in ten."""
    level = float(two.law.ppf(0.95))
    truth = two.share_of_b(level) - 0.05

    def once(rng: Rng) -> list[Found]:
        a, b = (
            sample_of(np.where(rng.random(n) < np.where(side > level, 0.1, 0.02), np.nan, side))
            for side in two.draw(rng, n)
        )
        own = difference.shares(a, b, [level], paired=True)
        return [Found(float(own.outer_lower[0]), float(own.outer_upper[0]), truth)]

    case = f"{two.name}, pairs correlated by {two.rho:g}, some lost"
    return Experiment((Asked("change of a share, what if", case, n),), once)


class _Joints(ChangedJoints):
    """Loads as drawn, and a level, without a campaign."""

    def __init__(self, base: FloatArray, level: float) -> None:
        self.base, self.level, self.design = base, level, Independent()


def _at_a_stop(two: Two) -> Experiment:
    """A change, with twice as many joints until it is settled: the interval that is shown then."""
    level = float(two.law.ppf(0.95))
    truth = two.share_of_b(level) - 0.05
    confidence = 1.0 - 0.05 / (1 + np.log2(change.MOST / change.FIRST))

    def once(rng: Rng) -> list[Found]:
        a, b = two.draw(rng, change.MOST)
        joints, n = _Joints(a, level), change.FIRST
        while n < change.MOST and not change._is_settled(joints, b[:n], np.nan, confidence):
            n *= 2
        _, low, high = joints.difference(a, b[:n])
        return [Found(low, high, truth)]

    case = f"{two.name}, pairs correlated by {two.rho:g}"
    return Experiment((Asked("change of a share, at a stop", case, change.MOST),), once)
