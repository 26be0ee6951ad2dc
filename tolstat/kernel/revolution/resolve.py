"""What becomes of a joint, revolution by revolution, whose steps follow the error (`mesh`).

Once its motion repeats, after one revolution or after several, it goes on with a tighter tolerance until it repeats
again: what that changes of the largest loads tells their error. A joint that has repeated in no number of revolutions
is watched to the end. Over the last ones a neighbour, set beside it by a small amount, goes around with it on the same
mesh and is brought back to that distance after each revolution: the mean logarithm of the growth is the largest
Lyapunov exponent (Benettin et al. 1980). The input angle is prescribed, so that no exponent is zero for the time's
sake: negative belongs to a motion that repeats, zero to a quasi-periodic and positive to a chaotic one.
"""

import math
from typing import NamedTuple

import numpy as np

from tolstat.common.tables import CONTACTS, RESULT, Fidelity, Method, Motion, Options, Status
from tolstat.kernel.integrators.mesh import CELL, cells_of, forget_mesh, refine_mesh, set_scale
from tolstat.kernel.integrators.state import STAGED, TOLERANCE
from tolstat.kernel.mechanics.scale import SMALLEST_FORCE, typical_force
from tolstat.kernel.mechanics.topology import N_DOF, N_LUMPS
from tolstat.kernel.mechanics.vector import copy
from tolstat.kernel.revolution.closeup import extend
from tolstat.kernel.revolution.settle import closure_error, summarise
from tolstat.kernel.revolution.trail import Trail, closure_trend, combine, lag_closure, make_trails, note_closure
from tolstat.kernel.simd.jit import njit

PERIODIC, SLOW, SUBHARMONIC = int(Motion.PERIODIC), int(Motion.SLOW), int(Motion.SUBHARMONIC)
QUASI_PERIODIC, CHAOTIC = int(Motion.QUASI_PERIODIC), int(Motion.CHAOTIC)
OK, NOT_SETTLED, NOT_PERIODIC = int(Status.OK), int(Status.NOT_SETTLED), int(Status.NOT_PERIODIC)
TR_BDF2, DYNAMIC = int(Method.TR_BDF2), int(Fidelity.DYNAMIC)
NEWTON_FAILED, NOT_FINITE = int(Status.NEWTON_FAILED), int(Status.NOT_FINITE)

TIGHTER = 8
"""Of one tolerance to the next: it halves the steps."""
NEARLY, PATIENT = 1.5e-2, 10
"""Closure error at which a joint gets a tighter tolerance, if it needs one, and revolutions after which it gets its
first one anyway: it need not settle with every one."""
ENOUGH = 0.1
"""Closure error at which a joint has settled in any case, in units of the last change of its largest loads: a third of
their error."""
RESOLVED = 2e-2
"""Change of the largest loads by a tighter tolerance at which it is the last, relative to the largest of their kind. A
method of order 2 leaves a third of it as error."""
FAR = 2 * RESOLVED
"""Change by the first revolution with a tighter tolerance at which the next one follows at once."""
SETTLING = 16
"""Revolutions that a tighter tolerance is allowed at least."""
LONGEST_PERIOD = 8
FALLS, CLEARLY, BARELY = 0.1, 10.0, 4.0
"""Fall of log10(closure) over the revolutions kept that counts, at least; in units of its scatter, where it needs no
other sign (closure errors of chaotic joints wander, and fell by four to five times their scatter in some), and where
it needs one."""
APART = 1e-8
"""Distance of the neighbour, m: above what Newton leaves of a step, below the micrometres of a contact."""
BESIDE, ALIGNING = 16, 4
"""Revolutions of the neighbour, and the first of them, in which it turns to the direction that grows. Of a joint that
is given up after no more than these no class is told."""
EXPONENT = 0.25
"""Size of an exponent (per revolution) that tells it from zero."""
MOST_ITERATIONS = 3_000_000
"""Bound on the work of a joint: half a minute of a core."""

TURNS = np.dtype(
    [
        ("revolution", "i8"),  # revolutions that the joint has made
        ("since", "i8"),  # those of them before the tolerance in use
        ("limit", "i8"),  # after which it is given up
        ("tightened", "i8"),  # times that the tolerance has been tightened
        ("period", "i8"),  # revolutions after which it has repeated, 0 if it has not
        ("beside", "i8"),  # 1: it is the neighbour that goes around
        ("growth", "f8"),  # sum of logarithms
        ("before", "f8", (8, 2)),  # largest |F|, |T| with the tolerance before
        ("other", "f8", (3, N_DOF)),  # q, v, a of the neighbour, or of the joint while the neighbour goes around
    ]
)


class Past(NamedTuple):
    """What is remembered of a joint from revolution to revolution."""

    trail: Trail
    turns: np.record  # TURNS
    extremes: np.recarray  # (2,) RESULT: largest and smallest loads of the cell and of the revolution under way
    begun: np.ndarray  # (3, N_DOF) q, v, a at the beginning of the cell under way
    mesh: np.recarray  # (cells,) CELL


class Pasts(NamedTuple):
    """The same of several joints, each array with a leading axis of joints.

    Kernels return no records: who needs one joint's makes a `Past` of it.
    """

    modulus: np.ndarray
    revolution: np.recarray
    notes: np.recarray
    turns: np.recarray
    extremes: np.recarray
    begun: np.ndarray
    mesh: np.recarray


def make_pasts(joints: int, options: Options) -> Pasts:
    """Allocate."""
    trails = make_trails(joints, options.steps_per_rev, revolutions_kept(options))
    turns, extremes = np.zeros(joints, TURNS).view(np.recarray), np.zeros((joints, 2), RESULT).view(np.recarray)
    cells = options.steps_per_rev * cells_of(options.steps_per_rev)
    mesh = np.zeros((joints, cells), CELL).view(np.recarray)
    return Pasts(*trails, turns, extremes, np.zeros((joints, 3, N_DOF)), mesh)


def make_past(options: Options) -> Past:
    """Allocate for one joint."""
    all_of_it = make_pasts(1, options)
    trail = Trail(all_of_it.modulus[0], all_of_it.revolution[0], all_of_it.notes[0])
    return Past(trail, all_of_it.turns[0], all_of_it.extremes[0], all_of_it.begun[0], all_of_it.mesh[0])


def revolutions_kept(options: Options) -> int:
    """Revolutions that are remembered of a joint whose steps follow the error; next to nothing of others."""
    return options.max_revs if follows_error(options) else 1


@njit
def follows_error(options):
    """Whether steps follow the error: TR-BDF2 with a tolerance."""
    return options.method == TR_BDF2 and options.rtol > 0 and options.fidelity == DYNAMIC


@njit
def wanted(options, turns):
    """Closure error that ends a joint's way with the tolerance in use, or leads to the next one."""
    return options.settle_tol if turns.tightened > 0 else max(NEARLY, options.settle_tol)


@njit
def begin_turns(par, options, memory, weight, past):
    """Make ready for a joint that stands at its start."""
    turns = past.turns
    turns.revolution = turns.since = turns.tightened = turns.period = turns.beside = 0
    turns.limit, turns.growth = options.max_revs, 0.0
    memory[TOLERANCE] = options.rtol
    force = typical_force(par)
    set_scale(force, force * par.R, wanted(options, turns), options, par, memory, weight)
    forget_mesh(past.mesh)
    past.trail.notes.count = 0
    clear_extremes(past.extremes[1])


@njit
def clear_extremes(extremes):
    """Know nothing of largest and smallest loads."""
    extremes.psi_max = 0.0
    for b in range(8):
        extremes.F_max[b] = extremes.T_max[b] = 0.0
        extremes.F_range[b] = extremes.T_range[b] = -np.inf
    for pin in range(4):
        for i in range(len(CONTACTS)):
            extremes.contact_max[pin, i] = 0.0


@njit
def merge_extremes(one, out):
    """Let the extremes `one` count among those of `out`."""
    for b in range(8):
        low = one.F_max[b] - one.F_range[b], one.T_max[b] - one.T_range[b]
        for kind in (0, 1):
            if kind == 0:
                top, reach = extend(one.F_max[b], out.F_max[b], out.F_range[b])
                out.F_max[b], out.F_range[b] = top, max(reach, top - low[0])
            else:
                top, reach = extend(one.T_max[b], out.T_max[b], out.T_range[b])
                out.T_max[b], out.T_range[b] = top, max(reach, top - low[1])
    for pin in range(4):
        for i in range(len(CONTACTS)):
            out.contact_max[pin, i] = max(out.contact_max[pin, i], one.contact_max[pin, i])
    out.psi_max = max(out.psi_max, one.psi_max)


@njit
def keep_revolution(samples, extremes, trail, r):
    """Keep revolution `r` (from 0): its statistics, and moduli to compare later ones with.

    Its largest and smallest loads are those of all parts: parabolas through samples of the grid would overshoot spikes.
    """
    own = trail.revolution[r % trail.revolution.size]
    summarise(samples, own)
    clear_extremes(own)
    merge_extremes(extremes, own)
    clear_extremes(extremes)
    stride = -(-samples.size // trail.modulus.shape[1])
    for s in range(0, samples.size, stride):
        for b in range(8):
            copy(samples[s].modulus[b], trail.modulus[r % trail.revolution.size, s // stride, b])
    return own


@njit
def largest_change(before, out):
    """Largest change of a largest load against those `before`, relative to the largest of the kind."""
    worst = 0.0
    for kind in (0, 1):
        change = size = 0.0
        for b in range(8):
            load = out.F_max[b] if kind == 0 else out.T_max[b]
            change, size = max(change, abs(load - before[b, kind])), max(size, load)
        worst = max(worst, change / size if size > 0 else 0.0)
    return worst


@njit
def find_period(last, closure, tolerance, turns, trail):
    """Revolutions after which the motion repeats, seen at the end of revolution `last` (from 0); 0 if it does not."""
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
def tighten(period, options, memory, mesh, turns, out):
    """Go on with a tighter tolerance."""
    memory[TOLERANCE] /= TIGHTER
    refine_mesh(mesh)
    for b in range(8):
        turns.before[b, 0], turns.before[b, 1] = out.F_max[b], out.T_max[b]
    turns.tightened += 1
    turns.since, turns.period = turns.revolution, period
    turns.limit = max(turns.limit, turns.revolution + SETTLING)


@njit
def repeats(last, options, memory, mesh, trail, turns, out):
    """Whether a joint repeats, with its largest loads resolved or no tolerance left; else it may get a tighter one."""
    period = find_period(last, out.closure, max(NEARLY, options.settle_tol), turns, trail)
    tired = turns.tightened == 0 and last + 1 >= PATIENT
    if period == 0 and not tired:
        return False
    combine(last, max(1, period), trail, out)
    change = largest_change(turns.before, out) if turns.tightened > 0 else np.nan
    if turns.tightened < options.max_refinements and not change <= RESOLVED:
        tighten(period, options, memory, mesh, turns, out)
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
    """Class of a joint that has not repeated; returns its status."""
    last, kept = turns.revolution - 1, min(trail.revolution.size, turns.revolution // 2)
    slope, scatter = closure_trend(turns.revolution - kept, trail.notes)
    combine(last, kept, trail, out)
    out.closure_trend = slope
    if turns.limit <= BESIDE:
        return NOT_SETTLED
    fall = -slope * kept
    growth = turns.growth / (BESIDE - ALIGNING)
    out.lyapunov = growth
    slow = fall > max(FALLS, CLEARLY * scatter) or growth < -EXPONENT
    if slow or (growth < EXPONENT and fall > max(FALLS, BARELY * scatter)):
        out.motion = SLOW
        return NOT_SETTLED
    out.motion = CHAOTIC if growth > EXPONENT else QUASI_PERIODIC
    return NOT_PERIODIC


@njit
def lever(i, R):
    """Radius at which unknown `i` is a displacement: 1 if it is one."""
    return 1.0 if i < 6 * N_LUMPS and i % 6 < 3 else R


@njit
def set_beside(q, v, a, R, turns):
    """Choose the neighbour's first difference: `APART`, in all unknowns."""
    turns.growth = 0.0
    share = APART / math.sqrt(N_DOF)
    for i in range(N_DOF):
        turns.other[0, i] = q[i] + (share if i % 2 == 0 else -share) / lever(i, R)
        turns.other[1, i], turns.other[2, i] = v[i], a[i]


@njit
def swap(q, v, a, turns):
    """Exchange the joint and its neighbour."""
    for i in range(N_DOF):
        q[i], turns.other[0, i] = turns.other[0, i], q[i]
        v[i], turns.other[1, i] = turns.other[1, i], v[i]
        a[i], turns.other[2, i] = turns.other[2, i], a[i]
    turns.beside = 1 - turns.beside


@njit
def draw_near(q, v, a, h, R, turns):
    """Bring the neighbour back to its distance from the joint; returns the logarithm of its growth.

    Speeds count by what they add in `h`, the time of a step of the grid, s.
    """
    square = 0.0
    for i in range(N_DOF):
        dq, dv = turns.other[0, i] - q[i], h * (turns.other[1, i] - v[i])
        square += lever(i, R) ** 2 * (dq * dq + dv * dv)
    factor = APART / max(math.sqrt(square), 1e-6 * APART)
    for i in range(N_DOF):
        turns.other[0, i] = q[i] + factor * (turns.other[0, i] - q[i])
        turns.other[1, i] = v[i] + factor * (turns.other[1, i] - v[i])
        turns.other[2, i] = a[i] + factor * (turns.other[2, i] - a[i])
    return -math.log(factor)


@njit
def neighbour_done(q, v, a, par, options, turns):
    """Go back from the neighbour, which has gone around, to the joint."""
    swap(q, v, a, turns)
    growth = draw_near(q, v, a, 2 * math.pi / (abs(par.omega) * options.steps_per_rev), par.R, turns)
    if turns.revolution > turns.limit - BESIDE + ALIGNING:
        turns.growth += growth


@njit
def revolved(point, memory, weight, iterations, par, options, samples, past, out):
    """Decide how a joint goes on that stands at theta = 0 again.

    Parameters
    ----------
    point : tuple of ndarray, shape (55,)
        q, v, a where it stands; exchanged for those of the neighbour, and back.
    memory, weight : ndarray
        As of State; the tolerance and what errors and residuals are relative to are set.
    iterations : int
        Newton iterations so far.
    par, options
        Joint and settings.
    samples : ndarray of SAMPLE
        The revolution just made.
    past : Past
        What is remembered.
    out : record of RESULT
        Written when the joint has come to its end.

    Returns
    -------
    status : int
        How the joint has ended.
    goes_on : bool
        Whether it has not.
    """
    q, v, a = point
    trail, turns = past.trail, past.turns
    memory[STAGED] = 0.0  # for it may be of the other one
    if turns.beside == 1:
        neighbour_done(q, v, a, par, options, turns)
        if turns.revolution == turns.limit:
            return conclude_watch(options, trail, turns, out), False
        return NOT_SETTLED, True
    if iterations > MOST_ITERATIONS:
        return NEWTON_FAILED, False
    last = turns.revolution
    turns.revolution += 1
    own = keep_revolution(samples, past.extremes[1], trail, last)
    out.revolutions = turns.revolution
    force, torque = own.F_max.max(), own.T_max.max()
    if not (force < 1e300 and torque < 1e300):
        return NOT_FINITE, False
    force, torque = max(force, SMALLEST_FORCE), max(torque, SMALLEST_FORCE * par.R)
    if last > turns.since:
        out.closure = closure_error(samples)
        note_closure(turns.revolution, out.closure, trail.notes)
        if repeats(last, options, memory, past.mesh, trail, turns, out):
            return (OK if out.period == 1 else NOT_PERIODIC), False
    elif turns.period == 1 and turns.tightened < options.max_refinements and largest_change(turns.before, own) > FAR:
        tighten(1, options, memory, past.mesh, turns, own)
    set_scale(force, torque, wanted(options, turns), options, par, memory, weight)
    if turns.limit > BESIDE and turns.revolution >= turns.limit - BESIDE:
        if turns.revolution == turns.limit - BESIDE:
            set_beside(q, v, a, par.R, turns)
        else:
            swap(q, v, a, turns)
        return NOT_SETTLED, True
    if turns.revolution == turns.limit:
        return conclude_watch(options, trail, turns, out), False
    return NOT_SETTLED, True
