"""BDF2 with variable step, applied to q' = v and v' = a (Hairer, Wanner: Solving ODEs I, III.5).

At the new point (3 y_2 - 4 y_1 + y_0) / (2 h) stands for y', for equal steps; with r the ratio of the step to the one
before, ((1+2r)/(1+r) y_2 - (1+r) y_1 + r^2/(1+r) y_0) / h. Zero-stable for r < 1 + sqrt(2). The first step is implicit
Euler. Algebraic order 2, L-stable.
"""

from tolstat.kernel._jit import njit
from tolstat.kernel.lane import where
from tolstat.kernel.state import AHEAD, H_OLD


@njit
def predict(h, begins, state, options):
    """Write a trial point that obeys the formula, in lanes that begin a step; return cv = dv/dq and ca = da/dq."""
    h_old = state.memory[H_OLD]
    r = where(h_old > 0, h / h_old, 0.0)
    cv, b1, b2 = (1 + 2 * r) / (1 + r) / h, -(1 + r) / h, r * r / (1 + r) / h
    known = state.memory[AHEAD] > 0
    for i in range(state.q.size):
        change = where(known, state.ahead[i], h * (state.v0[i] + 0.5 * h * state.a0[i]))
        guess = state.q0[i] + change
        v = cv * guess + (b1 * state.q0[i] + b2 * state.q1[i])
        state.q[i] = where(begins, guess, state.q[i])
        state.v[i] = where(begins, v, state.v[i])
        state.a[i] = where(begins, cv * v + (b1 * state.v0[i] + b2 * state.v1[i]), state.a[i])
    return cv, cv * cv
