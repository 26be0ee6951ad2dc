"""What files hold does nothing on a terminal or in a spreadsheet, and damaged files end in data or one message."""

from __future__ import annotations

import csv
import os
import subprocess
import sys
from io import StringIO
from pathlib import Path

import h5py
import pytest

from tests.support import corruption, synthetic
from tests.support.environment import environment
from tests.support.systems import needs_linux
from tolstat.cli import _shared
from tolstat.display import text
from tolstat.store import metadata

FORMULAS = ('=HYPERLINK("http://x")', "+1", "-1+1", "@SUM(1)", "\t=1", "\r=1")

CASES = (
    synthetic.HEAD
    + """[sampling]
method = "cases"
[[case]]
name = '=HYPERLINK("http://x")'
errors.hole4.offset_t = "0.1 mm"
"""
)


def test_cells_of_text_are_no_formulas() -> None:
    assert [text.cell(word) for word in (*FORMULAS, "a=1")] == [*("'" + word for word in FORMULAS), "a=1"]
    assert [text.cell(x) for x in (-1.0, -1)] == [-1.0, -1]


@needs_linux
def test_exports_hold_no_formulas(tmp_path: Path) -> None:
    path = synthetic.store(tmp_path, CASES)
    ended = corruption.call(["export", path, "--csv", "-"], tmp_path)
    assert ended.code == 0, ended.err
    rows = list(csv.reader(StringIO(ended.out)))
    cases = [row[rows[0].index("case")] for row in rows[2:]]
    assert cases[1:] == ["'" + FORMULAS[0]]


def test_standard_error_moves_no_cursor(capsys: pytest.CaptureFixture[str]) -> None:
    with _shared.session(quiet=False, verbose=False, log=None):
        _shared.say("a\x1b[2J\x9b1m\u202eb\rc\nd")
    assert capsys.readouterr().err == "a[U+001B][2J[U+009B]1m[U+202E]b[U+000D]c\nd\n"


@needs_linux
def test_a_terminal_gets_no_control_characters_and_a_pipe_what_is_there(tmp_path: Path) -> None:
    path = synthetic.store(tmp_path, simulated=0)
    with h5py.File(path, "r+") as file:
        metadata.write(file, metadata.read(file).model_copy(update={"study_name": "a\x1b]0;title\x07b"}))
    command = [sys.executable, "-m", "tolstat", "status", str(path)]
    own, terminal = os.openpty()
    subprocess.run(command, stdout=terminal, stderr=subprocess.DEVNULL, env=environment(), check=True)
    os.close(terminal)
    shown = os.read(own, 10_000).decode()
    os.close(own)
    assert shown.startswith("study: a[U+001B]]0;title[U+0007]b")
    assert corruption.call(["status", path], tmp_path).out.startswith("study: a\x1b]0;title\x07b")


@needs_linux
@pytest.mark.slow
def test_a_changed_bit_changes_nothing_without_a_word(tmp_path: Path) -> None:
    """A share of ``python -m tests.measure.corruption``."""
    path = synthetic.store(tmp_path)
    corruption.warm(path, tmp_path / "warm")
    found, kinds = corruption.search(path, tmp_path / "x", range(14))
    assert not found
    assert min(kinds[kind] for kind in ("same", "refused", "told")) > 2


@needs_linux
@pytest.mark.slow
def test_a_changed_bit_of_an_unfinished_file_ends_in_data_or_one_message(tmp_path: Path) -> None:
    path = synthetic.store(tmp_path, simulated=30)
    with h5py.File(path, "r+") as file:
        file["session/number"][()] = 3  # as a run leaves it that is killed
    corruption.warm(path, tmp_path / "warm")
    found, kinds = corruption.search(path, tmp_path / "x", range(4))
    assert {one.fault for one in found} <= {corruption.SILENT}
    assert kinds["same"] > 2


def test_a_search_for_faults_finds_them() -> None:
    usual = corruption.Ended(0, "joints: 60", "")
    assert not corruption.fault(usual, usual)
    for wrong, said in (
        (usual._replace(out="joints: 59"), corruption.SILENT),
        (usual._replace(code=-11), "signal 11"),
        (usual._replace(code=1, err="Traceback (most recent call last)"), "exit code 1"),
        (usual._replace(code=2, err="oh"), "no message"),
    ):
        assert corruption.fault(wrong, usual) == said
    assert not corruption.fault(usual._replace(out="", err="the results of rows 0:61 are damaged"), usual)
    assert not corruption.fault(usual._replace(code=2, err="error: a.h5: is damaged\n  hint: run it again"), usual)
