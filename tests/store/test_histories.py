"""Load histories beside the result file and in it: never lost, never another campaign's, never NaN for values."""

from __future__ import annotations

import dataclasses
import shutil
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from tolstat.store.histories import HistoryParts

from tests.store.test_store import in_another_process, new_store, simulation
from tests.support import fakes
from tolstat.common.errors import StoreError
from tolstat.store import ResultFile, Writer
from tolstat.store.result_file import text


@pytest.fixture
def study() -> fakes.Study:
    return fakes.Study(n=12, output=fakes.Output("full"))


def complete_store(path: Path, study: fakes.Study) -> np.ndarray:
    """Write all joints, in two parts that are not taken in; gives their load histories."""
    with new_store(path, study) as store:
        for rows in np.split(np.arange(study.n), [5]):
            store.write(rows, simulation(study, rows))
    return simulation(study, np.arange(study.n)).histories["loads"]


def test_finished_file_holds_the_histories(tmp_path: Path, study: fakes.Study) -> None:
    path, rows = tmp_path / "a.h5", np.arange(12)
    with new_store(path, study) as store:
        store.write(rows[5:], simulation(study, rows[5:]))
        store.finish()
        assert (tmp_path / "a.h5.parts").is_dir()
        store.write(rows[:5], simulation(study, rows[:5]))
        before = store.histories("loads")
        store.finish()
        store.finish()
        assert not (tmp_path / "a.h5.parts").exists()
        np.testing.assert_array_equal(store.histories("loads"), before)
        picked = store.histories("mode", np.array([7, 2, 7]))
    expected = simulation(study, rows).histories
    np.testing.assert_array_equal(before, expected["loads"])
    np.testing.assert_array_equal(picked, expected["mode"][[7, 2, 7]])
    with h5py.File(path) as file:
        for name, spec in fakes.SPECS.items():
            dataset = file["histories"][name]
            assert dataset.compression == "gzip"
            assert text(dataset.attrs, "units") == spec.unit
            np.testing.assert_array_equal(dataset[...], expected[name])
    assert [p.name for p in tmp_path.iterdir()] == ["a.h5"]


def test_rows_that_lost_their_histories_are_pending_again(tmp_path: Path, study: fakes.Study) -> None:
    rows = np.arange(6)
    with new_store(tmp_path / "a.h5", study) as store:
        store.write(rows[:4], simulation(study, rows[:4]))
        store.write(rows[4:], simulation(study, rows[4:]))
    (tmp_path / "a.h5.parts" / "00000000.h5").unlink()
    with Writer.open(tmp_path / "a.h5") as store:
        assert np.flatnonzero(store.status()).tolist() == [4, 5]


@pytest.mark.slow
def test_a_reader_finds_the_histories_in_the_file_that_replaced_its_own(tmp_path: Path, study: fakes.Study) -> None:
    path = tmp_path / "a.h5"
    expected = complete_store(path, study)
    with ResultFile.open(path) as early, ResultFile.open(path) as reader:
        np.testing.assert_array_equal(early.histories("loads"), expected)
        assert in_another_process(path, "store.finish(); print('finished')") == "finished\n"
        assert not (tmp_path / "a.h5.parts").exists()
        np.testing.assert_array_equal(reader.histories("loads"), expected)
        np.testing.assert_array_equal(early.histories("loads", np.array([3, 1])), expected[[3, 1]])


def test_histories_that_are_gone_are_an_error(tmp_path: Path, study: fakes.Study) -> None:
    path = tmp_path / "a.h5"
    expected = complete_store(path, study)
    lost = r"a.h5.parts: lacks the histories of 5 finished joints\n  hint: restore the folder"
    before = path.read_bytes()
    with Writer.open(path) as store:
        (tmp_path / "a.h5.parts" / "00000000.h5").unlink()
        with pytest.raises(StoreError, match=lost):
            store.finish()
        np.testing.assert_array_equal(store.histories("loads", np.arange(5, 12)), expected[5:])
    assert path.read_bytes() == before
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.h5", "a.h5.parts"]
    with ResultFile.open(path) as store, pytest.raises(StoreError, match=lost):
        store.histories("loads")


@pytest.mark.slow
def test_no_second_writer_while_histories_are_taken_in(
    tmp_path: Path, study: fakes.Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, answers = tmp_path / "a.h5", []
    complete_store(path, study)
    for step in ("gather_into", "remove"):
        done = getattr(HistoryParts, step)

        def watched(*args: object, done: Callable[..., None] = done) -> None:
            answers.append(in_another_process(path, "print('opened')"))
            done(*args)

        monkeypatch.setattr(HistoryParts, step, watched)
    with Writer.open(path) as store:
        store.finish()
        answers.append(in_another_process(path, "print('opened')"))
    assert [answer.split("\n")[0] for answer in answers] == [f"{path}: is being written by another process"] * 3
    assert in_another_process(path, "print('opened')") == "opened\n"


def test_a_file_replaced_while_it_is_opened_is_not_written(
    tmp_path: Path, study: fakes.Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, new = tmp_path / "a.h5", tmp_path / "new.h5"
    complete_store(path, study)
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


def test_parts_of_another_campaign_are_refused(tmp_path: Path, study: fakes.Study) -> None:
    complete_store(tmp_path / "a.h5", study)
    complete_store(tmp_path / "b.h5", dataclasses.replace(study, seed=8))
    shutil.rmtree(tmp_path / "a.h5.parts")
    (tmp_path / "b.h5.parts").rename(tmp_path / "a.h5.parts")
    for opened in (ResultFile.open, Writer.open):
        with pytest.raises(StoreError, match=r"00000000.h5: holds histories of another campaign"):
            opened(tmp_path / "a.h5").histories("loads")


def test_a_damaged_part_is_named(tmp_path: Path, study: fakes.Study) -> None:
    with new_store(tmp_path / "a.h5", study) as store:
        store.write(np.arange(4), simulation(study, np.arange(4)))
    part = tmp_path / "a.h5.parts" / "00000000.h5"
    part.write_bytes(b"nothing")
    with pytest.raises(StoreError, match=r"00000000.h5: is damaged\n  hint: delete it"):
        Writer.open(tmp_path / "a.h5")
