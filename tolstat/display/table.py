"""Tables for people: one list of columns, rendered as text for a terminal and as a block of the page.

Text fits a line of `WIDTH` characters: columns are left out, those of the highest rank first, until it does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from tolstat.display.blocks import Table
from tolstat.display.text import align

if TYPE_CHECKING:
    import pandas as pd

Row = Mapping[Any, Any]
WIDTH = 80
"""Characters in a line of a table, unless a wide one is asked for."""


def _always(_: pd.DataFrame) -> bool:
    return True


class Column(NamedTuple):
    """One column of a table for people.

    Attributes
    ----------
    head : str
        Heading.
    cell : callable
        Text of a cell, from its row of the frame.
    words : bool
        Whether cells are words, aligned to the left on the page.
    shown : callable
        Whether the column has anything to show, from the whole frame.
    rank : int
        Columns of the highest rank are left out first if a line of text is too long; those of rank 0 never.
    """

    head: str
    cell: Callable[[Row], str]
    words: bool = False
    shown: Callable[[pd.DataFrame], bool] = _always
    rank: int = 0


def cells(columns: Sequence[Column], table: pd.DataFrame) -> list[list[str]]:
    """Headings, then one row of cells for each row of a frame; without the columns that have nothing to show."""
    used = [column for column in columns if column.shown(table)]
    return [[c.head for c in used], *([c.cell(row) for c in used] for row in table.to_dict("records"))]


def as_text(columns: Sequence[Column], table: pd.DataFrame, width: int | None = WIDTH) -> str:
    """Aligned text of a frame, in lines of at most `width` characters if it can be; None for all columns."""
    return _text(fitting(columns, table, width), table)


def fitting(columns: Sequence[Column], table: pd.DataFrame, width: int | None = WIDTH) -> list[Column]:
    """Columns that `as_text` shows."""
    used = [column for column in columns if column.shown(table)]
    while width is not None and max(map(len, _text(used, table).splitlines())) > width:
        last = max(used, key=lambda column: column.rank)
        if not last.rank:
            break
        used = [column for column in used if column is not last]
    return used


def left_out(columns: Sequence[Column], table: pd.DataFrame, width: int | None = WIDTH) -> str:
    """Sentence that names the columns that `as_text` leaves out; empty if there are none."""
    used = fitting(columns, table, width)
    heads = [column.head for column in columns if column.shown(table) and column not in used]
    return f"with --wide also: {', '.join(heads)}" if heads else ""


def _text(used: Sequence[Column], table: pd.DataFrame) -> str:
    return align(cells(used, table), [column.words for column in used])


def plain(table: pd.DataFrame, ranked: Sequence[str] = ()) -> list[Column]:
    """Columns that show any frame, numbers to five digits; those `ranked` may be left out, the last first."""

    def column(name: str, words: bool) -> Column:
        rank = 1 + list(ranked).index(name) if name in ranked else 0
        return Column(name, lambda row: _short(row[name]), words, rank=rank)

    return [column(str(name), table[name].dtype.kind not in "iufb") for name in table.columns]


def _short(x: Any) -> str:
    return ("-" if math.isnan(x) else f"{x:.5g}") if isinstance(x, float) else str(x)


def as_block(title: str, columns: Sequence[Column], table: pd.DataFrame, verdicts: Sequence[str] = ()) -> Table:
    """Block of the page with a frame; see `blocks.Table`."""
    head, *rows = cells(columns, table)
    words = [column.words for column in columns if column.shown(table)]
    return Table(title, head, rows, frozenset({0} | {i for i, own in enumerate(words) if own}), verdicts)
