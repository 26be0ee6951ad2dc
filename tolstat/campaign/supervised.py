"""Joints beside the blocks of a campaign, as checks and pilots simulate them, in the same supervised processes."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.campaign import block as one_block
from tolstat.campaign import blocks
from tolstat.campaign.block import Block, BlockWork, Timed, simulate_block
from tolstat.campaign.blocks import Execution, status_of
from tolstat.campaign.executors import Lost, Work, map_in_processes, map_serially
from tolstat.campaign.executors.common import never_stop
from tolstat.common.tables import Options, Simulation, Status, without_results

Simulate = Callable[..., Simulation]


@dataclass(frozen=True)
class Supervised:
    """A function like `simulation.simulate_rows` whose joints may crash or hang: these get no results but a status.

    Attributes
    ----------
    work : Work
        As `blocks.work_of` makes it. Workers that were kept after the blocks of a campaign do the same work.
    warm_up : callable
        As in `Stages`: makes the compiled code here, which a worker then only loads.
    kind : {"processes", "serial", "dask"}, optional
        As in `Execution`; with "dask", too, the processes are those of this machine.
    """

    work: BlockWork
    warm_up: Callable[[Options], object]
    kind: str | None = None

    def __call__(self, params: NDArray[np.void], options: Options, **_: Any) -> Simulation:
        """Simulate joints, (m,) table PARAM, without histories; row i of the result is joint i."""
        self.warm_up(options)
        results = without_results(len(params), Status.PENDING)
        whole = Block("", np.arange(len(params)), params, options, histories=False)
        with closing(map_blocks(self.work, [whole], 1, self.kind or blocks.default_kind(1, 1))) as done:
            for block, result in done:
                results[block.slots] = results_of(block, result)
        return Simulation(results, {})


def results_of(block: Block, result: Timed | Lost) -> NDArray[np.void]:
    """Return the results of a block, (m,) table RESULT; without numbers if it was given up."""
    if isinstance(result, Lost):
        return without_results(len(block.slots), status_of(result))
    return result.simulation.results


def map_blocks(
    work: BlockWork, some: Iterable[Block], workers: int, kind: str, stop: Callable[[], bool] = never_stop
) -> Generator[tuple[Block, Timed | Lost], None, None]:
    """Simulate blocks in supervised processes, or here if `kind` is "serial"; close it when leaving early."""
    serial = kind == "serial"
    return map_serially(work, some, stop) if serial else map_in_processes(work, some, workers, stop)


def supervised(
    simulate: Simulate, warm_up: Callable[[Options], object], options: Sequence[Options], execution: Execution
) -> Supervised:
    """Simulate in workers of their own, which are ready once they have the code that `options` need."""
    function = partial(simulate_block, simulate, "none", 0, {})
    prepare = partial(one_block.prepare, warm_up, list(options))
    work: BlockWork = Work(function, Block.split, Block.size, prepare, execution.joint_timeout)
    return Supervised(work, warm_up, execution.kind)
