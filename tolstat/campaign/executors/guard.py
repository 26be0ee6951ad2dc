"""A process beside a worker of a cluster, which kills it when a joint hangs, as `processes` does on this machine.

The worker cannot do it alone: while compiled code loops, no thread and no signal handler of Python runs.
"""

from __future__ import annotations

import mmap
import os
import select
import signal
import subprocess
import sys
import tempfile
from contextlib import suppress

from tolstat.campaign.executors.common import POLL_S
from tolstat.campaign.executors.watch import Watch
from tolstat.common import progress_memory


class Guard:
    """The guard of this process, seen from it; to be started before kernels allocate their counters."""

    def __init__(self) -> None:
        with tempfile.TemporaryFile() as file:
            file.truncate(progress_memory.SIZE)
            progress_memory.attach(mmap.mmap(file.fileno(), progress_memory.SIZE))
            command = [sys.executable, "-m", __name__, str(os.getpid()), str(file.fileno())]
            self._process = subprocess.Popen(
                command, stdin=subprocess.PIPE, pass_fds=[file.fileno()], start_new_session=True
            )

    def begin(self, limit_s: float | None, joints: int) -> None:
        """Let the guard watch over a block, as `Watch.begin`."""
        self._tell(f"{limit_s} {joints}\n" if limit_s else "\n")

    def end(self) -> None:
        """Let the guard rest until the next block."""
        self._tell("\n")

    def _tell(self, line: str) -> None:
        assert self._process.stdin is not None
        with suppress(OSError):  # without its guard a worker simulates all the same
            os.write(self._process.stdin.fileno(), line.encode())


def guard(pid: int, memory: mmap.mmap) -> None:
    """Kill process `pid` when its time for a block, told on standard input, is over; end with it."""
    watch = Watch(pid, memory)
    while True:
        told, _, _ = select.select([0], [], [], POLL_S)
        if told:
            lines = os.read(0, 4096).splitlines()
            if not lines:
                return
            limit_s, joints = lines[-1].split() or (b"", b"1")
            watch.begin(float(limit_s) if limit_s else None, int(joints))
        elif watch.is_over():
            os.kill(pid, signal.SIGKILL)


if __name__ == "__main__":
    guard(int(sys.argv[1]), mmap.mmap(int(sys.argv[2]), progress_memory.SIZE))
