"""``tolstat export``: joints as a table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tolstat.cli._app import ResultFile, as_text, say, writing
from tolstat.common.errors import Fault, InputError

if TYPE_CHECKING:
    from typing import TextIO

    import pandas as pd

    from tolstat.store import ResultStore
    from tolstat.store.view import View


def export(
    file: ResultFile,
    out: Annotated[
        str | None, typer.Option("--csv", metavar="OUT", help="CSV file to write; - for standard output.")
    ] = None,
    cycles: Annotated[
        str | None,
        typer.Option("--pylife", metavar="OUT", help="CSV file for load cycles as pyLife takes them; - likewise."),
    ] = None,
    parquet: Annotated[
        str | None, typer.Option("--parquet", metavar="OUT", help="Parquet file for the joints (needs pyarrow).")
    ] = None,
    statistics: Annotated[
        str | None, typer.Option("--json", metavar="OUT", help="JSON file for all statistics; - likewise.")
    ] = None,
    by: Annotated[
        list[str] | None,
        typer.Option("--by", metavar="LOAD", help="With --json: loads whose causes are told; repeat for more."),
    ] = None,
) -> None:
    """Write the joints of a campaign, the cycles of their loads, or all statistics.

    One row a joint: its errors, then its results, in SI units; before them the case and variant that it is,
    if the study lists its joints. The first line names the columns, the second
    gives their units: pandas reads it with header=[0, 1]. Joints that are pending or failed have their row
    too; what is not known is empty.

    Parquet has the same columns, and their units in the metadata: pandas has them as frame.attrs["units"]. JSON has the
    share above each limit, quantiles, capability, the numerical error and what the file was made by.

    With --pylife one row a joint, channel and class of range and mean: cycles per revolution, for files whose study
    keeps cycles or load histories. See docs/questions/fatigue.md for the lines that read it as a Series.
    """
    from tolstat.common.files import check_target
    from tolstat.store import ResultStore

    given = {"--csv": out, "--pylife": cycles, "--parquet": parquet, "--json": statistics}
    targets = [target for target in given.values() if target is not None]
    if not targets or len(set(targets)) < len(targets):
        raise typer.BadParameter(
            "give --csv OUT, --parquet OUT, --json OUT or --pylife OUT, or some with different names"
        )
    if by and statistics is None:
        raise typer.BadParameter("--by is for --json OUT")
    if parquet is not None and find_spec("pyarrow") is None:
        raise InputError([Fault("--parquet", "pyarrow is not installed", "pip install pyarrow, or take --csv")])
    for target in targets:
        if target != "-":
            check_target(Path(target), file)
    with ResultStore.open(file) as store:
        if cycles is not None:
            _write(cycles, *_collectives(store.view()))
        if statistics is not None:
            _write(statistics, *_statistics(store, by or ()))
        if out is None and parquet is None:
            return
        frame = store.to_pandas(units=True)
    if out is not None:
        _write(out, lambda stream: _write_table(frame, stream), f"{len(frame)} joints")
    if parquet is not None:
        _write_parquet(frame, Path(parquet))
        say(f"wrote {parquet}: {len(frame)} joints")


def _write(out: str, write: Callable[[TextIO], object], what: str) -> None:
    import sys

    if out == "-":
        write(sys.stdout)
        return
    with writing(Path(out)) as temporary, temporary.open("w", encoding="utf-8", newline="") as stream:
        write(stream)
    say(f"wrote {out}: {what}")


def _collectives(view: View) -> tuple[Callable[[TextIO], None], str]:
    from tolstat.questions.fatigue import pylife

    table = pylife.table(pylife.pylife_series(view))
    what = f"cycles of {table['joint'].nunique()} joints"
    return lambda stream: table.to_csv(stream, index=False, lineterminator="\n"), what


def _statistics(store: ResultStore, by: Sequence[str]) -> tuple[Callable[[TextIO], object], str]:
    from tolstat.questions.causes import rendering
    from tolstat.questions.causes.query import causes_of
    from tolstat.report import summary

    view = store.view()
    found = summary.statistics(view)
    found["causes"] = {load: rendering.values(causes_of(view, load)) for load in by}
    return lambda stream: stream.write(as_text(found) + "\n"), "all statistics"


def _write_parquet(frame: pd.DataFrame, path: Path) -> None:
    plain = frame.droplevel(1, axis=1)
    plain.attrs["units"] = dict(zip(*(frame.columns.get_level_values(k) for k in (0, 1)), strict=True))
    with writing(path) as temporary:
        plain.to_parquet(temporary, engine="pyarrow")


def _write_table(frame: pd.DataFrame, stream: TextIO) -> None:
    import csv

    heads = csv.writer(stream, lineterminator="\n")
    names, units = zip(*frame.columns, strict=True)
    heads.writerow(["row", *names])
    heads.writerow(["1", *units])
    frame.to_csv(stream, header=False, lineterminator="\n")
