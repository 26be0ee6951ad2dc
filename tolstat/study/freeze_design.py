"""Groups of errors that a pick-freeze design exchanges together."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from tolstat.study import selection
from tolstat.study.selection import Entry
from tolstat.study.tolerances.correlation import Copula


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


def groups(entries: Iterable[Entry], names: Iterable[str], copula: Copula, by: str) -> tuple[Group, ...]:
    """Groups of the errors of a study.

    Parameters
    ----------
    entries : iterable of Entry
        Entries of ``[tolerances]``.
    names : iterable of str
        Errors that scatter.
    copula : Copula
        Their correlation: groups that it links become one.
    by : str
        ``error``: every error by itself; ``tolerance``: those of an entry together.

    Returns
    -------
    tuple of Group
        In the order of the table.
    """
    every = list(names)
    if by == "error":
        parts = [Group(name, (name,)) for name in every]
    else:
        parts = [Group(entry.pattern, tuple(selection.select(entry.pattern, every))) for entry in entries]
    for i, j in np.argwhere(np.triu(copula.matrix, 1)):
        one, other = (next(p for p in parts if copula.names[k] in p.names) for k in (i, j))
        if one is not other:
            parts[parts.index(one)] = Group(one.label, one.names + other.names)
            parts.remove(other)
    return tuple(p if "*" in p.label or len(p.names) == 1 else _named(p) for p in parts)


def _named(part: Group) -> Group:
    return Group(f"{part.names[0]} and {len(part.names) - 1} more", part.names)
