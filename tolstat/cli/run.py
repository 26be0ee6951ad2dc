"""``tolstat run``: run a campaign."""

from __future__ import annotations

from enum import StrEnum
from functools import partial
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tolstat.cli._app import Wide, Workers, announce_compilation, print_study_notes
from tolstat.cli._shortage import check_memory
from tolstat.cli._talk import progress, say
from tolstat.cli._work import exit_codes
from tolstat.common.errors import Fault, InputError, gather

if TYPE_CHECKING:
    from tolstat.common.counts import Counts
    from tolstat.store import Reader
    from tolstat.study import Study


class Executor(StrEnum):
    """Where joints are simulated, see `campaign.run`."""

    PROCESSES = "processes"
    DASK = "dask"


def run(
    study_file: Annotated[Path, typer.Argument(metavar="STUDY", help="Study file (TOML).")],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="Result file; default: STUDY.h5 in the current folder."),
    ] = None,
    n: Annotated[
        int | None, typer.Option("--n", metavar="N", min=1, help="Number of joints; default: that of the study.")
    ] = None,
    workers: Workers = None,
    executor: Annotated[
        Executor,
        typer.Option("--executor", metavar="WHERE", help="processes (of this machine), or dask (a cluster)."),
    ] = Executor.PROCESSES,
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler",
            metavar="URL",
            help="Address of a Dask scheduler, tcp://HOST:PORT; default: start a cluster on this machine.",
        ),
    ] = None,
    retry: Annotated[
        str | None,
        typer.Option(
            "--retry", metavar="STATES", help="Statuses of joints to simulate again, such as newton_failed,crashed."
        ),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="Key in place of that of the study, joint.shaft.axial=free; with --retry also of the solver for the "
            "joints simulated again, solver.steps_per_rev=360; repeatable.",
        ),
    ] = None,
    rows: Annotated[
        str | None,
        typer.Option(
            "--rows", metavar="A:B", help="Simulate rows A to B-1 only; FILE is then a slice for tolstat merge."
        ),
    ] = None,
    until: Annotated[
        str | None,
        typer.Option(
            "--until",
            metavar="RULE",
            help='Stop when a 95 % interval is narrow enough: "P(cross*.F > 700 N) width < 0.01", "P(any limit) ...".',
        ),
    ] = None,
    verify: Annotated[
        bool, typer.Option(help="Check the numerical error on one joint in 400 (1 to 16) at the end.")
    ] = True,
    report: Annotated[bool, typer.Option(help="Print the report at the end and write its files.")] = True,
    wide: Wide = False,
) -> None:
    """Simulate the joints of a study and print a report.

    Simulates the joints that are pending in the result file, which is created if missing. To resume after an
    interruption (Ctrl-C, kill, power failure), run the same command again.

    With --set the study is run with another value of a key of its sections joint, operation, sampling or output: give
    --out, too, and the same --set again to resume.

    Prints the share of joints above each limit (see tolstat report) and of those that keep all limits, why joints have
    no valid load, and the next command. Writes the result file, and beside it the curves as PNG, SVG and CSV.

    Example: tolstat run studies/iso2768_f.toml --n 512 --out first.h5
    """
    check_memory()
    from tolstat.common.files import check_target

    part, again = None, None
    retried = [own for own in settings or () if own.startswith("solver.")]
    changes = [own for own in settings or () if own not in retried]
    faults = _cannot_be_combined(rows, until, retry, retried)
    if scheduler is not None and executor is not Executor.DASK:
        faults.append(Fault("--scheduler", "is used with --executor dask only", "add --executor dask"))
    with gather(faults):
        part = None if rows is None else parse_rows(rows)
    path = out if out is not None else Path(f"{study_file.stem}.h5")
    with gather(faults):
        check_target(path)  # now, not when the pictures of the report are written
    from tolstat import study
    from tolstat.campaign.remedy import parse_retry
    from tolstat.common import strict
    from tolstat.study import rewriting
    from tolstat.study.assumptions import unselected

    with gather(faults):
        text = rewriting.with_settings(strict.read_text(study_file), changes) if changes else None
        plan = study.load(study_file, n=n, text=text)
        again = None if retry is None else parse_retry(retry, retried, plan)
    if faults:
        raise InputError(faults)
    print_study_notes(study_file, plan)
    if exact := unselected(plan):
        say(f"no tolerance, taken as exact: {', '.join(exact)}")
    where = {"workers": workers, "executor": executor.value, "scheduler": scheduler}
    simulate(plan, path, until=until, check=verify, rows=part, retry=again, **where)
    conclude(path, report, wide, " ".join([str(study_file), *(f"--set {quote(own)}" for own in changes)]))


def _cannot_be_combined(rows: str | None, until: str | None, retry: str | None, settings: list[str]) -> list[Fault]:
    faults = []
    if rows is not None and until is not None:
        faults.append(Fault("--until", "cannot be combined with --rows", "remove --until or --rows"))
    if until is not None and retry is not None:
        faults.append(Fault("--until", "cannot be combined with --retry", "remove --until or --retry"))
    if settings and retry is None:
        remedy = "add --retry newton_failed, or edit the study"
        faults.append(Fault(f"--set {settings[0]!r}", "sets the solver, which --retry alone can", remedy))
    return faults


def parse_rows(text: str) -> range:
    """Parse a range of rows, ``"5000:10000"``: the first row, and the row after the last.

    Raises
    ------
    InputError
        When the text is not a range with at least one row.
    """
    first, colon, last = text.partition(":")
    if not (colon and first.isdecimal() and last.isdecimal() and int(first) < int(last)):
        raise InputError([Fault("--rows", f"{text!r} is not a range of rows", "write --rows 5000:10000")])
    return range(int(first), int(last))


def simulate(plan: Study, path: Path, until: str | None = None, **choices: Any) -> None:
    """Simulate a campaign with progress on standard error; `choices` go to `campaign.run`."""
    announce_compilation()
    with exit_codes():
        counts = _campaign_until(until, plan, path, **choices) if until else _campaign(plan, path, **choices)
    say(f"{path}: {counts.done} {counts.counted}, {counts.shortfall}")


def conclude(path: Path, report: bool, wide: bool, study: str = "STUDY") -> None:
    """Print the report of a campaign if asked for, why joints have no valid load, and the next command.

    `study` is the study file as the user gave it, with its settings.
    """
    from tolstat.campaign.remedy import reasons
    from tolstat.cli._questions import show
    from tolstat.report.answer import report as answer
    from tolstat.report.answer import write
    from tolstat.store import ResultFile

    with ResultFile.open(path) as store:
        if report:
            with progress("report") as shown:
                view = store.view()
                made = answer(view)
                shown.stage("files")
                files = write(made, path)
            show(made, wide)
            for file in files:
                say(f"wrote {file}")
        found = reasons(store, {one.point or "": one.status() for one in store.each()})
        for reason in found:
            say(reason.text)
        for retry in dict.fromkeys(reason.retry for reason in found if reason.retry):
            say(f"again: tolstat run {study} --out {path} {retry}")
        say(f"next: {_next(store, path)}")


def _next(store: Reader, path: Path) -> str:
    """Command that follows the run of a campaign."""
    file, csv, page = (quote(str(name)) for name in (path, path.with_suffix(".csv"), path.with_suffix(".html")))
    if not store.whole:
        return f"tolstat merge {file} OTHER_SLICES --out WHOLE.h5"
    if store.case_names:
        return f"tolstat export {file} --csv {csv}"
    return f"tolstat report {file} --out {page}"


def _campaign(plan: Study, path: Path, **choices: Any) -> Counts:
    from tolstat.campaign import run as campaign

    with progress() as shown:
        return campaign.run(plan, path, progress=shown, tell=shown.note, stage=shown.stage, **choices)


def _campaign_until(text: str, plan: Study, path: Path, **choices: Any) -> Counts:
    from tolstat.campaign import run as campaign
    from tolstat.campaign import stop_rule
    from tolstat.store import ResultFile

    rule = stop_rule.parse(text, plan.limits)
    with progress() as shown:
        run = partial(campaign.run, plan, path, progress=shown, tell=shown.note, stage=shown.stage, **choices)
        outcome = stop_rule.run_until(plan, path, rule, lambda row: run(until_row=row))
    look = outcome.look
    say(
        f"{rule.text}: {'reached' if outcome.reached else 'not reached'} with {look.joints} joints, "
        f"{look.above} above, {look.n_unresolved} failed or not settled\n"
        f"{100 * stop_rule.CONFIDENCE:.0f} % interval {look.lower:.5f} to {look.upper:.5f}, valid after any number of "
        "looks (failed and unsettled joints: below at its lower end, above at its upper end)\n"
        f"share above {look.estimate:.5f}{f', {stop_rule.BIASED}: go by the interval' if outcome.reached else ''}; "
        "shares and intervals in the report are not corrected for the stop"
    )
    with ResultFile.open(path) as store:
        return store.counts()
