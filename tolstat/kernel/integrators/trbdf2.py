"""TR-BDF2, a one-step method with an error estimate, applied to q' = v and v' = a.

A trapezoidal stage to t + gamma h and a BDF2 stage to t + h, gamma = 2 - sqrt(2), so that both stages have the same
coefficient d = gamma / 2: of order 2, L-stable (Bank et al. 1985). As a Runge-Kutta method its weights are (w, w, d),
w = sqrt(2) / 4; the embedded formula of order 3 has ((1 - w) / 3, (3 w + 1) / 3, d / 3) (Hosea, Shampine 1996).
"""

import math

from tolstat.kernel.integrators.quadrature import relative
from tolstat.kernel.integrators.state import STAGED_STEP
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import where

STAGES = 2
GAMMA = 2 - math.sqrt(2)
D = GAMMA / 2
W = math.sqrt(2) / 4
E0, E1, E2 = (1 - W) / 3 - W, (3 * W + 1) / 3 - W, D / 3 - D
"""Weights of the error estimate: embedded formula minus advancing formula."""


@njit
def formula(h, staged):
    """Coefficients of the trial points of a step `h` (s); `staged`: the last step if its first stage is kept, else 0.

    Returns
    -------
    cv : float
        dv/dq of both stages.
    first : tuple
        Time g from the start to the first stage; g^2 / 6; 1 / time from the last step's first stage to the start.
    second : tuple
        Time k from the first to the second stage; k^2 / (6 g); weight of the derivatives at the start and first stage.
    """
    ahead, on = GAMMA * h, (1 - GAMMA) * h
    since = where(staged > 0, 1 / where(staged > 0, (1 - GAMMA) * staged, 1.0), 0.0)
    return 1 / (D * h), (ahead, ahead * ahead / 6, since), (on, on * on / (6 * ahead), h * W)


@njit
def first(of, last, staged):
    """Trial values (q, v, a) of an unknown in the first stage that satisfy its formula.

    `of`: values returned by `formula`; `last`: (q, v, a) at the start; `staged`: acceleration at the first stage of the
    last step.
    """
    cv, (ahead, cubic, since), _ = of
    q = last[0] + ahead * (last[1] + (0.5 * ahead * last[2] + cubic * (since * (last[2] - staged))))
    v = cv * (q - last[0]) - last[1]
    return q, v, cv * (v - last[1]) - last[2]


@njit
def second(of, last, stage):
    """Trial values (q, v, a) in the second stage, as in `first`; `stage`: (q, v, a) of the first stage."""
    cv, _, (on, cubic, weight) = of
    q = stage[0] + on * (stage[1] + (0.5 * on * stage[2] + cubic * (stage[2] - last[2])))
    v = cv * (q - last[0] - weight * (last[1] + stage[1]))
    return q, v, cv * (v - last[1] - weight * (last[2] + stage[2]))


@njit
def predict(h, stage, state, options):
    """Write a trial point that satisfies the formula of `stage` (0 or 1); return cv = dv/dq and ca = da/dq.

    ``state.v1`` and ``state.aux`` hold velocity and acceleration of the first stage.
    """
    of = formula(h, state.memory[STAGED_STEP])
    for i in range(state.q.size):
        last = state.q0[i], state.v0[i], state.a0[i]
        if stage == 0:
            state.q[i], state.v[i], state.a[i] = first(of, last, state.aux[i])
        else:
            state.q[i], state.v[i], state.a[i] = second(of, last, (state.q[i], state.v[i], state.a[i]))
    return of[0], of[0] * of[0]


@njit
def keep_stage(state):
    """Store velocity and acceleration of the first stage for the second one."""
    for i in range(state.q.size):
        state.v1[i], state.aux[i] = state.v[i], state.a[i]


@njit
def errors(i, h, state):
    """Estimated errors of unknown `i` and of its velocity at the end of the step."""
    of_q = h * (E0 * state.v0[i] + E1 * state.v1[i] + E2 * state.v[i])
    of_v = h * (E0 * state.a0[i] + E1 * state.aux[i] + E2 * state.a[i])
    return of_q, of_v


@njit
def error(h, state, options):
    """Estimated error of q and v at the end of the step, in units of ``atol + rtol |y|``; the largest of all."""
    worst = 0.0
    for i in range(state.q.size):
        of_q, of_v = errors(i, h, state)
        worst = max(worst, relative(i, h, of_q, of_v, state, options))
    return worst
