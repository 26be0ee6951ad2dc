"""Decisions after each revolution of a joint with error-controlled steps (`mesh`) or explicit ones (`explicit`).

Once the motion repeats, after one or several revolutions, the joint continues with steps half as long until it repeats
again: from the change of the largest loads their error is estimated. A joint that does not repeat is integrated up to a
limit. Over its last revolutions a neighbouring motion, started at a small distance, is integrated with the same steps
and scaled back to that distance after each revolution: the mean logarithm of the growth is the largest Lyapunov
exponent (Benettin et al. 1980). The input angle is prescribed, so that no exponent is trivially zero: a negative one
belongs to a motion that repeats, zero to a quasi-periodic and a positive one to a chaotic motion.
"""

import math
from typing import NamedTuple

import numpy as np

from tolstat.common.tables import KERNEL_RESULT, Fidelity, Method, Motion, Options, Status
from tolstat.kernel.integrators.mesh import CELL, cells_of
from tolstat.kernel.mechanics.loads import FORCES, N_AVERAGED, N_DECIDING, N_INSTANT, TORQUES
from tolstat.kernel.mechanics.scale import SMALLEST_FORCE, typical_force
from tolstat.kernel.mechanics.topology import N_DOF, N_LUMPS, S
from tolstat.kernel.revolution.closeup import extend
from tolstat.kernel.revolution.settle import ALL_LOADS, closure_error, summarise
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

PERIODIC, SLOW, SUBHARMONIC = int(Motion.PERIODIC), int(Motion.SLOW), int(Motion.SUBHARMONIC)
QUASI_PERIODIC, CHAOTIC = int(Motion.QUASI_PERIODIC), int(Motion.CHAOTIC)
OK, NOT_SETTLED, NOT_PERIODIC = int(Status.OK), int(Status.NOT_SETTLED), int(Status.NOT_PERIODIC)
TR_BDF2, DYNAMIC = int(Method.TR_BDF2), int(Fidelity.DYNAMIC)
NEWTON_FAILED, NOT_FINITE = int(Status.NEWTON_FAILED), int(Status.NOT_FINITE)

NEARLY, PATIENT = 1.5e-2, 10
"""Closure error at which the steps are halved, if need be, and number of revolutions after which the first ones are
halved anyway: a joint need not settle with all steps."""
ENOUGH = 0.1
"""Closure error at which a joint has settled in any case, in units of the last change of its largest loads: a third of
their error."""
RESOLVED = 2e-2
"""Change of the largest loads by halving the steps, relative to the largest of their kind, up to which these are not
halved again. A method of order 2 leaves a third of it as error."""
FAR = 2 * RESOLVED
"""Change in the first revolution with steps half as long above which they are halved again at once."""
SETTLING = 16
"""Minimum number of revolutions with steps half as long before a joint is given up."""
LONGEST_PERIOD = 8
"""Longest period that is recognised, revolutions."""
MIN_FALL, FALL_ALONE, FALL_WITH_EXPONENT = 0.2, 10.0, 4.0
"""Minimum fall of log10(closure) over the revolutions kept that counts as settling. It must also exceed its scatter by
the second factor (closure errors of chaotic joints wander, and fell by four to five times their scatter in some), or by
the third if the Lyapunov exponent is not positive."""
APART = 1e-8
"""Distance of the neighbouring motion, m: above the residual error of Newton's iteration, below the micrometres of a
contact."""
BESIDE, ALIGNING = 16, 4
"""Revolutions of the neighbouring motion, and how many of them are left out of the exponent, while the difference turns
to the direction that grows fastest. A joint limited to no more than `BESIDE` revolutions is not classified."""
EXPONENT = 0.25
"""Magnitude of an exponent (per revolution) up to which it counts as zero."""

TURNS = np.dtype(
    [
        ("revolution", "i8"),  # revolutions completed
        ("since", "i8"),  # revolutions completed before the steps in use
        ("limit", "i8"),  # revolutions after which the joint is given up
        ("halved", "i8"),  # number of times that the steps were halved to estimate their error
        ("period", "i8"),  # period found with the steps before, revolutions; 0: none
        ("beside", "i8"),  # 1 while the neighbouring motion is integrated
        ("force", "f8"),  # largest |F| of the last revolution, N; before the first one, an estimate
        ("torque", "f8"),  # largest |T|, N m
        ("steps", "i8"),  # explicit steps of a revolution before they were halved
        ("bearable", "f8"),  # contact force of an end station up to which the steps in use are stable, N
        ("growth", "f8"),  # sum of the logarithms of its growth
        ("before", "f8", N_DECIDING),  # largest of the loads that decide with the steps before
        ("other", "f8", (3, N_DOF)),  # q, v, a of the neighbour; of the joint while `beside` is 1
    ]
)


class Past(NamedTuple):
    """Data of one joint that are kept from revolution to revolution."""

    trail: Trail
    turns: np.record  # TURNS
    extremes: np.recarray  # (2,) KERNEL_RESULT: largest and smallest loads of the current cell and revolution
    begun: np.ndarray  # (3, N_DOF) q, v, a at the start of the current cell
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


def make_pasts(joints: int, options: Options) -> Pasts:
    """Allocate for several joints."""
    trails = make_trails(joints, options.steps_per_rev, revolutions_kept(options))
    turns = np.zeros(joints, TURNS).view(np.recarray)
    extremes = np.zeros((joints, 2), KERNEL_RESULT).view(np.recarray)
    cells = options.steps_per_rev * cells_of(options.steps_per_rev)
    mesh = np.zeros((joints, cells), CELL).view(np.recarray)
    return Pasts(*trails, turns, extremes, np.zeros((joints, 3, N_DOF)), mesh)


def make_past(options: Options) -> Past:
    """Allocate for one joint."""
    all_of_it = make_pasts(1, options)
    trail = Trail(all_of_it.loads[0], all_of_it.revolution[0], all_of_it.notes[0])
    return Past(trail, all_of_it.turns[0], all_of_it.extremes[0], all_of_it.begun[0], all_of_it.mesh[0])


def revolutions_kept(options: Options) -> int:
    """Number of revolutions kept of a joint: all of them with error-controlled steps, else one."""
    return options.max_revs if follows_error(options) else 1


@njit
def follows_error(options):
    """Whether steps are error-controlled: dynamic TR-BDF2 with a tolerance."""
    return options.method == TR_BDF2 and options.rtol > 0 and options.fidelity == DYNAMIC


@njit
def closure_target(options, turns):
    """Closure error at which a joint is finished with the steps in use: it ends or they are halved."""
    return options.settle_tol if turns.halved > 0 else max(NEARLY, options.settle_tol)


@njit
def begin_turns(par, options, past):
    """Initialise `past` for a joint at its start."""
    turns = past.turns
    turns.revolution = turns.since = turns.halved = turns.period = turns.beside = 0
    turns.limit, turns.growth = options.max_revs, 0.0
    turns.force = typical_force(par)
    turns.torque = turns.force * par.R
    past.trail.notes.count = 0
    clear_extremes(past.extremes[1])


@njit
def clear_extremes(extremes):
    """Reset largest and smallest loads."""
    for i in range(N_INSTANT):
        extremes.largest[i] = 0.0
    for i in range(N_AVERAGED):
        extremes.range[i] = -np.inf


@njit
def merge_extremes(one, out):
    """Include the extremes `one` in those of `out`."""
    for i in range(N_AVERAGED):
        low = one.largest[i] - one.range[i]
        top, span = extend(one.largest[i], out.largest[i], out.range[i])
        out.largest[i], out.range[i] = top, max(span, top - low)
    for i in range(N_AVERAGED, N_INSTANT):
        out.largest[i] = max(out.largest[i], one.largest[i])


@njit
def keep_revolution(par, samples, extremes, trail, r):
    """Store loads and statistics of revolution `r` (from 0) of the joint; reset `extremes`; return the statistics.

    Largest and smallest loads are those of all parts: parabolas through samples of the grid would overshoot spikes.
    """
    own = trail.revolution[r % trail.revolution.size]
    summarise(par, samples, own)
    clear_extremes(own)
    merge_extremes(extremes, own)
    clear_extremes(extremes)
    stride = -(-samples.size // trail.loads.shape[1])
    for s in range(0, samples.size, stride):
        keep_deciding(samples[s].loads, trail.loads[r % trail.revolution.size, s // stride])
    return own


@njit
def find_period(last, closure, tolerance, turns, trail):
    """Period, in revolutions, of the motion at the end of revolution `last` (from 0); 0 if it does not repeat.

    `closure`: error against the revolution before; the motion repeats where such an error is at most `tolerance`.
    """
    if closure <= tolerance:
        return 1
    known = last + 1 - turns.since
    if known < 2 * LONGEST_PERIOD and turns.period < 2:
        return 0
    for lag in range(2, min(LONGEST_PERIOD, known // 2) + 1):
        if lag_closure(last, lag, trail) <= tolerance:
            return lag
    return 0


@njit
def halve_steps(period, turns, out):
    """Halve the steps from the next revolution on; keep `period` and the largest loads in `out` for comparison."""
    keep_deciding(out.largest, turns.before)
    turns.halved += 1
    turns.since, turns.period = turns.revolution, period
    turns.limit = max(turns.limit, turns.revolution + SETTLING)


@njit
def repeats(last, options, trail, turns, out):
    """Whether a joint repeats after revolution `last` (from 0), and its largest loads are resolved.

    Loads that no further halving is allowed for count as resolved; others that are not halve the steps.
    """
    period = find_period(last, out.closure, max(NEARLY, options.settle_tol), turns, trail)
    tired = turns.halved == 0 and last + 1 >= PATIENT
    if period == 0 and not tired:
        return False
    combine(last, max(1, period), trail, out)
    change = largest_change(turns.before, out) if turns.halved > 0 else np.nan
    if turns.halved < options.max_refinements and not change <= RESOLVED:
        halve_steps(period, turns, out)
        return False
    period = find_period(last, out.closure, max(ENOUGH * change, options.settle_tol), turns, trail)
    if period == 0:
        return False
    combine(last, period, trail, out)
    out.refinement_change = largest_change(turns.before, out)
    out.motion, out.period = PERIODIC if period == 1 else SUBHARMONIC, period
    out.closure_trend, _ = closure_trend(turns.since, trail.notes)
    return True


@njit
def conclude_watch(options, trail, turns, out):
    """Classify the motion of a joint that has not repeated; return its status."""
    last, kept = turns.revolution - 1, min(trail.revolution.size, turns.revolution // 2)
    slope, scatter = closure_trend(turns.revolution - kept, trail.notes)
    combine(last, kept, trail, out)
    out.closure_trend = slope
    if turns.limit <= BESIDE:
        return NOT_SETTLED
    fall = -slope * kept
    growth = turns.growth / (BESIDE - ALIGNING)
    out.lyapunov = growth
    slow = fall > max(MIN_FALL, FALL_ALONE * scatter) or growth < -EXPONENT
    if slow or (growth < EXPONENT and fall > max(MIN_FALL, FALL_WITH_EXPONENT * scatter)):
        out.motion = SLOW
        return NOT_SETTLED
    out.motion = CHAOTIC if growth > EXPONENT else QUASI_PERIODIC
    return NOT_PERIODIC


@njit
def radius_of(i, R):
    """Radius (m) that makes unknown `i` a displacement: 1 if it is one."""
    return 1.0 if (i < 6 * N_LUMPS and i % 6 < 3) or i == S else R


@njit
def set_beside(q, v, a, par, turns):
    """Start the neighbouring motion at distance `APART`, with a difference in all unknowns that can move."""
    turns.growth = 0.0
    moving = N_DOF if par.slides > 0 else N_DOF - 1
    share = APART / math.sqrt(moving)
    for i in range(N_DOF):
        apart = (share if i % 2 == 0 else -share) / radius_of(i, par.R)
        turns.other[0, i] = q[i] + (apart if i < moving else 0.0)
        turns.other[1, i], turns.other[2, i] = v[i], a[i]


@njit
def swap(q, v, a, turns):
    """Exchange the states of the joint and its neighbour."""
    for i in range(N_DOF):
        q[i], turns.other[0, i] = turns.other[0, i], q[i]
        v[i], turns.other[1, i] = turns.other[1, i], v[i]
        a[i], turns.other[2, i] = turns.other[2, i], a[i]
    turns.beside = 1 - turns.beside


@njit
def rescale_neighbour(q, v, a, h, R, turns):
    """Scale the neighbour's difference back to `APART`; return the logarithm of its growth.

    Velocities are weighted by `h`, the step of the output grid (s), rotations by `R` (m).
    """
    square = 0.0
    for i in range(N_DOF):
        dq, dv = turns.other[0, i] - q[i], h * (turns.other[1, i] - v[i])
        square += radius_of(i, R) ** 2 * (dq * dq + dv * dv)
    factor = APART / max(math.sqrt(square), 1e-6 * APART)
    for i in range(N_DOF):
        turns.other[0, i] = q[i] + factor * (turns.other[0, i] - q[i])
        turns.other[1, i] = v[i] + factor * (turns.other[1, i] - v[i])
        turns.other[2, i] = a[i] + factor * (turns.other[2, i] - a[i])
    return -math.log(factor)


@njit
def neighbour_done(q, v, a, par, options, turns):
    """Restore the joint after a revolution of its neighbour, and add the growth."""
    swap(q, v, a, turns)
    growth = rescale_neighbour(q, v, a, 2 * math.pi / (abs(par.omega) * options.steps_per_rev), par.R, turns)
    if turns.revolution > turns.limit - BESIDE + ALIGNING:
        turns.growth += growth


@njit
def after_revolution(point, par, options, samples, past, out):
    """Decide how a joint continues after a revolution.

    Parameters
    ----------
    point : tuple of ndarray, shape (56,)
        q, v, a of the joint; exchanged for those of the neighbour, and back.
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
    q, v, a = point
    trail, turns = past.trail, past.turns
    if turns.beside == 1:
        neighbour_done(q, v, a, par, options, turns)
        if turns.revolution == turns.limit:
            return conclude_watch(options, trail, turns, out), False
        return NOT_SETTLED, True
    last = turns.revolution
    turns.revolution += 1
    own = keep_revolution(par, samples, past.extremes[1], trail, last)
    out.revolutions = turns.revolution
    force, torque = own.largest[FORCES : FORCES + 8].max(), own.largest[TORQUES : TORQUES + 8].max()
    if not (force < 1e300 and torque < 1e300):
        return NOT_FINITE, False
    turns.force, turns.torque = max(force, SMALLEST_FORCE), max(torque, SMALLEST_FORCE * par.R)
    if last > turns.since:
        closure = closure_error(0, samples.size, ALL_LOADS, samples)
        note_closure(turns.revolution, closure, trail.notes)
        out.closure = with_slow_decay(closure, turns.revolution, par, trail.notes)
        if repeats(last, options, trail, turns, out):
            return (OK if out.period == 1 else NOT_PERIODIC), False
    elif turns.period == 1 and turns.halved < options.max_refinements and largest_change(turns.before, own) > FAR:
        halve_steps(1, turns, own)
    if turns.limit > BESIDE and turns.revolution >= turns.limit - BESIDE:
        if turns.revolution == turns.limit - BESIDE:
            set_beside(q, v, a, par, turns)
        else:
            swap(q, v, a, turns)
        return NOT_SETTLED, True
    if turns.revolution == turns.limit:
        return conclude_watch(options, trail, turns, out), False
    return NOT_SETTLED, True
