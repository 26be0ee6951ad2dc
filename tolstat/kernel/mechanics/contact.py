"""Pins in holes: penetration, contact forces and modes (docs/model.md, "Contacts"; Cirelli et al. 2021, eqs. 3-7).

A pin touches its hole at stations along its axis, each with its own spring: with every contact law the elastic forces
have a potential. At each station n is the direction of the pin's displacement in the hole, h the hole axis and
m = h x n; f acts on the pin along -n, the film's drag along -m.
"""

import math

from tolstat.common.load_kinds import INNER, OUTER, RESULTANT
from tolstat.common.tables import Mode as ContactMode
from tolstat.kernel.mechanics.bushing import accumulate
from tolstat.kernel.mechanics.motion import point_to_hole, point_to_pin, to_hole, to_pin, velocity_in
from tolstat.kernel.mechanics.spring import elastic, has_needles
from tolstat.kernel.mechanics.vector import add, axpy, choose, cross, dot, row, scale, sub, turn
from tolstat.kernel.mechanics.work import (
    DAMPING,
    DELTA,
    FILM,
    FORCE,
    NORMAL,
    POINT,
    RHO,
    SLOPE,
    TANGENT,
    V_NORMAL,
    V_TANGENT,
)
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import all_of, any_of, where

NONE, ONE_POINT, TWO_POINT, UNIFORM = (float(m) for m in ContactMode)
SMALLEST_RHO = 1e-15
"""Displacement (m) up to which the pin counts as centred, without a direction of displacement."""


@njit
def smooth_step(x):
    """Cubic step S: 0 below 0, x^2 (3 - 2 x), 1 beyond 1."""
    return where(x <= 0, 0.0, where(x >= 1, 1.0, x * x * (3 - 2 * x)))


@njit
def smooth_step_slope(x):
    """Derivative of `smooth_step`."""
    return where((x <= 0) | (x >= 1), 0.0, 6 * x * (1 - x))


@njit
def in_hole(pin, lever, par, work):
    """Position of a point of a pin in the frame of its hole's member, and its velocity relative to the hole there.

    `lever`: from the pin's reference point, in axes of the pin's member, m.
    """
    body, hole, hinge = par.pin[pin], par.hole[pin], par.hinge[pin]
    point = point_to_hole(hinge, add(row(work.pos, body), lever), par, work)
    velocity = to_hole(hinge, add(row(work.vel, body), cross(row(work.spin, body), lever)), par, work)
    velocity = velocity_in(hinge, velocity, point, par, work)
    hole_lever = sub(point, row(work.pos, hole))
    return point, sub(velocity, add(row(work.vel, hole), cross(row(work.spin, hole), hole_lever)))


@njit
def push(pin, point, f_hole, par, work):
    """Add the force `f_hole` at `point` to the pin's hole, its opposite to the pin; in axes of the hole's member."""
    body, hole, hinge = par.pin[pin], par.hole[pin], par.hinge[pin]
    accumulate(work.force, hole, f_hole, cross(sub(point, row(work.pos, hole)), f_hole))
    f_pin = scale(-1.0, to_pin(hinge, f_hole, par, work))
    lever = sub(point_to_pin(hinge, point, par, work), row(work.pos, body))
    accumulate(work.force, body, f_pin, cross(lever, f_pin))


@njit
def locate(pin, par, work):
    """Write position, normal, penetration and velocity of each station of `pin` to ``work.station[pin]``."""
    body, hole, kind = par.pin[pin], par.hole[pin], par.pair_kind[pin]
    axis = turn(work.rot, hole, row(par.hole_axis, pin))
    centre = add(row(work.pos, hole), turn(work.rot, hole, row(par.hole_point, pin)))
    origin = turn(work.rot, body, row(par.pin_point, pin))
    direction = turn(work.rot, body, row(par.pin_axis, pin))
    for j in range(par.n_stations[kind]):
        lever = axpy(par.station_s[kind, j], direction, origin)
        point, velocity = in_hole(pin, lever, par, work)
        d = sub(point, centre)
        gap = axpy(-dot(d, axis), axis, d)
        rho = math.sqrt(dot(gap, gap))
        displaced = rho > SMALLEST_RHO
        n = scale(1 / where(displaced, rho, 1.0), gap)
        if not all_of(displaced):  # centred: any normal of the hole axis will do, as no force acts
            across = cross(axis, direction)
            length = math.sqrt(dot(across, across))
            oblique = length > 0
            across = choose(oblique, scale(1 / where(oblique, length, 1.0), across), cross(axis, (0.0, 0.0, 1.0)))
            n = choose(displaced, n, across)
        m = cross(axis, n)
        station = work.station[pin, j]
        for k in range(3):
            station[POINT + k], station[NORMAL + k], station[TANGENT + k] = point[k], n[k], m[k]
        station[RHO], station[DELTA] = rho, rho - par.clearance[pin]
        station[V_NORMAL], station[V_TANGENT] = dot(velocity, n), dot(velocity, m)


@njit
def press(pin, par, work):
    """Write force, eq. (5), its slopes by delta and its rate, and the film's constant to ``work.station[pin]``."""
    kind = par.pair_kind[pin]
    needles, steepness = has_needles(kind, par), 1 / par.delta_d[kind]
    for j in range(par.n_stations[kind]):
        station = work.station[pin, j]
        delta = station[DELTA]
        touching = delta > 0
        if not any_of(touching):
            station[FORCE] = station[SLOPE] = station[DAMPING] = station[FILM] = 0.0
            continue
        ramp = par.station_weight[kind, j] * smooth_step(delta * steepness)
        ramp_slope = par.station_weight[kind, j] * smooth_step_slope(delta * steepness) * steepness
        force, slope = elastic(kind, j, delta, par.clearance[pin], needles, par)
        total = force + par.c_d[kind] * ramp * station[V_NORMAL]
        pressed = touching & (total > 0)
        station[FORCE] = where(pressed, total, 0.0)
        station[SLOPE] = where(pressed, slope + par.c_d[kind] * ramp_slope * station[V_NORMAL], 0.0)
        station[DAMPING], station[FILM] = where(pressed, par.c_d[kind] * ramp, 0.0), par.c_t[kind] * ramp


@njit
def classify(pin, par, work):
    """Contact mode of `pin` from its two end stations: which of them touch, and whether on the same side."""
    outer, inner = work.station[pin, 0], work.station[pin, par.n_stations[par.pair_kind[pin]] - 1]
    cosine = 0.0
    for k in range(3):
        cosine += outer[NORMAL + k] * inner[NORMAL + k]
    at_outer, at_inner = outer[DELTA] > 0, inner[DELTA] > 0
    both = where(cosine < 0, TWO_POINT, UNIFORM)
    return where(at_outer & at_inner, both, where(at_outer | at_inner, ONE_POINT, NONE))


@njit
def contact_load(pin, par, work):
    """Add the contact forces of `pin` to pin and hole; write ``work.contact[pin]`` and ``work.mode[pin]``."""
    locate(pin, par, work)
    press(pin, par, work)
    total, stations = (0.0, 0.0, 0.0), par.n_stations[par.pair_kind[pin]]
    for j in range(stations):
        station = work.station[pin, j]
        if not any_of(station[DELTA] > 0):
            continue
        drag = station[FILM] * station[V_TANGENT]
        n = (station[NORMAL], station[NORMAL + 1], station[NORMAL + 2])
        m = (station[TANGENT], station[TANGENT + 1], station[TANGENT + 2])
        point = (station[POINT], station[POINT + 1], station[POINT + 2])
        f_hole = axpy(station[FORCE], n, scale(drag, m))
        total = add(total, f_hole)
        push(pin, point, f_hole, par, work)
    work.contact[pin, OUTER] = work.station[pin, 0, FORCE]
    work.contact[pin, INNER] = work.station[pin, stations - 1, FORCE]
    work.contact[pin, RESULTANT] = math.sqrt(dot(total, total))
    work.mode[pin] = classify(pin, par, work)
