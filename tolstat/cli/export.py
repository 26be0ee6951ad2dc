"""``tolstat export``: joints, load cycles or statistics as a file."""

from __future__ import annotations

import csv
import math
from functools import partial
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TextIO

import typer

from tolstat.cli._library import causes, exceedance, load_units, pylife, reports, result_file, stores, text
from tolstat.cli._shared import json_of, progress, say, write
from tolstat.common.errors import Fault, InputError
from tolstat.common.files import atomic_write
from tolstat.common.late import pandas as pd
from tolstat.display.options import Accepted, Opt, Point, ResultPath

if TYPE_CHECKING:
    from tolstat.store import Reader, View

Target = Annotated[str | None, Opt("OUT", writes=True)]
MAX_ROWS = 1_048_575
"""Number of joints that a sheet of Excel can hold below its heading."""
LIMITS = {"load": "load", "limit": "level", "unit": "unit", "above": "count", "joints": "valid"}
LIMITS |= {"share": "estimate"} | {name: name for name in ("lower", "upper", "confidence", "nominal")}
"""Columns of the sheet ``limits``, and the keys of `exceedance.limit_rows`."""


def export(
    file: ResultPath,
    *,
    joints: Annotated[str | None, Opt("OUT", name="csv", writes=True)] = None,
    cycles: Annotated[str | None, Opt("OUT", name="pylife", writes=True)] = None,
    parquet: Target = None,
    xlsx: Target = None,
    statistics: Target = None,
    by: Annotated[list[str] | None, Opt("LOAD")] = None,
    accepted: Accepted = math.nan,
    nominal: bool = False,
    point: Point = None,
) -> None:
    """Export joints, load cycles or statistics to files.

    --csv writes one row per joint: its errors, then its results, in SI units. If the study lists its joints, case and
    variant come first. Pending and failed joints are included; unknown values are empty. The first line has the names
    of the columns, the second their units: read it with pandas.read_csv(OUT, header=[0, 1], index_col=0). The joint
    without errors is left out unless --nominal is given.

    --parquet writes the same columns; pandas has their units in frame.attrs["units"].

    --xlsx writes three sheets: the same columns, the share above each limit, the unit and meaning of each column.

    If the study has several operating points, --statistics is of the worst of them, and the other files need --point.

    --statistics writes the verdict, the share above each limit, quantiles, capability, the numerical error and the
    versions.

    --pylife writes the cycles per revolution, one row per joint, channel and class of range and mean, if the study
    keeps cycles or load histories. To read it as a pandas Series: tolstat docs fatigue

    Example: tolstat export iso2768_f.h5 --csv joints.csv

    Parameters
    ----------
    joints : str, optional
        Write errors and results as CSV; - for standard output.
    cycles : str, optional
        Write load cycles as CSV for pyLife; - for standard output.
    parquet : str, optional
        Write errors and results as Parquet (needs pyarrow).
    xlsx : str, optional
        Write joints, limits and units as Excel file (needs openpyxl).
    statistics : str, optional
        Write all statistics as JSON; - for standard output.
    by : list of str, optional
        With --statistics: load whose causes are included, such as cross1.F; repeatable.
    nominal : bool
        Include the joint without errors, marked by a column.
    """
    given = {"--csv": joints, "--pylife": cycles, "--parquet": parquet, "--xlsx": xlsx, "--statistics": statistics}
    targets = {option: target for option, target in given.items() if target is not None}
    every = "--csv, --parquet, --xlsx, --statistics and --pylife, each with its own file OUT"
    wrong = {
        f"give one or more of {every}": not targets or len(set(targets.values())) < len(targets),
        "--by is used with --statistics only: add --statistics OUT": by and statistics is None,
        "--accept is used with --statistics only: add --statistics OUT": accepted == accepted and statistics is None,
        "--nominal is used with --csv, --parquet, --xlsx and --pylife: add one of them": nominal
        and targets.keys() == {"--statistics"},
    }
    for message, applies in wrong.items():
        if applies:
            raise typer.BadParameter(message)
    for option, target, package in (("--parquet", parquet, "pyarrow"), ("--xlsx", xlsx, "openpyxl")):
        if target is not None and find_spec(package) is None:
            remedy = f"install it with: pip install {package}, or use --csv OUT"
            raise InputError([Fault(option, f"{package} is not installed", remedy)])
    with progress("export"), stores.ResultFile.open(file) as opened:
        view = opened.view().at(point or "")
        store = view.store
        number = f"{store.n - (0 if nominal else store.first_sample)} joints"
        if xlsx is not None and store.n > MAX_ROWS:
            too_many = f"{store.path} has {store.n} joints, a sheet of Excel has {MAX_ROWS} rows"
            raise InputError([Fault("--xlsx", too_many, "use --parquet OUT or --csv OUT")])
        if cycles is not None:
            table = pylife.table(view, nominal=nominal)
            write(cycles, lambda out: table.to_csv(out, index=False, lineterminator="\n"))
            _tell(cycles, f"cycles of {table['joint'].nunique()} joints")
        if statistics is not None:
            values = reports.statistics(view, accepted=accepted)
            values["causes"] = {load: causes.causes(view, load).values() for load in by or ()}
            write(statistics, lambda out: out.write(json_of(values) + "\n"))
            _tell(statistics, "all statistics")
        if joints is not None:
            if joints == "-":
                list(result_file.in_blocks(store, nominal))  # damage is found before anything is printed
            write(joints, partial(_write_csv, store, nominal))
            _tell(joints, number)
        if parquet is None and xlsx is None:
            return
        (frame,) = result_file.in_blocks(store, nominal, store.n)
        writers = {xlsx: partial(_write_workbook, view, frame), parquet: partial(frame.to_parquet, engine="pyarrow")}
        for name, write_file in writers.items():
            if name is not None:
                with atomic_write(Path(name)) as temporary:
                    write_file(temporary)
                _tell(name, number)


def _tell(target: str, content: str) -> None:
    if target != "-":
        say(f"wrote {target}: {content}")


def _write_csv(store: Reader, nominal: bool, stream: TextIO) -> None:
    """Write errors and results block by block."""
    out = csv.writer(stream, lineterminator="\n")
    for k, frame in enumerate(result_file.in_blocks(store, nominal)):
        if k == 0:
            out.writerows([["row", *frame.columns], ["1", *frame.attrs["units"].values()]])
        out.writerows(text.csv_rows([frame.index.tolist(), *(frame[name].tolist() for name in frame)]))


def _write_workbook(view: View, frame: pd.DataFrame, path: Path) -> None:
    """Write an Excel workbook, a row at a time: joints in SI units, limits, and unit and meaning of each column.

    Sheet ``limits`` has the share of the joints with a valid load above each limit, and its interval (empty unless
    joints are independent samples).
    """
    from openpyxl import Workbook

    limits = [(name, limit, load_units.load_of(name).unit) for name, limit in view.limits.items()]
    if view.sampled:  # joints of a sweep or a list are no sample, whose shares would mean something
        rows = (
            {**row, "valid": row["n"] - row["n_failed"] - row["n_unsettled"]} for row in exceedance.limit_rows(view)
        )
        limits = [tuple(row[key] for key in LIMITS.values()) for row in rows]
    meanings = {name: column.description for name, column in result_file.described(view.store).items()}
    units = [(name, unit, meanings.get(name, "")) for name, unit in frame.attrs["units"].items()]
    sheets = {
        "joints": (("row", *frame.columns), frame.itertuples(name=None)),
        "limits": (LIMITS, limits),
        "units": (("column", "unit", "meaning"), units),
    }
    book = Workbook(write_only=True)
    for name, (heads, cells) in sheets.items():
        sheet = book.create_sheet(name)
        sheet.freeze_panes = "B2"
        sheet.append(list(heads))
        for row in cells:
            sheet.append([text.cell(text.plain(value)) for value in row])
    whole = BytesIO()  # openpyxl does not recover from a full disk
    book.save(whole)
    path.write_bytes(whole.getvalue())
