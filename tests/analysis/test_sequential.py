"""Stop rules: coverage, cost and bias from the exact distribution over look and count; drawn campaigns agree."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from tests.support import stops
from tolstat.analysis import binomial, capability, difference
from tolstat.analysis.design import Independent, Looked
from tolstat.analysis.sample import Sample

PLANS = [
    (0.2, 500),
    *(pytest.param(*plan, marks=pytest.mark.slow) for plan in ((0.1, 2000), (0.05, 5000), (0.02, 20_000))),
]


def least_coverage(width: float, n: int, confidence: float, most: int) -> float:
    """Least coverage at the stop over ends of intervals, where it is worst, and over shares between."""
    rule = stops.Rule(width, stops.grid(n), confidence)
    shares = np.concatenate([rule.ends(most), np.geomspace(10 / n, 0.5, 30)])
    return min(rule.coverage(float(p)) for p in shares)


def campaign(width: float, loads: np.ndarray, planned: list[int], ahead: bool) -> tuple[int, int]:
    """Number of joints at the stop, and count above; loads are 1 above the level, 0 below it, -1 without a value.

    `ahead`: looks at which no stop is possible are left out.
    """
    above, others = np.cumsum(loads == 1), np.cumsum(loads == -1)
    joints = binomial.next_look(width, planned) if ahead else planned[0]
    while True:
        counts = int(above[joints - 1]), int(others[joints - 1]), joints
        if joints == planned[-1] or binomial.narrow(width, *counts):
            return joints, counts[0]
        joints = binomial.next_look(width, planned, *counts) if ahead else planned[planned.index(joints) + 1]


@pytest.mark.parametrize(("width", "n"), PLANS)
def test_the_interval_at_the_stop_covers_every_share_and_one_without_correction_does_not(width: float, n: int) -> None:
    assert least_coverage(width, n, binomial.LOOK_CONFIDENCE, 120) >= 0.95
    assert least_coverage(width, n, 0.95, 120) < 0.95


@pytest.mark.slow
def test_it_covers_between_two_ends_of_intervals() -> None:
    """Between two ends one miss grows with the share and the other falls: their largest values bound the sum."""
    rule = stops.Rule(0.3, stops.grid(110), binomial.LOOK_CONFIDENCE)
    misses = [rule.misses(float(p)) for p in rule.ends(10_000)]
    assert max(below + above for (_, below), (above, _) in itertools.pairwise(misses)) <= 0.05


def test_the_rule_is_the_one_whose_coverage_is_computed() -> None:
    assert binomial.looks(2000) == stops.grid(2000)
    rule = stops.Rule(0.1, binomial.looks(2000), binomial.LOOK_CONFIDENCE)
    for look, n in enumerate(rule.looks):
        counts = np.arange(n + 1)
        for own, known in zip(binomial.stop_interval(counts, 0, n), (rule.lower[look], rule.upper[look]), strict=True):
            np.testing.assert_allclose(own, known, rtol=1e-9)
        if n < 2000:
            np.testing.assert_array_equal(binomial.narrow(0.1, counts, 0, n), rule.stop[look])


@pytest.mark.slow
def test_drawn_campaigns_agree_with_the_computation() -> None:
    rng, p, planned = np.random.default_rng(5), 0.12, binomial.looks(500)
    rule = stops.Rule(0.2, planned, binomial.LOOK_CONFIDENCE)
    assert sum(mass.sum() for _, _, mass in rule.stops(p)) == pytest.approx(1.0, abs=1e-9)
    ends = np.array([campaign(0.2, rng.binomial(1, p, 500), planned, ahead=True) for _ in range(1000)])
    joints, count = ends.T
    lower, upper = binomial.stop_interval(count, 0, joints)
    assert np.mean((lower > p) | (upper < p)) == pytest.approx(1.0 - rule.coverage(p), abs=0.015)
    assert joints.mean() == pytest.approx(rule.joints(p), rel=0.02)
    assert np.mean(count / joints) / p - 1.0 == pytest.approx(rule.bias(p), abs=0.04)


def fixed(p: float, width: float) -> int:
    """Number of joints of a plan without looks: the interval is narrow enough with exactly a share p of them above."""
    joints = np.arange(1, 1000)
    lower, upper = binomial.clopper_pearson(p * joints, joints)
    return int(joints[upper - lower < width][0])


def test_it_costs_little_more_than_a_fixed_plan_and_its_share_is_biased_high() -> None:
    rule = stops.Rule(0.1, stops.grid(2000), binomial.LOOK_CONFIDENCE)
    shares = np.geomspace(0.01, 0.5, 30)
    costs = [rule.joints(p) / fixed(p, 0.1) for p in shares if p * fixed(p, 0.1) >= 10]
    assert 1.0 < min(costs) < max(costs) < 1.4
    assert max(rule.bias(p) for p in shares) == pytest.approx(binomial.BIAS, abs=0.008)


@pytest.mark.parametrize("lost", [0.0, 0.05, 0.3])
def test_looks_that_are_left_out_could_not_have_stopped(lost: float) -> None:
    rng = np.random.default_rng(3)
    planned = binomial.looks(900)
    for p, width in itertools.product((0.01, 0.1, 0.5, 0.97), (0.5, 0.2, 0.1)):
        for _ in range(3):
            loads = rng.choice([1, 0, -1], 900, p=[p * (1 - lost), (1 - p) * (1 - lost), lost])
            assert campaign(width, loads, planned, ahead=True) == campaign(width, loads, planned, ahead=False)


def test_a_stop_has_ten_joints_on_each_side() -> None:
    found = binomial.narrow(0.4, [9, 10, 31, 10], [0, 0, 0, 21], 40)
    np.testing.assert_array_equal(found, [False, True, False, False])


def test_looks_grow_slowly_and_those_taken_stay() -> None:
    planned = binomial.looks(100_000)
    assert planned[0] == 20
    assert all(b <= 1.05 * a + 1 for a, b in itertools.pairwise(planned))
    assert binomial.looks(12) == [12]
    before = binomial.looks(301)
    assert set(before) <= set(binomial.looks(1000, taken=before))
    assert 301 not in binomial.looks(1000)


def test_every_interval_of_a_campaign_with_looks_is_that_of_a_look() -> None:
    """Share, quantile, Ppk, delivery and differences of one file say the same."""
    rng = np.random.default_rng(8)
    values, others = rng.normal(size=(2, 2000))
    alone, looked = (Sample.of(values, np.ones(2000), design) for design in (Independent(), Looked()))
    share, count = looked.above(2.0), int((values > 2.0).sum())
    lower, upper = binomial.clopper_pearson(count, 2000, binomial.LOOK_CONFIDENCE)
    assert (share.lower, share.upper) == (pytest.approx(float(lower)), pytest.approx(float(upper)))
    assert looked.quantile(0.9) == alone.quantile(0.9, binomial.LOOK_CONFIDENCE)
    assert looked.delivery(2.0, 500) == alone.delivery(2.0, 500, binomial.LOOK_CONFIDENCE)
    index, wide = capability.of_sample(looked, 4.0), capability.of_sample(alone, 4.0, binomial.LOOK_CONFIDENCE)
    assert index.ppk == wide.ppk
    second = Sample.of(values + 0.1 * others, np.ones(2000))
    for paired in (True, False):
        own, plain = (difference.shares(sample, second, [1.0], paired) for sample in (looked, alone))
        assert own.lower[0] < plain.lower[0] < plain.upper[0] < own.upper[0]
