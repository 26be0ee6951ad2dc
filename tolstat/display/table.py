"""Tables: numbers for JSON and files, and columns for people, shown on a terminal and on the page.

Text fits a line of `WIDTH` characters: columns are left out, those of the highest rank first, until it does.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import zip_longest
from typing import Any, NamedTuple

from tolstat.display.text import align, formed

Row = Mapping[Any, Any]
Rows = Sequence[Row]
WIDTH = 80
"""Characters in a line of a table, unless a wide one is asked for."""
WIDE = 160
"""Characters in a line of a wide table, whose longest words are folded."""

_LEAST = 12
"""Least width of a column of words that is folded."""


def has(name: str) -> Callable[[Rows], bool]:
    """`Column.shown` of a column that is shown if any row has a value, not NaN, of this name."""
    return lambda rows: any(name in row and row[name] is not None and row[name] == row[name] for row in rows)


def has_unresolved(rows: Rows) -> bool:
    """`Column.shown` of a column on joints that failed or did not settle."""
    return any(row["n_failed"] + row["n_unsettled"] for row in rows)


class Column(NamedTuple):
    """One column of a table for people.

    Attributes
    ----------
    head : str
        Heading.
    cell : callable
        Text of a cell, from its row.
    words : bool
        Whether cells are words, aligned to the left on the page.
    shown : callable
        Whether the column has anything to show, from all rows.
    rank : int
        Columns of the highest rank are left out first if a line of text is too long; those of rank 0 never.
    """

    head: str
    cell: Callable[[Row], str]
    words: bool = False
    shown: Callable[[Rows], bool] = lambda rows: True
    rank: int = 0


@dataclass(frozen=True)
class Table:
    """A table: all its rows as numbers, and how people see them.

    Attributes
    ----------
    name : str
        Key in JSON, and end of the name of its CSV file.
    title : str
        What it shows.
    columns : sequence of Column
        Columns that people see; none for a table that only JSON, CSV files and frames have.
    rows : sequence of mapping
        Values by key in SI units, the same keys in each row; a row with values of one unit may have a key ``unit``.
    units : mapping
        Units by key, where rows have none of their own.
    seen : sequence of mapping, optional
        What `columns` take their cells from: some of the rows, or rows arranged for people; by default all rows.
    verdicts : sequence of str
        Verdict of each row, ``yes``, ``no``, ``open`` or empty, which styles its second cell on the page. Empty if
        nothing is judged.
    """

    name: str
    title: str
    columns: Sequence[Column]
    rows: Rows
    units: Mapping[str, str] = field(default_factory=dict)
    seen: Rows | None = None
    verdicts: Sequence[str] = ()

    @property
    def for_people(self) -> Rows:
        """Rows that people see."""
        return self.rows if self.seen is None else self.seen

    @property
    def shown(self) -> list[Column]:
        """Columns that have something to show."""
        return [column for column in self.columns if column.shown(self.for_people)]


def by_share(rows: Rows, *keys: str) -> Rows:
    """Rows with the same values of `keys` as one: these values, and each row by its ``share``."""
    grouped: dict[tuple[Any, ...], dict[Any, Any]] = {}
    for row in rows:
        grouped.setdefault(tuple(row[key] for key in keys), {key: row[key] for key in keys})[row["share"]] = row
    return list(grouped.values())


def alike(rows: Rows, columns: Sequence[Column]) -> Rows:
    """Rows whose cells all agree but for the ``load`` as one, with the names of all loads; other rows as they are."""
    grouped: dict[tuple[str, ...], list[Row]] = {}
    for row in rows:
        cells = tuple(column.cell({**row, "load": ""}) for column in columns if column.shown(rows))
        grouped.setdefault(cells, []).append(row)
    return [{**same[0], "load": ", ".join(row["load"] for row in same)} for same in grouped.values()]


def of_shares(shares: Sequence[float], head: str, cell: Callable[[Row], str], rank: int = 0) -> list[Column]:
    """Columns of the rows of `by_share`, one a share: ``99 % reach``; the last one is never left out, see `Column`."""

    def column(share: float) -> Column:
        return Column(f"{100.0 * share:g} % {head}", lambda row: cell(row[share]), rank=rank * (share != shares[-1]))

    return list(map(column, shares))


def fitted(columns: Sequence[Column], rows: Rows, width: int | None = WIDTH) -> tuple[str, str]:
    """Aligned text of a table in lines of at most `width` characters if it can be, and what it leaves out.

    Without `width` it has all columns, and words are folded to lines of `WIDE` characters. The second text is a
    sentence that names the columns left out; empty if there are none.
    """
    able = used = [column for column in columns if column.shown(rows)]
    while True:
        words = [column.words for column in used]
        cells = [[column.head for column in used], *([column.cell(row) for column in used] for row in rows)]
        shown = align(_folded(cells, words) if width is None else cells, words)
        last = max(used, key=lambda column: column.rank)
        if width is None or not last.rank or max(map(len, shown.splitlines())) <= width:
            break
        used = [column for column in used if column is not last]
    heads = [column.head for column in able if column not in used]
    return shown, f"with --wide also: {', '.join(heads)}" if heads else ""


def _folded(rows: Sequence[Sequence[str]], words: Sequence[bool]) -> list[list[str]]:
    """Rows of text whose longest columns of `words` are folded, so that they fit a line of `WIDE` characters."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    while sum(widths) + 2 * (len(widths) - 1) > WIDE:
        longest = max((width, k) for k, width in enumerate(widths) if words[k] or not k)[1]
        if widths[longest] <= _LEAST:
            break
        widths[longest] -= 1
    lines = []
    for row in rows:
        folded = ([cell] if len(cell) <= w else textwrap.wrap(cell, w) for cell, w in zip(row, widths, strict=True))
        lines += [list(line) for line in zip_longest(*folded, fillvalue="")]
    return lines


def plain(rows: Rows, ranked: Sequence[str] = ()) -> list[Column]:
    """Columns that show any rows, numbers to five digits; those `ranked` may be left out, the last first."""

    def column(name: str) -> Column:
        words = any(isinstance(row[name], str) for row in rows)
        rank = 1 + list(ranked).index(name) if name in ranked else 0
        return Column(
            name.replace("N*m", "N m"),
            lambda row: formed(row[name], ".5g") if isinstance(row[name], float) else str(row[name]),
            words,
            rank=rank,
        )

    return [column(name) for name in (rows[0] if rows else ())]
