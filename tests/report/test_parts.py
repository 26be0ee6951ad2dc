"""Joints one by one: which are beyond which limits, and what a table shows of them."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from tests.support.environment import ROOT
from tolstat.campaign.run import run
from tolstat.cli.simulate import evaluate, simulate
from tolstat.common.cardan import CARDAN
from tolstat.common.tables import Status
from tolstat.display.answer import Answer
from tolstat.report.answer import report
from tolstat.report.parts import lives, names_of, parts
from tolstat.store import ResultFile
from tolstat.study import Study, load

HEAD = """
[joint]
base = "cirelli2021"
bearing = { C = "30 kN", needles = 32, needle_diameter = "4 mm", pitch_diameter = "42 mm", required_life = "5000 h" }
[operation]
alpha = "15 deg"
speed = "500 rpm"
torque = "100 N*m"
"""
LIMITS = '[limits]\n"cross[12].F" = "640 N"\n'
DRAWN = """
[tolerances]
"pin*.position" = { zone = "⌀0.1 mm", over = "22 mm", distribution = "normal", cp = 1.0 }
[sampling]
n = 64
"""
CASES = '[sampling]\nmethod = "cases"\n[[case]]\nname = "A7"\nfile = "cross.csv"\n'
OK, FAILED = Status.OK, Status.NEWTON_FAILED
LIFE = 1e6 * 10 ** (10 / 3) / (1000 * 60 * 4 * 30 / 360)
"""Life of a bearing, h: 1e6 (C/P)^(10/3) turns at 4 alpha/360 deg a revolution; C/P = 10, 30 deg, 1000 rpm."""


def study_of(folder: Path, text: str = HEAD + LIMITS + DRAWN) -> Study:
    (folder / "study.toml").write_text(text, encoding="utf-8")
    return load(folder / "study.toml")


def turning(loads: list[float]) -> dict[str, np.ndarray]:
    """Joints at 30 deg and -1000 rpm, each with one equivalent load of all its bearings, N."""
    n = len(loads)
    turned = {"alpha": np.full((n, 1), np.radians(30.0)), "omega": np.full(n, -1000 * np.pi / 30)}
    return turned | {"equivalent_load": np.tile(np.array(loads)[:, None], 4)}


def shown(study: Study, loads: list[float], of_bearings: list[float], status: list[Status]) -> Answer:
    """Answer on joints A, B … with loads of cross1 and along the shaft, and equivalent loads of their bearings."""
    of = {"cross1.F": np.array(loads), "input.axial": np.full(len(loads), 7.0)}
    labels = list("ABCDEF"[: len(loads)])
    return Answer("x", "x", parts(study, of, turning(of_bearings), labels, np.array(status, np.uint8)))


def cells(answer: Answer) -> list[list[str]]:
    table = answer.tables["joints"]
    heads = [column.head for column in table.columns]
    return [heads, *([column.cell(row) for column in table.columns] for row in table.for_people)]


def test_joints_beyond_limits(tmp_path: Path) -> None:
    """A is above its limit, B has too short a life, C has no result."""
    answer = shown(study_of(tmp_path), [700.0, 600.0, 600.0], [300.0, 30e3, 300.0], [OK, OK, FAILED])
    (told,) = answer.values()["sentences"]
    assert told["text"] == (
        "Beyond a limit: 2 of 3 joints: B (life of all four), A (cross1.F); 1 without a valid load or a rating: C."
    )
    first, *rows = cells(answer)
    assert first == ["load or life", "limit", "A", "B", "C"]
    assert rows[0] == ["cross1.F", "640 N", "700 N above", "600 N", "-"]
    assert rows[1] == ["input.axial", "-", "7 N", "7 N", "-"]
    assert rows[-1][:2] == ["life of all four", "5000 h"]
    assert rows[-1][3].endswith(" h short")
    assert rows[-1][4] == "-"
    long = answer.tables["joints"].rows
    assert long[1] == {"joint": "B", "quantity": "cross1.F", "unit": "N", "limit": 640.0, "value": 600.0}
    assert len(long) == 3 * 7


def test_of_many_joints_those_nearest_to_a_limit_stand_side_by_side(tmp_path: Path) -> None:
    loads = [600.0, 710.0, 630.0, 720.0, 500.0, 700.0]
    answer = shown(study_of(tmp_path), loads, [300.0] * 6, [OK] * 6)
    (told,) = answer.values()["sentences"]
    assert told["text"] == "Beyond a limit: 3 of 6 joints: D (cross1.F), B (cross1.F), F (cross1.F)."
    assert cells(answer)[0][2:] == ["D", "B", "F"]
    assert answer.tables["joints"].title == "Loads and lives of 3 of 6 joints, nearest to a limit first"
    assert len(answer.tables["joints"].rows) == 6 * 7
    more = shown(study_of(tmp_path), [700.0] * 5, [300.0] * 5, [OK] * 5).values()["sentences"][0]["text"]
    assert more == "Beyond a limit: 5 of 5 joints: A (cross1.F), B (cross1.F), C (cross1.F) and others."
    keep = shown(study_of(tmp_path), [640.0] * 5, [300.0] * 5, [OK] * 5).values()["sentences"][0]["text"]
    assert keep == "Beyond a limit: none of 5 joints."


def test_without_limits_and_lives_there_is_no_table(tmp_path: Path) -> None:
    bare = HEAD.replace("bearing", "#")
    assert not shown(study_of(tmp_path, bare + DRAWN), [700.0], [300.0], [OK]).parts
    assert shown(study_of(tmp_path, bare + LIMITS + DRAWN), [700.0], [300.0], [OK]).parts


def test_the_life_of_a_bearing_by_hand(tmp_path: Path) -> None:
    """That of the joint is 4^(-8/9) of that of its four bearings."""
    found = lives(study_of(tmp_path), turning([3000.0]))
    assert list(found) == [*(f"life of pin{i}" for i in (1, 2, 3, 4)), "life of all four"]
    assert found["life of pin1"] == pytest.approx(LIFE)
    assert found["life of all four"] == pytest.approx(LIFE * 4 ** (-8 / 9))


def test_a_drive_shaft_has_lives_of_its_joints_and_of_the_whole() -> None:
    study = load(ROOT / "studies" / "shaft.toml")
    turning = {"equivalent_load": np.full((2, 8), 6000.0), "omega": np.full(2, 157.0), "alpha": np.full((2, 2), 0.3)}
    found = lives(study, turning)
    assert list(found)[7:] == [
        "life of joint2.pin4",
        "life of all of joint1",
        "life of all of joint2",
        "life of all eight",
    ]
    of_pin = found["life of joint1.pin1"]
    assert found["life of all of joint1"] == pytest.approx(4 ** (-8 / 9) * of_pin, rel=1e-12)
    assert found["life of all eight"] == pytest.approx(8 ** (-8 / 9) * of_pin, rel=1e-12)


def test_loads_with_limits_stand_before_those_of_the_shafts() -> None:
    names = names_of({"cross1.F": 1.0, "input.axial": 2.0}, CARDAN)
    assert names[:2] == ["cross1.F", "input.axial"]
    assert names.count("input.axial") == 1
    assert set(names[2:]) == {"input.lateral", "input.moment", "output.axial", "output.lateral", "output.moment"}


@pytest.mark.slow
def test_a_case_evaluate_and_simulate_agree(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A measured joint has the same loads and lives by each way; zones of the study do not matter."""
    (tmp_path / "cross.csv").write_text("part;pin1.tilt_z;pin1.offset_t\n;deg;mm\nA7;0,21;0,03\n", encoding="utf-8")
    for name, text in (("drawn", HEAD + LIMITS + DRAWN), ("cases", HEAD + LIMITS + CASES), ("case", HEAD + LIMITS)):
        (tmp_path / f"{name}.toml").write_text(text, encoding="utf-8")
    run(load(tmp_path / "cases.toml"), tmp_path / "a.h5", workers=1)
    with ResultFile.open(tmp_path / "a.h5") as file:
        answer = report(file.view())
    values = {row["quantity"]: row["value"] for row in answer.tables["joints"].rows if row["joint"] == "A7"}
    assert {"cross1.F", "cross2.F", "output.moment", "life of pin1", "life of all four"} <= values.keys()
    table = tmp_path / "cross.csv"
    evaluate(tmp_path / "drawn.toml", errors=table, out=str(tmp_path / "y.csv"))
    printed = capsys.readouterr().out
    assert printed.startswith("Beyond a limit: ")
    assert f"{values['life of all four']:.4g} h" in printed
    with (tmp_path / "y.csv").open(encoding="utf-8") as stream:
        _, row = csv.DictReader(stream)
    assert row["joint"] == "A7"
    for name in ("cross1.F", "cross2.F", "life of pin1", "life of all four"):
        assert float(row[name]) == values[name]
    simulate(tmp_path / "case.toml", table=table, as_json=True)
    told = json.loads(capsys.readouterr().out)
    assert told["max"]["cross1.F"]["joint"] == values["cross1.F"]
    of_joint = {
        row["quantity"]: row["value"] for row in told["tables"]["joints"]["rows"] if row["joint"] == "this joint"
    }
    assert of_joint == values
    assert values["cross1.F"] != told["max"]["cross1.F"]["without_errors"]
