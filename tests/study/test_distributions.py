"""Every distribution against SciPy's: inverse, distribution function, density, moments, scores; ends and tails."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from tolstat.study import widths
from tolstat.study.axes import Bonus
from tolstat.study.tolerances import distributions
from tolstat.study.tolerances.distributions import Distribution
from tolstat.study.tolerances.external import ScipyLaw
from tolstat.study.tolerances.zone_laws import Accepted, Disc, Rayleigh, plane_scores

U = np.concatenate([10.0 ** np.arange(-15, -2), np.linspace(0.01, 0.99, 99), 1 - 10.0 ** np.arange(-3.0, -16, -1)])

bands = st.tuples(st.floats(-1e-3, 1e-3), st.floats(1e-6, 1e-3)).map(lambda b: (b[0], b[0] + b[1]))
shares = st.floats(0.05, 0.95)
cpks = st.floats(0.3, 3.0)

PAIRS = [
    (distributions.Normal(1.0, 2.0), stats.norm(1.0, 2.0)),
    (distributions.TruncatedNormal(1.0, 2.0, 0.5, 9.0), stats.truncnorm(-0.25, 4.0, 1.0, 2.0)),
    (distributions.TruncatedNormal(0.0, 1.0, -0.01, 0.02), stats.truncnorm(-0.01, 0.02)),
    (distributions.TruncatedNormal(0.0, 1.0, 5.0, 6.0), stats.truncnorm(5.0, 6.0)),
    (distributions.TruncatedNormal(0.0, 1.0, -9.0, -4.0), stats.truncnorm(-9.0, -4.0)),
    (distributions.Uniform(-1.0, 3.0), stats.uniform(-1.0, 4.0)),
    (distributions.Triangular(-1.0, 3.0, 0.0), stats.triang(0.25, -1.0, 4.0)),
    (distributions.Triangular(-1.0, 3.0, -1.0), stats.triang(0.0, -1.0, 4.0)),
    (distributions.Triangular(-1.0, 3.0, 3.0), stats.triang(1.0, -1.0, 4.0)),
    (distributions.LogNormal(-1.0, distributions.Normal(0.2, 0.4)), stats.lognorm(0.4, -1.0, math.exp(0.2))),
    (distributions.Beta(2.0, 5.0, -1.0, 3.0), stats.beta(2.0, 5.0, -1.0, 4.0)),
    (distributions.Beta(1.5, 1.0, -1.0, 3.0), stats.beta(1.5, 1.0, -1.0, 4.0)),
    (ScipyLaw("weibull_min", (("c", 1.8), ("scale", 0.012)), 1e-3), stats.weibull_min(1.8, scale=1.2e-5)),
    (ScipyLaw("norm", (("loc", 1.0), ("scale", 2.0)), 1.0, 0.5, 9.0), stats.truncnorm(-0.25, 4.0, 1.0, 2.0)),
    (ScipyLaw("norm", (), 1.0, 5.0, 6.0), stats.truncnorm(5.0, 6.0)),
    (ScipyLaw("norm", (), 1.0, None, -4.0), stats.truncnorm(-np.inf, -4.0)),
    (Rayleigh(2.0), stats.rayleigh(scale=2.0)),
    (Disc(3.0), stats.powerlaw(2.0, scale=3.0)),
    (widths.Rescaled(distributions.Normal(1.0, 2.0), 0.5, 0.25), stats.norm(0.625, 0.5)),
]


def each_kind(lower: float, upper: float, share: float) -> list[Distribution]:
    middle = lower + share * (upper - lower)
    sigma = distributions.sigma_of(lower, upper, middle, 1.0)
    return [
        distributions.Normal(middle, sigma),
        distributions.TruncatedNormal(middle, sigma, lower, upper),
        distributions.Uniform(lower, upper),
        distributions.Triangular(lower, upper, middle),
        distributions.LogNormal(lower, distributions.Normal(math.log(middle - lower), 0.3)),
        distributions.Beta(0.5 + 3 * share, 2.0, lower, upper),
        Rayleigh(sigma),
        Rayleigh(sigma, 2 * sigma),
        Disc(upper - lower),
        distributions.Measured.of([lower, middle, upper, middle]),
    ]


@settings(deadline=None, max_examples=60)
@given(bands, shares)
def test_ppf_is_monotone_and_finite(band: tuple[float, float], share: float) -> None:
    for dist in each_kind(*band, share):
        values = dist.ppf(np.sort(U))
        assert np.isfinite(values).all(), dist
        # rounding may swap neighbours that are one part in 1e16 of the band's position apart
        assert (np.diff(values) >= -1e-15 * np.abs(values).max()).all(), dist


def test_a_part_of_the_joints_has_the_same_bits_as_all_of_them() -> None:
    for dist in each_kind(-1e-4, 2e-4, 0.4):
        whole = dist.ppf(U)
        for part in (slice(0, 1), slice(3, 20), slice(40, None), slice(None, None, 7)):
            assert dist.ppf(U[part].copy()).tobytes() == whole[part].tobytes(), dist


@settings(deadline=None, max_examples=60)
@given(bands, shares)
def test_bounded_distributions_stay_inside_their_band(band: tuple[float, float], share: float) -> None:
    lower, upper = band
    for dist in each_kind(lower, upper, share):
        if isinstance(dist, (distributions.TruncatedNormal, distributions.Measured)):
            values = dist.ppf(U)
            assert values.min() >= lower
            assert values.max() <= upper
        elif isinstance(dist, (distributions.Uniform, distributions.Triangular, distributions.Beta)):
            slack = 1e-15 * max(abs(lower), abs(upper))
            assert dist.ppf(U).min() >= lower - slack
            assert dist.ppf(U).max() <= upper + slack


@settings(deadline=None, max_examples=60)
@given(bands, shares, cpks)
def test_cpk_is_reproduced_on_any_band(band: tuple[float, float], share: float, cpk: float) -> None:
    lower, upper = band
    mean = lower + share * (upper - lower)
    sigma = distributions.sigma_of(lower, upper, mean, cpk)
    assert min(upper - mean, mean - lower) / (3 * sigma) == pytest.approx(cpk, rel=1e-12)
    # share of rejects beyond the nearer limit, from the quantile function itself
    tail = stats.norm.sf(3 * cpk)
    dist = distributions.Normal(mean, sigma)
    distance = mean - dist.ppf(np.array([tail]))[0]
    assert distance == pytest.approx(min(upper - mean, mean - lower), rel=1e-6)


@pytest.mark.parametrize(("dist", "scipy_dist"), PAIRS)
def test_ppf_inverts_scipys_distribution_function(dist: Distribution, scipy_dist: stats.rv_continuous) -> None:
    u = U[(U > 1e-12) & (U < 1 - 1e-12)]
    x = dist.ppf(u)
    low = u < 0.5
    np.testing.assert_allclose(scipy_dist.cdf(x[low]), u[low], rtol=1e-7, atol=1e-13)  # digits of x near an end
    np.testing.assert_allclose(scipy_dist.sf(x[~low]), 1 - u[~low], rtol=1e-4, atol=1e-13)


@pytest.mark.parametrize(("dist", "scipy_dist"), PAIRS)
def test_distribution_function_is_scipys(dist: Distribution, scipy_dist: stats.rv_continuous) -> None:
    low, high = dist.ppf(np.array([1e-6, 1 - 1e-6]))
    x = np.concatenate([np.linspace(low, high, 40), [-30.0, low - 1.0, high + 1.0, 30.0]])  # ends of densities differ
    np.testing.assert_allclose(dist.cdf(x), scipy_dist.cdf(x), rtol=1e-9, atol=1e-14)


@pytest.mark.parametrize(("dist", "scipy_dist"), PAIRS)
def test_moments_are_scipys(dist: Distribution, scipy_dist: stats.rv_continuous) -> None:
    expected = scipy_dist.mean(), scipy_dist.std()
    assert dist.moments == pytest.approx(expected, rel=1e-7)  # SciPy's of a far tail have few digits
    assert Distribution.moments.fget(dist) == pytest.approx(expected, rel=1e-6)  # the quadrature behind no closed form
    assert dist.moments.mean_square == pytest.approx(dist.expect(np.square), rel=1e-6)


@pytest.mark.parametrize(("dist", "scipy_dist"), PAIRS)
def test_share_outside_a_band(dist: Distribution, scipy_dist: stats.rv_continuous) -> None:
    low, high = dist.ppf(np.array([1e-5, 0.9]))
    assert dist.outside(low, high) == pytest.approx(0.1 + 1e-5, rel=1e-9)
    assert dist.outside(low - 40.0, high + 40.0) == 0.0


@settings(deadline=None, max_examples=60)
@given(bands, shares)
def test_distribution_function_inverts_ppf(band: tuple[float, float], share: float) -> None:
    u = np.linspace(1e-3, 0.999, 50)
    for dist in each_kind(*band, share):
        if not isinstance(dist, distributions.Measured):
            position = np.spacing(np.abs(dist.ppf(u))).max() / (band[1] - band[0])  # a digit of the value
            np.testing.assert_allclose(dist.cdf(dist.ppf(u)), u, rtol=1e-9, atol=1e3 * position)


@settings(deadline=None, max_examples=40)
@given(bands, shares)
def test_moments_are_those_of_equally_probable_values(band: tuple[float, float], share: float) -> None:
    middle = (np.arange(20_000) + 0.5) / 20_000
    for dist in each_kind(*band, share):
        values, found = dist.ppf(middle), dist.moments
        assert found.mean == pytest.approx(values.mean(), abs=2e-3 * values.std())
        assert found.deviation == pytest.approx(values.std(), rel=6e-3)


@pytest.mark.parametrize(("dist", "scipy_dist"), PAIRS)
def test_scores_have_the_probability_of_the_value(dist: Distribution, scipy_dist: stats.rv_continuous) -> None:
    z = np.array([-5.0, -1.0, 0.0, 0.4, 2.0, 5.0])
    np.testing.assert_allclose(distributions.score(dist, dist.ppf(stats.norm.cdf(z))), z, atol=1e-7)


@pytest.mark.parametrize("dist", [Rayleigh(2.0), Rayleigh(2.0, 3.0), Disc(3.0)])
def test_vectors_have_two_normal_scores(dist: Distribution) -> None:
    normal = np.random.default_rng(1).standard_normal((2, 400))
    size = np.hypot(*normal)
    radius = dist.ppf(stats.rayleigh.cdf(size))
    np.testing.assert_allclose(plane_scores(dist, radius * normal / size), normal, rtol=1e-7)
    assert plane_scores(dist, np.zeros((2, 1))).tolist() == [[0.0], [0.0]]
    assert np.isfinite(plane_scores(dist, np.array([[3.0], [0.0]]))).all()


def test_measured_parts_count_up_to_and_including_a_value() -> None:
    dist = distributions.Measured.of([3.0, 1.0, 2.0, 2.0])
    assert dist.cdf(np.array([0.9, 1.0, 2.0, 2.5, 3.0])).tolist() == [0.0, 0.25, 0.75, 0.75, 1.0]
    assert dist.moments == pytest.approx((2.0, math.sqrt(0.5)))
    np.testing.assert_allclose(
        distributions.score(dist, np.array([0.0, 1.0, 2.0, 3.0])), [-9.0, *stats.norm.ppf([1 / 8, 1 / 2, 7 / 8])]
    )


def test_accepted_and_rescaled_distributions_follow_from_others() -> None:
    every = distributions.Normal(0.0, 1e-5)
    parts = Accepted(every, Bonus("reject", "hole1.diameter", -3e-5, 5e-5, 3e-5))
    u = np.linspace(0.01, 0.99, 99)
    np.testing.assert_allclose(parts.cdf(parts.ppf(u)), u, rtol=1e-6)
    values = parts.ppf((np.arange(100_000) + 0.5) / 100_000)
    assert parts.moments == pytest.approx((values.mean(), values.std()), rel=1e-3)
    exact = widths.Rescaled(every, 2e-5, 0.0)
    assert exact.cdf(np.array([1e-5, 2e-5, 3e-5])).tolist() == [0.0, 1.0, 1.0]
    assert exact.moments == pytest.approx((2e-5, 0.0), abs=1e-18)


def test_truncated_tails_are_as_exact_above_as_below() -> None:
    dist = distributions.TruncatedNormal(0.0, 1.0, -30.0, 30.0)
    u = 2.0 ** -np.arange(2, 50)
    np.testing.assert_allclose(dist.ppf(1 - u), -dist.ppf(u), rtol=1e-12)


def test_truncated_rayleigh_ends_at_its_radius() -> None:
    dist = Rayleigh(1.0, 2.0)
    assert dist.ppf(np.array([1 - 1e-16]))[0] == pytest.approx(2.0)
    half = dist.ppf(np.array([0.5]))[0]
    assert stats.rayleigh.cdf(half) == pytest.approx(0.5 * stats.rayleigh.cdf(2.0), rel=1e-12)


def test_measured_draws_each_value_equally_often() -> None:
    dist = distributions.Measured.of([3.0, 1.0, 2.0, 2.0])
    np.testing.assert_array_equal(dist.ppf(np.array([1e-9, 0.25, 0.26, 0.5, 0.75, 0.76, 1.0])), [1, 1, 2, 2, 2, 3, 3])
    assert dist.describe() == distributions.Measured.of([1.0, 2.0, 2.0, 3.0]).describe()
    assert dist.describe() != distributions.Measured.of([1.0, 2.0, 3.0, 3.0]).describe()


def test_each_kind_describes_itself() -> None:
    assert [dist.describe()["distribution"] for dist in each_kind(0.0, 1.0, 0.5)] == [
        *("normal", "truncatednormal", "uniform", "triangular", "lognormal", "beta"),
        *("rayleigh", "rayleigh", "disc", "measured"),
    ]
