"""Predict time, memory and precision of a campaign from a pilot of its joints."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import binomial
from tolstat.analysis.sample import CONFIDENCE, Sample
from tolstat.campaign import verify
from tolstat.campaign.block import spread
from tolstat.campaign.chosen import few
from tolstat.campaign.run import choose_fidelity
from tolstat.common.cores import number_of_workers
from tolstat.common.errors import input_error
from tolstat.common.loads import load_of, split
from tolstat.common.mechanism import Mechanism
from tolstat.common.memory import peak_bytes
from tolstat.common.tables import FAILED, UNSETTLED, Options, Status
from tolstat.display import text
from tolstat.display.progress import Tell, silent
from tolstat.joint import OperationOfLinkage, ideal
from tolstat.sampling import draw, streams
from tolstat.solver import fidelity, refinement
from tolstat.solver.compilation import stage_name, warm_up
from tolstat.solver.histories import history_specs
from tolstat.solver.simulation import simulate_rows
from tolstat.store import layout, metadata, worst
from tolstat.store.recorded import perturbed, settings, variants
from tolstat.study import Given, Study, assumptions, design, load
from tolstat.study.points import names_of
from tolstat.study.tolerances.correlation import correlations
from tolstat.study.tolerances.entry import meanings

PILOT = 128
"""Default number of joints in the pilot: fewer would not fill the lanes as a campaign does."""
PILOT_S, FIRST = 20.0, 8
"""Processor time that the default pilot may take, s: joints at 85 deg take seconds each; joints that tell how long."""
SHARES = (0.5, 0.1, 0.01)
"""Exceedances for which the width of the interval is predicted."""
TRUE_SHARES = (0.5, 0.8)
"""True shares, of what is accepted, for which the number of joints that decide is told."""
QUANTILES = (0.95, 0.99, 0.999)
ORDINARY = 680.0
"""Newton iterations of a joint that does not rattle, from `studies/rigid_shafts.toml` with the default settings."""
DRAWN = 1 << 14
"""Largest number of joints whose clearances are computed."""
LOOPS = 5
"""Number of times that `_loop` is timed; the shortest time counts."""
LOOP_S = 0.0124
"""Time of `_loop` on the core that the three times below were measured on, s."""
START_S = 4.0
"""Time from the command to the first joint: imports, loading the kernels, start of the workers, s."""
REPORT_S, REPORT_S_PER_JOINT = 3.0, 2.5e-5
"""Time of a report with 16 limits: imports and figures, and per joint, s."""


@dataclass(frozen=True)
class LimitPlan:
    """Predicted precision for one limit.

    Attributes
    ----------
    load : str
        Name of the load.
    level : float
        The limit, SI.
    above, of : int
        Joints of the pilot above the limit, and valid joints of the pilot.
    width : float
        Largest width of the campaign's interval for any exceedance inside the pilot's own interval, both with the
        same confidence.
    """

    load: str
    level: float
    above: int
    of: int
    width: float


@dataclass(frozen=True)
class Reversals:
    """Joints of the pilot whose torque reverses, so that they rattle, see `ideal.reversal_torque`; in series none.

    Attributes
    ----------
    joints : int
        Number of such joints.
    torque : float
        Smallest torque at which none of them would reverse, N m; None if none does.
    cost : float
        Mean work of such a joint (`refinement.work`) relative to that of the pilot's other joints, or to `ORDINARY` if
        there are no others; None if none reverses.
    """

    joints: int
    torque: float | None
    cost: float | None


@dataclass(frozen=True)
class Assembly:
    """Joints that do not go together, because a pin is larger than its hole: they have no result.

    Attributes
    ----------
    misfits, of : int
        Number of such joints, and of joints whose clearances were computed: the first `DRAWN` of the campaign.
    interval : tuple of float, optional
        Clopper-Pearson interval of their share; None if samples are not independent.
    """

    misfits: int
    of: int
    interval: tuple[float, float] | None


@dataclass(frozen=True, repr=False)
class Plan:
    """Predicted cost and precision of a campaign.

    Attributes
    ----------
    rows : int
        Number of joints, including the nominal joint.
    points : list of str
        Operating points that each joint is simulated at; one without a name unless the study has several.
    dimensions : int
        Number of errors that scatter; a vector of a zone counts as two.
    pilot : int
        Number of joints simulated for this plan.
    failed, unsettled : int
        Numbers of pilot joints without a valid load.
    fidelity : str
        What ``solver.fidelity = "auto"`` chooses, with the table of the pilot; empty if the study gives the fidelity.
    seconds_per_joint : float
        Mean processor time of a joint at all points, s: its time in one process that has a core of its own.
    workers : int
        Number of processes of the campaign.
    stages : dict of str to float
        Time of each stage of the whole command ``tolstat run`` if every process has a core of its own, s: ``start`` (of
        this process and the workers, kernels compiled), ``joints``, ``check`` of the numerical error, ``report``.
        Joints and check are timed in the pilot; start and report are scaled by the speed of this machine, and rough.
    process_bytes : int
        Peak memory of this process so far; the campaign needs as much for each worker and for its parent process.
    file_bytes : int
        Size of the result file, histories included.
    widths : dict of float to float
        Width of the interval by exceedance; empty if samples are not independent.
    limits : list of LimitPlan
        Predictions for the study's limits; empty if samples are not independent.
    reversals : Reversals
        Joints that rattle.
    assembly : Assembly
        Joints that do not go together.
    constraints : dict of str to int
        ``mobility`` of a linkage and number of ``redundant`` constraints; empty for joints.
    fit : list of str
        What the fit of the study means, as lines of text; empty without one.
    sweep : list of str
        Axes of a sweep whose values are deviations where a value of the joint is easily meant, as lines of text.
    tolerances : list of dict
        What each entry of ``[tolerances]`` means: rows of `study.tolerances.entry.meanings`.
    exact : list of str
        Errors of pins and holes that nothing sets in a study with tolerances, in words; see `assumptions.unselected`.
    correlations : list of dict
        What correlations mean for the errors themselves: rows of `study.tolerances.correlation.correlations`.
    wilks : dict of float to int
        Minimum number of joints for a one-sided bound, by quantile.
    deciding : dict of float to float
        Number of joints that decide whether at most the accepted share is above a limit, in `POWER` of the campaigns,
        by true share; empty without an accepted share.
    """

    rows: int
    points: list[str]
    dimensions: int
    pilot: int
    failed: int
    unsettled: int
    fidelity: str
    seconds_per_joint: float
    workers: int
    stages: dict[str, float]
    process_bytes: int
    file_bytes: int
    widths: dict[float, float]
    limits: list[LimitPlan]
    wilks: dict[float, int]
    deciding: dict[float, float]
    reversals: Reversals
    assembly: Assembly
    constraints: dict[str, int]
    fit: list[str]
    sweep: list[str]
    tolerances: list[dict[str, Any]]
    exact: list[str]
    correlations: list[dict[str, Any]]

    def __repr__(self) -> str:
        return (
            f"<plan of {self.rows} joints: about {self.seconds:.2g} s on {self.workers} cores, "
            f"{self.file_bytes / 1e6:.2g} MB>"
        )

    @property
    def seconds(self) -> float:
        """Time of the whole command, s."""
        return sum(self.stages.values())


def plan(
    study: Given, workers: int | None = None, pilot: int = PILOT, stage: Tell = silent, accepted: float = math.nan
) -> Plan:
    """Simulate a pilot of joints, spread over the study's rows, and predict cost and precision of the campaign.

    Parameters
    ----------
    study : Study, str, Path or mapping
        The study, see `study.load`.
    workers : int, optional
        Number of processes of the campaign; without it the number of cores.
    pilot : int
        Number of joints to simulate; at most all joints of the study. The default number is reduced to as many as take
        `PILOT_S`.
    stage : callable
        Called with the name of each stage when it begins.
    accepted : float
        Accepted share of the joints above a limit; NaN if none is given.

    Returns
    -------
    Plan

    Raises
    ------
    InputError
        When a share is accepted of joints that are not independent, or with the faults of the study.
    """
    study = load(study)
    iid = study.sampling.method == "random" and study.sampling.joints_per_lot == 1
    if not (iid or math.isnan(accepted)):
        raise input_error("--accept", "numbers of joints are known for independent joints only", "leave it out")
    workers = number_of_workers(workers)
    stage(stage_name(study.mechanism))
    warm_up(mechanism=study.mechanism)
    stage("pilot")
    choice = choose_fidelity(study) if study.solver.fidelity == "auto" else {}
    if pilot == PILOT < study.rows:
        pilot = _affordable(study, choice)
    rows = spread(study.rows, pilot)
    at, options = _joints(study, rows, choice)
    timed = {name: simulate_timed(study, params, options) for name, params in at.items()}
    each = sum(seconds for _, seconds in timed.values()) / len(rows)
    stage("check of the numerical error")
    results = {name: table for name, (table, _) in timed.items()}
    chain = study.operation.linkage.chain if isinstance(study.operation, OperationOfLinkage) else None
    check = sum(_check(study, at[name], table, options) for name, table in results.items())
    slower = min(_loop() for _ in range(LOOPS)) / LOOP_S
    stages = {"start": slower * START_S, "joints": each * study.rows / workers, "check": check}
    stages["report"] = slower * (REPORT_S + REPORT_S_PER_JOINT * study.rows)
    valid = slice(study.first_sample, None)
    status, solver = worst.together(list(results.values()))["status"], settings(study.solver, choice)
    specs = history_specs(solver, study.output.histories, study.output.harmonics, study.mechanism)
    document = metadata.of_study(study, range(study.rows), specs, solver, choice)
    return Plan(
        rows=study.rows,
        points=list(at),
        dimensions=len(streams(study)),
        pilot=len(rows),
        failed=int(np.isin(status, FAILED).sum()),
        unsettled=int(np.isin(status, UNSETTLED).sum()),
        fidelity=fidelity.describe(choice),
        seconds_per_joint=each,
        workers=workers,
        stages=stages,
        process_bytes=peak_bytes(),
        file_bytes=layout.size_of(document, 2 * few(study.rows)),
        widths={share: _width(share, study.samples) for share in SHARES} if iid else {},
        limits=_limits(study, {name: table[valid] for name, table in results.items()}) if iid else [],
        wilks={share: binomial.wilks(share, CONFIDENCE) for share in QUANTILES},
        deciding={part * accepted: binomial.needed(part * accepted, accepted) for part in TRUE_SHARES if accepted > 0},
        reversals=_reversals(np.concatenate([*at.values()]), np.concatenate([*results.values()]), study.mechanism),
        assembly=_assembly(study, iid),
        constraints={"mobility": chain.mobility, "redundant": chain.redundant} if chain else {},
        fit=fit_in_words(study),
        sweep=design.meaning(study.sweep, study.joint),
        tolerances=text.plain(meanings(study.entries).to_dict("records")),
        exact=list(assumptions.unselected(study)),
        correlations=text.plain(correlations(study.copula, study.tolerances).to_dict("records")),
    )


def _joints(
    study: Study, rows: NDArray[np.intp], choice: dict[str, Any]
) -> tuple[dict[str, NDArray[np.void]], list[Options]]:
    """Parameters of some joints at each operating point, table PARAM, and the solver options of each joint."""
    errors = np.concatenate([draw(study, range(row, row + 1)) for row in rows])
    each_options = [settings(solver, choice) for solver in study.solvers]
    at = {point.name: perturbed(study.at(point.name), rows, errors) for point in study.points}
    return at, [each_options[number] for number in variants(study, rows)]


def _affordable(study: Study, choice: dict[str, Any]) -> int:
    """Size of the default pilot, or as many joints as take `PILOT_S`, by the time of the first ones."""
    at, options = _joints(study, spread(study.rows, FIRST), choice)
    spent = sum(simulate_timed(study, params, options)[1] for params in at.values())
    return int(np.clip(FIRST * PILOT_S / max(spent, 1e-9), FIRST, PILOT))


def _loop() -> float:
    """Processor time of a fixed piece of Python, s: start and report are Python, and take as much more or less."""
    begin, total = time.process_time(), 0
    for i in range(300_000):
        total += i % 7
    return time.process_time() - begin


def fit_in_words(study: Study) -> list[str]:
    """Lines about the fit of a study, also which values of the joint file it replaces; empty without one."""
    if study.fit is None:
        return []
    values = " and ".join(f"{key} = {value}" for key, value in study.joint.replaced_bearing.items())
    return [*study.fit.meaning, *([f"fit: replaces {values} of the joint file"] if values else [])]


def _assembly(study: Study, iid: bool) -> Assembly:
    rows = np.arange(study.first_sample, min(study.rows, study.first_sample + DRAWN))
    errors = draw(study, range(rows[0], rows[-1] + 1))
    misfits = int((perturbed(study, rows, errors)["clearance"] < 0.0).any(axis=1).sum())
    lower, upper = binomial.clopper_pearson(misfits, rows.size, CONFIDENCE)
    return Assembly(misfits, rows.size, (float(lower), float(upper)) if iid else None)


def _check(study: Study, params: NDArray[np.void], results: NDArray[np.void], options: list[Options]) -> float:
    """Time of the check at the end of the run, from one on settled joints of the pilot, s."""
    number = min(2 * few(study.rows), study.rows)
    settled = np.flatnonzero(results["status"] == Status.OK)[:number]
    if not settled.size:
        return 0.0
    begin = time.process_time()
    own = [options[i] for i in settled.tolist()]
    verify.run_checks(params[settled], own, study.mechanism, verify.QUICK_CHECKS, simulate_rows)
    return (time.process_time() - begin) * number / settled.size


def _reversals(params: NDArray[np.void], results: NDArray[np.void], mechanism: Mechanism) -> Reversals:
    if len(mechanism.cardan) != 1:
        return Reversals(0, None, None)
    torque = ideal.reversal_torque(params)
    here = np.abs(params["torque"]) < torque
    if not here.any():
        return Reversals(0, None, None)
    work = refinement.work(results)
    others = float(work[~here].mean()) if not here.all() else ORDINARY
    return Reversals(int(here.sum()), float(torque[here].max()), float(work[here].mean()) / max(others, 1.0))


def simulate_timed(study: Study, params: NDArray[np.void], options: list[Options]) -> tuple[NDArray[np.void], float]:
    """Simulate each joint with its own options; also return the total processor time, s, without compilation."""
    for distinct in dict.fromkeys(options):
        simulate_rows(
            params[[options.index(distinct)]], distinct, mechanism=study.mechanism
        )  # compiles, or loads, what these options need
    kept = partial(simulate_rows, histories=study.output.histories, n_harmonics=study.output.harmonics)
    begin = time.process_time()
    return verify.simulate_each(params, options, study.mechanism, kept), time.process_time() - begin


def _width(share: float, n: int) -> float:
    lower, upper = binomial.clopper_pearson(round(share * n), n, CONFIDENCE)
    return float(upper - lower)


def _limits(study: Study, results: Mapping[str, NDArray[np.void]]) -> list[LimitPlan]:
    plans = []
    for name, level in study.limits.items():
        points = names_of(split(name)[1], list(results), "limits")
        values, status, _ = worst.load_of([results[point] for point in points], load_of(name, study.mechanism))
        share = Sample.of(values.values, status).above(level, CONFIDENCE)
        valid = share.n - share.n_failed - share.n_unsettled
        nearest_half = min(max(0.5, share.lower), share.upper)  # the interval is widest at a share of one half
        plans.append(LimitPlan(name, level, share.count, valid, _width(nearest_half, study.samples)))
    return plans
