"""Intervals of shares, quantiles and further joints: scipy's, from other algorithms than ours."""

import numpy as np
import pytest
from scipy import stats

from tests.support import exceedance
from tolstat.analysis import prediction
from tolstat.analysis.binomial import clopper_pearson
from tolstat.common.tables import Status

CONFIDENCES = (0.5, 0.8, 0.95, 0.999)
ROOT = 2e-12
"""Tolerance of the root finder that scipy's exact interval is from."""


@pytest.mark.parametrize("n", [1, 7, 100, 1024, 20_000])
def test_exact_interval_of_a_share(n):
    """Agrees to the tolerance of scipy's root finder (found: 5e-13); ours inverts the beta distribution directly.

    So the relative error of scipy's ends is larger for rare events: 6e-7 for one joint of 20 000.
    """
    for count in sorted({0, 1, n // 100, n // 10, n // 2, n - 1, n}):
        for confidence in CONFIDENCES:
            theirs = stats.binomtest(count, n).proportion_ci(confidence, "exact")
            np.testing.assert_allclose(clopper_pearson(count, n, confidence), theirs, rtol=0, atol=ROOT)


def test_exceedance_of_joints_of_which_some_have_no_load():
    """The interval is scipy's for the valid joints, the outer ends are scipy's for all joints: to 2e-12."""
    load = np.random.default_rng(1).normal(size=300)
    status = np.full(300, Status.OK)
    status[:20], load[:20] = Status.NEWTON_FAILED, np.nan
    found = exceedance.exceedance(load, status, 1.0)
    count = int((load > 1.0).sum())
    theirs = stats.binomtest(count, 280).proportion_ci(method="exact")
    np.testing.assert_allclose([found.lower, found.upper], theirs, rtol=0, atol=ROOT)
    ends = (
        stats.binomtest(count, 300).proportion_ci(method="exact").low,
        stats.binomtest(count + 20, 300).proportion_ci(method="exact").high,
    )
    np.testing.assert_allclose([found.outer_lower, found.outer_upper], ends, rtol=0, atol=ROOT)


@pytest.mark.parametrize("decimals", [16, 1])
@pytest.mark.parametrize("n", [5, 20, 59, 100, 1000, 1024])
def test_interval_of_a_quantile(n, decimals):
    """The same order statistics, ties or not; scipy has NaN where we have an infinite end."""
    load = np.round(np.random.default_rng(n).lognormal(size=n), decimals)
    for share in (0.01, 0.05, 0.5, 0.9, 0.95, 0.99):
        for confidence in CONFIDENCES:
            theirs = stats.quantile_test(load, p=share).confidence_interval(confidence)
            found = exceedance.quantile(load, np.full(n, Status.OK), share, confidence)
            assert found.lower == (-np.inf if np.isnan(theirs.low) else theirs.low)
            assert found.upper == (np.inf if np.isnan(theirs.high) else theirs.high)


@pytest.mark.parametrize("n", [10, 100, 1024])
def test_prediction_of_a_number_of_further_joints(n):
    """The same whole numbers as the quantiles of scipy's beta-binomial distribution."""
    for count in sorted({0, 1, n // 10, n // 2, n}):
        for further in (1, 20, 200, 1000):
            for confidence in (0.8, 0.95, 0.99):
                tail = 0.5 * (1.0 - confidence)
                lower = stats.betabinom.ppf(tail, further, count, n - count + 1) if count else 0.0
                upper = stats.betabinom.ppf(1.0 - tail, further, count + 1, n - count) if count < n else further
                assert prediction.of_counts(count, count, n, further, confidence) == (lower, upper)
