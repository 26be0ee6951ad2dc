"""What holds the output shaft along its axis, in studies and cases: axial forces, sweeps, variants, closed forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.support.of_cardan import without_results
from tolstat import sampling, study
from tolstat.campaign import remedy
from tolstat.common.cardan import CARDAN, MECHANISMS
from tolstat.common.errors import InputError
from tolstat.common.tables import Options, Simulation
from tolstat.joint import operating, perturb
from tolstat.joint.ideal import NO_CLOSED_FORM
from tolstat.solver import fidelity
from tolstat.study.mounting import note_on_pins, note_on_shafts

HEAD = """[joint]
base = "cirelli2021"
shaft.axial = "free"
[operation]
alpha = "15 deg"
speed = "500 rpm"
torque = "100 N*m"
axial_force = "-200 N"
"""
DRAWN = """[tolerances]
pin1.offset_t = { plus_minus = "0.1 mm", distribution = "normal" }
[sampling]
n = 64
method = "random"
"""
SCATTER = '[tolerances]\noperation.axial_force = { plus_minus = "500 N", distribution = "uniform" }\n'
RIGID = ('shaft.axial = "free"', "")
NO_FORCE = ('axial_force = "-200 N"', "")
IDEAL = ("[sampling]", '[solver]\nfidelity = "ideal"\n[sampling]')
NO_EFFECT = "has no effect: the output shaft is rigid along its axis"


def load(folder: Path, *changes: tuple[str, str], text: str = HEAD + DRAWN) -> study.Study:
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    (folder / "study.toml").write_text(text, encoding="utf-8")
    return study.load(folder / "study.toml")


def faults(folder: Path, *changes: tuple[str, str], text: str = HEAD + DRAWN) -> str:
    with pytest.raises(InputError) as caught:
        load(folder, *changes, text=text)
    return str(caught.value)


def test_an_axial_force_is_part_of_the_operating_point(tmp_path: Path) -> None:
    s = load(tmp_path)
    assert s.operation.axial_force == -200.0
    assert s.identity()["operation.axial_force"] == -200.0
    assert s.points[0].in_words == "15 deg, 500 rpm, 100 N m, axial force -200 N"
    assert load(tmp_path, NO_FORCE).points[0].in_words == "15 deg, 500 rpm, 100 N m"
    assert s.joint_in_words == "output shaft free along its axis; contact law mode"
    assert s.no_closed_form == [NO_CLOSED_FORM]
    assert not load(tmp_path, NO_FORCE).no_closed_form


def test_an_axial_force_scatters(tmp_path: Path) -> None:
    """About that of the operating point, and without a change of what else is drawn."""
    plain = sampling.draw(load(tmp_path))
    s = load(tmp_path, ("[tolerances]\n", SCATTER))
    errors = sampling.draw(s)
    own = errors["operation.axial_force"]
    assert own[0] == 0.0
    assert -500.0 < own.min() < -300.0 < 300.0 < own.max() < 500.0
    np.testing.assert_array_equal(errors["pin1.offset_t"], plain["pin1.offset_t"])
    np.testing.assert_array_equal(operating(s.operation, errors)["axial_force"], own - 200.0)
    np.testing.assert_array_equal(perturb(s.joint, s.operation, errors)["F_a"], own - 200.0)
    assert load(tmp_path, NO_FORCE, ("[tolerances]\n", SCATTER)).no_closed_form == [NO_CLOSED_FORM]


def test_an_axial_force_on_rigid_shafts_is_refused(tmp_path: Path) -> None:
    said = faults(tmp_path, RIGID)
    assert f"study.toml:8: operation.axial_force: {NO_EFFECT}" in said
    assert 'hint: write shaft.axial = "free" or a stiffness under [joint], or remove it' in said
    load(tmp_path, RIGID, ("-200 N", "0 N"))
    said = faults(tmp_path, RIGID, NO_FORCE, ("[tolerances]\n", SCATTER))
    assert f"tolerances.operation.axial_force: {NO_EFFECT}" in said
    points = HEAD.replace("[operation]", '[[operation]]\nname = "a"')
    points += HEAD.partition("[operation]")[2].join(['[[operation]]\nname = "b"', ""]).replace("-200", "0")
    assert f"operation[0].axial_force: {NO_EFFECT}" in faults(tmp_path, RIGID, text=points + DRAWN)
    assert load(tmp_path, text=points + DRAWN).at("a").no_closed_form == [NO_CLOSED_FORM]
    assert not load(tmp_path, text=points + DRAWN).at("b").no_closed_form


def test_settings_without_effect_are_refused_with_the_other_faults(tmp_path: Path) -> None:
    told = faults(tmp_path, RIGID, ('plus_minus = "0.1 mm"', 'plus_minus = "0.1"'))
    assert f"study.toml:8: operation.axial_force: {NO_EFFECT}" in told
    assert "tolerances.pin1.offset_t" in told


def test_a_case_has_the_same_rules(tmp_path: Path) -> None:
    path = tmp_path / "case.toml"
    path.write_text(HEAD, encoding="utf-8")
    assert study.load_case(path).operation.axial_force == -200.0
    path.write_text(HEAD.replace(*RIGID), encoding="utf-8")
    with pytest.raises(InputError, match=rf"case.toml:8: operation.axial_force: {NO_EFFECT}"):
        study.load_case(path)
    path.write_text(HEAD + '[solver]\nfidelity = "ideal"\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"solver.fidelity: 'ideal' does not hold with an axial force"):
        study.load_case(path)


SWEEP = """[sampling]
method = "sweep"
[sweep]
shaft.axial = { from = "1e6 N/m", to = "1e8 N/m", points = 3 }
operation.axial_force = { from = "0 N", to = "100 N", points = 2 }
"""


def test_stiffness_and_force_are_swept(tmp_path: Path) -> None:
    s = load(tmp_path, RIGID, text=HEAD + SWEEP)
    errors = sampling.draw(s)
    at = [
        perturb(joint, s.operation, errors[row : row + 1])
        for row, joint in enumerate(s.joints[k] for k in s.design["variant"])
    ]
    assert [float(p["k_a"][0]) for p in at] == [0.0, 1e6, 1e6, 5.05e7, 5.05e7, 1e8, 1e8]
    assert [float(p["F_a"][0]) for p in at] == [0.0, 0.0, 100.0, 0.0, 100.0, 0.0, 100.0]
    assert (
        "shafts rigid along their axes in 1 of 4 variants, output shaft held with 1e+06 to 1e+08 N/m"
        in s.joint_in_words
    )
    found = faults(tmp_path, ('from = "1e6 N/m"', 'from = "free"'), text=HEAD + SWEEP)
    assert "sweep.shaft.axial.from: 'free' is not a number with a unit" in found
    only = SWEEP.replace('shaft.axial = { from = "1e6 N/m", to = "1e8 N/m", points = 3 }\n', "")
    assert f"sweep.operation.axial_force: {NO_EFFECT}" in faults(tmp_path, RIGID, NO_FORCE, text=HEAD + only)


CASES = """[sampling]
method = "cases"
[[case]]
name = "tilt"
errors.pin1.tilt_z = "0.1 deg"
[[variant]]
name = "rigid"
joint.shaft.axial = "rigid"
[[variant]]
name = "held"
joint.shaft.axial = "2e7 N/m"
operation.axial_force = "70 N"
"""


def test_words_are_varied(tmp_path: Path) -> None:
    s = load(tmp_path, NO_FORCE, text=HEAD + CASES)
    assert [joint.shaft.axial for joint in s.joints] == ["rigid", 2e7]
    assert s.variants[0].values == {"shaft.axial": "rigid"}
    assert s.variants[1].values == {"shaft.axial": 2e7, "operation.axial_force": 70.0}
    assert s.no_closed_form == [NO_CLOSED_FORM]
    wrong = ('joint.shaft.axial = "2e7 N/m"', 'points = 2\nvary.shaft.axial = { from = "2e7 N/m", to = "free" }')
    assert "'free' is not a quantity that can vary" in faults(tmp_path, NO_FORCE, wrong, text=HEAD + CASES)
    one = ('joint.shaft.axial = "2e7 N/m"', 'joint.shaft.axial = "rigid"')
    assert f"variant.axial_force: {NO_EFFECT}" in faults(tmp_path, NO_FORCE, one, text=HEAD + CASES)


def test_closed_forms_are_refused_with_an_axial_force(tmp_path: Path) -> None:
    said = faults(tmp_path, IDEAL)
    assert "solver.fidelity: 'ideal' does not hold with an axial force on an output shaft that is not rigid" in said
    assert 'hint: write fidelity = "quasistatic", or leave the axial force out' in said
    load(tmp_path, IDEAL, NO_FORCE)
    assert "does not hold" in faults(tmp_path, IDEAL, NO_FORCE, ("[tolerances]\n", SCATTER))
    s = load(tmp_path)
    with pytest.raises(InputError, match=r"--set: solver.fidelity: 'ideal' does not hold"):
        remedy.parse_retry("newton_failed", ["solver.fidelity='ideal'"], s)


@pytest.mark.parametrize("closed_form", [True, False])
def test_auto_tries_closed_forms_where_they_hold(closed_form: bool) -> None:
    tried = []

    def simulate(params: np.ndarray, options: Options) -> Simulation:
        tried.append(options.fidelity)
        return Simulation(without_results(len(params), 1), {})

    fidelity.choose(np.zeros(2), Options(), 0.01, [], simulate, closed_form=closed_form)
    assert (2 in tried) is closed_form


def test_a_note_where_rigid_shafts_decide() -> None:
    said = note_on_shafts(["pin1.offset_t", "pin1.offset_z"], ["rigid"], CARDAN, "tolstat run x")
    assert said.endswith("With a free output shaft: tolstat run x")
    assert note_on_shafts(["hole2.position_inner"], ["rigid", "rigid"], CARDAN, "x")
    assert not note_on_shafts(["pin1.offset_t", "hole1.tilt_z"], ["rigid"], CARDAN, "x")
    assert not note_on_shafts(["pin1.offset_z"], ["rigid", "free"], CARDAN, "x")
    assert not note_on_shafts(["pin1.offset_z"], [2e7], CARDAN, "x")


def test_a_note_where_nothing_holds_pins_along_their_holes() -> None:
    free, held = MECHANISMS["cardan+friction"], MECHANISMS["cardan+thrust+friction"]
    assert "without thrust faces" in note_on_pins(["pin1.offset_t", "hole3.offset_e"], free)
    assert not note_on_pins(["pin1.offset_t", "hole1.position_inner"], free)
    assert not note_on_pins(["pin1.offset_t", "hole3.offset_e"], held)


SPLINE = ('shaft.axial = "free"\n', 'shaft.axial = "free"\nshaft.spline = { mu = 0.1, diameter = "40 mm" }\n')
DUTY = """[[operation]]
name = "cruise"
alpha = "15 deg"
speed = "500 rpm"
torque = "100 N*m"
axial_force = "-200 N"
[[operation]]
name = "reverse"
alpha = "15 deg"
speed = "500 rpm"
torque = "-300 N*m"
"""


def test_the_force_of_a_spline_follows_the_torque_of_each_point_and_joint(tmp_path: Path) -> None:
    """2 mu |T|/d at most, added to the force of the point: 500 N at 100 N m, 1500 N at -300 N m; mu 0.1, d 40 mm."""
    text = HEAD.partition("[operation]")[0] + DUTY + DRAWN
    torque = '[tolerances]\noperation.torque = { plus_minus = "10 N*m", distribution = "uniform" }\n'
    s = load(tmp_path, SPLINE, ("[tolerances]\n", torque), text=text)
    assert s.tolerances["shaft.spline"].describe() == {"distribution": "uniform", "lower": -1.0, "upper": 1.0}
    errors = sampling.draw(s)
    own = errors["shaft.spline"]
    assert own[0] == 0.0
    assert -1.0 < own.min() < -0.9 < 0.9 < own.max() < 1.0
    for point, force in zip(s.points, (-200.0, 0.0), strict=True):
        at = point.operation.torque + errors["operation.torque"]
        expected = force + own * 2.0 * 0.1 * np.abs(at) / 0.04
        np.testing.assert_allclose(perturb(s.joint, point.operation, errors)["F_a"], expected, rtol=1e-13)
    assert s.no_closed_form == [NO_CLOSED_FORM]
    assert s.mechanism is MECHANISMS["cardan+spline"]


def test_the_tolerance_of_a_spline_can_be_written(tmp_path: Path) -> None:
    narrow = '[tolerances]\nshaft.spline = { plus_minus = 0.5, distribution = "uniform" }\n'
    s = load(tmp_path, SPLINE, ("[tolerances]\n", narrow))
    assert s.tolerances["shaft.spline"].describe()["upper"] == 0.5
    assert list(s.tolerances).count("shaft.spline") == 1
    fixed = load(tmp_path, SPLINE, ("[tolerances]\n", "[errors]\nshaft.spline = 1.0\n[tolerances]\n"))
    assert "shaft.spline" not in fixed.tolerances
    assert fixed.errors == {"shaft.spline": 1.0}


def test_a_spline_is_refused_where_it_means_nothing(tmp_path: Path) -> None:
    rigid = ('shaft.axial = "free"\n', "")
    assert f"joint.shaft.spline: {NO_EFFECT}" in faults(tmp_path, SPLINE, rigid, NO_FORCE)
    wrong = SPLINE[1].replace("0.1", "1.2"), SPLINE[1].replace("40 mm", "-40 mm")
    assert "shaft.spline.mu: 1.2 is above 1" in faults(tmp_path, (SPLINE[0], wrong[0]))
    assert "shaft.spline.diameter" in faults(tmp_path, (SPLINE[0], wrong[1]))
    without = '[tolerances]\nshaft.spline = { plus_minus = 1, distribution = "uniform" }\n'
    assert "only joints with joint.shaft.spline have it" in faults(tmp_path, ("[tolerances]\n", without))


@pytest.mark.parametrize(
    ("diameter", "entry", "words"),
    [
        ("40 mm", '[tolerances]\nshaft.spline = { plus_minus = 2, distribution = "uniform" }\n', "reaches"),
        ("40 mm", "[errors]\nshaft.spline = -1.5\n[tolerances]\n", "errors.shaft.spline: reaches -1.5"),
        ("0.4 mm", "[tolerances]\n", "0.4 mm is no pitch diameter of a spline"),
        ("40 m", "[tolerances]\n", "40 m is no pitch diameter of a spline"),
    ],
)
def test_a_spline_that_no_shaft_has_is_refused(tmp_path: Path, diameter: str, entry: str, words: str) -> None:
    spline = SPLINE[0], SPLINE[1].replace("40 mm", diameter)
    assert words in faults(tmp_path, spline, ("[tolerances]\n", entry))


def test_a_spline_may_hold_all_of_its_force(tmp_path: Path) -> None:
    for law in ("uniform", "normal"):
        entry = f'[tolerances]\nshaft.spline = {{ plus_minus = 1, distribution = "{law}" }}\n'
        assert "shaft.spline" in load(tmp_path, SPLINE, ("[tolerances]\n", entry)).tolerances


def test_a_case_says_which_force_is_stuck(tmp_path: Path) -> None:
    path = tmp_path / "case.toml"
    path.write_text(HEAD.replace(*SPLINE) + '[errors]\nshaft.spline = "-1"\n', encoding="utf-8")
    assert study.load_case(path).errors == {"shaft.spline": -1.0}
