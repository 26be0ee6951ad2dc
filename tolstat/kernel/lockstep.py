"""Joints in lock-step: as many as there are lanes go through Newton's iteration together, each at its own time.

A round evaluates the residual of every lane once, at whatever trial point the lane has arrived at; then each lane is
corrected, gets a new tangent, or begins its next step. Lanes never wait for each other's convergence, and a lane whose
joint is finished takes the next one from the queue. What is rare a joint does alone, as `simulate` does it: its start,
and a step that must be halved. What a lane does depends on its own joint only; so does every bit of the result.
"""

from tolstat.kernel import bdf2
from tolstat.kernel._jit import njit
from tolstat.kernel.batch import get_counters, get_motion, put_joint, put_motion
from tolstat.kernel.borrow import borrowed
from tolstat.kernel.integrate import MAX_RATIO, ROUNDOFF, SLOW, START_LEVEL, scaled_size
from tolstat.kernel.lane import WIDTH, any_of, bits_of, count_of, where
from tolstat.kernel.lane_memory import as_lanes
from tolstat.kernel.settle import foresee, record, summarise
from tolstat.kernel.simulate import (
    NOT_SETTLED,
    OK,
    assemble,
    begin,
    clear,
    clear_results,
    conclude,
    describe,
    eliminate,
    grid_step,
    inside_model,
    is_finite,
    judge,
    look_closer,
    residual,
    set_weight,
    simulate_joint,
    solve,
    substeps,
)
from tolstat.kernel.state import AHEAD, H_OLD, HALVINGS, ITERATIONS
from tolstat.kernel.topology import N_DOF

bdf2_predict = bdf2.predict
PATIENCE = 3
"""Lanes that make a new tangent together: it costs as much for one as for all, and those that wait stand still."""


@njit
def samples_of(lane, batch, samples):
    """Where the samples of a lane's joint are kept."""
    return samples[batch.control.joint[lane]] if len(samples) > 0 else batch.samples[lane]


@njit
def send(lane, k, batch):
    """Send a lane to grid point `k`."""
    control = batch.control
    control.k[lane], control.t[lane] = k, (k - 1) * control.h[lane] + control.h[lane]
    control.live[lane] = control.fresh[lane] = 1.0


@njit
def leave(lane, settled, rows, options, alone, batch, samples, results):
    """Write a lane's joint to its row of RESULT, and empty the lane. One that has not settled is begun anew, alone."""
    work, state, ring = alone
    control, motion = batch.control, batch.motion
    joint, own = control.joint[lane], samples_of(lane, batch, samples)
    out = results[joint]
    if settled:
        summarise(own, out)
    if settled and is_finite(out):
        conclude(rows[joint], own, batch.notes[lane], out)
        get_counters(lane, batch, state.counters)
        if options.peak_substeps > 1:
            set_weight(rows[joint], state)
            look_closer(rows[joint], options, work, state, own, ring.fine, out)
        describe(OK, options, state.counters, out)
    else:
        simulate_joint(rows[joint], options, work, state, ring, out)
        for s in range(own.size):
            own[s] = ring.samples[s]
    control.live[lane] = control.fresh[lane] = 0.0
    for i in range(N_DOF):  # no NaN: it would take all lanes to the paths of large rotations
        motion.q[i, lane] = motion.v[i, lane] = motion.a[i, lane] = 0.0


@njit
def walk(lane, k, level, rows, options, alone, batch, samples, results):
    """Take a lane's joint alone to grid point `k`, and on until it can step as the lanes do, or is finished."""
    work, state, _ = alone
    control, notes = batch.control, batch.notes[lane]
    joint, own = control.joint[lane], samples_of(lane, batch, samples)
    par = rows[joint]
    h = grid_step(par, options)
    status = NOT_SETTLED
    while status == NOT_SETTLED and k <= options.max_revs * options.steps_per_rev:
        if not substeps((k - 1) * h, h, level, par, options, work, state):
            break
        record(k, 0, par, work, state, own)
        state.memory[AHEAD] = foresee(k, state.q0, state.v0, state.ahead, own)
        status = judge(k, state.counters[ITERATIONS], options, own, notes, results[joint])
        k, level = k + 1, 0
        if status == NOT_SETTLED and h <= 1.0001 * MAX_RATIO * state.memory[H_OLD]:
            put_motion(lane, state, batch)
            control.h[lane], control.factorised[lane] = h, 0.0
            send(lane, k, batch)
            return
    put_motion(lane, state, batch)
    leave(lane, status == OK, rows, options, alone, batch, samples, results)


@njit
def enter(lane, joint, rows, words, options, alone, batch, samples, results):
    """Start a joint, and put it into a lane."""
    work, state, _ = alone
    clear_results(results[joint])
    batch.control.joint[lane] = joint
    put_joint(lane, words[joint], batch)
    if not inside_model(rows[joint]):
        leave(lane, False, rows, options, alone, batch, samples, results)
        return
    clear(rows[joint], state, samples_of(lane, batch, samples), batch.notes[lane])
    begin(rows[joint], options, work, state)
    walk(lane, 1, min(START_LEVEL, options.max_halvings), rows, options, alone, batch, samples, results)


@njit
def fill(lane, queued, rows, words, options, alone, batch, samples, results):
    """Give an empty lane its next joint, if there is one; returns how many have left the queue."""
    while queued < len(rows) and batch.control.live[lane] == 0:
        enter(lane, queued, rows, words, options, alone, batch, samples, results)
        queued += 1
    return queued


@njit
def arrive(lane, par, work, motion, rows, options, alone, batch, samples, results):
    """Record the grid point that a lane has reached, and send it on to the next."""
    control, own = batch.control, batch.motion
    k, here = control.k[lane], samples_of(lane, batch, samples)
    record(k, lane, par, work, motion, here)
    own.memory[AHEAD, lane] = foresee(k, own.q0[:, lane], own.v0[:, lane], own.ahead[:, lane], here)
    status = judge(k, int(control.iterations[lane]), options, here, batch.notes[lane], results[control.joint[lane]])
    if status != NOT_SETTLED or k == options.max_revs * options.steps_per_rev:
        leave(lane, status == OK, rows, options, alone, batch, samples, results)
    else:
        send(lane, k + 1, batch)


@njit
def halve(lane, rows, options, alone, batch, samples, results):
    """Take the step that has failed in a lane in halves."""
    state = alone[1]
    get_motion(lane, batch, state)
    state.counters[HALVINGS] += 1
    if options.max_halvings == 0:
        leave(lane, False, rows, options, alone, batch, samples, results)
    else:
        walk(lane, batch.control.k[lane], 1, rows, options, alone, batch, samples, results)


@njit
def verdict(options, motion, control):
    """Which lanes have solved their step, have failed to, need a new tangent, or are to be corrected: four masks."""
    now = scaled_size(control.cv, control.ca, motion)
    finite, live = now < 1e300, control.live > 0
    solved = live & ((now <= options.newton_tol) | ((control.at_roundoff > 0) & finite))
    failed = live & ~solved & (~finite | (control.iteration == options.newton_max_iter))
    going = live & ~solved & ~failed
    slow = (control.iteration > 0) & (now > SLOW * control.before)
    stale = going & ((control.factorised != control.cv) | slow)
    control.before = where(going & ~stale, now, control.before)
    return solved, failed, stale, going & ~stale, now


@njit
def accept(solved, motion, control):
    """Make the trial point of the lanes that have solved their step the last accepted one."""
    for i in range(N_DOF):
        motion.q1[i] = where(solved, motion.q0[i], motion.q1[i])
        motion.v1[i] = where(solved, motion.v0[i], motion.v1[i])
        motion.q0[i] = where(solved, motion.q[i], motion.q0[i])
        motion.v0[i] = where(solved, motion.v[i], motion.v0[i])
        motion.a0[i] = where(solved, motion.a[i], motion.a0[i])
    motion.memory[H_OLD] = where(solved, control.h, motion.memory[H_OLD])
    control.steps = where(solved, control.steps + 1, control.steps)


@njit
def keep_blocks(mask, new, old):
    """Copy matrices, shape (n, m, m), in the lanes of the mask."""
    for b in range(new.shape[0]):
        for i in range(new.shape[1]):
            for j in range(new.shape[2]):
                old[b, i, j] = where(mask, new[b, i, j], old[b, i, j])


@njit
def keep_rows(mask, new, old):
    """Copy vectors, shape (n, m), in the lanes of the mask."""
    for b in range(new.shape[0]):
        for i in range(new.shape[1]):
            old[b, i] = where(mask, new[b, i], old[b, i])


@njit
def renew(mask, control, par, work, kept):
    """Make a new tangent in the lanes of the mask; returns in which of all lanes that can be done."""
    assemble(control.cv, control.ca, par, work)
    good = eliminate(work)
    keep_blocks(mask, work.lump_block, kept.lump_block)
    keep_blocks(mask, work.hub_pin, kept.hub_pin)
    keep_blocks(mask, work.pin_hub, kept.pin_hub)
    keep_blocks(mask, work.pin_arm, kept.pin_arm)
    keep_blocks(mask, work.arm_pin, kept.arm_pin)
    keep_blocks(mask, work.core, kept.core)
    keep_rows(mask, work.arm_psi, kept.arm_psi)
    keep_rows(mask, work.psi_arm, kept.psi_arm)
    keep_rows(mask, work.pin_psi, kept.pin_psi)
    keep_rows(mask, work.psi_pin, kept.psi_pin)
    control.factorised = where(mask, control.cv, control.factorised)
    control.factorisations = where(mask, control.factorisations + 1, control.factorisations)
    return good


@njit
def correct(mask, kept, motion, control):
    """Newton's correction in the lanes of the mask."""
    for i in range(N_DOF):
        kept.solution[i] = -motion.residual[i]
    solve(motion.q, kept)
    step = largest = 0.0 * control.cv
    for i in range(N_DOF):
        change = where(mask, kept.solution[i], 0.0)
        motion.q[i] = where(mask, motion.q[i] + change, motion.q[i])
        motion.v[i] = where(mask, motion.v[i] + control.cv * change, motion.v[i])
        motion.a[i] = where(mask, motion.a[i] + control.ca * change, motion.a[i])
        step, largest = max(step, abs(change)), max(largest, abs(motion.q[i]))
    control.at_roundoff = where(mask & (step <= ROUNDOFF * largest), 1.0, 0.0)
    control.iteration = where(mask, control.iteration + 1, control.iteration)
    control.iterations = where(mask, control.iterations + 1, control.iterations)


@njit
def begin_steps(options, motion, control):
    """Make trial points in the lanes that begin a step."""
    fresh = control.fresh > 0
    cv, ca = bdf2_predict(control.h, fresh, motion, options)
    control.cv, control.ca = where(fresh, cv, control.cv), where(fresh, ca, control.ca)
    control.iteration = where(fresh, 0.0, control.iteration)
    control.at_roundoff = where(fresh, 0.0, control.at_roundoff)
    control.fresh = 0.0


@njit
def lockstep(rows, words, options, patience, alone, batch, samples, results, tally):
    """Simulate joints with one contact law and one number of stations; row i of the results is joint i.

    Parameters
    ----------
    rows : ndarray of PARAM, shape (n,)
        The joints, n > 0.
    words : ndarray, shape (n, words)
        The same memory as doubles.
    options : Options
        Numerical settings; the method must be BDF2, without error control.
    patience : int
        Lanes that need a new tangent wait until there are so many of them; no result depends on it.
    alone : Scratch
        Of one joint.
    batch : Batch
        Of the lanes; nothing is carried over from one call to the next.
    samples : ndarray of SAMPLE, shape (n, steps_per_rev) or (0, steps_per_rev)
        Written where there is room: the last revolution of every joint.
    results : ndarray of RESULT, shape (n,)
        Written.
    tally : ndarray of int, shape (3,)
        Added to: rounds, lanes with a joint in them, rounds with new tangents.
    """
    rows, words, samples, results = borrowed(rows), borrowed(words), borrowed(samples), borrowed(results)
    alone, batch = borrowed(alone), borrowed(batch)
    par, work, kept = as_lanes(batch.par), as_lanes(batch.work), as_lanes(batch.kept)
    motion, control = as_lanes(batch.motion), as_lanes(batch.control)
    queued = 0
    for lane in range(WIDTH):
        put_joint(lane, words[0], batch)
        batch.control.live[lane] = 0.0
        queued = fill(lane, queued, rows, words, options, alone, batch, samples, results)
    while any_of(control.live > 0):
        if any_of(control.fresh > 0):
            begin_steps(options, motion, control)
        residual(control.t, motion.q, motion.v, motion.a, par, options, work, motion.residual)
        solved, failed, stale, moving, now = verdict(options, motion, control)
        tally[0] += 1
        tally[1] += count_of(control.live > 0)
        waiting = count_of(stale)
        if waiting >= patience or (waiting > 0 and not any_of(solved | failed | moving)):
            good = renew(stale, control, par, work, kept)
            tally[2] += 1
            control.before = where(stale, now, control.before)
            failed, moving = failed | (stale & ~good), moving | (stale & good)
        if any_of(solved):
            accept(solved, motion, control)
        correct(moving, kept, motion, control)
        acting = bits_of(solved | failed)
        arrived = bits_of(solved)
        for lane in range(WIDTH):
            if (acting >> lane) & 1 == 0:
                continue
            if (arrived >> lane) & 1:
                arrive(lane, par, work, motion, rows, options, alone, batch, samples, results)
            else:
                halve(lane, rows, options, alone, batch, samples, results)
            queued = fill(lane, queued, rows, words, options, alone, batch, samples, results)
