"""Fixed-step implicit integration of second-order systems, with bounded halving inside a step.

`build_integrator` binds the equations of any system to one Newton iteration and one stepping scheme. A method is a file
with `predict` (write a trial point that obeys the method's formulas, return how velocity and acceleration follow the
unknowns) and, where it remembers more than the last points, what it does when a stage or a step is accepted.

The output grid is kept: a step that Newton cannot solve, or whose estimated error is above the tolerance where the
method has an estimate, is halved, at most ``options.max_halvings`` times; steps grow again by factors of two where the
grid allows. An unconverged point is never accepted.
"""

from tolstat.kernel import bdf2, generalized_alpha, trbdf2
from tolstat.kernel._jit import closure, njit
from tolstat.kernel.state import CV_FACTORISED, FACTORISATIONS, H_OLD, HALVINGS, ITERATIONS, STEPS
from tolstat.tables import Method

BDF2, GENERALIZED_ALPHA, TR_BDF2 = int(Method.BDF2), int(Method.GENERALIZED_ALPHA), int(Method.TR_BDF2)
SLOW = 0.2
"""Contraction per iteration above which the tangent is renewed."""
ROUNDOFF = 10 * 2.0**-52
ERROR_TO_GROW = 0.1
"""Estimated error, in units of the tolerance, below which a step may be doubled."""
MAX_RATIO = 2.0
"""Largest ratio of a step to the one before, for BDF2's stability and where the error is controlled."""
START_LEVEL = 4
"""BDF2 has no past at its first step, which is implicit Euler over 1/16 of the step."""

bdf2_predict = bdf2.predict
alpha_predict, alpha_accept = generalized_alpha.predict, generalized_alpha.accept
tr_predict, keep_stage, estimate = trbdf2.predict, trbdf2.keep_stage, trbdf2.error


@njit
def stages(options):
    """Number of stages of the method in use."""
    return trbdf2.STAGES if options.method == TR_BDF2 else 1


@njit
def predict(h, stage, state, options):
    """Trial point of the method in use; returns cv, ca and the share of the step that the stage reaches."""
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
        state.q1[i], state.v1[i] = state.q0[i], state.v0[i]
        state.q0[i], state.v0[i], state.a0[i] = state.q[i], state.v[i], state.a[i]
    state.memory[H_OLD] = h
    state.counters[STEPS] += 1


@njit
def reset(state):
    """Forget everything but the last accepted point."""
    state.memory[:] = 0.0
    state.counters[:] = 0
    for i in range(state.q.size):
        state.q1[i], state.v1[i], state.aux[i] = state.q0[i], state.v0[i], state.a0[i]


@njit
def scaled_size(cv, ca, state):
    """Largest residual in units of its scale."""
    size = 0.0
    for i in range(state.q.size):
        # written so that a NaN is kept
        ratio = abs(state.residual[i]) / state.scale[i]
        if not ratio <= size:
            size = ratio
    return size


def build_newton(residual, factorise, solve, size=scaled_size):
    """Bind a system to Newton's iteration; arguments and the function returned as in `build_integrator`."""

    @closure
    def newton(t, cv, ca, par, options, work, state):
        q, v, a = state.q, state.v, state.a
        before = 0.0
        at_roundoff = False
        for iteration in range(options.newton_max_iter + 1):
            residual(t, q, v, a, par, options, work, state.residual)
            now = size(cv, ca, state)
            if now <= options.newton_tol or (at_roundoff and now < 1e300):
                return True
            if not now < 1e300 or iteration == options.newton_max_iter:
                break
            if state.memory[CV_FACTORISED] != cv or (iteration > 0 and now > SLOW * before):
                state.memory[CV_FACTORISED] = cv
                state.counters[FACTORISATIONS] += 1
                if not factorise(t, q, v, a, cv, ca, par, options, work):
                    break
            before = now
            for i in range(q.size):
                work.solution[i] = -state.residual[i]
            solve(q, work)
            state.counters[ITERATIONS] += 1
            step = largest = 0.0
            for i in range(q.size):
                change = work.solution[i]
                q[i] += change
                v[i] += cv * change
                a[i] += ca * change
                step, largest = max(step, abs(change)), max(largest, abs(q[i]))
            at_roundoff = step <= ROUNDOFF * largest
        state.memory[CV_FACTORISED] = 0.0
        return False

    return newton


def build_advance(newton):
    """Bind Newton's iteration for a system to the stepping scheme."""

    @closure
    def attempt(t, h, par, options, work, state):
        for stage in range(stages(options)):
            cv, ca, share = predict(h, stage, state, options)
            if not newton(t + share * h, cv, ca, par, options, work, state):
                return False, 0.0
        error = estimate(h, state, options) if options.method == TR_BDF2 and options.rtol > 0 else 0.0
        return error <= 1, error

    @closure
    def advance(t, h, par, options, work, state):
        whole = 1 << options.max_halvings  # the step is counted in parts of its smallest sub-step
        done = level = 0
        if options.method == BDF2 and state.memory[H_OLD] == 0:
            level = min(START_LEVEL, options.max_halvings)
        while done < whole:
            h_old = state.memory[H_OLD]
            if h_old > 0 and (options.method == BDF2 or options.rtol > 0):
                while level < options.max_halvings and h / (1 << level) > 1.0001 * MAX_RATIO * h_old:
                    level += 1
            part = h / (1 << level)
            good, error = attempt(t + h * (done / whole), part, par, options, work, state)
            if good:
                accept(part, state, options)
                done += whole >> level
                # a longer step where the grid allows it, and where it would not be refused for its error
                while level > 0 and done % (whole >> (level - 1)) == 0 and error < ERROR_TO_GROW:
                    level -= 1
                    error *= 8
            else:
                level += 1
                state.counters[HALVINGS] += 1
                if level > options.max_halvings:
                    return False
        return True

    return advance


def build_integrator(residual, factorise, solve, size=scaled_size):
    """Bind the equations of a system to Newton's iteration and the stepping scheme.

    Parameters
    ----------
    residual : jitted function (t, q, v, a, par, options, work, out) -> None
        Equations of motion, zero when met.
    factorise : jitted function (t, q, v, a, cv, ca, par, options, work) -> bool
        Makes and factorises d(residual)/dq + cv d/dv + ca d/da at the point last evaluated; False when singular.
    solve : jitted function (q, work) -> None
        Solves for ``work.solution`` in place.
    size : jitted function (cv, ca, state) -> float
        Norm of ``state.residual`` that is compared with ``options.newton_tol``.

    Returns
    -------
    newton : jitted function (t, cv, ca, par, options, work, state) -> bool
        Solves for the trial point; True when converged.
    advance : jitted function (t, h, par, options, work, state) -> bool
        One step of the output grid; False when it failed at the smallest sub-step.
    """
    newton = build_newton(residual, factorise, solve, size)
    return newton, build_advance(newton)
