"""``python -m tests.measure.start OLDER``: what commands take before and around their joints, beside an older checkout.

Runs the commands of both checkouts in turn, each in processes of its own: the first run with an empty cache of kernels,
then warm ones, the page, and two commands that simulate nothing. Prints the processor time of all processes as medians,
and the ratio to the older checkout. Takes a quarter of an hour; use a machine without other load.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.measure import usage
from tolstat.display import text

HERE = Path(__file__).parents[2]
STUDY = "studies/iso2768_f.toml"
COMPILING = "first run, 2 joints"
COMMANDS = {
    COMPILING: ("run", "{study}", "--n", "2", "--no-verify", "--no-report", "--out", "first.h5"),
    "run, 1024 joints": ("run", "{study}", "--out", "whole.h5"),
    "page": ("report", "whole.h5", "--out", "whole.html"),
    "status": ("status", "whole.h5"),
    "--help": ("--help",),
}
"""Arguments of each command that is timed, in this order."""


def seconds(checkout: Path, folder: Path, name: str) -> float:
    """Processor time of a command of a checkout and of all its processes, s; `folder` holds its files and kernels."""
    for made in ("first.h5", "whole.h5") if COMMANDS[name][0] == "run" else ():
        (folder / made).unlink(missing_ok=True)
    if name == COMPILING:
        shutil.rmtree(folder / "cache", ignore_errors=True)
    arguments = [word.format(study=checkout / STUDY) for word in COMMANDS[name]]
    script = [sys.executable, "-I", "-S", usage.__file__, sys.executable, "-m", "tolstat", *arguments]
    settings = os.environ | {"PYTHONPATH": str(checkout), "XDG_CACHE_HOME": str(folder / "cache")}
    done = subprocess.run(script, cwd=folder, env=settings, capture_output=True, text=True, check=True)
    used = json.loads(done.stdout)
    if used["code"]:
        raise subprocess.CalledProcessError(used["code"], ["tolstat", *arguments], stderr=done.stderr)
    return float(used["cpu"])


def measured(checkouts: list[Path], rounds: int, compilations: int) -> dict[str, list[float]]:
    """Median processor time of each command in each checkout, s."""
    with tempfile.TemporaryDirectory() as made:
        folders = [Path(made) / str(k) for k in range(len(checkouts))]
        for folder in folders:
            folder.mkdir()
        found: dict[str, list[float]] = {}
        for name in COMMANDS:
            times: list[list[float]] = [[] for _ in checkouts]
            for _ in range(compilations if name == COMPILING else rounds):
                for own, checkout, folder in zip(times, checkouts, folders, strict=True):
                    own.append(seconds(checkout, folder, name))
            found[name] = [statistics.median(own) for own in times]
        return found


def main(words: list[str] | None = None) -> None:
    """Measure, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("older", type=Path, help="older checkout")
    parser.add_argument("--rounds", type=int, default=5, help="runs of each command")
    parser.add_argument("--compilations", type=int, default=5, help="runs with an empty cache of kernels")
    given = parser.parse_args(words)
    rows = [("processor time, s", "older", "here", "ratio")]
    for name, (older, here) in measured([given.older.resolve(), HERE], given.rounds, given.compilations).items():
        rows.append((name, f"{older:.3g}", f"{here:.3g}", f"{here / older:.2f}"))
    print(text.align(rows))


if __name__ == "__main__":
    main()
