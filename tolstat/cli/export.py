"""``tolstat export``: joints, load cycles or statistics as a file."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from importlib.util import find_spec
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tolstat.cli._app import Accept, AtPoints, ResultPath, as_text, output_file, parse_share
from tolstat.cli._talk import progress, say
from tolstat.common.errors import Fault, InputError

if TYPE_CHECKING:
    from typing import TextIO

    import pandas as pd

    from tolstat.store import Reader
    from tolstat.store.view import View


def export(
    file: ResultPath,
    out: Annotated[
        str | None,
        typer.Option("--csv", metavar="OUT", help="Write errors and results as CSV; - for standard output."),
    ] = None,
    cycles: Annotated[
        str | None,
        typer.Option("--pylife", metavar="OUT", help="Write load cycles as CSV for pyLife; - for standard output."),
    ] = None,
    parquet: Annotated[
        str | None,
        typer.Option("--parquet", metavar="OUT", help="Write errors and results as Parquet (needs pyarrow)."),
    ] = None,
    workbook: Annotated[
        str | None,
        typer.Option("--xlsx", metavar="OUT", help="Write joints, limits and units as Excel file (needs openpyxl)."),
    ] = None,
    statistics: Annotated[
        str | None,
        typer.Option("--statistics", metavar="OUT", help="Write all statistics as JSON; - for standard output."),
    ] = None,
    by: Annotated[
        list[str] | None,
        typer.Option(
            "--by",
            metavar="LOAD",
            help="With --statistics: load whose causes are included, such as cross1.F; repeatable.",
        ),
    ] = None,
    accept: Accept = None,
    nominal: Annotated[
        bool,
        typer.Option("--nominal", help="Include the joint without errors, marked by a column."),
    ] = False,
    point: AtPoints = None,
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
    """
    from tolstat.common.files import check_target
    from tolstat.report import workbook as excel
    from tolstat.store import ResultFile
    from tolstat.store.result_file import to_pandas

    given = {"--csv": out, "--pylife": cycles, "--parquet": parquet, "--xlsx": workbook, "--statistics": statistics}
    targets = {option: target for option, target in given.items() if target is not None}
    _check_options(targets, bool(by), accept is not None, nominal)
    accepted = math.nan if accept is None else parse_share(accept)
    for target in targets.values():
        if target != "-":
            check_target(Path(target), file)
    with progress("export"), ResultFile.open(file) as opened:
        view = opened.view().at(point or "")
        store = view.store
        if workbook is not None:
            excel.check(store, "--xlsx")
        if cycles is not None:
            _write(cycles, *_collectives(view, nominal))
        if statistics is not None:
            _write(statistics, *_statistics(view, by or (), accepted))
        if out is not None:
            _write_csv(store, nominal, out)
        if parquet is None and workbook is None:
            return
        frame = to_pandas(store, nominal)
        if workbook is not None:
            with output_file(Path(workbook)) as temporary:
                excel.write(store, frame, temporary)
            say(f"wrote {workbook}: {len(frame)} joints")
    if parquet is not None:
        _write_parquet(frame, Path(parquet))
        say(f"wrote {parquet}: {len(frame)} joints")


def _check_options(targets: dict[str, str], by: bool, accept: bool, nominal: bool) -> None:
    """Refuse options that do not go together; `targets` are the files to write, by option."""
    if not targets or len(set(targets.values())) < len(targets):
        raise typer.BadParameter(
            "give one or more of --csv, --parquet, --xlsx, --statistics and --pylife, each with its own file OUT"
        )
    for option, used in (("--by", by), ("--accept", accept)):
        if used and "--statistics" not in targets:
            raise typer.BadParameter(f"{option} is used with --statistics only: add --statistics OUT")
    if nominal and targets.keys() == {"--statistics"}:
        raise typer.BadParameter("--nominal is used with --csv, --parquet, --xlsx and --pylife: add one of them")
    if "--parquet" in targets and find_spec("pyarrow") is None:
        raise InputError(
            [Fault("--parquet", "pyarrow is not installed", "install it with: pip install pyarrow, or use --csv OUT")]
        )


def _write(out: str, write: Callable[[TextIO], object], what: str) -> None:
    import sys

    if out == "-":
        write(sys.stdout)
        return
    with output_file(Path(out)) as temporary, temporary.open("w", encoding="utf-8", newline="") as stream:
        write(stream)
    say(f"wrote {out}: {what}")


def _collectives(view: View, nominal: bool) -> tuple[Callable[[TextIO], None], str]:
    from tolstat.questions.fatigue import pylife

    table = pylife.table(view, nominal=nominal)
    what = f"cycles of {table['joint'].nunique()} joints"
    return lambda stream: table.to_csv(stream, index=False, lineterminator="\n"), what


def _statistics(view: View, by: Sequence[str], accepted: float) -> tuple[Callable[[TextIO], object], str]:
    from tolstat.questions.causes.errors import causes
    from tolstat.report import summary

    found = summary.statistics(view, accepted=accepted)
    found["causes"] = {load: causes(view, load).values() for load in by}
    return lambda stream: stream.write(as_text(found) + "\n"), "all statistics"


def _write_parquet(frame: pd.DataFrame, path: Path) -> None:
    with output_file(path) as temporary:
        frame.to_parquet(temporary, engine="pyarrow")


def _write_csv(store: Reader, nominal: bool, out: str) -> None:
    """Write errors and results block by block; damage is found before anything goes to standard output."""
    from tolstat.store.result_file import in_blocks

    if out == "-":
        for _ in in_blocks(store, nominal):
            pass
    number = store.n - (0 if nominal else store.first_sample)
    _write(out, lambda stream: _write_table(in_blocks(store, nominal), stream), f"{number} joints")


def _write_table(blocks: Iterator[pd.DataFrame], stream: TextIO) -> None:
    """Write blocks of a table, as many at once as there are cores: turning numbers into text takes longest."""
    import csv

    from tolstat.common.aside import mapped
    from tolstat.common.cores import available_cores

    cores, first = available_cores(), next(blocks)
    heads = csv.writer(stream, lineterminator="\n")
    heads.writerow(["row", *first.columns])
    heads.writerow(["1", *first.attrs["units"].values()])
    blocks = chain([first], blocks)
    while some := list(islice(blocks, cores)):
        for text in mapped([partial(_as_csv, block) for block in some], cores):
            stream.write(text)


def _as_csv(frame: pd.DataFrame) -> str:
    import csv
    from io import StringIO

    from tolstat.display.text import csv_rows

    text = StringIO(newline="")
    columns = (frame[name].tolist() for name in frame)
    csv.writer(text, lineterminator="\n").writerows(csv_rows([frame.index.tolist(), *columns]))
    return text.getvalue()
