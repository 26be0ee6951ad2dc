"""All experiments, run over seeds by some processes."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from typing import NamedTuple

import numpy as np

from tests.measure.coverage import allocated, causes, derived, pairs, rare, shares
from tests.measure.coverage.statistics import CONTROL, STATISTICS
from tests.measure.coverage.trial import Asked, Experiment, Found, Row, laws, sample_of
from tolstat.common.errors import Fault, InputError
from tolstat.common.loads import FloatArray
from tolstat.common.strict import did_you_mean

FULL, QUICK = 1000, 200
"""Number of seeds of the whole measurement, and of its short form."""
MOST = 0.035
"""Share of the intervals that may lie on either side of the truth."""
LEAST = 0.93
"""Share of the intervals that contain the truth below which a case is named."""
CHUNK = 50
"""Number of seeds of a job: jobs are short, so that processes end together."""


class Coverage(NamedTuple):
    """What was measured.

    Attributes
    ----------
    rows : list of Row
        One for each interval asked for, in the order of `statistics.STATISTICS`.
    """

    rows: list[Row]

    @property
    def failed(self) -> list[Row]:
        """Rows whose intervals surely miss on a side more often than `MOST`, and of which that is not known."""
        return [row for row in self.rows if self.misses(row) and not row.asked.known and row.asked.statistic != CONTROL]

    @property
    def controls_pass(self) -> list[Row]:
        """Rows of the wrong estimator that are not found: none, if the measurement can find one."""
        return [row for row in self.rows if row.asked.statistic == CONTROL and not self.misses(row)]

    @staticmethod
    def misses(row: Row) -> bool:
        """Whether the intervals of a row surely miss more often than `MOST` on a side."""
        return row.misses_surely(MOST)


@cache
def experiments() -> tuple[Experiment, ...]:
    """Every experiment, the wrong estimator last."""
    return (
        *shares.experiments(),
        *derived.experiments(),
        *allocated.experiments(),
        *rare.experiments(),
        *pairs.experiments(),
        *causes.experiments(),
        *_controls(),
    )


def _controls() -> Iterator[Experiment]:
    """Share with the normal approximation, which has the width zero where no joint is above the level."""
    law = laws()["lognormal"]
    for share, n in ((0.05, 60), (0.005, 1024)):
        level = float(law.ppf(1.0 - share))

        def once(rng: np.random.Generator, n: int = n, share: float = share, level: float = level) -> list[Found]:
            own = sample_of(law.draw(rng, n)).above(level).estimate
            half = 1.96 * np.sqrt(own * (1.0 - own) / n)
            return [Found(own - half, own + half, share)]

        yield Experiment((Asked(CONTROL, f"lognormal, {share:g}", n),), once)


def measure(
    seeds: int = FULL,
    only: str = "",
    workers: int = 1,
    say: Callable[[str], None] = lambda words: None,
    among: tuple[Experiment, ...] | None = None,
    keep: Callable[[Coverage], None] = lambda found: None,
) -> Coverage:
    """Run experiments.

    Parameters
    ----------
    seeds : int
        Number of seeds, from 0.
    only : str
        Word that the name of a statistic must contain; all by default.
    workers : int
        Number of processes; does not affect results.
    say : callable
        Receives sentences on the progress.
    among : tuple of Experiment, optional
        Other experiments than all.
    keep : callable
        Receives what was measured so far, after every `CHUNK` seeds.

    Returns
    -------
    Coverage

    Raises
    ------
    InputError
        When no statistic has this name.
    """
    every = experiments() if among is None else among
    numbers = [k for k, one in enumerate(every) if any(only in asked.statistic for asked in one.asked)]
    if not numbers:
        raise InputError(
            [Fault("--only", f"no statistic has {only!r} in its name", did_you_mean(only, list(STATISTICS)))]
        )
    jobs = [
        (k, range(first, min(first + CHUNK, seeds, every[k].most)))
        for first in range(0, seeds, CHUNK)
        for k in numbers
        if first < every[k].most
    ]
    last = {own.start: number for number, (_, own) in enumerate(jobs)}
    parts: dict[int, list[FloatArray]] = {k: [] for k in numbers}

    def collect(done: Iterator[FloatArray]) -> Coverage:
        found = Coverage([])
        for number, ((k, own), judged) in enumerate(zip(jobs, done, strict=True)):
            parts[k].append(judged)
            if number == last[own.start]:
                found = _counted({k: every[k] for k in numbers}, parts, only)
                keep(found)
                say(f"{min(own.start + CHUNK, seeds)} of {seeds} seeds")
        return found

    if workers == 1 or among is not None:
        return collect(every[k].run(own) for k, own in jobs)
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        return collect(pool.map(_job, jobs, chunksize=4))


def _counted(of: dict[int, Experiment], parts: dict[int, list[FloatArray]], only: str) -> Coverage:
    """Rows of the seeds that are done, in the order of `STATISTICS`."""
    rows = []
    for k, one in of.items():
        judged = np.concatenate(parts[k])
        rows += [Row.of(asked, judged[:, i]) for i, asked in enumerate(one.asked) if only in asked.statistic]
    order = list(STATISTICS)
    return Coverage(sorted(rows, key=lambda row: order.index(row.asked.statistic)))


def _job(job: tuple[int, range]) -> FloatArray:
    """Some seeds of an experiment, by its number: functions do not travel between processes."""
    return experiments()[job[0]].run(job[1])
