"""Blocks of work through a function: in this process, or in a pool of spawned ones. It knows no physics.

Spawned, because a forked child inherits locks of threads that it does not have. Each worker computes with one
thread, leaves Ctrl-C to the parent, and ends when the parent is gone.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.process import BaseProcess
from typing import TypeVar

from tolstat.errors import TolstatError

BlockT = TypeVar("BlockT")
ResultT = TypeVar("ResultT")

POLL_S = 0.2
"""How often a request to stop is looked for while workers are busy, in seconds."""

THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMBA_NUM_THREADS",
)


class WorkerDied(TolstatError):
    """A worker process ended without an answer; the blocks that were finished have been handed over."""


def available_workers() -> int:
    """Return the number of processor cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def map_blocks(
    function: Callable[[BlockT], ResultT],
    blocks: Iterable[BlockT],
    workers: int,
    stop: Callable[[], bool] = lambda: False,
) -> Generator[tuple[BlockT, ResultT], None, None]:
    """Apply `function` to every block and yield the results as they come.

    Close the generator (`contextlib.closing`) when leaving it early: that ends the workers at once.

    Parameters
    ----------
    function : callable
        Function of one block; for more than one worker it, the blocks and its results must be picklable.
    blocks : iterable
        Blocks; taken from it only as they are needed, at most twice as many as workers at a time.
    workers : int
        Number of processes; 1 computes in this process.
    stop : callable, optional
        Asked often; when it says True no block is begun any more, and those in work are finished.

    Yields
    ------
    tuple
        A block and its result, in the order in which they are finished.

    Raises
    ------
    WorkerDied
        When a worker was killed or crashed, after all finished blocks have been yielded.
    """
    if workers > 1:
        yield from _map_in_processes(function, iter(blocks), workers, stop)
        return
    for block in blocks:
        if stop():
            return
        yield block, function(block)


def _map_in_processes(
    function: Callable[[BlockT], ResultT], blocks: Iterator[BlockT], workers: int, stop: Callable[[], bool]
) -> Iterator[tuple[BlockT, ResultT]]:
    started: set[BaseProcess] = set()
    context = multiprocessing.get_context("spawn")
    running: dict[Future[ResultT], BlockT] = {}
    with _one_thread_each():
        pool = ProcessPoolExecutor(workers, context, initializer=_start_worker)
        try:
            while True:
                if stop():
                    blocks = iter(())
                    running = {future: block for future, block in running.items() if not future.cancel()}
                while len(running) < 2 * workers and (block := next(blocks, None)) is not None:
                    before = set(multiprocessing.active_children())
                    running[_submit(pool, function, block)] = block
                    started |= set(multiprocessing.active_children()) - before
                if not running:
                    break
                done, _ = wait(running, timeout=POLL_S, return_when=FIRST_COMPLETED)
                yield from _finished(done, running)
        except BrokenProcessPool as error:
            # Every block still in work fails with the pool; some may have been finished before it.
            wait(running)
            yield from _finished({f for f in running if f.exception() is None}, running)
            raise WorkerDied(
                "a worker process died: it crashed, or the system killed it, often for want of memory\n"
                "  hint: use fewer workers; in a script of your own, start the campaign "
                'under: if __name__ == "__main__"'
            ) from error
        except BaseException:
            # Somebody wants to be gone: nobody waits for blocks whose results would be thrown away.
            for process in started:
                process.terminate()
            raise
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _finished(done: set[Future[ResultT]], running: dict[Future[ResultT], BlockT]) -> Iterator[tuple[BlockT, ResultT]]:
    """Yield the results of `done`, those that raise an exception last, and take them out of `running`."""
    for future in sorted(done, key=lambda future: future.exception() is not None):
        result = future.result()
        yield running.pop(future), result


def _submit(pool: ProcessPoolExecutor, function: Callable[[BlockT], ResultT], block: BlockT) -> Future[ResultT]:
    """Submit a block; a worker that this starts inherits a blocked SIGINT until it can ignore it."""
    if not hasattr(signal, "pthread_sigmask"):
        return pool.submit(function, block)
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        return pool.submit(function, block)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Have workers that are started meanwhile compute with one thread; libraries ask when they are loaded."""
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


def _start_worker() -> None:
    """Set up a worker: Ctrl-C is for the parent to decide about, and without a parent it must not stay."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
