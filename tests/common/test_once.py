"""Small results of a view: computed once for each view and set of arguments, however given, and gone with the view."""

import gc
import weakref

from tests.support.views import view
from tolstat.common.once import once


def test_a_result_is_computed_once_for_each_view_and_arguments():
    asked = []

    @once
    def number(made, factor=1.0):
        asked.append((made.n, factor))
        return factor * made.n

    first, second = view(11), view(21)
    assert [number(first), number(first, 1.0), number(second)] == [10.0, 10.0, 20.0]
    assert [number(first, factor=2.0), number(first, 2.0)] == [20.0, 20.0]
    assert asked == [(10, 1.0), (20, 1.0), (10, 2.0)]
    kept = weakref.ref(second)
    del second
    gc.collect()
    assert kept() is None
