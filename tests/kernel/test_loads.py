"""The registry of loads and what follows from it: columns, the arrays that kernels write, the loads at one instant."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support import synthetic
from tolstat.common.columns import RESULT_COLUMNS
from tolstat.common.loads import KINDS, LOADS, largest, of_kind, put_largest
from tolstat.common.tables import (
    KERNEL_RESULT,
    LOAD_KINDS,
    RESULT,
    RESULT_FIELDS,
    SPAN,
    Options,
    Status,
    for_kernels,
    without_results,
)
from tolstat.kernel.mechanics.loads import N_AVERAGED, N_LOADS
from tolstat.solver.simulation import simulate_rows


def test_kernels_see_the_same_bytes() -> None:
    assert set(RESULT.names) == {field.name for field in RESULT_FIELDS}
    assert RESULT.itemsize == KERNEL_RESULT.itemsize
    table = np.zeros(3, RESULT)
    rows = for_kernels(table)
    rows.largest[:] = np.arange(3 * N_LOADS).reshape(3, N_LOADS)
    rows.average[:], rows.range[:], rows.lyapunov[:] = rows.largest[:, :N_AVERAGED], -1.0, 7.0
    np.testing.assert_array_equal(largest(table), rows.largest)
    for kind in LOAD_KINDS:
        expected = rows.largest[:, SPAN[kind.name]].reshape(3, *kind.shape)
        np.testing.assert_array_equal(table[f"{kind.name}_max"], expected)
        if kind.averaged:
            np.testing.assert_array_equal(table[f"{kind.name}_mean"], expected)
            assert (table[f"{kind.name}_range"] == -1).all()
    assert (table["lyapunov"] == 7).all()


def test_kinds_with_mean_and_range_come_first() -> None:
    averaged = [kind.averaged for kind in LOAD_KINDS]
    assert averaged == sorted(averaged, reverse=True)


def test_each_load_is_the_largest_of_its_columns() -> None:
    table = synthetic.results(20)
    columns = {column.name: column for column in RESULT_COLUMNS}
    assert len(LOADS) == sum(of_kind(table, kind).shape[1] for kind in KINDS)
    for name, load in LOADS.items():
        assert {columns[column].unit for column in load.columns} == {load.unit}
        expected = np.max([columns[column].of(table) for column in load.columns], axis=0)
        np.testing.assert_array_equal(load.of(table), expected, err_msg=name)


def test_largest_loads_are_written_as_they_are_read() -> None:
    table, again = synthetic.results(5), without_results(5, Status.PENDING)
    put_largest(largest(table), again)
    np.testing.assert_array_equal(largest(again), largest(table))
    put_largest(np.nan, again[2:3])
    assert np.isnan(largest(again)).all(axis=1).tolist() == [False, False, True, False, False]


@pytest.mark.parametrize("fidelity", range(3))
def test_every_load_is_computed_at_every_fidelity(params, fidelity: int) -> None:
    """By one revolution with histories: moduli, and the contact forces, from what histories hold."""
    made = simulate_rows(params(alpha=0.2), Options(fidelity=fidelity, peak_substeps=1), "full")
    (row,) = made.results
    assert row["status"] == Status.OK
    assert (largest(made.results) >= 0).all()
    loads, contact = made.histories["loads"][0], made.histories["contact"][0]
    for kind, first in (("F", 0), ("T", 3)):
        moduli = np.linalg.norm(loads[..., first : first + 3], axis=2).max(axis=0)
        np.testing.assert_allclose(row[f"{kind}_max"], moduli, rtol=2e-3)
    np.testing.assert_allclose(row["contact_max"], contact.max(axis=0), rtol=2e-3, atol=1e-3)
