"""Blocks one after the other in this process, which nothing protects."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable

from tolstat.campaign.executors.common import BlockT, ResultT, Work, never


def map_here(
    work: Work[BlockT, ResultT], blocks: Iterable[BlockT], stop: Callable[[], bool] = never
) -> Generator[tuple[BlockT, ResultT], None, None]:
    """Apply the function to every block and yield the results in their order.

    Parameters
    ----------
    work : Work
        What to do; of it only the function counts.
    blocks : iterable
        Blocks; taken from it only as they are needed.
    stop : callable, optional
        Asked before each block; when it says True none is begun any more.
    """
    for block in blocks:
        if stop():
            return
        yield block, work.function(block)
