"""``tolstat time-above``: share of a revolution in which a load is above a level."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import ResultFile, as_text, make_folder, output_folder, say


def time_above(
    file: ResultFile,
    by: Annotated[
        list[str] | None,
        typer.Option(
            "--by",
            metavar="LOAD",
            help="Load or component, such as cross1.F or fork2.T_e; repeatable; default: loads with limits.",
        ),
    ] = None,
    level: Annotated[
        list[str] | None,
        typer.Option("--level", metavar="LEVEL", help='Level, such as "700 N"; repeatable; default: the limits.'),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Write curves (PNG, SVG, CSV) to this folder, created if missing."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Print how much of a revolution loads are above a level.

    Prints the time above, a share of the revolution of each joint, as its mean and its 50, 90 and 99 % quantiles over
    the joints; and the exceedance, the share of joints that are above the level at any time. The study must keep load
    histories (output.histories "full" or "harmonics").

    Example: tolstat time-above a.h5 --by cross1.F --level "1500 N"
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
        with output_folder(out):
            files = report.write(found, out / file.stem)
        for path in files:
            say(f"wrote {path}")
