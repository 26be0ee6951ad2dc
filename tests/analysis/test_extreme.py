"""Tails: the generalised Pareto fit against scipy and closed forms; coverage; refusals."""

import numpy as np
import pytest
from scipy.stats import expon, genpareto, norm

from tolstat.analysis import extreme
from tolstat.analysis.design import Listed
from tolstat.analysis.sample import Sample
from tolstat.common.tables import Status

SEEDS = 500
LEAST = 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / SEEDS)


def fit(values, status=None, iid=True, **options):
    states = np.full(len(values), Status.OK) if status is None else status
    return extreme.fit(Sample.of(values, states, None if iid else Listed()), **options)


@pytest.mark.parametrize("k", [-0.4, 0.0, 0.3])
def test_distribution_is_scipys(k):
    x = np.linspace(0.01, 2.0, 7)
    assert extreme.upper_share(x, k, 0.9) == pytest.approx(genpareto(k, scale=0.9).sf(x))
    assert extreme.quantile([0.5, 1e-6], k, 0.9) == pytest.approx(genpareto(k, scale=0.9).isf([0.5, 1e-6]))
    assert extreme.log_likelihood(x, k, 0.9) == pytest.approx(genpareto(k, scale=0.9).logpdf(x).sum())


@pytest.mark.slow
def test_estimates_agree_with_maximum_likelihood():
    x = genpareto.rvs(0.2, scale=3.0, size=(4, 2000), random_state=2)
    for row, k, sigma in zip(x, *extreme.zhang_stephens(x), strict=True):
        best = genpareto.fit(row, floc=0)
        assert (k, sigma) == pytest.approx((best[0], best[2]), abs=0.03)
        # the fit of a tail is maximum likelihood itself, on a grid
        tail = fit(np.concatenate([np.zeros(2000), row]), share=0.5)
        assert tail.shape.estimate == pytest.approx(best[0], abs=0.01)
        assert tail.scale.estimate == pytest.approx(best[2], rel=0.01)


def test_a_uniform_load_is_refused_and_the_others_are_not():
    rng = np.random.default_rng(12)
    for draw, refused in ((rng.random, True), (rng.exponential, False), (rng.standard_normal, False)):
        found = [bool(fit(draw(size=2000)).region[:, 1].min() <= -0.5 + 1e-9) for _ in range(10)]
        assert np.mean(found) == refused
    assert "-0.5 or less" in fit(rng.random(2000)).refusal


def test_the_fit_tested_is_the_fit_used():
    rng = np.random.default_rng(13)
    samples = genpareto.rvs(0.1, scale=2.0, size=(3, 200), random_state=rng)
    for row, k, sigma in zip(samples, *extreme.most_likely(samples), strict=True):
        tail = fit(np.concatenate([np.zeros(1800), row]), share=0.1)
        assert (tail.shape.estimate, tail.scale.estimate) == pytest.approx((k, sigma), rel=1e-6)
        grid = extreme.log_likelihood(tail.excesses, *tail.region[:, 1:].T)
        assert extreme.log_likelihood(tail.excesses, k, sigma) >= grid.max() - 1e-6


def test_the_end_of_a_tail_has_no_likelihood_beyond_it():
    assert extreme.log_likelihood(np.array([1.0, 2.5]), -0.5, 1.0) == -np.inf
    assert extreme.upper_share(2.5, -0.5, 1.0) == 0.0


@pytest.mark.slow
def test_return_loads_cover_over_seeds_and_without_doubt_of_the_shape_they_do_not():
    load, covered, narrow = expon(), [], []
    samples = np.random.default_rng(10).exponential(size=(SEEDS, 800))
    for row in samples:
        tail = fit(row)
        found, odds = tail.level(1e-5), tail.probability(load.isf(1e-4))
        covered.append([found.lower <= load.isf(1e-5) <= found.upper, odds.lower <= 1e-4 <= odds.upper])
        near = np.abs(tail.region[:, 1] - tail.shape.estimate) < 0.01
        loads = tail.threshold + extreme.quantile(1e-5 / tail.region[near, 0], *tail.region[near, 1:].T)
        narrow.append(loads.min() <= load.isf(1e-5) <= loads.max())
    assert np.all(np.mean(covered, axis=0) >= LEAST)
    assert np.mean(narrow) < LEAST


def test_largest_of_a_fleet_is_the_quantile_of_the_largest_of_many():
    values = np.random.default_rng(3).exponential(size=20_000)
    tail = fit(values)
    truth = np.random.default_rng(4).exponential(size=(2000, 1000)).max(axis=1)
    for probability in (0.05, 0.5, 0.95):
        found = tail.largest(1000, probability)
        assert found.lower < np.quantile(truth, probability) < found.upper
        assert found.estimate == pytest.approx(np.quantile(truth, probability), rel=0.08)
    assert tail.level(1e-3).estimate == pytest.approx(expon.isf(1e-3), rel=0.05)


def test_level_and_probability_are_inverse_and_join_the_count_at_the_threshold():
    values = np.random.default_rng(6).gumbel(500.0, 40.0, 3000)
    tail = fit(values, share=0.1)
    assert tail.n_above == 300
    assert tail.share == 0.1
    assert tail.probability(tail.threshold).estimate == pytest.approx(np.mean(values > tail.threshold))
    assert tail.probability(tail.level(1e-4).estimate).estimate == pytest.approx(1e-4)
    assert tail.shape.lower < tail.shape.estimate < tail.shape.upper


@pytest.mark.slow
def test_goodness_is_uniform_for_a_true_tail_and_finds_a_false_one():
    rng = np.random.default_rng(7)
    good = [fit(rng.exponential(size=600)).p for _ in range(100)]
    assert np.mean(np.array(good) < 0.2) == pytest.approx(0.2, abs=3.0 * np.sqrt(0.2 * 0.8 / 100))
    mixed = np.concatenate([rng.exponential(size=1800), rng.normal(12.0, 0.2, 120)])
    assert fit(mixed, share=0.2).p < 0.01


@pytest.mark.parametrize(("n", "above"), [(600, 60), (10_000, 300)])
def test_more_joints_have_a_smaller_share_in_the_tail(n, above):
    assert fit(np.random.default_rng(8).normal(size=n)).n_above == above


@pytest.mark.slow
def test_the_shape_at_several_thresholds_tells_where_the_tail_begins():
    values = np.concatenate(
        [-(norm.rvs(size=3000, random_state=1) ** 2), genpareto.rvs(0.1, size=1000, random_state=1)]
    )
    tails = [fit(values, share=share) for share in (0.5, 0.2, 0.05)]
    assert np.all(np.diff([t.threshold for t in tails]) > 0)
    assert tails[0].p < 0.05 < tails[1].p
    assert tails[1].shape.lower < 0.1 < tails[1].shape.upper


def test_a_thin_tail_is_refused_with_the_joints_needed():
    values, status = np.random.default_rng(1).normal(size=500), np.full(500, Status.OK)
    with pytest.raises(extreme.TooThinError, match="49 joints above the threshold, 50") as refusal:
        fit(values[:499], status[:499])
    assert refusal.value.needed == 500
    assert fit(values, status).n_above == 50
    status[100:] = Status.NEWTON_FAILED
    with pytest.raises(extreme.TooThinError) as refusal:
        fit(values, status)
    assert refusal.value.needed == 2500
    with pytest.raises(extreme.TooThinError):
        fit(np.round(values))


def test_unresolved_joints_bound_a_return_load_and_alone_decide_a_rarer_one():
    values, status = np.random.default_rng(2).exponential(size=2000), np.full(2000, Status.OK)
    complete = fit(values, status)
    assert complete.bounds(1e-3) == (complete.level(1e-3).estimate,) * 2
    status[::400] = Status.NOT_SETTLED
    tail = fit(values, status)
    low, high = tail.bounds(0.01)
    assert low < tail.level(0.01).estimate < high < np.inf
    assert tail.bounds(1e-3)[1] == np.inf


def test_what_is_not_in_the_tail_is_refused_and_dependent_samples_have_no_interval():
    tail = fit(np.random.default_rng(2).exponential(size=2000), iid=False)
    with pytest.raises(ValueError, match="quantile"):
        tail.level(0.2)
    with pytest.raises(ValueError, match="threshold"):
        tail.probability(0.1)
    with pytest.raises(ValueError, match="quantile"):
        tail.largest(3)
    found = tail.level(1e-3)
    assert np.isfinite(found.estimate)
    assert np.isnan([found.lower, found.upper, tail.shape.lower]).all()
