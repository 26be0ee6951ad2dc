"""``tolstat report``: tables and figures of a campaign, or one HTML page."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

from tolstat.cli._library import columns, compilation, page, recorded, reports, revolutions, stores
from tolstat.cli._shared import deliver, progress, say
from tolstat.common.cores import available_cores
from tolstat.common.files import check_target
from tolstat.display.options import Accepted, AsJson, Opt, Point, ResultPath, Wide

PAGES = (".html", ".htm")


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
    with stores.viewed(file) as view:
        if out is not None:
            check_target(out / file.stem)
        with progress("report"):
            answer = reports.report(view.at(point or ""), accepted)
        deliver(answer, wide, as_json)
        if as_json:
            return
        if note := recorded.note_on_mounting(view.store):
            say(f"note: {note}")
        with progress("files") as shown:
            files = reports.write(answer, view.path, out, point or "", shown.stage)
    for path in files:
        say(f"wrote {path}")


def _page(file: Path, out: Path, accepted: float, again: int | None, point: str, full: bool, brief: bool) -> None:
    check_target(out, file)
    with stores.viewed(file) as view:
        has_histories = bool(revolutions.held(view.store))
        if again is None:
            with progress("reading the file"):
                done = view.counts.done == view.counts.total
            again = page.REPLAYED if has_histories or done else 0
            if not again:
                say(f"{file} has pending joints: the page shows the others, and none over the input angle (--replay)")
        if again and view.method in columns.DRAWN and not has_histories:
            compilation.announce()
        with progress("page") as shown:
            page.write_page(view, out, accepted, again, shown.stage, point, available_cores(), full, brief)
    say(f"wrote {out}")
