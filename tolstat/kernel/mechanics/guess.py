"""Initial guess for the equilibrium: a rigid cross in rigid forks, placed so that all four pins just touch.

An output shaft that may slide moves along its axis first, so that the pins of the input and of the output fork have the
same displacement across the plane of the cross: without axial force loaded pins centre it there. In the plane of the
cross, a rotation and a displacement of the cross and a rotation of the output shaft bring the four
pins into contact. Across that plane, the cross tilts and moves so that the pins are centred, up to a part of their
displacements that a rigid cross cannot remove, of the same size for all pins. Rotations are small.
"""

import math

from tolstat.kernel.mechanics.contact import locate
from tolstat.kernel.mechanics.dynamics import set_bodies
from tolstat.kernel.mechanics.motion import ideal_motion, to_cross
from tolstat.kernel.mechanics.scale import centring_stiffness, mean_clearance
from tolstat.kernel.mechanics.spring import penetration
from tolstat.kernel.mechanics.topology import ARM, ARM_OF_PIN, FRAME, FRAME_F, HUB, PIN, PSI, TRIAD, S
from tolstat.kernel.mechanics.vector import add, axpy, cross, dot, row, scale
from tolstat.kernel.mechanics.work import NORMAL, RHO
from tolstat.kernel.simd.jit import njit

Z = (0.0, 0.0, 1.0)
LEAST = 0.1
"""Smallest displacement of a pin in the plane of the cross, as a share of its displacement at contact."""


@njit
def offset(pin, j, work):
    """Displacement (m) of station `j` in its hole, from `locate`, along the pin's t and along z of the cross."""
    station = work.station[pin, j]
    n = (station[NORMAL], station[NORMAL + 1], station[NORMAL + 2])
    d = scale(station[RHO], to_cross(FRAME[ARM + ARM_OF_PIN[pin]], n, work))
    return dot(d, row(TRIAD[PIN + pin], 1)), d[2]


@njit
def travel_to_contact(pin, side, across, par, work):
    """Displacement along t that brings `pin` into contact, and the radius of the end station that touches first.

    Parameters
    ----------
    pin : int
        Pin, 0 to 3.
    side : float
        1 for contact in the direction of t, -1 for the opposite one.
    across : float
        Displacement across the plane of the cross that remains, m.
    par, work : records of PARAM and WORK
        The joint; its stations as `locate` wrote them, and the resisting torque.

    Returns
    -------
    tuple of float
        Displacement and distance of the station from O, m.
    """
    load = abs(work.drive[1]) / (2 * par.R)
    best, radius = 0.0, 0.0
    for j in (0, par.n_stations - 1):
        reach = par.clearance[pin] + par.delta_d + penetration(load, j, par.clearance[pin], par)
        reach = max(math.sqrt(max(reach * reach - across * across, 0.0)), LEAST * reach)
        along, _ = offset(pin, j, work)
        want, r = side * reach - along, par.R + par.station_s[j]
        if radius == 0 or side * want / r < side * best / radius:
            best, radius = want, r
    return best, radius


@njit
def rigid_guess(t, at_rest, par, work, q):
    """Write the guess of the unknowns at time `t` (s) to `q`; `at_rest`: zeros, (56,); `work` is scratch."""
    q[:] = 0.0
    ideal_motion(par.omega * t, par, work)
    locate_all(q, at_rest, par, work)
    if par.slides > 0:
        q[S] = shift_along_axis(par, work)
        for body in (ARM + 2, ARM + 3):
            q[6 * body + 2] = q[S]
        locate_all(q, at_rest, par, work)
    z0, z1, z2, z3 = middle(0, par, work), middle(1, par, work), middle(2, par, work), middle(3, par, work)
    about_x, about_y = -(z0 - z1) / (2 * par.R), (z2 - z3) / (2 * par.R)
    up = -0.25 * (z0 + z1 + z2 + z3)
    across = 0.25 * abs(z0 + z1 - z2 - z3)

    forward = math.copysign(1.0, work.drive[1])
    want2, r2 = travel_to_contact(2, -forward, across, par, work)
    want3, r3 = travel_to_contact(3, -forward, across, par, work)
    turn_in = (want2 + want3) / (r2 + r3)
    want0, r0 = travel_to_contact(0, forward, across, par, work)
    want1, r1 = travel_to_contact(1, forward, across, par, work)
    turn_out = (want0 + want1) / (r0 + r1)
    shift = (r0 * turn_out - want0, want2 - r2 * turn_in, up)
    psi = (turn_in - turn_out) / work.relative[FRAME_F, 0]
    turned = (about_x, about_y, turn_in)
    for body in range(HUB, ARM):
        distance = 0.0 if body == HUB else par.R
        put_body(q, body, add(shift, cross(turned, scale(distance, row(TRIAD[body], 0)))), turned)
    for body in (ARM + 2, ARM + 3):
        put_body(q, body, axpy(psi * par.R, row(TRIAD[body], 1), scale(q[S], Z)), scale(psi, Z))
    q[PSI] = psi


@njit
def locate_all(q, v, par, work):
    """Write bodies and stations of all pins at the unknowns `q` and velocities `v`."""
    set_bodies(q, v, par, work)
    for pin in range(4):
        locate(pin, par, work)


@njit
def shift_along_axis(par, work):
    """Displacement s (m) of an output shaft that may slide: where the pins centre it, but for axial force and support.

    The stations of all pins are as `locate` wrote them at s = 0.
    """
    apart = middle(0, par, work) + middle(1, par, work) - middle(2, par, work) - middle(3, par, work)
    centred = 0.5 * apart / work.relative[FRAME_F, 0]
    stiffness = centring_stiffness(0, par) + par.k_a
    if stiffness == 0:
        return centred
    reach = 2 * mean_clearance(0, par)
    return centred + max(-reach, min(reach, (par.F_a - par.k_a * centred) / stiffness))


@njit
def middle(pin, par, work):
    """Displacement (m) of `pin` along z of the cross, mean over its stations."""
    total = 0.0
    for j in range(par.n_stations):
        total += offset(pin, j, work)[1]
    return total / par.n_stations


@njit
def put_body(q, body, u, phi):
    """Write displacement `u` and rotation vector `phi` of a lump to the unknowns `q`."""
    for k in range(3):
        q[6 * body + k], q[6 * body + 3 + k] = u[k], phi[k]
