"""A campaign: the pending rows of a result file, in blocks, through the simulation and back into the file."""

from __future__ import annotations

import json
import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.errors import Fault, InputError, StoreError
from tolstat.executor import WorkerDied, available_workers, map_blocks
from tolstat.progress import Reporter
from tolstat.store import Counts, ResultStore
from tolstat.store.provenance import versions
from tolstat.tables import PARAM, HistorySpec, Options, Simulation

if TYPE_CHECKING:
    from tolstat.study import Study

MAX_BLOCK = 32
"""Largest default block: a second or a few of work, which is what a stop or a crash costs."""
BLOCKS_PER_WORKER = 4
"""Least blocks a worker by default, so that none is long idle at the end."""


class Stages(NamedTuple):
    """The functions that a campaign strings together; tests put simple ones in their place.

    Attributes
    ----------
    draw : callable
        Study -> (n,) table ERROR.
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
        cache can crash.
    """

    draw: Callable[..., NDArray[np.void]]
    dimensions: Callable[[], Mapping[str, int]]
    perturb: Callable[..., NDArray[np.void]]
    history_specs: Callable[..., Mapping[str, HistorySpec]]
    simulate: Callable[..., Simulation]
    warm_up: Callable[[], object]


class Block(NamedTuple):
    """Rows of the campaign that are simulated together, and their parameters."""

    rows: NDArray[np.intp]
    params: NDArray[np.void]


class Interrupted(Exception):
    """A campaign was stopped by Ctrl-C; the file holds all finished blocks.

    Attributes
    ----------
    path : Path
        The result file.
    counts : Counts
        How far the campaign is.
    """

    def __init__(self, path: Path, counts: Counts) -> None:
        self.path = path
        self.counts = counts
        super().__init__(
            f"stopped: {counts.done} of {counts.total} joints are kept in {path}\n  hint: run the same command to go on"
        )


def run(
    study: Study,
    out: str | Path,
    workers: int | None = None,
    block: int | None = None,
    progress: Reporter | None = None,
    stages: Stages | None = None,
) -> Counts:
    """Simulate the joints of a study that its result file does not hold yet.

    Neither workers nor blocks nor interruptions change a number in the file.

    Parameters
    ----------
    study : Study
        The study.
    out : str or Path
        Result file; made if it does not exist, otherwise its pending rows are done, and limits, text and name of the
        study taken over.
    workers : int, optional
        Processes; without it as many as there are cores. 1 computes in this process.
    block : int, optional
        Joints a block.
    progress : Reporter, optional
        Told how far the campaign is, at the start and after every block.
    stages : Stages, optional
        Other functions than tolstat's own.

    Returns
    -------
    Counts
        How the joints ended.

    Raises
    ------
    InputError
        When `workers` or `block` is less than one.
    StoreError
        When the file is of another study or was begun by other code (it names what differs), or cannot be used.
    Interrupted
        When Ctrl-C was pressed.
    WorkerDied
        When a worker was killed or crashed; the file holds all finished blocks.
    """
    _check_at_least_one(workers=workers, block=block)
    stages = stages or _own_stages()
    path = Path(out)
    with _create_or_resume(study, path, stages) as store:
        pending = store.pending()
        workers = workers or available_workers()
        size = block or default_block(len(pending), workers)
        blocks = _blocks(pending, size, partial(_parameters, stages.perturb, study, store.errors()))
        function = partial(_simulate, stages.simulate, study.solver.options(), _history_options(study))
        counts = store.counts()
        try:
            if progress:
                progress(counts)
            if pending.size:
                stages.warm_up()
            with _stop_on_interrupt() as stop:
                workers = min(workers, -(-len(pending) // size)) if pending.size else 1
                with closing(map_blocks(function, blocks, workers, stop)) as finished:
                    for (rows, _), simulation in finished:
                        store.write(rows, simulation)
                        counts = counts.after(simulation.results["status"])
                        if progress:
                            progress(counts)
            store.finish()
        except KeyboardInterrupt:
            raise Interrupted(path, store.counts()) from None
        except WorkerDied as error:
            kept = f"{counts.done} of {counts.total} joints are kept in {path}"
            raise WorkerDied(f"{error}\n  {kept}: run the same command to go on") from error
        if not store.complete:
            raise Interrupted(path, counts)
        return counts


def default_block(n_pending: int, workers: int) -> int:
    """Return how many joints make a block: seconds of work at most, and several blocks a worker."""
    return max(1, min(MAX_BLOCK, n_pending // (BLOCKS_PER_WORKER * workers)))


def differing_keys(held: Mapping[str, Any], wanted: Mapping[str, Any]) -> list[str]:
    """Compare two identities of studies.

    Returns
    -------
    list of str
        ``"solver.steps_per_rev: 90 in the file, 180 in the study"`` for every key that differs.
    """
    lines = []
    for key in sorted(held.keys() | wanted.keys()):
        if key not in wanted or key not in held or held[key] != wanted[key]:
            sides = (f"{side[key]!r}" if key in side else "nothing" for side in (held, wanted))
            lines.append("{}: {} in the file, {} in the study".format(key, *sides))
    return lines


def _own_stages() -> Stages:
    from tolstat import joint, sampling, simulation

    return Stages(
        sampling.draw,
        sampling.dimensions,
        joint.perturb,
        simulation.history_specs,
        simulation.simulate_rows,
        simulation.warm_up,
    )


def _create_or_resume(study: Study, path: Path, stages: Stages) -> ResultStore:
    if not path.exists():
        histories = stages.history_specs(study.solver.options(), *_history_options(study))
        return ResultStore.create(path, study, stages.draw(study), histories, stages.dimensions())
    store = ResultStore.open(path, "r+")
    try:
        _check_same(store, study)
        store.judge_by(study)
    except StoreError:
        store.close()
        raise
    return store


def _check_same(store: ResultStore, study: Study) -> None:
    differing = differing_keys(store.identity, json.loads(json.dumps(study.identity())))
    found, remedy = "is the result file of another study", "use another --out, or delete the file"
    if not differing:
        began = f"commit {store.git_commit}" if store.git_commit else "the code that began it"
        found, remedy = "was begun by other code", f"use another --out, or go on with {began}"
    now = versions()
    for name, noun in (("tolstat", "version"), ("sources", "hash")):
        held = store.versions.get(name, "unknown")
        if held != now[name]:
            differing.append(f"{name}: {noun} {held} in the file, {now[name]} now")
    if differing:
        lines = "\n    ".join([found, *differing])
        raise StoreError(str(Fault(str(store.path), lines, remedy)))


def _check_at_least_one(**numbers: int | None) -> None:
    faults = [
        Fault(name, f"{value} is less than one", "give a whole number of 1 or more")
        for name, value in numbers.items()
        if value is not None and value < 1
    ]
    if faults:
        raise InputError(faults)


def _history_options(study: Study) -> tuple[str, int]:
    return study.output.histories, study.output.harmonics


def _blocks(
    pending: NDArray[np.intp], size: int, parameters: Callable[[NDArray[np.intp]], NDArray[np.void]]
) -> Iterator[Block]:
    for first in range(0, len(pending), size):
        rows = pending[first : first + size]
        yield Block(rows, parameters(rows))


def _parameters(
    perturb: Callable[..., NDArray[np.void]], study: Study, errors: NDArray[np.void], rows: NDArray[np.intp]
) -> NDArray[np.void]:
    """Parameters of `rows`, (m,) table PARAM, each from the joint of its own variant."""
    params = np.empty(len(rows), PARAM)
    variant = study.design["variant"][rows]
    for number in np.unique(variant):
        here = variant == number
        params[here] = perturb(study.joints[number], errors[rows[here]])
    return params


def _simulate(
    simulate: Callable[..., Simulation], options: Options, histories: tuple[str, int], block: Block
) -> Simulation:
    kind, n_harmonics = histories
    return simulate(block.params, options, histories=kind, n_harmonics=n_harmonics)


@contextmanager
def _stop_on_interrupt() -> Iterator[Callable[[], bool]]:
    """Turn the first Ctrl-C into a request to stop after the blocks in work; the second one interrupts.

    So that no interrupt lands in the middle of writing. Only the main thread can catch signals; elsewhere
    Ctrl-C is the caller's affair.
    """
    asked: list[int] = []

    def ask(number: int, frame: FrameType | None) -> None:
        if asked:
            raise KeyboardInterrupt
        asked.append(number)

    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    before = signal.signal(signal.SIGINT, ask)
    try:
        yield lambda: bool(asked)
    finally:
        signal.signal(signal.SIGINT, before)
