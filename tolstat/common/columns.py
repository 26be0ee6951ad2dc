"""Flat columns of the tables, as the result file and every CSV have them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.fields import Field
from tolstat.common.tables import DESIGN_FIELDS, ERROR_FIELDS, LEDGER_FIELDS, RESULT_FIELDS


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
ERROR_COLUMNS = flat(ERROR_FIELDS)
RESULT_COLUMNS = flat(RESULT_FIELDS)
