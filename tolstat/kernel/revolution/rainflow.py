"""Rainflow cycles of a periodic load: one revolution that repeats (ASTM E1049-85, 5.4.5)."""

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
        Written: the largest cycles in descending order, 0 where there are none. Where none is counted, the first is the
        whole range of the signal about its middle, so that its level is known.

    Returns
    -------
    int
        Number of cycles, including those that did not fit.
    """
    ranges[:] = 0.0
    means[:] = 0.0
    reversals = turning_points(x, points)
    highest, lowest = points[0], np.min(points[:reversals])
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
    if cycles == 0:
        ranges[0], means[0] = highest - lowest, 0.5 * (highest + lowest)
    return cycles


@njit
def count_joint(loads, places, factors, gates, ranges, means, cycles):
    """Rainflow cycles of signals of a joint, each a sum of load components at one place times factors.

    Parameters
    ----------
    loads : (n, places, components) array
        Components at each place over one revolution, finite.
    places : (signals,) array of int
        Place of each signal.
    factors : (signals, components) array
        Factor of each component.
    gates : (signals,) array
        Cycles up to this range are not counted.
    ranges, means : (signals, k) arrays
        Written, see `count`.
    cycles : (signals,) array of int
        Written: number of cycles.
    """
    n = loads.shape[0]
    x, points = np.empty(n), np.empty(n + 1)
    for c in range(len(places)):
        for s in range(n):
            x[s] = 0.0
            for i in range(loads.shape[2]):
                x[s] += factors[c, i] * loads[s, places[c], i]
        cycles[c] = count(x, gates[c], points, ranges[c], means[c])
