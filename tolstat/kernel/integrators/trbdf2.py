"""TR-BDF2, a one-step method with an error estimate, applied to q' = v and v' = a.

A trapezoidal stage to t + gamma h and a BDF2 stage to t + h, gamma = 2 - sqrt(2), so that both stages have the same
coefficient d = gamma / 2: of order 2, L-stable (Bank et al. 1985). As a Runge-Kutta method its weights are (w, w, d),
w = sqrt(2) / 4; the embedded formula of order 3 has ((1 - w) / 3, (3 w + 1) / 3, d / 3) (Hosea, Shampine 1996).
"""

import math

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
def first(coefficients, last, staged):
    """Trial values (q, v, a) of an unknown in the first stage that satisfy its formula.

    `coefficients`: values returned by `formula`; `last`: (q, v, a) at the start; `staged`: acceleration at the first
    stage of the last step.
    """
    cv, (ahead, cubic, since), _ = coefficients
    q = last[0] + ahead * (last[1] + (0.5 * ahead * last[2] + cubic * (since * (last[2] - staged))))
    v = cv * (q - last[0]) - last[1]
    return q, v, cv * (v - last[1]) - last[2]


@njit
def second(coefficients, last, stage):
    """Trial values (q, v, a) in the second stage, as in `first`; `stage`: (q, v, a) of the first stage."""
    cv, _, (on, cubic, weight) = coefficients
    q = stage[0] + on * (stage[1] + (0.5 * on * stage[2] + cubic * (stage[2] - last[2])))
    v = cv * (q - last[0] - weight * (last[1] + stage[1]))
    return q, v, cv * (v - last[1] - weight * (last[2] + stage[2]))


@njit
def errors(i, h, motion):
    """Estimated errors of unknown `i` and of its velocity at the end of a step.

    ``motion.v1`` and ``motion.aux`` hold velocity and acceleration of the first stage.
    """
    error_q = h * (E0 * motion.v0[i] + E1 * motion.v1[i] + E2 * motion.v[i])
    error_v = h * (E0 * motion.a0[i] + E1 * motion.aux[i] + E2 * motion.a[i])
    return error_q, error_v
