"""The integrator on textbook systems: order, invariants, kinks, and honest failure."""

from __future__ import annotations

import numba
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk

from tolstat.common.tables import Status
from tolstat.kernel.mechanics import rotation
from tolstat.solver.integrate import integrate

pytestmark = pytest.mark.slow

METHODS = ("bdf2", "generalized_alpha", "tr_bdf2")


@numba.njit
def oscillator(t, q, v, out):
    out[0] = -q[0] - 0.2 * v[0]


@numba.njit
def pendulum(t, q, v, out):
    out[0] = -np.sin(q[0])


@numba.njit
def pendulum_tangent(t, q, v, dq, dv):
    dq[0, 0] = -np.cos(q[0])
    dv[0, 0] = 0.0


def pendulum_angle(t, amplitude):
    """Closed form by Jacobi's elliptic functions, released from rest at `amplitude`."""
    k = np.sin(amplitude / 2)
    sn = ellipj(ellipk(k * k) - t, k * k)[0]
    return 2 * np.arcsin(k * sn)


INERTIA = (1.0, 2.0, 3.5)
to_spin, to_rate, bias = rotation.spin, rotation.unspin, rotation.spin_bias


@numba.njit
def free_body(t, q, v, out):
    """Euler's equations in rotation vectors: w' = J^-1 (-w x J w) in body axes, w turned to the axes of phi."""
    rate = (v[0], v[1], v[2])
    back = (-q[0], -q[1], -q[2])
    w = to_spin(back, rate)  # T(-phi) phi': angular velocity in body axes
    push = bias(back, (-rate[0], -rate[1], -rate[2]))
    j = INERTIA
    torque = (
        (j[1] - j[2]) * w[1] * w[2],
        (j[2] - j[0]) * w[2] * w[0],
        (j[0] - j[1]) * w[0] * w[1],
    )
    rest = (torque[0] / j[0] + push[0], torque[1] / j[1] + push[1], torque[2] / j[2] + push[2])
    out[0], out[1], out[2] = to_rate(back, rest)


@numba.njit
def bouncer(t, q, v, out):
    """Mass 1 thrown against a stiff spring with clearance, the kink of a contact."""
    out[0] = -1e6 * q[0] if q[0] > 0 else 0.0


@numba.njit
def hardening(t, q, v, out):
    out[0] = -1e3 * q[0] ** 7 - 20 * v[0]


@numba.njit
def exploding(t, q, v, out):
    out[0] = q[0] ** 3


@numba.njit
def broken(t, q, v, out):
    out[0] = np.nan


@numba.njit
def van_der_pol(t, q, v, out):
    out[0] = 1000 * (1 - q[0] ** 2) * v[0] - q[0]


@numba.njit
def pleiades(t, q, v, out):
    """Seven stars in a plane, of mass 1 to 7 (Hairer, Norsett, Wanner: Solving ODEs I, II.10)."""
    for i in range(7):
        out[i] = out[7 + i] = 0.0
        for j in range(7):
            if j != i:
                dx, dy = q[j] - q[i], q[7 + j] - q[7 + i]
                cubed = (dx * dx + dy * dy) ** 1.5
                out[i] += (j + 1) * dx / cubed
                out[7 + i] += (j + 1) * dy / cubed


@numba.njit
def quadratic_impact(t, q, v, out):
    out[0] = -1e8 * q[0] ** 2 if q[0] > 0 else 0.0


@numba.njit
def double_pendulum(t, q, v, out):
    """The same, solved for the accelerations by hand."""
    s, c = np.sin(q[0] - q[1]), np.cos(q[0] - q[1])
    f0 = -s * v[1] ** 2 - 2 * 9.81 * np.sin(q[0])
    f1 = s * v[0] ** 2 - 9.81 * np.sin(q[1])
    out[0], out[1] = (f0 - c * f1) / (2 - c * c), (2 * f1 - c * f0) / (2 - c * c)


@numba.njit
def elastic_pendulum(t, q, v, out):
    """Mass on a stiff spring of length 1 that starts level; the unknowns are its displacements."""
    x = 1 + q[0]
    r = np.sqrt(x * x + q[1] * q[1])
    pull = 1e8 * (r - 1) / r
    out[0], out[1] = -pull * x, -pull * q[1] - 1


@numba.njit
def kinked(t, q, v, out):
    """Two unknowns with kinks that do not know each other.

    One is driven against a stiff and damped stop at 0.1 (after Shaw and Holmes 1983). The other hangs on a belt by
    friction that falls with speed: it sticks, slips, and sticks again.
    """
    out[0] = -q[0] - 0.05 * v[0] + np.cos(2.8 * t)
    if q[0] > 0.1:
        out[0] -= 1e4 * (q[0] - 0.1) + 20 * v[0]
    slip = v[1] - 0.1
    out[1] = -q[1] - np.tanh(slip / 1e-4) * (0.3 + 0.3 * np.exp(-abs(slip) / 0.1))


@numba.njit
def prothero_robinson(t, q, v, out):
    out[0] = -1e6 * (q[0] - np.cos(t)) - 2e3 * (v[0] + np.sin(t)) - np.cos(t)


EPOCH = 4096.0
"""Length of the interval of time in which `any_of_them` evaluates one system."""
SYSTEMS = (
    pendulum,
    quadratic_impact,
    bouncer,
    oscillator,
    free_body,
    hardening,
    exploding,
    broken,
    van_der_pol,
    pleiades,
    double_pendulum,
    elastic_pendulum,
    kinked,
    prothero_robinson,
)


@numba.njit
def any_of_them(t, q, v, out):
    """Evaluate the one of `SYSTEMS` that the time selects: the integrator is compiled once for all of them."""
    if t < 1 * EPOCH:
        pendulum(t, q, v, out)
    elif t < 2 * EPOCH:
        quadratic_impact(t, q, v, out)
    elif t < 3 * EPOCH:
        bouncer(t, q, v, out)
    elif t < 4 * EPOCH:
        oscillator(t, q, v, out)
    elif t < 5 * EPOCH:
        free_body(t, q, v, out)
    elif t < 6 * EPOCH:
        hardening(t, q, v, out)
    elif t < 7 * EPOCH:
        exploding(t, q, v, out)
    elif t < 8 * EPOCH:
        broken(t, q, v, out)
    elif t < 9 * EPOCH:
        van_der_pol(t, q, v, out)
    elif t < 10 * EPOCH:
        pleiades(t, q, v, out)
    elif t < 11 * EPOCH:
        double_pendulum(t, q, v, out)
    elif t < 12 * EPOCH:
        elastic_pendulum(t, q, v, out)
    elif t < 13 * EPOCH:
        kinked(t - 12 * EPOCH, q, v, out)
    else:
        prothero_robinson(t - 13 * EPOCH, q, v, out)


def solve(system, q0, v0, t_span, *args, **given):
    """Call `integrate` for one of `SYSTEMS`, started at the time that selects it; returned times are relative."""
    start = EPOCH * SYSTEMS.index(system)
    found = integrate(any_of_them, q0, v0, (start + t_span[0], start + t_span[1]), *args, **given)
    return found._replace(t=found.t - start)


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
        w = np.array(rotation.spin(back, tuple(r.v[-1])))
        attitude = np.full((1, 3, 3), np.nan)
        rotation.exponential(tuple(r.q[-1]), attitude, 0)
        energy = 0.5 * j @ w**2 - 0.5 * j @ rate**2
        momentum = attitude[0] @ (j * w) - j * rate
        errors.append([abs(energy), np.linalg.norm(momentum)])
    for k in range(2):
        np.testing.assert_allclose(orders([e[k] for e in errors]), 2.0, atol=0.25)
    assert max(errors[-1]) < 1e-4


def test_a_given_tangent_gives_the_same_solution():
    plain = solve(pendulum, [1.5], [0.0], (0, 5), 300)
    given = integrate(pendulum, [1.5], [0.0], (0, 5), 300, tangent=pendulum_tangent)
    np.testing.assert_allclose(given.q, plain.q, atol=1e-9)


@pytest.mark.parametrize(("method", "loss"), [("bdf2", 0.06), ("generalized_alpha", 0.01), ("tr_bdf2", 0.01)])
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
        r = solve(van_der_pol, [2.0], [0.0], (0, 2000), 100, "tr_bdf2", rtol=rtol, atol=1e-9, max_halvings=24)
        assert r.status == Status.OK
        errors.append(max(abs(r.q[-1, 0] / expected[0] - 1), abs(r.v[-1, 0] / expected[1] - 1)))
    assert errors[0] < 1e-3
    assert errors[1] < 1e-4
    assert errors[2] < 1e-5


@pytest.mark.parametrize("method", METHODS)
def test_van_der_pol_as_a_user_would_ask(method):
    """No speed at the start and no absolute tolerance to speak of: rounding must not be taken for error."""
    r = solve(van_der_pol, [2.0], [0.0], (0, 2000), 100, method, rtol=1e-6)
    assert r.status == Status.OK
    assert r.q[-1, 0] == pytest.approx(1.706167732170469, rel=1e-4)


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
    r = solve(pleiades, q0, v0, (0, 3), 30, "tr_bdf2", rtol=1e-7, atol=1e-9, max_halvings=20)
    np.testing.assert_allclose(r.q[-1], expected, atol=1e-3)
    fixed = solve(pleiades, q0, v0, (0, 3), 60_000, "generalized_alpha", rho_inf=1.0)
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


@numba.njit
def double_pendulum_forces(t, q, v, out):
    """Two links of length 1 and mass 1, g = 9.81; angles from the vertical."""
    s = np.sin(q[0] - q[1])
    out[0] = -s * v[1] ** 2 - 2 * 9.81 * np.sin(q[0])
    out[1] = s * v[0] ** 2 - 9.81 * np.sin(q[1])


@numba.njit
def double_pendulum_mass(t, q, out):
    out[0, 0], out[1, 1] = 2.0, 1.0
    out[0, 1] = out[1, 0] = np.cos(q[0] - q[1])


@numba.njit
def double_pendulum_tangent(t, q, v, dq, dv):
    s, c = np.sin(q[0] - q[1]), np.cos(q[0] - q[1])
    dq[0, 0], dq[0, 1] = -c * v[1] ** 2 - 2 * 9.81 * np.cos(q[0]), c * v[1] ** 2
    dq[1, 0], dq[1, 1] = c * v[0] ** 2, -c * v[0] ** 2 - 9.81 * np.cos(q[1])
    dv[0, 1], dv[1, 0] = -2 * s * v[1], 2 * s * v[0]


@pytest.mark.parametrize("method", METHODS)
def test_a_mass_of_the_pose_gives_the_divided_form(method):
    start = [np.pi / 2, np.pi / 2], [0.0, 0.0], (0, 3), 600, method
    divided = solve(double_pendulum, *start)
    for given in ({}, {"tangent": double_pendulum_tangent}):
        r = integrate(double_pendulum_forces, *start, mass=double_pendulum_mass, **given)
        assert r.status == Status.OK
        np.testing.assert_allclose(r.q, divided.q, atol=1e-8)
        np.testing.assert_allclose(r.a, divided.a, atol=1e-5)
        # a wrong tangent would need more iterations, not give another answer
        assert r.newton_iterations <= divided.newton_iterations * 1.05


@numba.njit
def chain_forces(t, q, v, out):
    """Finite elements of a fixed bar, 40 unknowns: stiffness 40 and load at the free end."""
    for i in range(q.size):
        right = q[i + 1] - q[i] if i + 1 < q.size else 0.0
        out[i] = 40 * (right - (q[i] - (q[i - 1] if i else 0.0)))
    out[-1] += np.sin(3 * t)


@numba.njit
def chain_tangent(t, q, v, dq, dv):
    for i in range(q.size):
        dq[i, i] = -80.0 if i + 1 < q.size else -40.0
        if i:
            dq[i, i - 1] = dq[i - 1, i] = 40.0


def test_a_constant_mass_of_40_unknowns():
    """A bar's consistent mass; scipy's DOP853 is the truth."""
    n = 40
    mass = (np.diag(np.r_[np.full(n - 1, 4.0), 2.0]) + np.diag(np.ones(n - 1), 1) + np.diag(np.ones(n - 1), -1)) / 240

    def first_order(t, y):
        out = np.empty(n)
        chain_forces(t, y[:n], y[n:], out)
        return np.r_[y[n:], np.linalg.solve(mass, out)]

    truth = solve_ivp(first_order, (0, 2), np.zeros(2 * n), "DOP853", rtol=1e-9, atol=1e-12).y[:n, -1]
    r = integrate(chain_forces, np.zeros(n), np.zeros(n), (0, 2), 1000, "bdf2", chain_tangent, mass)
    assert r.status == Status.OK
    assert r.newton_iterations < 2.5 * r.steps  # linear: one iteration a step and its rounding
    np.testing.assert_allclose(r.q[-1], truth, atol=2e-4)


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


@pytest.mark.parametrize("method", METHODS)
def test_error_control_finds_impacts_and_sticking(method, kinked_end):
    """A grid far too coarse for either, as a user would ask for it."""
    r = solve(kinked, [0.0, 0.0], [0.0, 0.0], (0, 15), 60, method, rtol=1e-7, atol=1e-9)
    assert r.status == Status.OK
    np.testing.assert_allclose(r.q[-1], kinked_end, atol=1e-3)


@pytest.mark.parametrize("method", METHODS)
def test_error_control_meets_the_pendulum_to_its_tolerance(method):
    """Steps of order 2 grow as rtol^(1/3), and as many errors of rtol add up."""
    errors = []
    for rtol in (1e-4, 1e-6, 1e-8):
        r = solve(pendulum, [1.5], [0.0], (0, 5), 5, method, rtol=rtol, atol=1e-9)
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


def plain_python(t, q, v, out):
    out[0] = -np.sin(q[0])


def test_plain_functions_and_numbers_are_taken():
    plain = integrate(plain_python, 1.5, 0, (0, 5), 300)
    np.testing.assert_array_equal(plain.q, solve(pendulum, [1.5], [0.0], (0, 5), 300).q)


def test_an_entry_left_unwritten_is_no_result():
    """The pendulum writes one entry of two."""
    assert solve(pendulum, [1.0, 1.0], [0.0, 0.0], (0, 1), 10).status == Status.NOT_FINITE


@pytest.mark.parametrize(
    ("function", "word"),
    [
        (lambda t, q, v: -q, "arguments"),
        (lambda t, q, v, out: out.nothing(q), "nothing"),
        ("pendulum", "must be a function"),
    ],
)
def test_functions_that_cannot_be_compiled_are_refused(function, word):
    with pytest.raises(TypeError, match=word):
        integrate(function, [1.0], [0.0], (0, 1), 10)


def test_all_faults_are_told_at_once():
    with pytest.raises(ValueError, match=r"(?s)finite vectors.*t_span.*steps.*rho_inf.*newton_tol"):
        solve(pendulum, [np.inf], [0.0], (1, 1), 2.5, rho_inf=2, newton_tol=0)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"q0": [[1.0]]}, "vectors"),
        ({"v0": [np.nan]}, "finite"),
        ({"steps": 0}, "steps"),
        ({"method": "euler"}, "none of"),
        ({"rtol": -1e-3}, "negative"),
        ({"mass": [[1.0, 0.0]]}, "matrix"),
        ({"mass": [[0.0]]}, "singular"),
        ({"max_substeps": -1}, "max_substeps"),
        ({"max_halvings": 60}, "max_halvings"),
        ({"t_span": (1, 0)}, "increasing"),
    ],
)
def test_senseless_arguments_are_refused(change, word):
    given = {"q0": [1.0], "v0": [0.0], "t_span": (0, 1), "steps": 10} | change
    with pytest.raises(ValueError, match=word):
        solve(pendulum, **given)
