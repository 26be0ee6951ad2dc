"""Trajectory of a second-order system given by its forces, on equally spaced points."""

import numpy as np

from tolstat.common.tables import Status
from tolstat.kernel.integrators.dense import build_dense, lu, make_dense_work, motion_size, small_change
from tolstat.kernel.integrators.integrate import build_integrator, reset
from tolstat.kernel.integrators.state import ATTEMPTS_LEFT, make_state
from tolstat.kernel.mechanics.vector import copy
from tolstat.kernel.simd.jit import njit_inner

OK, NEWTON_FAILED, NOT_FINITE = int(Status.OK), int(Status.NEWTON_FAILED), int(Status.NOT_FINITE)


def build_march(force, tangent=None, mass=None, divided=False):
    """Bind a system to the integrator; `force`, `tangent`, `mass` and `divided` are those of `dense.build_dense`.

    Returns
    -------
    run : function (t0, t1, options, attempts, matrix, points) -> (status, counters)
        From time `t0` to `t1` (s). ``points[0]`` holds q and v at the start; `points`, shape (steps + 1, 3, n), is
        filled with q, v, a.
        `attempts` is the largest number of sub-steps tried; `matrix` is a constant mass or None.
    """
    acceleration, residual, factorise, solve = build_dense(force, tangent, mass, divided)
    _, advance = build_integrator(residual, factorise, solve, motion_size, small_change)

    @njit_inner
    def finite(state):
        for i in range(state.q0.size):
            if not (abs(state.q0[i]) < 1e300 and abs(state.v0[i]) < 1e300 and abs(state.a0[i]) < 1e300):
                return False
        return True

    @njit_inner
    def march(t0, t1, par, options, attempts, work, state, points):
        steps = points.shape[0] - 1
        h = (t1 - t0) / steps
        copy(points[0, 0], state.q0)
        copy(points[0, 1], state.v0)
        acceleration(t0, state.q0, state.v0, work, state.a0)
        reset(state)
        state.counters[ATTEMPTS_LEFT] = attempts
        if not finite(state):
            return NOT_FINITE
        copy(state.a0, points[0, 2])
        for k in range(steps):
            if not advance(t0 + k * h, h, par, options, work, state):
                return NEWTON_FAILED
            if not finite(state):
                return NOT_FINITE
            for i in range(points.shape[2]):
                points[k + 1, 0, i], points[k + 1, 1, i] = state.q0[i], state.v0[i]
                points[k + 1, 2, i] = state.a0[i]
        return OK

    def run(t0, t1, options, attempts, matrix, points):
        n = points.shape[2]
        state, work = make_state(n), make_dense_work(n)
        if matrix is not None:
            work.mass[:] = matrix
            if not lu(work.mass, work.mass_pivots):
                return NOT_FINITE, state.counters
        return march(t0, t1, np.zeros(1), options, attempts, work, state, points), state.counters

    return run
