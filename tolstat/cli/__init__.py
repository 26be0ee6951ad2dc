"""The command line: one file per command, shared parts in `_app` and `_talk`."""

from importlib import import_module

from tolstat.cli import bench
from tolstat.cli._app import GROUPS, app, command, main

__all__ = ["COMMANDS", "app", "main"]

COMMANDS = {
    "Plan": ("new", "schema", "show", "simulate", "plan"),
    "Run": ("run", "extend", "merge", "status", "verify", "replay"),
    "Read": ("report", "capability", "worst", "causes", "fatigue", "bearing_life", "time_above"),
    "Decide": ("reweight", "allocate", "compare", "rare", "multifidelity"),
    "Share": ("export", "docs", "cache"),
}
"""Headings of ``tolstat --help`` in the order of the work, and under each the files of this package with the commands,
each with a function of the same name; on the command line ``-`` stands for ``_``."""

for heading, names in COMMANDS.items():
    for name in names:
        app.command(name.replace("_", "-"))(command(getattr(import_module(f"tolstat.cli.{name}"), name)))
    GROUPS[heading] = tuple(name.replace("_", "-") for name in names)
for words, instrument in bench.INSTRUMENTS.items():
    app.command(words, epilog=bench.SEE_ALSO)(command(instrument))
GROUPS["Measure tolstat itself"] = tuple(bench.INSTRUMENTS)
