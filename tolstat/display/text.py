"""Values, sentences and tables as text: units, intervals, aligned columns, CSV."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from csv import writer
from pathlib import Path
from typing import Any

from tolstat.common import files, loads

LEAST_SHARE = 1e-9
"""Smallest share that is shown: one joint in a billion is beyond what any campaign tells."""


def plain(value: Any) -> Any:
    """Value for JSON: containers and numbers of Python, None for what is not finite."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    value = value.tolist() if hasattr(value, "tolist") else value
    if isinstance(value, list):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def cell(value: Any) -> Any:
    """Value of a cell as spreadsheets may read it: an apostrophe before text that they would take for a formula."""
    return f"'{value}" if isinstance(value, str) and value.startswith(("=", "+", "-", "@", "\t", "\r")) else value


def csv(columns: Mapping[str, Sequence[Any]], stem: Path, what: str) -> Path:
    """Write columns as ``STEM_what.csv``, NaN as an empty cell; return its path."""
    path = stem.with_name(f"{stem.name}_{what}.csv")
    with files.atomic_write(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as stream:
        out = writer(stream, lineterminator="\n")
        out.writerow(columns)
        out.writerows(csv_rows(columns.values()))
    return path


def csv_rows(columns: Iterable[Sequence[Any]]) -> Iterable[tuple[Any, ...]]:
    """Rows of a CSV file from its columns: NaN becomes an empty cell, text is no formula."""
    return zip(*map(_written, columns), strict=True)


def columns_of(rows: Sequence[Mapping[str, Any]]) -> dict[str, list[Any]]:
    """Columns of rows that have the same names."""
    return {name: [row[name] for row in rows] for name in rows[0]} if rows else {}


def _written(column: Sequence[Any]) -> list[Any]:
    """Cells of a column as `csv` writes them."""
    if str in set(map(type, column)):
        column = [cell(x) for x in column]
    return ["" if x is None or x != x else x for x in column]


def align(rows: Sequence[Sequence[str]], words: Sequence[bool] = ()) -> str:
    """Align rows of text in columns: the first and those of `words` to the left, the others to the right."""
    left = [k == 0 or (k < len(words) and words[k]) for k in range(len(rows[0]))]
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = (c.ljust(w) if is_left else c.rjust(w) for c, w, is_left in zip(row, widths, left, strict=True))
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def multiple(largest: float, unit: str) -> tuple[float, str]:
    """Multiple of a unit for values up to `largest`: its size and text; kN and kN m from 1e4 N and N m on; MPa."""
    if unit == "Pa":
        return 1e6, "MPa"
    kilo = unit in ("N", "N*m") and abs(largest) >= 1e4
    return (1e3, f"k{loads.unit_text(unit)}") if kilo else (1.0, loads.unit_text(unit))


def value(x: float, unit: str) -> str:
    """Format a load with its unit, four digits; NaN gives a dash."""
    if math.isnan(x):
        return "-"
    size, name = multiple(x, unit)
    return f"{number(x / size)} {name}".strip()


def limit(row: Mapping[Any, Any]) -> str:
    """Words for a row with ``load``, ``level`` and ``unit``: ``cross1.F > 1500 N``, ``any limit``."""
    name = row["load"]
    return loads.ANY_LIMIT if name == loads.ANY_LIMIT else f"{name} > {value(row['level'], row['unit'])}"


NUMBERS = ("none", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")


def in_words(count: int) -> str:
    """Write a number of parts: ``four``, from 13 on in digits."""
    return NUMBERS[count] if count < len(NUMBERS) else str(count)


def number(x: float) -> str:
    """Format to four digits; numbers below 1e7 have no positive exponent: ``13030``, not ``1.303e+04``."""
    short = f"{x:.4g}"
    return f"{float(short):.0f}" if "e+" in short and abs(x) < 1e7 else short


def several(n: int, noun: str) -> str:
    """Number of things: ``1 joint``, ``2 joints``."""
    return f"{n} {noun}" if n == 1 else f"{n} {noun}s"


def span_of(low: float, high: float, unit: str) -> str:
    """Format an interval of loads with its unit; NaN gives a dash."""
    if math.isnan(low):
        return "-"
    if math.isinf(high):
        return f"{value(low, unit)} .. needs more joints"
    size, name = multiple(high, unit)
    return f"{number(low / size)} .. {number(high / size)} {name}".rstrip()


def sentence(words: str) -> str:
    """Make words a sentence: capital letter (unless the first word has a digit, as names of loads) and full stop."""
    first = words.partition(" ")[0]
    words = words if any(letter.isdigit() for letter in first) else words[:1].upper() + words[1:]
    return words if words.endswith((".", "?", "!")) else f"{words}."


def capital(words: str) -> str:
    """Make the first letter a capital."""
    return f"{words[:1].upper()}{words[1:]}"


def formed(x: float, form: str = ".3g") -> str:
    """Format by a format specification; NaN gives a dash."""
    return "-" if math.isnan(x) else f"{x:{form}}"


def ends(low: float, high: float, form: str) -> str:
    """Format both ends of an interval by a format specification; NaN gives a dash."""
    return "-" if math.isnan(low) else f"{low:{form}} .. {high:{form}}"


def ppm(share: float) -> str:
    """Format a share in parts per million; NaN gives a dash."""
    return "-" if math.isnan(share) else number(1e6 * share)


def delivery(row: Mapping[Any, Any]) -> str:
    """Prediction interval of a row with the columns of `analysis.prediction`; NaN gives a dash."""
    low, high = row["next_lower"], row["next_upper"]
    return "-" if math.isnan(low) else f"{low:.0f} .. {high:.0f} of {row['delivery']:.0f}"


def percent(share: float) -> str:
    """Format a share in per cent, three digits; below `LEAST_SHARE` it is no more than that; NaN gives a dash."""
    return "-" if math.isnan(share) else f"{'< ' if 0.0 < share < LEAST_SHARE else ''}{_in_percent(share)} %"


def _in_percent(share: float) -> str:
    return f"{100.0 * (LEAST_SHARE if 0.0 < share < LEAST_SHARE else share) + 0.0:.3g}"  # no -0


def span(low: float, high: float) -> str:
    """Format an interval of shares in per cent; NaN gives a dash."""
    return "-" if math.isnan(low) else f"{_in_percent(0.0 if 0.0 < low < LEAST_SHARE else low)} .. {percent(high)}"
