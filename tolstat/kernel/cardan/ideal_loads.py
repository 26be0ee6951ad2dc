"""Loads of the ideal joint in closed form: rigid bodies without errors, each pin in contact at the outer station.

The cross turns about O, so the forces on the two pins of an axis are opposite. R' is the distance of the contacts from
O, M the rate of angular momentum of hub and pins (C axes), T the resisting torque plus the rate of angular momentum of
output shaft and output arms:

    2 R' F_t cos(gamma) = T + M_x sin(gamma)             each output pin, in the plane of the cross
    2 R' F_t = (T + M_x sin(gamma)) / cos(gamma) + M_z   each input pin
    2 R' F_z = M_x on the output pins, M_y on the input pins, across that plane

Without inertia these are the statics of Seherr-Thoss, Schmelz, Aucktor (2006), Universal Joints and Driveshafts, ch. 4:
the couple T / cos(gamma) on the cross along its normal, and the secondary couples on the forks that tilt with it.
"""

import math

import numpy as np

from tolstat.common.load_kinds import INNER, OUTER, RESULTANT
from tolstat.common.tables import Mode
from tolstat.kernel.mechanics.bushing import accumulate, markers
from tolstat.kernel.mechanics.cardan import CROSS, OUTPUT
from tolstat.kernel.mechanics.dynamics import body_inertia, set_bodies, throw
from tolstat.kernel.mechanics.motion import ideal_motion, to_hole
from tolstat.kernel.mechanics.triad import from_triad, to_triad
from tolstat.kernel.mechanics.vector import add, cross, row, scale, sub
from tolstat.kernel.mechanics.work import FORCE, RHO
from tolstat.kernel.simd.jit import njit

NONE, ONE_POINT = int(Mode.NONE), int(Mode.ONE_POINT)
ZERO = (0.0, 0.0, 0.0)


@njit
def contact_radius(par):
    """Distance R' (m) of the contacts from O: distance R of the reference points plus the outermost station's s."""
    return par.R + par.station_s[0, 0]


@njit
def moving_moments(par, work):
    """Rates of angular momentum, N m: of the cross about O in C axes; of output shaft and output arms about z.

    Writes the resultant force and torque that each lump needs for its motion to ``work.force``; `touch` subtracts the
    contact forces from it.
    """
    output = par.cardan[0] + OUTPUT
    on_cross, on_shaft = ZERO, par.Js[0] * work.frame_dw[output, 2]
    for body in range(work.force.shape[0]):
        for k in range(6):
            work.force[body, k] = 0.0
    for body in range(par.lump_kind.shape[0]):
        f, torque = body_inertia(body, (ZERO, ZERO), par, work)
        accumulate(work.force, body, f, torque)
        about = add(torque, cross(row(work.pos, body), f))
        if par.frame[body] == par.cardan[0] + CROSS:
            on_cross = add(on_cross, about)
        elif par.frame[body] == output:
            on_shaft += about[2]
    return on_cross, on_shaft


@njit
def ideal_loads(phase, at_rest, par, work):
    """Write loads of the bushings, contact forces and modes of the ideal joint at one phase.

    Parameters
    ----------
    phase : float
        Mean input angle omega t, rad.
    at_rest : ndarray, shape (n,)
        Zeros.
    par : record of PARAM
        The joint; its errors and clearances are not used.
    work : record of WORK
        ``load``, ``contact``, ``mode`` and, of the shafts, ``force`` are written; other fields are scratch.
    """
    ideal_motion(phase, par, work)
    set_bodies(at_rest, at_rest, par, work)
    radius = contact_radius(par)
    moment, torque = moving_moments(par, work)
    cos_gamma, sin_gamma = work.relative[1, 0], -work.relative[1, 1]
    output = (work.drive[2] + torque + moment[0] * sin_gamma) / cos_gamma
    for pin in range(4):
        e, t = from_triad(par.pin[pin], (1.0, 0.0, 0.0), par), from_triad(par.pin[pin], (0.0, 1.0, 0.0), par)
        # moments of the contact forces about O: output pins -output about z and M_x about x, input pins the rest
        couple = -output if pin < 2 else output + moment[2]
        along_t = couple / (2 * radius)
        along_z = (moment[0] * e[1] if pin < 2 else -moment[1] * e[0]) / (2 * radius)
        force = add(scale(along_t, t), (0.0, 0.0, along_z))
        touch(pin, radius, force, par, work)
    for i in range(8):
        carry(i, par, work)
    for face in range(par.face_pair.shape[0]):
        work.face[face, FORCE] = 0.0
    throw(par, work)


@njit
def touch(pin, radius, force, par, work):
    """Write the contact force of `pin` and subtract it from the resultants that pin and arm need.

    Parameters
    ----------
    pin : int
        Pin, 0 to 3.
    radius : float
        Distance of the contact from O, m.
    force : tuple of 3 float
        Force on the pin, N, in C axes.
    par, work : records of PARAM and WORK
        The joint; ``contact``, ``mode`` and ``force`` are written.
    """
    hole = par.hole[pin]
    size = math.sqrt(force[0] ** 2 + force[1] ** 2 + force[2] ** 2)
    work.contact[pin, OUTER] = work.contact[pin, RESULTANT] = size
    work.contact[pin, INNER] = 0.0
    work.mode[pin] = ONE_POINT if size > 0 else NONE
    work.station[pin, :, RHO] = np.nan  # it has no displacement
    on_hole = to_hole(par.hinge[pin], force, par, work)
    for body, off in ((par.pin[pin], scale(-1.0, force)), (hole, on_hole)):
        lever = from_triad(body, (radius - par.R, 0.0, 0.0), par)
        accumulate(work.force, body, off, cross(lever, off))


@njit
def carry(i, par, work):
    """Write the load of bushing `i`: the resultant that its lump still needs, about the marker, in the triad.

    Its opposite acts on the base.
    """
    lump, base = par.bushing_lump[i], par.bushing_base[i]
    lever, on_base = markers(i, par)
    f = row(work.force, lump)
    torque = sub((work.force[lump, 3], work.force[lump, 4], work.force[lump, 5]), cross(lever, f))
    off = scale(-1.0, f)
    accumulate(work.force, base, off, add(cross(on_base, off), scale(-1.0, torque)))
    f, torque = to_triad(lump, f, par), to_triad(lump, torque, par)
    for k in range(3):
        work.load[i, k], work.load[i, 3 + k] = f[k], torque[k]
