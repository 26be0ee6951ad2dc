"""Amplitudes of the shafts' loads and of Psi at multiples of the input speed (docs/model.md, Results).

A load across a shaft is a vector in axes that do not turn; at order n its end moves on an ellipse, whose semi-major
axis is the amplitude: |Z+| + |Z-|, Z+- the Fourier coefficients of x +- i y. Of one number, y = 0, this is the
amplitude of its cosine. The sense of rotation and the angle of the first sample do not matter.
"""

import math

from tolstat.common.load_kinds import ORDERS
from tolstat.kernel.mechanics.loads import DRIVE_ORDERS, LATERAL_ORDERS, MOMENT_ORDERS, PSI_ORDERS
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
def of_order(i, par, samples, out):
    """Write all amplitudes of order number `i` of `ORDERS` to a row of KERNEL_RESULT."""
    n, number = samples.size, len(ORDERS)
    turn_c, turn_s = math.cos(2 * math.pi * ORDERS[i] / n), -math.sin(2 * math.pi * ORDERS[i] / n)
    none = (0.0, 0.0)
    for shaft in range(par.turn.shape[0]):
        c, s = 1.0, 0.0
        fx = fy = mx = my = mz = none
        for k in range(n):
            of = samples[k].shafts[shaft]
            fx, fy, mx, my = plus(fx, of[0], c, s), plus(fy, of[1], c, s), plus(mx, of[3], c, s), plus(my, of[4], c, s)
            mz = plus(mz, of[5], c, s)
            c, s = c * turn_c - s * turn_s, s * turn_c + c * turn_s
        out.largest[par.begin[LATERAL_ORDERS] + number * shaft + i] = semi_major(fx, fy, n)
        out.largest[par.begin[MOMENT_ORDERS] + number * shaft + i] = semi_major(mx, my, n)
        for j in range(par.driven.shape[0]):
            if par.driven[j] == shaft:
                out.largest[par.begin[DRIVE_ORDERS] + number * j + i] = semi_major(mz, none, n)
    c, s = 1.0, 0.0
    psi = none
    for k in range(n):
        psi = plus(psi, samples[k].psi, c, s)
        c, s = c * turn_c - s * turn_s, s * turn_c + c * turn_s
    out.largest[par.begin[PSI_ORDERS] + i] = semi_major(psi, none, n)


@njit
def write_orders(par, samples, out):
    """Write the amplitudes of the recorded revolution to a row of KERNEL_RESULT."""
    for i in range(len(ORDERS)):
        of_order(i, par, samples, out)
