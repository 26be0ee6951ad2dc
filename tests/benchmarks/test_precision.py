"""Speed against error: jobs of a comparison, faults of its file, files of the command."""

from __future__ import annotations

import re
from typing import get_args

import pandas as pd
import pytest
from typer.testing import CliRunner

from tests.benchmarks.test_points import RUNS
from tests.conftest import REFERENCE
from tests.report.test_report import overlapping, texts
from tolstat import cli
from tolstat.benchmarks import points, runs
from tolstat.benchmarks.integrators import Code
from tolstat.benchmarks.joints import choose
from tolstat.benchmarks.precision import page, setup
from tolstat.benchmarks.precision.jobs import jobs
from tolstat.common.errors import InputError

STUDY = REFERENCE.parents[1] / "studies" / "precision.toml"


@pytest.fixture(autouse=True)
def _setups_may_name_cvode(monkeypatch):
    """Setups can be read and drawn where scikit-sundae is not installed."""
    monkeypatch.setattr(setup, "has_cvode", lambda: True)


@pytest.mark.parametrize("installed", [True, False])
def test_jobs_cover_every_contender_joint_and_setting(installed, monkeypatch):
    monkeypatch.setattr("tolstat.benchmarks.precision.jobs.has_exudyn", lambda: installed)
    said = []
    asked, base = setup.load(STUDY)
    params, count = choose(base, asked.joints, asked.seed, asked.tolstat.block)
    todo = list(jobs(asked, base, said.append))
    assert len(todo) == count * (1 + 8 + 2 * installed + 5) + 1
    by_name = {job.contender: job for job in todo}
    assert ("Exudyn is left out" in "".join(said)) != installed
    for name in {"Exudyn", "Exudyn, our Jacobian"} & set(by_name):
        assert by_name[name].settings == asked.tolstat.steps_per_rev
    assert by_name["CVODE"].settings == asked.others.rtol
    assert list(by_name)[-6:] == [
        *("BDF2", "generalised-α", "TR-BDF2", "quasistatic", "ideal joint", "BDF2, 64 joints at once")
    ]
    assert len(by_name["quasistatic"].options) == len(asked.tolstat.steps_per_rev)
    assert {o.fidelity for o in by_name["quasistatic"].options} == {1}
    assert {o.method for o in by_name["TR-BDF2"].options} == {2}
    assert len(by_name["BDF2, 64 joints at once"].params) == 64
    assert by_name["Radau"].params.tobytes() == params[count - 1 : count].tobytes()


@pytest.mark.slow
def test_every_fault_of_a_setup_is_told(tmp_path):
    text = STUDY.read_text(encoding="utf-8").replace('"rigid_shafts.toml"', f'"{STUDY.parent / "rigid_shafts.toml"}"')
    path = tmp_path / "setup.toml"
    path.write_text(text.replace('"bdf2"', '"bdf3"').replace("limit = 10.0", "limit = -1").replace("seed", "sed"))
    with pytest.raises(InputError) as caught:
        setup.load(path)
    told = str(caught.value)
    for place in ("tolstat.methods[0]", "others.limit", "sed: unknown key", "seed: missing key"):
        assert place in told
    few = STUDY.with_name("rigid_shafts.toml").read_text(encoding="utf-8").replace("n = 1024", "n = 38")
    (tmp_path / "few.toml").write_text(few, encoding="utf-8")
    path.write_text(text.replace("joints = 6 ", "joints = 39").replace(f"{STUDY.parent}/rigid_shafts.toml", "few.toml"))
    with pytest.raises(InputError, match="39 of the 38 joints"):
        setup.load(path)
    path.write_text(text.replace("rigid_shafts.toml", "cirelli2021/cirelli2021.toml"))
    with pytest.raises(InputError, match="lists its joints"):
        setup.load(path)


def test_exudyn_needs_steps(tmp_path):
    text = STUDY.read_text(encoding="utf-8").replace('"rigid_shafts.toml"', f'"{STUDY.parent / "rigid_shafts.toml"}"')
    path = tmp_path / "setup.toml"
    path.write_text(re.sub(r"steps_per_rev = .*(?=# of Exudyn)", "", text), encoding="utf-8")
    with pytest.raises(InputError, match=r"others.steps_per_rev(.|\n)*Exudyn"):
        setup.load(path)
    path.write_text(path.read_text(encoding="utf-8").replace(', "Exudyn"]', "]"), encoding="utf-8")
    assert setup.load(path)[0].others.steps_per_rev == ()


def test_figure_has_a_look_for_every_code():
    assert set(page.OTHERS) == set(get_args(Code))
    assert len(set(page.OTHERS.values())) == len(page.OTHERS)


def test_cvode_that_is_not_installed_is_an_input_fault(monkeypatch):
    monkeypatch.setattr(setup, "has_cvode", lambda: False)
    with pytest.raises(InputError, match=r"scikit-sundae(.|\n)*bench"):
        setup.load(STUDY)


def command(monkeypatch, *arguments):
    monkeypatch.setattr(runs, "run", lambda jobs, say: RUNS)
    return CliRunner().invoke(cli.app, ["bench", "precision", str(STUDY), "--quick", *map(str, arguments)])


@pytest.mark.slow
def test_command_writes_page_table_and_figure(tmp_path, monkeypatch):
    short = tmp_path / "numbers.md"
    short.write_text("before\n<!-- precision -->old<!-- end of precision -->\nafter\n", encoding="utf-8")
    done = command(monkeypatch, "--out", tmp_path / "new", "--into", short)
    assert done.exit_code == 0, done.stderr
    assert done.stdout.splitlines()[1].split() == ["0.01", "A", "2", "Radau,", "our", "Jacobian", "50", "25"]
    names = {path.name for path in (tmp_path / "new").iterdir()}
    assert names == {f"precision.{ending}" for ending in ("md", "csv", "png", "svg")}
    assert len(pd.read_csv(tmp_path / "new" / "precision.csv")) == 4
    text = (tmp_path / "new" / "precision.md").read_text(encoding="utf-8")
    assert "| A | 36 | 0 | 0 | 2 | 2e-03 |" in text
    assert "| 1e-04 | – | – | – | – | – |" in text
    assert "1e-06" not in text.partition("## All points")[0]  # the truth itself is no better than 1e-5
    inserted = short.read_text(encoding="utf-8")
    assert "| 0.01 | A | 2 | Radau, our Jacobian | 50 | 25 | – |" in inserted
    assert "old" not in inserted
    assert inserted.startswith("before\n<!-- precision")
    assert inserted.endswith("-->\nafter\n")


def test_nothing_is_measured_for_a_page_without_a_place(tmp_path, monkeypatch):
    bare = tmp_path / "bare.md"
    bare.write_text("no marks", encoding="utf-8")
    for path in (bare, tmp_path / "none.md"):
        done = command(monkeypatch, "--out", tmp_path / "new", "--into", path)
        assert done.exit_code == 2
        assert "hint" in done.stderr
    assert not (tmp_path / "new").exists()


def test_figure_marks_failures_and_halvings_and_says_units():
    figure = page.figure(*points.build(RUNS), "made up")
    assert len(figure.axes) == 3
    assert {ax.get_xscale() for ax in figure.axes} | {ax.get_yscale() for ax in figure.axes} == {"log"}
    said = texts(figure)
    assert said.count("core time a joint [ms]") == 3
    assert {"tolstat A", "the truth's own error", "36", "180"} <= set(said)
    assert overlapping(figure) == []
    main = figure.axes[0]
    rings = [line for line in main.lines if line.get_marker() == "o" and line.get_markerfacecolor() == "none"]
    assert [list(line.get_xdata()) for line in rings if len(line.get_xdata())] == [[2.0]]
    crosses = [line for line in main.lines if line.get_marker() == "x" and len(line.get_xdata())]
    assert [(list(line.get_xdata()), list(line.get_ydata())) for line in crosses] == [
        ([50.0], [pytest.approx(1e-4)]),
        ([900.0], [2.0]),
    ]
