"""``tolstat time-above``: share of a revolution in which a load is above a level."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import AsJson, AtPoint, ResultPath, Wide, as_text, make_folder, output_folder, print_table
from tolstat.cli._talk import progress, say


def time_above(
    file: ResultPath,
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
    point: AtPoint = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Print how much of a revolution loads are above a level.

    Prints the time above, a share of the revolution of each joint, as its mean and its 50, 90 and 99 % quantiles over
    the joints; and the exceedance, the share of joints that are above the level at any time. The study must keep load
    histories (output.histories "full" or "harmonics").

    Example: tolstat time-above iso2768_f.h5 --by cross1.F --level "1000 N"
    """
    from tolstat.display import text
    from tolstat.questions.time_above import query, rendering
    from tolstat.store import ResultFile

    with progress("time above the levels"), ResultFile.open(file) as store:
        found = query.time_above(store.view().at(point or ""), by or (), level or (), curves=out is not None)
    if as_json:
        summary = {"joints": found.joints, "left_out": found.left_out, "loads": text.records(found.table)}
        typer.echo(as_text(summary))
    else:
        print_table(rendering.LEVELS, found.table, wide)
    say(rendering.note(found))
    if out is not None:
        make_folder(out)
        with progress("figures"), output_folder(out):
            files = rendering.write(found, out / file.stem)
        for path in files:
            say(f"wrote {path}")
