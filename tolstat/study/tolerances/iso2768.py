"""General tolerances of ISO 2768-1: deviations of dimensions without individual tolerance."""

from __future__ import annotations

import csv
import math
from functools import cache

from tolstat.common.files import data_dir


@cache
def ranges(kind: str, grade: str) -> list[tuple[float, float, float]]:
    """Return the ranges of sizes of a table: over and up to and including (mm), with the deviation in m or rad."""
    factor = {"mm": 1e-3, "arcmin": math.radians(1 / 60)}
    with (data_dir() / "iso2768.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return [
        (float(row["over_mm"]), float(row["up_to_mm"]), float(row["deviation"]) * factor[row["unit"]])
        for row in rows
        if (row["kind"], row["class"]) == (kind, grade)
    ]


def deviation(kind: str, grade: str, nominal: float) -> float:
    """Permissible deviation (plus and minus) of a dimension without individual tolerance.

    Parameters
    ----------
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
        When there is no table of that class or it ends before that size; the text names the range that it covers.
    """
    table, size = ranges(kind, grade), 1e3 * nominal
    if not table:
        raise ValueError(f"no {kind} table for class {grade!r}")
    (least, *_), (_, most, _) = table[0], table[-1]
    if not least * (1 - 1e-12) <= size <= most * (1 + 1e-12):
        raise ValueError(f"outside the table ({least:g} mm to {most:g} mm)")
    return next(found for _, up_to, found in table if size <= up_to * (1 + 1e-12))
