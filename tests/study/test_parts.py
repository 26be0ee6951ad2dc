"""Thrust faces, friction, bearings and unbalance of shafts in studies: what is refused, and what `perturb` makes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.support.held import FACES, FREE, FRICTION, held
from tolstat import study
from tolstat.common.errors import InputError

HEAD = """
[joint]
base = "cirelli2021"
{parts}
[operation]
alpha = "15 deg"
speed = "500 rpm"
torque = "100 N*m"
[tolerances]
"pin1.offset_e" = {{ plus_minus = "0.05 mm", distribution = "normal", cpk = 1.0 }}
{tolerances}
[sampling]
n = 8
seed = 1
{more}
"""
UNIFORM = '= { plus_minus = "1e-2 mm", distribution = "uniform" }'

BELOW = '= {{ {}, distribution = "normal" }}'


def load(folder: Path, parts: str = "", tolerances: str = "", more: str = ""):
    path = folder / "a.toml"
    path.write_text(HEAD.format(parts=parts, tolerances=tolerances, more=more), encoding="utf-8")
    return study.load(path)


REFUSED = {
    "tolerance of faces without faces": (
        {"tolerances": f'"thrust.end_play" {UNIFORM}'},
        "tolerances.thrust.end_play: selects nothing",
        "only joints with joint.thrust have it",
    ),
    "limit on a loss without friction": (
        {"more": '[limits]\nloss = "3 W"'},
        "limits.loss: selects",
        "joint.friction.mu",
    ),
    "faces without stiffness": ({"parts": 'thrust.end_play = "0.02 mm"'}, "thrust.k: missing key", "add thrust.k"),
    "shaft that nothing holds across": (
        {"parts": 'shaft.lateral = "free"'},
        "thrust: missing, and shaft.lateral is not rigid",
        "[joint.thrust]",
    ),
    "negative friction": ({"parts": "friction.mu = -0.1"}, "joint.friction.mu: -0.1 must not be negative", "zero"),
    "friction above 1": ({"parts": "friction.mu = 3"}, "joint.friction.mu: 3 is above 1", "such as 0.05"),
    "friction that scatters below zero": (
        {"parts": "friction.mu = 0.004", "tolerances": f'"friction.mu" {BELOW.format("plus_minus = 0.02")}'},
        ":11: tolerances.friction.mu: takes friction.mu = 0.004 of the joint down to -0.016, below zero",
        "no deviation below -0.004",
    ),
    "friction without a band that scatters below zero": (
        {"parts": "friction.mu = 0.004", "tolerances": f'"friction.m*" {BELOW.format("std = 0.002")}'},
        "tolerances.friction.mu: takes friction.mu = 0.004 of the joint down to -0.00218, below zero",
        "no deviation below -0.004",
    ),
    "friction below zero by a given error": (
        {"parts": "friction.mu = 0.004", "more": '[errors]\n"friction.mu" = -0.01'},
        ":16: errors.friction.mu: takes friction.mu = 0.004 of the joint down to -0.006, below zero",
        "no deviation below -0.004",
    ),
    "faces far away": (
        {"parts": 'thrust = { end_play = "-50 mm", k = "1e8 N/m" }'},
        "joint.thrust: end_play = -50 mm is more than 0.2 cross.R = ",
        "check its unit; give -",
    ),
    "grade in m/s": (
        {"parts": 'shaft.unbalance = { grade = "16 m/s", mass = "5 kg", speed = "3000 rpm" }'},
        "grade: 16 m/s is above G 4000",
        '"16 mm/s"',
    ),
    "grade without unit": ({"parts": "shaft.unbalance.grade = 16"}, "grade: 16 has no unit", 'write "16 mm/s"'),
    "grade with its letter": ({"parts": 'shaft.unbalance.grade = "G16"'}, "'G16' is not a number", 'write "16 mm/s"'),
    "bearings in the wrong order": (
        {"parts": 'shaft.input.bearings = ["240 mm", "80 mm"]'},
        "shaft.input.bearings: 240 mm, 80 mm are not in order",
        "nearer bearing first",
    ),
    "grade without mass": (
        {"parts": 'shaft.unbalance.grade = "16 mm/s"'},
        "has grade without speed",
        "add speed",
    ),
    "unbalance without direction": (
        {"parts": 'shaft.unbalance.amount = "1e-3 kg*m"'},
        "shaft.unbalance: has no direction",
        '"output.unbalance_angle" =',
    ),
    "closed form with friction": (
        {"parts": "friction.mu = 0.1", "more": '[solver]\nfidelity = "ideal"'},
        "'ideal' does not hold with friction",
        "quasistatic",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refusals_name_place_and_remedy(tmp_path: Path, name: str) -> None:
    sections, found, remedy = REFUSED[name]
    with pytest.raises(InputError) as raised:
        load(tmp_path, **sections)
    assert found in str(raised.value)
    assert remedy in str(raised.value)


def test_friction_may_scatter_down_to_zero(tmp_path: Path) -> None:
    tolerance = '"friction.mu" = { plus_minus = 0.004, distribution = "uniform" }'
    more = '[errors]\n"thrust.end_play" = "0.1 mm"'
    parts = 'friction.mu = 0.004\nthrust = { end_play = "-0.5 mm", k = "1e8 N/m" }'
    assert "friction.mu" in load(tmp_path, parts, tolerance, more).tolerances


def test_all_joints_of_a_study_have_the_same_parts(tmp_path: Path) -> None:
    cases = """
[[case]]
name = "one"
errors."pin1.offset_t" = "0.1 mm"
[[variant]]
name = "with"
joint.thrust = { end_play = "0 mm", k = "1e8 N/m" }
[[variant]]
name = "without"
"""
    text = HEAD.format(parts="", tolerances="", more=cases).replace("n = 8\nseed = 1", 'method = "cases"')
    (tmp_path / "a.toml").write_text(text.partition("[tolerances]")[0] + text[text.index("[sampling]") :], "utf-8")
    with pytest.raises(InputError, match="some joints of the study have thrust, others have none"):
        study.load(tmp_path / "a.toml")


def test_faces_stand_half_the_end_play_apart() -> None:
    rows, mechanism = held({"thrust.end_play": -2e-5}, shaft=FREE, thrust=FACES)
    z = 22e-3  # contact.z
    assert [face.name for face in mechanism.faces] == ["thrust1", "thrust2", "thrust3", "thrust4"]
    np.testing.assert_allclose(rows["face_at"][0], [[z / 2, z / 2 + 1.5e-5]] * 4, rtol=1e-12)
    assert (rows["face_k"][0], rows["face_c"][0]) == (1e8, 2e3)


def test_friction_acts_at_its_radius_with_the_coefficient_of_each_joint() -> None:
    rows, _ = held({"friction.mu": 0.03}, friction=FRICTION)
    assert rows["mu"][0] == pytest.approx(0.13)
    assert rows["friction_radius"][0] == pytest.approx(0.019)


def test_bearings_lie_before_and_behind_the_joint() -> None:
    ends = {"input": {"bearings": ["80 mm", "240 mm"]}, "output": {"bearings": ["0.1 m", "0.15 m"]}}
    rows, mechanism = held(shaft=ends)
    assert [shaft.borne for shaft in mechanism.shafts] == [True, True]
    np.testing.assert_allclose(rows["bearing_at"][0], [[-0.08, -0.24], [0.1, 0.15]])


def test_a_grade_is_distance_times_speed() -> None:
    """G 16 of 5 kg at 3000 rpm: 16 mm/s / 314.2 rad/s, 51 um."""
    unbalance = {"grade": "16 mm/s", "mass": "5 kg", "speed": "3000 rpm", "angle": "30 deg"}
    rows, _ = held({"output.unbalance_angle": np.radians(60.0)}, shaft={"unbalance": unbalance})
    np.testing.assert_allclose(rows["unbalance"][0], [[0.0, 5 * 0.016 / (100 * np.pi)]], atol=1e-15)


def test_a_spline_that_sticks_pulls_like_an_axial_force() -> None:
    """2 mu T/d at 100 N m, mu 0.1, d 40 mm: 500 N."""
    spline = {"spline": {"mu": 0.1, "diameter": "40 mm"}}
    rows, mechanism = held({"shaft.spline": -0.5}, shaft=FREE | spline, axial_force=30.0)
    assert mechanism.spline
    assert rows["F_a"][0] == pytest.approx(30.0 - 250.0)
    rows, _ = held({"shaft.spline": -1.5}, shaft=FREE | spline)
    assert np.isnan(rows["F_a"][0]), "no spline holds more than its largest force"
