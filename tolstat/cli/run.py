"""``tolstat run``: a campaign."""

from __future__ import annotations

from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tolstat.cli._app import Workers, announce_compilation, say, tell, warn
from tolstat.common.errors import Fault, InputError, gather

if TYPE_CHECKING:
    from tolstat.store import Counts
    from tolstat.study import Study

SECONDS = {"s": 1.0, "min": 60.0, "h": 3600.0}


class Kind(StrEnum):
    """Where joints are simulated, see `execution.Execution`."""

    PROCESSES = "processes"
    SERIAL = "serial"
    DASK = "dask"


def run(
    study_file: Annotated[Path, typer.Argument(metavar="STUDY", help="Study file (TOML).")],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="Result file; default STUDY.h5 in the current folder."),
    ] = None,
    n: Annotated[
        int | None, typer.Option("--n", metavar="N", min=1, help="Number of joints instead of the study's.")
    ] = None,
    workers: Workers = None,
    executor: Annotated[
        Kind,
        typer.Option("--executor", metavar="WHERE", help="processes; dask; or serial, without guard against crashes."),
    ] = Kind.PROCESSES,
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler", metavar="URL", help="Dask scheduler, tcp://...; default a cluster of this machine."
        ),
    ] = None,
    joint_timeout: Annotated[
        str, typer.Option("--joint-timeout", metavar="TIME", help="A joint that takes longer twice is given up.")
    ] = "300 s",
    retry: Annotated[
        str | None,
        typer.Option("--retry", metavar="STATES", help="Simulate joints again that are newton_failed,timeout or so."),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="With --retry: another setting, solver.steps_per_rev=360."),
    ] = None,
    rows: Annotated[
        str | None,
        typer.Option(
            "--rows", metavar="A:B", help="Make FILE a slice of the campaign: rows A to B-1, for tolstat merge."
        ),
    ] = None,
    until: Annotated[
        str | None,
        typer.Option("--until", metavar="RULE", help='Stop when it holds: "P(cross1.F > 700 N) width < 0.01".'),
    ] = None,
    verify: Annotated[
        bool, typer.Option(help="Check the numerical error on a few joints at the end, one in 400.")
    ] = True,
    report: Annotated[bool, typer.Option(help="Write and print the report at the end.")] = True,
) -> None:
    """Simulate the joints of a study, then report.

    Only joints that FILE does not hold yet are simulated: stopped with Ctrl-C or killed, the same command goes on
    where it was.
    """
    from tolstat import study
    from tolstat.campaign.blocks import Execution
    from tolstat.campaign.retry import parse

    faults: list[Fault] = []
    limit, part, again = 0.0, None, None
    with gather(faults):
        limit = seconds_of(joint_timeout)
    with gather(faults):
        part = None if rows is None else slice_of(rows)
    if rows is not None and until is not None:
        faults.append(Fault("--until", "does not go with --rows", "give one of the two"))
    if until is not None and retry is not None:
        faults.append(Fault("--until", "does not go with --retry", "give one of the two"))
    if scheduler is not None and executor is not Kind.DASK:
        faults.append(Fault("--scheduler", "is for a Dask cluster", "add --executor dask"))
    if settings and retry is None:
        faults.append(Fault("--set", "is for joints that are simulated again", "add --retry, or edit the study"))
    with gather(faults):
        plan = study.load(study_file, n=n)
        again = None if retry is None else parse(retry, settings or (), plan)
    if faults:
        raise InputError(faults)
    warn(study_file, plan.joints, plan.variants)
    path = out if out is not None else Path(f"{study_file.stem}.h5")
    execution = Execution(executor.value, workers, joint_timeout=limit, scheduler=scheduler)
    if until is None:
        carry_out(plan, path, report, execution=execution, check=verify, rows=part, retry=again)
    else:
        carry_out(plan, path, report, until, execution=execution, check=verify)


def seconds_of(text: str, option: str = "--joint-timeout") -> float:
    """Time that ``"60 s"`` of an option stands for, in seconds.

    Raises
    ------
    InputError
        When it is something else, or not above zero.
    """
    number, _, unit = text.partition(" ")
    try:
        seconds = float(number) * SECONDS[unit.strip()]
    except (KeyError, ValueError):
        seconds = 0.0
    if not 0 < seconds < float("inf"):
        raise InputError([Fault(option, f"{text!r} is no time", 'write "60 s", "5 min" or "1 h"')])
    return seconds


def slice_of(text: str) -> range:
    """Rows that ``"5000:10000"`` stands for: the first one, and the one after the last.

    Raises
    ------
    InputError
        When it is something else.
    """
    first, colon, last = text.partition(":")
    if not (colon and first.isdecimal() and last.isdecimal() and int(first) < int(last)):
        raise InputError([Fault("--rows", f"{text!r} is no part of the rows", "write --rows 5000:10000")])
    return range(int(first), int(last))


def carry_out(plan: Study, path: Path, report: bool, until: str | None = None, **choices: Any) -> None:
    """Simulate what is pending, with progress on stderr, and report; `choices` go to `campaign.run`."""
    from tolstat.campaign import run as campaign
    from tolstat.campaign.executors import WorkerDied

    try:
        counts = _campaign_until(until, plan, path, **choices) if until else _campaign(plan, path, **choices)
    except campaign.Interrupted as stop:
        say(str(stop))
        raise typer.Exit(stop.exit_code) from stop
    except WorkerDied as error:
        say(f"error: {error}")
        raise typer.Exit(1) from error
    say(f"{path}: {counts.done} joints, {counts.shortfall}")
    if report:
        from tolstat.report import build

        tell(build(path))


def _campaign(plan: Study, path: Path, **choices: Any) -> Counts:
    from tolstat.campaign import progress
    from tolstat.campaign import run as campaign

    announce_compilation()
    with progress.reporter() as reporter:
        return campaign.run(plan, path, progress=reporter, tell=reporter.note, **choices)


def _campaign_until(text: str, plan: Study, path: Path, **choices: Any) -> Counts:
    from tolstat.campaign import progress, stop_rule
    from tolstat.campaign import run as campaign
    from tolstat.store import ResultStore

    rule = stop_rule.parse(text)
    announce_compilation()
    with progress.reporter() as reporter:
        run = partial(campaign.run, plan, path, progress=reporter, tell=reporter.note, **choices)
        outcome = stop_rule.run_until(plan, path, rule, lambda row: run(until_row=row))
    look = outcome.look
    n_looks = len(outcome.looks)
    say(
        f"{rule.text}: {'reached' if outcome.reached else 'not reached'} with {look.joints} joints, "
        f"{look.above} above, {look.n_unresolved} failed or not settled (counted both ways)\n"
        f"{stop_rule.CONFIDENCE:.0%} interval {look.lower:.5f} to {look.upper:.5f}, "
        f"corrected for {n_looks} planned look{'s' * (n_looks > 1)}; those of the report are not"
    )
    with ResultStore.open(path) as store:
        return store.counts()
