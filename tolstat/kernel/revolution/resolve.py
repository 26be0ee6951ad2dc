"""Decisions after each revolution of a joint with error-controlled steps (`mesh`) or explicit ones (`explicit`).

Once the motion repeats, after one or several revolutions, the joint continues with steps half as long until it repeats
again: from the change of the largest loads their error is estimated. A joint that does not repeat is integrated up to a
limit.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from tolstat.common import tables
from tolstat.common.cardan import CARDAN
from tolstat.common.load_kinds import sizes
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import Options
from tolstat.kernel.codes import NOT_FINITE, NOT_SETTLED, OK, STAGED_STEP, TOLERANCE
from tolstat.kernel.integrators.mesh import CELL, cells_of, forget_mesh, refine_mesh, set_scale
from tolstat.kernel.mechanics.loads import OF_FORCES, OF_TORQUES, size_of
from tolstat.kernel.mechanics.scale import SMALLEST_FORCE, typical_force
from tolstat.kernel.revolution.closeup import extend
from tolstat.kernel.revolution.settle import BUSHINGS_ONLY, closure_error, summarise
from tolstat.kernel.revolution.trail import (
    Trail,
    closure_trend,
    combine,
    keep_deciding,
    lag_closure,
    largest_change,
    make_trails,
    note_closure,
    with_slow_decay,
)
from tolstat.kernel.simd.jit import njit

follows_error = njit(tables.follows_error)
NEARLY, PATIENT = 1.5e-2, 10
"""Closure error at which the steps are halved, if need be, and number of revolutions after which the first ones are
halved anyway: a joint need not settle with all steps."""
ENOUGH = 0.1
"""Closure error at which a joint has settled in any case, in units of the last change of its largest bushing loads: a
third of their error."""
RESOLVED = 2e-2
"""Change of the largest loads by halving the steps, relative to the largest of their kind, up to which these are not
halved again. A method of order 2 leaves a third of it as error."""
FAR = 2 * RESOLVED
"""Change in the first revolution with steps half as long above which they are halved again at once."""
SETTLING = 16
"""Minimum number of revolutions with steps half as long before a joint is given up."""
TIGHTER = 8
"""Factor from one tolerance of error-controlled steps to the next tighter one: it halves the steps."""
LONGEST_PERIOD = 8
"""Longest period that is recognised, revolutions."""
MIN_FALL, MIN_FALL_OVER_SCATTER = 0.1, 10.0
"""Minimum fall of log10(closure) over the revolutions kept that counts as settling, and factor by which it must exceed
its scatter: closure errors of chaotic joints wander, and fell by four to five times their scatter in some."""


@cache
def turns_dtype(mechanism):
    """Type TURNS: number of the revolution, and what has been found so far."""
    return np.dtype(
        [
            ("revolution", "i8"),  # revolutions completed
            ("since", "i8"),  # revolutions completed before the steps in use
            ("limit", "i8"),  # revolutions after which the joint is given up
            ("halved", "i8"),  # number of times that the steps were halved to estimate their error
            ("period", "i8"),  # period found with the steps before, revolutions; 0: none
            ("force", "f8"),  # largest |F| of the last revolution, N; before the first one, an estimate
            ("torque", "f8"),  # largest |T|, N m
            ("steps", "i8"),  # explicit steps of a revolution before they were halved
            ("bearable", "f8"),  # contact force of an end station up to which the steps in use are stable, N
            ("before", "f8", sizes(mechanism).deciding),  # largest loads that decide, with the steps before
        ]
    )


class Past(NamedTuple):
    """Data of one joint that are kept from revolution to revolution."""

    trail: Trail
    turns: np.record  # TURNS
    extremes: np.recarray  # (2,) KERNEL_RESULT: largest and smallest loads of the current cell and revolution
    begun: np.ndarray  # (3, dof) q, v, a at the start of the current cell
    mesh: np.recarray  # (cells,) CELL


class Pasts(NamedTuple):
    """Data of several joints, fields as in `Past`, each array with a leading axis of joints.

    Kernels return no records: each caller makes the `Past` of one joint itself.
    """

    loads: np.ndarray
    revolution: np.recarray
    notes: np.recarray
    turns: np.recarray
    extremes: np.recarray
    begun: np.ndarray
    mesh: np.recarray


def make_pasts(joints: int, options: Options, mechanism: Mechanism = CARDAN) -> Pasts:
    """Allocate for several joints."""
    trails = make_trails(joints, options.steps_per_rev, revolutions_kept(options), mechanism)
    turns = np.zeros(joints, turns_dtype(mechanism)).view(np.recarray)
    extremes = np.zeros((joints, 2), tables.tables(mechanism).KERNEL_RESULT).view(np.recarray)
    cells = options.steps_per_rev * cells_of(options.steps_per_rev)
    mesh = np.zeros((joints, cells), CELL).view(np.recarray)
    return Pasts(*trails, turns, extremes, np.zeros((joints, 3, mechanism.dof)), mesh)


def revolutions_kept(options: Options) -> int:
    """Number of revolutions kept of a joint: all of them with error-controlled steps, else one."""
    return options.max_revs if follows_error(options) else 1


@njit
def closure_target(options, turns):
    """Closure error at which a joint is finished with the steps in use: it ends or they are halved."""
    return options.settle_tol if turns.halved > 0 else max(NEARLY, options.settle_tol)


@njit
def begin_turns(par, options, past):
    """Initialise `past` for a joint at its start."""
    turns = past.turns
    turns.revolution = turns.since = turns.halved = turns.period = 0
    turns.limit = options.max_revs
    turns.force = typical_force(par)
    turns.torque = turns.force * par.R
    past.trail.notes.count = 0
    clear_extremes(past.extremes[1], par)


@njit
def clear_extremes(extremes, par):
    """Reset largest and smallest loads."""
    for i in range(par.modulus.shape[0]):
        extremes.largest[i] = 0.0
    for i in range(extremes.average.shape[0]):
        extremes.range[i] = -np.inf


@njit
def merge_extremes(extremes, par, out):
    """Include `extremes` in those of `out`."""
    averaged = out.average.shape[0]
    for i in range(averaged):
        low = extremes.largest[i] - extremes.range[i]
        top, span = extend(extremes.largest[i], out.largest[i], out.range[i])
        out.largest[i], out.range[i] = top, max(span, top - low)
    for i in range(averaged, par.modulus.shape[0]):
        out.largest[i] = max(out.largest[i], extremes.largest[i])


@njit
def keep_revolution(par, samples, extremes, trail, r):
    """Store loads and statistics of revolution `r` (from 0) of the joint; reset `extremes`; return the statistics.

    Largest and smallest loads are those of all parts: parabolas through samples of the grid would overshoot spikes.
    """
    statistics = trail.revolution[r % trail.revolution.size]
    summarise(par, samples, statistics)
    clear_extremes(statistics, par)
    merge_extremes(extremes, par, statistics)
    clear_extremes(extremes, par)
    stride = -(-samples.size // trail.loads.shape[1])
    for s in range(0, samples.size, stride):
        keep_deciding(samples[s].loads, par, trail.loads[r % trail.revolution.size, s // stride])
    return statistics


@njit
def find_period(last, closure, tolerance, par, turns, trail):
    """Period, in revolutions, of the motion at the end of revolution `last` (from 0); 0 if it does not repeat.

    `closure`: error against the revolution before; the motion repeats where such an error is at most `tolerance`.
    """
    if closure <= tolerance:
        return 1
    known = last + 1 - turns.since
    if known < 2 * LONGEST_PERIOD and turns.period < 2:
        return 0
    for lag in range(2, min(LONGEST_PERIOD, known // 2) + 1):
        if lag_closure(last, lag, par, trail) <= tolerance:
            return lag
    return 0


@njit
def halve_steps(period, par, turns, out):
    """Halve the steps from the next revolution on; keep `period` and the largest loads in `out` for comparison."""
    keep_deciding(out.largest, par, turns.before)
    turns.halved += 1
    turns.since, turns.period = turns.revolution, period
    turns.limit = max(turns.limit, turns.revolution + SETTLING)


@njit
def repeats(last, par, options, trail, turns, out):
    """Whether a joint repeats after revolution `last` (from 0), and its largest loads are resolved.

    Loads that no further halving is allowed for count as resolved; others that are not halve the steps.
    """
    period = find_period(last, out.closure, max(NEARLY, options.settle_tol), par, turns, trail)
    tired = turns.halved == 0 and last + 1 >= PATIENT
    if period == 0 and not tired:
        return False
    combine(last, max(1, period), trail, out)
    change = largest_change(True, turns.before, par, out) if turns.halved > 0 else np.nan
    if turns.halved < options.max_refinements and not change <= RESOLVED:
        halve_steps(period, par, turns, out)
        return False
    change_of_bushings = largest_change(False, turns.before, par, out) if turns.halved > 0 else np.nan
    period = find_period(last, out.closure, max(ENOUGH * change_of_bushings, options.settle_tol), par, turns, trail)
    if period == 0:
        return False
    combine(last, period, trail, out)
    out.refinement_change = largest_change(True, turns.before, par, out)
    out.period = period
    out.closure_trend, _ = closure_trend(turns.since, trail.notes)
    return True


@njit
def conclude(trail, turns, out):
    """Write the loads of a joint that has not repeated, and the trend of its closure error, zero if it shows none."""
    last, count = turns.revolution - 1, min(trail.revolution.size, turns.revolution // 2)
    slope, scatter = closure_trend(turns.revolution - count, trail.notes)
    combine(last, count, trail, out)
    falls = -slope * count > max(MIN_FALL, MIN_FALL_OVER_SCATTER * scatter)
    out.closure_trend = slope if falls else 0.0


@njit
def after_revolution(par, options, samples, past, out):
    """Decide how a joint continues after a revolution.

    Parameters
    ----------
    par, options
        Joint and settings.
    samples : ndarray of SAMPLE
        The revolution just made.
    past : Past
        Data of the joint; updated.
    out : record of KERNEL_RESULT
        Updated; complete when the joint has ended.

    Returns
    -------
    status : int
        Final status, where the joint has ended.
    goes_on : bool
        Whether the joint continues.
    """
    trail, turns = past.trail, past.turns
    last = turns.revolution
    turns.revolution += 1
    statistics = keep_revolution(par, samples, past.extremes[1], trail, last)
    out.revolutions = turns.revolution
    force, torque = size_of(OF_FORCES, statistics.largest, par), size_of(OF_TORQUES, statistics.largest, par)
    if not (force < 1e300 and torque < 1e300):
        return NOT_FINITE, False
    turns.force, turns.torque = max(force, SMALLEST_FORCE), max(torque, SMALLEST_FORCE * par.R)
    if last > turns.since:
        closure = closure_error(0, samples.size, BUSHINGS_ONLY, par, samples)
        note_closure(turns.revolution, closure, trail.notes)
        out.closure = with_slow_decay(closure, turns.revolution, par, trail.notes)
        if repeats(last, par, options, trail, turns, out):
            return (OK if out.period == 1 else NOT_SETTLED), False
    elif (
        turns.period == 1
        and turns.halved < options.max_refinements
        and largest_change(True, turns.before, par, statistics) > FAR
    ):
        halve_steps(1, par, turns, statistics)
    if turns.revolution == turns.limit:
        conclude(trail, turns, out)
        return NOT_SETTLED, False
    return NOT_SETTLED, True


@njit
def begin_mesh(par, options, memory, weight, past):
    """Initialise `past`, and `memory` and `weight` of its motion, for a joint at its start."""
    begin_turns(par, options, past)
    forget_mesh(past.mesh)
    memory[TOLERANCE] = options.rtol
    set_scale(closure_target(options, past.turns), past.turns, options, par, memory, weight)


@njit
def adapt_mesh(halved, par, options, memory, weight, past):
    """Prepare the next revolution; `halved`: number of times that steps had been halved before this one.

    `memory` and `weight`, those of its motion, are written.
    """
    if past.turns.halved > halved:
        memory[TOLERANCE] /= TIGHTER
        refine_mesh(past.mesh)
    memory[STAGED_STEP] = 0.0  # the stage may belong to the other motion
    set_scale(closure_target(options, past.turns), past.turns, options, par, memory, weight)
