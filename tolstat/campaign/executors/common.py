"""Definitions shared by all executors: the work to be done, and the record of a block that was given up."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, Literal, NamedTuple, TypeVar

from tolstat.common.errors import TolstatError

BlockT = TypeVar("BlockT")
ResultT = TypeVar("ResultT")

POLL_S = 0.2
"""Interval at which a request to stop is checked while workers are busy, s."""


class WorkerDied(TolstatError):
    """Worker processes die whichever block they work on; finished results have been yielded before."""


class Lost(NamedTuple):
    """Takes the place of a result when a block that cannot be split was given up.

    Attributes
    ----------
    kind : {"crashed", "timeout"}
        Whether the block crashed its process (or raised), or made no progress in the time allowed.
    reason : str
        What happened at the last attempt, such as ``"killed by SIGKILL"``.
    """

    kind: Literal["crashed", "timeout"]
    reason: str


def unsplit(block: BlockT) -> Sequence[BlockT]:
    """Return a block as its only piece."""
    return [block]


def of_one(block: object) -> int:
    """Return the size of a block of one joint."""
    return 1


def no_preparation() -> None:
    """Do nothing before the first block."""


@dataclass(frozen=True)
class Work(Generic[BlockT, ResultT]):
    """A function of blocks, and how to apply it.

    Attributes
    ----------
    function : callable
        Function of one block. Function, blocks and results must be picklable if other processes are used.
    split : callable
        Block -> its halves, which are processed next if the block's process died or hung; itself if it is one joint.
    size : callable
        Block -> its number of joints.
    prepare : callable
        Called once in each process before the first block, outside the time limit.
    limit_s : float, optional
        Processor time that a joint may take, s, without changing `progress_memory`. A block may take as many times as
        long as it has joints, until it first does. One that takes longer is split; a single joint is given up.
    """

    function: Callable[[BlockT], ResultT]
    split: Callable[[BlockT], Sequence[BlockT]] = unsplit
    size: Callable[[BlockT], int] = of_one
    prepare: Callable[[], object] = no_preparation
    limit_s: float | None = None


def never_stop() -> bool:
    """Return False: no stop is requested."""
    return False
