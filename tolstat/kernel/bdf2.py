"""BDF2 with variable step, applied to q' = v and v' = a (Hairer, Wanner: Solving ODEs I, III.5).

At the new point (3 y_2 - 4 y_1 + y_0) / (2 h) stands for y', for equal steps; with r the ratio of the step to the one
before, ((1+2r)/(1+r) y_2 - (1+r) y_1 + r^2/(1+r) y_0) / h. Zero-stable for r < 1 + sqrt(2). The first step is implicit
Euler. Algebraic order 2, L-stable.
"""

from tolstat.kernel._jit import njit
from tolstat.kernel.state import H_OLD


@njit
def predict(h, state, options):
    """Write a trial point that obeys the formula; return cv = dv/dq and ca = da/dq."""
    h_old = state.memory[H_OLD]
    if h_old > 0:
        r = h / h_old
        c0, c1, c2 = (1 + 2 * r) / (1 + r), -(1 + r), r * r / (1 + r)
    else:
        c0, c1, c2 = 1.0, -1.0, 0.0
    cv = c0 / h
    for i in range(state.q.size):
        guess = state.q0[i] + h * (state.v0[i] + 0.5 * h * state.a0[i])
        state.q[i] = guess
        state.v[i] = cv * guess + (c1 * state.q0[i] + c2 * state.q1[i]) / h
        state.a[i] = cv * state.v[i] + (c1 * state.v0[i] + c2 * state.v1[i]) / h
    return cv, cv * cv
