"""Text tables that other programs write: measured parts, signals, costs, errors of joints.

Tabs, semicolons or commas separate cells: the first of them that the header has. Where it is no comma, numbers may
have a decimal comma. Lines that begin with #, and lines without text, are left out.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping, Sequence
from io import StringIO
from operator import itemgetter
from pathlib import Path

import numpy as np
from pydantic_core import PydanticCustomError

from tolstat.common import strict, units
from tolstat.common.errors import Fault, raise_all
from tolstat.common.loads import FloatArray
from tolstat.common.notation import MINUS

SHOWN = 20
"""Maximum number of faults of a file that a message lists."""
_HEAD = re.compile(r"(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\))?", re.DOTALL)
"""Name and unit in a cell of the header; in parentheses a usual unit only."""
_UNIT = re.compile(r"(?!(?:nan|inf|infinity)$)(?:1\s*/\s*)?[^\W\d_].*|[°%].*|[1-]|", re.IGNORECASE)
"""Unit in a cell below the header."""
_PURE = {"", "1", "-"}
"""What stands for the unit of a pure number."""
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?", re.ASCII | re.IGNORECASE)


def number(text: str) -> float:
    """Finite number that a text is, with a decimal point; NaN if it is none."""
    text = text.translate(MINUS)
    value = float(text) if _NUMBER.fullmatch(text) else math.nan
    return value if math.isfinite(value) else math.nan


def shortened(faults: Sequence[Fault], path: Path) -> list[Fault]:
    """First faults of a file, and how many more there are."""
    rest = Fault(str(path), f"and {len(faults) - SHOWN} more faults", "mend these first")
    return [*faults[:SHOWN], *([rest] if len(faults) > SHOWN else [])]


class TextTable:
    """Cells of a text table, and its faults, which are collected until `check` raises them.

    Parameters
    ----------
    path : Path
        Text in UTF-8, or in UTF-16 with its mark, as Excel's "Unicode text" is.

    Attributes
    ----------
    head : int
        Line of the header.
    columns : dict of str to int
        Place of each column that has a name.
    units : dict of str to str
        Unit of each column, from the header or the row below it; empty where there is none.
    rows : list of (int, list of str)
        Line of each row below the header, and its cells.

    Raises
    ------
    InputError
        When the file cannot be read as text.
    """

    def __init__(self, path: Path) -> None:
        self.path, self._faults = path, list[tuple[int, Fault]]()
        lines = list(StringIO(strict.read_text(path, utf_16=True), newline=""))
        comments = {line: text for line, text in enumerate(lines, start=1) if text.lstrip().startswith("#")}
        lines = ["\n" if line in comments else text for line, text in enumerate(lines, start=1)]
        first = re.sub('"[^"]*"', "", next((text for text in lines if text.strip()), ""))
        self.separator = next((mark for mark in "\t;" if mark in first), ",")
        (self.head, header), *records = self._records(lines) or [(1, [])]
        self.columns: dict[str, int] = {}
        self.units: dict[str, str] = {}
        for index, cell in enumerate(header):
            name, unit = _name_and_unit(cell)
            if name in self.columns:
                self.fault(self.head, name, "is there twice", "rename or remove one of the columns")
            if name:
                self.columns[name], self.units[name] = index, unit
        self.rows = [(line, cells) for line, cells in records if len(cells) == len(header)]
        self._refused = [(line, len(cells)) for line, cells in records if len(cells) != len(header)]
        self._marks: dict[str, tuple[int, str]] = {}
        for line, number in self._refused:
            remedy = "give a cell for each column"
            if self.separator == "," and number > len(header):
                remedy += "; write decimals with a point, or separate cells by semicolons"
            self.fault(line, "", f"has {number} cells, the header {len(header)}", remedy)
        for line, text in comments.items():
            if line > self.head and 1 < len(header) == text.count(self.separator) + 1:
                remedy = "remove the line, or its #; put comments above the header"
                self.fault(line, "", "begins with # and has as many cells as the header", remedy)

    def _records(self, lines: Sequence[str]) -> list[tuple[int, list[str]]]:
        """Cells of each row that has text, and its first line."""
        reader = csv.reader(lines, delimiter=self.separator, skipinitialspace=True, strict=True)
        records, line = [], 1
        try:
            for row in reader:
                cells = [cell.strip() for cell in row]
                if any(cells):
                    records.append((line, cells))
                line = reader.line_num + 1
        except csv.Error as error:
            self.fault(line, "", f"cannot be split into cells: {error}", "write quotes in pairs around a whole cell")
        return records

    def fault(self, line: int, name: str, found: str, remedy: str) -> None:
        """Add a fault of a line, and of its column `name` unless that is empty."""
        self._faults.append((line, Fault(f"{self.path}:{line}{f': {name}' if name else ''}", found, remedy)))

    def faults(self) -> list[Fault]:
        """Faults that were found, in the order of the lines."""
        if len(self._marks) > 1:
            (first, one), (second, other) = sorted(self._marks.values())
            found = f"{other!r} has another decimal mark than {one!r} in line {first}"
            self.fault(second, "", found, "write all decimals alike, and no thousands separators")
        return [fault for _, fault in sorted(self._faults, key=itemgetter(0))]

    def check(self) -> None:
        """Raise the faults that were found, see `shortened`.

        Raises
        ------
        InputError
            When there are any.
        """
        raise_all(shortened(self.faults(), self.path))

    def number(self, line: int, cell: str) -> float:
        """Finite number in a cell; NaN where there is none."""
        if self.separator == ",":
            return number(cell)
        value = number(cell.replace(",", "."))
        if not math.isnan(value):
            for mark in ",.":
                if mark in cell:
                    self._marks.setdefault(mark, (line, cell))
        return value

    def numbers(
        self,
        si: Mapping[str, str],
        needed: Sequence[str],
        least: int,
        unit_of: Mapping[str, str] | None = None,
        otherwise: str = "",
    ) -> dict[str, FloatArray]:
        """Columns of numbers; faults are collected.

        Parameters
        ----------
        si : mapping of str to str
            SI unit of each column that is read if there is one of this name.
        needed : sequence of str
            Columns that must be there.
        least : int
            Minimum number of rows.
        unit_of : mapping of str to str, optional
            Units of columns that have none in the file; a column needs a unit there or here unless it is a pure number.
        otherwise : str
            What else can be done where a column is missing.

        Returns
        -------
        dict of str to ndarray, (n,)
            SI; NaN where there is a fault.
        """
        if missing := [name for name in needed if name not in self.columns]:
            headers = ", ".join(
                f"{name} [{_usual(si[name])}]" if si.get(name, "1") != "1" else name for name in missing
            )
            remedy = f"add the headers {headers}{otherwise}; there are {', '.join(self.columns) or 'none'}"
            self.fault(self.head, "", f"has no column {', '.join(map(repr, missing))}", remedy)
        columns = {name: self.columns[name] for name in si if name in self.columns}
        line_of_units = self._take_units(columns)
        if any(self.units[name] for name in columns):
            unit_of = {}  # where some columns say their unit, none is taken for granted
        values = np.array([[self.number(line, cells[i]) for i in columns.values()] for line, cells in self.rows])
        values = values.reshape(len(self.rows), len(columns))
        for row, column in np.argwhere(np.isnan(values)):
            (line, cells), name = self.rows[row], list(columns)[column]
            remedy = "give a number, without unit and thousands separators"
            cell = cells[columns[name]]
            self.fault(
                line, name, f"{cell!r} is no finite number" if cell else "has no number: the cell is empty", remedy
            )
        if (number := len(self.rows) + len(self._refused)) < least:
            self.fault(self.head, "", f"has {number} rows below it", f"give at least {least}")
        return {
            name: self._factor(line_of_units, name, si[name], (unit_of or {}).get(name, "")) * values[:, column]
            for column, name in enumerate(columns)
        }

    def _take_units(self, columns: Mapping[str, int]) -> int:
        """Take the first row for units where the header has none and the row no numbers; returns the line of units."""
        if not self.rows or any(self.units[name] for name in columns):
            return self.head
        line, cells = self.rows[0]
        units_of = {name: _in_brackets(cells[column]) for name, column in columns.items()}
        if not all(map(_UNIT.fullmatch, units_of.values())) or set(units_of.values()) <= _PURE:
            return self.head
        self.units |= units_of
        del self.rows[0]
        return line

    def _factor(self, line: int, name: str, si: str, otherwise: str) -> float:
        """Factor from the unit of a column to SI."""
        unit = self.units[name] or otherwise
        try:
            return units.to_si(1.0 if unit in _PURE else f"1 {unit}", si)
        except PydanticCustomError:
            found = f"[{unit}] is no unit of it" if unit else "has no unit"
            self.fault(line, name, found, f"write its unit into the header: {name} [{_usual(si)}]")
            return math.nan


def _name_and_unit(cell: str) -> tuple[str, str]:
    """Name and unit in a cell of the header; the unit is empty where there is none."""
    name, brackets, parentheses = _HEAD.fullmatch(cell).groups("")  # type: ignore[union-attr]  # it matches any text
    if not parentheses or any(parentheses in usual for usual in units.FACTORS.values()):
        return name, brackets or parentheses
    return cell, ""


def _in_brackets(cell: str) -> str:
    """Text of a cell, of one in brackets or parentheses without these."""
    return cell[1:-1].strip() if (cell[:1], cell[-1:]) in (("[", "]"), ("(", ")")) else cell


def _usual(si: str) -> str:
    """Unit that people write for values of an SI unit."""
    return units.DISPLAY_UNITS.get(si, (si,))[0].replace(" ", "*") or "1"
