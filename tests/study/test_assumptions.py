"""What a study assumes of its joint: which assumptions hold, joints with other values, and faults of the tables."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tolstat import sampling, study
from tolstat.common.errors import InputError
from tolstat.study import starter
from tolstat.study.assumptions import assumptions, given, together, unselected, with_value
from tolstat.study.rewriting import with_settings

STUDIES = Path(__file__).parents[2] / "studies"
HEAD = """[joint]
base = "cirelli2021"
[operation]
alpha = "15 deg"
speed = "500 rpm"
torque = "100 N*m"
[tolerances]
pin1.offset_t = { plus_minus = "0.1 mm", distribution = "normal" }
[sampling]
n = 64
method = "random"
"""
OWN = """
[[assumed]]
name = "arm length"
values = [{ arm.l_f = "30 mm" }, { arm.l_f = "45 mm", arm.mass = "0.35 kg" }]
because = "a fork is no beam"
"""
OF_JOINT = ["mounting", "contact law", "H", "clearance", "inertia of the output shaft", "place of the cross bushings"]


def load(folder: Path, text: str, *keys: str) -> study.Study:
    file = folder / "study.toml"
    file.write_text(text.replace('base = "cirelli2021"\n', "\n".join(['base = "cirelli2021"', *keys, ""])), "utf-8")
    return study.load(file)


def names(s: study.Study) -> list[str]:
    return [own.name for own in assumptions(s) if own.varied]


def test_the_joint_that_comes_with_tolstat_says_what_is_assumed(tmp_path: Path) -> None:
    s = load(tmp_path, HEAD)
    assert names(s) == OF_JOINT
    assert given(s) == ()
    (inert,) = (own for own in assumptions(s) if not own.varied)
    assert inert.values[0].keys() == {"contact.c_t", "contact.delta_d", "hub.mass", "bushing.xi"}
    of = {own.name: own for own in assumptions(s)}
    assert of["contact law"].values == ({"contact.law": "sliced"}, {"contact.law": "uniform"})
    assert of["contact law"].because == "no drawing gives it"


@pytest.mark.parametrize(
    ("keys", "names_given"),
    [
        (['shaft.axial = "free"'], ("mounting",)),
        (['contact.D_P = "75.9 mm"'], ("clearance",)),  # the clearance follows from the diameters
        (['contact.z = "24 mm"'], ("clearance",)),  # its coefficients are no longer those of the joint file
        (['pin.l = "30 mm"'], ("place of the cross bushings",)),
        (['contact.law = "needles"', 'bearing = { needles = 32, needle_length = "22 mm" }'], ("contact law",)),
    ],
)
def test_what_the_study_sets_is_given(tmp_path: Path, keys: list[str], names_given: tuple[str, ...]) -> None:
    s = load(tmp_path, HEAD, *keys)
    assert given(s) == names_given
    assert names(s) == [name for name in OF_JOINT if name not in names_given]
    for own in assumptions(s):
        for value in own.values:
            with_value(s, value)


def test_a_fit_gives_the_clearance(tmp_path: Path) -> None:
    fit = '[tolerances]\nfit = { basic = "76 mm", code = "H7/f7", distribution = "normal" }'
    s = load(tmp_path, HEAD.replace("[tolerances]", fit))
    assert given(s) == ("clearance",)


def test_a_study_adds_assumptions_and_replaces_those_of_the_same_name(tmp_path: Path) -> None:
    s = load(tmp_path, HEAD + OWN)
    assert names(s) == [*OF_JOINT, "arm length"]
    s = load(tmp_path, HEAD + OWN.replace("arm length", "H"))
    assert names(s) == [*(name for name in OF_JOINT if name != "H"), "H"]
    assert assumptions(s)[-1].values[0] == {"arm.l_f": "30 mm"}
    s = load(tmp_path, HEAD + OWN, 'arm.l_f = "38 mm"')  # the file that lists an assumption may have its value, too
    assert names(s)[-1] == "arm length"


def test_they_affect_no_result(tmp_path: Path) -> None:
    s, other = load(tmp_path, HEAD), load(tmp_path, HEAD + OWN)
    assert s.identity() == other.identity()


@pytest.mark.parametrize("name", ["rigid_shafts", "iso2768_f", "needle_bearings", "line_bored", "welded_fork"])
def test_a_value_is_as_if_written_in_the_study(tmp_path: Path, name: str) -> None:
    s = study.load(STUDIES / f"{name}.toml", 8)
    for own in assumptions(s):
        for value in own.values:
            made = with_value(s, value)
            text = with_settings(s.text, [f"joint.{key}={one}" for key, one in value.items()])
            written = study.load(tmp_path / "study.toml", 8, text)
            assert made.identity() == written.identity(), value
            np.testing.assert_array_equal(sampling.draw(made), sampling.draw(s))
            assert made.joint != s.joint


def test_a_key_that_was_named_to_stay_gives_way_to_another_assumption(tmp_path: Path) -> None:
    s = load(tmp_path, HEAD)
    of = {own.name: own.values for own in assumptions(s)}
    for values in ([of["clearance"][0], of["H"][0]], [of["H"][0], of["clearance"][0]]):
        keys = together(s, values)
        assert keys.keys() == {"contact.clearance", "contact.k1u", "contact.k2u", "contact.H"}
        contact = with_value(s, keys).joint.contact
        assert contact.k2p == contact.k2u / 3.0
        assert contact.clearance == pytest.approx(5e-5)
    every = together(s, [values[0] for values in of.values()])
    assert with_value(s, every).joint.shaft.axial == "free"


def test_joints_with_dimensions_of_their_own_have_no_variations() -> None:
    s = study.load(STUDIES / "hard_cases.toml")
    with pytest.raises(InputError, match="no variations of one joint"):
        with_value(s, {"contact.law": "sliced"})


def test_an_axial_force_is_idle_on_a_rigid_shaft(tmp_path: Path) -> None:
    text = HEAD.replace("[tolerances]", 'axial_force = "50 N"\n[tolerances]')
    s = load(tmp_path, text, 'shaft.axial = "free"')
    assert not s.idle_forces
    (found,) = with_value(s, {"shaft.axial": "rigid"}).idle_forces
    assert "operation.axial_force: has no effect" in str(found)


FAULTY = """
[[assumed]]
values = [{ contact.lw = "sliced" }, { pin.l = "80 mm" }]
because = "no drawing gives it"
[[assumed]]
name = "mounting"
values = [{ shaft.axial = "fre" }, { bearing.a_iso = 1.0, bearing.needles = 32 }, { contact.clearance = "0.1" }]
because = "no drawing gives it"
[[assumed]]
name = "mounting"
values = []
"""


def test_faults_are_collected_with_all_others(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        load(tmp_path, HEAD.replace("n = 64", "n = 0") + FAULTY)
    text = str(caught.value)
    assert "assumed[0].name: missing key\n  hint: add assumed[0].name" in text
    assert "assumed[2].because: missing key" in text
    assert "assumed[2].values" in text
    assert "sampling.n" in text
    good = FAULTY.replace("values = []", 'values = [{ shaft.Js = "1 kg*m^2" }]\nbecause = "no"')
    with pytest.raises(InputError) as caught:
        load(tmp_path, HEAD.replace("n = 64", "n = 0") + good.replace("values", 'name = "law"\nvalues', 1))
    text = str(caught.value)
    assert (
        f"{tmp_path / 'study.toml'}:15: assumed[0].values[0].contact.lw: unknown key\n  hint: did you mean 'law'?"
        in text
    )
    assert "assumed[0].values[1].cross: R is not larger than pin.l" in text
    assert "assumed[1].values[0].shaft.axial" in text
    assert "assumed[1].values[1].bearing.a_iso: affects no result\n  hint: remove it" in text
    assert "assumed[1].values[2].contact.clearance: " in text
    assert "assumed[2].name: another one is named 'mounting'" in text
    assert "sampling.n" in text


def test_faults_of_a_joint_file_have_its_place(tmp_path: Path) -> None:
    starter.write(tmp_path / "study.toml", starter.OWN)
    own = tmp_path / "study_joint.toml"
    text = own.read_text("utf-8")
    own.write_text(text.replace("contact.H = 3.0", "contact.H = 1.0"), "utf-8")
    with pytest.raises(InputError) as caught:
        study.load(tmp_path / "study.toml")
    (fault,) = caught.value.faults
    assert fault.place.startswith(f"{own}:")
    assert fault.place.endswith("assumed[2].values[0].contact.H")
    own.write_text(text.replace('because = "taken from another joint"', ""), "utf-8")
    with pytest.raises(InputError, match=r"study_joint.toml:\d+: assumed\[2\].because: missing key"):
        study.load(tmp_path / "study.toml")


def test_a_study_does_not_replace_them_under_joint(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="assumed: is no key that a study or case replaces"):
        load(tmp_path, HEAD, "assumed = []")


def test_a_clearance_that_a_fit_sets_is_not_assumed(tmp_path: Path) -> None:
    fit = '[tolerances]\nfit = { basic = "76 mm", code = "H7/f7", distribution = "normal" }'
    own = OWN.replace('arm.l_f = "30 mm"', 'contact.clearance = "0.1 mm"')
    with pytest.raises(
        InputError, match=r"assumed\[0\].values\[0\].contact.clearance: is set by tolerances.fit already"
    ):
        load(tmp_path, HEAD.replace("[tolerances]", fit) + own)


def test_a_joint_file_of_ones_own_begins_with_assumptions(tmp_path: Path) -> None:
    starter.write(tmp_path / "study.toml", starter.OWN)
    s = study.load(tmp_path / "study.toml")
    sliding = "mass and damping of a sliding shaft"
    assert names(s) == ["pin length", "arm length", "H", "mounting", "contact law", sliding]
    for own in assumptions(s):
        assert any(with_value(s, value).joint != s.joint for value in own.values)


def test_errors_that_no_entry_selects_are_taken_as_exact(tmp_path: Path) -> None:
    exact = unselected(load(tmp_path, HEAD))
    assert exact == (
        *("positions of pin1 along e and z", "positions of pin2, pin3 and pin4", "pin angles", "pin diameters"),
        *("hole positions", "hole angles", "hole diameters"),
    )
    diameters = HEAD.replace("pin1.offset_t", '"pin*.clearance"').replace("0.1 mm", "0.01 mm")
    s = load(tmp_path, diameters)
    assert "pin diameters" not in unselected(s)
    assert "hole diameters" not in unselected(s)
    for name, expected in {
        "iso2768_f": (),
        "needle_bearings": ("pin positions along the pin axes", "hole positions along the hole axes"),
        "hard_cases": (),
        "clearance": (),
    }.items():
        assert unselected(study.load(STUDIES / f"{name}.toml")) == expected
