"""Simulation of joints in lock-step: one joint per lane, one Newton iteration of all lanes per round.

A round evaluates the residual of every lane once, at the lane's own time and trial point. Each lane is then corrected,
gets a new tangent, or continues: from the search for equilibrium to its first step, to the next sub-step, grid point,
cell or angle. Lanes never wait for each other's convergence, and a lane whose joint is finished takes the next one from
the queue. A joint in which a step or angle has finally failed is left `AGAIN_ALONE`, unless its steps are
error-controlled: the caller simulates it again from its start, alone, as in `simulate`. What a lane does depends only
on its own joint, and so does every bit of the result.
"""

from tolstat.kernel.integrators.mesh import cells_of, load_error, parts_of
from tolstat.kernel.integrators.state import ITERATIONS
from tolstat.kernel.lanes.batch import (
    ANGLE,
    HOLD,
    LOOK,
    PART,
    STEP,
    empty,
    get_counters,
    put_joint,
    put_points,
    put_start,
    samples_of,
    start_newton,
)
from tolstat.kernel.lanes.course import (
    GIVEN_UP,
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
from tolstat.kernel.lanes.lane_memory import as_lanes
from tolstat.kernel.lanes.rounds import begin, classify_lanes, correct, refactorise
from tolstat.kernel.mechanics.vector import copy
from tolstat.kernel.revolution.closeup import STEPS as STEPS_AGAIN
from tolstat.kernel.revolution.closeup import on_a_peak, recall, switches
from tolstat.kernel.revolution.equilibrium import CV_STATIC
from tolstat.kernel.revolution.quasistatic import angle_time, speed_ratios
from tolstat.kernel.revolution.resolve import Past, follows_error
from tolstat.kernel.revolution.settle import grid_step, summarise
from tolstat.kernel.revolution.simulate import (
    AGAIN_ALONE,
    DYNAMIC,
    NEWTON_FAILED,
    NOT_SETTLED,
    OK,
    OUTSIDE_MODEL,
    QUASISTATIC,
    RAMP,
    clear,
    clear_results,
    finish,
    inside_model,
    is_finite,
    residual,
    write_counters,
    write_diagnostics,
)
from tolstat.kernel.revolution.trail import Trail
from tolstat.kernel.simd.borrow import without_refcount
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import WIDTH, any_of, bits_of, count_of, where

PATIENCE = 1 + WIDTH // 4
"""Number of lanes in need of a new tangent at which it is computed: it costs as much for one lane as for all, and lanes
that wait stand still."""
STANDSTILL = 2 * WIDTH
"""Rounds that lanes have waited for a tangent, summed over the lanes, at which it is computed even for fewer than
`PATIENCE`: these rounds took longer than a tangent does."""


@njit
def finish_joint(lane, status, rows, left, options, alone, batch, samples, results):
    """Continue a lane whose joint has ended, or whose step of a closer look has: next closer look, or results.

    A joint that has not settled gets no closer look. A joint in which a step has failed is left `AGAIN_ALONE`; a failed
    step of a closer look ends that look. `status` is that of the joint or step; for the other arguments see `lockstep`.
    """
    control, joint, own = batch.control, batch.control.joint[lane], samples_of(lane, batch, samples)
    par, out, k = rows[joint], results[joint], 0
    good = status in (OK, GIVEN_UP)
    if control.phase[lane] == LOOK:
        control.left[lane] = control.left[lane] if good else 0
        good, status, k = True, OK, control.k[lane] + 1
    elif good:
        if options.fidelity == QUASISTATIC:
            speed_ratios(par, own)
        summarise(par, own, out)
        good = is_finite(out)
        if good:
            status = OK if status == OK else NOT_SETTLED
            write_diagnostics(status, par, options, batch.notes[lane], own, out)
        control.left[lane] = control.looked[lane] = 0
    if good:
        closer = status == OK and options.fidelity == DYNAMIC and options.peak_substeps > 1
        if closer and next_closeup_step(lane, k, par, options, alone, batch, own, out):
            return
        counters = alone.state.counters
        get_counters(lane, batch, counters)
        write_counters(status, options.steps_per_rev, counters, out)
        left[joint] -= counters[ITERATIONS]
    else:
        left[joint] -= int(control.iterations[lane])
        out.status = AGAIN_ALONE
    empty(lane, batch)


@njit
def give_up(lane, left, options, alone, batch, results):
    """Write how a joint without iterations left has ended, and empty its lane; for the arguments see `lockstep`."""
    joint, k, counters = batch.control.joint[lane], batch.control.k[lane], alone.state.counters
    if follows_error(options):
        k = -(-k // cells_of(options.steps_per_rev))
    get_counters(lane, batch, counters)
    left[joint] -= counters[ITERATIONS]
    finish(NEWTON_FAILED, max(1, k), options.steps_per_rev, options, counters, results[joint])
    empty(lane, batch)


@njit
def finish_adaptive_joint(lane, status, left, options, alone, batch, blocks, results):
    """Write the results of a joint with error-controlled steps that has ended, and empty its lane.

    `status` is that of the joint; for the other arguments see `lockstep`.
    """
    joint, counters = batch.control.joint[lane], alone.state.counters
    cells = cells_of(options.steps_per_rev)
    get_counters(lane, batch, counters)
    left[joint] -= counters[ITERATIONS]
    failed = (batch.control.k[lane] + cells - 1) // cells if status == NEWTON_FAILED else -1
    finish(status, failed, parts_of(batch.pasts.mesh[lane]), options, counters, results[joint])
    for r in range(blocks.shape[1]):
        if joint < len(blocks):
            blocks[joint, r] = batch.pasts.revolution[lane, r]
    empty(lane, batch)


@njit
def next_closeup_step(lane, k, par, options, alone, batch, samples, out):
    """Set up the next step that `closeup.look_closer` would integrate again; return whether there is one.

    Parameters
    ----------
    lane, k : int
        Number of the lane; first step to consider, the one to sample `k`.
    par, out
        The lane's joint and its row of KERNEL_RESULT.
    options, alone, batch
        As in `lockstep`.
    samples : ndarray of SAMPLE, shape (steps_per_rev,)
        Recorded revolution of the joint.
    """
    state = alone.state
    control, n, h = batch.control, options.steps_per_rev, grid_step(par, options)
    while k <= n:
        if k < n and switches(k, samples) and on_a_peak(k, samples, out):
            if control.left[lane] == 0:
                recall(k - 1, h, state, samples)
                put_points(lane, state, control, batch.motion)
                control.looked[lane] = 0
            control.left[lane] = STEPS_AGAIN
        if control.left[lane] > 0:
            control.left[lane] -= 1
            control.phase[lane], control.k[lane], control.part[lane] = LOOK, k, 0
            control.origin[lane], control.grid[lane] = (n + k - 1) * h, h / options.peak_substeps
            control.done[lane] = control.level[lane] = 0
            set_substep(lane, options, control, batch.motion)
            return True
        k += 1
    return False


@njit
def load_joint(lane, joint, rows, words, starts, left, options, alone, batch, samples, results):
    """Put a joint into a lane and set up its start: equilibrium from the pose where all pins just touch, or ramp.

    A joint outside the model ends at once.
    """
    state = alone.state
    par, control, motion = rows[joint], batch.control, batch.motion
    clear_results(results[joint])
    control.joint[lane], control.phase[lane] = joint, HOLD
    control.k[lane], control.iterations[lane] = 0, 0.0
    put_joint(lane, words[joint], batch)
    if not inside_model(par):
        state.counters[:] = 0
        finish(OUTSIDE_MODEL, -1, options.steps_per_rev, options, state.counters, results[joint])
        empty(lane, batch)
        return
    clear(par, state, samples_of(lane, batch, samples), batch.notes[lane])
    control.origin[lane], control.grid[lane] = 0.0, grid_step(par, options)
    control.t[lane] = 0.0 if options.fidelity == DYNAMIC else angle_time(0, options.steps_per_rev, par)
    if options.fidelity == DYNAMIC and options.start == RAMP:
        copy(starts[joint], state.a0)
        put_start(lane, state, control, motion)
        start_motion(lane, par, options, control, motion)
        if control.phase[lane] == PART:
            all_past = batch.pasts
            trail = Trail(all_past.loads[lane], all_past.revolution[lane], all_past.notes[lane])
            past = Past(trail, all_past.turns[lane], all_past.extremes[lane], all_past.begun[lane], all_past.mesh[lane])
            start_cells(lane, par, options, control, motion, past)
    else:
        copy(starts[joint], state.q0)
        put_start(lane, state, control, motion)
        start_newton(lane, CV_STATIC, 0.0, control, motion)


@njit
def fill(lane, queued, rows, words, starts, left, options, alone, batch, samples, results):
    """Give an empty lane the next joint of the queue, if there is one; return how many have left the queue.

    `queued` is the number that had left it before.
    """
    while queued < len(rows) and batch.control.live[lane] == 0:
        load_joint(lane, queued, rows, words, starts, left, options, alone, batch, samples, results)
        queued += 1
    return queued


@njit
def lockstep(rows, words, starts, left, options, patience, alone, batch, samples, blocks, results, tally):
    """Simulate joints with equal numbers of contact stations; row i of the results is joint i.

    Parameters
    ----------
    rows : ndarray of PARAM, shape (n,)
        The joints, n > 0.
    words : ndarray, shape (n, words)
        The same memory as doubles.
    starts : ndarray, shape (n, 56)
        Where the search for each joint's start begins, see `starts.write_starts`.
    left : ndarray of int, shape (n,)
        Newton iterations still allowed to each joint; reduced by those taken. A joint without any ends as
        `NEWTON_FAILED`.
    options : Options
        Numerical settings; quasi-static, or dynamic with BDF2 or with error-controlled steps.
    patience : int
        Number of lanes in need of a new tangent at which it is computed; for fewer, see `STANDSTILL`. No result depends
        on it.
    alone : Scratch
        Work arrays of one joint.
    batch : Batch
        Memory of the lanes; nothing is carried over from one call to the next.
    samples : ndarray of SAMPLE, shape (n, steps_per_rev) or (0, steps_per_rev)
        Written unless empty: the last revolution of every joint.
    blocks : ndarray of KERNEL_RESULT, shape (n, revolutions) or (0, revolutions)
        Written unless empty: statistics of the last revolutions of every joint with error-controlled steps; revolution
        r (from 0) at r modulo their number.
    results : ndarray of KERNEL_RESULT, shape (n,)
        Written; status `AGAIN_ALONE`: the joint is to be simulated from its start, with the iterations in `left`.
    tally : ndarray of int, shape (3,)
        Counters, increased: rounds; lanes with a joint, summed over rounds; rounds with new tangents.
    """
    rows, words, samples, results = (
        without_refcount(rows),
        without_refcount(words),
        without_refcount(samples),
        without_refcount(results),
    )
    blocks, left, tally = without_refcount(blocks), without_refcount(left), without_refcount(tally)
    starts = without_refcount(starts)
    alone, batch = without_refcount(alone), without_refcount(batch)
    par, work, kept = as_lanes(batch.par), as_lanes(batch.work), as_lanes(batch.kept)
    motion, control = as_lanes(batch.motion), as_lanes(batch.control)
    lanes, own, at = (par, work, motion), batch.motion, batch.control
    pasts = batch.pasts
    queued, waited, controlled = 0, 0, follows_error(options)
    for lane in range(WIDTH):
        put_joint(lane, words[0], batch)
        empty(lane, batch)
        queued = fill(lane, queued, rows, words, starts, left, options, alone, batch, samples, results)
    while any_of(control.live > 0):
        if any_of(control.fresh > 0):
            begin(options, motion, control)
        residual(control.t, motion.q, motion.v, motion.a, par, options, work, motion.residual)
        solved, failed, stale, moving, last, now = classify_lanes(options, motion, control)
        tally[0] += 1
        tally[1] += count_of(control.live > 0)
        waiting = count_of(stale)
        waited += waiting
        nothing_else = waiting > 0 and not any_of(solved | failed | moving)
        if waiting >= patience or waited >= STANDSTILL or nothing_else:
            good = refactorise(stale, control, par, work, kept)
            waited = 0
            tally[2] += 1
            control.before = where(stale, now, control.before)
            failed, moving = failed | (stale & ~good), moving | (stale & good)
        failed = failed | correct(moving, kept, motion, control)
        solved = solved | last
        if controlled and any_of(solved & (control.stage > 0)):
            control.error = load_error(control.h, par, motion)
        acting = bits_of(solved | failed)
        arrived = bits_of(solved)
        for lane in range(WIDTH):
            if (acting >> lane) & 1 == 0:
                continue
            joint, phase, status = at.joint[lane], at.phase[lane], NOT_SETTLED
            if at.iterations[lane] >= left[joint]:
                give_up(lane, left, options, alone, batch, results)
                queued = fill(lane, queued, rows, words, starts, left, options, alone, batch, samples, results)
                continue
            here, goes_on = samples_of(lane, batch, samples), True
            trail = Trail(pasts.loads[lane], pasts.revolution[lane], pasts.notes[lane])
            past = Past(trail, pasts.turns[lane], pasts.extremes[lane], pasts.begun[lane], pasts.mesh[lane])
            if (arrived >> lane) & 1 == 0:
                if phase == PART:
                    status = reject_cell(lane, options, at, own, past)
                    goes_on = status == NOT_SETTLED
                else:
                    status = fall_back(lane, rows[joint], options, at, own)
            elif phase == PART:
                fine, out = batch.fine[lane], results[joint]
                status, goes_on = part(lane, rows[joint], lanes, options, at, own, here, fine, past, out)
            elif phase == ANGLE:
                status = finish_angle(lane, rows[joint], lanes, options, at, own, here, results[joint])
            elif phase < STEP:
                next_phase(lane, rows[joint], options, at, own)
            elif advance(lane, options, at, own):
                if phase == STEP:
                    status = step(lane, rows[joint], lanes, options, at, own, here, batch.notes[lane], results[joint])
                else:
                    status = finish_closeup_part(
                        lane, rows[joint], lanes, options, at, own, batch.fine[lane], results[joint]
                    )
            if at.phase[lane] == PART and at.k[lane] == 0:
                start_cells(lane, rows[joint], options, at, own, past)
            if not goes_on:
                finish_adaptive_joint(lane, status, left, options, alone, batch, blocks, results)
            elif status != NOT_SETTLED:
                finish_joint(lane, status, rows, left, options, alone, batch, samples, results)
            else:
                continue
            queued = fill(lane, queued, rows, words, starts, left, options, alone, batch, samples, results)
