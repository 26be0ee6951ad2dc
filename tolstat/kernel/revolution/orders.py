"""Amplitudes of the shafts' loads and of Psi at multiples of the input speed (docs/model.md, Results).

A load across a shaft is a vector in axes that do not turn; at order n its end moves on an ellipse, whose semi-major
axis is the amplitude: |Z+| + |Z-|, Z+- the Fourier coefficients of x +- i y. Of one number, y = 0, this is the
amplitude of its cosine. The sense of rotation and the angle of the first sample do not matter.
"""

import math

from tolstat.common.load_kinds import ORDERS
from tolstat.kernel.mechanics.loads import (
    DRIVE_ORDERS,
    FAR_ORDERS,
    LATERAL_ORDERS,
    MOMENT_ORDERS,
    NEAR_ORDERS,
    PSI_ORDERS,
    bearing_loads,
)
from tolstat.kernel.simd.jit import njit


@njit
def semi_major(x, y, n):
    """Amplitude of a vector from its sums over `n` samples: `x`, `y` times the cosine, and times the sine."""
    (a, b), (c, d) = x, y
    return (math.sqrt((a - d) ** 2 + (b + c) ** 2) + math.sqrt((a + d) ** 2 + (b - c) ** 2)) / n


@njit
def plus(total, value, c, s):
    """Return the pair of sums `total` plus `value` times cosine `c` and sine `s`."""
    return total[0] + value * c, total[1] + value * s


@njit
def bearing_sums(j, fx, fy, mx, my, par):
    """Sums of the loads of both bearings of a shaft, number `j` of ``par.borne``, from those of its force and moment.

    `fx`, `fy`, `mx`, `my`: of their components, N and N m.
    """
    (near_xc, far_xc), (near_xs, far_xs) = bearing_loads(j, fx[0], my[0], par), bearing_loads(j, fx[1], my[1], par)
    (near_yc, far_yc), (near_ys, far_ys) = bearing_loads(j, fy[0], -mx[0], par), bearing_loads(j, fy[1], -mx[1], par)
    return (near_xc, near_xs), (near_yc, near_ys), (far_xc, far_xs), (far_yc, far_ys)


@njit
def of_order(i, par, samples, out):
    """Write all amplitudes of order number `i` of `ORDERS` to a row of KERNEL_RESULT."""
    n, number = samples.size, len(ORDERS)
    turn_c, turn_s = math.cos(2 * math.pi * ORDERS[i] / n), -math.sin(2 * math.pi * ORDERS[i] / n)
    none = (0.0, 0.0)
    for k in range(par.carried.shape[0]):
        shaft, c, s = par.carried[k], 1.0, 0.0
        fx = fy = mx = my = mz = none
        for point in range(n):
            of = samples[point].shafts[shaft]
            fx, fy, mx, my = plus(fx, of[0], c, s), plus(fy, of[1], c, s), plus(mx, of[3], c, s), plus(my, of[4], c, s)
            mz = plus(mz, of[5], c, s)
            c, s = c * turn_c - s * turn_s, s * turn_c + c * turn_s
        out.largest[par.begin[LATERAL_ORDERS] + number * k + i] = semi_major(fx, fy, n)
        out.largest[par.begin[MOMENT_ORDERS] + number * k + i] = semi_major(mx, my, n)
        for j in range(par.borne.shape[0]):
            if par.borne[j] == shaft:
                near_x, near_y, far_x, far_y = bearing_sums(j, fx, fy, mx, my, par)
                out.largest[par.begin[NEAR_ORDERS] + number * j + i] = semi_major(near_x, near_y, n)
                out.largest[par.begin[FAR_ORDERS] + number * j + i] = semi_major(far_x, far_y, n)
        for j in range(par.driven.shape[0]):
            if par.driven[j] == shaft:
                out.largest[par.begin[DRIVE_ORDERS] + number * j + i] = semi_major(mz, none, n)
    c, s = 1.0, 0.0
    psi = none
    for point in range(n):
        psi = plus(psi, samples[point].psi, c, s)
        c, s = c * turn_c - s * turn_s, s * turn_c + c * turn_s
    if par.Js.shape[0] > 0:
        out.largest[par.begin[PSI_ORDERS] + i] = semi_major(psi, none, n)


@njit
def write_orders(par, samples, out):
    """Write the amplitudes of the recorded revolution to a row of KERNEL_RESULT."""
    for i in range(len(ORDERS)):
        of_order(i, par, samples, out)
