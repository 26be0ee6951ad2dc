"""Groups of errors that a pick-freeze design exchanges together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tolstat.study.tolerances.correlation import Copula
from tolstat.study.tolerances.entry import Toleranced


class Group(NamedTuple):
    """Errors that are taken together from another joint; groups are independent of each other.

    Attributes
    ----------
    label : str
        Name of the error, or pattern of the entry of ``[tolerances]``; a group without a pattern is labelled by its
        first error and the number of others.
    names : tuple of str
        The errors.
    """

    label: str
    names: tuple[str, ...]


def groups(entries: Sequence[Toleranced], copula: Copula, by: str) -> tuple[Group, ...]:
    """Groups of the errors of a study.

    Parameters
    ----------
    entries : sequence of Toleranced
        ``[tolerances]`` of the study.
    copula : Copula
        Their correlation: groups that it links become one.
    by : str
        ``error``: every error by itself, of a zone every vector; ``tolerance``: those of an entry together.

    Returns
    -------
    tuple of Group
        In the order of the table.
    """
    if by == "error":
        parts = [Group(name, (name,)) for entry in entries for name in entry.quantities]
    else:
        parts = [Group(entry.pattern, tuple(entry.quantities)) for entry in entries]
    for i, j in np.argwhere(np.triu(copula.matrix, 1)):
        one, other = (next(p for p in parts if copula.names[k] in p.names) for k in (i, j))
        if one is not other:
            parts[parts.index(one)] = Group(one.label, one.names + other.names)
            parts.remove(other)
    return tuple(p if "*" in p.label or len(p.names) == 1 else _named(p) for p in parts)


def _named(part: Group) -> Group:
    return Group(f"{part.names[0]} and {len(part.names) - 1} more", part.names)
