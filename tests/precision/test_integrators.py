"""Other integrators on a system with a closed form, and the jobs that time them and tolstat."""

from __future__ import annotations

import time

import numpy as np
import pytest

from studies.precision import integrators
from studies.precision.integrators import Integrator, both_ways
from studies.precision.runs import OtherJob, OwnJob, largest_of
from tests.support.loads import largest_loads
from tests.support.of_cardan import RESULT, SPAN
from tolstat.common.tables import Options, Status
from tolstat.solver.reference import FirstOrder, first_order

EVERY = both_ways(("Radau", "BDF", "LSODA", "CVODE", "Exudyn"))
PACKAGES = {"CVODE": "sksundae", "Exudyn": "exudyn"}


def skip_without(code):
    """Skip a test whose code is not installed."""
    if code in PACKAGES:
        pytest.importorskip(PACKAGES[code])


def circle(rate=None):
    """x'' = -x from x = 1: the largest force is that of cos, and velocity -sin."""
    matrix = np.array([[0.0, 1.0], [-1.0, 0.0]])

    def largest(times, states):
        assert len(times) == len(states)
        return largest_loads(states[:, 0].max(), states[:, 1].max(), 0.0, times[0])

    return FirstOrder(
        rate or (lambda t, y: matrix @ y),
        lambda t, y: matrix,
        0.0,
        np.array([1.0, 0.0]),
        2 * np.pi,
        np.ones(2),
        largest,
        np.zeros(1, RESULT),
    )


@pytest.mark.parametrize("integrator", EVERY, ids=str)
def test_every_integrator_solves_and_is_counted(integrator):
    skip_without(integrator.code)
    settings = (20, 360) if integrator.code == "Exudyn" else (1e-3, 1e-7)
    loose, tight = (integrators.solve(circle(), integrator, setting, 2, 60.0) for setting in settings)
    assert loose.outcome == tight.outcome == "ok"
    assert tight.largest[SPAN["F"]][0] == pytest.approx(1.0, abs=1e-4)
    assert tight.largest[SPAN["T"]][0] == pytest.approx(1.0, abs=1e-4)
    assert tight.largest[SPAN["psi"]][0] > 2 * np.pi  # loads are those of the second revolution
    assert abs(loose.largest[SPAN["F"]][0] - 1) > abs(tight.largest[SPAN["F"]][0] - 1)
    assert tight.rates > loose.rates > 10
    assert (tight.jacobians > 0) == (integrator.jacobian and integrator.code != "LSODA")  # LSODA: not stiff
    assert tight.seconds > 0


@pytest.mark.parametrize("integrator", EVERY, ids=str)
def test_a_run_that_takes_too_long_is_stopped(integrator):
    skip_without(integrator.code)

    def slow(t, y):
        begin = time.process_time()
        while time.process_time() - begin < 2e-4:
            pass
        return np.array([y[1], -y[0]])

    found = integrators.solve(circle(slow), integrator, 2880 if integrator.code == "Exudyn" else 1e-9, 200, 0.02)
    assert found.outcome == "over_time"
    assert found.largest is None
    assert 0.02 < found.seconds < 1.0


@pytest.mark.parametrize("code", ["Radau", "CVODE"])
def test_a_run_that_cannot_be_solved_has_failed(code):
    skip_without(code)
    blow_up = circle(lambda t, y: np.array([y[0] ** 2, 0.0]))  # infinite at t = 1
    with np.errstate(all="ignore"):
        assert integrators.solve(blow_up, Integrator(code, False), 1e-6, 1, 20.0).outcome != "ok"


def test_exudyn_is_silent_leaves_no_file_and_hides_no_fault(tmp_path, monkeypatch, capfd):
    skip_without("Exudyn")
    monkeypatch.chdir(tmp_path)
    integrators.solve(circle(), Integrator("Exudyn", False), 20, 1, 20.0)
    blow_up = circle(lambda t, y: np.array([y[1], 6 * y[0] ** 2]))  # infinite at t = 1.2
    with np.errstate(all="ignore"):
        assert integrators.solve(blow_up, Integrator("Exudyn", False), 180, 1, 20.0).outcome == "failed"
    with pytest.raises(ValueError, match="no such force"):
        integrators.solve(circle(_faulty), Integrator("Exudyn", False), 20, 1, 20.0)
    assert capfd.readouterr() == ("", "")
    assert list(tmp_path.iterdir()) == []


def _faulty(t, y):
    raise KeyError("no such force")


@pytest.mark.slow
@pytest.mark.parametrize("jacobian", [False, True])
def test_loads_of_exudyn_approach_those_of_radau(params, jacobian):
    skip_without("Exudyn")
    system = first_order(params(alpha=0.2), Options(), from_start=True)
    true = integrators.solve(system, Integrator("Radau", True), 1e-7, 2, 60.0).largest[SPAN["F"]]
    errors = []
    for steps in (180, 720):
        found = integrators.solve(system, Integrator("Exudyn", jacobian), steps, 2, 60.0)
        assert found.outcome == "ok"
        assert (0 < found.jacobians < 100) == jacobian  # a wrong one would be asked for in every step
        errors.append(np.abs(found.largest[SPAN["F"]] - true).max() / true.max())
    assert errors[0] < 2e-5
    assert errors[1] < errors[0] / 8  # order two: a sixteenth


@pytest.mark.slow
def test_joint_begins_where_the_solver_does(params):
    par = params(alpha=0.2)
    system = first_order(par, Options(), from_start=True)
    assert system.t0 == 0.0
    np.testing.assert_array_equal(system.y0[56:], 0.0)
    at_ideal_pose = np.abs(system.rate(0.0, np.zeros(112))).max()
    assert np.abs(system.rate(0.0, system.y0)).max() < 1e-3 * at_ideal_pose


def test_own_job_times_each_setting_and_keeps_what_is_measured(params):
    rows = np.concatenate([params(alpha=0.2), params(alpha=0.2), params(alpha=0.2)])
    options = (Options(steps_per_rev=36), Options(steps_per_rev=60))
    runs = OwnJob("A", options, rows, 0, 3, 2).runs()
    assert [(r.setting, r.joint, r.outcome) for r in runs] == [(n, i, "ok") for n in (36.0, 60.0) for i in (0, 1)]
    assert all(0 < r.seconds < 1 for r in runs)
    assert runs[0].largest[0] == runs[1].largest[0] > 500


@pytest.mark.slow
def test_other_job_leaves_out_what_is_tighter_than_what_took_too_long(params):
    job = OtherJob("L", Integrator("LSODA", True), (1e-2, 1e-3, 1e-4), params(alpha=0.2), Options(), 0, 2, 0.02)
    runs = job._replace(settings=(1e-6, 1e-7)).runs()
    assert [r.outcome for r in runs] == ["over_time"] * 2
    assert runs[1].rates == 0
    assert runs[1].seconds == 0.02
    done = job._replace(settings=(1e-2,), limit=60.0).runs()[0]
    assert done.outcome == "ok"
    assert done.largest[SPAN["F"]].max() == pytest.approx(620, rel=0.1)


def test_results_that_are_none_have_no_loads():
    results = np.zeros(1, RESULT)
    results["status"] = Status.NEWTON_FAILED
    assert largest_of(results[0]) is None
    results["status"] = Status.NOT_SETTLED
    assert largest_of(results[0]) is not None
