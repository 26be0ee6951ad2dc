"""The registry of loads and what follows from it: columns, the arrays that kernels write, the loads at one instant."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support import synthetic
from tests.support.mechanisms import N_DOF
from tests.support.of_cardan import (
    CHANNELS,
    KERNEL_RESULT,
    KIND,
    LOAD_KINDS,
    LOADS,
    RESULT,
    RESULT_COLUMNS,
    RESULT_FIELDS,
    SPAN,
    for_kernels,
    largest,
    put_largest,
    without_results,
)
from tolstat.common.cardan import CARDAN
from tolstat.common.load_kinds import load_numbers, measure_of, sizes
from tolstat.common.loads import of_kind
from tolstat.common.mechanism import numbering
from tolstat.common.tables import Options, Status
from tolstat.kernel.cardan import ideal_loads
from tolstat.kernel.mechanics import dynamics, loads
from tolstat.kernel.mechanics.work import make_work
from tolstat.kernel.revolution import settle
from tolstat.solver.simulation import simulate_rows

SIZES, CARDAN_NUMBERS = sizes(CARDAN), numbering(CARDAN)


def test_kernels_see_the_same_bytes() -> None:
    assert set(RESULT.names) == {field.name for field in RESULT_FIELDS}
    assert RESULT.itemsize == KERNEL_RESULT.itemsize
    table = np.zeros(3, RESULT)
    rows = for_kernels(table)
    rows.largest[:] = np.arange(3 * SIZES.loads).reshape(3, SIZES.loads)
    rows.average[:], rows.range[:], rows.step_error[:] = rows.largest[:, : SIZES.averaged], -1.0, 7.0
    np.testing.assert_array_equal(largest(table), rows.largest)
    for kind in LOAD_KINDS:
        expected = rows.largest[:, SPAN[kind.key]].reshape(3, *kind.shape)
        np.testing.assert_array_equal(table[f"{kind.key}_max"], expected)
        if kind.averaged:
            np.testing.assert_array_equal(table[f"{kind.key}_mean"], expected)
            assert (table[f"{kind.key}_range"] == -1).all()
    assert (table["step_error"] == 7).all()


def test_the_range_of_a_modulus_that_falls_to_zero_is_not_above_its_largest_value(params) -> None:
    """A load that half a revolution lacks: the parabola through the samples where it ends dips below zero."""
    out = np.zeros(1, KERNEL_RESULT).view(np.recarray)
    samples = settle.make_samples(1, 36)[0]
    for name in samples.dtype.names:
        samples[name] = 0
    load = 700.0 * np.maximum(np.cos(2 * np.pi * (np.arange(36) + 0.2) / 36), 1e-4)
    samples.loads[:] = load[:, None]
    settle.summarise(params(alpha=0.26)[0], samples, out[0])
    np.testing.assert_allclose(out.largest[0, : SIZES.averaged], 700.0, rtol=1e-3)
    np.testing.assert_allclose(out.range[0], 700.0, rtol=1e-3)
    assert (out.range[0] <= out.largest[0, : SIZES.averaged]).all()
    np.testing.assert_allclose(out.average[0], load.mean())


def test_kinds_with_mean_and_range_come_first() -> None:
    averaged = [kind.averaged for kind in LOAD_KINDS]
    assert averaged == sorted(averaged, reverse=True)


def test_kinds_that_need_a_whole_revolution_come_last() -> None:
    orders = [bool(kind.orders) for kind in LOAD_KINDS]
    assert orders == sorted(orders)


def test_no_two_loads_share_a_name_a_field_or_a_column() -> None:
    names = [name for kind in LOAD_KINDS for _, name in kind.loads()]
    fields = [field.name for field in RESULT_FIELDS]
    columns = [column.name for column in RESULT_COLUMNS]
    for several in (names, fields, columns):
        assert len(set(several)) == len(several)
    assert len({kind.key for kind in LOAD_KINDS}) == len(LOAD_KINDS)
    assert not set(names) & set(fields)
    assert not set(names) & set(columns)
    assert set(CHANNELS) & set(names) == {name for name in names if LOADS[name].kind.components}


def test_a_name_is_place_and_symbol() -> None:
    for name, load in LOADS.items():
        assert (load.place.name, name) in load.kind.loads()
        assert name.startswith(f"{load.place.name}." if load.place.name else load.kind.symbol)


def test_loads_that_decide_are_compared_with_their_measure() -> None:
    """Indices of the kernel against the registry: each deciding load once, beside the loads of its measure."""
    of_load = np.repeat([kind.key for kind in LOAD_KINDS], [kind.size for kind in LOAD_KINDS])
    numbers = load_numbers(CARDAN)
    deciding = numbers["deciding"]
    assert sorted([*deciding, *numbers["others"]]) == list(range(SIZES.instant))
    for (first, last), (begin, end) in zip(numbers["measured"], numbers["of_measure"], strict=True):
        (measure,) = set(of_load[first:last])
        assert {measure_of(KIND[key]).key for key in of_load[deciding[begin:end]]} == {measure}
        assert deciding[begin : begin + last - first].tolist() == list(range(first, last))
    assert {of_load[i] for i in deciding} == {kind.key for kind in LOAD_KINDS if kind.decides}


def written(evaluate) -> dict[str, np.ndarray]:
    """Fields of the work record that hold numbers after an evaluation, with which of their elements do."""
    work = make_work()
    evaluate(work)
    return {name: np.isfinite(work[name]) for name in work.dtype.names}


def test_ideal_loads_and_equations_of_motion_fill_the_same_fields(params) -> None:
    """All that loads follow from, in the ideal joint as in the dynamic one."""
    par = params(alpha=0.2)[0]
    at_rest = np.zeros(N_DOF)
    dynamic = written(lambda work: dynamics.forces(0.01, at_rest, at_rest, par, work))
    ideal = written(lambda work: ideal_loads.ideal_loads(0.5, at_rest, par, work))
    turning = CARDAN_NUMBERS["about_z"] == 1
    for name in ("load", "contact", "mode", "force", "frame_w", "turned", "pos", "vel"):
        these = turning if name == "turned" else slice(None)
        assert dynamic[name][these].all(), name
        assert ideal[name][these].all(), name
    work = make_work()
    ideal_loads.ideal_loads(0.5, at_rest, par, work)
    loads.write_loads(at_rest, par, work)
    assert np.isfinite(work.loads).all()


def test_each_load_is_the_largest_of_its_columns() -> None:
    table = synthetic.results(20)
    columns = {column.name: column for column in RESULT_COLUMNS}
    assert len(LOADS) == sum(of_kind(table, kind).shape[1] for kind in LOAD_KINDS)
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
    components, contact = made.histories["loads"][0], made.histories["contact"][0]
    for kind, first in (("F", 0), ("T", 3)):
        moduli = np.linalg.norm(components[..., first : first + 3], axis=2).max(axis=0)
        np.testing.assert_allclose(row[f"{kind}_max"], moduli, rtol=2e-3)
    np.testing.assert_allclose(row["contact_max"], contact.max(axis=0), rtol=2e-3, atol=1e-3)
