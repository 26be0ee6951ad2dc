"""Yield and Ppk: estimates without bias, coverage, too few joints, unresolved joints."""

import numpy as np
import pytest
from scipy.stats import expon, lognorm, norm

from tests.support.views import view
from tolstat.analysis import binomial, capability
from tolstat.analysis.design import Listed
from tolstat.analysis.sample import Sample
from tolstat.common.loads import ANY_LIMIT
from tolstat.common.tables import Status
from tolstat.display.answer import Sentence
from tolstat.questions import capability as question
from tolstat.questions.exceedance.answer import limits


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


def truth_of(load, limit):
    return (limit - load.ppf(0.5)) / (load.ppf(norm.cdf(3.0)) - load.ppf(0.5))


@pytest.mark.parametrize("load", [norm(), lognorm(0.5), expon()], ids=["normal", "lognormal", "exponential"])
def test_an_estimate_lies_as_often_above_the_true_index_as_below(load):
    limit, seeds = float(load.ppf(0.999)), 400
    rng = np.random.default_rng(5)
    for n in (capability.LEAST, 1024):
        found = [capability_of(load.rvs(n, random_state=rng), np.ones(n), limit).ppk.estimate for _ in range(seeds)]
        assert np.median(found) == pytest.approx(truth_of(load, limit), rel=0.03)


@pytest.mark.slow
def test_interval_of_quantiles_covers_for_a_skew_load():
    load, n, seeds = lognorm(0.5), 6000, 500
    limit = float(load.ppf(0.9999))
    truth = truth_of(load, limit)
    samples = np.random.default_rng(6).lognormal(0.0, 0.5, (seeds, n))
    found = [capability_of(row, np.ones(n), limit) for row in samples]
    lower, upper = (np.array([getattr(c.ppk, end) for c in found]) for end in ("lower", "upper"))
    assert within(lower, upper, truth) >= 0.95 - slack(seeds)
    assert np.all(lower > 0)


def test_a_normal_load_has_the_index_of_mean_and_deviation():
    loads = np.random.default_rng(3).normal(500.0, 20.0, 200_000)
    assert capability_of(loads, np.ones(loads.size), 580.0).ppk.estimate == pytest.approx(80 / 60, rel=2e-2)


def test_too_few_joints_have_no_lower_end_and_are_told_the_number_needed():
    loads = np.random.default_rng(4).gamma(3.0, 1.0, 5000)
    few, enough = (capability_of(loads[:n], np.ones(n), 20.0) for n in (3000, 4000))
    assert few.ppk.lower == 0.0
    assert 0.0 < enough.ppk.lower < enough.ppk.estimate < enough.ppk.upper
    assert few.needed == 3244  # 1 - 0.99865^n >= 1 - 0.05 / 4


def test_an_index_of_a_handful_of_joints_has_no_interval_and_a_note():
    loads = np.random.default_rng(1).normal(size=10)
    assert np.isnan(capability_of(loads, np.ones(10), 2.0).ppk).all()


@pytest.mark.parametrize(("n", "interval"), [(3, "-"), (8, "-"), (65, "below "), (741, "below "), (742, "0.00 .. ")])
def test_an_index_that_few_joints_do_not_tell_is_not_printed(n, interval):
    made = view(limits={"cross1.F": 700.0}, n=n)
    row = limits_of(made).iloc[0].to_dict()
    assert np.isnan(row["ppk"]) == (n < 742)  # the nominal joint is one of n
    column = next(column for column in question.LIMITS if column.head == "interval of Ppk")
    assert column.cell(row).startswith(interval)
    words = "Ppk needs 741 valid joints, its lower end 3244; fewer tell at most its upper end"
    assert (words in notes_of(made)) == (n < 742)


def test_unresolved_joints_lower_the_yield():
    loads, status = np.arange(100.0), np.full(100, Status.OK)
    status[:4] = Status.NOT_SETTLED
    found = capability_of(loads, status, 89.5)
    assert found.above.estimate == pytest.approx(10 / 96)
    assert found.above.outer_upper == binomial.clopper_pearson(14, 100)[1]
    assert found.above.outer_lower == pytest.approx(binomial.clopper_pearson(10, 100)[0])


def test_dependent_samples_have_no_interval():
    found = capability_of(np.arange(50.0), np.ones(50), 60.0, iid=False)
    many = capability_of(np.arange(2000.0), np.ones(2000), 2100.0, iid=False)
    assert np.isfinite(many.ppk.estimate)
    ends = (found.above.outer_lower, found.above.outer_upper, many.ppk.lower, many.ppk.upper)
    assert np.isnan(ends).all()


@pytest.mark.parametrize("loads", [[], [3.0], [3.0, 3.0, 3.0]])
def test_joints_without_scatter_have_no_index(loads):
    found = capability_of(loads, np.ones(len(loads)), 4.0)
    assert np.isnan(found.ppk).all()


def test_limit_below_the_median_is_a_negative_index():
    found = capability_of(np.random.default_rng(1).normal(size=6000), np.ones(6000), -1.0)
    assert found.ppk.lower < found.ppk.estimate < found.ppk.upper < 0
    assert found.ppk.estimate == pytest.approx(-1 / 3, abs=0.05)


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
    assert table["ppk"].notna().all()
    assert "It is not Cpk: no process is shown to be under control" in notes_of(made)
    made = view(limits={"cross1.F": 700.0}, failed=60)
    assert limits_of(made)[["ppk", "ppk_lower", "ppk_upper"]].isna().all(axis=None)
    assert "as uncertain as sampling" in notes_of(made)
