"""Flutter of the contacts: the condensed cross against the whole joint, and what becomes of joints that flutter."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from tolstat import flutter, joint, refinement, sampling, simulation, study
from tolstat.kernel import cross_growth
from tolstat.kernel.dynamics import forces
from tolstat.kernel.topology import HUB, N_DOF, PSI, TRIAD
from tolstat.kernel.work import make_work
from tolstat.tables import RESULT, Options, Status

STUDY = Path(__file__).parent.parent / "studies" / "iso2768_f.toml"
FLUTTERS = 861
"""Row whose cross swings at 2.1 kHz and grows by 335 /s about 135 degrees; held by damping elsewhere."""
AT_30, AT_300 = 66, 981
"""Rows that flutter at 0.3 and 3 times the torque: largest loads are a fifth and a third above what 180 steps show."""
STIFFNESS, DAMPING, MASS = range(3)


def parameters(*rows: int, torque: float = 1.0) -> np.ndarray:
    plan = study.load(STUDY, n=max(1, *rows))
    params = joint.perturb(plan.joint, sampling.draw(plan)[list(rows)])
    params["torque"] *= torque
    return params


def recorded(params: np.ndarray) -> np.ndarray:
    """Last revolution of one joint at 180 steps."""
    (found,) = simulation._together(params, Options(), True, np.zeros(1, RESULT).view(np.recarray))
    return found[1].copy()


@pytest.mark.parametrize("damping", [0.3, 0.02, -0.01])
def test_radius_of_one_oscillation(damping: float) -> None:
    """Of K = M = 1 and C = 2 z the eigenvalues have modulus 1; Cayley's transform takes them to exp(-atanh z)."""
    scratch = cross_growth.make_cross_scratch()
    for k, size in ((STIFFNESS, 1.0), (DAMPING, 2 * damping), (MASS, 1.0)):
        scratch.hub[k] = size * np.eye(6)
    assert cross_growth.transform(scratch.hub, scratch.power)
    found, expected = cross_growth.log_radius(scratch.power), -math.atanh(damping)
    assert found == pytest.approx(expected, abs=3e-4) if damping < 0 else expected <= found < -cross_growth.ENOUGH


def test_radius_of_any_system_is_that_of_its_eigenvalues() -> None:
    rng, grew = np.random.default_rng(5), 0
    scratch = cross_growth.make_cross_scratch()
    for size in np.linspace(0.002, 0.1, 20):
        skew = rng.normal(0, size, (6, 6))
        scratch.hub[MASS] = np.eye(6) + 0.05 * (skew + skew.T)
        scratch.hub[DAMPING] = 0.05 * np.eye(6)
        scratch.hub[STIFFNESS] = np.diag(rng.uniform(0.3, 3, 6)) + skew - skew.T
        inverse = np.linalg.inv(scratch.hub[MASS])
        rates = np.block(
            [[np.zeros((6, 6)), np.eye(6)], [-inverse @ scratch.hub[STIFFNESS], -inverse @ scratch.hub[DAMPING]]]
        )
        values = np.linalg.eigvals(rates)
        expected = np.log(np.abs((1 + values) / (1 - values)).max())
        assert cross_growth.transform(scratch.hub, scratch.power)
        found = cross_growth.log_radius(scratch.power)
        if expected > -cross_growth.ENOUGH:
            grew += 1
            assert found == pytest.approx(expected, abs=1e-3)
        else:
            assert expected - 1e-9 <= found < 1e-3 - cross_growth.ENOUGH
    assert 3 < grew < 17


def masses(par: np.record) -> np.ndarray:
    mass = np.zeros((N_DOF, N_DOF))
    kinds = [("hub", np.eye(3))] + [("pin", TRIAD[b]) for b in range(1, 5)] + [("arm", TRIAD[b]) for b in range(5, 9)]
    for body, (kind, triad) in enumerate(kinds):
        i = 6 * body
        mass[i : i + 3, i : i + 3] = par[f"{kind}_mass"] * np.eye(3)
        mass[i + 3 : i + 6, i + 3 : i + 6] = triad.T @ np.diag(par[f"{kind}_inertia"]) @ triad
    mass[PSI, PSI] = par["Js"]
    return mass


def test_condensed_matrices_are_those_of_the_whole_joint() -> None:
    """Against the Jacobian of the accelerations by differences, condensed by dense algebra."""
    params = parameters(FLUTTERS)
    par, samples, work = params.view(np.recarray)[0], recorded(params), make_work()
    scratch = cross_growth.make_cross_scratch()
    for s in (0, 70, 135):
        forces(2 * math.pi / par.omega * (1 + s / 180), samples["q"][s], samples["v"][s], par, work)
        w = cross_growth.condense(par, work, scratch.hub)
        assert 1000 < w / (2 * math.pi) < 3000
        (jacobian,) = flutter._jacobians(params, Options(), samples, np.array([s]))
        mass = masses(par)
        whole = {
            STIFFNESS: -mass @ jacobian[N_DOF:, :N_DOF] / w**2,
            DAMPING: -mass @ jacobian[N_DOF:, N_DOF:] / w,
            MASS: mass,
        }
        hub, rest = np.arange(6) + 6 * HUB, np.arange(6, PSI)
        at_w = whole[STIFFNESS] - whole[MASS]
        inner = np.linalg.inv(at_w[np.ix_(rest, rest)])
        right = np.vstack([np.eye(6), -inner @ at_w[np.ix_(rest, hub)]])
        left = np.hstack([np.eye(6), -at_w[np.ix_(hub, rest)] @ inner])
        kept = np.concatenate([hub, rest])
        expected = {k: left @ matrix[np.ix_(kept, kept)] @ right for k, matrix in whole.items()}
        unit = 1 / np.sqrt(np.diag(expected[MASS]))
        for k, within in ((STIFFNESS, 0.02), (DAMPING, 0.03), (MASS, 0.02)):
            scaled = unit[:, None] * expected[k] * unit
            assert np.abs(scratch.hub[k] - scaled).max() < within * np.abs(scaled).max(), (s, k)


@pytest.mark.parametrize(("row", "torque"), [(FLUTTERS, 1.0), (AT_300, 3.0)])
def test_growth_of_the_cross_is_that_of_the_whole_joint(row: int, torque: float) -> None:
    params = parameters(row, torque=torque)
    samples, angles = recorded(params), np.arange(0, 180, 180 // cross_growth.ANGLES)
    estimates = samples["growth"][angles]
    rates = flutter._rates(flutter._jacobians(params, Options(), samples, angles), samples["mode"][angles], 500.0)
    assert (rates > 100).sum() >= 3
    assert (estimates[rates > 0] > rates[rates > 0]).all()
    assert (estimates[rates < -150] < 0).all()
    assert (estimates < np.maximum(3 * rates, rates + 400)).all()
    between = flutter._of_cross(samples, np.arange(180))
    assert (between[angles] >= estimates).all()
    assert (between[angles[estimates > 0][0] - 14 : angles[estimates > 0][0] + 15] > 0).all()


def test_cross_that_flutters_is_not_ok() -> None:
    """Steps that resolve 2 kHz show what the eigenvalues tell; without flutter they change nothing."""
    for row, torque in ((FLUTTERS, 1.0), (AT_30, 0.3), (AT_300, 3.0), (0, 3.0)):
        params = parameters(row, torque=torque)
        (found,) = simulation.simulate_rows(params, Options()).results
        fine = Options(steps_per_rev=11520, max_revs=6, max_refinements=0, peak_substeps=1)
        change = refinement.changes(np.array([found]), simulation.simulate_rows(params, fine).results)[0]
        flutters = row > 0
        assert not flutter.is_deep(params, np.array([found]))[0]
        assert (found["cross_growth"] > flutter.LEAST_GROWTH) == flutters
        assert (found["flutter"] > refinement.GROWN) == flutters
        assert found["status"] == (Status.NOT_RESOLVED if flutters else Status.OK)
        assert (change > 1e-2) == flutters


def test_joints_as_skew_whose_damping_holds_are_ok() -> None:
    found = simulation.simulate_rows(parameters(386, 739, FLUTTERS), Options()).results
    assert found["status"].tolist() == [Status.OK, Status.OK, Status.NOT_RESOLVED]
    assert found["flutter"][:2].tolist() == [0, 0]
    assert 3 < found["flutter"][2] < 6


def test_joints_without_growth_are_not_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    looked: list[int] = []

    def exponent(params: np.ndarray, *_: object) -> float:
        looked.append(len(params))
        return 0.0

    monkeypatch.setattr(flutter, "exponent", exponent)
    results = simulation.simulate_rows(parameters(0, 386, 739, FLUTTERS), Options()).results
    assert looked == [1]
    assert (results["cross_growth"] > flutter.LEAST_GROWTH).tolist() == [False, False, False, True]
