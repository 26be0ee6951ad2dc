"""What measured parts tell of a process: intervals against scipy, and over seeds."""

import numpy as np
import pytest
from scipy import stats

from tolstat.analysis import measured


@pytest.mark.parametrize("parts", [5, 10, 400])
def test_ends_are_quantiles_of_chi_squared_and_student(parts):
    low, high = measured.spreads(parts)
    chi = stats.chi2(parts - 1)
    assert (low, high) == pytest.approx(tuple(np.sqrt((parts - 1) / chi.ppf([0.95, 0.05]))))
    half = stats.t(parts - 1).ppf(0.95) / np.sqrt(parts)
    assert measured.means(parts) == pytest.approx((-half, half))


def test_they_contain_the_process_in_nine_of_ten_samples_and_normal_quantiles_do_not():
    parts, seeds = 6, 4000
    sample = 3.0 + 2.0 * np.random.default_rng(8).standard_normal((seeds, parts))
    mean, deviation = sample.mean(axis=1), sample.std(axis=1, ddof=1)
    low, high = measured.spreads(parts)
    inside = (low * deviation <= 2.0) & (high * deviation >= 2.0)
    slack = 3.0 * np.sqrt(0.9 * 0.1 / seeds)
    assert inside.mean() == pytest.approx(0.9, abs=slack)
    away, half = abs(mean - 3.0) / deviation, measured.means(parts)[1]
    assert (away <= half).mean() == pytest.approx(0.9, abs=slack)
    assert (away <= stats.norm.ppf(0.95) / np.sqrt(parts)).mean() < 0.9 - slack
