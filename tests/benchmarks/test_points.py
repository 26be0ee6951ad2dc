"""Points of a work-precision diagram, counted by hand."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.loads import largest_loads
from tolstat.benchmarks import points as table
from tolstat.benchmarks.runs import TRUTH, Run
from tolstat.common.errors import InputError


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
