"""A campaign at two fidelities: two ordinary result files of the same joints, and what they tell together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from tolstat import campaign
from tolstat.analysis import multifidelity
from tolstat.analysis.exceedance import FloatArray
from tolstat.analysis.multifidelity import Allocation, Pairs
from tolstat.combine import grow
from tolstat.errors import Fault, InputError, StoreError
from tolstat.execution import Execution
from tolstat.joint import perturb
from tolstat.plan import simulate_timed
from tolstat.progress import note
from tolstat.recorded import perturbed
from tolstat.report import source
from tolstat.sampling import draw, draw_blocks
from tolstat.schema import did_you_mean, validate
from tolstat.store import ResultStore
from tolstat.study import Study
from tolstat.study.model import Solver
from tolstat.study.selection import LIMIT_UNITS
from tolstat.tables import Status

SHARES = (0.5, 0.9, 0.99)
TIMED = 64
"""Joints that the cost of a fidelity is measured on."""


class Found(NamedTuple):
    """What two fidelities came to.

    Attributes
    ----------
    table : DataFrame
        One row a statistic: ``load``, ``unit``, ``statistic`` (``mean``, ``quantile``, ``share above``), ``at`` (share
        or level), then the fields of `analysis.multifidelity.Estimate`. Loads in SI units.
    allocation : Allocation
        Of the pilot.
    cost_high, cost_low : float
        Measured, seconds of one core a joint.
    high, low : int
        Joints.
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
    """Settings that ``"quasistatic:36"`` stands for: fidelity and, where given, steps a revolution.

    Raises
    ------
    InputError
        When it is something else.
    """
    fidelity, colon, steps = text.partition(":")
    own = study.solver.model_dump(exclude_unset=True, exclude={"error_budget"}) | {"fidelity": fidelity}
    if fidelity == "auto" or (colon and not steps.isdecimal()):
        raise InputError([Fault(place, f"{text!r} is no fidelity", "write dynamic, quasistatic:36 or so")])
    return validate(Solver, own | ({"steps_per_rev": int(steps)} if colon else {}), place)


def run(
    study: Study,
    low: Solver,
    high: Solver,
    folder: Path,
    budget: float,
    pilot: int = 128,
    by: str | None = None,
    workers: int | None = None,
    tell: Callable[[str], None] = note,
) -> Found:
    """Simulate a study at two fidelities and put them together.

    Parameters
    ----------
    study : Study
        Of independent joints; its number of joints is of no account.
    low, high : Solver
        Cheap settings, and those that statistics are asked of.
    folder : Path
        Where ``STUDY_high.h5`` and ``STUDY_low.h5`` are, or are made. Files with more joints than the pilot are
        finished and evaluated, as after an interruption; they are not made larger again.
    budget : float
        Time of one core for all joints together, seconds.
    pilot : int
        Joints simulated at both fidelities, by which the work is shared.
    by : str, optional
        Load whose mean the sharing is best for; the first that the study asks for without it.
    workers : int, optional
        Processes, which change no number; the budget is of one core all the same.
    tell : callable, optional
        Told how the work is shared.

    Returns
    -------
    Found

    Raises
    ------
    InputError
        When the joints are not independent samples, or the study does not keep the load.
    StoreError
        When a file is of another study, or the two are not of the same joints.
    """
    asked = study.asked or list(source.LOADS)
    by = asked[0] if by is None else by
    if study.sampling.method != "random":
        found = f"is {study.sampling.method!r}: only independent samples have such intervals"
        raise InputError([Fault(f"{study.path}: sampling.method", found, 'use "random"')])
    if by not in asked:
        raise InputError([Fault("--by", f"{by!r} is no load that the study asks for", did_you_mean(by, asked))])
    output = study.output.model_copy(update={"histories": "none"})
    plans = [replace(study, solver=solver, output=output) for solver in (high, low)]
    paths = folder / f"{study.name}_high.h5", folder / f"{study.name}_low.h5"
    held = [_simulate(plan, path, pilot, workers) for plan, path in zip(plans, paths, strict=True)]
    cost_high, cost_low = (_cost(plan, pilot) for plan in plans)
    pairs = _pairs(paths, by, cost_high, cost_low)
    both = np.isfinite(pairs.high[:pilot]) & np.isfinite(pairs.low[:pilot])
    allocation = multifidelity.allocate(pairs.high[:pilot][both], pairs.low[:pilot][both], cost_high, cost_low)
    tell(_sentence(allocation, by, cost_high, cost_low))
    if allocation.gain > 1.0 and max(held) == pilot:
        wanted = allocation.joints(budget, cost_high, cost_low, pilot)
        for plan, path, n in zip(plans, paths, wanted, strict=True):
            _simulate(plan, path, n, workers)
    table = _table(paths, asked, study.limits, cost_high, cost_low)
    counted = _pairs(paths, by, cost_high, cost_low)
    return Found(table, allocation, cost_high, cost_low, counted.high.size, counted.low.size, paths)


def _simulate(plan: Study, path: Path, n: int, workers: int | None) -> int:
    """Give a file `n` joints at least, and simulate those that are pending; how many it has."""
    first = int(plan.sampling.nominal_first)
    if path.exists():
        with ResultStore.open(path, "r+") as store:
            held = store.n
            if held < n + first:
                grow(store, _sized(plan, n), draw_blocks(plan, range(held, n + first)))
            n = max(n, held - first)
    campaign.run(_sized(plan, n), path, execution=Execution(workers=workers), check=False)
    return n


def _sized(plan: Study, n: int) -> Study:
    return replace(plan, sampling=plan.sampling.model_copy(update={"n": n}))


def _cost(plan: Study, pilot: int) -> float:
    """Seconds of one core a joint, measured."""
    first = int(plan.sampling.nominal_first)
    rows = np.arange(first, first + min(pilot, TIMED))
    params = perturbed(plan, rows, draw(plan, range(rows[0], rows[-1] + 1)), perturb)
    return simulate_timed(plan, params, [plan.solver.options()] * len(rows))[1] / len(rows)


def _sentence(allocation: Allocation, by: str, cost_high: float, cost_low: float) -> str:
    costs = f"{1e3 * cost_high:.3g} and {1e3 * cost_low:.3g} ms a joint, correlation of {by} {allocation.rho:.4f}"
    if not allocation.gain > 1.0:
        return f"no gain: {costs}; the high fidelity alone is as good or better"
    return f"{costs}: {allocation.ratio:.3g} joints of the low fidelity for one of the high; gain {allocation.gain:.3g}"


def _load(path: Path, name: str) -> tuple[FloatArray, np.ndarray[tuple[int], np.dtype[np.void]]]:
    """Load of each joint, NaN where it is not valid, and the joints' errors."""
    with ResultStore.open(path) as store:
        held = source.read(store)
    values = source.load(held.results, name)[0]
    return np.where(held.results["status"] == Status.OK, values, np.nan), held.errors


def _pairs(paths: tuple[Path, Path], name: str, cost_high: float, cost_low: float) -> Pairs:
    (high, errors), (low, others) = (_load(path, name) for path in paths)
    if high.size > low.size or (errors != others[: len(errors)]).any():
        found = f"{paths[0]} has other joints"
        raise StoreError(str(Fault(str(paths[1]), found, "make both anew with one command")))
    return Pairs(high, low, cost_high, cost_low)


def _table(
    paths: tuple[Path, Path], asked: list[str], limits: dict[str, float], cost_high: float, cost_low: float
) -> pd.DataFrame:
    rows = []
    for name in asked:
        pairs = _pairs(paths, name, cost_high, cost_low)
        found = [("mean", np.nan, multifidelity.mean(pairs))]
        found += [("quantile", share, multifidelity.quantile(pairs, share)) for share in SHARES]
        if name in limits:
            found.append(("share above", limits[name], multifidelity.share_above(pairs, limits[name])))
        unit = LIMIT_UNITS[name]
        rows += [{"load": name, "unit": unit, "statistic": s, "at": at} | e._asdict() for s, at, e in found]
    return pd.DataFrame(rows)
