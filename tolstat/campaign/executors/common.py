"""What all executors share: the work to be done, and what becomes of work that its process did not survive."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, Literal, NamedTuple, TypeVar

from tolstat.common.errors import TolstatError

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
    """Worker processes end without answers, whatever they work at; what was finished has been handed over."""


class Lost(NamedTuple):
    """In place of a result: the block, of one piece, was given up.

    Attributes
    ----------
    kind : {"crashed", "timeout"}
        Whether its process died or was too slow.
    reason : str
        What happened the last time, as ``"killed by SIGKILL"``.
    """

    kind: Literal["crashed", "timeout"]
    reason: str


def whole(block: BlockT) -> Sequence[BlockT]:
    """Do not split a block."""
    return [block]


def nothing() -> None:
    """Prepare nothing."""


@dataclass(frozen=True)
class Work(Generic[BlockT, ResultT]):
    """How blocks become results.

    Attributes
    ----------
    function : callable
        Function of one block. It, the blocks and its results must be picklable where they go to other processes.
    split : callable
        Block -> its pieces. The pieces of a block whose process died or hung are done one by one.
    prepare : callable
        Done once in each process before the first block, outside the time limit.
    limit_s : float, optional
        Longest time for a block, in seconds. One that takes longer is split, a single piece given up in the end.
    """

    function: Callable[[BlockT], ResultT]
    split: Callable[[BlockT], Sequence[BlockT]] = whole
    prepare: Callable[[], object] = nothing
    limit_s: float | None = None


def available_workers() -> int:
    """Return the number of processor cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def never() -> bool:
    """Do not stop."""
    return False
