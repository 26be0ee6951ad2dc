"""Mechanisms other than one joint: elimination with filled-in blocks, drive shafts against the twin."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support import naive
from tests.support.graphs import GRAPHS, put_system, system
from tests.support.held import FREE, drive_shaft, held
from tests.support.kernel_states import dense
from tolstat.common.cardan import SHAFT, SPLINED
from tolstat.common.mechanism import GENERAL
from tolstat.common.tables import Options
from tolstat.kernel.mechanics import dynamics, linsolve, tangent
from tolstat.kernel.mechanics.motion import ideal_motion
from tolstat.kernel.mechanics.work import make_work, work_dtype

OPTIONS = Options()


def test_elimination_with_blocks_that_are_filled_in() -> None:
    """Two joints on a tube with six unknowns, as records of the sizes of its graph."""
    graph = GRAPHS["free tube"]
    plan, n, u = graph.plan(), graph.lumps, graph.unknowns
    par = np.zeros(1, [(field, "i8", values.shape) for field, values in plan.items()])
    for field, values in plan.items():
        par[field] = values
    shapes = {"block": (graph.blocks(), 6, 6), "edge": (u, n, 6), "corner": (u, u), "solution": (6 * n + u,)}
    work = np.zeros(1, [(field, "f8", shape) for field, shape in shapes.items()]).view(np.recarray)[0]
    matrix, right = system(graph, 4)
    put_system(graph, matrix, work.block, work.edge, work.corner)
    work.solution[:] = right
    record = par.view(np.recarray)[0]
    assert linsolve.factorise(record, work)
    linsolve.solve(np.zeros(6 * n + u), record, work)
    np.testing.assert_allclose(work.solution, np.linalg.solve(matrix, right), rtol=1e-9, atol=1e-10)


@pytest.fixture(params=[{}, {"spline": None, "arrangement": "0.6 rad"}], ids=["splined", "one tube"])
def shaft(request):
    """Drive shaft with errors: parameters, mechanism, time, and a state in the midst of contact."""
    rng, bent = np.random.default_rng(5), drive_shaft(0.25, offset="0.4 rad", **request.param)
    mechanism = SPLINED if bent.spline else SHAFT
    errors = {f"{part}.offset_t": rng.normal(0, 2e-5) for pair in mechanism.pairs for part in (pair.pin, pair.hole)}
    rows, found = held(errors | ({"shaft.spline": 0.6} if bent.spline else {}), 0.4, 80.0, drive_shaft=bent, shaft=FREE)
    assert found == mechanism
    par, lumps = rows[0], len(mechanism.lumps)
    par.clearance[:] = 1e-5
    q, v = rng.normal(0, 2e-5, mechanism.dof), rng.normal(0, 1e-2, mechanism.dof)
    q[: 6 * lumps].reshape(lumps, 6)[:, 3:] = rng.normal(0, 5e-3, (lumps, 3))
    return par, mechanism, 0.017, q, v


@pytest.mark.parametrize("phase", [0.0, 0.7, 2.0, 4.0, 5.9])
def test_frames_of_the_second_joint_follow_the_first(shaft, phase: float) -> None:
    """Relative rotations, angular velocities and accelerations, by differences of the twin's attitudes."""
    par, mechanism, *_ = shaft
    work, h = make_work(mechanism), 1e-4
    at = np.array([naive.frames(phase + s * par.omega * h, par, mechanism) for s in naive.NODES])
    back = at[4].swapaxes(1, 2)
    w = naive.vee(np.tensordot(naive.FIRST, at, 1) @ back) / h
    dw = naive.vee(np.tensordot(naive.SECOND, at, 1) @ back) / h**2
    ideal_motion(phase, par, work)
    np.testing.assert_allclose(work.frame_w, np.einsum("bij,bj->bi", back, w), atol=1e-9 * par.omega)
    np.testing.assert_allclose(work.frame_dw, np.einsum("bij,bj->bi", back, dw), atol=1e-7 * par.omega**2)
    names = [member.name for member in mechanism.members]
    origin = naive.poses(phase, par, mechanism)[1]
    for i, hinge in enumerate(mechanism.hinges):
        pin, hole = (names.index(name) for name in (hinge.pin, hinge.hole))
        if hinge.axis == GENERAL:
            np.testing.assert_allclose(work.into_hole[i], back[hole] @ at[4][pin], atol=1e-13)
            np.testing.assert_allclose(work.place[i], back[hole] @ (origin[pin] - origin[hole]), atol=1e-13)
            continue
        expected = naive.turn(np.eye(3)[hinge.axis], np.arctan2(work.relative[i, 1], work.relative[i, 0]))
        np.testing.assert_allclose(back[hole] @ at[4][pin], expected, atol=1e-13)


def test_accelerations_of_two_joints_balance_the_naive_twin(shaft) -> None:
    par, mechanism, t, q, v = shaft
    work, a = make_work(mechanism), np.full(mechanism.dof, np.nan)
    dynamics.acceleration(t, q, v, par, OPTIONS, work, a)
    loads, largest = naive.forces(t, q, v, par, mechanism), np.abs(work.force).max()
    np.testing.assert_allclose(work.load, loads.bushing, rtol=1e-8, atol=1e-9 * np.abs(loads.bushing).max())
    contacts = naive.contacts(t, q, v, par, mechanism)
    assert (contacts[:, 2] > 100).all(), "the test wants every pin in contact"
    np.testing.assert_allclose(work.contact, contacts, rtol=1e-8, atol=1e-9 * contacts.max())
    off = naive.imbalance(t, q, v, a, par, mechanism)
    assert set(off) == {*(lump.name for lump in mechanism.lumps), *mechanism.unknowns}
    for name, difference in off.items():
        scale = largest if name != "psi" else np.abs(work.force[len(mechanism.lumps) :, 5]).max()
        assert np.abs(difference).max() < 1e-9 * scale, name


def test_residual_and_tangent_of_two_joints(shaft) -> None:
    par, mechanism, t, q, v = shaft
    q, v = 0.02 * q, 0.02 * v  # the tangent leaves out how loads turn with their bodies
    work, a, out = make_work(mechanism), np.full(mechanism.dof, np.nan), np.full((2, mechanism.dof), np.nan)
    dynamics.acceleration(t, q, v, par, OPTIONS, work, a)
    dynamics.residual(t, q, v, a, par, OPTIONS, work, out[0])
    assert np.abs(out[0]).max() < 1e-11 * np.abs(work.force).max()
    cv, derivative = 2000.0, np.empty((mechanism.dof, mechanism.dof))
    ca, a = cv * cv, np.zeros(mechanism.dof)
    for j, step in enumerate(1e-9 * np.eye(mechanism.dof)):
        for k, d in enumerate((step, -step)):
            dynamics.residual(t, q + d, v + cv * d, a + ca * d, par, OPTIONS, work, out[k])
        derivative[:, j] = (out[0] - out[1]) / 2e-9
    dynamics.residual(t, q, v, a, par, OPTIONS, work, out[0])
    tangent.assemble(cv, ca, cv, par, work)
    full = dense(work, mechanism)
    contraction = np.eye(mechanism.dof) - np.linalg.solve(full, derivative)
    assert np.abs(np.linalg.eigvals(contraction)).max() < 0.3
    right = np.random.default_rng(0).normal(size=mechanism.dof)
    assert linsolve.factorise(par, work)
    work.solution[:] = right
    linsolve.solve(np.zeros(mechanism.dof), par, work)
    expected = np.linalg.solve(full, right)
    np.testing.assert_allclose(work.solution, expected, rtol=1e-3, atol=5e-4 * np.abs(expected).max())
    assert work_dtype(mechanism) != work_dtype()
