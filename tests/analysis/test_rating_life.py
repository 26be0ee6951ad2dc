"""Rating life of bearings that oscillate: catalogues, published examples, and the geometry behind the formulas."""

from __future__ import annotations

import doctest

import numpy as np
import pytest
from scipy import integrate, optimize, stats

from tolstat.analysis import rating_life
from tolstat.analysis.rating_life import (
    A1,
    basic_life,
    critical_amplitude,
    population_life,
    system_life,
    turns_per_revolution,
)


def test_examples():
    assert doctest.testmod(rating_life).failed == 0


@pytest.mark.parametrize(("angle", "rpm", "ratio"), [(3.0, 100.0, 1.0), (12.0, 500.0, 0.4), (25.0, 60.0, 2.5)])
def test_hours_of_a_universal_joint_catalogue(angle, rpm, ratio):
    """AISCO, Universal joint sizing: 1.5e6/(A N) (Tc/Ta)^(10/3) h; Tc is the torque for 5000 h at 3 deg, 100 rpm."""
    catalogue = 1.5e6 / (angle * rpm) * ratio ** (10 / 3)
    hours = basic_life(1.0, ratio) / (turns_per_revolution(np.radians(angle)) * rpm * 60)
    assert hours == pytest.approx(catalogue, rel=1e-12)
    if ratio == 1.0:
        assert hours == pytest.approx(5000.0)


def test_hours_of_an_oscillating_crossed_roller_bearing():
    """Harmonic Drive, SHG series, eq. 44.1: 1e6/(60 n1) 180/phi (C/P)^(10/3) h, n1 a minute, of the way 2 phi each."""
    phi, rate, ratio = 40.0, 15.0, 5.0
    catalogue = 1e6 / (60 * rate) * 180 / phi * ratio ** (10 / 3)
    hours = basic_life(1.0, ratio) / (turns_per_revolution(np.radians(phi / 2)) * rate * 60)
    assert hours == pytest.approx(catalogue, rel=1e-12)


def test_published_example_of_a_roller_bearing():
    """Solution 11-3 of Shigley's Mechanical Engineering Design: 10.279 kN for 1440 million revolutions take 91.1 kN."""
    assert basic_life(10.279e3, 91.1e3) == pytest.approx(1440e6, rel=2e-3)


def test_factors_are_those_of_the_three_parameter_weibull_distribution():
    """ISO/TR 1281-2: the factors of ISO 281 follow from a least life of 0.05 L10 and the slope 1.5."""
    for reliability, factor in A1.items():
        expected = 0.95 * (np.log(1 / reliability) / np.log(1 / 0.9)) ** (1 / 1.5) + 0.05
        assert factor == pytest.approx(expected, abs=0.006 if factor > 0.1 else 0.0006)


def test_the_first_failure_of_four_bearings():
    """Weibull distributed lives, ten per cent of which are below each bearing's L10."""
    rng, slope = np.random.default_rng(5), rating_life.WEIBULL_SLOPE
    own = np.array([100.0, 150.0, 400.0, 90.0])
    scale = own / np.log(1 / 0.9) ** (1 / slope)
    first = (scale * rng.weibull(slope, (200_000, 4))).min(axis=1)
    early = (first < system_life(own)).mean()
    assert early == pytest.approx(0.1, abs=4 * np.sqrt(0.09 / 200_000))


@pytest.mark.parametrize("inner", [False, True])
def test_tracks_of_neighbouring_needles_overlap_from_the_critical_amplitude_on(inner):
    """Rolling without slip: the cage turns so far that a needle's contact moves alike on both rings."""
    needles, needle, pitch = 28, 3.0, 40.0
    outer_radius, inner_radius = 0.5 * (pitch + needle), 0.5 * (pitch - needle)

    def overlap(amplitude):
        swing = np.linspace(-amplitude, amplitude, 5)  # of the inner ring
        cage = swing * inner_radius / (inner_radius + outer_radius)
        moves = cage - swing if inner else cage  # of the contact, in axes of the ring
        return np.ptp(moves) >= 2 * np.pi / needles

    critical = critical_amplitude(needles, needle, pitch)
    assert overlap(1.001 * critical)
    assert overlap(0.999 * critical) == inner  # the outer ring's tracks overlap last


@pytest.mark.parametrize("part", [0.1, 0.5, 0.9, 1.0, 2.0, 3.0])
def test_equivalent_revolutions_are_those_of_the_weakest_of_many_patches(part):
    """Lundberg and Palmgren: ln(1/S) is the sum over patches of the outer raceway of their passes to the power e.

    Needles roll over their tracks twice in a revolution of the shaft. In turns of the inner ring each patch is passed
    by Z (1 - gamma)/2 needles. Multiples of the critical amplitude: all patches are alike beyond it.
    """
    needles, gamma, slope, patches = 28, 3.0 / 40.0, rating_life.WEIBULL_SLOPE, 28 * 1000
    critical = critical_amplitude(needles, 3.0, 40.0)
    track = round(part * critical * (1.0 - gamma) / (2.0 * np.pi) * patches)  # from end to end, in patches
    passes = np.zeros(patches)
    for needle in range(needles):
        passes[(np.arange(track) + needle * patches // needles) % patches] += 2.0
    rate = (passes**slope).mean() ** (1.0 / slope)  # of failure, in a revolution of the shaft
    turn = needles * (1.0 - gamma) / 2.0
    assert turns_per_revolution(part * critical, critical) == pytest.approx(rate / turn, rel=1e-3)


def test_small_swings_count_as_in_the_capacity_of_oscillating_bearings():
    """C_osc/C goes with the swing to the power -2/9 where a life goes with the load to the power -4 (NREL DG03)."""
    swings = np.array([0.02, 0.05])
    turns = turns_per_revolution(swings, 0.2)
    capacities = (1.0 / turns) ** (1.0 / 4.0)  # revolutions of the shaft, as C_osc^4
    assert capacities[0] / capacities[1] == pytest.approx((swings[0] / swings[1]) ** (-2.0 / 9.0))
    assert turns_per_revolution([0.0, 0.2], 0.2).tolist() == [0.0, turns_per_revolution(0.2)]


@pytest.mark.parametrize("reliability", [0.9, 0.99])
def test_life_of_a_population_is_the_quantile_of_lives_drawn_from_it(reliability):
    """Loads by scipy's log-normal, the life of each by its Weibull distribution."""
    rng, n = np.random.default_rng(4), 400_000
    lives = stats.lognorm(0.6).rvs(n, random_state=rng)
    scale = lives / (-np.log(reliability)) ** (8 / 9)
    drawn = scale * stats.weibull_min(9 / 8).rvs(n, random_state=rng)
    found = population_life(lives[:20_000], reliability, None).estimate
    assert found == pytest.approx(np.quantile(drawn, 1 - reliability), rel=0.05)
    assert found < 0.9 * np.median(lives)  # the quantile of the median load is no quantile of the population


@pytest.mark.slow
@pytest.mark.parametrize("of_lot", [0.0, 0.4])
def test_interval_of_the_life_of_a_population_covers_it(of_lot):
    """Loads by a log-normal whose population's L10 is known by scipy's integral; lots of 10, 0.4 of the scatter theirs.

    The wrong estimator, which takes joints of lots as independent, misses the L10 too often.
    """
    rng, lots, size, trials = np.random.default_rng(6), 60, 10, 800

    def survives(log_time):
        def part(x):
            return stats.norm.pdf(x) * 0.9 ** np.exp((log_time - 0.6 * x) * 9 / 8)

        return integrate.quad(part, -8.0, 8.0)[0]

    true = np.exp(optimize.brentq(lambda log_time: survives(log_time) - 0.9, -4.0, 2.0))
    covered = np.zeros(2)
    for _ in range(trials):
        both = np.sqrt(of_lot) * rng.normal(size=(lots, 1)) + np.sqrt(1.0 - of_lot) * rng.normal(size=(lots, size))
        for k, groups in enumerate((np.repeat(np.arange(lots), size), np.arange(lots * size))):
            _, lower, upper = population_life(np.exp(0.6 * both.ravel()), 0.9, groups)
            covered[k] += lower <= true <= upper
    assert covered[0] / trials == pytest.approx(0.95, abs=0.025)
    assert (covered[1] / trials > 0.9) == (of_lot == 0.0)
