"""The joint as a first-order system, y = (q, q'), for third-party integrators: rate, Jacobian."""

from tolstat.kernel.mechanics.dynamics import acceleration
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
    dof = work.solution.shape[0]
    for i in range(dof):
        out[i] = y[dof + i]
    acceleration(t, y[:dof], y[dof:], par, options, work, out[dof:])


@njit
def jacobian(t, y, par, options, work, column, out):
    """Write d(rate)/dy at `y` to `out`, (112, 112), by forward differences; `column`, (3, 112), is scratch."""
    base, moved, there = column[0], column[1], column[2]
    rate(t, y, par, options, work, base)
    copy(y, moved)
    dof = work.solution.shape[0]
    for j in range(2 * dof):
        moved[j] = y[j] + (POSITION_STEP if j < dof else VELOCITY_STEP)
        step = moved[j] - y[j]
        rate(t, moved, par, options, work, there)
        moved[j] = y[j]
        for i in range(2 * dof):
            out[i, j] = (there[i] - base[i]) / step


@njit
def rate_of_row(t, y, params, options, works, out):
    """`rate` at `y`, with `params` and `works` of shape (1,): Python passes arrays to kernels faster than records."""
    rate(t, y, params[0], options, works[0], out)


@njit
def jacobian_of_row(t, y, params, options, works, column, out):
    """`jacobian` at `y`, scratch `column`, with `params` and `works` of shape (1,), as in `rate_of_row`."""
    jacobian(t, y, params[0], options, works[0], column, out)
