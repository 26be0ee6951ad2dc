"""Simulate one joint with full histories, for ``tolstat simulate``."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.campaign.remedy import remedy
from tolstat.common.shown import shown
from tolstat.common.tables import BUSHINGS, CONTACTS, PINS, Motion, Options, Simulation, Status
from tolstat.solver.simulation import simulate_rows, warm_up

if TYPE_CHECKING:
    import pandas as pd

    from tolstat.study import Case

LOADS = ("F_e", "F_t", "F_z", "T_e", "T_t", "T_z")


@shown
class CaseResult(NamedTuple):
    """A simulated case.

    Attributes
    ----------
    simulation : Simulation
        One row, with full histories.
    alpha : float
        Misalignment, rad.
    wall_s : float
        Time that the simulation took, without compilation, s.
    options : Options
        Solver options of the simulation.
    """

    simulation: Simulation
    alpha: float
    wall_s: float
    options: Options

    def summary(self) -> dict[str, Any]:
        """Return key results as plain Python values; None for those that a failed joint does not have.

        ``max`` holds the largest moduli of each bushing's force (N) and torque (N m) over the last revolution.
        """
        row = self.simulation.results[0]
        largest = {
            name: {"F": _number(row["F_max"][i]), "T": _number(row["T_max"][i])} for i, name in enumerate(BUSHINGS)
        }
        return {
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
            "max": largest,
        }

    def remedy(self) -> str:
        """Return what to do about a joint that is not ok; empty for one that is."""
        return remedy(self.simulation.results[0], self.options._asdict())

    def to_pandas(self) -> pd.DataFrame:
        """Trace of the last revolution, one row per input angle.

        Columns: ``theta`` (deg), ``tau``, ``Psi``, then ``cross1.F_e`` … ``fork4.T_z`` (N and N m, on the lump, in
        the base marker's axes), ``pin1.contact_outer``, ``pin1.contact_inner``, ``pin1.contact_resultant`` … (N) and
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
        for b, bushing in enumerate(BUSHINGS):
            for k, load in enumerate(LOADS):
                columns[f"{bushing}.{load}"] = histories["loads"][:, b, k]
        for p, pin in enumerate(PINS):
            for i, of in enumerate(CONTACTS):
                columns[f"{pin}.contact_{of}"] = histories["contact"][:, p, i]
        for p, pin in enumerate(PINS):
            columns[f"{pin}.mode"] = histories["mode"][:, p]
        return pd.DataFrame(columns)


def simulate_case(case: Case) -> CaseResult:
    """Simulate the joint of a case file.

    Parameters
    ----------
    case : Case
        As `study.load_case` reads it.

    Returns
    -------
    CaseResult
    """
    from tolstat.joint import nominal_errors, perturb

    errors = nominal_errors(1, case.operation)
    for name, value in case.errors.items():
        errors[name] = value
    params = perturb(case.joint, errors)
    warm_up()
    begin = time.perf_counter()
    options = case.solver.options()
    simulation = simulate_rows(params, options, "full")
    return CaseResult(simulation, float(errors["operation.alpha"][0]), time.perf_counter() - begin, options)


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
