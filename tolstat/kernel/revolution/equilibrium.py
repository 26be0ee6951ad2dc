"""Static equilibrium of the loaded joint at one input angle: Newton's iteration, or pseudo-transient continuation.

From bodies that stand where all pins just touch, three joints of four need some nine iterations. The others take
implicit Euler steps at fixed theta, each from rest, with a step that grows while Newton converges (Kelley, Keyes 1998):
while contacts find each other the inertia terms bound each step; once they carry, the steps become Newton steps for the
equilibrium. Where there is none (no torque), the bound on steps ends it; what follows starts from where it got.
"""

from tolstat.kernel.integrators.integrate import LOST, at_rounding
from tolstat.kernel.integrators.state import CV_FACTORISED
from tolstat.kernel.mechanics.vector import copy
from tolstat.kernel.simd.jit import closure, njit

HELD = 1e-200
"""cv = dv/dq of an equilibrium: nothing to a force, but not the zero that stands for no tangent."""
CV_REGULAR, CA_REGULAR = 10.0, 100.0
"""cv (1/s) and ca (1/s^2) in the tangent of an equilibrium, as of an implicit step of 0.1 s: damping and inertia hold a
direction that nothing else holds, and are a thousandth of what a loaded contact has. The residual has neither."""

FAR = 1.0
"""Size of an unknown, m or rad, beyond which no equilibrium is looked for: Newton's iteration has left the joint."""

FIRST, LARGEST, SMALLEST = 3e-4, 1e-1, 1e-9
"""Pseudo-time steps, s."""
GROWTH, SHRINK = 3.0, 0.3
MAX_STEPS = 60
ENOUGH = 1e-4
"""Static residual, in units of its scale, at which the start is good enough."""


@njit
def near(cv, ca, fresh, options, work, state):
    """Whether the last change ends Newton's iteration for an equilibrium, as `integrate.at_rounding`, or it is lost."""
    for i in range(state.q.size):
        if abs(state.q[i]) > FAR:
            return LOST
    return at_rounding(cv, ca, fresh, options, work, state)


def build_equilibrium(residual, newton, static_newton, size, guess):
    """Bind the equations of a system.

    Parameters
    ----------
    residual, size : jitted functions
        As in `integrate.build_integrator`.
    newton, static_newton : jitted functions
        As `integrate.build_newton` makes them, the second with the regularised tangent of an equilibrium.
    guess : jitted function (t, par, work, state) -> None
        Writes where to look first to ``state.q0``.

    Returns
    -------
    hold, relax, equilibrium : jitted functions (t, par, options, work, state) -> bool
        Whether there is an equilibrium at the angle of time `t`: ``state.q`` when corrected from there by Newton's
        iteration; ``state.q0`` when reached from there in pseudo-time; ``state.q0`` by way of the guess.
    """

    @closure
    def hold(t, par, options, work, state):
        state.v[:] = 0.0
        state.a[:] = 0.0
        return static_newton(t, HELD, 0.0, par, options, work, state)

    @closure
    def relax(t, par, options, work, state):
        state.v0[:] = 0.0
        state.a0[:] = 0.0
        step = FIRST
        for _ in range(MAX_STEPS):
            copy(state.q0, state.q)
            state.v[:] = 0.0
            state.a[:] = 0.0
            if newton(t, 1 / step, 1 / (step * step), par, options, work, state):
                copy(state.q, state.q0)
                residual(t, state.q0, state.v0, state.a0, par, options, work, state.residual)
                if size(1.0, 1.0, state) < ENOUGH:
                    return True
                step = min(GROWTH * step, LARGEST)
            else:
                step *= SHRINK
                if step < SMALLEST:
                    break
        state.memory[CV_FACTORISED] = 0.0
        return False

    @closure
    def equilibrium(t, par, options, work, state):
        guess(t, par, work, state)
        copy(state.q0, state.q)
        if hold(t, par, options, work, state):
            copy(state.q, state.q0)
            return True
        if relax(t, par, options, work, state):
            return True
        state.q0[:] = 0.0
        return relax(t, par, options, work, state)

    return hold, relax, equilibrium
