"""CPU times of tasks run in turn: other load on the machine affects all of them alike, so that ratios stay valid."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class Times(NamedTuple):
    """CPU times by name, each of the same rounds.

    Attributes
    ----------
    seconds : dict of str to ndarray, shape (rounds,)
        CPU time of each task, s.
    returned : dict of str to object
        What each task returned in the last round.
    """

    seconds: dict[str, NDArray[np.float64]]
    returned: dict[str, Any]

    def typical(self, name: str) -> float:
        """Median over the rounds, s."""
        return float(np.median(self.seconds[name]))

    def least(self, name: str) -> float:
        """Minimum over the rounds, s: other load on the machine only adds to a time."""
        return float(self.seconds[name].min())

    def ratio(self, name: str, to: str) -> float:
        """Median over the rounds of the ratio of two times."""
        return float(np.median(self.seconds[name] / self.seconds[to]))


def in_turn(
    tasks: Mapping[str, Callable[[], object]], rounds: int, clock: Callable[[], float] = time.process_time
) -> Times:
    """Time all tasks one after the other, round by round, after a warm-up round that is not counted.

    Parameters
    ----------
    tasks : dict of str to callable
        What to time, by name.
    rounds : int
        Number of rounds.
    clock : callable, optional
        Clock in seconds; by default the CPU time of this process.

    Returns
    -------
    Times
    """
    times = Times({name: np.empty(rounds) for name in tasks}, {})
    for count in range(-1, rounds):
        for name, task in tasks.items():
            begin = clock()
            times.returned[name] = task()
            if count >= 0:
                times.seconds[name][count] = clock() - begin
    return times
