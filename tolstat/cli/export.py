"""``tolstat export`` and ``report``: joints, load cycles or statistics as files; tables, figures, one HTML page."""

from __future__ import annotations

import csv
import math
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TextIO

import typer

from tolstat.cli import _library as library
from tolstat.cli._shared import deliver, json_of, progress, say, write
from tolstat.common.cores import available_cores
from tolstat.common.files import check_target
from tolstat.display.options import Accepted, AsJson, Opt, Point, ResultPath, Wide

if TYPE_CHECKING:
    from tolstat.store import Reader

PAGES = (".html", ".htm")


def export(
    file: ResultPath,
    *,
    joints: Annotated[str | None, Opt("OUT", name="csv", writes=True)] = None,
    cycles: Annotated[str | None, Opt("OUT", name="pylife", writes=True)] = None,
    statistics: Annotated[str | None, Opt("OUT", writes=True)] = None,
    accepted: Accepted = math.nan,
    nominal: bool = False,
    point: Point = None,
) -> None:
    """Export joints, load cycles or statistics to files.

    --csv writes one row per joint: its errors, then its results, in SI units. If the study lists its joints, case and
    variant come first. Pending and failed joints are included; unknown values are empty. The first line has the names
    of the columns, the second their units: read it with pandas.read_csv(OUT, header=[0, 1], index_col=0). The joint
    without errors is left out unless --nominal is given.

    For Parquet or Excel: tolstat.open(FILE).to_pandas() has the same columns.

    If the study has several operating points, --statistics is of the worst of them, and the other files need --point.

    --statistics writes the verdict, the share above each limit, quantiles, capability, the numerical error and the
    versions; causes of a load: tolstat causes FILE --by LOAD --json.

    --pylife writes the cycles per revolution, one row per joint, channel and class of range and mean, if the study
    keeps cycles or load histories. To read it as a pandas Series: tolstat docs fatigue

    Example: tolstat export iso2768_f.h5 --csv joints.csv

    Parameters
    ----------
    joints : str, optional
        Write errors and results as CSV; - for standard output.
    cycles : str, optional
        Write load cycles as CSV for pyLife; - for standard output.
    statistics : str, optional
        Write all statistics as JSON; - for standard output.
    nominal : bool
        Include the joint without errors, marked by a column.
    """
    targets = [target for target in (joints, cycles, statistics) if target is not None]
    repeated = not targets or len(set(targets)) < len(targets)
    wrong = {
        "give one or more of --csv, --statistics and --pylife, each with its own file OUT": repeated,
        "--accept is used with --statistics only: add --statistics OUT": accepted == accepted and statistics is None,
        "--nominal is used with --csv and --pylife: add one of them": nominal and targets == [statistics],
    }
    for message, applies in wrong.items():
        if applies:
            raise typer.BadParameter(message)
    with progress("export"), library.stores.ResultFile.open(file) as opened:
        view = opened.view().at(point or "")
        store = view.store
        if cycles is not None:
            table = library.fatigue.pylife_table(view, nominal=nominal)
            write(cycles, lambda out: table.to_csv(out, index=False, lineterminator="\n"))
            _tell(cycles, f"cycles of {table['joint'].nunique()} joints")
        if statistics is not None:
            values = library.reports.statistics(view, accepted=accepted)
            write(statistics, lambda out: out.write(json_of(values) + "\n"))
            _tell(statistics, "all statistics")
        if joints is not None:
            if joints == "-":
                list(library.result_file.in_blocks(store, nominal))  # damage is found before anything is printed
            write(joints, partial(_write_csv, store, nominal))
            _tell(joints, f"{store.n - (0 if nominal else store.first_sample)} joints")


def _tell(target: str, content: str) -> None:
    if target != "-":
        say(f"wrote {target}: {content}")


def _write_csv(store: Reader, nominal: bool, stream: TextIO) -> None:
    """Write errors and results block by block."""
    out = csv.writer(stream, lineterminator="\n")
    for k, frame in enumerate(library.result_file.in_blocks(store, nominal)):
        if k == 0:
            out.writerows([["row", *frame.columns], ["1", *frame.attrs["units"].values()]])
        out.writerows(library.text.csv_rows([frame.index.tolist(), *(frame[name].tolist() for name in frame)]))


def report(
    file: ResultPath,
    *,
    out: Annotated[Path | None, Opt("DIR|PAGE.html")] = None,
    accepted: Accepted = math.nan,
    again: Annotated[int | None, Opt("N", least=0, name="replay")] = None,
    full: bool = False,
    brief: bool = False,
    point: Point = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Report the share of joints above each load.

    Prints the verdict and the share of joints above each limit; without limits, the quantiles of each bushing load; for
    a sweep, the loads against the swept value. Writes the curves as PNG, SVG and CSV.

    With --out PAGE.html, writes a single page instead, with verdict, exceedance, capability, causes, worst joints,
    fatigue, contact modes, numerical error, failed joints and provenance. The campaign may be unfinished.

    Example: tolstat report iso2768_f.h5 --out page.html --accept "1 %"

    Parameters
    ----------
    out : Path, optional
        Folder for the files, created if missing (default: folder of FILE), or an HTML page to write.
    again : int, optional
        With an HTML page: number of joints evaluated over the input angle, simulated again if FILE has no load
        histories; default: 1000, but none is simulated again if FILE has pending joints.
    full : bool
        With an HTML page: open all its sections.
    brief : bool
        With an HTML page: verdict and line to change only, on one printed sheet.
    """
    if out is not None and out.suffix.lower() in PAGES:
        _page(file, out, accepted, again, point or "", full, brief)
        return
    with library.stores.viewed(file) as view:
        stem = (out or file.parent) / (f"{file.stem}_{point}" if point else file.stem)
        check_target(stem)
        with progress("report"):
            answer = library.reports.report(view.at(point or ""), accepted)
        deliver(answer, wide, as_json)
        if as_json:
            return
        if note := library.recorded.note_on_mounting(view.store):
            say(f"note: {note}")
        with progress("files"):
            files = answer.write(stem)
    for path in files:
        say(f"wrote {path}")


def _page(file: Path, out: Path, accepted: float, again: int | None, point: str, full: bool, brief: bool) -> None:
    check_target(out, file)
    with library.stores.viewed(file) as view:
        has_histories = bool(library.revolutions.held(view.store))
        if again is None:
            with progress("reading the file"):
                done = view.counts.done == view.counts.total
            again = library.page.REPLAYED if has_histories or done else 0
            if not again:
                say(f"{file} has pending joints: the page shows the others, and none over the input angle (--replay)")
        if again and view.method in library.columns.DRAWN and not has_histories:
            library.compilation.announce()
        with progress("page") as shown:
            library.page.write_page(view, out, accepted, again, shown.stage, point, available_cores(), full, brief)
    say(f"wrote {out}")
