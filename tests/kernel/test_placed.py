"""Members with a place in their parents: linkages against the twin and the reference."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support import linkages, naive
from tolstat.common.tables import Options
from tolstat.kernel.mechanics import dynamics
from tolstat.kernel.mechanics.motion import ideal_motion
from tolstat.kernel.mechanics.work import FORCE, make_work

SPATIAL = "bennett"
MORE = [pytest.param(name, marks=pytest.mark.slow) for name in ("hinge_middle", "fourbar_tilt", "cranks")]
"""Each compiles kernels for another mechanism."""


@pytest.fixture(scope="module")
def linkage():
    """Bennett's linkage: mechanism, parameters, work record."""
    mechanism = linkages.mechanism_of(SPATIAL)
    return mechanism, linkages.parameters(SPATIAL, mechanism)[0], make_work(mechanism)


@pytest.mark.parametrize("name", ["hinge", "fourbar", "cranks", SPATIAL])
def test_members_move_as_closed_forms_say(name: str) -> None:
    mechanism, case = linkages.mechanism_of(name), linkages.cases()[name]
    par, members = linkages.parameters(name, mechanism)[0], [member.name for member in mechanism.members]
    for theta in np.linspace(0, 6, 7):
        attitudes, origins = naive.placed(theta, par, mechanism)
        for pair in case["pairs"].values():
            places = []
            for side in (pair["pin"], pair["eye"]):
                i, member = members.index(side["member"]), side["member"]
                axes, origin = linkages.pose(case, member, theta)
                np.testing.assert_allclose(attitudes[i] @ linkages.turned(name, member), axes, atol=1e-9)
                places.append(origins[i] + attitudes[i] @ linkages.in_member(name, side))
                np.testing.assert_allclose(places[-1], origin + axes @ side["point_m"], atol=1e-9)
            np.testing.assert_allclose(*places, atol=1e-9)


@pytest.mark.parametrize("phase", [0.3, 3.0])
def test_frames_and_relative_motion_are_derivatives_of_the_poses(linkage, phase: float) -> None:
    mechanism, par, work = linkage
    h = 1e-4
    poses = [naive.placed(phase + s * par.omega * h, par, mechanism) for s in naive.NODES]
    attitude, origin = (np.array([pose[k] for pose in poses]) for k in range(2))
    back = attitude[4].swapaxes(1, 2)
    w = naive.vee(np.tensordot(naive.FIRST, attitude, 1) @ back) / h
    dw = naive.vee(np.tensordot(naive.SECOND, attitude, 1) @ back) / h**2
    acceleration = np.tensordot(naive.SECOND, origin, 1) / h**2
    ideal_motion(phase, par, work)
    np.testing.assert_allclose(work.frame_w, np.einsum("bij,bj->bi", back, w), atol=1e-9 * par.omega)
    np.testing.assert_allclose(work.frame_dw, np.einsum("bij,bj->bi", back, dw), atol=1e-6 * par.omega**2)
    np.testing.assert_allclose(work.origin_a, np.einsum("bij,bj->bi", back, acceleration), atol=1e-6 * par.omega**2)
    members = [member.name for member in mechanism.members]
    for i, hinge in enumerate(mechanism.hinges):
        pin, hole = members.index(hinge.pin), members.index(hinge.hole)
        relative = np.einsum("sji,sjk->sik", attitude[:, hole], attitude[:, pin])
        place = np.einsum("sji,sj->si", attitude[:, hole], origin[:, pin] - origin[:, hole])
        np.testing.assert_allclose(work.into_hole[i], relative[4], atol=1e-13)
        np.testing.assert_allclose(work.place[i], place[4], atol=1e-13)
        np.testing.assert_allclose(work.place_v[i], np.tensordot(naive.FIRST, place, 1) / h, atol=1e-9)


@pytest.mark.parametrize("pulled", [False, True], ids=["", "pulled"])
@pytest.mark.parametrize("name", [SPATIAL, *MORE])
def test_accelerations_balance_the_twin(name: str, pulled: bool) -> None:
    mechanism = linkages.mechanism_of(name, pulled)
    par, work = linkages.parameters(name, mechanism, pulled)[0], make_work(mechanism)
    rng = np.random.default_rng(3)
    q, v, a = rng.normal(0, 2e-5, mechanism.dof), rng.normal(0, 1e-3, mechanism.dof), np.full(mechanism.dof, np.nan)
    dynamics.acceleration(0.3, q, v, par, Options(), work, a)
    largest = np.abs(work.force).max()
    expected = naive.forces(0.3, q, v, par, mechanism)
    np.testing.assert_allclose(work.load, expected.bushing, atol=1e-9 * largest)
    np.testing.assert_allclose(work.face[:, FORCE], expected.thrust, atol=1e-9 * largest)
    for lump, off in naive.imbalance(0.3, q, v, a, par, mechanism).items():
        assert np.abs(off).max() < 1e-7 * largest, lump


@pytest.mark.parametrize("name", [SPATIAL, *MORE])
def test_loads_at_the_states_of_the_reference(name: str) -> None:
    """What the ideal motion misses changes loads by the contacts' stiffness times some 1e-10 m."""
    mechanism = linkages.mechanism_of(name)
    par, work, of = linkages.parameters(name, mechanism)[0], make_work(mechanism), linkages.reference(name)
    bushings = [i for i, bushing in enumerate(mechanism.bushings) if bushing.group != "drive"]
    lumps = [list(of["bodies"]).index(linkages.name_in_reference(lump.name)) for lump in mechanism.lumps]
    order = [list(of["names"]).index(linkages.name_in_reference(mechanism.bushings[i].name)) for i in bushings]
    axes = np.array([linkages.turned(name, lump.member) for lump in mechanism.lumps])
    for theta, states, loads, thrust in zip(of["theta"], of["q"], of["loads"], of["thrust"], strict=True):
        here = np.einsum("lij,lkj->lki", axes, states[lumps].reshape(-1, 4, 3))
        q, v = here[:, :2].ravel(), here[:, 2:].ravel()
        dynamics.forces(theta / par.omega, q, v, par, work)
        np.testing.assert_allclose(work.load[bushings], loads[order], atol=1e-3 * np.abs(of["loads"]).max())
        np.testing.assert_allclose(work.face[:, FORCE], thrust.ravel(), atol=1e-3 * np.abs(of["loads"]).max())


def test_tangent_is_the_slope_of_the_residual(linkage) -> None:
    """As far as the tangent goes: Newton's iteration with it contracts."""
    from tests.support.kernel_states import dense
    from tolstat.kernel.mechanics import tangent

    mechanism, par, work = linkage
    n, cv = mechanism.dof, 2000.0
    rng = np.random.default_rng(5)
    q, v, a = rng.normal(0, 2e-5, n), rng.normal(0, 1e-3, n), np.zeros(n)
    out, derivative = np.empty((2, n)), np.empty((n, n))
    for j, step in enumerate(1e-9 * np.eye(n)):
        for k, d in enumerate((step, -step)):
            dynamics.residual(0.3, q + d, v + cv * d, a + cv * cv * d, par, Options(), work, out[k])
        derivative[:, j] = (out[0] - out[1]) / 2e-9
    dynamics.residual(0.3, q, v, a, par, Options(), work, out[0])
    tangent.assemble(cv, cv * cv, cv, par, work)
    contraction = np.eye(n) - np.linalg.solve(dense(work, mechanism), derivative)
    assert np.abs(np.linalg.eigvals(contraction)).max() < 0.3
