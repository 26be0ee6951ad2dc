"""Error of a step of any method of order 2, from quadrature of its own velocities and accelerations."""

from tolstat.kernel.integrators.state import H_OLD
from tolstat.kernel.simd.jit import njit

ROUNDING = 2.0**-49
"""Rounding of an unknown relative to its size, with what a step makes of it."""


@njit
def relative(i, h, of_q, of_v, state, options):
    """Error of unknown `i` and its velocity in units of ``atol + rtol |y|`` and the rounding of both, the larger one.

    A velocity is a difference of unknowns over the step: a shorter step cannot better what rounding makes of it.
    """
    rounding = ROUNDING * max(abs(state.q0[i]), abs(state.q[i]))
    size_q = options.atol + options.rtol * max(abs(state.q0[i]), abs(state.q[i])) + rounding
    size_v = options.atol + options.rtol * max(abs(state.v0[i]), abs(state.v[i])) + rounding / h
    return max(abs(of_q) / size_q, abs(of_v) / size_v)


@njit
def error(h, state, options):
    """Estimated error of q and v at the end of the step, in units of ``atol + rtol |y|``; the largest of all.

    What the step moved an unknown by, less Hermite's rule on its velocity and acceleration at both ends; what it moved
    a velocity by, less the integral of the parabola through the last three accelerations. Both rules are of a higher
    order than the step, so that the difference is the step's own error. A method with a memory counts what its past
    adds in this step too.
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
