"""An output shaft that slides along its axis: reference joints, limits, slow decay, other integrators, hard cases."""

from __future__ import annotations

import numpy as np
import pytest

from tests.conftest import REFERENCE, sliding
from tests.solver.test_hard_cases import assert_honest
from tests.support.environment import ROOT
from tests.support.mechanisms import S
from tolstat import joint, sampling, study
from tolstat.common.cardan import CARDAN
from tolstat.common.tables import Fidelity, Method, Options, Status
from tolstat.kernel.mechanics.scale import axial_decay, centring_stiffness
from tolstat.kernel.revolution.trail import make_notes, note_closure, with_slow_decay
from tolstat.solver.reference import reference_rows
from tolstat.solver.simulation import equilibrium, simulate_rows, starts

OPTIONS = Options()
SUPPORT = {
    "random_00_rigid": None,
    "random_00_free": {"k_a": 0.0, "c_a": 2e4, "F_a": 0.0},
    "random_00_force_free": {"k_a": 0.0, "c_a": 2e4, "F_a": 200.0},
    "random_01_elastic": {"k_a": 2e7, "c_a": 2e3, "F_a": 0.0},
}
FIDELITY = {
    "in lanes": {},
    "one-step method": {"method": int(Method.TR_BDF2)},
    "finer steps": {"method": int(Method.TR_BDF2), "rtol": 0.04, "max_revs": 48},
    "equilibria": {"fidelity": int(Fidelity.QUASISTATIC)},
}


def drawn(n: int, **operation: float) -> np.recarray:
    """The first joints of the study with ISO 2768-f, at another operating point."""
    plan = study.load(ROOT / "studies" / "rigid_shafts.toml", n=n)
    point = plan.operation.model_copy(update=operation)
    return joint.perturb(plan.joint, point, sampling.draw(plan)).view(np.recarray)


def difference(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Largest difference of a bushing's largest force or torque, relative to the largest of its kind, by joint."""
    changes = [np.abs(one[f] - other[f]).max(1) / other[f].max(1) for f in ("F_max", "T_max")]
    return np.maximum(*changes)


@pytest.mark.parametrize("settings", FIDELITY)
@pytest.mark.parametrize("name", SUPPORT)
def test_reference_joints(name, settings):
    """An independent solution, whose output shaft has six degrees of freedom; equilibria leave out inertia and c_a."""
    with np.load(REFERENCE / "mounting.npz") as file:
        largest = {load: file[f"{name}__{load}"] for load in "FT"}
    case = study.load_case(REFERENCE / f"{name[:9]}.toml")
    errors = joint.nominal_errors(1, CARDAN)
    for key, value in case.errors.items():
        errors[key] = value
    par = joint.perturb(case.joint, case.operation, errors).view(np.recarray)
    if SUPPORT[name]:
        sliding(par, **SUPPORT[name])
    rows = np.concatenate([par, par, par])
    results = simulate_rows(rows, case.solver.options()._replace(**FIDELITY[settings])).results
    assert (results["status"] == Status.OK).all()
    for load, expected in largest.items():
        np.testing.assert_allclose(results[f"{load}_max"][1], expected, atol=1e-3 * expected.max())


def test_stiff_support_is_a_rigid_one_and_soft_support_a_free_one():
    par = drawn(6)
    rigid, free = (
        simulate_rows(par, OPTIONS).results,
        simulate_rows(sliding(par.copy(), 0.0, 2e4, 0.0), OPTIONS).results,
    )
    stiff = simulate_rows(sliding(par.copy(), 1e13, 2e4, 0.0), OPTIONS).results
    soft = simulate_rows(sliding(par.copy(), 1.0, 2e4, 0.0), OPTIONS).results
    assert difference(stiff, rigid).max() < 1e-4
    assert difference(soft, free).max() < 1e-4
    assert difference(free, rigid).max() > 0.1


def test_errors_along_the_shafts_move_a_free_shaft_and_no_load(params):
    """Shafts 0.12 mm apart: the free one slides there, and only the arms of the output fork are longer by as much."""
    apart = {f"hole{i}__offset_z": 1.2e-4 for i in (3, 4)}
    free, straight = (simulate_rows(sliding(params(**e), 0.0, 2e4, 0.0), OPTIONS).results for e in (apart, {}))
    np.testing.assert_allclose(free["F_max"], straight["F_max"], rtol=1e-5)
    np.testing.assert_allclose(free["T_max"], straight["T_max"], rtol=1.01 * 1.2e-4 / 37.49e-3)
    assert difference(simulate_rows(params(**apart), OPTIONS).results, straight).max() > 0.1


@pytest.mark.parametrize("force", [0.0, 50.0, -50.0])
def test_start_is_near_the_place_where_the_shaft_rests(params, random_errors, force):
    """Of straight shafts, where a settled joint stands still; pins and holes are parallel."""
    errors = {name: value for name, value in random_errors(2).items() if "offset" in name}
    par = sliding(params(**errors), 0.0, 2e4, force)
    guess = starts(par, OPTIONS)[0, S]
    place = equilibrium(par, OPTIONS)[S]
    assert abs(guess - place) < 0.1 * par.clearance[0, 0]


@pytest.mark.parametrize(("alpha", "torque", "rpm"), [(2, 10, 3000), (2, 1, 500), (15, 10, 500)])
@pytest.mark.slow
def test_a_slow_shaft_has_settled_where_the_joint_is_said_to_have(alpha, torque, rpm):
    """Largest loads within twice the tolerance of those of 100 revolutions."""
    point = {"alpha": np.radians(alpha), "torque": float(torque), "speed": rpm * np.pi / 30}
    par = sliding(drawn(25, **point), 0.0, 2e4, 0.0)
    options = OPTIONS._replace(max_refinements=0, peak_substeps=1)
    long = simulate_rows(par, options._replace(max_revs=100, settle_tol=1e-12)).results
    found = simulate_rows(par, options._replace(max_revs=60)).results
    assert (found["status"] == Status.OK).all()
    assert difference(found, long).max() < 2e-4


def test_closure_counts_what_a_slow_decay_has_ahead(params):
    """Changes of a geometric series: those ahead sum to rho / (1 - rho) of the last."""
    par = sliding(params(torque=1.0), 0.0, 2e4, 0.0)[0]
    stiffness = centring_stiffness(0, par)
    assert stiffness == pytest.approx(1.0 / (2 * (par.R + par.station_s[0, 0]) * 1e-4), rel=1e-12)
    expected = np.exp(-2 * np.pi / par.omega * stiffness / par.c_a)
    assert axial_decay(par) == pytest.approx(expected, rel=1e-12)
    notes = make_notes(1)[0]
    assert with_slow_decay(1e-5, 1.0, par, notes) == pytest.approx(1e-5 * expected / (1 - expected))
    for rho in (0.3, 0.8, 0.97):
        notes.count = 0
        for k in range(24, 49):
            note_closure(k / 12, 1e-4 * rho ** (k / 12), notes)
        last = 1e-4 * rho**4
        assert with_slow_decay(last, 4.0, par, notes) == pytest.approx(last * max(1, rho / (1 - rho)), rel=1e-6)
    assert with_slow_decay(0.5, 4.0, par, notes) == 1.0
    assert with_slow_decay(1e-5, 4.0, params(torque=1.0)[0], notes) == 1e-5
    assert with_slow_decay(1e-5, 4.0, sliding(params(), 0.0, 2e4, 0.0)[0], notes) == 1e-5


@pytest.mark.slow
def test_integrators_agree_on_free_shafts():
    """BDF2 and TR-BDF2 with 1440 steps a revolution, each joint from its own start."""
    par = sliding(drawn(24), 0.0, 2e4, 0.0)
    fine = OPTIONS._replace(steps_per_rev=1440, max_refinements=0)
    one = simulate_rows(par, fine).results
    other = simulate_rows(par, fine._replace(method=int(Method.TR_BDF2))).results
    assert (one["status"] == Status.OK).all()
    assert (other["status"] == Status.OK).all()
    assert np.median(difference(one, other)) < 1e-5
    assert difference(one, other).max() < 5e-3, "where contacts ring"


@pytest.mark.slow
def test_radau_agrees_on_a_shaft_with_axial_force(params):
    par = sliding(params(alpha=0.26, pin1__tilt_z=0.005, hole3__offset_z=1e-4), 0.0, 2e4, 100.0)
    found, expected = simulate_rows(par, OPTIONS).results, reference_rows(par, OPTIONS)
    assert expected["status"][0] == Status.OK
    assert difference(found, expected).max() < 1e-3


HARD = {
    "no torque": {"torque": 0.0},
    "1 N m": {"torque": 1.0},
    "10 N m at 3000 rpm": {"torque": 10.0, "speed": 100 * np.pi},
    "crossing pins": {"alpha": np.radians(70)},
    "pulled apart": {"F_a": 5e3},
    "pulled apart without torque": {"torque": 0.0, "F_a": 200.0},
    "light shaft": {"m_s": 1e-4},
    "undamped": {"c_a": 0.0},
}


@pytest.mark.parametrize("case", HARD)
@pytest.mark.slow
def test_hard_cases_end_in_a_result_or_in_a_status_that_says_why(case):
    point = {key: value for key, value in HARD[case].items() if key in ("alpha", "speed", "torque")}
    par = sliding(drawn(3, **point), 0.0, 2e4, 0.0)
    for key, value in HARD[case].items():
        if key not in point:
            par[key] = value
    results = simulate_rows(par, OPTIONS).results
    assert_honest(results)
    print(case, [Status(s).label for s in results["status"]])
