"""Exceedance shares and quantiles: exact intervals, coverage, unresolved joints on both sides."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binom, binomtest, norm

from tests.support import exceedance
from tolstat.analysis import binomial
from tolstat.analysis.sample import Sample
from tolstat.common.tables import Status

N_SEEDS = 1500
N_JOINTS = 120
TRUE_SHARE = 0.02
LEVEL = float(norm.isf(TRUE_SHARE))


def samples():
    """Draw loads of `N_SEEDS` campaigns of `N_JOINTS` joints, standard normal."""
    return np.random.default_rng(20210304).standard_normal((N_SEEDS, N_JOINTS))


def clopper_pearson(count, n):
    return binomial.clopper_pearson(count, n, 0.95)


def wald(count, n):
    """Textbook interval that is known to cover too rarely: what the coverage test must catch."""
    share = count / n
    half = norm.ppf(0.975) * np.sqrt(share * (1.0 - share) / n)
    return share - half, share + half


def coverage(interval):
    count = (samples() > LEVEL).sum(axis=1)
    lower, upper = interval(count, N_JOINTS)
    return np.mean((lower <= TRUE_SHARE) & (upper >= TRUE_SHARE))


def test_no_trial_tells_nothing():
    assert [float(end) for end in binomial.clopper_pearson(0, 0)] == [0.0, 1.0]


def test_interval_covers_over_seeds_and_the_wald_interval_does_not():
    three_sigma = 3.0 * np.sqrt(0.95 * 0.05 / N_SEEDS)
    assert coverage(clopper_pearson) >= 0.95 - three_sigma
    assert coverage(wald) < 0.95 - three_sigma


def test_coverage_through_the_public_function():
    covered = 0
    for loads in samples()[:500]:
        share = exceedance.exceedance(loads, np.full(N_JOINTS, Status.OK), LEVEL)
        covered += share.lower <= TRUE_SHARE <= share.upper
    assert covered / 500 >= 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / 500)


def test_simultaneous_band_holds_the_whole_curve_and_the_pointwise_one_does_not():
    rng, n, whole, pointwise = np.random.default_rng(1990), 200, 0, 0
    for _ in range(500):
        u = np.sort(rng.random(n))  # exceedance of a uniform load is 1 - u: largest distance at the steps
        above = 1.0 - np.arange(n) / n
        far = max(np.abs(above - (1.0 - u)).max(), np.abs(above - 1.0 / n - (1.0 - u)).max())
        whole += far <= binomial.simultaneous(n)
        lower, upper = binomial.clopper_pearson(n - 1 - np.arange(n), n)
        pointwise += bool(np.all((lower <= 1.0 - u) & (1.0 - u <= upper)))
    least = 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / 500)
    assert whole / 500 >= least
    assert pointwise / 500 < least
    assert binomial.simultaneous(0) == 1.0


def deciding(share, accepted, n, seeds=20_000):
    """Share of simulated campaigns of n joints whose interval excludes the accepted share."""
    above = np.random.default_rng(2025).binomial(n, share, seeds)
    lower, upper = binomial.clopper_pearson(above, n)
    return np.mean((upper <= accepted) | (lower > accepted))


@pytest.mark.parametrize(
    ("share", "accepted"),
    [(0.05, 0.1), (0.0999, 0.11), (0.005, 0.01), (0.008, 0.01), (0.05, 0.04), (0.12, 0.1), (0.3, 0.1), (0.97, 0.99)],
)
def test_nine_campaigns_of_ten_decide_with_the_joints_that_are_needed(share, accepted):
    n = int(binomial.needed(share, accepted))
    assert 0.88 <= deciding(share, accepted, n) <= 0.93
    assert deciding(share, accepted, int(0.8 * n)) < 0.88
    half = int(binomial.needed(share, accepted, power=0.5))
    assert 0.48 <= deciding(share, accepted, half) <= 0.6


def test_where_no_joint_or_each_is_above_one_campaign_tells():
    for share, accepted in ((0.0, 0.001), (1.0, 0.5)):
        n = binomial.needed(share, accepted)
        ends = [binomial.clopper_pearson(share * number, number) for number in (n - 1, n)]
        assert [bool(upper <= accepted or lower > accepted) for lower, upper in ends] == [False, True]
    assert binomial.needed(0.1, 0.1) == np.inf


@pytest.mark.parametrize(("count", "n"), [(0, 61), (2, 14), (38, 395)])
def test_unresolved_joints_matter_from_half_the_interval_of_the_valid_ones_on(count, n):
    for unresolved in range(n - count):
        ends = binomtest(count, n - unresolved).proportion_ci(0.95, "exact")
        matter = unresolved > 0 and unresolved / n >= 0.5 * (ends.high - ends.low)
        assert binomial.unresolved_matter(count, n, unresolved) == matter


def test_hand_counted_case():
    values = [1.0, 2.0, 3.0, 4.0, np.nan, 9.0, 9.0]
    status = [1, 1, 1, 1, Status.NEWTON_FAILED, Status.NOT_SETTLED, Status.PENDING]
    share = exceedance.exceedance(values, status, 2.0)
    assert (share.n, share.n_failed, share.n_unsettled, share.count) == (6, 1, 1, 2)
    assert share.estimate == 0.5
    assert (share.bound_lower, share.bound_upper) == (2 / 6, 4 / 6)
    assert share.lower == pytest.approx(binomtest(2, 4).proportion_ci(0.95, "exact").low)
    assert share.outer_lower == pytest.approx(binomtest(2, 6).proportion_ci(0.95, "exact").low)
    assert share.outer_upper == pytest.approx(binomtest(4, 6).proportion_ci(0.95, "exact").high)


def test_a_load_equal_to_the_level_does_not_exceed_it():
    assert exceedance.exceedance([1.0, 1.0, 2.0], [1, 1, 1], 1.0).count == 1


def test_every_unresolved_joint_widens_the_bounds():
    rng = np.random.default_rng(5)
    values, status = rng.normal(size=200), np.full(200, Status.OK)
    complete = exceedance.exceedance(values, status, 1.0)
    for bad in (Status.NOT_SETTLED, Status.NEWTON_FAILED, Status.NOT_FINITE, Status.OUTSIDE_MODEL):
        status[: 10 * bad] = bad
        partial = exceedance.exceedance(values, status, 1.0)
        assert partial.n == 200
        assert partial.n_failed + partial.n_unsettled == 10 * bad
        assert partial.bound_lower <= complete.estimate <= partial.bound_upper
        assert partial.outer_lower <= partial.bound_lower < partial.bound_upper <= partial.outer_upper


def test_value_that_is_not_finite_counts_as_failed_even_when_marked_ok():
    assert exceedance.exceedance([np.nan, 1.0], [Status.OK, Status.OK], 0.0).n_failed == 1


def test_dependent_samples_get_no_interval_but_keep_the_bounds():
    share = exceedance.exceedance([1.0, 2.0, 3.0], [1, 1, Status.NOT_FINITE], 1.5, iid=False)
    assert np.isnan([share.lower, share.upper, share.outer_lower, share.outer_upper]).all()
    assert (share.estimate, share.bound_lower, share.bound_upper) == (0.5, 1 / 3, 2 / 3)


def test_no_joint_at_all():
    share = exceedance.exceedance([], [], 1.0)
    assert np.isnan(share.estimate)
    assert (share.lower, share.upper, share.bound_lower, share.bound_upper) == (0.0, 1.0, 0.0, 1.0)
    assert Sample.of([np.nan], [Status.PENDING]).curve().size == 0


@given(
    st.lists(st.tuples(st.integers(-5, 5), st.integers(0, 5)), min_size=1, max_size=40),
    st.integers(-6, 6),
)
@settings(max_examples=60, deadline=None)
def test_curve_agrees_with_counting_and_falls(rows, level):
    values, status = (np.array(column) for column in zip(*rows, strict=True))
    table = Sample.of(values, status).curve()
    assert list(table["level"]) == sorted(set(values[status == Status.OK]))
    assert np.all(np.diff(table["count"]) < 0)
    share = exceedance.exceedance(values, status, level)
    assert share.count == sum(v > level and s == Status.OK for v, s in rows)
    assert share.bound_lower <= share.bound_upper
    assert share.outer_lower <= share.bound_lower
    assert share.bound_upper <= share.outer_upper
    if share.n > share.n_failed + share.n_unsettled:
        assert share.bound_lower <= share.estimate <= share.bound_upper
        assert table["count"][-1] == 0


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: exceedance.exceedance([1.0], [1, 1], 0.0), "one length"),
        (lambda: exceedance.exceedance([1.0], [1], float("nan")), "NaN"),
        (lambda: exceedance.exceedance([1.0], [1], 0.0, confidence=1.0), "confidence"),
        (lambda: binomial.clopper_pearson(3, 2), "between 0 and n"),
        (lambda: exceedance.quantile([1.0], [1], 1.0), "share"),
    ],
)
def test_misuse_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize(("share", "confidence", "n"), [(0.95, 0.9, 59), (0.99, 0.9, 299)])
def test_quantile_upper_end_needs_the_number_of_joints_wilks_gives(share, confidence, n):
    """A two-sided 90 % interval has the one-sided 95 % upper end of Wilks' first-order formula."""
    enough = exceedance.quantile(np.arange(n), np.ones(n), share, confidence)
    too_few = exceedance.quantile(np.arange(n - 1), np.ones(n - 1), share, confidence)
    assert enough.upper == n - 1
    assert too_few.upper == np.inf


@given(st.integers(1, 3000), st.floats(1e-4, 1 - 1e-4), st.sampled_from([0.5, 0.9, 0.95, 0.999]))
@settings(max_examples=200, deadline=None)
def test_ranks_of_the_interval_are_the_outermost_that_scipys_binomial_allows(n, share, confidence):
    at_most = binom.cdf(np.arange(-1, n + 1), n, share)  # P(B <= k), k = -1 .. n
    found = exceedance.quantile(np.arange(n), np.ones(n), share, confidence)
    low, high = (0 if found.lower < 0 else int(found.lower) + 1, n + 1 if found.upper > n else int(found.upper) + 1)
    tail = 0.5 * (1 - confidence)
    assert at_most[low] <= tail * (1 + 1e-9)  # P(B < low)
    assert at_most[low + 1] > tail * (1 - 1e-9)
    assert high == n + 1 or at_most[high] >= (1 - tail) * (1 - 1e-9)
    assert at_most[high - 1] < (1 - tail) * (1 + 1e-9)


@pytest.mark.parametrize("share", [0.5, 0.9])
def test_quantile_interval_covers_over_seeds(share):
    truth, covered = norm.ppf(share), 0
    for loads in samples()[:600]:
        q = exceedance.quantile(loads, np.ones(N_JOINTS), share)
        covered += q.lower <= truth <= q.upper
    assert covered / 600 >= 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / 600)


def test_quantile_is_numpys_inverted_cdf_and_unresolved_joints_bound_it():
    loads = np.random.default_rng(3).normal(size=100)
    status = np.ones(100)
    assert exceedance.quantile(loads, status, 0.9).estimate == np.quantile(loads, 0.9, method="inverted_cdf")
    status[:5] = Status.NEWTON_FAILED
    q = exceedance.quantile(loads, status, 0.9)
    low, high = loads.copy(), loads.copy()
    low[:5], high[:5] = -np.inf, np.inf
    assert q.bound_lower == np.quantile(low, 0.9, method="inverted_cdf")
    assert q.bound_upper == np.quantile(high, 0.9, method="inverted_cdf")
    assert exceedance.quantile(loads, status, 0.96).bound_upper == np.inf
    assert np.isnan(exceedance.quantile(loads, status, 0.9, iid=False).lower)


def test_analysis_needs_no_file_and_no_figure():
    import subprocess
    import sys

    code = (
        "import sys, tolstat.analysis.sample, tolstat.analysis.clustered;"
        "print(sorted({'h5py', 'matplotlib', 'pandas', 'scipy.stats', 'tolstat.store'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
