"""Tables for people: one list of columns, rendered as text for a terminal and as a block of the page."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from tolstat.display.blocks import Table
from tolstat.display.text import align

if TYPE_CHECKING:
    import pandas as pd

Row = Mapping[Any, Any]


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
    """

    head: str
    cell: Callable[[Row], str]
    words: bool = False
    shown: Callable[[pd.DataFrame], bool] = _always


def cells(columns: Sequence[Column], table: pd.DataFrame) -> list[list[str]]:
    """Headings, then one row of cells for each row of a frame; without the columns that have nothing to show."""
    used = [column for column in columns if column.shown(table)]
    return [[c.head for c in used], *([c.cell(row) for c in used] for row in table.to_dict("records"))]


def as_text(columns: Sequence[Column], table: pd.DataFrame) -> str:
    """Aligned text of a frame."""
    return align(cells(columns, table))


def as_block(title: str, columns: Sequence[Column], table: pd.DataFrame, verdicts: Sequence[str] = ()) -> Table:
    """Block of the page with a frame; see `blocks.Table`."""
    head, *rows = cells(columns, table)
    words = [column.words for column in columns if column.shown(table)]
    return Table(title, head, rows, frozenset({0} | {i for i, own in enumerate(words) if own}), verdicts)
