"""Work and precision: competitors on a system with a closed form, tables counted by hand, files of the command."""

from __future__ import annotations

import time

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from tests.conftest import REFERENCE
from tests.report.test_report import overlapping, texts
from tolstat import cli, joint, study
from tolstat.benchmarks.work_precision import competitors, measure, page, setup, table
from tolstat.benchmarks.work_precision.competitors import Competitor
from tolstat.benchmarks.work_precision.measure import TRUTH, Run
from tolstat.common.errors import InputError
from tolstat.common.tables import RESULT, SPAN, Options, Status
from tolstat.solver.reference import FirstOrder, first_order

STUDY = REFERENCE.parents[1] / "studies" / "work_precision.toml"
EVERY = [Competitor(code, jacobian) for code in ("Radau", "BDF", "LSODA", "CVODE") for jacobian in (False, True)]


@pytest.fixture(autouse=True)
def _setups_may_name_cvode(monkeypatch):
    """Setups can be read and drawn where scikit-sundae is not installed."""
    monkeypatch.setattr(setup, "check_installed", lambda codes: None)


def largest_loads(force, torque, contact, psi):
    """Largest loads with one value for all of each kind; 1 of other kinds."""
    values = {"F": force, "T": torque, "contact": contact, "psi": psi}
    return np.concatenate([np.full(span.stop - span.start, values.get(kind, 1.0)) for kind, span in SPAN.items()])


def circle(rate=None):
    """x'' = -x from x = 1: the largest force is that of cos, and velocity -sin."""
    matrix = np.array([[0.0, 1.0], [-1.0, 0.0]])

    def largest(times, states):
        assert len(times) == len(states)
        return largest_loads(states[:, 0].max(), states[:, 1].max(), 0.0, times[0])

    return FirstOrder(
        rate or (lambda t, y: matrix @ y),
        lambda t, y: matrix,
        0.0,
        np.array([1.0, 0.0]),
        2 * np.pi,
        np.ones(2),
        largest,
        np.zeros(1, RESULT),
    )


@pytest.mark.parametrize("competitor", EVERY, ids=str)
def test_every_competitor_solves_and_is_counted(competitor):
    if competitor.code == "CVODE":
        pytest.importorskip("sksundae")
    loose, tight = (competitors.solve(circle(), competitor, rtol, 2, 60.0) for rtol in (1e-3, 1e-7))
    assert loose.outcome == tight.outcome == "ok"
    assert tight.largest[SPAN["F"]][0] == pytest.approx(1.0, abs=1e-4)
    assert tight.largest[SPAN["T"]][0] == pytest.approx(1.0, abs=1e-4)
    assert tight.largest[SPAN["psi"]][0] > 2 * np.pi  # loads are those of the second revolution
    assert abs(loose.largest[SPAN["F"]][0] - 1) > abs(tight.largest[SPAN["F"]][0] - 1)
    assert tight.rates > loose.rates > 10
    assert (tight.jacobians > 0) == (competitor.jacobian and competitor.code != "LSODA")  # LSODA: not stiff
    assert tight.seconds > 0


@pytest.mark.parametrize("competitor", EVERY, ids=str)
def test_a_run_that_takes_too_long_is_stopped(competitor):
    if competitor.code == "CVODE":
        pytest.importorskip("sksundae")

    def slow(t, y):
        begin = time.process_time()
        while time.process_time() - begin < 2e-4:
            pass
        return np.array([y[1], -y[0]])

    found = competitors.solve(circle(slow), competitor, 1e-9, 200, 0.02)
    assert found.outcome == "over_time"
    assert found.largest is None
    assert 0.02 < found.seconds < 1.0


@pytest.mark.parametrize("code", ["Radau", "CVODE"])
def test_a_run_that_cannot_be_solved_has_failed(code):
    if code == "CVODE":
        pytest.importorskip("sksundae")
    blow_up = circle(lambda t, y: np.array([y[0] ** 2, 0.0]))  # infinite at t = 1
    with np.errstate(all="ignore"):
        assert competitors.solve(blow_up, Competitor(code, False), 1e-6, 1, 20.0).outcome != "ok"


@pytest.mark.slow
def test_joint_begins_where_the_solver_does(params):
    par = params(alpha=0.2)
    system = first_order(par, Options(), from_start=True)
    assert system.t0 == 0.0
    np.testing.assert_array_equal(system.y0[55:], 0.0)
    at_ideal_pose = np.abs(system.rate(0.0, np.zeros(110))).max()
    assert np.abs(system.rate(0.0, system.y0)).max() < 1e-3 * at_ideal_pose


def row(contender, setting, joint, force, ms, ours=True, **kwargs):
    largest = None if force is None else largest_loads(force, 1.0, 1.0, 1e-4)
    outcome = kwargs.pop("outcome", "ok" if largest is not None else "failed")
    return Run(contender, ours, setting, joint, outcome, 1e-3 * ms, largest, **kwargs)


RUNS = [
    *(row(TRUTH, k, joint, 100.0 + k * 1e-3, 1000.0, False) for k in (0, 1) for joint in (0, 1, 2)),
    *(row("A", 36, joint, 100.0 + 0.1 * (joint + 1), 1.0 + joint, halvings=joint) for joint in (0, 1, 2)),
    *(row("A", 180, joint, 100.01, 4.0) for joint in (0, 1, 2)),
    *(row("Radau, our Jacobian", 1e-3, joint, 100.01 if joint else None, 50.0, False, rates=7) for joint in (0, 1, 2)),
    *(row("CVODE", 1e-3, joint, None, 900.0, False, outcome="over_time") for joint in (0, 1, 2)),
]


def test_medians_and_failures_are_counted_by_hand():
    points, truth = table.build(RUNS)
    assert list(points["contender"]) == ["A", "A", "Radau, our Jacobian", "CVODE"]
    coarse = points.iloc[0]
    assert coarse["loads"] == coarse["force"] == pytest.approx(2e-3)
    assert coarse["loads_worst"] == pytest.approx(3e-3)
    assert coarse["torque"] == coarse["contact"] == coarse["psi"] == 0.0
    assert coarse["ms"] == pytest.approx(2.0)
    assert coarse["halvings"] == 1.0
    other = points.iloc[2]
    assert (other["failed"], other["over_time"], other["rates"]) == (1, 0, 7)
    assert other["loads"] == pytest.approx(1e-4)  # the median joint; the worst has no result
    assert np.isinf(other["loads_worst"])
    assert points.iloc[3]["over_time"] == 3
    assert list(truth["loads"]) == pytest.approx([1e-5] * 3)


def test_joints_without_a_truth_do_not_count():
    untrue = [r._replace(largest=None) if r.contender == TRUTH and r.joint == 2 else r for r in RUNS]
    points, truth = table.build(untrue)
    assert set(points["joints"]) == {2}
    assert list(truth["joint"]) == [0, 1]
    with pytest.raises(InputError, match="no joint"):
        table.build([r._replace(largest=None) for r in RUNS])


def test_cost_is_that_of_the_cheapest_setting_and_leaders_are_named_honestly():
    points, _ = table.build(RUNS)
    levels = (1e-2, 1.1e-4, 1e-9)
    costs = table.cost(points, "loads", levels)
    assert list(costs[1e-2]) == pytest.approx([2.0, 50.0, np.nan], nan_ok=True)
    assert list(costs[1.1e-4]) == pytest.approx([4.0, 50.0, np.nan], nan_ok=True)
    ahead = table.leaders(costs)
    assert list(ahead["error"]) == list(levels)
    assert list(ahead["ratio"]) == pytest.approx([25.0, 12.5, np.nan], nan_ok=True)
    assert list(ahead["other"]) == ["Radau, our Jacobian"] * 2 + [""]
    costs["ours"] = ~costs["ours"]
    assert table.leaders(costs)["ratio"][0] == pytest.approx(1 / 25)
    worst = table.leaders(table.cost(points, "loads_worst", levels))
    assert list(worst["other"]) == [""] * 3  # one joint failed: no setting has the worst joint right
    assert worst["tolstat_ms"][0] == pytest.approx(2.0)


def test_jobs_cover_every_contender_joint_and_setting():
    asked, base = setup.load(STUDY)
    params = setup.parameters(asked, base)
    assert len(params) == asked.tolstat.block
    jobs = list(measure.jobs(asked, base, params))
    count = 1 + asked.joints
    assert len(jobs) == count * (1 + 8 + 5) + 1
    by_name = {job.contender: job for job in jobs}
    assert list(by_name)[-6:] == [
        *("BDF2", "generalised-α", "TR-BDF2", "quasistatic", "ideal joint", "BDF2, 64 joints at once")
    ]
    assert len(by_name["quasistatic"].options) == len(asked.tolstat.steps_per_rev)
    assert {o.fidelity for o in by_name["quasistatic"].options} == {1}
    assert {o.method for o in by_name["TR-BDF2"].options} == {2}
    assert len(by_name["BDF2, 64 joints at once"].params) == 64
    assert by_name["Radau"].params.tobytes() == params[count - 1 : count].tobytes()


def test_own_job_times_each_setting_and_keeps_what_is_measured(params):
    rows = np.concatenate([params(alpha=0.2), params(alpha=0.2), params(alpha=0.2)])
    options = (Options(steps_per_rev=36), Options(steps_per_rev=60))
    runs = measure.OwnJob("A", options, rows, 0, 3, 2).runs()
    assert [(r.setting, r.joint, r.outcome) for r in runs] == [(n, i, "ok") for n in (36.0, 60.0) for i in (0, 1)]
    assert all(0 < r.seconds < 1 for r in runs)
    assert runs[0].largest[0] == runs[1].largest[0] > 500


def test_other_job_leaves_out_what_is_tighter_than_what_took_too_long(params):
    job = measure.OtherJob("L", Competitor("LSODA", True), (1e-2, 1e-3, 1e-4), params(alpha=0.2), Options(), 0, 2, 0.02)
    runs = job._replace(rtols=(1e-6, 1e-7)).runs()
    assert [r.outcome for r in runs] == ["over_time"] * 2
    assert runs[1].rates == 0
    assert runs[1].seconds == 0.02
    done = job._replace(rtols=(1e-2,), limit=60.0).runs()[0]
    assert done.outcome == "ok"
    assert done.largest[SPAN["F"]].max() == pytest.approx(620, rel=0.1)


def test_a_job_whose_process_dies_has_failed(params):
    job = measure.OtherJob("CVODE", Competitor("CVODE", False), (1e-2, 1e-3), params(), Options(), 4, 2, 1.0)
    runs = measure.failures(job)
    assert [(r.contender, r.setting, r.joint, r.outcome) for r in runs] == [
        ("CVODE", rtol, 4, "failed") for rtol in (1e-2, 1e-3)
    ]


def test_results_that_are_none_have_no_loads():
    results = np.zeros(1, RESULT)
    results["status"] = Status.NEWTON_FAILED
    assert measure.largest_of(results[0]) is None
    results["status"] = Status.NOT_SETTLED
    assert measure.largest_of(results[0]) is not None


def test_every_fault_of_a_setup_is_told(tmp_path):
    text = STUDY.read_text(encoding="utf-8").replace('"iso2768_f.toml"', f'"{STUDY.parent / "iso2768_f.toml"}"')
    path = tmp_path / "setup.toml"
    path.write_text(text.replace('"bdf2"', '"bdf3"').replace("limit = 10.0", "limit = -1").replace("seed", "sed"))
    with pytest.raises(InputError) as caught:
        setup.load(path)
    told = str(caught.value)
    for place in ("tolstat.methods[0]", "others.limit", "sed: unknown key", "seed: missing key"):
        assert place in told
    path.write_text(text.replace("joints = 6 ", "joints = 39").replace("iso2768_f.toml", "clearance.toml"))
    with pytest.raises(InputError, match="39 of the 38 joints"):
        setup.load(path)
    path.write_text(text.replace("iso2768_f.toml", "cirelli2021/cirelli2021.toml"))
    with pytest.raises(InputError, match="lists its joints"):
        setup.load(path)


def test_cvode_that_is_not_installed_is_an_input_fault(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    competitors.check_installed(("Radau",))
    with pytest.raises(InputError, match="bench"):
        competitors.check_installed(("Radau", "CVODE"))


def command(monkeypatch, *arguments):
    monkeypatch.setattr(measure, "run", lambda asked, base, params, tell: RUNS)
    return CliRunner().invoke(cli.app, ["work-precision", str(STUDY), "--quick", *map(str, arguments)])


def test_command_writes_page_table_and_figure(tmp_path, monkeypatch):
    readme = tmp_path / "README.md"
    readme.write_text(
        "before\n<!-- work and precision -->old<!-- end of work and precision -->\nafter\n", encoding="utf-8"
    )
    done = command(monkeypatch, "--out", tmp_path / "new", "--into", readme)
    assert done.exit_code == 0, done.stderr
    assert done.stdout.splitlines()[1].split() == ["0.01", "A", "2", "Radau,", "our", "Jacobian", "50", "25"]
    names = {path.name for path in (tmp_path / "new").iterdir()}
    assert names == {f"work_precision.{ending}" for ending in ("md", "csv", "png", "svg")}
    assert len(pd.read_csv(tmp_path / "new" / "work_precision.csv")) == 4
    text = (tmp_path / "new" / "work_precision.md").read_text(encoding="utf-8")
    assert "| A | 36 | 0 | 0 | 2 | 2e-03 |" in text
    assert "| 1e-04 | – | – | – | – | – |" in text
    assert "1e-06" not in text.partition("## All points")[0]  # the truth itself is no better than 1e-5
    short = readme.read_text(encoding="utf-8")
    assert "| 0.01 | A | 2 | Radau, our Jacobian | 50 | 25 | – |" in short
    assert "old" not in short
    assert short.startswith("before\n<!-- work")
    assert short.endswith("-->\nafter\n")


def test_nothing_is_measured_for_a_page_without_a_place(tmp_path, monkeypatch):
    bare = tmp_path / "bare.md"
    bare.write_text("no marks", encoding="utf-8")
    for path in (bare, tmp_path / "none.md"):
        done = command(monkeypatch, "--out", tmp_path / "new", "--into", path)
        assert done.exit_code == 2
        assert "hint" in done.stderr
    assert not (tmp_path / "new").exists()


def test_figure_marks_failures_and_halvings_and_says_units():
    points, truth = table.build(RUNS)
    figure = page.figure(points, truth, "made up")
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


def test_joints_are_the_studys_own():
    asked, base = setup.load(STUDY)
    params = setup.parameters(asked, base)
    nominal = joint.perturb(base.joint, joint.nominal_errors(1, base.operation))
    assert params[:1].tobytes() == nominal.tobytes()
    assert len(np.unique(params["pin_axis"], axis=0)) == len(params)
    assert base.samples == study.load(STUDY.parent / "iso2768_f.toml").samples
