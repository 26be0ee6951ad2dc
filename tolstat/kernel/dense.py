"""Any second-order system given by its accelerations, with a dense tangent: textbook equations, small problems."""

from typing import NamedTuple

import numpy as np

from tolstat.kernel._jit import closure, njit

DIFFERENCE = 2.0**-26
"""Relative increment of one-sided differences, the root of the unit roundoff."""


class DenseWork(NamedTuple):
    """Scratch for n unknowns."""

    solution: np.ndarray  # (n,)
    matrix: np.ndarray  # (n, n) tangent, factorised in place
    pivots: np.ndarray  # (n,)
    dv: np.ndarray  # (n, n) derivative by the velocities, where a tangent is given
    shifted: np.ndarray  # (2, n) q and v of a difference
    change: np.ndarray  # (n,)
    base: np.ndarray  # (n,)


def make_dense_work(n: int) -> DenseWork:
    """Allocate for `n` unknowns."""
    arrays = [np.full(shape, np.nan) for shape in ((n,), (n, n), (n, n), (2, n), (n,), (n,))]
    return DenseWork(arrays[0], arrays[1], np.zeros(n, np.int64), *arrays[2:])


@njit
def lu(matrix, pivots):
    """Factorise in place with row exchanges; False when singular or not finite."""
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
def motion_size(cv, ca, state):
    """Residual of the accelerations relative to what the step moves the unknowns by, seen as an acceleration."""
    largest = 0.0
    for i in range(state.q.size):
        largest = max(largest, cv * abs(state.v[i]) + abs(state.a[i]))
    worst = 0.0
    for i in range(state.q.size):
        # an unknown that hardly moves is measured by a thousandth of the one that moves most
        scale = max(cv * abs(state.v[i]) + abs(state.a[i]), 1e-3 * largest, 1e-300)
        ratio = abs(state.residual[i]) / scale
        if not ratio <= worst:
            worst = ratio
    return worst


def build_dense(acceleration, tangent=None):
    """Bind a jitted ``acceleration(t, q, v, out)``, and a ``tangent(t, q, v, dq, dv)`` if there is one.

    Returns
    -------
    residual, factorise, solve : jitted functions
        As `integrate.build_integrator` wants them.
    """

    @closure
    def residual(t, q, v, a, par, options, work, out):
        acceleration(t, q, v, out)
        for i in range(out.size):
            out[i] = a[i] - out[i]

    @closure
    def by_differences(t, q, v, a, cv, ca, par, options, work):
        n = q.size
        acceleration(t, q, v, work.base)
        for j in range(n):
            # q and v move together, as they do along a step
            by = DIFFERENCE * max(abs(q[j]), abs(v[j]) / cv, 1e-8)
            for i in range(n):
                work.shifted[0, i], work.shifted[1, i] = q[i], v[i]
            work.shifted[0, j] += by
            by = work.shifted[0, j] - q[j]
            work.shifted[1, j] += cv * by
            acceleration(t, work.shifted[0], work.shifted[1], work.change)
            for i in range(n):
                work.matrix[i, j] = -(work.change[i] - work.base[i]) / by
            work.matrix[j, j] += ca
        return lu(work.matrix, work.pivots)

    if tangent is None:
        return residual, by_differences, dense_solve

    @closure
    def by_tangent(t, q, v, a, cv, ca, par, options, work):
        n = q.size
        tangent(t, q, v, work.matrix, work.dv)
        for i in range(n):
            for j in range(n):
                work.matrix[i, j] = -work.matrix[i, j] - cv * work.dv[i, j]
            work.matrix[i, i] += ca
        return lu(work.matrix, work.pivots)

    return residual, by_tangent, dense_solve
