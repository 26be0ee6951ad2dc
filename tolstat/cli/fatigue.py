"""``tolstat fatigue``: failures of the parts, damage-equivalent loads and damage sums over a service life."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Any

import typer

from tolstat.analysis.prediction import DELIVERY
from tolstat.cli._app import AsJson, Delivery, Wide, announce_compilation, as_text, output_file, print_table
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
    joints: Annotated[
        int | None,
        typer.Option("--joints", metavar="N", min=1, help="Evaluate the first N joints only; default: all."),
    ] = None,
    delivery: Delivery = DELIVERY,
    point: Annotated[
        str | None,
        typer.Option(
            "--point", metavar="POINT", help="Operating point of FILE, such as cruise; default: all, by their shares."
        ),
    ] = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Print failures of parts, equivalent loads and damage sums.

    For each [fatigue.point] of the study: the damage sum, the life that 90 % of the parts reach, and the share of the
    parts that fail in the service life, with 95 % intervals. Without load histories in the file, the joints are
    simulated again. From cycles in the file: quantiles of the damage-equivalent load over the joints, and for each S-N
    line of a load the share of joints whose damage sum exceeds 1. Without --by, prints the most loaded component of
    each bushing force and bending moment. All settings are those of [fatigue] in the study of the first FILE.

    The operating points of FILE form a duty cycle, by the share of the time that [[operation]] gives each; so do
    several files, with the same joints at one operating point each.

    Example: tolstat fatigue iso2768_f.h5 --by "cross*.F_t"
    """
    from tolstat.common.files import check_target
    from tolstat.display import text
    from tolstat.questions.fatigue import parts, parts_rendering, query, rendering
    from tolstat.questions.fatigue.counting import channels
    from tolstat.questions.fatigue.stress import load_stresses
    from tolstat.store import ResultFile
    from tolstat.store.revolutions import held
    from tolstat.study.fatigue import of_text

    if out is not None:
        check_target(out, *files)
    names = channels(by) if by else None
    with ExitStack() as stack:
        views = [stack.enter_context(ResultFile.open(file)).view().at(point or "") for file in files]
        parts_named = of_text(views[0].store.study_text, str(files[0])).points
        stressed = loading = None
        if parts_named:
            if not all(held(part.store) for view in views for part in view.parts):
                announce_compilation()
            with progress("stresses of the parts"):
                stressed = load_stresses(views, share or None, joints)
                failures = parts.part_failures(stressed, delivery=delivery)
        if (
            all(part.store.history_specs for view in views for part in view.parts)
            or names
            or out is not None
            or not parts_named
        ):
            with progress("counting cycles"):
                loading = query.load_cycles(views, share or None, names, joints)
                loads, damages = query.equivalent_loads(loading), query.damages(loading, delivery=delivery)
    if loading is not None and out is not None:
        with output_file(out) as temporary:
            loads.to_csv(temporary, index=False, encoding="utf-8", lineterminator="\n")
        say(f"wrote {out}")
    if as_json:
        found: dict[str, Any] = {"points": text.records(failures)} if stressed is not None else {}
        evaluated = loading if stressed is None else stressed
        if evaluated is not None and len(evaluated.duty) > 1:
            found["duty"] = dict(evaluated.duty)
        if loading is not None:
            found |= {"loads": text.records(loads), "damages": text.records(damages)}
        typer.echo(as_text(found))
        return
    if stressed is not None:
        print_table(parts_rendering.PARTS, failures, wide)
        say(parts_rendering.notes(stressed, failures))
    if loading is not None:
        if stressed is not None:
            typer.echo("\ndamage-equivalent loads")
        shown = [] if by else query.most_loaded(loads)
        table = rendering.by_channel(loads[loads["channel"].isin(shown)] if shown else loads)
        print_table(rendering.LOADS, table, wide)
        if len(damages):
            typer.echo("\nshare of joints whose damage sum exceeds 1")
            print_table(rendering.DAMAGES, damages, wide)
        say(rendering.notes(loading, loads))
