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
        Its ``frame_w``, ``frame_dw``, ``relative``, ``relative_w``, ``shaft``, ``turned`` and ``drive`` are
        written.
    """
    theta, slope, bend, torque = drive_and_load(phase, par)
    omega, domega = par.omega * slope, par.omega * par.omega * bend
    work.drive[0], work.drive[1] = omega, torque
    sa, ca = sine_cosine(par.alpha)
    st, ct = sine_cosine(theta)
    # cross relative to input fork: tan(beta) = tan(alpha) sin(theta)
    ta = sa / ca
    tb = ta * st
    sec2 = 1 + tb * tb
    cb = 1 / math.sqrt(sec2)
    sb = tb * cb
    db = omega * ta * ct / sec2
    ddb = -omega * omega * ta * st / sec2 - 2 * ta * st * db * db + domega * ta * ct / sec2
    # output fork relative to cross: sin(gamma) = sin(alpha) cos(theta)
    sg = sa * ct
    cg = math.sqrt(1 - sg * sg)
    dg = -sa * st * omega / cg
    # output shaft, eq. (2) and its time derivative
    below = 1 - sg * sg
    dto = omega * ca / below
    ddto = -omega * omega * ca * 2 * sa * sa * ct * st / (below * below) + domega * ca / below

    w, dw = work.frame_w, work.frame_dw
    w[FRAME_I, 0], w[FRAME_I, 1], w[FRAME_I, 2] = 0.0, 0.0, omega
    dw[FRAME_I, 0], dw[FRAME_I, 1], dw[FRAME_I, 2] = 0.0, 0.0, domega
    w[FRAME_C, 0], w[FRAME_C, 1], w[FRAME_C, 2] = db, omega * sb, omega * cb
    dw[FRAME_C, 0] = ddb
    dw[FRAME_C, 1], dw[FRAME_C, 2] = omega * cb * db + domega * sb, domega * cb - omega * sb * db
    w[FRAME_F, 0], w[FRAME_F, 1], w[FRAME_F, 2] = 0.0, 0.0, dto
    dw[FRAME_F, 0], dw[FRAME_F, 1], dw[FRAME_F, 2] = 0.0, 0.0, ddto

    # components in C to components in the arm's frame: Rx(beta) to I, Ry(gamma)^T to F
    rel, rel_w = work.relative, work.relative_w
    rel[FRAME_I, 0, 0], rel[FRAME_I, 0, 1], rel[FRAME_I, 0, 2] = 1.0, 0.0, 0.0
    rel[FRAME_I, 1, 0], rel[FRAME_I, 1, 1], rel[FRAME_I, 1, 2] = 0.0, cb, -sb
    rel[FRAME_I, 2, 0], rel[FRAME_I, 2, 1], rel[FRAME_I, 2, 2] = 0.0, sb, cb
    rel[FRAME_F, 0, 0], rel[FRAME_F, 0, 1], rel[FRAME_F, 0, 2] = cg, 0.0, -sg
    rel[FRAME_F, 1, 0], rel[FRAME_F, 1, 1], rel[FRAME_F, 1, 2] = 0.0, 1.0, 0.0
    rel[FRAME_F, 2, 0], rel[FRAME_F, 2, 1], rel[FRAME_F, 2, 2] = sg, 0.0, cg
    # angular velocity of C relative to the arm's frame, in axes of the arm's frame
    rel_w[FRAME_I, 0], rel_w[FRAME_I, 1], rel_w[FRAME_I, 2] = db, 0.0, 0.0
    rel_w[FRAME_F, 0], rel_w[FRAME_F, 1], rel_w[FRAME_F, 2] = 0.0, -dg, 0.0
    work.shaft[0], work.shaft[1] = dto, ddto
    work.turned[0, 0], work.turned[0, 1] = ct, st
    work.turned[1, 0], work.turned[1, 1] = ca * ct / cg, st / cg
