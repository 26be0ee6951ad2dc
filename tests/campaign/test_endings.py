"""Campaigns end, whatever their joints do: if they are slow, hang or kill their process, and on machines under load."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from tests.campaign.test_campaign import datasets
from tests.campaign.test_executor import running
from tests.support import fakes
from tests.support.environment import environment
from tolstat.campaign import run as campaign
from tolstat.campaign.blocks import Execution
from tolstat.campaign.executors import Lost, Work, kept_workers, map_in_processes
from tolstat.common import progress_memory
from tolstat.common.tables import Fidelity, Options, Simulation, Status
from tolstat.store import ResultFile, verification

LIMIT_S = 0.05


def burn(seconds: float) -> None:
    end = time.process_time() + seconds
    while time.process_time() < end:
        pass


def simulate_slowly(
    params: np.ndarray, options: Options, histories: str, n_harmonics: int, seconds: float
) -> Simulation:
    """Simulate joints that take processor time, `seconds` each, without progress."""
    burn(seconds * len(params))
    return fakes.simulate(params, options, histories, n_harmonics)


def simulate_checks_badly(params: np.ndarray, options: Options, histories: str, n_harmonics: int) -> Simulation:
    """Simulate; joints with finer steps kill their process, and those with a tighter tolerance take for ever."""
    if options.steps_per_rev > Options().steps_per_rev:
        os.kill(os.getpid(), signal.SIGKILL)
    while options.newton_tol < Options().newton_tol:
        pass
    return fakes.simulate(params, options, histories, n_harmonics)


def simulate_pilot_badly(
    params: np.ndarray, options: Options, histories: str, n_harmonics: int, kills: float
) -> Simulation:
    """Simulate; one joint kills its process with few quasi-static steps."""
    if kills in params["R"] and options.fidelity == Fidelity.QUASISTATIC and options.steps_per_rev < 90:
        os.kill(os.getpid(), signal.SIGKILL)
    return fakes.simulate(params, options, histories, n_harmonics)


def count_slowly(x: int) -> int:
    """Take six times as long as a joint may without progress, and show progress all the while."""
    counter = progress_memory.zeros(1, np.dtype(np.int64))
    for _ in range(12):
        counter += 1
        burn(LIMIT_S / 2)
    return x * x


def sleep(x: int) -> int:
    time.sleep(3600 if x == 1 else 0)
    return x


def process(x: int) -> int:
    return os.getpid()


def mark() -> None:
    """Leave a mark in this process."""
    os.environ["MARKED"] = "yes"


def marked_process(x: int) -> tuple[int, bool]:
    return os.getpid(), "MARKED" in os.environ


@contextmanager
def busy(number: int) -> Iterator[None]:
    """Keep that many processes busy beside this one."""
    beside = [subprocess.Popen([sys.executable, "-S", "-c", "while True: pass"]) for _ in range(number)]
    try:
        yield
    finally:
        for one in beside:
            one.kill()
            one.wait()


@pytest.mark.slow
@pytest.mark.parametrize("workers", [2, 8])
def test_a_campaign_in_which_no_joint_comes_through_ends(tmp_path: Path, workers: int) -> None:
    study, path = fakes.Study(n=3), tmp_path / "a.h5"
    stages = fakes.stages(partial(simulate_slowly, seconds=20 * LIMIT_S))
    execution = Execution("processes", workers, 2, joint_timeout=LIMIT_S)
    counts = campaign.run(study, path, stages=stages, execution=execution, tell=lambda _: None)
    assert (counts.done, counts.failed) == (3, 3)
    with ResultFile.open(path) as store:
        assert (store.status() == Status.TIMEOUT).all()


@pytest.mark.slow
@pytest.mark.usefixtures("supervised")
def test_a_joint_that_hangs_in_a_campaign_of_one_block_is_given_up_alone(tmp_path: Path) -> None:
    study, path = fakes.Study(n=3), tmp_path / "a.h5"
    values = fakes.draw(study)["pin1.offset_t"]
    stages = fakes.stages(partial(fakes.simulate_badly, kills=values[1], hangs=values[2]))
    execution = Execution(workers=1, block=3, joint_timeout=LIMIT_S)
    campaign.run(study, path, stages=stages, execution=execution, tell=lambda _: None)
    with ResultFile.open(path) as store:
        first, *others = store.status()
    assert others == [Status.CRASHED, Status.TIMEOUT]
    assert first in (Status.OK, Status.NOT_SETTLED, Status.NEWTON_FAILED)


@pytest.mark.slow
@pytest.mark.usefixtures("supervised")
def test_joints_that_kill_or_hang_in_the_check_of_a_run_do_not_end_it(tmp_path: Path) -> None:
    study, path = fakes.Study(n=3, solver=fakes.Solver(Options().steps_per_rev)), tmp_path / "a.h5"
    execution = Execution(workers=1, block=3, joint_timeout=LIMIT_S)
    assert campaign.run(study, path, stages=fakes.stages(simulate_checks_badly), execution=execution).done == 3
    with ResultFile.open(path) as store:
        found = verification.read(store)
    assert found is not None
    status = {name: check.results["status"].tolist() for name, check in found.checks.items()}
    assert status == {"half_step": [Status.CRASHED], "newton": [Status.TIMEOUT], "settling": [Status.OK]}


@pytest.mark.slow
@pytest.mark.usefixtures("supervised")
def test_a_joint_that_kills_in_the_pilot_of_a_fidelity_is_no_joint_of_the_others() -> None:
    study = fakes.Study(n=3)
    kills = fakes.draw(study)["pin1.offset_t"][1]
    stages = fakes.stages(partial(simulate_pilot_badly, kills=kills))
    record = campaign.choose_fidelity(study, stages, Execution(workers=1))
    differing = {(rung["fidelity"], rung["steps_per_rev"]): rung["differing"] for rung in record["table"]}
    assert [rung for rung, joints in differing.items() if joints] == [("quasistatic", 36), ("quasistatic", 60)]


def test_blocks_that_take_as_long_as_their_joints_may_are_no_timeouts() -> None:
    work = Work(partial(_burn_for, 0.6 * LIMIT_S), size=len, limit_s=LIMIT_S)
    assert [result for _, result in map_in_processes(work, [[1, 2, 3]] * 2, 1)] == [3, 3]


def _burn_for(seconds: float, xs: list[int]) -> int:
    burn(seconds * len(xs))
    return len(xs)


@pytest.mark.slow
def test_what_makes_progress_is_no_timeout() -> None:
    assert list(map_in_processes(Work(count_slowly, limit_s=LIMIT_S), [3], 1)) == [(3, 9)]


@pytest.mark.slow
def test_what_sleeps_is_a_timeout() -> None:
    found = dict(map_in_processes(Work(sleep, limit_s=LIMIT_S), [0, 1, 2], 1))
    assert found == {0: 0, 1: Lost("timeout", f"made no progress in {LIMIT_S:g} s of processor time"), 2: 2}


@pytest.mark.slow
def test_ten_busy_processes_beside_change_no_byte(tmp_path: Path) -> None:
    """Each joint takes half of what it may; on the clock it takes several times as long as that."""
    study, limit = fakes.Study(n=3), 0.2
    campaign.run(study, tmp_path / "a.h5", 1, stages=fakes.stages())
    stages = fakes.stages(partial(simulate_slowly, seconds=limit / 2))
    execution = Execution("processes", 1, 3, joint_timeout=limit)
    begin, used = time.monotonic(), 3 * limit
    with busy(5 * (os.cpu_count() or 1)):
        campaign.run(study, tmp_path / "b.h5", stages=stages, execution=execution)
    assert time.monotonic() - begin > used
    assert datasets(tmp_path / "b.h5") == datasets(tmp_path / "a.h5")


@pytest.mark.slow
def test_workers_are_kept_for_other_work_too() -> None:
    with kept_workers():
        first, second = (next(iter(dict(map_in_processes(Work(process), [1], 1)).values())) for _ in range(2))
        assert dict(map_in_processes(Work(abs, prepare=mark), [-3], 1)) == {-3: 3}
        assert dict(map_in_processes(Work(marked_process), [1], 1)) == {1: (first, True)}
    assert first == second
    assert not running(first)


@pytest.mark.slow
def test_workers_that_are_started_ahead_do_the_first_map() -> None:
    with kept_workers(2, mark):
        found = dict(map_in_processes(Work(marked_process), range(8), 2))
        assert {marked for _, marked in found.values()} == {True}
        assert len({number for number, _ in found.values()}) <= 2
    with kept_workers(1, sys.exit):  # a worker that is gone before it gets its work is replaced
        ((_, marked),) = dict(map_in_processes(Work(marked_process), [1], 1)).values()
        assert not marked


@pytest.mark.slow
def test_a_worker_that_hangs_ends_with_its_parent(tmp_path: Path) -> None:
    """Compiled code that loops lets no thread of Python run, here neither does a lock that is never released."""
    script = tmp_path / "script.py"
    script.write_text(
        "import ctypes, os, pathlib, sys\n"
        "from tests.campaign.test_endings import *\n"
        "def hang(folder):\n"
        "    pathlib.Path(folder, str(os.getpid())).touch()\n"
        "    ctypes.PyDLL(None).pause()\n"  # keeps the interpreter's lock
        "if __name__ == '__main__':\n"
        f"    list(map_in_processes(Work(hang), [{str(tmp_path)!r}], 1))\n"
    )
    parent = subprocess.Popen([sys.executable, str(script)], env=environment())
    with closing(_numbers(tmp_path)) as found:
        worker = next(found)
    parent.kill()
    parent.wait()
    deadline = time.monotonic() + 20
    while running(worker):
        assert time.monotonic() < deadline, "a worker outlives its parent"
        time.sleep(0.05)


def _numbers(folder: Path) -> Iterator[int]:
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        yield from (int(path.name) for path in folder.iterdir() if path.name.isdigit())
        time.sleep(0.05)
