"""The command line: standard output is data, standard error is talk, exit codes mean something.

0: done (joints that failed or did not settle are data, and are counted); 1: a fault of tolstat or of the
machine; 2: an input that cannot be used; 130: interrupted. What is heavy is imported inside the commands.
"""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from tolstat import __version__
from tolstat.errors import Fault, InputError, TolstatError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import TextIO

    import pandas as pd

    from tolstat.report import Report
    from tolstat.store import Counts
    from tolstat.trace import CaseResult

ABOUT = "Monte Carlo tolerance analysis of Cardan joints: which load is exceeded by which share of the joints."
EPILOG = "Exit codes: 0 done, 1 internal error, 2 input that cannot be used, 130 interrupted."


class _Commands(TyperGroup):
    """Turns errors that a user can mend into a message and an exit code, for every command in one place."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except TolstatError as error:
            _say(f"error: {error}")
            raise typer.Exit(2) from error
        except KeyboardInterrupt as error:
            _say("interrupted")
            raise typer.Exit(130) from error


app = typer.Typer(
    name="tolstat",
    cls=_Commands,
    help=ABOUT,
    epilog=EPILOG,
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

ResultFile = Annotated[Path, typer.Argument(metavar="FILE", help="Result file (HDF5) of a campaign.")]


def main() -> None:
    """Run the command line; the entry point of ``tolstat`` and ``python -m tolstat``."""
    app(prog_name="tolstat")


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"tolstat {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    pass


@app.command()
def simulate(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="Case file (TOML): one joint with its errors.")],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="CSV", help="Write the trace of the last revolution.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
) -> None:
    """Simulate one joint and print its largest loads.

    The loads are those of the last revolution, cross bushings 1 to 4 and fork bushings 1 to 4.
    """
    from tolstat import study, trace
    from tolstat.files import check_target

    if out is not None:
        check_target(out, case)
    loaded = study.load_case(case)
    _announce_compilation()
    result = trace.simulate_case(loaded)
    summary = result.summary()
    typer.echo(_json(summary) if as_json else _case_text(summary))
    _judge(summary)
    if out is not None:
        _write_trace(result, out)


@app.command()
def run(
    study_file: Annotated[Path, typer.Argument(metavar="STUDY", help="Study file (TOML).")],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="Result file; default STUDY.h5 in the current folder."),
    ] = None,
    n: Annotated[
        int | None, typer.Option("--n", metavar="N", min=1, help="Number of joints instead of the study's.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option("--workers", metavar="W", min=1, help="Processes; default one per core.")
    ] = None,
    report: Annotated[bool, typer.Option(help="Write and print the report at the end.")] = True,
) -> None:
    """Simulate the joints of a study, then report.

    Only joints that FILE does not hold yet are simulated: stopped with Ctrl-C, the same command goes on where
    it was.
    """
    from tolstat import campaign, study
    from tolstat.executor import WorkerDied

    plan = study.load(study_file, n=n)
    path = out if out is not None else Path(f"{study_file.stem}.h5")
    try:
        counts = _campaign(plan, path, workers)
    except campaign.Interrupted as stop:
        _say(str(stop))
        raise typer.Exit(130) from stop
    except WorkerDied as error:
        _say(f"error: {error}")
        raise typer.Exit(1) from error
    _say(f"{path}: {counts.done} joints, {counts.failed} failed, {counts.not_settled} not settled")
    if report:
        from tolstat.report import build

        _tell(build(path))


@app.command()
def status(
    file: ResultFile,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of lines.")] = False,
) -> None:
    """Print what became of the joints of a campaign.

    One line for each status with the number of joints; a campaign under way can be looked at.
    """
    from tolstat.store import ResultStore
    from tolstat.tables import Status

    with ResultStore.open(file) as store:
        found = store.status().tolist()
        summary: dict[str, Any] = {"study": store.study_name, "joints": store.n}
    # An unknown code would be a file of a newer kind; the store refuses those.
    summary |= {state.label: found.count(state) for state in Status}
    lines = (f"{name}: {value}" for name, value in summary.items())
    typer.echo(_json(summary) if as_json else "\n".join(lines))


@app.command()
def export(
    file: ResultFile,
    out: Annotated[str, typer.Option("--csv", metavar="OUT", help="CSV file to write; - for standard output.")],
) -> None:
    """Write all joints of a campaign as CSV.

    One row a joint: its errors, then its results, in SI units; before them the case and variant that it is,
    if the study lists its joints. The first line names the columns, the second
    gives their units: pandas reads it with header=[0, 1]. Joints that are pending or failed have their row
    too; what is not known is empty.
    """
    import sys

    from tolstat.files import check_target
    from tolstat.store import ResultStore

    if out != "-":
        check_target(Path(out), file)
    with ResultStore.open(file) as store:
        frame = store.to_pandas(units=True)
    if out == "-":
        _write_table(frame, sys.stdout)
        return
    with _writing(Path(out)) as temporary, temporary.open("w", encoding="utf-8", newline="") as stream:
        _write_table(frame, stream)
    _say(f"wrote {out}: {len(frame)} joints")


@app.command(name="report")
def report_command(
    file: ResultFile,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for the files, made if need be; default that of FILE."),
    ] = None,
) -> None:
    """Print and draw which loads are exceeded.

    Prints the share of joints above each of the study's limits; writes curves and pictures beside FILE. A
    study without limits gets the quantiles of every bushing load, a sweep its loads against the swept value.
    """
    from tolstat.report import build
    from tolstat.store import ResultStore

    if out is not None:
        ResultStore.open(file).close()  # a file that cannot be read leaves no folder behind
        _make_folder(out)
    _tell(build(file, out))


def _say(text: str) -> None:
    typer.echo(text, err=True)


def _tell(report: Report) -> None:
    typer.echo(report.table)
    _say(report.notes)
    for path in report.files:
        _say(f"wrote {path}")


def _make_folder(path: Path) -> None:
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        found = f"cannot be made a folder: {error.strerror or error}"
        raise InputError([Fault(str(path), found, "name another folder with --out")]) from error


def _announce_compilation() -> None:
    from tolstat.simulation import is_compiled

    if not is_compiled():
        _say("compiling the kernels for this machine: half a minute to a minute, this once")


def _campaign(plan: Any, path: Path, workers: int | None) -> Counts:
    from tolstat import campaign, progress

    _announce_compilation()
    with progress.reporter() as reporter:
        return campaign.run(plan, path, workers=workers, progress=reporter)


def _case_text(summary: dict[str, Any]) -> str:
    from tolstat.report.text import align

    def value(load: float | None) -> str:
        return "-" if load is None else f"{load:.6g}"

    rows = [["bushing", "max |F| [N]", "max |T| [N m]"]]
    rows += [[name, value(load["F"]), value(load["T"])] for name, load in summary["max"].items()]
    facts = "\n".join(f"{name}: {value}" for name, value in summary.items() if name != "max")
    return f"{facts}\n{align(rows)}"


def _judge(summary: dict[str, Any]) -> None:
    from tolstat.tables import STATUS_TEXT, Status

    state = Status[str(summary["status"]).upper()]
    if state != Status.OK:
        _say(f"warning: {state.label}: {STATUS_TEXT[state]}")


def _write_table(frame: pd.DataFrame, stream: TextIO) -> None:
    import csv

    heads = csv.writer(stream, lineterminator="\n")
    names, units = zip(*frame.columns, strict=True)
    heads.writerow(["row", *names])
    heads.writerow(["1", *units])
    frame.to_csv(stream, header=False, lineterminator="\n")


def _json(summary: dict[str, Any]) -> str:
    import json

    return json.dumps(summary, indent=2, allow_nan=False)


def _write_trace(result: CaseResult, out: Path) -> None:
    with _writing(out) as temporary:
        result.to_pandas().to_csv(temporary, index=False, lineterminator="\n")
    _say(f"wrote {out}")


@contextmanager
def _writing(path: Path) -> Iterator[Path]:
    """Yield a temporary file that becomes `path`; what hinders that is the user's to mend."""
    from tolstat.files import writing

    try:
        with writing(path) as temporary:
            yield temporary
    except OSError as error:
        found = f"cannot be written: {error.strerror or error}"
        raise InputError([Fault(str(path), found, "check the folder, its permissions and space")]) from error
