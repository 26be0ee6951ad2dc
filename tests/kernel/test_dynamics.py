"""Equations of motion against their naive twin in world coordinates, and the linear algebra against LAPACK."""

from __future__ import annotations

import numpy as np
import pytest

from tests.conftest import sliding, with_law, with_orders
from tests.support import naive
from tests.support.kernel_states import dense
from tests.support.mechanisms import N_DOF, N_LUMPS, PSI, S, body
from tolstat.common.cardan import CARDAN
from tolstat.common.load_kinds import INNER, OUTER, RESULTANT
from tolstat.common.tables import Mode, Options
from tolstat.joint.contact import LAWS
from tolstat.kernel.mechanics import dynamics, linsolve, tangent
from tolstat.kernel.mechanics.motion import ideal_motion, to_hole, to_pin, velocity_in
from tolstat.kernel.mechanics.work import make_work, work_fields

OPTIONS = Options()


SHAFTS = pytest.mark.parametrize("shaft", ["rigid", "sliding"])
ORDERS = pytest.mark.parametrize("orders", [{}, {"speed": [(1, 0.2, 0.5), (3, 0.1, 2.0)], "torque": [(2, 70.0, 1.0)]}])


def loaded(params, random_errors, law, seed=1, alpha=0.4, shaft="rigid", **orders):
    """A joint with errors in the midst of contact: pins pressed some 10 um into their holes, all moving."""
    par = with_orders(params(alpha=alpha, speed=80.0, **random_errors(seed)), **orders)[0]
    with_law(par, law)
    if shaft == "sliding":
        sliding(par)
    par.clearance[:] = 1e-5
    rng = np.random.default_rng(seed)
    q = rng.normal(0, 2e-5, N_DOF)
    q[:PSI].reshape(N_LUMPS, 6)[:, 3:] = rng.normal(0, 5e-3, (N_LUMPS, 3))
    v = rng.normal(0, 1e-2, N_DOF)
    v[S] = 0.1
    return par, 0.017, q, v


@ORDERS
@pytest.mark.parametrize("alpha", [0.0, 0.26, 1.2])
@pytest.mark.parametrize("phase", [0.0, 0.7, 2.0, 4.0, 5.9])
def test_frames_are_those_of_the_output_shaft(params, phase, alpha, orders):
    """C Ry(gamma) = Ry(alpha) Rz(theta_o), and angular velocities are the derivatives of the attitudes."""
    work = make_work()
    omega, h = 3.0, 1e-5
    par = with_orders(params(alpha=alpha, speed=omega), **orders)[0]
    ideal_motion(phase, par, work)
    angles = (naive.input_angle(phase + s * omega * h, par) for s in (0, 1, -1))
    here, ahead, behind = (naive.frames(theta, par) for theta in angles)
    shaft = here[2] @ naive.Z
    np.testing.assert_allclose(shaft, [np.sin(alpha), 0, np.cos(alpha)], atol=1e-15)
    for k in range(3):
        rate = here[k].T @ (ahead[k] - behind[k]) / (2 * h)
        w = np.array([rate[2, 1], rate[0, 2], rate[1, 0]])
        np.testing.assert_allclose(work.frame_w[k], w, atol=2e-7)
    speed = {}
    for s in (1, -1):
        ideal_motion(phase + s * omega * h, par, work)
        speed[s] = work.frame_w.copy()
    ideal_motion(phase, par, work)
    np.testing.assert_allclose(work.frame_dw, (speed[1] - speed[-1]) / (2 * h), atol=2e-6 * (1 + np.tan(alpha) ** 4))
    for hinge, k in enumerate((0, 2)):
        relative, x, dx = here[k].T @ here[1], np.array([0.3, -0.5, 0.8]), np.array([0.2, 0.7, -0.4])
        np.testing.assert_allclose(to_hole(hinge, x, par, work), relative @ x, atol=1e-14)
        np.testing.assert_allclose(to_pin(hinge, x, par, work), relative.T @ x, atol=1e-14)
        swept = np.cross(relative @ work.frame_w[1] - work.frame_w[k], x)
        np.testing.assert_allclose(
            velocity_in(hinge, dx, x, par, work), dx + swept, atol=1e-13 * (1 + np.tan(alpha) ** 2)
        )


@SHAFTS
@pytest.mark.parametrize("law", LAWS)
def test_loads_are_those_of_the_naive_twin(params, random_errors, law, shaft):
    par, t, q, v = loaded(params, random_errors, law, shaft=shaft)
    work = make_work()
    dynamics.forces(t, q, v, par, work)
    assert (work.contact[:, RESULTANT] > 100).all(), "the test wants every pin in contact"
    loads = naive.forces(t, q, v, par).bushing
    np.testing.assert_allclose(work.load, loads, rtol=1e-6, atol=1e-4 * np.abs(loads).max())
    contacts = naive.contacts(t, q, v, par)
    assert (contacts[:, OUTER] != contacts[:, INNER]).all(), "the test wants ends that differ"
    np.testing.assert_allclose(work.contact, contacts, rtol=1e-4)


@pytest.mark.parametrize("law", ["mode", "sliced"])
def test_contact_modes_are_those_of_the_naive_twin(params, random_errors, law):
    seen = set()
    for seed in range(12):
        par, t, q, v = loaded(params, random_errors, law, seed)
        par.clearance[:] = 1e-5 * 2.0 ** (seed % 5)
        work = make_work()
        dynamics.forces(t, q, v, par, work)
        modes = [Mode(m).name for m in work.mode]
        assert modes == naive.forces(t, q, v, par).modes
        seen |= set(modes)
    assert seen == set(Mode.__members__), "the test wants to see every mode"


@ORDERS
@SHAFTS
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("seed", [1, 2])
def test_accelerations_balance_the_naive_twin(params, random_errors, law, seed, shaft, orders):
    """Momentum and angular momentum of every body change by the forces on it, in world coordinates."""
    par, t, q, v = loaded(params, random_errors, law, seed, shaft=shaft, **orders)
    work, a = make_work(), np.full(N_DOF, np.nan)
    dynamics.acceleration(t, q, v, par, OPTIONS, work, a)
    force = work.force.copy()
    off = naive.imbalance(t, q, v, a, par)
    for name, difference in off.items():
        scale = np.abs(force).max() if name != "psi" else np.abs(force[body("output"), 5])
        assert np.abs(difference).max() < 1e-9 * scale, name
    assert ("s" in off) == (shaft == "sliding")
    assert (a[S] == 0) == (shaft == "rigid")


@SHAFTS
def test_residual_of_the_acceleration_is_zero(params, random_errors, shaft):
    par, t, q, v = loaded(params, random_errors, "mode", shaft=shaft)
    work, a, out = make_work(), np.full(N_DOF, np.nan), np.full(N_DOF, np.nan)
    dynamics.acceleration(t, q, v, par, OPTIONS, work, a)
    dynamics.residual(t, q, v, a, par, OPTIONS, work, out)
    assert np.abs(out).max() < 1e-11 * np.abs(work.force).max()


@SHAFTS
@pytest.mark.parametrize("law", LAWS)
def test_tangent_is_the_derivative_of_the_residual(params, random_errors, law, shaft):
    """Up to what the tangent leaves out on purpose, which must cost Newton less than a tenth a step."""
    par, t, q, v = loaded(params, random_errors, law, shaft=shaft)
    work, cv = make_work(), 2000.0
    ca = cv * cv
    a = np.zeros(N_DOF)
    out = np.full((2, N_DOF), np.nan)
    derivative = np.empty((N_DOF, N_DOF))
    for j in range(N_DOF):
        step = np.zeros(N_DOF)
        step[j] = 1e-9
        for k, sign in enumerate((1, -1)):
            d = sign * step
            dynamics.residual(t, q + d, v + cv * d, a + ca * d, par, OPTIONS, work, out[k])
        derivative[:, j] = (out[0] - out[1]) / 2e-9
    dynamics.residual(t, q, v, a, par, OPTIONS, work, out[0])
    tangent.assemble(cv, ca, cv, par, work)
    if shaft == "rigid":  # its s stays as it is: residual zero, tangent one
        assert not derivative[S].any()
        assert not derivative[:, S].any()
        derivative[S, S] = 1.0
    contraction = np.eye(N_DOF) - np.linalg.solve(dense(work), derivative)
    assert np.abs(np.linalg.eigvals(contraction)).max() < 0.1


@SHAFTS
@pytest.mark.parametrize("law", ["mode", "sliced"])
def test_block_elimination_is_lapack(params, random_errors, law, shaft):
    par, t, q, v = loaded(params, random_errors, law, shaft=shaft)
    doubles = np.dtype([(name, "f8", shape) for name, shape in work_fields(CARDAN).items()])
    work = np.zeros(1, doubles).view(np.recarray)[0]
    dynamics.forces(t, q, v, par, work)
    tangent.assemble(2000.0, 4e6, 2000.0, par, work)
    full = dense(work)
    rhs = np.random.default_rng(0).normal(size=N_DOF)
    expected = np.linalg.solve(full, rhs)
    assert linsolve.factorise(par, work)
    work.solution[:] = rhs
    linsolve.solve(np.zeros(N_DOF), par, work)
    np.testing.assert_allclose(work.solution, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())


@SHAFTS
def test_single_precision_bears_the_shortest_steps(params, random_errors, shaft):
    """With steps of 10 ns, m / h^2 is some 1e17 N/m, and a product of three of them beyond the largest single."""
    par, t, q, v = loaded(params, random_errors, "mode", shaft=shaft)
    work = make_work()
    dynamics.forces(t, q, v, par, work)
    tangent.assemble(2e8, 4e16, 2e8, par, work)
    full, rhs = dense(work), np.random.default_rng(1).normal(size=N_DOF)
    assert linsolve.factorise(par, work)
    work.solution[:] = rhs
    linsolve.solve(np.zeros(N_DOF), par, work)
    expected = np.linalg.solve(full, rhs)
    np.testing.assert_allclose(work.solution, expected, rtol=1e-4, atol=1e-9 * np.abs(expected).max())


def test_a_singular_block_is_reported(params):
    work, par, arm = make_work(), params()[0], body("hole1")
    dynamics.forces(0.0, np.zeros(N_DOF), np.zeros(N_DOF), par, work)
    tangent.assemble(2000.0, 4e6, 2000.0, par, work)
    work.block[arm, 0, 0] = 0.0
    assert not linsolve.factorise(par, work)
    work.block[arm, 0, 0] = np.nan
    assert not linsolve.factorise(par, work)
