"""The joint as a second-order system: forces at one state, residual of the equations of motion, accelerations.

The equations of motion are in docs/model.md, "Coordinates and equations of motion". Residuals are forces and torques
about the reference points in axes of the ideal frames, in the order of the unknowns.
"""

import math

from tolstat.kernel.codes import RAMP
from tolstat.kernel.mechanics.bushing import bushing_load
from tolstat.kernel.mechanics.contact import contact_load, smooth_step
from tolstat.kernel.mechanics.motion import ideal_motion
from tolstat.kernel.mechanics.rotation import about_z, coefficients, exponential, spin, spin_bias, spin_rate, unspin
from tolstat.kernel.mechanics.topology import (
    ARM,
    FRAME,
    HUB,
    INPUT_SHAFT,
    N_BODIES,
    N_LUMPS,
    OUTPUT_SHAFT,
    PSI,
    TRIAD,
    S,
)
from tolstat.kernel.mechanics.triad import from_triad, to_triad
from tolstat.kernel.mechanics.vector import add, axpy, cross, dot, put, row, scale, sub, turn, turn_back
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import where


@njit
def mass_of(body, par):
    """Mass and principal inertia of a lump, about the axes of its triad."""
    if body == HUB:
        return par.hub_mass, (par.hub_inertia[0], par.hub_inertia[1], par.hub_inertia[2])
    if body < ARM:
        return par.pin_mass, (par.pin_inertia[0], par.pin_inertia[1], par.pin_inertia[2])
    return par.arm_mass, (par.arm_inertia[0], par.arm_inertia[1], par.arm_inertia[2])


@njit
def set_bodies(q, v, par, work):
    """Write position, attitude and velocity of every body relative to its ideal frame to `work`; `q`, `v`: (56,)."""
    for body in range(N_LUMPS):
        i = 6 * body
        distance = 0.0 if body == HUB else par.R
        phi = (q[i + 3], q[i + 4], q[i + 5])
        put(work.pos, body, axpy(distance, row(TRIAD[body], 0), (q[i], q[i + 1], q[i + 2])))
        put(work.vel, body, (v[i], v[i + 1], v[i + 2]))
        s = coefficients(dot(phi, phi))
        put(work.series, body, s)
        exponential(phi, s, work.rot, body)
        put(work.spin, body, spin(phi, s, (v[i + 3], v[i + 4], v[i + 5])))
    still = 0.0 * q[PSI]
    place_shaft(INPUT_SHAFT, (still, still), (still, still), work)
    place_shaft(OUTPUT_SHAFT, (q[PSI], v[PSI]), (par.slides * q[S], par.slides * v[S]), work)


@njit
def place_shaft(body, turned, shifted, work):
    """Write position, attitude and velocities of a shaft.

    Parameters
    ----------
    body : int
        `INPUT_SHAFT` or `OUTPUT_SHAFT`.
    turned, shifted : tuple of float
        Rotation about z (rad) and its rate; displacement along z (m) and its rate.
    work : record of WORK
        Written.
    """
    zero = turned[0] - turned[0]  # of the type of the angle: tuples of one type go through one compiled version
    put(work.pos, body, (zero, zero, shifted[0]))
    put(work.vel, body, (zero, zero, shifted[1]))
    about_z(turned[0], work.rot, body)
    put(work.spin, body, (zero, zero, turned[1]))


@njit
def forces(t, q, v, par, work):
    """Evaluate all bushings and contacts at one state; write ``work.force`` and loads; arguments as in `residual`."""
    ideal_motion(par.omega * t, par, work)
    set_bodies(q, v, par, work)
    for body in range(N_BODIES):
        for k in range(6):
            work.force[body, k] = 0.0
    for i in range(8):
        bushing_load(i, par, work)
    for pin in range(4):
        contact_load(pin, par, work)


@njit
def resisting_torque(t, par, work, ramped):
    """Resisting torque T_r, N m; with `ramped` it rises by the cubic step over the first quarter revolution."""
    if not ramped:
        return work.drive[1]
    return work.drive[1] * smooth_step(t * abs(par.omega) / (0.5 * math.pi))


@njit
def axial_force(q, v, par, work):
    """Force along the output shaft that accelerates it, N: of its arms, F_a, and of the bearings; 0 if it is held."""
    return par.slides * (work.force[OUTPUT_SHAFT, 2] + par.F_a - par.k_a * q[S] - par.c_a * v[S])


@njit
def in_turning_frame(body, x, dx, w, a, work):
    """Absolute acceleration, angular velocity and angular acceleration of a lump, in axes of its ideal frame.

    `x`, `dx`: position and velocity; `w`: angular velocity; `a`: as in `body_inertia`; relative to that frame.
    """
    ddx, dw = a
    if body < ARM:
        omega, domega = row(work.frame_w, FRAME[body]), row(work.frame_dw, FRAME[body])
        centripetal = cross(omega, axpy(2.0, dx, cross(omega, x)))
        acceleration = add(add(ddx, centripetal), cross(domega, x))
        return acceleration, add(omega, w), add(add(domega, dw), cross(omega, w))
    turning, change = work.frame_w[FRAME[body], 2], work.frame_dw[FRAME[body], 2]  # about z, as the fork's shaft
    along, across = 2 * dx[0] - turning * x[1], 2 * dx[1] + turning * x[0]
    acceleration = (ddx[0] - turning * across - change * x[1], ddx[1] + turning * along + change * x[0], ddx[2])
    angular = (dw[0] - turning * w[1], dw[1] + turning * w[0], dw[2] + change)
    return acceleration, (w[0], w[1], w[2] + turning), angular


@njit
def body_inertia(body, a, par, work):
    """Mass times absolute acceleration of a lump (N), and the rate of its angular momentum (N m).

    `a`: acceleration and angular acceleration relative to the ideal frame, (u'', w'), m/s^2 and rad/s^2.
    """
    mass, inertia = mass_of(body, par)
    x, dx, w = row(work.pos, body), row(work.vel, body), row(work.spin, body)
    acceleration, total, angular = in_turning_frame(body, x, dx, w, a, work)
    total = to_triad(body, turn_back(work.rot, body, total))
    angular = to_triad(body, turn_back(work.rot, body, angular))
    momentum = (inertia[0] * total[0], inertia[1] * total[1], inertia[2] * total[2])
    rate = (inertia[0] * angular[0], inertia[1] * angular[1], inertia[2] * angular[2])
    rate = add(rate, cross(total, momentum))
    return scale(mass, acceleration), turn(work.rot, body, from_triad(body, rate))


@njit
def residual(t, q, v, a, par, options, work, out):
    """Inertia terms minus forces at one state; zero when `a` is the acceleration.

    Parameters
    ----------
    t : float
        Time, s.
    q, v, a : ndarray, shape (56,)
        Unknowns and their first and second derivatives; m and rad.
    par : record of PARAM
        The joint.
    options : Options
        ``start`` decides whether the resisting torque is ramped.
    work : record of WORK
        Scratch; holds the state and the loads afterwards.
    out : ndarray, shape (56,)
        Written: N and N m.
    """
    forces(t, q, v, par, work)
    for body in range(N_LUMPS):
        i = 6 * body
        phi, rate = (q[i + 3], q[i + 4], q[i + 5]), (v[i + 3], v[i + 4], v[i + 5])
        dw = spin_rate(phi, row(work.series, body), rate, (a[i + 3], a[i + 4], a[i + 5]))
        f, torque = body_inertia(body, ((a[i], a[i + 1], a[i + 2]), dw), par, work)
        for k in range(3):
            out[i + k] = f[k] - work.force[body, k]
            out[i + 3 + k] = torque[k] - work.force[body, 3 + k]
    resisting = resisting_torque(t, par, work, options.start == RAMP)
    out[PSI] = par.Js * (work.shaft[1] + a[PSI]) - work.force[OUTPUT_SHAFT, 5] + resisting
    out[S] = par.slides * par.m_s * a[S] - axial_force(q, v, par, work)


@njit
def acceleration(t, q, v, par, options, work, out):
    """Second derivatives of the unknowns, for integrators of q'' = f(t, q, q'); arguments as in `residual`."""
    forces(t, q, v, par, work)
    zero = (0.0, 0.0, 0.0)
    for body in range(N_LUMPS):
        i = 6 * body
        phi, rate = (q[i + 3], q[i + 4], q[i + 5]), (v[i + 3], v[i + 4], v[i + 5])
        f, torque = body_inertia(body, (zero, spin_bias(phi, row(work.series, body), rate)), par, work)
        mass, inertia = mass_of(body, par)
        torque = sub((work.force[body, 3], work.force[body, 4], work.force[body, 5]), torque)
        torque = to_triad(body, turn_back(work.rot, body, torque))
        dw = (torque[0] / inertia[0], torque[1] / inertia[1], torque[2] / inertia[2])
        ddphi = unspin(phi, turn(work.rot, body, from_triad(body, dw)))
        for k in range(3):
            out[i + k] = (work.force[body, k] - f[k]) / mass
            out[i + 3 + k] = ddphi[k]
    resisting = resisting_torque(t, par, work, options.start == RAMP)
    out[PSI] = (work.force[OUTPUT_SHAFT, 5] - resisting) / par.Js - work.shaft[1]
    out[S] = axial_force(q, v, par, work) / where(par.slides > 0, par.m_s, 1.0)
