"""Mistakes that people make in study and joint files: each has its own message, with place and remedy, and no other."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.support.environment import ROOT
from tolstat import study
from tolstat.cli import app
from tolstat.common.errors import InputError
from tolstat.common.files import data_dir
from tolstat.study import assumptions, starter
from tolstat.study.file import READERS
from tolstat.study.parts import Parts

STUDY = """[joint]
base = "own_joint.toml"
[operation]
alpha = "15 deg"
speed = "500 rpm"
torque = "100 N*m"
[tolerances]
"pin*.offset_[tz]" = { plus_minus = "0.1 mm", distribution = "normal" }
"hole*.diameter" = { lower = "0 mm", upper = "0.021 mm", distribution = "normal", cpk = 1.0 }
"pin*.diameter" = { lower = "-0.021 mm", upper = "0 mm", distribution = "normal" }
[sampling]
n = 64
method = "random"
"""
DIAMETERS = "".join(line for line in STUDY.splitlines(keepends=True) if ".diameter" in line)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("mistakes")
    starter.write(made / "own.toml", starter.OWN)
    return made


def load(folder: Path, text: str, encoding: str = "utf-8") -> study.Study:
    file = folder / "study.toml"
    file.write_bytes(text.encode(encoding))
    return study.load(file)


def refused(folder: Path, text: str, encoding: str = "utf-8") -> list[str]:
    with pytest.raises(InputError) as caught:
        load(folder, text, encoding)
    return [str(fault).replace(str(folder / "study.toml"), "") for fault in caught.value.faults]


@pytest.mark.parametrize(
    ("fit", "expected"),
    [
        ('"H7/f7"', [":8: tolerances.fit: 'H7/f7' is not a fit"]),
        ('{ basic = "20", code = "H7/f7", distribution = "normal" }', [":8: tolerances.fit.basic: '20' has no unit"]),
        (
            '{ basic = "20 mm", cod = "H7/f7", distribution = "normal" }',
            [":8: tolerances.fit.code: missing key", ":8: tolerances.fit.cod: unknown key"],
        ),
        (
            '{ basic = "20 mm", code = "H7/p6", distribution = "normal" }',
            [":8: tolerances.fit.code: H7/p6 is an interf"],
        ),
        (
            '{ basic = "900 mm", code = "H7/f7", distribution = "normal" }',
            [":8: tolerances.fit.basic: '900 mm' is outside"],
        ),
    ],
)
def test_a_fault_of_a_fit_brings_no_other(folder: Path, fit: str, expected: list[str]) -> None:
    without = folder / "without_joint.toml"
    text, _, _ = (folder / "own_joint.toml").read_text("utf-8").partition("# What is assumed")
    without.write_text(text.replace('clearance = "0.03 mm"', ""), "utf-8")
    correlated = '[[correlation]]\nbetween = ["pin*.diameter"]\nrho = 0.5\n'
    made = STUDY.replace("own_joint", "without_joint").replace(DIAMETERS, "")
    made = made.replace("[tolerances]\n", f"[tolerances]\nfit = {fit}\n") + correlated
    found = refused(folder, made)
    assert [message[: len(start)] for message, start in zip(found, expected, strict=True)] == expected
    assert load(folder, made.replace(fit, '{ basic = "20 mm", code = "H7/f7", distribution = "normal" }')).fit


def test_a_mark_before_the_text_is_no_fault(folder: Path) -> None:
    assert load(folder, STUDY, "utf-8-sig").text == STUDY


@pytest.mark.parametrize(
    ("encoding", "found"),
    [
        ("utf-16", "is UTF-16 text, not UTF-8"),
        ("utf-16-le", "is UTF-16 text, not UTF-8"),
        ("utf-16-be", "is UTF-16 text, not UTF-8"),
        ("cp1252", "is not UTF-8 text: line 3 has another encoding, 'ü' of Windows perhaps"),
    ],
)
def test_other_encodings_are_to_be_saved_as_utf_8(folder: Path, encoding: str, found: str) -> None:
    text = STUDY.replace("[operation]", "# für die Prüfung\n[operation]")
    assert refused(folder, text, encoding) == [f": {found}\n  hint: save it as UTF-8"]


def test_measured_parts_of_another_encoding(folder: Path) -> None:
    (folder / "parts.csv").write_bytes("Durchmesser in µm\n1\n2\n3\n".encode("cp1252"))
    entry = '"pin*.offset_[tz]" = { distribution = "measured", file = "parts.csv", column = "x", unit = "um" }\n'
    (message,) = refused(folder, STUDY.replace(STUDY.splitlines(keepends=True)[7], entry))
    assert "parts.csv: is not UTF-8 text: line 1 has another encoding" in message
    assert message.endswith("hint: save it as UTF-8")


@pytest.mark.parametrize(
    ("old", "new", "line", "remedy"),
    [
        ('"500 rpm"', "“500 rpm”", 5, 'write straight quotes, not typographic ones: speed = "500 rpm"'),
        ('"500 rpm"', "„500 rpm“", 5, 'write straight quotes, not typographic ones: speed = "500 rpm"'),
        ('"500 rpm"', "’500 rpm’", 5, "write straight quotes, not typographic ones: speed = '500 rpm'"),
        (
            '"pin*.offset_[tz]" = { plus_minus = "0.1 mm", distribution = "normal" }',
            "“pin*.offset_[tz]” = { plus_minus = “0.1 mm”, distribution = “normal” }",
            8,
            'write straight quotes, not typographic ones: "pin*.offset_[tz]" = '
            '{ plus_minus = "0.1 mm", distribution = "normal" }',
        ),
        (
            "cpk = 1.0",
            "cpk = 1,0",
            9,
            'write a point for the decimal comma: "hole*.diameter" = '
            '{ lower = "0 mm", upper = "0.021 mm", distribution = "normal", cpk = 1.0 }',
        ),
        ("n = 64", "n = 64,0", 12, "write a point for the decimal comma: n = 64.0"),
        (
            'plus_minus = "0.1 mm"',
            "plus_minus = 0.1 mm",
            8,
            'write the value in quotes: "pin*.offset_[tz]" = { plus_minus = "0.1 mm", distribution = "normal" }',
        ),
    ],
)
def test_quotes_and_decimal_commas(folder: Path, old: str, new: str, line: int, remedy: str) -> None:
    (message,) = refused(folder, STUDY.replace(old, new))
    assert message.startswith(f":{line}: is not TOML: ")
    assert message.endswith(f"\n  hint: {remedy}")


BEARINGS, TABLE = 'for example bearings = ["80 mm", "240 mm"]', "is not a table\n  hint: write a table, for example"


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        (
            'input.bearings = ["70 mm", "70 mm"]',
            "70 mm, 70 mm: both bearings are at one place\n  hint: give the distance",
        ),
        ('input.bearings = ["90 mm", "70 mm"]', "90 mm, 70 mm are not in order\n  hint: give the nearer bearing first"),
        ('input.bearings = ["1 m", "2 m", "3 m"]', f"['1 m', '2 m', '3 m'] has 3 entries\n  hint: give 2, {BEARINGS}"),
        ('input.bearings = ["70 mm"]', f"['70 mm'] has too few entries\n  hint: give all, {BEARINGS}"),
        ('input.bearings = "70 mm"', f"'70 mm' is not a list\n  hint: write a list in [ ], {BEARINGS}"),
        ('input.bearings = "free"', "'free' is not a list\n  hint: write shaft.axial = \"free\""),
        ('output = "free"', "'free' is not a table\n  hint: write shaft.axial = \"free\""),
        ('output = "1 m"', f'\'1 m\' {TABLE} output = {{ bearings = ["80 mm", "240 mm"] }}'),
        ('unbalance = "5 g*mm"', f"'5 g*mm' {TABLE} unbalance = {{ amount = "),
        ("unbalance = {}", "has neither amount nor grade and speed\n  hint: give amount = "),
        ('unbalance.grade = "16 mm/s"', "has grade without speed\n  hint: add speed, or give amount"),
        ('unbalance = { amount = "1 g*mm", mass = "5 kg" }', "has amount beside mass\n  hint: remove amount, or mass"),
    ],
)
def test_bearings_and_unbalance_of_shafts(folder: Path, written: str, expected: str) -> None:
    (message,) = refused(folder, STUDY.replace("[operation]", f"shaft.{written}\n[operation]"))
    key = written.partition(" ")[0].replace("unbalance.grade", "unbalance")
    assert message.startswith(f":3: joint.shaft.{key}: {expected}")


@pytest.mark.parametrize(
    ("written", "remedy"),
    [
        ('snap_rings.end_play = "0.02 mm"', "snap rings and cups are thrust: thrust = {"),
        ('bearing.C0r = "12 kN"', "give bearing.C0, or leave it out"),
        ("friction.coefficient_of_friction = 0.05", "this is friction.mu under [joint]"),
        ("mu = 0.05", "this is friction.mu under [joint]"),
        ('end_play = "0.02 mm"', "this play of the cross is thrust.end_play under [joint]"),
        ('unbalance = "5 g*mm"', "this is shaft.unbalance under [joint]"),
        ('temperature = "80 degC"', "the model leaves out what heat does to clearances"),
        ('roundness = "5 um"', "the model leaves out form errors and roughness"),
        ('grease = "NLGI 2"', "the oil film is contact.c_t"),
    ],
)
def test_words_of_the_trade(folder: Path, written: str, remedy: str) -> None:
    messages = refused(
        folder, STUDY.replace("own_joint.toml", "pin25").replace("[operation]", f"{written}\n[operation]")
    )
    assert any(f": unknown key\n  hint: {remedy}" in message for message in messages)


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ("end_play", "this play of the cross is thrust.end_play under [joint]"),
        ("concentricity", "the model has pins and holes whose axes are moved and tilted"),
        ("pin*.roundness", "the model leaves out form errors and roughness"),
    ],
)
def test_a_tolerance_of_what_the_model_does_not_have_is_refused_once(folder: Path, written: str, message: str) -> None:
    entry = f'"{written}" = {{ plus_minus = "0.1 mm", distribution = "normal" }}\n'
    (found,) = refused(folder, STUDY.replace("[tolerances]\n", f"[tolerances]\n{entry}"))
    assert found.startswith(f":8: tolerances.{written}: selects nothing\n  hint: {message}")


def test_lots_are_not_asked_for_where_an_entry_with_a_lot_has_a_fault(folder: Path) -> None:
    text = STUDY.replace("n = 64", "n = 600\njoints_per_lot = 20")
    (message,) = refused(folder, text)
    assert message.startswith(":13: sampling.joints_per_lot: has no effect: no tolerance has a lot")
    (message,) = refused(folder, text.replace("cpk = 1.0 }", "lot = { share = 30 } }"))
    assert message.startswith(":9: tolerances.hole*.diameter.lot.share: 30: should be less than 1")


def test_friction_along_pins_that_have_none_around(folder: Path) -> None:
    study = STUDY.replace("own_joint.toml", "cirelli2021")
    (message,) = refused(folder, study.replace("[operation]", "friction = { mu = 0, mu_along = 0.1 }\n[operation]"))
    assert "joint.friction: 0.1 is friction along pins that have none around" in message
    (message,) = refused(folder, study.replace("[operation]", "friction = { mu = 0.1, mu_along = 15 }\n[operation]"))
    assert "joint.friction.mu_along: 15 is above 1" in message


def test_keys_of_friction_without_its_coefficient(folder: Path) -> None:
    study = STUDY.replace("own_joint.toml", "cirelli2021")
    with_radius = study.replace("[operation]", 'friction.radius = "9 mm"\n[operation]')
    (message,) = refused(folder, with_radius)
    assert message.startswith(":3: joint.friction.radius: has no effect without friction.mu")
    assert load(folder, with_radius.replace("[operation]", "friction.mu = 0.05\n[operation]")).joint.warnings() == []
    assert load(folder, study).joint.warnings() == []
    default = (data_dir() / "joints" / "cirelli2021.toml").read_text("utf-8")
    (folder / "copy.toml").write_text(default, "utf-8")
    assert load(folder, STUDY.replace("own_joint", "copy")).joint.warnings() == []
    (folder / "radius.toml").write_text(default.replace('radius = "19 mm"', 'radius = "18 mm"'), "utf-8")
    (warning,) = load(folder, STUDY.replace("own_joint", "radius")).joint.warnings()
    assert warning.place == "friction.radius"
    assert "without friction.mu" in warning.found


def test_a_joint_file_is_no_study_and_a_study_no_joint_file(folder: Path) -> None:
    shutil.copy(data_dir() / "joints" / "cirelli2021.toml", folder / "joint.toml")
    for read in (study.load, study.load_case):
        with pytest.raises(InputError) as caught:
            read(folder / "joint.toml")
        (fault,) = caught.value.faults
        assert fault.found == "is a joint file, not a study or case"
        assert 'base = "joint.toml"' in fault.remedy
    (message,) = refused(folder, STUDY.replace("own_joint.toml", "own.toml"))
    assert "own.toml: is a study or case, not a joint file" in message


def told(folder: Path, *changes: tuple[str, str]) -> list[str]:
    text = STUDY
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return [str(fault).replace(str(folder / "study.toml"), "") for fault in assumptions.warnings(load(folder, text))]


def test_a_zone_far_wider_than_the_clearance_is_told(folder: Path) -> None:
    assert told(folder) == []
    zone = '"pin*.position" = { zone = "⌀10 mm", over = "16 mm", distribution = "normal" }\n'
    (message,) = told(folder, (STUDY.splitlines(keepends=True)[7], zone))
    assert message.startswith(":8: tolerances.pin*.position: moves the end of a pin by ")
    assert "times the radial clearance of 0.03 mm: nearly every pin binds" in message
    assert message.endswith("\n  hint: check its unit, and contact.clearance of the joint")
    (message,) = told(folder, ('plus_minus = "0.1 mm"', 'plus_minus = "0.1 cm"'))
    assert message.startswith(":8: tolerances.pin*.offset_[tz]: moves")
    assert told(folder, ("offset_[tz]", "offset_e"), ('plus_minus = "0.1 mm"', 'plus_minus = "1 mm"')) == []
    (message,) = told(folder, ("offset_[tz]", "tilt_t"), ('plus_minus = "0.1 mm"', 'plus_minus = "0.2 rad"'))
    assert "tilt_t: moves the end of a pin by 0.5" in message


def test_a_speed_in_the_wrong_unit_is_told(folder: Path) -> None:
    (message,) = told(folder, ("500 rpm", "800 rad/s"))
    assert message.startswith(":5: operation.speed: 7639 rpm at 15 deg: speed times angle, 114592 rpm deg, is beyond ")
    assert told(folder, ("500 rpm", "800 rpm")) == []
    assert told(folder, ("500 rpm", "2500 rpm"), ('alpha = "15 deg"', 'alpha = "12 deg"')) == []
    points = (
        "[operation]\nalpha",
        '[[operation]]\nname = "slow"\nspeed = "1 rpm"\nalpha = "1 deg"\n'
        'torque = "1 N*m"\n[[operation]]\nname = "fast"\nalpha',
    )
    (message,) = told(folder, points, ("500 rpm", "800 rad/s"))
    assert message.startswith(":11: operation[1].speed: 7639 rpm at 15 deg at fast: ")
    (message,) = told(folder, points, ("500 rpm", "800 rad/s"), ("1 rpm", "40000 rpm"))
    assert message.startswith(":11: operation[1].speed: 7639 rpm at 15 deg at fast: ")
    assert "makers of joint shafts allow, as at 1 other point\n" in message


def test_commands_tell_such_warnings(folder: Path) -> None:
    (folder / "fast.toml").write_text(STUDY.replace("500 rpm", "800 rad/s").replace("n = 64", "n = 2"), "utf-8")
    done = CliRunner().invoke(app, ["plan", str(folder / "fast.toml"), "--pilot", "1"])
    assert "fast.toml:5: operation.speed: 7639 rpm at 15 deg: speed times angle" in done.stderr


@pytest.mark.parametrize("file", sorted((ROOT / "studies").glob("*.toml")), ids=lambda file: file.stem)
def test_studies_that_come_along_have_no_such_warnings(file: Path) -> None:
    if "[sampling]" in file.read_text("utf-8"):
        assert [*assumptions.warnings(study.load(file, None))] == []


def test_each_part_that_is_read_has_its_name_and_no_other() -> None:
    assert set(Parts.__annotations__) == {*READERS, "notes"}
