"""Intervals over lots, and the prediction for the next delivery."""

from functools import partial

import numpy as np
import pytest
from scipy.stats import beta, betabinom, norm
from scipy.stats import t as student

from tolstat.analysis import clustered, prediction
from tolstat.analysis.binomial import clopper_pearson
from tolstat.analysis.clustered import Clustered
from tolstat.analysis.sample import Sample
from tolstat.common.tables import Status

RNG = np.random.default_rng(5)


def of_beta(share, correlation, number, joints, rng=RNG):
    size = (1.0 - correlation) / correlation
    return rng.binomial(joints, rng.beta(share * size, (1.0 - share) * size, number))


def test_interval_is_students_t_on_the_logit_of_the_mean():
    above = np.tile([0, 2, 5], 12)
    found = clustered.interval(above, np.full(36, 20))
    shares = above / 20
    p, error = shares.mean(), shares.std(ddof=1) / 6.0
    half = student.ppf(0.975, 35) * error / (p * (1 - p))
    for end, sign in ((found.lower, -1), (found.upper, 1)):
        assert np.log(end / (1 - end)) == pytest.approx(np.log(p / (1 - p)) + sign * half, rel=1e-12)


def test_fewer_than_thirty_lots_have_no_interval_and_lots_without_a_bad_joint_have_an_upper_end():
    assert np.isnan(clustered.interval([1] * 29, [20] * 29).upper)
    found = clustered.interval([0] * 50, [20] * 50)
    assert (found.lower, found.upper) == (0.0, pytest.approx(1.0 - 0.025 ** (1 / 50)))
    found = clustered.interval([20] * 50, [20] * 50)
    assert (found.lower, found.upper) == (pytest.approx(0.025 ** (1 / 50)), 1.0)


def test_no_joint_above_has_no_wider_interval_than_some():
    above = np.zeros((40, 6))
    for number, lots in enumerate((1, 2, 5, 10, 40), start=1):
        above[:lots, number] = 1
    found = clustered.interval(np.hstack([above, 20 - above]), np.full(40, 20))
    upper, lower = found.upper[:6], found.lower[6:]
    assert upper[0] == pytest.approx(1.0 - 0.025 ** (1 / 40))
    assert (upper >= upper[0]).all()
    assert lower == pytest.approx(1.0 - upper)


def test_interval_covers_where_lots_are_nearly_all_good_or_all_bad():
    rng = np.random.default_rng(8)
    above = np.stack([of_beta(0.04, 0.8, 40, 20, rng) for _ in range(400)], axis=1)
    # 0.06 if lots without a bad joint had the end of the beta law
    assert np.mean(clustered.interval(above, np.full(40, 20)).upper < 0.04) < 0.02


def test_interval_covers_where_few_lots_have_the_bad_joints():
    rng = np.random.default_rng(7)
    above = np.stack([of_beta(0.02, 0.2, 50, 20, rng) for _ in range(800)], axis=1)
    found = clustered.interval(above, np.full(50, 20))
    assert np.mean(found.upper < 0.02) < 0.01  # with Student's t alone 0.06 to 0.08
    assert np.mean(found.lower > 0.02) < 0.035
    assert np.median(found.upper - found.lower) < 0.08  # and yet it says something
    one = clustered.interval(above[:, 3], [20] * 50)
    assert (one.lower, one.upper) == pytest.approx((found.lower[3], found.upper[3]), rel=0.05)


def test_correlation_is_one_for_lots_of_one_kind_and_zero_where_lots_are_alike():
    assert clustered.interval([0, 20] * 20, [20] * 40).correlation == 1.0
    assert abs(clustered.interval(RNG.binomial(20, 0.3, 4000), [20] * 4000).correlation) < 0.01
    sizes = RNG.integers(5, 30, 8000)
    found = clustered.interval(RNG.binomial(sizes, RNG.beta(1.0, 3.0, 8000)), sizes)
    assert found.correlation == pytest.approx(0.2, abs=0.02)  # 1 / (a + b + 1)


def test_interval_covers_where_that_of_independent_joints_does_not():
    seeds, share = 2000, 0.1
    above = np.array([of_beta(share, 0.2, 50, 20) for _ in range(seeds)]).T
    found = clustered.interval(above, np.full(50, 20))
    covered = np.mean((found.lower <= share) & (share <= found.upper))
    assert 0.925 < covered < 0.975
    low, high = clopper_pearson(above.sum(axis=0), 1000)
    assert np.mean((low <= share) & (share <= high)) < 0.8


def test_curve_counts_joints_without_a_load_both_ways_and_parts_of_lots():
    loads = np.sqrt(0.3) * RNG.standard_normal((40, 1)) + np.sqrt(0.7) * RNG.standard_normal((40, 20))
    lot, values = np.repeat(np.arange(40), 20)[7:], loads.ravel()[7:]  # a slice cuts the first lot
    status = np.full(values.size, int(Status.OK))
    status[:30] = Status.NEWTON_FAILED
    load = Sample.of(values, status, Clustered(lot))
    row = load.curve([1.0])[0]
    assert row["estimate"] == np.mean(values[30:] > 1.0)
    assert row["outer_lower"] < row["lower"] < row["estimate"] < row["upper"] < row["outer_upper"]
    n = np.bincount(lot)
    most = np.bincount(lot, (values > 1.0) | (status == Status.NEWTON_FAILED))
    assert row["outer_upper"] == pytest.approx(float(clustered.interval(most, n).upper))


def test_quantile_inverts_the_curve():
    loads = RNG.standard_normal((50, 20))
    load = Sample.of(loads.ravel(), np.ones(1000), Clustered(np.repeat(np.arange(50), 20)))
    found = load.quantile(0.9)
    assert found.lower < found.estimate < found.upper
    ends = load.curve([found.lower, found.upper])
    assert ends["lower"][0] < 0.1 <= load.curve([np.nextafter(found.lower, -9.0)])["lower"][0]
    assert ends["upper"][1] <= 0.1
    assert abs(found.estimate - norm.ppf(0.9)) < 0.2


def test_prediction_of_many_lots_is_the_law_itself():
    predict = partial(clustered.delivery, of_beta(0.2, 0.25, 5000, 20), np.full(5000, 20))
    assert np.abs(predict(60) - betabinom(60, 0.6, 2.4).pmf(np.arange(61))).max() < 0.004
    assert predict(2000)[1001:].sum() == pytest.approx(beta(0.6, 2.4).sf(0.5), abs=0.01)
    assert predict(2000).sum() == pytest.approx(1.0)


def predicted(counts):
    """Prediction interval for 500 joints of a new lot, where lots of 20 joints have these counts above the level."""
    above = (np.arange(20) < np.array(counts)[:, None]).ravel()
    load = Sample.of(above.astype(float), np.ones(above.size), Clustered(np.repeat(np.arange(len(counts)), 20)))
    return load.delivery(0.5, 500)


def test_prediction_of_few_lots_is_wider_and_none_bad_leaves_room():
    few, many = (predicted([0, 2, 4, 1, 0] * times) for times in (6, 200))
    assert few[1] > many[1]
    independent = prediction.of_counts(42, 42, 600, 500)
    assert few[0] <= independent[0] < independent[1] < few[1]
    assert predicted([0] * 50) == (0.0, prediction.of_counts(0, 0, 1000, 500)[1])
    assert np.isnan(predicted([1] * 29)).all()
