"""Largest and smallest loads of a revolution of explicit steps, followed at every step.

They are the heights of parabolas through three steps, as in the closer look (`closeup`), but of squared moduli.
"""

import math

import numpy as np

from tolstat.common.tables import CONTACTS, INNER, OUTER
from tolstat.kernel.mechanics.topology import PSI
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import any_of, pick, retain, where

N_CONTACTS = 4 * len(CONTACTS)
PEAKS = np.dtype(
    [
        ("top", "f8", 16 + N_CONTACTS),  # |F|^2, |T|^2 of each bushing, contact forces of each pin
        ("low", "f8", 16),  # of |F|^2, |T|^2
        ("one", "f8", 16 + N_CONTACTS),  # of the last step
        ("two", "f8", 16 + N_CONTACTS),  # of the step before
        ("psi", "f8"),  # largest |Psi|, eq. (13)
    ]
)
"""Of one joint; a batch has them in lanes."""
NEAR = 0.9
"""Share of the largest value so far up to which no peak between steps is looked for."""


@njit
def follow_one(i, load, peaks):
    """Include the value `load` of curve `i`, and the peak at the step before, if there is one."""
    one, two, top = peaks.one[i], peaks.two[i], peaks.top[i]
    at_peak = (one >= two) & (one >= load) & (one > NEAR * top)
    if any_of(at_peak):
        bend = 2 * one - two - load
        bent = at_peak & (bend > 0)
        height = one + (load - two) * (load - two) / (8 * where(bent, bend, 1.0))
        top = max(top, where(bent, height, top))
    peaks.top[i], peaks.one[i], peaks.two[i] = max(top, load), load, one


@njit
def follow(work, v, peaks):
    """Include the loads in ``work``; `v`: velocities that they were evaluated at, (55,)."""
    for b in range(8):
        for kind in range(2):
            x, y, z = work.load[b, 3 * kind], work.load[b, 3 * kind + 1], work.load[b, 3 * kind + 2]
            square = x * x + y * y + z * z
            peaks.low[2 * b + kind] = min(peaks.low[2 * b + kind], square)
            follow_one(2 * b + kind, square, peaks)
    for pin in range(4):
        for i in range(len(CONTACTS)):
            follow_one(16 + len(CONTACTS) * pin + i, work.contact[pin, i], peaks)
    peaks.psi = max(peaks.psi, abs(v[PSI] / (work.shaft[0] + v[PSI])))


@njit
def forget(mask, peaks):
    """Reset in the lanes of the mask; NaN stands for steps before the first one, so that it is no peak."""
    for i in range(16 + N_CONTACTS):
        peaks.top[i] = retain(mask, 0.0, peaks.top[i])
        peaks.one[i], peaks.two[i] = retain(mask, np.nan, peaks.one[i]), retain(mask, np.nan, peaks.two[i])
        if i < 16:
            peaks.low[i] = retain(mask, np.inf, peaks.low[i])
    peaks.psi = retain(mask, 0.0, peaks.psi)


@njit
def largest_at_an_end(lane, peaks):
    """Largest contact force of any end station, N."""
    largest = 0.0
    for pin in range(4):
        first = 16 + len(CONTACTS) * pin
        largest = max(largest, pick(peaks.top[first + OUTER], lane), pick(peaks.top[first + INNER], lane))
    return largest


@njit
def write_peaks(lane, peaks, out):
    """Write largest and smallest loads of a lane to `out`, a row of RESULT."""
    for b in range(8):
        for kind in range(2):
            top = math.sqrt(pick(peaks.top[2 * b + kind], lane))
            reach = top - math.sqrt(pick(peaks.low[2 * b + kind], lane))
            if kind == 0:
                out.F_max[b], out.F_range[b] = top, reach
            else:
                out.T_max[b], out.T_range[b] = top, reach
    for pin in range(4):
        for i in range(len(CONTACTS)):
            out.contact_max[pin, i] = pick(peaks.top[16 + len(CONTACTS) * pin + i], lane)
    out.psi_max = pick(peaks.psi, lane)
