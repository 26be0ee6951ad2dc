"""Blocks through a function in one or several processes: complete, in order of finishing, stoppable."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from tests import fakes
from tolstat.executor import THREAD_VARIABLES, WorkerDied, available_workers, map_blocks

SQUARES = {i: i * i for i in range(20)}


def square(x: int) -> int:
    return x * x


def slow_square(x: int) -> int:
    time.sleep(0.05)
    return x * x


def very_slow_first(x: int) -> int:
    time.sleep(60 if x == 0 else 0)
    return x


def square_or_die(x: int) -> int:
    if x == 11:
        time.sleep(0.3)
        os.kill(os.getpid(), signal.SIGKILL)
    return x * x


def square_or_raise(x: int) -> int:
    if x == 11:
        raise ZeroDivisionError("a bug")
    return x * x


def surroundings(x: int) -> tuple[int, dict[str, str | None], bool]:
    ignored = signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    return os.getpid(), {name: os.environ.get(name) for name in THREAD_VARIABLES}, ignored


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_every_block_once(workers: int) -> None:
    pairs = list(map_blocks(square, iter(SQUARES), workers))
    assert len(pairs) == 20
    assert dict(pairs) == SQUARES
    assert list(map_blocks(square, [], workers)) == []


def test_one_worker_computes_here_and_in_order() -> None:
    assert list(map_blocks(square, SQUARES, 1)) == list(SQUARES.items())
    assert {pid for _, (pid, _, _) in map_blocks(surroundings, range(3), 1)} == {os.getpid()}


def test_workers_use_one_thread_and_ignore_interrupts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "8")
    monkeypatch.delenv("NUMBA_NUM_THREADS", raising=False)
    for _, (pid, variables, ignored) in map_blocks(surroundings, range(4), 2):
        assert pid != os.getpid()
        assert variables == dict.fromkeys(THREAD_VARIABLES, "1")
        assert ignored
    assert os.environ["OMP_NUM_THREADS"] == "8"
    assert "NUMBA_NUM_THREADS" not in os.environ
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.parametrize("workers", [1, 2])
def test_blocks_are_taken_as_they_are_needed(workers: int) -> None:
    taken: list[int] = []

    def blocks() -> Iterator[int]:
        for i in range(40):
            taken.append(i)
            yield i

    for done, _ in enumerate(map_blocks(square, blocks(), workers), start=1):
        # A batch that finished together is handed over before new blocks are taken.
        assert len(taken) <= done + 2 * workers
    assert len(taken) == 40


@pytest.mark.parametrize("workers", [1, 2])
def test_stop_finishes_what_is_begun(workers: int) -> None:
    seen: dict[int, int] = {}
    for block, result in map_blocks(slow_square, iter(range(200)), workers, stop=lambda: len(seen) >= 6):
        seen[block] = result
    assert 6 <= len(seen) <= 6 + 2 * workers
    assert all(result == block * block for block, result in seen.items())
    assert sorted(seen) == list(range(len(seen)))


def test_leaving_early_ends_the_workers_at_once() -> None:
    begin = time.monotonic()
    with closing(map_blocks(very_slow_first, range(9), 2)) as results:
        assert next(results)[0] > 0
        assert multiprocessing.active_children()
    assert multiprocessing.active_children() == []
    assert time.monotonic() - begin < 50  # not the minute that block 0 takes


def test_a_worker_that_dies_is_an_error_after_the_finished_blocks() -> None:
    seen: dict[int, int] = {}
    with pytest.raises(WorkerDied, match="a worker process died") as caught:
        seen.update(map_blocks(square_or_die, range(20), 2))
    assert "hint: use fewer workers" in str(caught.value)
    assert len(seen) >= 8  # block 11 was handed out when all but four before it had come back
    assert all(result == block * block for block, result in seen.items())
    assert 11 not in seen
    assert multiprocessing.active_children() == []


@pytest.mark.parametrize("workers", [1, 2])
def test_an_exception_of_the_function_comes_through(workers: int) -> None:
    seen: dict[int, int] = {}
    with pytest.raises(ZeroDivisionError, match="a bug"):
        seen.update(map_blocks(square_or_raise, range(20), workers))
    assert 11 not in seen
    assert len(seen) >= 8  # block 11 was handed out when all but four before it had come back
    assert all(result == block * block for block, result in seen.items())


def test_a_script_without_a_main_guard_is_told(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text("from tests.test_executor import *\nprint(dict(map_blocks(square, range(4), 2)))\n")
    python = [sys.executable, str(script)]
    ended = subprocess.run(python, env=fakes.environment(), capture_output=True, text=True, check=False)
    assert ended.returncode == 1
    assert "WorkerDied" in ended.stderr
    assert '__name__ == "__main__"' in ended.stderr


def test_workers_end_with_their_parent(tmp_path: Path) -> None:
    code = (
        "from tests.test_executor import *\n"
        "if __name__ == '__main__':\n"
        "    for i, (_, (pid, _, _)) in enumerate(map_blocks(surroundings, iter(range(10**9)), 2)):\n"
        "        if i < 20: print(pid, flush=True)\n"
        "        time.sleep(0.01)\n"
    )
    script = tmp_path / "script.py"
    script.write_text(code)
    parent = subprocess.Popen([sys.executable, str(script)], env=fakes.environment(), stdout=subprocess.PIPE)
    assert parent.stdout is not None
    workers = {int(parent.stdout.readline()) for _ in range(20)}
    parent.kill()
    parent.communicate()
    deadline = time.monotonic() + 20
    while any(running(pid) for pid in workers):
        assert time.monotonic() < deadline, "workers outlive their parent"
        time.sleep(0.05)


def running(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    status = Path(f"/proc/{pid}/stat")
    return not status.exists() or status.read_text().rsplit(")", 1)[1].split()[0] != "Z"


def test_available_workers_is_what_this_process_may_use() -> None:
    assert 1 <= available_workers() <= (os.cpu_count() or 1)
