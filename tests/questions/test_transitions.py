"""Cycles between the operating points of a duty cycle: those of the whole course, and by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.questions.test_fatigue import needs, of_signals
from tolstat.analysis import cycles
from tolstat.analysis.cycles import Cycles
from tolstat.analysis.design import Independent
from tolstat.common.cardan import CARDAN
from tolstat.common.channels import components, load_histories, signals_of
from tolstat.common.tables import Status
from tolstat.questions.fatigue.counting import Joints
from tolstat.solver import histories
from tolstat.study.fatigue import Fatigue


def test_cycles_between_points_by_hand():
    low, high = np.array([[0.0, 10.0, -5.0], [-1.0, -2.0, 0.0]]), np.array([[1.0, 11.0, 5.0], [1.0, 2.0, np.nan]])
    ranges, means, numbers, replaced = histories.between([0, 1, 0, 1], low[:1, :2], high[:1, :2])
    assert (ranges.tolist(), means.tolist(), numbers.tolist()) == ([[11.0]], [[5.5]], [[2.0]])
    assert replaced.tolist() == [[2.0, 0.0]]  # from 11 by 1 to 0 and back by 1: no cycle from 1 to 0
    assert histories.between([0, 1], low[1:, :2], high[1:, :2])[0].tolist() == [[3.0]]  # from 2 to -1
    assert np.isnan(histories.between([0, 1, 2], low, high)[0][1]).all()


def of_loads(loads, signals):
    """Cycles of one joint at a point."""
    names = tuple(signal.name for signal in signals)
    return Cycles.of_revolution(names, *(table[None] for table in histories.count(loads, signals, kept=40)))


def course(signals, visits, turns):
    """Load over the sequence: whole revolutions at each visit, from its largest value to the same again."""
    rolled = [np.roll(signal, -int(np.argmax(signal))) for signal in signals]
    each = [np.append(np.tile(rolled[v], turns[v]), rolled[v][0]) for v in visits]
    whole = np.concatenate(each)
    return np.append(np.roll(whole, -int(np.argmax(whole))), whole.max())


@needs("rainflow")
@pytest.mark.parametrize("seed", range(12))
def test_damage_of_a_sequence_is_that_of_the_histories_one_after_the_other(seed):
    """Oracle: the package rainflow on the whole course, every channel; some constant at a point, some nearly."""
    import rainflow

    rng = np.random.default_rng(seed)
    theta = 2 * np.pi * np.arange(60)[:, None, None] / 60
    signals = tuple(
        s
        for name in (*components(CARDAN), "cross1.F at 30 deg", "output.moment at 77 deg")
        for s in signals_of(name, CARDAN)
    )
    points = []
    for _ in range(4):
        loads = {}
        for history in load_histories(CARDAN).values():
            waves = (
                rng.normal(size=history.shape) * np.cos(k * theta + rng.uniform(0, 6, history.shape)) for k in (1, 2, 3)
            )
            size = rng.choice([0.0, 1e-6, 1.0], size=history.shape)
            loads[history.name] = 5.0 * rng.normal(size=history.shape) + size * sum(waves)
        points.append(loads)
    visits = rng.integers(0, 4, 9)
    visits = visits[np.flatnonzero(np.diff(visits, append=visits[0] - 9))]
    turns = rng.integers(1, 4, 4)  # revolutions at each visit
    used, number = np.unique(visits, return_counts=True)
    total = float(number @ turns[used])
    shares = number * turns[used] / total
    duty = tuple((f"p{p}", share) for p, share in zip(used, shares, strict=True))
    settings = Fatigue(visits=tuple(f"p{p}" for p in visits), turns=total)
    joints = Joints(np.full(1, Status.OK), Independent(), settings, CARDAN, 1, duty)
    parts = [of_loads(points[p], signals) for p in used]
    low, high = (np.stack([getattr(part, end) for part in parts], axis=2) for end in ("low", "high"))
    mixed = cycles.duty_cycle(parts, shares, joints.transitions(low, high))
    of_point = [
        [p[s.history.name][:, s.history.places.index(s.place)] @ np.array(s.factors) for p in points] for s in signals
    ]
    constant = np.array([[np.ptp(signal) < 1e-3 for signal in each] for each in of_point])[:, used]
    assert constant.any()
    assert not constant.all()
    for m in (3.0, 5.0):
        found = total * cycles.moment(mixed, m)[0]
        for c, each in enumerate(of_point):
            whole = rainflow.extract_cycles(course(each, visits, turns))
            expected = sum(count * size**m for size, _, count, _, _ in whole)
            assert found[c] == pytest.approx(expected, rel=1e-9), signals[c].name


def test_a_duty_cycle_with_a_sequence_adds_its_cycles():
    waves = [np.array([0.0, 1.0]), np.array([10.0, 11.0, 10.5, 10.7])]
    parts = [of_signals(wave, wave) for wave in waves]
    settings = Fatigue(visits=("a", "b", "a", "b"), turns=100.0)
    joints = Joints(np.full(2, Status.OK), Independent(), settings, CARDAN, 2, (("a", 0.5), ("b", 0.5)))

    def mixed(parts):
        low, high = (np.stack([getattr(part, end) for part in parts], axis=2) for end in ("low", "high"))
        return cycles.duty_cycle(parts, [0.5, 0.5], joints.transitions(low, high))

    between = 2 / 100 * (11.0**3 - 1.0)  # each takes the place of the largest cycle of a revolution at the lower point
    np.testing.assert_allclose(cycles.moment(mixed(parts), 3.0), 0.5 + 0.5 * (1.0 + 0.2**3) + between)
    np.testing.assert_allclose(mixed(parts).number, 0.5 + 1.0)
    assert "4 visits in 100 revolutions" in joints.duty_in_words[1]
    alone = replace(joints, settings=Fatigue())
    assert alone.transitions(np.zeros((2, 1, 2)), np.ones((2, 1, 2))) is None
    assert "gives no [fatigue.sequence]" in alone.duty_in_words[1]
    constant = mixed([parts[0], of_signals(np.full(3, 7.0), np.full(3, 7.0))])
    np.testing.assert_allclose(cycles.moment(constant, 3.0), 0.5 + 2 / 100 * (7.0**3 - 1.0))
