"""``solver.fidelity = "auto"``: the cheapest rung of the fidelity ladder that a pilot shows to be good enough.

A few joints of the campaign are solved on every rung and on a finer one, the reference. Cost is counted, not timed, so
that the same study chooses the same rung on a loaded machine.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.cardan import CARDAN
from tolstat.common.load_kinds import measure_of
from tolstat.common.loads import FloatArray, Load, load_of, of_kind, shown_loads
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import FINEST_STEPS, Fidelity, Options, Simulation, Status


class Rung(NamedTuple):
    """A fidelity and the steps a revolution that it takes."""

    fidelity: Fidelity
    steps_per_rev: int

    def __str__(self) -> str:
        return f"{self.fidelity.name.lower()} at {self.steps_per_rev} steps a revolution"


RUNGS = (
    Rung(Fidelity.IDEAL, 90),
    *(Rung(Fidelity.QUASISTATIC, steps) for steps in (36, 60, 90, 180)),
    *(Rung(Fidelity.DYNAMIC, steps) for steps in (36, 60, 90, 180, FINEST_STEPS)),
)
REFERENCE = Rung(Fidelity.DYNAMIC, 2 * FINEST_STEPS)
JOINTS = 24
"""Random joints of a pilot, beside the nominal one."""
MARGIN = 1.5
"""Factor on the worst error of the pilot before it is compared with the budget: a campaign has worse joints than a
pilot of two dozen."""
MICROSECONDS = {"steps": 2.3, "newton_iterations": 2.6, "factorisations": 4.3}
"""Cost of each count, microseconds of one core, fitted over fidelities and steps a revolution."""


def pilot(rows: int, first_sample: int, seed: int) -> NDArray[np.intp]:
    """Select the rows of the pilot: the nominal joint, if the campaign has one, and random others; ascending."""
    samples = rows - first_sample
    drawn = np.random.default_rng([seed, JOINTS]).choice(samples, min(JOINTS, samples), replace=False)
    return np.sort(np.concatenate([np.arange(first_sample), first_sample + drawn])).astype(np.intp)


def choose(
    params: NDArray[np.void],
    options: Options,
    budget: float,
    loads: Sequence[str],
    simulate: Callable[..., Simulation],
    min_steps: int = 0,
    closed_form: bool = True,
    mechanism: Mechanism = CARDAN,
) -> dict[str, Any]:
    """Choose a rung by a pilot of joints.

    A rung is good enough when the error of every load asked for, times `MARGIN`, is within the budget for every joint
    of the pilot that settles in the reference, and when every joint ends with the same status as in the reference.
    Errors are relative to the joint's largest load of the measure. Where no rung is good enough, the finest is taken.

    Parameters
    ----------
    params : ndarray of PARAM, shape (n,)
        The joints of the pilot.
    options : Options
        Numerical settings; fidelity and steps a revolution are replaced.
    budget : float
        Largest error allowed.
    loads : sequence of str
        Loads asked for: ``cross1.F``, ``fork3.T``, ``pin1.contact``, ``psi``; all forces and torques if none.
    mechanism : Mechanism
        What the joints are.
    simulate : callable
        (n,) table PARAM, Options -> Simulation.
    min_steps : int
        Minimum number of steps a revolution, as load histories need it.
    closed_form : bool
        Whether the joints of the campaign have closed forms, see `ideal.check`.

    Returns
    -------
    dict
        The choice and what was measured, as the result file keeps it: ``fidelity``, ``steps_per_rev``, whether they
        ``met`` the ``budget``, ``reason``, ``margin``, ``joints``, ``loads`` and, by rung, ``table``.
    """
    names = tuple(loads) or shown_loads(mechanism)
    truth = simulate(params, _at(options, REFERENCE)).results
    able = RUNGS if closed_form else [rung for rung in RUNGS if rung.fidelity != Fidelity.IDEAL]
    rungs = [rung for rung in able if rung.steps_per_rev >= min_steps]
    asked = [load_of(name, mechanism) for name in names]
    table = [_entry(rung, simulate(params, _at(options, rung)).results, truth, asked) for rung in rungs]
    settled = [entry for entry in table if entry["differing"] == 0 and entry["worst"] is not None]
    good = [entry for entry in settled if MARGIN * entry["worst"] <= budget]
    best = min(good, key=lambda entry: float(entry["cost"]), default=table[-1])
    rung, worst = Rung(Fidelity[best["fidelity"].upper()], best["steps_per_rev"]), _figure(best["worst"])
    reason = (
        f"auto: {rung}, the cheapest with {MARGIN:g} x worst error {worst} of {len(params)} joints within {budget:g}"
        if good
        else f"warning: auto: no rung meets the error budget {budget:g} over {len(params)} joints; "
        f"the finest is used, {rung} (worst error {worst})\n"
        '  hint: give a larger solver.error_budget, or fidelity = "dynamic" with more steps_per_rev'
    )
    return {
        "fidelity": best["fidelity"],
        "steps_per_rev": best["steps_per_rev"],
        "met": bool(good),
        "reason": reason,
        "budget": budget,
        "margin": MARGIN,
        "joints": len(params),
        "loads": list(names),
        "table": table,
    }


def apply(options: Options, record: Mapping[str, Any]) -> Options:
    """Return the options with the rung on record."""
    return _at(options, Rung(Fidelity[record["fidelity"].upper()], record["steps_per_rev"]))


def describe(record: Mapping[str, Any]) -> str:
    """Format the choice and its table of error against cost as aligned text, one line per rung; empty without one."""
    if not record:
        return ""
    lines = [str(record["reason"]), "  rung              worst error    cost  other status"]
    for entry in record["table"]:
        name = f"{entry['fidelity']} {entry['steps_per_rev']}"
        lines.append(f"  {name:<17} {_figure(entry['worst']):>11} {entry['cost']:>7.0f} {entry['differing']:>13}")
    return "\n".join(lines)


def sentence(options: Mapping[str, Any], record: Mapping[str, Any]) -> str:
    """Fidelity of the numbers in a file, for its report; empty for dynamic fidelity at steps that the user gave."""
    if record:
        return str(record["reason"])
    rung = Rung(Fidelity[options["fidelity"].upper()], options["steps_per_rev"])
    return "" if rung.fidelity == Fidelity.DYNAMIC else f"fidelity: {rung}"


def _at(options: Options, rung: Rung) -> Options:
    return options._replace(fidelity=int(rung.fidelity), steps_per_rev=rung.steps_per_rev)


def _entry(rung: Rung, results: NDArray[np.void], truth: NDArray[np.void], loads: Sequence[Load]) -> dict[str, Any]:
    """Error and cost of the pilot on one rung; the error is None if no joint settled."""
    settled = (results["status"] == Status.OK) & (truth["status"] == Status.OK)
    errors = [_error(results[settled], truth[settled], load) for load in loads]
    return {
        "fidelity": rung.fidelity.name.lower(),
        "steps_per_rev": rung.steps_per_rev,
        "worst": float(np.max(errors)) if settled.any() else None,
        "cost": sum(cost * float(results[name].mean()) for name, cost in MICROSECONDS.items()),
        "differing": int((results["status"] != truth["status"]).sum()),
    }


def _error(results: NDArray[np.void], truth: NDArray[np.void], load: Load) -> FloatArray:
    """Error of a load of each joint, relative to the largest load of its measure, (n,)."""
    change = np.abs(load.of(results) - load.of(truth))
    scale = of_kind(truth, measure_of(load.kind)).max(axis=1)
    error: FloatArray = np.divide(change, scale, out=np.where(change > 0, np.inf, 0.0), where=scale > 0)
    return error


def _figure(value: float | None) -> str:
    return "-" if value is None else f"{value:.1e}"
