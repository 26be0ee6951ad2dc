"""A whole trajectory of a system given by its accelerations."""

import numpy as np

from tolstat.kernel._jit import closure
from tolstat.kernel.dense import build_dense, make_dense_work, motion_size
from tolstat.kernel.integrate import build_integrator, reset
from tolstat.kernel.state import make_state


def build_march(acceleration, tangent=None):
    """Bind a system; returns a function (t0, t1, options, points) -> (converged, counters).

    ``points[0]`` holds q and v at the start; ``points``, shape (steps + 1, 3, n), is filled with q, v, a.
    """
    residual, factorise, solve = build_dense(acceleration, tangent)
    _, advance = build_integrator(residual, factorise, solve, motion_size)

    @closure
    def march(t0, t1, par, options, work, state, points):
        steps = points.shape[0] - 1
        h = (t1 - t0) / steps
        state.q0[:] = points[0, 0]
        state.v0[:] = points[0, 1]
        acceleration(t0, state.q0, state.v0, state.a0)
        points[0, 2] = state.a0
        reset(state)
        for k in range(steps):
            if not advance(t0 + k * h, h, par, options, work, state):
                return False
            for i in range(points.shape[2]):
                points[k + 1, 0, i], points[k + 1, 1, i] = state.q0[i], state.v0[i]
                points[k + 1, 2, i] = state.a0[i]
                if not abs(state.q0[i]) < 1e300:
                    return False
        return True

    def run(t0, t1, options, points):
        n = points.shape[2]
        state = make_state(n)
        good = march(t0, t1, np.zeros(1), options, make_dense_work(n), state, points)
        return good, state.counters

    return run
