"""``tolstat causes``: the errors behind a load."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import Workers, announce_compilation, as_text, say, writing
from tolstat.cli.extend import StudyFile
from tolstat.common.errors import Fault, InputError


class Groups(StrEnum):
    """Errors that a pick-freeze design moves together."""

    TOLERANCE = "tolerance"
    ERROR = "error"


def causes(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Result file; with --pick-freeze a study (TOML).")],
    by: Annotated[str, typer.Option("--by", metavar="LOAD", help="cross1.F, pin2.contact, psi.")] = "cross1.F",
    n: Annotated[int, typer.Option("--n", metavar="N", min=1, help="Number of errors in the table.")] = 12,
    log: Annotated[bool, typer.Option("--log", help="Decompose the variance of the load's logarithm.")] = False,
    points: Annotated[
        int | None,
        typer.Option("--pick-freeze", metavar="N", min=50, help="Run a design of N points."),
    ] = None,
    groups: Annotated[
        Groups,
        typer.Option(
            "--groups", metavar="WHAT", help="Groups of the design: tolerance (entries of the study) or error."
        ),
    ] = Groups.TOLERANCE,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="OUT", help="Result file of the design; default STUDY_causes.h5.")
    ] = None,
    workers: Workers = None,
    against_angle: Annotated[
        Path | None,
        typer.Option(
            "--against-angle",
            metavar="OUT.csv",
            help="Shares of the variance at each shaft angle instead: CSV file, and OUT.png beside it.",
        ),
    ] = None,
    joints: Annotated[
        int, typer.Option("--joints", metavar="N", min=100, help="Number of joints for --against-angle.")
    ] = 1000,
    study_file: StudyFile = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, with all errors, instead of a table.")] = False,
) -> None:
    """Find which errors make a load scatter, and which make its tail.

    For each error: the share of the load's variance that it explains alone, and that it takes part in (Sobol' indices
    from the joints of the file); the rank regression coefficient; and the probability that a joint above the limit (or
    the 90 % quantile) has the larger error, or the one farther from the middle, than a joint below.

    With --pick-freeze the indices come from joints that are simulated for them: no fit, and intervals in place of
    bounds. Each point takes two joints and one for each group of errors. After an interruption the same command
    resumes the design; its result file OUT can also be given as FILE.

    With --against-angle the table has the shares that each error explains alone of the force or torque at each angle,
    and over the revolution; joints without histories in FILE are simulated again.
    """
    if against_angle is not None:
        if points is not None or out is not None:
            raise InputError([Fault("--against-angle", "excludes --pick-freeze and --out", "give one of them")])
        _against_angle(file, by, n, log, against_angle, joints, study_file)
        return
    from tolstat.questions.causes import rendering
    from tolstat.questions.causes.query import causes_of
    from tolstat.store import ResultStore

    if points is not None:
        file = _run_design(file, points, groups, out, workers)
    elif out is not None:
        raise InputError([Fault("--out", "is for a design", "add --pick-freeze 1024")])
    with ResultStore.open(file) as store:
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
    from tolstat.cli.run import carry_out
    from tolstat.study.rewriting import with_keys

    keys = {"method": "pick_freeze", "n": points, "groups": groups.value}
    plan = study.load(path, text=with_keys(study.load(path).text, {("sampling",): keys}, str(path)))
    target = out if out is not None else Path(f"{path.stem}_causes.h5")
    carry_out(plan, target, False, execution=Execution("processes", workers))
    return target


def _against_angle(file: Path, by: str, n: int, log: bool, out: Path, joints: int, study_file: Path | None) -> None:
    from tolstat.common.files import check_target
    from tolstat.questions.causes import angles_figure
    from tolstat.questions.causes.angles import against_angle
    from tolstat.store import ResultStore, revolutions

    picture = out.with_suffix(".png")
    for path in (out, picture):
        check_target(path, file)
    with ResultStore.open(file) as store:
        view = store.view(study_file)
        if not revolutions.held(store):
            announce_compilation()
        found = against_angle(view, [by], joints, (by,) if log else ())[0]
    typer.echo(angles_figure.text(found, n))
    say(angles_figure.note(found, log))
    with writing(out) as temporary:
        found.table().to_csv(temporary, index=False, encoding="utf-8", lineterminator="\n")
    for path in (out, *angles_figure.save(found, log, picture)):
        say(f"wrote {path}")
