"""What the tables are made of: fields, and the kinds of loads, from which the fields of the results follow."""

from __future__ import annotations

import math
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


class Kind(NamedTuple):
    """A kind of loads, which are compared with the largest of them. Higher is worse.

    Attributes
    ----------
    name : str
        As in the load ``cross1.F`` and the fields ``F_max``, ``F_lower`` and ``F_upper`` of the results.
    noun : str
        What a load of the kind is called.
    unit : str
        SI unit.
    meaning : str
        What ``F_max`` is the largest of, for the reader of the file.
    places : tuple of str
        Bushings or pins that have such a load each; empty for a load of the whole joint.
    parts : tuple of str
        Values at each place, the largest of which is the load; empty if there is one.
    averaged : bool
        Whether results hold mean and range, too. The kinds that have them come first in the registry.
    interpolated : bool
        Whether a largest value between two samples is interpolated by a parabola.
    """

    name: str
    noun: str
    unit: str
    meaning: str
    places: tuple[str, ...] = ()
    parts: tuple[str, ...] = ()
    averaged: bool = False
    interpolated: bool = True

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of its fields in the results, without the interval's."""
        return tuple(len(names) for names in (self.places, self.parts) if names)

    @property
    def size(self) -> int:
        """Number of values."""
        return math.prod(self.shape)

    def columns(self, statistic: str) -> tuple[str, ...]:
        """Columns of a statistic, ``"max"``, ``"mean"`` or ``"range"``: ``pin1.contact_outer_max`` and so on."""
        places = [f"{place}." for place in self.places] or [""]
        parts = [f"_{part}" for part in self.parts] or [""]
        return tuple(f"{place}{self.name}{part}_{statistic}" for place in places for part in parts)

    def statistics(self) -> dict[str, Field]:
        """Fields of the results with its statistics over the revolutions that count, by statistic."""
        texts = {"max": "largest"} | ({"mean": "mean", "range": "largest less smallest"} if self.averaged else {})
        return {
            name: Field(
                f"{self.name}_{name}",
                self.unit,
                f"{text} {self.meaning}",
                shape=self.shape,
                columns=self.columns(name) if self.shape else (),
            )
            for name, text in texts.items()
        }

    def ends(self) -> list[Field]:
        """Fields of the results with the ends of the interval of its largest loads."""
        of = f"of the interval of the largest {self.noun} of a stationary joint, in units of it; of others 1"
        return [Field(f"{self.name}_{end}", "1", f"{end} end {of}") for end in ("lower", "upper")]


def dtype_of(fields: Iterable[Field]) -> np.dtype[np.void]:
    """Aligned structured dtype of a table."""
    return np.dtype([(f.name, f.dtype, f.shape) for f in fields], align=True)
