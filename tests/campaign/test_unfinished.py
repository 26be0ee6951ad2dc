"""Files of campaigns that are under way, were stopped or killed, or find no room: unchecked or checked, never wrong."""

from __future__ import annotations

import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from typer.testing import CliRunner

from tests.campaign.test_campaign import datasets, start
from tests.support import damage, fakes
from tests.support.systems import needs_linux
from tolstat import cli
from tolstat.campaign import run as campaign
from tolstat.common.counts import Counts
from tolstat.common.errors import StoreError
from tolstat.common.tables import Status
from tolstat.store import ResultFile


@pytest.mark.slow
def test_values_without_their_status_are_simulated_again(tmp_path: Path, expected: dict[str, bytes]) -> None:
    """A power cut after the values of some joints were on the disk, and before their status was."""
    path = tmp_path / "a.h5"
    fakes.run(fakes.Study(), path, 1)
    with h5py.File(path, "r+") as file:
        file["results/status"][5:9] = Status.PENDING
        file["session/number"][()] += 1
    with ResultFile.open(path) as store:
        assert store.pending().tolist() == [5, 6, 7, 8]
        assert store.to_pandas()["status"].loc[[4, 5]].tolist() == ["ok", "pending"]
        assert np.isnan(store.results()["F_max"][5:9]).all()
        assert not store.check().checked
    fakes.run(fakes.Study(), path, 1)
    assert datasets(path) == expected
    with ResultFile.open(path) as store:
        assert store.check() == (True, {})


@pytest.mark.slow
def test_a_killed_run_leaves_results_unchecked_and_the_next_one_checks_them(
    tmp_path: Path, expected: dict[str, bytes]
) -> None:
    path = tmp_path / "a.h5"
    process = start(path, 1, 2, seconds=0.05)
    with ResultFile.open(path) as store:
        assert not store.check().checked
    process.kill()
    process.communicate()
    done = CliRunner().invoke(cli.app, ["status", str(path), "--check"])
    assert done.exit_code == 0
    assert "\nchecksums: errors match; results have none while a run is under way, or after" in done.stdout
    assert "\nrunning: no" in done.stdout
    damage.flip_in(path, "errors/pin1.offset_t", 7)
    done = CliRunner().invoke(cli.app, ["status", str(path), "--check"])
    assert done.exit_code == 2
    assert "errors/pin1.offset_t of rows 0:40\n" in done.stderr
    damage.flip_in(path, "errors/pin1.offset_t", 7)
    fakes.run(fakes.Study(), path, 1)
    assert datasets(path) == expected
    with ResultFile.open(path) as store:
        assert store.check() == (True, {})


def test_a_run_that_is_stopped_leaves_checksums(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"

    def interrupt(counts: Counts) -> None:
        if counts.done == 20:
            raise KeyboardInterrupt

    with pytest.raises(campaign.Interrupted):
        fakes.run(fakes.Study(), path, 1, 5, progress=interrupt)
    with ResultFile.open(path) as store:
        assert store.pending().size
        assert store.check() == (True, {})
    fakes.run(fakes.Study(), path, 1, until_row=30)
    with ResultFile.open(path) as store:
        assert store.pending().tolist() == list(range(30, 40))
        assert store.check() == (True, {})


def test_what_cannot_be_simulated_again_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    fakes.run(fakes.Study(output=fakes.Output("full")), path, 1)
    damage.flip_in(path, "errors/pin1.offset_t", 7)
    with pytest.raises(StoreError, match=r"is damaged: errors/pin1\.offset_t of rows 0:40 does not match its checksum"):
        fakes.run(fakes.Study(output=fakes.Output("full")), path, 1)
    damage.flip_in(path, "errors/pin1.offset_t", 7)
    damage.flip_in(path, "metadata", 0)
    with pytest.raises(StoreError, match="metadata do not match their checksum"):
        ResultFile.open(path)


@pytest.mark.slow
def test_a_campaign_under_way_can_be_looked_at(tmp_path: Path, expected: dict[str, bytes]) -> None:
    path = tmp_path / "a.h5"
    process = start(path, 2, 2, seconds=0.05)
    with ResultFile.open(path) as store:
        session, begun = store.session(), store.counts().done
        assert session is not None
        assert session.done == 0
        assert store.check() == (False, {})
        assert abs(time.time() - session.started) < 60
        until = time.monotonic() + 30.0
        while store.counts().done == begun and time.monotonic() < until:
            time.sleep(0.01)
        assert store.counts().done > begun
    process.communicate(timeout=60)
    assert process.returncode == 0
    with ResultFile.open(path) as store:
        assert store.session() is None
    assert datasets(path) == expected


def limited(path: Path, size: int) -> str:
    """Run a campaign in a process whose files cannot grow beyond `size` bytes; gives what it says."""
    code = (
        "import psutil, sys; from pathlib import Path; from tests.support import fakes\n"
        f"psutil.Process().rlimit(psutil.RLIMIT_FSIZE, ({size}, {size}))\n"
        "study = fakes.Study(output=fakes.Output('full'))\n"
        f"fakes.run(study, Path({str(path)!r}), 1, 4)"
    )
    ended = subprocess.run([sys.executable, "-c", code], env=fakes.environment(), capture_output=True, text=True)
    assert ended.returncode
    return ended.stderr.rpartition("StoreError: ")[2]


@needs_linux
@pytest.mark.slow
@pytest.mark.parametrize("size", [20_000, 400_000])
def test_files_that_cannot_grow(tmp_path: Path, size: int) -> None:
    path = tmp_path / "a.h5"
    assert limited(path, size).startswith(f"{path}: cannot be written: ")
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """Mount a file system of 700 kB; needs the right to."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=700k", "tmpfs", folder], capture_output=True)
    if mounted.returncode:
        pytest.skip("no right to mount a file system")
    yield folder
    subprocess.run(["umount", folder], check=True)


@pytest.fixture
def read_only(small_disk: Path) -> Iterator[Path]:
    """Make a folder that holds half a campaign, and then can only be read, even by the superuser."""
    fakes.run(fakes.Study(), small_disk / "a.h5", 1, 4, until_row=20)
    subprocess.run(["mount", "-o", "remount,ro", small_disk], check=True)
    yield small_disk
    subprocess.run(["mount", "-o", "remount,rw", small_disk], check=True)


@needs_linux
def test_a_folder_that_can_only_be_read(read_only: Path, tmp_path: Path, expected: dict[str, bytes]) -> None:
    with pytest.raises(
        StoreError, match=r"new\.h5: cannot be written: Read-only file system\n  hint: check that the folder"
    ):
        fakes.run(fakes.Study(), read_only / "new.h5", 1)
    with pytest.raises(StoreError, match=r"a\.h5: cannot be opened: no permission\n  hint: change its permissions"):
        fakes.run(fakes.Study(), read_only / "a.h5", 1)
    assert [path.name for path in read_only.iterdir()] == ["a.h5"]
    with ResultFile.open(read_only / "a.h5") as store:  # looking at it goes on
        assert store.counts().done == 20
        assert store.session() is None
    moved = tmp_path / "a.h5"
    shutil.copy(read_only / "a.h5", moved)
    fakes.run(fakes.Study(), moved, 1)
    assert datasets(moved) == expected


@needs_linux
@pytest.mark.slow
def test_a_full_disk_is_told_before_the_first_joint(small_disk: Path) -> None:
    told: list[Counts] = []
    with pytest.raises(StoreError, match=r"cannot be written: No space left on device\n  hint: check that"):
        fakes.run(fakes.Study(n=80, output=fakes.Output("full")), small_disk / "a.h5", 1, 2, progress=told.append)
    assert not told
    assert list(small_disk.iterdir()) == []


@needs_linux
@pytest.mark.slow
def test_a_disk_without_room_for_a_second_copy_keeps_the_first(small_disk: Path, tmp_path: Path) -> None:
    study, path = fakes.Study(output=fakes.Output("full")), small_disk / "a.h5"
    fakes.run(study, path, 1, 2)
    with pytest.raises(StoreError, match=r"cannot be replaced: No space left on device\n  hint: free disk space"):
        fakes.run(replace(study, limits={}), path, 1)
    fakes.run(study, tmp_path / "b.h5", 1)
    assert datasets(path) == datasets(tmp_path / "b.h5")
    assert [file.name for file in small_disk.iterdir()] == ["a.h5"]
