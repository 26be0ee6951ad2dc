"""Simulation of joints in lanes with explicit steps, each joint with its own number of steps a revolution.

All lanes step together; each has its own time and step. At a point of the output grid a lane's joint is recorded, after
a revolution `resolve` decides how it continues, and a lane whose joint has ended takes the next one.
"""

import math

from tolstat.common.tables import STEPS_PER_ITERATION
from tolstat.kernel.codes import NEWTON_FAILED, NOT_SETTLED, RAMP
from tolstat.kernel.integrators.stability import fewest_steps
from tolstat.kernel.lanes.batch import empty, put_joint, put_start, samples_of
from tolstat.kernel.lanes.lane_memory import as_lanes
from tolstat.kernel.lanes.lockstep import end_joint
from tolstat.kernel.mechanics.dynamics import acceleration
from tolstat.kernel.mechanics.loads import complete_loads
from tolstat.kernel.revolution.explicit import (
    begin_explicit,
    begin_revolution,
    is_stable,
    repeat_finer,
    step_length,
    steps_of,
    walk,
)
from tolstat.kernel.revolution.outcome import clear_results, clear_samples
from tolstat.kernel.revolution.peaks import forget, largest_at_an_end, write_peaks
from tolstat.kernel.revolution.resolve import Past, after_revolution
from tolstat.kernel.revolution.settle import record
from tolstat.kernel.revolution.trail import Trail
from tolstat.kernel.simd.borrow import without_refcount
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import any_of, bits_of

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
def load_explicit_joint(lane, joint, steps, options, batch, queue, past):
    """Put a joint into a lane, at its start; one that has none has ended.

    `steps`: of the first revolution of each joint, (n,).
    """
    par, start, control, motion, out = queue.rows[joint], past.begun, batch.control, batch.motion, queue.results[joint]
    if out.status != NOT_SETTLED:
        return
    for i in range(start.shape[1]):
        start[0, i] = 0.0 if options.start == RAMP else queue.starts[joint, i]
        start[1, i] = 0.0
    acceleration(0.0, start[0], start[1], par, options, batch.scratch, start[2])
    put_joint(lane, queue.words[joint], batch)
    put_start(lane, par, start[0], control, motion)
    for i in range(start.shape[1]):
        motion.q[i, lane], motion.v[i, lane], motion.a[i, lane] = start[0, i], start[1, i], start[2, i]
    control.joint[lane] = joint
    control.iterations[lane], control.factorisations[lane] = out.newton_iterations, out.factorisations
    clear_results(out)
    clear_samples(samples_of(lane, joint, batch.samples, queue.samples), batch.notes[lane])
    begin_explicit(steps[joint], par, options, batch.scratch, past)
    begin_revolution((start[0], start[1], start[2]), steps[joint], par, batch.scratch, past)
    start_revolution(lane, par, options, batch)


@njit
def spent(lane, control):
    """Work of a lane's joint so far, in Newton iterations."""
    return int(control.iterations[lane]) + int(control.steps[lane] + control.count[lane]) // STEPS_PER_ITERATION


@njit
def arrive(lane, par, lanes, left, options, batch, samples, past, out):
    """Record the grid point that a lane has reached, decide after a revolution; return status and whether to go on.

    `left`: work still allowed to the joint, in Newton iterations.
    """
    control, motion, turns = batch.control, batch.motion, past.turns
    n, work = options.steps_per_rev, batch.scratch
    point = motion.q[:, lane], motion.v[:, lane], motion.a[:, lane]
    steps = steps_of(turns)
    k = int(control.count[lane]) // (steps // n)
    control.until[lane] = steps // n
    if spent(lane, control) >= left:
        control.steps[lane] += control.count[lane]
        out.failed_step = k
        return NEWTON_FAILED, False
    force = largest_at_an_end(lane, par, lanes[2])
    if not is_stable(force, point[0], turns):
        control.steps[lane] += control.count[lane]
        control.halvings[lane] += 1
        if not repeat_finer(force, point, par, options, work, past):
            out.failed_step = k
            return NEWTON_FAILED, False
        start_revolution(lane, par, options, batch)
        return NOT_SETTLED, True
    record(k, lane, lanes[0], lanes[1], samples)
    if k < n:
        return NOT_SETTLED, True
    control.steps[lane] += steps
    write_peaks(lane, par, lanes[2], past.extremes[1])
    status, goes_on = after_revolution(par, options, samples, past, out)
    if goes_on:
        begin_revolution(point, steps, par, work, past)
        start_revolution(lane, par, options, batch)
    return status, goes_on


@njit
def finish_explicit_joint(lane, status, options, batch, queue):
    """Write the results of a joint that has ended, and empty its lane."""
    control, joint = batch.control, batch.control.joint[lane]
    control.count[lane] = 0.0  # is part of the steps by now
    work_of_steps = spent(lane, control) - int(control.iterations[lane])
    failed = max(1, queue.results[joint].failed_step) if status == NEWTON_FAILED else -1
    end_joint(lane, status, failed, steps_of(batch.pasts.turns[lane]), options, batch, queue)
    queue.left[joint] -= work_of_steps
    rest(lane, batch)


@njit
def explicit(steps, options, batch, queue):
    """Simulate the joints of a queue that have a start.

    Parameters
    ----------
    steps : ndarray of int, shape (n,)
        Steps of the first revolution of each joint, multiples of ``options.steps_per_rev``, see `count_steps`.
    options : Options
        Numerical settings, with ``max_refinements``; its tolerance plays no part.
    batch : Batch
        Memory of the lanes; nothing is carried over from one call to the next.
    queue : Queue
        The joints. Where a joint's status is `NOT_SETTLED`, ``starts`` holds its start, unless the torque rises from
        zero; others have ended. A joint without work left ends as `NEWTON_FAILED`.
    """
    batch, queue, steps = without_refcount(batch), without_refcount(queue), without_refcount(steps)
    lanes = as_lanes(batch.par), as_lanes(batch.work), as_lanes(batch.peaks)
    motion, control = as_lanes(batch.motion), as_lanes(batch.control)
    pasts, at, queued = batch.pasts, batch.control, 0
    for lane in range(at.joint.size):
        put_joint(lane, queue.words[0], batch)
        rest(lane, batch)
    while queued < len(queue.rows) or any_of(control.live > 0):
        arrived = bits_of(control.until <= 0)
        if arrived > 0:
            complete_loads(lanes[0], lanes[1])
        for lane in range(at.joint.size):
            trail = Trail(pasts.loads[lane], pasts.revolution[lane], pasts.notes[lane])
            past = Past(trail, pasts.turns[lane], pasts.extremes[lane], pasts.begun[lane], pasts.mesh[lane])
            if (arrived >> lane) & 1:
                joint = at.joint[lane]
                out = queue.results[joint]
                samples = samples_of(lane, joint, batch.samples, queue.samples)
                left = queue.left[joint]
                status, goes_on = arrive(lane, queue.rows[joint], lanes, left, options, batch, samples, past, out)
                if not goes_on:
                    finish_explicit_joint(lane, status, options, batch, queue)
            while queued < len(queue.rows) and at.live[lane] == 0:
                load_explicit_joint(lane, queued, steps, options, batch, queue, past)
                queued += 1
        fresh = control.fresh > 0
        if any_of(fresh):
            forget(fresh, lanes[2])
            control.fresh = 0.0 * control.fresh
        if any_of(control.live > 0):
            walk(lanes[0], options, lanes[1], motion, control, lanes[2])
