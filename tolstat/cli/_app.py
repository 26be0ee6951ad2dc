"""Parts that all commands share: the application, common arguments, output, and errors with exit codes.

Results go to standard output, messages to standard error. Exit codes: 0 success (failed and unsettled joints are
results); 1 internal error, dead worker processes, or results that `replay` does not reproduce; 2 input that cannot be
used; 128 + N stopped by signal N (130 after Ctrl-C). Modules that load slowly are imported inside the commands.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import replace
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer
from typer.core import TyperArgument, TyperCommand, TyperGroup

from tolstat import __version__
from tolstat.cli._shortage import shortage
from tolstat.cli._talk import LogFile, Quiet, Verbose, fail, say, session, warn
from tolstat.common.cores import limit_threads
from tolstat.common.errors import Fault, InputError, TolstatError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from tolstat.common.tables import Variant
    from tolstat.display.table import Column, Rows
    from tolstat.joint import Joint
    from tolstat.study import Study

ABOUT = """Monte Carlo tolerance analysis of Cardan joints: which share of the joints exceeds a load.

\b
For the first time:
  tolstat new shaft                         a study to edit
  tolstat plan shaft.toml                   its time, memory and precision
  tolstat run shaft.toml                    simulate it, and print the report
  tolstat report shaft.h5 --out shaft.html  the page
"""
CONTEXT = {"help_option_names": ["-h", "--help"]}
EPILOG = (
    "Exit codes: 0 success, 1 internal error (replay: results differ), 2 input that cannot be used, "
    "128 + N stopped by signal N (130 after Ctrl-C)."
)


class Listed(NamedTuple):
    """A command before it is imported: heading and line in the help, and what makes its function."""

    heading: str
    summary: str
    make: Callable[[], Callable[..., None]]


LISTED: dict[str, Listed] = {}
"""Commands by name in the order of the help; `tolstat.cli` fills it."""


class _Commands(TyperGroup):
    """Commands under their headings; each is imported when it is used."""

    _completes = False

    def list_commands(self, ctx: Any) -> list[str]:
        """Names of all commands."""
        return list(LISTED)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """A command by its name; None if there is none."""
        if self._completes and cmd_name in LISTED and LISTED[cmd_name].summary:
            return TyperCommand(cmd_name, help=LISTED[cmd_name].summary)
        if cmd_name in LISTED and cmd_name not in self.commands:
            one = typer.Typer(rich_markup_mode=None, pretty_exceptions_enable=False, add_completion=False)
            function = command(LISTED[cmd_name].make())
            one.command(cmd_name, cls=OneCommand, context_settings=CONTEXT)(function)
            self.commands[cmd_name] = typer.main.get_command(one)
        return self.commands.get(cmd_name)

    def shell_complete(self, ctx: Any, incomplete: str) -> list[Any]:
        """Names that begin so, with their summaries: none of the commands is imported."""
        self._completes = True
        try:
            return super().shell_complete(ctx, incomplete)
        finally:
            self._completes = False

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands, one heading after the other."""
        width = max(map(len, LISTED))
        for heading in dict.fromkeys(one.heading for one in LISTED.values()):
            rows = [
                (f"{name:{width}}", one.summary or self.get_command(ctx, name).get_short_help_str(formatter.width))
                for name, one in LISTED.items()
                if one.heading == heading
            ]
            with formatter.section(heading):
                formatter.write_dl(rows)


class OneCommand(TyperCommand):
    """A command whose help names each argument by its word alone: FILE, without a type of Python behind it."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Parameters of the command, for help and for parsing."""
        found = super().get_params(ctx)
        for argument in found:
            if isinstance(argument, TyperArgument):
                argument.display_type_rich = _no_type  # type: ignore[method-assign]
        return found


def _no_type(ctx: Any) -> None:
    return None


app = typer.Typer(
    name="tolstat",
    cls=_Commands,
    help=ABOUT,
    epilog=EPILOG,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings=CONTEXT,
)

ResultPath = Annotated[Path, typer.Argument(metavar="FILE", help="Result file (HDF5) of a campaign.")]
Wide = Annotated[bool, typer.Option("--wide", help="Print all columns; default: those that fit 80 characters.")]
Workers = Annotated[
    int | None,
    typer.Option("--workers", metavar="W", min=1, help="Number of worker processes; default: one per core."),
]
AtPoints = Annotated[
    str | None,
    typer.Option(
        "--point",
        metavar="POINT",
        help="Operating point, such as cruise, or the worst of some: cruise+start; default: all.",
    ),
]
AtPoint = Annotated[
    str | None,
    typer.Option("--point", metavar="POINT", help="Operating point, such as cruise; needed if FILE has several."),
]
Accept = Annotated[
    str | None,
    typer.Option(
        "--accept",
        metavar="SHARE",
        help='Accepted share of the joints, all limits together, for the verdict: "0.1 %", "1000 ppm" or 0.001.',
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON instead of text.")]
StudyOption = Annotated[
    Path | None,
    typer.Option(
        "--study",
        metavar="STUDY",
        help="Study file (TOML) to read instead of the study text stored in FILE.",
    ),
]


def main() -> None:
    """Run the command line; the entry point of ``tolstat`` and ``python -m tolstat``."""
    limit_threads()
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


def command(function: Callable[..., None]) -> Callable[..., None]:
    """Add to a command the options that all have; errors that a user can mend become a message and an exit code."""

    @wraps(function)
    def run(*args: Any, quiet: bool, verbose: bool, log: Path | None, **options: Any) -> None:
        try:
            with session(quiet, verbose, log):
                try:
                    function(*args, **options)
                except TolstatError as error:
                    fail(f"error: {error}")
                    raise typer.Exit(2) from error
                except (MemoryError, OSError, ImportError) as error:
                    fault = shortage(error)
                    if fault is None:
                        raise
                    fail(f"error: {fault}")
                    raise typer.Exit(2) from error
                except KeyboardInterrupt as error:
                    fail("interrupted")
                    raise typer.Exit(130) from error
        except InputError as error:  # of the options themselves
            fail(f"error: {error}")
            raise typer.Exit(2) from error

    own = inspect.signature(function, eval_str=True)
    added = (("quiet", Quiet, False), ("verbose", Verbose, False), ("log", LogFile, None))
    parameters = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
        for name, annotation, default in added
    ]
    signature = own.replace(parameters=[*own.parameters.values(), *parameters])
    decorated: Any = run
    decorated.__signature__ = signature
    decorated.__annotations__ = {p.name: p.annotation for p in signature.parameters.values()}
    return run


def print_warnings(path: Path, joints: Iterable[Joint], variants: Iterable[Variant] = ()) -> None:
    """Print the warnings of the joint of a case or study, or of the joints of its `variants`; see `Joint.warnings`.

    Of several joints with a warning about the same key the first is printed, and how many others there are.
    """
    places = [f"variant {variant.family!r}: joint" for variant in variants] or ["joint"]
    found: dict[str, list[Fault]] = {}
    for place, joint in zip(places, joints, strict=True):
        for fault in joint.warnings():
            found.setdefault(fault.place, []).append(replace(fault, place=f"{place}.{fault.place}"))
    for first, *others in found.values():
        more = f" (and {len(others)} more joints)" if others else ""
        warn(f"warning: {path}: {replace(first, found=first.found + more)}")


def print_study_notes(path: Path, study: Study) -> None:
    """Print what a study stands on, and its warnings.

    These are mounting and contact law; warnings of its joints, of values that are probably not meant, shares without an
    interval, and a note where rigid shafts meet errors along them.
    """
    from tolstat.analysis.listed import without_interval
    from tolstat.study import mounting, plausible

    say(f"{study.name}: {study.joint_in_words}")
    axial = [joint.shaft.axial for joint in study.joints]
    if said := mounting.note(study.tolerances, axial, mounting.command(str(path), path.stem, study.joint)):
        say(f"note: {said}")

    print_warnings(path, study.joints, study.variants)
    for fault in plausible.warnings(study):
        warn(f"warning: {fault}")
    if not study.sampling.has_replicates and (said := without_interval(study.sampling.method)):
        warn(f"warning: {said}")


def parse_share(text: str) -> float:
    """Parse a share such as ``"0.1 %"``, ``"1000 ppm"`` or ``"1e-3"``.

    Raises
    ------
    InputError
        When the text is not a share between 0 and 1.
    """
    from pydantic_core import PydanticCustomError

    from tolstat.common.units import to_si

    try:
        share = to_si(text, "1")
    except PydanticCustomError:
        share = -1.0
    if not 0.0 < share < 1.0:
        remedy = 'write --accept "0.1 %", --accept "1000 ppm" or --accept 0.001'
        raise InputError([Fault("--accept", f"{text!r} is not a share between 0 and 1", remedy)])
    return share


def print_table(columns: Sequence[Column], rows: Rows, wide: bool) -> None:
    """Print a table on standard output, and on standard error the columns left out to fit the line."""
    from tolstat.display import table

    shown, missing = table.fitted(columns, rows, None if wide else table.WIDTH)
    typer.echo(shown)
    if missing:
        say(missing)


def announce_compilation() -> None:
    """Print a message if the kernels have to be compiled first."""
    from tolstat.solver import compilation

    compilation.announce()


def as_text(summary: dict[str, Any]) -> str:
    """Format plain values as JSON."""
    import json

    return json.dumps(summary, indent=2, allow_nan=False)


@contextmanager
def output_file(path: Path) -> Iterator[Path]:
    """Yield the path of a temporary file that replaces `path` at the end.

    Raises
    ------
    InputError
        When the file cannot be written.
    """
    from tolstat.common import files

    try:
        with files.atomic_write(path) as temporary:
            yield temporary
    except OSError as error:
        found = f"cannot be written: {files.reason(error)}"
        raise InputError(
            [Fault(str(path), found, "check that the folder is writable and the disk has space")]
        ) from error


def make_folder(path: Path) -> None:
    """Create a folder if it does not exist.

    Raises
    ------
    InputError
        When it cannot be created.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        found = f"cannot be created as a folder: {error.strerror or error}"
        raise InputError([Fault(str(path), found, "give another folder, for example: --out results")]) from error


@contextmanager
def output_folder(folder: Path) -> Iterator[None]:
    """Convert an error while files are written to a folder.

    Raises
    ------
    InputError
        When a file cannot be written.
    """
    try:
        yield
    except OSError as error:
        found = f"cannot be written to: {error.strerror or error}"
        raise InputError([Fault(str(folder), found, "give another folder, for example: --out results")]) from error
