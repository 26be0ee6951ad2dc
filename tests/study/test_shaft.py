"""Studies of drive shafts: names begin with the joint, and what only one joint can have is refused."""

from __future__ import annotations

import tomllib
from pathlib import Path

import jsonschema
import numpy as np
import pytest

import tolstat
from tests.support.environment import ROOT
from tolstat import sampling, study
from tolstat.campaign import remedy, run
from tolstat.common.cardan import MECHANISMS
from tolstat.common.errors import InputError
from tolstat.joint import OperationOfShaft, perturb
from tolstat.solver import fidelity
from tolstat.study import assumptions, changes, mounting, schema
from tolstat.study.points import Point

FACES = 'thrust = { end_play = "0.05 mm", k = "1e8 N/m" }\n'
FREE = 'shaft = { axial = "free", mass = "5 kg", axial_damping = "2e4 N*s/m" }\n'
TUBE = 'tube = { diameter = "76 mm", wall = "2.5 mm" }'
SPLINE = '[shaft.spline]\nat = "0.6 m"\nmu = 0.1\ndiameter = "40 mm"\n'
JOINT = """
[joint]
base = "cirelli2021"
[operation]
alpha = "8 deg"
speed = "1500 rpm"
torque = "100 N*m"
""".replace("[operation]", f"{FACES}[operation]")
SHAFT = f"""[shaft]
alpha = "6 deg"
arrangement = "Z"
length = "1.2 m"
{TUBE}
"""
HEAD = JOINT + SHAFT
SCATTER = '[tolerances]\n"joint*.pin*.offset_t" = { plus_minus = "0.05 mm", distribution = "uniform" }\n'
RANDOM = "[sampling]\nn = 60\n"
WHOLE = HEAD + SCATTER + RANDOM
CASES = HEAD + '[sampling]\nmethod = "cases"\n[[case]]\nname = "tilt"\nerrors.joint1.pin1.tilt_z = "0.1 deg"\n'
ENTRY = '{ plus_minus = "0.05 mm", distribution = "uniform" }'
ZONE = '{ zone = "⌀0.1 mm", over = "22 mm", distribution = "normal", cp = 1.0 }'
FIT = '{ basic = "76 mm", code = "H7/f7", distribution = "normal", cpk = 1.0 }'
ENTRY_OF_SPLINE = '"shaft.spline" = { plus_minus = 1.0, distribution = "uniform" }'
JOINTS = ("joint1", "joint2")


def load(text: str) -> study.Study:
    return study.load(Path("x.toml"), text=text)


def toleranced(entries: str) -> str:
    return f"{HEAD}[tolerances]\n{entries}\n{RANDOM}"


def refused(text: str) -> list[str]:
    """Key path of each fault with what was found, and its remedy."""
    with pytest.raises(InputError) as raised:
        load(text)
    return [f"{fault.place.partition(': ')[2]}: {fault.found} | {fault.remedy}" for fault in raised.value.faults]


def test_the_table_makes_a_study_of_two_joints() -> None:
    read = load(WHOLE)
    assert read.mechanism == MECHANISMS["shaft+thrust"]
    assert read.operation.alphas == pytest.approx(np.radians([8, 6]))
    assert read.points[0].in_words == "8 deg, 1500 rpm, 100 N m, Z arrangement, joint 2 of 6 deg"
    drawn = perturb(read.joint, read.operation, sampling.draw(read))
    assert (drawn["pin_point"][1:] != 0.0).any(axis=2).all()
    assert isinstance(load(CASES).operations[0], OperationOfShaft)
    assert Point.of("", read.points[0].values()) == read.points[0]


POINTS = """[[operation]]
name = "low"
alpha = "8 deg"
speed = "1500 rpm"
torque = "100 N*m"
[[operation]]
name = "high"
alpha = "4 deg"
alpha2 = "3 deg"
speed = "1500 rpm"
torque = "100 N*m"
"""


def with_points(text: str) -> str:
    """Study with two operating points, of which the second has an angle of joint 2 of its own."""
    begin, end = text.index("[operation]"), text.index("[shaft]") if "[shaft]" in text else text.index("[tolerances]")
    return text[:begin] + POINTS + text[end:]


@pytest.mark.parametrize(
    ("spline", "names", "lengths"), [("", ["tube"], [1.2]), (SPLINE, ["tube1", "tube2"], [0.6, 0.6])]
)
def test_the_grade_of_a_tube_is_for_its_own_mass(spline: str, names: list[str], lengths: list[float]) -> None:
    """G 16 at 3000 rpm: 16 mm/s over 314 rad/s, times the mass of 76 x 2.5 mm of steel; the output shaft has none."""
    grade = ', unbalance = { grade = "16 mm/s", speed = "3000 rpm", angle = "90 deg" } }'
    text = WHOLE.replace(' wall = "2.5 mm" }', f' wall = "2.5 mm"{grade}') + spline
    read = load(text)
    assert read.mechanism.unbalanced == (*names, "output")
    assert Point.of("", read.points[0].values()) == read.points[0]
    row = perturb(read.joint, read.operation, sampling.draw(read))[0]
    mass = 7850 * np.pi / 4 * (0.076**2 - 0.071**2) * np.array([*lengths, 0.0])
    np.testing.assert_allclose(row["unbalance"], np.outer(0.016 / (100 * np.pi) * mass, [0, 1]), atol=1e-15)
    turned = refused(text.replace(', angle = "90 deg"', ""))
    assert turned[0].startswith('shaft.tube.unbalance: has no direction | write "tube*.unbalance_angle" = ')
    assert "only shafts with shaft.tube.unbalance have it" in refused(toleranced(f'"tube.unbalance" = {ENTRY}'))[0]


def test_joint_2_may_have_an_angle_at_each_operating_point() -> None:
    read = load(with_points(WHOLE))
    np.testing.assert_allclose([at.operation.alphas for at in read.points], np.radians([[8, 6], [4, 3]]))
    assert [Point.of(at.name, at.values()) for at in read.points] == list(read.points)
    drawn = perturb(read.joint, read.points[1].operation, sampling.draw(read))
    np.testing.assert_allclose(drawn["alpha"][0], np.radians([4, 3]))
    too_far = refused(with_points(WHOLE).replace('"3 deg"', '"93 deg"'))
    assert too_far == ["operation[1].alpha2: a Cardan joint cannot turn at 93 deg | give less than 90 deg"]
    one = refused(with_points(JOINT + SCATTER.replace("joint*.", "") + RANDOM))
    assert one == ["operation[1].alpha2: has no effect: there is one joint | add [shaft], or remove it"]


@pytest.mark.parametrize(
    ("entries", "scattering"),
    [
        (f'"*.pin1.offset_[ez]" = {ENTRY}', [f"{joint}.pin1.offset_{axis}" for joint in JOINTS for axis in "ez"]),
        (f"joint1.pin2.offset_t = {ENTRY}", ["joint1.pin2.offset_t"]),
        (f'"joint2.*.offset_e" = {ENTRY}', [f"joint2.{p}{i}.offset_e" for p in ("pin", "hole") for i in range(1, 5)]),
        (f'"joint*.pin1.clearance" = {ENTRY}', [f"{joint}.pin1.clearance" for joint in JOINTS]),
        (f"fit = {FIT}", [f"{j}.{part}{i}.diameter" for part in ("pin", "hole") for j in JOINTS for i in range(1, 5)]),
        (
            f'"joint*.pin3.position" = {ZONE}',
            [f"{joint}.pin3.{key}" for joint in JOINTS for key in ("offset_t", "offset_z", "tilt_t", "tilt_z")],
        ),
        (
            f'"joint2.input_holes.position" = {ZONE.replace("22 mm", "100 mm")}',
            [f"joint2.hole{i}.{key}" for i in (1, 2) for key in ("offset_t", "offset_z", "tilt_t", "tilt_z")],
        ),
        ('"operation.alpha" = { plus_minus = "1 deg", distribution = "uniform" }', ["operation.alpha"]),
    ],
)  # fmt: skip
def test_errors_of_each_joint_are_selected(entries: str, scattering: list[str]) -> None:
    errors = sampling.draw(load(toleranced(entries)))[1:]
    names = errors.dtype.names or ()
    assert sorted(name for name in names if np.ptp(errors[name]) > 0) == sorted(scattering)


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        (
            HEAD.replace('alpha = "6 deg"', 'alhpa = "6 deg"') + SCATTER + RANDOM,
            ["shaft.alpha: missing key | add shaft.alpha, for example alpha = \"6 deg\"",
             "shaft.alhpa: unknown key | did you mean 'alpha'?"],
        ),
        (
            HEAD + SPLINE.replace("40 mm", "80 mm") + SCATTER + RANDOM,
            ["shaft: spline.diameter = 80 mm is larger than tube.diameter = 76 mm | "
             "give the pitch diameter of the spline"],
        ),
        (
            HEAD.replace('"6 deg"', '"90 deg"') + SCATTER + RANDOM,
            ["shaft.alpha: a Cardan joint cannot turn at 90 deg | give less than 90 deg"],
        ),
        (
            toleranced(f"pin1.offset_t = {ENTRY}"),
            ["tolerances.pin1.offset_t: selects nothing | "
             "write the joint before it: joint1.pin1.offset_t, or joint*.pin1.offset_t for all joints"],
        ),
        (
            toleranced(f'"*.offset_t" = {ENTRY}'),
            ["tolerances.*.offset_t: selects nothing | "
             "write the joint before it: joint1.*.offset_t, or joint*.*.offset_t for all joints"],
        ),
        (
            toleranced(f'"*.pin1.*" = {ENTRY}'),
            ["tolerances.*.pin1.*: selects quantities of different kinds (m, rad) | write one entry for each kind"],
        ),
        (
            toleranced(f'"joint1.operation.alpha" = {ENTRY}'),
            ["tolerances.joint1.operation.alpha: selects nothing | did you mean 'operation.alpha'?"],
        ),
        (
            toleranced("joint1.pin1 = 3"),
            ["tolerances.joint1.pin1: selects nothing | allowed here: offset_e, offset_t, offset_z, tilt_t, tilt_z, "
             "diameter, clearance, offset_radial, position, perpendicularity, angularity"],
        ),
        (
            toleranced(f"joint1.fit = {FIT}"),
            ["tolerances.joint1.fit: is the fit of one joint: a fit is of all | "
             "write tolerances.fit, or the tolerances of the diameters of each joint"],
        ),
        (
            toleranced(f'fit = {FIT}\n"joint2.pin1.diameter" = {ENTRY}'),
            ["tolerances.joint2.pin1.diameter: joint2.pin1.diameter is set by tolerances.fit already | "
             "remove one of the two, or narrow the pattern"],
        ),
        (
            WHOLE + '[[correlation]]\nbetween = ["pin1.offset_t", "joint2.pin1.offset_t"]\nrho = 0.5\n',
            ["correlation[0].between: 'pin1.offset_t' has no tolerance | "
             "write the joint before it: joint1.pin1.offset_t, or joint*.pin1.offset_t for all joints"],
        ),
        (
            WHOLE + '[limits]\n"*.F" = "900 N"\n"joint3.cross1.F" = "900 N"\njoint1.psi = 1e-3\n',
            ["limits.*.F: selects nothing | write the joint before it: joint1.*.F, or joint*.*.F for all joints",
             "limits.joint3.cross1.F: selects nothing | did you mean 'joint2.cross1.F'?",
             "limits.joint1.psi: selects nothing | did you mean 'psi'?"],
        ),
        (
            WHOLE + '[output]\nresults = ["cross*.F_max"]\n',
            ["output.results[0]: 'cross*.F_max' selects nothing | did you mean '*.cross*.F_max'?"],
        ),
        (
            WHOLE.replace("[operation]", f"{FREE}[operation]") + SPLINE,
            ['joint.shaft.axial: is free beside a spline: nothing holds the shaft | write axial = "rigid"'],
        ),
        (
            WHOLE + '[solver]\nfidelity = "ideal"\n',
            ["solver.fidelity: 'ideal' does not hold for a drive shaft: its closed forms are those of one joint | "
             'write "quasistatic" or "dynamic"'],
        ),
        (
            WHOLE.replace(FACES, ""),
            ["joint.thrust: missing: pins that slide freely locate no tube across its axis | "
             'give end_play = "0.02 mm" and k = "1e8 N/m", of yours, or remove [shaft]'],
        ),
        (
            WHOLE.replace(TUBE, 'tube = { diameter = "76 mm" }'),
            ["shaft.tube: has diameter without wall | add wall"],
        ),
        (
            WHOLE.replace(TUBE, "tube = {}"),
            ['shaft.tube: has neither a section nor a mass | give diameter = "76 mm" and wall = "2.5 mm", of yours'],
        ),
        (
            WHOLE.replace(TUBE, TUBE.replace(" }", ', mass = "5 kg" }')),
            ["shaft.tube: has diameter and wall beside mass | remove diameter and wall, or mass"],
        ),
        (
            WHOLE.replace(TUBE, 'tube = { diameter = "76 mm", wall = "40 mm" }'),
            ["shaft.tube: its wall is thicker than half of its diameter | check wall and diameter"],
        ),
        (
            WHOLE + SPLINE.replace("0.6 m", "1.3 m"),
            ["shaft: spline.at = 1.3 m is not between the joints | give less than length"],
        ),
        (
            WHOLE + SPLINE.replace('diameter = "40 mm"', ""),
            ['shaft.spline.diameter: missing key | add shaft.spline.diameter, for example diameter = "40 mm"'],
        ),
        (
            WHOLE.replace(TUBE, TUBE + "\ntube2" + TUBE[4:]),
            ["shaft: has tube2 without a spline | remove tube2, or add [shaft.spline]"],
        ),
        (
            WHOLE.replace('"Z"', '"X"'),
            ["shaft.arrangement: 'X' is neither a word of this key nor a number with a unit | "
             'write "Z", "W" or a quantity such as "0.5 deg"'],
        ),
        (
            WHOLE.replace("[shaft]", 'axial_force = "20 N"\n[shaft]'),
            ["operation.axial_force: has no effect: the output shaft is rigid along its axis | remove it"],
        ),
        (
            WHOLE.replace("[operation]", 'shaft.spline = { mu = 0.1, diameter = "40 mm" }\n[operation]'),
            ["joint.shaft.spline: is that of one joint | write shaft.spline, that of the tubes, or remove it"],
        ),
        (
            toleranced(ENTRY_OF_SPLINE),
            ["tolerances.shaft.spline: selects nothing | only shafts with shaft.spline have it: add that, or remove "
             "this entry"],
        ),
    ],
)  # fmt: skip
def test_what_two_joints_cannot_have_is_refused(text: str, faults: list[str]) -> None:
    assert refused(text) == faults


def test_names_of_a_joint_are_refused_where_there_is_one() -> None:
    text = WHOLE.replace(SHAFT, "").replace("joint*.", "")
    assert load(text).mechanism == MECHANISMS["cardan+thrust"]
    text += '[limits]\n"joint1.cross1.F" = "900 N"\n'
    assert refused(text) == ["limits.joint1.cross1.F: selects nothing | did you mean 'cross1.F'?"]


def test_shafts_with_a_spline_are_not_freed() -> None:
    """Their mounting is no assumption, and no note tells to free them; without a spline it does."""
    along = toleranced(f'"joint*.pin*.offset_z" = {ENTRY}')
    for text, splined in ((along, False), (along + SPLINE, True)):
        read = load(text)
        assert ("mounting" in assumptions.given(read)) == splined
        assert ("mounting" not in [assumption.name for assumption in assumptions.assumptions(read)]) == splined
        note = mounting.note_on_shafts(read.tolerances, ["rigid"], read.mechanism, "tolstat run x.toml")
        assert note.endswith("" if splined else "With a free output shaft: tolstat run x.toml")
        assert bool(note) != splined


def test_the_second_joint_may_be_too_fast() -> None:
    fast = WHOLE.replace("1500 rpm", "5000 rpm")
    assert list(assumptions.warnings(load(fast.replace('"8 deg"', '"5 deg"')))) == []
    (warning,) = assumptions.warnings(load(fast.replace('"6 deg"', '"7 deg"').replace('"8 deg"', '"5 deg"')))
    assert "5000 rpm at 7 deg: speed times angle, 35000 rpm deg" in warning.found


def test_keys_of_the_second_joint_are_changed() -> None:
    read = load(WHOLE)
    changed = changes.read(read, changes.with_settings(read, ["shaft.alpha=8 deg"]))
    assert changed.operation.alphas == pytest.approx(np.radians([8, 8]))
    one = study.load(ROOT / "studies" / "iso2768_f.toml")
    with pytest.raises(InputError, match="is in section 'shaft', which changes no joint"):
        changes.with_settings(one, ["shaft.alpha=8 deg"])


def test_editors_know_both_joints() -> None:
    known = jsonschema.Draft7Validator(schema.schema("study"))
    dotted = toleranced(
        f'joint1.pin2.offset_t = {ENTRY}\njoint2."hole*.tilt_t" = {{ plus_minus = "1 deg", distribution = "uniform" }}'
    )
    limited = WHOLE + '[limits]\n"joint*.cross*.F" = "1 kN"\njoint2.fork1.T = "3 N*m"\n"joint1.cross1.F at a" = "9 N"\n'
    for text in (WHOLE, CASES, dotted, limited):
        assert list(known.iter_errors(tomllib.loads(text))) == []
    for text in (WHOLE.replace("length", "lenght"), WHOLE.replace("joint*.pin*.offset_t", "joint1.pin1.ofset_t")):
        assert not known.is_valid(tomllib.loads(text))


@pytest.mark.parametrize(
    ("key", "accepted"), [('"bushing.cross.k_x"', True), ('bushing."cross.k_x"', True), ("bushing.cross.k_x", False)]
)
def test_editors_and_reader_agree_on_keys_of_a_joint_that_are_swept(key: str, accepted: bool) -> None:
    text = f'{HEAD}[sampling]\nmethod = "sweep"\n[sweep]\n{key} = {{ from = "1e9 N/m", to = "2e9 N/m", points = 3 }}\n'
    known = jsonschema.Draft7Validator(schema.schema("study"))
    assert known.is_valid(tomllib.loads(text)) == accepted
    if accepted:
        assert load(text).samples == 3
    else:
        assert refused(text) == ["sweep.bushing.cross: selects nothing | allowed here: k_x, k_y, k_z, k_bx, k_by, k_tz"]


def test_drive_shafts_have_no_closed_form(monkeypatch: pytest.MonkeyPatch) -> None:
    """A pilot of ``auto`` leaves it out, and a retry with it is refused."""
    closed_form: list[bool] = []
    monkeypatch.setattr(fidelity, "choose", lambda *args, **given: closed_form.append(args[6]) or {})
    for text in (WHOLE, toleranced(f'"pin1.offset_t" = {ENTRY}').replace(HEAD, JOINT)):
        run.choose_fidelity(load(text + '[solver]\nfidelity = "auto"\n'))
    assert closed_form == [False, True]
    with pytest.raises(InputError, match=r"--set: solver\.fidelity: 'ideal' does not hold for a drive shaft"):
        remedy.parse_retry("newton_failed", ["solver.fidelity=ideal"], load(WHOLE))


@pytest.mark.slow
def test_psi_of_a_case_is_that_of_the_whole_shaft(tmp_path: Path) -> None:
    """Of one that settles: the revolution that is kept is that of the largest values."""
    path = tmp_path / "case.toml"
    head = (ROOT / "studies" / "shaft.toml").read_text("utf-8").partition("[tolerances]")[0]
    path.write_text(head + '[errors]\njoint2.pin1.tilt_z = "0.2 deg"\n', encoding="utf-8")
    result = tolstat.simulate_case(study.load_case(path))
    largest = result.simulation.results["psi_max"][0]
    assert np.abs(result.to_pandas()["Psi"]).max() == pytest.approx(largest, rel=1e-6)
    assert largest < 1e-3
