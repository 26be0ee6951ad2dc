"""Trajectories of one joint, step by step with `stepping`, every state recorded."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tests.support.mechanisms import N_DOF
from tests.support.stepping import State, advance, make_state, reset
from tolstat.common.tables import Options, Start, Status
from tolstat.kernel.mechanics import dynamics
from tolstat.kernel.mechanics.scale import set_weight, typical_force
from tolstat.kernel.mechanics.work import make_work
from tolstat.kernel.revolution.outcome import inside_model
from tolstat.kernel.revolution.settle import grid_step
from tolstat.kernel.simd.jit import njit
from tolstat.solver import simulation


@njit
def march(par, options, work, state, points):
    """Take steps of the output grid; write q, v, a of each point reached to `points`, (steps + 1, 3, dof)."""
    h = grid_step(par, options)
    for k in range(points.shape[0]):
        if k > 0 and not advance((k - 1) * h, h, par, options, work, state):
            return False
        for i in range(state.q0.size):
            points[k, 0, i], points[k, 1, i], points[k, 2, i] = state.q0[i], state.v0[i], state.a0[i]
    return True


def follow(joint: NDArray[np.void], options: Options, steps: int) -> tuple[NDArray[np.float64], Status]:
    """Integrate a joint, (1,), from its start; states, shape (steps + 1, 3, dof), NaN where not reached, and status."""
    points, row = np.full((steps + 1, 3, N_DOF), np.nan), joint.view(np.recarray)[0]
    if not inside_model(row):
        return points, Status.OUTSIDE_MODEL
    state = begin(joint, options)
    return points, Status.OK if march(row, options, make_work(), state, points) else Status.NEWTON_FAILED


def begin(joint: NDArray[np.void], options: Options) -> State:
    """State of a joint, (1,), at its start."""
    row, state = joint.view(np.recarray)[0], make_state(N_DOF)
    set_weight(typical_force(row), row, state.weight)
    state.q0[:], state.v0[:], state.a0[:] = 0.0, 0.0, 0.0
    if options.start == Start.RAMP:
        dynamics.acceleration(0.0, state.q0, state.v0, row, options, make_work(), state.a0)
    else:
        state.q0[:] = simulation.equilibrium(joint, options)
    reset(state)
    return state
