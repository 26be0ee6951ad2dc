"""Drive shafts whose joint 2 is from a joint file of its own: `[shaft.joint2]`."""

from __future__ import annotations

import tomllib

import jsonschema
import numpy as np
import pytest

from tests.study.test_shaft import FREE, HEAD, RANDOM, SCATTER, SPLINE, load, refused
from tests.support.environment import ROOT
from tolstat import sampling, study
from tolstat.common.errors import InputError
from tolstat.common.tables import blank_params
from tolstat.joint import mechanism_of, nominal_errors, perturb
from tolstat.questions.assumptions.variations import label_of
from tolstat.study import assumptions, changes, placing, schema
from tolstat.study.points import Point

ENDS = 'input.bearings = ["80 mm", "240 mm"], output.bearings = ["100 mm", "150 mm"]'
RIGID = f'shaft = {{ axial = "rigid", {ENDS} }}\n'
OWN = f'[shaft.joint2]\nbase = "pin25"\n{RIGID}'
REST = SPLINE + SCATTER + RANDOM
WHOLE = HEAD + OWN + REST
FACES = 'thrust = { end_play = "0.05 mm", k = "1e8 N/m" }\n'


def test_each_joint_has_the_parameters_of_its_file() -> None:
    """Those of a shaft of two joints 1 and of a shaft of two joints 2, side by side."""
    read, both = load(WHOLE), sampling.draw(load(WHOLE), range(1, 4))
    found = perturb(read.joint, read.operation, both)
    of_one = read.operation.shaft.model_copy(update={"joint2": None})
    second, alone = read.operation.joint2, read.operation.model_copy(update={"shaft": of_one})
    assert second is not None
    one, two = (blank_params(3, read.mechanism) for _ in range(2))
    for params, joint in ((one, read.joint), (two, second)):
        made = perturb(joint, alone, nominal(joint, alone, both))
        for name in set(made.dtype.names) & set(params.dtype.names):
            params[name] = made[name] if made[name].shape == params[name].shape else params[name]
    kinds, of_lumps = read.mechanism.bushing_kinds, read.mechanism.lump_kinds
    for name, own in (("k", kinds), ("mass", of_lumps), ("inertia", of_lumps), ("at", of_lumps)):
        for i, kind in enumerate(own):
            expected = two if kind.startswith("joint2") else one
            if kind.startswith("joint"):
                np.testing.assert_array_equal(found[name][:, i], expected[name][:, i], err_msg=kind)
    for name in ("station_s", "station_k1", "station_k3", "needle_b", "c_d", "face_k", "friction_radius"):
        for k, expected in enumerate((one, two)):
            np.testing.assert_array_equal(found[name][:, k], expected[name][:, k], err_msg=name)
    assert found["n_stations"].tolist() == [[3, 5]] * 3
    np.testing.assert_allclose(found["mu"], [[0.0, 0.004]] * 3)  # joint 1 has no friction
    np.testing.assert_array_equal(found["clearance"][:, :4], one["clearance"][:, :4])
    np.testing.assert_array_equal(found["clearance"][:, 4:], two["clearance"][:, 4:])
    np.testing.assert_array_equal(found["face_at"][:, :4], one["face_at"][:, :4])
    np.testing.assert_array_equal(found["face_at"][:, 4:], two["face_at"][:, 4:])
    np.testing.assert_allclose(found["R"], 0.043)
    np.testing.assert_allclose(found["Js"], 0.02)


def nominal(joint, operation, errors):
    """Errors of shafts in the table of another mechanism of two joints."""
    made = nominal_errors(len(errors), mechanism_of(joint, operation))
    for name in set(made.dtype.names) & set(errors.dtype.names):
        made[name] = errors[name]
    return made


def test_the_outer_shafts_are_those_of_their_joints() -> None:
    """Of joint 2's file its output shaft counts, of joint 1's its input shaft, here without bearings."""
    read = load(WHOLE)
    assert read.mechanism.name == "splined shaft+thrust+friction+output_bearings"
    params = perturb(read.joint, read.operation, sampling.draw(read, range(1, 2)))
    np.testing.assert_allclose(params["bearing_at"], [[[0.1, 0.15]]])


def test_a_joint_2_like_joint_1_changes_no_byte() -> None:
    read = load(HEAD + REST)
    same = load(HEAD + f'[shaft.joint2]\nbase = "cirelli2021"\n{FACES}' + REST)
    errors = sampling.draw(read, range(1, 9))
    np.testing.assert_array_equal(sampling.draw(same, range(1, 9)), errors)
    expected = perturb(read.joint, read.operation, errors).tobytes()
    assert perturb(same.joint, same.operation, errors).tobytes() == expected


def test_joint_2_is_kept_with_the_points() -> None:
    read = load(WHOLE)
    (point,) = read.points
    again = Point.of(point.name, point.values())
    errors = sampling.draw(read, range(1, 3))
    assert (
        perturb(read.joint, again.operation, errors).tobytes() == perturb(read.joint, read.operation, errors).tobytes()
    )
    kept = load(WHOLE).identity()
    other = load(WHOLE.replace('base = "pin25"', 'base = "pin25"\ncross.R = "50 mm"')).identity()
    assert {key for key in other if other[key] != kept.get(key)} == {"joint2.cross.R"}
    described = load(WHOLE.replace('base = "pin25"', 'base = "pin25"\ndescription = "another"')).identity()
    assert described == kept
    assert not [key for key in load(HEAD + REST).identity() if "joint2." in key and not key.startswith("tolerances")]


def test_a_fit_is_of_both_joints() -> None:
    fit = '[tolerances]\nfit = { basic = "25 mm", code = "H7/f7", distribution = "normal", cpk = 1.0 }\n'
    read = load(HEAD + OWN + SPLINE + fit + RANDOM)
    joints = read.joint, read.operation.joint2
    assert [(joint.contact.D_P, joint.contact.D_H) for joint in joints if joint] == [
        (read.joint.contact.D_P, read.joint.contact.D_H)
    ] * 2
    twice = refused(HEAD + OWN + 'contact.D_H = "25.1 mm"\n' + SPLINE + fit + RANDOM)
    assert twice == ["shaft.joint2.contact.D_H: is set by tolerances.fit already | remove one of the two"]


@pytest.mark.parametrize(
    ("own", "faults"),
    [
        (
            '[shaft.joint2]\ncross.R = "50 mm"\n',
            ['shaft.joint2.base: missing key | write [shaft.joint2] with base = "mine.toml", the file of joint 2'],
        ),
        (
            'joint2 = "pin25"\n',
            ["shaft.joint2.base: 'pin25' is not a table | "
             'write [shaft.joint2] with base = "mine.toml", the file of joint 2'],
        ),
        (
            OWN + 'cross.r = "50 mm"\n',
            ["shaft.joint2.cross.r: unknown key | did you mean 'R'?"],
        ),
        (
            OWN.replace("pin25", "cirelli2021"),
            ["shaft.joint2.thrust: missing: pins that slide freely locate no tube across its axis | "
             'give end_play = "0.02 mm" and k = "1e8 N/m", of yours, or remove [shaft]'],
        ),
        (
            '[shaft.joint2]\nbase = "cirelli2021"\n' + FACES + FREE,
            ['shaft.joint2.shaft.axial: is free beside a spline: nothing holds the shaft | write axial = "rigid"'],
        ),
        (
            OWN.replace('axial = "rigid"', 'axial = "rigid", spline = { mu = 0.1, diameter = "40 mm" }'),
            ["shaft.joint2.shaft.spline: is that of one joint | write shaft.spline, that of the tubes, or remove it"],
        ),
        (
            OWN.replace('axial = "rigid"', 'axial = "rigid", unbalance = { amount = "1e-4 kg*m" }'),
            ['shaft.joint2.shaft.unbalance: has no direction | write "output.unbalance_angle" = '
             '{ plus_minus = "180 deg", distribution = "uniform" } under [tolerances], or give its angle'],
        ),
    ],
)  # fmt: skip
def test_faults_are_named_by_the_table_of_joint_2(own: str, faults: list[str]) -> None:
    assert refused(HEAD + own + REST) == faults


def test_one_life_is_required_of_both() -> None:
    bearing = (
        'bearing = { needles = 32, needle_length = "22 mm", needle_diameter = "4 mm", pitch_diameter = "42 mm", '
        'C = "27 kN", required_life = "1000 h" }\n'
    )
    joint = HEAD.replace("[operation]", f"{bearing}[operation]")
    other = OWN + bearing.replace("1000 h", "900 h")
    assert refused(joint + other + REST) == [
        "shaft.joint2.bearing.required_life: differs from that of joint 1: one life is required of both together | "
        "leave it out, or write required_life of joint 1 the same"
    ]
    assert load(joint + other.replace(', required_life = "900 h"', "") + REST).joint.bearing


def test_keys_of_joint_2_are_changed() -> None:
    read = load(WHOLE)
    text = changes.with_settings(read, ["shaft.joint2.cross.R=50 mm"])
    changed = changes.read(read, text)
    assert changed.operation.joint2 is not None
    assert (changed.joint.cross.R, changed.operation.joint2.cross.R) == (read.joint.cross.R, 0.05)
    only = changes.read(read, changes.with_settings(read, ["joint.contact.law=uniform"]))
    assert only.joint.contact.law == "uniform"
    assert only.operation.joint2 == read.operation.joint2
    with pytest.raises(InputError, match=r"--set shaft\.joint2\.base: is another joint"):
        changes.read(read, changes.with_settings(read, ["shaft.joint2.base=cirelli2021"]))


def test_common_axes_of_joint_2_are_as_long_as_its_cross() -> None:
    """Zones of both pins of an axis lie R from the centre of their own joint; so do the warnings about short ones."""
    zone = '{ zone = "⌀0.1 mm", over = "100 mm", distribution = "normal", cp = 1.0 }'
    entry = f'[tolerances]\n"joint*.input_holes.position" = {zone}\n'
    read = load(HEAD + OWN + SPLINE + entry + RANDOM)
    reaches = [read.axes[f"joint{k}.input_holes"].reach for k in (1, 2)]
    assert reaches == pytest.approx([0.07282, 0.043])
    warning, _ = assumptions.warnings(read)  # the other: joint 2 has bearings of the input shaft
    assert "100 mm is shorter than the 146 mm between the bearings" in warning.found


def test_the_files_of_both_joints_go_where_the_study_goes(tmp_path) -> None:
    (tmp_path / "rear.toml").write_text((ROOT / "data" / "joints" / "pin25.toml").read_text(encoding="utf-8"))
    source, target = tmp_path / "a.toml", tmp_path / "far" / "b.toml"
    source.write_text(WHOLE.replace('"pin25"', '"rear.toml"'), encoding="utf-8")
    read = study.load(source)
    text = placing.placed(read.text, source, target)
    assert tomllib.loads(text)["shaft"]["joint2"]["base"] == "../rear.toml"
    assert placing.joints_beside(read) == {}
    (tmp_path / "rear.toml").unlink()
    ((path, written),) = placing.joints_beside(read).items()
    assert path == ("shaft", "joint2")
    (tmp_path / "kept.toml").write_text(written, encoding="utf-8")
    again = study.load(source, text=read.text.replace("rear.toml", "kept.toml"))
    assert again.identity() == read.identity()
    assert study.load(source, text=read.text, joint2=read.operation.joint2).identity() == read.identity()


def test_editors_know_joint_2() -> None:
    known = jsonschema.Draft7Validator(schema.schema("study"))
    assert list(known.iter_errors(tomllib.loads(WHOLE))) == []
    assert not known.is_valid(tomllib.loads(WHOLE.replace(RIGID, 'croos.R = "50 mm"\n')))


def test_keys_of_the_shaft_that_the_other_joint_has_are_told() -> None:
    read = load(HEAD.replace("[joint]\n", "[joint]\nshaft.output.bearings = ['80 mm', '240 mm']\n", 1) + OWN + REST)
    told = [(fault.place.rpartition(": ")[2], fault.found) for fault in assumptions.warnings(read)]
    assert ("joint.shaft.output", "has no effect: the output shaft is that of [shaft.joint2]") in told
    assert ("shaft.joint2.shaft.input", "has no effect: the input shaft is that of [joint]") in told


def test_a_joint_2_that_is_no_table_is_refused_as_a_change() -> None:
    read = load(WHOLE)
    with pytest.raises(InputError, match=r"leaves out .*base.*, which the study sets"):
        changes.with_settings(read, ["shaft.joint2=pin25"])


def test_each_joint_has_the_assumptions_of_its_file() -> None:
    """Values of joint 2's are set in joint 2 alone, at all points; what the study gives of either is not varied."""
    read = load(WHOLE.replace(RIGID, f"{RIGID}friction.mu = 0.01\n"))
    named = {each.name: each.values for each in assumptions.assumptions(read)}
    faces, first = "stiffness of the thrust faces of joint 2", next(name for name in named if "joint 2" not in name)
    assert named[faces][0] == {"shaft.joint2.thrust.k": "5e7 N/m"}
    assert "friction of the needles of joint 2" in assumptions.given(read)
    assert "friction of the needles of joint 2" not in named
    softer, both = named[faces][0], assumptions.together(read, [named[faces][0], named[first][0]])
    assert both == {**softer, **named[first][0]}
    labels = [label_of(name, value) for name, values in named.items() for value in values]
    assert "joint 2: k 5e7 N/m" in labels
    assert len(labels) == len(set(labels))
    changed = assumptions.with_value(read, softer)
    assert changed.joint == read.joint
    for point in changed.points:
        assert point.operation.joint2.thrust.k == 5e7
    assert changed.operation.joint2.friction.mu == 0.01
    assert not assumptions.is_drawn(read, softer)
    assert assumptions.is_drawn(read, {"shaft.joint2.thrust.k": "1e8 N/m"})
