"""Experiments on tolerances that are known from measured parts: new parts and new joints in each sample."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tolstat.analysis import known_share, process, weighted
from tolstat.analysis.exceedance import FloatArray
from tolstat.analysis.known_share import Event, Mixture
from tolstat.analysis.process import Known, Sums
from tolstat.benchmarks.coverage.laws import fresh_share
from tolstat.benchmarks.coverage.shares import ok
from tolstat.benchmarks.coverage.trial import Asked, Experiment, Found
from tolstat.benchmarks.coverage.weights import ERRORS, Load, loads

ENTRIES = 2
"""Entries of the tolerances, each with a process and measured parts of its own."""
TOLERANCES = 0.2
"""Share of the joints drawn from the tolerances; the others come from the posterior predictive."""
ADDED = "an unknown mean can only add to a sum of squares: lower ends lie too high"
TAKEN_FOR_KNOWN = "the tolerances are taken as exact: the interval of a study without `known_from`"
CASES = ((30, 1024, 0.05), (30, 4096, 0.005), (50, 1024, 0.002))
"""Measured parts, joints, and share above the level."""
MOST = 250
"""Number of seeds: one takes up to a second."""
Rng = np.random.Generator


def experiments() -> Iterator[Experiment]:
    """All of this file."""
    for load in loads():
        for parts, n, share in CASES:
            yield _known(load, parts, n, share)


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
        (split,) = known_share.tallies(sums, known, drawn, weights, [Event(above, np.ones(n, dtype=bool))])
        found = known_share.intervals(split, [split], [split], usable)
        stated = weighted.weighted_exceedance(above, ok(n), weights, 0.5, heaviest=1.0 / TOLERANCES)
        return [Found(found.lower, found.upper, share), Found(stated.lower, stated.upper, share)]

    case = f"{load.name} of {ERRORS} errors, {parts} parts, {share:g}"
    fresh = fresh_share(n, share)
    return Experiment(
        (
            Asked("share, parts and joints", case, n, fresh, ADDED if load.name == "squares" else ""),
            Asked("share, parts left out", case, n, fresh, TAKEN_FOR_KNOWN),
        ),
        once,
        MOST,
    )


def _joints(rng: Rng, n: int, entry: Known) -> FloatArray:
    """Scores of n joints from the mixture, (ENTRIES, n, errors of an entry)."""
    z = rng.standard_normal((ENTRIES, n, entry.errors))
    b = process.deviation(rng.random((ENTRIES, n)), entry.parts)
    a = process.mean(rng.standard_normal((ENTRIES, n)), b, entry.parts)
    of_parts = rng.random(n) >= TOLERANCES
    return np.where(of_parts[None, :, None], a[:, :, None] + b[:, :, None] * z, z)
