"""Fixed-step implicit integration of second-order systems, with bounded halving inside a step.

`build_integrator` binds the equations of any system to one Newton iteration and one stepping scheme. A method is a file
with `predict`, which writes a trial point that satisfies the method's formulas and returns cv = dv/dq and ca = da/dq. A
method that keeps more than the last points also has a function that updates them when a stage or a step is accepted.

The output grid is kept. A step is halved, at most ``options.max_halvings`` times, if Newton's iteration fails or, with
error control, if the estimated error is above the tolerance; steps grow again by factors of two where the grid allows.
An unconverged point is never accepted.
"""

from tolstat.common.tables import Method
from tolstat.kernel.integrators import bdf2, generalized_alpha, quadrature, trbdf2
from tolstat.kernel.integrators.state import (
    AHEAD,
    ALLOWED,
    ATTEMPTS_LEFT,
    CV_FACTORISED,
    FACTORISATIONS,
    H_OLD,
    HALVINGS,
    ITERATIONS,
    LAST_ITERATION_BELOW,
    STAGED_STEP,
    STEPS,
    UNLIMITED,
)
from tolstat.kernel.simd.jit import njit, njit_inner
from tolstat.kernel.simd.lane import where

BDF2, GENERALIZED_ALPHA, TR_BDF2 = int(Method.BDF2), int(Method.GENERALIZED_ALPHA), int(Method.TR_BDF2)
SLOW = 0.2
"""Ratio of successive residuals above which the tangent is renewed, and the iteration has stalled."""
ROUNDOFF = 10 * 2.0**-52
NO, IF_STALLED, YES, LOST = range(4)
"""Does a change end Newton's iteration: no; if the residual stalls; yes; yes, as a failure."""
ERROR_TO_GROW = 0.1
"""Estimated error, in units of the tolerance, below which a step may be doubled."""
MAX_RATIO = 2.0
"""Largest ratio of a step to the one before, for the stability of BDF2 and with error control."""
START_LEVEL = 4
"""Level of the first sub-step of BDF2 in general, 1/2^4 of the step: without earlier points it is implicit Euler."""

bdf2_predict = bdf2.predict
alpha_predict, alpha_accept = generalized_alpha.predict, generalized_alpha.accept
tr_predict, keep_stage, embedded_error = trbdf2.predict, trbdf2.keep_stage, trbdf2.error
quadrature_error = quadrature.error


@njit
def stages(options):
    """Number of stages of the method in use."""
    return trbdf2.STAGES if options.method == TR_BDF2 else 1


@njit
def predict(h, stage, state, options):
    """Write the trial point of a step `h` (s); return cv, ca and the share of the step at the end of the stage."""
    if options.method == TR_BDF2:
        if stage > 0:
            keep_stage(state)
        cv, ca = tr_predict(h, stage, state, options)
        return cv, ca, (trbdf2.GAMMA if stage == 0 else 1.0)
    if options.method == BDF2:
        cv, ca = bdf2_predict(h, state, options)
    else:
        cv, ca = alpha_predict(h, state, options)
    return cv, ca, 1.0


@njit
def accept(h, state, options):
    """Make the trial point the last accepted one."""
    if options.method == GENERALIZED_ALPHA:
        alpha_accept(h, state, options)
    for i in range(state.q.size):
        state.q1[i], state.v1[i], state.a1[i] = state.q0[i], state.v0[i], state.a0[i]
        state.q0[i], state.v0[i], state.a0[i] = state.q[i], state.v[i], state.a[i]
    state.memory[H_OLD], state.memory[AHEAD] = h, 0.0
    state.memory[STAGED_STEP] = h if options.method == TR_BDF2 else 0.0
    state.counters[STEPS] += 1


@njit
def admissible_level(level, h, h_old, options):
    """Smallest level, from `level` on, with a sub-step h / 2^level of at most `MAX_RATIO` times the last, `h_old`."""
    while level < options.max_halvings and h_old > 0 and h / (1 << level) > 1.0001 * MAX_RATIO * h_old:
        level += 1
    return level


@njit
def next_substep_level(level, done, whole, error):
    """Level of the next sub-step: lower where the grid allows a longer one and its predicted error is accepted.

    `done` of `whole` parts of the step are complete; `error`: of the last sub-step, in units of the tolerance.
    """
    while level > 0 and done % (whole >> (level - 1)) == 0 and error < ERROR_TO_GROW:
        level -= 1
        error *= 8
    return level


@njit
def reset(state):
    """Clear memory and counters; keep only the last accepted point and the number of iterations allowed."""
    state.memory[:] = 0.0
    state.counters[:ALLOWED] = 0
    state.counters[ATTEMPTS_LEFT] = UNLIMITED
    for i in range(state.q.size):
        state.q1[i], state.v1[i], state.a1[i] = state.q0[i], state.v0[i], state.a0[i]
        state.aux[i] = state.a0[i]


@njit
def estimate(h, state, options):
    """Estimated error of the step in units of the tolerance; 0 without error control."""
    if options.rtol <= 0:
        return 0.0
    if options.method == TR_BDF2:
        return embedded_error(h, state, options)
    return quadrature_error(h, state, options)


@njit
def scaled_size(cv, ca, state):
    """Largest weighted residual; NaN if any residual is NaN."""
    size = total = 0.0
    for i in range(state.q.size):
        one = abs(state.residual[i]) * state.weight[i]
        size, total = max(size, one), total + one
    return where(total == total, size, total)  # the sum detects NaN; a NaN-safe maximum is slower


@njit
def at_rounding(cv, ca, fresh, options, work, state):
    """`YES` if the last change of the unknowns is no more than their rounding, else `NO`; see `build_integrator`."""
    step = largest = 0.0
    for i in range(state.q.size):
        step, largest = max(step, abs(work.solution[i])), max(largest, abs(state.q[i]))
    return YES if step <= ROUNDOFF * largest else NO


def build_newton(residual, factorise, solve, size=scaled_size, small=at_rounding):
    """Bind a system to Newton's iteration.

    `residual`, `factorise`, `solve`, `size`, `small` and the returned function are those of `build_integrator`.
    """

    @njit_inner
    def newton(t, cv, ca, par, options, work, state):
        q, v, a = state.q, state.v, state.a
        before = 0.0
        negligible = NO
        for iteration in range(options.newton_max_iter + 1):
            residual(t, q, v, a, par, options, work, state.residual)
            now = size(cv, ca, state)
            if now <= options.newton_tol or (negligible == YES and now < 1e300):
                return True
            if negligible == IF_STALLED and SLOW * before < now <= before / SLOW:
                return True
            if not now < 1e300 or iteration == options.newton_max_iter:
                break
            if state.counters[ITERATIONS] >= state.counters[ALLOWED]:
                break
            fresh = state.memory[CV_FACTORISED] != cv or (iteration > 0 and now > SLOW * before)
            last = now <= state.memory[LAST_ITERATION_BELOW] and not fresh
            if fresh:
                state.memory[CV_FACTORISED] = cv
                state.counters[FACTORISATIONS] += 1
                if not factorise(t, q, v, a, cv, ca, par, options, work):
                    break
            before = now
            for i in range(q.size):
                work.solution[i] = -state.residual[i]
            solve(q, work)
            state.counters[ITERATIONS] += 1
            for i in range(q.size):
                change = work.solution[i]
                q[i] += change
                v[i] += cv * change
                a[i] += ca * change
            negligible = small(cv, ca, fresh, options, work, state)
            if negligible == LOST:
                break
            if last:
                return True
        state.memory[CV_FACTORISED] = 0.0
        return False

    return newton


def build_advance(newton, start_level=0):
    """Bind Newton's iteration for a system to the stepping scheme.

    `start_level`: level of BDF2's first sub-step. Joints take the first step as a whole: that damps what their start
    leaves behind, and is forgotten before their loads count.

    Returns
    -------
    advance : jitted function (t, h, par, options, work, state) -> bool
        Take one step of the output grid; False when the smallest sub-step failed, or no attempt is left.
    """

    @njit_inner
    def attempt(t, h, par, options, work, state):
        for stage in range(stages(options)):
            cv, ca, share = predict(h, stage, state, options)
            if not newton(t + share * h, cv, ca, par, options, work, state):
                return False, 0.0
        error = estimate(h, state, options)
        return error <= 1, error

    @njit_inner
    def advance(t, h, par, options, work, state):
        whole = 1 << options.max_halvings  # progress is counted in sub-steps of the smallest size
        done = level = 0
        if options.method == BDF2 and state.memory[H_OLD] == 0:
            level = min(start_level, options.max_halvings)
        while done < whole:
            if options.method == BDF2 or options.rtol > 0:
                level = admissible_level(level, h, state.memory[H_OLD], options)
            if state.counters[ATTEMPTS_LEFT] <= 0:
                return False
            state.counters[ATTEMPTS_LEFT] -= 1
            part = h / (1 << level)
            good, error = attempt(t + h * (done / whole), part, par, options, work, state)
            if good:
                accept(part, state, options)
                done += whole >> level
                level = next_substep_level(level, done, whole, error)
            else:
                level += 1
                state.memory[AHEAD] = state.memory[STAGED_STEP] = 0.0
                state.counters[HALVINGS] += 1
                if level > options.max_halvings:
                    return False
        return True

    return advance


def build_integrator(residual, factorise, solve, size=scaled_size, small=at_rounding):
    """Bind the equations of a system to Newton's iteration and the stepping scheme.

    Parameters
    ----------
    residual : jitted function (t, q, v, a, par, options, work, out) -> None
        Residual of the equations of motion.
    factorise : jitted function (t, q, v, a, cv, ca, par, options, work) -> bool
        Assembles and factorises d(residual)/dq + cv d/dv + ca d/da at the point last evaluated; False when singular.
    solve : jitted function (q, work) -> None
        Solves for ``work.solution`` in place.
    size : jitted function (cv, ca, state) -> float
        Norm of ``state.residual`` that is compared with ``options.newton_tol``.
    small : jitted function (cv, ca, fresh, options, work, state) -> int
        Whether the last change, ``work.solution``, ends the iteration: `NO`; `YES`, converged; `IF_STALLED`, converged
        only if the residual does not fall; `LOST`, failed. `fresh`: the change was made with a new tangent.

    Returns
    -------
    newton : jitted function (t, cv, ca, par, options, work, state) -> bool
        Solves for the trial point; True when converged.
    advance : jitted function (t, h, par, options, work, state) -> bool
        Take one step of the output grid; False when the smallest sub-step failed, or no attempt is left.
    """
    newton = build_newton(residual, factorise, solve, size, small)
    return newton, build_advance(newton, START_LEVEL)
