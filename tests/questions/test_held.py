"""Joints with faces, friction and bearings of shafts: what a result file of them says, without a kernel."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tolstat
from tests.support import fakes
from tolstat import study
from tolstat.campaign import run as campaign
from tolstat.common.errors import InputError
from tolstat.common.tables import Simulation, Status, without_results
from tolstat.questions import heat
from tolstat.solver import stationary
from tolstat.store import ResultFile

TEXT = """
[joint]
base = "cirelli2021"
shaft.axial = "free"
shaft.input.bearings = ["80 mm", "240 mm"]
thrust = { end_play = "0.05 mm", k = "1e8 N/m" }
friction = { mu = 0.05, radius = "19 mm" }

[[operation]]
name = "slow"
alpha = "15 deg"
speed = "500 rpm"
torque = "100 N*m"
share = 0.75

[[operation]]
name = "fast"
alpha = "8 deg"
speed = "1500 rpm"
torque = "60 N*m"
share = 0.25

[tolerances]
"thrust.end_play" = { plus_minus = "0.02 mm", distribution = "uniform" }
"friction.mu" = { plus_minus = 0.02, distribution = "uniform" }
"pin*.offset_e" = { plus_minus = "0.05 mm", distribution = "normal", cpk = 1.0 }

[sampling]
n = 40
seed = 1

[limits]
"thrust*.F" = "1 kN"
"loss" = "30 W"
"loss at fast" = "47 W"
"""


def simulate(params, options, mechanism, **kept) -> Simulation:
    """Loss in proportion to friction, torque and speed, 5 W at least; loads of bearings to torque."""
    results = without_results(len(params), Status.OK, mechanism)
    for name in (name for name in results.dtype.names if name.endswith(("_max", "_mean", "_range"))):
        results[name] = 100.0
    of_pin = 0.1 * params["mu"][:, 0] * np.maximum(np.abs(params["torque"] * params["omega"]), 1e3) / 4
    results["loss_max"][:, :4], results["loss_max"][:, 4] = of_pin[:, None], 4 * of_pin
    results["bearing_a_balls_max"] = results["bearing_a_rollers_max"] = 10.0 * params["torque"][:, None]
    results["settled"] = 1
    stationary.fill_intervals(results, mechanism)
    return Simulation(results, {})


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Result file of 40 joints at two operating points."""
    folder = tmp_path_factory.mktemp("held")
    (folder / "held.toml").write_text(TEXT, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        fakes.replace_functions(patch, **fakes.SOLVER | {"simulate_rows": simulate})
        campaign.run(study.load(folder / "held.toml"), folder / "held.h5", 1, check=False)
    return folder / "held.h5"


def test_the_study_of_the_file_has_its_parts(path: Path) -> None:
    with ResultFile.open(path) as store:
        view = store.view()
        assert view.mechanism.name == "cardan+thrust+friction+input_bearings"
        assert view.study.mechanism == view.mechanism
        assert {"thrust.end_play", "friction.mu"} <= view.study.tolerances.keys()
        assert view.load("thrust3.F").limit == 1000.0


def test_a_limit_at_one_point_is_compared(path: Path) -> None:
    with ResultFile.open(path) as store:
        rows = tolstat.compare(store.view(), store.view()).frame("shares").set_index("load")
        with pytest.raises(InputError, match=r"'los at fast' is not a load .*\n.*did you mean 'loss'"):
            tolstat.compare(store.view(), store.view(), ["los at fast"])
        mu = 0.05 + store.errors()["friction.mu"][1:]
    share = np.mean(0.1 * mu * 60 * 1500 * np.pi / 30 > 47.0)
    assert rows.loc["loss at fast", ["level", "a", "b"]].tolist() == [47.0, share, share]


def test_heat_is_the_loss_and_what_it_leaves_of_the_power(path: Path) -> None:
    """Of the stand-in a share 0.1 mu of torque times speed, so that the efficiency is 1/(1 + 0.1 mu)."""
    with ResultFile.open(path) as store:
        rows = tolstat.heat(store.view()).frame("heat").set_index(["point", "of"])
        mu = np.sort(0.05 + store.errors()["friction.mu"][1:])
    power = {"slow": 100 * 500 * np.pi / 30, "fast": 60 * 1500 * np.pi / 30}
    for point, own in power.items():
        loss, efficiency = rows.loc[point, "loss of all bearings"], rows.loc[point, "efficiency"]
        assert loss["nominal"] == pytest.approx(0.005 * own)
        assert loss["median"] == pytest.approx(0.1 * mu[19] * own, rel=1e-9)
        assert rows.loc[point, "loss of the bearing of pin2"]["nominal"] == pytest.approx(0.00125 * own)
        assert efficiency["nominal"] == pytest.approx(1 / 1.005)
        assert efficiency["median"] == pytest.approx(np.median(1 / (1 + 0.1 * mu)), rel=1e-9)
        assert efficiency["bound"] <= efficiency["median"]


@pytest.mark.parametrize(
    ("torque", "speed", "expected"),
    [("-100", "500", 0.995), ("100", "-500", 0.995), ("-0.01", "500", 0.0), ("0", "500", np.nan)],
)
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_an_output_shaft_that_drives_loses_the_loss_of_its_power(
    tmp_path: Path, torque: str, speed: str, expected: float
) -> None:
    """A loss of 5 W leaves nothing of 0.5 W; without torque there is no efficiency."""
    text = TEXT.replace('torque = "100', f'torque = "{torque}').replace('speed = "500', f'speed = "{speed}')
    (tmp_path / "a.toml").write_text(text, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        fakes.replace_functions(patch, **fakes.SOLVER | {"simulate_rows": simulate})
        campaign.run(study.load(tmp_path / "a.toml"), tmp_path / "a.h5", 1, check=False)
    with ResultFile.open(tmp_path / "a.h5") as store:
        row = tolstat.heat(store.view()).frame("heat").set_index(["point", "of"]).loc["slow", "efficiency"]
    assert row["nominal"] == pytest.approx(expected, nan_ok=True)
    assert row["median"] == pytest.approx(expected, abs=3e-3, nan_ok=True)
    cells = [column.cell(row) for column in heat.COLUMNS[2:]]
    assert cells == ["-"] * 3 if np.isnan(expected) else "%" in cells[0]


def test_equivalent_loads_are_means_over_the_revolutions_of_the_duty_cycle(path: Path) -> None:
    turns = np.array([0.75 * 500, 0.25 * 1500])
    with ResultFile.open(path) as store:
        rows = tolstat.orders(store.view()).frame("bearings").set_index("load")
    for rolling, p in {"balls": 3.0, "rollers": 10 / 3}.items():
        expected = (turns / turns.sum() @ np.array([1000.0, 600.0]) ** p) ** (1 / p)
        row = rows.loc[f"input.bearing_a_{rolling}"]
        assert row["nominal"] == pytest.approx(expected)
        assert row["qmedian"] == pytest.approx(expected)


def test_a_joint_with_faces_is_drawn(path: Path) -> None:
    with ResultFile.open(path) as store:
        study, errors = store.view().study, store.errors()[3:4]
    assert tolstat.draw_row(study.joint, study.operation, errors, "one").axes
