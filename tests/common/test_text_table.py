"""Text tables of other programs: dialects, units, all faults of a file at once; nothing is read wrong."""

from __future__ import annotations

import csv
import re
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.study.test_fuzz import FUZZ
from tolstat.common.errors import InputError
from tolstat.common.text_table import SHOWN, TextTable
from tolstat.common.units import to_si

SI = {"tilt": "rad", "offset": "m", "E_factor": "1"}


def read(
    path: Path, text: str, encoding: str = "utf-8", needed: tuple[str, ...] = (), si: dict[str, str] = SI
) -> dict[str, list[float]]:
    path.write_bytes(text.encode(encoding))
    table = TextTable(path)
    numbers = table.numbers(si, needed, 1, si)
    table.check()
    return {name: values.tolist() for name, values in numbers.items()}


def refused(path: Path, text: str, **options: object) -> list[str]:
    """Line, what was found, and remedy of each fault."""
    with pytest.raises(InputError) as caught:
        read(path, text, **options)  # type: ignore[arg-type]
    return [str(fault).removeprefix(f"{path}:") for fault in caught.value.faults]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "a.csv"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize(
    "text",
    [
        "# Länge\n\ntilt,part,offset\n0.25,A,1e-5\n,,\n-.5,B,+2\n",
        "tilt;part;offset\n0,25;A;1e-5\n;;\n-,5;B;+2\n",
        'tilt\tpart\toffset\n"0,25"\t"A, links"\t1E-5\n\t\t\n-,5\tB\t+2',
        "# Länge\ntilt [rad], part [-], offset [m]\n0.25, A;B, 0.00001\n# half way\n-.5, B, 2\n",
        'tilt;part;offset\nrad;;[m]\n0.25;"A\nB";0.00001\n-.5;B;2\n',
    ],
)
def test_what_programs_write(path: Path, text: str, encoding: str, end: str) -> None:
    found = read(path, text.replace("\n", end), encoding)
    assert found == {"tilt": [0.25, -0.5], "offset": [1e-5, 2.0]}


def test_columns_in_any_order_and_units(path: Path) -> None:
    assert read(path, "part,E_factor,tilt,offset\nA,1.1,0.25,1e-5\n") == {
        "tilt": [0.25],
        "offset": [1e-5],
        "E_factor": [1.1],
    }
    for text in (
        "offset, tilt ,E_factor,row\num,deg,,1\n10,180,1,7\n20,90,2,8\n",
        "offset [um];tilt [°];E_factor [%];row\n10;180;100;7\n20;90;200;8\n",
        "offset (um);tilt (°);E_factor (%);row (no. of it)\n10;180;100;7\n20;90;200;8\n",
        "offset;tilt;E_factor;row\n(um);[°];(%);\n10;180;100;7\n20;90;200;8\n",
    ):
        found = read(path, text)
        expected = [[np.pi, np.pi / 2], [1e-5, 2e-5], [1.0, 2.0]]
        np.testing.assert_allclose([found[name] for name in SI], expected, rtol=1e-15)


def test_a_minus_of_a_spreadsheet_or_text_processor(path: Path) -> None:
    assert read(path, "tilt;offset\n−0,5;–1e−3\n")["tilt"] == [-0.5]
    assert read(path, "tilt;offset\n−0,5;–1e−3\n")["offset"] == [-1e-3]
    assert refused(path, "tilt,offset\n—1,1–2\n")[0].startswith("2: tilt: '—1' is no finite number")
    with pytest.raises(ValueError, match="is not a number") as caught:
        to_si("−0.1 mm", "m")
    assert caught.value.context["remedy"] == 'write a hyphen for minus: "-0.1 mm"'


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("tilt,part\n0,21,A\n", ["2: has 3 cells, the header 2"]),  # no decimal comma where commas separate
        (
            "tilt\n0,21\n",
            [
                "2: has 2 cells, the header 1\n  hint: give a cell for each column; write decimals with a point, or "
                "separate cells by semicolons"
            ],
        ),
        ('tilt,part\n"0,21",A\n', ["2: tilt: '0,21' is no finite number"]),
        ("tilt;part\n0.21;A\n1.234,5;B\n", ["3: tilt: '1.234,5' is no finite number"]),
        ("tilt;part\n1,234.5;A\n1 234;B\n", ["2: tilt: '1,234.5' is no", "3: tilt: '1 234' is no"]),
        ("tilt;part\n0,21;A\n1.234;B\n", ["3: '1.234' has another decimal mark than '0,21' in line 2"]),
        ("tilt;part\n0,21\n1;A;B\n", ["2: has 1 cells, the header 2", "3: has 3 cells, the header 2"]),
        ("tilt,tilt\n1,2\n", ["1: tilt: is there twice"]),
        ("tilt,offset\n1,nan\ninf,1e400\n", ["2: offset: 'nan'", "3: tilt: 'inf'", "3: offset: '1e400'"]),
        ("tilt\nnan\n", ["2: tilt: 'nan' is no finite number"]),
        (
            "tilt,offset\n1_0,١\nx,\n",
            ["2: tilt: '1_0'", "2: offset: '١'", "3: tilt: 'x'", "3: offset: has no number: the cell"],
        ),
        ("tilt,offset\nN,m\n1,2\n", ["2: tilt: [N] is no unit of it"]),
        ("\n# x\ntilt [mm],E_factor [m]\n1,2\n", ["3: tilt: [mm] is no unit", "3: E_factor: [m] is no unit"]),
        ('tilt,part\n1,"A\n2,B\n', ["1: has 0 rows", "2: cannot be split into cells: unexpected end of data"]),
        ('tilt,part\n1,"A"B\n', ["1: has 0 rows", "2: cannot be split into cells"]),
        ("part,tilt\n#1,2\n#3,4\n5,6\n", ["2: begins with # and has as many cells", "3: begins with # and has"]),
        ("tilt\n", ["1: has 0 rows below it"]),
        ("", ["1: has 0 rows below it"]),
    ],
)
def test_faults(path: Path, text: str, expected: list[str]) -> None:
    found = refused(path, text)
    assert [fault[: len(start)] for fault, start in zip(found, expected, strict=True)] == expected
    assert all("\n  hint: " in fault for fault in found)


def test_faults_come_at_once_with_their_lines(path: Path) -> None:
    text = "tilt,offset,offset\nN,mm,mm\n0.1,1,x\n1,2\n\nnan,1,1\n"
    assert refused(path, text, needed=("tilt", "offset", "E_factor", "speed"), si=SI | {"speed": "rad/s"}) == [
        "1: offset: is there twice\n  hint: rename or remove one of the columns",
        "1: has no column 'E_factor', 'speed'\n  hint: add the headers E_factor, speed [rpm]; there are tilt, offset",
        "2: tilt: [N] is no unit of it\n  hint: write its unit into the header: tilt [deg]",
        "3: offset: 'x' is no finite number\n  hint: give a number, without unit and thousands separators",
        "4: has 2 cells, the header 3\n  hint: give a cell for each column",
        "6: tilt: 'nan' is no finite number\n  hint: give a number, without unit and thousands separators",
    ]


def test_a_long_list_of_faults_is_cut(path: Path) -> None:
    found = refused(path, "tilt,offset\n0,0\n" + "0,x\n" * (SHOWN + 12))
    assert len(found) == SHOWN + 1
    assert found[-1] == " and 12 more faults\n  hint: mend these first"


PLAIN = ("tilt", "Länge", "a.b", "E_factor 2")
NAMES = st.lists(st.sampled_from((*PLAIN, "T, warm", "x;y", 'a "b"', "a\tb")), min_size=1, max_size=4, unique=True)


def check(error: InputError, path: Path, must_be_read: bool = False) -> None:
    assert not must_be_read, str(error)
    places = [fault.place.removeprefix(str(path)) for fault in error.faults]
    assert all(re.match(r":\d+", place) for place in places[:SHOWN])
    assert all(fault.found and fault.remedy for fault in error.faults)


@FUZZ
@given(
    data=st.data(),
    names=NAMES,
    separator=st.sampled_from(",;\t"),
    comma=st.booleans(),
    encoding=st.sampled_from(("utf-8", "utf-8-sig", "utf-16")),
    end=st.sampled_from(("\n", "\r\n", "\r")),
    quoting=st.sampled_from((csv.QUOTE_MINIMAL, csv.QUOTE_ALL)),
    units=st.sampled_from(("none", "header", "row")),
    above=st.sampled_from(("", "# made, by; a\tbench", "\n")),
)
def test_any_numbers_in_any_dialect_come_back_to_the_bit(
    tmp_path: Path, data: st.DataObject, names: list[str], separator: str, comma: bool, encoding: str, end: str,
    quoting: int, units: str, above: str,
) -> None:  # fmt: skip
    finite = st.floats(allow_nan=False, allow_infinity=False)
    rows = data.draw(st.lists(st.tuples(*[finite] * len(names)), min_size=1, max_size=6))
    stream = StringIO()
    writer = csv.writer(stream, delimiter=separator, lineterminator=end, quoting=quoting)  # type: ignore[arg-type]
    writer.writerow([f"{name} [m]" if units == "header" else name for name in names])
    if units == "row":
        writer.writerow(["m"] * len(names))
    mark = "," if comma else "."
    writer.writerows([[repr(value).replace(".", mark) for value in row] for row in rows])
    path = tmp_path / "a.csv"
    must = set(names) <= set(PLAIN) and (not comma or (separator != "," and len(names) > 1))
    try:
        found = read(path, f"{above}{end}{stream.getvalue()}", encoding, tuple(names), dict.fromkeys(names, "m"))
    except InputError as error:
        check(error, path, must)
    else:
        assert np.array(rows).tobytes() == np.column_stack([found[name] for name in names]).tobytes()


@FUZZ
@given(text=st.text(st.sampled_from('tilofse,;\t"#\n\r0123.-+e []mrad°x'), max_size=60), head=st.booleans())
def test_any_text_is_read_or_refused(tmp_path: Path, text: str, head: bool) -> None:
    try:
        found = read(tmp_path / "a.csv", "tilt,offset\n" * head + text)
    except InputError as error:
        check(error, tmp_path / "a.csv")
    else:
        assert all(np.isfinite(values).all() for values in found.values())
