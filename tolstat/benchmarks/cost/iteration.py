"""Split of a joint's time by part, and speed of the parts relative to the core's peak and to dense linear algebra.

Each part is timed separately, many times at states of the recorded revolution, and multiplied by its executions per
joint. The rest is the time of a whole joint less these parts: predictor, norms, records of grid points, results.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tolstat.benchmarks.cost.dense import Dense, against, systems
from tolstat.benchmarks.cost.flops import Snapshot, count_apart
from tolstat.benchmarks.cost.rates import Sample, alone
from tolstat.benchmarks.cost.split import Once, Split, split
from tolstat.benchmarks.timing import Times, in_turn
from tolstat.common.tables import KERNEL_RESULT, Options
from tolstat.solver import simulation

if TYPE_CHECKING:
    from tolstat.kernel.lanes.batch import Batch

TIMES = 1000
"""Executions of a part in one measurement of one joint or of all lanes, some 1 to 10 ms."""
PEAK_TIMES = 2_000_000
STATES = 8
"""Number of joints at whose states the parts are timed: enough to fill the lanes."""


@dataclass(frozen=True)
class Iteration:
    """Times, operations and ratios of the parts of a simulation.

    Attributes
    ----------
    lanes, alone : Split
        Time of a joint by part, in lanes and one joint at a time.
    operations : dict of str to float
        Floating-point operations of one execution of each part, mean over joints; see `flops`.
    peak_gflops : float
        Measured peak rate of fused multiply-adds in lanes, counted as two operations, 1e9/s.
    width : int
        Number of lanes.
    lanes_filled : float
        Share of the lanes that hold a joint, over the rounds of a block.
    dense : Dense
        Comparison with dense linear algebra.
    """

    lanes: Split
    alone: Split
    operations: dict[str, float]
    peak_gflops: float
    width: int
    lanes_filled: float
    dense: Dense


def snapshots(these: Sample, n: int) -> Iterator[Snapshot]:
    """Yield the last recorded state of each of the first n joints."""
    from tolstat.kernel.integrators.state import UNLIMITED
    from tolstat.kernel.revolution.simulate import simulate_joint

    params, options = these
    scratch = simulation.scratch(options)
    state = scratch.state
    out = np.zeros(1, KERNEL_RESULT).view(np.recarray)
    for i in range(min(n, len(params))):
        simulate_joint(params.view(np.recarray)[i], options, UNLIMITED, scratch, out[0])
        h = 2 * np.pi / (abs(float(params["omega"][i])) * options.steps_per_rev)
        cv = 1.5 / h
        t = float(out["revolutions"][0]) * options.steps_per_rev * h
        yield Snapshot(params[i : i + 1], t, cv, cv * cv, state.q0.copy(), state.v0.copy(), state.a0.copy())


def into_lanes(snaps: list[Snapshot], options: Options) -> Batch:
    """Make lanes with a state in each, in memory of their own; states repeat where there are fewer than lanes."""
    from tolstat.kernel.lanes.batch import make_batch, put_joint
    from tolstat.kernel.simd.lane import WIDTH

    batch = make_batch(options)
    for lane in range(WIDTH):
        snap = snaps[lane % len(snaps)]
        put_joint(lane, snap.params.view(np.float64), batch)
        for name in ("q", "v", "a"):
            batch.motion[name][:, lane] = getattr(snap, name)
        for name in ("t", "cv", "ca"):
            batch.control[name][lane] = getattr(snap, name)
    batch.par.n_stations = snaps[0].params["n_stations"][0]
    return batch


def tally(these: Sample) -> NDArray[np.int64]:
    """Counts of all joints in lock-step: rounds, lanes with a joint summed over rounds, rounds with new tangents."""
    from tolstat.kernel.integrators.state import UNLIMITED
    from tolstat.kernel.lanes.lockstep import PATIENCE, lockstep
    from tolstat.kernel.revolution.settle import make_samples

    params, options = these
    batch, counts = simulation.lanes(options), np.zeros(3, np.int64)
    batch.par.n_stations = params["n_stations"][0]
    words = params.view(np.float64).reshape(len(params), -1)
    out = np.zeros(len(params), KERNEL_RESULT).view(np.recarray)
    samples, blocks = make_samples(0, options.steps_per_rev), np.zeros((0, 0), KERNEL_RESULT).view(np.recarray)
    rows = params.view(np.recarray)
    left, scratch = np.full(len(params), UNLIMITED), simulation.scratch(options)
    starts = simulation.starts(rows, options)
    lockstep(rows, words, starts, left, options, PATIENCE, scratch, batch, samples, blocks, out, counts)
    return counts


def _start_counts(these: Sample, n: int) -> tuple[float, float]:
    """Newton iterations and tangents of a joint's initial equilibrium, mean."""
    from tolstat.benchmarks.cost.parts import start
    from tolstat.kernel.integrators.state import FACTORISATIONS, ITERATIONS

    params, options = these
    scratch = simulation.scratch(options)
    counts = []
    for i in range(min(n, len(params))):
        start(params[i : i + 1].view(np.recarray), options, scratch)
        counts.append(scratch.state.counters[[ITERATIONS, FACTORISATIONS]])
    iterations, factorisations = np.mean(counts, axis=0)
    return float(iterations), float(factorisations)


def measure(these: Sample, rounds: int) -> Iteration:
    """Time whole joints and their parts in turn, and count the parts' operations.

    Parameters
    ----------
    these : Sample
        The joints.
    rounds : int
        Number of timings of each task.

    Returns
    -------
    Iteration
    """
    from tolstat.benchmarks.cost.parts import CHAINS
    from tolstat.kernel.simd.lane import WIDTH

    params = these.params
    snaps = list(snapshots(these, STATES))
    times = in_turn(_tasks(these, snaps), rounds)
    once = {"lanes": _once(times, "lanes", TIMES * WIDTH), "alone": _once(times, "alone", TIMES * len(snaps))}
    results = times.returned["lanes"].results
    mean = {name: float(results[name].mean()) for name in ("steps", "newton_iterations", "factorisations", "halvings")}
    rounds_done, filled, renewals = (int(x) for x in tally(these))
    start_iterations, start_tangents = _start_counts(these, len(params))
    iterations, tangents = mean["newton_iterations"] - start_iterations, mean["factorisations"] - start_tangents
    one = np.array([iterations + mean["steps"] + mean["halvings"], tangents, iterations])
    # in lanes the initial equilibrium is solved like a step: its iterations, and the residual that ends them
    own = one + np.array([start_iterations + 1, start_tangents, start_iterations])
    lanes = WIDTH / len(params) * np.array([rounds_done, renewals, rounds_done])
    operations = _operations(snaps)
    peak = 2 * WIDTH * CHAINS * PEAK_TIMES / float(times.seconds["peak"].min())
    start = {name: times.least(f"{name} start") / len(params) for name in ("lanes", "alone")}
    whole = {name: times.least(name) / len(params) for name in ("lanes", "alone")}
    splits = {
        name: split(whole[name], start[name], once[name], done, of_use, mean["newton_iterations"], operations, peak)
        for name, done, of_use in (("lanes", lanes, own), ("alone", one, one))
    }
    per_iteration = one / iterations
    dense = against(times, once, TIMES // 10 * len(snaps), per_iteration)
    return Iteration(
        splits["lanes"], splits["alone"], operations, peak / 1e9, WIDTH, filled / (WIDTH * rounds_done), dense
    )


def _tasks(these: Sample, snaps: list[Snapshot]) -> dict[str, Callable[[], object]]:
    """Functions to be timed, by name."""
    from scipy.linalg.lapack import dgetrf, dgetrs

    from tolstat.benchmarks.cost import parts

    params, options = these
    scratch = simulation.scratch(options)
    work, state, *_ = scratch
    batch = into_lanes(snaps, options)
    rows = [snap.params.view(np.recarray)[0] for snap in snaps]
    tangents = list(systems(snaps, options))

    def one_by_one(part: int) -> None:
        for snap, par in zip(snaps, rows, strict=True):
            state.q[:], state.v[:], state.a[:] = snap.q, snap.v, snap.a
            parts.repeat(part, TIMES, snap.t, snap.cv, snap.ca, state, par, options, work)

    def in_lanes(part: int) -> None:
        parts.repeat_in_lanes(part, TIMES, options, batch)

    def lapack(factor: bool, kept: list[Any]) -> None:
        for _ in range(TIMES // 10):
            for k, (matrix, right) in enumerate(tangents):
                if factor:
                    kept[k] = dgetrf(matrix)[:2]
                dgetrs(*kept[k], right)

    tasks: dict[str, Callable[[], object]] = {
        "lanes": lambda: simulation.simulate_rows(params, options),
        "alone": lambda: alone(params, options),
        "lanes start": lambda: parts.guess(params.view(np.recarray), scratch),
        "alone start": lambda: parts.start(params.view(np.recarray), options, scratch),
        "peak": lambda: parts.multiply_add(PEAK_TIMES, batch),
    }
    for name in Once._fields:
        part = getattr(parts, name.upper())
        tasks[f"lanes {name}"], tasks[f"alone {name}"] = partial(in_lanes, part), partial(one_by_one, part)
    factors = [dgetrf(matrix)[:2] for matrix, _ in tangents]
    return tasks | {"lapack": partial(lapack, True, factors), "lapack solve": partial(lapack, False, factors)}


def _once(times: Times, name: str, count: int) -> Once:
    return Once(*(times.least(f"{name} {part}") / count for part in Once._fields))


def _operations(snaps: list[Snapshot]) -> dict[str, float]:
    """Operations of each part, mean over the states."""
    counts = count_apart(snaps)
    return {part: float(np.mean([count[part] for count in counts])) for part in counts[0]}
