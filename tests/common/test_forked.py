"""Functions evaluated in forked processes: the same results, also where a process fails or is killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import pytest

from tests.support.environment import environment
from tests.support.systems import needs_linux
from tolstat.common.cores import CAN_FORK, Forked, mapped


@pytest.mark.parametrize("processes", [1, 2, 3, 9])
def test_results_come_in_the_order_of_the_functions(processes: int) -> None:
    assert mapped([lambda i=i: i * i for i in range(5)], processes) == [0, 1, 4, 9, 16]
    assert mapped([], processes) == []


def test_a_function_is_evaluated_in_another_process() -> None:
    assert (Forked(os.getpid).result() != os.getpid()) == CAN_FORK
    assert Forked(os.getpid, forks=False).result() == os.getpid()


def test_what_was_killed_is_evaluated_here() -> None:
    parent = os.getpid()

    def killed() -> int:
        if os.getpid() != parent:
            os.kill(os.getpid(), signal.SIGKILL)
        return 7

    other = Forked(killed)
    assert other.result() == other.result() == 7


def test_what_fails_raises_where_the_result_is_asked_for() -> None:
    other = Forked(lambda: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        other.result()


@needs_linux
def test_no_process_outlives_one_that_is_killed() -> None:
    """The pipe of standard output is open as long as any of the three processes lives."""
    command = [sys.executable, "-c", KILLED]
    with subprocess.Popen(command, stdout=subprocess.PIPE, env=environment(), start_new_session=True) as process:
        try:
            assert process.communicate(timeout=30) == (b"", None)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            raise
    assert process.returncode == -signal.SIGKILL


KILLED = """
import os, signal
from tolstat.common.cores import Forked
others = [Forked(lambda: bytes(10**6)) for _ in range(2)]
assert all(other._end.poll(60) for other in others)
os.kill(os.getpid(), signal.SIGKILL)
"""
