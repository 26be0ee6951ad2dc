"""The command line: one file per command, shared parts in `_app`. `tolstat --help` lists commands in this order."""

from importlib import import_module

from tolstat import questions
from tolstat.cli import bench
from tolstat.cli._app import app, main

__all__ = ["COMMANDS", "app", "main"]

COMMANDS = (
    *("new", "schema", "simulate", "plan", "run", "extend", "merge", "status", "verify", "replay", "export", "report"),
    *questions.COMMANDS,
)
"""Files of this package, each with a function of the same name; on the command line ``-`` stands for ``_``."""
for command in COMMANDS:
    app.command()(getattr(import_module(f"tolstat.cli.{command}"), command))
for words, instrument in bench.INSTRUMENTS.items():
    app.command(words, epilog=bench.SEE_ALSO)(instrument)
