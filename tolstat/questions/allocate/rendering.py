"""Proposed tolerances and the shares that they are expected to give, as columns of tables."""

from __future__ import annotations

from tolstat.common.units import DISPLAY_UNITS
from tolstat.display import text
from tolstat.display.table import Column, Row
from tolstat.study.scaling import marked


def _width(row: Row, key: str) -> str:
    unit, factor = DISPLAY_UNITS.get(row["unit"], (row["unit"], 1.0))
    return marked(row["mark"], f"{factor * row[key]:.4g} {unit}".rstrip())


TOLERANCES = (
    Column("tolerance", lambda row: str(row["tolerance"])),
    Column("errors", lambda row: str(row["errors"]), rank=1),
    Column("before", lambda row: _width(row, "before")),
    Column("proposed", lambda row: _width(row, "proposed")),
    Column("factor", lambda row: f"{row['factor']:.3g}"),
    Column("cost before", lambda row: f"{row['cost_before']:.4g}"),
    Column("cost", lambda row: f"{row['cost']:.4g}"),
)
"""Columns of the table `Allocation.tolerances`."""
LIMITS = (
    Column("target", lambda row: str(row["limit"])),
    Column("before", lambda row: text.percent(row["before"])),
    Column("proposed", lambda row: text.percent(row["estimate"])),
    Column("95 % interval", lambda row: text.span(row["lower"], row["upper"])),
    Column("ppm", lambda row: text.ppm(row["estimate"]), rank=2),
    Column("above in delivery", text.delivery, rank=3),
    Column("counts as joints", lambda row: text.formed(row["ess"], ".0f"), rank=1),
)
"""Columns of the table `Allocation.limits`."""
