"""Blocks through a function in one or several processes: complete, in order of finishing, stoppable, unkillable."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from tests.support.environment import environment
from tolstat.campaign.executors import Lost, Work, WorkerDied, map_in_processes, map_serially
from tolstat.campaign.executors.common import never_stop
from tolstat.common.cores import THREAD_VARIABLES, available_cores

SQUARES = {i: i * i for i in range(20)}


def map_blocks(
    function: Callable[[Any], Any],
    blocks: Iterable[Any],
    workers: int,
    stop: Callable[[], bool] = never_stop,
    **how: Any,
) -> Generator[tuple[Any, Any], None, None]:
    if workers == 1:
        return map_serially(Work(function, **how), blocks, stop)
    return map_in_processes(Work(function, **how), blocks, workers, stop)


def square(x: int) -> int:
    return x * x


def slow_square(x: int) -> int:
    time.sleep(0.05)
    return x * x


def very_slow_first(x: int) -> int:
    time.sleep(60 if x == 0 else 0)
    return x


def squares(xs: list[int]) -> list[int]:
    """Squares; 11 kills the process, 12 loops for ever, 13 is a bug."""
    for x in xs:
        if x == 11:
            os.kill(os.getpid(), signal.SIGKILL)
        while x == 12:
            pass
        if x == 13:
            raise ZeroDivisionError("a bug")
    return [x * x for x in xs]


def halves(xs: list[int]) -> list[list[int]]:
    return [part for part in (xs[: (len(xs) + 1) // 2], xs[(len(xs) + 1) // 2 :]) if part]


def die(x: int) -> int:
    os.kill(os.getpid(), signal.SIGKILL)
    return x


def bad_luck(job: tuple[str, int]) -> int:
    """Square; the first process that comes to a multiple of three dies of it, the next does not."""
    folder, x = job
    if x % 3 == 0 and not Path(folder, str(x)).exists():
        Path(folder, str(x)).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return x * x


def die_in_the_middle(x: int) -> int:
    return die(x) if 3 <= x < 7 else x


def die_in_the_end(job: tuple[str, int]) -> int:
    """Every process dies after five blocks, whatever it works at, as when another program takes all memory."""
    folder, x = job
    if len(list(Path(folder).iterdir())) >= 5:
        die(x)
    Path(folder, str(x)).touch()
    return x


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


@pytest.mark.slow
def test_blocks_that_cannot_be_done_are_given_up_alone() -> None:
    blocks = [list(range(first, first + 5)) for first in range(0, 40, 5)]
    found: dict[int, Any] = {}
    for block, result in map_blocks(squares, blocks, 2, split=halves, size=len, limit_s=0.1):
        if isinstance(result, Lost):
            assert len(block) == 1
            found[block[0]] = result
        else:
            found |= dict(zip(block, result, strict=True))
    assert found.pop(11) == Lost("crashed", "killed by SIGKILL")
    assert found.pop(12) == Lost("timeout", "made no progress in 0.1 s of processor time")
    bug = found.pop(13)
    assert (bug.kind, bug.reason.splitlines()[0]) == ("crashed", "ZeroDivisionError: a bug")
    assert found == {x: x * x for x in range(40) if x not in (11, 12, 13)}
    assert multiprocessing.active_children() == []


def test_a_single_death_is_nobodys_fault(tmp_path: Path) -> None:
    jobs = [(str(tmp_path), x) for x in range(12)]
    assert dict(map_blocks(bad_luck, jobs, 2)) == {job: job[1] ** 2 for job in jobs}
    assert {int(p.name) for p in tmp_path.iterdir()} == {0, 3, 6, 9}


def test_the_only_block_is_given_up_too() -> None:
    assert list(map_in_processes(Work(die), [1], 1)) == [(1, Lost("crashed", "killed by SIGKILL"))]


@pytest.mark.slow
def test_joints_that_all_crash_are_given_up_one_after_the_other() -> None:
    """A worker that gets ready after each crash shows that the machine is not at fault, and the map goes on."""
    taken: list[int] = []
    blocks = (taken.append(x) or x for x in range(1000))
    with closing(map_in_processes(Work(die), blocks, 1)) as found:
        assert [next(found) for _ in range(3)] == [(x, Lost("crashed", "killed by SIGKILL")) for x in range(3)]
    assert len(taken) < 6


def test_no_block_is_blamed_when_workers_begin_to_die(tmp_path: Path) -> None:
    seen: dict[Any, int] = {}
    with pytest.raises(WorkerDied, match="3 worker processes in a row died at a block that was finished before"):
        seen.update(map_in_processes(Work(die_in_the_end), ((str(tmp_path), x) for x in range(100)), 1))
    assert sorted(seen.values()) == list(range(5))


@pytest.mark.slow
def test_many_bad_blocks_in_a_row_are_given_up() -> None:
    """Since one that came through before does so again, it is the blocks and not the machine."""
    found = dict(map_in_processes(Work(die_in_the_middle), range(9), 1))
    assert {x for x, result in found.items() if isinstance(result, Lost)} == set(range(3, 7))


@pytest.mark.parametrize("workers", [1, 2])
def test_an_exception_in_every_block_comes_through(workers: int) -> None:
    with pytest.raises(ZeroDivisionError, match="a bug"):
        list(map_blocks(squares, [[13]] * 40, workers))


def test_workers_that_cannot_start() -> None:
    with pytest.raises(WorkerDied, match="3 worker processes in a row died at their start: ended with exit code 0"):
        list(map_blocks(square, range(9), 2, prepare=sys.exit))


def test_a_script_without_a_main_guard_is_told(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text("from tests.campaign.test_executor import *\nprint(dict(map_blocks(square, range(4), 2)))\n")
    python = [sys.executable, str(script)]
    ended = subprocess.run(python, env=environment(), capture_output=True, text=True, check=False)
    assert ended.returncode == 1
    assert "WorkerDied" in ended.stderr
    assert '__name__ == "__main__"' in ended.stderr
    assert "died at their start" in ended.stderr


def test_workers_end_with_their_parent(tmp_path: Path) -> None:
    code = (
        "from tests.campaign.test_executor import *\n"
        "if __name__ == '__main__':\n"
        "    for i, (_, (pid, _, _)) in enumerate(map_blocks(surroundings, iter(range(10**9)), 2)):\n"
        "        if i < 20: print(pid, flush=True)\n"
        "        time.sleep(0.01)\n"
    )
    script = tmp_path / "script.py"
    script.write_text(code)
    parent = subprocess.Popen([sys.executable, str(script)], env=environment(), stdout=subprocess.PIPE)
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


def test_available_cores_is_what_this_process_may_use() -> None:
    assert 1 <= available_cores() <= (os.cpu_count() or 1)
