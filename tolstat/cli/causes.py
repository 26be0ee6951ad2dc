"""``tolstat causes``: sensitivity of a load to the errors."""

from __future__ import annotations

from contextlib import suppress
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
    output_file,
    print_table,
)
from tolstat.cli._talk import progress, say
from tolstat.common.errors import Fault, InputError, NotApplicable


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
            help="With --pick-freeze: result file, default STUDY_causes.h5. With --against-angle: CSV file of the "
            "indices, and a figure beside it.",
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
    most: Annotated[
        int, typer.Option("--most", metavar="N", min=128, help="With --run: largest number of joints of each change.")
    ] = 16_384,
    group: Annotated[
        list[str] | None,
        typer.Option(
            "--group", metavar="NAME=PATTERN,...", help="With --run: also change these errors together; repeatable."
        ),
    ] = None,
    workers: Workers = None,
    against_angle: Annotated[
        bool, typer.Option("--against-angle", help="Print the indices over the input angle instead.")
    ] = False,
    joints: Annotated[
        int, typer.Option("--joints", metavar="N", min=100, help="With --against-angle: number of joints used.")
    ] = 1000,
    point: AtPoints = None,
    study_file: StudyOption = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Print which tolerances and errors cause the largest loads.

    Prints for each line of the drawing, an entry of [tolerances], the share of the joints above the limit if it were
    half as wide, exact, finer or coarser by one class (else by the factors 0.63 and 1.6). With --run, simulates these
    joints, which have the seeds of FILE and keep their loads in it: until the order of the lines is settled, the time
    is up, or each change has --most joints. To go on, run the same command again.

    Prints for each error: the share of the load's variance that it explains alone and in interactions (first-order and
    total Sobol' indices), the direction of its effect (rank regression), and the probability that a joint above the
    limit (without a limit: above the 90 % quantile) has a larger, or a more extreme, error than a joint below.

    With --pick-freeze N, FILE is a study. A design of N points is simulated into OUT, each point with two joints and
    one more for each group of errors; it gives total indices with intervals instead of bounds. To resume after an
    interruption, run the same command again. OUT can be given as FILE afterwards.

    With --against-angle, prints the first-order indices of a force or torque over the revolution, and with --out writes
    them at each input angle. Joints are simulated again if FILE has no load histories.

    Example: tolstat causes iso2768_f.h5 --by cross1.F
    """
    if against_angle:
        if points is not None:
            raise InputError([Fault("--against-angle", "cannot be combined with --pick-freeze", "remove one of them")])
        _against_angle(file, by, top, logarithm, out, joints, point, study_file, wide)
        return
    if run:
        if points is not None or out is not None:
            raise InputError([Fault("--run", "cannot be combined with --pick-freeze or --out", "remove one of them")])
        _run_lines(file, by, each, group, budget, most, workers)
    elif group or each != Each.ENTRY:
        raise InputError([Fault("--each, --group", "say what --run simulates", "add --run")])
    from tolstat.cli._questions import show
    from tolstat.questions.causes import rendering
    from tolstat.questions.causes.lines import lines
    from tolstat.questions.causes.query import causes_of
    from tolstat.store import ResultFile

    if points is not None:
        file = _run_design(file, points, groups, out, workers)
    elif out is not None:
        remedy = "add --pick-freeze 1024, or --against-angle"
        raise InputError([Fault("--out", "is used with --pick-freeze or --against-angle only", remedy)])
    with progress("causes"), ResultFile.open(file) as store:
        view = store.view(study_file).at(point or "")
        load = by or view.decisive
        changed = None
        with suppress(NotApplicable):
            changed = lines(view, load) if view.altered else None
        found = causes_of(view, load, log=logarithm)
    if as_json:
        typer.echo(as_text(rendering.values(found) | ({"lines": changed.values()} if changed else {})))
        return
    if changed is not None:
        show(changed, wide)
        typer.echo(f"\n{rendering.heading(found)}")
    elif not found.from_design:
        say(f"which line of the drawing to change: tolstat causes {file} --run")
    print_table(rendering.columns(found), rendering.largest(found, top), wide)
    say(rendering.note(found, logarithm, changed is not None))


def _run_lines(
    path: Path, by: str | None, each: Each, group: list[str] | None, budget: str, most: int, workers: int | None
) -> None:
    """Simulate joints with other widths of each line into the result file."""
    from tolstat.cli._work import work
    from tolstat.cli.run import parse_time
    from tolstat.questions.causes.lines_run import simulate

    seconds = parse_time(budget, "--budget")
    with work(workers, path.parent) as running:
        simulate(path, running, by, each.value, group, seconds, most)


def _run_design(path: Path, points: int, groups: Groups, out: Path | None, workers: int | None) -> Path:
    """Simulate a pick-freeze design of a study; returns the result file."""
    from tolstat import study
    from tolstat.cli import run
    from tolstat.study.rewriting import with_keys

    keys = {"method": "pick_freeze", "n": points, "groups": groups.value}
    plan = study.load(path, text=with_keys(study.load(path).text, {("sampling",): keys}, str(path)))
    target = out if out is not None else Path(f"{path.stem}_causes.h5")
    run.simulate(plan, target, workers=workers)
    return target


def _against_angle(
    file: Path,
    by: str | None,
    top: int,
    logarithm: bool,
    out: Path | None,
    joints: int,
    point: str | None,
    study_file: Path | None,
    wide: bool,
) -> None:
    from tolstat.common.files import check_target
    from tolstat.questions.causes import angles_figure
    from tolstat.questions.causes.angles import against_angle
    from tolstat.store import ResultFile, revolutions

    if out is not None:
        for path in (out, out.with_suffix(".png")):
            check_target(path, file)
    with progress("causes over the input angle"), ResultFile.open(file) as store:
        view = store.view(study_file).at(point or "")
        view, load = view.narrowed(by or view.most_exceeded)
        if not revolutions.held(store):
            announce_compilation()
        found = against_angle(view, [load], joints, (load,) if logarithm else ())[0]
    print_table(angles_figure.COLUMNS, angles_figure.rows(found, top), wide)
    say(angles_figure.note(found, logarithm))
    if out is None:
        return
    with output_file(out) as temporary:
        found.table().to_csv(temporary, index=False, encoding="utf-8", lineterminator="\n")
    for path in (out, *angles_figure.save(found, logarithm, out.with_suffix(".png"))):
        say(f"wrote {path}")
