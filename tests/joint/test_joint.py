"""Joint files, and the way from errors to parameters."""

from __future__ import annotations

import re
import tomllib

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from tests.support.held import drive_shaft
from tests.support.mechanisms import bushing_kind, lump_kind
from tolstat import joint as joints
from tolstat.common import files
from tolstat.common.cardan import CARDAN, HOLE_OF_PIN
from tolstat.common.errors import InputError
from tolstat.common.mechanism import features
from tolstat.common.parameters import MAX_STATIONS
from tolstat.common.strict import validate
from tolstat.common.tables import tables
from tolstat.joint import Joint, Operation, ideal, material
from tolstat.joint.bodies import ARM_TRIADS, PIN_TRIADS
from tolstat.joint.contact import LAWS

PARAM, ERROR_FIELDS = tables(CARDAN).PARAM, tables(CARDAN).error_fields
PINS, HOLES = features(CARDAN)[:4], features(CARDAN)[4:]
ARM_OF_PIN = [hole - 1 for hole in HOLE_OF_PIN]
FILE = files.data_dir() / "joints" / "cirelli2021.toml"
MM = 1e-3


@pytest.fixture(scope="module")
def joint():
    return joints.load("cirelli2021", {}, "case.toml")


@pytest.fixture(scope="module")
def operation():
    return validate(Operation, {"alpha": "15 deg", "speed": "500 rpm", "torque": "100 N*m"}, "case.toml")


def one(**errors):
    table = joints.nominal_errors(1, CARDAN)
    for name, value in errors.items():
        table[name.replace("__", ".")] = value
    return table


def faults(overrides, base="cirelli2021", folder=None):
    with pytest.raises(InputError) as caught:
        joints.load(base, overrides, "case.toml", folder)
    return {f.place: f for f in caught.value.faults}


# --- joint files ----------------------------------------------------------------------------------------


def test_every_key_names_its_source():
    text, _, _ = FILE.read_text(encoding="utf-8").partition("# What is assumed")
    keys = [line for line in text.splitlines() if re.match(r"(# )?\w+ = [\"\[\d]", line)]
    data = tomllib.loads(text)
    flat = sum(len(v) if isinstance(v, dict) else 1 for v in data.values())
    inside = len(data["bushing"]["cross"]) + len(data["bushing"]["fork"]) - 2
    active = [line for line in keys if not line.startswith("#")]
    assert len(active) == flat + inside
    for line in keys:
        assert re.search(r"#\s+(printed|derived|assumed|misprint)\b", line), line


def test_default_joint_holds_the_printed_numbers(joint):
    assert_array_equal(joint.k_cross, [6.54e9, 2.21e9, 2.21e9, 4.44e5, 5.90e5, 5.90e5])
    assert_array_equal(joint.k_fork, [2.14e9, 2.14e9, 6.82e9, 1.91e6, 2.32e5, 8.08e5])
    assert joint.contact.c_d == 1.18e4
    assert joint.arm.mass == pytest.approx(7700 * 12.18e-4 * 37.49 * MM)
    assert_allclose([joint.cross.R, joint.pin.Jp], [2 * joint.pin.l, 2 * joint.pin.J])


def test_stiffness_coefficients_and_damping_can_follow_from_geometry():
    j = joints.load("cirelli2021", {"material": {"E": "105 GPa", "G": "79 GPa"}}, "case.toml")
    assert_allclose(j.k_cross, [3.27e9, 2.21e9, 2.21e9, 4.44e5, 2.95e5, 2.95e5], rtol=4e-3)
    assert_allclose(j.k_fork, [2.14e9, 2.14e9, 3.41e9, 0.955e6, 1.16e5, 8.08e5], rtol=4e-3)
    k1u, k2u, k1p, k2p = j.contact.coefficients()
    assert (k1u, k2u) == material.fit_contact(20e3, j.contact.z, j.contact.D_H, j.contact.D_P, 105e9, 0.28)
    assert_allclose([k1p, k2p], [k1u / 6.9**2, k2u / 6.9])
    assert j.contact.c_d == pytest.approx(1.18e4 / np.sqrt(2), rel=1e-3)


def test_keys_that_may_be_left_out(tmp_path):
    text = FILE.read_text(encoding="utf-8")
    for key in ("k1p", "k2p", 'Jp = "20.4', 'mass = "0.32', "fit_load", "description"):
        text, n = re.subn(rf"^{key}.*\n", "", text, flags=re.M)
        assert n == 1, key
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    j = joints.load("mine.toml", {}, "case.toml", tmp_path)
    assert_allclose(j.contact.coefficients()[2:], [7.5e13 / 6.9**2, 1.2e9 / 6.9])
    assert j.pin.mass == pytest.approx(7700 * 11.34e-4 * 36.41 * MM)


def test_joint_survives_its_json(joint):
    for dump in (joint.given("json"), joint.model_dump(mode="json")):
        assert validate(Joint, dump, "file.h5") == joint


def test_all_faults_of_a_broken_joint_file_at_once(tmp_path):
    text = FILE.read_text(encoding="utf-8")
    for old, new in (
        ('E = "210 GPa"', 'E = "-210 GPa"'),
        ("nu = 0.28", "nu = 0.5"),
        ('l = "36.41 mm"', 'l = "36.41"'),
        ('mass = "1.0 kg"', 'mass = "1.0 mm"'),
        ('"5.3e-4 kg*m^2"]', '"9e-4 kg*m^2"]'),
        ("xi = 0.04", "xi = -0.04"),
        ("n_stations = 5", "n_stations = 17"),
        ('c_d = "1.18e4', 'c_dd = "1.18e4'),
        ('D_P = "76.0 mm"', 'D_P = "76.3 mm"'),
        ('k_tz = "4.44e5', 'k_tz = "nan'),
    ):
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    path = tmp_path / "broken.toml"
    path.write_text(text, encoding="utf-8")
    found = faults({"contact": {"law": "hard"}}, "broken.toml", tmp_path)
    lines = {
        "material.E": '"-210 GPa"',
        "material.nu": "nu = 0.5",
        "pin.l": '"36.41"',
        "hub.mass": '"1.0 mm"',
        "hub.inertia": '"9e-4',
        "bushing.xi": "xi = -0.04",
        "bushing.cross.k_tz": '"nan',
        "contact.n_stations": "= 17",
        "contact.D_P": '"76.3 mm"',
        "contact.c_dd": "c_dd = ",
    }
    numbers = {key: 1 + [part in line for line in text.splitlines()].index(True) for key, part in lines.items()}
    places = {key: f"{path}:{number}: {key}" for key, number in numbers.items()}
    assert set(found) == {*places.values(), "case.toml: joint.contact.law"}
    assert found[places["contact.D_P"]].found == "a pin of 76.3 mm does not fit into a hole of 76.2 mm"
    assert all(f.remedy for f in found.values())


def test_overrides_can_mend_a_joint_file_and_their_faults_are_the_case_s(tmp_path):
    text = FILE.read_text(encoding="utf-8").replace('Js = "0.01 kg*m^2"', 'Js = "0 kg*m^2"')
    path = tmp_path / "light.toml"
    path.write_text(text, encoding="utf-8")
    (place,) = faults({}, path)
    assert re.fullmatch(rf"{re.escape(str(path))}:\d+: shaft\.Js", place)
    mended = joints.load(path, {"shaft": {"Js": "0.02 kg*m^2"}}, "case.toml")
    assert mended.shaft.Js == 0.02
    assert set(faults({"shaft": {"Js": "0 kg*m^2"}, "hubb": {}, "pin": 4}, path)) >= {
        "case.toml: joint.hubb",
        "case.toml: joint.pin",
    }


@pytest.mark.parametrize(
    ("section", "values", "place"),
    [
        ("contact", {"z": "200 mm"}, "contact"),
        ("contact", {"D_P": "76.2 mm"}, "contact"),
        ("contact", {"fit_load": "1e9 N"}, "contact"),
        ("contact", {"clearance": "0 mm"}, "contact"),
        ("contact", {"clearance": "-0.1 mm"}, "contact.clearance"),
        ("contact", {"clearance": "38.1 mm"}, "contact"),
        ("contact", {"D_H": "20.2 mm", "D_P": "20 mm", "clearance": "0.2 mm"}, "contact"),
        ("arm", {"width": "58 mm"}, "arm"),
        ("cross", {"R": "36.41 mm"}, "cross"),
        ("contact", {"c_t": "-1 N*s/m"}, "contact.c_t"),
        ("contact", {"delta_d": "0 um"}, "contact.delta_d"),
        ("contact", {"n_stations": 0}, "contact.n_stations"),
        ("contact", {"H": "2 mm"}, "contact.H"),
        ("arm", {"mass": "0 kg"}, "arm.mass"),
        ("bushing", {"cross": {"k_x": "stiff"}}, "bushing.cross.k_x"),
    ],
)
def test_values_without_sense_are_faults(section, values, place):
    assert set(faults({section: values})) == {f"case.toml: joint.{place}"}


def test_base_that_cannot_be_found(tmp_path):
    (f,) = faults({}, "cireli2021").values()
    assert "cirelli2021" in f.remedy
    (f,) = faults({}, "other").values()
    assert "cirelli2021" in f.remedy
    (f,) = faults({}, "none.toml", tmp_path).values()
    assert f.place == str(tmp_path / "none.toml")
    assert "cannot be read" in f.found


def test_operation_is_validated():
    with pytest.raises(InputError) as caught:
        validate(Operation, {"alpha": "90 deg", "speed": "0 rpm", "torque": "nan N*m"}, "case.toml")
    assert [f.place for f in caught.value.faults] == [f"case.toml: {k}" for k in ("alpha", "speed", "torque")]


# --- from errors to parameters --------------------------------------------------------------------------


def test_nominal_joint(joint, operation):
    p = joints.perturb(joint, operation, joints.nominal_errors(3, CARDAN))
    assert p.dtype == PARAM
    assert_allclose(p["alpha"], np.radians(15))
    assert_allclose(p["omega"], 500 * 2 * np.pi / 60)
    assert_array_equal(p["torque"], 100.0)
    assert_allclose(p["clearance"], 0.1 * MM, rtol=1e-12)
    assert_array_equal(p["pin_point"], 0.0)
    assert_array_equal(p["hole_point"], 0.0)
    for name in ("pin_axis", "hole_axis"):  # of each pair in axes of cross and fork, which coincide at theta = 0
        assert_array_equal(p[name][0], [[0, 1, 0], [0, -1, 0], [1, 0, 0], [-1, 0, 0]])
    cross, *forks = (bushing_kind(name) for name in ("cross", "input fork", "output fork"))
    assert_allclose(p["c"][0, cross, 0], 0.08 * np.sqrt(6.54e9 * 0.32))
    assert_allclose(p["c"][0, forks, 3], 0.08 * np.sqrt(1.91e6 * joint.arm.inertia[0]))
    assert p["n_stations"][0] == 3
    assert_allclose(p["station_s"][0, 0, :3], [11 * MM, 0.0, -11 * MM])
    assert_array_equal(p["station_weight"][0, 0], [1, 0, 1] + [0] * (MAX_STATIONS - 3))
    assert all(np.isfinite(p[name]).all() for name in PARAM.names)


def test_masses_stiffness_and_markers_are_those_of_their_parts(joint, operation):
    """Along e, t and z of pin or arm, from the reference points of lump and base (docs/model.md, Bushings)."""
    p = joints.perturb(joint, operation, joints.nominal_errors(1, CARDAN))[0]
    R, r_b, l_f = joint.cross.R, joint.cross.r_b, joint.arm.l_f
    for name, part, at in (("hub", joint.hub, 0.0), ("pin", joint.pin, R), ("arm", joint.arm, R)):
        kind = lump_kind(name)
        assert p["mass"][kind] == part.mass
        assert_array_equal(p["inertia"][kind], part.inertia)
        assert_array_equal(p["at"][kind], [at, 0, 0])
    for name, stiffness, on_lump, on_base in (
        ("cross", joint.k_cross, (r_b - R, 0, 0), (r_b, 0, 0)),
        ("input fork", joint.k_fork, (0, 0, -l_f), (R, 0, -l_f)),
        ("output fork", joint.k_fork, (0, 0, l_f), (R, 0, l_f)),
    ):
        kind = bushing_kind(name)
        assert_array_equal(p["k"][kind], stiffness)
        assert_array_equal(p["marker"][kind], [on_lump, on_base])


def test_triads_are_right_handed_with_z_of_the_frame():
    for triads in (PIN_TRIADS, ARM_TRIADS):
        for e, t, z in triads:
            assert_array_equal(z, [0, 0, 1])
            assert_array_equal(t, np.cross(z, e))
            assert_array_equal(np.cross(e, t), z)
    # at theta = 0 and alpha = 0 all frames coincide: a pin then points the way of the arm that takes it
    for pin, hole in enumerate(HOLE_OF_PIN):
        assert_array_equal(PIN_TRIADS[pin], ARM_TRIADS[hole - 1])


def test_offsets_and_tilts_by_hand(joint, operation):
    s, c = np.sin(0.01), np.cos(0.01)
    by_hand = {
        ("pin1.offset_t", 1e-4): ("pin_point", 0, [-1e-4, 0, 0]),  # pin 1 on +y: t = -x
        ("pin2.offset_t", 1e-4): ("pin_point", 1, [1e-4, 0, 0]),
        ("pin2.offset_e", 1e-4): ("pin_point", 1, [0, -1e-4, 0]),
        ("pin3.offset_t", 1e-4): ("pin_point", 2, [0, 1e-4, 0]),
        ("pin4.offset_z", 1e-4): ("pin_point", 3, [0, 0, 1e-4]),
        ("hole4.offset_t", 1e-4): ("hole_point", 0, [-1e-4, 0, 0]),
        ("hole3.offset_e", 1e-4): ("hole_point", 1, [0, -1e-4, 0]),
        ("hole2.offset_t", -1e-4): ("hole_point", 3, [0, 1e-4, 0]),
        ("pin1.tilt_z", 0.01): ("pin_axis", 0, [-s, c, 0]),
        ("pin2.tilt_z", 0.01): ("pin_axis", 1, [s, -c, 0]),
        ("pin3.tilt_t", 0.01): ("pin_axis", 2, [c, 0, -s]),
        ("hole4.tilt_t", 0.01): ("hole_axis", 0, [0, c, -s]),
        ("hole4.tilt_z", -0.01): ("hole_axis", 0, [s, c, 0]),
        ("hole1.tilt_z", 0.01): ("hole_axis", 2, [c, s, 0]),
    }
    nominal = joints.perturb(joint, operation, joints.nominal_errors(1, CARDAN))
    for (error, value), (field, index, expected) in by_hand.items():
        p = joints.perturb(joint, operation, one(**{error: value}))
        assert_allclose(p[field][0, index], expected, atol=1e-18, err_msg=error)
        p[field][0, index] = nominal[field][0, index]
        assert p.tobytes() == nominal.tobytes(), error  # nothing else has moved


def test_all_features_against_finite_rotations(joint, operation):
    rng = np.random.default_rng(7)
    errors = joints.nominal_errors(20, CARDAN)
    for f in ERROR_FIELDS:
        if f.name.startswith(("pin", "hole")):
            errors[f.name] = rng.normal(scale=0.3 if "tilt" in f.name else 1e-4, size=20)
    p = joints.perturb(joint, operation, errors)
    for k, hole in enumerate(HOLE_OF_PIN):
        features = ((PINS[k], PIN_TRIADS[k], "pin"), (HOLES[hole - 1], ARM_TRIADS[hole - 1], "hole"))
        for name, (e, t, z), kind in features:
            offset = np.stack([errors[f"{name}.offset_{a}"] for a in "etz"], axis=1)
            assert_allclose(p[f"{kind}_point"][:, k], offset @ (e, t, z), atol=1e-18)
            rotvec = np.outer(errors[f"{name}.tilt_t"], t) + np.outer(errors[f"{name}.tilt_z"], z)
            assert_allclose(p[f"{kind}_axis"][:, k], Rotation.from_rotvec(rotvec).apply(e), atol=1e-14)


def test_rows_do_not_see_each_other(joint, operation):
    rng = np.random.default_rng(8)
    errors = joints.nominal_errors(9, CARDAN)
    for f in ERROR_FIELDS:
        if f.name.startswith("operation."):
            continue
        errors[f.name] = rng.normal(scale=1e-4, size=9)
    errors["material.E_factor"] = rng.normal(1.0, 0.05, size=9)
    before = errors.tobytes()
    together = joints.perturb(joint, operation, errors)
    alone = np.concatenate([joints.perturb(joint, operation, errors[i : i + 1]) for i in range(9)])
    assert together.tobytes() == alone.tobytes()
    assert errors.tobytes() == before
    assert len(joints.perturb(joint, operation, errors[:0])) == 0


def test_diameters_enter_the_clearance_of_their_pin_alone(joint, operation):
    for pin, hole in (("pin1", "hole4"), ("pin2", "hole3"), ("pin3", "hole1"), ("pin4", "hole2")):
        k = PINS.index(pin)
        p = joints.perturb(joint, operation, one(**{f"{pin}.diameter": -2e-5, f"{hole}.diameter": 6e-5}))
        expected = np.full(4, 1e-4)
        expected[k] = 1.4e-4
        assert_allclose(p["clearance"][0], expected, rtol=1e-12)


@pytest.mark.parametrize("pin", PINS)
def test_clearance_is_that_of_its_pin_alone_and_adds_to_diameters(joint, operation, pin):
    errors = {f"{pin}.clearance": 3e-5, "hole1.diameter": 2e-5}
    expected = np.full(4, 1e-4)
    expected[PINS.index(pin)] += 3e-5
    expected[2] += 1e-5  # pin 3 turns in hole 1
    p = joints.perturb(joint, operation, one(**errors))
    assert_allclose(p["clearance"][0], expected, rtol=1e-12)
    p["clearance"] = joints.perturb(joint, operation, one())["clearance"]
    assert p.tobytes() == joints.perturb(joint, operation, one()).tobytes()  # nothing else has moved
    assert joints.perturb(joint, operation, one(**{f"{pin}.clearance": -1e-4}))["clearance"].min() == 0.0


def test_a_pin_of_exactly_the_hole_s_size_has_zero_clearance(joint, operation):
    names = {f"{pin}.diameter": 0.0002 for pin in PINS}
    assert_array_equal(joints.perturb(joint, operation, one(**names))["clearance"], 0.0)
    interference = joints.perturb(joint, operation, one(**{"pin1.diameter": 0.0002 + 1e-9}))["clearance"]
    assert interference[0, 0] == pytest.approx(-5e-10, rel=1e-5)


def test_factor_on_E(joint, operation):
    nominal = joints.perturb(joint, operation, one())
    p = joints.perturb(joint, operation, one(material__E_factor=1.21))
    for name in PARAM.names:
        scale = 1.21 if name in ("k", "station_k1", "station_k2", "station_k3") else 1.0
        scale = 1.1 if name == "c" else scale
        assert_allclose(p[name], scale * nominal[name], rtol=1e-14, err_msg=name)


@pytest.mark.parametrize(
    ("law", "s", "k1", "k2", "weight"),
    [
        ("mode", [11, 0, -11], [1.6e12, 7.18e13, 1.6e12], [1.8e8, 8.4e8, 1.8e8], [1, 0, 1]),
        ("uniform", [11, -11], [3.75e13, 3.75e13], [6e8, 6e8], [1, 1]),
        ("point", [11, -11], [1.6e12, 1.6e12], [1.8e8, 1.8e8], [1, 1]),
    ],
)
def test_a_law_is_a_set_of_stations(joint, law, s, k1, k2, weight):
    own = joints.load("cirelli2021", {"contact": {"law": law}}, "case.toml")
    stations = own.contact.springs(None)
    expected = {"s": np.array(s) * MM, "k1": k1, "k2": k2, "k3": 0.0, "weight": weight, "b": 0.0}
    for name, found in stations._asdict().items():
        assert_allclose(found, expected[name], rtol=1e-12)
    if law == "mode":
        assert sum(stations.k1) == pytest.approx(joint.contact.k1u)
        assert sum(stations.k2) == pytest.approx(joint.contact.k2u)


@pytest.mark.parametrize(
    ("contact", "key", "found"),
    [
        ({"k1p": "3.8e7 N/mm^2"}, "k1p", "2 k1p exceeds k1u"),
        ({"k2p": "6.1e5 N/mm"}, "k2p", "2 k2p exceeds k2u"),
        ({"H": 1.9}, "H", "the middle station would be negative"),
        ({"law": "sliced", "n_stations": 0}, "n_stations", "greater than or equal to 1"),
    ],
)
def test_stations_without_sense_are_faults(contact, key, found):
    told = faults({"contact": contact})
    assert set(told) == {f"case.toml: joint.contact.{key}"}
    assert found in told[f"case.toml: joint.contact.{key}"].found
    assert told[f"case.toml: joint.contact.{key}"].remedy


@pytest.mark.parametrize("n", [1, 2, 5, MAX_STATIONS])
def test_sliced_law_has_gauss_points_the_outermost_first(operation, n):
    j = joints.load("cirelli2021", {"contact": {"law": "sliced", "n_stations": n}}, "case.toml")
    p = joints.perturb(j, operation, joints.nominal_errors(1, CARDAN))[0]
    s, w = p["station_s"][0], p["station_weight"][0]
    assert p["n_stations"] == n
    assert_array_equal(s[n:], 0.0)
    assert_array_equal(w[n:], 0.0)
    assert (np.diff(s[:n]) < 0).all()
    assert np.abs(s).max() < 11 * MM
    assert w.sum() == pytest.approx(2.0)
    if n > 1:
        assert (w * s**2).sum() == pytest.approx(2 * (11 * MM) ** 2 / 3)  # mean square over the length, twice


@pytest.mark.parametrize("law", LAWS)
def test_each_contact_law_has_a_line_in_the_table_of_the_model(law):
    assert f"\n| `{law}` | " in (files.docs_dir() / "model.md").read_text(encoding="utf-8")


def test_equal_joints_of_a_shaft_turn_the_output_evenly(joint):
    """In Z and in W arrangement without offset; at 90 deg of offset both joints' swings add up."""
    theta = np.linspace(0.0, 2 * np.pi, 37)
    point = joints.Operation(alpha="20 deg", speed="500 rpm", torque="100 N*m")
    for arrangement in ("Z", "W", "40 deg"):
        for offset, swing in (("0 deg", 0.0), ("90 deg", 1 / np.cos(np.radians(20)) ** 2 - 1)):
            shaft = drive_shaft(np.radians(20), arrangement, offset=offset)
            both = joints.OperationOfShaft.model_construct(**dict(point), shaft=shaft)
            par = joints.perturb(joint, both, joints.nominal_errors(1, joints.mechanism_of(joint, both)))[0]
            ratio = ideal.ratio_of_all(theta, par)
            assert_allclose(ratio.max() - 1, swing, atol=1e-12)
