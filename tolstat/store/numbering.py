"""Numbers of the joints in a result file: row of the campaign, file slot, sample."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Number = TypeVar("Number", int, NDArray[np.intp])


class Numbering:
    """Conversion between rows of the campaign, slots of a file and samples; part of `Reader`.

    Attributes
    ----------
    rows : range
        Rows of the campaign in the file.
    sampling : dict
        Attribute ``sampling`` of the file.
    """

    rows: range
    sampling: dict[str, Any]

    def row(self, slot: Number) -> Number:
        """Row of the campaign in a file slot; also of many, (m,)."""
        return slot + self.rows.start

    def slot(self, row: Number) -> Number:
        """File slot of a row of the campaign; also of many, (m,)."""
        return row - self.rows.start

    @property
    def first_sample(self) -> int:
        """File slot of the first random joint: 1 if slot 0 holds the nominal joint, else 0."""
        return int(bool(self.sampling["nominal_first"]) and self.rows.start == 0)

    @property
    def samples(self) -> range:
        """Numbers of the random joints of this file among those of the campaign; from 0 unless it is a slice."""
        nominal = int(self.sampling["nominal_first"])
        return range(max(0, self.rows.start - nominal), self.rows.stop - nominal)
