"""BDF2 with variable step, applied to q' = v and v' = a (Hairer, Wanner: Solving ODEs I, III.5); the trapezoidal rule.

At the new point (3 y_2 - 4 y_1 + y_0) / (2 h) approximates y', for equal steps; with r the ratio of the step to the one
before, ((1+2r)/(1+r) y_2 - (1+r) y_1 + r^2/(1+r) y_0) / h. Zero-stable for r < 1 + sqrt(2). The first step is implicit
Euler, without inertia if it leaves an equilibrium (`lanes.course`). Algebraic order 2, L-stable. The trapezoidal rule,
y_1' = 2 (y_1 - y_0) / h - y_0', damps nothing: a closer look at ringing takes it, a few steps long.
"""

from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import where


@njit
def formula(h, h_old, trapezoidal):
    """Formula of a step `h` (s) after one of `h_old` (s).

    Returns
    -------
    cv : float
        dv/dq, 1/s.
    b1, b2 : float
        Weights of the last two points in a derivative, 1/s.
    b3 : float
        Weight of the last derivative.
    """
    r = where(h_old > 0, h / h_old, 0.0)
    rule = trapezoidal > 0
    cv, b1 = where(rule, 2 / h, (1 + 2 * r) / (1 + r) / h), where(rule, -2 / h, -(1 + r) / h)
    return cv, b1, where(rule, 0.0, r * r / (1 + r) / h), where(rule, -1.0, 0.0)


@njit
def trial(h, coefficients, last, before, known, ahead):
    """Trial values (q, v, a) of an unknown that satisfy the formula.

    Parameters
    ----------
    h : float
        Step, s.
    coefficients : tuple
        Values returned by `formula`.
    last, before : tuple
        (q, v, a) of the last accepted point, (q, v) of the one before.
    known, ahead : bool, float
        Whether q is predicted by its expected change `ahead`, or else by a Taylor series.
    """
    cv, b1, b2, b3 = coefficients
    q = last[0] + where(known, ahead, h * (last[1] + 0.5 * h * last[2]))
    v = cv * q + (b1 * last[0] + b2 * before[0]) + b3 * last[1]
    return q, v, cv * v + (b1 * last[1] + b2 * before[1]) + b3 * last[2]
