"""Executor in worker processes that may die or hang: such workers are replaced, and their blocks are repeated.

Neither pool of the standard library does this: `multiprocessing.Pool` waits for ever for the task of a killed worker,
and `ProcessPoolExecutor` fails every task once one worker is gone. Workers of pebble's `ProcessPool` (5.2) share two
pipes and their locks: one that is killed while it sends a result keeps the lock, and all others wait until it times
out, after 60 s; one that is killed before it has a task breaks the pool. Here each worker has a pipe and one block at a
time.

A block whose worker died, hung or raised is halved, and its halves go next, down to single joints. One that fails twice
alone is given up as `Lost`. If it hung, that is final: the time is processor time without progress, so that nothing but
the joint can be the cause. If it crashed, the machine may be at fault (no memory left, a broken installation). What
tells is another block that succeeds; if none is left, one that succeeded before and is repeated as a control; and
before any has succeeded, another worker that gets ready, which loads and calls the same code. The map ends early only
if a control fails again and again, if workers cannot start, or if the function raises an exception for all blocks.

Workers are spawned, because a forked child inherits locks of threads that it does not have.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from multiprocessing.reduction import ForkingPickler
from typing import Any, Generic, Literal, NamedTuple

from tolstat.campaign.executors.common import (
    POLL_S,
    BlockT,
    Lost,
    ResultT,
    Work,
    WorkerDied,
    never_stop,
    no_preparation,
)
from tolstat.campaign.executors.watch import Watch, shared_memory
from tolstat.campaign.executors.worker import RAISED, READY, serve
from tolstat.common.cores import THREAD_VARIABLES

MAX_FAILURES = 2
"""Number of failures at which a single joint is given up."""
LOSSES_BEFORE_CONTROL = 3
"""Number of consecutive crashes after which a block that succeeded before is repeated, to test the workers."""
MAX_FAILED_CONTROLS = 3
"""Number of times that a control may fail, one after the other."""
MOST_RAISED = 5
"""Number of exceptions, beyond one a worker and before any block has succeeded, at which one is raised here."""
MAX_FAILED_STARTS = 3
"""Number of consecutive workers ending before they are ready at which `WorkerDied` is raised."""
START_LIMIT_S = 600.0
"""Processor time for a worker to get ready, s: it may have to compile."""

HINT = (
    "hint: if memory is short, use fewer workers: --workers 1; in a Python script, start the campaign under: "
    'if __name__ == "__main__":'
)


def map_in_processes(
    work: Work[BlockT, ResultT], blocks: Iterable[BlockT], workers: int, stop: Callable[[], bool] = never_stop
) -> Generator[tuple[BlockT, ResultT | Lost], None, None]:
    """Apply the function to every block in worker processes and yield the results as they arrive.

    Close the generator (`contextlib.closing`) when leaving it early: that ends the workers at once.

    Parameters
    ----------
    work : Work
        Function to apply, and how.
    blocks : iterable
        Blocks; consumed only as they are needed.
    workers : int
        Number of processes.
    stop : callable, optional
        Called often; once it returns True no further block is started, and blocks in work are finished.

    Yields
    ------
    tuple
        A block or a piece of one, and its result, or `Lost` for a joint that was given up; in the order in which they
        are finished.

    Raises
    ------
    WorkerDied
        When workers cannot be started, or die at a block that succeeded before.
    Exception
        The function's own, when it raised one for block after block and no block succeeded.
    """
    team: _Team[BlockT, ResultT] = _Team(work, iter(blocks), workers)
    try:
        with one_thread_each():
            yield from team.run(stop)
    finally:
        team.end()


@contextmanager
def kept_workers(started: int = 0, ahead: Callable[[], object] = no_preparation) -> Iterator[None]:
    """Keep workers that have nothing left to do for the next map inside.

    Parameters
    ----------
    started : int, optional
        Number of workers to start now, so that they are loaded while the caller still prepares the first map.
    ahead : callable, optional
        What these do before they know their work, such as loading what it is likely to need; picklable.
    """
    global _kept
    if _kept is not None:  # somebody above keeps them
        yield
        return
    _kept = []
    try:
        with one_thread_each(), suppress(OSError):  # a map that finds no worker starts one itself, or says why not
            for _ in range(started):
                _kept.append(_start(ahead))
        yield
    finally:
        for worker in _kept:
            _end_worker(worker)
        _kept = None


class _Task(NamedTuple, Generic[BlockT]):
    """A block, how often it failed alone, and whether it is a control that only tests if workers still work."""

    block: BlockT
    failures: int = 0
    control: bool = False


@dataclass
class _Worker(Generic[BlockT]):
    """A process, its pipe, the watch over it, the pickled work that it does, and its block."""

    process: SpawnProcess
    connection: Connection
    watch: Watch
    work: bytes = b""
    ready: bool = False
    task: _Task[BlockT] | None = None


_kept: list[_Worker[Any]] | None = None


class _Team(Generic[BlockT, ResultT]):
    """Worker processes, and the tasks that are left for them."""

    def __init__(self, work: Work[BlockT, ResultT], blocks: Iterator[BlockT], size: int) -> None:
        self.work = work
        self.pickled = bytes(ForkingPickler.dumps(work))
        self.size = size
        self.workers: list[_Worker[BlockT]] = []
        self.fresh: Iterator[_Task[BlockT]] = (_Task(block) for block in blocks)
        self.ahead: _Task[BlockT] | None = None
        self.suspects: deque[_Task[BlockT]] = deque()
        self.given_up: list[tuple[BlockT, Lost]] = []
        self.doubtful: list[tuple[BlockT, Lost]] = []
        self.control: _Task[BlockT] | None = None
        self.losses = self.raised = self.failed_controls = self.failed_starts = 0

    def run(self, stop: Callable[[], bool]) -> Iterator[tuple[BlockT, ResultT | Lost]]:
        while True:
            if stop():
                self._drop_tasks()
            self._hand_out()
            if not any(worker.task for worker in self.workers) and not self._has_task():
                break
            # Read all messages, then hand out blocks, then yield: the caller may take long with the results.
            finished = [result for worker in self._wait_for_workers() for result in self._receive(worker)]
            self._hand_out()
            yield from finished
            while self.given_up:
                yield self.given_up.pop()
        yield from self.doubtful

    def end(self) -> None:
        for worker in self.workers:
            if _kept is not None and worker.ready and worker.task is None:
                _kept.append(worker)
            else:
                _end_worker(worker)

    def _drop_tasks(self) -> None:
        self.fresh, self.ahead = iter(()), None
        self.suspects.clear()
        self.doubtful.clear()

    def _next_task(self) -> _Task[BlockT] | None:
        task, self.ahead = self.ahead, None
        if task is not None:
            return task
        in_doubt = self.doubtful or self.losses >= LOSSES_BEFORE_CONTROL
        if in_doubt and self.control and not any(w.task and w.task.control for w in self.workers):
            return self.control
        return self.suspects.popleft() if self.suspects else next(self.fresh, None)

    def _has_task(self) -> bool:
        self.ahead = self._next_task()
        return self.ahead is not None

    def _hand_out(self) -> None:
        for worker in self.workers:
            if worker.ready and worker.task is None:
                task = self._next_task()
                if task is None:
                    return
                self._give(worker, task)
        while len(self.workers) < self.size and self._has_task():
            worker = _take_kept(self.pickled) or _start()
            self.workers.append(worker)
            if worker.work != self.pickled:
                _give_work(worker, self.pickled)
            elif (task := self._next_task()) is not None:
                self._give(worker, task)

    def _give(self, worker: _Worker[BlockT], task: _Task[BlockT]) -> None:
        worker.task = task
        worker.watch.begin(self.work.limit_s, self.work.size(task.block))
        with suppress(OSError):  # the worker has died: `_receive` will find its pipe closed
            worker.connection.send(task.block)

    def _wait_for_workers(self) -> list[_Worker[BlockT]]:
        """Wait for workers and return those with a message, a closed pipe (the worker died) or no time left."""
        ready = wait([worker.connection for worker in self.workers], timeout=POLL_S)
        busy = [worker for worker in self.workers if worker.task or not worker.ready]
        over = [worker for worker in busy if worker.connection not in ready and worker.watch.is_over()]
        return [worker for worker in self.workers if worker.connection in ready] + over

    def _receive(self, worker: _Worker[BlockT]) -> Iterator[tuple[BlockT, ResultT | Lost]]:
        if not worker.connection.poll():
            limit = self.work.limit_s if worker.ready else START_LIMIT_S
            self._drop_worker(worker, "timeout", f"made no progress in {limit:g} s of processor time")
            return
        try:
            kind, content = worker.connection.recv()
        except (EOFError, OSError):
            worker.process.join(1.0)
            self._drop_worker(worker, "crashed", _cause(worker.process.exitcode))
            return
        task, worker.task = worker.task, None
        if kind == READY:
            worker.ready, self.failed_starts = True, 0
            if self.control is None:
                yield from self._confirm()
        elif kind == RAISED and task is not None:
            self._handle_failure(task, Lost("crashed", f"{type(content).__name__}: {content}"), content)
        elif task is not None:
            yield from self._succeed(task, content)

    def _succeed(self, task: _Task[BlockT], result: ResultT) -> Iterator[tuple[BlockT, ResultT | Lost]]:
        self.losses = self.failed_controls = 0
        if self.control is None:
            self.control = task._replace(control=True)
        if not task.control:
            yield task.block, result
        yield from self._confirm()

    def _confirm(self) -> Iterator[tuple[BlockT, Lost]]:
        """Give up the joints that crashed: the machine works."""
        yield from self.doubtful
        self.doubtful.clear()

    def _drop_worker(self, worker: _Worker[BlockT], kind: Literal["crashed", "timeout"], reason: str) -> None:
        _end_worker(worker)
        self.workers.remove(worker)
        if worker.ready and worker.task is not None:
            self._handle_failure(worker.task, Lost(kind, reason), None)
            return
        self.failed_starts += 1
        if self.failed_starts >= MAX_FAILED_STARTS:
            found = f"{self.failed_starts} worker processes in a row died at their start: {reason}"
            raise WorkerDied(f"{found}\n  {HINT}")

    def _handle_failure(self, task: _Task[BlockT], lost: Lost, error: Exception | None) -> None:
        if task.control:
            self.failed_controls += 1
            if self.failed_controls == MAX_FAILED_CONTROLS:
                found = f"{self.failed_controls} worker processes in a row died at a block that was finished before"
                raise error or WorkerDied(f"{found}; the last worker: {lost.reason}\n  {HINT}")
            return
        self.losses += lost.kind == "crashed"
        self.raised += error is not None
        if error is not None and self.control is None and self.raised >= MOST_RAISED + self.size:
            raise error
        pieces = self.work.split(task.block)
        if len(pieces) > 1:
            self.suspects.extend(_Task(piece) for piece in pieces)
        elif task.failures + 1 < MAX_FAILURES:
            self.suspects.append(task._replace(failures=task.failures + 1))
        elif lost.kind == "timeout":
            self.given_up.append((task.block, lost))
        else:
            self.doubtful.append((task.block, lost))


def _end_worker(worker: _Worker[Any]) -> None:
    worker.process.kill()
    worker.process.join()
    worker.connection.close()


def _take_kept(pickled: bytes) -> _Worker[Any] | None:
    """Return a worker that was kept, if there is one: rather one that does this work than another."""
    if not _kept:
        return None
    worker = next((worker for worker in _kept if worker.work == pickled), _kept[0])
    _kept.remove(worker)
    return worker


def _give_work(worker: _Worker[Any], pickled: bytes) -> None:
    worker.work, worker.ready = pickled, False
    worker.watch.begin(START_LIMIT_S, 1)
    with suppress(OSError):  # the worker has died: `_receive` will find its pipe closed
        worker.connection.send_bytes(pickled)


def _start(ahead: Callable[[], object] = no_preparation) -> _Worker[Any]:
    """Start a worker; it inherits a mask that blocks signals until `serve` ignores them."""
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    memory = shared_memory(context)
    process = context.Process(target=serve, args=(there, memory, ahead), daemon=True)
    try:
        with signals_blocked():
            process.start()
    finally:
        there.close()
    assert process.pid is not None
    return _Worker(process, here, Watch(process.pid, memory))


def _cause(exit_code: int | None) -> str:
    if exit_code is None:
        return "closed its pipe"
    if exit_code < 0:
        return f"killed by {signal.Signals(-exit_code).name}"
    return f"ended with exit code {exit_code}"


@contextmanager
def signals_blocked() -> Iterator[None]:
    """Let processes started inside inherit blocked SIGINT and SIGTERM: only this process decides when to stop."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


@contextmanager
def one_thread_each() -> Iterator[None]:
    """Limit workers started inside to one thread each; libraries read these variables when they are loaded."""
    before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
