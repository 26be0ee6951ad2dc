"""Joints whose speed and torque have orders: independent solutions, closed forms, energy, converged integrators."""

from __future__ import annotations

import numpy as np
import pytest

from tests.conftest import REFERENCE, sliding, with_orders
from tests.support import naive
from tests.support.closed_forms import pin_force
from tests.support.mechanisms import lump_kind
from tolstat import joint, sampling, study
from tolstat.common.cardan import CARDAN
from tolstat.common.tables import Fidelity, Method, Options, Status
from tolstat.joint import ideal
from tolstat.solver.simulation import simulate_rows

SHAFT_LOADS = ("axial", "lateral", "moment", "drive")
DEGREE = np.pi / 180


def behind_a_joint(alpha: float) -> list[tuple[int, float, float]]:
    """Orders of the output of an ideal joint: theta_o - theta = sum tan^2k(alpha / 2) / k sin(2 k theta)."""
    t = np.tan(alpha / 2) ** 2
    return [(2 * k, t**k / k, -k * np.pi) for k in range(1, 13)]


ORDERS = {
    "random_00_second15_90": {"speed": behind_a_joint(15 * DEGREE)[:5]},
    "random_01_speed1": {"speed": [(1, 0.02, 30 * DEGREE)]},
    "random_01_torque1": {"torque": [(1, 20.0, 45 * DEGREE)]},
}


def row_of(name):
    """The joint of a reference case."""
    case = study.load_case(REFERENCE / f"{name[:9]}.toml")
    errors = joint.nominal_errors(1, CARDAN)
    for key, value in case.errors.items():
        errors[key] = value
    return joint.perturb(case.joint, case.operation, errors).view(np.recarray), case.solver.options()


@pytest.mark.parametrize("settings", [{}, {"method": int(Method.TR_BDF2), "rtol": 1e-5}])
@pytest.mark.parametrize("name", ORDERS)
def test_reference_joints(name, settings):
    """An independent solution: largest loads of bushings and shafts."""
    par, options = row_of(name)
    rows = np.concatenate([with_orders(par, **ORDERS[name])] * 3)
    results = simulate_rows(rows, options._replace(**settings)).results
    assert (results["status"] == Status.OK).all()
    with np.load(REFERENCE / "orders.npz") as file:
        force, torque, shafts = (file[f"{name}__{load}"] for load in ("F", "T", "shafts"))
    np.testing.assert_allclose(results["F_max"][1], force, atol=1e-3 * force.max())
    np.testing.assert_allclose(results["T_max"][1], torque, atol=1e-3 * torque.max())
    found = [results[f"{load}_max"][1] for load in SHAFT_LOADS]
    of_shafts = [found[0][0], found[1][0], found[2][0], found[3][0], found[0][1], found[1][1], found[2][1]]
    measure = np.array([force.max(), force.max(), torque.max(), torque.max()] + [force.max()] * 2 + [torque.max()])
    assert (np.abs(of_shafts - shafts) < 1e-3 * measure).all()


def test_closed_form_of_the_input_is_the_naive_twin(params):
    par = with_orders(params(), speed=[(1, 0.1, 0.3), (4, 0.05, 2.0)], torque=[(3, 40.0, 1.0)])
    phase = np.linspace(0, 7, 50)
    theta, slope, bend, torque = (values[0] for values in ideal.input_motion(phase, par))
    np.testing.assert_allclose(theta, [naive.input_angle(x, par[0]) for x in phase], rtol=1e-13)
    np.testing.assert_allclose(torque, [naive.resisting_torque(x, par[0]) for x in phase], rtol=1e-13)
    h = 1e-5
    ahead, behind = (ideal.input_motion(phase + s * h, par) for s in (1, -1))
    np.testing.assert_allclose(slope, (ahead[0][0] - behind[0][0]) / (2 * h), rtol=1e-8)
    np.testing.assert_allclose(bend, (ahead[1][0] - behind[1][0]) / (2 * h), atol=1e-8)


@pytest.mark.parametrize("fidelity", [Fidelity.IDEAL, Fidelity.QUASISTATIC, Fidelity.DYNAMIC])
def test_two_equal_joints_turn_the_output_evenly(params, fidelity):
    """Behind an ideal joint of the same misalignment, forks in one plane: output speed constant, pin force known.

    Seherr-Thoss, Schmelz, Aucktor (2006), ch. 4: the pins carry T / cos(gamma) / (2 R').
    """
    alpha, torque = 30 * DEGREE, 100.0
    par = with_orders(params(alpha=alpha, speed=2 * np.pi / 60, torque=torque), speed=behind_a_joint(alpha))
    found = simulate_rows(par, Options(fidelity=int(fidelity)), histories="full")
    phase = 2 * np.pi * np.arange(180) / 180
    theta, slope, _, _ = (values[0] for values in ideal.input_motion(phase, par))
    output = found.histories["tau"][0].astype(float) * slope
    near = 1e-6 if fidelity == Fidelity.IDEAL else 1e-3  # the elastic joint has an error Psi of its own
    np.testing.assert_allclose(output, 1.0, atol=near)
    expected = pin_force(theta, alpha, torque, par.R[0] + par.station_s[0, 0, 0])
    force = np.linalg.norm(found.histories["loads"][0, :, 0, :3].astype(float), axis=1)
    np.testing.assert_allclose(force, expected, rtol=1e-6 if fidelity == Fidelity.IDEAL else 2e-3)


def test_torque_orders_of_the_ideal_joint_at_rest(params):
    """Without inertia the loads follow the resisting torque."""
    par = with_orders(params(alpha=20 * DEGREE, speed=2 * np.pi / 60), torque=[(2, 60.0, 0.7)])
    found = simulate_rows(par, Options(fidelity=int(Fidelity.IDEAL)), histories="full")
    phase = 2 * np.pi * np.arange(180) / 180
    torque = 100 + 60 * np.cos(2 * phase + 0.7)
    expected = pin_force(phase, 20 * DEGREE, 1.0, par.R[0] + par.station_s[0, 0, 0]) * torque
    force = np.linalg.norm(found.histories["loads"][0, :, 0, :3].astype(float), axis=1)
    np.testing.assert_allclose(force, expected, rtol=1e-5)


@pytest.mark.parametrize("fidelity", list(Fidelity))
def test_orders_that_cancel_change_nothing(params, random_errors, fidelity):
    plain = params(alpha=15 * DEGREE, **random_errors(3))
    cancelling = plain.copy()
    cancelling["n_orders"] = 2
    cancelling["order"][0, :2] = 2
    cancelling["speed_order"][0, :2] = [[0.01, 0.02], [-0.01, -0.02]]
    cancelling["torque_order"][0, :2] = [[5.0, 7.0], [-5.0, -7.0]]
    options = Options(fidelity=int(fidelity), newton_tol=1e-7)
    one, other = (simulate_rows(par, options).results for par in (plain, cancelling))
    np.testing.assert_allclose(other["F_max"], one["F_max"], rtol=1e-6)
    np.testing.assert_allclose(other["T_max"], one["T_max"], rtol=1e-6)


def test_shafts_that_turn_back_are_outside_of_the_model(params):
    par = with_orders(params(), speed=[(1, 0.6, 0.0), (2, 0.25, 0.0)])
    assert simulate_rows(par, Options()).results["status"][0] == Status.OUTSIDE_MODEL


def test_torque_that_reverses(params):
    """Mean torque at which the least transmitted torque is zero, by differences of the output angle."""
    alpha, speed = 20 * DEGREE, 100.0
    par = with_orders(params(alpha=alpha, speed=speed), speed=[(1, 0.1, 0.4)], torque=[(2, 30.0, 1.1)])
    phase = np.linspace(0, 2 * np.pi, 20001)
    theta = np.array([naive.input_angle(x, par[0]) for x in phase])
    turning = np.gradient(np.gradient(ideal.output_angle(theta, alpha), phase), phase)[5:-5] * speed**2
    arm = lump_kind("arm")
    inertia = par.Js[0, 0] + 2 * (par.mass[0, arm] * par.R[0] ** 2 + par.inertia[0, arm, 2])
    swing = 30 * np.cos(2 * phase + 1.1)[5:-5] + inertia * turning
    assert ideal.reversal_torque(par)[0] == pytest.approx(-swing.min(), rel=1e-4)


def drawn(n: int, seed: int = 0) -> np.recarray:
    """Joints of the study with ISO 2768-f, each with orders of its own; every other shaft is free."""
    plan = study.load(study_path("rigid_shafts"), n=n)
    par = joint.perturb(plan.joint, plan.operation, sampling.draw(plan)).view(np.recarray)
    rng = np.random.default_rng(seed)
    for i in range(n):
        waves = [[(k, rng.uniform(0, size), rng.uniform(0, 6)) for k in (1, 2, 4)] for size in (0.02, 10.0)]
        with_orders(par[i : i + 1], *waves)
    sliding(par[::2], 0.0, 2e4, 0.0)
    return par


def study_path(name):
    return REFERENCE.parents[1] / "studies" / f"{name}.toml"


@pytest.mark.slow
def test_two_converged_integrators_agree():
    """Uniform steps of BDF2 and error-controlled ones of TR-BDF2, for 100 joints with orders, half of them free.

    The shafts' loads ring more where contacts switch.
    """
    par = drawn(100)
    fine = simulate_rows(par, Options(steps_per_rev=2880)).results
    controlled = simulate_rows(par, Options(method=int(Method.TR_BDF2), rtol=1e-6)).results
    assert (fine["status"] == Status.OK).all()
    assert (controlled["status"] == Status.OK).all()
    for load, measure, bound in (
        ("F_max", "F_max", 1e-3),
        ("T_max", "T_max", 1e-3),
        ("lateral_max", "F_max", 5e-3),
        ("moment_max", "T_max", 5e-3),
    ):
        changes = np.abs(fine[load] - controlled[load]).max(axis=1) / fine[measure].max(axis=1)
        assert changes.max() < bound, load


@pytest.mark.slow
def test_torque_orders_up_to_the_mean_torque_end_in_a_status():
    par = drawn(512)
    rng = np.random.default_rng(1)
    for i in range(len(par)):
        with_orders(par[i : i + 1], torque=[(2, par.torque[i] * rng.uniform(0.5, 1.0), rng.uniform(0, 6))])
    results = simulate_rows(par, Options()).results
    assert np.isin(results["status"], [Status.OK, Status.STATIONARY]).mean() > 0.98
    assert (results["status"] != Status.PENDING).all()
