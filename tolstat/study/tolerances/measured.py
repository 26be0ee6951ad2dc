"""Entry of ``[tolerances]`` that brings its measured parts: drawn as they are, or a sample of a law."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from io import StringIO
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field

from tolstat.analysis.process import LEAST_PARTS
from tolstat.common import strict, units
from tolstat.common.files import about_encoding, read_input
from tolstat.common.strict import refuse
from tolstat.study.tolerances import distributions as tolerance
from tolstat.study.tolerances.entry import SingleEntry, Site

RARE = 0.005
"""Share of the parts beyond a value that a reader of a tail asks about."""


class MeasuredEntry(SingleEntry):
    """Measured parts of a CSV file with a header row, drawn with equal probability; or, with `law`, its sample.

    With `law` mean and deviation of the sample are those of the parts, and the study knows that they are estimates.
    """

    distribution: Literal["measured"]
    file: str | None = Field(default=None, examples=["rattle.csv"])
    """path of the CSV file, from the study's folder"""
    column: str | None = Field(default=None, examples=["speed_rpm"])
    """name of the column in the header row"""
    values: list[float] | None = Field(default=None, examples=[[0.012, -0.004, 0.007]])
    """the measured values, in place of a file; needs `law`"""
    unit: str | None = Field(default=None, examples=["rpm"])
    """unit of the values; needed unless the error is a pure number"""
    law: Literal["normal", "lognormal"] | None = Field(default=None, examples=["normal"])
    """law that the parts are a sample of, for shares far out; without it each joint has one of the measured values"""

    def measured_parts(self, site: Site) -> int | None:
        """See `ToleranceEntry.measured_parts`."""
        return len(self._values(site)) if self.law else None

    def build(self, site: Site) -> tolerance.Measured | tolerance.Normal | tolerance.LogNormal:
        """See `ToleranceEntry.build`."""
        values = self._values(site)
        if self.values is not None and self.law is None:
            beyond = f"a value that {100 * RARE:g} % of the parts exceed lies beyond all of them with probability"
            found = f"a sample of {len(values)} has no tail: {beyond} {100 * (1.0 - RARE) ** len(values):.0f} %"
            raise refuse(found, 'add law = "normal" or "lognormal"')
        if self.unit is None and site.unit != "1":
            raise refuse("missing key unit", 'add the unit of the values, for example unit = "mm"')
        factor = units.to_si(1.0 if self.unit is None else f"1 {self.unit}", site.unit)
        if self.law is None:
            return tolerance.Measured.of(factor * value for value in values)
        return _fitted(self.law, factor * np.array(values))

    def number(self, site: Site) -> str:
        """See `SingleEntry.number`."""
        return f"{len(self._values(site))} measured parts"

    def band(self, site: Site) -> None:
        """See `SingleEntry.band`."""

    def _values(self, site: Site) -> Sequence[float]:
        if (self.values is None) == (self.file is None):
            raise refuse("needs either file and column, or values", "give one of the two")
        if self.values is not None:
            if self.column is not None:
                raise refuse("column without file", "remove it")
            if not all(map(math.isfinite, self.values)):
                raise refuse("a value is not a finite number", "give finite numbers")
            return self.values
        if self.file is None or self.column is None:
            raise refuse("file without column", "add the name of the column")
        return _read(site.folder / self.file, self.column)


def _fitted(law: str, values: tolerance.Array) -> tolerance.Normal | tolerance.LogNormal:
    """Law with the mean and deviation of the sample; of its logarithms for the lognormal law."""
    if len(values) < LEAST_PARTS:
        raise refuse(f"{len(values)} parts are too few for a law", f"give at least {LEAST_PARTS} parts")
    if law == "lognormal":
        if not values.min() > 0.0:
            raise refuse("a value is not above zero, which a lognormal law needs", 'write law = "normal"')
        values = np.log(values)
    normal = tolerance.Normal(float(values.mean()), float(values.std(ddof=1)))
    if not normal.sigma > 0.0:
        raise refuse("all measured values are equal", "give the values as they were measured")
    return normal if law == "normal" else tolerance.LogNormal(0.0, normal)


def _read(path: Path, column: str) -> list[float]:
    try:
        lines = StringIO(read_input(path), newline="")
        rows = csv.DictReader(line for line in lines if line.strip() and not line.startswith("#"))
        cells = [row.get(column) for row in rows]
        columns = rows.fieldnames or ()
    except UnicodeDecodeError as error:
        found, remedy = about_encoding(error)
        raise refuse(f"{path} {found}", remedy) from error
    except (OSError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise refuse(
            f"{path} cannot be read: {reason}", "give a CSV file; its path starts from the study's folder"
        ) from error
    if column not in columns:
        remedy = strict.did_you_mean(column, list(columns))
        raise refuse(f"{path} has no column {column!r}", remedy)
    values = []
    for number, cell in enumerate(cells, start=1):
        value = _number(cell)
        if value is None:
            raise refuse(f"{path}: row {number} of {column!r} is {cell!r}", "give a finite number in each row")
        values.append(value)
    if len(values) < 2:
        raise refuse(f"{path} has {len(values)} values in {column!r}", "give at least two measured parts")
    return values


def _number(cell: str | None) -> float | None:
    try:
        value = float(cell or "")
    except ValueError:
        return None
    return value if math.isfinite(value) else None
