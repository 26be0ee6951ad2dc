"""Error estimate for a step of any method of order 2, from quadrature of its velocities and accelerations."""

from tolstat.kernel.integrators.state import H_OLD
from tolstat.kernel.simd.jit import njit

ROUNDING = 2.0**-49
"""Rounding error of an unknown relative to its size, including that of the operations of a step."""


@njit
def relative(i, h, of_q, of_v, state, options):
    """Larger one of the errors of unknown `i` and its velocity, in units of ``atol + rtol |y|`` plus rounding.

    A velocity is a difference of unknowns divided by `h` (s), so its rounding error grows as the step gets shorter.
    `of_q`, `of_v`: the two errors.
    """
    rounding = ROUNDING * max(abs(state.q0[i]), abs(state.q[i]))
    size_q = options.atol + options.rtol * max(abs(state.q0[i]), abs(state.q[i])) + rounding
    size_v = options.atol + options.rtol * max(abs(state.v0[i]), abs(state.v[i])) + rounding / h
    return max(abs(of_q) / size_q, abs(of_v) / size_v)


@njit
def error(h, state, options):
    """Estimated error of q and v at the end of the step, in units of ``atol + rtol |y|``; the largest of all.

    For an unknown: its increment minus Hermite's rule on its velocity and acceleration at both ends. For a velocity:
    its increment minus the integral of the parabola through the last three accelerations. Both rules are of a higher
    order than the method, so that the difference estimates the error of the step. For a method with memory it includes
    what earlier points contribute to this step.
    """
    h_old = state.memory[H_OLD]
    worst = 0.0
    for i in range(state.q.size):
        bend = 0.0  # second divided difference of the acceleration
        if h_old > 0:
            bend = ((state.a[i] - state.a0[i]) / h - (state.a0[i] - state.a1[i]) / h_old) / (h + h_old)
        by_rule = 0.5 * h * (state.v0[i] + state.v[i]) - h * h / 12 * (state.a[i] - state.a0[i])
        of_q = state.q[i] - state.q0[i] - by_rule
        of_v = state.v[i] - state.v0[i] - 0.5 * h * (state.a0[i] + state.a[i]) + h * h * h / 6 * bend
        worst = max(worst, relative(i, h, of_q, of_v, state, options))
    return worst
