"""Cycles, spectra and damage: against ASTM E1049, other packages, a naive twin and closed forms."""

from __future__ import annotations

import doctest
from collections import Counter
from importlib.util import find_spec

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support import naive
from tests.support.of_cardan import BUSHING_LOADS, SHAFT_LOADS
from tolstat.analysis import cycles
from tolstat.analysis.cycles import Cycles
from tolstat.analysis.strength import SNLine
from tolstat.common.cardan import CARDAN
from tolstat.common.channels import components, load_histories, planes, signals_of
from tolstat.common.load_kinds import kinds
from tolstat.solver import histories

ASTM = [-2, 1, -3, 5, -1, 3, -4, 4]
"""ASTM E1049-85, Figures 6 and 7."""
SIGNALS = st.lists(st.integers(-9, 9), min_size=1, max_size=60)


def needs(package):
    return pytest.mark.skipif(find_spec(package) is None, reason=f"{package} is not installed: pip install .[fatigue]")


def pairs(ranges, means):
    """Multiset of cycles."""
    return Counter(zip(np.round(ranges, 9).tolist(), np.round(means, 9).tolist(), strict=True))


def closed(signal):
    """One period from its largest value to the same again."""
    first = int(np.argmax(signal))
    return np.concatenate([signal[first:], signal[: first + 1]]).astype(float)


def noise(seed=1, n=500):
    return np.random.default_rng(seed).normal(size=n)


def of_signals(*signals, name="cross1.F_e"):
    """Cycles of joints with one channel, as the store gives them."""
    table = np.zeros((len(signals), 1, 300, 2))
    number = np.zeros((len(signals), 1))
    for i, signal in enumerate(signals):
        ranges, means = histories.periodic(signal)
        table[i, 0, : len(ranges), 0], table[i, 0, : len(ranges), 1] = ranges, means
        table[i, 0, 0] = np.ptp(signal), 0.5 * (np.max(signal) + np.min(signal))
        number[i] = len(ranges)
    return Cycles.of_revolution((name,), table[..., 0], table[..., 1], number)


def test_the_standards_example():
    ranges, means = histories.periodic(ASTM)
    assert ranges.tolist() == [9, 7, 4, 3]
    assert means.tolist() == [0.5, 0.5, 1.0, -0.5]
    assert doctest.testmod(histories) == (0, 3)


@settings(max_examples=300, deadline=None)
@given(SIGNALS)
def test_cycles_are_those_of_the_naive_twin_and_conserve_reversals(signal):
    ranges, means = histories.periodic(signal)
    assert pairs(ranges, means) == pairs(*naive.rainflow(signal))
    assert 2 * len(ranges) == len(naive.turns(signal))
    travel = np.abs(np.diff([*signal, signal[0]])).sum()
    assert 2 * ranges.sum() == pytest.approx(travel)
    assert np.all(np.diff(ranges) <= 0)


@settings(max_examples=100, deadline=None)
@given(SIGNALS, st.integers(0, 59))
def test_where_the_revolution_is_cut_does_not_matter(signal, shift):
    assert pairs(*histories.periodic(signal)) == pairs(*histories.periodic(np.roll(signal, shift)))
    ranges, means = histories.periodic(signal)
    assert pairs(ranges, -means) == pairs(*histories.periodic(-np.array(signal)))


@settings(max_examples=100, deadline=None)
@given(SIGNALS, st.integers(0, 12))
def test_gate_takes_out_the_small_cycles_only(signal, gate):
    ranges, means = histories.periodic(signal)
    large = ranges > gate
    assert pairs(*histories.periodic(signal, gate)) == pairs(ranges[large], means[large])


@pytest.mark.parametrize("bad", [[], [[1.0]], [1.0, np.nan]])
def test_no_cycles_of_what_is_no_signal(bad):
    with pytest.raises(ValueError, match="finite values of one period expected"):
        histories.periodic(bad)


@needs("rainflow")
def test_cycles_of_the_package_rainflow():
    import rainflow as package

    for signal in (np.array(ASTM), noise()):
        whole = Counter()
        for size, mean, number, *_ in package.extract_cycles(closed(signal)):
            whole[round(size, 9), round(mean, 9)] += number
        assert pairs(*histories.periodic(signal)) == whole


@needs("fatpack")
def test_cycles_of_the_package_fatpack():
    import fatpack

    for signal in (np.array(ASTM), noise()):
        whole, residue = fatpack.find_rainflow_cycles(closed(naive.turns(signal.tolist())))
        again, _ = fatpack.find_rainflow_cycles(fatpack.concatenate_reversals(residue, residue))
        ends = np.array([*whole.tolist(), *again.tolist()])
        assert pairs(*histories.periodic(signal)) == pairs(np.ptp(ends, axis=1), ends.mean(axis=1))


@needs("pylife")
def test_cycles_of_pylife():
    from pylife.stress import rainflow as package

    for signal in (np.array(ASTM), noise()):
        recorder = package.LoopValueRecorder()
        detector = package.FourPointDetector(recorder=recorder).process(closed(signal))
        ends = np.transpose([recorder.values_from, recorder.values_to])
        rise, fall = np.abs(np.diff(detector.residuals))  # the largest cycle stays open
        assert rise == fall
        ends = np.vstack([ends, detector.residuals[1:]])
        assert pairs(*histories.periodic(signal)) == pairs(np.ptp(ends, axis=1), ends.mean(axis=1))


def components_of(history):
    return [signal.name for signal in components(CARDAN).values() if signal.history.name == history]


def test_cycles_of_a_joint_are_those_of_its_components():
    rng = np.random.default_rng(5)
    loads = {
        history.name: rng.normal(size=(40, *history.shape)) + np.arange(6)
        for history in load_histories(CARDAN).values()
    }
    loads["loads"][:, 7] *= 1e-6  # cycles below the gate
    loads["shafts"][:, 0] *= 2e-4  # some of them are
    counted = histories.cycles(loads)
    assert {name: values.shape for name, values in counted.items()} == {
        name: spec.shape for name, spec in histories.cycle_specs().items()
    }
    bushing = loads["loads"]
    largest = {
        "N": np.linalg.norm(bushing[..., :3], axis=-1).max(),
        "N*m": np.linalg.norm(bushing[..., 3:], axis=-1).max(),
    }
    for history in load_histories(CARDAN).values():
        kept, number = (counted[f"{history.prefix}{name}"] for name in ("cycles", "cycle_count"))
        for c, name in enumerate(components_of(history.name)):
            signal = loads[history.name][:, c // 6, c % 6]
            ranges, means = histories.periodic(signal, histories.GATE * largest[components(CARDAN)[name].unit])
            assert number[c] == len(ranges), name
            if len(ranges) == 0:  # the level of a load that hardly varies
                ranges, means = np.array([np.ptp(signal)]), np.array([0.5 * (signal.max() + signal.min())])
            k = min(len(ranges), histories.KEPT)
            np.testing.assert_allclose(kept[c, :k, 0], ranges[:k], rtol=1e-6)
            np.testing.assert_allclose(kept[c, :k, 1], means[:k], rtol=1e-5, atol=1e-6)
            assert not kept[c, k:].any()
    assert (counted["cycle_count"][:42] > 0).all()
    assert not counted["cycle_count"][42:].any()
    assert 0 < counted["shaft_cycle_count"][:3].max() < 20  # the gate leaves some out
    assert components_of(BUSHING_LOADS.name)[4:8] == ["cross1.T_t", "cross1.T_z", "cross2.F_e", "cross2.F_t"]
    assert components_of(SHAFT_LOADS.name)[5:8] == ["input.m_z", "output.f_x", "output.f_y"]
    bushing[3, 2, 1] = np.nan
    assert np.isnan(histories.cycles(loads)["cycles"]).all()


def test_cycles_along_a_direction_are_those_of_the_sum():
    rng = np.random.default_rng(6)
    loads = {history.name: rng.normal(size=(40, *history.shape)) for history in load_histories(CARDAN).values()}
    places = {"cross2.F": ("loads", 1, 1, 2), "fork3.T": ("loads", 6, 3, 4), "output.lateral": ("shafts", 1, 0, 1)}
    for plane, (history, place, x, y) in places.items():
        first, second = loads[history][:, place, x], loads[history][:, place, y]
        ranges, _, number = histories.count(loads, signals_of(f"{plane} at 30 deg", CARDAN), kept=40)
        gate = 0.01  # above that of the count
        expected = histories.periodic(np.sqrt(0.75) * first + 0.5 * second, gate)[0]
        np.testing.assert_allclose(ranges[0][ranges[0] > gate], expected, rtol=1e-12)
        assert number[0] >= len(expected)
        every = signals_of(f"{plane} at worst", CARDAN)
        counted = Cycles.of_revolution(
            tuple(signal.name for signal in every), *(table[None] for table in histories.count(loads, every, kept=40))
        )
        fine = [f"{plane} at {angle:g} deg" for angle in np.arange(0.0, 180.0, 0.5)]
        single = histories.count(loads, tuple(signal for name in fine for signal in signals_of(name, CARDAN)), kept=40)
        along = Cycles.of_revolution(tuple(fine), *(table[None] for table in single))
        worst = counted.worst(5.0)
        assert worst.channels == (f"{plane} at worst",)
        most, reached = cycles.equivalent_load(along, 5.0).max(), cycles.equivalent_load(worst, 5.0)[0, 0]
        assert most * (1 - 0.0022) < reached <= most
    assert set(planes(CARDAN)) == {
        *(f"{place}{i}.{kind}" for place in ("cross", "fork") for i in (1, 2, 3, 4) for kind in "FT"),
        *(f"{shaft}.{kind}" for shaft in kinds(CARDAN)["lateral"].places for kind in ("lateral", "moment")),
    }


def test_starts_take_the_place_of_the_largest_cycle():
    here = of_signals([3.0, 5.0, 3.5, 4.5], [-1.0, 2.0], [5.0, 5.0]).with_starts(0.25)
    line = SNLine(3.0, 3.0, 1.0, 1.0)
    whole = [0.25 * 5.0**3 + 0.75 * 2.0**3 + 1.0, 0.25 * 3.0**3 + 0.75 * 3.0**3, 0.25 * 5.0**3]
    np.testing.assert_allclose(cycles.damage(here, line, 1.0)[:, 0], whole)
    np.testing.assert_allclose(here.number[:, 0], [2.0, 1.0, 0.25])


def test_equivalent_load_and_damage_of_constant_amplitude():
    wave = 50.0 * np.cos(2 * np.pi * 3 * np.arange(60) / 60) + 7.0  # three cycles of range 100
    here = of_signals(wave, np.full(60, 5.0))
    assert here.number.tolist() == [[3], [0]]
    load = cycles.equivalent_load(here, 5.0, revolutions=1e6, reference_cycles=2e6)
    assert load[:, 0] == pytest.approx([100.0 * 1.5**0.2, 0.0])
    line = SNLine(4.0, 4.0, 2e6, 200.0)
    assert cycles.damage(here, line, revolutions=1e6)[:, 0] == pytest.approx([3e6 / (2e6 * 2.0**4), 0.0])


def test_a_duty_cycle_adds_damage_not_loads():
    parts = [of_signals(noise(seed), noise(seed + 10)) for seed in (1, 2)]
    shares = [0.3, 0.7]
    both = cycles.duty_cycle(parts, shares)
    line = SNLine(3.0, 3.0, 1e6, 4.0)
    separate = sum(s * cycles.damage(p, line, 1e6) for s, p in zip(shares, parts, strict=True))
    np.testing.assert_allclose(cycles.damage(both, line, 1e6), separate)
    power = sum(s * cycles.equivalent_load(p, 3.0) ** 3 for s, p in zip(shares, parts, strict=True))
    np.testing.assert_allclose(cycles.equivalent_load(both, 3.0), power ** (1 / 3))
    np.testing.assert_allclose(cycles.duty_cycle([parts[0]] * 2, [0.5, 0.5]).number, parts[0].number)


def test_spectrum_reads_the_ordered_ranges():
    signals = [noise(1), np.array([0.0, 4, 1, 2]), np.zeros(4)]
    here = of_signals(*signals)
    numbers = [0.5, 1, 2, 3, 100]
    expected = np.zeros((3, 5))
    for i, signal in enumerate(signals):
        ranges = histories.periodic(signal)[0]
        for q, number in enumerate(numbers):
            expected[i, q] = next((r for k, r in enumerate(ranges, 1) if k >= number), 0.0)
    np.testing.assert_allclose(cycles.spectrum(here, numbers)[:, 0], expected)
    both = cycles.duty_cycle([here, here], [0.4, 0.6])
    np.testing.assert_allclose(cycles.spectrum(both, numbers)[:, 0], expected)


def largest(signal, k):
    """Cycles of one joint of which `k` are stored, and the ranges of the others."""
    ranges = histories.periodic(signal)[0]
    stored = ranges[None, None, :k]
    return Cycles.of_revolution(("cross1.F_e",), stored, stored, np.array([[len(ranges)]])), ranges[k:]


def test_small_cycles_are_those_below_a_share_of_the_largest_load_of_their_kind():
    """Cycles just below and above the gate: forces of 1000 N, torques of 10 N m, on bushings and on shafts."""
    waves = np.outer(np.tile([0.5, -0.5], 4) * histories.GATE, [0.99, 1.02])
    loads = {history.name: np.zeros((8, len(history.places), 6)) for history in load_histories(CARDAN).values()}
    for values in loads.values():
        values[:, :2, 0], values[:, :2, 5] = 1000.0 * (waves + 0.9), 10.0 * (waves + 0.9)
    loads["loads"][0, 2, 1], loads["loads"][0, 2, 4] = 1000.0, 10.0
    counted = histories.cycles(loads)
    for history in load_histories(CARDAN).values():
        names = components_of(history.name)
        numbers = dict(zip(names, counted[f"{history.prefix}cycle_count"], strict=True))
        for component in (history.components[0], history.components[5]):
            assert [numbers[f"{place}.{component}"] for place in history.places[:2]] == [0, 4]


def test_what_is_not_stored_is_bounded():
    kept, others = largest(noise(), 16)
    lost = np.sum(others**3) / cycles.moment(kept, 3.0)[0, 0]
    assert lost <= cycles.truncation_bound(kept, 3.0)[0, 0] < 100 * lost
    assert cycles.truncation_bound(of_signals(noise()), 3.0)[0, 0] == 0.0


def test_what_is_not_stored_of_a_duty_cycle_is_bounded():
    # the point with small cycles stores them all: its smallest does not bound what the other one leaves out
    large, others = largest(noise(), 16)
    small, _ = largest(1e-3 * noise(2, 20), 16)
    both = cycles.duty_cycle([large, small], [0.4, 0.6])
    lost = 0.4 * np.sum(others**3) / cycles.moment(both, 3.0)[0, 0]
    assert lost <= cycles.truncation_bound(both, 3.0)[0, 0] < 100 * lost
    assert cycles.truncation_bound(both, 3.0)[0, 0] == pytest.approx(cycles.truncation_bound(large, 3.0)[0, 0])


def test_joints_without_results_have_no_values():
    here = of_signals(noise(1), noise(2))
    for table in (here.ranges, here.means, here.number):
        table[1] = np.nan
    values = [
        cycles.equivalent_load(here, 3.0),
        cycles.damage(here, SNLine(3.0, 3.0, 1e6, 1.0), 1e6),
        cycles.spectrum(here, [1.0])[..., 0],
    ]
    for value in values:
        assert np.isfinite(value[0]).all()
        assert np.isnan(value[1]).all()
