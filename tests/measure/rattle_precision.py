"""``python -m tests.measure.rattle_precision``: work against error where contacts hit, beside other integrators.

Three joints of studies/rigid_shafts.toml at 30 deg, 1500 rpm and 100 N m, from the equilibrium that the solver starts
from. Others make six revolutions, of which the last counts; the solver makes as many as it needs. Errors are of the
largest |F| or |T|, relative to the largest of the kind, against scipy's RK45 at a tolerance of 1e-7.
"""

from __future__ import annotations

import time

import numpy as np
import scipy.integrate
from numpy.typing import NDArray

from studies.precision.integrators import Code, Integrator, solve
from studies.precision.runs import largest_of
from tests.support.environment import ROOT
from tolstat import joint, sampling, study
from tolstat.common.load_kinds import SPAN
from tolstat.common.tables import Method, Options
from tolstat.solver.reference import FirstOrder, Largest, first_order
from tolstat.solver.simulation import simulate_rows

STUDY = ROOT / "studies" / "rigid_shafts.toml"
ROWS, REVOLUTIONS, LIMIT = (2, 5, 9), 6, 200.0
ANGLES = 23_040
"""At which the loads of others are looked at: spikes of impacts last a degree."""
CODES: dict[Code, tuple[float, ...]] = {"CVODE": (1e-3, 1e-4, 1e-5, 1e-6), "Radau": (1e-3,)}
LANES = 64
"""Joints that the solver is given at once, as a campaign does; their time is shared."""


def explicit(system: FirstOrder, rtol: float) -> tuple[Largest, float]:
    """Solve with scipy's RK45; largest loads of the last revolution, and CPU seconds."""
    begin = time.process_time()
    first = system.t0 + (REVOLUTIONS - 1) * system.period
    settings = {"method": "RK45", "rtol": rtol, "atol": rtol * system.scale}
    y = scipy.integrate.solve_ivp(system.rate, (system.t0, first), system.y0, **settings).y[:, -1]
    found = scipy.integrate.solve_ivp(system.rate, (first, first + system.period), y, **settings)
    return system.largest(found.t, np.ascontiguousarray(found.y.T)), time.process_time() - begin


def error(found: Largest | None, true: Largest) -> float:
    """Largest error of a largest load, relative to the largest of its kind."""
    if found is None:
        return np.nan
    return max(
        float(np.abs(a - b).max() / b.max()) for a, b in ((found[SPAN[kind]], true[SPAN[kind]]) for kind in "FT")
    )


def show(name: str, errors: list[float], seconds: list[float]) -> None:
    """One line: errors of each joint, and the mean time of one."""
    print(f"| {name} | {', '.join(f'{e:.1e}' for e in errors)} | {np.mean(seconds):.2f} |", flush=True)


def main() -> None:
    """Print the table."""
    plan = study.load(STUDY, n=LANES + 1)
    params: NDArray[np.void] = joint.perturb(plan.joint, plan.operation, sampling.draw(plan)[1:])
    params["alpha"][:, 0], params["omega"] = np.radians(30), 1500 * np.pi / 30
    mine = params[list(ROWS)]
    systems = [first_order(mine[i : i + 1], Options(max_refinements=0), from_start=True) for i in range(len(ROWS))]
    true = [explicit(system, 1e-7)[0] for system in systems]
    print("| method | errors | s a joint |\n|---|---|---|")
    uniform = Options(max_refinements=0)
    own = {"default, in lanes": Options()}
    own |= {f"BDF2, {n} steps": uniform._replace(steps_per_rev=n) for n in (180, 720, 2880)}
    own |= {
        f"TR-BDF2, {n} steps": uniform._replace(steps_per_rev=n, method=int(Method.TR_BDF2))
        for n in (2880, 11_520, 20_000)
    }
    for name, options in own.items():
        given = params if "lanes" in name else mine
        simulate_rows(given[:1], options)
        begin = time.process_time()
        results = simulate_rows(given, options).results
        seconds = (time.process_time() - begin) / len(given)
        rows = results[list(ROWS)] if "lanes" in name else results
        show(name, [error(largest_of(row), best) for row, best in zip(rows, true, strict=True)], [seconds])
    for rtol in (1e-3, 1e-4, 1e-5, 1e-6):
        runs = [explicit(system, rtol) for system in systems]
        errors = [error(run[0], best) for run, best in zip(runs, true, strict=True)]
        show(f"RK45 (scipy), {rtol:.0e}", errors, [run[1] for run in runs])
    for code, rtols in CODES.items():
        for rtol in rtols:
            found = [solve(system, Integrator(code, True), rtol, REVOLUTIONS, LIMIT, ANGLES) for system in systems]
            errors = [error(run.largest, best) for run, best in zip(found, true, strict=True)]
            show(f"{code}, our Jacobian, {rtol:.0e}", errors, [run.seconds for run in found])


if __name__ == "__main__":
    main()
