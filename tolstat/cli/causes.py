"""``tolstat causes``: sensitivity of a load to the errors."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import StudyOption, Workers, announce_compilation, as_text, output_file, say
from tolstat.common.errors import Fault, InputError


class Groups(StrEnum):
    """Errors that a pick-freeze design exchanges together."""

    TOLERANCE = "tolerance"
    ERROR = "error"


def causes(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="Result file (HDF5); with --pick-freeze: study file (TOML).")
    ],
    by: Annotated[
        str, typer.Option("--by", metavar="LOAD", help="Name of the load, such as cross1.F, pin2.contact or psi.")
    ] = "cross1.F",
    n: Annotated[int, typer.Option("--n", metavar="N", min=1, help="Number of errors in the printed table.")] = 12,
    log: Annotated[
        bool, typer.Option("--log", help="Explain the variance of the load's logarithm instead of the load's.")
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
        typer.Option("--out", metavar="OUT", help="With --pick-freeze: result file; default: STUDY_causes.h5."),
    ] = None,
    workers: Workers = None,
    against_angle: Annotated[
        Path | None,
        typer.Option(
            "--against-angle",
            metavar="OUT.csv",
            help="Write the indices at each input angle to OUT.csv, and a figure to OUT.png.",
        ),
    ] = None,
    joints: Annotated[
        int, typer.Option("--joints", metavar="N", min=100, help="With --against-angle: number of joints used.")
    ] = 1000,
    study_file: StudyOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON with all errors instead of a table.")] = False,
) -> None:
    """Print which errors cause the scatter of a load.

    Prints for each error: the share of the load's variance that it explains alone and in interactions (first-order and
    total Sobol' indices), the direction of its effect (rank regression), and the probability that a joint above the
    limit (without a limit: above the 90 % quantile) has a larger, or a more extreme, error than a joint below.

    With --pick-freeze N, FILE is a study. A design of N points is simulated into OUT, each point with two joints and
    one more for each group of errors; it gives total indices with intervals instead of bounds. To resume after an
    interruption, run the same command again. OUT can be given as FILE afterwards.

    With --against-angle OUT.csv, prints and writes the first-order indices of a force or torque at each input angle and
    over the revolution. Joints are simulated again if FILE has no load histories.

    Example: tolstat causes iso2768_f.h5 --by cross1.F
    """
    if against_angle is not None:
        if points is not None or out is not None:
            remedy = "remove these two, or --against-angle"
            raise InputError([Fault("--against-angle", "cannot be combined with --pick-freeze or --out", remedy)])
        _against_angle(file, by, n, log, against_angle, joints, study_file)
        return
    from tolstat.questions.causes import rendering
    from tolstat.questions.causes.query import causes_of
    from tolstat.store import Reader

    if points is not None:
        file = _run_design(file, points, groups, out, workers)
    elif out is not None:
        raise InputError([Fault("--out", "is used with --pick-freeze only", "add --pick-freeze 1024")])
    with Reader.open(file) as store:
        found = causes_of(store.view(study_file), by, log=log)
    if as_json:
        typer.echo(as_text(rendering.values(found)))
        return
    typer.echo(rendering.text(found, n))
    say(rendering.note(found, log))


def _run_design(path: Path, points: int, groups: Groups, out: Path | None, workers: int | None) -> Path:
    """Simulate a pick-freeze design of a study; returns the result file."""
    from tolstat import study
    from tolstat.campaign.blocks import Execution
    from tolstat.cli.run import run_and_report
    from tolstat.study.rewriting import with_keys

    keys = {"method": "pick_freeze", "n": points, "groups": groups.value}
    plan = study.load(path, text=with_keys(study.load(path).text, {("sampling",): keys}, str(path)))
    target = out if out is not None else Path(f"{path.stem}_causes.h5")
    run_and_report(plan, target, False, execution=Execution("processes", workers))
    return target


def _against_angle(file: Path, by: str, n: int, log: bool, out: Path, joints: int, study_file: Path | None) -> None:
    from tolstat.common.files import check_target
    from tolstat.questions.causes import angles_figure
    from tolstat.questions.causes.angles import against_angle
    from tolstat.store import Reader, revolutions

    figure = out.with_suffix(".png")
    for path in (out, figure):
        check_target(path, file)
    with Reader.open(file) as store:
        view = store.view(study_file)
        if not revolutions.held(store):
            announce_compilation()
        found = against_angle(view, [by], joints, (by,) if log else ())[0]
    typer.echo(angles_figure.text(found, n))
    say(angles_figure.note(found, log))
    with output_file(out) as temporary:
        found.table().to_csv(temporary, index=False, encoding="utf-8", lineterminator="\n")
    for path in (out, *angles_figure.save(found, log, figure)):
        say(f"wrote {path}")
