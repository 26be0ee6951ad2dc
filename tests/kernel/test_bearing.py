"""Equivalent loads of the pins' bearings: closed forms, and integrals of histories by NumPy, with each method."""

from __future__ import annotations

import numpy as np
import pytest

from tests.conftest import with_orders
from tests.support import naive
from tests.support.of_cardan import KERNEL_RESULT, SPAN
from tolstat.common.load_kinds import CONTACTS, RESULTANT
from tolstat.common.tables import Fidelity, Method, Options
from tolstat.kernel.revolution.bearing import write_equivalent_loads
from tolstat.kernel.revolution.settle import make_samples
from tolstat.solver.simulation import simulate_rows

P = 10 / 3
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
