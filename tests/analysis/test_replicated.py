"""Replicates of Sobol' points: Student's t covers, the normal distribution does not."""

import numpy as np
import pytest
from scipy.stats import norm, qmc

from tests.support import exceedance
from tolstat.analysis import binomial
from tolstat.analysis.design import Replicated
from tolstat.analysis.sample import Sample

SEEDS, REPLICATES, JOINTS = 600, 4, 64


def loads_of(seed, joints, number):
    """Load 2 z1 + z2 of scrambled Sobol' points in independent blocks."""
    rng = np.random.default_rng(seed)
    z = [norm.ppf(qmc.Sobol(2, rng=rng).random(joints // number)) for _ in range(number)]
    return np.concatenate([2.0 * part[:, 0] + part[:, 1] for part in z])


def sample_of(values, number=8):
    return Sample.of(values, np.ones(len(values)), Replicated(len(values), number, "sobol"))


def test_interval_covers_over_seeds_and_a_normal_one_does_not():
    truth, slack = norm.sf(2.0 / np.sqrt(5.0)), 3.0 * np.sqrt(0.95 * 0.05 / SEEDS)
    covers = np.zeros((SEEDS, 2), dtype=bool)
    for seed in range(SEEDS):
        loads = loads_of(seed, REPLICATES * JOINTS, REPLICATES)
        row, shares = sample_of(loads, REPLICATES).above(2.0), (loads.reshape(REPLICATES, JOINTS) > 2.0).mean(axis=1)
        half = 1.96 * shares.std(ddof=1) / np.sqrt(REPLICATES)
        covers[seed] = row.lower <= truth <= row.upper, abs(shares.mean() - truth) <= half
    assert covers[:, 0].mean() == pytest.approx(0.95, abs=slack)
    assert covers[:, 1].mean() < 0.95 - slack


def test_interval_is_students_over_the_shares():
    row = sample_of([i < above for above in (20, 21, 19) for i in range(100)], 3).above(0.5)
    # t(0.975, 2) = 4.3027; the standard deviation is 0.01
    assert (row.estimate, row.upper) == pytest.approx((0.2, 0.2 + 4.3027 * 0.01 / np.sqrt(3)), abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.2, 0.01])
def test_shares_and_quantiles_of_blocks_cover_over_seeds(share):
    level, found, few = norm.isf(share) * np.sqrt(5.0), [], []
    for seed in range(150):
        load = sample_of(loads_of(seed, 1024, 8))
        row, quantile = load.above(level), load.quantile(1.0 - share)
        found.append([row.lower <= share <= row.upper, quantile.lower <= level <= quantile.upper])
        few.append(exceedance.exceedance(load.values, load.status, level).upper - row.upper)
    assert np.mean(found, axis=0).min() >= 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / 150)
    assert (np.mean(few) > 0) == (share == 0.2)  # narrower than those of independent joints, where joints are many


def test_no_joint_above_in_any_block_does_not_mean_none():
    loads = np.arange(800.0) % 100
    row = sample_of(loads).above(99.0)
    assert (row.estimate, row.lower) == (0.0, 0.0)
    assert row.upper == row.outer_upper == binomial.clopper_pearson(0, 800)[1]
