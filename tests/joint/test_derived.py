"""Keys of a joint that follow from others: formulas, overrides of a joint file, warnings."""

from __future__ import annotations

import math
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tolstat import joint as joints
from tolstat.common import files, units
from tolstat.common.errors import InputError
from tolstat.common.strict import validate
from tolstat.joint import Joint, derived, material
from tolstat.joint.derived import BEARING, DERIVED, get
from tolstat.joint.model import leaves, nested
from tolstat.joint.sections import quantities

FILE = files.data_dir() / "joints" / "cirelli2021.toml"
GIVEN = {
    key: value for key, value in leaves(tomllib.loads(FILE.read_text(encoding="utf-8"))).items() if key != "assumed"
}
UNITS = quantities(Joint)
RECTANGLE = {"arm.width": "58 mm", "arm.depth": "21 mm"}
ROUND = {"arm.d": "40 mm"}
OWN = """
[material]
E = "210 GPa"
nu = 0.3
rho = "7850 kg/m^3"
[pin]
l = "18 mm"
d = "20 mm"
[arm]
l_f = "25 mm"
width = "40 mm"
depth = "14 mm"
[cross]
R = "40 mm"
[shaft]
Js = "0.001 kg*m^2"
[bushing]
xi = 0.04
[contact]
law = "mode"
clearance = "0.03 mm"
z = "16 mm"
H = 6.9
fit_load = "20 kN"
xi = 0.05
c_t = "200 N*s/m"
delta_d = "1 um"
"""
"""A joint file without any key that follows from others."""


def overridden(**keys: object) -> Joint:
    return joints.load("cirelli2021", nested({key.replace("__", "."): value for key, value in keys.items()}), "case")


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Joint:
    path = tmp_path_factory.mktemp("own") / "own.toml"
    path.write_text(OWN, encoding="utf-8")
    return joints.load(path, {}, "case")


# --- a joint file of dimensions alone ----------------------------------------------------------------------


def test_all_that_follows_is_left_out_and_filled_in(own: Joint) -> None:
    assert not leaves(tomllib.loads(OWN)).keys() & (DERIVED.keys() - {"contact.clearance"})
    assert all(get(own, key) is not None for key in DERIVED)
    assert not leaves(own.given()).keys() & (DERIVED.keys() - {"contact.clearance"})
    assert own.warnings() == []


def test_values_by_hand(own: Joint) -> None:
    A, J = math.pi * 0.01**2, math.pi * 0.01**4 / 4
    mass = 7850 * A * 0.018
    assert_allclose([own.pin.A, own.pin.J, own.pin.Jp, own.pin.mass], [A, J, 2 * J, mass])
    assert_allclose(own.pin.inertia, [mass * 0.01**2 / 2, *2 * [mass * (0.01**2 / 4 + 0.018**2 / 12)]])
    arm = 7850 * 0.04 * 0.014 * 0.025
    assert_allclose([own.arm.A, own.arm.mass], [5.6e-4, arm])
    assert_allclose([own.arm.Jx, own.arm.Jy], [0.04 * 0.014**3 / 12, 0.014 * 0.04**3 / 12])
    assert_allclose(own.arm.Jp, own.arm.Jx + own.arm.Jy)
    sides = np.array([0.014, 0.04, 0.025])  # along e, t, z
    assert_allclose(own.arm.inertia, arm / 12 * (np.sum(sides**2) - sides**2))
    assert own.cross.r_b == pytest.approx(0.022)
    E, G = 210e9, 210e9 / 2.6
    assert pytest.approx(G) == own.material.G
    assert_allclose(own.k_cross[:3], [E * A / 0.018, *2 * [G * A / (1.11 * 0.018)]])
    assert_allclose(own.k_cross[3:], [G * 2 * J / 0.018, *2 * [E * J / 0.018]])
    assert_allclose(own.k_fork[:3], [*2 * [G * 5.6e-4 / (1.2 * 0.025)], E * 5.6e-4 / 0.025])
    assert_allclose(own.k_fork[3:], [E * own.arm.Jy / 0.025, E * own.arm.Jx / 0.025, G * own.arm.Jp / 0.025])
    assert_allclose([own.contact.D_P, own.contact.D_H], [0.02, 0.02006])
    omega = (math.pi / 0.018) ** 2 * math.sqrt(E * J / (7850 * A))
    assert own.contact.c_d == pytest.approx(2 * 0.05 * mass * omega)
    k1u, k2u, k1p, k2p = own.contact.coefficients()
    delta = material.contact_displacement(np.array([10e3 / 0.016]), 0.02006, 0.02, E, 0.3)[0]
    assert k1u * delta**2 + k2u * delta == pytest.approx(10e3, rel=0.02)
    assert_allclose([k1p, k2p], [k1u / 6.9**2, k2u / 6.9])


def with_round_arms(folder: Path, line: str = 'd = "30 mm"') -> Path:
    path = folder / "round.toml"
    path.write_text(OWN.replace('width = "40 mm"\ndepth = "14 mm"', line), encoding="utf-8")
    return path


def test_round_arms_by_hand(tmp_path: Path) -> None:
    joint = joints.load(with_round_arms(tmp_path), {}, "case")
    A, J = math.pi * 0.015**2, math.pi * 0.015**4 / 4
    mass = 7850 * A * 0.025
    across = mass * (0.015**2 / 4 + 0.025**2 / 12)
    assert_allclose([joint.arm.A, joint.arm.Jx, joint.arm.Jy, joint.arm.Jp, joint.arm.mass], [A, J, J, 2 * J, mass])
    assert_allclose(joint.arm.inertia, [across, across, mass * 0.015**2 / 2])
    E, G = 210e9, 210e9 / 2.6
    assert joint.arm.chi == 1.11
    assert_allclose(joint.k_fork[:3], [*2 * [G * A / (1.11 * 0.025)], E * A / 0.025])
    assert_allclose(joint.k_fork[3:], [E * J / 0.025, E * J / 0.025, G * 2 * J / 0.025])


def test_an_override_makes_arms_round_or_rectangular(tmp_path: Path) -> None:
    joint = overridden(arm__d="30 mm")
    assert_allclose([joint.arm.chi, joint.arm.A], [1.11, math.pi * 0.015**2])
    assert joint.warnings() == []
    path = with_round_arms(tmp_path)
    back = joints.load(path, nested(RECTANGLE), "case")
    assert back.arm.d is None
    assert_allclose([back.arm.chi, back.arm.A, back.k_fork[2]], [1.2, 0.058 * 0.021, 210e9 * 0.058 * 0.021 / 0.025])


@pytest.mark.parametrize(
    ("line", "place", "found", "remedy"),
    [
        ('d = "30 mm"\nwidth = "20 mm"', "arm.d", "a round section has no width", "remove d, or width"),
        ("", "arm", "missing keys A, Jx, Jy", "give them, or d, or width and depth"),
        ('width = "20 mm"', "arm", "missing keys A, Jx, Jy", "give them, or depth"),
    ],
)
def test_arms_have_one_section(tmp_path: Path, line: str, place: str, found: str, remedy: str) -> None:
    path = with_round_arms(tmp_path, line)
    with pytest.raises(InputError) as caught:
        joints.load(path, {}, "case")
    (fault,) = caught.value.faults
    assert re.sub(r"(?<=round\.toml):\d+", "", fault.place) == f"{path}: {place}"
    assert (fault.found, fault.remedy) == (found, remedy)


def test_crossed_cylinders_against_a_fine_grid() -> None:
    r, half, n = 0.01, 0.022, 121
    edges = np.linspace(-half, half, n + 1)
    x, y, z = np.meshgrid(*3 * [0.5 * (edges[1:] + edges[:-1])], indexing="ij")
    inside = ((y**2 + z**2 < r**2) | (x**2 + z**2 < r**2)).astype(float) * 7850 * (edges[1] - edges[0]) ** 3
    mass, inertia = material.crossed_cylinders(7850, 2 * r, 2 * half)
    assert mass == pytest.approx(inside.sum(), rel=5e-3)
    moments = [(inside * (a**2 + b**2)).sum() for a, b in ((y, z), (x, z), (x, y))]
    assert_allclose(inertia, moments, rtol=5e-3)


def test_the_formulas_give_the_default_joint() -> None:
    """Printed and assumed values of the paper's joint, but for the misprints, within some per cent."""
    joint = joints.load("cirelli2021", {}, "case")
    for key, rule in DERIVED.items():
        given = key in GIVEN and rule.applies(joint)
        # the bearing's diameters are twice the pin's, k1p of Table 2 does not follow from H
        if given and key not in ("contact.D_H", "contact.D_P", "contact.k1p"):
            tolerance = 0.25 if key.startswith(("hub.inertia", "contact.k")) else 0.04 if key == "material.G" else 0.02
            assert_allclose(rule.value(joint), get(joint, key), rtol=tolerance, err_msg=key)


def test_sources_come_before_what_follows_from_them() -> None:
    known = {key for key in UNITS if key not in DERIVED} | set(BEARING)
    assert known >= RECTANGLE.keys() | ROUND.keys()
    for key, rule in DERIVED.items():
        assert set(rule.follows) <= known, key
        known.add(key)
    assert {key: rule.unit for key, rule in DERIVED.items() if key in UNITS} == {
        key: UNITS[key] for key in DERIVED if key in UNITS
    }


# --- overrides ----------------------------------------------------------------------------------------------


def scaled(key: str) -> object:
    """Value of a key of the default joint, a little larger, as a file writes it."""
    joint = joints.load("cirelli2021", nested(ROUND if key in ROUND else RECTANGLE), "case")
    return units.Quantity(UNITS[key]).written(1.001 * get(joint, key))


PAIRS = [(of, key) for key, rule in DERIVED.items() for of in rule.follows if of in UNITS and key not in BEARING]


@pytest.mark.parametrize(("of", "key"), PAIRS)
def test_an_override_moves_what_follows_from_it(of: str, key: str) -> None:
    """Unless it stays with a warning, or is given, too."""
    section = ROUND if of in ROUND else RECTANGLE
    over = {of: scaled(of)} | (section if of.startswith("arm.") and key.startswith("arm.") else {})
    if of in section:
        over[of] = scaled(of)
    joint = joints.load("cirelli2021", nested(over), "case")
    if DERIVED[key].stays:
        assert get(joint, key) == get(joints.load("cirelli2021", {}, "case"), key)
        return
    assert get(joint, key) == DERIVED[key].value(joint)
    assert key not in leaves(joint.given())
    if key in GIVEN:
        again = joints.load("cirelli2021", nested(over | {key: GIVEN[key]}), "case")
        assert get(again, key) == get(joints.load("cirelli2021", {}, "case"), key)


@pytest.mark.parametrize(
    ("over", "changed"),
    [
        ({"contact.law": "point", "contact.c_t": "100 N*s/m", "shaft.Js": "0.1 kg*m^2", "bushing.xi": 0.1}, set()),
        ({"cross.R": "80 mm"}, {"cross.r_b"}),
        (
            {"material.G": "80 GPa"},
            {f"bushing.{part}.{k}" for part in ("cross", "fork") for k in ("k_x", "k_y", "k_tz")},
        ),
        ({"contact.xi": 0.1}, {"contact.c_d"}),
        ({"contact.H": 7.0}, {"contact.k1p", "contact.k2p"}),
        ({"pin.chi": 1.2}, {"bushing.cross.k_x", "bushing.cross.k_y"}),
    ],
)
def test_nothing_else_moves(over: dict[str, object], changed: set[str]) -> None:
    joint = joints.load("cirelli2021", nested(over), "case")
    assert GIVEN.keys() - leaves(joint.given()).keys() == changed


@pytest.mark.parametrize(
    ("over", "expected"),
    [
        ({"D_P": "75.9 mm"}, (76.2, 75.9, 0.15)),
        ({"D_H": "76.3 mm"}, (76.3, 76.0, 0.15)),
        ({"clearance": "0.2 mm"}, (76.2, 75.8, 0.2)),
        ({"clearance": "0.2 mm", "D_P": "20 mm"}, (20.4, 20.0, 0.2)),
        ({"clearance": "0.2 mm", "D_H": "20 mm"}, (20.0, 19.6, 0.2)),
        ({"D_H": "20.2 mm", "D_P": "20 mm"}, (20.2, 20.0, 0.1)),
        ({"D_H": "20.2 mm", "D_P": "20 mm", "clearance": "0.1 mm"}, (20.2, 20.0, 0.1)),
        ({"clearance": "0.2 mm", "pin": "30 mm"}, (30.4, 30.0, 0.2)),
    ],
)
def test_two_of_three_define_a_bearing(over: dict[str, str], expected: tuple[float, ...]) -> None:
    keys = {"pin.d" if key == "pin" else f"contact.{key}": value for key, value in over.items()}
    of = joints.load("cirelli2021", nested(keys), "case").contact
    assert_allclose(1e3 * np.array([of.D_H, of.D_P, of.clearance]), expected)


@pytest.mark.parametrize(
    ("line", "over", "expected"),
    [
        ('D_H = "20.1 mm"', {}, (20.1, 20.0, 0.05)),
        ('D_H = "20.1 mm"', {"contact.clearance": "0.1 mm"}, (20.1, 19.9, 0.1)),
        ('D_P = "19 mm"\nD_H = "19.1 mm"', {"contact.clearance": "0.1 mm"}, (19.1, 18.9, 0.1)),
        ('D_P = "19 mm"\nclearance = "0.1 mm"', {"contact.clearance": "0.2 mm"}, (19.4, 19.0, 0.2)),
        ('D_P = "19 mm"\nclearance = "0.1 mm"', {"contact.D_H": "19.1 mm"}, (19.1, 19.0, 0.05)),
        ('D_H = "19 mm"\nclearance = "0.1 mm"', {"contact.D_P": "18.9 mm"}, (19.0, 18.9, 0.05)),
        ('clearance = "0.1 mm"', {"contact.D_H": "20.1 mm"}, (20.1, 20.0, 0.05)),
        ('clearance = "0.1 mm"', {"contact.D_P": "19 mm"}, (19.2, 19.0, 0.1)),
        ('clearance = "0.1 mm"', {"pin.d": "22 mm"}, (22.2, 22.0, 0.1)),
    ],
)
def test_a_bearing_of_one_s_own(
    tmp_path: Path, line: str, over: dict[str, str], expected: tuple[float, float, float]
) -> None:
    path = tmp_path / "own.toml"
    path.write_text(OWN.replace('clearance = "0.03 mm"', line), encoding="utf-8")
    joint = joints.load(path, nested(over), "case")
    assert_allclose(1e3 * np.array([joint.contact.D_H, joint.contact.D_P, joint.contact.clearance]), expected)
    assert joint.contact.k1u == DERIVED["contact.k1u"].value(joint)


@pytest.mark.parametrize(
    ("old", "new", "place", "found"),
    [
        ('clearance = "0.03 mm"\n', "", "contact", "missing key"),
        ("H = 6.9\n", "", "contact.H", "missing key"),
        ('fit_load = "20 kN"\n', "", "contact", "missing keys k1u, k2u"),
        ("xi = 0.05\n", "", "contact", "missing key c_d"),
        ('width = "40 mm"\n', "", "arm", "missing keys A, Jx, Jy"),
        ('d = "20 mm"\n', "", "pin.d", "missing key"),
        ('R = "40 mm"', 'R = "17 mm"', "cross", "R is not larger than pin.l"),
        ('R = "40 mm"', 'R = "27 mm"', "hub", "the pins overlap"),
        ('clearance = "0.03 mm"', 'clearance = "0 mm"', "contact", "eq. (3) has no value without clearance"),
        ('clearance = "0.03 mm"', 'D_H = "19 mm"', "contact", "does not fit"),
    ],
)
def test_what_a_joint_file_cannot_do_without(tmp_path: Path, old: str, new: str, place: str, found: str) -> None:
    assert OWN.count(old) == 1
    path = tmp_path / "own.toml"
    path.write_text(OWN.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        joints.load(path, {}, "case")
    (fault,) = caught.value.faults
    assert re.sub(r"(?<=own\.toml):\d+", "", fault.place) == f"{path}: {place}"
    assert found in fault.found
    assert fault.remedy


# --- warnings -----------------------------------------------------------------------------------------------

WARNED = [
    ({}, {}),
    ({"pin.d": "20 mm"}, {"contact.D_P": "20.0 mm", "contact.D_H": "20.2 mm", "hub.mass": "0.311", "hub.inertia": ""}),
    ({"pin.d": "20 mm", "contact.clearance": "0.02 mm", "hub.mass": "0.4 kg"}, {"hub.inertia": ""}),
    ({"pin.d": "20 mm", "cross.R": "40 mm"}, {"contact.D_P": "", "contact.D_H": "", "cross.r_b": "3.59 mm"}),
    ({"contact.D_P": "20 mm"}, {"contact.D_H": "20.0 mm"}),
    ({"contact.D_P": "20 mm", "contact.D_H": "20.1 mm"}, {"pin.d": "20.0 mm"}),
    ({"contact.D_P": "74.68 mm"}, {}),
    ({"contact.D_P": "75.955 mm", "contact.D_H": "76.015 mm"}, {}),
    ({"material.rho": "2700 kg/m^3"}, {"hub.mass": "0.347 kg"}),
    ({"contact.clearance": "0.05 mm", "material.E": "70 GPa"}, {}),
    ({"material.E": "70 GPa", "material.nu": 0.33, "material.G": "79 GPa"}, {"material.G": "26.32 GPa"}),
]


@pytest.mark.parametrize(("over", "expected"), WARNED)
def test_what_is_inherited_beside_dimensions_of_one_s_own_is_a_warning(
    over: dict[str, str], expected: dict[str, str]
) -> None:
    told = {fault.place: fault for fault in joints.load("cirelli2021", nested(over), "case").warnings()}
    assert told.keys() == expected.keys() | ({"hub.inertia"} if "hub.mass" in expected else set())
    for key, words in expected.items():
        assert words in str(told[key])
        assert ("inherited from cirelli2021" in told[key].found) == (key not in ("cross.r_b", "material.G"))


@pytest.mark.parametrize(
    ("friction", "warned"),
    [({"mu": 0.1}, True), ({"mu": 0.05}, False), ({"mu": 0.1, "mu_along": 0.05}, False), ({"radius": "12 mm"}, False)],
)
def test_friction_along_the_pins_that_is_inherited_beside_another_one_around_them(
    friction: dict[str, Any], warned: bool
) -> None:
    told = [str(fault) for fault in joints.load("pin25", {"friction": friction}, "case").warnings()]
    found = "friction.mu_along: 0.05 along the pins is inherited from pin25, beside mu = 0.1 around them"
    assert [words.startswith(found) for words in told] == [True] * warned


def test_given_values_silence_a_warning() -> None:
    hub = {"hub.mass": "1.0 kg", "hub.inertia": GIVEN["hub.inertia"]}
    assert joints.load("cirelli2021", nested({"material.rho": "2700 kg/m^3"} | hub), "case").warnings() == []


def test_roots_of_a_change() -> None:
    assert derived.changed({"pin.d"}, GIVEN) >= {"pin.A", "pin.mass", "contact.c_d", "bushing.cross.k_tz"}
    assert not derived.changed({"pin.d"}, GIVEN) & {"contact.k1u", "cross.r_b", "hub.mass"}
    assert "contact.k1u" in derived.changed({"pin.d"}, GIVEN.keys() - {"contact.D_P"})


# --- the load range of the fit ------------------------------------------------------------------------------


@pytest.mark.parametrize(("clearance", "used"), [("0.1 mm", 2e4), ("0.005 mm", 1e4), ("0.001 mm", 2.5e3)])
def test_the_load_range_is_halved_until_contact_stiffens(tmp_path: Path, clearance: str, used: float) -> None:
    """By eq. (3) itself: force rises faster than displacement up to this load, but not up to twice this load."""
    joint = overridden(contact__clearance=clearance)
    of, steel = joint.contact, joint.material
    assert of.fit_load == used
    (k1, k2), (above, below) = (
        np.polynomial.polynomial.polyfit(delta, force / delta, 1, w=delta)[::-1]
        for load in (used, 2 * used)
        for force in [np.linspace(0, load, 101)[1:]]
        for delta in [material.contact_displacement(force / of.z, of.D_H, of.D_P, steel.E, steel.nu)]
    )
    assert_allclose((of.k1u, of.k2u), (k1, k2), rtol=1e-6)
    told = [fault for fault in joint.warnings() if fault.place == "contact.fit_load"]
    assert bool(told) == (used < 2e4)
    if told:
        assert not (above >= 0 and below > 0)
        assert told[0].found.startswith("up to 20 kN eq. (3) gives no stiffening contact")
        assert f'fit_load = "{used / 1e3} kN"' in told[0].remedy
    held = joint.given("json")
    assert units.to_si(held["contact"]["fit_load"], "N") == used  # so that a result file says what was used
    assert validate(Joint, held, "file.h5").model_dump() == joint.model_dump()


def test_given_coefficients_need_no_fit() -> None:
    joint = overridden(contact={"clearance": "0.001 mm", "k1u": "7.5e7 N/mm^2", "k2u": "1.2e6 N/mm"})
    assert joint.contact.fit_load == 2e4
    assert not [fault for fault in joint.warnings() if fault.place == "contact.fit_load"]


def test_what_no_load_range_can_mend() -> None:
    with pytest.raises(InputError) as caught:
        overridden(contact__clearance="1e-9 mm")
    (fault,) = caught.value.faults
    assert "no stiffening contact, not even up to a thousandth of fit_load" in fault.found
    assert "a larger clearance" in fault.remedy


@pytest.mark.parametrize("E", ["210 MPa", "210e3 Pa", "0 GPa", "-210 GPa"])
def test_a_wrong_modulus_is_not_a_matter_of_the_fit(E: str) -> None:
    with pytest.raises(InputError) as caught:
        overridden(material__E=E)
    (fault,) = caught.value.faults
    assert fault.place == "case: joint.material.E"
    assert E in fault.found
