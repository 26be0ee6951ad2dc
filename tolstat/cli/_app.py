"""The application ``tolstat``: its help, and its commands, each imported when it is used."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, NamedTuple

import typer
from typer.core import TyperArgument, TyperCommand, TyperGroup

from tolstat import __version__
from tolstat.cli._command import command_of, exit_codes
from tolstat.common.cores import limit_threads

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
        if self._completes and cmd_name in LISTED:
            return TyperCommand(cmd_name, help=LISTED[cmd_name].summary)
        if cmd_name in LISTED and cmd_name not in self.commands:
            with exit_codes():
                function = command_of(LISTED[cmd_name].make())
            alone = typer.Typer(rich_markup_mode=None, pretty_exceptions_enable=False, add_completion=False)
            alone.command(cmd_name, context_settings=CONTEXT)(function)
            self.commands[cmd_name] = made = typer.main.get_command(alone)
            for argument in made.params:
                if isinstance(argument, TyperArgument):  # help says FILE alone, without a type of Python behind it
                    argument.display_type_rich = lambda ctx: None  # type: ignore[method-assign]
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
            rows = [(f"{name:{width}}", one.summary) for name, one in LISTED.items() if one.heading == heading]
            with formatter.section(heading):
                formatter.write_dl(rows)


app = typer.Typer(
    name="tolstat",
    cls=_Commands,
    epilog=EPILOG,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings=CONTEXT,
)


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
    """Monte Carlo tolerance analysis of Cardan joints: which share of the joints exceeds a load.

    \b
    For the first time:
      tolstat new shaft                         a study to edit
      tolstat plan shaft.toml                   its time, memory and precision
      tolstat run shaft.toml                    simulate it, and print the report
      tolstat report shaft.h5 --out shaft.html  the page
    """  # noqa: D301
