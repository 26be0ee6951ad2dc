"""Joints in lock-step: as many as there are lanes go through Newton's iteration together, each at its own time.

A round evaluates the residual of every lane once, at whatever trial point the lane has arrived at; then each lane is
corrected, gets a new tangent, or goes on: from the search for an equilibrium to its first step, from sub-step to
sub-step, from grid point to grid point, or from angle to angle. Lanes never wait for each other's convergence, and a
lane whose joint is finished takes the next one from the queue. A joint whose step or angle has failed for good is begun
anew alone, as `simulate` does it, unless its steps follow the error. What a lane does depends on its own joint only;
so does every bit of the result.
"""

from tolstat.kernel.integrators.mesh import cells_of, load_error
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
    rest,
)
from tolstat.kernel.lanes.course import (
    GIVEN_UP,
    advance,
    aim,
    depart,
    find,
    glance,
    part,
    refuse,
    retry,
    set_out,
    step,
    turn,
)
from tolstat.kernel.lanes.lane_memory import as_lanes
from tolstat.kernel.lanes.rounds import begin, correct, renew, verdict
from tolstat.kernel.revolution.closeup import STEPS as STEPS_AGAIN
from tolstat.kernel.revolution.closeup import on_a_peak, switches
from tolstat.kernel.revolution.equilibrium import HELD
from tolstat.kernel.revolution.quasistatic import angle_time, speed_ratios
from tolstat.kernel.revolution.resolve import Past, follows_error
from tolstat.kernel.revolution.settle import grid_step, summarise
from tolstat.kernel.revolution.simulate import (
    DYNAMIC,
    NEWTON_FAILED,
    NOT_SETTLED,
    OK,
    QUASISTATIC,
    RAMP,
    acceleration,
    clear,
    clear_results,
    conclude,
    describe,
    finish,
    inside_model,
    is_finite,
    recall,
    residual,
    rigid_guess,
    simulate_joint,
)
from tolstat.kernel.revolution.trail import Trail
from tolstat.kernel.simd.borrow import borrowed
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import WIDTH, any_of, bits_of, count_of, where

PATIENCE = 3
"""Lanes that make a new tangent together: it costs as much for one as for all, and those that wait stand still."""


@njit
def samples_of(lane, batch, samples):
    """Where the samples of a lane's joint are kept."""
    return samples[batch.control.joint[lane]] if len(samples) > 0 else batch.samples[lane]


@njit
def leave(lane, status, rows, options, alone, batch, samples, results):
    """Go on with a lane whose joint has settled, or has taken a step once more: to its next closer look, or out.

    A joint that has not settled goes as it is. Where a step has failed, the joint is begun anew, alone; a closer look
    is ended.
    """
    _, state, ring, _ = alone
    control, joint, own = batch.control, batch.control.joint[lane], samples_of(lane, batch, samples)
    par, out, k = rows[joint], results[joint], 0
    good = status in (OK, GIVEN_UP)
    if control.phase[lane] == LOOK:
        control.left[lane] = control.left[lane] if good else 0
        good, status, k = True, OK, control.k[lane] + 1
    elif good:
        if options.fidelity == QUASISTATIC:
            speed_ratios(par, own)
        summarise(own, out)
        good = is_finite(out)
        if good:
            status = OK if status == OK else NOT_SETTLED
            conclude(status, par, options, batch.notes[lane], own, out)
        control.left[lane] = control.looked[lane] = 0
    if good:
        closer = status == OK and options.fidelity == DYNAMIC and options.peak_substeps > 1
        if closer and look(lane, k, par, options, alone, batch, own, out):
            return
        get_counters(lane, batch, state.counters)
        describe(status, options, state.counters, batch.pasts.mesh[lane], out)
    else:
        simulate_joint(par, options, alone, out)
        for s in range(own.size):
            own[s] = ring.samples[s]
    empty(lane, batch)


@njit
def end(lane, status, options, alone, batch, blocks, results):
    """Empty a lane whose joint has come to its end with steps that follow the error."""
    joint, counters = batch.control.joint[lane], alone.state.counters
    cells = cells_of(options.steps_per_rev)
    get_counters(lane, batch, counters)
    failed = (batch.control.k[lane] + cells - 1) // cells if status == NEWTON_FAILED else -1
    finish(status, failed, options, counters, batch.pasts.mesh[lane], results[joint])
    for r in range(blocks.shape[1]):
        if joint < len(blocks):
            blocks[joint, r] = batch.pasts.revolution[lane, r]
    empty(lane, batch)


@njit
def look(lane, k, par, options, alone, batch, samples, out):
    """Send a lane to the next step, from the one to sample `k` on, that `closeup.look_closer` takes again, if any."""
    work, state, _, _ = alone
    control, n, h = batch.control, options.steps_per_rev, grid_step(par, options)
    while k <= n:
        if k < n and switches(k, samples) and on_a_peak(k, samples, out):
            if control.left[lane] == 0:
                recall(k - 1, h, par, options, work, state, samples)
                put_points(lane, state, control, batch.motion)
                control.looked[lane] = 0
            control.left[lane] = STEPS_AGAIN
        if control.left[lane] > 0:
            control.left[lane] -= 1
            control.phase[lane], control.k[lane], control.part[lane] = LOOK, k, 0
            control.origin[lane], control.grid[lane] = (n + k - 1) * h, h / options.peak_substeps
            control.done[lane] = control.level[lane] = 0
            aim(lane, options, control, batch.motion)
            return True
        k += 1
    return False


@njit
def enter(lane, joint, rows, words, options, alone, batch, samples, results):
    """Put a joint into a lane, to find its equilibrium from where all pins just touch."""
    work, state, _, _ = alone
    par, control, motion = rows[joint], batch.control, batch.motion
    clear_results(results[joint])
    control.joint[lane], control.phase[lane] = joint, HOLD
    put_joint(lane, words[joint], batch)
    if not inside_model(par):
        leave(lane, NEWTON_FAILED, rows, options, alone, batch, samples, results)
        return
    clear(par, state, samples_of(lane, batch, samples), batch.notes[lane])
    control.origin[lane], control.grid[lane] = 0.0, grid_step(par, options)
    control.t[lane] = 0.0 if options.fidelity == DYNAMIC else angle_time(0, options.steps_per_rev, par)
    if options.fidelity == DYNAMIC and options.start == RAMP:
        acceleration(0.0, state.q0, state.v0, par, options, work, state.a0)
        put_start(lane, state, control, motion)
        depart(lane, par, options, control, motion)
        if control.phase[lane] == PART:
            all_past = batch.pasts
            trail = Trail(all_past.modulus[lane], all_past.revolution[lane], all_past.notes[lane])
            past = Past(trail, all_past.turns[lane], all_past.extremes[lane], all_past.begun[lane], all_past.mesh[lane])
            set_out(lane, par, options, control, motion, past)
    else:
        rigid_guess(control.t[lane], par, work, state)
        put_start(lane, state, control, motion)
        rest(lane, HELD, 0.0, control, motion)


@njit
def fill(lane, queued, rows, words, options, alone, batch, samples, results):
    """Give an empty lane its next joint, if there is one; returns how many have left the queue."""
    while queued < len(rows) and batch.control.live[lane] == 0:
        enter(lane, queued, rows, words, options, alone, batch, samples, results)
        queued += 1
    return queued


@njit
def lockstep(rows, words, options, patience, alone, batch, samples, blocks, results, tally):
    """Simulate joints with one number of contact stations; row i of the results is joint i.

    Parameters
    ----------
    rows : ndarray of PARAM, shape (n,)
        The joints, n > 0.
    words : ndarray, shape (n, words)
        The same memory as doubles.
    options : Options
        Numerical settings; quasi-static, or dynamic with BDF2 or with steps that follow the error.
    patience : int
        Lanes that need a new tangent wait until there are so many of them; no result depends on it.
    alone : Scratch
        Of one joint.
    batch : Batch
        Of the lanes; nothing is carried over from one call to the next.
    samples : ndarray of SAMPLE, shape (n, steps_per_rev) or (0, steps_per_rev)
        Written where there is room: the last revolution of every joint.
    blocks : ndarray of RESULT, shape (n, revolutions) or (0, revolutions)
        Written where there is room: statistics of the last revolutions of every joint whose steps follow the error;
        revolution r (from 0) at r modulo their number.
    results : ndarray of RESULT, shape (n,)
        Written.
    tally : ndarray of int, shape (3,)
        Added to: rounds, lanes with a joint in them, rounds with new tangents.
    """
    rows, words, samples, results = borrowed(rows), borrowed(words), borrowed(samples), borrowed(results)
    blocks = borrowed(blocks)
    alone, batch = borrowed(alone), borrowed(batch)
    par, work, kept = as_lanes(batch.par), as_lanes(batch.work), as_lanes(batch.kept)
    motion, control = as_lanes(batch.motion), as_lanes(batch.control)
    lanes, own, at = (par, work, motion), batch.motion, batch.control
    pasts = batch.pasts
    queued, controlled = 0, follows_error(options)
    for lane in range(WIDTH):
        put_joint(lane, words[0], batch)
        empty(lane, batch)
        queued = fill(lane, queued, rows, words, options, alone, batch, samples, results)
    while any_of(control.live > 0):
        if any_of(control.fresh > 0):
            begin(options, motion, control)
        residual(control.t, motion.q, motion.v, motion.a, par, options, work, motion.residual)
        solved, failed, stale, moving, last, now = verdict(options, motion, control)
        tally[0] += 1
        tally[1] += count_of(control.live > 0)
        waiting = count_of(stale)
        if waiting >= patience or (waiting > 0 and not any_of(solved | failed | moving)):
            good = renew(stale, control, par, work, kept)
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
            here, goes_on = samples_of(lane, batch, samples), True
            trail = Trail(pasts.modulus[lane], pasts.revolution[lane], pasts.notes[lane])
            past = Past(trail, pasts.turns[lane], pasts.extremes[lane], pasts.begun[lane], pasts.mesh[lane])
            if (arrived >> lane) & 1 == 0:
                if phase == PART:
                    status = refuse(lane, options, at, own, past)
                    goes_on = status == NOT_SETTLED
                else:
                    status = retry(lane, rows[joint], options, at, own)
            elif phase == PART:
                fine, out = batch.fine[lane], results[joint]
                status, goes_on = part(lane, rows[joint], lanes, options, at, own, here, fine, past, out)
            elif phase == ANGLE:
                status = turn(lane, rows[joint], lanes, options, at, own, here, results[joint])
            elif phase < STEP:
                find(lane, rows[joint], options, at, own)
            elif advance(lane, options, at, own):
                if phase == STEP:
                    status = step(lane, lanes, options, at, own, here, batch.notes[lane], results[joint])
                else:
                    status = glance(lane, rows[joint], lanes, options, at, own, batch.fine[lane], results[joint])
            if at.phase[lane] == PART and at.k[lane] == 0:
                set_out(lane, rows[joint], options, at, own, past)
            if not goes_on:
                end(lane, status, options, alone, batch, blocks, results)
            elif status != NOT_SETTLED:
                leave(lane, status, rows, options, alone, batch, samples, results)
            else:
                continue
            queued = fill(lane, queued, rows, words, options, alone, batch, samples, results)
