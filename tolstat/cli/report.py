"""``tolstat report``: tables and figures of a campaign, or one HTML page."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import (
    Accept,
    AsJson,
    AtPoints,
    ResultPath,
    Wide,
    announce_compilation,
    as_text,
    make_folder,
    parse_share,
)
from tolstat.cli._talk import progress, say
from tolstat.common.errors import Fault, InputError, gather

PAGES = (".html", ".htm")


def report(
    file: ResultPath,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="DIR|PAGE.html",
            help="Folder for the files, created if missing (default: folder of FILE), or an HTML page to write.",
        ),
    ] = None,
    accept: Accept = None,
    again: Annotated[
        int | None,
        typer.Option(
            "--replay",
            metavar="N",
            min=0,
            help="With an HTML page: number of joints evaluated over the input angle, simulated again if FILE "
            "has no load histories; default: 1000, but none is simulated again if FILE has pending joints.",
        ),
    ] = None,
    full: Annotated[bool, typer.Option("--full", help="With an HTML page: open all its sections.")] = False,
    brief: Annotated[
        bool, typer.Option("--brief", help="With an HTML page: verdict and line to change only, on one printed sheet.")
    ] = False,
    point: AtPoints = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Report the share of joints above each load.

    Prints the verdict and the share of joints above each limit; without limits, the quantiles of each bushing load; for
    a sweep, the loads against the swept value. Writes the curves as PNG, SVG and CSV.

    With --out PAGE.html, writes a single page instead, with verdict, exceedance, capability, causes, worst joints,
    fatigue, contact modes, numerical error, failed joints and provenance. The campaign may be unfinished.

    Example: tolstat report iso2768_f.h5 --out page.html --accept "1 %"
    """
    if out is not None and out.suffix.lower() in PAGES:
        _page(file, out, accept, again, point or "", full, brief)
        return
    accepted = math.nan if accept is None else parse_share(accept)
    from tolstat.cli._questions import show
    from tolstat.report.answer import report as answer
    from tolstat.report.answer import write
    from tolstat.store import recorded, viewed

    with viewed(file) as view:
        if out is not None:
            make_folder(out)
        with progress("report"):
            made = answer(view.at(point or ""), accepted)
        if as_json:
            typer.echo(as_text(made.values()))
            return
        show(made, wide)
        if note := recorded.note_on_mounting(view.store):
            say(f"note: {note}")
        with progress("files") as shown:
            files = write(made, view.path, out, point or "", shown.stage)
    for path in files:
        say(f"wrote {path}")


def _page(file: Path, out: Path, accept: str | None, again: int | None, point: str, full: bool, brief: bool) -> None:
    from tolstat.common.cores import available_cores
    from tolstat.common.draw_records import DRAWN
    from tolstat.common.files import check_target
    from tolstat.report import page
    from tolstat.store import revolutions, viewed

    faults: list[Fault] = []
    with gather(faults):
        check_target(out, file)
    accepted = float("nan")
    with gather(faults):
        accepted = parse_share(accept) if accept is not None else accepted
    if faults:
        raise InputError(faults)
    with viewed(file) as view:
        store, held = view.store, bool(revolutions.held(view.store))
        if again is None:
            with progress("reading the file"):
                done = view.counts.done == view.counts.total
            again = page.REPLAYED if held or done else 0
            if not again:
                say(f"{file} has pending joints: the page shows the others, and none over the input angle (--replay)")
        if again and store.sampling["method"] in DRAWN and not held:
            announce_compilation()
        with progress("page") as shown:
            page.write_page(view, out, accepted, again, shown.stage, point, available_cores(), full, brief)
    say(f"wrote {out}")
