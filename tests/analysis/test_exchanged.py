"""Indices from joints with exchanged errors, with known answers and against scipy's on the same joints."""

import numpy as np
import pytest
from scipy.stats import norm, sobol_indices

from tests.analysis.test_sensitivity import ISHIGAMI_FIRST
from tolstat.analysis import exchanged

SEEDS = 500
ISHIGAMI_TOTAL = np.array([0.557589, 0.442411, 0.243684])
LEAST = 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / SEEDS)


def test_indices_of_a_rare_event_cover_with_few_points_and_normal_intervals_do_not():
    rng, n, level = np.random.default_rng(4), 300, 1.6448536  # a share of 0.05
    x = np.linspace(-8.0, 8.0, 4001)
    density = norm.pdf(x) / norm.pdf(x).sum()
    truth = float(density @ (norm.sf((level - 0.6 * x) / 0.8) - 0.05) ** 2) / (0.05 * 0.95)
    missed = {exchanged.of_event: [], exchanged.indices: []}
    for _ in range(200):
        a, b = rng.standard_normal((2, n, 2))
        loads = [part @ [0.6, 0.8] > level for part in (a, b, np.stack([np.column_stack([b[:, 0], a[:, 1]])], axis=1))]
        for estimate, own in missed.items():
            found = estimate(*loads)
            own.append([found.first.lower[0] > truth, found.first.upper[0] < truth])
        np.testing.assert_allclose(exchanged.of_event(*loads)[0][0], exchanged.indices(*loads)[0][0], atol=1e-12)
        np.testing.assert_allclose(exchanged.of_event(*loads)[1][0], exchanged.indices(*loads)[1][0], atol=1e-12)
    counted, normal = (np.mean(own, axis=0).max() for own in missed.values())
    assert counted < 0.025 + 3.0 * np.sqrt(0.025 * 0.975 / 200)
    assert normal > 0.1


def test_an_error_without_effect_on_an_event_has_an_interval_that_is_no_point():
    a, b = np.random.default_rng(5).standard_normal((2, 200, 1))
    found = exchanged.of_event(a[:, 0] > 1.0, b[:, 0] > 1.0, (a > 1.0))
    assert found.first.estimate.tolist() == found.total.estimate.tolist() == [0.0]
    assert found.first.lower[0] == 0.0 < found.first.upper[0] < 0.3
    assert 0.0 < found.total.upper[0] < 0.1


def ishigami(x):
    return np.sin(x[..., 0]) + 7.0 * np.sin(x[..., 1]) ** 2 + 0.1 * x[..., 2] ** 4 * np.sin(x[..., 0])


def design(n, rng):
    a, b = rng.uniform(-np.pi, np.pi, (2, n, 3))
    ab = np.stack([np.where(np.arange(3) == i, b, a) for i in range(3)], axis=1)
    return ishigami(a), ishigami(b), ishigami(ab)


def test_indices_of_ishigamis_function_cover_and_frozen_for_picked_does_not():
    rng, covered, wrong = np.random.default_rng(11), [], []
    for _ in range(SEEDS):
        a, b, ab = design(1000, rng)
        found = exchanged.indices(a, b, ab)
        for index, truth in ((found.first, ISHIGAMI_FIRST), (found.total, ISHIGAMI_TOTAL)):
            covered.append((index.lower <= truth) & (truth <= index.upper))
        swapped = exchanged.indices(b, a, ab).first  # A in B's place: everything but the group
        wrong.append((swapped.lower <= ISHIGAMI_FIRST) & (swapped.upper >= ISHIGAMI_FIRST))
    first, total = np.mean(covered[::2], axis=0), np.mean(covered[1::2], axis=0)
    assert min(*first, *total) >= LEAST
    assert max(*first, *total) < 0.995
    assert np.mean(wrong, axis=0).max() < LEAST


def test_no_interval_leaves_0_to_1():
    a, b = np.random.default_rng(3).normal(size=(2, 60, 2))
    load = lambda x: x[..., 0] + 0.1 * x[..., 1]  # noqa: E731
    mixed = np.stack([np.where([True, False], b, a), np.where([False, True], b, a)], axis=1)
    found = (
        exchanged.indices(load(a), load(b), load(mixed)),
        exchanged.of_event(load(a) > 1, load(b) > 1, load(mixed) > 1),
    )
    ends = np.array([(index.lower, index.upper) for own in found for index in (own.first, own.total)])
    assert (ends.min(), ends.max()) == (0.0, 1.0)


def test_estimates_are_scipys():
    a, b, ab = design(512, np.random.default_rng(3))
    theirs = sobol_indices(func={"f_A": a[None], "f_B": b[None], "f_AB": ab.T[:, None]}, n=512)
    found = exchanged.indices(a, b, ab)
    np.testing.assert_allclose(found.first.estimate, theirs.first_order, rtol=1e-9)
    np.testing.assert_allclose(found.total.estimate, theirs.total_order, rtol=1e-9)


def test_a_joint_without_a_load_costs_only_its_own_index():
    a, b, ab = design(200, np.random.default_rng(4))
    lost = ab.copy()
    lost[:20, 1] = np.nan
    found, whole = exchanged.indices(a, b, lost), exchanged.indices(a, b, ab)
    np.testing.assert_array_equal(found.first.estimate[[0, 2]], whole.first.estimate[[0, 2]])
    assert found.first.estimate[1] != whole.first.estimate[1]
    for loads, text in (
        ((a[:49], b[:49], ab[:49]), "too few"),
        ((a[:1].repeat(60),) * 2 + (ab[:1].repeat(60, 0) * 0 + a[0],), "scatter"),
    ):
        with pytest.raises(ValueError, match=text):
            exchanged.indices(*loads)
