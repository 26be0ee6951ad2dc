"""General tolerances of ISO 2768-1: deviations of dimensions without individual tolerance."""

from __future__ import annotations

import csv
import math
from functools import cache
from pathlib import Path
from typing import NamedTuple


class Row(NamedTuple):
    """One range of the ISO 2768-1 tables: sizes over `over` up to and including `up_to` (mm)."""

    kind: str
    grade: str
    over: float
    up_to: float
    deviation: float


@cache
def rows_of(path: Path) -> tuple[Row, ...]:
    """Read the general tolerances; deviations in m and rad."""
    factor = {"mm": 1e-3, "arcmin": math.radians(1 / 60)}
    with path.open(encoding="utf-8", newline="") as file:
        return tuple(
            Row(
                row["kind"],
                row["class"],
                float(row["over_mm"]),
                float(row["up_to_mm"]),
                float(row["deviation"]) * factor[row["unit"]],
            )
            for row in csv.DictReader(line for line in file if not line.startswith("#"))
        )


def deviation(path: Path, kind: str, grade: str, nominal: float) -> float:
    """Permissible deviation (plus and minus) of a dimension without individual tolerance.

    Parameters
    ----------
    path : Path
        The table, ``data/iso2768.csv``.
    kind : str
        ``"linear"`` or ``"angular"``.
    grade : str
        Tolerance class, ``"f"`` or ``"m"``.
    nominal : float
        Nominal size (m); for an angle the length of its shorter leg.

    Returns
    -------
    float
        Deviation in m or rad.

    Raises
    ------
    ValueError
        When the table has no such class or ends before that size; the text names the range that it covers.
    """
    rows = [row for row in rows_of(path) if (row.kind, row.grade) == (kind, grade)]
    if not rows:
        raise ValueError(f"no {kind} table for class {grade!r}")
    size = 1e3 * nominal
    fits = (row for row in rows if size <= row.up_to * (1 + 1e-12))
    row = next(fits, None) if size >= rows[0].over * (1 - 1e-12) else None
    if row is None:
        raise ValueError(f"outside the table ({rows[0].over:g} mm to {rows[-1].up_to:g} mm)")
    return row.deviation
