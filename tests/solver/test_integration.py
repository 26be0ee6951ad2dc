"""The integrator on textbook systems: order, invariants, kinks, and honest failure."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.support.integrate import integrate
from tests.support.problems import (
    INERTIA,
    bouncer,
    broken,
    elastic_pendulum,
    exploding,
    free_body,
    hardening,
    kinked,
    oscillator,
    pendulum,
    pendulum_angle,
    pendulum_tangent,
    pleiades,
    prothero_robinson,
    quadratic_impact,
    solve,
    van_der_pol,
)
from tolstat.common.tables import Status
from tolstat.kernel.mechanics import rotation

pytestmark = pytest.mark.slow

METHODS = ("bdf2", "tr_bdf2")


def orders(errors):
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


def system_error(system, method, steps):
    if system == "oscillator":
        w = np.sqrt(1 - 0.01)
        exact = np.exp(-0.5) * (np.cos(5 * w) + 0.1 / w * np.sin(5 * w))
        return abs(solve(oscillator, [1.0], [0.0], (0, 5), steps, method).q[-1, 0] - exact)
    return abs(solve(pendulum, [1.5], [0.0], (0, 5), steps, method).q[-1, 0] - pendulum_angle(5, 1.5))


@pytest.mark.parametrize("system", ["oscillator", "pendulum"])
@pytest.mark.parametrize("method", METHODS)
def test_order_is_two_over_five_halvings(system, method):
    errors = [system_error(system, method, 100 * 2**k) for k in range(6)]
    np.testing.assert_allclose(orders(errors), 2.0, atol=0.2)


@pytest.mark.parametrize("method", METHODS)
def test_velocity_and_acceleration_are_of_order_two(method):
    errors = []
    for steps in (200, 400, 800):
        r = solve(pendulum, [1.5], [0.0], (0, 5), steps, method)
        exact = pendulum_angle(r.t, 1.5)
        energy = r.v[-1, 0] ** 2 / 2 - np.cos(r.q[-1, 0]) + np.cos(1.5)
        errors.append([abs(energy), abs(r.a[-1, 0] + np.sin(exact[-1]))])
    for k in range(2):
        np.testing.assert_allclose(orders([e[k] for e in errors]), 2.0, atol=0.3)


@pytest.mark.parametrize("method", METHODS)
def test_a_free_body_keeps_energy_and_momentum_to_the_order(method):
    """Tumbling about the middle axis: energy and the angular momentum vector in space drift as h^2."""
    j = np.array(INERTIA)
    rate = np.array([0.3, 1.0, 0.2])
    errors = []
    for steps in (100, 200, 400, 800):
        r = solve(free_body, np.zeros(3), rate, (0, 2), steps, method)
        assert r.status == Status.OK
        back = tuple(-r.q[-1])
        w = np.array(rotation.spin(back, rotation.coefficients(np.dot(back, back)), tuple(r.v[-1])))
        attitude = np.full((1, 3, 3), np.nan)
        rotation.exponential(tuple(r.q[-1]), rotation.coefficients(np.dot(back, back)), attitude, 0)
        energy = 0.5 * j @ w**2 - 0.5 * j @ rate**2
        momentum = attitude[0] @ (j * w) - j * rate
        errors.append([abs(energy), np.linalg.norm(momentum)])
    for k in range(2):
        np.testing.assert_allclose(orders([e[k] for e in errors]), 2.0, atol=0.25)
    assert max(errors[-1]) < 1e-4


def test_a_given_tangent_gives_the_same_solution():
    plain = solve(pendulum, [1.5], [0.0], (0, 5), 300)
    given = integrate(pendulum, [1.5], [0.0], (0, 5), 300, tangent=pendulum_tangent)
    np.testing.assert_allclose(given.q, plain.q)


@pytest.mark.parametrize(("method", "loss"), [("bdf2", 0.06), ("tr_bdf2", 0.01)])
def test_an_impact_gives_back_its_energy(method, loss):
    """Restitution 1 in truth; at 8 steps a contact the methods lose a few per cent of the speed at most."""
    contact = np.pi / 1e3
    r = solve(bouncer, [-0.01], [1.0], (0, 0.03), round(0.03 / (contact / 8)), method)
    assert r.status == Status.OK
    assert -r.v[-1, 0] == pytest.approx(1.0, abs=loss)


@pytest.mark.parametrize("method", METHODS)
def test_a_step_too_long_for_newton_is_halved_and_counted(method):
    """The predictor overshoots into a spring of the seventh power; the output grid stays."""
    r = solve(hardening, [0.0], [100.0], (0, 1), 10, method)
    assert r.status == Status.OK
    assert r.q.shape == (11, 1)
    assert r.halvings > 0
    assert r.steps > 10
    assert np.isfinite(r.q).all()


def test_van_der_pol_at_mu_1000():
    """Published solution at t = 2000 (Test Set for IVP Solvers, problem vdpol with mu = 1000)."""
    expected = 1.706167732170469, -8.928097010248125e-4
    errors = []
    for rtol in (1e-4, 1e-6, 1e-8):
        r = solve(van_der_pol, [2.0], [0.0], (0, 2000), 100, "tr_bdf2", rtol=rtol, max_halvings=24)
        assert r.status == Status.OK
        errors.append(max(abs(r.q[-1, 0] / expected[0] - 1), abs(r.v[-1, 0] / expected[1] - 1)))
    assert errors[0] < 1e-3
    assert errors[1] < 1e-4
    assert errors[2] < 1e-5


def test_pleiades():
    """Published solution at t = 3 (Hairer, Norsett, Wanner: Solving ODEs I, II.10), checked with scipy's DOP853 too."""
    q0 = [3, 3, -1, -3, 2, -2, 2, 3, -3, 2, 0, 0, -4, 4]
    v0 = [0, 0, 0, 0, 0, 1.75, -1.5, 0, 0, 0, -1.25, 1, 0, 0]
    expected = [
        *(0.3706139143970502, 3.237284092057233, -3.222559032418324, 0.6597091455775310, 0.3425581707156584),
        *(1.562172101400631, -0.7003092922212495),
        *(-3.943437585517392, -3.271380973972550, 5.225081843456543, -2.590612434977470, 1.198213693392275),
        *(-0.2429682344935824, 1.091449240428980),
    ]

    def first_order(t, y):
        out = np.empty(14)
        pleiades(t, y[:14], y[14:], out)
        return np.concatenate([y[14:], out])

    truth = solve_ivp(first_order, (0, 3), [*q0, *v0], "DOP853", rtol=1e-12, atol=1e-12).y[:14, -1]
    np.testing.assert_allclose(truth, expected, atol=1e-6)
    r = solve(pleiades, q0, v0, (0, 3), 30, "tr_bdf2", rtol=1e-7, max_halvings=20)
    np.testing.assert_allclose(r.q[-1], expected, atol=1e-3)
    fixed = solve(pleiades, q0, v0, (0, 3), 60_000)
    np.testing.assert_allclose(fixed.q[-1], expected, atol=5e-3)


@pytest.mark.parametrize("method", METHODS)
def test_contact_time_of_a_quadratic_spring(method):
    """Contact lasts 2 * 1.40218 delta_max / v, delta_max^3 = 3 m v^2 / (2 k), and gives the speed back."""
    speed = 1.0
    deepest = (3 * speed**2 / (2 * 1e8)) ** (1 / 3)
    lasting = 2 * 1.4021821053254543 * deepest / speed
    r = solve(quadratic_impact, [0.0], [speed], (0, 1.2 * lasting), 2400, method)
    assert r.q.max() == pytest.approx(deepest, rel=1e-4)
    assert -r.v[-1, 0] == pytest.approx(speed, rel=1e-4)
    leaving = np.interp(0.0, -r.q[1200:, 0], r.t[1200:])
    assert leaving == pytest.approx(lasting, rel=1e-4)


@pytest.mark.parametrize("method", METHODS)
def test_forces_that_cancel_do_not_stop_newton(method):
    """Rounding of 1e8 (r - 1) is 1e-8 of an acceleration of 1: the residual stays above its tolerance.

    For so stiff a spring the direction is that of the rigid pendulum, whose closed form is the truth.
    """
    r = solve(elastic_pendulum, [0.0, 0.0], [0.0, 0.0], (0, 5), 1600, method)
    assert r.status == Status.OK
    assert r.steps < 1800
    assert np.arctan2(1 + r.q[-1, 0], -r.q[-1, 1]) == pytest.approx(pendulum_angle(5, np.pi / 2), abs=2e-4)


@pytest.fixture(scope="module")
def kinked_end():
    """End of the kinked motion by scipy's Radau, a step for every few contacts at most."""

    def first_order(t, y):
        out = np.empty(2)
        kinked(t, y[:2], y[2:], out)
        return np.r_[y[2:], out]

    return solve_ivp(first_order, (0, 15), np.zeros(4), "Radau", rtol=1e-8, atol=1e-11, max_step=0.05).y[:2, -1]


def test_error_control_finds_impacts_and_sticking(kinked_end):
    """A grid far too coarse for either, as a user would ask for it."""
    r = solve(kinked, [0.0, 0.0], [0.0, 0.0], (0, 15), 60, rtol=1e-7)
    assert r.status == Status.OK
    np.testing.assert_allclose(r.q[-1], kinked_end, atol=1e-3)


def test_error_control_meets_the_pendulum_to_its_tolerance():
    """Steps of order 2 grow as rtol^(1/3), and as many errors of rtol add up."""
    errors = []
    for rtol in (1e-4, 1e-6, 1e-8):
        r = solve(pendulum, [1.5], [0.0], (0, 5), 5, rtol=rtol)
        errors.append(abs(r.q[-1, 0] - pendulum_angle(5, 1.5)))
        assert errors[-1] < 3 * rtol ** (2 / 3)
    assert errors[0] > 7 * errors[1] > 49 * errors[2]


@pytest.mark.parametrize("method", METHODS)
def test_a_stiff_spring_that_follows_its_guide(method):
    """Prothero and Robinson (1974) in second order: the solution cos t, whatever the stiffness, and steps of 1/10."""
    r = solve(prothero_robinson, [1.0], [0.0], (0, 10), 100, method)
    assert r.status == Status.OK
    np.testing.assert_allclose(r.q[:, 0], np.cos(r.t), atol=1e-4)
    assert r.halvings == 0


@pytest.mark.parametrize(
    ("system", "status"),
    [
        (exploding, Status.NEWTON_FAILED),
        (broken, Status.NOT_FINITE),
    ],
)
@pytest.mark.parametrize("method", METHODS)
def test_failure_is_a_status_and_nan(system, status, method):
    r = solve(system, [2.0], [0.0], (0, 10), 50, method)
    assert r.status == status
    assert np.isnan(r.q[-1, 0])


def test_work_is_bounded():
    r = solve(pendulum, [1.5], [0.0], (0, 5), 5, rtol=1e-10, max_substeps=100)
    assert r.status == Status.NEWTON_FAILED
    assert r.steps <= 105
    assert np.isnan(r.q[-1, 0])


def test_an_entry_left_unwritten_is_no_result():
    """The pendulum writes one entry of two."""
    assert solve(pendulum, [1.0, 1.0], [0.0, 0.0], (0, 1), 10).status == Status.NOT_FINITE
