"""Campaigns: the same bytes however they are run, stopped or killed; clear words when they cannot go on."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import threading
import time
from functools import partial
from pathlib import Path

import h5py
import numpy as np
import pytest

from tests.support import fakes
from tests.support.of_cardan import RESULT
from tests.support.synthetic import HEAD
from tests.support.systems import needs_posix
from tolstat import joint
from tolstat import study as studies
from tolstat.campaign import blocks as execution
from tolstat.campaign import run as campaign
from tolstat.common.counts import Counts
from tolstat.common.errors import InputError, StoreError
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import Options
from tolstat.display import progress
from tolstat.solver import compilation, simulation
from tolstat.store import ResultFile, Writer


def datasets(path: Path) -> dict[str, bytes]:
    """Bytes of every dataset of a result file but those that say when and how often it was written."""
    found: dict[str, bytes] = {}

    def take(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset) and name not in ("metadata", "session/number"):
            held = item[...]  # names along an axis are Python objects, whose bytes are addresses
            found[name] = b" ".join(held.tolist()) if held.dtype.kind == "O" else held.tobytes()

    with h5py.File(path, "r") as file:
        file.visititems(take)
    return found


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory):
    """Run a study in one go with one worker; gives it and the datasets of its campaign, histories among them."""
    study = fakes.Study(output=fakes.Output("full"))
    path = tmp_path_factory.mktemp("reference") / "a.h5"
    counts = fakes.run(study, path, workers=1)
    assert counts == Counts(total=40, done=40, unsettled=4, failed=4)
    expected = datasets(path)
    assert "histories/loads" in expected
    return study, expected


@pytest.mark.slow
@pytest.mark.parametrize(("workers", "block"), [(1, 1), (1, 7), (1, 1000), (2, None), (3, 1)])
def test_workers_and_blocks_change_no_byte(tmp_path: Path, reference, workers: int, block: int | None) -> None:
    study, expected = reference
    fakes.run(study, tmp_path / "a.h5", workers, block)
    assert datasets(tmp_path / "a.h5") == expected
    assert [p.name for p in tmp_path.iterdir()] == ["a.h5"]


@pytest.mark.slow
def test_order_of_blocks_changes_no_byte(tmp_path: Path, reference, monkeypatch: pytest.MonkeyPatch) -> None:
    study, expected = reference
    blocks = execution._blocks
    monkeypatch.setattr(execution, "_blocks", lambda *args: reversed(list(blocks(*args))))
    fakes.run(study, tmp_path / "a.h5", 1, 3)
    assert datasets(tmp_path / "a.h5") == expected


@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.slow
def test_interrupted_in_progress_and_resumed(tmp_path: Path, reference, workers: int) -> None:
    study, expected = reference
    path = tmp_path / "a.h5"

    def interrupt(counts: Counts) -> None:
        if counts.done >= 12:
            raise KeyboardInterrupt

    with pytest.raises(campaign.Interrupted, match="to resume, run the same command again") as caught:
        fakes.run(study, path, workers, 4, progress=interrupt)
    assert caught.value.counts.done == 12
    assert caught.value.path == path
    with ResultFile.open(path) as store:
        assert store.pending().size == 28
    fakes.run(study, path, 3 - workers, 5)
    assert datasets(path) == expected


def test_resume_simulates_pending_rows_only(tmp_path: Path) -> None:
    study, path = fakes.Study(), tmp_path / "a.h5"
    simulated: list[int] = []

    def count(params: np.ndarray, options: object, **rest: object) -> object:
        simulated.append(len(params))
        return fakes.simulate(params, fakes.Options(), "none", 0)

    def interrupt(counts: Counts) -> None:
        if counts.done >= 15:
            raise KeyboardInterrupt

    with pytest.raises(campaign.Interrupted):
        fakes.run(study, path, 1, 5, progress=interrupt, simulate_rows=count)
    fakes.run(study, path, 1, 5, simulate_rows=count)
    assert sum(simulated) == 40
    before = path.read_bytes()
    assert fakes.run(study, path, simulate_rows=count).done == 40
    assert sum(simulated) == 40
    assert path.read_bytes() == before
    for _ in range(2):  # the checks at the end are made once
        fakes.run(study, path, check=True, simulate_rows=count)
        assert simulated[-1] == 32  # all that have settled
        assert sum(simulated) == 72


@pytest.mark.slow
def test_progress_hears_the_start_and_every_block(tmp_path: Path) -> None:
    heard: list[Counts] = []
    fakes.run(fakes.Study(), tmp_path / "a.h5", 2, 8, progress=heard.append)
    assert [counts.done for counts in heard] == [0, 8, 16, 24, 32, 40]
    assert heard[-1] == Counts(40, 40, 4, 4)


def warm(calls: list[str], options: Options, params: np.ndarray, mechanism: Mechanism) -> None:
    calls.append("warm")


@pytest.mark.slow
def test_the_kernel_is_compiled_before_there_are_workers(tmp_path: Path) -> None:
    calls: list[str] = []
    hear = {"warm_up": partial(warm, calls), "progress": lambda counts: calls.append("block")}
    fakes.run(fakes.Study(), tmp_path / "a.h5", 2, **hear)
    assert calls[:2] == ["warm", "block"]
    assert calls.count("warm") == 1


def test_a_run_names_its_stages(tmp_path: Path) -> None:
    heard: list[str] = []
    for _ in range(2):
        fakes.run(fakes.Study(), tmp_path / "a.h5", check=True, stage=heard.append)
    kernels = compilation.stage_name()
    check = "check of the numerical error"
    assert heard[:4] == ["drawing the errors", kernels, progress.JOINTS, check]
    assert heard[4:] == ["opening the file", progress.JOINTS, check]


def start(
    path: Path, workers: int, block: int, seconds: float, histories: str = "none", n: int = 40
) -> subprocess.Popen[str]:
    """Start a slow campaign in another process; returns when its first block is in the file."""
    arguments = (str(path), workers, block, seconds, histories, n)
    python = [
        sys.executable,
        "-c",
        f"from tests.support import fakes\nif __name__ == '__main__': fakes.main{arguments!r}",
    ]
    # A session of its own, as a job of a shell is: an interrupt goes to the workers, too.
    process = subprocess.Popen(
        python, env=fakes.environment(), stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "go\n"
    return process


@needs_posix
@pytest.mark.slow
@pytest.mark.parametrize(("workers", "number"), [(1, signal.SIGINT), (2, signal.SIGTERM)])
def test_a_request_to_stop_keeps_finished_blocks(tmp_path: Path, workers: int, number: signal.Signals) -> None:
    path = tmp_path / "a.h5"
    process = start(path, workers, block=2, seconds=0.05)
    signal_group(process, number)
    said, _ = process.communicate(timeout=60)
    assert process.returncode == 128 + number
    with ResultFile.open(path) as store:
        counts = store.counts()
    assert said.startswith(f"stopped: {path} holds the results of {counts.done} of 40 joints\n  hint: to resume")
    assert 2 <= counts.done < 40
    fakes.run(fakes.Study(), path, 1)
    fakes.run(fakes.Study(), tmp_path / "b.h5", 1)
    assert datasets(path) == datasets(tmp_path / "b.h5")


@needs_posix
@pytest.mark.slow
def test_second_ctrl_c_waits_for_nothing(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    process = start(path, workers=2, block=1, seconds=0.4)
    deadline = time.monotonic() + 60
    while process.poll() is None:
        assert time.monotonic() < deadline
        signal_group(process, signal.SIGINT)
        time.sleep(0.1)
    assert process.returncode in (130, -signal.SIGINT)  # the last one may hit Python's own end
    with Writer.open(path) as store:
        assert 1 <= store.counts().done < 40


def signal_group(process: subprocess.Popen[str], number: signal.Signals) -> None:
    os.killpg(process.pid, number)


@pytest.fixture(scope="module")
def long_reference(tmp_path_factory: pytest.TempPathFactory):
    """Run a study of many joints; gives it and its datasets."""
    study = fakes.Study(n=300, output=fakes.Output("full"))
    path = tmp_path_factory.mktemp("reference") / "a.h5"
    fakes.run(study, path, 1)
    return study, datasets(path)


@pytest.mark.parametrize("moment", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in (1, 2, 3))])
def test_kill_loses_at_most_the_blocks_in_work(tmp_path: Path, long_reference, moment: int) -> None:
    study, expected = long_reference
    path, workers, block = tmp_path / "a.h5", 1 + moment % 2, 2 + moment
    process = start(path, workers, block, seconds=0.005, histories=study.output.histories, n=study.n)
    time.sleep(random.Random(moment).uniform(0, 0.3))
    process.kill()
    process.communicate()
    with Writer.open(path) as store:
        done = np.flatnonzero(store.status())
        results = store.results()
    assert block <= done.size < study.n
    kept = {name: np.frombuffer(expected[f"results/{name}"]) for name in ("cross1.F_max", "psi_max")}
    np.testing.assert_array_equal(results["F_max"][done, 0], kept["cross1.F_max"][done])
    np.testing.assert_array_equal(results["psi_max"][done], kept["psi_max"][done])
    # Blocks are begun in the order of the rows: what is missing below the last one done was in work.
    assert np.setdiff1d(np.arange(done.max()), done).size <= 2 * workers * block
    fakes.run(study, path, 1)
    assert datasets(path) == expected


@pytest.mark.slow
def test_stopped_while_checksums_are_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study, path = fakes.Study(output=fakes.Output("full")), tmp_path / "a.h5"
    fakes.run(study, tmp_path / "b.h5", 1)

    def interrupt(*args: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("tolstat.store.checksums.update", interrupt)
        with pytest.raises(KeyboardInterrupt):
            fakes.run(study, path, 1)
    fakes.run(study, path, 1)
    assert datasets(path) == datasets(tmp_path / "b.h5")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.h5", "b.h5"]


def test_another_study_is_refused_with_the_keys(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    fakes.run(fakes.Study(), path, 1)
    before = path.read_bytes()
    other = fakes.Study(seed=8, solver=fakes.Solver(60), limits={}, text="# another comment")
    with pytest.raises(StoreError) as caught:
        fakes.run(other, path, 1)
    assert str(caught.value) == (
        f"{path}: is the result file of another study\n"
        "    sampling.seed: 7 in the file, 8 in the study\n"
        "    solver.steps_per_rev: 30 in the file, 60 in the study\n"
        "  hint: give another file: --out OTHER.h5"
    )
    assert path.read_bytes() == before


def test_edited_limits_are_taken_over_and_nothing_is_simulated_again(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    fakes.run(fakes.Study(), path, 1)
    before = datasets(path)
    same = fakes.Study(limits={"fork1.T": 40.0}, text="# another comment", name="moved")
    assert fakes.run(same, path, simulate_rows=fakes.simulate_and_raise).done == 40
    with ResultFile.open(path) as store:
        assert (store.limits, store.study_text, store.study_name) == ({"fork1.T": 40.0}, "# another comment", "moved")
    assert datasets(path) == before


def test_another_version_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fakes.run(fakes.Study(), tmp_path / "a.h5", 1)
    monkeypatch.setattr("tolstat.__version__", "99.0")
    with pytest.raises(StoreError, match=r"tolstat: .* in the file, 99.0 now"):
        fakes.run(fakes.Study(), tmp_path / "a.h5", 1)


@pytest.mark.slow
def test_a_bug_in_every_joint_comes_through(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError):
        fakes.run(fakes.Study(), tmp_path / "a.h5", 2, 2, simulate_rows=fakes.simulate_and_raise)
    fakes.run(fakes.Study(), tmp_path / "a.h5", 1)


def test_runs_outside_the_main_thread(tmp_path: Path) -> None:
    done: list[Counts] = []

    def run() -> None:
        done.append(fakes.run(fakes.Study(), tmp_path / "a.h5", 1))

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    assert done[0].done == 40


def test_signals_mean_the_same_as_before_afterwards(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = [signal.getsignal(number) for number in campaign.SIGNALS]
    fakes.run(fakes.Study(), tmp_path / "a.h5", 1)
    assert [signal.getsignal(number) for number in campaign.SIGNALS] == before
    with pytest.raises(KeyboardInterrupt), campaign.signals_caught():
        signal.raise_signal(signal.SIGTERM)
    assert [signal.getsignal(number) for number in campaign.SIGNALS] == before


@needs_posix
def test_an_ignored_hang_up_stays_ignored() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with campaign.signals_caught() as stop, stop.deferred():
            signal.raise_signal(signal.SIGHUP)
            assert not stop()
            signal.raise_signal(signal.SIGTERM)
            assert stop()
            assert stop.number == signal.SIGTERM
    finally:
        signal.signal(signal.SIGHUP, before)


def test_workers_and_block_must_be_positive(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        fakes.run(fakes.Study(), tmp_path / "a.h5", workers=0, block=-1)
    assert [fault.place for fault in caught.value.faults] == ["workers", "block"]
    assert list(tmp_path.iterdir()) == []


REAL_STUDY = (
    HEAD
    + """[solver]
steps_per_rev = 60
[tolerances]
"pin*.offset_t" = { plus_minus = "0.05 mm", distribution = "normal", cpk = 1.0 }
"hole*.tilt_z" = { plus_minus = "0.3 deg", distribution = "uniform" }
[sampling]
n = 6
seed = 3
[output]
histories = "KIND"
"""
)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["full", "harmonics+cycles"])
def test_real_joints_give_the_same_bytes(tmp_path: Path, kind: str) -> None:
    (tmp_path / "real.toml").write_text(REAL_STUDY.replace("KIND", kind))
    plan = studies.load(tmp_path / "real.toml")
    for name, workers, block in (("a", 1, 7), ("b", 2, 2)):
        counts = campaign.run(plan, tmp_path / f"{name}.h5", workers, block)
        assert counts.done == 7
    assert datasets(tmp_path / "a.h5") == datasets(tmp_path / "b.h5")
    with ResultFile.open(tmp_path / "a.h5") as store:
        # A row can be run again from the file alone, in any company.
        again = simulation.simulate_rows(
            joint.perturb(plan.joint, plan.operation, store.errors()[[4, 2]]),
            plan.solver.options(),
            kind,
            plan.output.harmonics,
        )
        results = store.results()[[4, 2]]
        for name in RESULT.names or ():
            np.testing.assert_array_equal(results[name], again.results[name])
        for name in store.history_specs:
            np.testing.assert_array_equal(store.histories(name, np.array([4, 2])), again.histories[name])
