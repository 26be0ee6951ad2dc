"""``tolstat export``: joints as a table."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tolstat.cli._app import ResultFile, say, writing

if TYPE_CHECKING:
    from typing import TextIO

    import pandas as pd

    from tolstat.store import ResultStore


def export(
    file: ResultFile,
    out: Annotated[
        str | None, typer.Option("--csv", metavar="OUT", help="CSV file to write; - for standard output.")
    ] = None,
    cycles: Annotated[
        str | None,
        typer.Option("--pylife", metavar="OUT", help="CSV file for load cycles as pyLife takes them; - likewise."),
    ] = None,
) -> None:
    """Write all joints of a campaign, or the cycles of their loads, as CSV.

    One row a joint: its errors, then its results, in SI units; before them the case and variant that it is,
    if the study lists its joints. The first line names the columns, the second
    gives their units: pandas reads it with header=[0, 1]. Joints that are pending or failed have their row
    too; what is not known is empty.

    With --pylife one row a joint, channel and class of range and mean: cycles per revolution, for files whose study
    keeps cycles or load histories. See docs/fatigue.md for the lines that read it as a Series.
    """
    from tolstat.files import check_target
    from tolstat.store import ResultStore

    targets = [target for target in (out, cycles) if target is not None]
    if not targets or (targets[0] == targets[-1] and len(targets) == 2):
        raise typer.BadParameter("give --csv OUT, --pylife OUT, or both with two names")
    for target in targets:
        if target != "-":
            check_target(Path(target), file)
    with ResultStore.open(file) as store:
        if cycles is not None:
            _write(cycles, *_collectives(store))
        if out is not None:
            frame = store.to_pandas(units=True)
            _write(out, lambda stream: _write_table(frame, stream), f"{len(frame)} joints")


def _write(out: str, write: Callable[[TextIO], None], what: str) -> None:
    import sys

    if out == "-":
        write(sys.stdout)
        return
    with writing(Path(out)) as temporary, temporary.open("w", encoding="utf-8", newline="") as stream:
        write(stream)
    say(f"wrote {out}: {what}")


def _collectives(store: ResultStore) -> tuple[Callable[[TextIO], None], str]:
    from tolstat import pylife

    table = pylife.table(pylife.series(store))
    what = f"cycles of {table['joint'].nunique()} joints"
    return lambda stream: table.to_csv(stream, index=False, lineterminator="\n"), what


def _write_table(frame: pd.DataFrame, stream: TextIO) -> None:
    import csv

    heads = csv.writer(stream, lineterminator="\n")
    names, units = zip(*frame.columns, strict=True)
    heads.writerow(["row", *names])
    heads.writerow(["1", *units])
    frame.to_csv(stream, header=False, lineterminator="\n")
