"""Blocks through worker processes: complete, in order of finishing, stoppable; deaths cost a joint at most."""

from __future__ import annotations

import multiprocessing
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any

import psutil
import pytest

from tests.conftest import IN_WORKERS as map_blocks
from tests.support.blocks import (
    bad_luck,
    die,
    die_in_the_end,
    halves,
    large,
    mark,
    marked,
    raise_often,
    slow_square,
    square,
    squares,
    surroundings,
    very_slow_first,
)
from tests.support.environment import environment
from tests.support.systems import needs_posix
from tolstat.campaign import pool
from tolstat.campaign.pool import Lost, Work, WorkerDied, kept_workers
from tolstat.common.cores import THREAD_VARIABLES, available_cores

SQUARES = {i: i * i for i in range(20)}


def test_every_block_once() -> None:
    pairs = list(map_blocks(Work(square), iter(SQUARES), 2))
    assert len(pairs) == 20
    assert dict(pairs) == SQUARES
    assert list(map_blocks(Work(square), [], 2)) == []
    assert multiprocessing.active_children() == []


def test_workers_use_one_thread_and_ignore_signals(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "8")
    monkeypatch.delenv("NUMBA_NUM_THREADS", raising=False)
    before = signal.getsignal(signal.SIGINT)
    for _, (pid, variables, handlers) in map_blocks(Work(surroundings), range(4), 2):
        assert pid != os.getpid()
        assert variables == dict.fromkeys(THREAD_VARIABLES, "1")
        assert handlers == {signal.SIG_IGN}
    assert os.environ["OMP_NUM_THREADS"] == "8"
    assert "NUMBA_NUM_THREADS" not in os.environ
    assert signal.getsignal(signal.SIGINT) is before


def test_blocks_are_taken_as_they_are_needed() -> None:
    taken: list[int] = []

    def blocks() -> Iterator[int]:
        for i in range(40):
            taken.append(i)
            yield i

    for done, _ in enumerate(map_blocks(Work(square), blocks(), 2), start=1):
        # A batch that finished together is handed over before new blocks are taken.
        assert len(taken) <= done + 4
    assert len(taken) == 40


def test_stop_finishes_what_is_begun() -> None:
    seen: dict[int, int] = {}
    for block, result in map_blocks(Work(slow_square), iter(range(200)), 2, lambda: len(seen) >= 6):
        seen[block] = result
    assert 6 <= len(seen) <= 10
    assert all(result == block * block for block, result in seen.items())
    assert sorted(seen) == list(range(len(seen)))


def test_leaving_early_ends_the_workers_at_once() -> None:
    begin = time.monotonic()
    with closing(map_blocks(Work(very_slow_first), range(9), 2)) as results:
        assert next(results)[0] > 0
        assert multiprocessing.active_children()
    assert multiprocessing.active_children() == []
    assert time.monotonic() - begin < 50  # not the minute that block 0 takes


@needs_posix
def test_joints_that_fail_twice_are_given_up_alone() -> None:
    blocks = [list(range(first, first + 5)) for first in range(0, 40, 5)]
    found: dict[int, Any] = {}
    for block, result in map_blocks(Work(squares, halves), blocks, 2):
        if isinstance(result, Lost):
            assert len(block) == 1
            found[block[0]] = result
        else:
            found |= dict(zip(block, result, strict=True))
    assert found.pop(11) == Lost("killed by SIGKILL")
    assert found.pop(13) == Lost("ZeroDivisionError: a bug")
    assert found == {x: x * x for x in range(40) if x not in (11, 13)}
    assert multiprocessing.active_children() == []


@needs_posix
def test_a_single_death_is_nobodys_fault(tmp_path: Path) -> None:
    jobs = [(str(tmp_path), x) for x in range(12)]
    assert dict(map_blocks(Work(bad_luck), jobs, 2)) == {job: job[1] ** 2 for job in jobs}
    assert {int(p.name) for p in tmp_path.iterdir()} == {0, 3, 6, 9}


@needs_posix
def test_the_only_joint_is_given_up_too() -> None:
    assert list(map_blocks(Work(die), [1], 1)) == [(1, Lost("killed by SIGKILL"))]


@needs_posix
def test_workers_that_begin_to_die_end_the_map(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pool, "MAX_FAILURES", 4)
    seen: dict[Any, Any] = {}
    with pytest.raises(WorkerDied, match="4 times in a row a worker process failed, the last time: killed by SIGKILL"):
        seen.update(map_blocks(Work(die_in_the_end), ((str(tmp_path), x) for x in range(100)), 1))
    assert [found for found in seen.values() if not isinstance(found, Lost)] == list(range(5))
    assert len(seen) < 10


def test_an_exception_in_every_block_comes_through() -> None:
    taken: list[int] = []
    blocks = ([13] for x in range(40) if not taken.append(x))
    with pytest.raises(ZeroDivisionError, match="a bug") as caught:
        list(map_blocks(Work(squares, halves), blocks, 2))
    assert "in squares" in caught.value.__notes__[0]
    assert len(taken) < 20


def test_workers_that_cannot_start() -> None:
    with pytest.raises(WorkerDied, match=r"1[12] times in a row a worker process failed, .*: ended with exit code 3"):
        list(map_blocks(Work(square, prepare=partial(sys.exit, 3)), range(9), 2))


def test_workers_are_kept_for_other_work_too() -> None:
    with kept_workers():
        assert dict(map_blocks(Work(marked, prepare=mark), [1], 1)) == {1: True}
        with kept_workers():
            assert dict(map_blocks(Work(abs), [-3], 1)) == {-3: 3}
        assert dict(map_blocks(Work(marked), [1], 1)) == {1: True}
        assert len(multiprocessing.active_children()) == 1
    assert multiprocessing.active_children() == []


def test_a_kept_worker_that_has_died_is_replaced() -> None:
    with kept_workers():
        assert dict(map_blocks(Work(abs), [-3], 1)) == {-3: 3}
        for process in multiprocessing.active_children():
            process.kill()
            process.join()
        assert dict(map_blocks(Work(abs), [-4], 1)) == {-4: 4}


@needs_posix
@pytest.mark.slow
def test_workers_that_are_killed_while_they_send_change_nothing() -> None:
    chance, ended = random.Random(0), threading.Event()

    def kill() -> None:
        for _ in range(4):
            ended.wait(chance.uniform(0.2, 1.0))
            if started := multiprocessing.active_children():
                chance.choice(started).kill()

    thread = threading.Thread(target=kill)
    thread.start()
    try:
        found = dict(map_blocks(Work(large), range(60), 2))
    finally:
        ended.set()
        thread.join()
    twice = [x for x, result in found.items() if isinstance(result, Lost)]  # on a busy machine a block may be hit twice
    assert len(twice) <= 2
    assert {found[x] for x in twice} <= {Lost("killed by SIGKILL")}
    assert {x: bytes(found[x][:1]) for x in range(60) if x not in twice} == {
        x: bytes([x]) for x in range(60) if x not in twice
    }


@pytest.mark.slow
def test_a_script_without_a_main_guard_is_told(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        "from tests.support.blocks import square\n"
        "from tolstat.campaign.pool import Work, map_blocks\n"
        "print(dict(map_blocks(Work(square), range(4), 2)))\n"
    )
    python = [sys.executable, str(script)]
    ended = subprocess.run(python, env=environment(), capture_output=True, text=True, check=False)
    assert ended.returncode == 1
    assert "Unguarded" in ended.stderr
    assert '__name__ == "__main__"' in ended.stderr
    assert ended.stderr.count("Traceback") == 1  # no worker adds its own


@pytest.mark.slow
@pytest.mark.parametrize("rest", ["time.sleep(3600)", "compute(1.0)"])
def test_workers_end_with_their_parent(tmp_path: Path, rest: str) -> None:
    """Also while a kernel computes, here one without an end."""
    script = tmp_path / "script.py"
    script.write_text(
        "import os, time\n"
        "from pathlib import Path\n"
        "from tolstat.campaign.pool import Work, map_blocks\n"
        "from tolstat.kernel.simd.jit import njit_inner\n"
        "@njit_inner\n"
        "def compute(x):\n"
        "    while x > 0.0:\n"
        "        x = x / 2.0 + 1.0\n"
        "    return x\n"
        "def work(x):\n"
        "    compute(-1.0)\n"
        f"    Path({str(tmp_path)!r}, str(os.getpid())).touch()\n"
        f"    {rest}\n"
        "if __name__ == '__main__':\n"
        "    list(map_blocks(Work(work), range(2), 2))\n"
    )
    parent = subprocess.Popen([sys.executable, str(script)], env=environment())
    workers: list[int] = []
    deadline = time.monotonic() + 60
    while len(workers) < 2:
        assert time.monotonic() < deadline
        workers = [int(path.name) for path in tmp_path.iterdir() if path.name.isdigit()]
        time.sleep(0.05)
    parent.kill()
    parent.wait()
    deadline = time.monotonic() + 2
    while any(running(pid) for pid in workers):
        assert time.monotonic() < deadline, "workers outlive their parent"
        time.sleep(0.05)


def running(pid: int) -> bool:
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def test_available_cores_is_what_this_process_may_use(monkeypatch: pytest.MonkeyPatch) -> None:
    allowed = {0: {0, 1, 5}}  # 0 is this process
    monkeypatch.setattr(os, "sched_getaffinity", allowed.__getitem__, raising=False)
    assert available_cores() == 3
    monkeypatch.delattr(os, "sched_getaffinity")
    assert available_cores() == (os.cpu_count() or 1)


def test_many_joints_that_fail_are_given_up_alone() -> None:
    blocks = [list(range(first, first + 16)) for first in range(0, 800, 16)]
    found = list(map_blocks(Work(raise_often, halves), blocks, 2))
    lost = [x for xs, result in found if isinstance(result, Lost) for x in xs]
    assert sorted(lost) == list(range(5, 800, 17))
    assert sorted(x for xs, _ in found for x in xs) == list(range(800))
