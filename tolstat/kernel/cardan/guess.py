"""Initial guess for the equilibrium: rigid crosses in rigid forks, placed so that all four pins of each just touch.

An output shaft that may slide moves along its axis first, so that the pins of the input and of the output fork have the
same displacement across the plane of the cross: without axial force loaded pins centre it there. In the plane of the
cross, a rotation and a displacement of the cross and a rotation of the output shaft bring the four
pins into contact. Across that plane, the cross tilts and moves so that the pins are centred, up to a part of their
displacements that a rigid cross cannot remove, of the same size for all pins. Rotations are small. A joint behind
another one is turned with the shaft between them.

Joint k has the pairs from 4 k on, those of the output fork first, and the bushings from 8 k on.
"""

import math

from tolstat.kernel.mechanics.cardan import CROSS, OUTPUT
from tolstat.kernel.mechanics.contact import locate
from tolstat.kernel.mechanics.dynamics import set_bodies
from tolstat.kernel.mechanics.motion import ideal_motion, to_pin
from tolstat.kernel.mechanics.scale import centring_stiffness, mean_clearance
from tolstat.kernel.mechanics.spring import penetration
from tolstat.kernel.mechanics.triad import from_triad
from tolstat.kernel.mechanics.vector import add, cross, dot, row, scale
from tolstat.kernel.mechanics.work import NORMAL, RHO
from tolstat.kernel.simd.jit import njit

Z, ZERO = (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
LEAST = 0.1
"""Smallest displacement of a pin in the plane of the cross, as a share of its displacement at contact."""


@njit
def offset(pin, j, par, work):
    """Displacement (m) of station `j` in its hole, from `locate`, along the pin's t and along z of the cross."""
    station = work.station[pin, j]
    n = (station[NORMAL], station[NORMAL + 1], station[NORMAL + 2])
    d = scale(station[RHO], to_pin(par.hinge[pin], n, par, work))
    return dot(d, from_triad(par.pin[pin], (0.0, 1.0, 0.0), par)), d[2]


@njit
def travel_to_contact(pin, side, across, par, work):
    """Displacement along t that brings `pin` into contact, and the radius of the end station that touches first.

    Parameters
    ----------
    pin : int
        Number of the pair.
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
    kind, R = par.pair_kind[pin], par.at[par.lump_kind[par.pin[pin]], 0]
    load = abs(work.drive[2]) / (2 * R)
    best, radius = 0.0, 0.0
    for j in (0, par.n_stations[kind] - 1):
        reach = par.clearance[pin] + par.delta_d[kind] + penetration(load, kind, j, par.clearance[pin], par)
        reach = max(math.sqrt(max(reach * reach - across * across, 0.0)), LEAST * reach)
        along, _ = offset(pin, j, par, work)
        want, r = side * reach - along, R + par.station_s[kind, j]
        if radius == 0 or side * want / r < side * best / radius:
            best, radius = want, r
    return best, radius


@njit
def rigid_guess(t, at_rest, par, work, q):
    """Write the guess of the unknowns at time `t` (s) to `q`; `at_rest`: zeros, (n,); `work` is scratch."""
    q[:] = 0.0
    ideal_motion(par.omega * t, par, work)
    psi = 0.0
    for joint in range(par.cardan.shape[0]):
        psi = place_joint(joint, psi, at_rest, par, work, q)


@njit
def place_joint(joint, by_input, at_rest, par, work, q):
    """Write the unknowns of cross and output of a joint to `q`, in which those of the joints before it stand.

    Parameters
    ----------
    joint : int
        Its number.
    by_input : float
        Rotation of its input from the ideal one, rad.
    at_rest : ndarray, shape (dof,)
        Zeros.
    par, work : records of PARAM and WORK
        The joint; scratch.
    q : ndarray, shape (dof,)
        Written.

    Returns
    -------
    float
        Rotation of its output, rad.
    """
    first, member = 4 * joint, par.cardan[joint]
    share = by_input / work.frame_w[member, 2]
    psi = share * work.frame_w[member + OUTPUT, 2]
    if by_input != 0:
        move(member + CROSS, ZERO, scale(share, row(work.frame_w, member + CROSS)), par, q)
        move(member + OUTPUT, ZERO, scale(psi, Z), par, q)
    locate_all(q, at_rest, par, work)
    if slides(member + OUTPUT, par):
        move(member + OUTPUT, scale(shift_along_axis(joint, par, work), Z), ZERO, par, q)
        locate_all(q, at_rest, par, work)
    z0, z1 = middle(first, par, work), middle(first + 1, par, work)
    z2, z3 = middle(first + 2, par, work), middle(first + 3, par, work)
    R = par.at[par.lump_kind[par.pin[first]], 0]
    about_x, about_y = -(z0 - z1) / (2 * R), (z2 - z3) / (2 * R)
    up = -0.25 * (z0 + z1 + z2 + z3)
    across = 0.25 * abs(z0 + z1 - z2 - z3)

    forward = math.copysign(1.0, work.drive[2])
    want2, r2 = travel_to_contact(first + 2, -forward, across, par, work)
    want3, r3 = travel_to_contact(first + 3, -forward, across, par, work)
    turn_in = (want2 + want3) / (r2 + r3)
    want0, r0 = travel_to_contact(first, forward, across, par, work)
    want1, r1 = travel_to_contact(first + 1, forward, across, par, work)
    turn_out = (want0 + want1) / (r0 + r1)
    shift = (r0 * turn_out - want0, want2 - r2 * turn_in, up)
    turned = (turn_in - turn_out) / work.relative[2 * joint + 1, 0]
    move(member + CROSS, shift, (about_x, about_y, turn_in), par, q)
    move(member + OUTPUT, ZERO, scale(turned, Z), par, q)
    return psi + turned


@njit
def slides(member, par):
    """Whether the shaft of a member may move along its axis."""
    for shaft in range(par.slide.shape[0]):
        if par.frame[par.lump_kind.shape[0] + shaft] == member:
            return par.slide[shaft] >= 0 and par.slides > 0
    return False


@njit
def move(member, u, phi, par, q):
    """Displace all bodies of `member` by `u` (m) and turn them about its origin by `phi` (rad), in the unknowns `q`."""
    lumps = par.lump_kind.shape[0]
    for body in range(lumps):
        if par.frame[body] == member:
            moved = add(u, cross(phi, from_triad(body, row(par.at, par.lump_kind[body]), par)))
            for k in range(3):
                q[6 * body + k] += moved[k]
                q[6 * body + 3 + k] += phi[k]
    for shaft in range(par.turn.shape[0]):
        if par.frame[lumps + shaft] == member:
            if par.turn[shaft] >= 0:
                q[6 * lumps + par.turn[shaft]] += phi[2]
            if par.slide[shaft] >= 0:
                q[6 * lumps + par.slide[shaft]] += u[2]


@njit
def locate_all(q, v, par, work):
    """Write bodies and stations of all pins at the unknowns `q` and velocities `v`."""
    set_bodies(q, v, par, work)
    for pin in range(par.pin.shape[0]):
        locate(pin, par, work)


@njit
def shift_along_axis(joint, par, work):
    """Displacement s (m) of an output shaft that may slide: where the pins centre it, but for axial force and support.

    The stations of all pins are as `locate` wrote them at s = 0.
    """
    first = 4 * joint
    of_output = middle(first, par, work) + middle(first + 1, par, work)
    apart = of_output - middle(first + 2, par, work) - middle(first + 3, par, work)
    centred = 0.5 * apart / work.relative[2 * joint + 1, 0]
    stiffness = centring_stiffness(0, par) + par.k_a
    if stiffness == 0:
        return centred
    reach = 2 * mean_clearance(0, par)
    return centred + max(-reach, min(reach, (par.F_a - par.k_a * centred) / stiffness))


@njit
def middle(pin, par, work):
    """Displacement (m) of `pin` along z of the cross, mean over its stations."""
    total, stations = 0.0, par.n_stations[par.pair_kind[pin]]
    for j in range(stations):
        total += offset(pin, j, par, work)[1]
    return total / stations
