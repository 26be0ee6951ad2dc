"""``tolstat report``: tables and figures, or all of a campaign as one page."""

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
            help="Folder for the files, made if need be; default that of FILE. Or a page that holds everything.",
        ),
    ] = None,
    accept: Annotated[
        str | None,
        typer.Option(
            "--accept", metavar="SHARE", help='Judge the limits on the page: "0.1 %" of the joints above, or less.'
        ),
    ] = None,
    again: Annotated[
        int,
        typer.Option(
            "--replay",
            metavar="N",
            min=0,
            help="Joints that the page looks at over the shaft angle; simulated again if FILE has no histories.",
        ),
    ] = 1000,
) -> None:
    """Print and draw which loads are exceeded, or put all that FILE tells on one page.

    Prints the share of joints above each of the study's limits; writes curves and pictures beside FILE. A
    study without limits gets the quantiles of every bushing load, a sweep its loads against the swept value.

    With --out PAGE.html one file with everything inside, for reading and sharing: verdict, exceedance, capability,
    causes, worst joints, fatigue, contact modes, errors, failures, and where the numbers come from.
    """
    if out is not None and out.suffix.lower() in PAGES:
        _page(file, out, accept, again)
        return
    from tolstat.report import build
    from tolstat.store import ResultStore

    if accept is not None:
        raise InputError([Fault("--accept", "is for a page", "add --out PAGE.html")])
    if out is not None:
        ResultStore.open(file).close()  # a file that cannot be read leaves no folder behind
        make_folder(out)
    tell(build(file, out))


def _page(file: Path, out: Path, accept: str | None, again: int) -> None:
    from tolstat.campaign.executors.common import THREAD_VARIABLES

    for name in THREAD_VARIABLES:  # many small products: threads of BLAS cost more than they give
        os.environ.setdefault(name, "1")
    from tolstat.common.files import check_target
    from tolstat.report import page
    from tolstat.store import ResultStore, revolutions
    from tolstat.store.view import DRAWN

    faults: list[Fault] = []
    with gather(faults):
        check_target(out, file)
    accepted = float("nan")
    with gather(faults):
        accepted = share_of(accept) if accept is not None else accepted
    if faults:
        raise InputError(faults)
    with ResultStore.open(file) as store:
        if again and store.sampling["method"] in DRAWN and not revolutions.held(store):
            announce_compilation()
    say(f"wrote {page.write(file, out, accepted, again)}")


def share_of(text: str) -> float:
    """Share that ``"0.1 %"``, ``"1000 ppm"`` or ``"1e-3"`` stands for.

    Raises
    ------
    InputError
        When it is something else, or not between 0 and 1.
    """
    from pydantic_core import PydanticCustomError

    from tolstat.common.units import to_si

    try:
        share = to_si(text, "1")
    except PydanticCustomError:
        share = -1.0
    if not 0.0 < share < 1.0:
        raise InputError([Fault("--accept", f"{text!r} is no share", 'write "0.1 %", "1000 ppm" or 0.001')])
    return share
