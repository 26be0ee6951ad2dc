"""What the entries of ``[tolerances]`` and ``[[correlation]]`` mean, as tables."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from tolstat.common.late import pandas as pd
from tolstat.common.late import special
from tolstat.study.tolerances.correlation import Copula
from tolstat.study.tolerances.distributions import Array, Distribution, Normal
from tolstat.study.tolerances.entry import Toleranced

NODES = 64
"""Number of Gauss–Hermite nodes of each of two normal scores."""


def table(entries: Sequence[Toleranced]) -> pd.DataFrame:
    """Make one row for each entry and kind of error that it sets.

    Parameters
    ----------
    entries : sequence of Toleranced
        Entries of a study.

    Returns
    -------
    DataFrame
        ``entry``, its pattern; ``number``, what its number is; ``errors``, keys of the errors as a pattern; ``unit``
        and ``sigma``, standard deviation of each of these errors, SI (where several entries set an error, the part of
        this one); ``outside``, share of the parts outside the band or zone, NaN without either.
    """
    rows: dict[tuple[Any, ...], dict[str, None]] = {}
    for entry in entries:
        for site, model in entry.models:
            for found in model.meaning(site):
                sigma = float(f"{found.sigma:.6g}")
                key = (entry.pattern, found.number, found.unit, sigma, f"{found.outside:.6g}")
                rows.setdefault(key, {}).update(dict.fromkeys(name.partition(".")[2] for name in found.errors))
    columns = ["entry", "number", "unit", "sigma", "outside", "errors"]
    cells = [(*key[:4], float(key[4]), _pattern(list(keys))) for key, keys in rows.items()]
    made = pd.DataFrame(cells, columns=columns)
    return made[["entry", "number", "errors", "unit", "sigma", "outside"]]


def correlations(copula: Copula, tolerances: Mapping[str, Distribution]) -> pd.DataFrame:
    """Make one row for each pair of kinds of errors that are correlated alike.

    Parameters
    ----------
    copula : Copula
        Correlation of the normal scores.
    tolerances : mapping of str to Distribution
        Distribution of each error.

    Returns
    -------
    DataFrame
        ``errors``, the first pair; ``pairs``, number of pairs; ``rho`` of their normal scores, as the study gives it;
        ``pearson``, linear correlation of the errors themselves; ``spearman``, rank correlation.
    """
    rows: dict[tuple[float, float], list[str]] = {}
    for (i, one), (j, other) in combinations(enumerate(copula.names), 2):
        if rho := float(copula.matrix[i, j]):
            linear = pearson(tolerances[one], tolerances[other], rho)
            rows.setdefault((rho, float(f"{linear:.4g}")), []).append(f"{one}, {other}")
    cells = [
        (pairs[0], len(pairs), rho, linear, 6.0 / math.pi * math.asin(0.5 * rho))
        for (rho, linear), pairs in rows.items()
    ]
    return pd.DataFrame(cells, columns=["errors", "pairs", "rho", "pearson", "spearman"])


def pearson(one: Distribution, other: Distribution, rho: float) -> float:
    """Linear correlation of two errors whose normal scores have the correlation `rho`: smaller unless both are normal.

    Gauss–Hermite quadrature over both scores.
    """
    if isinstance(one, Normal) and isinstance(other, Normal):
        return rho
    z, weight = np.polynomial.hermite_e.hermegauss(NODES)
    weight = weight / weight.sum()

    def values(found: Distribution, scores: Array) -> Array:
        return found.ppf(np.clip(special.ndtr(scores), 2.0**-53, 1.0 - 2.0**-53)) - found.moments.mean

    second = rho * z[:, None] + math.sqrt(1.0 - rho**2) * z
    y = values(other, second.ravel()).reshape(second.shape)
    covariance = float((weight * values(one, z)) @ y @ weight)
    return covariance / (one.moments.deviation * other.moments.deviation)


def _pattern(keys: Sequence[str]) -> str:
    """Keys as one pattern where they have the same kind: ``offset_[tz]``."""
    kinds: dict[str, str] = {}
    for key in keys:
        kind, dash, part = key.rpartition("_")
        name = f"{kind}{dash}" if len(part) == 1 else key
        kinds[name] = kinds.get(name, "") + (part if len(part) == 1 else "")
    return ", ".join(f"{kind}[{parts}]" if len(parts) > 1 else f"{kind}{parts}" for kind, parts in kinds.items())
