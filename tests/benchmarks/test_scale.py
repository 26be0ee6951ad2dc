"""Commands over the number of joints: what a process used, growth, commands that fail, faults of the options."""

from __future__ import annotations

import json
import math
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from tests.conftest import CHEAP
from tests.report.test_report import overlapping, texts
from tests.support import synthetic
from tests.support.environment import ROOT, environment
from tolstat import cli
from tolstat.benchmarks.scale import page, run, usage
from tolstat.benchmarks.scale.run import Row
from tolstat.common.errors import InputError

WORDS = ("run", "report", "causes", "export")


def used(*arguments):
    """What another Python used, measured as the bench does."""
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


def call(*arguments):
    return CliRunner().invoke(cli.app, ["bench", "scale", *map(str, arguments)])


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
    found = run.growth(rows(exponents))
    assert all(map(math.isnan, found[:4]))
    assert found[4:8] == pytest.approx(exponents)
    assert found[8:] == pytest.approx(exponents)


def test_growth_past_a_command_that_failed_is_not_known():
    made = rows((1.0, 1.0, 1.0, 1.0), (20, 40, 80, 160))
    made[5] = Row(40, "report", failed="exit code 2")
    found = run.growth(made)
    assert [k for k in range(4, 16) if math.isnan(found[k])] == [5, 9]
    assert found[13] == pytest.approx(1.0)


def test_a_command_that_fails_becomes_a_row(study, monkeypatch):
    own = run.commands

    def wrong(setup, n, folder):
        file = folder / "there.txt"
        file.write_text("abc")
        good = (["docs", "study"], file)
        return own(setup, n, folder) | {
            "run": good if n == 20 else (["run", str(study), "--n", "0"], file),
            "report": (["report", str(study)], None),
            "causes": (["docs", "study"], None),
            "export": good,
        }

    monkeypatch.setattr(run, "commands", wrong)
    done = call(study, "--joints", "20,40", "--json")
    assert done.exit_code == 1
    found = json.loads(done.stdout)["rows"]
    assert [(row["joints"], row["command"]) for row in found] == [(n, word) for n in (20, 40) for word in WORDS]
    assert [row["failed"] for row in found] == [None, "exit code 2", None, None, "exit code 2", *3 * ["not run"]]
    assert [row["wall"] is None for row in found] == [row["failed"] is not None for row in found]
    assert [row["size"] for row in found[:4]] == [3, None, None, 3]
    assert "20 joints, report: exit code 2" in done.stderr
    text = page.terminal([Row(20, "run", 1.0, 1.0, 1e6, 1e6), Row(20, "report", failed="exit code 2")])
    assert text.splitlines()[2].split() == ["20", "report", *5 * ["-"], "exit", "code", "2"]


@pytest.mark.parametrize("joints", ["0,10", "10,10", "20,10", "10,,20", "ten", "", "-5", "1.5"])
def test_numbers_of_joints_that_do_not_ascend_are_refused(study, joints):
    with pytest.raises(InputError, match="--joints"):
        run.load(study, joints, 1)


def test_the_first_load_with_a_limit_is_asked_for_its_causes(study):
    setup = run.load(study, "20, 40", 3)
    assert (setup.joints, setup.load, setup.point) == ([20, 40], "cross1.F", [])
    words = run.commands(setup, 20, study.parent)
    assert words["run"][0][2:6] == ["--n", "20", "--workers", "3"]
    setup = run.load(ROOT / "studies" / "duty_cycle.toml", "20", 1)
    assert run.commands(setup, 20, study.parent)["export"][0][-2] == "--point"


def test_studies_that_draw_no_joints_are_refused(study):
    study.write_text(synthetic.SWEEP, encoding="utf-8")
    with pytest.raises(InputError, match="'sweep' the number of joints cannot be chosen"):
        run.load(study, "20,40", 1)
    study.write_text(synthetic.STUDY.replace("seed", 'method = "pick_freeze"\nseed'), encoding="utf-8")
    with pytest.raises(InputError, match="'pick_freeze' the number"):
        run.load(study, "20,40", 1)
    study.write_text(synthetic.STUDY.replace("n = 60\n", ""), encoding="utf-8")
    with pytest.raises(InputError, match="missing key n") as caught:
        run.load(study, "40,20", 1)
    assert len(caught.value.faults) == 2
    study.write_text(synthetic.STUDY.replace("seed", 'method = "sobol"\nreplicates = 4\nseed'), encoding="utf-8")
    with pytest.raises(InputError, match="n = 18 is no multiple"):
        run.load(study, "16,18,20", 1)


def test_all_faults_are_told_at_once_and_nothing_is_run(study, tmp_path, monkeypatch):
    monkeypatch.setattr(run, "measure", lambda *_: pytest.fail("measured"))
    study.write_text(synthetic.SWEEP, encoding="utf-8")
    (tmp_path / "file").write_text("no folder")
    (tmp_path / "bare.md").write_text("no marks")
    before = sorted(tmp_path.iterdir())
    options = ("--joints", "40,20", "--plot", tmp_path / "a.txt", "--into", tmp_path / "bare.md")
    done = call(study, *options, "--folder", tmp_path / "file" / "in")
    assert done.exit_code == 2
    for fault in ("'40,20' are not ascending", "sampling.method", "a.txt", "bare.md: has no place", "is no folder"):
        assert done.stderr.count(fault) == 1, fault
    assert done.stderr.count("hint:") == 5
    assert done.stdout == ""
    assert sorted(tmp_path.iterdir()) == before


def test_the_command_writes_table_and_figure(study, tmp_path, monkeypatch):
    monkeypatch.setattr(run, "measure", lambda *_: rows((1.0, 0.5, 1.0, 1.0)))
    target = tmp_path / "page.md"
    target.write_text("before\n<!-- scale -->old<!-- end of scale -->\nafter\n", encoding="utf-8")
    done = call(study, "--workers", "3", "--into", target, "--plot", tmp_path / "new" / "a.b.svg")
    assert done.exit_code == 0, done.stderr
    assert done.stdout.splitlines()[-1].split() == ["100", "export", "30", "50", "200", "0.1", "1.00"]
    text = target.read_text(encoding="utf-8")
    assert "| 100 | report | 3 | 5 | 200 | 0.1 | 0.50 |\n" in text
    assert "3 workers" in text
    assert "old" not in text
    assert (text[:7], text[-7:]) == ("before\n", "\nafter\n")
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["a.b.svg"]


def test_the_figure_has_units_a_line_for_each_command_and_one_in_proportion():
    made = rows((1.0, 0.5, 1.1, 1.0), (1000, 10_000, 1_000_000), 1e-3)
    made[-3] = Row(1_000_000, "report", failed="exit code 2")
    figure = page.figure(made, "made up\ntwice")
    time, memory = figure.axes
    assert {ax.get_xscale() for ax in figure.axes} | {ax.get_yscale() for ax in figure.axes} == {"log"}
    assert overlapping(figure) == []
    said = texts(figure)
    assert {"time on the clock [s]", "resident memory [MB]", *WORDS, "1\xa0000\xa0000"} <= set(said)
    assert said.count("number of joints") == 2
    assert len({(line.get_color(), line.get_marker()) for line in memory.lines}) == 4
    assert math.isnan(list(time.lines[1].get_ydata())[-1])
    x, y = (list(map(math.log, data)) for data in (time.lines[4].get_xdata(), time.lines[4].get_ydata()))
    assert (y[1] - y[0]) / (x[1] - x[0]) == pytest.approx(1.0)
    assert overlapping(page.figure([Row(20, word, failed="signal 9") for word in WORDS], "made up")) == []


@pytest.mark.slow
def test_commands_run_one_after_the_other_and_leave_no_file(study, tmp_path):
    study.write_text(synthetic.STUDY.replace("[sampling]", f"[output]\n{CHEAP}"), encoding="utf-8")
    script = [sys.executable, "-m", "tolstat", "bench", "scale", str(study), "--joints", "200,400", "--json"]
    folder = ["--workers", "1", "--folder", str(tmp_path / "made")]
    done = subprocess.run([*script, *folder], capture_output=True, text=True, env=environment(), check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)["rows"]
    assert [(row["joints"], row["command"]) for row in found] == [(n, word) for n in (200, 400) for word in WORDS]
    assert all(row["cpu"] > 0 and row["memory"] > 30e6 for row in found)
    assert [row["size"] is None for row in found] == 2 * [False, False, True, False]
    assert found[7]["size"] > 1.5 * found[3]["size"]  # the CSV has twice the lines
    assert [row["growth"] is None for row in found] == [*4 * [True], *4 * [False]]
    assert list((tmp_path / "made").iterdir()) == []
