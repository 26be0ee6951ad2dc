"""``tolstat fatigue``: damage-equivalent loads and damage sums over a service life."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import AsJson, Wide, as_text, output_file, print_table
from tolstat.cli._talk import progress, say


def fatigue(
    files: Annotated[
        list[Path],
        typer.Argument(metavar="FILE", help="Result file (HDF5) of all operating points, or several of one each."),
    ],
    share: Annotated[
        list[float] | None,
        typer.Option(
            "--share",
            metavar="S",
            help="Share of the revolutions, once for each FILE in the same order; sum 1; default: 1 for one file.",
        ),
    ] = None,
    by: Annotated[
        list[str] | None,
        typer.Option(
            "--by",
            metavar="LOAD",
            help='Component or pattern, such as cross1.F_t or "cross*.F_t"; repeatable; default: the most loaded ones.',
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="CSV", help="Write the damage-equivalent loads of all components as CSV."),
    ] = None,
    point: Annotated[
        str | None,
        typer.Option(
            "--point", metavar="POINT", help="Operating point of FILE, such as cruise; default: all, by their shares."
        ),
    ] = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Print damage-equivalent loads and damage sums.

    Prints the quantiles of the damage-equivalent load over the joints, and for each S-N line the share of joints whose
    damage sum exceeds 1, with 95 % intervals. Without --by, prints the most loaded component of each bushing force
    and torque. Exponents, service life and S-N lines are those of [fatigue] in the study of the first FILE.

    The operating points of FILE form a duty cycle, by the share of the time that [[operation]] gives each; so do
    several files, with the same joints at one operating point each.

    Example: tolstat fatigue iso2768_f.h5 --by "cross*.F_t"
    """
    from tolstat.common.files import check_target
    from tolstat.display import text
    from tolstat.questions.fatigue import query, rendering
    from tolstat.questions.fatigue.counting import channels
    from tolstat.store import Reader

    if out is not None:
        check_target(out, *files)
    names = channels(by) if by else None
    with progress("counting cycles"), ExitStack() as stack:
        views = [stack.enter_context(Reader.open(file)).view().at(point or "") for file in files]
        loading = query.load_cycles(views, share or None, names)
        loads, damages = query.equivalent_loads(loading), query.damages(loading)
    if out is not None:
        with output_file(out) as temporary:
            loads.to_csv(temporary, index=False, encoding="utf-8", lineterminator="\n")
        say(f"wrote {out}")
    if as_json:
        typer.echo(as_text({"loads": text.records(loads), "damages": text.records(damages)}))
        return
    shown = [] if by else query.most_loaded(loads)
    table = rendering.by_channel(loads[loads["channel"].isin(shown)] if shown else loads)
    print_table(rendering.LOADS, table, wide)
    if len(damages):
        typer.echo("\nshare of joints whose damage sum exceeds 1")
        print_table(rendering.DAMAGES, damages, wide)
    say(rendering.notes(loading, loads))
