"""Amplitudes of the shafts' loads and of Psi at multiples of the input speed (docs/model.md, Results).

A load across a shaft is a vector in axes that do not turn; at order n its end moves on an ellipse, whose semi-major
axis is the amplitude: |Z+| + |Z-|, Z+- the Fourier coefficients of x +- i y. Of one number, y = 0, this is the
amplitude of its cosine. The sense of rotation and the angle of the first sample do not matter.
"""

import math

from tolstat.common.load_kinds import ORDERS, SPAN
from tolstat.kernel.simd.jit import njit

LATERAL_ORDERS, MOMENT_ORDERS, DRIVE_ORDERS, PSI_ORDERS = (
    SPAN[f"{key}_orders"].start for key in ("lateral", "moment", "drive", "psi")
)
"""First element of each kind."""


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
def of_order(i, samples, out):
    """Write all amplitudes of order ``ORDERS[i]`` to a row of KERNEL_RESULT."""
    n = samples.size
    turn_c, turn_s = math.cos(2 * math.pi * ORDERS[i] / n), -math.sin(2 * math.pi * ORDERS[i] / n)
    c, s = 1.0, 0.0
    none = (0.0, 0.0)
    fx = fy = mx = my = gx = gy = nx = ny = drive = psi = none  # f, m of the input shaft, g, n of the output shaft
    for k in range(n):
        one, two = samples[k].shafts[0], samples[k].shafts[1]
        fx, fy, mx, my = plus(fx, one[0], c, s), plus(fy, one[1], c, s), plus(mx, one[3], c, s), plus(my, one[4], c, s)
        gx, gy, nx, ny = plus(gx, two[0], c, s), plus(gy, two[1], c, s), plus(nx, two[3], c, s), plus(ny, two[4], c, s)
        drive, psi = plus(drive, one[5], c, s), plus(psi, samples[k].psi, c, s)
        c, s = c * turn_c - s * turn_s, s * turn_c + c * turn_s
    of_output = len(ORDERS) + i
    out.largest[LATERAL_ORDERS + i] = semi_major(fx, fy, n)
    out.largest[LATERAL_ORDERS + of_output] = semi_major(gx, gy, n)
    out.largest[MOMENT_ORDERS + i] = semi_major(mx, my, n)
    out.largest[MOMENT_ORDERS + of_output] = semi_major(nx, ny, n)
    out.largest[DRIVE_ORDERS + i] = semi_major(drive, none, n)
    out.largest[PSI_ORDERS + i] = semi_major(psi, none, n)


@njit
def write_orders(samples, out):
    """Write the amplitudes of the recorded revolution to a row of KERNEL_RESULT."""
    for i in range(len(ORDERS)):
        of_order(i, samples, out)
