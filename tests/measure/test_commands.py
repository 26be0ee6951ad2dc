"""Commands over the number of joints: what a process used, growth, table and figure."""

from __future__ import annotations

import json
import math
import subprocess
import sys

import pytest

from tests.measure import commands, usage
from tests.measure.commands import Row
from tests.support import synthetic
from tests.support.environment import environment
from tests.support.systems import needs_posix

WORDS = ("run", "report", "causes", "export")


def used(*arguments):
    """What another Python used, measured as the program does."""
    script = [sys.executable, "-I", "-S", usage.__file__, sys.executable, *arguments]
    done = subprocess.run(script, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def rows(exponents, joints=(20, 40, 100), c=0.3):
    """Rows whose times are t = c n^p, with an exponent p for each command."""
    return [
        Row(n, word, c * n**p, 0.5 * n**p, 2e8 + n, math.nan if word == "causes" else 1e3 * n)
        for n in joints
        for word, p in zip(WORDS, exponents, strict=True)
    ]


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(synthetic.STUDY, encoding="utf-8")
    return path


@needs_posix
def test_memory_is_that_of_the_largest_process_and_not_of_the_one_that_measures():
    ballast = b"x" * 150_000_000
    small = used("-c", "pass")
    assert small["memory"] < 60e6 < len(ballast)
    assert 200e6 < used("-c", "b'x' * 200_000_000")["memory"] < 200e6 + 60e6
    inside = "import subprocess, sys; subprocess.run([sys.executable, '-c', sys.argv[1]])"
    assert 200e6 < used("-c", inside, "b'x' * 200_000_000")["memory"] < 200e6 + 60e6


def test_growth_is_the_exponent_of_the_time():
    exponents = (1.0, 0.2, 1.7, 0.0)
    found = commands.growth(rows(exponents))
    assert all(map(math.isnan, found[:4]))
    assert found[4:8] == pytest.approx(exponents)
    assert found[8:] == pytest.approx(exponents)


@needs_posix
@pytest.mark.slow
def test_commands_run_one_after_the_other_and_leave_no_file(study, tmp_path):
    study.write_text(f'{synthetic.REAL.partition("[limits]")[0]}[limits]\n"cross1.F" = "700 N"\n', encoding="utf-8")
    script = [sys.executable, "-m", "tests.measure.commands", str(study), "--joints", "200,400", "--workers", "1"]
    (tmp_path / "made").mkdir()
    run = [*script, "--folder", str(tmp_path / "made")]
    done = subprocess.run(run, capture_output=True, text=True, env=environment(), check=False)
    assert done.returncode == 0, done.stderr
    found = [line.split() for line in done.stdout.splitlines()[1:]]
    assert [(row[0], row[1]) for row in found] == [(n, word) for n in ("200", "400") for word in WORDS]
    assert all(float(row[3]) > 0 and float(row[4]) > 30 for row in found)
    assert [row[5] == "-" for row in found] == 2 * [False, False, True, False]
    assert float(found[7][5]) > 1.5 * float(found[3][5])  # the CSV has twice the lines
    assert [row[6] == "-" for row in found] == [*4 * [True], *4 * [False]]
    assert list((tmp_path / "made").iterdir()) == []
