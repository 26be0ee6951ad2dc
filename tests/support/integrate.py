"""The kernel's integrator on any second-order system q'' = f(t, q, q') with a dense tangent: textbook problems."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tests.support.stepping import (
    ATTEMPTS_LEFT,
    IF_STALLED,
    NO,
    START_LEVEL,
    YES,
    at_rounding,
    build_advance,
    make_state,
    reset,
)
from tolstat.common.tables import Method, Options, Status
from tolstat.kernel.mechanics.vector import copy, larger
from tolstat.kernel.simd.jit import njit, njit_inner

OK, NEWTON_FAILED, NOT_FINITE = int(Status.OK), int(Status.NEWTON_FAILED), int(Status.NOT_FINITE)
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


def make_work(n: int) -> DenseWork:
    """Allocate work arrays for `n` unknowns."""
    solution, matrix, *rest = (np.full(shape, np.nan) for shape in ((n,), (n, n), (n, n), (2, n), (n,), (n,)))
    return DenseWork(solution, matrix, np.zeros(n, np.int64), *rest)


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
def solve(q, par, work):
    """Solve the factorised system for ``work.solution`` in place."""
    x, matrix, n = work.solution, work.matrix, work.pivots.size
    for k in range(n):
        x[k], x[work.pivots[k]] = x[work.pivots[k]], x[k]
    for i in range(n):
        for j in range(i):
            x[i] -= matrix[i, j] * x[j]
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            x[i] -= matrix[i, j] * x[j]
        x[i] /= matrix[i, i]


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
    """Largest residual of the accelerations relative to the motion in the step; see `stepping.build_advance`."""
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
    of `small` in `stepping.build_advance`.
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


@njit
def increment(j, q, v, a, cv, ca):
    """Increment of unknown `j` for a one-sided difference; `cv`, `ca`: dv/dq (1/s), da/dq (1/s^2)."""
    return max(DIFFERENCE * max(abs(v[j]) / cv, abs(a[j]) / ca), SMALLEST_DIFFERENCE * max(abs(q[j]), 1.0))


@lru_cache(maxsize=32)
def bind(force: Any, tangent: Any) -> Any:
    """Bind the kernel's steps to a system; the cache spares compiling it again.

    Returns
    -------
    march : jitted function (t0, t1, par, options, attempts, work, state, points) -> status
        From time `t0` to `t1`. ``points[0]`` holds q and v at the start; `points`, shape (steps + 1, 3, n), is filled
        with q, v, a. `attempts` is the largest number of sub-steps tried.
    """

    @njit_inner
    def residual(t, q, v, a, par, options, work, out):
        out[:] = np.nan  # exposes entries that `force` does not write
        force(t, q, v, out)
        for i in range(out.size):
            out[i] = a[i] - out[i]

    @njit_inner
    def by_differences(t, q, v, a, cv, ca, par, options, work):
        n = q.size
        work.base[:] = np.nan
        force(t, q, v, work.base)
        for j in range(n):
            for i in range(n):
                work.shifted[0, i], work.shifted[1, i] = q[i], v[i]
            # q and v move together, as they do along a step
            work.shifted[0, j] += increment(j, q, v, a, cv, ca)
            by = work.shifted[0, j] - q[j]
            work.shifted[1, j] += cv * by
            work.change[:] = np.nan
            force(t, work.shifted[0], work.shifted[1], work.change)
            for i in range(n):
                work.matrix[i, j] = -(work.change[i] - work.base[i]) / by
            work.matrix[j, j] += ca
        return lu(work.matrix, work.pivots)

    @njit_inner
    def by_tangent(t, q, v, a, cv, ca, par, options, work):
        work.matrix[:] = 0.0
        work.dv[:] = 0.0
        tangent(t, q, v, work.matrix, work.dv)
        for i in range(q.size):
            for j in range(q.size):
                work.matrix[i, j] = -work.matrix[i, j] - cv * work.dv[i, j]
            work.matrix[i, i] += ca
        return lu(work.matrix, work.pivots)

    factorise = by_differences if tangent is None else by_tangent
    advance = build_advance(residual, factorise, solve, motion_size, small_change, START_LEVEL)

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
        state.a0[:] = np.nan
        force(t0, state.q0, state.v0, state.a0)
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

    return march


class Trajectory(NamedTuple):
    """Solution on the output grid.

    Attributes
    ----------
    t : ndarray, shape (steps + 1,)
        Time.
    q, v, a : ndarray, shape (steps + 1, n)
        Unknowns, velocities, accelerations; NaN from the point of a failure on.
    status : Status
        How the integration ended, see `integrate`.
    steps, newton_iterations, halvings : int
        Work done; `steps` counts sub-steps.
    """

    t: NDArray[np.float64]
    q: NDArray[np.float64]
    v: NDArray[np.float64]
    a: NDArray[np.float64]
    status: Status
    steps: int
    newton_iterations: int
    halvings: int


def integrate(
    acceleration: Any,
    q0: Sequence[float] | NDArray[np.float64],
    v0: Sequence[float] | NDArray[np.float64],
    t_span: tuple[float, float],
    steps: int,
    method: str = "tr_bdf2",
    tangent: Any = None,
    *,
    max_substeps: int = 1_000_000,
    **settings: float,
) -> Trajectory:
    """Integrate q'' = f(t, q, q') on a grid of equal steps.

    Parameters
    ----------
    acceleration : jitted function (t, q, v, out) -> None
        Writes every entry of q'' to `out`, which is NaN on entry.
    q0, v0 : array_like, shape (n,)
        Initial unknowns and velocities.
    t_span : tuple of float
        First and last time.
    steps : int
        Steps of the output grid.
    method : {"bdf2", "tr_bdf2"}
        All of order 2.
    tangent : jitted function (t, q, v, dq, dv) -> None, optional
        Writes to `dq` and `dv`, each (n, n), the derivatives by q and by v of what `acceleration` writes; row i belongs
        to entry i. Both are zero on entry. Without it finite differences are used.
    max_substeps : int
        Bound on the work: sub-steps that may be tried beyond those of the output grid.
    **settings : float
        Fields of `Options`: `newton_tol`, `newton_max_iter`, `max_halvings`, and `rtol` for TR-BDF2: above zero a step
        is halved until the estimated error in it of every unknown and velocity y is below ``1e-9 + rtol |y|``. With 0,
        the default here, steps are halved for Newton's iteration alone.

    Returns
    -------
    Trajectory
        Its `status` is one of

        ==================  ==========================================================================================
        ``OK``              every step was solved
        ``NEWTON_FAILED``   a step failed at the smallest sub-step (no solution, a jump of the force with the state, an
                            error above `rtol`), or `max_substeps` were spent; NaN from there on
        ``NOT_FINITE``      q'' at the start is not finite (not written), or the solution overflowed
        ==================  ==========================================================================================
    """
    defaults = {
        "newton_tol": 1e-10,
        "newton_max_iter": 12,
        "max_halvings": 40,
        "rtol": 0.0,
    }
    options = Options(method=int(Method[method.upper()]), **defaults | settings)
    points = np.full((steps + 1, 3, len(q0)), np.nan)
    points[0, 0], points[0, 1] = q0, v0
    first, last = (float(t) for t in t_span)
    work, state = make_work(len(q0)), make_state(len(q0))
    status = bind(acceleration, tangent)(first, last, np.zeros(1), options, steps + max_substeps, work, state, points)
    done, iterations, halvings = (int(count) for count in state.counters[:3])
    t = np.linspace(first, last, steps + 1)
    return Trajectory(t, points[:, 0], points[:, 1], points[:, 2], Status(status), done, iterations, halvings)
