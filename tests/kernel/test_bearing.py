"""Equivalent loads of the pins' bearings: closed forms, and integrals of histories by NumPy, with each method."""

from __future__ import annotations

import numpy as np
import pytest

from tests.conftest import with_orders
from tests.support import naive
from tests.support.of_cardan import KERNEL_RESULT, SPAN
from tolstat import joint as joints
from tolstat.common.cardan import CARDAN
from tolstat.common.load_kinds import CONTACTS, RESULTANT
from tolstat.common.tables import Fidelity, Method, Options
from tolstat.joint import Operation
from tolstat.kernel.revolution.bearing import tilt_of, write_equivalent_loads
from tolstat.kernel.revolution.settle import make_samples
from tolstat.solver.simulation import simulate_rows

P = 10 / 3
NEEDLES = {"needles": 32, "needle_length": "22 mm", "needle_diameter": "4 mm", "pitch_diameter": "42 mm"}
PLAIN = {"needles": 32, "needle_length": "22 mm"}
OPERATION = Operation.model_construct(alpha=np.radians(15), speed=50.0, torque=300.0)
ALPHA = np.radians(20)


def kernel(forces, par):
    """Equivalent loads of resultant contact forces, (samples, 4), of the joint `par`."""
    samples = make_samples(1, len(forces))[0]
    for pin in range(4):
        samples.loads[:, SPAN["contact"].start + len(CONTACTS) * pin + RESULTANT] = forces[:, pin]
    out = np.zeros(1, KERNEL_RESULT).view(np.recarray)[0]
    write_equivalent_loads(par[0], samples, out)
    return out.equivalent_load.copy()


def integral(forces, alpha, par=None):
    """The same by trapezoids over the angles of the swing, from the frames' definitions."""
    theta = np.linspace(0, 2 * np.pi, len(forces) + 1)
    theta = theta if par is None else naive.input_angle(theta, par)
    beta, gamma = np.arctan(np.tan(alpha) * np.sin(theta)), np.arcsin(np.sin(alpha) * np.cos(theta))
    powers = np.vstack([forces, forces[:1]]) ** P
    found = []
    for pin in range(4):
        way = np.abs(np.diff(gamma if pin < 2 else beta))
        found.append((np.sum(0.5 * (powers[1:, pin] + powers[:-1, pin]) * way) / way.sum()) ** (1 / P))
    return np.array(found)


@pytest.mark.parametrize("alpha", [0.0, 1e-9, ALPHA, -ALPHA, np.radians(89)])
def test_a_constant_force_is_its_own_equivalent(params, alpha):
    par = with_orders(params(alpha=alpha), speed=[(1, 0.3, 0.4)])
    np.testing.assert_allclose(kernel(np.full((180, 4), 700.0), par), 700.0, rtol=1e-13)


def test_two_forces_over_half_of_the_swing_each(params):
    """Pins 3 and 4 are at beta > 0 in the first half of a revolution, pins 1 and 2 at gamma > 0 around theta = 0."""
    theta = 2 * np.pi * (np.arange(3600)) / 3600
    forces = np.where(np.column_stack([np.cos(theta)] * 2 + [np.sin(theta)] * 2) > 0, 1000.0, 400.0)
    expected = (0.5 * (1000.0**P + 400.0**P)) ** (1 / P)
    np.testing.assert_allclose(kernel(forces, params(alpha=ALPHA)), expected, rtol=2e-4)


def test_a_force_where_the_pin_stands_still_counts_little(params):
    """beta turns back at theta = 90 deg, gamma at 0: the same peaks weigh differently on the two pairs."""
    forces = np.full((360, 4), 100.0)
    forces[88:93] = forces[268:273] = 1000.0
    output, _, input_, _ = kernel(forces, params(alpha=ALPHA))
    assert output > 2.5 * input_


@pytest.mark.parametrize("speed", [[], [(2, 0.2, 1.0)]])
def test_any_history_against_trapezoids(params, speed):
    rng, theta = np.random.default_rng(3), 2 * np.pi * np.arange(720) / 720
    for alpha in (0.05, 0.3, 1.0):
        par = with_orders(params(alpha=alpha), speed=speed)
        waves = sum(rng.uniform(-1, 1, 4) * np.cos(h * theta[:, None] + rng.uniform(0, 6, 4)) for h in range(1, 9))
        forces = 1000 * np.abs(waves)
        np.testing.assert_allclose(kernel(forces, par), integral(forces, alpha, par[0]), rtol=1e-4)


def test_no_force_and_no_result(params):
    assert (kernel(np.zeros((180, 4)), params(alpha=ALPHA)) == 0).all()
    forces = np.ones((180, 4))
    forces[7, 2] = np.nan
    assert np.isnan(kernel(forces, params(alpha=ALPHA))).tolist() == [False, False, True, False]


@pytest.mark.parametrize("law", ["mode", "needles"])
def test_tilt_and_place_of_a_pin_follow_from_its_end_stations(law, params):
    """Any displacements of the ends, as vectors across the hole."""
    joint = joints.load("cirelli2021", {"contact": {"law": law}, "bearing": NEEDLES}, "x")
    par = joints.perturb(joint, OPERATION, joints.nominal_errors(1, CARDAN)).view(np.recarray)[0]
    s = par.station_s[0, : par.n_stations[0]]
    for outer, inner in np.random.default_rng(5).uniform(-1e-4, 1e-4, (20, 2, 2)):
        products = np.array([outer @ outer, outer @ inner, inner @ inner])
        tilt, (r, along, across) = tilt_of(0, products, par)
        middle, beyond = 0.5 * (outer + inner), (outer - inner) / (s[0] - s[-1]) * 0.011
        np.testing.assert_allclose(tilt, np.hypot(*beyond) / 0.011)
        np.testing.assert_allclose(r, np.hypot(*middle))
        np.testing.assert_allclose(
            (along, across), (beyond @ middle / r, abs(beyond[0] * middle[1] - beyond[1] * middle[0]) / r), rtol=1e-6
        )


@pytest.mark.parametrize(("law", "clearance"), [("needles", "0.01 mm"), ("mode", "0.01 mm")])
def test_loads_over_a_revolution_are_those_of_laminae(law, clearance):
    """Sampled loads of a simulated joint: its pins lie between in line and at one end, loads rise with its tilt."""
    overrides = {"contact": {"law": law, "clearance": clearance}, "bearing": NEEDLES}
    joint = joints.load("cirelli2021", overrides, "x")
    errors = joints.nominal_errors(3, CARDAN)
    errors["pin1.tilt_z"] = np.radians([0.0, 0.05, 0.1])
    par = joints.perturb(joint, OPERATION, errors)
    plain = joints.load("cirelli2021", overrides | {"bearing": PLAIN}, "x")
    found, by_force = (simulate_rows(p, Options()).results for p in (par, joints.perturb(plain, OPERATION, errors)))
    np.testing.assert_array_equal(found["contact_max"], by_force["contact_max"])
    assert (found["equivalent_load"] > 1.05 * by_force["equivalent_load"]).all()
    assert (np.diff(found["tilt"][:, 0]) > 5e-4).all()
    assert (np.diff(found["equivalent_load"][:, 0]) > 0).all()
    assert (np.diff(found["line_load"][:, 0]) > 0).all()
    assert np.isnan(by_force["line_load"]).all()
    # the most loaded needle takes at least what it takes in line without clearance: 4.08 F/Z
    assert (found["line_load"] * 0.022 > 4.08 / 32 * found["contact_max"][:, :, RESULTANT]).all()


def test_an_ideal_joint_has_no_displacements():
    """Its pins touch at one place: the equivalent load is that of the force."""
    joint = joints.load("cirelli2021", {"bearing": NEEDLES}, "x")
    par = joints.perturb(joint, OPERATION, joints.nominal_errors(1, CARDAN))
    found = simulate_rows(par, Options(**METHODS["ideal"])).results[0]
    plain = joints.perturb(joints.load("cirelli2021", {}, "x"), OPERATION, joints.nominal_errors(1, CARDAN))
    by_force = simulate_rows(plain, Options(**METHODS["ideal"])).results[0]
    np.testing.assert_allclose(found["equivalent_load"], by_force["equivalent_load"], rtol=1e-3)
    assert np.isnan(found["line_load"]).all()
    assert not found["tilt"].any()


METHODS = {
    "bdf2": {},
    "tr_bdf2": {"method": int(Method.TR_BDF2)},
    "error_controlled": {"method": int(Method.TR_BDF2), "rtol": 1e-4},
    "quasistatic": {"fidelity": int(Fidelity.QUASISTATIC)},
    "ideal": {"fidelity": int(Fidelity.IDEAL)},
}


@pytest.mark.parametrize("name", METHODS)
def test_results_are_the_integral_of_the_histories(name, params):
    par = params(alpha=ALPHA, pin1__tilt_z=np.radians(0.3), hole3__offset_t=1e-4)
    found = simulate_rows(par, Options(**METHODS[name]), histories="full")
    forces = found.histories["contact"][0, :, :, RESULTANT].astype(float)
    assert np.ptp(forces, axis=0).min() > 1
    np.testing.assert_allclose(found.results["equivalent_load"][0], integral(forces, ALPHA), rtol=1e-3)


def test_finer_steps_change_it_little(params):
    par = params(alpha=ALPHA, pin1__tilt_z=np.radians(0.3))
    coarse, fine = (simulate_rows(par, Options(steps_per_rev=n)).results["equivalent_load"][0] for n in (180, 720))
    np.testing.assert_allclose(coarse, fine, rtol=1e-3)
