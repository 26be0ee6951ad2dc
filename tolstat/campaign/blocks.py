"""Joints of a result file in blocks through the pool, or a cluster; joints beside them, as checks and pilots do."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tolstat.campaign import pool
from tolstat.campaign.block import (
    Block,
    BlockWork,
    load_kernels,
    results_of,
    simulate_block,
    spread,
    without_simulation,
)
from tolstat.campaign.cluster import map_on_cluster
from tolstat.campaign.pool import Lost, Work
from tolstat.common.cores import available_cores
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import Options, Simulation, Status, from_names, without_results
from tolstat.solver.compilation import is_compiled, warm_up
from tolstat.solver.simulation import simulate_rows
from tolstat.store import Reader
from tolstat.store.recorded import perturbed, settings, variants
from tolstat.study import Study

Executor = Literal["processes", "dask"]
"""Worker processes on this machine, or a cluster."""
MAX_FIRST_BLOCK, MAX_BLOCK = 256, 2048
"""Largest default number of joints in a block, before and after the time per joint is known: enough to keep the lanes
busy, and at most 90 MB of histories."""
MIN_BLOCKS_PER_WORKER = 4
"""Minimum number of blocks per worker by default, so that no worker is idle for long at the end."""
MIN_BLOCK_S, MAX_BLOCK_S = 1.0, 8.0
"""Smallest and largest target duration of a block, s: a kill loses the blocks being simulated."""
MAX_WRITE_SHARE, MAX_PARENT_SHARE = 0.05, 0.25
"""Largest share of a block's simulation time that writing it may take, and largest share of the parent's time spent on
writing: beyond a quarter the workers begin to wait for the parent. Writing a block waits twice for the disk, 5 to 50 ms
together, whatever the block's size."""
MIN_BESIDE = 16
"""Minimum number of joints for each worker where few are simulated beside a file: two for each lane."""
SOME, READ = 64, 4096
"""Number of joints that tell which kernels a campaign needs, and of the first rows that they are from."""


class Pace:
    """Number of joints per block: small at first, then adapted to the time that finished blocks took.

    Parameters
    ----------
    n_pending : int
        Number of joints to simulate.
    workers : int
        Number of processes.
    fixed : int, optional
        Constant number of joints per block, if one was asked for.

    Attributes
    ----------
    size : int
        Joints of the next block, unless fewer are left.
    """

    def __init__(self, n_pending: int, workers: int, fixed: int | None) -> None:
        self._left = n_pending
        self._workers = workers
        self._fixed = fixed
        self.size = fixed or max(1, min(MAX_FIRST_BLOCK, n_pending // (MIN_BLOCKS_PER_WORKER * workers)))

    def take(self, available: int) -> int:
        """Return the size of the next block, and count its joints as handed out."""
        last = max(self._left // (MIN_BLOCKS_PER_WORKER * self._workers), -(-self.size // 4))  # shorter at the end
        size = min(available, self._fixed or min(self.size, last))
        self._left -= size
        return size

    def note(self, joints: int, simulating_s: float, writing_s: float) -> None:
        """Adapt the size of blocks to the time a worker took for a block and the parent took to write it."""
        target_s = writing_s * max(1 / MAX_WRITE_SHARE, self._workers / MAX_PARENT_SHARE)
        wanted = min(max(target_s, MIN_BLOCK_S), MAX_BLOCK_S) * joints / max(simulating_s, 1e-9)
        step = min(max(wanted, 0.5 * self.size), 2.0 * self.size)  # limits the effect of one untypical block
        self.size = max(1, min(MAX_BLOCK, round(step)))


def _work(mechanism: Mechanism, options: list[Options], *kept: Any) -> BlockWork:
    """How a worker simulates blocks with these options and histories."""
    load = partial(load_kernels, warm_up, options, mechanism)
    return Work(partial(simulate_block, simulate_rows, *kept), Block.split, load)


def simulate_pending(
    study: Study,
    store: Reader,
    stop_slot: int,
    workers: int | None,
    block: int | None,
    executor: Executor,
    scheduler: str | None,
    stop: Callable[[], bool],
) -> Generator[tuple[Block, Simulation, str], None, None]:
    """Simulate the joints in the pending file slots below `stop_slot`, until `stop` returns true; see `run.run`.

    Yields each block, its simulation, and why its joint was given up, which is empty if it was not. Close the generator
    (`contextlib.closing`) when leaving it early.

    Raises
    ------
    WorkerDied
        When worker processes die whichever block they work on.
    """
    todo = sum(len(slots) for _, slots in store.pending_blocks(stop_slot))
    workers = workers or available_cores()
    if not todo:
        return
    pace = Pace(todo, workers, block)
    kept = study.output.histories, study.output.harmonics, store.history_specs
    work = _work(study.mechanism, settings_in_use(study, store), *kept)
    blocks = _blocks(study, store, stop_slot, pace)
    if executor == "dask":
        results = map_on_cluster(work, blocks, scheduler, workers, stop)
    else:
        results = pool.map_blocks(work, blocks, max(1, min(workers, -(-todo // pace.size))), stop)
    with closing(results):
        for done, result in results:
            if isinstance(result, Lost):
                blank = without_simulation(len(done.slots), Status.CRASHED, store.history_specs, done.mechanism)
                yield done, blank, result.reason
            else:
                begin = time.perf_counter()
                # the caller writes the block to the file before it asks for the next one
                yield done, result.simulation, ""
                pace.note(len(done.slots), result.seconds, time.perf_counter() - begin)


def simulate_beside(params: NDArray[np.void], options: Options, mechanism: Mechanism, workers: int = 1) -> Simulation:
    """Simulate joints, (m,) table PARAM, in workers and without histories; those that crash get no results."""
    compile_missing(mechanism, options)
    results = without_results(len(params), Status.PENDING, mechanism)
    shares = np.array_split(np.arange(len(params)), max(1, min(workers, len(params) // MIN_BESIDE)))
    blocks = [Block("", slots, params[slots], options, mechanism) for slots in shares]
    with closing(pool.map_blocks(work_beside(mechanism, options), blocks, len(blocks))) as done:
        for block, result in done:
            results[block.slots] = results_of(block, result)
    return Simulation(results, {})


def work_beside(mechanism: Mechanism, *options: Options) -> BlockWork:
    """Return how a worker simulates blocks with any of these options, without histories."""
    return _work(mechanism, [*options], "none", 0, {})


def settings_in_use(study: Study, store: Reader) -> list[Options]:
    """Return the solver options of all joints of a file, each once."""
    return list(dict.fromkeys(_each_settings(study, store)))


def _each_settings(study: Study, store: Reader) -> list[Options]:
    """Solver options of each variant of a study, then of each retry."""
    variants = [settings(solver, store.fidelity) for solver in study.solvers]
    return variants + [from_names(retry["options"]) for retry in store.retries]


def compile_missing(mechanism: Mechanism, options: Options, params: NDArray[np.void] | None = None) -> None:
    """Compile what joints with these options need, such as `params`, unless it lies in the cache."""
    if not is_compiled(options, params, mechanism=mechanism):
        warm_up(options, params, mechanism=mechanism)


def compile_for(study: Study, store: Reader) -> None:
    """Compile what some joints at each point need: kernels that none of them needs are not compiled ahead."""
    first = min(store.n, READ)
    slots = spread(first, SOME)
    errors = store.errors(slice(0, first))[slots]
    each = [perturbed(study.at(at_point.point or ""), at_point.row(slots), errors) for at_point in store.each()]
    for options in settings_in_use(study, store):
        compile_missing(study.mechanism, options, np.concatenate(each))


def _blocks(study: Study, store: Reader, stop_slot: int, pace: Pace) -> Iterator[Block]:
    """Yield the pending file slots below `stop_slot` as blocks whose joints have the same point and solver options."""
    studies = {point: study.at(point) for point in store.points}
    distinct = settings_in_use(study, store)
    numbers = np.array([distinct.index(own) for own in _each_settings(study, store)])
    for at_point, slots in store.pending_blocks(stop_slot):
        read = slice(slots[0], slots[-1] + 1)
        errors, attempt = store.errors(read), at_point.attempt(read)[slots - slots[0]]
        point = at_point.point or ""
        option = numbers[np.where(attempt, len(study.solvers) + attempt - 1, variants(study, store.row(slots)))]
        for number in np.unique(option):
            left = slots[option == number]
            while left.size:
                some, left = np.split(left, [pace.take(left.size)])
                params = perturbed(studies[point], store.row(some), errors[some - slots[0]])
                yield Block(point, some, params, distinct[number], study.mechanism)
