"""``tolstat fatigue``: damage-equivalent loads and damage sums over a service life."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import output_file, say


def fatigue(
    files: Annotated[
        list[Path],
        typer.Argument(metavar="FILE", help="Result file (HDF5); for a duty cycle, one per operating point."),
    ],
    share: Annotated[
        list[float] | None,
        typer.Option(
            "--share",
            metavar="S",
            help="Share of the revolutions, once for each FILE in the same order; sum 1; default: 1 for one file.",
        ),
    ] = None,
    channel: Annotated[
        list[str] | None,
        typer.Option(
            "--channel",
            metavar="PATTERN",
            help='Load channels to evaluate, such as "cross*.F_t"; repeatable; default: all.',
        ),
    ] = None,
    csv: Annotated[
        Path | None,
        typer.Option(
            "--csv", metavar="OUT", help="Write the damage-equivalent loads of all evaluated channels as CSV."
        ),
    ] = None,
) -> None:
    """Print damage-equivalent loads and damage sums.

    Prints the quantiles of the damage-equivalent load over the joints, and for each S-N line the share of joints whose
    damage sum exceeds 1, with 95 % intervals. Without --channel, prints the most loaded component of each bushing force
    and torque. Exponents, service life and S-N lines are those of [fatigue] in the study of the first FILE.

    Several files form a duty cycle: the same joints at several operating points.

    Example: tolstat fatigue low.h5 high.h5 --share 0.3 --share 0.7
    """
    from tolstat.common.files import check_target
    from tolstat.display.table import as_text
    from tolstat.questions.fatigue import query, rendering
    from tolstat.questions.fatigue.counting import channels
    from tolstat.store import Reader

    if csv:
        check_target(csv, *files)
    names = channels(channel) if channel else None
    with ExitStack() as stack:
        views = [stack.enter_context(Reader.open(file)).view() for file in files]
        loading = query.load_cycles(views, share or [1.0], names)
    loads, damages = query.equivalent_loads(loading), query.damages(loading)
    shown = [] if channel else query.most_loaded(loads)
    table = rendering.by_channel(loads[loads["channel"].isin(shown)] if shown else loads)
    typer.echo(as_text(rendering.LOADS, table))
    if len(damages):
        typer.echo("\nshare of joints whose damage sum exceeds 1")
        typer.echo(as_text(rendering.DAMAGES, damages))
    say(rendering.notes(loading, loads))
    if csv:
        with output_file(csv) as temporary:
            loads.to_csv(temporary, index=False, encoding="utf-8", lineterminator="\n")
        say(f"wrote {csv}")
