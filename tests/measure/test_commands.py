"""Commands over the number of joints: what a process used, growth, table and figure."""

from __future__ import annotations

import json
import math
import subprocess
import sys

import pytest

from tests.measure import commands, usage
from tests.measure.commands import Row
from tests.report.test_report import overlapping, texts
from tests.support import synthetic
from tests.support.environment import ROOT, environment

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


def test_memory_is_that_of_the_largest_process_and_not_of_the_one_that_measures():
    ballast = b"x" * 150_000_000
    small = used("-c", "pass")
    assert small["memory"] < 60e6 < len(ballast)
    assert 200e6 < used("-c", "b'x' * 200_000_000")["memory"] < 200e6 + 60e6
    inside = "import subprocess, sys; subprocess.run([sys.executable, '-c', sys.argv[1]])"
    assert 200e6 < used("-c", inside, "b'x' * 200_000_000")["memory"] < 200e6 + 60e6


def test_processor_time_has_that_of_processes_inside_and_clock_that_of_waiting():
    busy = "import time\nwhile time.process_time() < 0.4: pass"
    inside = "import subprocess, sys; subprocess.run([sys.executable, '-c', sys.argv[1]])"
    found = used("-c", inside, busy)
    assert found["cpu"] >= 0.4
    found = used("-c", "import time; time.sleep(0.4)")
    assert found["cpu"] < 0.4 <= found["wall"]


def test_the_exit_code_is_told_and_standard_output_is_none_of_ours():
    found = used("-c", "import sys; print('data'); sys.exit(3)")
    assert found["code"] == 3
    assert used("-c", "import os, signal; os.kill(os.getpid(), signal.SIGKILL)")["code"] == -9


def test_growth_is_the_exponent_of_the_time():
    exponents = (1.0, 0.2, 1.7, 0.0)
    found = commands.growth(rows(exponents))
    assert all(map(math.isnan, found[:4]))
    assert found[4:8] == pytest.approx(exponents)
    assert found[8:] == pytest.approx(exponents)


@pytest.mark.parametrize("joints", ["0,10", "10,10", "20,10", "10,,20", "ten", "", "-5", "1.5"])
def test_numbers_of_joints_that_do_not_ascend_are_refused(study, joints):
    with pytest.raises(SystemExit):
        commands.main([str(study), f"--joints={joints}"])


def test_the_first_load_with_a_limit_is_asked_for_its_causes(study):
    words = commands.commands(study, 20, 3, study.parent)
    assert words["run"][0][2:6] == ["--n", "20", "--workers", "3"]
    assert words["causes"][0][-1] == "cross1.F"
    words = commands.commands(ROOT / "studies" / "duty_cycle.toml", 20, 1, study.parent)
    assert words["export"][0][-2] == "--point"


def test_the_program_writes_table_and_figure(study, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(commands, "measure", lambda *_: rows((1.0, 0.5, 1.0, 1.0)))
    target = tmp_path / "page.md"
    target.write_text("before\n<!-- scale -->old<!-- end of scale -->\nafter\n", encoding="utf-8")
    commands.main([str(study), "--workers", "3", "--into", str(target), "--plot", str(tmp_path / "a.b.svg")])
    assert capsys.readouterr().out.splitlines()[-1].split() == ["100", "export", "30", "50", "200", "0.1", "1.00"]
    text = target.read_text(encoding="utf-8")
    assert "| 100 | report | 3 | 5 | 200 | 0.1 | 0.50 |\n" in text
    assert "3 workers" in text
    assert "old" not in text
    assert (text[:7], text[-7:]) == ("before\n", "\nafter\n")
    assert (tmp_path / "a.b.svg").stat().st_size > 1000


def test_the_figure_has_units_a_line_for_each_command_and_one_in_proportion():
    made = rows((1.0, 0.5, 1.1, 1.0), (1000, 10_000, 1_000_000), 1e-3)
    figure = commands.figure(made, "made up\ntwice")
    time, memory = figure.axes
    assert {ax.get_xscale() for ax in figure.axes} | {ax.get_yscale() for ax in figure.axes} == {"log"}
    assert overlapping(figure) == []
    said = texts(figure)
    assert {"time on the clock [s]", "resident memory [MB]", *WORDS, "1\xa0000\xa0000"} <= set(said)
    assert said.count("number of joints") == 2
    assert len({(line.get_color(), line.get_marker()) for line in memory.lines}) == 4
    x, y = (list(map(math.log, data)) for data in (time.lines[4].get_xdata(), time.lines[4].get_ydata()))
    assert (y[1] - y[0]) / (x[1] - x[0]) == pytest.approx(1.0)


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


def test_a_command_that_fails_ends_the_measurement(study, capfd):
    with pytest.raises(subprocess.CalledProcessError):
        commands.measure(study, [10**12], 1, None)
    assert "error:" in capfd.readouterr().err
