"""Interval of a mean between 0 and 1: coverage over seeds on skewed laws, beside an estimator that fails there."""

from __future__ import annotations

import numpy as np
import pytest

from tolstat.analysis.binomial import clopper_pearson, mean_interval

SEEDS = 150
LAWS = {
    # mean, and a sample of n values
    "rare failures": (0.01, lambda rng, n: (rng.random(n) < 0.01).astype(float)),
    "long tail": (0.05 / 2.05, lambda rng, n: rng.beta(0.05, 2.0, n)),
    "uniform": (0.5, lambda rng, n: rng.random(n)),
}


def normal(values, confidence=0.95):
    """The wrong estimator: the central limit theorem, on a few hundred values of a skewed law."""
    half = 1.96 * values.std(ddof=1) / np.sqrt(values.size)
    return values.mean() - half, values.mean() + half


def misses(estimator, law, n=150):
    """Numbers of intervals below and above the mean."""
    mean, draw = LAWS[law]
    ends = np.array([estimator(draw(np.random.default_rng(seed), n)) for seed in range(SEEDS)])
    return int((ends[:, 1] < mean).sum()), int((ends[:, 0] > mean).sum())


@pytest.mark.parametrize("law", list(LAWS))
def test_neither_end_misses_more_often_than_it_may(law):
    assert max(misses(mean_interval, law)) <= 0.025 * SEEDS + 3 * np.sqrt(0.025 * SEEDS)


def test_the_same_bench_finds_a_wrong_estimator():
    assert max(misses(normal, "long tail")) > 0.025 * SEEDS + 3 * np.sqrt(0.025 * SEEDS)


def test_the_interval_is_not_much_wider_than_it_must_be():
    assert mean_interval(np.zeros(1024))[1] < 1.5 * clopper_pearson(0, 1024)[1]
    assert mean_interval(np.ones(1024))[0] > 1.0 - 1.5 * clopper_pearson(0, 1024)[1]
    sample = np.random.default_rng(1).random(2000)
    lower, upper = mean_interval(sample)
    assert upper - lower < 1.6 * np.subtract(*normal(sample)[::-1])
    assert lower < sample.mean() < upper
    assert mean_interval([]) == (0.0, 1.0)
