"""Integrators of scipy, SUNDIALS and Exudyn on the compiled right-hand side of a joint.

The task is that of tolstat's solver: from its initial equilibrium, which these integrators get at no cost, over a given
number of revolutions to the largest loads of the last one. A call of the right-hand side from Python costs little more
than its arithmetic (`kernel.simd.jit.compiled_entry`).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.solver.reference import SAMPLES_PER_REV, FirstOrder, Largest

FloatArray = NDArray[np.float64]
Code = Literal["Radau", "BDF", "LSODA", "CVODE", "Exudyn"]
Outcome = Literal["ok", "failed", "over_time"]
Found = tuple[FloatArray, FloatArray] | None
"""Times (m,) and states there (m, 112), or nothing."""

MAX_STEPS = 10**9
"""Step limit of CVODE, whose default is 500; here the CPU time limits its work."""
EQUAL_STEPS: tuple[Code, ...] = ("Exudyn",)
"""Codes that are given steps a revolution, and no tolerance."""
NEWTON_TOL = 1e-2
"""Absolute tolerance (m/s2, rad/s2) of Exudyn's Newton iteration, in the norm of all accelerations. Rounding leaves
some 1e-5 of them, more than Exudyn's own tolerance allows; 2e-4 changes errors of largest loads by less than 1e-7."""


class Integrator(NamedTuple):
    """An integrator and how it is used.

    Attributes
    ----------
    code : {"Radau", "BDF", "LSODA", "CVODE", "Exudyn"}
        The first three from scipy, CVODE (BDF, dense linear algebra) from SUNDIALS through scikit-sundae, Exudyn
        (generalised alpha with equal steps, dense linear algebra) from the multibody code of that name.
    jacobian : bool
        Whether it gets the compiled Jacobian; else it uses finite differences.
    """

    code: Code
    jacobian: bool

    def __str__(self) -> str:
        return f"{self.code}, our Jacobian" if self.jacobian else self.code


class Solution(NamedTuple):
    """Outcome of a run.

    Attributes
    ----------
    outcome : {"ok", "failed", "over_time"}
        ``failed``: the integrator gave up; ``over_time``: it was stopped at the limit.
    largest : Largest or None
        Largest loads of the last revolution.
    seconds : float
        CPU time.
    rates, jacobians : int
        Calls of the right-hand side and of the compiled Jacobian.
    """

    outcome: Outcome
    largest: Largest | None
    seconds: float
    rates: int
    jacobians: int


class _OverTimeError(Exception):
    """Raised in a right-hand side to stop the integrator that called it."""


class _Counted:
    """Right-hand side and Jacobian that count their calls and end a run that takes too long."""

    def __init__(self, system: FirstOrder, limit: float) -> None:
        self._system = system
        self._end = time.process_time() + limit
        self.rates = self.jacobians = 0
        self.stopped = False

    def rate(self, t: float, y: FloatArray) -> FloatArray:
        self.rates += 1
        if self.rates % 256 == 0 and time.process_time() > self._end:
            self.stopped = True
            raise _OverTimeError
        return self._system.rate(t, y)

    def jacobian(self, t: float, y: FloatArray) -> FloatArray:
        self.jacobians += 1
        return self._system.jacobian(t, y)


def both_ways(codes: Sequence[Code]) -> list[Integrator]:
    """Each of `codes` with a Jacobian from finite differences, and with the compiled one."""
    return [Integrator(code, jacobian) for code in codes for jacobian in (False, True)]


def installed(code: Code) -> bool:
    """Whether the package that an integrator comes from is installed."""
    package = {"CVODE": "sksundae", "Exudyn": "exudyn"}.get(code, "scipy")
    return find_spec(package) is not None


def solve(
    system: FirstOrder,
    integrator: Integrator,
    setting: float,
    revolutions: int,
    limit: float,
    angles: int = SAMPLES_PER_REV,
) -> Solution:
    """Integrate a joint and find the largest loads of the last revolution.

    Parameters
    ----------
    system : FirstOrder
        The joint and the state to begin from, see `reference.first_order`.
    integrator : Integrator
        The integrator.
    setting : float
        Relative tolerance; the absolute one is this times ``system.scale``. For a code of `EQUAL_STEPS`: steps a
        revolution.
    revolutions : int
        Number of revolutions to integrate.
    limit : float
        CPU time (s) after which the run is stopped.
    angles : int
        Number of angles of the last revolution at which loads are evaluated, by the integrator's own interpolation; for
        a code of `EQUAL_STEPS` they are its steps instead.

    Returns
    -------
    Solution
    """
    own: dict[Code, Callable[..., Found]] = {"CVODE": _cvode, "Exudyn": _exudyn}
    run: Callable[..., Found] = own.get(integrator.code, _scipy)
    settings: dict[str, Any] = {"rtol": setting, "atol": setting * system.scale}
    if integrator.code in EQUAL_STEPS:
        angles = round(setting)
        settings = {"steps": revolutions * angles}
    last = revolutions - 1 + np.arange(1, angles + 1) / angles
    times = system.t0 + system.period * last
    counted = _Counted(system, limit)
    begin = time.process_time()
    outcome: Outcome = "failed"
    largest = None
    try:
        found = run(system, integrator, counted, times, settings)
    except _OverTimeError:
        outcome = "over_time"
    else:
        if found is not None and np.isfinite(found[1]).all():
            outcome, largest = "ok", system.largest(*found)
    return Solution(outcome, largest, time.process_time() - begin, counted.rates, counted.jacobians)


def _scipy(
    system: FirstOrder, integrator: Integrator, counted: _Counted, times: FloatArray, settings: dict[str, Any]
) -> Found:
    """`times` and the states there, (m, 112); None where the integrator gives up."""
    from scipy.integrate import solve_ivp

    if integrator.jacobian:
        settings = settings | {"jac": counted.jacobian}
    span = (system.t0, times[-1])
    method: Any = integrator.code
    found = solve_ivp(counted.rate, span, system.y0, method, t_eval=times, **settings)
    return (times, np.ascontiguousarray(found.y.T)) if found.success else None


def _cvode(
    system: FirstOrder, integrator: Integrator, counted: _Counted, times: FloatArray, settings: dict[str, Any]
) -> Found:
    """As `_scipy`."""
    from sksundae.cvode import CVODE

    def rate(t: float, y: FloatArray, out: FloatArray) -> None:
        out[:] = counted.rate(t, y)

    def jacobian(t: float, y: FloatArray, _: FloatArray, out: FloatArray) -> None:
        out[:] = counted.jacobian(t, y)

    if integrator.jacobian:
        settings = settings | {"jacfn": jacobian}
    found = CVODE(rate, max_num_steps=MAX_STEPS, **settings).solve(np.concatenate([[system.t0], times]), system.y0)
    return (times, np.ascontiguousarray(found.y[1:])) if found.success else None


def _exudyn(
    system: FirstOrder, integrator: Integrator, counted: _Counted, times: FloatArray, settings: dict[str, Any]
) -> Found:
    """As `_scipy`, at all of Exudyn's own steps from the first of `times` to the last.

    There are ``settings["steps"]`` equal steps from the initial state to the last of `times`; Exudyn reduces those that
    Newton's iteration cannot solve. The joint is one object with the identity as mass matrix, whose forces are the
    accelerations. Settings are Exudyn's own, but for its output and `NEWTON_TOL`.
    """
    import exudyn
    from exudyn.itemInterface import NodeGenericODE2, ObjectGenericODE2

    n = len(system.y0) // 2
    states: list[FloatArray] = []
    reached: list[float] = []
    first = times[0] - 1e-9 * system.period

    def force(_mbs: Any, t: float, _item: int, q: list[float], v: list[float]) -> FloatArray:
        return counted.rate(t, np.array([*q, *v]))[n:]

    def jacobian(_mbs: Any, t: float, _item: int, q: list[float], v: list[float], *factors: float) -> FloatArray:
        found = counted.jacobian(t, np.array([*q, *v]))[n:]
        return -factors[0] * found[:, :n] - factors[1] * found[:, n:]

    def keep(mbs: Any, t: float) -> bool:
        if t >= first:
            reached.append(t)
            states.append(np.concatenate([mbs.systemData.GetODE2Coordinates(), mbs.systemData.GetODE2Coordinates_t()]))
        return True

    exudyn.config.printToConsole = False
    container = exudyn.SystemContainer()
    mbs = container.AddSystem()
    start = {"initialCoordinates": system.y0[:n], "initialCoordinates_t": system.y0[n:]}
    node = mbs.AddNode(NodeGenericODE2(referenceCoordinates=np.zeros(n), numberOfODE2Coordinates=n, **start))
    functions = {"forceUserFunction": force, "jacobianUserFunction": jacobian if integrator.jacobian else 0}
    mbs.AddObject(ObjectGenericODE2(nodeNumbers=[node], massMatrix=np.eye(n), **functions))
    mbs.SetPostStepUserFunction(keep)
    mbs.Assemble()
    asked = exudyn.SimulationSettings()
    asked.solution.file.write = False
    course = asked.timeIntegration
    course.startTime, course.endTime, course.numberOfSteps = system.t0, times[-1], settings["steps"]
    course.newton.absoluteTolerance = NEWTON_TOL
    try:
        mbs.SolveDynamic(asked)
    except exudyn.SolverError:
        return None
    except exudyn.ModelError:  # what a function raised that Exudyn called
        if counted.stopped:
            raise _OverTimeError from None
        raise
    return np.array(reached), np.array(states)
