"""``tolstat time-above``: how long a load is above a level."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import ResultFile, as_text, filling, make_folder, say


def time_above(
    file: ResultFile,
    by: Annotated[
        list[str] | None,
        typer.Option("--by", metavar="LOAD", help="cross1.F, fork2.T_e; repeat for more. Default: loads with limits."),
    ] = None,
    level: Annotated[
        list[str] | None,
        typer.Option("--level", metavar="LEVEL", help='"700 N"; repeat for more. Default: the limits.'),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder for curves (PNG, SVG, CSV), made if need be.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Tell for which share of a revolution loads are above a level.

    That is time within each joint: its mean over the joints, and what half, 90 % and 99 % of the joints do not surpass.
    Beside it stands the share of the joints that are above the level at any time. For files whose study keeps load
    histories, in full or as harmonics.
    """
    from tolstat.display import text
    from tolstat.questions.time_above import query as source
    from tolstat.questions.time_above import rendering as report
    from tolstat.store import ResultStore

    with ResultStore.open(file) as store:
        found = source.of_store(store, by or (), level or (), curves=out is not None)
    if as_json:
        summary = {"joints": found.joints, "lost": found.lost, "loads": text.records(found.table)}
        typer.echo(as_text(summary))
    else:
        typer.echo(report.text(found))
    say(report.note(found))
    if out is not None:
        make_folder(out)
        with filling(out):
            files = report.write(found, out / file.stem)
        for path in files:
            say(f"wrote {path}")
