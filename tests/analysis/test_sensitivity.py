"""Causes: Sobol' indices and the tail, on functions with known answers; coverage over seeds."""

import numpy as np
import pytest
from scipy import stats
from scipy.stats import norm

from tolstat.analysis import ranks, sensitivity

SEEDS = 500
LEAST = 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / SEEDS)
ISHIGAMI_FIRST = np.array([0.313905, 0.442411, 0.0])
"""Closed form for a = 7, b = 0.1 (Homma and Saltelli 1996)."""
SLOPES = np.array([0.7, 0.5, -0.3, 0.0])


def ishigami(n, rng):
    x = rng.uniform(-np.pi, np.pi, (n, 3))
    return x, np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def linear(n, rng):
    x = rng.standard_normal((n, len(SLOPES)))
    return x, x @ SLOPES


def share_explained(x, y):
    """Share that steps of eight equal parts explain, not corrected for chance: what the test must catch."""
    part = np.argsort(np.argsort(x, axis=0), axis=0) * 8 // len(x)
    means = np.array([[y[column == k].mean() for k in range(8)] for column in part.T])
    return means.var(axis=1) / y.var()


@pytest.fixture(scope="module")
def found():
    rng = np.random.default_rng(1991)
    first, naive = [], []
    for _ in range(SEEDS):
        x, y = ishigami(1000, rng)
        first.append(sensitivity.first_order(x, y))
        naive.append(share_explained(x, y))
    return first, np.array(naive)


@pytest.mark.slow
def test_first_order_indices_cover_and_are_not_biased(found):
    first, naive = found
    lower, upper, estimate = (np.array([getattr(f, e) for f in first]) for e in ("lower", "upper", "estimate"))
    covered = ((lower <= ISHIGAMI_FIRST) & (upper >= ISHIGAMI_FIRST)).mean(axis=0)
    assert np.all(covered >= LEAST)
    assert covered[0] < 0.995  # not by being wide
    assert np.abs(estimate.mean(axis=0) - ISHIGAMI_FIRST).max() < 0.005
    # an estimator that takes chance for an effect, with the same widths
    half = 0.5 * (upper - lower)[:, 2]
    assert np.mean(np.abs(naive[:, 2] - ISHIGAMI_FIRST[2]) <= half) < LEAST


def test_linear_model_has_the_shares_of_its_slopes():
    x, y = linear(20_000, np.random.default_rng(5))
    shares = SLOPES**2 / (SLOPES @ SLOPES)
    first = sensitivity.first_order(x, y)
    assert first.estimate == pytest.approx(shares, abs=0.012)
    assert first.additive[0] == pytest.approx(1.0, abs=0.01)


def test_few_joints_give_an_error_without_effect_no_share_on_average_and_without_correction_they_do():
    rng = np.random.default_rng(50)
    x, loads = rng.standard_normal((sensitivity.FEWEST, 40)), rng.standard_normal((100, sensitivity.FEWEST))
    assert abs(np.mean([sensitivity.first_order(x, y).estimate for y in loads])) < 0.01
    assert share_explained(x, loads[0]).mean() > 0.1


def test_a_load_that_scatters_more_at_large_errors_has_no_share_on_average_and_by_degrees_of_freedom_it_has():
    """The mean of the load is zero at every value of every error; its scatter grows with five of them."""
    rng, leaving_out, by_degrees = np.random.default_rng(51), [], []
    for _ in range(100):
        x = rng.standard_normal((200, 8))
        y = rng.standard_normal(200) * (x[:, :5] ** 4).sum(axis=1)
        found = sensitivity.first_order(x, y)
        low, high = found.additive[1:]
        leaving_out.append(found.additive[0])
        assert found.additive[0] == pytest.approx(found.estimate.sum())
        assert low <= max(found.additive[0], 0.0) <= high
        e = y - y.mean()
        inside = [np.sum((e - sensitivity._fit(column, e).mean) ** 2) / (199 - 8) for column in x.T]
        by_degrees.append(np.sum(1.0 - np.array(inside) / e.var(ddof=1)))
    assert abs(np.mean(leaving_out)) < 0.05
    assert np.mean(by_degrees) > 0.16


def test_errors_of_few_values_and_of_one_value():
    rng = np.random.default_rng(8)
    x = np.column_stack([rng.integers(0, 2, 1000), rng.standard_normal(1000), np.full(1000, 3.0)])
    found = sensitivity.first_order(x, 2.0 * x[:, 0] + x[:, 1])
    assert found.estimate[:2] == pytest.approx([0.5, 0.5], abs=0.05)
    assert np.isnan(found.estimate[2])


def test_a_load_that_does_not_scatter_has_no_indices():
    x = np.random.default_rng(9).standard_normal((800, 3))
    assert np.isnan(sensitivity.first_order(x, np.zeros(800)).estimate).all()


@pytest.mark.slow
def test_probability_of_the_larger_error_covers_and_a_binomial_interval_does_not():
    rng, shift, covered, narrow = np.random.default_rng(4), 0.8, [], []
    above = np.arange(300) < 25
    truth = norm.cdf(shift / np.sqrt(2.0))
    for _ in range(2 * SEEDS):
        z = rng.standard_normal((300, 2))
        z[above, 0] += shift
        part = ranks.tail(z, above).direction
        covered.append([part.lower[0] <= truth <= part.upper[0], part.lower[1] <= 0.5 <= part.upper[1]])
        half = 1.96 * np.sqrt(part.estimate[0] * (1.0 - part.estimate[0]) / 300)
        narrow.append(abs(part.estimate[0] - truth) <= half)
    least = 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / (2 * SEEDS))
    assert np.all(np.mean(covered, axis=0) >= least)
    assert np.mean(narrow) < least


@pytest.mark.slow
def test_errors_that_play_no_part_are_rarely_blamed_and_without_holm_often():
    rng = np.random.default_rng(12)
    above = np.arange(200) < 30
    least = []
    for _ in range(SEEDS):
        found = ranks.tail(rng.standard_normal((200, 20)), above)
        least.append(min(found.direction.p.min(), found.size.p.min()))
    most = 0.05 + 3.0 * np.sqrt(0.05 * 0.95 / SEEDS)
    assert np.mean(np.array(least) < 0.05) <= most
    assert np.mean(np.array(least) / 40 < 0.05) > most


def test_direction_and_size_are_told_apart():
    rng = np.random.default_rng(3)
    z = rng.standard_normal((2000, 3))
    found = ranks.tail(z, z[:, 0] + z[:, 1] ** 2 > 3.0)
    assert found.direction.estimate[0] > 0.6
    assert found.direction.p[1] > 0.05
    assert found.size.estimate[1] > 0.8
    assert min(found.direction.p[2], found.size.p[2]) > 0.05


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: sensitivity.first_order(np.zeros((10, 2)), np.zeros(10)), "too few"),
        (lambda: ranks.tail(np.eye(60), np.arange(60) < 3), "3 of 60 joints"),
    ],
)
def test_misuse_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_ranks_are_those_of_scipy_for_all_joints_and_for_some():
    rng = np.random.default_rng(4)
    x = np.column_stack([rng.standard_normal(300), rng.integers(0, 5, 300), np.zeros(300)])
    np.testing.assert_array_equal(ranks.ranks(x), stats.rankdata(x, axis=0))
    some = rng.random(300) < 0.3
    np.testing.assert_array_equal(ranks.from_places(ranks.places(x)[:, some]).T, stats.rankdata(x[some], axis=0))


def test_p_values_in_the_tail_are_those_of_mann_whitney():
    rng = np.random.default_rng(5)
    x = np.column_stack([rng.standard_normal(200), rng.integers(-3, 4, 200)])
    above = x[:, 0] + rng.standard_normal(200) > 1.0
    both = np.column_stack([x, np.abs(x)])
    p = stats.mannwhitneyu(both[above], both[~above], method="asymptotic").pvalue
    # Holm: the smallest of four counts four times, the next three times, and none less than one before it
    adjusted = [min(1.0, max((p >= before).sum() * before for before in p[p <= own])) for own in p]
    found = ranks.tail(x, above)
    np.testing.assert_allclose(np.concatenate([found.direction.p, found.size.p]), adjusted, rtol=1e-12)


def test_exchanging_the_sides_of_a_limit_mirrors_the_interval():
    z, above = np.random.default_rng(6).standard_normal((200, 3)), np.arange(200) < 25
    z[above, 0] += 1.0
    one, other = ranks.tail(z, above).direction, ranks.tail(z, ~above).direction
    for ours, mirrored in ((one.estimate, other.estimate), (one.lower, other.upper), (one.upper, other.lower)):
        np.testing.assert_allclose(ours, 1.0 - mirrored, rtol=1e-4)


def test_dependent_samples_have_no_interval():
    x, y = linear(300, np.random.default_rng(6))
    ends = [sensitivity.first_order(x, y, iid=False).lower]
    ends.append(ranks.tail(x, y > 0.8, iid=False).size.upper)
    assert np.isnan(ends).all()
