"""Needle bearings as a contact law: the sum over needles, the formula that kernels use, what a joint needs for it."""

from __future__ import annotations

import re

import numpy as np
import pytest

from tests.conftest import joint_with_law
from tolstat import joint as joints
from tolstat.common.cardan import CARDAN
from tolstat.common.errors import InputError
from tolstat.common.strict import validate
from tolstat.joint import Joint, Operation, affecting_results
from tolstat.joint.bearing import Fit, displacement, fit_needles, formula, needle_force
from tolstat.study.starter import joint_text

NEEDLES = {"needles": 32, "needle_length": "22 mm"}
BEARINGS = [(32, 0.022), (20, 0.010), (61, 0.030)]
CLEARANCES = [2e-6, 1e-5, 2e-5, 1e-4]
OPERATION = Operation.model_construct(alpha=0.1, speed=50.0, torque=100.0)


def loads_of(delta, clearance, needles, length, cage):
    """Force of each needle (N), and its angle to the displacement, at one position of the cage."""
    angles = 2 * np.pi * (np.arange(needles) + cage) / needles
    pressed = np.maximum((clearance + delta) * np.cos(angles) - clearance, 0.0)
    return 35948 * (1e3 * length) ** (8 / 9) * (1e3 * pressed) ** (10 / 9), angles


def summed(delta, clearance, needles, length, positions=1000):
    """Force of the bearing (N), the mean over positions of the cage."""
    forces = [
        load @ np.cos(angles)
        for cage in np.arange(positions) / positions
        for load, angles in [loads_of(delta, clearance, needles, length, cage)]
    ]
    return float(np.mean(forces))


def slope(force, delta):
    h = 1e-5 * delta
    return (force(delta + h) - force(delta - h)) / (2 * h)


@pytest.mark.parametrize(("needles", "length"), BEARINGS)
def test_force_is_the_mean_over_positions_of_the_cage_of_the_sum_over_needles(needles, length):
    for clearance in (0.0, 2e-5):
        delta = np.array([1e-7, 3e-6, 5e-5])
        expected = [summed(d, clearance, needles, length) for d in delta]
        np.testing.assert_allclose(needle_force(delta, clearance, needles, length), expected, rtol=1e-5)


def test_without_clearance_the_most_loaded_needle_takes_4_08_times_the_mean():
    """The number of textbooks for roller bearings without clearance, Q = 4.08 F/Z (Stribeck; Harris)."""
    load, _ = loads_of(1e-5, 0.0, 32, 0.022, 0.0)
    assert load.max() * 32 / summed(1e-5, 0.0, 32, 0.022) == pytest.approx(4.08, abs=0.01)
    assert load.max() * 32 / needle_force(np.array([1e-5]), 0.0, 32, 0.022)[0] == pytest.approx(4.08, abs=0.01)


@pytest.mark.parametrize(("needles", "length"), BEARINGS)
@pytest.mark.parametrize("clearance", CLEARANCES)
@pytest.mark.parametrize("load", [5e3, 2e4])
def test_the_formula_holds_for_other_clearances_than_the_one_it_is_fitted_at(needles, length, clearance, load):
    """Force within 2 %, slope within 5 %, from a hundredth of the largest load of the fit on."""
    fit = fit_needles(load, clearance, needles, length)
    for own in (0.7 * clearance, clearance, 1.3 * clearance):
        ends = (displacement(share * load, own, needles, length) for share in (0.01, 1.0))
        delta = np.geomspace(*ends, 50)

        def true(d, own=own):
            return needle_force(d, own, needles, length)

        def used(d, own=own, fit=fit):
            return formula(d, own, *fit)

        np.testing.assert_allclose(used(delta), true(delta), rtol=0.02)
        np.testing.assert_allclose(slope(used, delta), slope(true, delta), rtol=0.05)
        linear = np.linalg.lstsq(np.column_stack([delta, delta**2]) / true(delta)[:, None], np.ones(50), rcond=None)[0]
        assert np.abs(np.polyval([linear[1], linear[0], 0], delta) / true(delta) - 1).max() > 0.1  # eq. (5) does not


def test_a_joint_without_clearance_has_a_fit_for_clearances_of_its_own():
    fit = fit_needles(2e4, 0.0, needles=32, length=0.022)
    for own, within in ((0.0, 0.05), (5e-6, 0.04)):
        delta = np.geomspace(displacement(200.0, own, 32, 0.022), displacement(2e4, own, 32, 0.022), 50)
        np.testing.assert_allclose(formula(delta, own, *fit), needle_force(delta, own, 32, 0.022), rtol=within)


def test_the_fit_has_the_least_relative_errors():
    delta = np.geomspace(displacement(200.0, 2e-5, 32, 0.022), displacement(2e4, 2e-5, 32, 0.022), 41)
    force, fit = needle_force(delta, 2e-5, 32, 0.022), fit_needles(2e4, 2e-5, 32, 0.022)

    def misfit(fit):
        return ((formula(delta, 2e-5, *fit) / force - 1) ** 2).sum()

    for change in ((1.001, 1.0), (0.999, 1.0), (1.0, 1.01), (1.0, 0.99), (1.002, 1.01), (0.998, 0.99)):
        assert misfit(Fit(fit.k3 * change[0], fit.b * change[1])) > misfit(fit)


def test_stations_are_slices_of_the_needles():
    joint = joint_with_law("needles")
    errors = joints.nominal_errors(2, CARDAN)
    errors["material.E_factor"][1], errors["pin2.clearance"][1] = 1.1, -2e-5
    par = joints.perturb(joint, OPERATION, errors)
    sliced = joints.perturb(joint_with_law("sliced"), OPERATION, errors)
    fit = fit_needles(joint.contact.fit_load, 1e-4, 32, 0.022)
    np.testing.assert_allclose(par["station_k3"].sum(axis=(1, 2)), fit.k3 * np.array([1.0, 1.1]), rtol=1e-6)
    np.testing.assert_allclose(par["needle_b"], fit.b, rtol=1e-6)
    for name in ("n_stations", "station_s", "station_weight", "clearance", "c_d"):
        np.testing.assert_array_equal(par[name], sliced[name], err_msg=name)  # needles are as long as the contact here
    for name in ("k1", "k2"):
        assert not par[f"station_{name}"].any()
    assert not sliced["station_k3"].any()
    half = {"bearing": NEEDLES | {"needle_length": "11 mm"}}
    shorter = joints.load("cirelli2021", {"contact": {"law": "needles"}} | half, "x")
    np.testing.assert_allclose(
        joints.perturb(shorter, OPERATION, errors)["station_s"], 0.5 * par["station_s"], rtol=1e-12
    )


def faults(overrides):
    with pytest.raises(InputError) as caught:
        joints.load("cirelli2021", overrides, "case.toml")
    return {f.place.removeprefix("case.toml: joint."): f for f in caught.value.faults}


@pytest.mark.parametrize(
    ("contact", "bearing", "place", "found"),
    [
        ({}, None, "bearing", "missing keys needles, needle_length, needed with contact.law"),
        ({}, {"needles": 32}, "bearing", "missing key needle_length, needed with contact.law"),
        ({}, NEEDLES | {"needle_length": "146 mm"}, "bearing", "needles of 146 mm reach past the joint centre"),
        ({"fit_load": None}, NEEDLES, "contact.fit_load", 'missing key, needed with law = "needles"'),
    ],
)
def test_what_needles_need(contact, bearing, place, found):
    overrides = {"contact": {"law": "needles"} | contact} | ({} if bearing is None else {"bearing": bearing})
    told = faults(overrides)
    assert set(told) == {place}
    assert found in told[place].found
    assert told[place].remedy


def test_needles_are_enough_of_a_bearing_and_other_laws_need_none():
    joint = joint_with_law("needles")
    assert joint.bearing.lacking(("C", "pitch_diameter")) == ["pitch_diameter"]  # C follows from the dimensions
    assert validate(Joint, joint.given("json"), "file.h5") == joint
    assert not joint.warnings()
    free = joints.load("cirelli2021", {"contact": {"law": "needles", "clearance": "0 mm"}, "bearing": NEEDLES}, "x")
    assert (joints.perturb(free, OPERATION, joints.nominal_errors(1, CARDAN))["station_k3"][0, 0, :5] > 0).all()


def test_keys_of_a_bearing_that_affect_results():
    bearing = {"needles": 32, "needle_length": "22 mm", "pitch_diameter": "42 mm", "C": "22 kN", "a_iso": 0.9}
    kept = affecting_results(joints.load("cirelli2021", {"bearing": bearing}, "x").given("json"))
    decide = {"bearing.needles", "bearing.needle_length", "bearing.pitch_diameter"}
    assert {key for key in kept if key.startswith("bearing")} == decide
    assert "description" not in kept


def test_laws_can_be_changed_to_needles_and_back():
    bearing = {"bearing": NEEDLES}
    needles = joints.varied(joint_with_law("mode"), {"contact.law": "needles"})
    assert needles.contact.law == "needles"
    back = joints.varied(needles, {"contact.law": "mode"})
    assert back == joints.load("cirelli2021", bearing, "x")


def test_needles_are_switched_on_in_a_joint_file_of_one_s_own(tmp_path):
    """By the law and the lines of the bearing and of n_stations, whose comments are removed."""
    text = joint_text().replace('law = "mode"', 'law = "needles"')
    for key in ("[bearing]", "needles =", "needle_length =", "n_stations ="):
        text, n = re.subn(rf"(?m)^# ({re.escape(key)})", r"\1", text)
        assert n == 1, key
    path = tmp_path / "own.toml"
    path.write_text(text, encoding="utf-8")
    own = joints.load(path, {}, "case.toml")
    assert (own.contact.law, own.bearing.needles) == ("needles", 32)
    assert own.contact.springs(own.bearing).k3.sum() > 1e9
