"""Ratios to other integrators at the same error, on the same joints and in the same run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tolstat.benchmarks.integrators import Code, both_ways, has_cvode
from tolstat.benchmarks.joints import Params, choose
from tolstat.benchmarks.points import build, cheapest
from tolstat.benchmarks.runs import TRUTH, Job, OtherJob, OwnJob, TruthJob, run
from tolstat.common.tables import Fidelity, Method, Options, Start

if TYPE_CHECKING:
    import pandas as pd

    from tolstat.study import Study

ERROR = 1e-3
"""Error of the largest loads at which times are compared: of the worst joint, relative to its largest load."""
STEPS = (24, 36, 60, 90, 180, 360)
"""Steps a revolution of tolstat, beside those of the study; the cheapest that meets `ERROR` counts."""
RTOL = (1e-2, 1e-3, 1e-4, 1e-5)
"""Relative tolerances of the other integrators, of which the cheapest that meets `ERROR` counts."""
REVOLUTIONS = 2
"""Revolutions that the other integrators compute; the last one counts."""
TRUTH_RTOL = (1e-7, 1e-6)
BLOCK, REPEATS, SEED = 64, 5, 4
IN_LANES = f"BDF2, {BLOCK} joints at once"


@dataclass(frozen=True)
class Contender:
    """An integrator at the cheapest of its settings that meets the error.

    Attributes
    ----------
    name : str
        Name of the integrator.
    ours : bool
        Whether it is tolstat.
    setting : float or None
        Steps a revolution, or relative tolerance; None if no setting met the error.
    ms : float
        CPU time of the median joint, ms; if no setting met the error, that of the slowest setting, a lower bound.
    error : float or None
        Error of the worst joint; None if no setting met the error.
    ratio : float
        `ms` over that of tolstat in lanes at its cheapest setting.
    ratio_default : float
        `ms` over that of tolstat in lanes with the study's own settings.
    """

    name: str
    ours: bool
    setting: float | None
    ms: float
    error: float | None
    ratio: float
    ratio_default: float


@dataclass(frozen=True)
class Comparison:
    """Times of all contenders at one error.

    Attributes
    ----------
    joints : int
        Number of joints compared, those with a truth.
    error : float
        Required error.
    contenders : list of Contender
        Tolstat's first.
    """

    joints: int
    error: float
    contenders: list[Contender]


def compare(study: Study, joints: int, limit: float, say: Callable[[str], None]) -> Comparison:
    """Solve some joints with tolstat and with other integrators at several settings.

    Parameters
    ----------
    study : Study
        Study that the joints are drawn from.
    joints : int
        Number of random joints, beside the nominal one if the study has it.
    limit : float
        CPU time after which a run of another integrator is stopped, s.
    say : callable
        Called with progress messages.

    Returns
    -------
    Comparison

    Raises
    ------
    InputError
        When no joint has largest loads that repeat.
    """
    codes: list[Code] = ["Radau"]
    if has_cvode():
        codes.append("CVODE")
    else:
        say('CVODE is left out: it needs scikit-sundae (pip install "tolstat[bench]")')
    options = study.solver.options()
    params, count = choose(study, joints, SEED, BLOCK)
    points, truth = build(run([*_jobs(params, count, options, codes, limit)], say))
    return Comparison(len(truth), ERROR, contenders(points, options.steps_per_rev))


def _jobs(params: Params, count: int, options: Options, codes: list[Code], limit: float) -> Iterator[Job]:
    """All jobs on the first `count` joints, and tolstat's on the block of all joints."""
    rows = [(i, params[i : i + 1]) for i in range(count)]
    yield from (TruthJob(TRUTH, TRUTH_RTOL, row, options, i) for i, row in rows)
    ramp = options._replace(start=int(Start.RAMP))
    tasks = [(str(one), one, options) for one in both_ways(codes)]
    # without tolstat's initial equilibrium: at rest, with a rising torque
    tasks += [(f"{one}, from rest", one, ramp) for one in both_ways(["Radau"])]
    for name, integrator, start in tasks:
        yield from (OtherJob(name, integrator, RTOL, row, start, i, REVOLUTIONS, limit) for i, row in rows)
    steps = sorted({*STEPS, options.steps_per_rev})
    bdf2 = [options._replace(fidelity=int(Fidelity.DYNAMIC), method=int(Method.BDF2), steps_per_rev=n) for n in steps]
    static = [one._replace(fidelity=int(Fidelity.QUASISTATIC)) for one in bdf2]
    for name, ladder in (("BDF2", bdf2), ("quasistatic", static)):
        yield from (OwnJob(name, tuple(ladder), row, i, REPEATS, 1) for i, row in rows)
    yield OwnJob(IN_LANES, tuple(bdf2), params, 0, REPEATS, count)


def contenders(points: pd.DataFrame, steps_per_rev: int) -> list[Contender]:
    """Select the cheapest setting of each contender that meets the error.

    Parameters
    ----------
    points : DataFrame
        As `points.build` makes it.
    steps_per_rev : int
        The study's own setting.

    Returns
    -------
    list of Contender
    """
    lanes = points[points["contender"] == IN_LANES]
    best = float(lanes.loc[lanes["loads_worst"] <= ERROR, "ms"].min())
    default = float(lanes.loc[lanes["setting"] == steps_per_rev, "ms"].iloc[0])
    met = cheapest(points, "loads_worst", ERROR).to_dict("index")
    found = []
    for name, group in points.groupby("contender", sort=False):
        one = met.get(name, {"setting": None, "loads_worst": None, "ms": float(group["ms"].max())})
        ours, ms = bool(group["ours"].iloc[0]), one["ms"]
        found.append(Contender(str(name), ours, one["setting"], ms, one["loads_worst"], ms / best, ms / default))
    return found
