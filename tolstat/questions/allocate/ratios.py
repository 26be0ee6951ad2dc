"""Density ratios of joints as a function of factors on their tolerances."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.common.loads import FloatArray
from tolstat.study import Study
from tolstat.study.scaling import Tolerance
from tolstat.study.tolerances.density_ratio import Exact, of_error
from tolstat.study.tolerances.distributions import Distribution, Normal
from tolstat.study.tolerances.radial import Rayleigh

Entries = dict[str, dict[str, Any]]
"""Keys of entries of ``[tolerances]`` by pattern."""


class DensityRatios:
    """Logarithms of new over old density of joints; terms of the factors used last are kept.

    Parameters
    ----------
    study : Study
        Study that the joints were drawn for.
    tolerances : sequence of Tolerance
        Tolerances that the factors scale.
    errors : ndarray, shape (n,)
        Errors of the joints, a table with the columns that the tolerances are for.
    """

    def __init__(self, study: Study, tolerances: Sequence[Tolerance], errors: NDArray[np.void]) -> None:
        self._tolerances = tolerances
        self._values = [[sampling.values(study, errors, name) for name in t.names] for t in tolerances]
        self._old = [t.distribution(t.entry) for t in tolerances]
        self._old_density = [self._log_density(i, old) for i, old in enumerate(self._old)]
        keep = lru_cache(maxsize=4 * len(tolerances))
        self._one = keep(self._log_ratio)
        self._one_exact = keep(lambda i, factor: of_error(self._scaled(i, factor), self._old[i]))

    def log_ratios(self, factors: FloatArray) -> FloatArray:
        """Logarithms of the ratios for tolerances scaled by factors, (n,)."""
        return np.asarray(sum(self._one(i, float(f)) for i, f in enumerate(factors)))

    def log_mean_square(self, factors: FloatArray) -> float:
        """Logarithm of the mean square of the ratio; see `analysis.allocation.Problem.log_spread`."""
        return self.exact(factors).mean_square

    def exact(self, factors: FloatArray) -> Exact:
        """Exact numbers of the ratio for tolerances scaled by factors."""
        return self._sum(self._one_exact(i, float(f)) for i, f in enumerate(factors))

    def exact_of_entries(self, entries: Entries) -> Exact:
        """Exact numbers of the ratio for changed entries."""
        new = [t.distribution(entries.get(t.pattern, t.entry)) for t in self._tolerances]
        return self._sum(of_error(*pair) for pair in zip(new, self._old, strict=True))

    def _sum(self, each: Iterable[Exact]) -> Exact:
        """Sum over errors, of which a tolerance may have several."""
        found = np.array([len(t.names) * np.array(own) for t, own in zip(self._tolerances, each, strict=True)])
        return Exact(*found.sum(axis=0).tolist())

    def of_entries(self, entries: Entries) -> FloatArray:
        """Logarithms of the ratios for changed entries, (n,)."""
        new = [t.distribution(entries.get(t.pattern, t.entry)) for t in self._tolerances]
        return np.asarray(sum(self._log_density(i, own) for i, own in enumerate(new)) - sum(self._old_density))

    def _log_ratio(self, i: int, factor: float) -> FloatArray:
        return self._log_density(i, self._scaled(i, factor)) - self._old_density[i]

    def _scaled(self, i: int, factor: float) -> Distribution:
        old, t = self._old[i], self._tolerances[i]
        # as the scaled entry gives it, but without parsing
        if isinstance(old, Normal):
            mean = old.mean if t.fixed is None else t.fixed + factor * (old.mean - t.fixed)
            return replace(old, mean=mean, sigma=factor * old.sigma)
        if isinstance(old, Rayleigh) and old.upper is None:
            return replace(old, sigma=factor * old.sigma)
        return t.distribution(t.scaled(factor))

    def _log_density(self, i: int, found: Distribution) -> FloatArray:
        return np.asarray(sum(found.logpdf(values) for values in self._values[i]))
