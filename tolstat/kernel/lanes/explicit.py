"""Simulation of joints in lanes with explicit steps, each joint with its own number of steps a revolution.

All lanes step together; each has its own time and step. At a point of the output grid a lane's joint is recorded, after
a revolution `resolve` decides how it continues, and a lane whose joint has ended takes the next one.
"""

import math

from tolstat.common.tables import STEPS_PER_ITERATION
from tolstat.kernel.integrators.stability import fewest_steps
from tolstat.kernel.integrators.state import ALLOWED, FACTORISATIONS, ITERATIONS
from tolstat.kernel.lanes.batch import empty, get_counters, put_joint, samples_of
from tolstat.kernel.lanes.lane_memory import as_lanes
from tolstat.kernel.mechanics.topology import N_DOF
from tolstat.kernel.revolution.explicit import (
    begin_explicit,
    begin_revolution,
    is_stable,
    repeat_finer,
    step_length,
    steps_of,
    walk,
)
from tolstat.kernel.revolution.peaks import forget, largest_at_an_end, write_peaks
from tolstat.kernel.revolution.resolve import Past, after_revolution
from tolstat.kernel.revolution.settle import record
from tolstat.kernel.revolution.simulate import (
    NEWTON_FAILED,
    NOT_SETTLED,
    OUTSIDE_MODEL,
    acceleration,
    begin,
    clear,
    clear_results,
    finish,
    inside_model,
)
from tolstat.kernel.revolution.trail import Trail
from tolstat.kernel.simd.borrow import without_refcount
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import WIDTH, any_of, bits_of

NEVER = 1e300
"""Steps up to the next grid point of a lane without a joint."""


@njit
def count_steps(rows, options, work, out):
    """Write the least number of stable steps a revolution of each joint of `rows` to `out`; `work` is scratch."""
    for i in range(len(rows)):
        out[i] = fewest_steps(rows[i], options, work)


@njit
def rest(lane, batch):
    """Mark a lane as empty; it stands still."""
    empty(lane, batch)
    batch.control.h[lane] = batch.control.origin[lane] = batch.control.count[lane] = 0.0
    batch.control.until[lane] = NEVER


@njit
def start_revolution(lane, par, options, batch):
    """Set up the first step of a revolution in a lane.

    All revolutions but the first have the times of the second one: the ideal motion repeats.
    """
    control, turns = batch.control, batch.pasts.turns[lane]
    h, steps = step_length(par, turns), steps_of(turns)
    control.h[lane], control.count[lane], control.until[lane] = h, 0.0, steps // options.steps_per_rev
    control.origin[lane] = 2 * math.pi / abs(par.omega) if turns.revolution > 0 else 0.0
    control.fresh[lane] = 1.0


@njit
def load_joint(lane, joint, rows, words, steps, left, options, alone, batch, samples, past, results):
    """Put a joint into a lane, at its start; one outside the model ends at once."""
    work, state, _, _ = alone
    par, control, motion, out = rows[joint], batch.control, batch.motion, results[joint]
    clear_results(out)
    state.counters[:] = 0
    state.counters[ALLOWED] = left[joint]
    if not inside_model(par):
        finish(OUTSIDE_MODEL, -1, options.steps_per_rev, options, state.counters, out)
        return
    put_joint(lane, words[joint], batch)
    control.joint[lane], control.live[lane] = joint, 1.0
    clear(par, state, samples_of(lane, batch, samples), batch.notes[lane])
    begin(par, options, work, state)
    acceleration(0.0, state.q0, state.v0, par, options, work, state.a0)
    for i in range(N_DOF):
        motion.q[i, lane], motion.v[i, lane], motion.a[i, lane] = state.q0[i], state.v0[i], state.a0[i]
    control.steps[lane] = control.halvings[lane] = 0.0
    control.iterations[lane] = state.counters[ITERATIONS]
    control.factorisations[lane] = state.counters[FACTORISATIONS]
    begin_explicit(steps[joint], par, options, work, past)
    begin_revolution((state.q0, state.v0, state.a0), steps[joint], par, work, past)
    start_revolution(lane, par, options, batch)


@njit
def spent(lane, control):
    """Work of a lane's joint so far, in Newton iterations."""
    return int(control.iterations[lane]) + int(control.steps[lane] + control.count[lane]) // STEPS_PER_ITERATION


@njit
def arrive(lane, par, lanes, left, options, alone, batch, samples, past, out):
    """Record the grid point that a lane has reached, decide after a revolution; return status and whether to go on."""
    control, motion, turns = batch.control, batch.motion, past.turns
    n, work = options.steps_per_rev, alone.work
    point = motion.q[:, lane], motion.v[:, lane], motion.a[:, lane]
    steps = steps_of(turns)
    k = int(control.count[lane]) // (steps // n)
    control.until[lane] = steps // n
    if spent(lane, control) >= left:
        control.steps[lane] += control.count[lane]
        out.failed_step = k
        return NEWTON_FAILED, False
    force = largest_at_an_end(lane, lanes[2])
    if not is_stable(force, point[0], turns):
        control.steps[lane] += control.count[lane]
        control.halvings[lane] += 1
        if not repeat_finer(force, point, par, options, work, past):
            out.failed_step = k
            return NEWTON_FAILED, False
        start_revolution(lane, par, options, batch)
        return NOT_SETTLED, True
    record(k, lane, lanes[0], lanes[1], motion.v[:, lane], samples)
    if k < n:
        return NOT_SETTLED, True
    control.steps[lane] += steps
    write_peaks(lane, lanes[2], past.extremes[1])
    status, goes_on = after_revolution(par, options, samples, past, out)
    if goes_on:
        begin_revolution(point, steps, par, work, past)
        start_revolution(lane, par, options, batch)
    return status, goes_on


@njit
def finish_joint(lane, status, left, options, alone, batch, blocks, results):
    """Write the results of a joint that has ended, and empty its lane."""
    joint, counters = batch.control.joint[lane], alone.state.counters
    batch.control.count[lane] = 0.0  # is part of the steps by now
    left[joint] -= spent(lane, batch.control)
    get_counters(lane, batch, counters)
    failed = max(1, results[joint].failed_step) if status == NEWTON_FAILED else -1
    finish(status, failed, steps_of(batch.pasts.turns[lane]), options, counters, results[joint])
    for r in range(blocks.shape[1]):
        if joint < len(blocks):
            blocks[joint, r] = batch.pasts.revolution[lane, r]
    rest(lane, batch)


@njit
def explicit(rows, words, steps, left, options, alone, batch, samples, blocks, results):
    """Simulate joints with equal numbers of contact stations; row i of the results is joint i.

    Parameters
    ----------
    rows : ndarray of PARAM, shape (n,)
        The joints, n > 0.
    words : ndarray, shape (n, words)
        The same memory as doubles.
    steps : ndarray of int, shape (n,)
        Steps of the first revolution of each joint, multiples of ``options.steps_per_rev``, see `count_steps`.
    left : ndarray of int, shape (n,)
        Work still allowed to each joint, in Newton iterations; reduced by that done. A joint without any ends as
        `NEWTON_FAILED`.
    options : Options
        Numerical settings, with ``max_refinements``; its tolerance plays no part.
    alone : Scratch
        Work arrays of one joint.
    batch : Batch
        Memory of the lanes; nothing is carried over from one call to the next.
    samples : ndarray of SAMPLE, shape (n, steps_per_rev) or (0, steps_per_rev)
        Written unless empty: the last revolution of every joint.
    blocks : ndarray of KERNEL_RESULT, shape (n, revolutions) or (0, 0)
        Written unless empty: statistics of the last revolutions of every joint, revolution r at r modulo their number.
    results : ndarray of KERNEL_RESULT, shape (n,)
        Written.
    """
    rows, words, samples, results = (
        without_refcount(rows),
        without_refcount(words),
        without_refcount(samples),
        without_refcount(results),
    )
    blocks, steps = without_refcount(blocks), without_refcount(steps)
    left = without_refcount(left)
    alone, batch = without_refcount(alone), without_refcount(batch)
    lanes = as_lanes(batch.par), as_lanes(batch.work), as_lanes(batch.peaks)
    motion, control = as_lanes(batch.motion), as_lanes(batch.control)
    pasts, at, queued = batch.pasts, batch.control, 0
    for lane in range(WIDTH):
        put_joint(lane, words[0], batch)
        rest(lane, batch)
    while queued < len(rows) or any_of(control.live > 0):
        arrived = bits_of(control.until <= 0)
        for lane in range(WIDTH):
            trail = Trail(pasts.loads[lane], pasts.revolution[lane], pasts.notes[lane])
            past = Past(trail, pasts.turns[lane], pasts.extremes[lane], pasts.begun[lane], pasts.mesh[lane])
            if (arrived >> lane) & 1:
                joint = at.joint[lane]
                own, out = samples_of(lane, batch, samples), results[joint]
                status, goes_on = arrive(lane, rows[joint], lanes, left[joint], options, alone, batch, own, past, out)
                if not goes_on:
                    finish_joint(lane, status, left, options, alone, batch, blocks, results)
            while queued < len(rows) and at.live[lane] == 0:
                load_joint(lane, queued, rows, words, steps, left, options, alone, batch, samples, past, results)
                queued += 1
        fresh = control.fresh > 0
        if any_of(fresh):
            forget(fresh, lanes[2])
            control.fresh = 0.0 * control.fresh
        if any_of(control.live > 0):
            walk(lanes[0], options, lanes[1], motion, control, lanes[2])
