"""What is on the disk at each sync of a campaign: values before their status, both before they are announced."""

from __future__ import annotations

import os
from io import BytesIO
from pathlib import Path

import h5py
import numpy as np
import pytest

import tolstat
from tests.support import fakes, synthetic
from tolstat import study
from tolstat.common.tables import Status
from tolstat.store import checksums, layout, metadata

BLOCK = 7


def columns(file: h5py.File) -> dict[str, np.ndarray]:
    """Results and, where the file holds them, histories by name of the dataset; status apart."""
    groups = [name for name in ("results", "histories") if name in file]
    return {f"{group}/{name}": file[group][name][()] for group in groups for name in file[group]}


def read(content: bytes) -> dict[str, np.ndarray]:
    with h5py.File(BytesIO(content), "r") as file:
        return columns(file)


@pytest.fixture
def synced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, list[bytes], list[tuple[int, int]]]:
    """Simulate a campaign; gives its file, its content at each sync, and (syncs so far, joints announced)."""
    path, contents, announced = tmp_path / "a.h5", list[bytes](), list[tuple[int, int]]()
    (tmp_path / "a.toml").write_text(synthetic.REAL.replace("n = 60", "n = 24"), encoding="utf-8")
    sync = os.fsync

    def watched(handle: int) -> None:
        sync(handle)
        if path.exists() and os.path.samestat(os.fstat(handle), path.stat()):
            contents.append(path.read_bytes())

    monkeypatch.setattr(os, "fsync", watched)
    tolstat.run(
        study.load(tmp_path / "a.toml"),
        path,
        workers=1,
        block=BLOCK,
        check=False,
        progress=lambda counts: announced.append((len(contents), counts.done)),
    )
    return path, contents, announced


def test_values_are_on_the_disk_before_their_status_and_both_before_joints_are_announced(
    synced: tuple[Path, list[bytes], list[tuple[int, int]]],
) -> None:
    path, contents, announced = synced
    with h5py.File(path) as file:
        final = columns(file)
    status = final.pop("results/status")
    assert (status != Status.PENDING).all()
    values_first = np.zeros(status.size, bool)
    done_at = []
    for content in contents:
        found = read(content)
        done = found.pop("results/status") != Status.PENDING
        whole = np.ones(status.size, bool)
        for name in found.keys() & final.keys():
            same = found[name] == final[name]
            if final[name].dtype.kind == "f":
                same |= np.isnan(found[name]) & np.isnan(final[name])
            whole &= same.reshape(status.size, -1).all(axis=1)
        assert whole[done].all()
        values_first |= whole & ~done
        done_at.append(np.count_nonzero(done))
    assert values_first.all()
    assert [number for _, number in announced] == [0, 7, 14, 21, 25]
    for syncs, number in announced[1:]:
        assert done_at[syncs - 1] == number


def columns_of(content: bytes) -> dict[str, bytes]:
    """Bytes of the results in a file."""
    return {name: values.tobytes() for name, values in read(content).items()}


def matches(content: bytes) -> tuple[int, bool]:
    """Session number of a file, and whether all its checksums match."""
    with h5py.File(BytesIO(content), "r") as file:
        held = metadata.read(file)
        found = checksums.computed(file, layout.datasets(held), np.arange(checksums.blocks_of(held.n)))
        return int(file["session/number"][()]), bool((found == file["checksums/crc"][()]).all())


def test_results_never_have_wrong_checksums_that_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a run that resumes: the session number is odd on the disk before a result changes, and until all match."""
    path = tmp_path / "a.h5"
    fakes.run(fakes.Study(), path, until_row=10)
    before, contents, sync = path.read_bytes(), list[bytes](), os.fsync

    def watched(handle: int) -> None:
        contents.append(path.read_bytes())  # what a power cut may leave, at the latest
        sync(handle)

    monkeypatch.setattr(os, "fsync", watched)
    fakes.run(fakes.Study(), path, 1, 15)
    found = [matches(content) for content in contents]
    assert matches(before) == (2, True)
    assert [number for number, _ in found] == sorted(number for number, _ in found)
    assert {number for number, _ in found} == {3, 4}
    assert not found[len(found) // 2][1]
    assert all(same for number, same in found if number % 2 == 0)
    first, own = (columns_of(content) for content in (contents[0], before))
    assert first == own
