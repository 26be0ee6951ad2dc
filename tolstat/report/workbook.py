"""A campaign as an Excel workbook: joints, limits and units, a sheet each."""

from __future__ import annotations

import math
from io import BytesIO
from pathlib import Path
from typing import Any

from tolstat.common.late import pandas as pd
from tolstat.common.loads import load_of
from tolstat.display.text import cell
from tolstat.questions.exceedance.rows import limit_rows
from tolstat.store import Reader, result_file
from tolstat.store.view import View

MAX_ROWS = 1_048_575
"""Number of joints that a sheet of Excel can hold below its heading."""
LIMITS = ("load", "limit", "unit", "above", "joints", "share", "lower", "upper", "confidence", "nominal")
"""Columns of the sheet ``limits``."""


def write(store: Reader, frame: pd.DataFrame, path: Path) -> None:
    """Write the workbook.

    Parameters
    ----------
    store : ResultFile
        The campaign.
    frame : DataFrame
        Its joints, as `ResultFile.to_pandas` returns them: sheet ``joints``, SI units.
    path : Path
        File to write. Sheet ``limits`` has the share of the joints with a valid load above each limit, and its
        interval (empty unless joints are independent samples); sheet ``units`` has unit and meaning of each column.
    """
    from openpyxl import Workbook

    columns = result_file.described(store)
    meanings = {name: column.description for name, column in columns.items()}
    units = [(name, unit, meanings.get(name, "")) for name, unit in frame.attrs["units"].items()]
    sheets = {
        "joints": (("row", *frame.columns), frame.itertuples(name=None)),
        "limits": (LIMITS, _limits(View(store))),
        "units": (("column", "unit", "meaning"), units),
    }
    book = Workbook(write_only=True)  # a row at a time
    for name, (heads, rows) in sheets.items():
        sheet = book.create_sheet(name)
        sheet.freeze_panes = "B2"
        sheet.append(heads)
        for row in rows:
            sheet.append([_finite(value) for value in row])
    whole = BytesIO()  # openpyxl does not recover from a full disk
    book.save(whole)
    path.write_bytes(whole.getvalue())


def _limits(view: View) -> list[tuple[object, ...]]:
    if not view.sampled:  # joints of a sweep or a list are no sample, whose shares would mean something
        return [(name, limit, load_of(name).unit) for name, limit in view.limits.items()]
    names = ("load", "level", "unit", "count", "valid", "estimate", "lower", "upper", "confidence", "nominal")
    rows = [{**row, "valid": row["n"] - row["n_failed"] - row["n_unsettled"]} for row in limit_rows(view)]
    return [tuple(row[name] for name in names) for row in rows]


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else cell(value)
