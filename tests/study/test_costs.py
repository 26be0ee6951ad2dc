"""Cost tables as text: the same costs as in TOML, and every fault with its line."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support import synthetic
from tolstat import study
from tolstat.common.cardan import CARDAN
from tolstat.common.errors import InputError
from tolstat.common.text_table import SHOWN
from tolstat.study import costs, scaling

TOML = """
"pin*.offset_t" = { cost = 4.5, fixed = 1, at = "0.5 mm", power = 2, least = "0.01 mm" }
"pin*.offset_z" = { keep = true }
"""
BAND = '{ plus_minus = "0.1 mm", distribution = "normal", cpk = 1.0 }'


@pytest.fixture
def tolerances(tmp_path: Path) -> list[scaling.Tolerance]:
    entries = f'"pin*.offset_t" = {BAND}\n"pin*.offset_z" = {BAND}\n'
    text = f"{synthetic.HEAD}[tolerances]\n{entries}[sampling]\nn = 10\n"
    return scaling.tolerances(study.load(tmp_path / "a.toml", text=text))


@pytest.mark.parametrize(
    ("name", "text", "encoding"),
    [
        ("costs.toml", TOML, "utf-8"),
        ("COSTS.TOML", TOML, "utf-8"),
        (
            "COSTS.CSV",
            "tolerance,cost,fixed,at,power,least,keep\n"
            "pin*.offset_t,4.5,1,0.5 mm,2,0.01 mm,\npin*.offset_z,,,,,,true\n",
            "utf-8-sig",
        ),
        (
            "costs.txt",
            "tolerance\tcost\tfixed\tat [mm]\tpower\tleast [um]\tkeep\r\n"
            "pin*.offset_t\t4,5\t1\t0,5\t2\t10\t\r\npin*.offset_z\t\t\t\t\t\tTRUE\r\n",
            "utf-16",
        ),
        (
            "costs.csv",
            "tolerance;cost;fixed;at;power;least;keep\n"
            "pin*.offset_t;4,5;1;0,5 mm;2;0,01 mm;\npin*.offset_z;;;;;;true\n",
            "utf-8",
        ),
    ],
)
def test_a_cost_table_is_what_its_ending_says(
    tmp_path: Path, tolerances: list[scaling.Tolerance], name: str, text: str, encoding: str
) -> None:
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    first, second = costs.of(tolerances, CARDAN, path)
    assert first.at(1.0) == pytest.approx(4 * (1 + 3.5 * 5**2))
    assert (first.reach[0], second.reach) == (pytest.approx(0.1), (1.0, 1.0))


def test_faults_have_their_lines(tmp_path: Path, tolerances: list[scaling.Tolerance]) -> None:
    path = tmp_path / "costs.csv"
    path.write_text(
        "# quoted\ntolerance;cost;at\npin*.offset_t;x;0,5 deg\npin1.tilt_x;1\npin9.offset_z;1;\npin*.offset_t;3;\n"
        "pin*.offset_z;inf;\n;;\n"
    )
    with pytest.raises(InputError) as caught:
        costs.of(tolerances, CARDAN, path)
    found = [str(fault).removeprefix(f"{path}:") for fault in caught.value.faults]
    starts = ["4: has 2 cells", "6: has a second row of 'pin*.offset_t'", "3: pin*.offset_t.cost: 'x'"]
    starts += ["3: pin*.offset_t.at: '0.5 deg' cannot be", "5: pin9.offset_z: ", "7: pin*.offset_z.cost: 'inf'"]
    assert [fault[: len(start)] for fault, start in zip(found, starts, strict=True)] == starts
    path.write_text("tolerance;cost\n" + "pin*.offset_t;1\n" * (SHOWN + 13))
    with pytest.raises(InputError, match="and 12 more faults"):
        costs.of(tolerances, CARDAN, path)


def test_a_cost_table_needs_names(tmp_path: Path, tolerances: list[scaling.Tolerance]) -> None:
    (tmp_path / "costs.csv").write_text("name;cost\npin*.offset_t;1\n")
    with pytest.raises(InputError, match="1: has no column 'tolerance'"):
        costs.of(tolerances, CARDAN, tmp_path / "costs.csv")
