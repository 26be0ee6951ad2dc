"""Result files: what is written is read, what cannot be used is refused, and a kill does no harm."""

from __future__ import annotations

import dataclasses
import errno
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest

import tolstat
from tests import format_tables
from tests.support import fakes
from tests.support.of_cardan import ERROR_COLUMNS, RESULT, RESULT_COLUMNS
from tests.support.systems import needs_posix
from tolstat.common import tables
from tolstat.common.counts import Counts
from tolstat.common.errors import StoreError
from tolstat.common.tables import Simulation, Status
from tolstat.store import ResultFile, Writer, layout, metadata
from tolstat.store.hdf5 import text
from tolstat.store.metadata import Metadata
from tolstat.store.result_file import OPERATING


def simulation(study: fakes.Study, rows: np.ndarray) -> Simulation:
    params = fakes.perturb(study.joint, study.operation, fakes.draw(study)[rows])
    return fakes.simulate(params, study.solver.options(), study.output.histories, study.output.harmonics)


def new_store(path: Path, study: fakes.Study) -> Writer:
    specs = fakes.specs_of(study.output.histories)
    return Writer.create(path, study, [fakes.draw(study)], specs)


@pytest.fixture
def study() -> fakes.Study:
    return fakes.Study(n=12, output=fakes.Output("full"))


@pytest.mark.parametrize("n", [500, 4000])
def test_the_size_of_a_file_is_known_before_it_is_made(tmp_path: Path, n: int) -> None:
    with new_store(tmp_path / "a.h5", fakes.Study(n=n)) as store:
        expected = layout.size_of(store.metadata)
    assert (tmp_path / "a.h5").stat().st_size == pytest.approx(expected, rel=0.05)


def test_what_is_written_is_read(tmp_path: Path, study: fakes.Study) -> None:
    path = tmp_path / "a.h5"
    rows = np.array([1, 2, 3, 7, 9, 8])
    with new_store(path, study) as store:
        assert store.pending().tolist() == list(range(12))
        store.write(rows, simulation(study, rows))
    with ResultFile.open(path) as store:
        assert store.pending().tolist() == [0, 4, 5, 6, 10, 11]
        assert store.errors().tobytes() == fakes.draw(study).tobytes()
        written, expected = store.results(), simulation(study, rows)
        for name in RESULT.names or ():
            np.testing.assert_array_equal(written[name][rows], expected.results[name])
        assert np.isnan(written["F_max"][store.pending()]).all()
        for name in fakes.SPECS:
            np.testing.assert_array_equal(store.histories(name, rows), expected.histories[name])
        assert np.isnan(store.histories("loads", [0, 4])).all()


def test_attributes_tell_where_the_numbers_come_from(tmp_path: Path, study: fakes.Study) -> None:
    with new_store(tmp_path / "a.h5", study) as store:
        assert store.study_text == study.text
        assert store.study_name == "fake"
        assert store.identity == study.identity()
        assert store.joint == study.joint
        assert store.options["steps_per_rev"] == 30
        assert store.sampling["seed"] == study.seed
        assert store.limits == {"cross1.F": 700.0}
        assert store.versions["tolstat"] == tolstat.__version__
        assert {"sources", "python", "numpy", "numba", "scipy", "h5py"} <= store.versions.keys()
        assert store.created.endswith("+00:00")


def test_long_study_text_fits(tmp_path: Path) -> None:
    study = fakes.Study(n=2, text="# ü\n" * 100_000)
    new_store(tmp_path / "a.h5", study).close()
    with ResultFile.open(tmp_path / "a.h5") as store:
        assert store.study_text == study.text


def test_every_dataset_has_unit_and_description(tmp_path: Path, study: fakes.Study) -> None:
    new_store(tmp_path / "a.h5", study).close()
    with h5py.File(tmp_path / "a.h5") as file:
        assert file.attrs["filetype"] == b"tolstat campaign"
        assert file.attrs["schema_version"] == tables.SCHEMA_VERSION
        for group, columns in (("errors", ERROR_COLUMNS), ("results", RESULT_COLUMNS)):
            assert set(file[group]) == {c.name for c in columns} | {"row", "nominal"}
            for c in columns:
                dataset = file[group][c.name]
                assert text(dataset.attrs, "units") == c.unit
                assert text(dataset.attrs, "description") == c.description
                assert dataset.shape == (study.n,)
                assert dataset.dtype == c.dtype
                assert dataset.chunks is None


def test_frame_holds_all_rows_and_columns(tmp_path: Path, study: fakes.Study) -> None:
    rows = np.arange(5)
    with new_store(tmp_path / "a.h5", study) as store:
        store.write(rows, simulation(study, rows))
    with ResultFile.open(tmp_path / "a.h5") as store:
        frame, without = store.to_pandas(nominal=True), store.to_pandas()
        results = store.results()
    columns = ERROR_COLUMNS + OPERATING + RESULT_COLUMNS
    assert list(frame.columns) == ["nominal", *(c.name for c in columns)]
    assert frame.attrs["units"] == {"nominal": "1"} | {c.name: c.unit for c in columns}
    assert frame["nominal"].tolist() == [True] + [False] * (study.n - 1)
    pd.testing.assert_frame_equal(without, frame.iloc[1:].drop(columns="nominal"), check_index_type=False)
    assert without.index.tolist() == list(range(1, study.n))
    assert frame.index.name == "row"
    assert len(frame) == study.n
    assert frame["status"].tolist() == [Status(s).label for s in results["status"]]
    assert frame["status"].iloc[-1] == "pending"
    np.testing.assert_array_equal(frame["fork3.T_mean"], results["T_mean"][:, 6])
    np.testing.assert_array_equal(frame["pin2.contact_inner_max"], results["contact_max"][:, 1, 1])
    np.testing.assert_array_equal(frame["pin4.share_uniform"], results["mode_share"][:, 3, 3])


def test_counts(tmp_path: Path, study: fakes.Study) -> None:
    rows = np.arange(4)
    part = simulation(study, rows)
    part.results["status"] = [Status.NOT_SETTLED, Status.NOT_SETTLED, Status.NOT_FINITE, Status.NOT_RESOLVED]
    with new_store(tmp_path / "a.h5", study) as store:
        store.write(rows, part)
        assert store.counts() == Counts(total=12, done=4, unsettled=3, failed=1, not_resolved=1)


@pytest.mark.slow
def test_writing_moves_no_structure_of_the_file(tmp_path: Path) -> None:
    """Why a kill cannot make the file unreadable: bytes change inside the space of numbers only."""
    study, path = fakes.Study(n=500, output=fakes.Output("full")), tmp_path / "a.h5"
    new_store(path, study).close()
    before = np.fromfile(path, np.uint8)
    with Writer.open(path) as store:
        for rows in np.array_split(np.random.default_rng(1).permutation(study.n), 9):
            store.write(rows, simulation(study, rows))
        assert store.complete
    after = np.fromfile(path, np.uint8)
    assert before.size == after.size
    may_change = np.zeros(before.size, bool)
    with h5py.File(path) as file:
        held = [file[group] for group in ("results", "ledger", "histories", "session")]
        for dataset in (file["checksums/crc"], *(own for group in held for own in group.values())):
            may_change[dataset.id.get_offset() :][: dataset.id.get_storage_size()] = True
    changed = before != after
    assert changed.any()
    assert not (changed & ~may_change).any()


def in_another_process(path: Path, code: str) -> str:
    """Run code on a result file opened for writing as `store`; gives what it prints, or why it cannot be opened."""
    program = (
        "from tolstat.common.errors import StoreError\nfrom tolstat.store import ResultFile, Writer\n"
        f"try:\n    with Writer.open({str(path)!r}) as store: {code}\n"
        "except StoreError as error: print(error)"
    )
    python, environment = [sys.executable, "-c", program], fakes.environment()
    return subprocess.run(python, capture_output=True, text=True, check=True, env=environment).stdout


def test_limits_are_replaced_whole_or_not_at_all(
    tmp_path: Path, study: fakes.Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.h5"
    with new_store(path, study) as store:
        store.write(np.arange(5), simulation(study, np.arange(5)))
    before = path.read_bytes()
    other = dataclasses.replace(study, limits={"fork1.T": 40.0}, text="# edited", name="b")

    def full(*args: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with Writer.open(path) as store, monkeypatch.context() as patch:
        patch.setattr("os.replace", full)
        store.change(**metadata.editable(study))
        with pytest.raises(StoreError, match=r"cannot be replaced: No space left on device\n  hint: free disk space"):
            store.change(**metadata.editable(other))
        assert store.limits == study.limits
    assert path.read_bytes() == before
    with Writer.open(path) as store:
        store.change(**metadata.editable(other))
        assert (store.limits, store.study_text, store.study_name) == (other.limits, "# edited", "b")
    with ResultFile.open(path) as store:
        assert (store.limits, store.study_text, store.study_name) == (other.limits, "# edited", "b")
        assert store.identity == study.identity()
        assert store.errors().tobytes() == fakes.draw(study).tobytes()
        assert store.counts().done == 5
        assert store.check() == (True, {})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"filetype": "statepoint"}, "is HDF5, but of type 'statepoint'"),
        (
            {"schema_version": tables.SCHEMA_VERSION + 1},
            f"has schema version {tables.SCHEMA_VERSION + 1}, this tolstat reads {tables.SCHEMA_VERSION}\n"
            "  hint: use a newer tolstat",
        ),
    ],
)
def test_other_files_are_refused(tmp_path: Path, study: fakes.Study, change: dict, message: str) -> None:
    path = tmp_path / "a.h5"
    new_store(path, study).close()
    with h5py.File(path, "r+") as file:
        file.attrs.update(change)
    for opened in (ResultFile.open, Writer.open):
        with pytest.raises(StoreError, match=message):
            opened(path)


def test_a_file_of_an_unknown_mechanism_is_refused(tmp_path: Path, study: fakes.Study) -> None:
    path = tmp_path / "a.h5"
    new_store(path, study).close()
    with h5py.File(path, "r+") as file:
        metadata.write(file, metadata.read(file).model_copy(update={"mechanism": "chain"}))
    message = "has mechanism 'chain', which this tolstat does not know\n  hint: use a newer tolstat"
    for opened in (ResultFile.open, Writer.open):
        with pytest.raises(StoreError, match=message):
            opened(path)


def test_unreadable_files_are_refused(tmp_path: Path, study: fakes.Study) -> None:
    plain = tmp_path / "text.h5"
    plain.write_text("not HDF5")
    with pytest.raises(StoreError, match=r"text.h5: is not an HDF5 file\n  hint: give a result file"):
        ResultFile.open(plain)
    with pytest.raises(StoreError, match=r"none.h5: does not exist"):
        ResultFile.open(tmp_path / "none.h5")
    with pytest.raises(StoreError, match="is a folder"):
        ResultFile.open(tmp_path)
    empty = tmp_path / "empty.h5"
    empty.touch()
    with pytest.raises(StoreError, match=r"empty.h5: is not an HDF5 file"):
        Writer.open(empty)
    assert empty.stat().st_size == 0
    foreign = tmp_path / "foreign.h5"
    h5py.File(foreign, "w").close()
    with pytest.raises(StoreError, match="of type None"):
        ResultFile.open(foreign)
    cut = tmp_path / "cut.h5"
    new_store(cut, study).close()
    cut.write_bytes(cut.read_bytes()[:5000])
    with pytest.raises(StoreError, match="is damaged"):
        ResultFile.open(cut)
    poor = tmp_path / "poor.h5"
    new_store(poor, study).close()
    with h5py.File(poor, "r+") as file:
        del file["results"]
    with ResultFile.open(poor) as store, pytest.raises(StoreError, match="is damaged"):
        store.counts()


@pytest.mark.slow
def test_one_writer_and_any_readers(tmp_path: Path, study: fakes.Study) -> None:
    path = tmp_path / "a.h5"
    code = f"from tolstat.store import ResultFile, Writer\nprint(ResultFile.open({str(path)!r}).counts().done)"
    with new_store(path, study) as store:
        store.write(np.arange(5), simulation(study, np.arange(5)))
        python, environment = [sys.executable, "-c", code], fakes.environment()
        assert subprocess.run(python, capture_output=True, check=True, env=environment).stdout == b"5\n"
        answer = in_another_process(path, "print('opened')")
    assert answer.startswith(f"{path}: is being written by another process\n  hint: ")


def test_a_file_that_another_program_keeps_open_is_told(
    tmp_path: Path, study: fakes.Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On Windows a program may open a file so that no other can; here the system's error is made."""

    def refused(*_: object, **__: object) -> None:
        raise PermissionError(errno.EACCES, "Permission denied")

    new_store(tmp_path / "a.h5", study).close()
    monkeypatch.setattr(h5py, "File", refused)
    with pytest.raises(StoreError, match=r"a\.h5: is open in another program\n  hint: close it there"):
        Writer.open(tmp_path / "a.h5")
    assert [path.name for path in tmp_path.iterdir()] == ["a.h5"]


def test_create_replaces_nothing(tmp_path: Path, study: fakes.Study) -> None:
    path = tmp_path / "a.h5"
    path.write_text("precious")
    with pytest.raises(StoreError, match="exists already"):
        new_store(path, study)
    assert path.read_text() == "precious"
    with pytest.raises(StoreError, match="cannot be written"):
        new_store(path / "a.h5", study)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.h5"]


def test_create_makes_a_missing_folder(tmp_path: Path, study: fakes.Study) -> None:
    new_store(tmp_path / "new" / "folder" / "a.h5", study).close()
    assert (tmp_path / "new" / "folder" / "a.h5").is_file()


def test_a_failed_create_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*args: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("tolstat.store.layout.create", interrupt)
    with pytest.raises(KeyboardInterrupt):
        new_store(tmp_path / "a.h5", fakes.Study())
    assert list(tmp_path.iterdir()) == []


@needs_posix
@pytest.mark.slow
def test_a_killed_create_leaves_no_half_file(tmp_path: Path) -> None:
    code = (
        "import os, signal, pathlib, tolstat.store.layout\n"
        "from tests.support import fakes\n"
        "from tests.store import test_store\n"
        "tolstat.store.layout.create = lambda *args: os.kill(os.getpid(), signal.SIGKILL)\n"
        f"test_store.new_store(pathlib.Path({str(tmp_path / 'a.h5')!r}), fakes.Study())"
    )
    ended = subprocess.run([sys.executable, "-c", code], env=fakes.environment(), check=False)
    assert ended.returncode == -9
    assert not (tmp_path / "a.h5").exists()
    counts = fakes.run(fakes.Study(), tmp_path / "a.h5", 1, check=True)
    assert counts.done == 40


def test_other_sources_of_the_same_version_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, package = tmp_path / "a.h5", tmp_path / "tolstat"
    monkeypatch.setattr(metadata, "source_hash", metadata.source_hash.__wrapped__)  # tests compute it once
    fakes.run(fakes.Study(), path, 1, check=True)
    shutil.copytree(Path(tolstat.__file__).parent, package)
    monkeypatch.setattr("tolstat.__file__", str(package / "__init__.py"))
    fakes.run(fakes.Study(), path, 1, check=True)  # the same code in another place
    for name in ("kernel/contact.py", "joint/material.py", "tolerance.py"):
        (package / name).write_text("# edited")
        says = rf"a.h5: was begun by another version.*\n    sources: .*, {metadata.source_hash()} now\n  hint: "
        with pytest.raises(StoreError, match=says):
            fakes.run(fakes.Study(), path, 1, check=True)


DOCUMENTS = [format_tables.FORMAT, format_tables.MODEL, format_tables.SCHEMA]


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.stem)
def test_tables_of_documents_are_up_to_date(path: Path) -> None:
    held = path.read_text(encoding="utf-8") if path.exists() else ""
    assert held == format_tables.documents()[path], "run: python -m tests.format_tables"


def test_document_names_every_attribute_and_every_key_of_the_metadata(tmp_path: Path, study: fakes.Study) -> None:
    new_store(tmp_path / "a.h5", study).close()
    document = format_tables.FORMAT.read_text(encoding="utf-8")
    with h5py.File(tmp_path / "a.h5") as file:
        assert [name for name in file.attrs if f"`{name}`" not in document] == []
    assert [key for key in Metadata.model_fields if f"\n| `{key}` | " not in document] == []
