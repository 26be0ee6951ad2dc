"""Replicates of Sobol' points: Student's t covers, the normal distribution does not."""

import numpy as np
import pytest
from scipy.stats import norm, qmc

from tolstat.analysis import exceedance, replicates

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
    found = replicates.interval(shares.T)
    assert np.mean((found.lower <= truth) & (found.upper >= truth)) == pytest.approx(0.95, abs=slack)
    half = 1.96 * shares.std(axis=1, ddof=1) / np.sqrt(REPLICATES)
    assert np.mean(np.abs(shares.mean(axis=1) - truth) <= half) < 0.95 - slack


def test_shares_stay_between_none_and_all():
    found = replicates.interval([[0.0, 0.2], [0.02, 0.21], [0.0, 0.19]], least=0.0, most=1.0)
    assert found.lower[0] == 0.0
    assert found.n == 3
    assert found.estimate == pytest.approx([0.02 / 3, 0.2])
    # t(0.975, 2) = 4.3027; the standard deviation is 0.01
    assert found.upper[1] == pytest.approx(0.2 + 4.3027 * 0.01 / np.sqrt(3), abs=1e-6)


def test_replicates_of_no_event_are_no_fault():
    assert float(replicates.interval([0.0, 0.0, 0.0], least=0.0, most=1.0).upper) == 0.0


def test_estimates_of_any_kind():
    status = np.ones(50)
    shares = [exceedance.exceedance(np.random.default_rng(s).normal(size=50), status, 1.0).estimate for s in range(5)]
    found = replicates.interval(shares)
    assert found.lower < np.mean(shares) < found.upper


@pytest.mark.parametrize("estimates", [[0.1], [[1.0, 2.0]], [[1.0, 2.0], [1.0, 2.0]]])
def test_too_few_and_equal_replicates_are_refused(estimates):
    with pytest.raises(ValueError, match=r"sampling\.seed"):
        replicates.interval(estimates)
