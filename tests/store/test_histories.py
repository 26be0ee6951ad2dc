"""Load histories lie in the result file from its creation on: NaN while a joint is pending, never another joint's."""

from __future__ import annotations

import errno
from pathlib import Path

import h5py
import numpy as np
import pytest

from tests.store.test_store import in_another_process, new_store, simulation
from tests.support import damage, fakes
from tolstat.common.errors import StoreError
from tolstat.common.tables import Status
from tolstat.store import ResultFile, Writer
from tolstat.store.hdf5 import text


@pytest.fixture
def study() -> fakes.Study:
    return fakes.Study(n=12, output=fakes.Output("full"))


def written(path: Path, study: fakes.Study, rows: np.ndarray) -> dict[str, np.ndarray]:
    """Write some joints, in two blocks; gives the histories of all joints of the study."""
    with new_store(path, study) as store:
        for part in np.array_split(rows, 2):
            store.write(part, simulation(study, part))
    return simulation(study, np.arange(study.n)).histories


def test_histories_are_those_of_their_joints(tmp_path: Path, study: fakes.Study) -> None:
    path, rows = tmp_path / "a.h5", np.array([7, 2, 9, 4, 3])
    expected = written(path, study, rows)
    others = np.setdiff1d(np.arange(12), rows)
    with ResultFile.open(path) as store:
        for name, values in expected.items():
            found = store.histories(name)
            np.testing.assert_array_equal(found[rows], values[rows])
            blank = 0 if values.dtype.kind == "u" else np.nan
            np.testing.assert_array_equal(found[others], np.full_like(values[others], blank))
            np.testing.assert_array_equal(store.histories(name, np.array([7, 0, 7])), found[[7, 0, 7]])
            assert store.histories(name, np.empty(0, np.intp)).shape == (0, *values.shape[1:])
    assert [p.name for p in tmp_path.iterdir()] == ["a.h5"]


def test_their_space_is_taken_when_the_file_is_created(tmp_path: Path, study: fakes.Study) -> None:
    path = tmp_path / "a.h5"
    new_store(path, study).close()
    size = path.stat().st_size
    with h5py.File(path) as file:
        for name, spec in fakes.SPECS.items():
            dataset = file["histories"][name]
            assert (dataset.shape, dataset.dtype, dataset.chunks) == ((12, *spec.shape), spec.dtype, None)
            assert dataset.id.get_storage_size() == dataset.nbytes
            assert text(dataset.attrs, "units") == spec.unit
    written(tmp_path / "b.h5", study, np.arange(12))
    assert (tmp_path / "b.h5").stat().st_size == size


def test_a_full_disk_is_told_before_the_first_joint(
    tmp_path: Path, study: fakes.Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def allocate(handle: int, offset: int, size: int) -> None:
        asked.append(size)
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.posix_fallocate", allocate, raising=False)
    with pytest.raises(StoreError, match=r"a\.h5: cannot be written: No space left on device\n  hint: check that"):
        fakes.run(study, tmp_path / "a.h5")
    histories = sum(12 * spec.blank(1).nbytes for spec in fakes.SPECS.values())
    results = sum(values.nbytes for values in (fakes.draw(study), simulation(study, np.arange(12)).results))
    assert asked[0] > histories + results
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_reader_of_a_running_campaign_sees_them_appear(tmp_path: Path, study: fakes.Study) -> None:
    path = tmp_path / "a.h5"
    expected = written(path, study, np.arange(5))["loads"]
    with ResultFile.open(path) as reader:
        np.testing.assert_array_equal(reader.histories("loads")[:5], expected[:5])
        assert np.isnan(reader.histories("loads", np.array([8]))).all()
        more = (
            "rows = numpy.arange(5, 12); study = fakes.Study(n=12, output=fakes.Output('full'));"
            " store.write(rows, test_store.simulation(study, rows)); print('written')"
        )
        code = f"import numpy; from tests.support import fakes; from tests.store import test_store; {more}"
        assert in_another_process(path, code) == "written\n"
        np.testing.assert_array_equal(reader.histories("loads"), expected)


def test_pending_joints_give_nothing_though_values_were_written(tmp_path: Path, study: fakes.Study) -> None:
    """A run was killed after the values of its block were on the disk, and before their status was."""
    path = tmp_path / "a.h5"
    written(path, study, np.arange(12))
    with h5py.File(path, "r+") as file:
        file["results/status"][4:7] = Status.PENDING
        file["session/number"][()] = 3
    with ResultFile.open(path) as store:
        assert store.pending().tolist() == [4, 5, 6]
        assert np.isnan(store.histories("loads", np.arange(4, 7))).all()
        assert np.isnan(store.results()["F_max"][4:7]).all()
        assert not store.check().checked
    with Writer.open(path) as store:
        store.write(np.arange(4, 7), simulation(study, np.arange(4, 7)))
    with ResultFile.open(path) as store:
        assert store.check() == (True, {})


def test_damaged_histories_are_refused_and_simulated_again(
    tmp_path: Path, study: fakes.Study, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    damage.small_blocks(monkeypatch, 4)
    path = tmp_path / "a.h5"
    expected = written(path, study, np.arange(12))["loads"]
    damage.flip_in(path, "histories/loads", 6)
    refused = r"is damaged: histories/loads of rows 4:8 does not match its checksum\n  hint: simulate these joints"
    with ResultFile.open(path) as store:
        with pytest.raises(StoreError, match=refused):
            store.histories("loads")
        np.testing.assert_array_equal(store.histories("loads", np.array([9, 8])), expected[[9, 8]])
        assert store.histories("mode").any()
        assert store.complete
    with Writer.open(path) as store:
        assert store.pending().tolist() == [4, 5, 6, 7]
        store.write(np.arange(4, 8), simulation(study, np.arange(4, 8)))
    assert "the results of rows 4:8 are damaged and pending again\n" in caplog.text
    with ResultFile.open(path) as store:
        np.testing.assert_array_equal(store.histories("loads"), expected)
        assert store.check() == (True, {})


def test_a_file_replaced_while_it_is_opened_is_not_written(
    tmp_path: Path, study: fakes.Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, new = tmp_path / "a.h5", tmp_path / "new.h5"
    written(path, study, np.arange(12))
    new.write_bytes(path.read_bytes())
    opened = h5py.File

    def late(*args: object, **options: object) -> h5py.File:
        file = opened(*args, **options)
        if new.exists():
            new.replace(path)
        return file

    monkeypatch.setattr(h5py, "File", late)
    with pytest.raises(StoreError, match="is being written by another process"):
        Writer.open(path)
    Writer.open(path).close()
