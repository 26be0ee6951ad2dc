"""Experiments on joints counted by other weights: other tolerances, measured parts."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2, norm

from tests.measure.coverage.trial import Asked, Experiment, Found, Law, Rng, found, fresh_share, sample_of
from tolstat.analysis import known_share, process, reweight
from tolstat.analysis.known_share import Mixture
from tolstat.analysis.process import Known, Sums
from tolstat.analysis.reweight import Ratios
from tolstat.analysis.weighted import Weighted
from tolstat.common.loads import FloatArray
from tolstat.study.tolerances import density_ratio
from tolstat.study.tolerances.distributions import Normal

ERRORS = 10
ENTRIES = 2
"""Entries of the tolerances, each with a process and measured parts of its own."""
TOLERANCES = 0.2
"""Share of the joints drawn from the tolerances; the others come from the posterior predictive."""
ADDED = "an unknown mean can only add to a sum of squares: lower ends lie too high"
TAKEN_FOR_KNOWN = "the tolerances are taken as exact: the interval of a study without `known_from`"
PARTS = ((30, 1024, 0.05), (30, 4096, 0.005), (50, 1024, 0.002))
"""Measured parts, joints, and share above the level."""
MOST_SEEDS = 250
"""Number of seeds: one takes up to a second."""


class Load(NamedTuple):
    """A load of independent normal errors of one deviation, with its distribution."""

    name: str
    of: Callable[[FloatArray], FloatArray]
    law: Callable[[float], Law]


def loads() -> list[Load]:
    """Sum, sum of squares, and largest of the errors; laws by the factor on their deviation."""
    root = math.sqrt(ERRORS)

    def largest(f: float) -> Law:
        return Law("largest", lambda p: f * norm.ppf(p ** (1 / ERRORS)), lambda x: 1.0 - norm.cdf(x / f) ** ERRORS)

    def total(f: float) -> Law:
        return Law("sum", lambda p: f * root * norm.ppf(p), lambda x: norm.sf(x / f / root))

    def squares(f: float) -> Law:
        return Law("squares", lambda p: f**2 * chi2.ppf(p, ERRORS), lambda x: chi2.sf(x / f**2, ERRORS))

    return [
        Load("sum", lambda x: x.sum(axis=1), total),
        Load("squares", lambda x: (x**2).sum(axis=1), squares),
        Load("largest", lambda x: x.max(axis=1), largest),
    ]


def experiments() -> Iterator[Experiment]:
    """All of this file."""
    for load in loads():
        for factor, n in ((0.8, 256), (0.8, 1024), (1.1, 1024), (1.1, 4096), (1.15, 4096), (1.3, 4096)):
            yield _reweighted(load, factor, n)
    for load in loads():
        for parts, n, share in PARTS:
            yield _known(load, parts, n, share)


def _exact(factors: FloatArray, errors: int) -> density_ratio.Exact:
    """Of standard normal errors in groups of so many, for deviations `factors` times as large, (groups,)."""
    one = [density_ratio.exact([(Normal(0.0, float(own)), Normal(0.0, 1.0))]) for own in factors]
    return density_ratio.Exact(*(errors * float(sum(values)) for values in zip(*one, strict=True)))


def _log_ratios(squares: FloatArray, factors: FloatArray, errors: int) -> FloatArray:
    """Of joints whose squares of the errors have these sums, (n, groups); see `_exact`."""
    return np.asarray(squares @ (0.5 * (1.0 - factors**-2.0)) - errors * np.log(factors).sum())


def _ratios(squares: FloatArray, factors: FloatArray, errors: int) -> Ratios:
    exact, values = _exact(factors, errors), np.exp(_log_ratios(squares, factors, errors))
    return Ratios(values, exact.mean_square, exact.unbounded, float(np.exp(exact.largest)))


def _reweighted(load: Load, factor: float, n: int) -> Experiment:
    law, shares = load.law(factor), (0.5, 0.05, 0.005)
    levels = [float(law.ppf(1.0 - share)) for share in shares]
    names = [f"{load.name} of {ERRORS} errors, {factor:g} times as wide, {share:g}" for share in shares]
    of_shares = [fresh_share(n, share) for share in shares]
    of_quantiles = [law.fresh_quantile(n, 1.0 - share) for share in shares]
    asked = [
        Asked(f"{statistic}, other tolerances", name, n, width)
        for statistic, widths in (("share", of_shares), ("quantile", of_quantiles))
        for name, width in zip(names, widths, strict=True)
    ]

    def once(rng: Rng) -> list[Found]:
        x = rng.standard_normal((n, ERRORS))
        ratios = _ratios((x**2).sum(axis=1, keepdims=True), np.array([factor]), ERRORS)
        sample = sample_of(load.of(x))
        shares_above = [reweight.share_above(sample, ratios, level) for level in levels]
        quantiles = [reweight.quantile(sample, ratios, 1.0 - share) for share in shares]
        return [
            *(Found(f.lower, f.upper, share, f.support.usable) for f, share in zip(shares_above, shares, strict=True)),
            *(Found(f.lower, f.upper, level, f.usable) for f, level in zip(quantiles, levels, strict=True)),
        ]

    return Experiment(tuple(asked), once)


def _known(load: Load, parts: int, n: int, share: float) -> Experiment:
    level = float(load.law(1.0).ppf(1.0 - share))
    entry = Known(parts, ERRORS // ENTRIES)
    known = (entry,) * ENTRIES
    drawn = process.draws((parts,) * ENTRIES)
    mixture = [Mixture(TOLERANCES, (None,) * ENTRIES), Mixture(1.0 - TOLERANCES, (parts,) * ENTRIES)]
    usable = known_share.supported(n, drawn, known, mixture)

    def once(rng: Rng) -> list[Found]:
        # the errors of the process are standard normal; the study states what its parts show
        measured = rng.standard_normal((ENTRIES, parts))
        center, spread = measured.mean(axis=1), measured.std(axis=1, ddof=1)
        z = _joints(rng, n, entry)
        sums = [Sums(own.sum(axis=1), np.square(own).sum(axis=1)) for own in z]
        ratio = np.exp(sum(process.log_student(own, entry) for own in sums))
        weights = 1.0 / (TOLERANCES + (1.0 - TOLERANCES) * ratio)
        errors = center[:, None, None] + spread[:, None, None] * z
        above = load.of(np.concatenate(list(errors), axis=1)) > level
        event = (above, np.ones(n, dtype=bool))
        (split,) = known_share.tallies(sums, known, drawn, weights, [event], 1.0 / TOLERANCES)
        own = known_share.intervals(split, [split], [split], usable)
        stated = sample_of(above, Weighted(weights, 1.0 / TOLERANCES)).above(0.5)
        return found(own, [share]) + found(stated, [share])

    case = f"{load.name} of {ERRORS} errors, {parts} parts, {share:g}"
    fresh = fresh_share(n, share)
    return Experiment(
        (
            Asked("share, parts and joints", case, n, fresh, ADDED if load.name == "squares" else ""),
            Asked("share, parts left out", case, n, fresh, TAKEN_FOR_KNOWN),
        ),
        once,
        MOST_SEEDS,
    )


def _joints(rng: Rng, n: int, entry: Known) -> FloatArray:
    """Scores of n joints from the mixture, (ENTRIES, n, errors of an entry)."""
    z = rng.standard_normal((ENTRIES, n, entry.errors))
    b = process.deviation(rng.random((ENTRIES, n)), entry.parts)
    a = b * rng.standard_normal((ENTRIES, n)) / np.sqrt(entry.parts)
    of_parts = rng.random(n) >= TOLERANCES
    return np.where(of_parts[None, :, None], a[:, :, None] + b[:, :, None] * z, z)
