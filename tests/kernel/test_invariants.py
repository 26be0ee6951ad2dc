"""What mechanics conserves: energy, momentum and angular momentum, action and reaction.

Tolerances are set so that one quantity off by a per cent or less fails; where that does not show, a wrong twin does.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.conftest import sliding, with_law
from tests.kernel.test_dynamics import OPTIONS, ORDERS, SHAFTS, loaded
from tests.support import energy, naive
from tests.support.kernel_energy import ENERGY, ENERGY_FIELDS
from tests.support.mechanisms import N_DOF, PSI, body, lump_kind, triads
from tests.support.of_cardan import PARAM
from tolstat.common.cardan import CARDAN
from tolstat.common.tables import Method, Options, Status
from tolstat.joint.contact import LAWS
from tolstat.kernel.mechanics import dynamics
from tolstat.kernel.mechanics.work import make_work

METHODS = pytest.mark.parametrize("method", list(Method))
BENT = np.radians(15)
DAMPERS = ("c", "c_d", "c_t", "c_a")


def integrated(par, revolutions, **options):
    """Trajectory of a joint and its energy balance."""
    options = Options(**({"newton_tol": 1e-9, "newton_max_iter": 30} | options))
    steps = round(revolutions * options.steps_per_rev)
    trajectory = energy.follow(par, options, steps)
    assert trajectory.status == Status.OK
    return trajectory, energy.balance(par, options, trajectory)


def undamped(par):
    for name in DAMPERS:
        par[name] = 0.0
    return par


def particles(t, q, par):
    """World positions of six particles that stand for each lump, hub and pins before arms; (54, 3), and their masses.

    A pair on each principal axis, at the distance that gives the lump's second moments of mass.
    """
    at, (places, masses) = naive.bodies(t, q, par), ([], [])
    for i, lump in enumerate(CARDAN.lumps):
        mass, inertia = par.mass[lump_kind(lump.kind)], par.inertia[lump_kind(lump.kind)]
        distance = np.sqrt(3 * (0.5 * inertia.sum() - inertia) / mass)
        arms = distance[:, None] * (triads()[i] @ at.attitude[i].T)
        places.append(at.position[i] + np.concatenate([arms, -arms]))
        masses.append(np.full(6, mass / 6))
    return np.concatenate(places), np.concatenate(masses)


def along(t, q, v, a, par, h):
    """Positions of the particles at five times h apart, on the parabola through q; (5, 54, 3), and their masses."""
    at = [particles(t + s, q + v * s + 0.5 * a * s * s, par) for s in h * np.arange(-2, 3)]
    return np.array([places for places, _ in at]), at[0][1]


def measured(par, t, q, v):
    return energy.balance(
        np.array([par], PARAM), OPTIONS, energy.Trajectory(np.array([t]), np.array([[q, v, v]]), Status.OK)
    ).of[0]


@pytest.mark.slow
def test_kinetic_energy_is_that_of_particles(params, random_errors):
    par, t, q, v = loaded(params, random_errors, "mode")
    places, masses = along(t, q, v, np.zeros(N_DOF), par, 1e-5)
    velocity = (places[0] - 8 * places[1] + 8 * places[3] - places[4]) / 12e-5
    work = make_work()
    dynamics.forces(t, q, v, par, work)
    output = work.frame_w[par.frame[body("output")], 2] + v[PSI]
    expected = 0.5 * masses @ (velocity**2).sum(axis=1) + 0.5 * par.Js[0] * output**2
    kinetic = measured(par, t, q, v)["kinetic"]
    assert kinetic == pytest.approx(expected, rel=1e-9)
    assert measured(par, t, q, 1.001 * v)["kinetic"] != pytest.approx(expected, rel=1e-9)


@ORDERS
@SHAFTS
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_powers_are_the_rate_of_the_stored_energy(params, random_errors, law, seed, shaft, orders):
    """To 0.5 % of the smallest of them, so that none can be wrong by more; differences extrapolated to h = 0.

    Orders of the speed make the input power a million watts, which the differences round to 2e-9 of it.
    """
    par, t, q, v = loaded(params, random_errors, law, seed, shaft=shaft, **orders)
    v = 3 * v
    a = np.full(N_DOF, np.nan)
    dynamics.acceleration(t, q, v, par, OPTIONS, make_work(), a)

    def rate(h):
        ends = [measured(par, t + s, q + v * s + 0.5 * a * s * s, v + a * s) for s in (-h, h)]
        return sum(ends[1][name] - ends[0][name] for name in energy.STORED) / (2 * h)

    powers = {name: sign * measured(par, t, q, v)[name] for name, sign in energy.GAINS.items()}
    smallest = min(abs(power) for power in powers.values() if power)
    assert abs((4 * rate(5e-8) - rate(1e-7)) / 3 - sum(powers.values())) < 0.005 * smallest + 2e-9 * abs(
        powers["input"]
    )


@METHODS
@pytest.mark.parametrize("damped", [True, False])
def test_energy_closes_to_the_order_of_the_method_from_the_start(params, method, damped):
    """Over the first 7 degrees, with steps that resolve the ringing of the start."""
    par = params(alpha=BENT) if damped else undamped(params(alpha=BENT))
    errors = []
    for steps in (2500, 5000, 10000, 20000):
        _, balance = integrated(par, 0.02, method=int(method), steps_per_rev=steps)
        errors.append(np.abs(balance.imbalance()).max())
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(slopes, 2.0, atol=0.3)
    # one per cent of the input's change of power is seen
    excess = 0.01 * np.abs(balance.work("input") - balance.t * balance.of["input"][0]).max()
    assert excess > 10 * errors[-1]


def wobble(balance, steps):
    """Root mean square of the imbalance about its mean over the last revolution."""
    return np.std(balance.imbalance()[-1 - steps :])


@METHODS
def test_energy_closes_to_the_order_of_the_method_once_settled(params, method):
    par = params(alpha=BENT, pin1__tilt_z=np.radians(0.5))
    errors = []
    for steps in (360, 720):
        _, balance = integrated(par, 3, method=int(method), steps_per_rev=steps)
        errors.append(wobble(balance, steps))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.3)
    # a kinetic energy without one thousandth of its change would stand out
    balance.of["kinetic"] *= 0.999
    assert wobble(balance, 720) > 100 * errors[-1]


@METHODS
def test_power_in_is_power_out_and_losses_over_a_settled_revolution(params, random_errors, method):
    """Closed within 0.3 % of the losses, which are 1e-7 of the power; 2 % with a free output shaft, by TR-BDF2."""
    errors = random_errors(1)
    for law, support in (("uniform", None), ("mode", None), ("mode", 0.0), ("mode", 2e7)):
        par = with_law(params(alpha=BENT, **errors), law)
        if support is not None:
            sliding(par, k_a=support)
        _, balance = integrated(par, 4, method=int(method), steps_per_rev=1440)
        work = {name: np.diff(balance.work(name)[[-1441, -1]])[0] for name in energy.GAINS}
        stored = np.diff(balance.stored()[[-1441, -1]])[0]
        assert work["input"] == pytest.approx(2 * np.pi * par.torque[0], rel=1e-6)
        assert abs(stored) < 1e-8
        left = sum(sign * work[name] for name, sign in energy.GAINS.items())
        losses = work["film"] + work["contact_damping"] + work["bushing_damping"] + work["support_damping"]
        assert 1e-5 < losses < 1e-3
        assert abs(left) < (0.02 if support == 0 else 0.003) * losses
        assert (work["support_damping"] > 0.01 * losses) == (support is not None)


@METHODS
@pytest.mark.parametrize("alpha", [0.0, BENT])
def test_undamped_joint_keeps_its_energy_for_twenty_revolutions(params, method, alpha):
    """Without any damper; the start rings beyond what 180 steps resolve, and that part is lost or gained at once."""
    par = undamped(params(alpha=alpha))
    _, balance = integrated(par, 20, method=int(method))
    off, through = balance.imbalance(), balance.work("input")
    assert all((balance.of[name] == 0).all() for name in ("bushing_damping", "contact_damping", "film"))
    assert through[-1] == pytest.approx(20 * 2 * np.pi * par.torque[0], rel=1e-6)
    drift = off[-1] - off[180]
    assert np.abs(off).max() < 5e-3
    assert abs(drift) < 1e-8 * through[-1]
    # an input power wrong by a ten-millionth
    assert abs(drift - 1e-7 * through[-1]) > 1e-8 * through[-1]


@pytest.fixture(scope="module", params=list(Method))
def revolution(request, params, random_errors):
    """The second revolution of a joint with errors everywhere: its parameters, and t, q, v, a at every step."""
    par = params(alpha=BENT, **random_errors(1))
    trajectory, _ = integrated(par, 2, method=int(request.param))
    return par[0], list(zip(trajectory.t[180:], *trajectory.points[180:].swapaxes(0, 1), strict=True))


def ground_loads(t, q, v, par):
    """Force on every body and its moment about O, in ground axes; shape (11, 2, 3)."""
    work = make_work()
    dynamics.forces(t, q, v, par, work)
    frames = naive.ideal_attitudes(t, par, CARDAN)
    force = np.einsum("bij,bj->bi", frames, work.force[:, :3])
    torque = np.einsum("bij,bj->bi", frames, work.force[:, 3:] + np.cross(work.pos, work.force[:, :3]))
    return np.stack([force, torque], axis=1)


def test_action_is_reaction_at_each_step(revolution):
    par, points = revolution
    for t, q, v, _ in points:
        loads = ground_loads(t, q, v, par)
        size = np.abs(loads).max(axis=(0, 2))
        assert (np.abs(loads.sum(axis=0)).max(axis=1) < 1e-12 * size).all()
        loads[body("pin1")] *= 1 + 1e-6
        assert (np.abs(loads.sum(axis=0)).max(axis=1) > 1e-12 * size).all()


@pytest.mark.slow
def test_momentum_of_the_cross_changes_by_the_forces_of_the_arms_at_each_step(revolution):
    """Linear and angular, about O, in ground axes; rates from second differences of the particles' positions."""
    par, points = revolution
    arms = body("hole1")
    assert {lump.member for lump in CARDAN.lumps[:arms]} == {"cross"}
    rates, loads = [], []
    h = 1e-4
    for t, q, v, a in points:
        places, masses = along(t, q, v, a, par, h)
        cross = slice(0, 6 * arms)
        acceleration = np.tensordot([-1, 16, -30, 16, -1], places, 1)[cross] / (12 * h * h)
        force = masses[cross, None] * acceleration
        rates.append([force.sum(axis=0), np.cross(places[2, cross], force).sum(axis=0)])
        # what the arms and shafts do not keep for themselves acts on the cross
        loads.append(-ground_loads(t, q, v, par)[arms:].sum(axis=0))
    rates, loads = np.array(rates), np.array(loads)
    size = np.abs(rates).max(axis=(0, 2))
    assert (size > [0.05, 0.5]).all(), "N, N m"
    assert (np.abs(rates - loads).max(axis=(0, 2)) < 1e-4 * size).all()
    assert (np.abs(rates - 1.001 * loads).max(axis=(0, 2)) > 1e-4 * size).all()


def test_a_joint_that_fails_keeps_what_it_reached(params):
    par = params(alpha=BENT)
    par.clearance[0, 2] = -1e-6
    outside = energy.follow(par, OPTIONS, 10)
    assert outside.status == Status.OUTSIDE_MODEL
    assert outside.points.shape == (0, 3, N_DOF)
    par = params(alpha=BENT)
    par.mass[0, lump_kind("hub")] = np.nan
    failed = energy.follow(par, OPTIONS, 10)
    assert failed.status == Status.NEWTON_FAILED
    assert len(failed.t) == len(failed.points) == 1


def test_every_field_has_its_place_in_the_balance():
    assert {*energy.STORED, *energy.GAINS} == set(ENERGY.names) == {f.name for f in ENERGY_FIELDS}
