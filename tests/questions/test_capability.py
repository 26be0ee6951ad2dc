"""Capability: exact intervals of normal loads, indices of quantiles for others, coverage, unresolved joints."""

from statistics import fmean, stdev

import numpy as np
import pytest
from scipy.special import nctdtr
from scipy.stats import lognorm, norm, normaltest, t

from tests.support.views import view
from tolstat.analysis import binomial, capability
from tolstat.analysis.design import Listed
from tolstat.analysis.sample import Sample
from tolstat.common.loads import ANY_LIMIT
from tolstat.common.tables import Status
from tolstat.display.answer import Sentence
from tolstat.questions import capability as question
from tolstat.questions.exceedance.answer import limits

SEEDS = 2000
LIMIT = 3.0
TRUE_CPK = 1.0
"""Of a standard normal load."""


def limits_of(made):
    return question.capability(made).frame("limits")


def notes_of(made):
    return " ".join(part.text for part in question.capability(made).parts if isinstance(part, Sentence))


def capability_of(values, status, limit, iid=True):
    return capability.of_sample(Sample.of(values, status, None if iid else Listed()), limit)


def within(lower, upper, truth):
    return float(np.mean((lower <= truth) & (truth <= upper)))


def slack(seeds):
    return 3.0 * np.sqrt(0.95 * 0.05 / seeds)


def indices(n):
    loads = np.random.default_rng(51).standard_normal((SEEDS, n))
    return (LIMIT - loads.mean(axis=1)) / (3.0 * loads.std(axis=1, ddof=1))


@pytest.mark.parametrize("n", [8, 60])
def test_interval_of_a_normal_load_covers_and_one_that_forgets_sigma_does_not(n):
    cpk = indices(n)
    assert abs(within(*capability.cpk_interval(cpk, n), TRUE_CPK) - 0.95) < slack(SEEDS)
    half = norm.ppf(0.975) / (3.0 * np.sqrt(n))  # as though sigma were known
    assert within(cpk - half, cpk + half, TRUE_CPK) < 0.95 - slack(SEEDS)


@pytest.mark.parametrize(("cpk", "n"), [(-0.4, 5), (0.0, 30), (1.33, 30), (1.1, 100_000)])
def test_ends_are_where_the_estimate_is_at_the_edge_of_its_distribution(cpk, n):
    scale = 3.0 * np.sqrt(n)
    lower, upper = capability.cpk_interval(cpk, n, 0.9)
    assert lower < cpk < upper
    assert nctdtr(n - 1, scale * lower, scale * cpk) == pytest.approx(0.95, abs=1e-3)
    assert nctdtr(n - 1, scale * upper, scale * cpk) == pytest.approx(0.05, abs=1e-3)


def test_index_of_few_joints_has_the_standard_deviation_with_divisor_n_less_1():
    loads = [640.0, 655.0, 648.0, 671.0]
    found = capability_of(loads, np.ones(4), 700.0)
    assert found.cpk_normal.estimate == pytest.approx((700.0 - fmean(loads)) / (3.0 * stdev(loads)), rel=1e-12)


@pytest.mark.slow
def test_interval_of_quantiles_covers_for_a_skew_load():
    load, n, seeds = lognorm(0.5), 6000, 500
    limit = float(load.ppf(0.9999))
    truth = (limit - load.ppf(0.5)) / (load.ppf(capability.REFERENCE) - load.ppf(0.5))
    samples = np.random.default_rng(6).lognormal(0.0, 0.5, (seeds, n))
    found = [capability_of(row, np.ones(n), limit) for row in samples]
    lower, upper = (np.array([getattr(c.cpk, end) for c in found]) for end in ("lower", "upper"))
    assert within(lower, upper, truth) >= 0.95 - slack(seeds)
    assert np.all(lower > 0)
    normal = (np.array([getattr(c.cpk_normal, end) for c in found]) for end in ("lower", "upper"))
    assert within(*normal, truth) < 0.95 - slack(seeds)
    assert max(c.normal_p for c in found) < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("load", [lognorm(0.25), t(6)])
def test_interval_of_mean_and_deviation_covers_for_loads_that_are_not_normal(load):
    n, limit, seeds = 1000, float(load.ppf(0.999)), 200
    truth, missed = (limit - load.mean()) / (3.0 * load.std()), {"own": [0, 0], "of a normal load": [0, 0]}
    for values in load.rvs((seeds, n), random_state=np.random.default_rng(9)):
        found = capability_of(values, np.ones(n), limit)
        plain = capability.cpk_interval((limit - values.mean()) / (3.0 * values.std(ddof=1)), n)
        for name, (low, high) in (
            ("own", (found.cpk_normal.lower, found.cpk_normal.upper)),
            ("of a normal load", plain),
        ):
            missed[name][0] += low > truth
            missed[name][1] += high < truth
    assert max(missed["own"]) <= seeds * (0.025 + 2.5 * np.sqrt(0.025 * 0.975 / seeds))
    assert max(missed["of a normal load"]) > 0.04 * seeds


def test_no_index_of_a_long_tail_and_no_interval_of_few_joints():
    rng = np.random.default_rng(10)
    long, few = (capability_of(own, np.ones(own.size), 4.0) for own in (rng.lognormal(size=2000), rng.random(900)))
    assert np.isnan([long.cpk_normal.estimate, long.cpk_normal.lower]).all()
    assert np.isfinite(few.cpk_normal.estimate)
    assert np.isnan([few.cpk_normal.lower, few.cpk_normal.upper]).all()


def test_both_indices_agree_for_a_normal_load():
    loads = np.random.default_rng(3).normal(500.0, 20.0, 200_000)
    found = capability_of(loads, np.ones(loads.size), 580.0)
    assert found.cpk_normal.estimate == pytest.approx(80 / 60, rel=5e-3)
    assert found.cpk.estimate == pytest.approx(80 / 60, rel=2e-2)
    assert found.normal_p > 0.01


def test_too_few_joints_have_no_lower_end_and_are_told_the_number_needed():
    loads = np.random.default_rng(4).gamma(3.0, 1.0, 5000)
    few, enough = (capability_of(loads[:n], np.ones(n), 20.0) for n in (3000, 4000))
    assert few.cpk.lower == 0.0
    assert 0.0 < enough.cpk.lower < enough.cpk.estimate < enough.cpk.upper
    assert few.needed == 3244  # 1 - 0.99865^n >= 1 - 0.05 / 4


def test_an_index_of_a_handful_of_joints_has_no_interval_and_a_note():
    loads = np.random.default_rng(1).normal(size=10)
    cpk = capability_of(loads, np.ones(10), 2.0).cpk
    assert np.isfinite(cpk.estimate)
    assert np.isnan([cpk.lower, cpk.upper]).all()


@pytest.mark.parametrize(("n", "interval"), [(8, "-"), (65, "below "), (1001, "0.00 .. ")])
def test_an_index_that_few_joints_do_not_tell_is_not_printed(n, interval):
    made = view(limits={"cross1.F": 700.0}, n=n)
    row = limits_of(made).iloc[0].to_dict()
    assert np.isnan([row["cpk"], row["cpk_normal"]]).all() == (n < 1000)
    column = next(column for column in question.LIMITS if column.head == "interval of Cpk")
    assert column.cell(row).startswith(interval)
    words = "Cpk needs 1000 valid joints, its lower end 3244; fewer tell at most its upper end"
    assert (words in notes_of(made)) == (n < 1000)


def test_unresolved_joints_lower_the_yield():
    loads, status = np.arange(100.0), np.full(100, Status.OK)
    status[:4] = Status.NOT_SETTLED
    found = capability_of(loads, status, 89.5)
    assert found.above.estimate == pytest.approx(10 / 96)
    assert found.above.outer_upper == binomial.clopper_pearson(14, 100)[1]
    assert found.above.outer_lower == pytest.approx(binomial.clopper_pearson(10, 100)[0])


def test_dependent_samples_have_no_interval():
    found = capability_of(np.arange(50.0), np.ones(50), 60.0, iid=False)
    assert np.isfinite([found.cpk.estimate, found.cpk_normal.estimate]).all()
    many = capability_of(np.arange(2000.0), np.ones(2000), 2100.0, iid=False)
    assert (np.isfinite(many.cpk_normal.estimate), np.isnan(many.cpk_normal.lower)) == (True, True)
    above = found.above.outer_lower, found.above.outer_upper
    ends = (*above, found.cpk.lower, found.cpk.upper, found.cpk_normal.lower, found.cpk_normal.upper)
    assert np.isnan(ends).all()


@pytest.mark.parametrize("loads", [[], [3.0], [3.0, 3.0, 3.0]])
def test_joints_without_scatter_have_no_index(loads):
    found = capability_of(loads, np.ones(len(loads)), 4.0)
    assert np.isnan([found.cpk.estimate, found.cpk_normal.estimate, found.cpk.lower]).all()


def test_limit_below_the_median_is_a_negative_index():
    found = capability_of(np.random.default_rng(1).normal(size=6000), np.ones(6000), -1.0)
    assert found.cpk.lower < found.cpk.estimate < found.cpk.upper < 0
    assert found.cpk.estimate == pytest.approx(-1 / 3, abs=0.05)


def test_a_joint_is_good_when_no_load_is_above_its_limit():
    made = view(limits={"cross1.F": 700.0, "fork3.T": 26.0}, failed=7, unsettled=5)
    together = limits_of(made).iloc[-1]
    above = (made.load("cross1.F").values > 700.0) | (made.load("fork3.T").values > 26.0)
    assert together["load"] == ANY_LIMIT
    assert 0 < above[:188].sum() < 188
    assert (together["count"], together["n"], together["n_failed"]) == (above[:188].sum(), 200, 7)
    assert together["good"] == pytest.approx(1.0 - above[:188].mean())


def test_yields_have_the_total_interval_of_the_limits_table_with_the_numerical_error():
    made = view(limits={"cross1.F": 700.0, "fork3.T": 26.0}, failed=2)
    made.numerical_error = {"F": 0.02, "T": 0.01}
    table, of_limits = limits_of(made), limits(made).frame("limits")
    np.testing.assert_allclose(1.0 - table["good_lower"][:2], of_limits["total_upper"])
    np.testing.assert_allclose(table["ppm_lower"][:2], 1e6 * of_limits["total_lower"])
    made = view(limits={"cross1.F": 700.0, "fork3.T": 26.0}, failed=2)
    made.numerical_error = {}
    assert (table["good_lower"] <= limits_of(made)["good_lower"]).all()
    assert table["good_lower"].iloc[-1] < limits_of(made)["good_lower"].iloc[-1]


def test_indices_that_must_not_be_used_are_not_given():
    made = view(limits={"cross1.F": 700.0}, n=2001)
    table = limits_of(made)
    assert (table["normal_p"] < question.NOT_NORMAL).all()
    assert "'Cpk by sigma' tells no share above" in notes_of(made)
    assert table["cpk"].notna().all()
    made = view(limits={"cross1.F": 700.0}, failed=60)
    assert limits_of(made)[["cpk", "cpk_lower", "cpk_normal"]].isna().all(axis=None)
    assert "as uncertain as sampling" in notes_of(made)


@pytest.mark.parametrize("n", [20, 61, 3000])
def test_normality_is_tested_as_by_scipy(n):
    rng = np.random.default_rng(n)
    for load in (rng.normal(size=n), rng.exponential(size=n), 700.0 + rng.uniform(size=n)):
        found = capability_of(load, [Status.OK] * n, 800.0).normal_p
        assert found == pytest.approx(normaltest(load).pvalue, rel=1e-10)
