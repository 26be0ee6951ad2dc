"""One joint again, bit for bit, from its file alone; and the joints behind a tail with their errors in sigma."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.support import damage, synthetic
from tests.support.of_cardan import PARAM
from tests.support.reports import call
from tolstat import sampling, study
from tolstat.campaign import replay
from tolstat.campaign import run as campaign
from tolstat.common.cardan import CARDAN
from tolstat.common.columns import SUBSET
from tolstat.common.errors import InputError, StoreError
from tolstat.common.files import data_dir
from tolstat.common.tables import Options, Simulation, Status
from tolstat.display.answer import Sentence
from tolstat.questions.causes.worst import NOTES, joint_rows, ordered, worst
from tolstat.store import ResultFile, Writer, recorded

HEAD = """
[joint]
base = "own.toml"
material.E = "210 GPa"

[operation]
alpha = "15 deg"
speed = "500 rpm"
torque = "100 N*m"

[solver]
steps_per_rev = 60
"""
DRAWN = """
[tolerances]
"pin*.offset_t" = { plus_minus = "0.1 mm", distribution = "normal", cpk = 1.0 }
[sampling]
n = 5
[output]
histories = "harmonics"
harmonics = 6
"""
LISTED = """
[sampling]
method = "cases"
[output]
histories = "full"
[[case]]
name = "tilted"
errors = { "pin1.tilt_z" = "0.3 deg" }
[[variant]]
name = "as drawn"
[[variant]]
name = "tighter"
points = 2
joint.contact.law = "sliced"
vary."contact.D_H" = { from = "76.2 mm", to = "76.1 mm" }
[[variant]]
name = "measured"
joint.pin.mass = "0.31 kg"
"""


@pytest.fixture(scope="module", params=[DRAWN, LISTED], ids=["drawn", "listed"])
def file(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Result file of a small campaign whose study and joint file are gone."""
    folder = tmp_path_factory.mktemp("replay")
    shutil.copy(data_dir() / "joints" / "cirelli2021.toml", folder / "own.toml")
    (folder / "small.toml").write_text(HEAD + request.param, encoding="utf-8")
    campaign.run(study.load(folder / "small.toml"), folder / "small.h5", 1)
    (folder / "own.toml").unlink()
    (folder / "small.toml").unlink()
    return folder / "small.h5"


def test_every_row_comes_out_as_it_is_stored(file: Path) -> None:
    with ResultFile.open(file) as store:
        for row in range(store.n):
            again = replay.replay(store, row)
            assert (again.differences, again.code, again.stored) == ([], [], Status.OK)
        assert len({recorded.joint_of(store, row).contact.D_H for row in range(store.n)}) == 1 + bool(store.case_names)


def test_differences_are_found_and_named(file: Path, tmp_path: Path) -> None:
    path = tmp_path / "changed.h5"
    shutil.copy(file, path)
    with damage.rewritten(path) as changed:
        changed["results/fork2.T_mean"][3] *= 1 + 1e-12
        name = next(name for name in ("coefficients_imag", "loads") if name in changed["histories"])
        changed[f"histories/{name}"][3, 1, 1, 1] += 0.25
    with ResultFile.open(path) as store:
        again = replay.replay(store, 3)
        assert [d.name for d in again.differences] == ["fork2.T_mean", f"histories/{name}"]
        assert again.differences[0].relative == pytest.approx(1e-12, rel=1e-3)
        assert again.differences[1].stored - again.differences[1].now == pytest.approx(0.25)
        assert replay.replay(store, 2).differences == []


def test_command(file: Path, tmp_path: Path) -> None:
    done = call("replay", file, "--row", 1, "--out", tmp_path / "trace.csv", "--json")
    assert done.exit_code == 0
    assert done.stderr.endswith("row 1: identical to the stored results, bit for bit\n")
    summary = json.loads(done.stdout)
    assert summary["equal"]
    trace = pd.read_csv(tmp_path / "trace.csv")
    load = np.sqrt((trace[["fork1.F_e", "fork1.F_t", "fork1.F_z"]] ** 2).sum(axis=1)).max()
    assert load == pytest.approx(summary["max"]["fork1.F"]["joint"], rel=1e-6)
    path = tmp_path / "changed.h5"
    shutil.copy(file, path)
    with damage.rewritten(path) as changed:
        changed["results/steps"][1] += 1
    done = call("replay", path, "--row", 1)
    assert done.exit_code == 1
    assert "row 1: 1 values differ, largest relative difference 0.0" in done.stderr
    assert "all versions are those that made the file" in done.stderr
    done = call("replay", path, "--row", 99)
    assert done.exit_code == 2
    assert "hint: give one of these rows, for example --row 0" in done.stderr


def test_pending_rows_are_refused(file: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    shutil.copy(file, path)
    with damage.rewritten(path) as changed:
        changed["results/status"][2] = Status.PENDING
    with ResultFile.open(path) as store, pytest.raises(InputError, match="row 2 is pending"):
        replay.replay(store, 2)


def test_the_tail_is_told_with_its_errors(tmp_path: Path) -> None:
    text = synthetic.STUDY.replace(
        "[sampling]", '"hole2.offset_radial" = { sigma = "0.1 mm", distribution = "rayleigh" }\n[sampling]'
    )
    path = synthetic.store(tmp_path, text, failed=2, unsettled=3)
    with ResultFile.open(path) as store:
        found = joint_rows(store.view(), "cross1.F", 4)
        errors, results = store.errors(), store.results()
        contact = joint_rows(store.view(), "pin1.contact", 100)
        assert joint_rows(store.view(), "steps", 1)[0]["unit"] == "1"
        with pytest.raises(InputError, match="did you mean 'cross1\\.F'"):
            joint_rows(store.view(), "cros1.F")
    largest = results["F_max"][1:, 0]
    order = np.argsort(-np.nan_to_num(largest, nan=0.0))[:4] + 1
    assert [joint["row"] for joint in found] == order.tolist()
    assert {joint["unit"] for joint in found} == {"N"}
    assert len(contact) == 58  # sixty joints less two failed; the nominal one is not counted
    assert {joint["status"] for joint in contact} == {Status.OK.label, Status.NOT_SETTLED.label}
    for joint in found:
        z = errors["pin3.offset_t"][joint["row"]] / (1e-4 / 3)
        assert joint["pin3.offset_t"] == pytest.approx(z, abs=1e-9)
        for part in "tz":
            z = errors[f"hole2.offset_{part}"][joint["row"]] / 1e-4
            assert joint[f"hole2.offset_radial_{part}"] == pytest.approx(z, abs=1e-9)
        first = joint["raised_by"].split(", ") if joint["raised_by"] else []
        sizes = [abs(score) for _, score in ordered(joint)[len(first) :]]
        assert sizes == sorted(sizes, reverse=True)


def test_errors_that_move_the_load_come_before_larger_ones(tmp_path: Path) -> None:
    """The load follows one error to its positive side, and another one to both sides; of few joints none is known."""
    for n, known in ((400, True), (20, False)):
        text = synthetic.WHOLE.replace("n = 60", f"n = {n}").replace('"pin*.offset_t"', '"pin*.offset_[tz]"')
        path = synthetic.store(tmp_path, text, f"of_{n}", simulated=0)
        with Writer.open(path) as store:
            results, errors = synthetic.results(n + 1), store.errors()
            results["F_max"][:, 0] = 640.0 + 1e6 * (errors["pin1.offset_t"] + np.abs(errors["pin3.offset_z"]))
            store.write(np.arange(n + 1), Simulation(results, {}))
        with ResultFile.open(path) as store:
            view = store.view()
            found, answer = joint_rows(view, "cross1.F", 8), worst(view, "cross1.F", 8)
        assert any(joint["raised_by"] for joint in found) == known
        notes = [part.text for part in answer.parts if isinstance(part, Sentence)]
        assert notes[0] == NOTES[known]
        for joint in found if known else ():
            first = joint["raised_by"].split(", ")
            assert set(first) == {"pin1.offset_t", "pin3.offset_z"}
            assert [name for name, _ in ordered(joint)[:2]] == first
            assert joint["pin1.offset_t"] > 0.0


def test_the_tail_of_a_subset_simulation_is_told_too(tmp_path: Path) -> None:
    (tmp_path / "plan.toml").write_text(synthetic.STUDY, encoding="utf-8")
    plan = study.load(tmp_path / "plan.toml")
    subset = study.subset_of(plan, {"load": "cross1.F", "levels": {"cross1.F": 700.0}, "per_level": 60, "p0": 0.1})
    results, origin = synthetic.results(61), np.zeros(61, SUBSET)
    with Writer.create(tmp_path / "subset.h5", subset, [sampling.draw(plan)], origin=[origin]) as store:
        store.write(np.arange(61), Simulation(results, {}))
    with ResultFile.open(tmp_path / "subset.h5") as store:
        view = store.view()
        assert [joint["row"] for joint in joint_rows(view, "cross1.F", 1)] == [np.argmax(results["F_max"][:, 0])]
        with pytest.raises(StoreError, match="no random sample"):
            view.load("cross1.F")


def test_a_load_that_is_zero_without_errors_has_no_change():
    """Up to the accuracy of Newton's iteration: six million per cent of a residual say nothing."""
    joint, nominal = synthetic.results(2)[:1].copy(), synthetic.results(2)[1:2].copy()
    joint["F_max"], nominal["F_max"] = 660.0, 600.0
    joint["lateral_orders_max"], nominal["lateral_orders_max"] = 0.3, 1e-4
    made = replay.CaseResult(Simulation(joint, {}), np.zeros(1, PARAM), 0.1, Options(), CARDAN, nominal)
    largest = made.summary()["max"]
    assert largest["input.lateral_1x"]["change"] is None
    assert largest["cross1.F"]["change"] == pytest.approx(0.1)
