"""The joint's integrator for any second-order system: ``tolstat.integrate``."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.common.shown import shown
from tolstat.common.tables import Method, Options, Status

MethodName = Literal["generalized_alpha", "bdf2", "tr_bdf2"]


@shown
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
    acceleration: Callable[..., None],
    q0: ArrayLike,
    v0: ArrayLike,
    t_span: tuple[float, float],
    steps: int,
    method: MethodName = "generalized_alpha",
    tangent: Callable[..., None] | None = None,
    mass: ArrayLike | Callable[..., None] | None = None,
    *,
    rho_inf: float = 0.8,
    rtol: float = 0.0,
    atol: float = 1e-12,
    newton_tol: float = 1e-10,
    newton_max_iter: int = 12,
    max_halvings: int = 40,
    max_substeps: int = 1_000_000,
) -> Trajectory:
    """Integrate q'' = f(t, q, q'), or M q'' = f(t, q, q'), on a grid of equal steps.

    Parameters
    ----------
    acceleration : function (t, q, v, out) -> None
        Writes every entry of q'' to `out`; with `mass`, every entry of the force f. `out` is NaN on entry. Jitted by
        numba, or plain Python that numba can compile.
    q0, v0 : array_like, shape (n,)
        Initial unknowns and velocities; a number for one unknown.
    t_span : tuple of float
        First and last time.
    steps : int
        Steps of the output grid.
    method : {"generalized_alpha", "bdf2", "tr_bdf2"}
        All of order 2; generalised-alpha with spectral radius `rho_inf` at infinite frequency keeps energy better, the
        others are L-stable. Only BDF2 does not oscillate where steps are far too long for an impact.
    tangent : function (t, q, v, dq, dv) -> None, optional
        Writes to `dq` and `dv`, each (n, n), the derivatives by q and by v of what `acceleration` writes; row i belongs
        to entry i. Both are zero on entry. Without it finite differences are used.
    mass : array_like, shape (n, n), or function (t, q, out) -> None, optional
        Mass M, or a function that writes it to `out`, (n, n), which is zero on entry.
    rho_inf : float
        Numerical dissipation of generalised-alpha, 0 (strongest) to 1 (none).
    rtol, atol : float
        With `rtol` above zero a step is halved until the estimated error in it of every unknown and velocity y is below
        ``atol + rtol |y|``. With 0, the default, steps are halved for Newton's iteration alone.
    newton_tol : float
        Newton stops when the residual is below this, relative to the motion in the step (seen as an acceleration).
    newton_max_iter : int
        Iterations before a step is halved.
    max_halvings : int
        Depth to which one step may be halved, at most 50.
    max_substeps : int
        Bound on the work: sub-steps that may be tried beyond those of the output grid.

    Returns
    -------
    Trajectory
        Its `status` is one of

        ==================  ==========================================================================================
        ``OK``              every step was solved
        ``NEWTON_FAILED``   a step failed at the smallest sub-step (no solution, a jump of the force with the state, an
                            error above `rtol`), or `max_substeps` were spent; NaN from there on
        ``NOT_FINITE``      q'' at the start is not finite (not written, or M singular), or the solution overflowed
        ==================  ==========================================================================================

    Raises
    ------
    ValueError
        For invalid shapes or values; the message lists all of them.
    TypeError
        For functions that cannot be called or compiled as described. Exceptions that they raise are passed on.
    """
    options = Options(
        method=_method(method),
        newton_tol=newton_tol,
        newton_max_iter=newton_max_iter,
        max_halvings=max_halvings,
        rho_inf=float(rho_inf),
        rtol=float(rtol),
        atol=float(atol),
    )
    q, v = np.array(q0, float, ndmin=1), np.array(v0, float, ndmin=1)
    matrix = None if mass is None or callable(mass) else np.array(mass, float, ndmin=2)
    faults = [*_start_faults(q, v, matrix), *_grid_faults(t_span, steps, max_substeps), *_option_faults(options)]
    if faults:
        raise ValueError("; ".join(faults))
    run = _bind(
        _jitted(acceleration, "acceleration(t, q, v, out)", (0, 1, 1, 1)),
        None if tangent is None else _jitted(tangent, "tangent(t, q, v, dq, dv)", (0, 1, 1, 2, 2)),
        _jitted(mass, "mass(t, q, out)", (0, 1, 2)) if callable(mass) else None,
        mass is not None,
    )
    points = np.full((steps + 1, 3, len(q)), np.nan)
    points[0, 0], points[0, 1] = q, v
    first, last = (float(t) for t in t_span)
    status, counters = run(first, last, options, steps + max_substeps, matrix, points)
    done, iterations, halvings = (int(c) for c in counters[:3])
    t = np.linspace(first, last, steps + 1)
    return Trajectory(t, points[:, 0], points[:, 1], points[:, 2], Status(status), done, iterations, halvings)


def _method(name: str) -> int:
    """Return the number of a method; ValueError for an unknown name."""
    if not isinstance(name, str) or name.upper() not in Method.__members__:
        raise ValueError(f"method {name!r} is none of {', '.join(m.name.lower() for m in Method)}")
    return int(Method[name.upper()])


def _start_faults(q: NDArray[Any], v: NDArray[Any], matrix: NDArray[Any] | None) -> list[str]:
    """List the faults of the initial values and of a constant mass."""
    faults = []
    if q.ndim != 1 or q.size < 1 or q.shape != v.shape or not (np.isfinite(q).all() and np.isfinite(v).all()):
        faults.append(f"q0 and v0 must be finite vectors of one length, not of shapes {q.shape} and {v.shape}")
    if matrix is not None:
        if matrix.shape != (q.size, q.size) or not np.isfinite(matrix).all():
            faults.append(f"mass must be a finite matrix of shape {(q.size, q.size)}, not of {matrix.shape}")
        elif np.linalg.slogdet(matrix)[0] == 0:
            faults.append("mass is singular; every unknown needs mass")
    return faults


def _grid_faults(t_span: tuple[float, float], steps: int, max_substeps: int) -> list[str]:
    """List the faults of the output grid and of the bound on the work."""
    faults = []
    span = np.asarray(t_span, float)
    if span.shape != (2,) or not np.isfinite(span).all() or not span[1] > span[0]:
        faults.append(f"t_span {t_span} must be two finite, increasing times")
    if not isinstance(steps, int | np.integer) or steps < 1:
        faults.append(f"steps {steps!r} must be a whole number of at least 1")
    if not isinstance(max_substeps, int | np.integer) or max_substeps < 0:
        faults.append(f"max_substeps {max_substeps!r} must be a whole number, not negative")
    return faults


def _option_faults(options: Options) -> list[str]:
    """List the faults of the numerical settings."""
    faults = []
    if not 0 <= options.rho_inf <= 1:
        faults.append(f"rho_inf {options.rho_inf} must lie between 0 and 1")
    if not (0 <= options.rtol < 1 and 0 <= options.atol < np.inf):
        faults.append(f"rtol {options.rtol} and atol {options.atol} must not be negative, and rtol below 1")
    if not 0 < options.newton_tol < 1:
        faults.append(f"newton_tol {options.newton_tol} must lie between 0 and 1")
    if not isinstance(options.newton_max_iter, int | np.integer) or options.newton_max_iter < 1:
        faults.append(f"newton_max_iter {options.newton_max_iter!r} must be a whole number of at least 1")
    if not isinstance(options.max_halvings, int | np.integer) or not 0 <= options.max_halvings <= 50:
        faults.append(f"max_halvings {options.max_halvings!r} must be a whole number from 0 to 50")
    return faults


@lru_cache(maxsize=128)
def _jitted(function: Any, signature: str, dimensions: tuple[int, ...]) -> Any:
    """Compile a function for arguments of `dimensions` (0: number); TypeError with the reason if that fails."""
    import numba
    from numba.core.errors import NumbaError

    if not callable(function):
        raise TypeError(f"{signature} must be a function, not {function!r}")
    double = numba.types.float64
    try:
        jitted = function if hasattr(function, "overloads") else numba.njit(function)
        jitted.compile(tuple(numba.types.Array(double, d, "C") if d else double for d in dimensions))
    except (NumbaError, TypeError) as error:
        reason = "\n".join(str(error).strip().splitlines()[:12])
        raise TypeError(f"{function!r} does not compile with numba as {signature}: {reason}") from error
    return jitted


@lru_cache(maxsize=32)
def _bind(force: Any, tangent: Any, mass: Any, divided: bool) -> Any:
    """Bind the integrator to one system; the cache spares compiling the same system again."""
    from tolstat.kernel.integrators import march

    build: Any = march.build_march
    return build(force, tangent, mass, divided)
