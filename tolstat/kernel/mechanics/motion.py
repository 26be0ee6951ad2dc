"""Ideal motion of the members (docs/model.md, "Frames"); the unknowns are deviations from it."""

from tolstat.common.mechanism import DRIVEN, GENERAL, HELD, X, Y
from tolstat.kernel.mechanics.cardan import write_joints
from tolstat.kernel.mechanics.placed import place_members, relate
from tolstat.kernel.mechanics.trigonometry import sine_cosine
from tolstat.kernel.mechanics.vector import add, cross, row, sub, turn, turn_back
from tolstat.kernel.simd.jit import njit


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
    """Write the members' angular velocities and accelerations, and the rotations between them, to `work`.

    Parameters
    ----------
    phase : float
        Mean input angle omega t, rad.
    par : record of PARAM
        The joint.
    work : record of WORK
        Its ``frame_w``, ``frame_dw``, ``relative``, ``turned`` and ``drive`` are written.
    """
    theta, slope, bend, torque = drive_and_load(phase, par)
    omega, domega = par.omega * slope, par.omega * par.omega * bend
    work.drive[0], work.drive[1], work.drive[2] = omega, domega, torque
    if par.pivot.shape[0] > 0:
        place_members(theta, par, work)
    for member in range(par.motion.shape[0]):
        if par.motion[member] == HELD:
            set_turning(member, (1.0 + 0.0 * theta, 0.0 * theta), (0.0 * theta, 0.0 * theta), work)
        elif par.motion[member] == DRIVEN:
            s, c = sine_cosine(theta)
            set_turning(member, (c, s), (omega, domega), work)
    joints = par.cardan.shape[0]
    if joints > 0:
        write_joints(theta, par, work)
    for hinge in range(2 * joints, par.hinge_axis.shape[0]):
        pin, hole = par.hinge_pin[hinge], par.hinge_hole[hinge]
        if par.hinge_axis[hinge] == GENERAL:
            relate(hinge, par, work)
            continue
        c, s, c0, s0 = work.turned[pin, 0], work.turned[pin, 1], work.turned[hole, 0], work.turned[hole, 1]
        work.relative[hinge, 0], work.relative[hinge, 1] = c * c0 + s * s0, s * c0 - c * s0
        work.relative[hinge, 2] = work.frame_w[pin, 2] - work.frame_w[hole, 2]


@njit
def set_turning(member, turned, motion, work):
    """Write a member that turns about z.

    Parameters
    ----------
    member : int
        Its number.
    turned : tuple of float
        Cosine and sine of its angle.
    motion : tuple of float
        Its angular velocity (rad/s) and acceleration (rad/s^2).
    work : record of WORK
        Written.
    """
    work.turned[member, 0], work.turned[member, 1] = turned
    for k in range(2):
        work.frame_w[member, k] = work.frame_dw[member, k] = 0.0
    work.frame_w[member, 2], work.frame_dw[member, 2] = motion


@njit
def to_hole(hinge, a, par, work):
    """Components in axes of a hinge's hole of a vector in axes of its pin; both are members' frames."""
    c, s, axis = work.relative[hinge, 0], work.relative[hinge, 1], par.hinge_axis[hinge]
    if axis == X:
        return (a[0], c * a[1] - s * a[2], s * a[1] + c * a[2])
    if axis == Y:
        return (c * a[0] + s * a[2], a[1], c * a[2] - s * a[0])
    if axis == GENERAL:
        return turn(work.into_hole, hinge, a)
    return (c * a[0] - s * a[1], s * a[0] + c * a[1], a[2])


@njit
def to_pin(hinge, a, par, work):
    """Components in axes of a hinge's pin of a vector in axes of its hole."""
    c, s, axis = work.relative[hinge, 0], work.relative[hinge, 1], par.hinge_axis[hinge]
    if axis == X:
        return (a[0], c * a[1] + s * a[2], c * a[2] - s * a[1])
    if axis == Y:
        return (c * a[0] - s * a[2], a[1], s * a[0] + c * a[2])
    if axis == GENERAL:
        return turn_back(work.into_hole, hinge, a)
    return (c * a[0] + s * a[1], c * a[1] - s * a[0], a[2])


@njit
def point_to_hole(hinge, point, par, work):
    """Place of `point` in a hole's member, in its axes; given in the pin's."""
    if par.hinge_axis[hinge] == GENERAL:
        return add(turn(work.into_hole, hinge, point), row(work.place, hinge))
    return to_hole(hinge, point, par, work)


@njit
def point_to_pin(hinge, point, par, work):
    """Place of `point` in a pin's member, in its axes; given in the hole's."""
    if par.hinge_axis[hinge] == GENERAL:
        return turn_back(work.into_hole, hinge, sub(point, row(work.place, hinge)))
    return to_pin(hinge, point, par, work)


@njit
def velocity_in(hinge, velocity, point, par, work):
    """Velocity relative to the hole's frame of what moves with `velocity` in the pin's; all in axes of the hole's.

    `point`: where it is, m.
    """
    w, axis = work.relative[hinge, 2], par.hinge_axis[hinge]
    if axis == GENERAL:
        lever = sub(point, row(work.place, hinge))
        return add(add(velocity, row(work.place_v, hinge)), cross(row(work.relative_w, hinge), lever))
    if axis == X:
        return (velocity[0], velocity[1] - w * point[2], velocity[2] + w * point[1])
    if axis == Y:
        return (velocity[0] + w * point[2], velocity[1], velocity[2] - w * point[0])
    return (velocity[0] - w * point[1], velocity[1] + w * point[0], velocity[2])
