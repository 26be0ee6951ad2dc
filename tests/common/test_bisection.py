"""Bisection against plain search and against inverse functions."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tolstat.common.bisection import first


@given(st.lists(st.tuples(st.integers(-50, 50), st.integers(0, 40), st.integers(-60, 100)), min_size=1, max_size=5))
def test_integers_are_found_as_by_counting(brackets):
    low, width, threshold = np.array(brackets).T
    found = first(lambda n: n >= threshold, low, low + width)
    each = [next((n for n in range(a, a + w) if n >= t), a + w) for a, w, t in brackets]
    assert found.tolist() == each
    assert np.issubdtype(found.dtype, np.integer)


def test_condition_is_never_called_at_the_upper_end_of_integers():
    called = []

    def holds(n):
        called.append(int(n))
        return False

    assert first(holds, 0, 1000) == 1000
    assert max(called) == 999


def test_an_empty_bracket_gives_its_end():
    assert first(lambda n: n > 0, 5, 5) == 5
    assert first(lambda n: n > 0, 5.0, 5.0) == 5.0


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=8))
def test_real_numbers_are_found_up_to_rounding(thresholds):
    found = first(lambda x: x >= np.array(thresholds), 0.0, 1.0)
    np.testing.assert_allclose(found, thresholds, rtol=0, atol=1e-15)
    assert (found >= thresholds).all()  # the condition holds there


def test_nan_and_conditions_that_never_hold_give_the_upper_end():
    found = first(lambda x: x * np.array([1.0, np.nan]) >= 2.0, np.zeros(2), np.ones(2))
    assert found.tolist() == [1.0, 1.0]
