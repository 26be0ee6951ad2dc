"""Tables as people see them: cells of text."""

from __future__ import annotations

from tolstat.display.table import Table


def head(table: Table) -> list[str]:
    """Headings of the columns that have something to show."""
    return [column.head for column in table.shown]


def body(table: Table) -> list[list[str]]:
    """Cells of each row."""
    return [[column.cell(row) for column in table.shown] for row in table.for_people]
