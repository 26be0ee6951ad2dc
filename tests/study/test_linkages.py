"""Linkages of a study: what is refused, with its place and remedy, once, without faults that follow from it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tolstat import study
from tolstat.common.errors import InputError
from tolstat.joint import nominal_errors, perturb

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
        ("eye_t = [4, 3, 0]", 'joint.pin.d = "-3 mm"', "mechanism.pair.D.joint.pin.d: "),
        ("eye_t = [4, 3, 0]", 'joint.pin.dia = "3 mm"', "mechanism.pair.D.joint.pin.dia: unknown key"),
        ("eye_t = [4, 3, 0]", "joint.pin = 3", "mechanism.pair.D.joint.pin: "),
        ("eye_t = [4, 3, 0]", 'joint.base = "pin25"', "mechanism.pair.D.joint.base: is nothing of a pin or eye"),
        ("eye_t = [4, 3, 0]", 'joint.shaft.axial = "free"', "mechanism.pair.D.joint.shaft: is nothing of a pin or eye"),
        (
            "eye_t = [4, 3, 0]",
            'clearance = "0.1 mm"\njoint.contact.clearance = "0.1 mm"',
            "mechanism.pair.D.clearance: is given as joint.contact.clearance, too",
        ),
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


FIT = 'fit = { basic = "25 mm", code = "H7/f7", distribution = "normal", cpk = 1.0 }'


@pytest.mark.parametrize(
    ("head", "own", "place", "found"),
    [
        ('base = "cirelli2021"', "joint.friction.mu = 0.2", "joint.friction", "the study's joint has none"),
        ('base = "cirelli2021"', 'joint.thrust.k = "1e7 N/m"', "joint.thrust", "the study's joint has none"),
        ('base = "pin25"', 'joint.contact.D_P = "20 mm"', "joint.contact.D_P", "set by tolerances.fit already"),
    ],
)
def test_keys_of_a_pair_go_with_those_of_the_study(tmp_path: Path, head: str, own: str, place: str, found: str) -> None:
    path = tmp_path / "study.toml"
    text = TEXT.replace('base = "pin25"', head).replace("eye_t = [4, 3, 0]", own)
    path.write_text(text.replace('"*_pin.clearance" =', f"{FIT}\n#"), encoding="utf-8")
    with pytest.raises(InputError) as raised:
        study.load(path)
    (fault,) = (fault for fault in raised.value.faults if fault.place.endswith(place))
    assert found in fault.found


def test_a_pair_of_other_dimensions_has_those_of_a_joint_with_them(tmp_path: Path) -> None:
    """Its parameters, and those of the other pairs, are those of the study in which all pins have these dimensions."""
    own = 'pin = { d = "32 mm", l = "40 mm" }\njoint.contact = { clearance = "0.05 mm", z = "20 mm", law = "uniform" }'
    of_all = f'base = "pin25"\ncross.R = "60 mm"\n{own}'.replace("joint.", "")
    texts = (
        TEXT,
        TEXT.replace("eye_t = [4, 3, 0]", f"eye_t = [4, 3, 0]\njoint.{own}"),
        TEXT.replace('base = "pin25"', of_all),
    )
    found = []
    for number, text in enumerate(texts):
        path = tmp_path / f"{number}.toml"
        path.write_text(text, encoding="utf-8")
        one = study.load(path)
        found.append(perturb(one.joint, one.operation, nominal_errors(1, one.mechanism))[0])
    usual, mixed, other = found
    mechanism = one.mechanism
    for name, of in (
        ("mass", mechanism.lump_kinds),
        ("inertia", mechanism.lump_kinds),
        ("k", mechanism.bushing_kinds),
        ("c", mechanism.bushing_kinds),
        ("clearance", [pair.kind for pair in mechanism.pairs]),
        ("station_k1", mechanism.pair_kinds),
        ("station_k3", mechanism.pair_kinds),
        ("station_s", mechanism.pair_kinds),
        ("c_d", mechanism.pair_kinds),
    ):
        for i, kind in enumerate(of):
            expected = other if kind.startswith("D") else usual
            np.testing.assert_array_equal(mixed[name][i], expected[name][i], err_msg=f"{name} of {kind}")
    assert mixed["n_stations"].tolist() == [5, 5, 2]


def test_a_value_that_a_pair_leaves_is_told(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    text = TEXT.replace('base = "pin25"', 'base = "pin25"\ncontact.D_P = "25 mm"')
    path.write_text(text.replace("eye_t = [4, 3, 0]", 'joint.pin.d = "20 mm"'), encoding="utf-8")
    (fault,) = study.load(path).others["mechanism.pair.D.joint"].warnings()
    assert fault.place == "contact.D_P"
    assert "is inherited from [joint]" in fault.found


def test_the_radius_of_friction_of_another_pin_is_told(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text(TEXT.replace("eye_t = [4, 3, 0]", 'joint.pin = { d = "40 mm", l = "30 mm" }'), encoding="utf-8")
    (fault,) = study.load(path).others["mechanism.pair.D.joint"].warnings()
    assert fault.place == "friction.radius"
    assert "half of contact.D_P is 0.02 m" in fault.found
    own = 'joint = { pin = { d = "40 mm", l = "30 mm" }, friction = { radius = "20 mm" } }'
    path.write_text(TEXT.replace("eye_t = [4, 3, 0]", own), encoding="utf-8")
    assert not study.load(path).others["mechanism.pair.D.joint"].warnings()


def test_ideal_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text(f'{TEXT}\n[solver]\nfidelity = "ideal"\n', encoding="utf-8")
    with pytest.raises(InputError, match="'ideal' does not hold for a linkage"):
        study.load(path)
