"""Quantities as drawings write them: what is read, and what is refused because it may mean two things."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys

import pytest
from pydantic_core import PydanticCustomError

from tests.support.environment import ROOT
from tolstat.common import notation, units
from tolstat.common.notation import DIAMETER, PLUS_MINUS
from tolstat.common.units import FACTORS, to_si, written

NUMBERS = ("0.1", "3.3", "-7.77e3", "1e-7", "0.30000000000000004", "123456.789", "0")


@pytest.mark.parametrize("text", ["0,1 mm", "1,5 mm", "1 000 N", "10**10**10 mm", "1_000 mm", "mm", "", "0.1 mm;"])
def test_what_is_no_number_with_a_unit_is_not_guessed(text: str) -> None:
    with pytest.raises(PydanticCustomError, match="is not a number with a unit"):
        to_si(text, "m")


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("0.1 mm", "m", 1e-4),
        (" -.5mm ", "m", -5e-4),
        ("1.2e+06 N/mm", "N/m", 1.2e9),
        ("7.5e7 N/mm^2", "N/m^2", 7.5e13),
        *[("100 N·m", "N*m", 100.0), ("100 Nm", "N*m", 100.0), ("0.1 kNm", "N*m", 100.0), ("1e5 Nmm", "N*m", 100.0)],
        *[("1 MNm", "N*m", 1e6), ("1 Ncm", "N*m", 0.01), ("1 Nm/rad", "N*m/rad", 1.0), ("1 N/mm", "N/m", 1e3)],
        *[("1 nm", "m", 1e-9), ("1 mN", "N", 1e-3), ("1 m N", "N*m", 1.0)],
        ("1 um", "m", 1e-6),
        ("5 µm", "m", 5e-6),
        ("0.5 °", "rad", math.radians(0.5)),
        ("30 kg*m^2", "kg*m^2", 30.0),
        ("5 %", "1", 0.05),
        ("0.5", "1", 0.5),
    ],
)
def test_quantities_are_read(text: str, unit: str, value: float) -> None:
    assert to_si(text, unit) == pytest.approx(value, rel=1e-14)


def test_usual_units_have_the_bits_of_pint(monkeypatch: pytest.MonkeyPatch) -> None:
    cases = [(f"{number} {name}", unit) for unit, known in FACTORS.items() for name in known for number in NUMBERS]
    ours = [to_si(*case) for case in cases]
    monkeypatch.setattr(units, "FACTORS", {})
    assert ours == [to_si(*case) for case in cases]


def test_usual_units_do_not_load_pint() -> None:
    said = (
        "import sys; from tolstat.common.units import to_si; to_si('0.1 mm', 'm'), to_si('500 rpm', 'rad/s');"
        "sys.exit('pint' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", said], cwd=ROOT, check=False).returncode == 0


def test_commands_are_known_before_numpy_reads_the_number_of_threads() -> None:
    said = "import sys; import tolstat.cli; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", said], cwd=ROOT, check=False).returncode == 0


@pytest.mark.parametrize(
    "text",
    [
        *("1200 rpm", "1200 rev/min", "1200 turn/min", "20 rps", "20 rev/s", "7200 deg/s", "20 turn/s"),
        "125.66370614359172 rad/s",
        *("1200 min^-1", "1200 min**-1", "1200 min⁻¹", "1200 1/min", "1200/min", "1200 / min", "1200 1/minute"),
        *("1200 min-1", "1200 U/min", "1200 r/min", "1200 tr/min", "1200 RPM", "20 U/s", "1.2 krpm", "432000 deg/min"),
    ],
)
def test_a_speed_is_in_revolutions_however_it_is_spelt(text: str) -> None:
    assert to_si(text, "rad/s") == pytest.approx(40.0 * math.pi, rel=1e-14)
    assert to_si(str(written(80.0 * math.pi, "rad/s", text)), "rad/s") == pytest.approx(80.0 * math.pi, rel=1e-11)


@pytest.mark.parametrize(
    "text",
    [
        *("20 Hz", "0.02 kHz", "20 Bq", "20 cps", "20 1/s", "20/s", "20 s^-1", "20 s⁻¹", "72000 1/h", "0.02 1/ms"),
        *("1200 count/min", "2000 %/s", "20 sr/s"),
    ],
)
def test_what_may_be_revolutions_or_radians_is_no_speed(text: str) -> None:
    with pytest.raises(PydanticCustomError, match="ambiguous") as caught:
        to_si(text, "rad/s")
    assert caught.value.context
    assert caught.value.context["remedy"] == 'write "20 rev/s" or "20 rad/s"'


@pytest.mark.parametrize(
    "text", ["20 rev*Hz", "20 rad^2/s", "20 rad*Hz", "20 rpm*rad", "20 rad", "20 min", "20 rev/min^2"]
)
def test_what_is_no_speed(text: str) -> None:
    with pytest.raises(PydanticCustomError, match="cannot be a value in rad/s"):
        to_si(text, "rad/s")


@pytest.mark.parametrize(
    "text", ["⌀0.1 mm", "Ø 0.1 mm", "ø0.1mm", "φ0.1 mm", "dia 0.1 mm", "Dia. 100 um", "0.1 mm dia"]
)
def test_a_diameter_is_read_where_one_is_meant_and_refused_elsewhere(text: str) -> None:
    read = notation.read(text)
    assert read is not None
    assert read.mark == DIAMETER
    assert to_si(text, "m", DIAMETER) == pytest.approx(1e-4)
    half = "50 um" if "um" in text else "0.05 mm"
    for mark, remedy in ((PLUS_MINUS, f'half of it: "{half}"'), ("", f'or "{half}" where a radius is meant')):
        with pytest.raises(PydanticCustomError, match="is a diameter where") as caught:
            to_si(text, "m", mark)
        assert caught.value.context
        assert remedy in caught.value.context["remedy"]


@pytest.mark.parametrize("text", ["±0.1 mm", "+-0.1 mm", "+/- 100 um"])
def test_a_band_is_read_where_a_half_width_is_meant(text: str) -> None:
    assert to_si(text, "m", PLUS_MINUS) == pytest.approx(1e-4)
    for mark in ("", DIAMETER):
        with pytest.raises(PydanticCustomError, match="is a band where another quantity is meant"):
            to_si(text, "m", mark)
    assert to_si(str(written(2e-4, "m", text)), "m", PLUS_MINUS) == pytest.approx(2e-4)


@pytest.mark.parametrize("text", ["0.1 mm diam", "⌀-0.1 mm", "⌀", "dia", "±-0.1 mm", "⌀0.1 N", "⌀0.1"])
def test_what_is_no_diameter(text: str) -> None:
    with pytest.raises(PydanticCustomError):
        to_si(text, "m", DIAMETER)


@pytest.mark.parametrize(
    ("text", "degrees"),
    [
        *[("0°30'", 0.5), ("0° 30′", 0.5), ("30'", 0.5), ("-1°30'", -1.5), ("1°30.6'", 1.51), ("0°0'36\"", 0.01)],
        *[("0°30'36\"", 0.51), ("0°30′36″", 0.51), ("0°30'36''", 0.51), ('36"', 0.01), ("1°0'3.6\"", 1.001)],
    ],
)
def test_angles_in_minutes_and_seconds(text: str, degrees: float) -> None:
    assert to_si(text, "rad") == pytest.approx(math.radians(degrees), rel=1e-14)
    assert to_si(str(written(0.1, "rad", text)), "rad") == pytest.approx(0.1)


@pytest.mark.parametrize("text", ["0°75'", "0°0'60\"", "1.5°30'", "0°30.5'10\"", "0°-30'", "°30'", "30'0.5 deg"])
def test_what_is_no_angle_in_minutes(text: str) -> None:
    with pytest.raises(PydanticCustomError, match="is not a number with a unit"):
        to_si(text, "rad")


def documented() -> list[tuple[str, list[str], list[str]]]:
    """Rows of the table of quantities in the documents: kind, texts that are accepted, texts that are not."""
    page = (ROOT / "docs" / "tolerances.md").read_text(encoding="utf-8")
    table = page.partition("| quantity |")[2].partition("\n\n")[0].splitlines()[2:]
    cells = [line.strip("|").split(" | ") for line in table]
    return [(kind.split()[0].strip(",| "), *(re.findall("`([^`]+)`", cell) for cell in rest)) for kind, *rest in cells]


KINDS = {
    "length": ("m", ""),
    "diameter": ("m", DIAMETER),
    "half": ("m", PLUS_MINUS),
    "angle": ("rad", ""),
    "speed": ("rad/s", ""),
    "torque": ("N*m", ""),
    "stress": ("Pa", ""),
    "factor": ("1/m^3", ""),
    "share": ("1", ""),
}


def test_the_documented_quantities_are_read() -> None:
    rows = documented()
    assert {kind for kind, *_ in rows} == set(KINDS)
    for kind, accepted, refused in rows:
        unit, mark = KINDS[kind]
        values = [text for text in accepted if text not in ("D_H", "D_P", "pin.d", "plus_minus")]
        assert values
        for text in values:
            assert to_si(json.loads(text), "rad" if "°" in text else unit, mark) > 0.0
        for text in refused:
            with pytest.raises(PydanticCustomError):
                to_si(json.loads(text), unit, mark)
