"""Errors that depend on each other: ``[[correlation]]`` and lots as one Gaussian copula; groups of them.

Parts that are made together deviate together: with the key ``lot`` of an entry the normal score of an error is
``sqrt(share) z_lot + sqrt(1 - share) z_part``, so that its distribution stays that of the entry. `sampling` draws the
scores; how many joints a lot has is ``sampling.joints_per_lot``. Where each joint is its own lot, the score of the lot
only correlates errors of the joint that share it, as `correlated` does.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tolstat.common.errors import gather, input_error
from tolstat.common.late import pandas as pd
from tolstat.common.late import special
from tolstat.common.strict import Strict, dotted
from tolstat.common.units import Number
from tolstat.study.axes import is_zone
from tolstat.study.selection import Reading, select, without_joint
from tolstat.study.tolerances.distributions import Distribution, Normal

Array = NDArray[np.float64]
NODES = 64
"""Number of Gauss–Hermite nodes of each of two normal scores."""

MIN_EIGENVALUE = 1e-9
"""A correlation matrix with a smaller eigenvalue does not count as positive definite."""


class Correlation(Strict):
    """Correlation of every pair of some errors."""

    between: list[str] = Field(min_length=1, examples=[["pin*.diameter"]])
    """names or patterns of errors that have a tolerance; every pair of them has the correlation `rho`"""
    rho: Annotated[Number, Field(gt=-1, lt=1)] = Field(examples=[0.6])
    """correlation of the normal scores (Gaussian copula), and of the errors themselves if normal"""


@dataclass(frozen=True)
class Copula:
    """Gaussian copula of the errors `names`; the others are independent.

    Attributes
    ----------
    names : tuple of str
        In the order in which the file first names them, so that errors correlated later in the file leave the
        draws of these unchanged.
    matrix : ndarray, (m, m)
        Correlation of the normal scores.
    """

    names: tuple[str, ...] = ()
    matrix: Array = field(default_factory=lambda: np.eye(0))

    def apply(self, u: Array) -> Array:
        """Correlate independent probabilities.

        Parameters
        ----------
        u : ndarray, (n, m)
            Independent and uniform in (0, 1), one column for each of `names`.

        Returns
        -------
        ndarray, (n, m)
            Uniform in each column, correlated across; the first column is unchanged but for rounding.
        """
        scores, factor = special.ndtri(u), np.linalg.cholesky(self.matrix)
        # term by term: in a matrix product the rounding of a row depends on the number of rows
        mixed = np.zeros_like(scores)
        for i, j in zip(*np.nonzero(factor), strict=True):
            mixed[:, i] += factor[i, j] * scores[:, j]
        correlated: Array = special.ndtr(mixed)
        return np.clip(correlated, np.finfo(float).tiny, 1 - np.finfo(float).epsneg)


def read(file: Reading) -> Copula:
    """Read ``[[correlation]]``, and the correlation of errors that share the score of their lot.

    Faults are names without tolerance, a pair given twice, a matrix that is not positive definite, errors with a lot
    or a bonus.
    """
    lots, before = file.scatter.lots, len(file.faults)
    entries = file.models("correlation", Correlation)
    rho: dict[frozenset[str], float] = {}
    order: dict[str, None] = {}
    for number, entry in enumerate(entries if len(file.faults) == before else []):
        where = f"correlation[{number}].between"
        names: dict[str, None] = {}
        for pattern in entry.between:
            with gather(file.faults):
                names.update(dict.fromkeys(_named(pattern, file.scatter.drawn, f"{file.place}: {where}")))
        members = list(names)
        if len(members) < 2 and len(file.faults) == before:
            file.fault(where, f"names only one error, {members[0]}", "name at least two")
        order.update(names)
        for pair in (frozenset((a, b)) for i, a in enumerate(members) for b in members[:i]):
            if pair in rho:
                text = " and ".join(sorted(pair))
                file.fault(where, f"{text} are correlated by an earlier entry", "remove one of the two")
            rho[pair] = entry.rho
    with gather(file.faults):
        if len(file.faults) == before:
            copula = correlated(_positive_definite(tuple(order), rho, file.place), lots, file.place)
            for name in sorted({bonus.diameter for bonus in file.scatter.rejecting}.intersection(copula.names)):
                found = f"{name} cannot be correlated: parts are accepted by this diameter and the position"
                remedy = 'remove the correlation or the bonus, or write material_condition = "fills"'
                file.fault("correlation", found, remedy)
            return copula
    return Copula()


def _named(pattern: str, toleranced: Sequence[str], where: str) -> list[str]:
    """Errors of one name or pattern in `between`."""
    names = select(pattern, toleranced)
    if any(is_zone(name) for name in names or [pattern]):
        remedy = "give offset_t, offset_z, tilt_t and tilt_z tolerances of their own, and correlate those"
        raise input_error(where, f"{pattern} is a zone: it cannot be correlated", remedy)
    if not names:
        remedy = without_joint(pattern, toleranced) or f"add tolerances.{pattern}, or remove it here"
        raise input_error(where, f"{pattern!r} has no tolerance", remedy)
    return names


def _positive_definite(names: tuple[str, ...], rho: dict[frozenset[str], float], place: str) -> Copula:
    index = {name: i for i, name in enumerate(names)}
    matrix = np.eye(len(names))
    for pair, value in rho.items():
        i, j = (index[name] for name in pair)
        matrix[i, j] = matrix[j, i] = value
    if names:
        values, vectors = np.linalg.eigh(matrix)
        if values[0] < MIN_EIGENVALUE:
            part = np.abs(vectors[:, 0])
            guilty = [name for name, share in zip(names, part, strict=True) if share > 0.1 * part.max()]
            found = f"not positive definite: the correlations of {', '.join(guilty)} contradict each other"
            remedy = "give a smaller |rho|, or add the missing pairs (they have rho = 0)"
            raise input_error(f"{place}: correlation", found, remedy)
    return Copula(names, matrix)


class Lot(NamedTuple):
    """How an error depends on the lot of its joint.

    Attributes
    ----------
    share : float
        Share of the variance of the normal score that is between lots.
    score : str
        Name of the score of the lot: that of the error itself, or the first error of the entry that shares it.
    """

    share: float
    score: str


def correlated(copula: Copula, lots: Mapping[str, Lot], place: str) -> Copula:
    """Correlation of the errors of a joint, with that of errors that share the score of their lot.

    Parameters
    ----------
    copula : Copula
        Of ``[[correlation]]``.
    lots : mapping of str to Lot
        Lot of each error that has one.
    place : str
        File name shown in faults.

    Raises
    ------
    InputError
        When an error has a lot and a correlation.
    """
    both = [name for name in copula.names if name in lots]
    if both:
        remedy = "remove one of the two; errors of one entry are correlated by lot = { share = ..., shared = true }"
        raise input_error(f"{place}: {dotted(('correlation',))}", f"{both[0]} has a lot already", remedy)
    scores_of_lots = [lot.score for lot in lots.values()]
    names = [name for name, lot in lots.items() if scores_of_lots.count(lot.score) > 1]
    scores, shares = (np.array([lots[name][i] for name in names]) for i in (1, 0))
    shared = np.where(scores[:, None] == scores, shares[:, None], 0.0)
    np.fill_diagonal(shared, 1.0)
    matrix = np.eye(len(copula.names) + len(names))
    matrix[: len(copula.names), : len(copula.names)] = copula.matrix
    matrix[len(copula.names) :, len(copula.names) :] = shared
    return Copula((*copula.names, *names), matrix)


class Group(NamedTuple):
    """Errors that are taken from another joint, or changed, together: a line of the drawing.

    Attributes
    ----------
    label : str
        Pattern of the entry of ``[tolerances]``, name of a group, feature or error.
    names : tuple of str
        The errors, or zones.
    """

    label: str
    names: tuple[str, ...]


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
    for (i, first), (j, second) in combinations(enumerate(copula.names), 2):
        if rho := float(copula.matrix[i, j]):
            linear = pearson(tolerances[first], tolerances[second], rho)
            rows.setdefault((rho, float(f"{linear:.4g}")), []).append(f"{first}, {second}")
    cells = [
        (pairs[0], len(pairs), rho, linear, 6.0 / math.pi * math.asin(0.5 * rho))
        for (rho, linear), pairs in rows.items()
    ]
    return pd.DataFrame(cells, columns=["errors", "pairs", "rho", "pearson", "spearman"])


def pearson(first: Distribution, other: Distribution, rho: float) -> float:
    """Linear correlation of two errors whose normal scores have the correlation `rho`: smaller unless both are normal.

    Gauss–Hermite quadrature over both scores.
    """
    if isinstance(first, Normal) and isinstance(other, Normal):
        return rho
    z, weight = np.polynomial.hermite_e.hermegauss(NODES)
    weight = weight / weight.sum()

    def values(distribution: Distribution, scores: Array) -> Array:
        return distribution.ppf(np.clip(special.ndtr(scores), 2.0**-53, 1.0 - 2.0**-53)) - distribution.moments.mean

    second = rho * z[:, None] + math.sqrt(1.0 - rho**2) * z
    y = values(other, second.ravel()).reshape(second.shape)
    covariance = float((weight * values(first, z)) @ y @ weight)
    return covariance / (first.moments.deviation * other.moments.deviation)
