"""``tolstat fatigue``: equivalent loads and damage sums of the load cycles over a service life."""

from __future__ import annotations

from contextlib import ExitStack
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
    from tolstat.display.table import as_text
    from tolstat.questions.fatigue import query, rendering
    from tolstat.questions.fatigue.counting import channels
    from tolstat.store import ResultStore

    if csv:
        check_target(csv, *files)
    names = channels(channel) if channel else None
    with ExitStack() as stack:
        views = [stack.enter_context(ResultStore.open(file)).view() for file in files]
        loading = query.load_cycles(views, share or [1.0], names)
    loads, damages = query.equivalent_loads(loading), query.damages(loading)
    shown = [] if channel else query.most_loaded(loads)
    table = rendering.by_channel(loads[loads["channel"].isin(shown)] if shown else loads)
    typer.echo(as_text(rendering.LOADS, table))
    if len(damages):
        typer.echo("\nshare of the joints whose damage exceeds 1")
        typer.echo(as_text(rendering.DAMAGES, damages))
    say(rendering.notes(loading, loads))
    if csv:
        with writing(csv) as temporary:
            loads.to_csv(temporary, index=False, encoding="utf-8", lineterminator="\n")
        say(f"wrote {csv}")
