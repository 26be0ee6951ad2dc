"""Lanes: operations against NumPy, and joints in lock-step against the same joints one after the other, bit by bit."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.conftest import REFERENCE, joint_with_law, sliding
from tests.support import kernel_states, trajectory
from tests.support.of_cardan import CARDAN, PARAM, RESULT
from tolstat import joint as joints
from tolstat import sampling, study
from tolstat.common.tables import Fidelity, Method, Options, Start, Status, iterations_allowed
from tolstat.joint.contact import LAWS
from tolstat.kernel.lanes import lockstep
from tolstat.kernel.lanes.lane_memory import aligned_zeros, as_lanes, lane_dtype
from tolstat.kernel.simd.jit import njit_inner
from tolstat.kernel.simd.lane import WIDTH, all_of, any_of, bits_of, count_of, fma, pick, reciprocal, retain, where
from tolstat.solver import simulation, stationary

STUDY = REFERENCE.parents[1] / "studies" / "rigid_shafts.toml"
FAST = Options(steps_per_rev=45, max_revs=6, max_refinements=0)
STATIC = FAST._replace(fidelity=int(Fidelity.QUASISTATIC))


OPERATION = np.dtype([("a", "f8"), ("b", "f8"), ("out", "f8", 19)])
"""Two operands, and results of operations on them."""


@njit_inner
def operations(record):
    lanes = as_lanes(record)
    a, b, out = lanes.a, lanes.b, lanes.out
    out[0], out[1], out[2], out[3] = a + b, a - b, a * b, a / b
    out[4], out[5], out[6], out[7] = -a, math.sqrt(abs(a)), max(a, b), min(a, b)
    out[8], out[9], out[10], out[11] = math.sin(a), math.cos(a), math.tan(a), math.atan2(a, b)
    out[12], out[13] = where(a < b, a, b), where((a >= b) | ~(b > 0), 2.0, a)
    out[14], out[15] = where((a <= b) & (a != b), 1, 0), where(a == b, 1.0, 0.0)
    out[16], out[17] = 2 - a, (1 + a) * 3
    total = 0.0
    for k in range(3):
        total += k * a
    out[18] = total
    return any_of(a > b), all_of(a > b), count_of(a > b), bits_of(a > b), pick(a, WIDTH - 1)


def test_operations_are_those_of_numpy():
    rng = np.random.default_rng(3)
    special = np.array([0.0, -0.0, np.inf, -np.inf, np.nan, 1.0, -1.5, 3.0])
    for k in range(40):
        record = aligned_zeros(1, lane_dtype(OPERATION)).view(np.recarray)[0]
        x, y = (rng.choice(special, WIDTH) if k % 2 else rng.normal(size=WIDTH) for _ in range(2))
        record.a[:], record.b[:] = x, y
        reduced = operations(record)
        with np.errstate(all="ignore"):
            expected = [x + y, x - y, x * y, x / y, -x, np.sqrt(abs(x)), np.where(y > x, y, x), np.where(y < x, y, x)]
            expected += [libm(math.sin, x), libm(math.cos, x), libm(math.tan, x), libm(math.atan2, x, y)]
            expected += [np.where(x < y, x, y), np.where((x >= y) | ~(y > 0), 2.0, x), (x <= y) & (x != y), x == y]
            expected += [2 - x, (1 + x) * 3, 0.0 + 0 * x + 1 * x + 2 * x]
        np.testing.assert_array_equal(record.out, np.array(expected, float))
        more = x > y
        assert reduced[:4] == (more.any(), more.all(), more.sum(), sum(int(m) << i for i, m in enumerate(more)))
        np.testing.assert_equal(reduced[4], x[-1])


SINGLES = np.dtype([("a", "f4"), ("b", "f4"), ("x", "f8"), ("out", "f4", 9), ("mixed", "f8", 3)])
"""Two operands in single precision and one in double, and results of operations on them."""


@njit_inner
def single_operations(record):
    singles = as_lanes(record)
    a, b, x, out, mixed = singles.a, singles.b, singles.x, singles.out, singles.mixed
    out[0], out[1], out[2], out[3], out[4] = a + b, a - b, a * b, a / b, -a
    out[5], out[6], out[7], out[8] = fma(a, b, a), reciprocal(a), x, retain(x > 0, x, b)
    mixed[0], mixed[1], mixed[2] = a * x, 2.0 * a, fma(a, x, b)


def test_singles_compute_in_single_precision_and_with_doubles_in_double():
    record = aligned_zeros(1, lane_dtype(SINGLES)).view(np.recarray)[0]
    rng = np.random.default_rng(5)
    a, b, x = (rng.normal(size=WIDTH).astype(kind) for kind in ("f4", "f4", "f8"))
    record.a[:], record.b[:], record.x[:] = a, b, x
    single_operations(record)
    once = (a.astype("f8") * b + a).astype("f4")  # a product of singles is exact in double precision
    expected = [a + b, a - b, a * b, a / b, -a, once, 1 / a, x.astype("f4"), np.where(x > 0, x, b).astype("f4")]
    np.testing.assert_array_equal(record.out, np.array(expected))
    assert record.out.dtype == np.float32
    np.testing.assert_allclose(record.mixed, [a * x, 2.0 * a.astype("f8"), a * x + b], rtol=1e-15)


def libm(function, *arguments):
    """`function` of each element; NaN where it raises."""
    out = []
    for values in zip(*arguments, strict=True):
        try:
            out.append(function(*values))
        except ValueError:
            out.append(math.nan)
    return np.array(out)


@njit_inner
def halve_all(record):
    lanes = as_lanes(record)
    lanes.R = 0.5 * lanes.R
    for pin in range(4):
        for k in range(3):
            lanes.pin_axis[pin, k] = where(lanes.R > 1, lanes.R, lanes.pin_axis[pin, k])
    return lanes.n_stations[0]


def test_records_are_read_and_written_lane_by_lane():
    record = aligned_zeros(1, lane_dtype(PARAM)).view(np.recarray)[0]
    record.R[:], record.n_stations[:], record.pin_axis[...] = np.arange(WIDTH), 2, -1.0
    assert halve_all(record) == 2
    np.testing.assert_array_equal(record.R, 0.5 * np.arange(WIDTH))
    np.testing.assert_array_equal(record.pin_axis[3, 2], np.where(record.R > 1, record.R, -1.0))


@pytest.fixture(scope="module")
def mixed(cirelli):
    """Joints of all laws, tight and wide, some that halve their steps, some that fail, some outside the model.

    The output shafts of a third of them slide, with and without support.
    """
    rng = np.random.default_rng(11)
    rows = []
    for law in LAWS:
        joint = joint_with_law(law)
        n = 7
        operation = joints.Operation.model_construct(alpha=0.3, speed=52.0, torque=100.0)
        errors = joints.nominal_errors(n, CARDAN)
        for name in errors.dtype.names:
            if "offset" in name or "diameter" in name:
                errors[name] = rng.normal(0, 2e-5, n)
            elif "tilt" in name:
                errors[name] = rng.normal(0, 2e-3, n)
        errors["operation.torque"][3], errors["operation.speed"][4] = 5.0 - 100.0, 300.0 - 52.0
        errors["operation.alpha"][5] = 0.9 - 0.3
        rows.append(joints.perturb(joint, operation, errors))
    params = np.concatenate(rows)
    params["clearance"][6] = -1e-5
    params["clearance"][9], params["c_t"][16] = 0.0, 0.0
    free, held = sliding(params[::4].copy(), 0.0, 2e4, 0.0), sliding(params[1::4].copy())
    params = np.concatenate([params, free, held])
    return params[rng.permutation(len(params))]


def assert_same(a, b):
    for name in a.dtype.names:
        np.testing.assert_array_equal(a[name], b[name], err_msg=name)


def alone(params, options, monkeypatch):
    results = np.zeros(len(params), RESULT).view(np.recarray)
    left = np.full(len(params), iterations_allowed(options.steps_per_rev, options.max_revs))
    monkeypatch.setattr(simulation, "width", lambda: 1)
    samples = {i: own.copy() for i, own in simulation.simulate_together(params, options, left, True, results)}
    monkeypatch.undo()
    stationary.fill_intervals(results)
    results["clearance"] = params["clearance"]
    return results, samples


@pytest.mark.parametrize(
    "options",
    [
        FAST,
        FAST._replace(start=int(Start.RAMP), settle_tol=1e-3),
        FAST._replace(newton_max_iter=6, max_halvings=8),
        FAST._replace(max_halvings=0, newton_max_iter=4, max_revs=2),
        FAST._replace(method=int(Method.TR_BDF2), peak_substeps=4),
        FAST._replace(method=int(Method.TR_BDF2), start=int(Start.RAMP), newton_max_iter=6),
        STATIC,
        STATIC._replace(steps_per_rev=12),
        STATIC._replace(newton_max_iter=3, settle_tol=1e-12, max_revs=2),
    ],
)
def test_a_joint_has_the_same_bits_in_lanes_and_alone(mixed, options, monkeypatch):
    results, samples = alone(mixed, options, monkeypatch)
    together = simulation.simulate_rows(mixed, options, "full")
    assert_same(together.results, results)
    for i in np.flatnonzero(np.isin(results.status, simulation.SIMULATED)):
        np.testing.assert_array_equal(together.histories["loads"][i], samples[i]["components"].astype("f4"))
        np.testing.assert_array_equal(together.histories["tau"][i], samples[i]["tau"])
    if (options.newton_max_iter == 6 and options.method == Method.BDF2) or options.steps_per_rev == 12:
        assert ((results.status == Status.OK) & (results.halvings > 0)).any()


@pytest.mark.parametrize("start", Start)
@pytest.mark.parametrize("method", Method)
def test_lanes_take_the_steps_of_a_plain_driver(mixed, method, start):
    """States at every point of the second revolution, m and rad, beside those of `stepping`; two joints may whirl."""
    options = Options(method=int(method), start=int(start), max_revs=2, settle_tol=1e-12, newton_tol=1e-9)
    rows = [params for params in np.split(mixed, len(mixed)) if params["clearance"].min() > 0][:6]
    results = np.zeros(len(rows), RESULT).view(np.recarray)
    left, n, apart = np.full(len(rows), 10**6), options.steps_per_rev, np.full(len(rows), np.inf)
    for i, samples in simulation.simulate_together(np.concatenate(rows), options, left, True, results):
        points, _ = trajectory.follow(rows[i], options, 2 * n)
        apart[i] = np.abs(np.roll(samples["q"], -1, axis=0) - points[n + 1 :, 0]).max()
    assert (apart < 1e-7).sum() >= 4


def test_the_mixed_joints_are_mixed(mixed):
    results = simulation.simulate_rows(mixed, FAST).results
    assert {Status.OK, Status.OUTSIDE_MODEL} < set(results["status"])
    assert len(np.unique(mixed["n_stations"])) > 1
    assert (results["halvings"] > 0).any()


@pytest.mark.parametrize("options", [FAST, STATIC])
def test_no_result_depends_on_lane_neighbours_order_or_patience(mixed, options, monkeypatch):
    results = simulation.simulate_rows(mixed, options).results
    order = np.random.default_rng(5).permutation(len(mixed))
    assert_same(simulation.simulate_rows(mixed[order], options).results, results[order])
    parts = [simulation.simulate_rows(part, options).results for part in np.split(mixed, [1, 4, 15])]
    assert_same(np.concatenate(parts), results)
    for patience in (1, WIDTH):
        monkeypatch.setattr(lockstep, "PATIENCE", patience)
        assert_same(simulation.simulate_rows(mixed, options).results, results)


def test_lanes_wait_for_a_tangent_no_longer_than_allowed(monkeypatch):
    plan = study.load(STUDY)
    options = plan.solver.options()._replace(max_refinements=0, peak_substeps=1)
    params = joints.perturb(plan.joint, plan.operation, sampling.draw(plan, range(1, 25)))
    results = simulation.simulate_rows(params, options).results
    evaluations = sum(int(results[name].sum()) for name in ("newton_iterations", "steps", "halvings"))
    monkeypatch.setattr(lockstep, "PATIENCE", WIDTH + 1)
    _, filled, tangents = kernel_states.tally(kernel_states.Sample(params, options))
    assert 0 < (filled - evaluations) / tangents <= lockstep.STANDSTILL


def test_a_tangent_serves_seven_degrees(params):
    """With a tolerance that no prediction meets, each fourth step of two degrees gets a new one."""
    made = simulation.simulate_rows(params(), Options(newton_tol=1e-10, peak_substeps=1, max_refinements=0)).results[0]
    assert made["status"] == Status.OK
    assert made["factorisations"] >= made["steps"] / 4
