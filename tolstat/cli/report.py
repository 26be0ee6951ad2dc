"""``tolstat report``: tables and figures of a campaign, or one HTML page."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import ResultFile, announce_compilation, make_folder, say, tell
from tolstat.common.errors import Fault, InputError, gather

PAGES = (".html", ".htm")


def report(
    file: ResultFile,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="DIR|PAGE.html",
            help="Folder for the files, created if missing (default: folder of FILE), or an HTML page to write.",
        ),
    ] = None,
    accept: Annotated[
        str | None,
        typer.Option(
            "--accept",
            metavar="SHARE",
            help='With an HTML page: accepted share of joints above a limit: "0.1 %", "1000 ppm" or 0.001.',
        ),
    ] = None,
    again: Annotated[
        int,
        typer.Option(
            "--replay",
            metavar="N",
            min=0,
            help="With an HTML page: number of joints evaluated over the input angle; simulated again if FILE has no "
            "load histories.",
        ),
    ] = 1000,
) -> None:
    """Report the share of joints above each load.

    Prints the share of joints above each limit; without limits, the quantiles of each bushing load; for a sweep, the
    loads against the swept value. Writes the curves as PNG, SVG and CSV.

    With --out PAGE.html, writes a single page instead, with verdict, exceedance, capability, causes, worst joints,
    fatigue, contact modes, numerical error, failed joints and provenance.

    Example: tolstat report iso2768_f.h5 --out page.html --accept "1 %"
    """
    if out is not None and out.suffix.lower() in PAGES:
        _page(file, out, accept, again)
        return
    from tolstat.report import build
    from tolstat.store import Reader

    if accept is not None:
        raise InputError([Fault("--accept", "is used with an HTML page only", "add --out page.html")])
    if out is not None:
        Reader.open(file).close()  # check the file before the folder is created
        make_folder(out)
    tell(build(file, out))


def _page(file: Path, out: Path, accept: str | None, again: int) -> None:
    from tolstat.campaign.executors.common import THREAD_VARIABLES

    for name in THREAD_VARIABLES:  # for many small products, BLAS threads only cost time
        os.environ.setdefault(name, "1")
    from tolstat.common.files import check_target
    from tolstat.report import page
    from tolstat.store import Reader, revolutions
    from tolstat.store.view import DRAWN

    faults: list[Fault] = []
    with gather(faults):
        check_target(out, file)
    accepted = float("nan")
    with gather(faults):
        accepted = parse_share(accept) if accept is not None else accepted
    if faults:
        raise InputError(faults)
    with Reader.open(file) as store:
        if again and store.sampling["method"] in DRAWN and not revolutions.held(store):
            announce_compilation()
    say(f"wrote {page.write_page(file, out, accepted, again)}")


def parse_share(text: str) -> float:
    """Parse a share such as ``"0.1 %"``, ``"1000 ppm"`` or ``"1e-3"``.

    Raises
    ------
    InputError
        When the text is not a share between 0 and 1.
    """
    from pydantic_core import PydanticCustomError

    from tolstat.common.units import to_si

    try:
        share = to_si(text, "1")
    except PydanticCustomError:
        share = -1.0
    if not 0.0 < share < 1.0:
        raise InputError(
            [
                Fault(
                    "--accept",
                    f"{text!r} is not a share between 0 and 1",
                    'write --accept "0.1 %", --accept "1000 ppm" or --accept 0.001',
                )
            ]
        )
    return share
