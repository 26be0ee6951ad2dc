"""Settings of a change: the text of the study that they make, and what is refused."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from tests.support import synthetic
from tolstat import study
from tolstat.common.errors import InputError
from tolstat.study import Study, changes

TEXT = (
    synthetic.HEAD
    + """[tolerances]
"pin*.offset_[tz]" = { plus_minus = "0.1 mm", distribution = "normal", cpk = 1.0 }  # of the drawing
"hole*.tilt_t" = { iso2768 = "f", nominal = "22 mm", distribution = "normal", cpk = 1.0 }

[errors]
"pin2.tilt_z" = "0.1 deg"

[sampling]
n = 60
seed = 2021
"""
)
POINTS = TEXT.replace("[operation]", '[[operation]]\nname = "cruise"').replace(
    "[tolerances]",
    '[[operation]]\nname = "start"\nalpha = "15 deg"\nspeed = "50 rpm"\ntorque = "200 N*m"\n[tolerances]',
)
FIT = TEXT.replace(
    "[tolerances]", '[tolerances]\nfit = { basic = "76 mm", code = "H8/e8", distribution = "normal", cpk = 1.0 }'
)


def loaded(text: str = TEXT) -> Study:
    return study.load(Path("made.toml"), text=text)


def changed(*settings: str, text: str = TEXT) -> Study:
    plan = loaded(text)
    return changes.read(plan, changes.with_settings(plan, settings))


@pytest.mark.parametrize(
    ("setting", "old", "new"),
    [
        (
            "*.tilt_*.cpk=1.2",
            '"22 mm", distribution = "normal", cpk = 1.0',
            '"22 mm", distribution = "normal", cpk = 1.2',
        ),
        (
            "'*.tilt_*'.cpk=1.2",
            '"22 mm", distribution = "normal", cpk = 1.0',
            '"22 mm", distribution = "normal", cpk = 1.2',
        ),
        ("tolerances.hole*.tilt_t.cpk = 1.2", 'nominal = "22 mm", distribution = "normal", cpk = 1.0', None),
        ("operation.alpha=12 deg", 'alpha = "15 deg"', 'alpha = "12 deg"'),
        ("errors.pin2.tilt_z=0.2 deg", '"pin2.tilt_z" = "0.1 deg"', '"pin2.tilt_z" = "0.2 deg"'),
        ("hole*.tilt_t=none", '"hole*.tilt_t" = { iso2768 = "f", nominal', None),
        ("joint.contact.law=sliced", 'base = "cirelli2021"', 'base = "cirelli2021"\ncontact = { law = "sliced" }'),
    ],
)
def test_a_setting_changes_one_line(setting: str, old: str, new: str | None) -> None:
    plan = loaded()
    text = changes.with_settings(plan, [setting])
    assert old in plan.text
    assert old not in text or new is not None
    if new is not None:
        assert text == plan.text.replace(old, new)
    study.load(Path("made.toml"), text=text)  # as a study of its own


@pytest.mark.parametrize(
    "settings",
    [
        ["joint.contact.clearance=0.15 mm"],
        ["joint.contact.law=sliced", "joint.arm.l_f=30 mm"],
        ["pin1.offset_t.plus_minus=0.05 mm", "operation.alpha=12 deg"],
        ["pin3.offset_z=none"],
        ['pin*.tilt_t={ plus_minus = "0.2 deg", distribution = "uniform" }'],
        ["errors.pin1.tilt_z=0.3 deg", "errors.pin2.tilt_z=0 deg"],
    ],
)
def test_the_study_simulated_is_the_one_written(settings: list[str]) -> None:
    plan = loaded()
    text = changes.with_settings(plan, settings)
    assert changes.read(plan, text).identity() == study.load(Path("made.toml"), text=text).identity()
    assert changes.differing(plan, changes.read(plan, text))


BOTH = '"cirelli2021"\ncontact = { D_H = "76.3 mm", D_P = "76 mm" }'


@pytest.mark.parametrize(
    "bearing",
    [
        BOTH,
        '"cirelli2021"\ncontact.D_H = "76.3 mm"\ncontact.D_P = "76 mm"',
        '"cirelli2021"\n[joint.contact]\nD_H = "76.3 mm"\nD_P = "76 mm"',
    ],
)
@pytest.mark.parametrize(
    ("settings", "third"),
    [
        (["joint.contact.clearance=0.05 mm"], "D_P"),
        (["joint.contact.clearance=0.05 mm", "joint.contact.D_P=76 mm"], "D_H"),
        (["joint.contact.clearance=0.05 mm", "joint.contact.law=sliced"], "D_P"),
    ],
)
def test_the_third_of_a_bearing_is_not_written_either(settings: list[str], third: str, bearing: str) -> None:
    plan = loaded(TEXT.replace('"cirelli2021"', bearing))
    text = changes.with_settings(plan, settings)
    other, written = changes.read(plan, text), study.load(Path("made.toml"), text=text)
    assert other.identity() == written.identity()
    assert third not in tomllib.loads(text)["joint"]["contact"]
    assert written.joint.contact.clearance == pytest.approx(5e-5)


def test_a_table_that_leaves_out_keys_of_the_study_is_refused() -> None:
    with pytest.raises(InputError, match=r"leaves out contact.D_H, which the study sets\n  hint: set each key"):
        changed('joint.contact={ clearance = "0.05 mm" }', text=TEXT.replace('"cirelli2021"', BOTH))


def test_a_key_given_twice_is_refused_by_both_settings() -> None:
    with pytest.raises(InputError, match=r"'tolerances.fit.code=H7/f6': sets the key of --set 'fit.code=H7/e8' again"):
        changed("fit.code=H7/e8", "tolerances.fit.code=H7/f6", text=FIT)


def test_another_fit_changes_the_diameters_of_the_joint() -> None:
    other = changed("fit.code=H7/e7", text=FIT)
    written = study.load(Path("made.toml"), text=FIT.replace("H8/e8", "H7/e7"))
    assert other.identity() == written.identity()
    assert other.joint.contact.D_H != loaded(FIT).joint.contact.D_H
    apart = changed("hole*.diameter.cpk=1.3", text=FIT)
    assert apart.fit is None
    assert apart.joint.contact.D_H == loaded(FIT).joint.contact.D_H


def test_of_several_operating_points_one_is_named() -> None:
    other = changed("operation.start.torque=150 N*m", text=POINTS)
    assert [point.operation.torque for point in other.points] == pytest.approx([100.0, 150.0])
    plan = loaded(POINTS).at("start")
    alone = changes.read(plan, changes.with_settings(plan, ["operation.start.torque=150 N*m"]))
    assert alone.operation.torque == pytest.approx(150.0)
    with pytest.raises(InputError, match=r"names no operating point\n  hint: .*cruise, start"):
        changed("operation.torque=150 N*m", text=POINTS)


def test_what_differs_is_named_whatever_the_sampling() -> None:
    plan = loaded()
    assert changes.differing(plan, plan) == {}
    assert changes.differing(plan, changed("operation.alpha=15 deg")) == {}
    (key,) = changes.differing(plan, changed("pin1.offset_t.cpk=2"))
    assert key == "tolerances.pin1.offset_t.sigma"
    gone = changes.differing(plan, changed("pin1.offset_t=none"))
    assert set(gone.values()) == {None}


@pytest.mark.parametrize(
    ("same", "other", "alike"),
    [
        (
            "pin*.offset_[tz].plus_minus=100 um",
            "pin*.offset_[tz].plus_minus=80 um",
            "pin*.offset_[tz].plus_minus=0.08mm",
        ),
        ("errors.pin2.tilt_z=6 arcmin", "errors.pin2.tilt_z=12 arcmin", "errors.pin2.tilt_z=0.2 deg"),
        ("joint.pin.l=36400 um", "joint.pin.l=36 mm", "joint.pin.l=36000 um"),
    ],
)
def test_a_value_in_another_unit_is_the_same(same: str, other: str, alike: str) -> None:
    plan = loaded(TEXT.replace('"cirelli2021"', '"cirelli2021"\npin.l = "36.4 mm"'))
    found = [
        changes.differing(plan, changes.read(plan, changes.with_settings(plan, [s]))) for s in (same, other, alike)
    ]
    assert found[0] == {}
    assert found[1] == found[2] != {}


def test_a_pattern_selects_entries_too_and_the_words_say_what_changes() -> None:
    zones = '"pin*.position" = { ZONE }\n"*_holes.position" = { ZONE }\n'
    zones = zones.replace("ZONE", 'zone = "⌀0.1 mm", over = "22 mm", distribution = "normal"')
    head, _, rest = TEXT.partition("[tolerances]")
    plan = loaded(f"{head}[tolerances]\n{zones}\n[sampling]{rest.partition('[sampling]')[2]}")
    text = changes.with_settings(plan, ["*.position.zone=⌀0.08 mm", "errors.pin1.tilt_t=1 deg"])
    said = "changed: pin*.position.zone ⌀0.1 mm → ⌀0.08 mm, *_holes.position.zone ⌀0.1 mm → ⌀0.08 mm"
    assert changes.words(plan, text) == f"{said}; new: errors.pin1.tilt_t"


def test_every_fault_of_the_settings_is_told() -> None:
    settings = [
        "pin1",
        "sampling.seed=3",
        "limits.psi=0.1",
        "pinn1.offset_t.cpk=1",
        "pin1.offset_t=3",
        "pin1.tilt_t=none",
    ]
    with pytest.raises(InputError) as told:
        changed(*settings)
    assert len(told.value.faults) == len(settings)
    text = str(told.value)
    assert "is in section 'sampling', which changes no joint" in text
    assert "--set 'pin1.tilt_t=none': selects no error that has a tolerance" in text


@pytest.mark.parametrize(
    ("setting", "said", "text"),
    [
        ("pin1.offset_t.cpk=-1", r"--set: tolerances.pin1.offset_t.cpk", TEXT),
        ("joint.contact.lawn=sliced", r"joint: contact.lawn|joint.contact.lawn", TEXT),
        ("joint.base=other.toml", r"is another joint", TEXT),
        ("joint.contact.D_H=77 mm", r"is set by tolerances.fit already", FIT),
        ("fit.code=H7/x3", r"--set: tolerances.fit.code", FIT),
    ],
)
def test_values_that_make_no_study_are_refused(setting: str, said: str, text: str) -> None:
    with pytest.raises(InputError, match=said):
        changed(setting, text=text)
