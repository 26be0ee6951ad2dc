"""A block of joints and its simulation: what a worker process runs, so that it loads no file formats and no study."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.campaign import executors
from tolstat.campaign.executors import Lost
from tolstat.common.tables import PARAM, HistorySpec, Options, Simulation, Status, without_results


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
    histories : bool
        Whether to keep the load histories that the study asks for, or none.
    """

    point: str
    slots: NDArray[np.intp]
    params: NDArray[np.void]
    options: Options
    histories: bool = True

    def split(self) -> list[Block]:
        """Split into halves; a block of one joint is its only piece."""
        half = (len(self.slots) + 1) // 2
        parts = [part for part in (slice(half), slice(half, None)) if self.slots[part].size]
        return [self._replace(slots=self.slots[part], params=self.params[part]) for part in parts]

    def size(self) -> int:
        """Return the number of joints."""
        return len(self.slots)


class Timed(NamedTuple):
    """Result of simulating a block, and the time that it took, s."""

    simulation: Simulation
    seconds: float


BlockWork = executors.Work[Block, Timed | Lost]
"""How a worker simulates a block."""


def prepare(warm_up: Callable[..., object], options: Iterable[Options], params: NDArray[np.void] | None = None) -> None:
    """Compile what joints with any of the options need, such as `params`, or load it."""
    for one in options:
        warm_up(one, params)


def _finite(params: NDArray[np.void]) -> NDArray[np.bool_]:
    good = np.ones(len(params), bool)
    for name in PARAM.names or ():
        good &= np.isfinite(params[name]).reshape(len(params), -1).all(axis=1)
    return good


def simulate_block(
    simulate: Callable[..., Simulation],
    histories: str,
    n_harmonics: int,
    specs: Mapping[str, HistorySpec],
    block: Block,
) -> Timed:
    """Simulate a block and measure the time that it takes."""
    begin = time.perf_counter()
    kept = (histories, n_harmonics, specs) if block.histories else ("none", 0, {})
    simulation = simulate_finite(simulate, *kept, block)
    return Timed(simulation, time.perf_counter() - begin)


def simulate_finite(
    simulate: Callable[..., Simulation],
    histories: str,
    n_harmonics: int,
    specs: Mapping[str, HistorySpec],
    block: Block,
) -> Simulation:
    """Simulate the joints of a block with finite parameters; the others get INVALID_INPUT."""
    good = _finite(block.params)
    whole = without_simulation(len(good), Status.INVALID_INPUT, specs)
    if not good.any():
        return whole
    part = simulate(block.params[good], block.options, histories=histories, n_harmonics=n_harmonics)
    if good.all():
        return part
    whole.results[good] = part.results
    for name, values in part.histories.items():
        whole.histories[name][good] = values
    return whole


def without_simulation(n: int, status: Status, specs: Mapping[str, HistorySpec]) -> Simulation:
    """Return what the file stores for `n` joints that have no results: the given status and NaN."""
    return Simulation(without_results(n, status), {name: spec.blank(n) for name, spec in specs.items()})
