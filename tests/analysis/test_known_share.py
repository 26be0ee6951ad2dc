"""Tolerances known from measured parts: closed forms against sampling, limits of the intervals, coverage."""

import numpy as np
import pytest
from scipy import stats

from tolstat.analysis import known_share, process, weighted
from tolstat.analysis.estimates import Column
from tolstat.analysis.known_share import Mixture
from tolstat.analysis.process import Draws, Known, Sums

KNOWN = Known(parts=12, errors=4)


def sums(z):
    return Sums(z.sum(axis=1), np.square(z).sum(axis=1))


def test_the_predictive_is_a_multivariate_student_distribution_and_the_mean_over_likely_processes():
    z = 1.5 * np.random.default_rng(1).standard_normal((6, 4))
    student = stats.multivariate_t(np.zeros(4), np.eye(4) + 1 / 12, df=11)
    found = process.log_student(sums(z), KNOWN)
    np.testing.assert_allclose(found, student.logpdf(z) - stats.norm.logpdf(z).sum(axis=1), rtol=1e-12)
    drawn = process.draws((12,))
    each = np.exp(process.log_ratios(sums(z), 4, drawn.mean[:, 0], drawn.deviation[:, 0]))
    np.testing.assert_allclose(each.mean(axis=1), np.exp(found), rtol=0.01)


def test_ratios_are_those_of_normal_densities():
    z = np.random.default_rng(2).standard_normal((5, 4))
    found = process.log_ratios(sums(z), 4, np.array([0.3, -0.1]), np.array([1.2, 0.9]))
    for k, (a, b) in enumerate(((0.3, 1.2), (-0.1, 0.9))):
        np.testing.assert_allclose(found[:, k], (stats.norm.logpdf(z, a, b) - stats.norm.logpdf(z)).sum(axis=1))


@pytest.mark.parametrize("errors", [1, 4])
@pytest.mark.parametrize("over", [None, 12])
def test_mean_squares_are_those_of_many_joints(errors, over):
    a, b, known = np.array([0.2]), np.array([1.1]), Known(12, errors)
    z = sums(a + b * np.random.default_rng(3).standard_normal((200_000, errors)))
    logs = process.log_ratios(z, errors, a, b)[:, 0] - (0.0 if over is None else process.log_student(z, known))
    exact = process.log_mean_square(Draws(a[:, None], b[:, None]), (known,), (over,))
    assert np.exp(exact[0]) == pytest.approx(np.exp(logs).mean(), rel=0.02)


def test_a_process_that_is_twice_as_wide_has_no_mean_square_over_the_tolerances():
    drawn = Draws(np.zeros((1, 1)), np.full((1, 1), 2.0))
    assert np.isposinf(process.log_mean_square(drawn, (KNOWN,), (None,))).all()
    assert not known_share.supported(10**6, drawn, (KNOWN,), [Mixture(1.0, (None,))]).any()
    assert known_share.supported(10**6, drawn, (KNOWN,), [Mixture(0.5, (12,))]).all()


def test_with_very_many_parts_both_is_the_interval_of_the_joints():
    rng = np.random.default_rng(4)
    z, known, drawn = rng.standard_normal((2000, 3)), (Known(100_000, 3),), process.draws((100_000,))
    weights, above = rng.uniform(0.5, 2.0, 2000), z.sum(axis=1) > 2.5
    counted = np.arange(2000) % 7 > 0
    (split,) = known_share.tallies([sums(z)], known, drawn, weights, [(above, counted)])
    found = known_share.intervals(split, [split], [split], np.ones(1024, dtype=bool))
    one = weighted.Split.by(above[counted], weights[counted])
    lower, upper = one.interval(0.95)
    assert (found.lower, found.upper) == (pytest.approx(lower[0], rel=0.02), pytest.approx(upper[0], rel=0.02))
    assert found.expected == pytest.approx(one.share[0], rel=0.01)
    assert found.parts_upper - found.parts_lower < 0.2 * (found.upper - found.lower)


def test_with_few_joints_above_both_is_not_narrower_than_the_interval_of_the_joints():
    """One joint of 97 above: the joint added has the largest weight that a joint can have, as for the joints alone."""
    rng = np.random.default_rng(6)
    z, weights = rng.standard_normal((97, 3)), rng.uniform(0.5, 1.3, 97)
    above, every = z.sum(axis=1) >= np.sort(z.sum(axis=1))[-1], np.ones(97, dtype=bool)
    alone = weighted.Weighted(weights, heaviest=5.0).shares(Column(above.astype(float)), np.array([0.5]), 0.95)

    def both(parts, heaviest):
        drawn, known = process.draws((parts,)), (Known(parts, 3),)
        (split,) = known_share.tallies([sums(z)], known, drawn, weights, [(above, every)], heaviest)
        return known_share.intervals(split, [split], [split], np.ones(1024, dtype=bool))

    many, fewer = both(100_000, 5.0), both(300, 5.0)
    assert (many.lower, many.upper) == (
        pytest.approx(alone.lower[0], rel=0.02),
        pytest.approx(alone.upper[0], rel=0.02),
    )
    assert fewer.lower <= many.lower < many.upper <= fewer.upper
    assert both(100_000, 0.0).upper < 0.6 * alone.upper[0]  # with the largest weight drawn it is too narrow


def test_processes_without_support_count_at_both_ends():
    z = np.random.default_rng(5).standard_normal((500, 2))
    event = (z[:, 0] > 1.0, z[:, 0] < 9.0)
    (split,) = known_share.tallies([sums(z)], (Known(30, 2),), process.draws((30,)), np.ones(500), [event])
    some = np.arange(1024) >= 10
    few = known_share.intervals(split, [split], [split], some)
    all_ = known_share.intervals(split, [split], [split], np.ones(1024, dtype=bool))
    assert few.unsupported == pytest.approx(10 / 1024)
    assert few.lower < all_.lower < all_.upper < few.upper < 1.0
    assert known_share.intervals(split, [split], [split], np.arange(1024) >= 30).upper == pytest.approx(1.0)
