"""What the entries of ``[tolerances]`` mean, as columns and as a part of the page."""

from __future__ import annotations

import math

import pandas as pd

from tolstat.common import units
from tolstat.display import text
from tolstat.display.blocks import Block, Section, Text
from tolstat.display.table import Column, as_block
from tolstat.store.view import View
from tolstat.study.tolerances import meaning

ENTRIES = (
    Column("tolerance", lambda row: str(row["entry"])),
    Column("its number", lambda row: str(row["number"]), words=True),
    Column("error", lambda row: str(row["errors"]), words=True, rank=1),
    Column("sigma", lambda row: units.shown(row["sigma"], row["unit"])),
    Column("outside", lambda row: text.percent(math.nan if row["outside"] is None else row["outside"])),
)
"""Columns of the table `meaning.table`."""
CORRELATED = (
    Column("correlated errors", lambda row: str(row["errors"])),
    Column("pairs", lambda row: str(row["pairs"])),
    Column("rho of normal scores", lambda row: f"{row['rho']:.3g}"),
    Column("Pearson", lambda row: f"{row['pearson']:.3f}"),
    Column("Spearman", lambda row: f"{row['spearman']:.3f}"),
)
"""Columns of the table `meaning.correlations`."""


def section(view: View) -> Section:
    """Part of the page with the meaning of the tolerances, and of their correlation."""
    study = view.study
    blocks: list[Block] = [as_block("Entries of [tolerances]", ENTRIES, meaning.table(study.entries))]
    said = "Sigma: standard deviation of one error. Outside: share of the parts outside the drawing's band or zone."
    correlated = meaning.correlations(study.copula, study.tolerances)
    if len(correlated):
        blocks.append(as_block("Correlation", CORRELATED, correlated))
        said += " Rho is given for the normal scores; Pearson's and Spearman's correlation are those of the errors."
    return Section("tolerances", "What the tolerances mean", [*blocks, Text(said, small=True)])


def as_text(entries: pd.DataFrame, correlated: pd.DataFrame) -> list[str]:
    """Both tables as lines of text; none for a study without tolerances."""
    from tolstat.display import table

    pairs = ((ENTRIES, entries), (CORRELATED, correlated))
    return [line for columns, rows in pairs if len(rows) for line in ("", table.as_text(columns, rows))]
