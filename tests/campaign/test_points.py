"""The same joints at several operating points in one campaign."""

import math
import shutil
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest

from tests.support import fakes
from tolstat import study
from tolstat.analysis.cycles import duty_cycle
from tolstat.campaign import extend, replay
from tolstat.campaign import run as campaign
from tolstat.campaign.blocks import settings_in_use
from tolstat.campaign.remedy import Reason, Retry, in_words
from tolstat.common.errors import InputError, StoreError
from tolstat.common.tables import Options, Status
from tolstat.joint import Operation, load
from tolstat.questions.fatigue.loads import load_cycles
from tolstat.store import ResultFile, Writer
from tolstat.study.points import Point

ALPHAS = {"low": 0.0, "mid": 0.4, "high": -0.7}
POINTS = tuple(Point(name, Operation.model_construct(alpha=a, speed=1.0, torque=1.0)) for name, a in ALPHAS.items())
KEPT = tuple(f"cross{i}.F_max" for i in (1, 2, 3, 4))
AT_POINTS = ("results", "ledger", "histories", "verify")


def fake(points=POINTS, **changes):
    return fakes.Study(points=points, output=fakes.Output("full", results=KEPT), **changes)


def run(plan, path, check=False, **given):
    return fakes.run(plan, path, 1, 20, check=check, **given)


def results(path, name):
    """Bytes of what the joints have at a point, without the checks of the numerical error."""
    return {key: value for key, value in tables(path, f"/points/{name}").items() if not key.startswith("verify")}


def tables(path, place="/"):
    """Bytes of all numbers in the groups that each operating point has, and of the errors."""
    found = {}

    def add(name, item):
        if isinstance(item, h5py.Dataset) and item.dtype.kind != "O":
            found[name] = item[()].tobytes()

    with h5py.File(path) as file:
        for group in ("errors", *(f"{place}/{name}" for name in AT_POINTS)):
            before, held = dict(found), file.get(group)
            if held is not None:
                found.clear()
                held.visititems(add)
                name = group.rpartition("/")[2]
                found = before | {f"{name}/{key}": value for key, value in found.items()}
    return found


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    path = tmp_path_factory.mktemp("points") / "whole.h5"
    run(fake(), path, check=True)
    return path


def test_a_campaign_at_three_points_equals_three_campaigns_bit_for_bit(tmp_path, whole):
    for point in POINTS:
        alone = tmp_path / f"{point.name}.h5"
        run(fake().at(point.name), alone, check=True)
        expected = tables(alone)
        assert len(expected) > 50
        assert tables(whole, f"/points/{point.name}") == expected
    with ResultFile.open(whole) as store:
        loads = [store.at(name).results()["F_max"] for name in ALPHAS]
        assert np.ptp(store.errors()["operation.alpha"]) > 1
    assert (loads[0] != loads[1]).any()


def test_an_interrupted_campaign_goes_on_at_all_points(tmp_path, whole):
    path = tmp_path / "stopped.h5"
    run(fake(), path, until_row=20)
    with ResultFile.open(path) as store:
        assert [one.pending().tolist() for one in store.each()] == 3 * [list(range(20, 40))]
        assert store.counts()[:2] == (120, 60)
        assert store.view().counts[:2] == (39, 19)
        assert not store.complete
        assert np.isfinite(store.at("mid").histories("loads")[:20]).any()
        assert np.isnan(store.at("mid").histories("loads")[20:]).all()
    run(fake(), path)
    assert all(results(path, name) == results(whole, name) for name in ALPHAS)


def test_slices_merge_to_the_whole(tmp_path, whole):
    parts = [tmp_path / "a.h5", tmp_path / "b.h5"]
    for part, rows in zip(parts, (range(25), range(22, 40)), strict=True):
        run(fake(), part, rows=rows)
    merged = extend.merge(parts, tmp_path / "merged.h5")
    assert merged.counts.done == 120
    assert merged.counts.counted == "simulations of joints at 3 operating points"
    assert all(results(tmp_path / "merged.h5", name) == results(whole, name) for name in ALPHAS)


def test_a_file_grows_at_all_points(tmp_path, whole):
    path = tmp_path / "grown.h5"
    run(fake(n=12), path)
    with Writer.open(path) as store:
        extend.grow(store, fake(), [fakes.draw(fake())[12:]])
    run(fake(), path)
    assert all(results(path, name) == results(whole, name) for name in ALPHAS)


def test_a_retry_simulates_the_points_that_failed(tmp_path, whole):
    path = tmp_path / "again.h5"
    shutil.copy(whole, path)
    with ResultFile.open(path) as store:
        failed = {one.point: np.flatnonzero(one.status() == Status.NEWTON_FAILED).tolist() for one in store.each()}
    assert failed["mid"]
    assert failed["low"] != failed["mid"]
    run(fake(), path, retry=Retry((Status.NEWTON_FAILED,), {}, Options(steps_per_rev=30)))
    with ResultFile.open(path) as store:
        assert {one.point: np.flatnonzero(one.attempt()).tolist() for one in store.each()} == failed
        assert len(store.retries) == 1
        used = settings_in_use(fake(), store)  # the file holds names of methods, kernels take numbers
        assert used[-1] == Options(steps_per_rev=30)
        assert all(isinstance(own.method, int) for own in used)
    for name in ALPHAS:
        held, expected = (tables(file, f"/points/{name}") for file in (path, whole))
        assert all(held[key] == value for key, value in expected.items() if key.startswith(("results", "histories")))


def test_shares_and_limits_may_be_edited_after_the_run(tmp_path, whole):
    path = tmp_path / "edited.h5"
    shutil.copy(whole, path)
    shared = tuple(point._replace(share=share) for point, share in zip(POINTS, (0.5, 0.3, 0.2), strict=True))
    run(replace(fake(), points=shared, limits={"cross1.F at mid": 600.0}), path)
    with ResultFile.open(path) as store:
        assert [point.share for point in store.points.values()] == [0.5, 0.3, 0.2]
        assert store.view().limits == {"cross1.F at mid": 600.0}
        assert store.view().at("mid").limits == {"cross1.F": 600.0}


def test_a_duty_cycle_has_the_cycles_of_each_point_by_its_share_of_the_revolutions(tmp_path, whole):
    path, times, speeds = tmp_path / "duty.h5", (0.5, 0.3, 0.2), (1.0, -2.0, 4.0)
    points = [p._replace(share=t, operation=p.operation.model_copy(update={"speed": s}))
              for p, t, s in zip(POINTS, times, speeds, strict=True)]  # fmt: skip
    run(fake(tuple(points), joint=fakes.Dump(load("cirelli2021", {}, "test").given("json"))), path)
    with ResultFile.open(path) as store:
        view, chosen = store.view(), ["cross1.F_t", "fork2.T_e"]
        one = load_cycles(view, names=chosen, samples=3)
        each = [load_cycles(part, chosen, samples=3).cycles for part in view.parts]
        several = duty_cycle(each, [0.5 / 1.9, 0.6 / 1.9, 0.8 / 1.9])
        np.testing.assert_array_equal(one.status, view.status[:3])
    assert [name for name, _ in one.duty] == [point.name for point in points]
    np.testing.assert_allclose([share for _, share in one.duty], [0.5 / 1.9, 0.6 / 1.9, 0.8 / 1.9])
    np.testing.assert_array_equal(one.cycles.ranges, several.ranges)
    np.testing.assert_allclose(one.cycles.repeats, several.repeats)
    with (
        ResultFile.open(whole) as store,
        pytest.raises(InputError, match=r"without a share of the time\n.*--point low"),
    ):
        load_cycles(store.view())


def test_what_needs_one_point_asks_for_it(whole):
    with ResultFile.open(whole) as store:
        for ask in (store.results, store.status, lambda: store.histories("loads")):
            with pytest.raises(StoreError, match=r"several operating points: low, mid, high\n.*--point low"):
                ask()
        with pytest.raises(StoreError, match="--point low"):
            replay.replay(store, 3)
        with pytest.raises(InputError, match=r"no operating point 'hihg'\n  hint: did you mean 'high'"):
            store.at("hihg")
        with pytest.raises(InputError, match="no single operating point"):
            store.at("low+mid")
        frame = store.at("mid").to_pandas()
        np.testing.assert_array_equal(frame["operation.alpha"], store.errors()["operation.alpha"][1:])
        np.testing.assert_array_equal(frame["alpha"], 0.4 + store.errors()["operation.alpha"][1:])
        assert repr(store).startswith("<result file 'whole.h5': 39 joints (low: ")


def test_a_duty_cycle_is_one_table(whole):
    with ResultFile.open(whole) as store:
        frame, each = store.to_pandas(), {name: store.at(name).to_pandas() for name in store.points}
    assert frame.columns[0] == "point"
    for name, of_point in each.items():
        found = frame[frame["point"] == name].drop(columns="point")
        pd.testing.assert_frame_equal(found, of_point)
    assert frame.attrs["units"]["point"] == "1"


def test_a_duty_cycle_is_one_labelled_data_set(whole, tmp_path):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    with ResultFile.open(whole) as store:
        store.to_xarray().to_netcdf(tmp_path / "whole.nc", engine="h5netcdf")
        frame, points, errors = store.to_pandas(), store.points, store.errors()
    with xarray.open_dataset(tmp_path / "whole.nc") as data:
        assert dict(data.sizes) == {"point": 3, "row": 39}
        assert data["pin1.tilt_t"].dims == ("row",)
        np.testing.assert_array_equal(data["pin1.tilt_t"], errors["pin1.tilt_t"][1:])
        for name, point in points.items():
            here = data.sel(point=name)
            np.testing.assert_array_equal(here["cross1.F_max"], frame.loc[frame["point"] == name, "cross1.F_max"])
            assert float(here["point_speed"]) == point.operation.speed
        assert data["point_speed"].attrs["units"] == "rad/s"
        assert data.attrs["seed"] == 7
        assert {"title", "version", "date", "study"} <= data.attrs.keys()


def test_groups_of_points_say_their_values(whole):
    with ResultFile.open(whole) as store:
        points, text = store.points, store.study_text
    with h5py.File(whole) as file:
        assert file.attrs["seed"] == 7
        assert file.attrs["study"].decode() == text
        for name, point in points.items():
            own = file[f"points/{name}"].attrs
            assert (own["alpha"], own["alpha_units"].decode()) == (point.operation.alpha, "rad")
            assert own["torque"] == point.operation.torque
            assert ("share" in own) == (not math.isnan(point.share))


STUDY = """
[joint]
base = "cirelli2021"
{operation}
[solver]
fidelity = "quasistatic"
steps_per_rev = 36
[tolerances]
"pin*.offset_[tz]" = {{ plus_minus = "0.05 mm", distribution = "normal", cpk = 1.0 }}
"hole*.tilt_[tz]" = {{ plus_minus = "0.1 deg", distribution = "normal", cpk = 1.0 }}
operation.alpha = {{ std = "0.5 deg", distribution = "normal" }}
operation.speed = {{ plus_minus = "20 rpm", distribution = "uniform" }}
operation.torque = {{ lower = "-10 N*m", upper = "5 N*m", distribution = "triangular" }}
[sampling]
n = 4
method = "random"
[output]
histories = "harmonics"
harmonics = 4
"""
OPERATIONS = {
    "cruise": 'alpha = "10 deg"\nspeed = "500 rpm"\ntorque = "100 N*m"\n',
    "start": 'alpha = "15 deg"\nspeed = "-100 rpm"\ntorque = "200 N*m"\n',
    "idle": 'alpha = "1 deg"\nspeed = "800 rpm"\ntorque = "40 N*m"\n',
}


@pytest.mark.slow
def test_simulated_joints_at_three_points_equal_those_of_three_studies(tmp_path: Path) -> None:
    """Acceptance: toleranced operating point included, with histories and checks; and each replays."""

    def simulated(name, operation):
        (tmp_path / f"{name}.toml").write_text(STUDY.format(operation=operation))
        campaign.run(study.load(tmp_path / f"{name}.toml"), tmp_path / f"{name}.h5", workers=1)
        return tmp_path / f"{name}.h5"

    whole = simulated("all", "".join(f'[[operation]]\nname = "{n}"\n{keys}' for n, keys in OPERATIONS.items()))
    for name, keys in OPERATIONS.items():
        assert tables(whole, f"/points/{name}") == tables(simulated(name, f"[operation]\n{keys}"))
    with ResultFile.open(whole) as store:
        assert not replay.replay(store.at("start"), 2).differences
        assert store.view().study.points == study.load(tmp_path / "all.toml").points


def test_why_joints_have_no_load_is_said_once_for_all_points():
    outside, failed = Status.OUTSIDE_MODEL, Status.NEWTON_FAILED
    reasons = [
        Reason(outside, 5, 2, "check the units", "why", "low"),
        Reason(failed, 4, 6, "failed at step 3", "other", "mid"),
        Reason(outside, 3, 4, "check the units", "why", "high"),
        Reason(failed, 1, 7, "failed at step 9", "other", "low"),
    ]
    first, second = in_words(reasons)
    head, hint = first.splitlines()
    assert head.startswith("5 joints outside_model at low, 3 at high: ")
    assert hint == "  hint, for row 2 at low: check the units"
    head, *hints = second.splitlines()
    assert head.startswith("4 joints newton_failed at mid, 1 at low: ")
    assert hints == ["  hint, for row 6 at mid: failed at step 3", "  hint, for row 7 at low: failed at step 9"]
    (alone,) = in_words([Reason(failed, 1, 7, "failed at step 9", "other")])
    assert alone.startswith("1 joint newton_failed: ")
    assert alone.endswith("\n  hint, for row 7: failed at step 9")
