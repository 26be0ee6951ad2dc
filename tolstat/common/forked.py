"""Functions evaluated in other processes while this one goes on: forks of it, which need no start and no copies.

Where there is no fork that is safe (outside Linux), functions are evaluated here. Results do not depend on that. A fork
may read a result file that is open here for reading: HDF5 reads at given places (pread), they share no position.
"""

from __future__ import annotations

import multiprocessing
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection
from typing import Generic, TypeVar

T = TypeVar("T")

CAN_FORK = sys.platform == "linux"


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
            context = multiprocessing.get_context("fork")
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
