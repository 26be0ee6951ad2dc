"""Timing joints: jobs that a worker process executes, and the runs that they return.

A job is all settings of one contender for one joint, or one block of joints. Times are CPU times of a process that
computes with one thread; they exclude compilation, loading and preparation.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.benchmarks.work_precision.competitors import Competitor, Outcome, solve
from tolstat.benchmarks.work_precision.setup import Setup, measured
from tolstat.campaign.executors import Lost, Work, available_workers, map_in_processes
from tolstat.common import loads
from tolstat.common.tables import SIMULATED, Fidelity, Method, Options, Status
from tolstat.solver.reference import FirstOrder, Largest, first_order, reference_rows
from tolstat.solver.simulation import simulate_rows, warm_up
from tolstat.study import Study

Params = NDArray[np.void]
METHOD_NAMES = {"bdf2": "BDF2", "generalized_alpha": "generalised-α", "tr_bdf2": "TR-BDF2"}
IDEAL_STEPS = 90
"""Steps a revolution of the ideal joint, which does not converge with them: the nearest setting is taken."""
TRUTH = "truth"


class Run(NamedTuple):
    """One contender at one setting on one joint.

    Attributes
    ----------
    contender : str
        Its name; `TRUTH` with a setting of 0 for the reference, and of 1 for the looser one that it is compared with.
    ours : bool
        Whether it is tolstat.
    setting : float
        Steps a revolution, or relative tolerance.
    joint : int
        Row among `setup.parameters`.
    outcome : {"ok", "failed", "over_time"}
        Outcome; a run that is skipped because a looser tolerance took too long is ``over_time`` too.
    seconds : float
        CPU time of the joint.
    largest : Largest or None
        Largest loads computed.
    halvings, rates : int
        Steps halved by the solver; calls of the right-hand side by a competitor.
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
    """The solver at several settings on one joint or a block of joints, of which the first `measured` have a truth."""

    contender: str
    options: tuple[Options, ...]
    params: Params
    joint: int
    repeats: int
    measured: int

    def runs(self) -> list[Run]:
        """Simulate once for the results, then `repeats` times for the time."""
        runs = []
        for options in self.options:
            results = simulate_rows(self.params, options).results
            seconds = _median_time(partial(simulate_rows, self.params, options), self.repeats) / len(self.params)
            for i, row in enumerate(results[: self.measured]):
                largest = largest_of(row)
                outcome: Outcome = "failed" if largest is None else "ok"
                halvings = int(row["halvings"])
                setting = float(options.steps_per_rev)
                runs.append(Run(self.contender, True, setting, self.joint + i, outcome, seconds, largest, halvings))
        return runs


class OtherJob(NamedTuple):
    """A competitor at several tolerances, loosest first."""

    contender: str
    competitor: Competitor
    rtols: tuple[float, ...]
    params: Params
    options: Options
    joint: int
    revolutions: int
    limit: float

    def runs(self) -> list[Run]:
        """Integrate at each tolerance; after a run that takes too long, tighter ones are skipped."""
        system = first_order(self.params, self.options, from_start=True)
        prepare(system)
        solve(system, self.competitor, 0.1, 1, 1e-3)  # loads the integrator
        runs = []
        outcome: Outcome = "ok"
        for rtol in self.rtols:
            seconds, largest, rates = self.limit, None, 0
            if outcome != "over_time":
                outcome, largest, seconds, rates, _ = solve(system, self.competitor, rtol, self.revolutions, self.limit)
            runs.append(Run(self.contender, False, rtol, self.joint, outcome, seconds, largest, rates=rates))
        return runs


class TruthJob(NamedTuple):
    """The reference at two tolerances; the tighter one has no result where the largest loads do not repeat."""

    contender: str
    rtols: tuple[float, float]
    params: Params
    options: Options
    joint: int

    def runs(self) -> list[Run]:
        """Compute the reference at both tolerances."""
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
    return loads.largest(np.array([row]))[0] if Status(row["status"]) in SIMULATED else None


def prepare(system: FirstOrder) -> None:
    """Call a system's functions once, so that no run includes the cost of first calls."""
    system.rate(system.t0, system.y0)
    system.jacobian(system.t0, system.y0)
    system.largest(np.full(1, system.t0), system.y0[None])


def jobs(setup: Setup, base: Study, params: Params) -> Iterator[Job]:
    """All jobs of a study, those that take longest first.

    Parameters
    ----------
    setup : Setup
        The study.
    base : Study
        Study that the joints are drawn from.
    params : ndarray of PARAM
        As `setup.parameters` makes them.
    """
    options = base.solver.options()
    count = measured(setup, base)
    rows = [(i, params[i : i + 1]) for i in range(count)]
    yield from (TruthJob(TRUTH, setup.truth.rtol, row, options, i) for i, row in rows)
    others = setup.others
    for competitor in (Competitor(code, jacobian) for code in others.codes for jacobian in (False, True)):
        for i, row in rows:
            yield OtherJob(str(competitor), competitor, others.rtol, row, options, i, others.revolutions, others.limit)
    ladders = own_ladders(setup, options)
    for name, ladder in ladders.items():
        yield from (OwnJob(name, ladder, row, i, setup.repeats, 1) for i, row in rows)
    name, ladder = next(iter(ladders.items()))
    block = params[: max(setup.tolstat.block, count)]
    yield OwnJob(f"{name}, {len(block)} joints at once", ladder, block, 0, setup.repeats, count)


def own_ladders(setup: Setup, options: Options) -> dict[str, tuple[Options, ...]]:
    """Settings of each of the solver's curves, by name."""
    own = setup.tolstat
    ladders: dict[str, tuple[Options, ...]] = {}
    steps = [options._replace(steps_per_rev=n) for n in own.steps_per_rev]
    for fidelity in own.fidelities:
        level = [o._replace(fidelity=int(Fidelity[fidelity.upper()])) for o in steps]
        if fidelity == "dynamic":
            for method in own.methods:
                ladders[METHOD_NAMES[method]] = tuple(o._replace(method=int(Method[method.upper()])) for o in level)
        elif fidelity == "quasistatic":
            ladders["quasistatic"] = tuple(level)
        else:
            ladders["ideal joint"] = (min(level, key=lambda o: abs(o.steps_per_rev - IDEAL_STEPS)),)
    return ladders


def run(setup: Setup, base: Study, params: Params, tell: Callable[[str], None], more: Sequence[Job] = ()) -> list[Run]:
    """Run all jobs in worker processes, one a core.

    The kernels are compiled beforehand in this process: two processes that compile at once could corrupt the cache.

    Parameters
    ----------
    setup, base, params
        As for `jobs`.
    tell : callable
        Called with progress messages, and with each job whose process died.
    more : sequence of Job
        Jobs beside those of the setup.

    Returns
    -------
    list of Run
        The solver's own first, each contender's in the order of its settings.
    """
    warm_up()
    prepare(first_order(params[:1], base.solver.options(), from_start=True))
    todo = [*jobs(setup, base, params), *more]
    places = {job.contender: place for place, job in enumerate(todo)}
    runs: list[Run] = []
    with closing(map_in_processes(Work(_work), todo, available_workers())) as finished:
        for done, (job, found) in enumerate(finished, 1):
            if isinstance(found, Lost):
                tell(f"{job.contender} on joint {job.joint}: {found.reason}")
            runs += failures(job) if isinstance(found, Lost) else found
            if done % max(1, len(todo) // 10) == 0:
                tell(f"{done} of {len(todo)} jobs done")
    return sorted(runs, key=lambda r: (not r.ours, places[r.contender], r.joint))


def _work(job: Job) -> list[Run]:
    return job.runs()


def failures(job: Job) -> list[Run]:
    """Runs of a job whose process died."""
    settings: Sequence[float]
    if isinstance(job, OwnJob):
        settings = [float(options.steps_per_rev) for options in job.options]
    else:
        settings = job.rtols if isinstance(job, OtherJob) else (0.0, 1.0)
    ours = isinstance(job, OwnJob)
    return [Run(job.contender, ours, setting, job.joint, "failed", np.nan, None) for setting in settings]


def _median_time(function: Callable[[], object], repeats: int) -> float:
    times = []
    for _ in range(repeats):
        begin = time.process_time()
        function()
        times.append(time.process_time() - begin)
    return float(np.median(times))
