"""Speed against error: points counted by hand, jobs of a comparison, page and figure."""

from __future__ import annotations

import sys

import numpy as np
import pandas as pd
import pytest

from studies.precision import points as table
from studies.precision import run, runs, setup
from studies.precision.measuring import choose
from studies.precision.runs import TRUTH, Run
from tests.support.environment import ROOT
from tests.support.loads import largest_loads
from tolstat.common.errors import InputError

STUDY = ROOT / "studies" / "precision" / "precision.toml"


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
    assert coarse["loads"] == coarse["F"] == pytest.approx(2e-3)
    assert coarse["loads_worst"] == pytest.approx(3e-3)
    assert coarse["T"] == coarse["contact"] == coarse["psi"] == 0.0
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


@pytest.mark.parametrize("there", [True, False])
def test_jobs_cover_every_contender_joint_and_setting(there, monkeypatch):
    monkeypatch.setattr(setup, "installed", lambda code: there or code not in ("CVODE", "Exudyn"))
    said = []
    asked, base = setup.load(STUDY)
    params, count = choose(base, asked.joints, asked.seed, asked.tolstat.block)
    todo = list(setup.jobs(asked, base, said.append))
    assert len(todo) == count * (1 + 6 + 4 * there + 4) + 2
    by_name = {job.contender: job for job in todo}
    assert ("CVODE" in "".join(said)) == ("Exudyn" in "".join(said)) != there
    for name in {"Exudyn", "Exudyn, our Jacobian"} & set(by_name):
        assert by_name[name].settings == asked.tolstat.steps_per_rev
    assert by_name["LSODA"].settings == asked.others.rtol
    together = ["BDF2, 64 joints at once", "BDF2 uniform, 64 joints at once"]
    assert list(by_name)[-6:] == ["BDF2", "TR-BDF2", "quasistatic", "ideal joint", *together]
    assert len(by_name["quasistatic"].options) == len(asked.tolstat.steps_per_rev)
    assert {o.fidelity for o in by_name["quasistatic"].options} == {1}
    assert {o.method for o in by_name["TR-BDF2"].options} == {1}
    assert [len(by_name[name].params) for name in together] == [64, 64]
    assert {o.peak_substeps for o in by_name[together[1]].options} == {1}
    assert by_name["Radau"].params.tobytes() == params[count - 1 : count].tobytes()


def test_every_fault_of_a_comparison_is_told(tmp_path):
    text = STUDY.read_text(encoding="utf-8")
    path = tmp_path / "setup.toml"
    path.write_text(text.replace('"bdf2"', '"bdf3"').replace("limit = 10.0", "limit = -1").replace("seed", "sed"))
    with pytest.raises(InputError) as caught:
        setup.load(path)
    assert len(caught.value.faults) >= 3


@pytest.mark.slow
def test_the_program_writes_page_table_and_figure(tmp_path, monkeypatch, capsys):
    short = tmp_path / "numbers.md"
    short.write_text("before\n<!-- precision -->old<!-- end of precision -->\nafter\n", encoding="utf-8")
    monkeypatch.setattr(runs, "run", lambda jobs, say: RUNS)
    monkeypatch.setattr(sys, "argv", ["run.py", "--quick", "--out", str(tmp_path / "new"), "--into", str(short)])
    run.main()
    first = capsys.readouterr().out.splitlines()[1]
    assert first.split() == [
        "0.01",
        "A",
        "2",
        "Radau,",
        "our",
        "Jacobian",
        "50",
        "25",
    ]
    names = {path.name for path in (tmp_path / "new").iterdir()}
    assert names == {f"precision.{ending}" for ending in ("md", "csv", "png", "svg")}
    points = pd.read_csv(tmp_path / "new" / "precision.csv")
    assert len(points) == 4
    columns = ["contender", "setting", "ms", "loads"]
    assert ("A", 36, 2.0, 0.002) in set(points[columns].itertuples(index=False, name=None))
    text = (tmp_path / "new" / "precision.md").read_text(encoding="utf-8")
    assert "| 1e-04 | – | – | – | – | – |" in text
    assert "1e-06" not in text  # the truth itself is no better than 1e-5
    inserted = short.read_text(encoding="utf-8")
    assert "| 0.01 | A | 2 | Radau, our Jacobian | 50 | 25 | – |" in inserted
    assert "old" not in inserted
    assert inserted.startswith("before\n<!-- precision")
    assert inserted.endswith("-->\nafter\n")
