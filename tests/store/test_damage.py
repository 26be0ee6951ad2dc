"""A changed bit costs the joints of its block, or refuses the file; every command that meets it says so."""

from __future__ import annotations

import logging
import os
import shutil
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from click.testing import Result
from typer.testing import CliRunner

import tolstat
from tests.campaign.test_campaign import datasets
from tests.store.test_store import new_store, simulation
from tests.support import damage, fakes, synthetic
from tests.support.systems import needs_posix
from tolstat import cli, study
from tolstat.common.errors import StoreError
from tolstat.common.tables import Status
from tolstat.sampling import draw_blocks, origin_blocks
from tolstat.store import ResultFile, Writer, metadata, verification, what_if
from tolstat.store.checksums import Integrity

ROWS = 8
KEPT = synthetic.KEPT.replace("[", '["*.lateral_?x_max", ', 1)
TEXT = synthetic.REAL.replace("n = 60", "n = 40").replace(
    synthetic.KEPT, f'{KEPT}\nhistories = "harmonics+cycles"\nharmonics = 4'
)
CHANGE = {"kind": "width", "label": "pin*.offset_t", "step": "half", "words": "half", "seed": 1, "tolerances": {}}
SET = f"what_if/{what_if.key(CHANGE)}"


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """File of a complete campaign with all that a file may hold, a checksum for each column and 8 rows."""
    folder = tmp_path_factory.mktemp("damage")
    (folder / "a.toml").write_text(TEXT, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        damage.small_blocks(patch, ROWS)
        tolstat.run(study.load(folder / "a.toml"), folder / "a.h5", workers=1)
        with Writer.open(folder / "a.h5") as store:
            loads, status = np.arange(6.0).reshape(3, 2), np.ones(3, np.uint8)
            what_if.write(store, {SET[8:]: what_if.Altered(CHANGE, 4, ("cross1.F", "psi"), loads, status)})
    return folder / "a.h5"


@pytest.fixture
def path(kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    damage.small_blocks(monkeypatch, ROWS)
    monkeypatch.chdir(tmp_path)
    for suffix in (".h5", ".toml"):
        shutil.copy(kept.with_suffix(suffix), tmp_path)
    return tmp_path / "a.h5"


def call(path: Path, words: str) -> Result:
    """Run a command; ``report`` means that with FILE after its first word."""
    command, *rest = words.split()
    return CliRunner().invoke(cli.app, [command, str(path), *rest])


OF_RESULTS = "the results of rows 8:16 are damaged and are left out\n  hint: simulate these joints again: tolstat run"
OF_ERRORS = "is damaged: errors/pin1.offset_t of rows 8:16 does not match its checksum\n  hint: restore a copy"
OF_METADATA = "is damaged or no tolstat result file: its metadata do not match their checksum"
OF_VERIFICATION = "is damaged: its verification cannot be used: its values do not match their checksum"
OF_HISTORIES = "is damaged: histories/cycles of rows 8:16 does not match its checksum\n  hint: simulate these joints"
OF_WHAT_IF = "the joints of 1 change of what_if are damaged and left out\n  hint: simulate them again: tolstat causes"
READING = ("status", "report", "export --csv -", "export --statistics -", "export --pylife -")
READING += ("worst --by cross1.F", "fatigue", "capability", "orders")
TOLD = {
    **{("results/cross1.F_max", words): (0, OF_RESULTS) for words in READING},
    **{("results/status", words): (0, OF_RESULTS) for words in ("status", "report", "export --csv -")},
    **{("ledger/attempt", words): (0, OF_RESULTS) for words in ("status", "report", "export --csv -")},
    ("results/cross1.F_max", "replay --row 10"): (2, OF_RESULTS),
    ("results/cross1.F_max", "replay --row 20"): (0, "identical to the stored results"),
    **{("errors/pin1.offset_t", words): (2, OF_ERRORS) for words in ("export --csv -", "worst --by cross1.F")},
    ("errors/pin1.offset_t", "replay --row 10"): (2, OF_ERRORS),
    ("errors/pin1.offset_t", "extend --n 50 --no-report"): (2, OF_ERRORS),
    ("errors/pin1.offset_t", "verify --joints 2"): (2, OF_ERRORS),
    ("errors/pin1.offset_t", "merge --out b.h5"): (2, OF_ERRORS),
    **{("metadata", words): (2, OF_METADATA) for words in ("status", "report", "replay --row 10", "extend --n 50")},
    **{("verify/finer", w): (2, OF_VERIFICATION) for w in ("report", "capability", "status")},
    ("verify/rows", "export --statistics -"): (2, OF_VERIFICATION),
    **{
        ("histories/cycles", words): (2, OF_HISTORIES) for words in ("fatigue", "export --pylife -", "merge --out b.h5")
    },
    ("histories/cycles", "export --csv -"): (0, ""),
    (f"{SET}/loads", "report --out page.html"): (0, OF_WHAT_IF),
}
"""Exit code of a command over a file of which one bit of a dataset has changed, and a part of what it says."""


SLOW = ("report", "statistics", "pylife", "fatigue", "capability", "orders", "extend", "verify")
"""Words of commands that take long."""


@pytest.mark.parametrize(
    ("name", "words"),
    [pytest.param(*own, marks=pytest.mark.slow if any(word in own[1] for word in SLOW) else ()) for own in TOLD],
)
def test_commands_tell_of_damage(path: Path, name: str, words: str) -> None:
    whole = None if TOLD[name, words][1] else call(path, words)
    damage.flip_in(path, name, 0 if name.startswith(("metadata", "verify", "what_if")) else 10)
    code, told = TOLD[name, words]
    done = call(path, words)
    assert (done.exit_code, told in done.stderr) == (code, True), done.stderr
    assert code == 0 or not done.stdout
    assert whole is None or done.stdout == whole.stdout
    assert done.stderr.count("damaged") == ("damaged" in told)


FOUND = {
    "results/psi_max": "results/psi_max of rows 8:16",
    "results/status": "results/status of rows 8:16",
    "ledger/attempt": "ledger/attempt of rows 8:16",
    "histories/cycles": "histories/cycles of rows 8:16",
    "errors/hole2.tilt_z": "errors/hole2.tilt_z of rows 8:16",
    "verify/finer": OF_VERIFICATION,
    f"{SET}/status": "what_if: 1 change\n",
    "metadata": OF_METADATA,
}


@pytest.mark.parametrize("name", FOUND)
def test_status_compares_everything_with_its_checksum(path: Path, name: str) -> None:
    done = call(path, "status --check")
    assert (done.exit_code, done.stderr) == (0, "")
    assert "\nchecksums: all match\n" in done.stdout
    damage.flip_in(path, name, 10 if name.startswith(("results", "ledger", "hist", "errors")) else 0)
    done = call(path, "status --check")
    assert (done.exit_code, done.stdout) == (2, "")
    assert FOUND[name] in done.stderr


def test_a_damaged_checksum_is_damage_of_its_numbers(path: Path) -> None:
    with h5py.File(path) as file:
        columns = [name.decode() for name in file["checksums/column"]]
        place, blocks = file["checksums/crc"].id.get_offset(), file["checksums/crc"].shape[1]
    damage.flip(path, place + 8 * (columns.index("results/psi_max") * blocks + 2))
    with ResultFile.open(path) as store:
        assert store.check() == Integrity(True, {"results/psi_max": ["16:24"]})


@pytest.mark.parametrize("name", ["verify", "what_if"])
def test_a_group_of_another_name_is_not_taken_for_missing(path: Path, name: str) -> None:
    content = path.read_bytes()
    damage.flip(path, content.index(f"\0{name}\0".encode()) + len(name), 2)
    done = call(path, "status")
    assert (done.exit_code, done.stdout) == (2, "")
    assert "is damaged or no tolstat result file: " in done.stderr
    with h5py.File(path) as file:
        assert name not in file


def test_only_the_block_is_lost(path: Path, caplog: pytest.LogCaptureFixture) -> None:
    for row, name in ((9, "results/cross1.F_max"), (14, "results/psi_max"), (40, "results/closure")):
        damage.flip_in(path, name, row)
    with ResultFile.open(path) as store:
        store.errors()
    assert not caplog.records, "who reads no results is told nothing"
    with ResultFile.open(path) as store:
        results = store.results()
        lost = [*range(8, 16), 40]
        assert np.flatnonzero(results["status"] == Status.PENDING).tolist() == lost
        assert np.isnan(results["F_max"][lost]).all()
        assert store.pending().tolist() == lost
        assert store.counts().done == 41 - 9
        assert np.isnan(store.histories("cycles", np.array(lost))).all()
    (told,) = [record.getMessage() for record in caplog.records if record.levelno == logging.WARNING]
    assert "the results of rows 8:16, 40:41 are damaged and are left out\n" in told


@pytest.mark.slow
@pytest.mark.parametrize("name", ["results/cross1.F_max", "results/status", "ledger/attempt", "histories/cycles"])
def test_a_run_simulates_the_block_again(path: Path, name: str, kept: Path) -> None:
    damage.flip_in(path, name, 10)
    done = CliRunner().invoke(cli.app, ["run", "a.toml", "--out", "a.h5", "--workers", "1", "--no-report"])
    assert done.exit_code == 0, done.stderr
    assert "the results of rows 8:16 are damaged and pending again\n" in done.stderr
    assert datasets(path) == datasets(kept)
    assert call(path, "status --check").exit_code == 0


def test_damage_is_told_before_anything_goes_to_standard_output(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tolstat.store.result_file.AT_ONCE", 4)
    damage.flip_in(path, "errors/pin1.offset_t", 38)
    done = call(path, "export --csv -")
    assert (done.exit_code, done.stdout) == (2, "")


@pytest.mark.parametrize(("name", "message"), [("origin/level", "origin/level"), ("origin/parent", "origin/parent")])
def test_how_joints_were_drawn_is_checked(tmp_path: Path, name: str, message: str) -> None:
    (tmp_path / "a.toml").write_text(synthetic.STUDY, encoding="utf-8")
    settings = {"load": "cross1.F", "levels": {"cross1.F": 900.0}, "per_level": 60, "p0": 0.1}
    plan, rows = study.subset_of(study.load(tmp_path / "a.toml"), settings), range(61)
    Writer.create(tmp_path / "a.h5", plan, draw_blocks(plan, rows), origin=origin_blocks(plan, rows)).close()
    damage.flip_in(tmp_path / "a.h5", name, 5, 0)
    with ResultFile.open(tmp_path / "a.h5") as store, pytest.raises(StoreError, match=f"damaged: {message}"):
        store.origin()
    with pytest.raises(StoreError, match=f"damaged: {message}"):
        Writer.open(tmp_path / "a.h5")


def test_which_joint_a_row_is_is_checked(tmp_path: Path) -> None:
    errors = 'errors.hole4.offset_t = "0.1 mm"\n'
    listed = f'[sampling]\nmethod = "cases"\n[[case]]\nname = "a"\n{errors}[[case]]\nname = "b"\n{errors}'
    path = synthetic.store(tmp_path, synthetic.HEAD + listed)
    damage.flip_in(path, "design/case", 1, 0)
    with ResultFile.open(path) as store, pytest.raises(StoreError, match=r"damaged: design/case of rows 0:3"):
        _ = store.design
    with pytest.raises(StoreError, match="damaged: design/case"):
        Writer.open(path)


def test_a_damaged_attempt_simulates_nothing_with_the_settings_of_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Blocks with damaged attempts begin anew with the settings of the study; other damaged ones keep theirs."""
    damage.small_blocks(monkeypatch, 4)
    path, plan = tmp_path / "a.h5", fakes.Study(n=12)
    with new_store(path, plan) as store:
        store.write(np.arange(12), simulation(plan, np.arange(12)))
        entry = {"status": ["ok"], "settings": {}, "options": store.options}
        store.mark_pending({"": np.array([3, 9])}, entry)
        store.write(np.array([3, 9]), simulation(plan, np.array([3, 9])))
    damage.flip_in(path, "ledger/attempt", 3, 0)
    damage.flip_in(path, "results/psi_max", 9)
    with ResultFile.open(path) as store:
        assert np.flatnonzero(store.attempt()).tolist() == []
    with Writer.open(path) as store:
        assert store.pending().tolist() == [0, 1, 2, 3, 8, 9, 10, 11]
        assert np.flatnonzero(store.attempt()).tolist() == [9]


def test_a_retry_that_is_killed_or_stopped_before_its_first_joint_is_no_damage(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    damage.small_blocks(monkeypatch, 4)
    path, killed, plan = tmp_path / "a.h5", tmp_path / "b.h5", fakes.Study(n=12)
    with new_store(path, plan) as store:
        store.write(np.arange(12), simulation(plan, np.arange(12)))
    with Writer.open(path) as store:
        store.mark_pending({"": np.array([3, 9])}, {"status": ["ok"], "settings": {}, "options": store.options})
        killed.write_bytes(path.read_bytes())
    for file, checked in ((path, True), (killed, False)):
        with ResultFile.open(file) as store:
            assert store.pending().tolist() == [3, 9]
            assert np.flatnonzero(store.attempt()).tolist() == [3, 9]
            assert store.check() == (checked, {})


def test_damage_at_one_operating_point_is_not_that_of_another(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    damage.small_blocks(monkeypatch, 4)
    names = ("low", "lower")
    points = tuple(fakes.Study().points[0]._replace(name=name, share=0.5) for name in names)
    path, plan = tmp_path / "a.h5", fakes.Study(n=12, points=points)
    with new_store(path, plan) as store:
        for name in names:
            store.at(name).write(np.arange(12), simulation(plan, np.arange(12)))
    damage.flip_in(path, "points/lower/results/psi_max", 5)
    for read in (ResultFile.open, Writer.open):
        with read(path) as store:
            assert [one.pending().tolist() for one in store.each()] == [[], [4, 5, 6, 7]]


@pytest.mark.parametrize(("started", "done"), [(1e300, 3), (np.inf, 3), (5.0, -1), (5.0, 1 << 40), (np.nan, 0)])
def test_an_impossible_session_is_no_session(tmp_path: Path, started: float, done: int) -> None:
    path = tmp_path / "a.h5"
    with new_store(path, fakes.Study(n=12)) as store:
        store.begin_session(3)
        session = store.session()
        assert session is not None
        assert session.done == 3
        assert session.started <= time.time()
        own = store._checked.file["session"]
        own["started"][()], own["done"][()] = started, done
        assert store.session() is None


def put_study(path: Path, text: str) -> None:
    with h5py.File(path, "r+") as file:
        metadata.write(file, metadata.read(file).model_copy(update={"study": text}))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "words"),
    [
        *((text, "report") for text in ("\x1b[2J\u202e", "[tolerances", "tolerances = 3\nsweep = 1\nfatigue = []")),
        *(("tolerances = 3", words) for words in ("export --statistics -", "fatigue")),
    ],
)
def test_a_study_that_is_no_study_ends_in_one_message(tmp_path: Path, text: str, words: str) -> None:
    path = synthetic.store(tmp_path)
    put_study(path, text)
    done = call(path, words)
    assert done.exit_code in (0, 2), done.stderr
    assert done.exit_code == 0 or str(path) in done.stderr


@needs_posix
def test_pipes_and_devices_are_no_result_files(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.h5")
    for path in (tmp_path / "pipe.h5", Path("/dev/zero")):
        for read in (ResultFile.open, Writer.open):
            with pytest.raises(StoreError, match="is a pipe or a device"):
                read(path)


def test_damaged_checks_of_joints_near_a_limit_are_told_with_their_command(path: Path) -> None:
    with Writer.open(path) as store:
        held = verification.read(store)
        assert held is not None
        verification.write([(store, verification.NEAR, held)])
    damage.flip_in(path, f"{verification.NEAR}/finer", 0)
    done = call(path, "status --check")
    assert done.exit_code == 2
    assert "--near LIMIT" in done.stderr
