"""Joints a second over the number of worker processes, and the memory of each."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.benchmarks.cost.rates import Sample
from tolstat.campaign.pool import Lost, Work, map_blocks
from tolstat.common.cores import available_cores
from tolstat.common.tables import Options
from tolstat.solver import compilation, simulation

BLOCKS, QUICK_BLOCKS = 8, 2
"""Blocks per worker."""
BLOCK, QUICK_BLOCK = 128, 32
"""Joints per block."""


@dataclass(frozen=True)
class Scale:
    """Throughput of a number of workers.

    Attributes
    ----------
    workers : int
        Number of workers.
    per_second : float
        Joints a second of all workers together, wall-clock time, over the time in which all were busy.
    efficiency : float
        `per_second` over `workers` times the rate of one worker.
    cpu_efficiency : float
        The same by CPU time, which excludes other programs on the machine: shows the cost of shared caches and memory.
    worker_mb : float
        Memory of the largest worker after its last block, MB.
    growth_mb : float
        Growth of that memory after the first block, MB.
    """

    workers: int
    per_second: float
    efficiency: float
    cpu_efficiency: float
    worker_mb: float
    growth_mb: float


class Stint(NamedTuple):
    """One block in one process: process id, joints, clock at begin and end (s), CPU time (s), peak memory (MB)."""

    process: int
    joints: int
    begin: float
    end: float
    cpu: float
    mb: float


def counts(most: int) -> list[int]:
    """1, 2, 4 and so on, and `most`."""
    powers = [2**k for k in range(most.bit_length()) if 2**k < most]
    return [*powers, most]


def measure(these: Sample, quick: bool, workers: Sequence[int] | None = None) -> list[Scale]:
    """Simulate blocks of the joints with each number of workers.

    Parameters
    ----------
    these : Sample
        The joints.
    quick : bool
        Few and small blocks: to check that everything runs, not for the numbers.
    workers : sequence of int, optional
        Numbers of processes, the first of them 1; by default 1, 2, 4 and so on, up to one a core.

    Returns
    -------
    list of Scale
    """
    block = np.resize(these.params, QUICK_BLOCK if quick else BLOCK)
    blocks = QUICK_BLOCKS if quick else BLOCKS
    stints = {n: _run([block] * (blocks * n), these.options, n) for n in workers or counts(available_cores())}
    return table(stints)


def table(stints: dict[int, list[Stint]]) -> list[Scale]:
    """Compute the rates of each number of workers from their blocks; the first number is the reference."""
    rates = {n: (_rate(done), _cpu_rate(done)) for n, done in stints.items()}
    first, (rate, cpu_rate) = next(iter(rates.items()))
    scales = []
    for n, done in stints.items():
        own, own_cpu = rates[n]
        largest = max(one.mb for one in done)
        scales.append(
            Scale(n, own, own * first / (n * rate), own_cpu / cpu_rate, largest, largest - _after_first(done))
        )
    return scales


def _rate(done: list[Stint]) -> float:
    """Joints a second over the time in which all processes were busy."""
    processes = {one.process for one in done}
    begin = max(min(one.begin for one in done if one.process == p) for p in processes)
    end = min(max(one.end for one in done if one.process == p) for p in processes)
    inside = [(one, min(one.end, end) - max(one.begin, begin)) for one in done]
    joints = sum(one.joints * max(both, 0.0) / (one.end - one.begin) for one, both in inside)
    return joints / (end - begin)


def _cpu_rate(done: list[Stint]) -> float:
    """Joints per second of CPU time."""
    return sum(one.joints for one in done) / sum(one.cpu for one in done)


def _after_first(done: list[Stint]) -> float:
    """Memory of the largest process after its first block."""
    first: dict[int, Stint] = {}
    for one in sorted(done, key=lambda one: one.begin):
        first.setdefault(one.process, one)
    return max(one.mb for one in first.values())


def _run(blocks: Sequence[NDArray[np.void]], options: Options, workers: int) -> list[Stint]:
    work: Work[NDArray[np.void], Stint | Lost] = Work(
        partial(_simulate, options), prepare=partial(compilation.warm_up, options)
    )
    stints = []
    with closing(map_blocks(work, blocks, workers)) as results:
        for _, stint in results:
            if not isinstance(stint, Lost):
                stints.append(stint)
    return stints


def _simulate(options: Options, block: NDArray[np.void]) -> Stint:
    import os

    begin, cpu = time.monotonic(), time.process_time()
    simulation.simulate_rows(block, options)
    return Stint(os.getpid(), len(block), begin, time.monotonic(), time.process_time() - cpu, memory_mb())


def memory_mb() -> float:
    """Peak memory of this process so far, MB; 0 where that is not known."""
    try:
        lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
        return next(float(line.split()[1]) for line in lines if line.startswith("VmHWM")) * 1.024e-3
    except (OSError, StopIteration):  # not on Linux, where getrusage would give that of the process that started this
        pass
    try:
        import resource
    except ImportError:  # not on Windows
        return 0.0
    import sys

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return float(peak) / (1e6 if sys.platform == "darwin" else 1e3)
