"""S–N line with a knee and a population of strengths: against published figures, pyLife, a naive twin, closed forms."""

from __future__ import annotations

import doctest
from importlib.util import find_spec

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import gamma, gammainc, gammaincc
from scipy.stats import norm

from tolstat.analysis import strength
from tolstat.analysis.strength import SNLine

MPA = 1e6
HAIBACH = SNLine(k=5.0, k_2=9.0, N_D=2e6, S_D=360 * MPA, T_S=1.25)
needs_pylife = pytest.mark.skipif(find_spec("pylife") is None, reason="pylife is not installed")
CYCLES = st.lists(st.tuples(st.floats(1.0, 2000.0), st.floats(1.0, 1e7)), min_size=1, max_size=6)


def one(cycles, line):
    """Collective of one joint with these (range in MPa, number)."""
    ranges, numbers = np.array(cycles, dtype=float).T
    return strength.sort_out(ranges[None] * MPA, numbers[None], line)


def naive(cycles, line, factor):
    """Miner's sum, cycle by cycle."""
    total = 0.0
    for size, number in cycles:
        x = size * MPA / (line.S_D * factor)
        total += number / (line.N_D * x ** -(line.k if x >= 1 else line.k_2))
    return total


@settings(max_examples=60, deadline=None)
@given(CYCLES, st.floats(0.05, 20.0))
def test_damage_is_that_of_the_naive_twin(cycles, factor):
    found = strength.damage_at(one(cycles, HAIBACH), HAIBACH, factor)
    assert found[0] == pytest.approx(naive(cycles, HAIBACH, factor), rel=1e-9)


@settings(max_examples=60, deadline=None)
@given(CYCLES, st.floats(1e-6, 1e6), st.floats(0.1, 1.0), st.sampled_from([5.0, 9.0, 40.0]))
def test_the_critical_part_has_the_critical_damage(cycles, lives, critical, k_2):
    line = HAIBACH._replace(D_c=critical, k_2=k_2)
    factor = strength.critical_factor(one(cycles, line), line, lives)[0]
    assert lives * naive(cycles, line, factor) == pytest.approx(critical, rel=1e-9)


def test_joints_without_cycles_never_fail_and_those_without_results_have_none():
    ranges = np.array([[0.0, 0.0], [np.nan, np.nan], [100 * MPA, 0.0]])
    collective = strength.sort_out(ranges, np.full((3, 2), 1e6), HAIBACH)
    factor = strength.critical_factor(collective, HAIBACH)
    np.testing.assert_array_equal(factor[:2], [0.0, np.nan])
    np.testing.assert_array_equal(strength.damage_at(collective, HAIBACH)[:2], [0.0, np.nan])
    assert strength.probability(factor, 1.25)[0] == 0.0
    for scatter in (1.0, 1.25):
        assert np.isnan(strength.probability(factor, scatter)).tolist() == [False, True, False]


# DNV-RP-C203, Fatigue design of offshore steel structures (2010): S–N curve B1 in air, 10^7 cycles at the knee, slopes
# 4 and 5, log a = 15.117; table of the largest stress range in 10^8 cycles whose ranges have a Weibull distribution of
# shape h, for a damage of 1
PUBLISHED = {0.8: 704.7, 0.9: 594.1, 1.0: 512.9, 1.1: 451.4, 1.2: 403.6}


def weibull(largest, h, n=1e8, classes=40_000):
    """Classes of range (MPa) and numbers of a Weibull spectrum whose largest range comes once in n cycles."""
    scale = largest / np.log(n) ** (1.0 / h)
    edges = np.linspace(0.0, 3.0 * largest, classes + 1)
    return 0.5 * (edges[1:] + edges[:-1]), -n * np.diff(np.exp(-((edges / scale) ** h)))


@pytest.mark.parametrize(("h", "largest"), PUBLISHED.items())
def test_allowable_ranges_of_dnv_rp_c203(h, largest):
    line = SNLine(k=4.0, k_2=5.0, N_D=1e7, S_D=MPA * 10 ** ((15.117 - 7.0) / 4.0))
    found = strength.damage_at(one(np.transpose(weibull(largest, h)), line), line)[0]
    assert found == pytest.approx(1.0, rel=2e-3)  # four digits of the range to the fourth power


def test_a_weibull_spectrum_in_closed_form_with_haibachs_slope():
    # two incomplete gamma functions; curve D of the same document has slopes 3 and 5 = 2 * 3 - 1
    h, scale, number, line = 0.9, 12.0, 1e8, SNLine(k=3.0, k_2=5.0, N_D=1e7, S_D=52.63 * MPA)
    x = (52.63 / scale) ** h
    parts = ((3.0, gammaincc), (5.0, gammainc))
    closed = sum((scale / 52.63) ** m * gamma(1 + m / h) * part(1 + m / h, x) for m, part in parts) * number / 1e7
    ranges, numbers = weibull(scale * np.log(number) ** (1 / h), h, number)
    assert strength.damage_at(one(np.transpose([ranges, numbers]), line), line)[0] == pytest.approx(closed, rel=1e-4)


@needs_pylife
def test_damage_of_pylife():
    import pylife.strength.fatigue
    import pylife.stress.collective  # noqa: F401

    cycles = [(900.0, 1e3), (500.0, 1e5), (300.0, 1e6), (100.0, 1e7)]
    curve = pd.Series({"k_1": HAIBACH.k, "ND": HAIBACH.N_D, "SD": 180.0, "TS": HAIBACH.T_S})  # SD is an amplitude
    ranges, numbers = np.transpose(cycles)
    load = pd.DataFrame({"range": ranges, "mean": 0.0, "cycles": numbers}).load_collective
    haibach = curve.fatigue.miner_haibach()
    collective = one(cycles, HAIBACH)
    assert strength.damage_at(collective, HAIBACH)[0] == pytest.approx(haibach.damage(load).sum())
    for share in (0.1, 1e-4):  # the part that this share of the parts is weaker than
        factor = 10 ** (norm.ppf(share) * np.log10(HAIBACH.T_S) / strength.DECILES)
        weaker = haibach.transform_to_failure_probability(share).to_pandas().fatigue.miner_haibach()
        assert strength.damage_at(collective, HAIBACH, factor)[0] == pytest.approx(weaker.damage(load).sum())
        assert strength.probability(np.array([factor]), HAIBACH.T_S)[0] == pytest.approx(share)


@needs_pylife
def test_mean_stress_of_pylife():
    from pylife.strength.meanstress import fkm_goodman

    rng = np.random.default_rng(3)
    amplitude, ratio = rng.uniform(20, 200, 300), rng.uniform(-3, 2.9, 300)  # pyLife's M2 holds to R = 1: no R > 0.5
    for R in (-1.0, 0.0, 0.3):
        theirs = fkm_goodman(pd.Series(amplitude), pd.Series(ratio * amplitude), 0.3, 0.1, R)
        found = strength.at_ratio(2 * amplitude, ratio * amplitude, 0.3, R)
        np.testing.assert_allclose(found, 2 * theirs, rtol=1e-9)


@pytest.mark.parametrize(
    ("R", "factor"),  # FKM guideline: mean-stress factor of the fatigue limit, from its four ranges, for M
    [
        (-1.0, lambda M: 1.0),
        (0.0, lambda M: 1 / (1 + M)),
        (0.5, lambda M: (3 + M) / (3 * (1 + M) ** 2)),
        (0.8, lambda M: (3 + M) / (3 * (1 + M) ** 2)),
        (2.0, lambda M: 1 / (1 - M)),
    ],
)
def test_mean_stress_factors_of_the_fkm_guideline(R, factor):
    assert doctest.testmod(strength) == (0, 1)
    mean = 50.0 * (1 + R) / (1 - R) if R < 1 else -50.0 * (R + 1) / (R - 1)
    for M in (0.1, 0.4):
        assert strength.at_ratio(100.0, mean, M) == pytest.approx(100.0 / factor(M))
        if -1 <= R < 1:
            assert strength.at_ratio(100.0, mean, M, R) == pytest.approx(100.0)
    assert strength.at_ratio(100.0, mean, 0.0) == pytest.approx(100.0)


@needs_pylife
def test_joints_and_strengths_that_both_scatter():
    # one range per joint, lognormal over the joints: load against strength has a closed form, and pyLife an integral
    from pylife.strength.failure_probability import FailureProbability

    scatter, std = 0.05, np.log10(HAIBACH.T_S) / strength.DECILES
    grid = norm.ppf((np.random.default_rng(1).permutation(4000) + 0.5) / 4000)
    ranges = 300 * MPA * 10 ** (scatter * grid[:, None])
    collective = strength.sort_out(ranges, np.full((4000, 1), HAIBACH.N_D), HAIBACH)
    chances = strength.probability(strength.critical_factor(collective, HAIBACH), HAIBACH.T_S)
    found = strength.failures(chances, 0, 0)
    closed = norm.cdf(np.log10(300 / 360) / np.hypot(scatter, std))
    assert found.estimate == pytest.approx(closed, rel=1e-3)
    assert FailureProbability(360.0, std).pf_norm_load(300.0, scatter) == pytest.approx(closed)
    assert found.lower < closed < found.upper


def test_joints_without_a_result_count_both_ways():
    chances = np.random.default_rng(1).permutation(np.append(np.linspace(0.0, 0.2, 100), [np.nan] * 5))
    found = strength.failures(chances, 2, 3)
    assert (found.n, found.n_failed, found.n_unsettled, found.estimate) == (105, 2, 3, pytest.approx(0.1))
    assert found.outer_lower < found.lower < 0.1 < found.upper < found.outer_upper
    assert found.outer_upper > (10 + 5) / 105
    none = strength.failures(np.full(5, np.nan), 5, 0)
    assert np.isnan(none.estimate)
    assert (none.outer_lower, none.outer_upper) == (0.0, 1.0)
    assert np.isnan(strength.failures(chances, 2, 3, iid=False)[4:]).all()


def test_strengths_without_scatter_give_the_share_of_joints():
    from tolstat.analysis.binomial import clopper_pearson

    factor = np.array([0.5, 0.99, 1.0, 3.0])
    chances = strength.probability(factor, 1.0)
    assert chances.tolist() == [0.0, 0.0, 1.0, 1.0]
    found = strength.failures(chances, 0, 0)
    assert (found.lower, found.upper) == clopper_pearson(2, 4)
