"""Where the bodies stand when all four pins just touch: the rigid cross in rigid forks, as a start for equilibrium.

A turn of the cross, a shift of it and a turn of the output shaft bring four pins to their holes; across the plane of
the cross equal forces on all pins centre them but for what a rigid cross cannot follow. Small rotations.
"""

import math

from tolstat.kernel.mechanics.contact import locate
from tolstat.kernel.mechanics.dynamics import place
from tolstat.kernel.mechanics.motion import ideal_motion
from tolstat.kernel.mechanics.topology import ARM, ARM_OF_PIN, FRAME, FRAME_F, HUB, PIN, PSI, TRIAD
from tolstat.kernel.mechanics.vector import add, cross, dot, row, scale, turn_back
from tolstat.kernel.mechanics.work import NORMAL, RHO
from tolstat.kernel.simd.jit import njit

Z = (0.0, 0.0, 1.0)
LEAST = 0.1
"""Least share of the clearance by which a pin that is far off across the plane is moved within it."""


@njit
def offset(pin, j, work):
    """Displacement of station `j` in its hole along t and z of the cross, as `locate` found it."""
    station = work.station[pin, j]
    n = (station[NORMAL], station[NORMAL + 1], station[NORMAL + 2])
    d = scale(station[RHO], turn_back(work.relative, FRAME[ARM + ARM_OF_PIN[pin]], n))
    return dot(d, row(TRIAD[PIN + pin], 1)), d[2]


@njit
def depth(load, k1, k2):
    """Penetration at which a station carries `load`, eq. (5); 0 for a station without stiffness."""
    slope = k2 + math.sqrt(k2 * k2 + 4 * k1 * load)
    return 2 * load / slope if slope > 0 else 0.0


@njit
def need(pin, side, across, par, work):
    """Displacement along t at which `pin` carries on `side`, and the radius of the end station that touches first."""
    load = abs(par.torque) / (2 * par.R)
    best, radius = 0.0, 0.0
    for j in (0, par.n_stations - 1):
        reach = par.clearance[pin] + par.delta_d + depth(load, par.station_k1[j], par.station_k2[j])
        reach = max(math.sqrt(max(reach * reach - across * across, 0.0)), LEAST * reach)
        along, _ = offset(pin, j, work)
        want, r = side * reach - along, par.R + par.station_s[j]
        if radius == 0 or side * want / r < side * best / radius:
            best, radius = want, r
    return best, radius


@njit
def rigid_guess(t, par, work, state):
    """Write the bodies' places at time `t` to ``state.q0``."""
    q = state.q0
    q[:] = 0.0
    state.v0[:] = 0.0
    ideal_motion(par.omega * t, par.alpha, par.omega, work)
    place(q, state.v0, par, work)
    for pin in range(4):
        locate(pin, par, work)
    z0, z1, z2, z3 = middle(0, par, work), middle(1, par, work), middle(2, par, work), middle(3, par, work)
    about_x, about_y = -(z0 - z1) / (2 * par.R), (z2 - z3) / (2 * par.R)
    up = -0.25 * (z0 + z1 + z2 + z3)
    across = 0.25 * abs(z0 + z1 - z2 - z3)

    forward = math.copysign(1.0, par.torque)
    want2, r2 = need(2, -forward, across, par, work)
    want3, r3 = need(3, -forward, across, par, work)
    turn_in = (want2 + want3) / (r2 + r3)
    want0, r0 = need(0, forward, across, par, work)
    want1, r1 = need(1, forward, across, par, work)
    turn_out = (want0 + want1) / (r0 + r1)
    shift = (r0 * turn_out - want0, want2 - r2 * turn_in, up)
    psi = (turn_in - turn_out) / work.relative[FRAME_F, 2, 2]
    turned = (about_x, about_y, turn_in)
    for body in range(HUB, ARM):
        distance = 0.0 if body == HUB else par.R
        put_body(q, body, add(shift, cross(turned, scale(distance, row(TRIAD[body], 0)))), turned)
    for body in (ARM + 2, ARM + 3):
        put_body(q, body, scale(psi * par.R, row(TRIAD[body], 1)), scale(psi, Z))
    q[PSI] = psi


@njit
def middle(pin, par, work):
    """Displacement of `pin` along z of the cross, mean over its stations."""
    total = 0.0
    for j in range(par.n_stations):
        total += offset(pin, j, work)[1]
    return total / par.n_stations


@njit
def put_body(q, body, u, phi):
    """Write displacement and rotation vector of a lump."""
    for k in range(3):
        q[6 * body + k], q[6 * body + 3 + k] = u[k], phi[k]
