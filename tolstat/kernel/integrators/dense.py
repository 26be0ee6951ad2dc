"""Any second-order system M q'' = f(t, q, q') with a dense tangent, for textbook equations and small problems.

With a mass the equations are solved as q'' = M^-1 f, so that residuals are accelerations whatever the units of the
equations are. M is a constant matrix, factorised into ``work.mass`` before the first step, or a function of t and q.
"""

from typing import NamedTuple

import numpy as np

from tolstat.kernel.integrators.integrate import IF_STALLED, NO, YES, at_rounding
from tolstat.kernel.mechanics.vector import copy, larger
from tolstat.kernel.simd.jit import njit, njit_inner

DIFFERENCE = 2.0**-26
"""Increment of one-sided differences relative to the motion in a step: the square root of 2^-52."""
SMALLEST_DIFFERENCE = 2.0**-40
"""Smallest increment relative to max(|q|, 1): above the rounding of sums such as 1 + q."""
STALL = 1e4
"""Newton change, in units of newton_tol times the motion, up to which a residual that does not fall is rounding."""


class DenseWork(NamedTuple):
    """Work arrays for n unknowns."""

    solution: np.ndarray  # (n,)
    matrix: np.ndarray  # (n, n) tangent, factorised in place
    pivots: np.ndarray  # (n,)
    dv: np.ndarray  # (n, n) df/dv, where a tangent is given
    shifted: np.ndarray  # (2, n) q and v with the increment of a difference
    change: np.ndarray  # (n,) q'' with the increment
    base: np.ndarray  # (n,) q'' without the increment
    mass: np.ndarray  # (n, n) factors of the last mass matrix
    mass_pivots: np.ndarray  # (n,)


def make_dense_work(n: int) -> DenseWork:
    """Allocate work arrays for `n` unknowns."""
    vector, square = (n,), (n, n)
    arrays = [np.full(shape, np.nan) for shape in (vector, square, square, (2, n), vector, vector, square)]
    return DenseWork(arrays[0], arrays[1], np.zeros(n, np.int64), *arrays[2:], np.zeros(n, np.int64))


@njit
def lu(matrix, pivots):
    """LU factorisation in place with row exchanges; False when singular or not finite."""
    n = pivots.size
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        pivots[k] = best
        if not 0 < abs(matrix[best, k]) < 1e300:
            return False
        for j in range(n):
            matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
        for i in range(k + 1, n):
            matrix[i, k] /= matrix[k, k]
            for j in range(k + 1, n):
                matrix[i, j] -= matrix[i, k] * matrix[k, j]
    return True


@njit
def lu_solve(matrix, pivots, x):
    """Solve for `x` in place with the factors of `lu`."""
    n = pivots.size
    for k in range(n):
        x[k], x[pivots[k]] = x[pivots[k]], x[k]
    for i in range(n):
        for j in range(i):
            x[i] -= matrix[i, j] * x[j]
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            x[i] -= matrix[i, j] * x[j]
        x[i] /= matrix[i, i]


@njit
def dense_solve(q, work):
    """Solve the factorised system for ``work.solution``."""
    lu_solve(work.matrix, work.pivots, work.solution)


@njit
def motion(i, cv, largest, state):
    """Motion of unknown `i` in the step, cv |v| + |a|; at least a thousandth of the `largest` one of all unknowns."""
    return max(cv * abs(state.v[i]) + abs(state.a[i]), 1e-3 * largest, 1e-300)


@njit
def largest_motion(cv, state):
    """Largest cv |v| + |a| of all unknowns: the motion in the step, as an acceleration."""
    largest = 0.0
    for i in range(state.q.size):
        largest = max(largest, cv * abs(state.v[i]) + abs(state.a[i]))
    return largest


@njit
def motion_size(cv, ca, state):
    """Largest residual of the accelerations relative to the motion in the step; see `integrate.build_integrator`."""
    largest = largest_motion(cv, state)
    worst = 0.0
    for i in range(state.q.size):
        worst = larger(worst, abs(state.residual[i]) / motion(i, cv, largest, state))
    return worst


@njit
def small_change(cv, ca, fresh, options, work, state):
    """`YES` if the last change is rounding, `IF_STALLED` if it is so small that a stalled residual must be rounding.

    Where large stiff forces cancel, their rounding keeps the residual above any tolerance although the unknowns are
    exact: a Newton step with a new tangent then changes them very little, and the residual does not fall. Arguments as
    of `small` in `integrate.build_integrator`.
    """
    if at_rounding(cv, ca, fresh, options, work, state) == YES:
        return YES
    if not fresh:
        return NO
    largest = largest_motion(cv, state)
    for i in range(state.q.size):
        if not ca * abs(work.solution[i]) <= STALL * options.newton_tol * motion(i, cv, largest, state):
            return NO
    return IF_STALLED


def build_acceleration(force, mass=None, divided=False):
    """Build the jitted function (t, q, v, work, out) that evaluates q''; arguments as in `build_dense`."""

    @njit_inner
    def plain(t, q, v, work, out):
        out[:] = np.nan  # exposes entries that `force` does not write
        force(t, q, v, out)

    @njit_inner
    def by_matrix(t, q, v, work, out):
        out[:] = np.nan
        force(t, q, v, out)
        lu_solve(work.mass, work.mass_pivots, out)

    if mass is None:
        return by_matrix if divided else plain

    @njit_inner
    def by_function(t, q, v, work, out):
        out[:] = np.nan
        force(t, q, v, out)
        work.mass[:] = 0.0
        mass(t, q, work.mass)
        if lu(work.mass, work.mass_pivots):
            lu_solve(work.mass, work.mass_pivots, out)
        else:
            out[:] = np.nan

    return by_function


@njit
def increment(j, q, v, a, cv, ca):
    """Increment of unknown `j` for a one-sided difference; `cv`, `ca`: dv/dq (1/s), da/dq (1/s^2)."""
    return max(DIFFERENCE * max(abs(v[j]) / cv, abs(a[j]) / ca), SMALLEST_DIFFERENCE * max(abs(q[j]), 1.0))


def build_differences(acceleration):
    """Build `factorise` of `integrate.build_integrator` with a tangent by one-sided differences of `acceleration`."""

    @njit_inner
    def by_differences(t, q, v, a, cv, ca, par, options, work):
        n = q.size
        acceleration(t, q, v, work, work.base)
        for j in range(n):
            for i in range(n):
                work.shifted[0, i], work.shifted[1, i] = q[i], v[i]
            # q and v move together, as they do along a step
            work.shifted[0, j] += increment(j, q, v, a, cv, ca)
            by = work.shifted[0, j] - q[j]
            work.shifted[1, j] += cv * by
            acceleration(t, work.shifted[0], work.shifted[1], work, work.change)
            for i in range(n):
                work.matrix[i, j] = -(work.change[i] - work.base[i]) / by
            work.matrix[j, j] += ca
        return lu(work.matrix, work.pivots)

    return by_differences


def build_given(acceleration, force, tangent, mass=None, divided=False):
    """Build `factorise` of `integrate.build_integrator` with the user's `tangent`; other arguments as in `build_dense`.

    `acceleration`: as `build_acceleration` returns it from the same `force`, `mass` and `divided`.
    """

    @njit_inner
    def mass_moves(t, q, v, a, cv, ca, work):
        """Add d(M(q) q'')/dq to the tangent, by differences of the mass at a fixed q''."""
        n = q.size
        acceleration(t, q, v, work, work.base)
        force(t, q, v, work.change)  # equal to M(q) base
        for j in range(n):
            for i in range(n):
                work.shifted[0, i] = q[i]
            work.shifted[0, j] += increment(j, q, v, a, cv, ca)
            by = work.shifted[0, j] - q[j]
            work.mass[:] = 0.0
            mass(t, work.shifted[0], work.mass)
            for i in range(n):
                moved = -work.change[i]
                for k in range(n):
                    moved += work.mass[i, k] * work.base[k]
                work.matrix[i, j] += moved / by
        work.mass[:] = 0.0
        mass(t, q, work.mass)
        return lu(work.mass, work.mass_pivots)

    @njit_inner
    def by_tangent(t, q, v, a, cv, ca, par, options, work):
        n = q.size
        work.matrix[:] = 0.0
        work.dv[:] = 0.0
        tangent(t, q, v, work.matrix, work.dv)
        for i in range(n):
            for j in range(n):
                work.matrix[i, j] = -work.matrix[i, j] - cv * work.dv[i, j]
        if mass is not None and not mass_moves(t, q, v, a, cv, ca, work):
            return False
        for j in range(n):
            if divided:
                copy(work.matrix[:, j], work.solution)
                lu_solve(work.mass, work.mass_pivots, work.solution)
                copy(work.solution, work.matrix[:, j])
            work.matrix[j, j] += ca
        return lu(work.matrix, work.pivots)

    return by_tangent


def build_dense(force, tangent=None, mass=None, divided=False):
    """Bind a system to the functions that `integrate.build_integrator` needs.

    Parameters
    ----------
    force : jitted function (t, q, v, out)
        Writes f, shape (n,); without a mass this is q'' itself.
    tangent : jitted function (t, q, v, dq, dv), optional
        Writes df/dq and df/dv, shape (n, n); without it the tangent comes from differences.
    mass : jitted function (t, q, out), optional
        Writes M, shape (n, n).
    divided : bool
        Whether there is a mass: `mass`, or a constant matrix whose factors are in ``work.mass``.

    Returns
    -------
    acceleration : jitted function (t, q, v, work, out) -> None
    residual, factorise, solve : jitted functions
        Arguments of `integrate.build_integrator`.
    """
    acceleration = build_acceleration(force, mass, divided)

    @njit_inner
    def residual(t, q, v, a, par, options, work, out):
        acceleration(t, q, v, work, out)
        for i in range(out.size):
            out[i] = a[i] - out[i]

    if tangent is None:
        return acceleration, residual, build_differences(acceleration), dense_solve
    return acceleration, residual, build_given(acceleration, force, tangent, mass, divided), dense_solve
