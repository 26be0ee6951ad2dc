"""What the tables are made of; parameters of one joint for the kernel, which the table PARAM holds."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np


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
