"""Campaigns that are broken on purpose: nothing is lost, nothing wrong is kept, and the rest goes on.

``TOLSTAT_LONG=1 pytest tests/campaign/test_survival.py`` does the random ones as often as a release asks for.
"""

from __future__ import annotations

import os
import random
import signal
import time
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import psutil
import pytest

from tests.campaign.test_campaign import datasets, start
from tests.support import fakes
from tests.support.systems import needs_posix
from tolstat.campaign import pool
from tolstat.campaign import run as campaign
from tolstat.campaign.block import without_simulation
from tolstat.campaign.pool import WorkerDied
from tolstat.campaign.remedy import Retry, parse_retry
from tolstat.common.cardan import CARDAN
from tolstat.common.counts import Counts
from tolstat.common.errors import InputError, StoreError
from tolstat.common.tables import SIMULATED, Fidelity, Options, Simulation, Status, from_names
from tolstat.joint import Operation
from tolstat.store import ResultFile, verification
from tolstat.study.model import Solver

LONG = bool(os.environ.get("TOLSTAT_LONG"))


def assert_same_but(path: Path, expected: dict[str, bytes], rows: list[int]) -> None:
    """Check that a campaign differs from another one in the results of `rows` only."""
    for name, found in datasets(path).items():
        if name.startswith(("results/", "errors/")):
            kept = np.delete(np.frombuffer(found, np.uint8).reshape(40, -1), rows, axis=0)
            wanted = np.delete(np.frombuffer(expected[name], np.uint8).reshape(40, -1), rows, axis=0)
            np.testing.assert_array_equal(kept, wanted)


@needs_posix
@pytest.mark.slow
@pytest.mark.usefixtures("in_workers")
@pytest.mark.parametrize(("workers", "block"), [(2, 4), (1, 10)])
def test_joints_that_kill_or_raise_are_marked_and_cost_only_themselves(
    tmp_path: Path, expected: dict[str, bytes], workers: int, block: int
) -> None:
    study, path, told = fakes.Study(), tmp_path / "a.h5", []
    values = fakes.draw(study)["pin1.offset_t"]
    bad = partial(fakes.simulate_badly, kills=values[17], raises=values[30])
    counts = fakes.run(study, path, workers, block, simulate_rows=bad, tell=told.append)
    assert counts.done == 40
    with ResultFile.open(path) as store:
        assert store.status()[[17, 30]].tolist() == [Status.CRASHED, Status.CRASHED]
        assert np.isnan(store.results()["F_max"][[17, 30]]).all()
    raised = "row 30: crashed: ZeroDivisionError: a bug of this joint"
    assert sorted(told) == ["row 17: crashed: killed by SIGKILL", raised]
    assert_same_but(path, expected, [17, 30])
    again = Retry((Status.CRASHED,), {}, study.solver.options())
    assert fakes.run(study, path, retry=again, tell=told.append).done == 40
    with ResultFile.open(path) as store:
        assert not (store.status() == Status.CRASHED).any()


@needs_posix
@pytest.mark.slow
@pytest.mark.usefixtures("in_workers")
def test_a_machine_on_which_workers_die_ends_the_run_and_keeps_what_is_done(
    tmp_path: Path, expected: dict[str, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pool, "MAX_FAILURES", 3)
    path = tmp_path / "a.h5"
    dying = partial(simulate_until, folder=str(tmp_path / "done"))
    (tmp_path / "done").mkdir()
    with pytest.raises(WorkerDied, match=r"(?s)3 times in a row .*holds the results of \d+ of 40 joints; to resume"):
        fakes.run(fakes.Study(), path, 1, 4, simulate_rows=dying)
    with ResultFile.open(path) as store:
        assert 16 <= store.counts().done < 30
    again = Retry((Status.CRASHED,), {}, fakes.Study().solver.options())
    fakes.run(fakes.Study(), path, retry=again, tell=lambda _: None)
    found = datasets(path)
    assert {name: found[name] for name in expected if name.startswith("results/")} == {
        name: held for name, held in expected.items() if name.startswith("results/")
    }


def simulate_until(params: np.ndarray, options: Options, folder: str, **kept: Any) -> Simulation:
    """Simulate four blocks; then every process dies."""
    if len(list(Path(folder).iterdir())) == 4:
        os.kill(os.getpid(), signal.SIGKILL)
    Path(folder, str(params["R"][0])).touch()
    return fakes.simulate(params, options, **kept)


@needs_posix
@pytest.mark.slow
@pytest.mark.usefixtures("in_workers")
def test_a_joint_that_kills_in_the_check_of_a_run_does_not_end_it(tmp_path: Path) -> None:
    study, path = fakes.Study(n=3, solver=fakes.Solver(Options().steps_per_rev)), tmp_path / "a.h5"
    assert fakes.run(study, path, 1, 3, check=True, simulate_rows=simulate_checks_badly).done == 3
    with ResultFile.open(path) as store:
        found = verification.read(store)
    assert found is not None
    status = {name: check.results["status"].tolist() for name, check in found.checks.items()}
    assert status == {"finer": [Status.CRASHED, Status.CRASHED]}


def simulate_checks_badly(params: np.ndarray, options: Options, **kept: Any) -> Simulation:
    """Simulate; joints with finer steps kill their process."""
    if options.steps_per_rev > Options().steps_per_rev:
        os.kill(os.getpid(), signal.SIGKILL)
    return fakes.simulate(params, options, **kept)


@needs_posix
@pytest.mark.slow
@pytest.mark.usefixtures("in_workers")
def test_a_joint_that_kills_in_the_pilot_of_a_fidelity_is_no_joint_of_the_others() -> None:
    study = fakes.Study(n=3)
    kills = fakes.draw(study)["pin1.offset_t"][1]
    with fakes.in_place(simulate_rows=partial(simulate_pilot_badly, kills=kills)):
        record = campaign.choose_fidelity(study)
    differing = {(rung["fidelity"], rung["steps_per_rev"]): rung["differing"] for rung in record["table"]}
    assert [rung for rung, joints in differing.items() if joints] == [("quasistatic", 36), ("quasistatic", 60)]


def simulate_pilot_badly(params: np.ndarray, options: Options, kills: float, **kept: Any) -> Simulation:
    """Simulate; one joint kills its process with few quasi-static steps."""
    if kills in params["R"] and options.fidelity == Fidelity.QUASISTATIC and options.steps_per_rev < 90:
        os.kill(os.getpid(), signal.SIGKILL)
    return fakes.simulate(params, options, **kept)


def test_parameters_that_are_no_numbers_are_not_simulated(tmp_path: Path, expected: dict[str, bytes]) -> None:
    path = tmp_path / "a.h5"
    fakes.run(fakes.Study(), path, 1, 4, perturb=perturb_badly)
    with ResultFile.open(path) as store:
        bad = np.flatnonzero(store.errors()["operation.alpha"] > 1.5)
        assert bad.size
        assert (store.status()[bad] == Status.INVALID_INPUT).all()
    assert_same_but(path, expected, bad.tolist())


def perturb_badly(joint: object, operation: Operation, errors: np.ndarray) -> np.ndarray:
    params = fakes.perturb(joint, operation, errors)
    params["pin_axis"][errors["operation.alpha"] > 1.5, 2, 1] = np.inf
    return params


@needs_posix
@pytest.mark.slow
@pytest.mark.parametrize("moment", range(20 if LONG else 1))
def test_all_processes_killed_again_and_again(tmp_path: Path, expected: dict[str, bytes], moment: int) -> None:
    chance, path, kills = random.Random(moment), tmp_path / "a.h5", 0
    while True:
        process = start(path, chance.choice((1, 2)), chance.choice((1, 2, 3)), seconds=0.05)
        time.sleep(chance.uniform(0, 0.4))
        if process.poll() is not None:
            break
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        kills += 1
        with ResultFile.open(path) as store:
            if not store.pending().size:
                break
    assert kills
    fakes.run(fakes.Study(), path, 1)
    assert datasets(path) == expected


@needs_posix
@pytest.mark.slow
@pytest.mark.parametrize("moment", range(5 if LONG else 1))
def test_workers_killed_at_random_change_no_byte(tmp_path: Path, expected: dict[str, bytes], moment: int) -> None:
    chance, path = random.Random(moment), tmp_path / "a.h5"
    process = start(path, 2, 2, seconds=0.05)
    for _ in range(3):
        time.sleep(chance.uniform(0, 0.3))
        alive = psutil.process_iter(["ppid", "cmdline"])
        workers = [one for one in alive if one.info["ppid"] == process.pid and "spawn_main" in str(one.info["cmdline"])]
        if workers:
            chance.choice(workers).kill()
    process.communicate(timeout=60)
    assert process.returncode == 0
    assert datasets(path) == expected


def test_states_without_results_have_none(tmp_path: Path) -> None:
    for status in Status:
        if status not in SIMULATED and status != Status.PENDING:
            blank = without_simulation(2, status, fakes.SPECS, CARDAN)
            assert (blank.results["status"] == status).all()
            assert np.isnan(blank.results["T_mean"]).all()
            assert np.isnan(blank.histories["loads"]).all()


@pytest.mark.parametrize("replaced", [False, True])
@pytest.mark.slow
def test_a_file_that_is_deleted_meanwhile_is_put_back(
    tmp_path: Path, expected: dict[str, bytes], replaced: bool
) -> None:
    path = tmp_path / "a.h5"

    def remove(counts: Counts) -> None:
        if counts.done == 10:
            path.unlink()
            if replaced:
                path.write_text("of somebody else")

    with pytest.raises(StoreError, match=f"during the campaign\n  hint: {tmp_path}.* holds all finished joints"):
        fakes.run(fakes.Study(), path, 1, 5, progress=remove)
    kept = tmp_path / "a.saved.h5" if replaced else path
    with ResultFile.open(kept) as store:
        assert store.counts().done == 15
    fakes.run(fakes.Study(), kept, 1)
    assert datasets(kept) == expected
    assert not replaced or path.read_text() == "of somebody else"


SETTINGS = {"solver.steps_per_rev": 60}
AGAIN = Retry((Status.NEWTON_FAILED,), SETTINGS, Options(steps_per_rev=60))


def simulate_finely(params: np.ndarray, options: Options, **kept: Any) -> Simulation:
    """Simulate; with 60 steps nothing fails."""
    found = fakes.simulate(params, options, **kept)
    if options.steps_per_rev == 60:
        found.results["status"] = Status.OK
        found.results["F_max"] = 7.0
    return found


def stop_at_38(counts: Counts) -> None:
    if counts.done == 38:
        raise KeyboardInterrupt


@pytest.mark.slow
def test_failed_joints_are_simulated_again_with_other_settings(tmp_path: Path) -> None:
    study, path, told = fakes.Study(output=fakes.Output("full")), tmp_path / "a.h5", []
    run = partial(fakes.run, study, path, simulate_rows=simulate_finely)
    run()
    before = datasets(path)
    with ResultFile.open(path) as store:
        failed = np.flatnonzero(store.status() == Status.NEWTON_FAILED)

    with pytest.raises(campaign.Interrupted):
        run(1, 1, progress=stop_at_38, retry=AGAIN, tell=told.append)
    run(2, 1)  # the rows to come know their settings
    assert run(retry=AGAIN, tell=told.append).failed == 0
    assert told == [f"{failed.size} joints are simulated again", "0 joints are simulated again"]
    with ResultFile.open(path) as store:
        (entry,) = store.retries
        assert (entry["status"], entry["settings"]) == ([state.label for state in AGAIN.status], AGAIN.settings)
        assert from_names(entry["options"]) == AGAIN.options
        assert store.check() == (True, {})
        assert np.flatnonzero(store.attempt() == 1).tolist() == failed.tolist()
        assert (store.results()["steps"][failed] == 60).all()
        assert store.to_pandas(nominal=True)["attempt"].sum() == failed.size
        assert sorted(p.name for p in tmp_path.iterdir()) == ["a.h5"]
        for name in store.history_specs:
            assert np.isfinite(store.histories(name)).all()
    assert_same_but(path, before, failed.tolist())


def test_a_second_retry_that_was_stopped_goes_on(tmp_path: Path) -> None:
    run, told = partial(fakes.run, fakes.Study(), tmp_path / "a.h5", simulate_rows=simulate_finely), list[str]()
    run()
    run(retry=Retry((Status.NOT_SETTLED,), {"solver.steps_per_rev": 45}, Options(steps_per_rev=45)), tell=told.append)

    with pytest.raises(campaign.Interrupted):
        run(1, 1, progress=stop_at_38, retry=AGAIN, tell=told.append)
    assert run(retry=AGAIN, tell=told.append).failed == 0
    assert told == ["4 joints are simulated again"] * 2
    with ResultFile.open(tmp_path / "a.h5") as store:
        assert len(store.retries) == 2
        assert [(store.attempt() == number).sum() for number in (1, 2)] == [4, 4]


def test_a_retry_that_changes_the_shape_of_histories_is_refused(tmp_path: Path) -> None:
    study, path = fakes.Study(output=fakes.Output("full")), tmp_path / "a.h5"
    fakes.run(study, path, 1)
    before = path.read_bytes()
    with pytest.raises(InputError, match="another number of samples than those in the file"):
        fakes.run(study, path, retry=AGAIN, history_specs=lambda *args: {})
    assert path.read_bytes() == before


def test_what_is_asked_for_again_is_read_with_all_faults() -> None:
    study = SimpleNamespace(solver=Solver(), no_closed_form=[])
    again = parse_retry("newton_failed, crashed", ["solver.steps_per_rev=360", "solver.method=tr_bdf2"], study)
    assert again.status == (Status.NEWTON_FAILED, Status.CRASHED)
    assert again.settings == {"solver.steps_per_rev": 360, "solver.method": "tr_bdf2"}
    assert again.options == Solver(steps_per_rev=360, method="tr_bdf2").options()
    with pytest.raises(InputError) as caught:
        parse_retry("newton_faild,pending", ["limits.F=3", "solver.steps_per_rev=2.5", "solver.steps_per_re=1"], study)
    text = str(caught.value)
    assert len(caught.value.faults) == 5
    assert "did you mean 'newton_failed'?" in text
    assert "--set: solver.steps_per_rev" in text
    assert "did you mean 'steps_per_rev'?" in text


def test_what_auto_chose_holds_for_joints_that_are_simulated_again() -> None:
    study = SimpleNamespace(solver=Solver(fidelity="auto"), no_closed_form=[])
    chosen = {"fidelity": "quasistatic", "steps_per_rev": 60}
    again = parse_retry("crashed", ["solver.newton_max_iter=40"], study).chosen(chosen).options
    assert (again.fidelity, again.steps_per_rev, again.newton_max_iter) == (Fidelity.QUASISTATIC, 60, 40)
    again = parse_retry("crashed", ["solver.fidelity=dynamic"], study).chosen(chosen).options
    assert again == Options()
