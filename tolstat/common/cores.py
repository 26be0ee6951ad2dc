"""Processors: their number, threads of libraries on them, and functions evaluated in other processes at the same time.

These processes are forks of this one, which need no start and no copies. Where there is no fork, or none that is safe
(macOS), functions are evaluated here. Results do not depend on that. A fork may read a result file that is open here
for reading: HDF5 reads at given places (pread), they share no position.
"""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from multiprocessing.connection import Connection
from typing import Any, Generic, TypeVar

from tolstat.common.errors import input_error

THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMBA_NUM_THREADS",
)
"""Variables that set the number of threads; libraries read them when they are imported."""


def limit_threads() -> None:
    """Let libraries that are imported from now on use one thread, unless the user has set a number.

    For the small products here, threads of BLAS cost more than they gain: twice the processor time where they wait for
    each other.
    """
    for name in THREAD_VARIABLES:
        os.environ.setdefault(name, "1")


@contextmanager
def one_thread_each() -> Iterator[None]:
    """Limit processes that are started inside to one thread each."""
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


def available_cores() -> int:
    """Return the number of processor cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def number_of_workers(workers: int | None) -> int:
    """Return the number of worker processes that was asked for: one per core with None.

    Raises
    ------
    InputError
        When it is below one.
    """
    if workers is None:
        return available_cores()
    if workers < 1:
        raise input_error("workers", f"{workers!r} is no number of processes", "give a whole number of at least 1")
    return int(workers)


T = TypeVar("T")

CAN_FORK = multiprocessing.get_all_start_methods()[0] != "spawn"  # the default one


class Forked(Generic[T]):
    """A function that is being evaluated in a forked process.

    Parameters
    ----------
    function : callable
        Function without arguments; its result must be picklable. It must not write to files that this process has open.
    forks : bool
        Whether to fork; otherwise the function is evaluated here when its result is asked for.
    """

    def __init__(self, function: Callable[[], T], forks: bool = True) -> None:
        self._function = function
        self._results: list[T] = []
        self._process = None
        if forks and CAN_FORK:
            context: Any = multiprocessing.get_context("fork")
            self._end, other = context.Pipe(duplex=False)
            self._process = context.Process(target=_send, args=(function, other, self._end), daemon=True)
            self._process.start()
            other.close()

    def result(self) -> T:
        """Result of the function; where its process failed or was killed, it is evaluated here, and may raise."""
        if not self._results and self._process is not None:
            with suppress(EOFError, OSError):  # the process has ended without its result
                self._results.append(self._end.recv())
            self._end.close()
            self._process.join()
            self._process = None
        if not self._results:
            self._results.append(self._function())
        return self._results[0]


def _send(function: Callable[[], object], end: Connection, parents: Connection) -> None:
    parents.close()  # so that sending fails where the parent was killed: nobody else reads, and this process ends
    try:
        end.send(function())
    except BaseException:  # the parent evaluates the function again, and raises what there is to raise
        end.close()


def mapped(functions: Sequence[Callable[[], T]], processes: int) -> list[T]:
    """Results of functions, in their order, evaluated in so many processes, this one among them."""
    return in_order(begun(functions, processes, here=1))


def begun(functions: Sequence[Callable[[], T]], processes: int, here: int) -> list[Forked[list[T]]]:
    """Begin to evaluate functions in so many processes: every other one in the same, if these are two.

    What is left to the first `here` of them is evaluated in this process when the results are asked for.
    """
    number = min(processes, len(functions))
    return [Forked(partial(_evaluated, functions[first::number]), first >= here) for first in range(number)]


def in_order(parts: Sequence[Forked[list[T]]]) -> list[T]:
    """Results of the functions that `begun` divides among processes."""
    results = [part.result() for part in parts]
    return [results[i % len(results)][i // len(results)] for i in range(sum(map(len, results)))]


def _evaluated(functions: Sequence[Callable[[], T]]) -> list[T]:
    return [function() for function in functions]
