"""The joint's integrator for any second-order system: ``tolstat.integrate``."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.tables import Method, Options, Status

MethodName = Literal["generalized_alpha", "bdf2", "tr_bdf2"]


class Trajectory(NamedTuple):
    """Solution on the output grid.

    Attributes
    ----------
    t : ndarray, shape (steps + 1,)
        Time.
    q, v, a : ndarray, shape (steps + 1, n)
        Unknowns, velocities, accelerations; NaN from the point of a failure on.
    status : Status
        ``OK``, or ``NEWTON_FAILED`` when a step failed at the smallest sub-step.
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
    *,
    rho_inf: float = 0.8,
    rtol: float = 0.0,
    atol: float = 1e-12,
    newton_tol: float = 1e-10,
    newton_max_iter: int = 12,
    max_halvings: int = 16,
) -> Trajectory:
    """Integrate q'' = f(t, q, q') with a fixed step.

    Parameters
    ----------
    acceleration : jitted function (t, q, v, out) -> None
        Writes q'' to `out`.
    q0, v0 : array_like, shape (n,)
        Initial unknowns and velocities.
    t_span : tuple of float
        First and last time.
    steps : int
        Steps of the output grid.
    method : {"generalized_alpha", "bdf2", "tr_bdf2"}
        All of order 2; generalised-alpha with spectral radius `rho_inf` at infinite frequency keeps energy better, the
        others are L-stable. TR-BDF2 has an error estimate, see `rtol`.
    tangent : jitted function (t, q, v, dq, dv) -> None, optional
        Writes the derivatives of q'' by q and by v, each (n, n); differences are used without it.
    rho_inf : float
        Numerical dissipation of generalised-alpha, 0 (strongest) to 1 (none).
    rtol, atol : float
        With `rtol` above zero, ``"tr_bdf2"`` halves a step until the estimated error of every unknown and velocity y is
        below ``atol + rtol |y|``. Other methods have no estimate.
    newton_tol : float
        Newton stops when the residual is below this, relative to the motion in the step (seen as an acceleration).
    newton_max_iter : int
        Iterations before a step is halved.
    max_halvings : int
        Depth to which one step may be halved.

    Returns
    -------
    Trajectory

    Raises
    ------
    ValueError
        For shapes or values that make no sense.
    """
    q = np.array(q0, float, ndmin=1)
    v = np.array(v0, float, ndmin=1)
    if q.ndim != 1 or q.shape != v.shape or not (np.isfinite(q).all() and np.isfinite(v).all()):
        raise ValueError(f"q0 and v0 must be finite vectors of one length, not of shapes {q.shape} and {v.shape}")
    if steps < 1 or not np.isfinite(t_span).all() or t_span[1] <= t_span[0]:
        raise ValueError(f"t_span {t_span} must grow and steps {steps} be at least 1")
    if not 0 <= rho_inf <= 1:
        raise ValueError(f"rho_inf {rho_inf} must lie between 0 and 1")
    if method.upper() not in Method.__members__:
        raise ValueError(f"method {method!r} is none of {', '.join(m.name.lower() for m in Method)}")
    if (rtol > 0 and method != "tr_bdf2") or rtol < 0 or atol < 0:
        raise ValueError("rtol and atol must not be negative, and only tr_bdf2 can keep them")
    options = Options(
        method=int(Method[method.upper()]),
        newton_tol=newton_tol,
        newton_max_iter=newton_max_iter,
        max_halvings=max_halvings,
        rho_inf=float(rho_inf),
        rtol=float(rtol),
        atol=float(atol),
    )
    march = _bind(acceleration, tangent)
    points = np.full((steps + 1, 3, len(q)), np.nan)
    points[0, 0], points[0, 1] = q, v
    good, counters = march(float(t_span[0]), float(t_span[1]), options, points)
    status = Status.OK if good else Status.NEWTON_FAILED
    t = np.linspace(*t_span, steps + 1)
    done, iterations, halvings, _ = (int(c) for c in counters)
    return Trajectory(t, points[:, 0], points[:, 1], points[:, 2], status, done, iterations, halvings)


@lru_cache(maxsize=32)
def _bind(acceleration: Any, tangent: Any) -> Any:
    """Compile the march for one system; a system met again is not compiled again."""
    from tolstat.kernel import march

    build: Any = march.build_march
    return build(acceleration, tangent)
