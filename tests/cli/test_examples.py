"""The example on each help page runs, and no line of a table is longer than 80 characters."""

from __future__ import annotations

import re
import shlex
import shutil
import webbrowser
from pathlib import Path

import pytest
from typer.testing import Result

import tolstat
from tests.support import synthetic
from tests.support.environment import ROOT
from tests.support.reports import call
from tolstat.cli import LISTED

COMMANDS = list(LISTED)
STUDY = (ROOT / "studies" / "iso2768_f.toml").read_text(encoding="utf-8")
SHORT = {
    "allocate": ("--most", "1024"),
    "rare": ("--n", "20", "--p0", "0.5", "--repeats", "1"),
    "verify": ("--joints", "1"),
}
"""Options with which an example takes seconds."""


def example(command: str) -> list[str]:
    """Words of the example on the help page of a command."""
    (line,) = re.findall(r"^  Example: tolstat (.*)$", call(command, "--help").stdout, flags=re.MULTILINE)
    return shlex.split(line)


@pytest.fixture(scope="module")
def made(example_files: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the files that the examples name."""
    folder = Path(shutil.copytree(example_files, tmp_path_factory.mktemp("made") / "examples"))
    study = folder / "studies" / "iso2768_f.toml"
    for part, rows in (("part1", range(300)), ("part2", range(300, 601))):
        tolstat.run(tolstat.load(study), folder / f"{part}.h5", workers=1, rows=rows)
    return folder


def too_wide(done: Result) -> list[str]:
    """Lines above 80 characters of what a command says; a table of TOML, and a path that is longer, have any width."""
    lines = [*done.stdout.partition("[tolerances]")[0].splitlines(), *done.stderr.splitlines()]
    return [line for line in lines if len(line) > 80 and "/tmp" not in line]


@pytest.mark.parametrize("command", COMMANDS)
def test_help_has_plain_words_for_arguments(command: str) -> None:
    shown = call(command, "--help").stdout
    arguments = shown.partition("\nArguments:\n")[2].partition("\nOptions:\n")[0]
    assert not re.search(r"<\w|\[Path|list\[", arguments)


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_the_example_runs(command: str, made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(made, tmp_path / "work")
    monkeypatch.chdir(tmp_path / "work")
    monkeypatch.setattr(webbrowser, "open", lambda page: True)
    done = call(*example(command), *SHORT.get(command, ()))
    assert done.exit_code == 0, done.stderr
    assert "Traceback" not in done.stderr
    assert too_wide(done) == [] or command == "docs"  # whose pages have lines of any length


TABLES = {
    "status": (),
    "report": (),
    "capability": ("--one-in", 100),
    "worst": (),
    "causes": (),
    "compare": ("other.h5", "--by", "cross1.F"),
}


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with two campaigns whose numbers of joints have four digits."""
    folder = tmp_path_factory.mktemp("large")
    for name, failed in (("small", 12), ("other", 3)):
        synthetic.store(folder, STUDY.replace("n = 1024", "n = 1300"), name, failed=failed, unsettled=9)
    return folder


@pytest.mark.parametrize("command", TABLES)
@pytest.mark.slow
def test_tables_fit_80_columns_and_wide_ones_have_all(
    command: str, large: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(large)
    args = (command, "small.h5", *TABLES[command])
    done, wide = call(*args), call(*args, "--wide")
    assert (done.exit_code, wide.exit_code) == (0, 0), done.stderr + wide.stderr
    lines = done.stdout.partition("[tolerances]")[0].splitlines()
    if command == "status":
        lines = lines[lines.index("") :]
    assert len(lines) > 1
    assert [line for line in lines if len(line) > 80] == []
    named = re.findall(r"^with --wide also: (.*)$", done.stderr.replace("\n    ", " "), flags=re.MULTILINE)
    heads = [head for line in named for head in line.split(", ")]
    assert all(head in wide.stdout for head in heads)
    assert "--wide" not in wide.stderr
    if heads:
        assert max(map(len, wide.stdout.splitlines())) > 80
