"""Equivalent loads of tilted needles: against ISO/TS 16281 lamina by lamina, limits, and the example of the docs."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.laminae import Needles
from tolstat import joint as joints
from tolstat.analysis.rating_life import basic_life, line_pressure, turns_per_revolution
from tolstat.common.cardan import CARDAN
from tolstat.common.parameters import LAMINAE
from tolstat.joint import Operation
from tolstat.joint.laminae import relief
from tolstat.kernel.revolution.laminae import lamina_load

BEARING = {"needles": 32, "needle_length": "22 mm", "needle_diameter": "4 mm", "pitch_diameter": "42 mm"}
PROFILES = {
    "cylinder": {},
    "crowned": {"profile": "crowned", "end_relief": "5 um"},
    "logarithmic": {"profile": "logarithmic", "end_relief": "5 um"},
}
OPERATION = Operation.model_construct(alpha=0.26, speed=50.0, torque=100.0)


def made(factor=1.0, **keys):
    """A bearing as the kernel has it, its stiffness by a factor on E, and by the letter of the standard."""
    joint, errors = joints.load("cirelli2021", {"bearing": BEARING | keys}, "x.toml"), joints.nominal_errors(1, CARDAN)
    errors["material.E_factor"] = factor
    par = joints.perturb(joint, OPERATION, errors).view(np.recarray)[0]
    return par, Needles(profile=lambda x: 1e3 * relief(joint.bearing, 0.022, x))


def load(par, force, end=0.0, turn=0.0, clearance=0.0, start=2e-5):
    """Equivalent load, N, and line load, N/mm; lengths in mm."""
    ends = (start, 1e-3 * end * np.cos(turn), 1e-3 * end * np.sin(turn))
    equivalent, line, _ = lamina_load(force, ends, 0.0, 1e-3 * clearance, 0, par, np.empty((6, LAMINAE)))
    return equivalent, 1e-3 * line


@pytest.mark.parametrize("profile", PROFILES)
def test_loads_are_those_of_the_standard_lamina_by_lamina(profile):
    par, twin = made(**PROFILES[profile])
    rng = np.random.default_rng(7)
    for clearance in (0.0, 5e-3, 2e-2):
        for end in (1e-3, 3e-3, 1e-2):
            force, turn = 10.0 ** rng.uniform(2.7, 4.2), rng.uniform(0, 2 * np.pi)
            place = (end, turn, clearance)
            expected = twin.equivalent(force, *place), twin.line_load(force, *place)
            np.testing.assert_allclose(load(par, force, *place), expected, rtol=0.01, err_msg=str((force, *place)))


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("force", [50.0, 300.0, 3400.0, 15e3])
@pytest.mark.parametrize("factor", [1.0, 1.1])
def test_in_line_and_without_clearance_the_life_is_that_of_iso_281(profile, force, factor):
    par, _ = made(factor, **PROFILES[profile])
    np.testing.assert_allclose(basic_life(load(par, force)[0], 21e3), 1e6 * (21e3 / force) ** (10 / 3), rtol=0.01)


def test_the_standard_and_iso_281_have_the_same_ratings():
    """With one lamina only, L10r is (C/(0.83 F))^4: 0.83 is the part of C for uneven loads (ISO/TR 1281-1)."""
    riser, one = Needles().riser(), Needles(laminae=1).L10r(3400.0)
    np.testing.assert_allclose(one ** (1 / 4), 21e3 / 0.83 / 3400.0, rtol=0.01)
    np.testing.assert_allclose(Needles().L10r(3400.0) / one, np.mean(riser**4.5) ** (-8 / 9), rtol=1e-6)


@pytest.mark.parametrize("clearance", [0.0, 5e-3, 2e-2])
@pytest.mark.parametrize("turn", [0.0, 1.0, np.pi / 2])
def test_tilt_shortens_the_life_the_more_the_larger_it_is(turn, clearance):
    par, _ = made()
    found = [load(par, 3400.0, end, turn, clearance)[0] for end in np.linspace(0.0, 0.02, 15)]
    assert (np.diff(found) > -1e-3 * np.array(found[1:])).all()
    assert found[-1] > 1.5 * found[0]


def test_clearance_shortens_the_life():
    par, _ = made()
    found = [load(par, 3400.0, clearance=c)[0] for c in (0.0, 1e-3, 1e-2, 3e-2)]
    assert (np.diff(found) > 0).all()


def test_the_start_of_the_iteration_does_not_matter():
    par, _ = made(**PROFILES["crowned"])
    found = [load(par, 3400.0, 5e-3, 0.3, 1e-2, start) for start in (0.0, 1e-6, 1.5e-5, 1e-3)]
    np.testing.assert_allclose(found, np.broadcast_to(found[0], (4, 2)), rtol=0.01)


def test_the_example_of_the_documentation():
    """docs/questions/bearing_life.md, By hand: numbers as they stand there."""
    par, twin = made()
    end = 0.5 * 1.5764e-3  # tilt by half the length, mm
    np.testing.assert_allclose(twin.ratings(), (2246.5, 2894.4), rtol=1e-3)
    np.testing.assert_allclose(twin.riser()[[29, 28, 27]], (2.328, 1.127, 1.064), rtol=1e-3)
    r = twin.displaced(3400.0, end, 0.0, 0.0)
    np.testing.assert_allclose(r, 1.5764e-3, rtol=1e-3)
    q, _ = twin.loads(r, end, 0.0, 0.0)
    np.testing.assert_allclose(q.max(axis=1)[[0, 29]], (6.910, 22.304), rtol=1e-3)
    np.testing.assert_allclose([twin.L10r(3400.0), twin.L10r(3400.0, end)], (871.3, 320.5), rtol=1e-3)
    found, line = load(par, 3400.0, end)
    np.testing.assert_allclose((found, line), (4366.0, 30.41), rtol=1e-3)
    hours = basic_life(found, 21e3) / turns_per_revolution(np.radians(15.0)) / (1000.0 * 60.0)
    np.testing.assert_allclose(hours, 18790.0, rtol=5e-3)
    np.testing.assert_allclose(line_pressure(30.41e3, 4e-3, 38e-3), 778.1e6, rtol=1e-3)
    bearing = joints.load("cirelli2021", {"bearing": BEARING}, "x.toml").bearing
    np.testing.assert_allclose((bearing.dynamic_rating, bearing.static_rating), (55190.0, 112100.0), rtol=1e-3)


ISO_281_TABLE_7 = {0.02: 60.8, 0.06: 76.9, 0.1: 84.2, 0.14: 87.7, 0.18: 88.8, 0.24: 87.5, 0.3: 83.8}


@pytest.mark.parametrize(("gamma", "f_c"), ISO_281_TABLE_7.items())
def test_ratings_are_those_of_the_tables_of_iso_281(gamma, f_c):
    bearing = {"needles": 9, "needle_length": "10 mm", "needle_diameter": "1 mm", "pitch_diameter": f"{1 / gamma} mm"}
    made = joints.load("cirelli2021", {"bearing": bearing}, "x.toml").bearing
    np.testing.assert_allclose(made.dynamic_rating, f_c * 10 ** (7 / 9) * 9**0.75, rtol=1e-3)
    machined = joints.load("cirelli2021", {"bearing": bearing | {"rings": "machined"}}, "x.toml").bearing
    np.testing.assert_allclose(machined.dynamic_rating / made.dynamic_rating, 1.1)
