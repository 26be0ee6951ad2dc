"""Tight reference solutions of single joints by scipy's integrators, and the joint as a first-order system for them.

Only the equations of motion are shared with the solver: its integrators, linear algebra and analytic tangent are not.
The Jacobian is computed from finite differences of the accelerations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common import tables
from tolstat.common.cardan import CARDAN
from tolstat.common.load_kinds import kinds, measure_of, spans
from tolstat.common.loads import FloatArray, put_largest
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import SIMULATED, Fidelity, Options, Start, Status
from tolstat.solver.simulation import equilibrium, simulate_together

IntegratorName = Literal["Radau", "BDF", "LSODA"]

SAMPLES_PER_REV = 2880
"""Angles a revolution at which loads are evaluated, in addition to the integrator's own steps: a peak is met within
1e-6 of its height."""
LENGTH, VELOCITY = 1e-4, 1.0
"""Sizes (m or rad, per s) below which errors of unknowns and velocities are absolute: a clearance, and a velocity that
changes a bushing's damping force by its tolerance."""
MAX_STEPS = 50_000
"""Bound on the steps of a joint: half a minute. Where contacts ring the integrator takes a few thousand steps."""
MAX_REVS = 6
"""Number of revolutions after which a joint whose largest loads still change is not periodic."""

Largest = FloatArray
"""Largest values of all loads of a joint, (values,), SI, in the order of `load_kinds.SPAN`."""


class FirstOrder(NamedTuple):
    """A joint as y' = f(t, y), y = (q, q') of 112 components (m and rad, per s), and an initial state.

    Attributes
    ----------
    rate : callable
        (t, y) -> y', (112,); t in s.
    jacobian : callable
        (t, y) -> df/dy, (112, 112).
    t0 : float
        Time of the initial state, s; for a settled one, time within its revolution.
    y0 : ndarray, shape (112,)
        Initial state.
    period : float
        Time of a revolution, s.
    scale : ndarray, shape (112,)
        Size of each component below which its error is absolute: ``atol = rtol * scale``.
    largest : callable
        Times (m,) and states (m, 112) of a revolution -> Largest. A third argument, (m,) booleans, says which times are
        equally spaced, without it all: from these the amplitudes of orders are computed.
    settled : ndarray of RESULT, shape (1,)
        Result of the solver for the joint. If its status is one without results, there is no initial state.
    """

    rate: Callable[[float, FloatArray], FloatArray]
    jacobian: Callable[[float, FloatArray], FloatArray]
    t0: float
    y0: FloatArray
    period: float
    scale: FloatArray
    largest: Callable[..., Largest]
    settled: NDArray[np.void]


def first_order(
    params: NDArray[np.void], options: Options, from_start: bool = False, mechanism: Mechanism = CARDAN
) -> FirstOrder:
    """Simulate a joint until it settles, and return it as a first-order system that starts in the settled state.

    Parameters
    ----------
    params : ndarray of PARAM, shape (1,)
        The joint.
    options : Options
        Numerical settings of that simulation; its fidelity is always dynamic.
    mechanism : Mechanism
        What the joint is.
    from_start : bool
        Start the system where the solver starts instead, at time zero.

    Returns
    -------
    FirstOrder
        Its functions share work arrays, and so are not thread-safe.
    """
    from tolstat.kernel.integrators import first_order as kernel
    from tolstat.kernel.mechanics.work import work_dtype
    from tolstat.kernel.revolution.settle import make_samples, sample, write_of_revolution
    from tolstat.kernel.simd.jit import compiled_entry

    par = params.view(np.recarray)[0]
    options = options._replace(fidelity=int(Fidelity.DYNAMIC))
    settled = np.zeros(1, tables.tables(mechanism).RESULT)
    allowed = np.full(1, tables.iterations_allowed(options.steps_per_rev, options.max_revs))
    ((_, revolution),) = simulate_together(params, options, allowed, True, settled, mechanism=mechanism)
    period = 2 * np.pi / abs(float(par.omega))
    last = round(float(np.nan_to_num(settled["revolutions"][0])) * options.steps_per_rev) % options.steps_per_rev
    t0, y0 = period * last / options.steps_per_rev, np.concatenate([revolution[last].q, revolution[last].v])
    if from_start:
        is_ramp, at_rest = options.start == Start.RAMP, np.zeros(mechanism.dof)
        t0, y0 = 0.0, np.concatenate([at_rest if is_ramp else equilibrium(params, options, mechanism), at_rest])
    else:
        options = options._replace(start=int(Start.STATIC))  # the torque ramp has ended

    n = 2 * mechanism.dof
    works, scratch = np.zeros(1, work_dtype(mechanism)), np.empty((3, n))
    work = works.view(np.recarray)[0]
    fast_rate = compiled_entry(kernel.rate_of_row, t0, y0, params, options, works, y0)
    fast_jacobian = compiled_entry(kernel.jacobian_of_row, t0, y0, params, options, works, scratch, scratch)

    def rate(t: float, y: FloatArray) -> FloatArray:
        out = np.empty(n)
        fast_rate(t, np.ascontiguousarray(y, np.float64), params, options, works, out)
        return out

    def jacobian(t: float, y: FloatArray) -> FloatArray:
        out = np.empty((n, n))
        fast_jacobian(t, np.ascontiguousarray(y, np.float64), params, options, works, scratch, out)
        return out

    def largest(times: FloatArray, states: FloatArray, equal: NDArray[np.bool_] | None = None) -> Largest:
        samples = make_samples(1, len(times), mechanism)[0]
        sample(times, np.ascontiguousarray(states), par, work, samples)
        out = tables.for_kernels(np.zeros(1, tables.tables(mechanism).RESULT), mechanism)[0]
        write_of_revolution(par, samples if equal is None else samples[equal], out)
        out.largest[: samples.loads.shape[1]] = samples.loads.max(axis=0)
        return np.array(out.largest)

    scale = np.repeat([LENGTH, VELOCITY], mechanism.dof)
    return FirstOrder(rate, jacobian, t0, y0, period, scale, largest, settled)


def reference_rows(
    params: NDArray[np.void],
    options: Options,
    rtol: float = 1e-7,
    integrator: IntegratorName = "Radau",
    closure_tol: float = 1e-5,
    max_steps: int = MAX_STEPS,
    angles: int | None = None,
    mechanism: Mechanism = CARDAN,
) -> NDArray[np.void]:
    """Solve joints with a tight tolerance from their settled state until their largest loads repeat.

    The first revolution serves to forget the errors of that state.

    Parameters
    ----------
    params : ndarray of PARAM, shape (n,)
        The joints.
    options : Options
        Numerical settings of the solver that gives the settled state.
    mechanism : Mechanism
        What the joints are.
    rtol : float
        Relative tolerance; the absolute one is `rtol` times `LENGTH` and `VELOCITY`.
    integrator : {"Radau", "BDF", "LSODA"}
        Of ``scipy.integrate``.
    closure_tol : float
        Change of the largest loads between two revolutions, relative to the largest of the kind, at which they repeat.
    max_steps : int
        Steps of the integrator after which a joint is given up.
    angles : int, optional
        Look for the largest loads at this many angles only, as the solver does with ``steps_per_rev``; without it at
        `SAMPLES_PER_REV` angles and at all steps, so that no peak is missed.

    Returns
    -------
    ndarray of RESULT, shape (n,)
        ``status``, ``settled``, ``closure`` (that change), ``revolutions``, ``steps`` and the largest loads of the last
        revolution; all else is NaN. A joint that the solver cannot simulate keeps its status; one that does not repeat
        within `MAX_REVS` or `max_steps` is ``NOT_SETTLED``, or ``NEWTON_FAILED`` if the integration ended before the
        second revolution did.
    """
    results = tables.without_results(len(params), Status.NEWTON_FAILED, mechanism)
    for i in range(len(params)):
        system = first_order(params[i : i + 1], options, mechanism=mechanism)
        status = Status(system.settled["status"][0])
        if status in SIMULATED:
            revolutions = _revolutions(system, rtol, integrator, max_steps, angles)
            status = _periodic(revolutions, closure_tol, mechanism, results[i : i + 1])
        results["status"][i] = status
    results["settled"] = results["status"] == Status.OK
    return results


def _periodic(
    revolutions: Iterator[tuple[Largest, int]], closure_tol: float, mechanism: Mechanism, out: NDArray[np.void]
) -> Status:
    """Integrate until the largest loads repeat; write them and the work to `out`, (1,); return the status."""
    before = None
    for last, steps in revolutions:
        out["revolutions"], out["steps"] = 1 + np.nan_to_num(out["revolutions"]), steps
        put_largest(last, out, mechanism)
        if before is not None:
            out["closure"] = _change(before, last, mechanism)
            if out["closure"][0] <= closure_tol:
                return Status.OK
            if out["revolutions"][0] == MAX_REVS:
                return Status.NOT_SETTLED
        before = last
    if np.isfinite(out["closure"][0]):
        return Status.NOT_SETTLED
    put_largest(np.nan, out, mechanism)
    return Status.NEWTON_FAILED


def _revolutions(
    system: FirstOrder, rtol: float, integrator: IntegratorName, max_steps: int, angles: int | None
) -> Iterator[tuple[Largest, int]]:
    """Yield the largest loads of each revolution and the steps so far; end early when the integrator gives up."""
    import scipy.integrate

    end = system.t0 + (MAX_REVS + 0.5) * system.period
    settings: dict[str, Any] = {"rtol": rtol, "atol": rtol * system.scale, "jac": system.jacobian}
    make: Callable[..., Any] = getattr(scipy.integrate, integrator)
    solver = make(system.rate, system.t0, system.y0, end, max_step=0.1 * system.period, **settings)
    times, states, equal = [], [], []
    spacing, done = system.period / (angles or SAMPLES_PER_REV), 0
    boundary = system.t0 + (1 + 1e-9) * system.period
    for step in range(1, max_steps + 1):
        solver.step()
        if solver.status == "failed":
            return
        reached = int((solver.t - system.t0) / spacing)
        grid = system.t0 + spacing * np.arange(done + 1, reached + 1)
        done = reached
        times.append(grid)
        states.append(solver.dense_output()(grid).T)
        equal.append(np.ones(len(grid), bool))
        if angles is None:
            times.append(np.array([solver.t]))
            states.append(solver.y[None].copy())
            equal.append(np.zeros(1, bool))
        if solver.t >= boundary:
            parts = [np.concatenate(part) for part in (times, states, equal)]
            inside = parts[0] <= boundary
            yield system.largest(*(part[inside] for part in parts)), step
            times, states, equal = ([part[~inside]] for part in parts)
            boundary += system.period
        if solver.status == "finished":
            return


def _change(before: Largest, last: Largest, mechanism: Mechanism) -> float:
    """Largest change of any largest load that decides, relative to the largest of its measure."""
    span, deciding = spans(mechanism), [kind for kind in kinds(mechanism).values() if kind.decides]
    compared = [(span[kind.key], span[measure_of(kind).key]) for kind in deciding]
    return max(
        float(np.abs(last[these] - before[these]).max() / max(last[measure].max(), 1e-300))
        for these, measure in compared
    )
