"""``tolstat time-above``: share of a revolution in which a load is above a level."""

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
    """Estimate for which share of a revolution loads are above a level.

    Every joint has such a share: printed are its mean over the joints, and the share that half, 90 % and 99 % of the
    joints do not exceed. A further column gives the share of the joints that are above the level at any time. For files
    whose study keeps load histories, in full or as harmonics.
    """
    from tolstat.display import table, text
    from tolstat.questions.time_above import query, rendering
    from tolstat.store import ResultStore

    with ResultStore.open(file) as store:
        found = query.time_above(store.view(), by or (), level or (), curves=out is not None)
    if as_json:
        summary = {"joints": found.joints, "left_out": found.left_out, "loads": text.records(found.table)}
        typer.echo(as_text(summary))
    else:
        typer.echo(table.as_text(rendering.LEVELS, found.table))
    say(rendering.note(found))
    if out is not None:
        make_folder(out)
        with filling(out):
            files = rendering.write(found, out / file.stem)
        for path in files:
            say(f"wrote {path}")
