"""Campaigns that grow and campaigns put together: the same bytes as one run from the start, or a refusal that helps."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from tests.campaign.test_campaign import datasets
from tests.support import damage, fakes, synthetic
from tests.support.of_cardan import ERROR, RESULT
from tolstat import sampling
from tolstat import study as studies
from tolstat.campaign import extend
from tolstat.campaign import run as campaign
from tolstat.common import files
from tolstat.common.errors import InputError, StoreError
from tolstat.common.tables import Options, Simulation, Status
from tolstat.store import ResultFile, Writer, metadata
from tolstat.study import Study

BODY = synthetic.STUDY.replace("[output]", '[output]\nhistories = "KIND"')
Make = Callable[..., Study]


def simulate(params: np.ndarray, options: Options, **kept: Any) -> Simulation:
    """Stand-in for the solver: numbers that depend on the joint's own errors."""
    params = params.copy()
    params["R"] = params["pin_point"].sum(axis=(1, 2)) * 1e4
    return fakes.simulate(params, options, **kept)


STAND_IN = fakes.SOLVER | {"history_specs": fakes.history_specs, "simulate_rows": simulate}
"""Functions in place of the solver's."""


def small(folder: Path, n: int, method: str = "random", kind: str = "none", seed: int = 2021) -> Study:
    """Write ``small.toml``, a study of n joints, and load it."""
    path = folder / "small.toml"
    body = BODY.replace("n = 60", f'n = {n}\nmethod = "{method}"').replace("KIND", kind)
    path.write_text(body.replace("seed = 2021", f"seed = {seed}"), encoding="utf-8")
    return studies.load(path)


@pytest.fixture
def make(tmp_path: Path) -> Make:
    return partial(small, tmp_path)


def run(study: Study, path: Path, check: bool = False, **choices: object) -> Path:
    """Run in one block without checks of the numerical error, which merged slices do not have."""
    with pytest.MonkeyPatch.context() as patch:
        fakes.replace_functions(patch, **STAND_IN)
        campaign.run(study, path, 1, 1000, check=check, **choices)
    return path


def slices(study: Study, folder: Path, *edges: int) -> list[Path]:
    """Result files of the rows between neighbouring edges."""
    return [run(study, folder / f"{a}-{b}.h5", rows=range(a, b)) for a, b in pairwise(edges)]


def test_an_extended_campaign_is_one_of_that_size(tmp_path: Path, make: Make) -> None:
    whole = run(make(101, kind="full"), tmp_path / "whole.h5")
    grown = run(make(40, kind="full"), tmp_path / "grown.h5")
    before = datasets(grown)
    for n in (41, 101):  # more than once, too
        study = extend.extend(grown, n)
        run(study, grown)
    assert datasets(grown) == datasets(whole)
    assert "histories/loads" in before
    with h5py.File(grown) as a, h5py.File(whole) as b:
        held, expected = (metadata.read(file).model_dump(exclude={"study", "created"}) for file in (a, b))
        assert held == expected


@pytest.mark.slow
def test_a_kill_while_extending_leaves_the_old_file(
    tmp_path: Path, make: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = run(make(40, kind="full"), tmp_path / "a.h5")
    before = path.read_bytes()

    def killed(*args: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("os.replace", killed)
        with pytest.raises(KeyboardInterrupt):
            extend.extend(path, 60)
    assert path.read_bytes() == before
    run(extend.extend(path, 60), path)
    assert datasets(path) == datasets(run(make(60, kind="full"), tmp_path / "b.h5"))


def test_as_many_joints_are_no_extension(tmp_path: Path, make: Make) -> None:
    path = run(make(40), tmp_path / "a.h5")
    before = path.read_bytes()
    with pytest.raises(InputError, match="has 40 joints already\n  hint: give a larger number"):
        extend.extend(path, 40)
    assert path.read_bytes() == before


def test_a_sweep_does_not_grow(tmp_path: Path) -> None:
    path = synthetic.store(tmp_path, synthetic.SWEEP, "sweep")
    before = path.read_bytes()
    with pytest.raises(InputError, match="cannot be extended: the points of a sweep determine its number of joints"):
        extend.extend(path, 80)
    assert path.read_bytes() == before


def test_a_file_of_other_code_does_not_grow(tmp_path: Path, make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    path = run(make(40), tmp_path / "a.h5")
    before = path.read_bytes()
    monkeypatch.setattr(metadata, "source_hash", lambda: "0")
    says = r"another version of the code\n    sources: \w+ in the file, 0 now\n  hint: .*STUDY --n 80 --out OTHER.h5"
    with pytest.raises(InputError, match=says):
        extend.extend(path, 80)
    assert path.read_bytes() == before
    assert list(tmp_path.glob("*.h5*")) == [path]


def test_slices_and_changed_studies_do_not_grow(tmp_path: Path, make: Make) -> None:
    (part,) = slices(make(40), tmp_path, 5, 20)
    with pytest.raises(InputError, match="holds only rows 5:20 of the campaign\n  hint: merge"):
        extend.extend(part, 80)
    whole = run(make(40), tmp_path / "a.h5")
    make(40, seed=3)
    changed = "does not match the study that was read for it\n    sampling.seed: 2021 in the file, 3 in the study"
    with pytest.raises(StoreError, match=changed):
        extend.extend(whole, 80, tmp_path / "small.toml")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["full", "none"])
def test_merged_slices_are_one_run(tmp_path: Path, make: Make, kind: str) -> None:
    study = make(60, kind=kind)
    parts = slices(study, tmp_path, 0, 1, 20, 44, 61)
    assert len(datasets(parts[2])["errors/row"]) == 24 * 8
    merged = extend.merge(parts[::-1], tmp_path / "c.h5")
    whole = run(study, tmp_path / "whole.h5")
    assert datasets(tmp_path / "c.h5") == datasets(whole)
    assert (merged.counts.done, merged.twice) == (61, 0)
    with h5py.File(tmp_path / "c.h5") as a, h5py.File(whole) as b:
        held, expected = (metadata.read(file).model_dump(exclude={"created"}) for file in (a, b))
        assert held == expected
    assert run(study, tmp_path / "c.h5").read_bytes() == (tmp_path / "c.h5").read_bytes()


@pytest.mark.slow
def test_equal_overlaps_are_merged_and_different_ones_refused(tmp_path: Path, make: Make) -> None:
    study = make(60)
    parts = slices(study, tmp_path, 0, 30, 61) + slices(study, tmp_path, 10, 40)
    assert extend.merge(parts, tmp_path / "c.h5").twice == 30
    assert datasets(tmp_path / "c.h5") == datasets(run(study, tmp_path / "whole.h5"))
    with Writer.open(parts[2]) as store:
        results = store.results(slice(7, 8))
        results["T_max"][0, 1] += 1e-13
        store.write(np.array([7]), Simulation(results, {}))
    with pytest.raises(InputError, match=r"0-30.h5 and .*10-40.h5: hold different results of row 17: cross2.T_max"):
        extend.merge(parts, tmp_path / "d.h5")
    assert not (tmp_path / "d.h5").exists()


def test_gaps_and_strangers_are_told_together(tmp_path: Path, make: Make) -> None:
    other = slices(make(60, seed=4), tmp_path, 20, 22)
    parts = slices(make(60), tmp_path, 0, 5) + slices(make(60), tmp_path, 30, 50) + other
    with pytest.raises(InputError) as caught:
        extend.merge(parts, tmp_path / "c.h5")
    text = str(caught.value)
    assert "20-22.h5: belongs to another campaign than" in text
    assert re.search(r"sampling.seed: 4 in the file, 2021 in .*0-5.h5", text)
    assert "no slice holds rows 5:20, 22:30, 50:61 of 61" in text
    assert "tolstat run STUDY --rows 5:20" in text
    assert not (tmp_path / "c.h5").exists()
    (tmp_path / "c.h5").touch()
    with pytest.raises(StoreError, match="exists already"):
        extend.merge(parts, tmp_path / "c.h5")


@pytest.mark.slow
def test_pending_rows_stay_pending_and_can_be_done_later(tmp_path: Path, make: Make) -> None:
    study = make(60)
    parts = slices(study, tmp_path, 0, 30, 61)
    with damage.rewritten(parts[1]) as file:
        file["results/status"][3:9] = Status.PENDING
    assert extend.merge(parts, tmp_path / "c.h5").counts.done == 55
    run(study, tmp_path / "c.h5")
    assert datasets(tmp_path / "c.h5") == datasets(run(study, tmp_path / "whole.h5"))


def killed(path: Path) -> None:
    """Leave a file as a run does that is killed: some values without their status, results without checksums."""
    with h5py.File(path, "r+") as file:
        file["results/status"][12:15] = Status.PENDING
        file["session/number"][()] += 1


def test_a_campaign_with_pending_joints_grows(tmp_path: Path, make: Make) -> None:
    grown = run(make(40, kind="full"), tmp_path / "grown.h5", until_row=30)
    killed(grown)
    study = extend.extend(grown, 60)
    with ResultFile.open(grown) as store:
        assert store.pending().tolist() == [12, 13, 14, *range(30, 61)]
        assert np.isnan(store.histories("loads", np.array([12, 60]))).all()
        assert store.check() == (True, {})
    run(study, grown)
    assert datasets(grown) == datasets(run(make(60, kind="full"), tmp_path / "whole.h5"))


def test_a_campaign_with_damaged_joints_grows_without_them(
    tmp_path: Path, make: Make, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    damage.small_blocks(monkeypatch, 8)
    grown = run(make(40, kind="full"), tmp_path / "grown.h5")
    damage.flip_in(grown, "results/psi_max", 9)
    damage.flip_in(grown, "histories/loads", 30)
    study = extend.extend(grown, 60)
    assert "the results of rows 8:16, 24:32 are damaged and pending again" in caplog.text
    with ResultFile.open(grown) as store:
        assert store.pending().tolist() == [*range(8, 16), *range(24, 32), *range(41, 61)]
        assert store.check() == (True, {})
    run(study, grown)
    assert datasets(grown) == datasets(run(make(60, kind="full"), tmp_path / "whole.h5"))


def test_joints_that_are_to_be_simulated_again_stay_so_when_the_campaign_grows(tmp_path: Path, make: Make) -> None:
    grown = run(make(40), tmp_path / "grown.h5")
    with Writer.open(grown) as store:
        store.mark_pending({"": np.array([3, 9])}, {"status": ["ok"], "settings": {}, "options": store.options})
    extend.extend(grown, 60)
    with ResultFile.open(grown) as store:
        assert store.pending().tolist() == [3, 9, *range(41, 61)]
        assert np.flatnonzero(store.attempt()).tolist() == [3, 9]


def test_slices_with_pending_joints_are_merged(tmp_path: Path, make: Make) -> None:
    """A row that one file has and another has not is that of the first."""
    study = make(60, kind="full")
    parts = [*slices(study, tmp_path, 0, 40), run(study, tmp_path / "b.h5", rows=range(20, 61), until_row=50)]
    killed(parts[0])
    killed(parts[1])
    merged = extend.merge(parts, tmp_path / "c.h5")
    assert merged.counts.done == 61 - 3 - 11
    with ResultFile.open(tmp_path / "c.h5") as store:
        assert store.pending().tolist() == [12, 13, 14, *range(50, 61)]
        assert store.check() == (True, {})
    run(study, tmp_path / "c.h5")
    assert datasets(tmp_path / "c.h5") == datasets(run(study, tmp_path / "whole.h5"))


def test_slices_with_damaged_joints_are_merged_without_them(
    tmp_path: Path, make: Make, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    damage.small_blocks(monkeypatch, 8)
    study = make(40)
    parts = slices(study, tmp_path, 0, 20, 41)
    damage.flip_in(parts[1], "results/psi_max", 9)
    assert extend.merge(parts, tmp_path / "c.h5").counts.done == 41 - 8
    assert "the results of rows 28:36 are damaged and are left out" in caplog.text
    damage.flip_in(parts[0], "errors/pin1.offset_t", 3)
    with pytest.raises(StoreError, match=r"0-20\.h5: is damaged: errors/pin1\.offset_t of rows 0:8"):
        extend.merge(parts, tmp_path / "d.h5")
    assert not (tmp_path / "d.h5").exists()
    run(study, tmp_path / "c.h5")
    assert datasets(tmp_path / "c.h5") == datasets(run(study, tmp_path / "whole.h5"))


def test_slices_are_refused_where_they_do_not_fit(tmp_path: Path, make: Make) -> None:
    study = make(60)
    for rows in (range(0), range(-1, 4), range(50, 62), range(0, 10, 2)):
        with pytest.raises(InputError, match="is no part of the rows 0:61 of the study"):
            run(study, tmp_path / "a.h5", rows=rows)
    (part,) = slices(study, tmp_path, 5, 20)
    with pytest.raises(StoreError, match="holds rows 5:20, not 0:61\n  hint: give --rows 5:20"):
        run(study, part)


def test_rows_of_a_slice_are_those_of_the_campaign(tmp_path: Path, make: Make) -> None:

    study = make(60)
    (part,) = slices(study, tmp_path, 5, 20)
    with ResultFile.open(part) as store:
        assert (store.rows, store.n, store.campaign_rows, store.whole) == (range(5, 20), 15, 61, False)
        assert store.to_pandas().index.tolist() == list(range(5, 20))
        assert store.errors().tobytes() == sampling.draw(study)[5:20].tobytes()


@pytest.mark.slow
def test_large_campaigns_need_no_more_memory(tmp_path: Path) -> None:
    """A smaller count of ``python -m tests.measure.scale 10000000 FOLDER``: tables are nowhere held whole."""
    measured = []
    for n in (70_000, 150_000):
        python = [sys.executable, "-m", "tests.measure.scale", str(n), str(tmp_path)]
        told = subprocess.run(python, capture_output=True, text=True, check=True, env=fakes.environment()).stdout
        measured.append(json.loads(told))
    growth = 1e6 * (measured[1]["parent_MB_at_most"] - measured[0]["parent_MB_at_most"])
    whole = 80_000 * (ERROR.itemsize + RESULT.itemsize)
    assert growth < 0.3 * whole
    assert measured[1]["file_bytes_a_row"] < 1.02 * (ERROR.itemsize + RESULT.itemsize)


def test_a_file_away_from_its_study_and_joint_file_is_extended(tmp_path: Path) -> None:
    here, away = tmp_path / "here", tmp_path / "away"
    here.mkdir()
    away.mkdir()
    joint_file = here / "own.toml"
    joint_file.write_bytes((files.data_dir() / "joints" / "cirelli2021.toml").read_bytes())
    study = here / "small.toml"
    study.write_text(
        synthetic.STUDY.replace('"cirelli2021"', '"own.toml"').replace("n = 60", "n = 4"), encoding="utf-8"
    )
    path = run(studies.load(study), away / "small.h5")
    identity = studies.load(study, n=6).identity()
    joint_file.unlink()
    assert extend.extend(path, 6).identity() == identity
    with ResultFile.open(path) as store:
        assert store.n == 7


def test_what_a_study_needs_beside_the_file_is_named(tmp_path: Path) -> None:
    (tmp_path / "here").mkdir()
    (tmp_path / "here" / "parts.csv").write_text("shift\n0.01\n0.02\n", encoding="utf-8")
    study = tmp_path / "here" / "small.toml"
    measured = '{ file = "parts.csv", column = "shift", unit = "mm", distribution = "measured" }'
    old = '{ plus_minus = "0.1 mm", distribution = "normal", cpk = 1.0 }'
    study.write_text(synthetic.STUDY.replace(old, measured).replace("n = 60", "n = 4"), encoding="utf-8")
    path = run(studies.load(study), tmp_path / "small.h5")
    with pytest.raises(InputError, match=r"(?s)parts\.csv.*hint: give the study file.*--study STUDY"):
        extend.extend(path, 6)
    assert extend.extend(path, 6, study).samples == 6
