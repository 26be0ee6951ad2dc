"""Sine and cosine without a call of the C library: the same operations for a plain number and for lanes.

The nearest multiple of a right angle is subtracted in three parts (Cody and Waite 1980). The power series end where
terms are below half a unit in the last place at 45 degrees. The error is at most 2e-16 while |x| < 1e6.
"""

import math

from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import fma, where

ROUNDING = 1.5 * 2.0**52
"""Adding this number to another one and subtracting it again rounds the other one to an integer."""
RIGHT_ANGLES = 2 / math.pi
HIGH, MIDDLE, LOW = 1.5707963109016418, 1.5893254712295857e-08, 6.123233995736766e-17
"""pi/2 in parts: products of the first two, of 26 bits each, with integers below 2^27 are exact."""


@njit
def sine_cosine(x):
    """Return sin(x) and cos(x), x in rad."""
    k = (x * RIGHT_ANGLES + ROUNDING) - ROUNDING
    r = ((x - k * HIGH) - k * MIDDLE) - k * LOW
    y = r * r
    s = fma(y, fma(y, 1 / 355687428096000, -1 / 1307674368000), 1 / 6227020800)
    s = fma(y, fma(y, fma(y, fma(y, s, -1 / 39916800), 1 / 362880), -1 / 5040), 1 / 120)
    sine = fma(r * y, fma(y, s, -1 / 6), r)
    c = fma(y, fma(y, 1 / 20922789888000, -1 / 87178291200), 1 / 479001600)
    c = fma(y, fma(y, fma(y, fma(y, c, -1 / 3628800), 1 / 40320), -1 / 720), 1 / 24)
    cosine = fma(y * y, c, fma(-0.5, y, 1.0))
    quarter = k - 4 * ((0.25 * k + ROUNDING) - ROUNDING)  # -2 to 2
    odd = abs(quarter) == 1
    sine, cosine = where(odd, cosine, sine), where(odd, sine, cosine)
    sine = where((quarter == -1) | (abs(quarter) == 2), -sine, sine)
    cosine = where((quarter == 1) | (abs(quarter) == 2), -cosine, cosine)
    return sine, cosine
