"""Mean square of density ratios: closed forms, integrals of unbounded and of bounded distributions, infinite ones."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from tolstat.study.tolerances import density_ratio
from tolstat.study.tolerances.density_ratio import of_error, unbounded
from tolstat.study.tolerances.distributions import (
    Beta,
    Distribution,
    LogNormal,
    Measured,
    Normal,
    Triangular,
    TruncatedNormal,
    Uniform,
)
from tolstat.study.tolerances.zone_laws import Rayleigh


class Laplace(Distribution):
    """An unbounded distribution that `density_ratio` has no closed form for."""

    def __init__(self, scale):
        self.scale = scale

    def ppf(self, u):
        return np.where(u < 0.5, np.log(2 * u), -np.log(2 * (1 - u))) * self.scale

    def cdf(self, x):
        tail = 0.5 * np.exp(-np.abs(x) / self.scale)
        return np.where(x < 0, tail, 1 - tail)

    def logpdf(self, x):
        return -np.abs(x) / self.scale - math.log(2 * self.scale)

    def describe(self):
        return {}


def integral(new, old, low, high):
    def square(x):
        at = np.array([x])
        return math.exp(2 * new.logpdf(at)[0] - old.logpdf(at)[0])

    return math.log(quad(square, low, high, limit=200)[0])


@pytest.mark.parametrize(
    ("new", "old"),
    [
        (Normal(1.0, 0.4), Normal(1.0, 0.5)),
        (Normal(1.2, 0.6), Normal(1.0, 0.5)),
        (Rayleigh(0.6), Rayleigh(0.5)),
    ],
)
def test_closed_forms_are_the_integrals(new, old):
    low = 0.0 if isinstance(old, Rayleigh) else -9.0
    assert of_error(new, old).mean_square == pytest.approx(integral(new, old, low, 9.0), rel=1e-6)
    assert density_ratio._integrated(new, old) == pytest.approx(of_error(new, old)[::2], abs=1e-5)


@pytest.mark.parametrize("factor", [0.3, 0.8, 1.0, 1.2, 1.35])
def test_unbounded_distributions_of_other_kinds_are_integrated(factor):
    old, new = LogNormal(0.1, Normal(-0.3, 0.4)), LogNormal(0.1, Normal(-0.3, 0.4 * factor))
    assert of_error(new, old).mean_square == pytest.approx(of_error(new.log, old.log).mean_square, abs=2e-4)
    assert of_error(Laplace(factor), Laplace(1.0)).mean_square == pytest.approx(
        -math.log(factor * (2 - factor)), abs=1e-4
    )


@pytest.mark.parametrize(
    ("new", "old"),
    [
        (Normal(0.0, 1.5), Normal(0.0, 1.0)),
        (Rayleigh(1.42), Rayleigh(1.0)),
        (LogNormal(0.0, Normal(0.0, 1.5)), LogNormal(0.0, Normal(0.0, 1.0))),
        (Laplace(2.1), Laplace(1.0)),
        (Uniform(-1.2, 1.2), Uniform(-1.0, 1.0)),
        (LogNormal(-0.1, Normal(0.0, 0.5)), LogNormal(0.0, Normal(0.0, 0.5))),
    ],
)
def test_infinite_where_tails_are_too_wide_or_values_have_no_density(new, old):
    assert of_error(new, old).mean_square == math.inf


@pytest.mark.parametrize(
    ("new", "old"),
    [
        (Uniform(-0.6, 0.6), Uniform(-1.0, 1.0)),
        (Triangular(-0.7, 0.7, 0.0), Triangular(-1.0, 1.0, 0.0)),
        (Beta(2.0, 3.0, -0.8, 0.8), Beta(2.0, 3.0, -1.0, 1.0)),
        (TruncatedNormal(0.0, 0.3, -0.8, 0.8), TruncatedNormal(0.0, 0.4, -1.0, 1.0)),
        (Rayleigh(0.3, 0.8), Rayleigh(0.4, 1.0)),
    ],
)
def test_bounded_distributions(new, old):
    low, high = new.ppf(np.array([0.0, 1.0]))
    assert of_error(new, old).mean_square == pytest.approx(integral(new, old, low, high), abs=2e-4)


def test_support_tells_whether_a_distribution_is_unbounded():
    log = Normal(0.0, 1.0), TruncatedNormal(0.0, 1.0, -1.0, 1.0)
    assert [unbounded(d) for d in (Normal(0, 1), Rayleigh(1.0), LogNormal(0.0, log[0]), Laplace(1.0))] == [True] * 4
    bounded = (log[1], Rayleigh(1.0, 2.0), LogNormal(0.0, log[1]), Uniform(0, 1), Triangular(0, 3, 1), Beta(1, 2, 0, 1))
    assert not any(unbounded(d) for d in (*bounded, Measured.of([1, 2])))
