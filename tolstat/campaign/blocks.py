"""The pending rows of a result file, in blocks, through the simulation, wherever that runs."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.campaign import executors as executor
from tolstat.campaign.executors import Lost
from tolstat.common.tables import PARAM, HistorySpec, Options, Simulation, Status, without_results
from tolstat.store import ResultStore
from tolstat.store.provenance import versions
from tolstat.store.recorded import perturbed, settings, variants

if TYPE_CHECKING:
    from tolstat.study import Study

FIRST_BLOCK, MAX_BLOCK = 256, 2048
"""Largest default block, before and after it is known how long a joint takes: enough to keep lanes busy, and at most 90
MB of histories."""
BLOCKS_PER_WORKER = 4
"""Least blocks a worker by default, so that none is long idle at the end."""
LEAST_S, MOST_S = 1.0, 8.0
"""How long a block shall take, in seconds: that is what a kill costs."""
WRITE_SHARE, PARENT_SHARE = 0.05, 0.25
"""Most of a block's time that writing it may take, and most of the parent's time that writing may: beyond a quarter the
workers begin to wait for it. A block waits twice for the disk, 5 to 50 ms together, however large it is."""
JOINT_TIMEOUT_S = 300.0
"""Default of the longest time for a joint, in seconds: a thousand times what most take."""


class Stages(NamedTuple):
    """The functions that a campaign strings together; tests put simple ones in their place.

    Attributes
    ----------
    draw : callable
        Study, rows of the campaign (range) -> their errors, tables ERROR one after the other.
    dimensions : callable
        () -> dimension of the sequence by name of error.
    perturb : callable
        Joint, (m,) table ERROR -> (m,) table PARAM.
    history_specs : callable
        Options, kind of histories, number of harmonics -> what each history holds for a joint.
    simulate : callable
        (m,) table PARAM, Options, ``histories=``, ``n_harmonics=`` -> Simulation; goes to other processes.
    warm_up : callable
        Compiles what `simulate` needs. Done before there are workers: two processes that compile into one
        cache can crash. Then done in each of them, to load it.
    origins : callable
        Study, rows of the campaign (range) -> how they were drawn, tables one after the other, or None where the
        sampling method has no such table (`origins.columns`).
    """

    draw: Callable[..., Iterable[NDArray[np.void]]]
    dimensions: Callable[[], Mapping[str, int]]
    perturb: Callable[..., NDArray[np.void]]
    history_specs: Callable[..., Mapping[str, HistorySpec]]
    simulate: Callable[..., Simulation]
    warm_up: Callable[[], object]
    origins: Callable[..., Iterable[NDArray[np.void]] | None] = lambda *_: None


@dataclass(frozen=True)
class Execution:
    """Where and how the joints are simulated, which changes no number.

    Attributes
    ----------
    kind : {"processes", "serial", "dask"}, optional
        Supervised worker processes, this process, or a cluster; without it processes if there are several workers.
        In this process nothing protects the campaign from a joint that crashes or hangs.
    workers : int, optional
        Processes; without it as many as there are cores.
    block : int, optional
        Joints a block; without it seconds of work, see `Pace`.
    joint_timeout : float
        Longest time for a joint, in seconds. A block that takes longer is done again joint by joint.
    scheduler : str, optional
        Address of a Dask scheduler, as ``tcp://host:8786``; without it a cluster of this machine.
    """

    kind: Literal["processes", "serial", "dask"] | None = None
    workers: int | None = None
    block: int | None = None
    joint_timeout: float = JOINT_TIMEOUT_S
    scheduler: str | None = None


class Block(NamedTuple):
    """Rows of a file that are simulated together, their parameters, and how."""

    rows: NDArray[np.intp]
    params: NDArray[np.void]
    options: Options

    def split(self) -> list[Block]:
        """Row by row."""
        return [Block(self.rows[i : i + 1], self.params[i : i + 1], self.options) for i in range(len(self.rows))]


class Timed(NamedTuple):
    """What simulating a block gave, and the seconds that it took."""

    simulation: Simulation
    seconds: float


class Pace:
    """How many joints make a block: at first a few, then by what the blocks so far took.

    Parameters
    ----------
    n_pending : int
        Joints to be done.
    workers : int
        Processes that do them.
    fixed : int, optional
        Number of joints asked for, which nothing changes.
    """

    def __init__(self, n_pending: int, workers: int, fixed: int | None) -> None:
        self._left = n_pending
        self._workers = workers
        self._fixed = fixed
        self._size = fixed or default_block(n_pending, workers)

    def take(self, available: int) -> int:
        """Size of the next block, of which the joints count as handed out."""
        last = max(self._left // (BLOCKS_PER_WORKER * self._workers), -(-self._size // 4))  # none is long idle
        size = min(available, self._fixed or min(self._size, last))
        self._left -= size
        return size

    def note(self, joints: int, simulating_s: float, writing_s: float) -> None:
        """Take note of how long a worker took for a block, and the parent for writing it."""
        aim = writing_s * max(1 / WRITE_SHARE, self._workers / PARENT_SHARE)
        wanted = min(max(aim, LEAST_S), MOST_S) * joints / max(simulating_s, 1e-9)
        step = min(max(wanted, 0.5 * self._size), 2.0 * self._size)  # one odd block shall not decide
        self._size = max(1, min(MAX_BLOCK, round(step)))


class Finished(NamedTuple):
    """Rows of a file, what simulating them gave, and why if they were given up."""

    rows: NDArray[np.intp]
    simulation: Simulation
    trouble: str


def pending(store: ResultStore, last: int) -> Iterator[NDArray[np.intp]]:
    """Pending rows of the file before its row `last`, in arrays as the store gives them."""
    for rows in store.pending_blocks():
        if rows[0] >= last:
            return
        yield rows[rows < last]


def simulate_pending(
    study: Study, store: ResultStore, last: int, stages: Stages, execution: Execution, stop: Callable[[], bool]
) -> Generator[Finished, None, None]:
    """Simulate the pending rows of a file before its row `last`.

    Close the generator (`contextlib.closing`) when leaving it early.

    Raises
    ------
    WorkerDied
        When worker processes die whatever they work at.
    """
    todo = sum(len(rows) for rows in pending(store, last))
    workers = execution.workers or executor.available_workers()
    size = execution.block or default_block(todo, workers)
    if not todo:
        return
    kind = execution.kind or ("processes" if workers > 1 and todo > size else "serial")
    pace = Pace(todo, workers, execution.block)
    blocks = _blocks(study, store, last, pace, stages.perturb)
    work: executor.Work[Block, Timed | Lost] = executor.Work(
        partial(_simulate, stages.simulate, study.output.histories, study.output.harmonics, store.history_specs),
        Block.split,
        stages.warm_up,
        execution.joint_timeout,
    )
    results: Generator[tuple[Block, Timed | Lost], None, None]
    if kind == "serial":
        results = executor.map_here(work, blocks, stop)
    elif kind == "dask":
        from tolstat.campaign.executors.cluster import map_on_cluster

        results = map_on_cluster(work, blocks, execution.scheduler, workers, versions, stop)
    else:
        results = executor.map_in_processes(work, blocks, max(1, min(workers, -(-todo // size))), stop)
    with closing(results):
        for block, result in results:
            if isinstance(result, Lost):
                status = Status.TIMEOUT if result.kind == "timeout" else Status.CRASHED
                blank = without_simulation(len(block.rows), status, store.history_specs)
                yield Finished(block.rows, blank, result.reason)
            else:
                begin = time.perf_counter()
                yield Finished(block.rows, result.simulation, "")
                pace.note(len(block.rows), result.seconds, time.perf_counter() - begin)


def default_block(n_pending: int, workers: int) -> int:
    """Return how many joints make the first blocks: a second of work or so, and several blocks a worker."""
    return max(1, min(FIRST_BLOCK, n_pending // (BLOCKS_PER_WORKER * workers)))


def without_simulation(n: int, status: Status, specs: Mapping[str, HistorySpec]) -> Simulation:
    """Make what stands in the file for joints that have no results: NaN and a status, (n,)."""
    return Simulation(without_results(n, status), {name: spec.blank(n) for name, spec in specs.items()})


def _blocks(
    study: Study, store: ResultStore, last: int, pace: Pace, perturb: Callable[..., NDArray[np.void]]
) -> Iterator[Block]:
    own = [settings(solver, store.fidelity) for solver in study.solvers]
    again = [Options(**retry["options"]) for retry in store.retries]
    known = list(dict.fromkeys(own + again))
    for chunk in pending(store, last):
        held = slice(chunk[0], chunk[-1] + 1)
        errors, attempt = store.errors(held), store.attempt(held)[chunk - chunk[0]]
        numbers = variants(study, chunk + store.rows.start)
        options = [again[k - 1] if k else own[i] for i, k in zip(numbers.tolist(), attempt.tolist(), strict=True)]
        which = np.array([known.index(one) for one in options])
        for number in np.unique(which):
            alike = chunk[which == number]
            while alike.size:
                rows, alike = np.split(alike, [pace.take(alike.size)])
                params = perturbed(study, rows + store.rows.start, errors[rows - chunk[0]], perturb)
                yield Block(rows, params, known[number])


def _finite(params: NDArray[np.void]) -> NDArray[np.bool_]:
    good = np.ones(len(params), bool)
    for name in PARAM.names or ():
        good &= np.isfinite(params[name]).reshape(len(params), -1).all(axis=1)
    return good


def _simulate(
    simulate: Callable[..., Simulation],
    histories: str,
    n_harmonics: int,
    specs: Mapping[str, HistorySpec],
    block: Block,
) -> Timed:
    """Simulate a block and see how long it takes."""
    begin = time.perf_counter()
    simulation = _simulate_finite(simulate, histories, n_harmonics, specs, block)
    return Timed(simulation, time.perf_counter() - begin)


def _simulate_finite(
    simulate: Callable[..., Simulation],
    histories: str,
    n_harmonics: int,
    specs: Mapping[str, HistorySpec],
    block: Block,
) -> Simulation:
    """Simulate the joints of a block whose parameters are finite numbers."""
    good = _finite(block.params)
    whole = without_simulation(len(good), Status.INVALID_INPUT, specs)
    if not good.any():
        return whole
    part = simulate(block.params[good], block.options, histories=histories, n_harmonics=n_harmonics)
    if good.all():
        return part
    whole.results[good] = part.results
    for name, values in part.histories.items():
        whole.histories[name][good] = values
    return whole
