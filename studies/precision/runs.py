"""Jobs that measure integrators on joints in worker processes, and the runs that they return.

A job is one contender (tolstat with one method and fidelity, or another integrator) with all its settings, on one joint
or one block of joints. Times are CPU times of a process with one thread, without compilation, loading and preparation.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studies.precision.integrators import Integrator, Outcome, solve
from studies.precision.measuring import in_turn
from tolstat.common import loads
from tolstat.common.cardan import CARDAN
from tolstat.common.cores import available_cores
from tolstat.common.tables import SIMULATED, Options, Status
from tolstat.solver.compilation import warm_up
from tolstat.solver.reference import FirstOrder, Largest, first_order, reference_rows
from tolstat.solver.simulation import simulate_rows

TRUTH = "truth"
"""Name of the reference solution among the contenders."""


class Run(NamedTuple):
    """One contender at one setting on one joint.

    Attributes
    ----------
    contender : str
        Its name; `TRUTH` with a setting of 0 for the reference solution, and of 1 for one with a looser tolerance.
    ours : bool
        Whether it is tolstat.
    setting : float
        Steps a revolution, or relative tolerance.
    joint : int
        Place among the joints that are compared.
    outcome : {"ok", "failed", "over_time"}
        ``over_time`` also for a run that was skipped because a looser setting took too long.
    seconds : float
        CPU time of the joint.
    largest : Largest or None
        Largest loads computed.
    halvings, rates : int
        Steps that tolstat halved; calls of the right-hand side by another integrator.
    """

    contender: str
    ours: bool
    setting: float
    joint: int
    outcome: Outcome
    seconds: float
    largest: Largest | None
    halvings: int = 0
    rates: int = 0


class OwnJob(NamedTuple):
    """Tolstat at several settings on a joint or a block of joints, of which the first `measured` are compared."""

    contender: str
    options: tuple[Options, ...]
    params: NDArray[np.void]
    joint: int
    repeats: int
    measured: int

    def runs(self) -> list[Run]:
        """Time all settings in turn, `repeats` times each; the median counts."""
        tasks = {str(k): partial(simulate_rows, self.params, options) for k, options in enumerate(self.options)}
        times = in_turn(tasks, self.repeats)
        runs = []
        for name, options in zip(tasks, self.options, strict=True):
            seconds, setting = times.typical(name) / len(self.params), float(options.steps_per_rev)
            for i, row in enumerate(times.returned[name].results[: self.measured]):
                largest = largest_of(row)
                outcome: Outcome = "failed" if largest is None else "ok"
                halvings = int(row["halvings"])
                runs.append(Run(self.contender, True, setting, self.joint + i, outcome, seconds, largest, halvings))
        return runs


class OtherJob(NamedTuple):
    """Another integrator at several settings, tolerances or steps a revolution, loosest first."""

    contender: str
    integrator: Integrator
    settings: tuple[float, ...]
    params: NDArray[np.void]
    options: Options
    joint: int
    revolutions: int
    limit: float

    def runs(self) -> list[Run]:
        """Integrate at each setting; after a run that takes too long, skip the tighter ones."""
        system = first_order(self.params, self.options, from_start=True)
        prepare(system)
        solve(system, self.integrator, self.settings[0], 1, 1e-3)  # loads the integrator
        runs = []
        outcome: Outcome = "ok"
        for setting in self.settings:
            seconds, largest, rates = self.limit, None, 0
            if outcome != "over_time":
                try:
                    solution = solve(system, self.integrator, setting, self.revolutions, self.limit)
                    outcome, largest, seconds, rates, _ = solution
                except ValueError as error:  # what scipy raises where the joint's accelerations overflow
                    print(f"{self.contender} at {setting:g}, joint {self.joint}: {error}", file=sys.stderr)
                    outcome, seconds = "failed", np.nan
            runs.append(Run(self.contender, False, setting, self.joint, outcome, seconds, largest, rates=rates))
        return runs


class TruthJob(NamedTuple):
    """The reference solution at two tolerances; the tighter one has no result where the largest loads do not repeat."""

    contender: str
    rtols: tuple[float, float]
    params: NDArray[np.void]
    options: Options
    joint: int

    def runs(self) -> list[Run]:
        """Integrate at both tolerances."""
        runs = []
        for k, rtol in enumerate(self.rtols):
            begin = time.process_time()
            row = reference_rows(self.params, self.options, rtol)[0]
            largest = None if k == 0 and not row["settled"] else largest_of(row)
            outcome: Outcome = "failed" if largest is None else "ok"
            runs.append(Run(self.contender, False, float(k), self.joint, outcome, time.process_time() - begin, largest))
        return runs


Job = OwnJob | OtherJob | TruthJob


def largest_of(row: np.void) -> Largest | None:
    """Largest loads of a row of RESULT; None where it has none."""
    return loads.largest(np.array([row]), CARDAN)[0] if Status(row["status"]) in SIMULATED else None


def prepare(system: FirstOrder) -> None:
    """Call a system's functions once, so that no run includes the cost of first calls."""
    system.rate(system.t0, system.y0)
    system.jacobian(system.t0, system.y0)
    system.largest(np.full(1, system.t0), system.y0[None])


def run(jobs: Sequence[Job], say: Callable[[str], None]) -> list[Run]:
    """Run all jobs in worker processes, one a core.

    The kernels are compiled beforehand in this process, once for all workers.

    Parameters
    ----------
    jobs : sequence of Job
        The jobs, those that take longest first, with a `TruthJob` for each joint.
    say : callable
        Called with progress messages.

    Returns
    -------
    list of Run
        Those of tolstat first; each contender's in the order of its settings.
    """
    warm_up()
    truth = next(job for job in jobs if isinstance(job, TruthJob))
    prepare(first_order(truth.params, truth.options, from_start=True))
    places = {job.contender: place for place, job in enumerate(jobs)}
    runs: list[Run] = []
    with ProcessPoolExecutor(available_cores(), mp_context=get_context("spawn")) as pool:
        for done, found in enumerate(pool.map(_work, jobs), 1):
            runs += found
            if done % max(1, len(jobs) // 10) == 0:
                say(f"{done} of {len(jobs)} jobs done")
    return sorted(runs, key=lambda r: (not r.ours, places[r.contender], r.joint))


def _work(job: Job) -> list[Run]:
    return job.runs()
