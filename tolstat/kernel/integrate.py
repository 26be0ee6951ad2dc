"""Fixed-step implicit integration of second-order systems, with bounded halving inside a step.

`build_integrator` binds the equations of any system to one Newton iteration and one stepping scheme. A method is a file
with `predict` (write a trial point that obeys the method's formulas, return how velocity and acceleration follow the
unknowns) and `accept` (remember what the next step needs).

The output grid is kept: a step that Newton cannot solve is halved, at most ``options.max_halvings`` times; steps grow
again by factors of two where the grid allows. An unconverged point is never accepted.
"""

from tolstat.kernel import bdf2, generalized_alpha
from tolstat.kernel._jit import closure, njit
from tolstat.kernel.state import CV_FACTORISED, FACTORISATIONS, H_OLD, HALVINGS, ITERATIONS, STEPS
from tolstat.tables import Method

BDF2 = int(Method.BDF2)
SLOW = 0.2
"""Contraction per iteration above which the tangent is renewed."""
ROUNDOFF = 10 * 2.0**-52
START_LEVEL = 4
"""BDF2 has no past at its first step, which is implicit Euler over 1/16 of the step."""

bdf2_predict, bdf2_accept = bdf2.predict, bdf2.accept
alpha_predict, alpha_accept = generalized_alpha.predict, generalized_alpha.accept


@njit
def predict(h, state, options):
    """Trial point of the method in use."""
    if options.method == BDF2:
        return bdf2_predict(h, state, options)
    return alpha_predict(h, state, options)


@njit
def accept(h, state, options):
    """Make the trial point the last accepted one."""
    if options.method != BDF2:
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

    @closure
    def advance(t, h, par, options, work, state):
        whole = 1 << options.max_halvings  # the step is counted in parts of its smallest sub-step
        done = level = 0
        if options.method == BDF2 and state.memory[H_OLD] == 0:
            level = min(START_LEVEL, options.max_halvings)
        while done < whole:
            h_old = state.memory[H_OLD]
            if options.method == BDF2 and h_old > 0:
                while level < options.max_halvings and h / (1 << level) > 1.0001 * bdf2.MAX_RATIO * h_old:
                    level += 1
            part = h / (1 << level)
            cv, ca = predict(part, state, options)
            if newton(t + h * (done / whole) + part, cv, ca, par, options, work, state):
                accept(part, state, options)
                done += whole >> level
                while level > 0 and done % (whole >> (level - 1)) == 0:
                    level -= 1
            else:
                level += 1
                state.counters[HALVINGS] += 1
                if level > options.max_halvings:
                    return False
        return True

    return newton, advance
