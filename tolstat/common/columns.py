"""Flat columns of the tables, as the result file and every CSV have them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.tables import (
    BUSHINGS,
    CONTACTS,
    DESIGN_FIELDS,
    ERROR_FIELDS,
    LEDGER_FIELDS,
    PINS,
    RESULT_FIELDS,
    Field,
    Mode,
)


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


def _result_columns() -> tuple[Column, ...]:
    columns = []
    for f in RESULT_FIELDS:
        for index in np.ndindex(*f.shape):
            if not f.shape:
                name = f.name
            elif f.name[:2] in ("F_", "T_"):
                name = f"{BUSHINGS[index[0]]}.{f.name}"
            elif f.name == "contact_max":
                name = f"{PINS[index[0]]}.contact_{CONTACTS[index[1]]}_max"
            elif f.name == "mode_share":
                name = f"{PINS[index[0]]}.share_{Mode(index[1]).name.lower()}"
            else:
                name = f.name
            columns.append(Column(name, f.unit, f.description, f.dtype, f.name, index))
    return tuple(columns)


def _scalar_columns(fields: tuple[Field, ...]) -> tuple[Column, ...]:
    return tuple(Column(f.name, f.unit, f.description, f.dtype, f.name, ()) for f in fields)


DESIGN_COLUMNS = _scalar_columns(DESIGN_FIELDS)
LEDGER_COLUMNS = _scalar_columns(LEDGER_FIELDS)
ERROR_COLUMNS = _scalar_columns(ERROR_FIELDS)
RESULT_COLUMNS = _result_columns()
