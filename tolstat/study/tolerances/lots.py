"""Lots: parts that are made together deviate together. The key ``lot`` of an entry of ``[tolerances]``.

The normal score of an error is ``sqrt(share) z_lot + sqrt(1 - share) z_part``, so that its distribution stays that of
the entry. `sampling` draws the scores; how many joints a lot has is ``sampling.joints_per_lot``. Where each joint is
its own lot, the score of the lot only correlates errors of the joint that share it, as `correlated` does.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Annotated, NamedTuple

import numpy as np
from pydantic import Field

from tolstat.common.errors import Fault, InputError
from tolstat.common.strict import Strict, dotted
from tolstat.common.units import Number
from tolstat.study.tolerances.correlation import Copula

if TYPE_CHECKING:
    from tolstat.study.tolerances.entry import Toleranced


class LotEntry(Strict):
    """Key ``lot`` of an entry: parts of one lot deviate together."""

    share: Annotated[Number, Field(gt=0, lt=1)] = Field(examples=[0.3])
    """share of the variance of the normal score that is between lots"""
    shared: bool = Field(default=False, strict=True, examples=[True])
    """whether all errors that the pattern selects have one score of the lot, so that they are correlated in each
    joint; else each error has its own"""


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


def of_entries(entries: Iterable[Toleranced]) -> dict[str, Lot]:
    """Lots of the errors, by name, in the order of the entries."""
    found: dict[str, Lot] = {}
    for entry in entries:
        names = [site.name for site, _ in entry.models]
        for site, model in entry.models:
            lot = getattr(model, "lot", None)
            if lot is not None:
                found[site.name] = Lot(lot.share, names[0] if lot.shared else site.name)
    return found


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
        raise InputError([Fault(f"{place}: {dotted(('correlation',))}", f"{both[0]} has a lot already", remedy)])
    every = [lot.score for lot in lots.values()]
    names = [name for name, lot in lots.items() if every.count(lot.score) > 1]
    own = np.eye(len(names))
    for i, one in enumerate(names):
        for j, other in enumerate(names):
            if i != j and lots[one].score == lots[other].score:
                own[i, j] = lots[one].share
    matrix = np.eye(len(copula.names) + len(names))
    matrix[: len(copula.names), : len(copula.names)] = copula.matrix
    matrix[len(copula.names) :, len(copula.names) :] = own
    return Copula((*copula.names, *names), matrix)
