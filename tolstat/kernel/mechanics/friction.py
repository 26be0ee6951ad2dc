"""Friction of pins in their holes, along and around them together (docs/model.md, "Friction in the bearings")."""

import math

from tolstat.kernel.mechanics.contact import in_hole, push
from tolstat.kernel.mechanics.motion import point_to_pin
from tolstat.kernel.mechanics.vector import axpy, choose, cross, dot, row, scale, sub
from tolstat.kernel.mechanics.work import DAMPING, FORCE, NORMAL, POINT, SLOPE, TANGENT
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import any_of, where


@njit
def lengthen(vector, axis, ratio):
    """S of `vector`: its part along the pin's `axis` counts by the `ratio` of the coefficients of friction."""
    return axpy((ratio - 1) * dot(vector, axis), axis, vector)


@njit
def rub(pin, par, work):
    """Add the friction of a pin to pin and hole; write ``work.rubbing[pin]`` and ``work.loss[pin]``.

    Where a station presses, the surfaces slide with w, and u = S w, where S lengthens the part along the pin by the
    ratio of the coefficients along and around it; friction is mu f S u / sqrt(u^2 + v_s^2). Its slopes by u along and
    across u are those of the tangent, SLOPE and DAMPING, with S of these directions; that by the force f is not
    symmetric, and left out.
    """
    body, hinge, kind, loss = par.pin[pin], par.hinge[pin], par.pair_kind[pin], 0.0 * work.drive[0]
    ratio = par.mu_ratio[kind]
    for j in range(par.n_stations[kind]):
        station, rubbing = work.station[pin, j], work.rubbing[pin, j]
        pressed = station[FORCE] > 0
        if not any_of(pressed):
            rubbing[FORCE] = rubbing[SLOPE] = rubbing[DAMPING] = 0.0
            continue
        normal = (station[NORMAL], station[NORMAL + 1], station[NORMAL + 2])
        point = (station[POINT], station[POINT + 1], station[POINT + 2])
        surface = point_to_pin(hinge, axpy(par.friction_radius[kind], normal, point), par, work)
        point, velocity = in_hole(pin, sub(surface, row(work.pos, body)), par, work)
        round_pin = (station[TANGENT], station[TANGENT + 1], station[TANGENT + 2])
        axis = cross(normal, round_pin)
        u = lengthen(axpy(-dot(velocity, normal), normal, velocity), axis, ratio)
        square = dot(u, u)
        regular = square + par.slip_speed[kind] * par.slip_speed[kind]
        drag = par.mu[kind] * station[FORCE] / math.sqrt(regular)
        sliding = square > 0
        along = choose(sliding, scale(1 / math.sqrt(where(sliding, square, 1.0)), u), round_pin)
        across = lengthen(cross(normal, along), axis, ratio)
        along = lengthen(along, axis, ratio)
        for k in range(3):
            rubbing[POINT + k], rubbing[NORMAL + k], rubbing[TANGENT + k] = point[k], along[k], across[k]
        rubbing[FORCE] = drag * math.sqrt(square)
        rubbing[SLOPE], rubbing[DAMPING] = drag * (1 - square / regular), drag
        push(pin, point, scale(drag, lengthen(u, axis, ratio)), par, work)
        loss += drag * square
    work.loss[pin] = loss
