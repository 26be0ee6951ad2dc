"""How far simulated joints are from Tables 4 to 7 of Cirelli et al. (2021)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studies.cirelli2021.tables import CROSS, FORK, OUTPUT_SIDE, printed

Array = NDArray[np.float64]

ALL, OUTPUT = 0, -1
"""In place of the number of a table: all four, and of these the output side."""


class Distance(NamedTuple):
    """How far computed entries are from printed ones.

    Attributes
    ----------
    table : int
        Number of the printed table (32 entries); `ALL` (128), or `OUTPUT` for the output side of all four (64).
    median, mean, worst : float
        Of the absolute differences, percentage points.
    correlation : float
        Spearman's rank correlation.
    """

    table: int
    median: float
    mean: float
    worst: float
    correlation: float

    @property
    def label(self) -> str:
        """What the entries are, for the reader."""
        return {ALL: "all four", OUTPUT: "output side only"}.get(self.table, f"Table {self.table}")


def distances(computed: Array, signed: bool = False) -> list[Distance]:
    """Distance of Tables 4 to 7, of all four together, and of their output side.

    The input side is close to zero on both sides: its half of the entries makes medians small.

    Parameters
    ----------
    computed : ndarray, shape (4, 2, 8, 2)
        As `paper.tabulated` gives it, with its sign.
    signed : bool
        Compare with the sign; else the modulus.
    """
    table = printed()
    value = computed if signed else np.abs(computed)
    found = []
    for column, part in enumerate((CROSS, FORK)):
        for a in range(len(table.alpha)):
            number = int(table.tables[a, column])
            found.append(_distance(number, value[:, a, part], table.gamma[:, a, part]))
    whole = _distance(ALL, value, table.gamma)
    return [*sorted(found), whole, _distance(OUTPUT, value[:, :, OUTPUT_SIDE], table.gamma[:, :, OUTPUT_SIDE])]


def _distance(number: int, value: Array, target: Array) -> Distance:
    from scipy.stats import spearmanr

    x, y = value.ravel(), target.ravel()
    apart = np.abs(x - y)
    constant = np.ptp(x) == 0.0  # no rank correlation with a table of equal entries
    rank = float("nan") if constant else float(spearmanr(x, y).statistic)
    return Distance(number, float(np.median(apart)), float(apart.mean()), float(apart.max()), rank)
