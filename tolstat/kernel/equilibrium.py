"""Start of a joint: static equilibrium of the loaded joint at theta = 0, by pseudo-transient continuation.

Implicit Euler steps at fixed theta, each from rest, with a step that grows while Newton converges (Kelley, Keyes 1998):
while clearances close the inertia terms bound each step; once the contacts carry, the steps become Newton steps for
the equilibrium. Where there is none (no torque), the bound on steps ends it; the joint then starts from where it got.
"""

from tolstat.kernel._jit import closure
from tolstat.kernel.state import CV_FACTORISED

FIRST, LARGEST, SMALLEST = 1e-4, 1e-1, 1e-9
"""Pseudo-time steps, s."""
GROWTH, SHRINK = 3.0, 0.1
MAX_STEPS = 60
ENOUGH = 1e-4
"""Static residual, in units of its scale, at which the start is good enough."""


def build_equilibrium(residual, newton, size):
    """Bind the equations of a system; returns a jitted function (par, options, work, state) -> bool (converged)."""

    @closure
    def equilibrium(par, options, work, state):
        state.q0[:] = 0.0
        state.v0[:] = 0.0
        state.a0[:] = 0.0
        step = FIRST
        for _ in range(MAX_STEPS):
            state.q[:] = state.q0
            state.v[:] = 0.0
            state.a[:] = 0.0
            if newton(0.0, 1 / step, 1 / (step * step), par, options, work, state):
                state.q0[:] = state.q
                residual(0.0, state.q0, state.v0, state.a0, par, options, work, state.residual)
                if size(1.0, 1.0, state) < ENOUGH:
                    return True
                step = min(GROWTH * step, LARGEST)
            else:
                step *= SHRINK
                if step < SMALLEST:
                    break
        state.memory[CV_FACTORISED] = 0.0
        return False

    return equilibrium
