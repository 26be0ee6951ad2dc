"""Ideal motion of the frames I, C and F (docs/model.md, "Frames"); the unknowns are deviations from it."""

import math

from tolstat.kernel.mechanics.topology import FRAME_C, FRAME_F, FRAME_I
from tolstat.kernel.mechanics.trigonometry import sine_cosine
from tolstat.kernel.simd.jit import njit


@njit
def speed_ratio(theta, alpha):
    """Speed ratio of the ideal joint, d theta_o / d theta (Cirelli et al. 2021, eq. 2)."""
    sa, ca = sine_cosine(alpha)
    _, ct = sine_cosine(theta)
    return ca / (1 - (sa * ct) ** 2)


@njit
def drive_and_load(phase, par):
    """Input angle, its derivatives and the resisting torque at a phase (docs/model.md, "Drive and load").

    Parameters
    ----------
    phase : float
        Mean input angle omega t, rad.
    par : record of PARAM
        The joint.

    Returns
    -------
    theta, slope, bend : float
        Input angle (rad) and its first and second derivative with respect to the phase.
    torque : float
        Resisting torque T_r, N m, without the ramp at the start.
    """
    theta, slope, bend, torque = phase, 1.0 + 0.0 * phase, 0.0 * phase, par.torque + 0.0 * phase
    for i in range(par.n_orders):
        n = par.order[i]
        s, c = sine_cosine(n * phase)
        turned = par.speed_order[i, 0] * c + par.speed_order[i, 1] * s
        theta += turned
        slope += n * (par.speed_order[i, 1] * c - par.speed_order[i, 0] * s)
        bend -= n * n * turned
        torque += par.torque_order[i, 0] * c + par.torque_order[i, 1] * s
    return theta, slope, bend, torque


@njit
def ideal_motion(phase, par, work):
    """Write the frames' angular velocities and accelerations, and the rotations between the frames, to `work`.

    Parameters
    ----------
    phase : float
        Mean input angle omega t, rad.
    par : record of PARAM
        The joint.
    work : record of WORK
        Its ``frame_w``, ``frame_dw``, ``relative``, ``shaft``, ``turned`` and ``drive`` are
        written.
    """
    theta, slope, bend, torque = drive_and_load(phase, par)
    omega, domega = par.omega * slope, par.omega * par.omega * bend
    work.drive[0], work.drive[1] = omega, torque
    sa, ca = sine_cosine(par.alpha)
    st, ct = sine_cosine(theta)
    # output fork relative to cross: sin(gamma) = sin(alpha) cos(theta); with secant = 1 / cos(gamma) and
    # cross relative to input fork: tan(beta) = tan(alpha) sin(theta), cos(beta) = cos(alpha) / cos(gamma)
    sg = sa * ct
    secant = 1 / math.sqrt(1 - sg * sg)
    secant2 = secant * secant
    cg, dg = (1 - sg * sg) * secant, -sa * st * omega * secant
    cb, sb = ca * secant, sa * st * secant
    db = omega * sa * ca * ct * secant2
    ddb = sa * ca * secant2 * (domega * ct - omega * omega * st * (1 + 2 * sg * sg * secant2))
    # output shaft, eq. (2) and its time derivative
    dto = omega * ca * secant2
    ddto = ca * secant2 * (domega - 2 * omega * omega * sa * sa * ct * st * secant2)

    w, dw = work.frame_w, work.frame_dw
    w[FRAME_I, 0], w[FRAME_I, 1], w[FRAME_I, 2] = 0.0, 0.0, omega
    dw[FRAME_I, 0], dw[FRAME_I, 1], dw[FRAME_I, 2] = 0.0, 0.0, domega
    w[FRAME_C, 0], w[FRAME_C, 1], w[FRAME_C, 2] = db, omega * sb, omega * cb
    dw[FRAME_C, 0] = ddb
    dw[FRAME_C, 1], dw[FRAME_C, 2] = omega * cb * db + domega * sb, domega * cb - omega * sb * db
    w[FRAME_F, 0], w[FRAME_F, 1], w[FRAME_F, 2] = 0.0, 0.0, dto
    dw[FRAME_F, 0], dw[FRAME_F, 1], dw[FRAME_F, 2] = 0.0, 0.0, ddto

    work.relative[FRAME_I, 0], work.relative[FRAME_I, 1], work.relative[FRAME_I, 2] = cb, sb, db
    work.relative[FRAME_F, 0], work.relative[FRAME_F, 1], work.relative[FRAME_F, 2] = cg, -sg, -dg
    work.shaft[0], work.shaft[1] = dto, ddto
    work.turned[0, 0], work.turned[0, 1] = ct, st
    work.turned[1, 0], work.turned[1, 1] = ca * ct * secant, st * secant


@njit
def to_arm(frame, a, work):
    """Components in axes of a fork's frame, I or F, of a vector in axes of C."""
    c, s = work.relative[frame, 0], work.relative[frame, 1]
    if frame == FRAME_I:
        return (a[0], c * a[1] - s * a[2], s * a[1] + c * a[2])
    return (c * a[0] + s * a[2], a[1], c * a[2] - s * a[0])


@njit
def to_cross(frame, a, work):
    """Components in axes of C of a vector in axes of a fork's frame, I or F."""
    c, s = work.relative[frame, 0], work.relative[frame, 1]
    if frame == FRAME_I:
        return (a[0], c * a[1] + s * a[2], c * a[2] - s * a[1])
    return (c * a[0] - s * a[2], a[1], s * a[0] + c * a[2])


@njit
def velocity_in(frame, velocity, point, work):
    """Velocity relative to `frame`, I or F, of what moves with `velocity` in C at `point`; all in axes of `frame`."""
    w = work.relative[frame, 2]
    if frame == FRAME_I:
        return (velocity[0], velocity[1] - w * point[2], velocity[2] + w * point[1])
    return (velocity[0] + w * point[2], velocity[1], velocity[2] - w * point[0])
