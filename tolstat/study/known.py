"""Entries of ``[tolerances]`` whose mean and deviation were estimated from measured parts."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple

from tolstat.common.errors import Fault
from tolstat.common.strict import dotted
from tolstat.study.tolerances.entry import Toleranced

METHODS = ("random", "importance")
"""Sampling methods whose joints are independent: they can be reweighted to likely processes, with intervals."""
RATHER = 'write method = "importance", and a [[proposal]] with parts'
"""Remedy where the joints of a study cannot be reweighted."""


class KnownEntry(NamedTuple):
    """An entry that is known from measured parts.

    Attributes
    ----------
    pattern : str
        Pattern as written in the study.
    names : tuple of str
        Errors that it draws, all from one process.
    parts : int
        Number of measured parts.
    """

    pattern: str
    names: tuple[str, ...]
    parts: int


def of(entries: Sequence[Toleranced]) -> tuple[KnownEntry, ...]:
    """Entries of a study that are known from measured parts, in the order of the file."""
    return tuple(
        KnownEntry(entry.pattern, tuple(entry.quantities), entry.measured_parts)
        for entry in entries
        if entry.measured_parts is not None
    )


def faults(
    entries: Sequence[KnownEntry], method: str, correlated: Collection[str], accepted: Collection[str], place: str
) -> Iterator[Fault]:
    """Faults of entries whose joints could not be reweighted to other means and deviations.

    Parameters
    ----------
    entries : sequence of KnownEntry
        Entries that are known from measured parts.
    method : str
        Sampling method.
    correlated, accepted : collection of str
        Errors with a correlation; diameters by which parts are accepted.
    place : str
        File name shown in faults.
    """
    for entry in entries:
        where = f"{place}: {dotted(('tolerances', entry.pattern))}"
        own = f"is known from {entry.parts} measured parts"
        if method not in METHODS:
            yield Fault(where, f"{own}, which needs independent joints, not {method!r}", RATHER)
        if among := sorted(set(entry.names) & set(correlated)):
            yield Fault(where, f"{own}, and {among[0]} is correlated", "remove the correlation, or known_from")
        if among := sorted(set(entry.names) & set(accepted)):
            found = f"{own}, and parts are accepted by {among[0]} and a position"
            yield Fault(where, found, 'remove known_from or the bonus, or write material_condition = "fills"')
