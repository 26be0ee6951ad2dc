"""Simulation of joints in lock-step: one joint per lane, one Newton iteration of all lanes per round.

A round evaluates the residual of every lane once, at the lane's own time and trial point. Each lane is then corrected,
gets a new tangent, or continues: from the search for equilibrium to its first step, to the next stage, sub-step, grid
point, cell or angle. Lanes never wait for each other's convergence, and a lane whose joint is finished takes the next
one from the queue. What a lane does depends only on its own joint, and so does every bit of the result.
"""

from tolstat.kernel.codes import DYNAMIC, NEWTON_FAILED, NOT_FINITE, NOT_SETTLED, OK, OUTSIDE_MODEL, QUASISTATIC, RAMP
from tolstat.kernel.integrators.mesh import cells_of, load_error, parts_of
from tolstat.kernel.lanes.batch import (
    ANGLE,
    HOLD,
    LOOK,
    PART,
    STEP,
    empty,
    forget_steps,
    put_joint,
    put_start,
    samples_of,
    start_newton,
)
from tolstat.kernel.lanes.course import (
    advance,
    fall_back,
    finish_angle,
    finish_closeup_part,
    next_phase,
    part,
    reject_cell,
    set_substep,
    start_cells,
    start_motion,
    step,
)
from tolstat.kernel.lanes.equilibrium import CV_STATIC
from tolstat.kernel.lanes.lane_memory import as_lanes
from tolstat.kernel.lanes.rounds import begin, classify_lanes, correct, refactorise
from tolstat.kernel.mechanics.dynamics import residual
from tolstat.kernel.mechanics.loads import complete_loads, write_loads
from tolstat.kernel.revolution.closeup import KINK, SHARP_KINK, divide, on_a_peak, recall, reverses, switches
from tolstat.kernel.revolution.closeup import STEPS as STEPS_AGAIN
from tolstat.kernel.revolution.outcome import (
    clear_results,
    clear_samples,
    finish,
    inside_model,
    is_finite,
    write_diagnostics,
)
from tolstat.kernel.revolution.quasistatic import angle_time, speed_ratios
from tolstat.kernel.revolution.resolve import Past, follows_error
from tolstat.kernel.revolution.settle import grid_step, summarise
from tolstat.kernel.revolution.trail import Trail
from tolstat.kernel.simd.borrow import without_refcount
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import WIDTH, any_of, bits_of, count_of, where

PATIENCE = WIDTH // 2
"""Number of lanes in need of a new tangent at which it is computed: it costs as much for one lane as for all, and lanes
that wait stand still."""
STANDSTILL = WIDTH
"""Rounds that lanes have waited for a tangent, summed over the lanes, at which it is computed even for fewer than
`PATIENCE`: these rounds took longer than a tangent does."""
START_ONLY = 0
"""Value of ``max_revs`` with which a joint ends at its start, `NOT_SETTLED`; an equilibrium is then in ``starts``."""


@njit
def end_joint(lane, status, failed, steps_per_rev, options, batch, queue):
    """Write how a joint ended, `failed` and `steps_per_rev` as in `outcome.finish`, and empty its lane."""
    control, joint = batch.control, batch.control.joint[lane]
    out = queue.results[joint]
    finish(status, failed, steps_per_rev, options, out)
    out.steps, out.newton_iterations = int(control.steps[lane]), int(control.iterations[lane])
    out.halvings, out.factorisations = int(control.halvings[lane]), int(control.factorisations[lane])
    queue.left[joint] -= out.newton_iterations
    for r in range(queue.blocks.shape[1]):
        if joint < len(queue.blocks):
            queue.blocks[joint, r] = batch.pasts.revolution[lane, r]
    empty(lane, batch)


@njit
def finish_joint(lane, status, options, batch, queue):
    """Continue a lane whose joint has ended, or whose step of a closer look has: next closer look, or results.

    A joint that has not settled gets no closer look. A failed step of a closer look ends that look. `status` is that of
    the joint or step.
    """
    control, joint = batch.control, batch.control.joint[lane]
    samples = samples_of(lane, joint, batch.samples, queue.samples)
    par, out, k, failed, looking = queue.rows[joint], queue.results[joint], 0, -1, False
    if control.phase[lane] == LOOK:
        looking, status, k = status != NEWTON_FAILED, OK, control.k[lane] + 1
    elif status == NEWTON_FAILED:
        failed = control.k[lane] if options.fidelity == DYNAMIC else -1
    else:
        if options.fidelity == QUASISTATIC and par.Js.shape[0] > 0:
            speed_ratios(par, samples)
        summarise(par, samples, out)
        if is_finite(out):
            status = OK if status == OK else NOT_SETTLED
            write_diagnostics(status, par, options, batch.notes[lane], samples, out)
        else:
            status, failed = NOT_FINITE, int(control.steps[lane])
    closer = status == OK and options.fidelity == DYNAMIC and options.peak_substeps > 1
    if closer and next_closeup_step(lane, k, looking, par, options, batch, samples, out):
        return
    end_joint(lane, status, failed, options.steps_per_rev, options, batch, queue)


@njit
def finish_spent_joint(lane, options, batch, queue):
    """Write that Newton has failed for a joint without iterations left, and empty its lane."""
    k = batch.control.k[lane]
    if follows_error(options):
        k = -(-k // cells_of(options.steps_per_rev))
    end_joint(lane, NEWTON_FAILED, max(1, k), options.steps_per_rev, options, batch, queue)


@njit
def finish_adaptive_joint(lane, status, options, batch, queue):
    """Write the results of a joint with error-controlled steps that has ended, and empty its lane."""
    cells = cells_of(options.steps_per_rev)
    failed = (batch.control.k[lane] + cells - 1) // cells if status == NEWTON_FAILED else -1
    end_joint(lane, status, failed, parts_of(batch.pasts.mesh[lane]), options, batch, queue)


@njit
def next_closeup_step(lane, k, looking, par, options, batch, samples, out):
    """Set up the next step of the recorded revolution that is integrated again, see `closeup`; return if there is one.

    `k`: first step to consider, the one to sample `k`; `looking`: whether the step before it was integrated again.
    """
    control, n, h = batch.control, options.steps_per_rev, grid_step(par, options)
    while k <= n:
        switched = k < n and switches(k, samples)
        goes_on = switched or looking
        begins = goes_on or (k < n and reverses(k, samples))
        rings = k < n and begins and on_a_peak(k, KINK if goes_on else SHARP_KINK, par, samples, out)
        if rings and not looking:
            forget_steps(lane, control, batch.motion)
            recall(k - 1, lane, par, options, samples, batch.motion)
            control.looked[lane] = 0
        control.left[lane] = control.left[lane] - 1 if looking else 0
        if rings and switched:
            control.left[lane] = STEPS_AGAIN
        if rings or control.left[lane] > 0:
            control.phase[lane], control.k[lane], control.part[lane] = LOOK, k, 0
            control.origin[lane] = (n + k - 1) * h
            control.done[lane] = control.level[lane] = 0
            divide(lane, par, options, control, batch.motion)
            set_substep(lane, options, control, batch.motion)
            return True
        looking = False
        k += 1
    return False


@njit
def load_joint(lane, joint, options, batch, queue):
    """Put a joint into a lane and set up its start: equilibrium from the pose where all pins just touch, or ramp.

    A joint outside the model ends at once.
    """
    par, start, control, motion = queue.rows[joint], queue.starts[joint], batch.control, batch.motion
    clear_results(queue.results[joint])
    control.joint[lane], control.phase[lane], control.k[lane] = joint, HOLD, 0
    put_joint(lane, queue.words[joint], batch)
    put_start(lane, par, start, control, motion)
    if not inside_model(par):
        end_joint(lane, OUTSIDE_MODEL, -1, options.steps_per_rev, options, batch, queue)
        return
    clear_samples(samples_of(lane, joint, batch.samples, queue.samples), batch.notes[lane])
    control.origin[lane], control.grid[lane] = 0.0, grid_step(par, options)
    control.t[lane] = 0.0 if options.fidelity == DYNAMIC else angle_time(0, options.steps_per_rev, par)
    if options.fidelity == DYNAMIC and options.start == RAMP:
        for i in range(start.shape[0]):
            motion.q0[i, lane], motion.a0[i, lane] = 0.0, start[i]
        if options.max_revs == START_ONLY:
            end_joint(lane, NOT_SETTLED, -1, options.steps_per_rev, options, batch, queue)
            return
        start_motion(lane, par, options, control, motion)
        if control.phase[lane] == PART:
            pasts = batch.pasts
            trail = Trail(pasts.loads[lane], pasts.revolution[lane], pasts.notes[lane])
            past = Past(trail, pasts.turns[lane], pasts.extremes[lane], pasts.begun[lane], pasts.mesh[lane])
            start_cells(lane, par, options, control, motion, past)
    else:
        start_newton(lane, CV_STATIC, 0.0, control, motion)


@njit
def fill(lane, queued, options, batch, queue):
    """Give an empty lane the next joint of the queue, if there is one; return how many have left the queue.

    `queued` is the number that had left it before.
    """
    while queued < len(queue.rows) and batch.control.live[lane] == 0:
        load_joint(lane, queued, options, batch, queue)
        queued += 1
    return queued


@njit
def lockstep(options, patience, batch, queue, tally):
    """Simulate the joints of a queue.

    Parameters
    ----------
    options : Options
        Numerical settings; quasi-static, or dynamic with uniform or error-controlled steps.
    patience : int
        Number of lanes in need of a new tangent at which it is computed; for fewer, see `STANDSTILL`. No result depends
        on it.
    batch : Batch
        Memory of the lanes; nothing is carried over from one call to the next.
    queue : Queue
        The joints; a joint without work left ends as `NEWTON_FAILED`.
    tally : ndarray of int, shape (3,)
        Counters, increased: rounds; lanes with a joint, summed over rounds; rounds with new tangents.
    """
    batch, queue, tally = without_refcount(batch), without_refcount(queue), without_refcount(tally)
    par, work, tangent = as_lanes(batch.par), as_lanes(batch.work), as_lanes(batch.tangent)
    motion, control = as_lanes(batch.motion), as_lanes(batch.control)
    lanes, motions, controls = (par, work, motion), batch.motion, batch.control
    rows, results, pasts = queue.rows, queue.results, batch.pasts
    queued, waited, controlled = 0, 0, follows_error(options)
    for lane in range(controls.joint.size):
        put_joint(lane, queue.words[0], batch)
        empty(lane, batch)
        queued = fill(lane, queued, options, batch, queue)
    while any_of(control.live > 0):
        if any_of(control.fresh > 0):
            begin(options, motion, control)
        residual(control.t, motion.q, motion.v, motion.a, par, options, work, motion.residual)
        solved, failed, stale, moving, last, now = classify_lanes(options, par, motion, control)
        tally[0] += 1
        tally[1] += count_of(control.live > 0)
        waiting = count_of(stale)
        waited += waiting
        nothing_else = waiting > 0 and not any_of(solved | failed | moving)
        if waiting >= patience or waited >= STANDSTILL or nothing_else:
            good = refactorise(stale, control, par, work, tangent)
            waited = 0
            tally[2] += 1
            control.before = where(stale, now, control.before)
            failed, moving = failed | (stale & ~good), moving | (stale & good)
        failed = failed | correct(moving, solved, par, tangent, motion, control)
        solved = solved | last
        if controlled and any_of(solved & (control.stage > 0)):
            control.error = load_error(control.h, par, motion)
        if any_of(solved & (control.phase >= STEP)):
            write_loads(motion.v, par, work)
            complete_loads(par, work)
        acting, arrived = bits_of(solved | failed), bits_of(solved)
        # what follows stands here, not in a function of its own: passing the lanes to one cost 7 % of the time
        for lane in range(controls.joint.size):
            if (acting >> lane) & 1 == 0:
                continue
            joint, phase, status = controls.joint[lane], controls.phase[lane], NOT_SETTLED
            if controls.iterations[lane] >= queue.left[joint]:
                finish_spent_joint(lane, options, batch, queue)
                queued = fill(lane, queued, options, batch, queue)
                continue
            here, goes_on = samples_of(lane, joint, batch.samples, queue.samples), True
            trail = Trail(pasts.loads[lane], pasts.revolution[lane], pasts.notes[lane])
            past = Past(trail, pasts.turns[lane], pasts.extremes[lane], pasts.begun[lane], pasts.mesh[lane])
            if (arrived >> lane) & 1 == 0:
                if phase == PART:
                    status = reject_cell(lane, rows[joint], options, controls, motions, past)
                    goes_on = status == NOT_SETTLED
                else:
                    status = fall_back(lane, rows[joint], options, controls, motions)
            elif phase == PART:
                fine, out = batch.fine[lane], results[joint]
                status, goes_on = part(lane, rows[joint], lanes, options, controls, motions, here, fine, past, out)
            elif phase == ANGLE:
                status = finish_angle(lane, rows[joint], lanes, options, controls, motions, here, results[joint])
            elif phase < STEP:
                next_phase(lane, rows[joint], options, controls, motions)
            elif advance(lane, options, controls, motions):
                if phase == STEP:
                    status = step(
                        lane, rows[joint], lanes, options, controls, motions, here, batch.notes[lane], results[joint]
                    )
                else:
                    status = finish_closeup_part(
                        lane, rows[joint], lanes, options, controls, motions, batch.fine[lane], results[joint]
                    )
            if options.max_revs == START_ONLY and controls.phase[lane] in (STEP, PART):
                for i in range(queue.starts.shape[1]):
                    queue.starts[joint, i] = motions.q0[i, lane]
                end_joint(lane, NOT_SETTLED, -1, options.steps_per_rev, options, batch, queue)
            elif not goes_on:
                finish_adaptive_joint(lane, status, options, batch, queue)
            elif status != NOT_SETTLED:
                finish_joint(lane, status, options, batch, queue)
            else:
                if controls.phase[lane] == PART and controls.k[lane] == 0:
                    start_cells(lane, rows[joint], options, controls, motions, past)
                continue
            queued = fill(lane, queued, options, batch, queue)
