"""``tolstat causes``: sensitivity of a load to the errors."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import (
    AsJson,
    AtPoints,
    StudyOption,
    Wide,
    Workers,
    announce_compilation,
    as_text,
    print_table,
)
from tolstat.cli._talk import progress, say
from tolstat.common.errors import Fault, InputError


class Each(StrEnum):
    """What a line is."""

    ENTRY = "entry"
    FEATURE = "feature"
    ERROR = "error"


class Groups(StrEnum):
    """Errors that a pick-freeze design exchanges together."""

    TOLERANCE = "tolerance"
    ERROR = "error"


def causes(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="Result file (HDF5); with --pick-freeze: study file (TOML).")
    ],
    by: Annotated[
        str | None,
        typer.Option(
            "--by",
            metavar="LOAD",
            help='Load, such as cross1.F or psi, or "any limit"; default: all limits, or the only one.',
        ),
    ] = None,
    top: Annotated[int, typer.Option("--top", metavar="N", min=1, help="Number of errors in the printed table.")] = 12,
    logarithm: Annotated[
        bool, typer.Option("--logarithm", help="Explain the variance of the load's logarithm instead of the load's.")
    ] = False,
    points: Annotated[
        int | None,
        typer.Option("--pick-freeze", metavar="N", min=50, help="Simulate a pick-freeze design of N points."),
    ] = None,
    groups: Annotated[
        Groups,
        typer.Option(
            "--groups",
            help="With --pick-freeze: exchange all errors of a tolerance together, or each error by itself.",
        ),
    ] = Groups.TOLERANCE,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="OUT",
            help="With --pick-freeze: result file, default STUDY_causes.h5.",
        ),
    ] = None,
    run: Annotated[
        bool,
        typer.Option("--run", help="Simulate joints with each line narrower and wider, and keep their loads in FILE."),
    ] = False,
    budget: Annotated[
        str,
        typer.Option("--budget", metavar="TIME", help="With --run: time limit, with unit s, min or h."),
    ] = "5 min",
    each: Annotated[
        Each,
        typer.Option(
            "--each", help="With --run: a line is an entry of [tolerances], a pin with its hole, or an error."
        ),
    ] = Each.ENTRY,
    group: Annotated[
        list[str] | None,
        typer.Option(
            "--group", metavar="NAME=PATTERN,...", help="With --run: also change these errors together; repeatable."
        ),
    ] = None,
    workers: Workers = None,
    point: AtPoints = None,
    study_file: StudyOption = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Print which tolerances and errors cause the largest loads.

    Prints for each line of the drawing, an entry of [tolerances], the share of the joints above the limit if it were
    half as wide, exact, finer or coarser by one class (else by the factors 0.63 and 1.6). With --run, simulates these
    joints, which have the seeds of FILE and keep their loads in it: until the order of the lines is settled or the
    time is up. To go on, run the same command again.

    Prints for each error: the share of the load's variance that it explains alone and in interactions (first-order and
    total Sobol' indices), the direction of its effect (rank regression), and the probability that a joint above the
    limit (without a limit: above the 90 % quantile) has a larger, or a more extreme, error than a joint below.

    With --pick-freeze N, FILE is a study. A design of N points is simulated into OUT, each point with two joints and
    one more for each group of errors; it gives total indices with intervals instead of bounds. To resume after an
    interruption, run the same command again. OUT can be given as FILE afterwards.

    Example: tolstat causes iso2768_f.h5 --by cross1.F
    """
    if run:
        if points is not None or out is not None:
            raise InputError([Fault("--run", "cannot be combined with --pick-freeze or --out", "remove one of them")])
        _run_lines(file, by, each, group or [], budget, workers)
    elif group or each != Each.ENTRY:
        raise InputError([Fault("--each, --group", "say what --run simulates", "add --run")])
    from tolstat.cli._questions import show
    from tolstat.questions.causes import errors
    from tolstat.questions.what_if import rendering as whatifs
    from tolstat.questions.what_if.query import what_if
    from tolstat.store import ResultFile

    if points is not None:
        file = _run_design(file, points, groups, out, workers)
    elif out is not None:
        raise InputError([Fault("--out", "is used with --pick-freeze only", "add --pick-freeze 1024")])
    with progress("causes"), ResultFile.open(file) as store:
        view = store.view(study_file).at(point or "")
        load = by or view.decisive
        lines = what_if(view, load) if view.altered else None
        answer = errors.causes(view, load, top, logarithm)
    if as_json:
        typer.echo(as_text(answer.values() | ({"what_if": whatifs.values(lines)} if lines else {})))
        return
    if lines is not None:
        typer.echo(whatifs.heading(lines))
        print_table(whatifs.columns(lines), whatifs.rows(lines), wide)
        say(whatifs.note(lines))
        typer.echo(f"\n{answer.tables['errors'].title}")
    show(answer, wide)


def _run_lines(path: Path, by: str | None, each: Each, groups: list[str], budget: str, workers: int | None) -> None:
    """Simulate joints with other widths of each line into the result file."""
    from tolstat.cli.run import parse_time
    from tolstat.questions.what_if.run import simulate

    seconds = parse_time(budget, "--budget")
    announce_compilation()
    with progress() as shown:
        done = simulate(path, by, each.value, groups, seconds, workers, say, shown)
    order = "settled" if done.settled else "not settled: a longer --budget goes on"
    say(
        f"simulated {done.simulated} joints in {done.seconds:.0f} s, {done.each} of each change; order of lines {order}"
    )


def _run_design(path: Path, points: int, groups: Groups, out: Path | None, workers: int | None) -> Path:
    """Simulate a pick-freeze design of a study; returns the result file."""
    from tolstat import study
    from tolstat.campaign.blocks import Execution
    from tolstat.cli import run
    from tolstat.study.rewriting import with_keys

    keys = {"method": "pick_freeze", "n": points, "groups": groups.value}
    plan = study.load(path, text=with_keys(study.load(path).text, {("sampling",): keys}, str(path)))
    target = out if out is not None else Path(f"{path.stem}_causes.h5")
    run.simulate(plan, target, execution=Execution("processes", workers))
    return target
