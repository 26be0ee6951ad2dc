"""Files of the current schema are read, by xarray and MATLAB, too; others, and what is left of one, are refused."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest

import tolstat
from tests import make_golden
from tests.campaign.test_campaign import datasets
from tests.store.test_store import new_store, simulation
from tests.support import fakes
from tests.support.of_cardan import ERROR_COLUMNS, RESULT_COLUMNS
from tests.support.reading import read_all
from tolstat.common import tables
from tolstat.common.cardan import CARDAN
from tolstat.common.errors import StoreError
from tolstat.common.tables import SCHEMA_VERSION, Mode, Status
from tolstat.store import ResultFile, Writer, layout, metadata, verification, what_if
from tolstat.store.hdf5 import text

GOLDEN, BEFORE = make_golden.FOLDER / make_golden.PRESENT, make_golden.FOLDER / make_golden.BEFORE


def test_a_released_file_is_read() -> None:
    expected = pd.read_csv(GOLDEN.with_suffix(".csv"), index_col="row", float_precision="round_trip")
    with ResultFile.open(GOLDEN) as store:
        frame = store.to_pandas(nominal=True)
        assert (store.n, store.rows, store.campaign_rows, store.whole) == (3, range(3), 3, True)
        assert store.limits == {"cross1.F": 700.0}
        assert (store.study_name, store.sampling["seed"], store.options["steps_per_rev"]) == ("fake", 7, 30)
        assert store.complete
        loads, modes = store.histories("loads"), store.histories("mode")
    pd.testing.assert_frame_equal(frame[expected.columns], expected, check_exact=True, check_dtype=False)
    x = frame["pin1.offset_t"].to_numpy() + 2 * frame["alpha"].to_numpy()
    np.testing.assert_array_equal(loads, fakes.history(fakes.SPECS["loads"], x))
    np.testing.assert_array_equal(modes, fakes.history(fakes.SPECS["mode"], x))


def test_the_layout_is_that_of_its_schema(tmp_path: Path) -> None:
    """Whoever changes the layout raises SCHEMA_VERSION and adds a golden file."""
    made = make_golden.make(tmp_path)
    assert datasets(made) == datasets(GOLDEN), "raise SCHEMA_VERSION, then: python -m tests.make_golden"
    with h5py.File(made) as new, h5py.File(GOLDEN) as old:
        assert set(new.attrs) == set(old.attrs)
        assert [*json.loads(new["metadata"][()])] == [*json.loads(old["metadata"][()])]


@pytest.fixture(scope="module")
def content(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Bytes of the file of a complete campaign with histories."""
    path, study = tmp_path_factory.mktemp("whole") / "a.h5", fakes.Study(n=6, output=fakes.Output("full"))
    with new_store(path, study) as store:
        store.write(np.arange(6), simulation(study, np.arange(6)))
        store.finish()
    assert read_all(path) == 6
    return path.read_bytes()


@pytest.fixture
def whole(tmp_path: Path, content: bytes) -> Path:
    """Copy the file of a complete campaign with histories."""
    (tmp_path / "a.h5").write_bytes(content)
    return tmp_path / "a.h5"


def groups(path: Path) -> list[str]:
    """All groups of a file, the root among them."""
    found = ["/"]
    with h5py.File(path) as file:
        file.visititems(lambda name, item: found.append(f"/{name}") if isinstance(item, h5py.Group) else None)
    return found


@pytest.mark.slow
def test_every_group_is_described_and_opens_in_xarray_without_a_warning(whole: Path) -> None:
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    verify(whole)
    names = groups(whole)
    always = {"/", "/errors", "/results", "/ledger", "/session", "/histories", "/checksums"}
    assert {*names} == always | {"/verify", "/what_if", f"/what_if/{what_if.key(CHANGE)}"}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for name in names:
            with xarray.open_dataset(whole, engine="h5netcdf", group=name) as opened:
                opened.load()
                assert len(opened.attrs["description"]) > 10
                assert set(opened.dims) == set(opened.coords)
                if "nominal" in opened:
                    assert opened["nominal"].to_numpy().tolist() == [1, 0, 0, 0, 0, 0]
                    assert opened["row"].to_numpy().tolist() == list(range(6))


CHANGE = {"kind": "width", "label": "pin*.tilt_t", "step": "half", "words": "half", "seed": 1, "tolerances": {}}


def verify(path: Path) -> None:
    with Writer.open(path) as store:
        check = verification.Check("finer Newton", {}, store.results()[1:3])
        found = verification.Verification(1, np.arange(1, 3), check.results, {"newton": check})
        verification.write([(store, verification.VERIFY, found)])
        loads, status = np.arange(6.0).reshape(3, 2), np.ones(3, np.uint8)
        changed = what_if.Altered(CHANGE, 4, ("cross1.F", "psi"), loads, status)
        what_if.write(store, {what_if.key(CHANGE): changed})


def test_codes_carry_their_meanings(whole: Path) -> None:
    with h5py.File(whole) as file:
        for name, codes in (("results/status", Status), ("histories/mode", Mode)):
            held = file[name]
            assert held.attrs["flag_values"].dtype == held.dtype
            assert held.attrs["flag_values"].tolist() == [code.value for code in codes]
            assert text(held.attrs, "flag_meanings").split() == [code.name.lower() for code in codes]
        assert text(file["nominal"].attrs, "flag_meanings") == "joint_with_errors nominal_joint"


def test_meanings_of_cases_and_families_are_words(whole: Path, tmp_path: Path) -> None:
    with h5py.File(whole) as file:
        held = metadata.read(file)
    variants = [tables.Variant(family, {}) for family in ("a b", "a b", "c")]
    design = metadata.Design(cases=("ideal", "tilted by 1°"), variants=variants)
    codes = layout.meanings_of(held.model_copy(update={"design": design}))
    with h5py.File(tmp_path / "b.h5", "w") as file:
        for name, meanings in codes.items():
            layout.put_meanings(file.create_dataset(name, (2,), "i4"), meanings)
        told = {name: text(dataset.attrs, "flag_meanings") for name, dataset in file.items()}
    assert told["case"] == "ideal tilted_by_1_"
    assert told["variant"] == "a_b_0 a_b_1 c"


def test_axes_of_histories_have_names(tmp_path: Path) -> None:
    from tolstat.solver.histories import history_specs

    specs = history_specs(fakes.Options(steps_per_rev=36), "full", 0) | history_specs(
        fakes.Options(steps_per_rev=36), "harmonics+cycles", 4
    )
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, spec in specs.items():
            layout.attach_scales(file.create_dataset(name, (2, *spec.shape), spec.dtype), spec, CARDAN)
        held = {name: file[name].asstr()[:].tolist() for name in layout.axes_of(CARDAN)}
        assert held == {name: list(names) for name, (names, _) in layout.axes_of(CARDAN).items()}
        np.testing.assert_allclose(file["theta"][:], np.radians(np.arange(0, 360, 10)))
        assert file["harmonic"][:].tolist() == [0, 1, 2, 3, 4]
        assert all(len(dim) == 1 for name in specs for dim in list(file[name].dims)[1:])


def test_xarray_reads_values_as_the_store_does(whole: Path) -> None:
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    with ResultFile.open(whole) as store:
        results, loads = store.results(), store.histories("loads")
    with xarray.open_dataset(whole, engine="h5netcdf", group="results") as opened:
        assert opened.sizes == {"row": 6}
        np.testing.assert_array_equal(opened["cross3.F_max"], results["F_max"][:, 2])
        assert opened["cross3.F_max"].attrs["units"] == "N"
    with xarray.open_dataset(whole, engine="h5netcdf", group="histories") as opened:
        assert opened["loads"].dims[0] == "row"
        assert len(opened["loads"].dims) == 4
        np.testing.assert_array_equal(opened["loads"], loads)


def test_every_axis_has_a_dimension_scale(whole: Path) -> None:
    with h5py.File(whole) as file:
        assert file["row"][:].tolist() == list(range(6))
        for group in ("errors", "results", "histories"):
            for dataset in file[group].values():
                if not dataset.is_scale:
                    scales = zip(dataset.dims, dataset.shape, strict=True)
                    assert all(len(dim) == 1 and len(dim[0]) == size for dim, size in scales)
                    assert dataset.dims[0][0] == file["row"]


def test_texts_have_a_fixed_length(whole: Path) -> None:
    found = []

    def look(name: str, item: h5py.HLObject) -> None:
        found.extend(
            h5py.check_string_dtype(item.attrs.get_id(key).dtype)
            for key in ("units", "description")
            if key in item.attrs
        )

    with h5py.File(whole) as file:
        file.visititems(look)
        found += [h5py.check_string_dtype(file.attrs.get_id(name).dtype) for name in file.attrs]
    kinds = [info for info in found if info is not None]
    assert len(kinds) > 200
    assert all(info.length is not None for info in kinds)


def test_histories_name_their_axes(tmp_path: Path) -> None:
    from tolstat.solver.histories import history_specs

    for kind in ("full", "harmonics+cycles"):
        for spec in history_specs(fakes.Options(), kind, 4).values():
            assert len(spec.axes) == len(spec.shape)


Change = Callable[[h5py.File], object]


def replaced(name: str, **how: object) -> Change:
    """Put another dataset in the place of one."""

    def change(file: h5py.File) -> None:
        del file[name]
        file.create_dataset(name, **how)

    return change


OTHER: dict[str, Change] = {
    "type of a column": replaced("results/steps", data=np.zeros(6)),
    "length of a column": replaced("errors/pin1.offset_e", data=np.zeros(7)),
    "two dimensions": replaced("results/status", data=np.zeros((6, 2), np.uint8)),
    "a group for a column": lambda file: (file.__delitem__("results/closure"), file.create_group("results/closure")),
    "a column that is gone": lambda file: file.__delitem__("results/psi_max"),
    "shape of a history": replaced("histories/loads", data=np.zeros((6, 30, 8, 5), "f4")),
    "histories that are gone": lambda file: file.__delitem__("histories"),
    "checksums that are gone": lambda file: file.__delitem__("checksums"),
    "a session that is gone": lambda file: file.__delitem__("session"),
    "metadata that are gone": lambda file: file.__delitem__("metadata"),
    "metadata without a checksum": lambda file: file["metadata"].attrs.__delitem__("sha256"),
    "version is a text": lambda file: file.attrs.__setitem__("schema_version", "two"),
}


@pytest.mark.parametrize("name", OTHER)
def test_files_that_are_not_as_their_metadata_say_are_refused(whole: Path, name: str) -> None:
    with h5py.File(whole, "r+") as file:
        OTHER[name](file)
    with pytest.raises(StoreError, match=r"a\.h5: is damaged or no tolstat result file: .*\n  hint: run the campaign"):
        read_all(whole)
    with pytest.raises(StoreError, match=r"a\.h5: is damaged or no tolstat result file: "):
        Writer.open(whole)


READ_ALL = """
import pathlib, psutil, sys
if hasattr(psutil, "RLIMIT_AS"):
    psutil.Process().rlimit(psutil.RLIMIT_AS, (1 << 32, 1 << 32))
from tests.support.reading import read_all
from tolstat.common.errors import StoreError
from tolstat.common.tables import SCHEMA_VERSION
for line in sys.stdin:
    try:
        print("read", read_all(pathlib.Path(line.strip())), flush=True)
    except StoreError as error:
        print("refused", str(error).splitlines()[0], flush=True)
"""


def outcomes(paths: list[Path]) -> list[str]:
    """What becomes of reading files, each in turn, in a process with bounded memory and time."""
    told = "".join(f"{path}\n" for path in paths)
    python = [sys.executable, "-c", READ_ALL]
    done = subprocess.run(
        python,
        input=told,
        capture_output=True,
        text=True,
        timeout=60 + len(paths),
        check=False,
        env=fakes.environment(),
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout.splitlines()


def test_cut_files_are_refused(whole: Path, tmp_path: Path) -> None:
    content = whole.read_bytes()
    lengths = np.linspace(1, len(content) - 1, 60).astype(int)
    paths = []
    for length in lengths:
        paths.append(tmp_path / f"cut{length}.h5")
        paths[-1].write_bytes(content[:length])
    told = outcomes(paths)
    assert len(told) == len(paths)
    assert all(line.startswith("refused") for line in told), told


@pytest.mark.slow
def test_changed_bytes_end_in_data_or_an_error(whole: Path, tmp_path: Path) -> None:
    """Wherever a byte is changed: no crash, no traceback, no endless reading."""
    rng = np.random.default_rng(11)
    content = np.frombuffer(whole.read_bytes(), np.uint8)
    count = int(os.environ.get("TOLSTAT_FLIPS", "60"))
    paths = []
    for number in range(count):
        changed = content.copy()
        # the first part of the file holds HDF5's own structures, which do the most harm
        changed[rng.integers(0, changed.size if number % 2 else changed.size // 4)] = rng.integers(256)
        paths.append(tmp_path / f"flip{number}.h5")
        changed.tofile(paths[-1])
    told = outcomes(paths)
    assert len(told) == count
    assert {line.split()[0] for line in told} == {"read", "refused"}


def test_no_file_is_unpickled_but_the_cache_of_the_kernels() -> None:
    """Compiled code is unpickled by Numba, from a folder of the user and behind a checksum; workers get a pipe."""
    package = Path(tolstat.__file__).parent
    own = {package / "kernel" / "simd" / "cache.py", package / "campaign" / "pool.py"}
    for path in {*package.rglob("*.py")} - own:
        assert "allow_pickle" not in path.read_text(encoding="utf-8"), path
        assert not path.read_text(encoding="utf-8").count("import pickle"), path


def test_a_released_file_lacks_nothing_that_is_asked_for() -> None:
    with ResultFile.open(GOLDEN) as store:
        assert set(store.to_pandas().columns) >= {c.name for c in ERROR_COLUMNS + RESULT_COLUMNS}


def test_the_file_of_the_schema_before_is_refused() -> None:
    with pytest.raises(StoreError, match=rf"this tolstat reads {SCHEMA_VERSION}\n.*run its study again"):
        ResultFile.open(BEFORE)


@pytest.mark.parametrize(("further", "remedy"), [(-1, "run its study again"), (1, "use a newer tolstat")])
def test_another_schema_is_refused_in_one_sentence(tmp_path: Path, further: int, remedy: str) -> None:
    version = SCHEMA_VERSION + further
    path = tmp_path / "other.h5"
    shutil.copy(GOLDEN, path)
    with h5py.File(path, "r+") as file:
        file.attrs["schema_version"] = version
    with pytest.raises(StoreError, match=rf"schema version {version}, this tolstat reads {SCHEMA_VERSION}\n.*{remedy}"):
        ResultFile.open(path)


def test_a_copy_of_a_file_is_not_changed_by_reading(tmp_path: Path) -> None:
    path = tmp_path / "copy.h5"
    shutil.copy(GOLDEN, path)
    before = path.read_bytes()
    read_all(path)
    assert path.read_bytes() == before
