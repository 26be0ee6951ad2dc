"""Tables of ISO 286, zones of a hole and a shaft, and of ISO 2768-1, dimensions without individual tolerance."""

from __future__ import annotations

import math
import re
from functools import cache
from typing import NamedTuple

from tolstat.common.files import data_rows

GRADES, DEVIATIONS = "iso286_grades.csv", "iso286_deviations.csv"
"""Files of the data folder."""
CLEARANCE, TRANSITION = ("c", "d", "e", "f", "g", "h"), ("js", "k", "m", "n", "p", "r", "s")
"""Letters of shafts that lie at or below the basic size, and of shafts that reach above it."""
SHAFTS = (*CLEARANCE, *TRANSITION)
"""Letters of shafts, from the loosest to the tightest."""
HOLES = (*(letter.upper() for letter in CLEARANCE), "JS")
"""Letters of holes: those whose deviations are the shaft's with the opposite sign at every size and grade."""
GRADE_NAMES = ("01", *map(str, range(19)))
LARGEST = 500.0
"""Largest basic size of the tables, mm."""
_K_GRADES = ("4", "5", "6", "7")
_CODE = re.compile(r"\s*([A-Z]+)\s*(\d+)\s*/\s*([a-z]+)\s*(\d+)\s*")


class Zone(NamedTuple):
    """Tolerance zone of a diameter: lower and upper limit deviation from the basic size, um."""

    lower: float
    upper: float

    @property
    def middle(self) -> float:
        """Middle of the zone, um."""
        return 0.5 * (self.lower + self.upper)

    @property
    def half(self) -> float:
        """Half its width, um."""
        return 0.5 * (self.upper - self.lower)


class Zones(NamedTuple):
    """Tolerance zones of a fit."""

    hole: Zone
    shaft: Zone

    @property
    def least(self) -> float:
        """Smallest clearance within the zones (difference of the diameters), um; negative if parts can interfere."""
        return self.hole.lower - self.shaft.upper

    @property
    def largest(self) -> float:
        """Largest clearance within the zones, um."""
        return self.hole.upper - self.shaft.lower

    @property
    def kind(self) -> str:
        """``"clearance"``, ``"transition"`` or ``"interference"``."""
        return "clearance" if self.least >= 0.0 else "transition" if self.largest > 0.0 else "interference"


class Code(NamedTuple):
    """Letters and grades of a hole and a shaft."""

    hole: str
    hole_grade: str
    shaft: str
    shaft_grade: str

    def __str__(self) -> str:
        return f"{self.hole}{self.hole_grade}/{self.shaft}{self.shaft_grade}"


def parse(code: str) -> Code:
    """Read the code of a fit, ``"H7/f7"``: class of the hole, then of the shaft.

    Raises
    ------
    ValueError
        For a code that the tables do not have; the text names what they have.
    """
    match = _CODE.fullmatch(code)
    if match is None:
        raise ValueError(f"{code!r} is not the class of a hole, a slash and the class of a shaft")
    read = Code(*match.groups())
    for kind, letter, letters in (("hole", read.hole, HOLES), ("shaft", read.shaft, SHAFTS)):
        if letter not in letters:
            raise ValueError(f"the tables have no {kind} {letter}, only {', '.join(letters)}")
    for grade in (read.hole_grade, read.shaft_grade):
        if grade not in GRADE_NAMES:
            raise ValueError(f"there is no grade IT{grade}, only IT01, IT0, IT1 to IT18")
    return read


def zones(code: Code, size: float) -> Zones:
    """Tolerance zones of a fit.

    Parameters
    ----------
    code : Code
        As `parse` reads it.
    size : float
        Basic size, mm: above 0, at most `LARGEST`.

    Returns
    -------
    Zones
        Limit deviations, um.
    """
    mirrored = _shaft(code.hole.lower(), code.hole_grade, size)
    return Zones(Zone(0.0 - mirrored.upper, 0.0 - mirrored.lower), _shaft(code.shaft, code.shaft_grade, size))


def _shaft(letter: str, grade: str, size: float) -> Zone:
    """Zone of a shaft."""
    width = _row(GRADES, size)[f"IT{grade}"]
    if letter == "js":
        return Zone(-0.5 * width, 0.5 * width)
    deviation = _row(DEVIATIONS, size)[letter]
    if letter in CLEARANCE:
        return Zone(deviation - width, deviation)
    if letter == "k" and grade not in _K_GRADES:
        deviation = 0.0
    return Zone(deviation, deviation + width)


def _row(name: str, size: float) -> dict[str, float]:
    """Row of a table for a basic size, mm: column to number."""
    return next(row for row in table(name) if size <= row["up_to_mm"] * (1 + 1e-12))


@cache
def table(name: str) -> tuple[dict[str, float], ...]:
    """Read a table of the data folder: rows by ascending size, numbers by column (mm, um)."""
    return tuple({column: float(text) for column, text in row.items()} for row in data_rows(name))


@cache
def ranges(kind: str, grade: str) -> list[tuple[float, float, float]]:
    """Return the ranges of sizes of a table: over and up to and including (mm), with the deviation in m or rad."""
    factor = {"mm": 1e-3, "arcmin": math.radians(1 / 60)}
    return [
        (float(row["over_mm"]), float(row["up_to_mm"]), float(row["deviation"]) * factor[row["unit"]])
        for row in data_rows("iso2768.csv")
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
    return next(value for _, up_to, value in table if size <= up_to * (1 + 1e-12))
