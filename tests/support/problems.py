"""Second-order systems from textbooks and test sets, for `integrate`."""

from __future__ import annotations

import numba
import numpy as np
from scipy.special import ellipj, ellipk

from tests.support.integrate import Trajectory, integrate
from tolstat.kernel.mechanics import rotation


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
series, to_spin, to_rate, bias = rotation.coefficients, rotation.spin, rotation.unspin, rotation.spin_bias


@numba.njit
def free_body(t, q, v, out):
    """Euler's equations in rotation vectors: w' = J^-1 (-w x J w) in body axes, w turned to the axes of phi."""
    rate = (v[0], v[1], v[2])
    back = (-q[0], -q[1], -q[2])
    s = series(q[0] * q[0] + q[1] * q[1] + q[2] * q[2])
    w = to_spin(back, s, rate)  # T(-phi) phi': angular velocity in body axes
    push = bias(back, s, (-rate[0], -rate[1], -rate[2]))
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
        elastic_pendulum(t, q, v, out)
    elif t < 12 * EPOCH:
        kinked(t - 11 * EPOCH, q, v, out)
    else:
        prothero_robinson(t - 12 * EPOCH, q, v, out)


def solve(system, q0, v0, t_span, *args, **given) -> Trajectory:
    """Call `integrate` for one of `SYSTEMS`, started at the time that selects it; returned times are relative."""
    start = EPOCH * SYSTEMS.index(system)
    found = integrate(any_of_them, q0, v0, (start + t_span[0], start + t_span[1]), *args, **given)
    return found._replace(t=found.t - start)
