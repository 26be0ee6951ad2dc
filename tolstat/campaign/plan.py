"""What a campaign will take and give, from a few of its joints."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import exceedance, quantile
from tolstat.campaign.executors import available_workers
from tolstat.campaign.run import choose_fidelity
from tolstat.common.tables import FAILED, RESULT, UNSETTLED, Options, Simulation
from tolstat.joint import ideal, perturb
from tolstat.sampling import dimensions, draw, origin_blocks
from tolstat.solver.simulation import history_specs, simulate_rows
from tolstat.store.histories import attach_scales, create_dataset
from tolstat.store.recorded import perturbed, settings, variants
from tolstat.store.result_file import attributes, fill
from tolstat.store.view import ends, load
from tolstat.study.selection import columns_of

if TYPE_CHECKING:
    from tolstat.study import Study

PILOT = 128
"""Joints: fewer would not fill the lanes as a campaign does."""
SHARES = (0.5, 0.1, 0.01)
"""Exceedances for which the width of the interval is told."""
QUANTILES = (0.95, 0.99, 0.999)
ORDINARY = 600.0
"""Newton iterations of a joint that does not rattle: of `studies/iso2768_f.toml` with the default settings."""
CONFIDENCE = 0.95


@dataclass(frozen=True)
class LimitPlan:
    """What is to be expected of one limit.

    Attributes
    ----------
    load : str
        Name of the load.
    level : float
        The limit, SI.
    above, of : int
        Joints of the pilot above it, and valid joints of the pilot.
    width : float
        Largest width that the interval of the campaign has for any exceedance that the pilot leaves possible (its
        own interval, at the same confidence).
    """

    load: str
    level: float
    above: int
    of: int
    width: float


@dataclass(frozen=True)
class Reversals:
    """Joints of the pilot whose torque reverses, so that they rattle: see `ideal.reversal_torque`.

    Attributes
    ----------
    joints : int
        Such joints.
    torque : float
        Least torque at which none of them would, N m; None without any.
    cost : float
        Newton iterations of such a joint in those of one whose torque does not reverse; without any of these, in
        `ORDINARY`.
    """

    joints: int
    torque: float | None
    cost: float | None


@dataclass(frozen=True)
class Plan:
    """What a campaign will take and give.

    Attributes
    ----------
    rows : int
        Joints, the nominal one included.
    dimensions : int
        Errors that scatter, a radial one as two.
    pilot : int
        Joints simulated for this plan.
    failed, unsettled : int
        Joints among them without a valid load.
    fidelity : str
        What ``solver.fidelity = "auto"`` chooses, and why; empty where the study says it.
    seconds_per_joint : float
        Mean processor time of a joint, s: its time in one process that has a core of its own.
    workers : int
        Processes of the campaign.
    seconds : float
        Time of the campaign if every process has a core of its own, s, without start and compilation.
    process_bytes : int
        Largest memory of this process so far; the campaign has one such for each worker, and itself.
    file_bytes : int
        Size of the result file. Histories are compressed; theirs is that of the pilot's.
    widths : dict of float to float
        Exceedance to the width of its interval; empty where samples are not independent.
    limits : list of LimitPlan
        The study's limits; empty likewise.
    reversals : Reversals
        Joints that rattle.
    wilks : dict of float to int
        Quantile to the joints that its one-sided bound needs at least.
    """

    rows: int
    dimensions: int
    pilot: int
    failed: int
    unsettled: int
    fidelity: str
    seconds_per_joint: float
    workers: int
    seconds: float
    process_bytes: int
    file_bytes: int
    widths: dict[float, float]
    limits: list[LimitPlan]
    wilks: dict[float, int]
    reversals: Reversals


def plan(study: Study, workers: int | None = None, pilot: int = PILOT) -> Plan:
    """Simulate some joints of a study, spread over its rows, and say what all of them will take and give.

    Parameters
    ----------
    study : Study
        The study.
    workers : int, optional
        Processes of the campaign; without it as many as there are cores.
    pilot : int
        Joints to simulate; the study's, if it has fewer.

    Returns
    -------
    Plan
    """
    workers = workers or available_workers()
    rows = np.unique(np.linspace(0, study.rows - 1, min(pilot, study.rows)).astype(np.intp))
    errors = _errors(study, rows)
    params = perturbed(study, rows, errors, perturb)
    choice = choose_fidelity(study) if study.solver.fidelity == "auto" else {}
    own = [settings(solver, choice) for solver in study.solvers]
    simulation, seconds = simulate_timed(study, params, [own[number] for number in variants(study, rows)])
    each = seconds / len(rows)
    iid = study.sampling.method == "random"
    valid = slice(int(study.sampling.nominal_first), None)
    status = simulation.results["status"]
    return Plan(
        rows=study.rows,
        dimensions=len({column for name in study.tolerances for column in columns_of(name)}),
        pilot=len(rows),
        failed=int(np.isin(status, FAILED).sum()),
        unsettled=int(np.isin(status, UNSETTLED).sum()),
        fidelity=choice.get("reason", ""),
        seconds_per_joint=each,
        workers=workers,
        seconds=each * study.rows / workers,
        process_bytes=_process_bytes(),
        file_bytes=_file_bytes(study, errors, simulation, settings(study.solver, choice), choice),
        widths={share: _width(share, study.samples) for share in SHARES} if iid else {},
        limits=_limits(study, simulation.results[valid]) if iid else [],
        wilks={share: quantile.wilks(share, CONFIDENCE) for share in QUANTILES},
        reversals=_reversals(params, simulation.results),
    )


def _reversals(params: NDArray[np.void], results: NDArray[np.void]) -> Reversals:
    torque = ideal.reversal_torque(params)
    here = np.abs(params["torque"]) < torque
    if not here.any():
        return Reversals(0, None, None)
    iterations = results["newton_iterations"]
    others = float(iterations[~here].mean()) if not here.all() else ORDINARY
    return Reversals(int(here.sum()), float(torque[here].max()), float(iterations[here].mean()) / max(others, 1.0))


def _errors(study: Study, rows: NDArray[np.intp]) -> NDArray[np.void]:
    if study.sampling.method == "lhs":
        return draw(study)[rows]
    return np.concatenate([draw(study, range(row, row + 1)) for row in rows])


def simulate_timed(study: Study, params: NDArray[np.void], options: list[Options]) -> tuple[Simulation, float]:
    """Simulate each joint with its own settings; also tell the processor time of all together, s."""
    kinds = study.output.histories, study.output.harmonics
    specs = history_specs(options[0], *kinds)
    whole = Simulation(np.empty(len(params), RESULT), {name: spec.blank(len(params)) for name, spec in specs.items()})
    seconds = 0.0
    for one in dict.fromkeys(options):
        here = np.array([other == one for other in options])
        simulate_rows(params[here][:1], one)  # compiles, or loads, what these options need
        begin = time.process_time()
        part = simulate_rows(params[here], one, *kinds)
        seconds += time.process_time() - begin
        whole.results[here] = part.results
        for name, values in part.histories.items():
            whole.histories[name][here] = values
    return whole, seconds


def _width(share: float, n: int) -> float:
    lower, upper = exceedance.clopper_pearson(round(share * n), n, CONFIDENCE)
    return float(upper - lower)


def _limits(study: Study, results: NDArray[np.void]) -> list[LimitPlan]:
    plans = []
    for name, level in study.limits.items():
        found = exceedance.at(load(results, name)[0], results["status"], level, CONFIDENCE, ends=ends(results, name))
        valid = found.n - found.n_failed - found.n_unsettled
        nearest_half = min(max(0.5, found.lower), found.upper)  # the interval is widest at a share of one half
        plans.append(LimitPlan(name, level, found.count, valid, _width(nearest_half, study.samples)))
    return plans


def _file_bytes(
    study: Study, errors: NDArray[np.void], simulation: Simulation, options: Options, choice: Mapping[str, Any]
) -> int:
    """Size of the result file, from one in memory with the pilot's joints."""
    specs = history_specs(options, study.output.histories, study.output.harmonics)
    n = len(errors)
    design = study.design[:n] if study.case_names else None
    origin = origin_blocks(study, range(n))
    with h5py.File("pilot", "w", driver="core", backing_store=False, block_size=512) as file:
        fill(file, attributes(study, specs, dimensions(), options, choice), range(n), [errors], design, origin)
        groups = [group for group in file.values() if isinstance(group, h5py.Group)]
        datasets = [file["row"], *(dataset for group in groups for dataset in group.values())]
        group = file.create_group("histories") if specs else file
        for name, spec in specs.items():
            datasets.append(create_dataset(group, name, n, spec))
            datasets[-1][...] = simulation.histories[name]
            attach_scales(datasets[-1], file["row"], spec)
        file.flush()
        by_row = sum(dataset.id.get_storage_size() for dataset in datasets) / n
        return int(file.id.get_filesize() + by_row * (study.rows - n))


def _process_bytes() -> int:
    try:
        import resource
    except ImportError:  # not on Windows
        return 0
    import sys

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return int(peak if sys.platform == "darwin" else 1024 * peak)
