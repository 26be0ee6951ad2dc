"""Commands run in this process; what ``tolstat report`` says and writes."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from typer.testing import CliRunner, Result

from tolstat.cli import app


def call(*words: object) -> Result:
    """Run a command in this process."""
    return CliRunner().invoke(app, [str(word) for word in words])


class Report(NamedTuple):
    """Standard output, messages without line breaks in sentences, and the files written."""

    table: str
    notes: str
    files: list[Path]


def build(path: Path, *options: object) -> Report:
    """Run the command on a result file, all columns printed."""
    done = call("report", path, "--wide", *options)
    assert done.exit_code == 0, done.output
    lines = done.stderr.replace("\n    ", " ").splitlines()
    files = [Path(line.removeprefix("wrote ")) for line in lines if line.startswith("wrote ")]
    return Report(done.stdout, "\n".join(lines), files)
