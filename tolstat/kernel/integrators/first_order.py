"""The joint as a first-order system, y = (q, q'), for third-party integrators: rate, Jacobian."""

from tolstat.kernel.mechanics.dynamics import acceleration
from tolstat.kernel.mechanics.topology import N_DOF
from tolstat.kernel.mechanics.vector import copy
from tolstat.kernel.simd.jit import njit

POSITION_STEP, VELOCITY_STEP = 1e-10, 1e-6
"""Increments of the Jacobian's differences (m, rad; per s): above rounding, below the micrometre of contact onset."""


@njit
def rate(t, y, par, options, work, out):
    """Evaluate y'.

    Parameters
    ----------
    t : float
        Time, s.
    y : ndarray, shape (112,)
        Unknowns, then their velocities; m and rad, per s.
    par, options, work
        As in `dynamics.residual`.
    out : ndarray, shape (112,)
        Written: y'.
    """
    for i in range(N_DOF):
        out[i] = y[N_DOF + i]
    acceleration(t, y[:N_DOF], y[N_DOF:], par, options, work, out[N_DOF:])


@njit
def jacobian(t, y, par, options, work, column, out):
    """Write d(rate)/dy at `y` to `out`, (112, 112), by forward differences; `column`, (3, 112), is scratch."""
    base, moved, there = column[0], column[1], column[2]
    rate(t, y, par, options, work, base)
    copy(y, moved)
    for j in range(2 * N_DOF):
        moved[j] = y[j] + (POSITION_STEP if j < N_DOF else VELOCITY_STEP)
        step = moved[j] - y[j]
        rate(t, moved, par, options, work, there)
        moved[j] = y[j]
        for i in range(2 * N_DOF):
            out[i, j] = (there[i] - base[i]) / step


@njit
def rate_of_row(t, y, params, options, works, out):
    """`rate` at `y`, with `params` and `works` of shape (1,): Python passes arrays to kernels faster than records."""
    rate(t, y, params[0], options, works[0], out)


@njit
def jacobian_of_row(t, y, params, options, works, column, out):
    """`jacobian` at `y`, scratch `column`, with `params` and `works` of shape (1,), as in `rate_of_row`."""
    jacobian(t, y, params[0], options, works[0], column, out)
