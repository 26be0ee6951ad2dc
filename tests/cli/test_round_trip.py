"""What `export --csv` writes, `evaluate` takes: the loads of the file come back to the last bit, of every study."""

from __future__ import annotations

import csv
import logging
from pathlib import Path

import numpy as np
import pytest

from tests.support.environment import ROOT
from tolstat.campaign.function import function
from tolstat.campaign.run import run
from tolstat.cli.results import export
from tolstat.cli.simulate import evaluate
from tolstat.common.columns import holds
from tolstat.common.errors import InputError
from tolstat.common.loads import loads_of
from tolstat.common.tables import SIMULATED, STATUS_TEXT, Status
from tolstat.store.result_file import ResultFile
from tolstat.study import load

CASES = {"tilted_pin", "precision"}
"""Files that are no studies."""
STUDIES = sorted(path for path in (ROOT / "studies").rglob("*.toml") if path.stem not in CASES)
ROWS = range(9)


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))[1:]  # without the units


@pytest.mark.slow
@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_loads_come_back(path: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Also of the joint without errors, at each operating point, and of joints with dimensions of their own."""
    caplog.set_level(logging.INFO, "tolstat")
    study = load(path)
    run(study, tmp_path / "a.h5", workers=1, check=False, rows=ROWS)
    loads = [name for name, load in loads_of(study.mechanism).items() if holds(study.columns, load)]
    for point in study.points:
        export(tmp_path / "a.h5", joints=str(tmp_path / "x.csv"), nominal=True, point=point.name or None)
        evaluate(path, errors=tmp_path / "x.csv", out=str(tmp_path / "y.csv"), point=point.name, loads=loads, workers=1)
        with ResultFile.open(tmp_path / "a.h5") as file:
            stored = file.at(point.name).results()
        found = rows_of(tmp_path / "y.csv")
        assert [row["status"] for row in found] == [Status(code).label for code in stored["status"]]
        assert np.isin(stored["status"], SIMULATED).sum() > len(ROWS) / 2
        valid = [i for i, row in enumerate(found) if row["status"] in ("ok", "stationary")]
        for name in loads:
            again = np.array([float(found[i][name]) for i in valid])
            assert again.tobytes() == loads_of(study.mechanism)[name].of(stored)[valid].tobytes(), name
        assert [row["joint"] for row in found] == [f"row {row}" for row in ROWS]
        assert "columns left out: nominal" in caplog.text
        assert ("speed, torque" if study.mechanism.placed else "alpha, speed, torque, axial_force") in caplog.text


@pytest.mark.slow
def test_deviations_of_the_operating_point_are_not_added_twice(tmp_path: Path) -> None:
    """The columns have their own names: the torque of a joint, and its deviation."""
    path = ROOT / "studies" / "fuzz.toml"
    study = load(path)
    run(study, tmp_path / "a.h5", workers=1, check=False, rows=range(3))
    export(tmp_path / "a.h5", joints=str(tmp_path / "x.csv"), nominal=True)
    first, *drawn = rows_of(tmp_path / "x.csv")
    assert {float(first[f"operation.{name}"]) for name in ("alpha", "speed", "torque")} == {0.0}
    for row in [first, *drawn]:
        for name in ("alpha", "speed", "torque", "axial_force"):
            deviation = float(row[f"operation.{name}"])
            assert float(row[name]) == getattr(study.operation, name) + deviation
    assert all(float(row["operation.torque"]) != 0.0 for row in drawn)


def test_a_case_is_no_study(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("pin1.tilt_z\n0.01\n", encoding="utf-8")
    with pytest.raises(InputError, match="tolstat simulate"):
        evaluate(ROOT / "studies" / "tilted_pin.toml", errors=tmp_path / "x.csv", out=str(tmp_path / "y.csv"))
    assert not (tmp_path / "y.csv").exists()


@pytest.mark.slow
def test_columns_that_are_left_out_and_joints_outside_the_model_are_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Degrees without their unit end as a status and a sentence on units, not as loads."""
    caplog.set_level(logging.INFO, "tolstat")
    path = ROOT / "studies" / "iso2768_f.toml"
    names = function(load(path), ["psi"]).names
    cells = ["0.5" if name == "pin1.tilt_t" else "0" for name in names]
    text = ",".join([*names, "part", "status"]) + "\n" + ",".join([*cells, "A7", "ok"]) + "\n"
    (tmp_path / "x.csv").write_text(text, encoding="utf-8")
    evaluate(path, errors=tmp_path / "x.csv", out=str(tmp_path / "y.csv"), loads=["psi"])
    assert rows_of(tmp_path / "y.csv") == [{"joint": "A7", "status": "outside_model", "psi": ""}]
    assert "x.csv: columns left out: 1 of results" in caplog.text
    assert f"1 outside_model: {STATUS_TEXT[Status.OUTSIDE_MODEL]}" in caplog.text
    assert "errors are in m and rad" in caplog.text
    assert "hint: check the units" in caplog.text
