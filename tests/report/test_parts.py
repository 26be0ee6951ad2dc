"""Joints one by one: which are beyond which limits, and what a table shows of them."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from tolstat import joint
from tolstat.campaign.run import run
from tolstat.cli.simulate import evaluate, simulate
from tolstat.common.cardan import CARDAN
from tolstat.display.answer import Sentence, Table
from tolstat.report.answer import report
from tolstat.report.parts import Quantity, lives, names_of, parts
from tolstat.store import ResultFile
from tolstat.study import load

NAN = np.nan
FOUND = [
    Quantity("cross1.F", "N", 1000.0, np.array([900.0, 1100.0, NAN])),
    Quantity("input.axial", "N", NAN, np.array([5.0, 7.0, NAN])),
    Quantity("life of all four", "h", 5000.0, np.array([4000.0, np.inf, NAN]), True),
]


def shown(labels: list[str], found: list[Quantity]) -> tuple[str, list[list[str]], Table]:
    sentence, table = parts(found, labels)
    assert isinstance(sentence, Sentence)
    assert isinstance(table, Table)
    cells = [[column.cell(row) for column in table.columns] for row in table.for_people]
    return sentence.text, [[column.head for column in table.columns], *cells], table


def test_few_joints_stand_side_by_side() -> None:
    text, cells, table = shown(["A", "B", "C"], FOUND)
    told = "A (life of all four), B (cross1.F)"
    assert text == f"Beyond a limit: 2 of 3 joints: {told}; 1 without a valid result."
    assert cells == [
        ["load or life", "limit", "A", "B", "C"],
        ["cross1.F", "1000 N", "900 N", "1100 N above", "-"],
        ["input.axial", "-", "5 N", "7 N", "-"],
        ["life of all four", "5000 h", "4000 h short", "no limit", "-"],
    ]
    assert len(table.rows) == 9
    assert table.rows[1] == {
        "joint": "B",
        "quantity": "cross1.F",
        "unit": "N",
        "limit": 1000.0,
        "value": 1100.0,
        "beyond": True,
    }


def test_of_many_joints_the_worst_is_shown() -> None:
    few = [Quantity(q.name, q.unit, q.limit, np.tile(q.values, 2), q.is_life) for q in FOUND]
    text, cells, _ = shown(list("ABCDEF"), few)
    assert text.startswith("Beyond a limit: 4 of 6 joints: A (life of all four), B (cross1.F)")
    assert cells[1:] == [
        ["cross1.F", "1000 N", "1100 N above", "B", "2 of 4"],
        ["input.axial", "-", "7 N", "B", ""],
        ["life of all four", "5000 h", "4000 h short", "A", "2 of 4"],
    ]
    none = [Quantity("psi", "1", 1.0, np.full(6, NAN))]
    assert shown(list("ABCDEF"), none)[1][1] == ["psi", "1", "-", "-", "0 of 0"]


def test_joints_that_keep_all_limits() -> None:
    text, _, _ = shown(["A", "B"], [Quantity("psi", "1", 1.0, np.array([0.5, 1.0]))])
    assert text == "Beyond a limit: none of 2 joints."


BEARING = {"C": "30 kN", "needles": 32, "needle_diameter": "4 mm", "pitch_diameter": "42 mm", "required_life": "2 h"}


def test_the_life_of_a_bearing_by_hand() -> None:
    """1e6 (C/P)^(10/3) turns at 4 alpha/360 deg a revolution: C/P = 10, 30 deg, 1000 rpm; the joint 4^(-8/9) of it."""
    of = joint.load("cirelli2021", {"bearing": BEARING}, "study.toml").bearing
    turning = {"equivalent_load": np.full((1, 4), 3000.0), "alpha": np.radians([[30.0]])}
    found = lives(of, turning | {"omega": np.array([-1000 * np.pi / 30])})
    hours = 1e6 * 10 ** (10 / 3) / (1000 * 60 * 4 * 30 / 360)
    assert [life.name for life in found] == [*(f"life of pin{i}" for i in (1, 2, 3, 4)), "life of all four"]
    assert found[0].values[0] == pytest.approx(hours)
    assert found[4].values[0] == pytest.approx(hours * 4 ** (-8 / 9))
    assert (found[4].limit, found[4].is_life) == (2.0, True)
    assert lives(None, turning) == []


def test_loads_with_limits_stand_before_those_of_the_shafts() -> None:
    names = names_of({"cross1.F": 1.0, "input.axial": 2.0}, CARDAN)
    assert names[:2] == ["cross1.F", "input.axial"]
    assert names.count("input.axial") == 1
    assert set(names[2:]) == {"input.lateral", "input.moment", "output.axial", "output.lateral", "output.moment"}


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


@pytest.mark.slow
def test_a_case_evaluate_and_simulate_agree(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A measured joint has the same loads and lives by each way; zones of the study do not matter."""
    (tmp_path / "cross.csv").write_text("pin1.tilt_z;pin1.offset_t\ndeg;mm\n0,21;0,03\n", encoding="utf-8")
    for name, text in (("drawn", HEAD + LIMITS + DRAWN), ("cases", HEAD + LIMITS + CASES), ("case", HEAD)):
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
    assert [float(row[name]) for name in ("cross1.F", "cross2.F")] == [values["cross1.F"], values["cross2.F"]]
    simulate(tmp_path / "case.toml", table=table, as_json=True)
    told = json.loads(capsys.readouterr().out)
    assert told["max"]["cross1.F"]["joint"] == values["cross1.F"]
    assert told["life of all four [h]"] == pytest.approx(values["life of all four"], rel=1e-3)
    assert values["cross1.F"] != told["max"]["cross1.F"]["without_errors"]


def test_a_list_without_limits_and_lives_has_no_such_table(tmp_path: Path) -> None:
    text = HEAD.replace('required_life = "5000 h"', "").replace("bearing", "#") + CASES.replace("file", "#")
    text += 'errors."pin1.tilt_z" = "0.1 deg"\n[solver]\nfidelity = "ideal"\n'
    (tmp_path / "cases.toml").write_text(text, encoding="utf-8")
    run(load(tmp_path / "cases.toml"), tmp_path / "a.h5", workers=1, check=False)
    with ResultFile.open(tmp_path / "a.h5") as file:
        assert "joints" not in report(file.view()).tables
