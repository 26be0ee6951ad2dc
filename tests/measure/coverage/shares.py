"""Experiments on samples of each design: shares, quantiles, the band, the next delivery."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from tests.measure.coverage.trial import (
    NUMBERS,
    Asked,
    Experiment,
    Found,
    Law,
    Rng,
    fresh_share,
    laws,
    quantiles_at,
    sample_of,
    shares_at,
)
from tolstat.analysis import prediction
from tolstat.analysis.binomial import clopper_pearson, simultaneous
from tolstat.analysis.clustered import Clustered
from tolstat.analysis.sample import Sample, total_interval
from tolstat.common.loads import FloatArray

SHARES, QUANTILES = (0.5, 0.05, 0.002), (0.5, 0.9, 0.99)
JOINTS, DELIVERY = 20, 500
"""Joints of a lot, and of its next delivery."""
MOST_SEEDS = 400
"""Number of seeds of lots: one takes a tenth of a second."""


def experiments() -> Iterator[Experiment]:
    """All of this file."""
    known = laws()
    for name in ("normal", "lognormal", "uniform", "rounded"):
        for n in NUMBERS:
            yield _independent(known[name], n)
    for n in NUMBERS:
        yield _unresolved(known["lognormal"], n)
    for share in SHARES:
        for n in NUMBERS:
            yield _delivered(share, n)
    for lot in _LOTS:
        for share in (0.1, 0.02, 0.002):
            yield _of_lots(lot, share, 50)
        yield _of_lots(lot, 0.1, 30)


def _independent(law: Law, n: int) -> Experiment:
    levels = [float(law.ppf(1.0 - share)) + 0.01 for share in SHARES]
    asked = [Asked("share", f"{law.name}, {share:g}", n) for share in SHARES]
    asked += [Asked("quantile", f"{law.name}, {100 * share:g} %", n) for share in QUANTILES]
    asked += [Asked("band", law.name, n), Asked("band at random levels", law.name, n)]
    shares = {level: float(law.sf(level)) for level in levels}
    loads = {share: float(law.ppf(share)) for share in QUANTILES}

    def once(rng: Rng) -> list[Found]:
        sample = sample_of(law.draw(rng, n))
        level = float(law.draw(rng, 1)[0])
        at_random = shares_at(sample, {level: float(law.sf(level))})
        return [*shares_at(sample, shares), *quantiles_at(sample, loads), _band(law, sample.valid), *at_random]

    return Experiment(tuple(asked), once)


def _band(law: Law, valid: FloatArray) -> Found:
    """Interval of the largest difference of the truth from the estimate, on each side: it contains zero or not."""
    n, half = valid.size, simultaneous(valid.size)
    at, number = np.unique(valid, return_counts=True)
    above = n - np.cumsum(number)
    truth, just_before = law.sf(at), law.sf(np.nextafter(at, -np.inf))
    over = float((above / n - truth).max(initial=0.0))
    under = float((just_before - (above + number) / n).max(initial=0.0))
    # the band is above the truth where the estimate less the half width is
    return Found(over - half, half - under, 0.0)


def _unresolved(law: Law, n: int) -> Experiment:
    """One in a hundred joints has no valid load, of those above the limit one in two."""
    level = float(law.ppf(0.95))

    def once(rng: Rng) -> list[Found]:
        loads = law.draw(rng, n)
        lost = rng.random(n) < np.where(loads > level, 0.5, 0.01)
        return [Found(*total_interval([sample_of(np.where(lost, np.nan, loads))], level, 0.95), 0.05)]

    return Experiment((Asked("share, joints without a load", f"{law.name}, 0.05, half of those above lost", n),), once)


def _delivered(share: float, n: int) -> Experiment:
    """Joints above a limit in the next delivery, a random number itself."""
    number = prediction.DELIVERY
    case = f"any law, {share:g}, {number} joints delivered"
    half = prediction.half(0.95)

    def once(rng: Rng) -> list[Found]:
        above, truth = int(rng.binomial(n, share)), float(rng.binomial(number, share))
        low, high = clopper_pearson(above, n, half)
        of_share = prediction.of_share(float(low), float(high), number)
        ends = sample_of(np.arange(n) < above).delivery(0.5, number), of_share
        return [Found(*each, truth) for each in ends]

    return Experiment((Asked("next delivery", case, n), Asked("next delivery, from a share", case, n)), once)


def _of_normal(case: str, n: int, share: float) -> tuple[list[Asked], Callable[[Sample], list[Found]]]:
    """Share above a level, and load that the other joints stay at or below, of standard normal loads of lots."""
    law, level = laws()["normal"], float(norm.isf(share))
    asked = [
        Asked("share, lots", case, n, fresh_share(n, share)),
        Asked("quantile, lots", case, n, law.fresh_quantile(n, 1.0 - share)),
    ]
    return asked, lambda sample: [*shares_at(sample, {level: share}), *quantiles_at(sample, {1.0 - share: level})]


class _Lots(NamedTuple):
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


_LOTS = (
    _Lots("normal, 30 % between lots", _scores(0.3)),
    _Lots("normal, lots alike", _scores(0.0)),
    _Lots("beta, correlation 0.2", _beta(0.2)),
)


def _of_lots(law: _Lots, share: float, number: int) -> Experiment:
    level, n = float(norm.isf(share)), number * JOINTS
    case = f"{law.name}, {share:g}, {number} lots"
    asked, judged = _of_normal(case, n, share)
    design = Clustered(np.arange(n) // JOINTS)

    def once(rng: Rng) -> list[Found]:
        sample = sample_of(law.draw(rng, number, JOINTS, share).ravel(), design)
        ends = sample.delivery(level, DELIVERY)
        truth = float((law.draw(rng, 1, DELIVERY, share) > level).sum())
        return [*judged(sample), Found(*ends, truth)]

    return Experiment((*asked, Asked("next delivery, lots", case, n)), once, MOST_SEEDS)
