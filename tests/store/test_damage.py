"""What is believed has a checksum: single bits are changed, and no reader says anything else without a word."""

from __future__ import annotations

import contextlib
import json
import logging
import os
import shutil
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from typer.testing import CliRunner

from tests.store.test_store import new_store, simulation
from tests.support import corruption, fakes, synthetic
from tolstat import cli
from tolstat.common.errors import InputError, StoreError
from tolstat.store import ResultFile, Writer, integrity, result_file, verification
from tolstat.store.recorded import recall

N = 12


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """File of a complete campaign with a verification."""
    path, study = tmp_path_factory.mktemp("damage") / "a.h5", fakes.Study(n=N)
    with new_store(path, study) as store:
        store.write(np.arange(N), simulation(study, np.arange(N)))
        check = verification.Check("finer Newton", store.options, store.results()[1:5])
        verification.write(store, verification.Verification(1, np.arange(1, 5), check.results, {"newton": check}))
    return path


@pytest.fixture
def path(kept: Path, tmp_path: Path) -> Path:
    copied = tmp_path / "a.h5"
    shutil.copy(kept, copied)
    return copied


def flip(path: Path, offset: int, bit: int = 6) -> None:
    with path.open("r+b") as file:
        file.seek(offset)
        (old,) = file.read(1)
        file.seek(offset)
        file.write(bytes([old ^ 1 << bit]))


def place(path: Path, name: str, row: int = 0) -> int:
    """Offset of an entry of a dataset in its file."""
    with h5py.File(path) as file:
        return int(file[name].id.get_offset() + row * file[name].dtype.itemsize)


@pytest.mark.parametrize("name", ["cross1.F_max", "status", "steps"])
def test_a_flipped_bit_of_a_verification_is_found(path: Path, name: str) -> None:
    flip(path, place(path, f"verify/newton/{name}", 2))
    with ResultFile.open(path) as store, pytest.raises(StoreError, match="make it anew: tolstat verify"):
        verification.read(store)


def test_a_flipped_row_number_of_a_verification_is_found(path: Path) -> None:
    flip(path, place(path, "verify/rows", 2))
    with ResultFile.open(path) as store, pytest.raises(StoreError, match="do not match their checksum"):
        verification.read(store)


def test_a_hostile_verification_takes_no_memory(path: Path) -> None:
    """2^33 rows are claimed, with valid checksums; the dataset takes no space in the file."""
    with h5py.File(path, "r+") as file:
        del file["verify/rows"]
        file["verify"].create_dataset("rows", (1 << 33,), "i8")
        integrity.seal(file)
    with pytest.raises(StoreError, match="beyond the end of the file"):
        ResultFile.open(path)


@pytest.mark.parametrize(
    ("rows", "found"), [([4, 3, 2, 1], "no ascending rows"), ([1, 2, 3, 99], "no ascending rows"), (5, "is .4,. of")]
)
def test_rows_of_a_verification_are_rows_of_the_file(path: Path, rows: list[int] | int, found: str) -> None:
    with h5py.File(path, "r+") as file:
        del file["verify/rows"]
        file["verify"].create_dataset("rows", data=np.arange(1, 1 + rows) if isinstance(rows, int) else rows)
        integrity.seal_values(file["verify"])
        integrity.seal(file)
    with ResultFile.open(path) as store, pytest.raises(StoreError, match=found):
        verification.read(store)


def test_attributes_of_columns_have_a_checksum(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        result_file.put_attributes(file["results/cross1.F_max"], {"units": "kN"})
    with pytest.raises(StoreError, match="attributes do not match their checksum"):
        ResultFile.open(path)


def test_a_flipped_attempt_is_found_before_joints_are_simulated_with_other_settings(path: Path) -> None:
    with Writer.open(path) as store:
        store.begin_retry({"": np.array([3])}, {"status": ["ok"], "settings": {}, "options": store.options})
    flip(path, place(path, "ledger/attempt", 3), 0)
    with ResultFile.open(path) as store, pytest.raises(StoreError, match="attempt of row 3 does not match"):
        store.attempt()


def test_readers_tell_of_damaged_rows(path: Path, caplog: pytest.LogCaptureFixture) -> None:
    for row in (4, 7):
        flip(path, place(path, "results/cross1.F_max", row))
    with ResultFile.open(path) as store:
        assert store.counts().done == N - 2
    (said,) = [record.getMessage() for record in caplog.records if record.levelno == logging.WARNING]
    assert "the results of 2 joints are damaged and are left out: row 4, 7\n  hint: simulate these joints again" in said
    done = CliRunner().invoke(cli.app, ["export", str(path), "--csv", "-", "--quiet"])
    assert done.exit_code == 0
    assert done.stdout.count("pending") == 2
    assert done.stderr == said + "\n"
    with ResultFile.open(path) as store:
        store.errors()
    assert len(caplog.records) <= 2, "who reads no results is told nothing"


def test_who_writes_is_told_which_rows_are_pending_again(path: Path, caplog: pytest.LogCaptureFixture) -> None:
    flip(path, place(path, "results/cross1.F_max", 4))
    with Writer.open(path) as store:
        assert store.pending().tolist() == [4]
    assert "the results of 1 joint are damaged and pending again: row 4\n" in caplog.text


@pytest.mark.parametrize(("started", "done"), [(1e300, 3), (np.inf, 3), (5.0, -1), (5.0, 1 << 40), (np.nan, 0)])
def test_an_impossible_session_is_no_session(path: Path, started: float, done: int) -> None:
    with Writer.open(path) as store:
        store.begin_session(3)
        session = store.session()
        assert session is not None
        assert session.done == 3
        assert session.started <= time.time()
        store._file["session/started"][()], store._file["session/done"][()] = started, done
        assert store.session() is None


def reference(file: h5py.File) -> None:
    file["verify"].attrs["x"] = file["row"].ref


def region(file: h5py.File) -> None:
    file.create_dataset("extra", data=np.array([file["row"].ref] * 2, h5py.ref_dtype))


def loop(file: h5py.File) -> None:
    file["results/again"] = file["/"]


def soft(file: h5py.File) -> None:
    file["verify/more"] = h5py.SoftLink("/results/status")


def external(file: h5py.File) -> None:
    file["verify/more"] = h5py.ExternalLink("/etc/hostname", "/x")


def raw(file: h5py.File) -> None:
    file["verify"].create_dataset("more", (6,), "f8", external=[("/etc/passwd", 0, 48)])


def named_type(file: h5py.File) -> None:
    file["type"] = np.dtype("f8")


def compressed(file: h5py.File) -> None:
    file["verify"].create_dataset("more", data=np.zeros(100), compression="lzf")


LAYOUTS = (reference, region, loop, soft, external, raw, named_type, compressed)


@pytest.mark.parametrize("change", LAYOUTS)
def test_nothing_but_the_own_layout_is_read_anywhere_in_a_file(path: Path, change: object) -> None:
    with h5py.File(path, "r+") as file:
        change(file)
        if change is not loop:
            with contextlib.suppress(ValueError):  # what cannot be walked cannot be sealed by these means
                integrity.seal(file)
    with pytest.raises(StoreError, match=r"a\.h5: is damaged: .*\n  hint: "):
        ResultFile.open(path)


POINT = {"alpha": 0.1, "speed": 1.0, "torque": 1.0, "axial_force": 0.0, "share": None}
ABSENT = object()
"""Stands for a key that is taken out."""
CONTENTS = {
    "limits": [
        {"cross1.F": "a lot"},
        {"cross1.F": "700"},
        {"cross1.F": -1.0},
        {"cross9.F": 1.0},
        {"cross1.F at cruise": 1.0},
        [],
        3,
        {"cross1.F": float("inf")},
    ],
    "points": [
        *({}, [], 3, {"cruise": 3}, {"": {key: POINT[key] for key in POINT if key != "share"}}),
        *({name: POINT} for name in ("cruise", "../x")),
        *({"": POINT | wrong} for wrong in ({"alpha": 2.0}, {"speed": 0.0}, {"torque": "x"}, {"axial_force": "x"})),
        *({"": POINT | wrong} for wrong in ({"share": 2.0}, {"x": 1.0})),
        {"": POINT},
    ],
    "options": [{}, {"steps_per_rev": 10**9}, {"method": "rk4"}, {"fidelity": 1}, {"newton_tol": "1e-6"}, {"warp": 9}],
    "sampling": [
        {},
        {"seed": -1},
        {"seed": 1.5},
        {"n": 10**9},
        {"method": "magic"},
        {"nominal_first": 1},
        *({name: ABSENT} for name in ("seed", "nominal_first", "n", "method")),
    ],
    "fidelity": [{"fidelity": "dynamic"}, {"steps_per_rev": 10**9}, [1]],
    "stop": [{"rule": 3}, {"looks": ["x"]}, [1]],
    "retries": [[{"options": {}}], [3], {}, [{"status": [], "settings": {}, "options": {"steps_per_rev": 10**9}}]],
    "versions": [{"tolstat": 3}, []],
    "design": [{}, {"cases": 3, "variants": []}, {"cases": [], "variants": [{"family": 1}]}],
    "histories": [{"a/b": [[3], "f4", "N", "x"]}, {"loads": 3}, {"loads": [[3], "O", "N", "x"]}],
    "identity": [[], {"output.results": 3}],
    "joint": [3, [], {"cross": {"R": "3 m"}}, {"material": {"E": 1}}, {"wheel": 3}],
}


@pytest.mark.parametrize("name", CONTENTS)
def test_contents_of_attributes_are_checked_although_their_checksum_is_right(path: Path, name: str) -> None:
    for wrong in CONTENTS[name]:
        with h5py.File(path, "r+") as file:
            held = json.loads(result_file.text(file.attrs, name)) if name in file.attrs else {}
            before = json.dumps(held)
            merged = held | wrong if isinstance(held, dict) and isinstance(wrong, dict) and name != "limits" else wrong
            if isinstance(merged, dict):
                merged = {key: own for key, own in merged.items() if own is not ABSENT}
            value = merged if wrong != {} else {}
            file.attrs[name] = json.dumps(value)
            integrity.seal(file)
        with pytest.raises(StoreError, match=r"a\.h5: is damaged: .*\n  hint: run the campaign again"):
            ResultFile.open(path)
        with h5py.File(path, "r+") as file:
            file.attrs[name] = before


def put_study(path: Path, text: str) -> None:
    with h5py.File(path, "r+") as file:
        result_file.put_attributes(file, {"study": text})
        integrity.seal(file)


MEASURED = (
    synthetic.HEAD
    + """[tolerances]
pin1.offset_e = { distribution = "measured", file = "FILE", column = "x", unit = "mm" }
[sampling]
n = 12
"""
)


@pytest.fixture
def measured(tmp_path: Path) -> Path:
    """File of a campaign from measured errors, beside its data; what another file in its folder is tempts."""
    folder = tmp_path / "own"
    folder.mkdir()
    (folder / "a.csv").write_text("x\n1\n2\n", encoding="utf-8")
    (tmp_path / "secret.csv").write_text("x,password\nhunter2,1\n", encoding="utf-8")
    return synthetic.store(folder, MEASURED.replace("FILE", "a.csv"))


@pytest.mark.parametrize("named", ["/dev/zero", "pipe.csv", "../secret.csv", "link.csv", "/etc/passwd", "huge.csv"])
def test_a_result_file_names_regular_files_of_its_own_folder_only(measured: Path, named: str) -> None:
    """A device of zeros took all memory, a pipe hung, the first line of a system file was quoted."""
    os.mkfifo(measured.parent / "pipe.csv")
    (measured.parent / "link.csv").symlink_to("../secret.csv")
    with (measured.parent / "huge.csv").open("wb") as file:
        file.truncate(1 << 40)
    with ResultFile.open(measured) as store:
        assert recall(store).tolerances
    put_study(measured, MEASURED.replace("FILE", named))
    begun = time.monotonic()
    with ResultFile.open(measured) as store, pytest.raises(InputError, match="cannot be read: ") as raised:
        recall(store)
    assert time.monotonic() - begun < 5
    assert "hunter2" not in str(raised.value)
    assert "root:" not in str(raised.value)


@pytest.mark.parametrize("text", ["\x1b[2J\u202e", "[tolerances", "tolerances = 3\nsweep = 1\nfatigue = []"])
@pytest.mark.parametrize("words", [["export", "--statistics", "-"], ["report"], ["fatigue"], ["sorting"]])
def test_a_study_that_is_no_study_ends_in_one_message(tmp_path: Path, text: str, words: list[str]) -> None:
    path = synthetic.store(tmp_path)
    put_study(path, text)
    ended = corruption.call([words[0], path, *words[1:]], tmp_path)
    assert ended.code in (0, 2), ended.err
    assert "Traceback" not in ended.err
    assert ended.code == 0 or str(path) in ended.err


def test_contents_of_files_that_a_result_file_names_are_not_quoted(measured: Path) -> None:
    (measured.parent / "a.csv").write_text("hunter2\nhunter3\n", encoding="utf-8")
    with ResultFile.open(measured) as store, pytest.raises(InputError) as raised:
        recall(store)
    assert "hunter" not in str(raised.value)
    assert "--study STUDY" in str(raised.value)


def test_pipes_and_devices_are_no_result_files(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.h5")
    for path in (tmp_path / "pipe.h5", Path("/dev/zero")):
        for read in (ResultFile.open, Writer.open):
            with pytest.raises(StoreError, match="is a pipe or a device"):
                read(path)
