"""Experiments on what is computed from independent joints, or measured parts: capability, damage, failures, stops."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from tests.measure.coverage.causes import SLOPES
from tests.measure.coverage.trial import (
    NUMBERS,
    Asked,
    Experiment,
    Found,
    Law,
    Rng,
    found,
    fresh_share,
    laws,
    quantiles_at,
    sample_of,
    shares_at,
)
from tolstat.analysis import binomial, capability, cycles, measured, sensitivity, strength
from tolstat.analysis.design import Looked
from tolstat.common.loads import FloatArray


def experiments() -> Iterator[Experiment]:
    """All of this file."""
    known = laws()
    for name in ("normal", "slightly skew", "exponential", "lognormal", "uniform"):
        for n in (*NUMBERS, 4000):
            yield _capability(known[name], n)
    for exponent in (3.0, 5.0, 10.0):
        for n in NUMBERS:
            yield _equivalent(exponent, n)
    for n in NUMBERS:
        for part in _PARTS:
            yield _failed(part, n)
    for share in (0.5, 0.05, 0.002):
        yield _until(share)
    for parts in (5, 10, 50):
        yield _process(parts)


def _capability(law: Law, n: int) -> Experiment:
    limit = float(law.ppf(0.999))
    middle, high = (float(law.ppf(share)) for share in (0.5, capability.REFERENCE))
    truth = (limit - middle) / (high - middle)
    asked = (
        Asked("Ppk", f"{law.name}, limit at 99.9 %", n),
        Asked("yield and ppm", f"{law.name}, limit at 99.9 %", n),
    )

    def once(rng: Rng) -> list[Found]:
        own = capability.of_sample(sample_of(law.draw(rng, n)), limit)
        lower, upper = 1e6 * own.above.outer_lower, 1e6 * own.above.outer_upper
        return [Found(own.ppk.lower, own.ppk.upper, truth), Found(lower, upper, 1e3)]

    return Experiment(asked, once)


def _equivalent(exponent: float, n: int) -> Experiment:
    """Two cycles a revolution, whose ranges are lognormal with one factor in common."""
    known, factor = laws()["lognormal"], (1.0 + 0.5**exponent) ** (1.0 / exponent)

    def once(rng: Rng) -> list[Found]:
        ranges = known.draw(rng, n)[:, None, None] * np.array([1.0, 0.5])
        counted = cycles.Cycles.of_revolution(("cross1.F",), ranges, ranges, np.full((n, 1), 2.0))
        sample = sample_of(cycles.equivalent_load(counted, exponent)[:, 0])
        return quantiles_at(sample, {share: factor * float(known.ppf(share)) for share in (0.5, 0.9)})

    cases = (f"lognormal ranges, exponent {exponent:g}, {share}" for share in ("50 %", "90 %"))
    return Experiment(tuple(Asked("equivalent load", case, n) for case in cases), once)


class _Part(NamedTuple):
    """A law of numbers between 0 and 1."""

    name: str
    draw: Callable[[Rng, int], FloatArray]
    mean: float


_PARTS = (
    _Part("beta (1, 20)", lambda rng, n: rng.beta(1.0, 20.0, n), 1.0 / 21.0),
    _Part("beta (2, 2)", lambda rng, n: rng.beta(2.0, 2.0, n), 0.5),
    _Part("zero but in 1 of 10", lambda rng, n: np.where(rng.random(n) < 0.1, rng.random(n), 0.0), 0.05),
    _Part(
        "zero but in 1 of 200", lambda rng, n: np.where(rng.random(n) < 0.005, 1.0 - 0.5 * rng.random(n), 0.0), 0.00375
    ),
)


def _failed(part: _Part, n: int) -> Experiment:
    """Share of the parts that fail, from probabilities of failure by joint."""

    def once(rng: Rng) -> list[Found]:
        return found(strength.failures(part.draw(rng, n), 0, 0), [part.mean])

    return Experiment((Asked("share of failed parts", part.name, n, fresh_share(n, part.mean)),), once)


def _until(share: float, width: float = 0.04, most: int = 5000) -> Experiment:
    """A campaign of a linear load that looks at its interval until it is narrow; what is said of its joints then."""
    size, design, quantiles = float(np.sqrt((SLOPES**2).sum())), Looked(), (0.5, 0.9, 0.99)
    level, case = float(norm.isf(share)), f"linear, {share:g}, narrower than {width:g}"
    planned, loads_of = np.array(binomial.looks(most)), {q: float(norm.ppf(q)) for q in quantiles}
    asked = [Asked("share at a stop", case, most)]
    asked += [Asked("quantile at a stop", f"{case}, {100 * q:g} %", most) for q in quantiles]
    asked += [Asked("index alone, at a stop", f"{case}, error {k + 1}", most) for k in range(SLOPES.size)]

    def once(rng: Rng) -> list[Found]:
        errors = rng.standard_normal((most, SLOPES.size))
        loads = errors @ SLOPES / size
        above = np.cumsum(loads > level)[planned - 1]
        stops = np.append(np.flatnonzero(binomial.narrow(width, above, 0, planned)), planned.size - 1)
        joints = int(planned[stops[0]])
        sample = sample_of(loads[:joints], design)
        indices = sensitivity.first_order(errors[:joints], sample.values, design.level(0.95))
        of_shares = [*shares_at(sample, {level: share}), *quantiles_at(sample, loads_of)]
        return of_shares + found(indices, SLOPES**2 / size**2)

    return Experiment(tuple(asked), once)


def _process(parts: int) -> Experiment:
    """Standard deviation and mean of a process, from normal parts."""

    def once(rng: Rng) -> list[Found]:
        sample = rng.standard_normal(parts)
        mean, deviation = float(sample.mean()), float(sample.std(ddof=1))
        spreads, means = measured.spreads(parts, 0.95), measured.means(parts, 0.95)
        return [
            Found(deviation * spreads[0], deviation * spreads[1], 1.0),
            Found(mean + deviation * means[0], mean + deviation * means[1], 0.0),
        ]

    asked = (Asked("process, measured parts", f"normal, {word}", parts) for word in ("spread", "mean"))
    return Experiment(tuple(asked), once)
