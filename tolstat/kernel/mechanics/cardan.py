"""Ideal motion of a Cardan joint's frames I, C and F in closed form (docs/model.md, "Frames")."""

import math

from tolstat.common.mechanism import GENERAL
from tolstat.kernel.mechanics.trigonometry import sine_cosine
from tolstat.kernel.mechanics.vector import put
from tolstat.kernel.simd.jit import njit

INPUT, CROSS, OUTPUT = range(3)
"""Members of a joint, by their order."""
PINS_OF_JOINT = 4
"""Number of pins of a joint; the first two turn in the output fork."""


@njit
def write_joint(joint, turned, motion, par, work):
    """Write the frames of a joint and the rotations between them.

    Parameters
    ----------
    joint : int
        Number of the joint.
    turned : tuple of float
        Cosine and sine of the angle theta of its input, counted from the plane of the joint.
    motion : tuple of float
        Angular velocity (rad/s) and acceleration (rad/s^2) of its input.
    par, work : records of PARAM and WORK
        The joint; ``frame_w``, ``frame_dw``, ``relative`` and ``turned`` are written.
    """
    ct, st = turned
    omega, domega = motion
    sa, ca = sine_cosine(par.alpha[joint])
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

    w, dw, first = work.frame_w, work.frame_dw, par.cardan[joint]
    i, c, f = first + INPUT, first + CROSS, first + OUTPUT
    w[i, 0], w[i, 1], w[i, 2] = 0.0, 0.0, omega
    dw[i, 0], dw[i, 1], dw[i, 2] = 0.0, 0.0, domega
    w[c, 0], w[c, 1], w[c, 2] = db, omega * sb, omega * cb
    dw[c, 0] = ddb
    dw[c, 1], dw[c, 2] = omega * cb * db + domega * sb, domega * cb - omega * sb * db
    w[f, 0], w[f, 1], w[f, 2] = 0.0, 0.0, dto
    dw[f, 0], dw[f, 1], dw[f, 2] = 0.0, 0.0, ddto

    x, y = 2 * joint, 2 * joint + 1
    work.relative[x, 0], work.relative[x, 1], work.relative[x, 2] = cb, sb, db
    work.relative[y, 0], work.relative[y, 1], work.relative[y, 2] = cg, -sg, -dg
    work.turned[i, 0], work.turned[i, 1] = ct, st
    work.turned[f, 0], work.turned[f, 1] = ca * ct * secant, st * secant


@njit
def write_joints(theta, par, work):
    """Write the frames of all joints, each driven by the one before; `theta`: angle of the first input, rad."""
    st, ct = sine_cosine(theta)
    motion = (work.drive[0], work.drive[1])
    for joint in range(par.cardan.shape[0]):
        if joint > 0:
            before = par.cardan[joint - 1] + OUTPUT
            s, c = sine_cosine(par.ahead[joint])
            co, so = work.turned[before, 0], work.turned[before, 1]
            ct, st = c * co - s * so, s * co + c * so
            motion = (work.frame_w[before, 2], work.frame_dw[before, 2])
        write_joint(joint, (ct, st), motion, par, work)
        if par.hinge_axis[2 * joint] == GENERAL:
            write_on_shaft(joint, par, work)


@njit
def write_on_shaft(joint, par, work):
    """Write how the cross of a joint lies and moves in the frame of the output of the joint before.

    The frame of its own input is that frame, a distance L along z and turned about it.
    """
    x = 2 * joint
    c, s, rate = work.relative[x, 0], work.relative[x, 1], work.relative[x, 2]
    sine, cosine = sine_cosine(par.ahead[joint] + par.plane[joint])
    axes = ((cosine, sine, 0.0 * c), (-sine * c, cosine * c, s), (sine * s, -cosine * s, c))
    for j in range(3):
        for k in range(3):
            work.into_hole[x, k, j] = axes[j][k]
    put(work.place, x, (0.0, 0.0, par.span[joint]))
    put(work.place_v, x, (0.0, 0.0, 0.0))
    put(work.relative_w, x, (cosine * rate, sine * rate, 0.0))


@njit
def input_of(joint, theta, slope, par):
    """Cosine and sine of the input angle of a joint, from the plane of the joint, and its slope by the phase.

    `theta` (rad), `slope`: angle of the first joint's input and its derivative by the phase.
    """
    sine, cosine = sine_cosine(theta)
    for before in range(joint):
        sa, ca = sine_cosine(par.alpha[before])
        secant = 1 / math.sqrt(1 - (sa * cosine) ** 2)
        s, c = sine_cosine(par.ahead[before + 1])
        co, so = ca * cosine * secant, sine * secant
        cosine, sine, slope = c * co - s * so, s * co + c * so, slope * ca * secant * secant
    return cosine, sine, slope


@njit
def ideal_ratio(theta, par):
    """Speed ratio of the ideal mechanism at the angle `theta` of the first input.

    Of a joint d theta_o / d theta (Cirelli et al. 2021, eq. 2).
    """
    ratio = 1.0
    for joint in range(par.cardan.shape[0]):
        cosine, _, _ = input_of(joint, theta, 1.0, par)
        sa, ca = sine_cosine(par.alpha[joint])
        ratio *= ca / (1 - (sa * cosine) ** 2)
    return ratio


@njit
def travel(joint, theta, slope, par):
    """Speed of each two pins in their holes, by the ideal motion; `theta`, `slope` as of `input_of`.

    Of pins that are no part of a Cardan joint, the speed of the input.

    Returns
    -------
    at_output, at_input : float
        |d gamma/d phase| / sin(alpha) of pins 1 and 2, |d beta/d phase| / tan(alpha) of pins 3 and 4. Both have a
        limit at alpha = 0.
    """
    if joint >= par.cardan.shape[0]:
        return slope, slope
    cosine, sine, slope = input_of(joint, theta, slope, par)
    sine_alpha, cosine_alpha = sine_cosine(par.alpha[joint])
    tan_beta = sine_alpha / cosine_alpha * sine
    at_output = abs(sine) / math.sqrt(1 - (sine_alpha * cosine) ** 2)
    return slope * at_output, slope * abs(cosine) / (1 + tan_beta * tan_beta)
