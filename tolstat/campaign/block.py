"""A block of joints and its simulation: what a worker process runs, so that it loads no file formats and no study."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.campaign.pool import Lost, Work
from tolstat.common.fields import HistorySpec
from tolstat.common.loads import load_of
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import VALID, Options, Simulation, Status, tables, without_results


class Block(NamedTuple):
    """Joints that are simulated together.

    Attributes
    ----------
    point : str
        Operating point.
    slots : ndarray of int, shape (m,)
        Their file slots.
    params : ndarray of PARAM, shape (m,)
        Their parameters.
    options : Options
        Their solver options.
    mechanism : Mechanism
        What they are.
    """

    point: str
    slots: NDArray[np.intp]
    params: NDArray[np.void]
    options: Options
    mechanism: Mechanism

    def split(self) -> list[Block]:
        """Split into halves; a block of one joint is its only piece."""
        half = (len(self.slots) + 1) // 2
        parts = [part for part in (slice(half), slice(half, None)) if self.slots[part].size]
        return [self._replace(slots=self.slots[part], params=self.params[part]) for part in parts]


class Timed(NamedTuple):
    """Result of simulating a block, and the time that it took, s."""

    simulation: Simulation
    seconds: float


BlockWork = Work[Block, Timed | Lost]
"""How a worker simulates a block."""


def load_kernels(warm_up: Callable[..., object], options: Iterable[Options], mechanism: Mechanism) -> None:
    """Load what joints with any of the options need."""
    for each in options:
        warm_up(each, mechanism=mechanism)


def simulate_block(
    simulate: Callable[..., Simulation],
    histories: str,
    n_harmonics: int,
    specs: Mapping[str, HistorySpec],
    block: Block,
) -> Timed:
    """Simulate the joints of a block and measure the time; those whose parameters are not finite get INVALID_INPUT."""
    begin = time.perf_counter()
    mechanism = block.mechanism
    fields = [block.params[name].reshape(len(block.params), -1) for name in tables(mechanism).PARAM.names or ()]
    good = np.isfinite(np.concatenate(fields, axis=1)).all(axis=1)
    whole = without_simulation(len(good), Status.INVALID_INPUT, specs, mechanism)
    if good.any():
        kept = {"histories": histories, "n_harmonics": n_harmonics}
        part = simulate(block.params[good], block.options, mechanism=mechanism, **kept)
        whole.results[good] = part.results
        for name, values in part.histories.items():
            whole.histories[name][good] = values
    return Timed(whole, time.perf_counter() - begin)


def without_simulation(n: int, status: Status, specs: Mapping[str, HistorySpec], mechanism: Mechanism) -> Simulation:
    """Return what the file stores for `n` joints that have no results: the given status and NaN."""
    return Simulation(without_results(n, status, mechanism), {name: spec.blank(n) for name, spec in specs.items()})


def spread(rows: int, count: int) -> NDArray[np.intp]:
    """Return `count` of so many rows, or all, at equal distances, ascending."""
    return np.unique(np.linspace(0, rows - 1, min(count, rows)).astype(np.intp))


def loads_of(results: NDArray[np.void], names: Sequence[str], mechanism: Mechanism) -> NDArray[np.float64]:
    """Loads of joints, (m, loads), SI, NaN where a joint is not valid; from a table RESULT, (m,)."""
    loads = np.column_stack([load_of(name, mechanism).of(results) for name in names])
    return np.where(np.isin(results["status"], VALID)[:, None], loads, np.nan)


def results_of(block: Block, result: Timed | Lost) -> NDArray[np.void]:
    """Return the results of a block, (m,) table RESULT; without numbers if it was given up."""
    if isinstance(result, Lost):
        return without_results(len(block.slots), Status.CRASHED, block.mechanism)
    return result.simulation.results
