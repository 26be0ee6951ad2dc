"""Amplitudes of the shafts' loads and of Psi at multiples of the input speed (docs/model.md, Results).

A load across a shaft is a vector in axes that do not turn; at order n its end moves on an ellipse, whose semi-major
axis is the amplitude: |Z+| + |Z-|, Z+- the Fourier coefficients of x +- i y. Of one number, y = 0, this is the
amplitude of its cosine. The sense of rotation and the angle of the first sample do not matter.
"""

import math

from tolstat.common.load_kinds import ORDERS, SPAN
from tolstat.kernel.simd.jit import njit

LATERAL, MOMENT, DRIVE, PSI = (SPAN[f"{key}_orders"].start for key in ("lateral", "moment", "drive", "psi"))
"""First element of each kind."""


@njit
def semi_major(of_x, of_y, n):
    """Amplitude of a vector from the sums of x e^(-i n theta) and y e^(-i n theta) over `n` samples."""
    (a, b), (c, d) = of_x, of_y
    return (math.sqrt((a - d) ** 2 + (b + c) ** 2) + math.sqrt((a + d) ** 2 + (b - c) ** 2)) / n


@njit
def of_shaft(shaft, order, samples):
    """Amplitudes of lateral force and bending moment of a shaft (0 input, 1 output) at an order."""
    n = samples.size
    turn_c, turn_s = math.cos(2 * math.pi * order / n), -math.sin(2 * math.pi * order / n)
    c, s = 1.0, 0.0
    f_x = f_y = m_x = m_y = (0.0, 0.0)
    for k in range(n):
        load = samples[k].shafts[shaft]
        f_x = (f_x[0] + load[0] * c, f_x[1] + load[0] * s)
        f_y = (f_y[0] + load[1] * c, f_y[1] + load[1] * s)
        m_x = (m_x[0] + load[3] * c, m_x[1] + load[3] * s)
        m_y = (m_y[0] + load[4] * c, m_y[1] + load[4] * s)
        c, s = c * turn_c - s * turn_s, s * turn_c + c * turn_s
    return semi_major(f_x, f_y, n), semi_major(m_x, m_y, n)


@njit
def of_speed(order, samples):
    """Amplitudes of driving torque and Psi at an order."""
    n = samples.size
    turn_c, turn_s = math.cos(2 * math.pi * order / n), -math.sin(2 * math.pi * order / n)
    c, s = 1.0, 0.0
    drive = psi = none = (0.0, 0.0)
    for k in range(n):
        drive = (drive[0] + samples[k].shafts[0, 5] * c, drive[1] + samples[k].shafts[0, 5] * s)
        psi = (psi[0] + samples[k].psi * c, psi[1] + samples[k].psi * s)
        c, s = c * turn_c - s * turn_s, s * turn_c + c * turn_s
    return semi_major(drive, none, n), semi_major(psi, none, n)


@njit
def write_orders(samples, out):
    """Write the amplitudes of the recorded revolution to a row of KERNEL_RESULT."""
    for i in range(len(ORDERS)):
        for shaft in range(2):
            j = len(ORDERS) * shaft + i
            out.largest[LATERAL + j], out.largest[MOMENT + j] = of_shaft(shaft, ORDERS[i], samples)
        out.largest[DRIVE + i], out.largest[PSI + i] = of_speed(ORDERS[i], samples)
