"""The command line: standard output is data, standard error is talk, exit codes mean something.

0: done (joints that failed or did not settle are data, and are counted); 1: a fault of tolstat or of the
machine; 2: an input that cannot be used; 130: interrupted;
143: terminated. What is heavy is imported inside the commands.
"""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from tolstat import __version__
from tolstat.common.errors import Fault, InputError, TolstatError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from tolstat.common.tables import Variant
    from tolstat.joint import Joint
    from tolstat.report import Report

ABOUT = "Monte Carlo tolerance analysis of Cardan joints: which load is exceeded by which share of the joints."
EPILOG = "Exit codes: 0 done, 1 internal error, 2 input that cannot be used, 130 interrupted, 143 terminated."


class _Commands(TyperGroup):
    """Commands of one or two words; errors that a user can mend become a message and an exit code."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        two = " ".join(args[:2])
        return super().resolve_command(ctx, [two, *args[2:]] if two in self.commands else args)

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except TolstatError as error:
            say(f"error: {error}")
            raise typer.Exit(2) from error
        except KeyboardInterrupt as error:
            say("interrupted")
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
Workers = Annotated[int | None, typer.Option("--workers", metavar="W", min=1, help="Processes; default one per core.")]


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


def say(text: str) -> None:
    typer.echo(text, err=True)


def warn(path: Path, joints: Iterable[Joint], variants: Iterable[Variant] = ()) -> None:
    """Warn of joints that are hardly meant: that of a case or study, or those of its `variants`."""
    places = [f"variant {variant.family!r}: joint" for variant in variants] or ["joint"]
    faults = (f"{place}.{fault}" for place, joint in zip(places, joints, strict=True) for fault in joint.warnings())
    for fault in dict.fromkeys(faults):
        say(f"warning: {path}: {fault}")


def tell(report: Report) -> None:
    typer.echo(report.table)
    say(report.notes)
    for path in report.files:
        say(f"wrote {path}")


def announce_compilation() -> None:
    from tolstat.solver.simulation import is_compiled

    if not is_compiled():
        say("compiling the kernels for this machine: about a minute, this once")


def as_text(summary: dict[str, Any]) -> str:
    import json

    return json.dumps(summary, indent=2, allow_nan=False)


@contextmanager
def writing(path: Path) -> Iterator[Path]:
    """Yield a temporary file that becomes `path`; what hinders that is the user's to mend."""
    from tolstat.common import files

    try:
        with files.atomic_write(path) as temporary:
            yield temporary
    except OSError as error:
        found = f"cannot be written: {error.strerror or error}"
        raise InputError([Fault(str(path), found, "check the folder, its permissions and space")]) from error


def make_folder(path: Path) -> None:
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        found = f"cannot be made a folder: {error.strerror or error}"
        raise InputError([Fault(str(path), found, "name another folder with --out")]) from error


@contextmanager
def filling(folder: Path) -> Iterator[None]:
    """Turn what hinders files from being written to a folder into a fault of the user's to mend."""
    try:
        yield
    except OSError as error:
        found = f"cannot be written to: {error.strerror or error}"
        raise InputError([Fault(str(folder), found, "name another folder with --out")]) from error
