"""Rainflow cycles of a periodic load: one revolution that repeats (ASTM E1049-85, 5.4.5)."""

import math

import numpy as np

from tolstat.kernel.simd.jit import njit


@njit
def turning_points(x, points):
    """Find the reversals of a periodic signal, from its largest value to the same value one period later.

    Parameters
    ----------
    x : (n,) array
        One period, finite.
    points : (n + 1,) array
        Written: values of the reversals in order. Equal neighbours count as one sample.

    Returns
    -------
    int
        Number of values written: 1 for a constant, otherwise odd, the last equal to the first.
    """
    n = x.size
    top = 0
    for i in range(1, n):
        if x[i] > x[top]:
            top = i
    points[0] = x[top]
    m = 1
    for i in range(1, n + 1):
        value = x[(top + i) % n]
        if value == points[m - 1]:
            continue
        if m > 1 and (points[m - 1] - points[m - 2]) * (value - points[m - 1]) > 0:
            points[m - 1] = value
        else:
            points[m] = value
            m += 1
    return m


@njit
def keep(size, mean, ranges, means):
    """Insert a cycle, range `size` about `mean`, into `ranges` and `means`, (k,), in descending order.

    The smallest one drops out.
    """
    k = ranges.size - 1
    if not size > ranges[k]:
        return
    while k > 0 and size > ranges[k - 1]:
        ranges[k], means[k] = ranges[k - 1], means[k - 1]
        k -= 1
    ranges[k], means[k] = size, mean


@njit
def count(x, gate, points, ranges, means):
    """Rainflow cycles of a periodic signal.

    Counted from the largest value on, every cycle closes within the period: no residue, no half cycles.

    Parameters
    ----------
    x : (n,) array
        One period, finite.
    gate : float
        Cycles whose range is not above it are not counted.
    points : (n + 1,) array
        Scratch.
    ranges, means : (k,) arrays
        Written: the largest cycles in descending order, 0 where there are none.

    Returns
    -------
    int
        Number of cycles, including those that did not fit.
    """
    ranges[:] = 0.0
    means[:] = 0.0
    reversals = turning_points(x, points)
    cycles = m = 0
    for i in range(reversals):
        points[m] = points[i]  # the stack of open reversals lies in the part already read
        m += 1
        while m >= 3 and abs(points[m - 1] - points[m - 2]) >= abs(points[m - 2] - points[m - 3]):
            size = abs(points[m - 2] - points[m - 3])
            if size > gate:
                keep(size, 0.5 * (points[m - 2] + points[m - 3]), ranges, means)
                cycles += 1
            points[m - 3] = points[m - 1]
            m -= 2
    return cycles


@njit
def count_joint(loads, relative_gate, ranges, means, cycles):
    """Rainflow cycles of all channels of a joint.

    Parameters
    ----------
    loads : (n, 8, 6) array
        Force (N) and torque (N m) along e, t, z of each bushing over one revolution, finite.
    relative_gate : float
        Cycles up to this fraction of the joint's largest force or torque are not counted.
    ranges, means : (64, k) arrays
        Written, see `count`. For each bushing in turn force e, t, z, torque e, t, z, and the moduli of both.
    cycles : (64,) array of int
        Written: number of cycles.
    """
    n = loads.shape[0]
    moduli = np.empty((n, 8, 2))
    x, points = np.empty(n), np.empty(n + 1)
    for kind in (0, 1):
        largest = 0.0
        for s in range(n):
            for b in range(8):
                square = 0.0
                for i in range(3):
                    square += loads[s, b, 3 * kind + i] ** 2
                moduli[s, b, kind] = math.sqrt(square)
                largest = max(largest, moduli[s, b, kind])
        gate = relative_gate * largest
        for b in range(8):
            for i in range(4):
                for s in range(n):
                    x[s] = moduli[s, b, kind] if i == 3 else loads[s, b, 3 * kind + i]
                c = 8 * b + (6 + kind if i == 3 else 3 * kind + i)
                cycles[c] = count(x, gate, points, ranges[c], means[c])
