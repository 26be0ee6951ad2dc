"""Cycles between the operating points of a duty cycle: those of the whole course, and by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.questions.test_fatigue import of_signals
from tolstat.analysis import cycles
from tolstat.analysis.design import Independent
from tolstat.common.tables import Status
from tolstat.questions.fatigue import loads
from tolstat.questions.fatigue.duty import Joints
from tolstat.solver import histories
from tolstat.study.fatigue import Fatigue


def course(levels, visits, turns):
    """Load that goes through so many revolutions at each visit, a cosine between the two levels of the point."""
    wave = np.cos(2 * np.pi * np.arange(40) / 40)
    each = [0.5 * (levels[v][0] + levels[v][1]) + 0.5 * (levels[v][1] - levels[v][0]) * wave for v in visits]
    return np.concatenate([np.append(np.tile(own, turns), own[0]) for own in each])


@pytest.mark.parametrize("seed", range(6))
def test_cycles_between_points_are_those_of_the_whole_course(seed):
    """Oracle: all cycles of a course of many revolutions, without those of the revolutions themselves."""
    rng = np.random.default_rng(seed)
    levels = np.sort(rng.normal(size=(4, 2)) + 3 * rng.normal(size=(4, 1)), axis=1)
    visits, turns = rng.integers(0, 4, 12), 50
    visits = visits[np.flatnonzero(np.diff(visits, append=visits[0] - 9))]
    ranges, means, numbers = histories.between(visits, levels[None, :, 0], levels[None, :, 1])
    whole, middles = histories.periodic(course(levels, visits, turns))
    own = {round(high - low, 9) for low, high in levels}
    between = np.array([r for r in whole if round(r, 9) not in own])
    np.testing.assert_allclose(np.sort(np.repeat(ranges[0], numbers[0].astype(int))), np.sort(between))
    steady = sum(turns * np.ptp(levels[v]) ** 3 for v in visits)
    added = float(numbers[0] @ ranges[0] ** 3)
    # a cycle between points may take the place of one of a revolution, once a visit
    assert -1e-9 < steady + added - np.sum(whole**3) < steady / turns
    assert set(means[0][numbers[0] > 0].round(9)) <= set(middles.round(9))


def test_cycles_between_points_by_hand():
    low, high = np.array([[0.0, 10.0, -5.0], [-1.0, -2.0, 0.0]]), np.array([[1.0, 11.0, 5.0], [1.0, 2.0, np.nan]])
    ranges, means, numbers = histories.between([0, 1, 0, 1], low[:1, :2], high[:1, :2])
    assert (ranges.tolist(), means.tolist(), numbers.tolist()) == ([[11.0]], [[5.5]], [[2.0]])
    assert histories.between([0, 1], low[1:, :2], high[1:, :2])[0].tolist() == [[3.0]]  # from 2 to -1
    assert np.isnan(histories.between([0, 1, 2], low, high)[0][1]).all()


def test_a_duty_cycle_with_a_sequence_adds_its_cycles():
    waves = [np.array([0.0, 1.0]), np.array([10.0, 11.0, 10.5, 10.7])]
    parts = [of_signals(wave, wave) for wave in waves]
    settings = Fatigue(visits=("a", "b", "a", "b"), turns=100.0)
    joints = Joints(np.full(2, Status.OK), Independent(), settings, 2, (("a", 0.5), ("b", 0.5)))
    mixed = loads._mixed(joints, parts, [0.5, 0.5])
    expected = 0.5 * 1.0 + 0.5 * (1.0 + 0.2**3) + 2 / 100 * 11.0**3
    np.testing.assert_allclose(cycles.moment(mixed, 3.0), expected)
    np.testing.assert_allclose(mixed.number, 0.5 + 1.0 + 0.02)
    assert "4 visits in 100 revolutions" in joints.duty_in_words[1]
    alone = replace(joints, settings=Fatigue())
    assert alone.transitions(np.zeros((2, 1, 2)), np.ones((2, 1, 2))) is None
    assert "gives no [fatigue.sequence]" in alone.duty_in_words[1]
    constant = loads._mixed(joints, [parts[0], of_signals(np.zeros(3), np.zeros(3))], [0.5, 0.5])
    np.testing.assert_allclose(cycles.moment(constant, 3.0), 0.5)
