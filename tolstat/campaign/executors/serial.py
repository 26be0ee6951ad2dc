"""Serial executor in this process, without protection against crashes and hangs."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable

from tolstat.campaign.executors.common import BlockT, ResultT, Work, never_stop


def map_serially(
    work: Work[BlockT, ResultT], blocks: Iterable[BlockT], stop: Callable[[], bool] = never_stop
) -> Generator[tuple[BlockT, ResultT], None, None]:
    """Apply the function to every block and yield the results in the order of the blocks.

    Parameters
    ----------
    work : Work
        Work to do; only its function is used.
    blocks : iterable
        Blocks; consumed only as they are needed.
    stop : callable, optional
        Called before each block; once it returns True no further block is started.
    """
    for block in blocks:
        if stop():
            return
        yield block, work.function(block)
