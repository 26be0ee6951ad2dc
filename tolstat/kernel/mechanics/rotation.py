"""Finite rotations by rotation vectors phi: attitude exp(phi x), angular velocity, and their inverses.

With x = |phi|^2 and the coefficients s1 = sin|phi|/|phi|, s2 = (1 - cos|phi|)/x, s3 = (1 - s1)/x (Bauchau, Flexible
Multibody Dynamics, 2011, ch. 13):

    R = 1 + s1 phi x + s2 phi x phi x            attitude
    w = T phi',  T = 1 + s2 phi x + s3 phi x phi x   angular velocity in the axes that phi is given in
    T^-1 = 1 - phi x / 2 + s4 phi x phi x

A function takes `phi`, the coefficients `s` = (s1, s2, s3) at `phi`, and `rate`, the derivative of `phi`.
"""

import math

from tolstat.kernel.mechanics.vector import add, axpy, cross, dot, scale
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import all_of, where

SERIES_BELOW = 2.5e-3
"""|phi|^2 below which power series are used; their first omitted term is below 2e-16 there."""


@njit
def coefficients(x):
    """Return s1, s2, s3 at x = |phi|^2."""
    s1 = 1 - x * (1 / 6 - x * (1 / 120 - x * (1 / 5040)))
    s2 = 1 / 2 - x * (1 / 24 - x * (1 / 720 - x * (1 / 40320)))
    s3 = 1 / 6 - x * (1 / 120 - x * (1 / 5040 - x * (1 / 362880)))
    small = x < SERIES_BELOW
    if not all_of(small):
        angle = math.sqrt(x)
        ratio = math.sin(angle) / angle
        s1 = where(small, s1, ratio)
        s2 = where(small, s2, (1 - math.cos(angle)) / x)
        s3 = where(small, s3, (1 - ratio) / x)
    return s1, s2, s3


@njit
def inverse_coefficient(x):
    """Return s4 = (1 - (|phi|/2) cot(|phi|/2)) / x at x = |phi|^2."""
    # Bernoulli numbers: 1/12, 1/720, 1/30240, 1/1209600
    s4 = 1 / 12 + x * (1 / 720 + x * (1 / 30240 + x * (1 / 1209600)))
    small = x < SERIES_BELOW
    if not all_of(small):
        half = 0.5 * math.sqrt(x)
        s4 = where(small, s4, (1 - half / math.tan(half)) / x)
    return s4


@njit
def exponential(phi, s, out, i):
    """Write R = exp(phi x) to matrix `i` of `out`, shape (n, 3, 3)."""
    s1, s2, _ = s
    a, b, c = phi
    out[i, 0, 0] = 1 - s2 * (b * b + c * c)
    out[i, 1, 1] = 1 - s2 * (a * a + c * c)
    out[i, 2, 2] = 1 - s2 * (a * a + b * b)
    out[i, 0, 1] = s2 * a * b - s1 * c
    out[i, 1, 0] = s2 * a * b + s1 * c
    out[i, 0, 2] = s2 * a * c + s1 * b
    out[i, 2, 0] = s2 * a * c - s1 * b
    out[i, 1, 2] = s2 * b * c - s1 * a
    out[i, 2, 1] = s2 * b * c + s1 * a


@njit
def spin(phi, s, rate):
    """Angular velocity w = T(phi) rate, in the axes of phi."""
    _, s2, s3 = s
    turned = cross(phi, rate)
    return add(rate, axpy(s3, cross(phi, turned), scale(s2, turned)))


@njit
def unspin(phi, w):
    """Rate of the rotation vector, T(phi)^-1 w."""
    turned = cross(phi, w)
    return add(w, axpy(inverse_coefficient(dot(phi, phi)), cross(phi, turned), scale(-0.5, turned)))


@njit
def spin_bias(phi, s, rate):
    """Velocity-dependent part of the angular acceleration: dT/dt rate, so that w' = T phi'' + bias."""
    x, (s1, s2, s3) = dot(phi, phi), s
    small = x < SERIES_BELOW
    ds2 = -1 / 24 + x * (1 / 360 - x * (1 / 13440 - x * (1 / 907200)))
    ds3 = -1 / 120 + x * (1 / 2520 - x * (1 / 120960 - x * (1 / 9979200)))
    if not all_of(small):
        ds2 = where(small, ds2, (0.5 * s1 - s2) / x)
        ds3 = where(small, ds3, (0.5 * s2 - 1.5 * s3) / x)
    along = 2 * dot(phi, rate)
    turned = cross(phi, rate)
    twice = cross(phi, turned)
    back = cross(rate, turned)
    return add(scale(ds2 * along, turned), axpy(ds3 * along, twice, scale(s3, back)))


@njit
def spin_rate(phi, s, rate, change):
    """Angular acceleration w' = T(phi) change + dT/dt rate, `change` being the second derivative of phi."""
    turned = cross(phi, change)
    w = add(change, axpy(s[2], cross(phi, turned), scale(s[1], turned)))
    return add(w, spin_bias(phi, s, rate))


@njit
def about_z(angle, out, i):
    """Write the rotation by `angle` about z to matrix `i` of `out`, shape (n, 3, 3)."""
    x = angle * angle
    s1, s2, _ = coefficients(x)
    sine, cosine = s1 * angle, 1 - s2 * x
    out[i, 0, 0], out[i, 0, 1], out[i, 0, 2] = cosine, -sine, 0.0
    out[i, 1, 0], out[i, 1, 1], out[i, 1, 2] = sine, cosine, 0.0
    out[i, 2, 0], out[i, 2, 1], out[i, 2, 2] = 0.0, 0.0, 1.0


@njit
def relative_vector(rot, i, j):
    """Rotation vector of R_i^T R_j in axes i, for angles below pi; R_i: matrix `i` of `rot`, shape (n, 3, 3)."""
    r21 = r12 = r02 = r20 = r10 = r01 = trace = 0.0
    for k in range(3):
        r21 += rot[i, k, 2] * rot[j, k, 1]
        r12 += rot[i, k, 1] * rot[j, k, 2]
        r02 += rot[i, k, 0] * rot[j, k, 2]
        r20 += rot[i, k, 2] * rot[j, k, 0]
        r10 += rot[i, k, 1] * rot[j, k, 0]
        r01 += rot[i, k, 0] * rot[j, k, 1]
        trace += rot[i, k, 0] * rot[j, k, 0] + rot[i, k, 1] * rot[j, k, 1] + rot[i, k, 2] * rot[j, k, 2]
    return _logarithm((0.5 * (r21 - r12), 0.5 * (r02 - r20), 0.5 * (r10 - r01)), trace)


@njit
def relative_to_turned(rot, i, j):
    """`relative_vector` where R_i is a rotation about z."""
    c, s = rot[i, 0, 0], rot[i, 1, 0]
    r12, r02 = c * rot[j, 1, 2] - s * rot[j, 0, 2], c * rot[j, 0, 2] + s * rot[j, 1, 2]
    r10, r01 = c * rot[j, 1, 0] - s * rot[j, 0, 0], c * rot[j, 0, 1] + s * rot[j, 1, 1]
    trace = c * (rot[j, 0, 0] + rot[j, 1, 1]) + s * (rot[j, 1, 0] - rot[j, 0, 1]) + rot[j, 2, 2]
    return _logarithm((0.5 * (rot[j, 2, 1] - r12), 0.5 * (r02 - rot[j, 2, 0]), 0.5 * (r10 - r01)), trace)


@njit
def _logarithm(half, trace):
    """Rotation vector of a matrix: half the differences of its entries (21, 12), (02, 20), (10, 01), and its trace."""
    y = dot(half, half)  # sin^2 of the angle
    ratio = 1 + y * (1 / 6 + y * (3 / 40 + y * (5 / 112 + y * (35 / 1152))))  # asin(s)/s
    small = (y < 1e-3) & (trace > 1)
    if not all_of(small):
        s = math.sqrt(y)
        ratio = where(small, ratio, math.atan2(s, 0.5 * (trace - 1)) / s)
    return scale(ratio, half)
