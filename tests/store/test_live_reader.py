"""A file that is written or replaced while it is read: the reader gives the joints of its campaign, and no alarm."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray

import tolstat
from tests.store.test_store import new_store, simulation
from tests.support import damage, fakes, synthetic
from tolstat import study
from tolstat.common.errors import StoreError
from tolstat.common.tables import Status
from tolstat.store import ResultFile, checksums

TEXT = synthetic.REAL.replace("n = 60", "n = 11").replace("[output]", '[output]\nhistories = "full"')


def load(folder: Path, seed: int) -> study.Study:
    (folder / f"{seed}.toml").write_text(TEXT.replace("seed = 2021", f"seed = {seed}"), encoding="utf-8")
    return study.load(folder / f"{seed}.toml")


def everything(store: ResultFile, done: NDArray[np.intp]) -> dict[str, bytes]:
    """Errors, results and histories of joints; what the file refuses to give is left out."""
    results = store.results()[done[1:]]
    found = {"errors": store.errors()[1:].tobytes()}
    found["results"] = b"".join(results[name].tobytes() for name in results.dtype.names or ())
    with suppress(StoreError):
        found["histories"] = store.histories("loads", done[1:]).tobytes()
    return found


@pytest.mark.parametrize("until_row", [8, pytest.param(None, marks=pytest.mark.slow)])
def test_no_joint_of_another_campaign_is_given(tmp_path: Path, until_row: int | None) -> None:
    """A campaign of another seed takes the place of one that is being read, finished or not."""
    path, other = tmp_path / "a.h5", tmp_path / "b.h5"
    tolstat.run(load(tmp_path, 1), path, workers=1, until_row=until_row, check=False)
    tolstat.run(load(tmp_path, 2), other, workers=1, check=False)
    with tolstat.open(path) as store:
        done = np.flatnonzero(store.status() != Status.PENDING)
        own = everything(store, done)
    with tolstat.open(other) as store:
        assert not set(everything(store, done).values()) & set(own.values())
    with tolstat.open(path) as store:
        os.replace(other, path)
        found = everything(store, done)
    assert [name for name in found if found[name] != own[name]] == []


def put_in_place(path: Path, content: bytes, begin: int = 0) -> None:
    """Write bytes of a file as another process does: past the memory of HDF5 in this one."""
    with path.open("r+b") as raw:
        raw.seek(begin)
        raw.write(content)


@pytest.fixture
def half(tmp_path: Path) -> Path:
    """File of 12 joints, the first 6 of which are done."""
    plan = fakes.Study(n=12)
    with new_store(tmp_path / "a.h5", plan) as store:
        store.write(np.arange(6), simulation(plan, np.arange(6)))
    return tmp_path / "a.h5"


def begins(path: Path, later: Path) -> None:
    """Change the session number and a result to those of another file."""
    content = later.read_bytes()
    with h5py.File(later) as file:
        places = [file["session/number"].id.get_offset(), file["results/psi_max"].id.get_offset() + 8 * 8]
    put_in_place(path, (3).to_bytes(8, "little"), places[0])
    put_in_place(path, content[places[1] : places[1] + 8], places[1])


def begins_and_ends(path: Path, later: Path) -> None:
    """All that a run writes lies between two reads of the session number."""
    put_in_place(path, later.read_bytes())


@pytest.mark.parametrize("run", [begins, begins_and_ends])
def test_a_run_that_begins_while_blocks_are_compared_is_no_damage(
    half: Path,
    run: Callable[[Path, Path], None],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    own, later, runs, rows = checksums.computed, tmp_path / "later.h5", [], np.arange(6, 12)
    later.write_bytes(half.read_bytes())
    with tolstat.store.Writer.open(later) as store:
        store.write(rows, simulation(fakes.Study(n=12), rows))

    def computed(*args: object) -> NDArray[np.uint64]:
        if not runs:
            runs.append(run(half, later))
        return own(*args)

    with ResultFile.open(half) as store:
        monkeypatch.setattr(checksums, "computed", computed)
        assert np.flatnonzero(store.status()).tolist()[:6] == list(range(6))
        assert runs
        assert store.counts().done == (12 if run is begins_and_ends else 6)
    assert not caplog.records


def test_damage_of_an_earlier_session_is_not_that_of_the_next(half: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A reader that stays open compares blocks again once a run has ended."""
    plan, rows = fakes.Study(n=12), np.arange(6, 12)
    before = half.read_bytes()
    with tolstat.store.Writer.open(half) as store:
        store.write(rows, simulation(plan, rows))
    after = half.read_bytes()
    half.write_bytes(before)
    damage.flip_in(half, "results/psi_max", 2)
    with ResultFile.open(half) as store:
        assert store.counts().done == 0
        put_in_place(half, after)
        assert store.counts().done == 12
    assert len(caplog.records) == 1


SESSIONS = """
import pathlib, sys, time
import numpy as np
from tests.store.test_store import simulation
from tests.support import fakes
from tolstat.store import Writer
plan = fakes.Study(n=200)
for rows in np.array_split(np.arange(6, 200), 12):
    with Writer.open(pathlib.Path(sys.argv[1])) as store:
        store.begin_session(int(rows[0]))
        for part in np.array_split(rows, 4):
            store.write(part, simulation(plan, part))
    time.sleep(0.02)
"""


@pytest.mark.slow
def test_a_reader_of_runs_that_begin_and_end_sees_right_joints_and_no_damage(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path, plan = tmp_path / "a.h5", fakes.Study(n=200)
    with new_store(path, plan) as store:
        store.write(np.arange(6), simulation(plan, np.arange(6)))
    expected, seen = simulation(plan, np.arange(200)).results, []
    python = [sys.executable, "-c", SESSIONS, str(path)]
    with subprocess.Popen(python, env=fakes.environment()) as running, ResultFile.open(path) as kept:
        while running.poll() is None:
            with ResultFile.open(path) as fresh:
                for store in (kept, fresh):
                    results = store.results()
                    done = results["status"] != Status.PENDING
                    seen.append((int(done.sum()), store.check().checked))
                    for name in ("F_max", "psi_max", "steps"):
                        np.testing.assert_array_equal(results[name][done], expected[name][done])
    assert running.returncode == 0
    numbers = [number for number, _ in seen]
    assert len({*numbers}) > 3
    assert {checked for _, checked in seen} == {True, False}
    assert min(numbers) >= 6
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]
