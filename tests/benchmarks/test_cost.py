"""Cost of a joint: operations counted by hand, tables with known rates, and the command."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from tests.conftest import REFERENCE
from tolstat import cli, study
from tolstat.benchmarks.cost import flops, iteration, others, rates, run, scaling, split, startup
from tolstat.benchmarks.cost import text as page
from tolstat.benchmarks.cost.flops import Counting
from tolstat.benchmarks.cost.scaling import Stint
from tolstat.benchmarks.cost.split import Once

STUDY = REFERENCE.parents[1] / "studies" / "rigid_shafts.toml"


def counted(function):
    Counting.done = 0
    value = function(Counting(3.0), Counting(2.0))
    return float(value), Counting.done


def test_numbers_count_what_is_done_with_them():
    array = np.array([2.0, 5.0])
    assert counted(lambda a, b: a * b + 1.0 - 2 / a) == pytest.approx((7 - 2 / 3, 4))
    assert counted(lambda a, b: array[1] * a - array[0]) == (13.0, 2)
    assert counted(lambda a, b: (a - b).sqrt()) == (1.0, 2)
    assert counted(lambda a, b: max(-a, abs(b))) == (2.0, 0)
    assert counted(lambda a, b: 1.0 if a > b and a != b else 0.0) == (1.0, 0)


@pytest.fixture(scope="module")
def these():
    return rates.sample(study.load(STUDY), 8)


@pytest.mark.slow
def test_operations_are_those_of_the_structure(these):
    """The elimination does the same for any joint: counted along `linsolve`, block by block."""
    counts = flops.count_apart(list(iteration.snapshots(these, 2)))
    product, dot = 6 * 6 * 2, 11  # of a block with six numbers, of six with six
    inverse = 6 * (1 + 6 + 5 * 6 * 2)
    chain = 2 * inverse + 2 * 6 * product + 2 * 6 * product
    output = 2 * (3 * product + 6 * dot + product + 6 * (dot + 1)) + 4 * (2 * dot + 2)  # psi and s
    last = inverse + 2 * product + 4 * (dot + 1) + 5
    for count in counts:
        assert count["elimination"] == 4 * chain + 2 * output + last
        assert count["contact"] < count["residual"]
    assert counts[0]["substitution"] == counts[1]["substitution"]


@pytest.mark.slow
def test_parts_and_rest_are_the_whole(these):
    found = iteration.measure(these, 1)
    for part in (found.lanes, found.alone):
        total = sum(part.joint_us)
        assert part.iteration_us > 0
        assert 0 < part.share_of_peak < 1
        assert min(part.joint_us[:-1]) > 0
        assert part.joint_us.rest < total
        assert part.joint_us.contact + part.joint_us.bodies > part.joint_us.factor
    assert found.lanes.residuals >= found.alone.residuals  # idle lanes
    assert found.lanes.flops > found.alone.flops  # the start is in lanes too
    assert found.lanes.joint_us.start < found.alone.joint_us.start
    assert 0 < found.lanes_filled <= 1
    assert found.dense.solver_ratio > 1  # LAPACK does not know the structure
    assert found.dense.iteration_ratio > 1


def test_the_split_adds_up_by_hand():
    once = Once(residual=5.0, contact=2.0, assembly=7.0, elimination=11.0, substitution=3.0)
    operations = {"residual": 10.0, "contact": 4.0, "assembly": 20.0, "elimination": 5.0, "substitution": 2.0}
    counts, own = np.array([4.0, 1.0, 3.0]), np.array([2.0, 1.0, 1.5])
    found = split.split(100.0, 6.0, once, counts, own, 10.0, operations, 5.0)
    joint = [1e6 * x for x in (6.0, 8.0, 12.0, 7.0, 4.0, 9.0, 54.0)]
    assert list(found.joint_us) == pytest.approx(joint)
    assert sum(found.joint_us) == pytest.approx(100e6)
    assert found.flops == pytest.approx(2 * 10 + 25 + 1.5 * 2)
    assert found.share_of_peak == pytest.approx(48 / 40 / 5)


def test_efficiency_is_counted_while_all_workers_are_busy():
    alone = [Stint(1, 10, float(k), k + 1.0, 1.0, 100.0 + k) for k in range(4)]
    # the second process begins half a second later and takes twice as long by the clock, not in processor time
    both = [
        *(Stint(1, 10, float(k), k + 1.0, 1.0, 100.0) for k in range(4)),
        *(Stint(2, 10, 0.5 + 2 * k, 2.5 + 2 * k, 1.0, 90.0) for k in range(2)),
    ]
    one, two = scaling.table({1: alone, 2: both})
    assert (one.per_second, one.efficiency, one.cpu_efficiency) == pytest.approx((10.0, 1.0, 1.0))
    assert (one.worker_mb, one.growth_mb) == (103.0, 3.0)
    assert two.per_second == pytest.approx(10 + 5)
    assert (two.efficiency, two.cpu_efficiency) == pytest.approx((0.75, 1.0))
    assert scaling.counts(6) == [1, 2, 4, 6]


POINTS = pd.DataFrame(
    [
        ("BDF2", True, 36.0, 2.0, 5e-3),
        ("BDF2", True, 90.0, 3.0, 5e-4),
        ("BDF2, 64 joints at once", True, 36.0, 1.0, 5e-3),
        ("BDF2, 64 joints at once", True, 90.0, 1.5, 5e-4),
        ("BDF2, 64 joints at once", True, 180.0, 2.0, 1e-4),
        ("Radau", False, 1e-2, 100.0, np.inf),
        ("Radau", False, 1e-3, 600.0, 9e-4),
        ("CVODE", False, 1e-2, 100.0, 0.1),
        ("CVODE", False, 1e-3, 900.0, np.inf),
    ],
    columns=["contender", "ours", "setting", "ms", "loads_worst"],
)


def test_contenders_are_compared_at_the_cheapest_setting_that_meets_the_error():
    found = {one.name: one for one in others.contenders(POINTS, 180)}
    assert (found["BDF2"].setting, found["BDF2"].ratio) == (90.0, 2.0)
    radau = found["Radau"]
    assert (radau.ms, radau.error, radau.ratio, radau.ratio_default) == (600.0, 9e-4, 400.0, 300.0)
    assert (found["CVODE"].setting, found["CVODE"].error, found["CVODE"].ms) == (None, None, 900.0)
    text = page.align(page._others(others.Comparison(3, 1e-3, list(found.values()))))
    assert "> 900" in text
    assert "none met" in text


@pytest.mark.parametrize(("installed", "others_named"), [(True, ["Radau", "CVODE"]), (False, ["Radau"])])
def test_other_integrators_are_those_that_are_installed(installed, others_named, monkeypatch):
    asked, said = [], []

    def run(jobs, say):
        asked.extend(jobs)
        raise InterruptedError

    monkeypatch.setattr(others, "has_cvode", lambda: installed)
    monkeypatch.setattr(others, "run", run)
    with pytest.raises(InterruptedError):
        others.compare(study.load(STUDY), 2, 5.0, said.append)
    names = list(dict.fromkeys(job.contender for job in asked))
    given = [name for code in others_named for name in (code, f"{code}, our Jacobian")]
    at_rest = ["Radau, from rest", "Radau, our Jacobian, from rest"]
    assert names == ["truth", *given, *at_rest, "BDF2", "quasistatic", "BDF2, 64 joints at once"]
    assert len(asked) == 3 * (len(names) - 1) + 1
    assert ("scikit-sundae" in "".join(said)) != installed


@pytest.fixture
def light(monkeypatch):
    """No worker processes and no other Pythons."""
    stints = {1: [Stint(1, 10, 0.0, 1.0, 1.0, 100.0)]}
    monkeypatch.setattr(scaling, "measure", lambda these, quick: scaling.table(stints))
    starts = startup.Startup(0.2, 1.5, 1.0, 90.0, 80.0, None, None)
    monkeypatch.setattr(startup, "measure", lambda *args: starts)


@pytest.mark.slow
def test_the_command_prints_tables_or_json(light, these, monkeypatch):
    found = iteration.measure(these, 1)
    monkeypatch.setattr(iteration, "measure", lambda these, rounds: found)
    done = CliRunner().invoke(cli.app, ["bench", str(STUDY), "--quick", "--joints", "4", "--json"])
    assert done.exit_code == 0, done.output
    facts = json.loads(done.stdout)
    assert set(facts) == {"study", "machine", "rates", "iteration", "scaling", "startup", "others"}
    assert facts["rates"]["joints"] == facts["rates"]["settled"] == 4
    assert facts["rates"]["lanes_ratio"] > 0
    assert set(facts["iteration"]["lanes"]["joint_us"]) == set(split.Parts._fields)
    assert facts["others"] is None
    against = others.Comparison(3, 1e-3, others.contenders(POINTS, 180))
    speeds = rates.Rates(**facts["rates"])
    scales, starts = scaling.measure(None, True), startup.measure()
    whole = run.Cost("iso2768_f", {"processor": "some"}, speeds, found, scales, starts, against)
    text = page.text(whole)
    for word in ("one at a time", "assembly", "LAPACK", "workers", "--help", "compilation for dynamic joints", "Radau"):
        assert word in text
    assert "quasi-static joints" not in text
    assert json.dumps(whole.plain(), allow_nan=False)


def test_a_study_that_cannot_be_read_is_exit_code_2(tmp_path):
    done = CliRunner().invoke(cli.app, ["bench", str(tmp_path / "none.toml")])
    assert done.exit_code == 2
    assert done.stdout == ""
