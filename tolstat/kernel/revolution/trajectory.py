"""Trajectories of one joint: over a given number of steps, with every state recorded; loads along a given one."""

import math

from tolstat.kernel.integrators import integrate
from tolstat.kernel.mechanics import dynamics
from tolstat.kernel.mechanics.scale import set_weight, typical_force
from tolstat.kernel.mechanics.topology import N_DOF
from tolstat.kernel.revolution.settle import record
from tolstat.kernel.revolution.simulate import (
    NEWTON_FAILED,
    OK,
    OUTSIDE_MODEL,
    RAMP,
    advance,
    equilibrium,
    inside_model,
)
from tolstat.kernel.simd.jit import njit

residual, acceleration, reset = dynamics.residual, dynamics.acceleration, integrate.reset


@njit
def follow(par, options, work, state, points):
    """Integrate a joint on the output grid; return a status.

    Parameters
    ----------
    par : record of PARAM
        The joint.
    options : Options
        Numerical settings; whether the joint settles is not checked.
    work, state : record of WORK, State
        Scratch.
    points : ndarray, shape (steps + 1, 3, 55)
        Written: q, v, a (m, rad, s) of every grid point that was reached.
    """
    if not inside_model(par):
        return OUTSIDE_MODEL
    set_weight(typical_force(par), par, state.weight)
    state.q0[:] = 0.0
    state.v0[:] = 0.0
    state.a0[:] = 0.0
    reset(state)
    if options.start == RAMP:
        acceleration(0.0, state.q0, state.v0, par, options, work, state.a0)
    else:
        equilibrium(0.0, par, options, work, state)
    reset(state)
    h = 2 * math.pi / (abs(par.omega) * options.steps_per_rev)
    for k in range(points.shape[0]):
        if k > 0 and not advance((k - 1) * h, h, par, options, work, state):
            return NEWTON_FAILED
        for i in range(state.q0.size):
            points[k, 0, i], points[k, 1, i], points[k, 2, i] = state.q0[i], state.v0[i], state.a0[i]
    return OK


@njit
def sample(times, states, par, work, samples):
    """Record the loads along a solution.

    Parameters
    ----------
    times, states : ndarray, shapes (m,) and (m, 112)
        The solution, s; m and rad, per s.
    par, work : records of PARAM and WORK
        The joint; scratch.
    samples : ndarray of SAMPLE, shape (m,)
        Written.
    """
    for k in range(times.size):
        dynamics.forces(times[k], states[k, :N_DOF], states[k, N_DOF:], par, work)
        record(k, 0, par, work, states[k, N_DOF:], samples)
