"""A campaign at two fidelities: two ordinary result files of the same joints, evaluated together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from tolstat.analysis import multifidelity
from tolstat.analysis.multifidelity import Allocation, Pairs
from tolstat.campaign import run as campaign
from tolstat.campaign.blocks import Execution
from tolstat.campaign.extend import grow
from tolstat.campaign.plan import simulate_timed
from tolstat.campaign.progress import note
from tolstat.common.errors import Fault, InputError, StoreError, gather
from tolstat.common.loads import BUSHING_LOADS, LOAD_FIELDS, UNIT_OF_LOAD
from tolstat.common.strict import did_you_mean, validate
from tolstat.common.tables import VALID
from tolstat.joint import perturb
from tolstat.sampling import draw, draw_blocks
from tolstat.store import ResultStore, view
from tolstat.store.recorded import perturbed
from tolstat.store.view import Campaign
from tolstat.study import Study
from tolstat.study.model import Solver

SHARES = (0.5, 0.9, 0.99)
TIMED = 64
"""Maximum number of joints simulated to measure the cost of a fidelity."""


class Found(NamedTuple):
    """Result of a campaign at two fidelities.

    Attributes
    ----------
    table : DataFrame
        One row per statistic: ``load``, ``unit``, ``statistic`` (``mean``, ``quantile``, ``share above``), ``at``
        (share or level), then the fields of `analysis.multifidelity.Estimate`. Loads in SI units.
    allocation : Allocation
        Allocation of the work, computed from the pilot.
    cost_high, cost_low : float
        Measured cost, seconds of one core per joint.
    high, low : int
        Number of joints at each fidelity.
    files : tuple of Path
        Result files, that of the high fidelity first.
    """

    table: pd.DataFrame
    allocation: Allocation
    cost_high: float
    cost_low: float
    high: int
    low: int
    files: tuple[Path, Path]


def solver_of(study: Study, text: str, place: str) -> Solver:
    """Solver settings from a text such as ``"quasistatic:36"``: fidelity and, if given, steps per revolution.

    Raises
    ------
    InputError
        When the text is not of this form.
    """
    fidelity, colon, steps = text.partition(":")
    own = study.solver.model_dump(exclude_unset=True, exclude={"error_budget"}) | {"fidelity": fidelity}
    if fidelity == "auto" or (colon and not steps.isdecimal()):
        raise InputError([Fault(place, f"{text!r} is no fidelity", "write dynamic, quasistatic:36 or so")])
    return validate(Solver, own | ({"steps_per_rev": int(steps)} if colon else {}), place)


def run(
    study: Study,
    low: str,
    high: str,
    folder: Path,
    budget: float,
    pilot: int = 128,
    by: str | None = None,
    workers: int | None = None,
    tell: Callable[[str], None] = note,
) -> Found:
    """Simulate a study at two fidelities and combine the results.

    Parameters
    ----------
    study : Study
        Study of independent joints; its number of joints is ignored.
    low, high : str
        Cheap fidelity, and the one that the statistics refer to, such as ``"quasistatic:36"``; see `solver_of`.
    folder : Path
        Existing folder of ``STUDY_high.h5`` and ``STUDY_low.h5``, which are created if missing. Files with more joints
        than the pilot, as after an interruption, are completed and evaluated but not extended again.
    budget : float
        Time of one core for all joints together, seconds.
    pilot : int
        Number of joints first simulated at both fidelities, from which the work is allocated.
    by : str, optional
        Load for whose mean the allocation is optimal; by default the first that the study asks for.
    workers : int, optional
        Number of processes; does not affect results. The budget counts the time of one core in any case.
    tell : callable, optional
        Receives a sentence on the allocation.

    Returns
    -------
    Found

    Raises
    ------
    InputError
        When a fidelity is invalid or both are the same, the joints are not independent samples, or the study does not
        ask for the load.
    StoreError
        When a file is of another study, or that of the high fidelity has more joints.
    Interrupted, WorkerDied
        As `campaign.run`; the same call resumes.
    """
    solvers = _solvers(study, low, high)
    asked = study.asked or list(BUSHING_LOADS)
    by = asked[0] if by is None else by
    if study.sampling.method != "random":
        found = f"is {study.sampling.method!r}: only independent samples have such intervals"
        raise InputError([Fault(f"{study.path}: sampling.method", found, 'use "random"')])
    if by not in asked:
        raise InputError([Fault("--by", f"{by!r} is no load that the study asks for", did_you_mean(by, asked))])
    output = study.output.model_copy(update={"histories": "none"})
    plans = [replace(study, solver=solver, output=output) for solver in solvers]
    paths = folder / f"{study.name}_high.h5", folder / f"{study.name}_low.h5"
    held = [_simulate(plan, path, pilot, workers) for plan, path in zip(plans, paths, strict=True)]
    costs = _cost(plans[0], pilot), _cost(plans[1], pilot)
    pairs = _pairs(_read(paths), by, costs)
    both = np.isfinite(pairs.high[:pilot]) & np.isfinite(pairs.low[:pilot])
    allocation = multifidelity.allocate(pairs.high[:pilot][both], pairs.low[:pilot][both], *costs)
    tell(_sentence(allocation, by, *costs))
    if allocation.gain > 1.0 and max(held) == pilot:
        # extend both files before simulating, so that an interrupted run resumes with the numbers of joints chosen
        for plan, path, n in zip(plans, paths, allocation.joints(budget, *costs, pilot), strict=True):
            _extend(plan, path, n)
        for plan, path in zip(plans, paths, strict=True):
            _simulate(plan, path, pilot, workers)
    whole = _read(paths)
    joints = len(whole[0].results), len(whole[1].results)
    return Found(_table(whole, asked, study.limits, costs), allocation, *costs, *joints, paths)


def _solvers(study: Study, low: str, high: str) -> tuple[Solver, Solver]:
    """Settings of the high and of the low fidelity."""
    faults: list[Fault] = []
    found = []
    for place, text in (("high", high), ("low", low)):
        with gather(faults):
            found.append(solver_of(study, text, place))
    if len(found) == 2 and found[0] == found[1]:
        faults.append(Fault("low", f"{low!r} is the same as {high!r}", "give a cheaper one"))
    if faults:
        raise InputError(faults)
    return found[0], found[1]


def _simulate(plan: Study, path: Path, n: int, workers: int | None) -> int:
    """Simulate the pending joints of a file (`n` joints if it is new); return its number of joints."""
    if path.exists():
        with ResultStore.open(path) as store:
            n = store.n - int(plan.sampling.nominal_first)
    campaign.run(_sized(plan, n), path, execution=Execution(workers=workers), check=False)
    return n


def _extend(plan: Study, path: Path, n: int) -> None:
    """Extend a file to `n` joints; the new ones are pending."""
    with ResultStore.open(path, "r+") as store:
        more = range(store.n, n + int(plan.sampling.nominal_first))
        if more:
            grow(store, _sized(plan, n), draw_blocks(plan, more))


def _sized(plan: Study, n: int) -> Study:
    return replace(plan, sampling=plan.sampling.model_copy(update={"n": n}))


def _cost(plan: Study, pilot: int) -> float:
    """Measured cost, seconds of one core per joint."""
    first = int(plan.sampling.nominal_first)
    rows = np.arange(first, first + min(pilot, TIMED))
    params = perturbed(plan, rows, draw(plan, range(rows[0], rows[-1] + 1)), perturb)
    return simulate_timed(plan, params, [plan.solver.options()] * len(rows))[1] / len(rows)


def _sentence(allocation: Allocation, by: str, cost_high: float, cost_low: float) -> str:
    costs = f"{1e3 * cost_high:.3g} and {1e3 * cost_low:.3g} ms a joint, correlation of {by} {allocation.rho:.4f}"
    if not allocation.gain > 1.0:
        return f"no gain: {costs}; the high fidelity alone is as good or better"
    return f"{costs}: {allocation.ratio:.3g} joints of the low fidelity for one of the high; gain {allocation.gain:.3g}"


def _read(paths: tuple[Path, Path]) -> tuple[Campaign, Campaign]:
    """Loads of the joints of both files, the high fidelity first."""
    found = []
    for path in paths:
        with ResultStore.open(path) as store:
            found.append(view.read(store, LOAD_FIELDS, ()))
    if len(found[0].results) > len(found[1].results):
        raise StoreError(str(Fault(str(paths[1]), f"has fewer joints than {paths[0]}", "make both anew")))
    return found[0], found[1]


def _pairs(campaigns: tuple[Campaign, Campaign], name: str, costs: tuple[float, float]) -> Pairs:
    """Pairs of a load, NaN where not valid; both files have one study and seed, so row i is the same joint."""
    high, low = (
        np.where(np.isin(held.results["status"], VALID), view.load(held.results, name)[0], np.nan) for held in campaigns
    )
    return Pairs(high, low, *costs)


def _table(
    campaigns: tuple[Campaign, Campaign], asked: list[str], limits: dict[str, float], costs: tuple[float, float]
) -> pd.DataFrame:
    rows = []
    for name in asked:
        pairs = _pairs(campaigns, name, costs)
        found = [("mean", np.nan, multifidelity.mean(pairs))]
        found += [("quantile", share, multifidelity.quantile(pairs, share)) for share in SHARES]
        if name in limits:
            found.append(("share above", limits[name], multifidelity.share_above(pairs, limits[name])))
        unit = UNIT_OF_LOAD[name]
        rows += [{"load": name, "unit": unit, "statistic": s, "at": at} | e._asdict() for s, at, e in found]
    return pd.DataFrame(rows)
