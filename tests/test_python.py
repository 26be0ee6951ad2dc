"""What Python says as the command line does: studies as they are given, tables for other programs, single joints."""

import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pint
import pytest

import tolstat
from tests.support import synthetic
from tests.support.environment import ROOT
from tolstat.campaign.run import Interrupted

UNITS = pint.UnitRegistry()
SECTIONS = {
    "joint": {"base": "cirelli2021"},
    "operation": {"alpha": "15 deg", "speed": "500 rpm", "torque": "100 N*m"},
    "tolerances": {"pin*.offset_t": {"plus_minus": "0.1 mm", "distribution": "normal", "cpk": 1.0}},
    "sampling": {"n": 6, "method": "random", "seed": 3},
    "limits": {"cross*.F": "700 N"},
}
DUTY_CYCLE = SECTIONS | {
    "operation": [
        {"name": "drive", "share": 0.75, "alpha": "13 deg", "speed": "1200 rpm", "torque": "300 N*m"},
        {"name": "climb", "share": 0.25, "alpha": "16 deg", "speed": "600 rpm", "torque": "600 N*m"},
    ],
    "output": {"histories": "cycles"},
    "fatigue": {
        "exponents": [4],
        "revolutions": 1e7,
        "line": {"cross1.F_t": {"m": 5, "S0": "1 kN", "N0": 2e6}},
    },
}
USER = """
import tolstat

counts = tolstat.run("study.toml", "a.h5", workers=1)
with tolstat.open("a.h5") as store:
    frame = tolstat.causes(store.view(), "cross1.F").frame("errors")
    done: int = counts.done
"""
"""A script that mypy accepts."""


@pytest.fixture(scope="module")
def duty_cycle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("python") / "duty.h5"
    tolstat.run(DUTY_CYCLE, path, workers=1, check=False)
    return path


def test_quantities_and_numbers_of_numpy_are_values_of_a_study():
    quantities = {"alpha": 15 * UNITS.deg, "speed": 500 * UNITS.rpm, "torque": np.float64(100.0) * UNITS.N * UNITS.m}
    given = SECTIONS | {"operation": quantities, "sampling": SECTIONS["sampling"] | {"n": np.int64(6)}}
    assert tolstat.load(given).identity() == tolstat.load(SECTIONS).identity()


def test_a_study_is_taken_as_it_is_given(tmp_path):
    read = tolstat.load(SECTIONS)
    (tmp_path / "study.toml").write_text(read.text, encoding="utf-8")
    tables = [tolstat.draw(given) for given in (SECTIONS, read, tmp_path / "study.toml", str(tmp_path / "study.toml"))]
    assert len({table.tobytes() for table in tables}) == 1
    assert tolstat.load(read) is read
    assert tolstat.load(read, n=3).samples == 3


@pytest.mark.parametrize("wrong", [5, None, ["study.toml"]])
def test_what_is_no_study_is_told(wrong, tmp_path):
    for ask in (tolstat.load, tolstat.load_case, tolstat.draw, tolstat.function, tolstat.plan, tolstat.simulate_case):
        with pytest.raises(tolstat.InputError, match=f"type {type(wrong).__name__} is none"):
            ask(wrong)
    with pytest.raises(tolstat.InputError, match="is none"):
        tolstat.run(wrong, tmp_path / "a.h5")


def test_a_closed_file_says_so(tmp_path):
    path = synthetic.store(tmp_path)
    with tolstat.open(path) as store:
        view, altered = store.view(), store.view()
        assert altered.load("cross1.F").values.size
    for ask in (store.to_pandas, store.counts, store.errors, store.check, lambda: tolstat.limits(view)):
        with pytest.raises(tolstat.StoreError, match="is closed"):
            ask()
    store.close()  # again
    assert repr(store) == f"<result file {path.name!r}, closed>"


def test_a_stopped_run_is_a_keyboard_interrupt():
    assert issubclass(Interrupted, KeyboardInterrupt)


def test_a_store_is_no_view(tmp_path):
    with (
        tolstat.open(synthetic.store(tmp_path)) as store,
        pytest.raises(tolstat.InputError, match=r"give store.view\(\)"),
    ):
        tolstat.limits(store)


def test_answers_pickle_and_all_that_is_public_is_short(tmp_path):
    with tolstat.open(synthetic.store(tmp_path)) as store:
        view = store.view()
        answer = tolstat.worst(view, "cross1.F")
        again = pickle.loads(pickle.dumps(answer))
        pd.testing.assert_frame_equal(again.frame("joints"), answer.frame("joints"))
        assert again.values() == answer.values()
        shown = (answer, view, store, store.loads, store.metadata, view.load("cross1.F"), tolstat.load(SECTIONS))
        assert max(len(repr(each)) for each in shown) < 800


@pytest.mark.parametrize("ending", [".csv", ".parquet", ".xlsx"])
def test_a_table_has_the_columns_units_and_rows_of_to_pandas(tmp_path, ending):
    pytest.importorskip({".csv": "csv", ".parquet": "pyarrow", ".xlsx": "openpyxl"}[ending])
    path = synthetic.store(tmp_path, failed=2)
    made = tolstat.write_table(path, tmp_path / f"joints{ending}", nominal=True)
    with tolstat.open(path) as store:
        expected = store.to_pandas(nominal=True)
    if ending == ".parquet":
        found, units = pd.read_parquet(made), pd.read_parquet(made).attrs["units"]
    else:
        read = pd.read_csv if ending == ".csv" else pd.read_excel
        found = read(made, header=[0, 1], index_col=0)
        units = dict(found.columns.tolist())
        found.columns = found.columns.get_level_values(0)
    assert units == expected.attrs["units"]
    pd.testing.assert_frame_equal(found, expected, check_dtype=False, check_names=False, check_index_type=False)


def test_a_table_in_no_known_format_is_refused(tmp_path):
    with pytest.raises(tolstat.InputError, match="is no format of a table"):
        tolstat.write_table(synthetic.store(tmp_path), tmp_path / "joints.ods")
    assert not (tmp_path / "joints.ods").exists()


def test_an_extended_campaign_is_one_of_so_many_joints(tmp_path):
    study = tolstat.load(SECTIONS)
    tolstat.run(SECTIONS, tmp_path / "whole.h5", workers=1, check=False)
    tolstat.run(tolstat.load(study, n=4), tmp_path / "a.h5", workers=1, check=False)
    assert tolstat.extend(tmp_path / "a.h5", 6, workers=1).done == 7
    with tolstat.open(tmp_path / "a.h5") as store, tolstat.open(tmp_path / "whole.h5") as whole:
        assert store.results().tobytes() == whole.results().tobytes()
    assert not tolstat.replay(tmp_path / "a.h5", 5).differences
    assert tolstat.plan(SECTIONS, pilot=2).rows == 7


def test_own_errors_of_one_joint_give_loads_over_a_revolution():
    sections = {name: SECTIONS[name] for name in ("joint", "operation")}
    found = tolstat.simulate_case(sections | {"errors": {"pin1.offset_t": 0.1 * UNITS.mm}})
    trace = found.to_pandas()
    F = np.sqrt((trace[[f"cross1.F_{axis}" for axis in "etz"]] ** 2).sum(axis=1))
    assert found.summary()["max"]["cross1.F"]["joint"] == pytest.approx(F.max(), rel=1e-3)


def test_histories_of_chosen_joints_are_a_labelled_array(duty_cycle):
    pytest.importorskip("xarray")
    loads = tolstat.histories(duty_cycle, [2, 4], "drive")
    again = tolstat.replay(duty_cycle, 4, "drive").result.to_pandas()
    np.testing.assert_array_equal(loads.sel(row=4, channel="cross1.F_t"), again["cross1.F_t"])
    np.testing.assert_array_equal(loads["theta"], again["theta"])
    units = dict(zip(loads["channel"].to_numpy(), loads["unit"].to_numpy(), strict=True))
    expected = {
        "tau": "1",
        "cross1.F_t": "N",
        "fork2.T_z": "N*m",
        "pin1.contact_outer": "N",
        "input.m_x": "N*m",
        "pin1.mode": "1",
    }
    assert {name: units[name] for name in expected} == expected


def test_damage_by_joint_follows_from_a_netcdf_file(duty_cycle, tmp_path):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    with tolstat.open(duty_cycle) as store:
        store.to_xarray(histories="cycles").to_netcdf(tmp_path / "duty.nc", engine="h5netcdf")
        expected = tolstat.fatigue_by_joint(store.view(), ["cross1.F_t"])
    with xarray.open_dataset(tmp_path / "duty.nc") as data:
        turns = data["share"] * data["point_speed"]
        ranges = data["cycles"].sel(channel="cross1.F_t", of_cycle="range").astype(float)
        damage = ((ranges / 1e3) ** 5 / 2e6 * 1e7).sum("cycle", skipna=False)
        damage = (damage * turns / turns.sum()).sum("point", skipna=False)
    np.testing.assert_allclose(damage, expected["damage cross1.F_t"], rtol=1e-6)
    assert list(expected.index) == data["row"].to_numpy().tolist()
    assert expected.attrs["units"]["cross1.F_t m=4"] == "N"


def test_joints_with_the_largest_damage_and_what_causes_it(duty_cycle):
    with tolstat.open(duty_cycle) as store:
        view = store.view()
        rows = tolstat.worst(view, "damage cross1.F_t", top=2).frame("joints")
        expected = tolstat.fatigue_by_joint(view, ["cross1.F_t"])["damage cross1.F_t"].nlargest(2)
        with pytest.raises(tolstat.InputError, match="has no S-N line"):
            tolstat.worst(view, "damage cross1.F_e")
    assert rows["row"].tolist() == expected.index.tolist()
    np.testing.assert_allclose(rows["value"], expected)


@pytest.mark.slow  # mypy reads the whole package
def test_mypy_knows_the_types_of_a_users_script(tmp_path):
    pytest.importorskip("mypy")
    wrong = USER.replace("store.view()", "store").replace("done: int", "done: str")
    for text, errors in ((USER, 0), (wrong, 2)):
        (tmp_path / "user.py").write_text(text, encoding="utf-8")
        command = [sys.executable, "-m", "mypy", "--strict", str(tmp_path / "user.py")]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
        assert done.stdout.count(" error: ") == errors, done.stdout
