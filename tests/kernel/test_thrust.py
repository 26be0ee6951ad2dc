"""Thrust faces, friction and bearings of shafts: the naive twin, slopes of the residual, statics of a shaft."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support import naive
from tests.support.held import FACES, FREE, FRICTION, TUBE, drive_shaft, held
from tests.support.kernel_states import dense
from tolstat import joint as joints
from tolstat.common.load_kinds import spans
from tolstat.common.tables import Options
from tolstat.kernel.mechanics import dynamics, tangent
from tolstat.kernel.mechanics.loads import complete_loads, write_loads
from tolstat.kernel.mechanics.work import FORCE, make_work

OPTIONS = Options()
WHOLE = {"thrust": FACES | {"end_play": "0 mm"}, "friction": FRICTION, "shaft": FREE}
ACROSS = {"lateral": "2e7 N/m", "mass": "5 kg", "unbalance": {"amount": "1e-3 kg*m", "angle": "30 deg"}}
THROWN = TUBE | {"unbalance": {"amount": "2e-3 kg*m", "angle": "50 deg"}}
OTHER = joints.load(
    "pin25",
    {"thrust": {"end_play": "0 mm", "k": "6e7 N/m"}, "friction": {"mu": 0.06, "slip_speed": "0.02 m/s"}, "shaft": FREE},
    "case.toml",
)
"""A smaller joint in needle bearings, with five stations a pin instead of three."""
SHAFT, UNLIKE = (drive_shaft(0.2, offset="0.1 rad", tube=THROWN, **own) for own in ({}, {"joint2": OTHER}))
MECHANISMS = pytest.mark.parametrize("drive", [None, SHAFT, UNLIKE], ids=["joint", "shaft", "unlike"])


def state(seed: int, drive: joints.DriveShaft | None = None, turned: float = 5e-3, **sections):
    """A joint, or two, with errors in the midst of contact: parameters, mechanism, time, q and v at random."""
    rng = np.random.default_rng(seed)
    names = held(drive_shaft=drive, **sections)[1]
    errors = {}
    for pair in names.pairs:
        for feature in (pair.pin, pair.hole):
            errors |= {f"{feature}.offset_{axis}": rng.normal(0, 2e-5) for axis in "etz"}
            errors |= {f"{feature}.tilt_{axis}": rng.normal(0, 2e-3) for axis in "tz"}
    rows, mechanism = held(errors, alpha=0.4, speed=80.0, drive_shaft=drive, **sections)
    par, lumps = rows[0], len(mechanism.lumps)
    par.clearance[:] = 1e-5
    q, v = rng.normal(0, 2e-5, mechanism.dof), rng.normal(0, 1e-2, mechanism.dof)
    q[: 6 * lumps].reshape(lumps, 6)[:, 3:] = rng.normal(0, turned, (lumps, 3))
    return par, mechanism, 0.017, q, v


def test_a_shaft_that_moves_across_has_the_accelerations_and_loads_of_the_twin() -> None:
    par, mechanism, t, q, v = state(1, thrust=FACES | {"end_play": "0 mm"}, shaft=FREE | ACROSS)
    work, a = make_work(mechanism), np.full(mechanism.dof, np.nan)
    dynamics.acceleration(t, q, v, par, OPTIONS, work, a)
    largest = np.abs(work.force).max()
    for name, difference in naive.imbalance(t, q, v, a, par, mechanism).items():
        assert np.abs(difference).max() < 1e-8 * largest, name
    out = np.full(mechanism.dof, np.nan)
    dynamics.residual(t, q, v, a, par, OPTIONS, work, out)
    assert np.abs(out).max() < 1e-11 * largest
    write_loads(v, par, work)
    complete_loads(par, work)
    carried = par.k_l * q[-2:] + par.c_l * (v[-2:] + work.frame_w[par.frame[-1], 2] * np.array([-q[-1], q[-2]]))
    lateral = work.loads[spans(mechanism)["lateral"]][1]
    assert lateral == pytest.approx(np.linalg.norm(carried), rel=1e-12)


@MECHANISMS
@pytest.mark.parametrize(("seed", "along"), [(1, 0.1), (2, 0.1), (3, 0.3)])
def test_accelerations_and_loads_are_those_of_the_naive_twin(drive, seed: int, along: float) -> None:
    par, mechanism, t, q, v = state(seed, drive, **WHOLE | {"friction": FRICTION | {"mu_along": along}})
    work, a = make_work(mechanism), np.full(mechanism.dof, np.nan)
    dynamics.acceleration(t, q, v, par, OPTIONS, work, a)
    expected, largest = naive.forces(t, q, v, par, mechanism), np.abs(work.force).max()
    assert 0 < (expected.thrust > 100).sum() < len(mechanism.faces), "the test wants faces pressed and clear"
    assert (expected.loss > 1).all(), "the test wants every pin to rub"
    np.testing.assert_allclose(work.face[:, FORCE], expected.thrust, rtol=1e-8, atol=1e-9 * expected.thrust.max())
    np.testing.assert_allclose(work.loss, expected.loss, rtol=1e-7)
    np.testing.assert_allclose(work.load, expected.bushing, rtol=1e-8, atol=1e-9 * np.abs(expected.bushing).max())
    off = naive.imbalance(t, q, v, a, par, mechanism)
    for name, difference in off.items():
        scale = np.abs(work.force[len(mechanism.lumps) :, 5]).max() if name in mechanism.rotations else largest
        assert np.abs(difference).max() < 1e-9 * scale, name


def slopes(by_q: float, by_v: float, case) -> np.ndarray:
    """Derivative of the residual where q changes `by_q` times, and v `by_v` times, as much as an unknown."""
    par, mechanism, t, q, v = case
    work, a, out = make_work(mechanism), np.zeros(mechanism.dof), np.empty((2, mechanism.dof))
    columns = []
    for step in 1e-9 * np.eye(mechanism.dof):
        for k, d in enumerate((step, -step)):
            dynamics.residual(t, q + by_q * d, v + by_v * d, a, par, OPTIONS, work, out[k])
        columns.append((out[0] - out[1]) / 2e-9)
    return np.array(columns).T


def assembled(cv: float, case) -> np.ndarray:
    """Tangent at a state, without the part of the masses."""
    par, mechanism, t, q, v = case
    work = make_work(mechanism)
    dynamics.forces(t, q, v, par, work)
    tangent.assemble(cv, 0.0, cv, par, work)
    return dense(work, mechanism)


def without(name: str, case):
    """The same state with a number of the joint zero."""
    par = case[0].copy()
    par[name] = 0.0
    return par, *case[1:]


def test_tangent_of_faces_is_the_slope_of_their_forces() -> None:
    """Stiffness and damping; what it leaves out, the turning of a face with its hole, is a per mille of it."""
    case, cv = state(1, turned=1e-4, **WHOLE | {"friction": {}}), 2000.0
    bare = without("face_k", without("face_c", case))
    expected = slopes(1.0, cv, case) - slopes(1.0, cv, bare)
    found = assembled(cv, case) - assembled(cv, bare)
    np.testing.assert_allclose(found, expected, atol=2e-3 * np.abs(expected).max())


@pytest.mark.parametrize("along", [0.1, 0.3])
def test_tangent_of_friction_is_its_slope_by_velocity(along: float) -> None:
    """Forces that press held: they have no damping here, so that they do not change with v."""
    # pins slide as fast as the slip speed: the slope along the sliding counts, and differs from that across it
    friction = FRICTION | {"mu_along": along, "slip_speed": "0.5 m/s"}
    case = without("c_d", state(1, turned=1e-4, **WHOLE | {"friction": friction}))
    cv = 2000.0
    bare = without("mu", case)
    expected = cv * (slopes(0.0, 1.0, case) - slopes(0.0, 1.0, bare))
    found = assembled(cv, case) - assembled(cv, bare)
    np.testing.assert_allclose(found, expected, atol=1e-3 * np.abs(expected).max())


def test_bearings_balance_what_the_joint_exerts_on_a_shaft() -> None:
    """Two forces across a shaft at its bearings have the resultant and the moment about O of the twin's forces."""
    bearings = {"input": {"bearings": ["80 mm", "240 mm"]}, "output": {"bearings": ["0.1 m", "0.15 m"]}}
    par, mechanism, t, q, v = state(2, shaft=FREE | bearings)
    work = make_work(mechanism)
    dynamics.forces(t, q, v, par, work)
    write_loads(v, par, work)
    complete_loads(par, work)
    now = naive.motion(t, q, v, 0 * q, par, mechanism)
    force, axes = naive.loads_between(now, par, mechanism).force, naive.ideal_attitudes(t, par, mechanism)
    for i, (name, places) in enumerate({"input": (-0.08, -0.24), "output": (0.1, 0.15)}.items()):
        b = mechanism.bodies.index(name)
        about_centre = force[b, 3:] + np.cross(now.bodies.position[b], force[b, :3])
        f, m = (axes[b].T @ x @ [1, 1j, 0] for x in (force[b, :3], about_centre))
        reactions = np.linalg.solve([[1, 1], places], [f, -1j * m])  # a force F across at z has the moment z i F
        found = [work.loads[spans(mechanism)[f"bearing_{end}"]][i] for end in "ab"]
        np.testing.assert_allclose(found, np.abs(reactions), rtol=1e-8)
