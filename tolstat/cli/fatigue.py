"""``tolstat fatigue``: what the cycles of a revolution do over a service life."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import say, writing


def fatigue(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE...", help="Result files: one, or one for each operating point.")
    ],
    share: Annotated[
        list[float] | None,
        typer.Option("--share", metavar="S", help="Share of the revolutions, once for each file; their sum is 1."),
    ] = None,
    channel: Annotated[
        list[str] | None,
        typer.Option("--channel", metavar="PATTERN", help='Channels, as "cross*.F_t"; repeat for more.'),
    ] = None,
    csv: Annotated[
        Path | None, typer.Option("--csv", metavar="OUT", help="CSV file for the loads of all channels.")
    ] = None,
) -> None:
    """Print damage-equivalent loads and damage sums over the joints.

    Several files are a duty cycle: the same joints under several operating points. Exponents, service life and S-N
    lines are those of the section [fatigue] of the (first) study. Without --channel the most loaded component of each
    bushing's force and torque is printed, and all channels are written.
    """
    from tolstat.common.files import check_target
    from tolstat.display import text
    from tolstat.questions.fatigue import query as source
    from tolstat.questions.fatigue import rendering as tables

    if csv:
        check_target(csv, *files)
    names = source.channels(channel) if channel else None
    loading = source.read(files, share or [1.0], names)
    loads = tables.equivalent_loads(loading)
    worst = [] if channel else tables.worst(loads)
    shown = loads[loads["channel"].isin(worst)] if worst else loads
    rows = [f"{channel}, m = {m:g}" for channel, m in zip(shown["channel"], shown["m"], strict=True)]
    typer.echo(text.quantiles(shown.assign(load=rows)))
    sums = tables.damages(loading)
    if len(sums):
        columns = ["channel", "m", "S0", "N0", "nominal", "median", "n", "count", "estimate", "lower", "upper"]
        typer.echo("\nshare of the joints whose damage exceeds 1")
        typer.echo(text.plain(sums[columns]))
    say(tables.notes(loading, loads))
    if csv:
        with writing(csv) as temporary:
            loads.to_csv(temporary, index=False, encoding="utf-8", lineterminator="\n")
        say(f"wrote {csv}")
