"""Transitions of one lane: through equilibrium, sub-steps, grid points, input angles, and cells.

Each function sets up the next trial point of a lane, or returns how the joint has ended: `NOT_SETTLED` while it
continues, `OK`, `OUT_OF_REVOLUTIONS`, or `NEWTON_FAILED`. `par`, `samples`, `notes`, `fine`, `past` and `out` are those
of the lane's joint; `control` and `motion` are read joint by joint.
"""

from tolstat.common.tables import MAX_ITERATIONS
from tolstat.kernel.codes import (
    AHEAD,
    H_OLD,
    MASSLESS,
    NEWTON_FAILED,
    NOT_SETTLED,
    OK,
    QUASISTATIC,
    STAGED_STEP,
    TR_BDF2,
)
from tolstat.kernel.integrators.mesh import cells_of, next_level, note_cell
from tolstat.kernel.integrators.trbdf2 import GAMMA
from tolstat.kernel.lanes.batch import ANGLE, CHECK, HOLD, PART, RELAX, STEP, start_newton
from tolstat.kernel.lanes.equilibrium import (
    AT_ANGLE,
    CV_STATIC,
    FROM_GUESS,
    GROWTH,
    LARGEST,
    SHRINK,
    relax,
    start_relaxing,
)
from tolstat.kernel.revolution.closeup import count_in
from tolstat.kernel.revolution.outcome import check_settled
from tolstat.kernel.revolution.quasistatic import angle_time
from tolstat.kernel.revolution.resolve import (
    adapt_mesh,
    after_revolution,
    begin_mesh,
    clear_extremes,
    follows_error,
    merge_extremes,
)
from tolstat.kernel.revolution.settle import (
    ALL_LOADS,
    closure_error,
    grid_step,
    predict_increment,
    record,
    record_loads,
)
from tolstat.kernel.simd.jit import njit

OUT_OF_REVOLUTIONS = -1
"""Status, in addition to those of a joint, after the last revolution without settling."""
MAX_RATIO = 2.0
"""Largest ratio of a step to the one before, for the stability of BDF2."""
MASSLESS_SHARE = 60
"""A joint's first steps from an equilibrium neglect the inertia of the unknowns: one in so many of a revolution, at
least one. Inertia then sets in on a joint that moves almost as it will when settled; from rest the joint would ring."""


@njit
def accept_unknowns(lane, motion):
    """Accept the unknowns of the trial point of a lane."""
    for i in range(motion.q.shape[0]):
        motion.q0[i, lane] = motion.q[i, lane]


@njit
def search(lane, par, options, control, motion):
    """Take the next step of pseudo-time in a lane; once it ends, continue with the last iterate."""
    if not relax(lane, control, motion):
        resume(lane, par, options, control, motion)


@njit
def resume(lane, par, options, control, motion):
    """Continue a lane after pseudo-time: with the first step or angle, or with another attempt at its angle."""
    if control.level[lane] == AT_ANGLE:
        control.phase[lane] = ANGLE
        start_newton(lane, CV_STATIC, 0.0, control, motion)
    else:
        start_motion(lane, par, options, control, motion)


@njit
def start_motion(lane, par, options, control, motion):
    """Set up the first grid point, cell or angle of a lane that is at its start."""
    control.done[lane] = 0
    if options.fidelity == QUASISTATIC:
        control.phase[lane] = ANGLE
        set_angle(lane, 0, par, options, control)
    else:
        for i in range(motion.q.shape[0]):
            motion.q1[i, lane] = motion.q0[i, lane]
        control.phase[lane], control.factorised[lane], control.k[lane] = STEP, 0.0, 1
        control.level[lane] = 0
        if follows_error(options):
            control.phase[lane], control.k[lane] = PART, 0  # `start_cells` continues from here
        else:
            set_substep(lane, options, control, motion)


@njit
def set_angle(lane, k, par, options, control):
    """Set up angle `k` in a lane."""
    control.k[lane], control.level[lane], control.fresh[lane] = k, 0, 1.0
    control.t[lane] = angle_time(k, options.steps_per_rev, par)


@njit
def set_substep(lane, options, control, motion):
    """Set up the next sub-step of a lane."""
    if options.method != TR_BDF2:
        h_old = motion.memory[H_OLD, lane]
        control.level[lane] = admissible_level(control.level[lane], control.grid[lane], h_old, options)
    set_stage(lane, 0, options, control)


@njit
def admissible_level(level, h, h_old, options):
    """Smallest level, from `level` on, with a sub-step h / 2^level of at most `MAX_RATIO` times the last, `h_old`."""
    while level < options.max_halvings and h_old > 0 and h / (1 << level) > 1.0001 * MAX_RATIO * h_old:
        level += 1
    return level


@njit
def set_stage(lane, stage, options, control):
    """Set up a stage of the current sub-step, or part of a cell."""
    grid, whole = control.grid[lane], 1 << options.max_halvings
    h = grid / (1 << control.level[lane])
    reach = GAMMA if options.method == TR_BDF2 and stage == 0 else 1.0
    control.stage[lane], control.h[lane], control.fresh[lane] = stage, h, 1.0
    control.t[lane] = control.origin[lane] + grid * (control.done[lane] / whole) + reach * h


@njit
def advance(lane, options, control, motion):
    """Accept the stage or sub-step of a lane; return whether its step is complete, else set up what follows."""
    if options.method == TR_BDF2 and control.stage[lane] == 0:
        set_stage(lane, 1, options, control)
        return False
    whole = 1 << options.max_halvings
    control.steps[lane] += 1
    control.passed[lane] = 1.0
    if motion.memory[MASSLESS, lane] > 0:
        motion.memory[MASSLESS, lane] -= 1
        if motion.memory[MASSLESS, lane] == 0:
            control.factorised[lane] = 0.0
    motion.memory[H_OLD, lane], motion.memory[AHEAD, lane] = control.h[lane], 0.0
    motion.memory[STAGED_STEP, lane] = control.h[lane]
    control.done[lane] += whole >> control.level[lane]
    while control.level[lane] > 0 and control.done[lane] % (whole >> (control.level[lane] - 1)) == 0:
        control.level[lane] -= 1  # steps grow again where the grid allows it
    if control.done[lane] < whole:
        set_substep(lane, options, control, motion)
        return False
    control.done[lane] = control.level[lane] = 0
    return True


@njit
def step(lane, par, lanes, options, control, motion, samples, notes, out):
    """Record the grid point that a lane has reached and set up the next step; return the status."""
    k = control.k[lane]
    record(k, lane, lanes[0], lanes[1], samples)
    motion.memory[AHEAD, lane] = predict_increment(
        k, motion.q[:, lane], motion.v[:, lane], motion.ahead[:, lane], samples
    )
    status = check_settled(k, int(control.iterations[lane]), par, options, samples, notes, out)
    if status != NOT_SETTLED:
        return status
    if k == options.max_revs * options.steps_per_rev:
        return OUT_OF_REVOLUTIONS
    control.k[lane], control.origin[lane] = k + 1, k * control.grid[lane]
    set_substep(lane, options, control, motion)
    return NOT_SETTLED


@njit
def finish_closeup_part(lane, par, lanes, options, control, motion, fine, out):
    """Record a part of a closer look and set up the next one; return `OK` after the last part of the step."""
    j, part = control.looked[lane], control.grid[lane]
    record_loads(lane, lanes[1], fine[j % 3])
    count_in(j, fine, par, out)
    control.looked[lane] += 1
    control.part[lane] += 1
    if control.part[lane] == control.until[lane]:
        return OK
    n, h = options.steps_per_rev, grid_step(par, options)
    control.origin[lane] = (n + control.k[lane] - 1) * h + control.part[lane] * part
    set_substep(lane, options, control, motion)
    return NOT_SETTLED


@njit
def finish_angle(lane, par, lanes, options, control, motion, samples, out):
    """Record the angle that a lane has solved and set up the next one; return the status."""
    k, n = control.k[lane], options.steps_per_rev
    control.steps[lane] += 1
    control.passed[lane] = 1.0
    record(k, lane, lanes[0], lanes[1], samples)
    psi = 6 * par.lump_kind.shape[0] + par.Js.shape[0] - 1
    samples[k % n].tau = motion.q[psi, lane]
    if k == n:
        k = 0
        control.done[lane] += 1
        out.closure, out.revolutions = closure_error(0, 1, ALL_LOADS, par, samples), float(control.done[lane])
        if out.closure <= options.settle_tol:
            return OK
        if control.iterations[lane] > MAX_ITERATIONS * n * options.max_revs:
            return NEWTON_FAILED
        if control.done[lane] == options.max_revs:
            return OUT_OF_REVOLUTIONS
    set_angle(lane, k + 1, par, options, control)
    return NOT_SETTLED


@njit
def next_phase(lane, par, options, control, motion):
    """Select the next phase after success in the search for equilibrium, or in a step of pseudo-time."""
    phase = control.phase[lane]
    if phase != CHECK:
        accept_unknowns(lane, motion)
    if phase == RELAX:
        control.phase[lane] = CHECK
        start_newton(lane, CV_STATIC, 0.0, control, motion)
    elif phase == CHECK:
        resume(lane, par, options, control, motion)
    else:
        start_motion(lane, par, options, control, motion)
    if control.phase[lane] == STEP and options.method != TR_BDF2:
        motion.memory[MASSLESS, lane] = max(1, options.steps_per_rev // MASSLESS_SHARE)


@njit
def fall_back(lane, par, options, control, motion):
    """Select the fallback after Newton failed in this lane, or `CHECK` did; return the status."""
    phase = control.phase[lane]
    if phase == CHECK:
        control.pseudo[lane] = min(GROWTH * control.pseudo[lane], LARGEST)
        search(lane, par, options, control, motion)
        return NOT_SETTLED
    control.factorised[lane] = 0.0
    if phase == HOLD:
        start_relaxing(lane, FROM_GUESS, control)
        search(lane, par, options, control, motion)
    elif phase == RELAX:
        control.pseudo[lane] *= SHRINK
        search(lane, par, options, control, motion)
    elif phase == ANGLE:
        if control.level[lane] == AT_ANGLE:
            return NEWTON_FAILED
        if control.level[lane] == 0:
            control.halvings[lane] += 1
            control.level[lane] = 1
            start_newton(lane, CV_STATIC, 0.0, control, motion)
        else:
            start_relaxing(lane, AT_ANGLE, control)
            search(lane, par, options, control, motion)
    elif motion.memory[MASSLESS, lane] > 0:
        motion.memory[MASSLESS, lane] = 0.0
        set_substep(lane, options, control, motion)
    else:
        control.halvings[lane] += 1
        control.level[lane] += 1
        if control.level[lane] > options.max_halvings:
            return NEWTON_FAILED
        motion.memory[AHEAD, lane] = motion.memory[STAGED_STEP, lane] = 0.0
        set_substep(lane, options, control, motion)
    return NOT_SETTLED


@njit
def start_cells(lane, par, options, control, motion, past):
    """Start error-controlled steps in a lane."""
    begin_mesh(par, options, motion.memory[:, lane], motion.weight[:, lane], past)
    control.grid[lane] = grid_step(par, options) / cells_of(options.steps_per_rev)
    start_cell(lane, 1, par, options, control, motion, past)


@njit
def start_cell(lane, c, par, options, control, motion, past):
    """Set up cell `c` in a lane that is at the end of the previous cell."""
    cell, before = past.mesh[c % past.mesh.size], past.mesh[(c - 1) % past.mesh.size]
    for i in range(motion.q.shape[0]):
        past.begun[0, i], past.begun[1, i] = motion.q0[i, lane], motion.v0[i, lane]
        past.begun[2, i] = motion.a0[i, lane]
    control.k[lane], control.origin[lane] = c, (c - 1) * control.grid[lane]
    control.level[lane] = next_level(past.turns.revolution - past.turns.since, cell, before)
    control.began[lane] = control.level[lane]
    start_parts(lane, par, options, control, past)


@njit
def start_parts(lane, par, options, control, past):
    """Set up the first part of a cell."""
    control.done[lane] = control.part[lane] = 0
    control.worst[lane] = 0.0
    clear_extremes(past.extremes[0], par)
    set_stage(lane, 0, options, control)


@njit
def reject_cell(lane, par, options, control, motion, past):
    """Reject a cell and set it up again with parts half as long; return the status."""
    control.halvings[lane] += 1
    control.level[lane] += 1
    control.factorised[lane] = control.passed[lane] = motion.memory[STAGED_STEP, lane] = 0.0
    if control.level[lane] > options.max_halvings:
        return NEWTON_FAILED
    for i in range(motion.q.shape[0]):
        motion.q0[i, lane], motion.v0[i, lane] = past.begun[0, i], past.begun[1, i]
        motion.a0[i, lane] = past.begun[2, i]
    start_parts(lane, par, options, control, past)
    return NOT_SETTLED


@njit
def part(lane, par, lanes, options, control, motion, samples, fine, past, out):
    """Evaluate a solved stage of a part and set up the next one; return the status and whether the joint continues."""
    if control.stage[lane] == 0:
        set_stage(lane, 1, options, control)
        return NOT_SETTLED, True
    whole = 1 << options.max_halvings
    control.worst[lane] = max(control.worst[lane], control.error[lane])
    if not control.error[lane] <= 1:
        status = reject_cell(lane, par, options, control, motion, past)
        return status, status == NOT_SETTLED
    record_loads(lane, lanes[1], fine[control.part[lane] % 3])
    count_in(control.part[lane], fine, par, past.extremes[0])
    control.steps[lane] += 1
    control.done[lane] += whole >> control.level[lane]
    control.part[lane] += 1
    motion.memory[STAGED_STEP, lane] = control.h[lane]
    if control.done[lane] < whole:
        control.passed[lane] = 1.0
        set_stage(lane, 0, options, control)
        return NOT_SETTLED, True
    return finish_cell(lane, par, lanes, options, control, motion, samples, past, out)


@njit
def finish_cell(lane, par, lanes, options, control, motion, samples, past, out):
    """Complete a cell, record the grid point at its end if there is one, and continue; return values as of `part`."""
    c, turns, status, goes_on = control.k[lane], past.turns, NOT_SETTLED, True
    for i in range(motion.q.shape[0]):
        motion.q0[i, lane], motion.v0[i, lane] = motion.q[i, lane], motion.v[i, lane]
        motion.a0[i, lane] = motion.a[i, lane]
    refused = control.level[lane] > control.began[lane]
    note_cell(control.level[lane], refused, control.worst[lane], turns.revolution, past.mesh[c % past.mesh.size])
    merge_extremes(past.extremes[0], par, past.extremes[1])
    cells = past.mesh.size // samples.size
    if c % cells == 0:
        k = c // cells
        record(k, lane, lanes[0], lanes[1], samples)
        predict_increment(k, motion.q[:, lane], motion.v[:, lane], motion.ahead[:, lane], samples)
    if c % past.mesh.size == 0:
        halved = turns.halved
        status, goes_on = after_revolution(par, options, samples, past, out)
        adapt_mesh(halved, par, options, motion.memory[:, lane], motion.weight[:, lane], past)
    if goes_on:
        start_cell(lane, c + 1, par, options, control, motion, past)
    return status, goes_on
