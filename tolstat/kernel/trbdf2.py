"""TR-BDF2, a one-step method with an error estimate, applied to q' = v and v' = a.

A trapezoidal stage to t + gamma h and a BDF2 stage to t + h, gamma = 2 - sqrt(2), so that both stages have the same
coefficient d = gamma / 2: of order 2, L-stable (Bank et al. 1985). As a Runge-Kutta method its weights are (w, w, d),
w = sqrt(2) / 4; the embedded formula of order 3 has ((1 - w) / 3, (3 w + 1) / 3, d / 3) (Hosea, Shampine 1996).
"""

import math

from tolstat.kernel._jit import njit
from tolstat.kernel.quadrature import relative

STAGES = 2
GAMMA = 2 - math.sqrt(2)
D = GAMMA / 2
W = math.sqrt(2) / 4
E0, E1, E2 = (1 - W) / 3 - W, (3 * W + 1) / 3 - W, D / 3 - D
"""Weights of the error estimate: embedded less advancing formula."""


@njit
def predict(h, stage, state, options):
    """Write a trial point that obeys the stage's formula; return cv = dv/dq and ca = da/dq.

    ``state.v1`` and ``state.aux`` hold velocity and acceleration of the first stage.
    """
    cv = 1 / (D * h)
    for i in range(state.q.size):
        if stage == 0:
            ahead = GAMMA * h
            state.q[i] = state.q0[i] + ahead * (state.v0[i] + 0.5 * ahead * state.a0[i])
            state.v[i] = cv * (state.q[i] - state.q0[i]) - state.v0[i]
            state.a[i] = cv * (state.v[i] - state.v0[i]) - state.a0[i]
        else:
            ahead = (1 - GAMMA) * h
            state.q[i] += ahead * (state.v[i] + 0.5 * ahead * state.a[i])
            state.v[i] = cv * (state.q[i] - state.q0[i] - h * W * (state.v0[i] + state.v1[i]))
            state.a[i] = cv * (state.v[i] - state.v0[i] - h * W * (state.a0[i] + state.aux[i]))
    return cv, cv * cv


@njit
def keep_stage(state):
    """Remember the first stage, which the second one starts from."""
    for i in range(state.q.size):
        state.v1[i], state.aux[i] = state.v[i], state.a[i]


@njit
def error(h, state, options):
    """Estimated error of q and v at the end of the step, in units of ``atol + rtol |y|``; the largest of all."""
    worst = 0.0
    for i in range(state.q.size):
        of_q = h * (E0 * state.v0[i] + E1 * state.v1[i] + E2 * state.v[i])
        of_v = h * (E0 * state.a0[i] + E1 * state.aux[i] + E2 * state.a[i])
        worst = max(worst, relative(i, h, of_q, of_v, state, options))
    return worst
