"""Time that a worker has used without progress: processor time, so that a machine under load delays no verdict."""

from __future__ import annotations

import ctypes
import time
from dataclasses import dataclass
from multiprocessing.context import SpawnContext
from typing import Any

from tolstat.campaign.executors.common import POLL_S
from tolstat.common.cores import processor_time
from tolstat.common.progress_memory import SIZE


def shared_memory(context: SpawnContext) -> Any:
    """Memory for a worker's `progress_memory`, which processes of `context` inherit."""
    return context.RawArray(ctypes.c_char, SIZE)


@dataclass
class Watch:
    """Watch over one worker.

    Attributes
    ----------
    pid : int
        The worker.
    memory : array of char
        Its `progress_memory`, shared with this process.
    limit_s : float, optional
        Processor time after which a worker that makes no progress is given up, s.
    joints : int
        How many times as long the worker may take until it makes progress for the first time: work that does not count
        in its memory takes no more than that in all.
    """

    pid: int
    memory: Any
    limit_s: float | None = None
    joints: int = 1

    def begin(self, limit_s: float | None, joints: int) -> None:
        """Begin to watch over another block."""
        self.limit_s, self.joints = limit_s, joints
        self._seen = bytes(self.memory)
        self._at, (self._used, _) = time.monotonic(), processor_time(self.pid)
        self._idle = 0.0

    def is_over(self) -> bool:
        """Whether the worker has used up its time; to be called a few times a second.

        A worker that sleeps uses none: what it sleeps counts as used. One that waits for a processor does not sleep.
        """
        if self.limit_s is None:
            return False
        at, (used, sleeps), seen = time.monotonic(), processor_time(self.pid), bytes(self.memory)
        if seen != self._seen:
            self._seen, self._idle, self.joints = seen, 0.0, 1
        elif used > self._used or not sleeps:
            self._idle += used - self._used
        else:
            self._idle += min(at - self._at, 2 * POLL_S)  # this process may have been stopped meanwhile
        self._at, self._used = at, used
        return self._idle > self.limit_s * self.joints
