"""Operations of a lock-step round on all lanes at once: predictor, convergence test, tangent, correction.

`motion` and `control` are the batch's records of MOTION and CONTROL, read as lanes. `begins` and `passed` are masks:
lanes that begin a step, stage or angle, and lanes whose trial point is accepted before that.
"""

import math

from tolstat.kernel.codes import (
    AHEAD,
    H_OLD,
    LAST_ITERATION_BELOW,
    MASSLESS,
    QUASISTATIC,
    STAGED_STEP,
    TR_BDF2,
    TRAPEZOIDAL,
)
from tolstat.kernel.integrators import bdf2, trbdf2
from tolstat.kernel.lanes.batch import CHECK, STEP
from tolstat.kernel.lanes.equilibrium import CA_REGULAR, CV_REGULAR, CV_STATIC, ENOUGH, FAR
from tolstat.kernel.mechanics.linsolve import factorise, solve
from tolstat.kernel.mechanics.tangent import assemble
from tolstat.kernel.revolution.quasistatic import extrapolate, keep
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import retain, where

SLOW = 0.2
"""Ratio of successive residuals above which the tangent is renewed."""
OLD = math.radians(7)
"""Turn of the input shaft after which a point that needs a correction gets a new tangent. Contact normals turn with the
shaft: an older tangent leaves a tenth of a residual, and the prediction multiplies that by 15, so that errors would
grow from step to step until `newton_tol` stops them."""
ROUNDOFF = 10 * 2.0**-52
"""Change of the unknowns, relative to the largest of them, that is no more than their rounding."""


@njit
def begin_steps(begins, passed, motion, control):
    """Accept the last sub-step where it passed; predict the trial point of the next one where one begins (BDF2)."""
    h = control.h
    coefficients = bdf2.formula(h, motion.memory[H_OLD], motion.memory[TRAPEZOIDAL])
    known, massless = motion.memory[AHEAD] > 0, motion.memory[MASSLESS] > 0
    for i in range(motion.q.shape[0]):
        q, v, a, q0, v0 = motion.q[i], motion.v[i], motion.a[i], motion.q0[i], motion.v0[i]
        before = retain(passed, q0, motion.q1[i]), retain(passed, v0, motion.v1[i])
        last = retain(passed, q, q0), retain(passed, v, v0), retain(passed, a, motion.a0[i])
        motion.q1[i], motion.v1[i] = before
        motion.q0[i], motion.v0[i], motion.a0[i] = last
        guess = bdf2.trial(h, coefficients, last, before, known, motion.ahead[i])
        motion.q[i] = retain(begins, guess[0], q)
        motion.v[i] = retain(begins, guess[1], v)
        motion.a[i] = retain(begins, where(massless, 0.0, guess[2]), a)
    control.cv = where(begins, coefficients[0], control.cv)
    control.ca = where(begins, where(massless, 0.0, coefficients[0] * coefficients[0]), control.ca)


@njit
def begin_parts(begins, passed, motion, control):
    """Accept the last part where it passed; predict the trial point of a stage where one begins (TR-BDF2)."""
    coefficients, later = trbdf2.formula(control.h, motion.memory[STAGED_STEP]), control.stage > 0
    at_second = begins & later
    for i in range(motion.q.shape[0]):
        q, v, a = motion.q[i], motion.v[i], motion.a[i]
        last = retain(passed, q, motion.q0[i]), retain(passed, v, motion.v0[i]), retain(passed, a, motion.a0[i])
        motion.q0[i], motion.v0[i], motion.a0[i] = last
        first = trbdf2.first(coefficients, last, motion.aux[i])
        second = trbdf2.second(coefficients, last, (q, v, a))
        motion.v1[i], motion.aux[i] = retain(at_second, v, motion.v1[i]), retain(at_second, a, motion.aux[i])
        motion.q[i] = retain(begins, where(later, second[0], first[0]), q)
        motion.v[i] = retain(begins, where(later, second[1], first[1]), v)
        motion.a[i] = retain(begins, where(later, second[2], first[2]), a)
    control.cv = where(begins, coefficients[0], control.cv)
    control.ca = where(begins, coefficients[0] * coefficients[0], control.ca)


@njit
def begin_angles(begins, passed, motion, control):
    """Accept the last angle where it passed; predict the trial point of the next one where one begins."""
    keep(passed, motion)
    extrapolate(begins, control.steps, motion)
    for i in range(motion.q.shape[0]):
        motion.v[i], motion.a[i] = where(begins, 0.0, motion.v[i]), where(begins, 0.0, motion.a[i])
    control.cv, control.ca = where(begins, CV_STATIC, control.cv), where(begins, 0.0, control.ca)


@njit
def begin(options, motion, control):
    """Begin a step, a stage or an angle in the lanes that are to."""
    begins, passed = control.fresh > 0, control.passed > 0
    if options.fidelity == QUASISTATIC:
        begin_angles(begins, passed, motion, control)
    elif options.method == TR_BDF2:
        begin_parts(begins, passed, motion, control)
    else:
        begin_steps(begins, passed, motion, control)
    control.iteration = where(begins, 0.0, control.iteration)
    control.at_roundoff = where(begins, 0.0, control.at_roundoff)
    control.fresh = control.passed = 0.0 * control.fresh


@njit
def scaled_size(motion):
    """Largest weighted residual; NaN if any residual is NaN."""
    size = total = 0.0
    for i in range(motion.q.shape[0]):
        weighted = abs(motion.residual[i]) * motion.weight[i]
        size, total = max(size, weighted), total + weighted
    return where(total == total, size, total)  # the sum detects NaN; a NaN-safe maximum is slower


@njit
def classify_lanes(options, par, motion, control):
    """Classify the lanes by their residuals.

    Returns
    -------
    solved, failed, stale, moving : masks
        Lanes whose trial point is solved; has failed; needs a new tangent; is to be corrected with the tangent in use.
    last : mask
        Lanes of `moving` that one correction solves, without another residual.
    now : lane
        Scaled size of the residuals.
    """
    now = scaled_size(motion)
    finite, live, checked = now < 1e300, control.live > 0, control.phase == CHECK
    small = (now <= options.newton_tol) | ((control.at_roundoff > 0) & finite)
    solved = live & ((checked & (now < ENOUGH)) | (~checked & small))
    failed = live & ~solved & (checked | ~finite | (control.iteration == options.newton_max_iter))
    going = live & ~solved & ~failed
    slow = (control.iteration > 0) & (now > SLOW * control.before)
    old = (control.iteration == 0) & (abs(par.omega) * (control.t - control.t_tangent) > OLD)
    stale = going & ((control.factorised != control.cv) | slow | old)
    control.before = where(going & ~stale, now, control.before)
    moving = going & ~stale
    return solved, failed, stale, moving, moving & (now <= motion.memory[LAST_ITERATION_BELOW]), now


@njit
def keep_tangent(mask, new, old):
    """Copy a factorised tangent in the lanes of the mask, from `new`, a record of WORK, to `old`, one of FACTORS."""
    lumps = new.edge.shape[1]
    for b in range(new.block.shape[0]):
        for i in range(6):
            for j in range(i if b < lumps else 0, 6):
                old.block[b, i, j] = retain(mask, new.block[b, i, j], old.block[b, i, j])
    border = new.corner.shape[0]
    for unknown in range(border):
        for lump in range(lumps):
            for i in range(6):
                old.edge[unknown, lump, i] = retain(mask, new.edge[unknown, lump, i], old.edge[unknown, lump, i])
        for other in range(unknown, border):
            old.corner[unknown, other] = retain(mask, new.corner[unknown, other], old.corner[unknown, other])


@njit
def refactorise(mask, control, par, work, tangent):
    """Compute new tangents in the lanes of the mask; return where, of all lanes, the factorisation succeeded."""
    static = control.cv == CV_STATIC
    cv, ca = where(static, CV_REGULAR, control.cv), where(control.ca > 0, control.ca, CA_REGULAR)
    assemble(cv, ca, where(static, 0.0, control.cv), par, work)
    good = factorise(par, work)
    keep_tangent(mask, work, tangent)
    control.factorised = where(mask, control.cv, control.factorised)
    control.t_tangent = where(mask, control.t, control.t_tangent)
    control.factorisations = where(mask, control.factorisations + 1, control.factorisations)
    return good


@njit
def correct(moving, solved, par, tangent, motion, control):
    """Apply Newton's correction in the lanes of `moving`; return in which of them an equilibrium has diverged.

    The lanes of `solved` that have a tangent are corrected, too, without being evaluated again: the prediction of the
    next steps multiplies what is left of the residual by up to 15. Their loads stay those of the last evaluation.
    """
    mask = moving | (solved & (control.factorised == control.cv) & (control.phase >= STEP))
    for i in range(motion.q.shape[0]):
        tangent.solution[i] = -motion.residual[i]
    solve(motion.q, par, tangent)
    step = largest = 0.0 * control.cv
    for i in range(motion.q.shape[0]):
        change = where(mask, tangent.solution[i], 0.0)
        motion.q[i] = retain(mask, motion.q[i] + change, motion.q[i])
        motion.v[i] = retain(mask, motion.v[i] + control.cv * change, motion.v[i])
        motion.a[i] = retain(mask, motion.a[i] + control.ca * change, motion.a[i])
        step, largest = max(step, abs(change)), max(largest, abs(motion.q[i]))
    lost = moving & (control.cv == CV_STATIC) & (largest > FAR)
    control.at_roundoff = where(moving & (step <= ROUNDOFF * largest), 1.0, 0.0)
    control.iteration = where(moving, control.iteration + 1, control.iteration)
    control.iterations = where(moving, control.iterations + 1, control.iterations)
    return lost
