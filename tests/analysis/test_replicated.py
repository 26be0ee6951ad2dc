"""Replicates of Sobol' points: Student's t covers, the normal distribution does not."""

import numpy as np
import pytest
from scipy.stats import norm, qmc

from tests.support import exceedance
from tolstat.analysis import binomial, design
from tolstat.analysis.design import Replicated
from tolstat.analysis.sample import Sample

SEEDS, REPLICATES, JOINTS = 600, 4, 64


@pytest.fixture(scope="module")
def shares():
    """Share of 2 z1 + z2 > 2 among scrambled Sobol' points; shape (SEEDS, REPLICATES)."""
    rng = np.random.default_rng(17)
    found = np.empty((SEEDS, REPLICATES))
    for i in np.ndindex(found.shape):
        z = norm.ppf(qmc.Sobol(2, rng=rng).random(JOINTS))
        found[i] = np.mean(2.0 * z[:, 0] + z[:, 1] > 2.0)
    return found


def test_interval_covers_over_seeds_and_a_normal_one_does_not(shares):
    truth, slack = norm.sf(2.0 / np.sqrt(5.0)), 3.0 * np.sqrt(0.95 * 0.05 / SEEDS)
    found = design.over_replicates(shares.T)
    assert np.mean((found.lower <= truth) & (found.upper >= truth)) == pytest.approx(0.95, abs=slack)
    half = 1.96 * shares.std(axis=1, ddof=1) / np.sqrt(REPLICATES)
    assert np.mean(np.abs(shares.mean(axis=1) - truth) <= half) < 0.95 - slack


def test_shares_stay_between_none_and_all():
    found = design.over_replicates([[0.0, 0.2], [0.02, 0.21], [0.0, 0.19]], least=0.0, most=1.0)
    assert found.lower[0] == 0.0
    assert found.estimate == pytest.approx([0.02 / 3, 0.2])
    # t(0.975, 2) = 4.3027; the standard deviation is 0.01
    assert found.upper[1] == pytest.approx(0.2 + 4.3027 * 0.01 / np.sqrt(3), abs=1e-6)


def test_replicates_of_no_event_are_no_fault():
    assert float(design.over_replicates([0.0, 0.0, 0.0], least=0.0, most=1.0).upper) == 0.0


def test_estimates_of_any_kind():
    status = np.ones(50)
    shares = [exceedance.exceedance(np.random.default_rng(s).normal(size=50), status, 1.0).estimate for s in range(5)]
    found = design.over_replicates(shares)
    assert found.lower < np.mean(shares) < found.upper


@pytest.mark.parametrize("estimates", [[0.1], [[1.0, 2.0]], [[1.0, 2.0], [1.0, 2.0]]])
def test_too_few_and_equal_replicates_are_refused(estimates):
    with pytest.raises(ValueError, match=r"sampling\.seed"):
        design.over_replicates(estimates)


def loads_of(seed, joints, number):
    """Load 2 z1 + z2 of scrambled Sobol' points in independent blocks."""
    rng = np.random.default_rng(seed)
    z = [norm.ppf(qmc.Sobol(2, rng=rng).random(joints // number)) for _ in range(number)]
    return np.concatenate([2.0 * part[:, 0] + part[:, 1] for part in z])


def sample_of(values):
    return Sample.of(values, np.ones(len(values)), Replicated(len(values), 8, "sobol"))


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
