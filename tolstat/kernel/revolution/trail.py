"""History of a joint over many revolutions: closure errors, loads and statistics of each revolution.

With uniform steps only closure errors are stored, one number per check. With error-controlled steps (`resolve`) whole
revolutions are stored: loads that decide, for closure errors over several revolutions, and the statistics of each.
"""

import math
from typing import NamedTuple

import numpy as np

from tolstat.common.cardan import CARDAN
from tolstat.common.load_kinds import sizes
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import LIFE_EXPONENT, tables
from tolstat.kernel.mechanics.loads import size_of
from tolstat.kernel.mechanics.scale import axial_decay
from tolstat.kernel.mechanics.vector import larger
from tolstat.kernel.simd.jit import njit

MOST_ANGLES = 360
"""Maximum number of input angles per revolution at which loads are kept."""
MOST_CHECKS = 192
"""Maximum number of closure errors kept; older ones are overwritten."""
SLOW_DECAY = 0.05
"""Share of a deviation along the output shaft left after a revolution, estimated, from which it is watched: the true
one stays below a half, where it begins to matter, if the axial stiffness is four times less than estimated."""
SLOWEST_DECAY = 0.99
"""Largest share reckoned with: closure errors that no longer fall are rounding, or a change that does not decay."""


NOTES = np.dtype([("check", "f8", (MOST_CHECKS, 2)), ("count", "i8")])
"""Closure errors: revolutions and log10 of the error at each check; number of errors noted."""


class Trail(NamedTuple):
    """Work arrays; revolution r lies at index r modulo the capacity."""

    loads: np.ndarray  # (capacity, angles, n) loads that decide
    revolution: np.ndarray  # (capacity,) record of KERNEL_RESULT: statistics of each revolution
    notes: np.record  # NOTES


def make_trails(
    joints: int, steps_per_rev: int, capacity: int, mechanism: Mechanism = CARDAN
) -> tuple[np.ndarray, np.recarray, np.recarray]:
    """Allocate the arrays of the trails of several `joints`, for `capacity` revolutions of `steps_per_rev`."""
    angles = -(-steps_per_rev // _stride(steps_per_rev))
    loads = np.full((joints, capacity, angles, sizes(mechanism).deciding), np.nan)
    return loads, np.zeros((joints, capacity), tables(mechanism).KERNEL_RESULT).view(np.recarray), make_notes(joints)


def make_notes(joints: int) -> np.recarray:
    """Allocate, shape (joints,)."""
    return np.zeros(joints, NOTES).view(np.recarray)


def _stride(steps: int) -> int:
    return -(-steps // MOST_ANGLES)


@njit
def note_closure(revolutions, closure, notes):
    """Store a closure error; one without a finite logarithm is left out."""
    if 0 < closure < 1e300:
        i = notes.count % MOST_CHECKS
        notes.check[i, 0], notes.check[i, 1] = revolutions, math.log10(closure)
        notes.count += 1


@njit
def closure_trend(since, notes):
    """Fit a straight line to the logarithms of the closure errors from revolution `since` on.

    Returns
    -------
    slope : float
        Per revolution; NaN if there are fewer than two closure errors.
    scatter : float
        Root mean square deviation from the line.
    """
    n = 0
    x = y = xx = xy = yy = 0.0
    for i in range(min(notes.count, MOST_CHECKS)):
        if notes.check[i, 0] >= since:
            dx, value = notes.check[i, 0] - since, notes.check[i, 1]
            n += 1
            x, y = x + dx, y + value
            xx, xy, yy = xx + dx * dx, xy + dx * value, yy + value * value
    if n < 2:
        return np.nan, np.nan
    spread, product = xx - x * x / n, xy - x * y / n
    slope = product / spread
    return slope, math.sqrt(max(0.0, yy - y * y / n - slope * product) / n)


@njit
def with_slow_decay(closure, revolutions, par, notes):
    """Closure error, or what a slow decay still has ahead if that is more, up to 1, the whole load.

    Where each revolution leaves the share rho of the change before, those ahead sum to rho / (1 - rho) of the last
    one. Only the motion of an output shaft along its axis is slow enough to matter. Its rho follows from the closure
    errors of the last revolution or, before these are known, from the joint's parameters.

    Parameters
    ----------
    closure : float
        Closure error, the last of those noted, if any is.
    revolutions : float
        Revolutions at its end.
    par, notes
        As in all kernels.
    """
    rho = axial_decay(par)
    if rho < SLOW_DECAY:
        return closure
    slope, _ = closure_trend(revolutions - 1.001, notes)
    if notes.count > 1 and notes.check[0, 0] < revolutions - 0.99 and slope == slope:
        rho = 10**slope
    rho = min(rho, SLOWEST_DECAY)
    return max(closure, min(1.0, closure * rho / (1 - rho)))


@njit
def lag_closure(last, lag, par, trail):
    """Closure error of revolution `last` (from 0) against the one `lag` earlier, of bushing loads."""
    capacity, angles = trail.loads.shape[0], trail.loads.shape[1]
    now, before = trail.loads[last % capacity], trail.loads[(last - lag) % capacity]
    worst = 0.0
    for measure in range(par.measured.shape[0]):
        change = largest = 0.0
        first, number = par.of_measure[measure, 0], par.measured[measure, 1] - par.measured[measure, 0]
        for s in range(angles):
            for j in range(first, first + number):
                change = larger(change, abs(now[s, j] - before[s, j]))
                largest = max(largest, now[s, j])
        error = change / largest if largest > 0 else change
        worst = larger(worst, error)
    return worst


@njit
def keep_deciding(loads, par, deciding):
    """Copy the loads that decide to `deciding`, (n,)."""
    for j in range(par.deciding.shape[0]):
        deciding[j] = loads[par.deciding[j]]


@njit
def largest_change(of_all, before, par, out):
    """Largest change of a largest load that decides against `before`, (n,), relative to its measure.

    With `of_all` false, changes of bushing loads count, without what the shafts carry.
    """
    worst = 0.0
    for measure in range(par.measured.shape[0]):
        change, size = 0.0, size_of(measure, out.largest, par)
        first, last = par.of_measure[measure, 0], par.of_measure[measure, 1]
        for j in range(first, last if of_all else first + par.measured[measure, 1] - par.measured[measure, 0]):
            change = max(change, abs(out.largest[par.deciding[j]] - before[j]))
        worst = max(worst, change / size if size > 0 else 0.0)
    return worst


@njit
def combine(last, count, trail, out):
    """Write the statistics over the `count` revolutions up to `last` (from 0) to `out`, a row of KERNEL_RESULT."""
    capacity = trail.revolution.size
    for i in range(out.largest.shape[0]):
        top, low, total = trail.revolution[last % capacity].largest[i], np.inf, 0.0
        for r in range(last - count + 1, last + 1):
            statistics = trail.revolution[r % capacity]
            top = max(top, statistics.largest[i])
            if i < out.average.shape[0]:
                low, total = min(low, statistics.largest[i] - statistics.range[i]), total + statistics.average[i]
        out.largest[i] = top
        if i < out.average.shape[0]:
            out.average[i], out.range[i] = total / count, top - low
    out.mode_share[:] = 0.0
    for r in range(last - count + 1, last + 1):
        for pin in range(out.mode_share.shape[0]):
            for mode in range(out.mode_share.shape[1]):
                out.mode_share[pin, mode] += trail.revolution[r % capacity].mode_share[pin, mode] / count
    for pin in range(out.mode_share.shape[0]):
        total = 0.0
        out.tilt[pin] = out.line_load[pin] = 0.0
        for r in range(last - count + 1, last + 1):
            statistics = trail.revolution[r % capacity]
            total += statistics.equivalent_load[pin] ** LIFE_EXPONENT
            out.tilt[pin] = max(out.tilt[pin], statistics.tilt[pin])
            out.line_load[pin] = larger(out.line_load[pin], statistics.line_load[pin])
        out.equivalent_load[pin] = (total / count) ** (1 / LIFE_EXPONENT)
