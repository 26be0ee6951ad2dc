"""Which results a campaign keeps: all of them, or those that ``[output] results`` of its study selects.

Columns on the course of a simulation (status, closure, period, counts) are always kept: results are meaningless
without them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.common.columns import RESULT_COLUMNS, Column
from tolstat.common.load_kinds import LOAD_KINDS
from tolstat.common.loads import LOADS

KEY = "output.results"
"""Key in the identity of a study that holds the names of the selected columns; absent where all are kept."""
OPTIONAL_FIELDS = (
    "mode_share",
    "equivalent_load",
    "clearance",
    *(field.name for kind in LOAD_KINDS for field in kind.statistics().values()),
)
"""Fields of the results that a study may leave out."""
NAMES = tuple(c.name for c in RESULT_COLUMNS)


def chosen(names: Iterable[str]) -> list[str] | None:
    """Optional columns among `names`, in the order of the table; None if no optional column is left out."""
    optional = [c.name for c in RESULT_COLUMNS if c.field in OPTIONAL_FIELDS]
    selected = [name for name in optional if name in set(names)]
    return None if selected == optional else selected


def columns(identity: Mapping[str, Any]) -> tuple[Column, ...]:
    """Columns of the results that a campaign keeps, in the order of the table.

    Parameters
    ----------
    identity : mapping
        Identity of the campaign's study, by dotted key.

    Raises
    ------
    ValueError
        When the identity holds anything but a list of column names.
    """
    names = identity.get(KEY)
    if names is None:
        return RESULT_COLUMNS
    if not isinstance(names, list) or any(name not in NAMES for name in names):
        raise ValueError(f"{KEY} is {names!r}, not a list of columns of the results")
    return tuple(c for c in RESULT_COLUMNS if c.field not in OPTIONAL_FIELDS or c.name in names)


def blank_others(results: NDArray[np.void], kept: Iterable[Column]) -> None:
    """Write NaN to the columns of a table RESULT that are not in `kept`; all of these have type f8."""
    names = {c.name for c in kept}
    for c in RESULT_COLUMNS:
        if c.name not in names:
            c.of(results)[:] = np.nan


def holds(kept: Iterable[Column], load: str) -> bool:
    """Whether a load that can have a limit can be read from the columns kept."""
    return {c.name for c in kept}.issuperset(LOADS[load].columns)
