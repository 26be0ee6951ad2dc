"""Worker processes on this machine: a pipe for each worker, one block of work at a time.

So a death has one culprit and costs one worker. Its block is halved and repeated at once, down to single joints; one
that fails twice alone is given up as `Lost`. A function that raises is a failure of its block in the same way. Failures
in a row, without a finished block between them, end the map: then the machine is at fault, or the function.

`ProcessPoolExecutor` was tried: a worker killed while it sends leaves the pool hanging, one death fails innocent
blocks, and workers outlive a killed parent. Workers are spawned, because a forked child inherits locks of threads that
it does not have.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import sys
import threading
import traceback
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any, Generic, NamedTuple, TypeVar

from tolstat.common.cores import one_thread_each
from tolstat.common.errors import TolstatError

BlockT = TypeVar("BlockT")
ResultT = TypeVar("ResultT")

POLL_S = 0.2
"""Interval at which a request to stop is checked while workers are busy, s."""
MAX_ATTEMPTS = 2
"""Number of failures at which a single joint is given up."""
MAX_FAILURES = 10
"""Number of failures in a row that end a map, and one more for each worker but the first: all may be killed at once.
Nine attempts lead from a block of 256 to a joint, so that one joint never ends a map."""
READY, RESULT, RAISED, DIED = "ready", "result", "raised", "died"
"""Kinds of messages from a worker, and what stands for one from a worker that has died."""
SIGNALS = tuple(number for number in signal.Signals if number.name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK"))
"""Signals of this system that end a campaign. Workers ignore them: their parent decides when to stop."""
HINT = "hint: if memory is short, use fewer workers: --workers 1"
UNGUARDED = (
    "each worker process runs the script, which would start the campaign again\n"
    '  hint: start the campaign under: if __name__ == "__main__":'
)
SCRIPT = 113
"""Exit code of a worker that began the script of its user anew."""


class WorkerDied(TolstatError):
    """Worker processes die whichever block they work on; finished results have been yielded before."""


class Unguarded(WorkerDied):
    """Worker processes cannot start, because the script of the user starts a campaign wherever it runs."""


class Lost(NamedTuple):
    """Takes the place of the result of a joint that was given up; `reason` is, for example, "killed by SIGKILL"."""

    reason: str


def _no_preparation() -> None:
    """Do nothing before the first block."""


@dataclass(frozen=True)
class Work(Generic[BlockT, ResultT]):
    """A function of blocks, and how to apply it.

    Attributes
    ----------
    function : callable
        Function of one block. Function, blocks and results must be picklable.
    split : callable
        Block -> its halves, which are processed after a failure of the block; itself if it is a single joint.
    prepare : callable
        Called in each worker that is started for this work, before it takes blocks.
    """

    function: Callable[[BlockT], ResultT]
    split: Callable[[BlockT], Sequence[BlockT]] = lambda block: [block]
    prepare: Callable[[], object] = _no_preparation


def end_second_script() -> None:
    """End this process if it is a worker that runs the script of its user, which begins a campaign, once more."""
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        sys.exit(SCRIPT)


def map_blocks(
    work: Work[BlockT, ResultT], blocks: Iterable[BlockT], workers: int, stop: Callable[[], bool] = lambda: False
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
        When workers or blocks fail again and again, without a finished block between them.
    Exception
        The function's own, when it was the last of these failures and no block has been finished.
    """
    end_second_script()
    running: _Map[BlockT, ResultT] = _Map(work, iter(blocks), workers)
    try:
        yield from running.run(stop)
    finally:
        running.end()


@contextmanager
def kept_workers() -> Iterator[None]:
    """Keep workers that have nothing left to do for the next map inside."""
    global _kept
    if _kept is not None:  # a caller keeps them
        yield
        return
    _kept = []
    try:
        yield
    finally:
        for worker in _kept:
            worker.end()
        _kept = None


def too_many_failures(failures: int, workers: int, last: str | Exception, succeeded: bool) -> Exception | None:
    """Error that ends a map after that many failures in a row, the last one of which is given; None if they are few."""
    if failures < MAX_FAILURES + workers - 1:
        return None
    if isinstance(last, Exception) and not succeeded:
        return last
    found = f"{failures} times in a row a worker process failed, the last time: {_reason(last)}"
    return WorkerDied(f"{found}\n  {HINT}")


_Task = tuple[BlockT, int]
"""A block, and how often it failed before, if it cannot be split."""


class _Worker(Generic[BlockT]):
    """A process, its pipe, whether it is ready, and the task that it works on."""

    def __init__(self, prepare: Callable[[], object]) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, there = context.Pipe()
        self.process = context.Process(target=serve, args=(there, prepare), daemon=True)
        self.ready = False
        self.task: _Task[BlockT] | None = None
        try:
            with one_thread_each(), signals_blocked():
                self.process.start()
        finally:
            there.close()

    def give(self, function: Callable[[BlockT], object], task: _Task[BlockT]) -> None:
        """Hand out a task."""
        self.task = task
        with suppress(OSError):  # the worker has died: `receive` will find its pipe closed
            self.connection.send((function, task[0]))

    def receive(self) -> tuple[str, Any]:
        """Return kind and content of a message."""
        try:
            message: tuple[str, Any] = self.connection.recv()
        except (EOFError, OSError):
            self.process.join(1.0)
            code = self.process.exitcode or 0
            if code == SCRIPT and not self.ready:
                raise Unguarded(UNGUARDED) from None
            return DIED, f"killed by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"
        return message

    def end(self) -> None:
        """Kill the process."""
        self.process.kill()
        self.process.join()
        self.connection.close()


_kept: list[_Worker[Any]] | None = None


class _Map(Generic[BlockT, ResultT]):
    """The workers of a map, and what is left for them."""

    def __init__(self, work: Work[BlockT, ResultT], blocks: Iterator[BlockT], size: int) -> None:
        self.work, self.fresh, self.size = work, blocks, size
        self.workers: list[_Worker[BlockT]] = []
        self.pieces: deque[_Task[BlockT]] = deque()
        self.failures, self.succeeded = 0, False
        self.last: str | Exception = ""
        self.ahead = self._next()

    def run(self, stop: Callable[[], bool]) -> Iterator[tuple[BlockT, ResultT | Lost]]:
        while True:
            if stop():
                self.fresh, self.ahead = iter(()), None
                self.pieces.clear()
            self._hand_out()
            if self.ahead is None and not any(worker.task for worker in self.workers):
                return
            # Read all messages, then hand out blocks, then yield: the caller may take long with the results.
            ready = wait([worker.connection for worker in self.workers], timeout=POLL_S)
            told = [worker for worker in self.workers if worker.connection in ready]
            finished = [result for worker in told for result in self._receive(worker)]
            error = too_many_failures(self.failures, self.size, self.last, self.succeeded)
            if error is None:
                self._hand_out()
            yield from finished
            if error is not None:
                raise error

    def end(self) -> None:
        for worker in self.workers:
            if _kept is not None and worker.ready and worker.task is None:
                _kept.append(worker)
            else:
                worker.end()

    def _next(self) -> _Task[BlockT] | None:
        """Return the newest piece of a block that failed, which is the smallest, or a fresh block."""
        if self.pieces:
            return self.pieces.pop()
        for block in self.fresh:
            return block, 0
        return None

    def _hand_out(self) -> None:
        self.ahead = self.ahead or self._next()
        while self.ahead is not None:
            idle = next((worker for worker in self.workers if worker.ready and worker.task is None), None)
            if idle is not None:
                idle.give(self.work.function, self.ahead)
                self.ahead = self._next()
            elif len(self.workers) < self.size:
                self.workers.append(_kept.pop() if _kept else _Worker(self.work.prepare))
            else:
                break

    def _receive(self, worker: _Worker[BlockT]) -> Iterator[tuple[BlockT, ResultT | Lost]]:
        kind, content = worker.receive()
        task, worker.task = worker.task, None
        if kind == READY:
            worker.ready = True
        elif kind == RESULT and task is not None:
            self.failures, self.succeeded = 0, True
            yield task[0], content
        else:
            if kind == DIED:
                worker.end()
                self.workers.remove(worker)
            self.last = content
            self.failures += task is None or task[1] == 0  # the second failure of a joint confirms the first
            if task is not None:
                yield from self._repeat(*task)

    def _repeat(self, block: BlockT, failures: int) -> Iterator[tuple[BlockT, Lost]]:
        """Queue the halves of a block that failed, a joint behind all others; give up one that failed twice."""
        halves = self.work.split(block)
        if len(halves) > 1:
            self.pieces.extend((half, 0) for half in reversed(halves))
        elif failures + 1 < MAX_ATTEMPTS:
            self.pieces.appendleft((block, failures + 1))
        else:
            yield block, Lost(_reason(self.last))


def _reason(failure: str | Exception) -> str:
    return failure if isinstance(failure, str) else f"{type(failure).__name__}: {failure}"


@contextmanager
def signals_blocked() -> Iterator[None]:
    """Let processes started inside inherit blocked signals, until they ignore them; Windows cannot block any."""
    system: Any = signal
    if not hasattr(system, "pthread_sigmask"):
        yield
        return
    mask = system.pthread_sigmask(system.SIG_BLOCK, SIGNALS)
    try:
        yield
    finally:
        system.pthread_sigmask(system.SIG_SETMASK, mask)


def serve(connection: Connection, prepare: Callable[[], object]) -> None:
    """Main loop of a worker: apply functions to blocks until the parent closes the pipe or ends."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    prepare()
    with suppress(EOFError, OSError):
        connection.send((READY, None))
        while True:
            function, block = connection.recv()
            connection.send(_answer(function, block))


def _answer(function: Callable[[Any], Any], block: Any) -> tuple[str, Any]:
    try:
        return RESULT, function(block)
    except Exception as error:
        error.add_note(traceback.format_exc())
        try:
            pickle.loads(pickle.dumps(error))
        except Exception:
            return RAISED, RuntimeError(f"{type(error).__name__}: {error}\n{error.__notes__[0]}")
        return RAISED, error


def _end_with_parent() -> None:
    """Wait for the end of the parent, and end this process at once, whatever its other thread does.

    Kernels release the lock of Python's interpreter, so that this thread runs beside them.
    """
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
