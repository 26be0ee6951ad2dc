"""Experiments on joints of equal weight: shares, quantiles, band, capability, damage, lives, replicates, lots."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from tests.measure.coverage.trial import Asked, Experiment, Found, Law, Rng, fresh_share, laws, ok
from tolstat.analysis import (
    capability,
    cycles,
    damage,
    exceedance,
    lots,
    prediction,
    quantile,
    replicates,
    sequential,
    sorted_loads,
    strength,
)
from tolstat.common.loads import FloatArray
from tolstat.common.tables import Status

SHARES, QUANTILES = (0.5, 0.05, 0.002), (0.5, 0.9, 0.99)
JOINTS, DELIVERY = 20, 500
"""Joints of a lot, and of its next delivery."""


def experiments() -> Iterator[Experiment]:
    """All of this file."""
    known = laws()
    for name in ("normal", "lognormal", "uniform", "rounded"):
        for n in (60, 1024):
            yield _independent(known[name], n)
    for n in (100, 1024):
        yield _unresolved(known["lognormal"], n)
    for name in ("normal", "slightly skew", "exponential", "lognormal", "uniform"):
        for n in (100, 1000, 4000):
            yield _capability(known[name], n)
    for exponent in (3.0, 5.0, 10.0):
        for n in (60, 1024):
            yield _equivalent(exponent, n)
    for n in (60, 1024):
        for part in _PARTS:
            yield _of_revolution(part, n)
            yield _failed(part, n)
    for method in ("Sobol'", "Latin hypercube"):
        for dimensions in (3, 10):
            for share in (0.5, 0.05, 0.005):
                yield _replicated(method, dimensions, share)
    for share in SHARES:
        yield _until(share)
        for n in (100, 1024):
            yield _delivered(share, n)
    for lot in _LOTS:
        for share in (0.5, 0.1, 0.02, 0.002):
            yield _of_lots(lot, share, 50)
        yield _of_lots(lot, 0.1, 30)


def _independent(law: Law, n: int) -> Experiment:
    levels = [float(law.ppf(1.0 - share)) + 0.01 for share in SHARES]
    asked = [Asked("share", f"{law.name}, {share:g}", n) for share in SHARES]
    asked += [Asked("quantile", f"{law.name}, {100 * share:g} %", n) for share in QUANTILES]
    asked.append(Asked("band", law.name, n))
    truths = [float(law.sf(level)) for level in levels]

    def once(rng: Rng) -> list[Found]:
        sample = sorted_loads.sort_out(law.draw(rng, n), ok(n))
        rows = exceedance.curve_of(sample, levels)
        found = [Found(row["lower"], row["upper"], truth) for row, truth in zip(rows, truths, strict=True)]
        for share in QUANTILES:
            own = quantile.of_sample(sample, share)
            found.append(Found(own.lower, own.upper, float(law.ppf(share))))
        return [*found, _band(law, sample)]

    return Experiment(tuple(asked), once)


def _band(law: Law, sample: sorted_loads.Sample) -> Found:
    """Interval of the largest difference of the truth from the estimate, on each side: it contains zero or not."""
    half = exceedance.simultaneous(sample.n)
    at, number = np.unique(sample.valid, return_counts=True)
    above = sample.n - np.cumsum(number)
    truth, just_before = law.sf(at), law.sf(np.nextafter(at, -np.inf))
    over = float((above / sample.n - truth).max(initial=0.0))
    under = float((just_before - (above + number) / sample.n).max(initial=0.0))
    # the band is above the truth where the estimate less the half width is
    return Found(over - half, half - under, 0.0)


def _unresolved(law: Law, n: int) -> Experiment:
    """One in a hundred joints has no valid load, of those above the limit one in two."""
    level = float(law.ppf(0.95))

    def once(rng: Rng) -> list[Found]:
        loads = law.draw(rng, n)
        lost = rng.random(n) < np.where(loads > level, 0.5, 0.01)
        row = exceedance.exceedance(loads, np.where(lost, int(Status.NEWTON_FAILED), ok(n)), level)
        return [Found(row.outer_lower, row.outer_upper, 0.05)]

    return Experiment((Asked("share, joints without a load", f"{law.name}, 0.05, half of those above lost", n),), once)


def _capability(law: Law, n: int) -> Experiment:
    limit = float(law.ppf(0.999))
    points = law.ppf((np.arange(100_000) + 0.5) / 100_000)
    by_moments = (limit - points.mean()) / (3.0 * points.std())
    middle, high = (float(law.ppf(share)) for share in (0.5, capability.REFERENCE))
    by_quantiles = (limit - middle) / (high - middle)
    asked = (
        Asked("Cpk, normal", f"{law.name}, limit at 99.9 %", n),
        Asked("Cpk from quantiles", f"{law.name}, limit at 99.9 %", n),
        Asked("yield and ppm", f"{law.name}, limit at 99.9 %", n),
    )

    def once(rng: Rng) -> list[Found]:
        own = capability.capability(law.draw(rng, n), ok(n), limit)
        _, lower, upper = own.ppm
        normal = Found(own.cpk_normal_lower, own.cpk_normal_upper, by_moments)
        return [normal, Found(own.cpk_lower, own.cpk_upper, by_quantiles), Found(lower, upper, 1e3)]

    return Experiment(asked, once)


def _equivalent(exponent: float, n: int) -> Experiment:
    """Two cycles a revolution, whose ranges are lognormal with one factor in common."""
    known = laws()["lognormal"]

    def once(rng: Rng) -> list[Found]:
        ranges = known.draw(rng, n)[:, None, None] * np.array([1.0, 0.5])
        counted = cycles.Cycles.of_revolution(("cross1.F",), ranges, ranges, np.full((n, 1), 2.0))
        loads = damage.equivalent_load(counted, exponent)[:, 0]
        found = []
        for share in (0.5, 0.9):
            own, truth = exceedance.quantile(loads, ok(n), share), float(known.ppf(share))
            found.append(Found(own.lower, own.upper, truth * (1.0 + 0.5**exponent) ** (1.0 / exponent)))
        return found

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


def _of_revolution(part: _Part, n: int) -> Experiment:
    """Mean time above a level, as `questions.time_above` has it."""

    def once(rng: Rng) -> list[Found]:
        time = part.draw(rng, n)
        lower, upper = exceedance.clopper_pearson(time.sum(), time.size)
        return [Found(float(lower), float(upper), part.mean)]

    return Experiment((Asked("mean time above", part.name, n),), once)


def _failed(part: _Part, n: int) -> Experiment:
    """Share of the parts that fail, from probabilities of failure by joint."""

    def once(rng: Rng) -> list[Found]:
        own = strength.failures(part.draw(rng, n), 0, 0)
        return [Found(own.lower, own.upper, part.mean)]

    return Experiment((Asked("share of failed parts", part.name, n, fresh_share(n, part.mean)),), once)


def _replicated(method: str, dimensions: int, share: float, n: int = 1024, parts: int = 8) -> Experiment:
    """Sum of normal errors, drawn in eight randomisations of a design."""
    law = laws()["normal"]
    level = float(law.ppf(1.0 - share))
    name = f"{method}, sum of {dimensions} errors, {share:g}"
    asked = (
        Asked("share, replicates", name, n, fresh_share(n, share)),
        Asked("quantile, replicates", name, n, law.fresh_quantile(n, 1.0 - share)),
    )

    def once(rng: Rng) -> list[Found]:
        from scipy.special import ndtri
        from scipy.stats import qmc

        engine = qmc.Sobol if method == "Sobol'" else qmc.LatinHypercube
        points = [engine(dimensions, rng=rng).random(n // parts) for _ in range(parts)]
        samples = [sorted_loads.sort_out(ndtri(x).sum(axis=1) / np.sqrt(dimensions), ok(len(x))) for x in points]
        whole = sorted_loads.sort_out(np.concatenate([own.valid for own in samples]), ok(n))
        row = replicates.curve_of(whole, samples, [level])[0]
        own = replicates.quantile_of(whole, samples, 1.0 - share)
        return [Found(row["lower"], row["upper"], share), Found(own.lower, own.upper, level)]

    return Experiment(asked, once)


def _delivered(share: float, n: int) -> Experiment:
    """Joints above a limit in the next delivery, a random number itself."""
    number = prediction.DELIVERY
    case = f"any law, {share:g}, {number} joints delivered"

    def once(rng: Rng) -> list[Found]:
        above, truth = int(rng.binomial(n, share)), float(rng.binomial(number, share))
        lower, upper = exceedance.clopper_pearson(above, n, prediction.half(0.95))
        ends = prediction.of_counts(above, above, n, number), prediction.of_share(float(lower), float(upper), number)
        return [Found(*own, truth) for own in ends]

    return Experiment((Asked("next delivery", case, n), Asked("next delivery, from a share", case, n)), once)


def _until(share: float, width: float = 0.02, most: int = 20_000) -> Experiment:
    """A campaign that looks at its interval until it is narrow."""

    def once(rng: Rng) -> list[Found]:
        above = joints = 0
        for look in sequential.looks(most):
            above, joints = above + int(rng.binomial(look - joints, share)), look
            if sequential.narrow(width, above, 0, joints):
                break
        lower, upper = sequential.interval(above, 0, joints)
        return [Found(float(lower), float(upper), share)]

    return Experiment((Asked("share at a stop", f"any law, {share:g}, narrower than {width:g}", most),), once)


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
