"""Which results a campaign keeps: all of them, or those that ``[output] results`` of its study selects.

How the simulation of a joint went (status, closure, motion, counts) is always kept: no result means anything without.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.common.columns import RESULT_COLUMNS, Column
from tolstat.common.tables import CONTACTS

KEY = "output.results"
"""Key in the identity of a study: names of the columns selected; not there where all are kept."""
CHOSEN_FROM = ("F_max", "F_mean", "F_range", "T_max", "T_mean", "T_range", "contact_max", "mode_share", "psi_max")
"""Fields of the results that a study can do without."""
NAMES = tuple(c.name for c in RESULT_COLUMNS)


def chosen(names: Iterable[str]) -> list[str] | None:
    """Those of the columns `names` that are not kept anyway, in the order of the table; None if nothing is left out."""
    optional = [c.name for c in RESULT_COLUMNS if c.field in CHOSEN_FROM]
    found = [name for name in optional if name in set(names)]
    return None if found == optional else found


def columns(identity: Mapping[str, Any]) -> tuple[Column, ...]:
    """Columns of the results that a campaign keeps, in the order of the table.

    Parameters
    ----------
    identity : mapping
        Of its study, by dotted key.

    Raises
    ------
    ValueError
        When the identity names what is no column.
    """
    names = identity.get(KEY)
    if names is None:
        return RESULT_COLUMNS
    if not isinstance(names, list) or any(name not in NAMES for name in names):
        raise ValueError(f"{KEY} is {names!r}, not a list of columns of the results")
    return tuple(c for c in RESULT_COLUMNS if c.field not in CHOSEN_FROM or c.name in names)


def blank_others(results: NDArray[np.void], kept: Iterable[Column]) -> None:
    """Write NaN to the columns of a table RESULT that are not kept: numbers of type f8, all of them."""
    names = {c.name for c in kept}
    for c in RESULT_COLUMNS:
        if c.name not in names:
            c.of(results)[:] = np.nan


def needed(load: str) -> tuple[str, ...]:
    """Columns that a load with a limit (``cross1.F``, ``pin1.contact``, ``psi``) is read from."""
    return tuple(f"{load}_{of}_max" for of in CONTACTS) if load.endswith(".contact") else (f"{load}_max",)


def holds(kept: Iterable[Column], load: str) -> bool:
    """Whether a load that can have a limit can be read from the columns kept."""
    return {c.name for c in kept}.issuperset(needed(load))
