"""Experiments on joints that share lots: share, quantile, next delivery."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from tolstat.analysis import lots, sorted_loads
from tolstat.analysis.exceedance import FloatArray
from tolstat.benchmarks.coverage.laws import fresh_share, laws
from tolstat.benchmarks.coverage.shares import ok
from tolstat.benchmarks.coverage.trial import Asked, Experiment, Found

Rng = np.random.Generator
JOINTS, DELIVERY = 20, 500
"""Joints of a lot, and of the next delivery."""


class _Law(NamedTuple):
    """Standard normal loads of joints, by lot: `draw` takes a generator, lots, joints of each and the share above."""

    name: str
    draw: Callable[[Rng, int, int, float], FloatArray]


def _scores(between: float) -> Callable[[Rng, int, int, float], FloatArray]:
    """Normal load, of whose variance a share is between lots."""

    def draw(rng: Rng, number: int, joints: int, share: float) -> FloatArray:
        own = np.sqrt(1.0 - between) * rng.standard_normal((number, joints))
        return np.asarray(np.sqrt(between) * rng.standard_normal((number, 1)) + own)

    return draw


def _beta(correlation: float) -> Callable[[Rng, int, int, float], FloatArray]:
    """Share of a lot above the limit is a beta variate; above and below, loads are those of a normal law."""

    def draw(rng: Rng, number: int, joints: int, share: float) -> FloatArray:
        size = (1.0 - correlation) / correlation
        of_lot = rng.beta(share * size, (1.0 - share) * size, (number, 1))
        above, u = rng.random((number, joints)) < of_lot, rng.random((number, joints))
        return np.asarray(norm.isf(np.where(above, share * u, share + (1.0 - share) * u)))

    return draw


_LAWS = (
    _Law("normal, 30 % between lots", _scores(0.3)),
    _Law("normal, lots alike", _scores(0.0)),
    _Law("beta, correlation 0.2", _beta(0.2)),
)


def experiments() -> Iterator[Experiment]:
    """All of this file."""
    for law in _LAWS:
        for share in (0.5, 0.1, 0.02, 0.002):
            yield _of_lots(law, share, 50)
        yield _of_lots(law, 0.1, 30)


def _of_lots(law: _Law, share: float, number: int) -> Experiment:
    level, n = float(norm.isf(share)), number * JOINTS
    case = f"{law.name}, {share:g}, {number} lots"
    asked = (
        Asked("share, lots", case, n, fresh_share(n, share)),
        Asked("quantile, lots", case, n, laws()["normal"].fresh_quantile(n, 1.0 - share)),
        Asked("next delivery, lots", case, n),
    )

    def once(rng: Rng) -> list[Found]:
        loads = law.draw(rng, number, JOINTS, share)
        parts = [sorted_loads.sort_out(own, ok(JOINTS)) for own in loads]
        whole = sorted_loads.sort_out(loads.ravel(), ok(n))
        row, middle = lots.curve_of(whole, parts, [level])[0], lots.quantile_of(whole, parts, 1.0 - share)
        counts = (loads > level).sum(axis=1)
        ends = lots.law_of(counts, np.full(number, JOINTS)).delivery(DELIVERY).ends()
        truth = float((law.draw(rng, 1, DELIVERY, share) > level).sum())
        return [Found(row["lower"], row["upper"], share), Found(middle.lower, middle.upper, level), Found(*ends, truth)]

    return Experiment(asked, once)
