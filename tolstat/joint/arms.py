"""Loads that are one force: a pin, the bushing that carries it, and the hole that it bears in."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from tolstat.common.loads import split
from tolstat.kernel.mechanics.topology import ARM_OF_PIN

PIN_OF_LOAD = {
    name: pin
    for pin, arm in enumerate(ARM_OF_PIN, 1)
    for name in (f"cross{pin}.F", f"fork{arm + 1}.F", f"pin{pin}.contact")
}
"""Pin of each load that is its force; the three of a pin differ by the inertia of its lumped bodies alone."""


def one_force(rows: Iterable[Mapping[str, Any]], level: str, size: str) -> list[dict[str, Any]]:
    """Rows of limits for people: one for all loads that are the same force and have the same limit.

    Parameters
    ----------
    rows : iterable of mapping
        Rows with ``load``, the key `level` of the limit, and the key `size`.
    level, size : str
        Of the rows of one force, that of the largest `size` is shown, with the names of all in ``load``.
    """
    by_force: dict[Any, list[Mapping[str, Any]]] = {}
    for row in rows:
        name, points = split(row["load"])
        force = (PIN_OF_LOAD[name], points, row[level]) if name in PIN_OF_LOAD else row["load"]
        by_force.setdefault(force, []).append(row)
    return [
        {**max(same, key=lambda row: row[size]), "load": ", ".join(row["load"] for row in same)}
        for same in by_force.values()
    ]
