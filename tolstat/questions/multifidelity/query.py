"""A campaign at two fidelities: two ordinary result files of the same joints, evaluated together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from tolstat.analysis import multifidelity
from tolstat.analysis.multifidelity import Allocation, Pairs
from tolstat.analysis.sample_load import SampleLoad
from tolstat.campaign import run as campaign
from tolstat.campaign.blocks import Execution
from tolstat.campaign.extend import grow
from tolstat.campaign.plan import simulate_timed
from tolstat.common.errors import Fault, InputError, StoreError, gather
from tolstat.common.loads import SHOWN_LOADS, UNIT_OF_LOAD
from tolstat.common.shown import shown
from tolstat.common.strict import did_you_mean, validate
from tolstat.display.progress import Reporter, note, silent
from tolstat.joint import perturb
from tolstat.joint.ideal import NO_CLOSED_FORM
from tolstat.sampling import draw, draw_blocks
from tolstat.store import ResultFile, Writer
from tolstat.store.recorded import perturbed
from tolstat.study import Study
from tolstat.study.model import Solver

NAMES = ("high", "low")
SHARES = (0.5, 0.9, 0.99)
MAX_TIMED = 64
"""Maximum number of joints simulated to measure the cost of a fidelity."""


@shown
class TwoFidelities(NamedTuple):
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


class _Plan(NamedTuple):
    """One of the two campaigns: its study, its file, and the number of joints of the pilot."""

    study: Study
    path: Path
    pilot: int


class _Loads(NamedTuple):
    """Loads asked for by name, of the joints of both files; both draw the same joints, row by row."""

    high: dict[str, SampleLoad]
    low: dict[str, SampleLoad]
    costs: tuple[float, float]

    def pairs(self, name: str) -> Pairs:
        return Pairs(self.high[name].valid_or_nan, self.low[name].valid_or_nan, *self.costs)


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
        remedy = 'write "dynamic" or, with steps per revolution, "quasistatic:36"'
        raise InputError([Fault(place, f"{text!r} is not a fidelity", remedy)])
    if fidelity == "ideal" and study.has_axial_force:
        raise InputError([Fault(place, *NO_CLOSED_FORM)])
    return validate(Solver, own | ({"steps_per_rev": int(steps)} if colon else {}), place)


def two_fidelities(
    study: Study,
    low: str,
    high: str,
    folder: Path,
    budget: float,
    pilot: int = 128,
    by: str | None = None,
    workers: int | None = None,
    tell: Callable[[str], None] = note,
    stage: Callable[[str], None] = silent,
    progress: Reporter | None = None,
) -> TwoFidelities:
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
    stage : callable
        Called with the name of each stage when it begins.
    progress : callable, optional
        Called with the counts of the joints of each file while they are simulated.

    Returns
    -------
    TwoFidelities

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
    plans = _plans(study, low, high, folder, pilot)
    names = study.asked or list(SHOWN_LOADS)
    by = names[0] if by is None else by
    if by not in names:
        raise InputError([Fault("--by", f"{by!r} is not a load that the study asks for", did_you_mean(by, names))])
    held = [_simulate(plan, workers, name, stage, progress) for plan, name in zip(plans, NAMES, strict=True)]
    stage("cost of a joint")
    costs = _cost(plans[0]), _cost(plans[1])
    allocation = _allocate(_read(plans, [by], costs).pairs(by), pilot)
    tell(_sentence(allocation, by, *costs))
    if allocation.gain > 1.0 and max(held) == pilot:
        # extend both files before simulating, so that an interrupted run resumes with the numbers of joints chosen
        for plan, n in zip(plans, allocation.joints(budget, *costs, pilot), strict=True):
            _extend(plan, n)
        for plan, name in zip(plans, NAMES, strict=True):
            _simulate(plan, workers, name, stage, progress)
    loads = _read(plans, names, costs)
    joints = len(loads.high[by].values), len(loads.low[by].values)
    table = _table(loads, study.limits)
    return TwoFidelities(table, allocation, *costs, *joints, (plans[0].path, plans[1].path))


def _plans(study: Study, low: str, high: str, folder: Path, pilot: int) -> tuple[_Plan, _Plan]:
    """Campaigns at the high and at the low fidelity."""
    faults: list[Fault] = []
    solvers = []
    for place, text in (("high", high), ("low", low)):
        with gather(faults):
            solvers.append(solver_of(study, text, place))
    if len(solvers) == 2 and solvers[0] == solvers[1]:
        faults.append(Fault("low", f"{low!r} is the same as {high!r}", "give a cheaper one"))
    if study.sampling.method != "random":
        found = f"is {study.sampling.method!r}: the intervals hold for independent samples only"
        faults.append(study.fault("sampling.method", found, 'use "random"'))
    if study.sampling.joints_per_lot > 1:
        found = "makes joints depend on one another: the intervals hold for independent samples only"
        faults.append(study.fault("sampling.joints_per_lot", found, "remove it"))
    if faults:
        raise InputError(faults)
    output = study.output.model_copy(update={"histories": "none"})
    plans = [
        _Plan(replace(study, solver=solver, output=output), folder / f"{study.name}_{name}.h5", pilot)
        for solver, name in zip(solvers, NAMES, strict=True)
    ]
    return plans[0], plans[1]


def _simulate(
    plan: _Plan, workers: int | None, name: str, stage: Callable[[str], None], progress: Reporter | None
) -> int:
    """Simulate the pending joints of a file, a new one with the joints of the pilot; return its number of joints."""
    n = plan.pilot
    if plan.path.exists():
        with ResultFile.open(plan.path) as store:
            n = store.n - store.first_sample
    stage(f"{name} fidelity")
    campaign.run(_sized(plan.study, n), plan.path, execution=Execution(workers=workers), check=False, progress=progress)
    return n


def _extend(plan: _Plan, n: int) -> None:
    """Extend a file to `n` joints; the new ones are pending."""
    study = _sized(plan.study, n)
    with Writer.open(plan.path) as store:
        more = range(store.n, study.rows)
        if more:
            grow(store, study, draw_blocks(plan.study, more))


def _sized(study: Study, n: int) -> Study:
    return replace(study, sampling=study.sampling.model_copy(update={"n": n}))


def _cost(plan: _Plan) -> float:
    """Measured cost, seconds of one core per joint."""
    study, first = plan.study, plan.study.first_sample
    rows = np.arange(first, first + min(plan.pilot, MAX_TIMED))
    params = perturbed(study, rows, draw(study, range(rows[0], rows[-1] + 1)), perturb)
    return simulate_timed(study, params, [study.solver.options()] * len(rows))[1] / len(rows)


def _allocate(pairs: Pairs, pilot: int) -> Allocation:
    """Split of the work from the pilot: the first joints of both files, those with both loads."""
    high, low = pairs.high[:pilot], pairs.low[:pilot]
    both = np.isfinite(high) & np.isfinite(low)
    return multifidelity.allocate(high[both], low[both], pairs.cost_high, pairs.cost_low)


def _sentence(allocation: Allocation, by: str, cost_high: float, cost_low: float) -> str:
    costs = f"{1e3 * cost_high:.3g} and {1e3 * cost_low:.3g} ms per joint, correlation of {by} {allocation.rho:.4f}"
    if not allocation.gain > 1.0:
        return f"no gain: {costs}; the high fidelity alone is as good or better"
    ratio = f"{allocation.ratio:.3g} joints at low fidelity for each at high fidelity"
    return f"{costs}: {ratio}; gain {allocation.gain:.3g}"


def _read(plans: tuple[_Plan, _Plan], names: Sequence[str], costs: tuple[float, float]) -> _Loads:
    """Read loads of both files."""
    found = []
    for plan in plans:
        with ResultFile.open(plan.path) as store:
            view = store.view()
            found.append({load.name: load for load in view.loads(names)})
    high, low = found
    if len(high[names[0]].values) > len(low[names[0]].values):
        fault = Fault(str(plans[1].path), f"has fewer joints than {plans[0].path}", "give another folder: --out OTHER")
        raise StoreError(str(fault))
    return _Loads(high, low, costs)


def _table(loads: _Loads, limits: dict[str, float]) -> pd.DataFrame:
    rows = []
    for name in loads.high:
        pairs = loads.pairs(name)
        found = [("mean", np.nan, multifidelity.mean(pairs))]
        found += [("quantile", share, multifidelity.quantile(pairs, share)) for share in SHARES]
        if name in limits:
            found.append(("share above", limits[name], multifidelity.share_above(pairs, limits[name])))
        unit = UNIT_OF_LOAD[name]
        rows += [{"load": name, "unit": unit, "statistic": s, "at": at} | e._asdict() for s, at, e in found]
    return pd.DataFrame(rows)
