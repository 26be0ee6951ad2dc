"""The application ``tolstat``: its help, and its commands, each imported when it is used.

Functions of questions are made by `_command`, those of the other commands from files of this package.
"""

from __future__ import annotations

import gc
import io
import sys
from collections.abc import Callable
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperArgument, TyperCommand, TyperGroup

from tolstat import __version__
from tolstat.cli import _command
from tolstat.common.cores import limit_threads
from tolstat.questions import QUESTIONS

PLAIN = {
    "Plan": {
        "new": "Write a study with comments that runs as it stands.",
        "show": "Draw a joint, its errors, or one joint of a campaign.",
        "simulate": "Simulate one joint, with and without its errors.",
        "plan": "Predict time, memory and precision of a campaign.",
    },
    "Run": {
        "run": "Simulate the joints of a study and print a report.",
        "extend": "Add joints to a campaign and simulate them.",
        "merge": "Merge the slices of a campaign into one result file.",
        "status": "Print the number of joints by status.",
        "verify": "Estimate the numerical error on some joints.",
        "replay": "Simulate one joint again and compare with the file.",
        "evaluate": "Simulate joints whose errors another program gives.",
    },
    "Read": {"report": "Report the share of joints above each load."},
    "Decide": {},
    "Share": {
        "export": "Export joints, load cycles or statistics to files.",
        "docs": "Print a page of the documents, or a JSON schema.",
        "cache": "Show where compiled kernels are kept, or remove them.",
    },
}
"""Commands that are no question, by heading of the help: functions of this package, and their first lines."""
FILES = {
    **dict.fromkeys(("plan", "extend", "merge"), "run"),
    **dict.fromkeys(("replay", "evaluate", "show"), "simulate"),
    **dict.fromkeys(("status", "verify", "export", "report"), "results"),
    "cache": "docs",
}
"""Files of commands that have none of their own name."""
ASKED = {question.name.replace("_", "-"): question for question in QUESTIONS if question.heading}
"""Questions by the names of their commands."""
HEADINGS = {
    heading: plain | {name: question.summary for name, question in ASKED.items() if question.heading == heading}
    for heading, plain in PLAIN.items()
}
LISTED = {name: summary for commands in HEADINGS.values() for name, summary in commands.items()}
"""First line of the help of each command, in the order of the help."""
CONTEXT = {"help_option_names": ["-h", "--help"]}
EPILOG = (
    "Exit codes: 0 success, 1 internal error (replay: results differ), 2 input that cannot be used, "
    "128 + N stopped by signal N (130 after Ctrl-C)."
)


def function_of(name: str) -> Callable[..., None]:
    """Import the function of a command."""
    if name in ("run", "extend"):
        _command.check_memory()  # before libraries are loaded
    if name in ASKED:
        return _command.function_of(ASKED[name])
    function: Callable[..., None] = getattr(import_module(f"tolstat.cli.{FILES.get(name, name)}"), name)
    return function


class _Commands(TyperGroup):
    """Commands under their headings; each is imported when it is used."""

    _completes = False

    def list_commands(self, ctx: Any) -> list[str]:
        """Names of all commands."""
        return list(LISTED)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """A command by its name; None if there is none."""
        if self._completes and cmd_name in LISTED:
            return TyperCommand(cmd_name, help=LISTED[cmd_name])
        if cmd_name in LISTED and cmd_name not in self.commands:
            with _command.exit_codes():
                function = _command.command_of(function_of(cmd_name))
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
        for heading, commands in HEADINGS.items():
            with formatter.section(heading):
                formatter.write_dl([(f"{name:{width}}", summary) for name, summary in commands.items()])


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
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # of characters that its encoding does not have
    gc.disable()  # until the command begins: the search for garbage among new modules finds none and takes time
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
    """Monte Carlo tolerance analysis of over-constrained mechanisms: which share exceeds a load.

    \b
    For the first time:
      tolstat new shaft                         a study to edit
      tolstat plan shaft.toml                   its time, memory and precision
      tolstat run shaft.toml                    simulate it, and print the report
      tolstat report shaft.h5 --out shaft.html  the page
    """  # noqa: D301
