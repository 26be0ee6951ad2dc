"""The command line: one file per command, shared parts in `_app` and `_talk`."""

from importlib import import_module

from tolstat import questions
from tolstat.cli._app import GROUPS, OneCommand, app, command, main

__all__ = ["COMMANDS", "app", "main"]

COMMANDS = {
    "Plan": ("new", "schema", *questions.commands("Plan"), "simulate", "plan"),
    "Run": ("run", "extend", "merge", "status", "verify", "replay"),
    "Read": ("report", *questions.commands("Read")),
    "Decide": questions.commands("Decide"),
    "Share": ("export", "docs", "cache"),
}
"""Headings of ``tolstat --help`` in the order of the work, and under each the files of this package with the commands,
each with a function of the same name; on the command line ``-`` stands for ``_``. Commands of questions come from their
registry."""

for heading, names in COMMANDS.items():
    for name in names:
        app.command(name.replace("_", "-"), cls=OneCommand)(
            command(getattr(import_module(f"tolstat.cli.{name}"), name))
        )
    GROUPS[heading] = tuple(name.replace("_", "-") for name in names)
