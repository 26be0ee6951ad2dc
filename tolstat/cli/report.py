"""``tolstat report``: tables and figures."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import ResultFile, make_folder, tell


def report(
    file: ResultFile,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for the files, made if need be; default that of FILE."),
    ] = None,
) -> None:
    """Print and draw which loads are exceeded.

    Prints the share of joints above each of the study's limits; writes curves and pictures beside FILE. A
    study without limits gets the quantiles of every bushing load, a sweep its loads against the swept value.
    """
    from tolstat.report import build
    from tolstat.store import ResultStore

    if out is not None:
        ResultStore.open(file).close()  # a file that cannot be read leaves no folder behind
        make_folder(out)
    tell(build(file, out))
