"""Shape of the tail of weights: ArviZ' Pareto-smoothed importance sampling."""

import warnings

import numpy as np
import pytest

from tolstat.analysis import extreme

with warnings.catch_warnings():
    warnings.simplefilter("ignore", FutureWarning)  # the package announces its next version
    pytest.importorskip("arviz", reason="pip install .[oracles]")
    from arviz.stats.stats import _gpdfit, psislw


@pytest.mark.parametrize("n", [10, 50, 1000])
def test_parameters_of_a_generalised_pareto_tail(n):
    """The same estimator (Zhang and Stephens): agrees to 1e-12, once ArviZ' ten observations of 1/2 are taken out."""
    excesses = np.sort(np.random.default_rng(n).pareto(2.0, size=n))
    k, sigma = extreme.zhang_stephens(excesses)
    drawn, theirs = _gpdfit(excesses)
    assert k == pytest.approx(((n + 10) * drawn - 0.5 * 10) / n, rel=1e-12)
    assert sigma == pytest.approx(theirs, rel=1e-12)


@pytest.mark.parametrize("spread", [0.1, 1.0, 2.0, 4.0])
@pytest.mark.parametrize("n", [60, 225, 1024, 20_000])
def test_shape_of_weights(n, spread):
    """Agrees to 1e-12, far below and far above the shape that is allowed."""
    logarithms = spread * np.random.default_rng(3).standard_normal(n)
    assert extreme.shape_of_weights(np.exp(logarithms)) == pytest.approx(float(psislw(logarithms)[1]), abs=1e-12)


def test_ties_at_the_threshold():
    """Both leave out weights that equal the threshold, and agree to 1e-12 on those above it."""
    logarithms = np.round(np.random.default_rng(4).standard_normal(200), 1)
    assert extreme.shape_of_weights(np.exp(logarithms)) == pytest.approx(float(psislw(logarithms)[1]), abs=1e-12)


def test_where_the_tails_differ():
    """A fifth of n weights is rounded down here and up there; weights of 0 are among the n there, and not here.

    So shapes differ if n is no multiple of 5 and less than 225, and for weights of which some are 0. If all weights are
    equal, ours is -inf, since they have all moments, and ArviZ' is inf, since it has no tail to fit.
    """
    logarithms = np.random.default_rng(3).standard_normal(225)
    ours, theirs = extreme.shape_of_weights(np.exp(logarithms[:62])), float(psislw(logarithms[:62])[1])
    assert ours != pytest.approx(theirs, abs=1e-3)
    weights = np.sort(np.exp(logarithms[:62]))
    for m, found in ((12, ours), (13, theirs)):
        k = float(extreme.zhang_stephens(weights[-m:] - weights[-m - 1])[0])
        assert found == pytest.approx((m * k + 5.0) / (m + 10.0), abs=1e-12)
    lost = np.concatenate([logarithms, np.full(100, -np.inf)])
    assert extreme.shape_of_weights(np.exp(lost)) == extreme.shape_of_weights(np.exp(logarithms))
    assert abs(float(psislw(lost)[1]) - float(psislw(logarithms)[1])) > 0.01
    assert extreme.shape_of_weights(np.ones(100)) == -float(psislw(np.zeros(100))[1]) == -np.inf
