"""Studies of a drive shaft that `tolstat new` writes, and the table of crosses of catalogue size."""

from __future__ import annotations

import math
import re
import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.study.test_schema import faults
from tests.support.environment import ROOT
from tolstat import study
from tolstat.cli import app
from tolstat.common.errors import InputError
from tolstat.joint.bearing import FOR_LIFE
from tolstat.study import cross_sizes, starter

SIZES = [row.size for row in cross_sizes.crosses()]
PTO = 2.0 * math.pi * 540.0 / 60.0
"""Speed of the powers in the table, rad/s."""


def tabulated_factor(row: cross_sizes.Cross) -> float:
    """Factor f_c of ISO 281:2007, table 7, between its values."""
    ratios = [0.10, 0.12, 0.14, 0.16]
    values = [84.2, 86.4, 87.7, 88.5]
    ratio = row.needle_diameter_mm / (row.pin_mm + row.needle_diameter_mm)
    after = next(index for index, value in enumerate(ratios) if value > ratio)
    share = (ratio - ratios[after - 1]) / (ratios[after] - ratios[after - 1])
    return values[after - 1] + share * (values[after] - values[after - 1])


@pytest.mark.parametrize("row", cross_sizes.crosses(), ids=SIZES)
def test_what_no_source_gives_follows_from_the_formulas_of_the_table(row: cross_sizes.Cross) -> None:
    assert row.size == f"{row.cup_mm:g} x {row.length_mm:g}"
    assert row.pin_mm == pytest.approx(0.62 * row.cup_mm, abs=0.051)
    assert (row.needle_diameter_mm, row.needle_length_mm) == (round(0.18 * row.cup_mm) / 2, 0.5 * row.cup_mm)
    pitch = row.pin_mm + row.needle_diameter_mm
    assert row.needles == math.floor(math.pi / math.asin(row.needle_diameter_mm / pitch))
    sizes = row.needle_length_mm ** (7 / 9) * row.needles**0.75 * row.needle_diameter_mm ** (29 / 27)
    assert pytest.approx(1e-3 * tabulated_factor(row) * sizes, rel=5e-3) == row.C_kN
    assert 0.4 < row.pin_force_kN / row.C_kN < 0.6
    if power := re.search(r"([\d.]+) hp", row.source):
        assert pytest.approx(float(power[1]) * 745.7 / PTO, abs=0.5) == row.torque_Nm
    computed = {"pin", "needles", "C"} | ({"torque"} if "length, torque" not in row.source else set())
    assert set(row.computed.split(", ")) == computed


def test_the_same_cup_bears_the_same_force() -> None:
    short, long = cross_sizes.cross("27 x 74.6"), cross_sizes.cross("27 x 81.8")
    assert short.pin_force_kN == pytest.approx(long.pin_force_kN, rel=1e-3)


@pytest.mark.parametrize("size", [None, *SIZES])
def test_a_new_shaft_is_a_study_without_warnings(tmp_path: Path, size: str | None) -> None:
    written = starter.write_shaft(tmp_path / "truck.toml", size)
    names = ["truck.toml", "truck_joint.toml", "study.schema.json", "joint.schema.json"]
    assert [path.name for path in written] == ([names[0], names[2]] if size is None else names)
    loaded = study.load(written[0])
    assert list(loaded.joint.warnings()) == []
    assert (loaded.rows, len(loaded.limits), len(loaded.points)) == (257, 21, 3)
    for path in (path for path in written if path.suffix == ".toml"):
        text = path.read_text(encoding="utf-8")
        assert faults("study" if path == written[0] else "joint", text) == []
        assert max(map(len, text.splitlines())) <= 130
        assert "$" not in text
    if size is not None:
        row, joint = cross_sizes.cross(size), loaded.joint
        assert joint.bearing is not None
        assert joint.bearing.lacking(FOR_LIFE) == []
        assert joint.cross.R + 0.5 * joint.contact.z == pytest.approx(
            1e-3 * (0.5 * row.length_mm - 0.1 * row.cup_mm), abs=1e-4
        )
        assert max(point.operation.torque for point in loaded.points) == pytest.approx(row.torque_Nm)
        assert row.source in written[1].read_text(encoding="utf-8")


@pytest.mark.parametrize("size", ["27x81.8", "27 X 81,8 mm", "27 mm × 81.8 mm"])
def test_a_size_may_be_written_in_several_ways(size: str) -> None:
    assert cross_sizes.cross(size).size == "27 x 81.8"


def test_an_unknown_size_is_refused_with_those_that_are_known(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no cross of '27 x 82' is in the table") as caught:
        starter.write_shaft(tmp_path / "truck.toml", "27 x 82")
    assert all(size in str(caught.value) for size in SIZES)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (["--size", "27 x 70"], ["--size: is the size of the crosses", "give --shaft, too"]),
        (["--shaft", "--joint", "own"], ["--shaft: cannot be used together with --joint"]),
        (
            ["--shaft", "--signal", "a.csv", "--joint", "own"],
            ["--joint: cannot be used", "--shaft: cannot be used together with --joint and --signal"],
        ),
    ],
)
def test_options_that_do_not_go_together_are_one_message(
    tmp_path: Path, options: list[str], expected: list[str]
) -> None:
    done = CliRunner().invoke(app, ["new", str(tmp_path / "truck"), *options])
    assert done.exit_code == 2
    assert done.stderr.count("error: ") == 1
    assert all(text in done.stderr for text in expected)
    assert list(tmp_path.iterdir()) == []


def test_the_wheel_has_all_tables() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    included = project["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
    for path in (ROOT / "data").glob("*.csv"):
        assert included[f"data/{path.name}"] == f"tolstat/data/{path.name}"


@pytest.mark.slow
def test_a_new_shaft_runs_as_it_stands(tmp_path: Path) -> None:
    path = starter.write_shaft(tmp_path / "truck.toml", "27 x 81.8")[0]
    done = CliRunner().invoke(app, ["plan", str(path), "--n", "4", "--pilot", "4"])
    assert done.exit_code == 0, done.stderr
    assert "0 failed, 0 not settled" in done.stdout
