"""Static equilibrium of the loaded joint at one input angle: Newton's iteration, or pseudo-transient continuation.

Newton's iteration starts from the pose in which all pins just touch, and needs some nine iterations for three joints of
four. The others take pseudo-transient continuation (Kelley, Keyes 1998): implicit Euler steps at fixed theta, each from
rest, with a step that grows while Newton converges. Until contacts carry, the inertia terms bound each step; then the
steps become Newton steps for the equilibrium. Where there is no equilibrium (no torque), the number of steps is
bounded, and the simulation continues from the last iterate.
"""

from tolstat.kernel.integrators.integrate import LOST, at_rounding
from tolstat.kernel.integrators.state import CV_FACTORISED
from tolstat.kernel.mechanics.vector import copy
from tolstat.kernel.simd.jit import njit, njit_inner

CV_STATIC = 1e-200
"""cv = dv/dq of an equilibrium: so small that rate terms vanish, but not zero, which would mean that no tangent is
stored."""
CV_REGULAR, CA_REGULAR = 10.0, 100.0
"""cv (1/s) and ca (1/s^2) in the tangent of an equilibrium, those of an implicit step of 0.1 s: damping and inertia
regularise directions without stiffness, and are a thousandth of the stiffness of a loaded contact. The residual
contains neither."""

FAR = 1.0
"""Size of an unknown, m or rad, above which Newton's iteration for an equilibrium has diverged."""

FIRST, LARGEST, SMALLEST = 3e-4, 1e-1, 1e-9
"""First, largest and smallest step of pseudo-time, s."""
GROWTH, SHRINK = 3.0, 0.3
"""Factors on the step of pseudo-time after a converged and after a failed step."""
MAX_STEPS = 60
ENOUGH = 1e-4
"""Scaled static residual below which pseudo-transient continuation ends: good enough as a start."""


@njit
def near(cv, ca, fresh, options, work, state):
    """Return `LOST` if an unknown exceeds `FAR`, else whether the last change ends Newton's iteration.

    Arguments and return value are those of `small` in `integrate.build_integrator`.
    """
    for i in range(state.q.size):
        if abs(state.q[i]) > FAR:
            return LOST
    return at_rounding(cv, ca, fresh, options, work, state)


def build_equilibrium(residual, newton, static_newton, size, guess):
    """Bind the equations of a system to the search for an equilibrium.

    Parameters
    ----------
    residual, size : jitted functions
        As in `integrate.build_integrator`.
    newton, static_newton : jitted functions
        As `integrate.build_newton` returns them, the second with the regularised tangent of an equilibrium.
    guess : jitted function (t, par, work, state) -> None
        Writes the initial guess to ``state.q0``.

    Returns
    -------
    hold, relax, equilibrium : jitted functions (t, par, options, work, state) -> bool
        Whether an equilibrium was found at the input angle of time `t`. `hold` corrects ``state.q`` by Newton's
        iteration. `relax` moves ``state.q0`` by pseudo-transient continuation. `equilibrium` writes ``state.q0``: by
        `hold` from the guess, else by `relax` from the guess, else by `relax` from zero.
    """

    @njit_inner
    def hold(t, par, options, work, state):
        state.v[:] = 0.0
        state.a[:] = 0.0
        return static_newton(t, CV_STATIC, 0.0, par, options, work, state)

    @njit_inner
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

    @njit_inner
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
