"""Joints that are measured are those of the study; timing with a clock that is set."""

from __future__ import annotations

import numpy as np
import pytest

from studies.precision.measuring import Times, choose, in_turn, parameters
from tests.support.environment import ROOT
from tolstat import joint, sampling, study
from tolstat.common.cardan import CARDAN

STUDIES = ROOT / "studies"


def test_any_rows_are_those_of_the_campaign():
    base = study.load(STUDIES / "rigid_shafts.toml")
    rows = np.array([7, 0, 3])
    expected = joint.perturb(base.joint, base.operation, sampling.draw(base)[rows])
    assert parameters(base, rows).tobytes() == expected.tobytes()


@pytest.mark.slow
def test_each_joint_of_a_family_has_its_own_variant():
    base = study.load(STUDIES / "cirelli2021" / "cirelli2021.toml")
    rows = np.arange(0, base.rows, base.rows // 50)
    assert len(base.joints) > 1
    assert len(np.unique(parameters(base, rows)["alpha"])) > 1


def test_chosen_joints_are_nominal_and_random_ones_then_a_block():
    base = study.load(STUDIES / "rigid_shafts.toml")
    params, count = choose(base, 6, 4, 64)
    assert (len(params), count) == (64, 7)
    nominal = joint.perturb(base.joint, base.operation, joint.nominal_errors(1, CARDAN))
    assert params[:1].tobytes() == nominal.tobytes()
    assert len(np.unique(params["pin_axis"], axis=0)) == len(params)
    few, count = choose(base, 6, 4, 1)
    assert (len(few), count) == (7, 7)
    assert few.tobytes() == params[:7].tobytes()


def test_tasks_take_turns_and_the_first_round_does_not_count():
    now, order = [0.0], []

    def task(name, seconds):
        order.append(name)
        now[0] += seconds * (100 if len(order) <= 2 else 1)  # the first round loads things
        return len(order)

    done = in_turn({"a": lambda: task("a", 1.0), "b": lambda: task("b", 3.0)}, 3, lambda: now[0])
    assert order == ["a", "b"] * 4
    assert (done.typical("a"), done.least("b"), done.ratio("b", "a")) == (1.0, 3.0, 3.0)
    assert len(done.seconds["a"]) == 3
    assert done.returned == {"a": 7, "b": 8}


def test_a_ratio_is_taken_round_by_round():
    slow = Times({"a": np.array([1.0, 10.0, 2.0]), "b": np.array([2.0, 20.0, 4.0])}, {})
    assert slow.ratio("b", "a") == 2.0
