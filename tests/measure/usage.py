"""What a command uses: time on the clock, processor time, memory. Runs as a script, which prints JSON.

A script of its own, because the system counts the memory of a process from its fork: a command that a larger program
started would have at least the memory of that program. This one imports next to nothing.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import time


def measure(command: list[str]) -> dict[str, float]:
    """Run a command, without its standard output, and wait for it.

    Parameters
    ----------
    command : list of str
        Path of a program, and its arguments.

    Returns
    -------
    dict of str to float
        ``code``: exit code, negative for a signal. ``wall``: time on the clock, s. ``cpu``: processor time (user and
        system) of the process and of those that it started and waited for, s. ``memory``: largest resident memory of
        any one of these processes, bytes.
    """
    silent = [(os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0)]
    begin = time.perf_counter()
    pid = os.posix_spawn(command[0], command, os.environ, file_actions=silent)
    signal.signal(signal.SIGINT, lambda *_: None)  # a terminal sends it to the command too, which ends
    signal.signal(signal.SIGTERM, lambda *_: os.kill(pid, signal.SIGTERM))
    _, status, used = os.wait4(pid, 0)
    wall = time.perf_counter() - begin
    peak = used.ru_maxrss if sys.platform == "darwin" else 1024 * used.ru_maxrss
    cpu = used.ru_utime + used.ru_stime
    return {"code": os.waitstatus_to_exitcode(status), "wall": wall, "cpu": cpu, "memory": peak}


if __name__ == "__main__":
    print(json.dumps(measure(sys.argv[1:])))
