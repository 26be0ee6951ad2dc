"""Joints of a result file as a table for other programs: CSV, Parquet or Excel."""

from __future__ import annotations

import csv
import importlib.util
from pathlib import Path
from typing import TextIO

from tolstat.common.errors import Fault, InputError
from tolstat.common.files import atomic_write
from tolstat.common.late import pandas as pd
from tolstat.display import text
from tolstat.store.reader import Reader
from tolstat.store.result_file import in_blocks, viewed
from tolstat.store.view import View

NEEDS = {".csv": "", ".parquet": "pyarrow", ".xlsx": "openpyxl"}
"""Package that writes files with an ending."""
SHEET = 1 << 20, 1 << 14
"""Rows and columns that a sheet of Excel has."""


def write_table(source: str | Path | Reader | View, path: str | Path, nominal: bool = False) -> Path:
    """Write errors and results of all joints, see `ResultFile.to_pandas`, in the format that the name ends in.

    Parameters
    ----------
    source : str, Path, Reader or View
        Result file; of a view with one of several operating points that alone.
    path : str or Path
        File to write: ``.csv`` and ``.xlsx`` with the names of the columns in the first row and their units in the
        second, ``.parquet`` with units as metadata, ``attrs`` of the frame that pandas reads.
    nominal : bool
        Include the nominal joint, and a column that marks it.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the name ends in another way, or what writes it is not installed; a sheet of Excel holds fewer joints.
    StoreError
        When the result file is damaged.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in NEEDS:
        raise InputError([Fault(str(path), "is no format of a table", f"end its name in {', '.join(NEEDS)}")])
    if (package := NEEDS[ending]) and importlib.util.find_spec(package) is None:
        raise InputError([Fault(str(path), f"{package} is not installed", f"install it with: pip install {package}")])
    with viewed(source) as view, atomic_write(path) as temporary:
        store = view.store
        if ending == ".csv":
            with temporary.open("w", encoding="utf-8", newline="") as stream:
                write_csv(store, stream, nominal)
        elif ending == ".parquet":
            frames = list(in_blocks(store, nominal))
            whole = pd.concat(frames)
            whole.attrs = frames[0].attrs
            whole.to_parquet(temporary)
        else:
            _write_sheet(store, temporary, nominal)
    return path


def write_csv(store: Reader, stream: TextIO, nominal: bool = False) -> None:
    """Write errors and results as CSV, block by block; see `write_table`."""
    out = csv.writer(stream, lineterminator="\n")
    for k, frame in enumerate(in_blocks(store, nominal)):
        if k == 0:
            out.writerows(_head(frame))
        out.writerows(text.csv_rows([frame.index.tolist(), *(frame[name].tolist() for name in frame)]))


def _write_sheet(store: Reader, path: Path, nominal: bool) -> None:
    from openpyxl import Workbook

    book = Workbook(write_only=True)
    sheet, rows = book.create_sheet("joints"), 2
    for k, frame in enumerate(in_blocks(store, nominal)):
        rows += len(frame)
        if rows > SHEET[0] or frame.shape[1] >= SHEET[1]:
            found = f"a sheet of Excel has {SHEET[0]} rows and {SHEET[1]} columns, which are too few"
            raise InputError([Fault(str(store.path), found, "write a file that ends in .csv or .parquet")])
        for head in _head(frame) if k == 0 else []:
            sheet.append(head)
        known = frame.astype(object).where(frame.notna(), None)
        for row in known.itertuples():
            sheet.append(list(row))
    with path.open("wb") as stream:
        book.save(stream)


def _head(frame: pd.DataFrame) -> list[list[str]]:
    """Names of the columns, and their units."""
    return [["row", *map(str, frame)], ["1", *frame.attrs["units"].values()]]
