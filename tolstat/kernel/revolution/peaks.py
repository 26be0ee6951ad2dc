"""Largest and smallest loads of a revolution of explicit steps, followed at every step.

They are the heights of parabolas through three steps, as in the closer look (`closeup`), but of squared moduli.
"""

import math
from functools import cache

import numpy as np

from tolstat.common.load_kinds import CONTACTS, INNER, OUTER, sizes
from tolstat.kernel.mechanics.loads import CONTACT_FORCES, write_loads
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import any_of, pick, retain, where


@cache
def peaks_dtype(mechanism):
    """Type PEAKS, of one joint; a batch has them in lanes."""
    instant, averaged = sizes(mechanism).instant, sizes(mechanism).averaged
    return np.dtype(
        [
            ("last", "f8", instant),  # loads as `write_loads` writes them, at the last step
            ("before", "f8", instant),  # at the step before
            ("top", "f8", instant),  # largest so far
            ("low", "f8", averaged),  # smallest so far
        ]
    )


NEAR = 0.9
"""Share of the largest value so far up to which no peak between steps is looked for."""


@njit
def follow_value(i, load, par, peaks):
    """Include the value `load` of load `i` in `peaks`; if it is interpolated, also its peak at the step before."""
    last, before, top = peaks.last[i], peaks.before[i], peaks.top[i]
    if par.interpolated[i] == 1:
        at_peak = (last >= before) & (last >= load) & (last > NEAR * top)
        if any_of(at_peak):
            bend = 2 * last - before - load
            bent = at_peak & (bend > 0)
            height = last + (load - before) * (load - before) / (8 * where(bent, bend, 1.0))
            top = max(top, where(bent, height, top))
        peaks.last[i], peaks.before[i] = load, last
    peaks.top[i] = max(top, load)
    if i < peaks.low.shape[0]:
        peaks.low[i] = min(peaks.low[i], load)


@njit
def follow(par, work, v, peaks):
    """Include the loads in ``work`` in `peaks`; `v`: velocities that they were evaluated at, (dof,)."""
    write_loads(v, par, work)
    for i in range(work.loads.shape[0]):
        follow_value(i, work.loads[i], par, peaks)


@njit
def forget(mask, peaks):
    """Reset in the lanes of the mask; NaN stands for steps before the first one, so that it is no peak."""
    for i in range(peaks.top.shape[0]):
        peaks.top[i] = retain(mask, 0.0, peaks.top[i])
        peaks.last[i], peaks.before[i] = retain(mask, np.nan, peaks.last[i]), retain(mask, np.nan, peaks.before[i])
        if i < peaks.low.shape[0]:
            peaks.low[i] = retain(mask, np.inf, peaks.low[i])


@njit
def largest_at_an_end(lane, par, peaks):
    """Largest contact force of any end station, N."""
    largest = 0.0
    for pin in range(par.pin.shape[0]):
        first = par.begin[CONTACT_FORCES] + len(CONTACTS) * pin
        largest = max(largest, pick(peaks.top[first + OUTER], lane), pick(peaks.top[first + INNER], lane))
    return largest


@njit
def write_peaks(lane, par, peaks, out):
    """Write largest and smallest loads in `peaks` of a lane to `out`, a row of KERNEL_RESULT."""
    for i in range(peaks.top.shape[0]):
        top = pick(peaks.top[i], lane)
        out.largest[i] = math.sqrt(top) if par.modulus[i] == 1 else top
        if i < peaks.low.shape[0]:
            low = pick(peaks.low[i], lane)
            out.range[i] = out.largest[i] - (math.sqrt(low) if par.modulus[i] == 1 else low)
