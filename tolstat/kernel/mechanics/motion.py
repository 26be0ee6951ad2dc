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
def ideal_motion(theta, alpha, omega, work):
    """Write the frames' angular velocities and accelerations, and the rotations between the frames, to `work`.

    Parameters
    ----------
    theta, alpha : float
        Input angle and misalignment, rad.
    omega : float
        Input speed, rad/s.
    work : record of WORK
        Its ``frame_w``, ``frame_dw``, ``relative``, ``relative_w``, ``shaft`` and ``turned`` are written.
    """
    sa, ca = sine_cosine(alpha)
    st, ct = sine_cosine(theta)
    # cross relative to input fork: tan(beta) = tan(alpha) sin(theta)
    ta = sa / ca
    tb = ta * st
    sec2 = 1 + tb * tb
    cb = 1 / math.sqrt(sec2)
    sb = tb * cb
    db = omega * ta * ct / sec2
    ddb = -omega * omega * ta * st / sec2 - 2 * ta * st * db * db
    # output fork relative to cross: sin(gamma) = sin(alpha) cos(theta)
    sg = sa * ct
    cg = math.sqrt(1 - sg * sg)
    dg = -sa * st * omega / cg
    # output shaft, eq. (2) and its time derivative
    below = 1 - sg * sg
    dto = omega * ca / below
    ddto = -omega * omega * ca * 2 * sa * sa * ct * st / (below * below)

    w, dw = work.frame_w, work.frame_dw
    w[FRAME_I, 0], w[FRAME_I, 1], w[FRAME_I, 2] = 0.0, 0.0, omega
    dw[FRAME_I, 0], dw[FRAME_I, 1], dw[FRAME_I, 2] = 0.0, 0.0, 0.0
    w[FRAME_C, 0], w[FRAME_C, 1], w[FRAME_C, 2] = db, omega * sb, omega * cb
    dw[FRAME_C, 0], dw[FRAME_C, 1], dw[FRAME_C, 2] = ddb, omega * cb * db, -omega * sb * db
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
