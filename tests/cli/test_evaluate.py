"""Tables of errors that another program gives: units, columns, and all faults of a file at once."""

import numpy as np
import pytest

from tolstat.cli.simulate import MAX_FAULTS, read_table
from tolstat.common.errors import InputError

NAMES = ["pin1.tilt_t", "pin1.offset_t", "material.E_factor"]
UNITS = {"pin1.tilt_t": "rad", "pin1.tilt_z": "rad", "pin1.offset_t": "m", "material.E_factor": "1"}


def table(tmp_path, text):
    (tmp_path / "x.csv").write_text(text, encoding="utf-8")
    return read_table(tmp_path / "x.csv", NAMES, UNITS)


def test_columns_in_any_order_and_units(tmp_path):
    si, others = table(tmp_path, "part,material.E_factor,pin1.tilt_t,pin1.offset_t\nA,1.1,0.25,1e-5\n")
    assert {name: values.tolist() for name, values in si.items()} == {
        "pin1.tilt_t": [0.25],
        "pin1.offset_t": [1e-5],
        "material.E_factor": [1.1],
    }
    assert others == ["part"]
    head = "pin1.offset_t, pin1.tilt_t ,material.E_factor,row\num,deg,,1\n"
    units, others = table(tmp_path, f"{head}\n10,180,1,7\n20,90,2,8\n")
    found = [units[name] for name in NAMES]
    np.testing.assert_allclose(found, [[np.pi, np.pi / 2], [1e-5, 2e-5], [1.0, 2.0]], rtol=1e-15)
    assert others == ["row"]


def test_faults_come_at_once_with_their_lines(tmp_path):
    text = "pin1.tilt_t,pin1.offset_t,pin1.offset_t\nN,mm,mm\n0.1,x,1\n1,2\n\nnan,1,1\n"
    with pytest.raises(InputError) as caught:
        table(tmp_path, text)
    expected = [
        ("x.csv:1", "more than one column 'pin1.offset_t'"),
        ("x.csv:1", "no column 'material.E_factor'"),
        ("x.csv:4", "has 2 cells, the first line 3"),
        ("x.csv:2: pin1.tilt_t", "'N' is no unit of it"),
        ("x.csv:3: pin1.offset_t", "'x' is no finite number"),
        ("x.csv:6: pin1.tilt_t", "'nan' is no finite number"),
    ]
    assert [(f.place.removeprefix(f"{tmp_path}/"), f.found) for f in caught.value.faults] == expected


@pytest.mark.parametrize("text", ["", "pin1.tilt_t,pin1.offset_t,material.E_factor\n"])
def test_a_file_without_joints(tmp_path, text):
    with pytest.raises(InputError, match="no column" if not text else "has no joints"):
        table(tmp_path, text)


def test_a_long_list_of_faults_is_cut(tmp_path):
    head = "pin1.tilt_t,pin1.offset_t,material.E_factor\nrad,m,1\n"
    with pytest.raises(InputError, match="and 80 more faults") as caught:
        table(tmp_path, head + "0,0,x\n" * 100)
    assert len(caught.value.faults) == MAX_FAULTS + 1
