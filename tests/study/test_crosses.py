"""Measured joints: tables with the columns that were measured, and cases of a study that name one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tolstat import study
from tolstat.common.cardan import CARDAN
from tolstat.common.error_fields import error_units
from tolstat.common.errors import InputError
from tolstat.study import crosses

UNITS = error_units(CARDAN)
CROSS = "part;pin1.tilt_z;pin1.offset_t;pin1.contact_outer_max\n-;deg;mm;N\nA7;0,21;0,03;700\n"


def table(folder: Path, text: str) -> Path:
    path = folder / "cross.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_columns_that_are_there_are_read_and_the_others_counted_once(tmp_path: Path) -> None:
    path = table(tmp_path, CROSS)
    columns, labels, named, notes = crosses.read(path, CARDAN, UNITS, {})
    assert (labels, named) == (["A7"], "part")
    assert columns.keys() == {"pin1.tilt_z", "pin1.offset_t"}
    np.testing.assert_allclose(columns["pin1.tilt_z"], np.radians([0.21]), rtol=1e-15)
    np.testing.assert_allclose(columns["pin1.offset_t"], [3e-5], rtol=1e-15)
    assert notes == [
        f"{path}: columns left out: 1 of results",
        f"{path}: 46 errors not measured: taken as nominal",
    ]


@pytest.mark.parametrize(
    ("text", "labels", "named"),
    [
        ("grade,Name,pin1.tilt_z\n1,A7,0\n1,B8,0\n", ["A7", "B8"], "Name"),
        ("row,pin1.tilt_z\n4,0\n7,0\n", ["row 4", "row 7"], "row"),
        ("part,pin1.tilt_z\nA,0\n,0\nA,0\n", ["A (line 2)", "line 3", "A (line 4)"], "part"),
        ("pin1.tilt_z,grade\n0,1\n0,2\n", ["line 2", "line 3"], ""),
    ],
)
def test_joints_are_called_by_the_column_that_names_them(
    tmp_path: Path, text: str, labels: list[str], named: str
) -> None:
    found = crosses.read(table(tmp_path, text), CARDAN, UNITS, {})
    assert (found.labels, found.named) == (labels, named)
    assert not any(named and named in note for note in found.notes)


def test_errors_that_the_study_gives_are_told_from_nominal_ones(tmp_path: Path) -> None:
    given = {"pin4.tilt_z": 0.01, "pin1.tilt_z": 0.01}
    notes = crosses.read(table(tmp_path, CROSS), CARDAN, UNITS, given).notes
    assert notes[-1].endswith("46 errors not measured: taken as nominal, but for 1 of [errors]")


def test_where_some_columns_have_units_all_need_them(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"cross.csv:1: pin1.offset_t: has no unit"):
        crosses.read(table(tmp_path, "pin1.offset_t;pin1.tilt_z [deg]\n0,005;0,21\n"), CARDAN, UNITS, {})
    columns = crosses.read(table(tmp_path, "pin1.offset_t;pin1.tilt_z\n0,005;0,21\n"), CARDAN, UNITS, {}, ()).columns
    assert columns["pin1.tilt_z"] == [0.21]


def test_of_one_joint_the_errors_of_its_parts_are_counted(tmp_path: Path) -> None:
    """Four pins and four holes have five positions and angles and a diameter each; a clearance stands for diameters."""
    _, notes = crosses.of_one(table(tmp_path, CROSS), CARDAN, {})
    assert notes[-1].endswith("46 errors not measured: taken as nominal")
    errors, notes = crosses.of_one(table(tmp_path, "pin1.clearance [um],grade\n5,2\n"), CARDAN, {})
    assert errors == {"pin1.clearance": pytest.approx(5e-6)}
    assert notes[0].endswith("columns left out: grade")
    assert notes[-1].endswith("46 errors not measured: taken as nominal")


REFUSED = {
    "names that are no errors": (
        "pin1.tilt_x,pin1.position,hole9.tilt_t,PIN2.tilt_t,pin1.tilt_z [deg],p.no\n1,2,3,4,5,6\n",
        r"cross.csv:1: has columns that are no errors: 'pin1.tilt_x', 'pin1.position', 'hole9.tilt_t', 'PIN2.tilt_t'\n"
        r".*remove or rename them: did you mean 'pin1.tilt_z'\?; give pin1.offset_t, .*; write 'pin2.tilt_t' for 'PIN2",
    ),
    "a pattern": (
        "hole*.tilt_z,pin1.tilt_z [deg]\n1,2\n",
        r"no errors: 'hole\*.tilt_z'\n.*give a column for each of hole1.tilt_z, .*, hole4.tilt_z$",
    ),
    "another separator": ("pin1-tilt_z,pin1.tilt_t [deg]\n1,2\n", r"write 'pin1.tilt_z' for 'pin1-tilt_z'"),
    "other places of the words": ("tilt z Pin 1,pin1.tilt_t [deg]\n1,2\n", r"write 'pin1.tilt_z' for 'tilt z Pin 1'"),
    "a unit without brackets": (
        "pin1.tilt_z / deg,pin1.tilt_t [deg]\n1,2\n",
        r"write 'pin1.tilt_z' for 'pin1.tilt_z / deg', and a unit in brackets",
    ),
    "a typing error": ("pin1tlt_z,pin1.tilt_t [deg]\n1,2\n", r"no errors: 'pin1tlt_z'\n.*did you mean 'pin1.tilt_z'\?"),
    "an empty cell": (
        "pin1.tilt_z [deg],pin1.tilt_t (deg)\n,−0.1\n",
        r"cross.csv:2: pin1.tilt_z: has no number: the cell is empty",
    ),
    "a zone": (
        "pin1.position,pin1.tilt_z [deg]\n1,2\n",
        r"no errors: 'pin1.position'\n.*give pin1.offset_t, pin1.offset_z, pin1.tilt_t, pin1.tilt_z$",
    ),
    "clearance beside diameter": (
        "pin1.diameter [um],hole4.diameter [um],pin2.clearance [um],pin1.clearance [um]\n1,0,3,2\n",
        r"cross.csv:1: pin1.clearance: is given beside pin1.diameter\n.*remove one or the other",
    ),
    "no unit": ("pin1.tilt_z\n0.1\n", r"cross.csv:1: pin1.tilt_z: has no unit\n.*header: pin1.tilt_z \[deg\]"),
    "nothing measured": (
        "part,torque\n1,2\n",
        r"has no column of an error\n.*write names such as pin1.offset_e; there are part, torque",
    ),
    "several joints": ("pin1.tilt_z [deg]\n0.1\n0.2\n", r"cross.csv:3: is a second joint\n.*tolstat evaluate STUDY"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_faults_of_a_table(tmp_path: Path, name: str) -> None:
    text, words = REFUSED[name]
    with pytest.raises(InputError, match=words) as caught:
        crosses.read(table(tmp_path, text), CARDAN, UNITS, {}, single=True)
    assert len(caught.value.faults) == 1


CASES = """
[joint]
base = "cirelli2021"
[operation]
alpha = "5 deg"
speed = "500 rpm"
torque = "100 N*m"
[[case]]
name = "A7"  # of the first lot
file = "cross.csv"
[[case]]
name = "tilt"
errors."pin1.tilt_z" = "0.21 deg"
[sampling]
method = "cases"
[limits]
"cross*.F" = "700 N"
"""


def load(folder: Path, text: str = CASES) -> study.Study:
    (folder / "cases.toml").write_text(text, encoding="utf-8")
    return study.load(folder / "cases.toml")


def test_a_case_has_the_errors_of_its_file(tmp_path: Path) -> None:
    """The study that a result file holds needs the table no longer; another table is another study."""
    path = table(tmp_path, CROSS)
    s = load(tmp_path)
    assert s.listed is not None
    assert s.listed.cases["A7"] == {"pin1.tilt_z": np.radians(0.21), "pin1.offset_t": pytest.approx(3e-5)}
    assert s.notes[-1] == f"{path}: 46 errors not measured: taken as nominal"
    assert s.limits["cross1.F"] == 700.0
    assert "cross.csv" not in s.text
    assert "# of the first lot" in s.text
    again = study.load(tmp_path / "elsewhere" / "cases.toml", text=s.text)
    assert again.identity() == s.identity()
    table(tmp_path, CROSS.replace("0,03", "0,04"))
    changed = load(tmp_path).identity()
    assert [key for key in changed if changed[key] != s.identity()[key]] == ["case.A7.pin1.offset_t"]


def test_faults_of_a_case_with_a_file(tmp_path: Path) -> None:
    table(tmp_path, CROSS.replace("0,21", "x"))
    text = CASES.replace('errors."pin1', 'file = "b.csv"\nerrors."pin1') + '[[case]]\nname = "c"\n'
    with pytest.raises(InputError) as caught:
        load(tmp_path, text)
    told = str(caught.value)
    assert "cross.csv:3: pin1.tilt_z: 'x' is no finite number" in told
    assert "case[1]: has errors beside file\n  hint: remove one of the two" in told
    assert 'case[2]: has neither errors nor file\n  hint: give errors = { ... }, or file = "cross.csv"' in told
    with pytest.raises(InputError, match=r"missing.csv"):
        load(tmp_path, CASES.replace('"cross.csv"', '"missing.csv"'))
