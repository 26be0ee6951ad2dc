"""What the tables and histories of a campaign are made of."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class Field(NamedTuple):
    """One column, or a small array of columns, of a table.

    Attributes
    ----------
    name : str
        Identifier, the same from TOML key to file and CSV header.
    unit : str
        SI unit, ``"1"`` for a pure number.
    description : str
        One sentence for the reader of the file.
    dtype : str
        NumPy scalar type.
    shape : tuple of int
        ``()`` for a scalar column.
    columns : tuple of str
        Names of the columns of an array, one for each element; ``()`` for a scalar column.
    """

    name: str
    unit: str
    description: str
    dtype: str = "f8"
    shape: tuple[int, ...] = ()
    columns: tuple[str, ...] = ()


def dtype_of(fields: Iterable[Field]) -> np.dtype[np.void]:
    """Aligned structured dtype of a table."""
    return np.dtype([(f.name, f.dtype, f.shape) for f in fields], align=True)


class HistorySpec(NamedTuple):
    """What a load history holds for each joint: an array of `shape`, without the leading axis of joints.

    `axes` are the names of its axes.
    """

    shape: tuple[int, ...]
    dtype: str
    unit: str
    description: str
    axes: tuple[str, ...] = ()

    def blank(self, n: int) -> NDArray[Any]:
        """Return a placeholder for `n` joints without history, (n, ...): NaN (0 for integers) throughout."""
        dtype = np.dtype(self.dtype)
        return np.full((n, *self.shape), np.nan if dtype.kind == "f" else 0, dtype)
