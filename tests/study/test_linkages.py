"""Linkages of a study: what is refused, with its place and remedy, once, without faults that follow from it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tolstat import study
from tolstat.common.errors import InputError

STUDY = Path(__file__).parents[2] / "studies" / "four_bar.toml"
TEXT = STUDY.read_text(encoding="utf-8")
D = '[mechanism.pair.D]\npin = "ground"\neye = "rocker"\n'
WIND = """[mechanism.force.wind]
member = "crank"
point = ["0 m", "0 m", "0 m"]
force = ["1 N", "0 N", "0 N"]
"""
NO_MEMBER = "mechanism.member.wheel: missing table: a pair names it"


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        (D, '[mechanism.pair.D]\npin = "ground"\neye = "wheel"\n', NO_MEMBER),
        (D, '[mechanism.pair.D]\npin = "rocker"\neye = "rocker"\n', "mechanism.pair.D: pin and eye are both of rocker"),
        ("eye_t = [4, 3, 0]", "eye_t = [0, 0, 2]", "mechanism.pair.D.eye_t: lies along the axis of the pin"),
        ('member = "crank"', 'member = "wheel"', "mechanism.drive.member: 'wheel' is in no pair"),
        ('loaded = "rocker"', 'loaded = "crank"', "mechanism.loaded: 'crank' is no member that moves freely"),
        (D, WIND + D, "mechanism.force.wind.member: 'crank' is no member that moves freely"),
        ('loaded = "rocker"', "", "operation.torque: has no effect: no member is loaded"),
        ('mass = "4 kg"', 'mass = "-4 kg"', "mechanism.member.coupler.mass: "),
        ('point = ["80 mm", "0 mm", "0 mm"]', 'point = ["400 mm", "0 mm", "0 mm"]', "mechanism: the drive cannot turn"),
        ('speed = "60 rpm"', 'speed = "60 rpm"\nalpha = "5 deg"', "operation.alpha: unknown key"),
        (
            'member = "crank"',
            'member = "crank"\nswing = ["9 deg", "9 deg"]',
            "mechanism.drive.swing: both angles are the same",
        ),
    ],
)
def test_a_fault_is_told_once_with_its_place(tmp_path: Path, old: str, new: str, found: str) -> None:
    assert old in TEXT
    path = tmp_path / "study.toml"
    path.write_text(TEXT.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError) as raised:
        study.load(path)
    places = [f"{fault.place}: {fault.found}" for fault in raised.value.faults]
    assert len(places) == len(set(places))
    assert any(found in place for place in places)
    assert not any("pin4" in str(fault) or "operation.alpha: missing" in str(fault) for fault in raised.value.faults)


@pytest.mark.parametrize(
    ("pairs", "found"),
    [
        ("", "moves in 3 ways"),
        ('pin = "ground"\neye = "coupler"\npoint = ["0 mm", "9 mm", "5 mm"]\naxis = [0, 1, 1]\n', "mechanism"),
    ],
)
def test_it_must_move_in_one_way(tmp_path: Path, pairs: str, found: str) -> None:
    path = tmp_path / "study.toml"
    first, _, rest = TEXT.partition("[mechanism.pair.D]")
    more = f"[mechanism.pair.D]\n{pairs}" if pairs else ""
    path.write_text(f"{first}{more}[operation]{rest.partition('[operation]')[2]}", encoding="utf-8")
    with pytest.raises(InputError, match=found):
        study.load(path)


def test_ideal_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text(f'{TEXT}\n[solver]\nfidelity = "ideal"\n', encoding="utf-8")
    with pytest.raises(InputError, match="'ideal' does not hold for a linkage"):
        study.load(path)
