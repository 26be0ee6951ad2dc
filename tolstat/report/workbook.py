"""A campaign as an Excel workbook: joints, limits and units, a sheet each."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tolstat.common.errors import Fault, InputError
from tolstat.common.loads import load_of
from tolstat.display.text import cell
from tolstat.questions.exceedance.rows import limit_rows
from tolstat.store import Reader
from tolstat.store.result_file import described
from tolstat.store.view import View

if TYPE_CHECKING:
    import pandas as pd


MAX_ROWS = 1_048_575
"""Number of joints that a sheet of Excel can hold below its heading."""
LIMITS = ("load", "limit", "unit", "above", "joints", "share", "lower", "upper", "confidence", "nominal")
"""Columns of the sheet ``limits``."""


def check(store: Reader, option: str) -> None:
    """Check that a workbook of a campaign can be written.

    Raises
    ------
    InputError
        When openpyxl is not installed, or the campaign has more joints than a sheet has rows.
    """
    if find_spec("openpyxl") is None:
        raise InputError(
            [Fault(option, "openpyxl is not installed", "install it with: pip install openpyxl, or use --csv OUT")]
        )
    if store.n > MAX_ROWS:
        found = f"{store.path} has {store.n} joints, a sheet of Excel has {MAX_ROWS} rows"
        raise InputError([Fault(option, found, "use --parquet OUT or --csv OUT")])


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

    book, columns = Workbook(write_only=True), described(store)
    joints = zip(frame.index.tolist(), *(frame[name].tolist() for name in frame), strict=True)
    _sheet(book, "joints", ["row", *map(str, frame.columns)], joints)
    _sheet(book, "limits", LIMITS, _limits(View(store)))
    meanings = {name: column.description for name, column in columns.items()}
    units = ((name, unit, meanings.get(name, "")) for name, unit in frame.attrs["units"].items())
    _sheet(book, "units", ("column", "unit", "meaning"), units)
    whole = BytesIO()  # openpyxl does not recover from a full disk
    book.save(whole)
    path.write_bytes(whole.getvalue())


def _limits(view: View) -> Iterable[Sequence[object]]:
    if not view.sampled:  # joints of a sweep or a list are no sample, whose shares would mean something
        return [(name, limit, load_of(name).unit) for name, limit in view.limits.items()]
    names = ("load", "level", "unit", "count", "valid", "estimate", "lower", "upper", "confidence", "nominal")
    rows = [{**row, "valid": row["n"] - row["n_failed"] - row["n_unsettled"]} for row in limit_rows(view)]
    return [[row[name] for name in names] for row in rows]


def _sheet(book: Any, name: str, heads: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Append a sheet with a heading in bold that stays in view."""
    from openpyxl.cell import WriteOnlyCell
    from openpyxl.styles import Font
    from openpyxl.utils import get_column_letter

    sheet = book.create_sheet(name)
    sheet.freeze_panes = "B2"
    for k, head in enumerate(heads, 1):
        sheet.column_dimensions[get_column_letter(k)].width = max(10, min(len(head) + 2, 40))
    bold = []
    for head in heads:
        bold.append(WriteOnlyCell(sheet, value=head))
        bold[-1].font = Font(bold=True)
    sheet.append(bold)
    for row in rows:
        sheet.append([None if isinstance(value, float) and not math.isfinite(value) else cell(value) for value in row])
