"""Joints from their start to a settled revolution: reference joints, closed forms, symmetries, convergence."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from tests.conftest import REFERENCE, REFERENCE_CASES, with_law
from tests.support.closed_forms import pin_force
from tests.support.environment import ROOT
from tests.support.mechanisms import lump_kind
from tests.support.of_cardan import CARDAN, LOAD_KINDS, RESULT
from tolstat import joint, sampling, study
from tolstat.campaign import replay
from tolstat.campaign.remedy import Reason, remedy
from tolstat.common.load_kinds import RESULTANT, measure_of
from tolstat.common.tables import SIMULATED, Fidelity, Method, Mode, Options, Start, Status, iterations_allowed
from tolstat.joint import ideal
from tolstat.kernel.mechanics import dynamics
from tolstat.kernel.mechanics.work import FORCE, make_work
from tolstat.solver import simulation
from tolstat.solver.histories import restore
from tolstat.solver.simulation import simulate_rows

OPTIONS = Options()
TWIST = {"pin1__tilt_z": 0.005, "pin3__offset_t": 3e-5, "hole2__tilt_t": -0.004, "hole4__offset_e": 4e-5}


def full(par, **options):
    """Results row and load histories of one joint."""
    r = simulate_rows(par, OPTIONS._replace(**options), "full")
    return r.results[0], {name: values[0].astype(float) for name, values in r.histories.items()}


@pytest.fixture(scope="module")
def reference():
    with np.load(REFERENCE / "loads.npz") as file:
        return dict(file)


@pytest.mark.parametrize("name", REFERENCE_CASES)
def test_reference_joints(reference, name):
    """Every component at every angle within 1e-3 of the largest of its kind, and the maxima too."""
    case = study.load_case(REFERENCE / f"{name}.toml")
    result = replay.simulate_case(case)
    row = result.simulation.results[0]
    assert row["status"] == Status.OK
    largest = reference[f"{name}__max"]
    for k, kind in enumerate(("F_max", "T_max")):
        np.testing.assert_allclose(row[kind], largest[:, k], atol=1e-3 * largest[:, k].max())
    histories = {key: values[0] for key, values in result.simulation.histories.items()}
    loads = reference[f"{name}__loads"]
    for k, part in enumerate((slice(0, 3), slice(3, 6))):
        np.testing.assert_allclose(histories["loads"][..., part], loads[..., part], atol=1e-3 * largest[:, k].max())
    np.testing.assert_allclose(histories["tau"], reference[f"{name}__tau"], atol=2e-4)
    if f"{name}__contact" in reference:
        contact = reference[f"{name}__contact"]
        np.testing.assert_allclose(halves(case), contact, atol=1e-3 * contact.max())


def halves(case):
    """Normal force on the outer and inner half of each pin over the revolution; a station in the middle is on both."""
    errors = joint.nominal_errors(1, CARDAN)
    for key, value in case.errors.items():
        errors[key] = value
    par = joint.perturb(case.joint, case.operation, errors).view(np.recarray)
    options = case.solver.options()
    left = np.full(1, iterations_allowed(options.steps_per_rev, options.max_revs))
    ((_, samples),) = simulation.simulate_together(par, options, left, True, np.zeros(1, RESULT).view(np.recarray))
    work, found = make_work(), np.zeros((len(samples), 4, 2))
    outer = np.sign(par.station_s[0, 0, : par.n_stations[0, 0]]) / 2 + 0.5
    for k, sample in enumerate(samples):
        dynamics.forces(2 * np.pi * k / len(samples) / par.omega[0], sample["q"], sample["v"], par[0], work)
        force = work.station[:, : par.n_stations[0, 0], FORCE]
        found[k] = np.stack([force @ outer, force @ (1 - outer)], axis=1)
    return found


def test_straight_ideal_joint_carries_its_torque_at_the_outer_ends(params):
    """T_r / (2 (R + z/2)) on each pin, from statics (596.5 N), and the contact stays at one end."""
    par = params()
    row, histories = full(par)
    force = par.torque[0] / (2 * (par.R[0] + 0.011))
    assert force == pytest.approx(596.5, abs=0.1)
    np.testing.assert_allclose(histories["contact"][:, :, 0], force, rtol=2e-3)
    np.testing.assert_allclose(histories["contact"][:, :, 1], 0.0)
    assert (row["mode_share"][:, Mode.ONE_POINT] == 1).all()
    # constant in these coordinates, up to where Newton stops
    assert np.ptp(histories["loads"], axis=0).max() < 1e-2


def output_acceleration(theta, alpha, omega):
    """Angular acceleration of the ideal output shaft by differences of the closed form, rad/s^2."""
    h = 1e-5
    change = ideal.speed_ratio(theta + h, alpha) - ideal.speed_ratio(theta - h, alpha)
    return change / (2 * h) * omega**2


@pytest.mark.parametrize("rpm", [20.0, 500.0])
def test_bent_ideal_joint_follows_the_closed_form(params, rpm):
    """Contact force between T/(2(R+z/2)) and that over cos(alpha), T with the inertia of shaft and arms."""
    alpha, omega = np.radians(15), rpm * np.pi / 30
    par = params(alpha=alpha, speed=omega)
    _, histories = full(par)
    theta = np.linspace(0, 2 * np.pi, 180, endpoint=False)
    outer = par.R[0] + 0.011
    force = pin_force(theta, alpha, 100.0, outer)
    assert force.min() == pytest.approx(596.5, abs=0.1)
    assert force.max() == pytest.approx(596.5 / np.cos(alpha), abs=0.2)
    arm = lump_kind("arm")
    arms = 2 * (par.mass[0, arm] * par.R[0] ** 2 + par.inertia[0, arm, 2])
    torque = 100.0 + (par.Js[0, 0] + arms) * output_acceleration(theta, alpha, omega)
    expected = pin_force(theta, alpha, 1.0, outer) * torque
    total = histories["contact"][:, :, RESULTANT]
    np.testing.assert_allclose(total[:, :2].mean(axis=1), expected, rtol=3e-3)
    if rpm < 100:  # without noticeable inertia every pin stays between the bounds
        assert total.min() > 0.999 * force.min()
        assert total.max() < 1.001 * force.max()


@pytest.mark.parametrize("alpha", [0.0, np.radians(15)])
def test_speed_ratio_of_the_joint_without_errors_is_the_ideal_one(params, alpha):
    _, histories = full(params(alpha=alpha))
    theta = np.linspace(0, 2 * np.pi, 180, endpoint=False)
    psi = (histories["tau"] - ideal.speed_ratio(theta, alpha)) / histories["tau"]
    assert np.abs(psi).mean() < 1e-4


SWAP_ALL = {"pin1": "pin2", "pin2": "pin1", "pin3": "pin4", "pin4": "pin3"}
SWAP_ALL |= {"hole1": "hole2", "hole2": "hole1", "hole3": "hole4", "hole4": "hole3"}
SWAP_OUTPUT = {"pin1": "pin2", "pin2": "pin1", "hole3": "hole4", "hole4": "hole3"}


def permuted(errors, swap):
    return {
        f"{swap.get(name[: name.index('__')], name[: name.index('__')])}{name[name.index('__') :]}": value
        for name, value in errors.items()
    }


class TestSymmetries:
    """The group of order 8 made by half turn, change of side, and mirror image maps joints to joints.

    Half turn: the joint begun half a revolution later, features exchanged across the axis. Side: the output shaft
    inclined to the other side, which is the same joint half a revolution later. Mirror: reflected in the plane of the
    shafts, where rotation and torque change sign, and with them offset_t, tilt_z (an axial vector), F_t, T_e, T_z.
    """

    ALPHA = np.radians(12)

    def histories(self, params, errors, alpha=ALPHA, sign=1.0, **options):
        par = params(alpha=alpha, speed=sign * 60.0, torque=sign * 80.0, **errors)
        row, histories = full(par, settle_tol=1e-6, **options)
        assert row["status"] == Status.OK
        return histories

    def loads(self, *given, **options):
        return self.histories(*given, **options)["loads"]

    @staticmethod
    def assert_same(a, b):
        for part in (slice(0, 3), slice(3, 6)):
            np.testing.assert_allclose(a[..., part], b[..., part], atol=2e-5 * np.abs(a[..., part]).max())

    def test_half_turn(self, params, random_errors):
        errors = random_errors(5)
        there = self.loads(params, permuted(errors, SWAP_ALL))
        here = np.roll(self.loads(params, errors), 90, axis=0)[:, [1, 0, 3, 2, 5, 4, 7, 6]]
        self.assert_same(here, there)

    def test_side(self, params, random_errors):
        errors = random_errors(5)
        there = self.loads(params, errors, alpha=-self.ALPHA)
        self.assert_same(np.roll(self.loads(params, errors), 90, axis=0), there)

    @pytest.mark.parametrize("fidelity", [Fidelity.DYNAMIC, Fidelity.QUASISTATIC])
    def test_mirror(self, params, random_errors, fidelity):
        errors = random_errors(5)
        flipped = {
            name: -value if name.endswith(("offset_t", "tilt_z")) else value
            for name, value in permuted(errors, SWAP_OUTPUT).items()
        }
        there = self.histories(params, flipped, sign=-1.0, fidelity=int(fidelity))
        here = self.histories(params, errors, fidelity=int(fidelity))
        # both count their samples in their own sense of rotation
        self.assert_same(here["loads"][:, [1, 0, 2, 3, 4, 5, 7, 6]] * [1, -1, 1, -1, 1, -1], there["loads"])
        plain = self.histories(params, {}, fidelity=int(fidelity))["tau"]
        np.testing.assert_allclose(there["tau"], here["tau"], atol=1e-2 * np.abs(here["tau"] - plain).max())


def test_the_clearance_of_each_pin_is_a_result_whatever_becomes_of_the_joint(params):
    par = np.concatenate([params(), params(pin2__clearance=2e-5, hole1__diameter=2e-5), params(pin4__clearance=-2e-4)])
    results = simulate_rows(par, Options(fidelity=int(Fidelity.IDEAL))).results
    assert results["status"].tolist() == [Status.OK, Status.OK, Status.OUTSIDE_MODEL]
    expected = 1e-4 + np.array([[0, 0, 0, 0], [0, 2e-5, 1e-5, 0], [0, 0, 0, -2e-4]])
    np.testing.assert_allclose(results["clearance"], expected, rtol=1e-9)


def test_ramp_and_static_start_settle_to_the_same_revolution(params):
    par = params(alpha=0.2, pin1__tilt_z=0.004, pin3__offset_t=3e-5, hole4__offset_e=4e-5)
    static, a = full(par, start=int(Start.STATIC), settle_tol=1e-6, newton_tol=1e-9)
    assert static["halvings"] == 0  # else a contact that switches is followed by shorter steps in one revolution only
    ramp, b = full(par, start=int(Start.RAMP), settle_tol=1e-6, newton_tol=1e-9)
    assert static["status"] == ramp["status"] == Status.OK
    assert ramp["revolutions"] >= static["revolutions"]
    np.testing.assert_allclose(a["loads"], b["loads"], atol=2e-5 * np.abs(b["loads"]).max())


METHODS = pytest.mark.parametrize("method", list(Method))
TIGHT = {"settle_tol": 1e-7, "newton_tol": 1e-9, "max_revs": 40, "max_refinements": 0}


def test_a_smooth_joint_settles_early_in_the_revolution_that_it_would_repeat(params):
    early, samples = full(params(pin1__tilt_z=0.001, hole2__offset_t=1e-5))
    late, again = full(
        params(pin1__tilt_z=0.001, hole2__offset_t=1e-5), settle_tol=1e-14, max_revs=4, max_refinements=0
    )
    assert (early["status"], late["status"]) == (Status.OK, Status.NOT_SETTLED)
    assert early["revolutions"] < 1.1
    assert early["step_error"] < 0.02
    for loads, repeated in ((samples["loads"][..., :3], again["loads"][..., :3]), (samples["loads"], again["loads"])):
        assert np.abs(loads - repeated).max() < 1e-5 * np.abs(repeated).max()


@pytest.mark.parametrize("name", ["rigid_shafts", "iso2768_f"])
def test_smooth_joints_settle_in_their_second_revolution(name):
    """Their loads are those after many revolutions, a shaft that is free along its axis included."""
    plan = study.load(ROOT / "studies" / f"{name}.toml")
    params = joint.perturb(plan.joint, plan.operation, sampling.draw(plan, range(1, 65)))
    early = simulate_rows(params, OPTIONS._replace(peak_substeps=1, max_refinements=0)).results
    late = simulate_rows(params, OPTIONS._replace(peak_substeps=1, max_refinements=0, settle_tol=1e-8)).results
    smooth = early["step_error"] <= 0.02
    assert smooth.mean() > 0.7
    assert (early["revolutions"] < 2)[smooth].mean() > 0.95
    if name == "rigid_shafts":
        assert early["revolutions"][smooth].mean() < 1.13  # 1.16 if joints start from rest
    assert late["revolutions"].min() > 2
    for kind in (kind for kind in LOAD_KINDS if kind.decides):
        largest = late[f"{measure_of(kind).key}_max"].max(axis=1)
        change = np.abs(early[f"{kind.key}_max"] - late[f"{kind.key}_max"]).max(axis=1)
        assert (change < 1e-4 * largest)[smooth].all()


@METHODS
def test_load_histories_of_a_joint_whose_contacts_stay_are_of_order_two(params, method):
    par = params(alpha=np.radians(15), pin1__tilt_z=np.radians(0.5))
    fine = full(par, steps_per_rev=1440, method=int(method), **TIGHT)[1]["loads"]
    errors = []
    for steps in (36, 72, 144):
        coarse = full(par, steps_per_rev=steps, method=int(method), **TIGHT)[1]["loads"]
        errors.append(np.sqrt(np.mean((coarse - fine[:: 1440 // steps])[..., :3] ** 2)))
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (slopes > 1.7).all(), (errors, slopes)


@METHODS
def test_largest_loads_of_a_joint_whose_contacts_switch_still_converge(params, method):
    """Ringing after a switch costs the histories their order; docs/notes/accuracy.md states the slopes measured."""
    par = params(alpha=np.radians(15), **TWIST)
    fine = full(par, steps_per_rev=1440, method=int(method), **TIGHT)[0]["F_max"]
    errors = []
    for steps in (45, 90, 180):
        coarse = full(par, steps_per_rev=steps, method=int(method), **TIGHT)[0]["F_max"]
        errors.append(np.abs(coarse - fine).max())
    assert errors[0] > errors[1] > errors[2]
    assert 0.5 * np.log2(errors[0] / errors[2]) > 1.0, errors
    assert errors[-1] < 1e-4 * fine.max()


@pytest.mark.parametrize("clearance", [0.0, 1e-7, 5e-6, 5e-5, 2e-4, 8e-4])
def test_any_clearance_starts(params, clearance):
    errors = {f"pin{i}__diameter": 2e-4 - 2 * clearance for i in (1, 2, 3, 4)}
    row = simulate_rows(params(alpha=0.2, pin1__tilt_z=2e-3, hole3__offset_t=2e-5, **errors), OPTIONS).results[0]
    assert row["status"] == Status.OK
    assert row["halvings"] < 50


@pytest.mark.parametrize(
    "errors",
    [
        {"pin2__diameter": 3e-4},
        {"operation__alpha": np.pi / 2},
        {"operation__alpha": 2.0},
        {"speed": 0.0},
        {"operation__torque": np.nan},
        {"material__E_factor": 0.0},
        {"material__E_factor": -0.5},
    ],
)
def test_what_the_model_has_no_meaning_for_is_marked(params, errors):
    row = simulate_rows(params(**errors), OPTIONS).results[0]
    assert row["status"] == Status.OUTSIDE_MODEL
    assert np.isnan(row["F_max"]).all()


def test_not_settled_is_said_and_results_kept(params):
    row = simulate_rows(params(alpha=0.2), OPTIONS._replace(max_revs=2, settle_tol=1e-15, max_refinements=0)).results[0]
    assert row["status"] == Status.NOT_SETTLED
    assert row["settled"] == 0
    assert row["closure"] > 1e-15
    assert np.isfinite(row["F_max"]).all()
    alone = simulate_rows(params(), OPTIONS._replace(max_revs=1, max_refinements=0)).results[0]
    assert alone["status"] == Status.NOT_SETTLED
    assert np.isnan(alone["closure"])


def test_failure_of_newton_is_said_and_nothing_invented(params):
    par = params(alpha=0.3)
    par.mass[0, lump_kind("hub")] = np.nan
    row = simulate_rows(par, OPTIONS).results[0]
    assert row["status"] == Status.NEWTON_FAILED
    assert np.isnan(row["F_max"]).all()


def test_without_an_equilibrium_the_remedy_is_dynamic(params):
    par = params(alpha=0.3)
    par.mass[0, lump_kind("hub")] = np.nan
    row = simulate_rows(par, OPTIONS._replace(fidelity=Fidelity.QUASISTATIC)).results[0]
    said = remedy(row, OPTIONS._asdict())
    assert "no equilibrium" in said
    again = Reason(Status(int(row["status"])), 1, 1, said, "").retry
    assert again == "--retry newton_failed --set solver.fidelity=dynamic"


@pytest.mark.slow
def test_a_joint_without_torque_ends(params):
    row = simulate_rows(params(alpha=0.2, torque=0.0), OPTIONS._replace(max_revs=4)).results[0]
    assert row["status"] in SIMULATED
    assert np.isfinite(row["F_max"]).all()


def test_a_row_does_not_depend_on_the_rows_before_it(params, random_errors):
    table = np.concatenate([params(alpha=0.2, **random_errors(k)) for k in (1, 2, 3)])
    table["mass"][1, lump_kind("hub")] = np.nan
    together = simulate_rows(table, OPTIONS).results
    alone = np.concatenate([simulate_rows(table[k : k + 1], OPTIONS).results for k in (2, 1, 0)])[::-1]
    for name in RESULT.names:
        np.testing.assert_array_equal(together[name], alone[name])


def test_harmonics_restore_the_trace_to_the_error_they_state(params):
    par = params(alpha=np.radians(15), **TWIST)
    _, exact = full(par)
    kept = {k: v[0] for k, v in simulate_rows(par, OPTIONS, "harmonics", n_harmonics=24).histories.items()}
    restored = restore(kept["coefficients_real"], kept["coefficients_imag"], 180)
    assert restored.shape == (180, 8, 6)
    for k, part in enumerate((slice(0, 3), slice(3, 6))):
        size = np.linalg.norm(exact["loads"][..., part], axis=-1).max()
        difference = np.abs(restored - exact["loads"])[..., part].max()
        assert difference / size == pytest.approx(kept["harmonics_error"][k], rel=1e-2, abs=1e-6)
        assert difference / size < 0.05
    every = {k: v[0] for k, v in simulate_rows(par, OPTIONS, "harmonics", n_harmonics=500).histories.items()}
    restored = restore(every["coefficients_real"], every["coefficients_imag"], 180)
    np.testing.assert_allclose(restored, exact["loads"], atol=1e-5 * np.abs(exact["loads"]).max())


@pytest.mark.parametrize("law", ["uniform", "point", "sliced"])
def test_other_laws_share_the_statics(params, law):
    """Whatever the law, two opposite output pins carry equal tangential forces at alpha = 0."""
    par = with_law(params(pin1__tilt_z=2e-3), law)
    row, histories = full(par)
    assert row["status"] == Status.OK
    pins = histories["contact"][:, :, RESULTANT]
    np.testing.assert_allclose(pins[:, 0], pins[:, 1], rtol=2e-2)


PROBE = """
import numpy as np
from tolstat import joint
from tolstat.common.cardan import CARDAN
from tolstat.common.tables import Options, tables
from tolstat.solver import simulation
operation = joint.Operation.model_construct(alpha=0.3, speed=50.0, torque=100.0)
par = joint.perturb(joint.load("cirelli2021", {}, "test", None), operation, joint.nominal_errors(1, CARDAN))
par = par.view(np.recarray)
"""


def python(code):
    done = subprocess.run(
        [sys.executable, "-c", PROBE + code],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
def test_nothing_is_allocated_per_step():
    code = """
from numba.core.runtime import _nrt_python, rtsys
_nrt_python.memsys_enable_stats()
out = np.zeros(1, tables(CARDAN).RESULT).view(np.recarray)
counts = []
for revolutions in (2, 2, 4):
    options = Options(max_revs=revolutions, settle_tol=1e-12)
    simulation.lanes(options, simulation.width())
    before = rtsys.get_allocation_stats().alloc
    list(simulation.simulate_together(par, options, np.full(1, 10**6), False, out))
    counts.append(rtsys.get_allocation_stats().alloc - before)
    assert out[0].steps > 150 * revolutions
print(counts)
"""
    _, two, four = eval(python(code))
    assert two == four


@pytest.mark.slow
def test_a_second_process_finds_the_compiled_kernel():
    code = """
from tolstat.kernel.lanes.lockstep import lockstep
from tolstat.solver.compilation import warm_up
warm_up()
print(sum(lockstep.stats.cache_hits.values()), sum(lockstep.stats.cache_misses.values()))
"""
    python(code)
    assert python(code).split() == ["1", "0"]


def test_results_have_the_layout_of_the_table(params):
    assert simulate_rows(params(), OPTIONS).results.dtype == RESULT
