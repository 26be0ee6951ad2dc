"""Simulate one joint, beside the joint without errors, with full histories, for ``tolstat simulate``."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.campaign.remedy import remedy
from tolstat.common import loads
from tolstat.common.channels import BUSHING_LOADS, SHAFT_LOADS, LoadHistory
from tolstat.common.load_kinds import CONTACTS, PINS
from tolstat.common.shown import shown
from tolstat.common.tables import Motion, Options, Simulation, Status
from tolstat.solver.compilation import warm_up
from tolstat.solver.simulation import simulate_rows

if TYPE_CHECKING:
    import pandas as pd

    from tolstat.study import Case


@shown
class CaseResult(NamedTuple):
    """A simulated case.

    Attributes
    ----------
    simulation : Simulation
        The joint: one row, with full histories.
    alpha : float
        Misalignment, rad.
    wall_s : float
        Time that both simulations took together, without compilation, s.
    options : Options
        Solver options of the simulation.
    nominal : ndarray, (1,), dtype RESULT, optional
        Results of the joint without errors.
    """

    simulation: Simulation
    alpha: float
    wall_s: float
    options: Options
    nominal: NDArray[np.void] | None = None

    def summary(self) -> dict[str, Any]:
        """Return key results as plain Python values; None for those that a failed joint does not have.

        ``max`` holds the largest value of each load that can have a limit, by name: its ``unit`` and the value in this
        joint (``joint``); where the joint without errors was simulated, too, also the value there
        (``without_errors``) and the relative difference (``change``).
        """
        row = self.simulation.results[0]
        facts = {
            "status": Status(row["status"]).label,
            "settled": bool(row["settled"]),
            "closure": _number(row["closure"]),
            "closure_trend": _number(row["closure_trend"]),
            "motion": Motion(row["motion"]).label,
            "period": int(row["period"]),
            "revolutions": _number(row["revolutions"]),
            "steps": int(row["steps"]),
            "newton_iterations": int(row["newton_iterations"]),
            "halvings": int(row["halvings"]),
            "wall_s": self.wall_s,
        }
        if self.nominal is not None:
            facts["status_without_errors"] = Status(self.nominal[0]["status"]).label
        return facts | {"max": {load.name: self._largest(load) for load in loads.LOADS.values()}}

    def _largest(self, load: loads.Load) -> dict[str, Any]:
        own = float(load.of(self.simulation.results)[0])
        found = {"unit": load.unit, "joint": _number(own)}
        if self.nominal is None:
            return found
        ideal = float(load.of(self.nominal)[0])
        change = own / ideal - 1.0 if ideal else math.nan
        return found | {"without_errors": _number(ideal), "change": _number(change)}

    def remedy(self) -> str:
        """Return what to do about a joint that is not ok; empty for one that is."""
        return remedy(self.simulation.results[0], self.options._asdict())

    def to_pandas(self) -> pd.DataFrame:
        """Trace of the last revolution, one row per input angle.

        Columns: ``theta`` (deg), ``tau``, ``Psi``, then ``cross1.F_e`` … ``fork4.T_z`` (N and N m, on the lump, in
        the base marker's axes), ``pin1.contact_outer``, ``pin1.contact_inner``, ``pin1.contact_resultant`` … (N),
        ``input.f_x`` … ``output.m_z`` (force and moment about O on the shafts, N and N m, in axes that do not turn) and
        ``pin1.mode`` …
        """
        import pandas as pd

        from tolstat.joint.ideal import speed_ratio

        histories = {name: values[0] for name, values in self.simulation.histories.items()}
        tau = histories["tau"].astype(float)
        theta = 2 * math.pi * np.arange(len(tau)) / len(tau)
        columns: dict[str, NDArray[Any]] = {
            "theta": 360 * np.arange(len(tau)) / len(tau),
            "tau": tau,
            "Psi": (tau - speed_ratio(theta, self.alpha)) / tau,
        }
        columns |= _components(BUSHING_LOADS, histories)
        for p, pin in enumerate(PINS):
            for i, of in enumerate(CONTACTS):
                columns[f"{pin}.contact_{of}"] = histories["contact"][:, p, i]
        columns |= _components(SHAFT_LOADS, histories)
        for p, pin in enumerate(PINS):
            columns[f"{pin}.mode"] = histories["mode"][:, p]
        return pd.DataFrame(columns)


def _components(history: LoadHistory, histories: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Columns of the components at each place of a history."""
    values = histories[history.name]
    return {
        f"{place}.{component}": values[:, i, k]
        for i, place in enumerate(history.places)
        for k, component in enumerate(history.components)
    }


def simulate_case(case: Case) -> CaseResult:
    """Simulate the joint of a case file, and the same joint without errors.

    Parameters
    ----------
    case : Case
        As `study.load_case` reads it.

    Returns
    -------
    CaseResult
    """
    from tolstat.joint import nominal_errors, perturb

    errors = nominal_errors(2)
    for name, value in case.errors.items():
        errors[name][0] = value
    params = perturb(case.joint, case.operation, errors)
    warm_up()
    begin = time.perf_counter()
    options = case.solver.options()
    both = simulate_rows(params, options, "full")
    wall_s = time.perf_counter() - begin
    own = Simulation(both.results[:1], {name: values[:1] for name, values in both.histories.items()})
    return CaseResult(own, case.operation.alpha, wall_s, options, both.results[1:])


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
