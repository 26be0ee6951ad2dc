"""Pins in holes: penetration, contact laws and contact modes (model, section 5; Cirelli et al. 2021, eqs. 3-7).

A pin touches its hole at stations along its axis. At each station n is the direction of the pin's displacement in
the hole, h the hole axis and m = h x n; f acts on the pin along -n, the film's drag along -m.
"""

import math

from tolstat.kernel._jit import njit
from tolstat.kernel.bushing import accumulate
from tolstat.kernel.lane import all_of, any_of, where
from tolstat.kernel.topology import ARM, ARM_OF_PIN, FRAME, PIN
from tolstat.kernel.vector import add, axpy, choose, cross, dot, row, scale, sub, turn, turn_back
from tolstat.kernel.work import (
    DELTA,
    EXCESS,
    FORCE,
    NORMAL,
    POINT,
    RHO,
    SLOPE,
    TANGENT,
    V_NORMAL,
    V_TANGENT,
)
from tolstat.tables import Law
from tolstat.tables import Mode as ContactMode

UNIFORM, POINT_LAW, MODE_LAW = int(Law.UNIFORM), int(Law.POINT), int(Law.MODE)
NONE, ONE_POINT, TWO_POINT, UNIFORM_MODE = (float(m) for m in ContactMode)
SMALLEST_RHO = 1e-15
"""Below it (m) the pin is centred and has no direction of displacement."""


@njit
def smooth_step(x):
    """Cubic step S: 0 below 0, x^2 (3 - 2 x), 1 beyond 1."""
    return where(x <= 0, 0.0, where(x >= 1, 1.0, x * x * (3 - 2 * x)))


@njit
def smooth_step_slope(x):
    """Derivative of `smooth_step`."""
    return where((x <= 0) | (x >= 1), 0.0, 6 * x * (1 - x))


@njit
def locate(pin, par, work):
    """Find where each station of `pin` stands in its hole; written to ``work.station[pin]``."""
    body, arm = PIN + pin, ARM + ARM_OF_PIN[pin]
    frame = FRAME[arm]
    axis = turn(work.rot, arm, row(par.hole_axis, ARM_OF_PIN[pin]))
    centre = add(row(work.pos, arm), turn(work.rot, arm, row(par.hole_point, ARM_OF_PIN[pin])))
    origin = turn(work.rot, body, row(par.pin_point, pin))
    direction = turn(work.rot, body, row(par.pin_axis, pin))
    for j in range(par.n_stations):
        lever = axpy(par.station_s[j], direction, origin)
        # the pin's point and its velocity against the arm's ideal frame, in axes of that frame
        point = turn(work.relative, frame, add(row(work.pos, body), lever))
        velocity = turn(work.relative, frame, add(row(work.vel, body), cross(row(work.spin, body), lever)))
        velocity = add(velocity, cross(row(work.relative_w, frame), point))
        arm_lever = sub(point, row(work.pos, arm))
        velocity = sub(velocity, add(row(work.vel, arm), cross(row(work.spin, arm), arm_lever)))

        d = sub(point, centre)
        gap = axpy(-dot(d, axis), axis, d)
        rho = math.sqrt(dot(gap, gap))
        displaced = rho > SMALLEST_RHO
        n = scale(1 / where(displaced, rho, 1.0), gap)
        if not all_of(displaced):  # else any direction across the hole: no force acts
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
def sharing(pin, law, work):
    """Weight w of uniform contact in the law `mode`, with its derivatives, to ``work.mode_weight[pin]``.

    w = r^2 (3 - 2 r) max(0, n_a . n_b), r the ratio of the smaller to the larger penetration; derivatives by
    delta_a, by a displacement of a along m_a, and the same for b.
    """
    out = work.mode_weight[pin]
    for k in range(5):
        out[k] = 0.0
    if law == UNIFORM:
        out[0] = 1.0
    if law != MODE_LAW:
        return
    a, b = work.station[pin, 0], work.station[pin, 1]
    touching = (a[DELTA] > 0) & (b[DELTA] > 0)
    if not any_of(touching):
        return
    cosine = along_a = along_b = 0.0
    for k in range(3):
        cosine += a[NORMAL + k] * b[NORMAL + k]
        along_a += a[TANGENT + k] * b[NORMAL + k]
        along_b += a[NORMAL + k] * b[TANGENT + k]
    shared = touching & (cosine > 0)
    a_is_larger = a[DELTA] >= b[DELTA]
    larger, smaller = max(a[DELTA], b[DELTA]), min(a[DELTA], b[DELTA])
    r = smaller / larger
    step, slope = smooth_step(r), smooth_step_slope(r)
    by_smaller, by_larger = slope * cosine / larger, -slope * cosine * r / larger
    out[0] = where(shared, step * cosine, 0.0)
    out[1] = where(shared, where(a_is_larger, by_larger, by_smaller), 0.0)
    out[3] = where(shared, where(a_is_larger, by_smaller, by_larger), 0.0)
    out[2] = where(shared, step * along_a / a[RHO], 0.0)
    out[4] = where(shared, step * along_b / b[RHO], 0.0)


@njit
def press(pin, w, par, work):
    """Normal force of each station, its slope by delta, and uniform less point law, to ``work.station[pin]``."""
    sliced = par.law > MODE_LAW
    for j in range(par.n_stations):
        station, weight = work.station[pin, j], par.station_weight[j]
        delta = station[DELTA]
        touching = delta > 0
        if not any_of(touching):
            station[FORCE] = station[SLOPE] = station[EXCESS] = 0.0
            continue
        ramp = smooth_step(delta / par.delta_d)
        slope_d = par.c_d * weight * smooth_step_slope(delta / par.delta_d) / par.delta_d * station[V_NORMAL]
        uniform = 0.5 * weight * (par.k1u * delta + par.k2u) * delta
        uniform_slope = 0.5 * weight * (2 * par.k1u * delta + par.k2u)
        point = (par.k1p * delta + par.k2p) * delta
        point_slope = 2 * par.k1p * delta + par.k2p
        elastic, slope, excess = uniform, uniform_slope, uniform - point
        if not sliced:
            elastic = w * uniform + (1 - w) * point
            slope = w * uniform_slope + (1 - w) * point_slope
        total = elastic + par.c_d * weight * ramp * station[V_NORMAL]
        pressed = touching & (total > 0)
        station[FORCE] = where(pressed, total, 0.0)
        station[SLOPE] = where(pressed, slope + slope_d, 0.0)
        station[EXCESS] = where(pressed, excess, 0.0)


@njit
def classify(pin, par, work):
    """Contact mode of `pin`: which stations touch, and on which side."""
    touching = 0.0
    opposed = False
    for j in range(par.n_stations):
        touches = work.station[pin, j, DELTA] > 0
        touching += where(touches, 1.0, 0.0)
        for i in range(j):
            cosine = 0.0
            for k in range(3):
                cosine += work.station[pin, i, NORMAL + k] * work.station[pin, j, NORMAL + k]
            opposed = opposed | (touches & (work.station[pin, i, DELTA] > 0) & (cosine < 0))
    one_sided = where(touching == par.n_stations, UNIFORM_MODE, ONE_POINT)
    return where(touching == 0, NONE, where(opposed, TWO_POINT, one_sided))


@njit
def contact_load(pin, par, work):
    """Contact forces of `pin`: added to pin and arm; ``work.contact[pin]`` and ``work.mode[pin]`` are written."""
    body, arm = PIN + pin, ARM + ARM_OF_PIN[pin]
    locate(pin, par, work)
    sharing(pin, par.law, work)
    press(pin, work.mode_weight[pin, 0], par, work)
    work.contact[pin, 0] = work.contact[pin, 1] = 0.0
    for j in range(par.n_stations):
        station = work.station[pin, j]
        if not any_of(station[DELTA] > 0):
            continue
        s = par.station_s[j]
        outer = where(s == 0, 0.5, where(s > 0, 1.0, 0.0))
        work.contact[pin, 0] += outer * station[FORCE]
        work.contact[pin, 1] += (1 - outer) * station[FORCE]
        drag = par.c_t * par.station_weight[j] * smooth_step(station[DELTA] / par.delta_d) * station[V_TANGENT]
        n = (station[NORMAL], station[NORMAL + 1], station[NORMAL + 2])
        m = (station[TANGENT], station[TANGENT + 1], station[TANGENT + 2])
        point = (station[POINT], station[POINT + 1], station[POINT + 2])
        f_arm = axpy(station[FORCE], n, scale(drag, m))
        accumulate(work.force, arm, f_arm, cross(sub(point, row(work.pos, arm)), f_arm))
        f_pin = scale(-1.0, turn_back(work.relative, FRAME[arm], f_arm))
        lever = sub(turn_back(work.relative, FRAME[arm], point), row(work.pos, body))
        accumulate(work.force, body, f_pin, cross(lever, f_pin))
    work.mode[pin] = classify(pin, par, work)
