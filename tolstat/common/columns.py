"""Flat columns of the tables, as the result file and every CSV have them.

A campaign keeps all columns of the results, or those that ``[output] results`` of its study selects. Columns on the
course of a simulation (status, closure, period, counts) are always kept: results are meaningless without them. Sampling
methods that need it have a table of how each joint was drawn, which the result file keeps in the group ``origin``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.fields import Field, dtype_of
from tolstat.common.load_kinds import kinds
from tolstat.common.loads import Load
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import DESIGN_FIELDS, LEDGER_FIELDS, tables


class Column(NamedTuple):
    """One flat column of a table as files and CSV headers show it.

    `element` is the index into a field that holds a small array; ``()`` for a scalar field.
    """

    name: str
    unit: str
    description: str
    dtype: str
    field: str
    element: tuple[int, ...]

    def of(self, table: NDArray[np.void]) -> NDArray[Any]:
        """Values of the column in `table`, (n,): a view that can be written to."""
        index: tuple[Any, ...] = (slice(None), *self.element)
        values: NDArray[Any] = table[self.field][index]
        return values


def flat(fields: tuple[Field, ...]) -> tuple[Column, ...]:
    """Columns of fields."""
    return tuple(
        Column(name, f.unit, f.description, f.dtype, f.name, index)
        for f in fields
        for name, index in zip(f.columns or (f.name,), np.ndindex(*f.shape), strict=True)
    )


DESIGN_COLUMNS = flat(DESIGN_FIELDS)
LEDGER_COLUMNS = flat(LEDGER_FIELDS)
KEPT = "output.results"
"""Key in the identity of a study that holds the names of the selected columns; absent where all are kept."""


@cache
def error_columns(mechanism: Mechanism) -> tuple[Column, ...]:
    """Columns of the errors."""
    return flat(tables(mechanism).error_fields)


@cache
def result_columns(mechanism: Mechanism) -> tuple[Column, ...]:
    """Columns of the results."""
    return flat(tables(mechanism).result_fields)


@cache
def optional_columns(mechanism: Mechanism) -> tuple[Column, ...]:
    """Columns of the results that a study may leave out."""
    of_loads = {field.name for kind in kinds(mechanism).values() for field in kind.statistics().values()}
    optional = {"mode_share", "equivalent_load", "tilt", "line_load", "clearance"} | of_loads
    return tuple(column for column in result_columns(mechanism) if column.field in optional)


def kept_names(names: Iterable[str], mechanism: Mechanism) -> list[str] | None:
    """Optional columns among `names`, in the order of the table; None if no optional column is left out."""
    optional = [c.name for c in optional_columns(mechanism)]
    among = [name for name in optional if name in set(names)]
    return None if among == optional else among


def kept_columns(identity: Mapping[str, Any], mechanism: Mechanism) -> tuple[Column, ...]:
    """Columns of the results that a campaign keeps, in the order of the table.

    Parameters
    ----------
    identity : mapping
        Identity of the campaign's study, by dotted key.
    mechanism : Mechanism
        What is simulated.

    Raises
    ------
    ValueError
        When the identity holds anything but a list of column names.
    """
    names = identity.get(KEPT)
    columns, optional = result_columns(mechanism), optional_columns(mechanism)
    if names is None:
        return columns
    if not isinstance(names, list) or any(name not in {c.name for c in columns} for name in names):
        raise ValueError(f"{KEPT} is {names!r}, not a list of columns of the results")
    return tuple(c for c in columns if c not in optional or c.name in names)


def blank_others(results: NDArray[np.void], kept: Iterable[Column], mechanism: Mechanism) -> None:
    """Write NaN to the columns of a table RESULT that are not in `kept`; all of these have type f8."""
    names = {c.name for c in kept}
    for c in result_columns(mechanism):
        if c.name not in names:
            c.of(results)[:] = np.nan


def holds(kept: Iterable[Column], load: Load) -> bool:
    """Whether a load that can have a limit can be read from the columns kept."""
    return {c.name for c in kept}.issuperset(load.columns)


SUBSET_FIELDS = (
    Field("level", "1", "level of the subset simulation: 0 is drawn from the tolerances, -1 the nominal joint", "i4"),
    Field("parent", "1", "row of the joint whose errors were moved to give these; -1 at level 0", "i8"),
)
SUBSET = dtype_of(SUBSET_FIELDS)

METHODS = {"random": "random sampling", "sweep": "sweep"}
"""Sampling methods in words."""


def drawn_columns(sampling: Mapping[str, Any]) -> tuple[Column, ...]:
    """Columns of the table; empty where the method needs none.

    Parameters
    ----------
    sampling : mapping
        The attribute ``sampling`` of a result file.
    """
    return flat(SUBSET_FIELDS) if sampling["method"] == "subset" else ()
