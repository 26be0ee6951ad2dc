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
    from tolstat.display import table, text
    from tolstat.questions.time_above import query, rendering
    from tolstat.store import Reader

    with Reader.open(file) as store:
        found = query.time_above(store.view(), by or (), level or (), curves=out is not None)
    if as_json:
        summary = {"joints": found.joints, "left_out": found.left_out, "loads": text.records(found.table)}
        typer.echo(as_text(summary))
    else:
        typer.echo(table.as_text(rendering.LEVELS, found.table))
    say(rendering.note(found))
    if out is not None:
        make_folder(out)
        with output_folder(out):
            files = rendering.write(found, out / file.stem)
        for path in files:
            say(f"wrote {path}")
