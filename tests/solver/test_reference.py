"""The tight reference against solutions that share nothing with it, closed forms, and the solver's own limit."""

from __future__ import annotations

import numpy as np
import pytest

from tests.conftest import REFERENCE
from tests.support.mechanisms import N_DOF
from tests.support.of_cardan import CARDAN, KIND, SPAN
from tolstat import joint, study
from tolstat.common.load_kinds import measure_of
from tolstat.common.tables import Options, Status
from tolstat.solver.reference import first_order, reference_rows
from tolstat.solver.simulation import simulate_rows

OPTIONS = Options()


def case(name):
    loaded = study.load_case(REFERENCE / f"{name}.toml")
    errors = joint.nominal_errors(1, CARDAN)
    for key, value in loaded.errors.items():
        errors[key] = value
    return joint.perturb(loaded.joint, loaded.operation, errors)


def assert_largest(row, force, torque, tol):
    np.testing.assert_allclose(row["F_max"], force, atol=tol * force.max())
    np.testing.assert_allclose(row["T_max"], torque, atol=tol * torque.max())


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ang_cross_z_15", "random_01", "zero_clearance_10"])
def test_independent_solutions(name):
    """Solved elsewhere at rtol 1e-6, so that the last digit here is theirs."""
    with np.load(REFERENCE / "loads.npz") as file:
        largest = file[f"{name}__max"]
    row = reference_rows(case(name), OPTIONS, angles=360)[0]
    assert row["status"] == Status.OK
    assert row["closure"] < 1e-5
    assert_largest(row, largest[:, 0], largest[:, 1], 1e-5)


@pytest.mark.slow
def test_limit_of_the_solver():
    """At 2880 steps a revolution and another method of integration, the same loads."""
    par = case("ang_cross_z_15")
    fine = simulate_rows(par, OPTIONS._replace(steps_per_rev=2880, settle_tol=1e-6)).results[0]
    row = reference_rows(par, OPTIONS)[0]
    for kind in SPAN:
        measure = measure_of(KIND[kind]).key
        error = 2e-5 if measure == "psi" else 2e-6 if measure == kind or kind == "contact" else 1e-5  # sums of forces
        within = error * fine[f"{measure}_max"].max()
        np.testing.assert_allclose(row[f"{kind}_max"], fine[f"{kind}_max"], rtol=0, atol=within, err_msg=kind)


def test_statics_of_the_straight_joint(params):
    par = params()
    row = reference_rows(par, OPTIONS)[0]
    np.testing.assert_allclose(row["contact_max"][:, 0], par.torque[0] / (2 * (par.R[0] + 0.011)), rtol=2e-3)
    np.testing.assert_allclose(row["contact_max"][:, 1], 0.0)


@pytest.mark.parametrize("integrator", ["BDF", "LSODA"])
@pytest.mark.slow
def test_other_integrators_agree(integrator):
    par = case("ideal_15")
    row, other = reference_rows(par, OPTIONS)[0], reference_rows(par, OPTIONS, 1e-4, integrator, 1e-3)[0]
    assert other["status"] == Status.OK
    assert_largest(other, row["F_max"], row["T_max"], 1e-3)


def test_jacobian_is_the_slope_of_the_rate():
    system = first_order(case("twist_15"), OPTIONS)
    rng = np.random.default_rng(3)
    t, y = system.t0, system.y0
    jacobian = system.jacobian(t, y)
    direction = rng.normal(size=len(y)) * np.repeat([1e-9, 1e-5], N_DOF)
    slope = 0.5 * (system.rate(t, y + direction) - system.rate(t, y - direction))
    np.testing.assert_allclose(jacobian @ direction, slope, atol=1e-3 * np.abs(slope).max())
    np.testing.assert_array_equal(jacobian[:N_DOF, :N_DOF], 0.0)
    np.testing.assert_allclose(jacobian[:N_DOF, N_DOF:], np.eye(N_DOF), atol=1e-6)


@pytest.mark.slow
def test_what_did_not_repeat_in_the_steps_allowed_keeps_its_largest_loads(params):
    par = params(alpha=0.2)
    full = reference_rows(par, OPTIONS)[0]
    cut = reference_rows(par, OPTIONS, closure_tol=0.0, max_steps=int(full["steps"]))[0]
    assert (cut["status"], cut["settled"]) == (Status.NOT_SETTLED, 0)
    assert cut["closure"] == full["closure"]
    np.testing.assert_array_equal(cut["F_max"], full["F_max"])


def test_what_cannot_be_solved_says_so_and_is_nan(params):
    par = params(alpha=0.2)
    given_up = reference_rows(par, OPTIONS, max_steps=20)[0]
    assert given_up["status"] == Status.NEWTON_FAILED
    par.clearance[:] = -1.0
    impossible = reference_rows(par, OPTIONS)[0]
    assert impossible["status"] == Status.OUTSIDE_MODEL
    for row in (given_up, impossible):
        assert not row["settled"]
        assert all(np.isnan(row[f"{kind}_max"]).all() for kind in SPAN)
