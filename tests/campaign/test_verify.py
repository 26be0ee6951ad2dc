"""Numerical error of campaigns: of the size that it is, kept in the file, and in the report's bounds."""

from __future__ import annotations

import json
import math
from functools import partial

import numpy as np
import pandas as pd
import pytest

from tests.support import damage, fakes, synthetic
from tests.support.of_cardan import CARDAN, LOAD_KINDS
from tests.support.reports import call
from tolstat import joint, sampling, study
from tolstat.analysis import accuracy
from tolstat.campaign import chosen, verify
from tolstat.campaign import run as campaign
from tolstat.common.errors import InputError, NotApplicable, StoreError
from tolstat.common.tables import Method, Options, Simulation, Start, Status, from_names
from tolstat.questions import accuracy as question
from tolstat.questions.exceedance.answer import exceedance
from tolstat.store import ResultFile, Writer, metadata, recorded, verification
from tolstat.store.verification import Check, Verification

REAL = (
    synthetic.HEAD.replace("15 deg", "25 deg")
    + """[solver]
steps_per_rev = 12
[tolerances]
"pin*.offset_t" = { plus_minus = "0.02 mm", distribution = "normal", cpk = 1.0 }
"hole*.tilt_z" = { plus_minus = "0.1 deg", distribution = "uniform" }
[sampling]
n = 8
seed = 3
[limits]
"cross*.F" = "640 N"
"""
)


def written(folder, text=REAL):
    path = folder / "real.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    return study.load(written(tmp_path_factory.mktemp("coarse")))


@pytest.fixture(scope="module")
def told():
    """Progress of the checks of `coarse`."""
    return []


@pytest.fixture(scope="module")
def coarse(plan, told):
    """Joints at 12 steps a revolution, where the steps' error is large; two processes share the references."""
    return verify.check_study(plan, 6, make=partial(verify.run_checks, workers=2, progress=told.append))


def force_and_torque(base, other):
    """Error of the largest |F| and |T| of each joint, (m, 2)."""
    return accuracy.by_kind(accuracy.differences(base, other, CARDAN), CARDAN)[:, :2]


@pytest.mark.slow
def test_estimate_is_of_the_size_of_the_error(coarse):
    """What the solver's own checks give is at least half and at most 2.5 times the distance to the reference.

    Where the error passes through zero at these steps, the estimate cannot know it and is above.
    """
    own = {name: check.results for name, check in coarse.checks.items() if name != "reference"}
    true = force_and_torque(coarse.base, coarse.checks["reference"].results)
    ratio = accuracy.by_kind(accuracy.numerical(coarse.base, own, CARDAN), CARDAN)[:, :2] / true
    crossing = true < 0.1 * np.median(true, axis=0)
    assert crossing.sum() <= 3
    assert (ratio > 1 / 2).all()
    assert (ratio[~crossing] < 2.5).all()


@pytest.mark.slow
def test_references_are_the_same_in_other_processes_and_are_told_of(plan, coarse, told):
    params = joint.perturb(plan.joint, plan.operation, sampling.draw(plan)[coarse.rows[-1:]])
    here = verify.run_checks(params, [plan.solver.options()], CARDAN, ("reference",))["reference"].results
    for name in ("F_max", "T_max"):  # with other threads LAPACK rounds otherwise, and Radau takes other steps
        np.testing.assert_allclose(coarse.checks["reference"].results[name][-1], here[name][0], rtol=1e-6)
    assert [(counts.done, counts.total) for counts in told] == [(k, 6) for k in range(7)]


@pytest.mark.slow
def test_coarse_steps_are_seen_and_nothing_else_is_blamed(plan, coarse):
    reference = coarse.checks["reference"].results
    true = force_and_torque(coarse.base, reference)
    assert np.median(true) > 1e-3
    for name in ("newton", "settling"):
        assert force_and_torque(coarse.base, coarse.checks[name].results).max() < 1e-3 * np.median(true)
    params = joint.perturb(plan.joint, plan.operation, sampling.draw(plan)[coarse.rows])
    fine = verify.run_checks(params, [Options(steps_per_rev=90)] * len(params), CARDAN, ("half_step",))["half_step"]
    assert fine.options["steps_per_rev"] == 180
    assert np.median(force_and_torque(fine.results, reference)) < 0.05 * np.median(true)


def test_each_check_changes_what_it_says():
    options = Options()
    assert verify.options_of_check(options, "half_step") == options._replace(steps_per_rev=360)
    assert verify.options_of_check(options, "newton").newton_tol == pytest.approx(options.newton_tol / 100)
    settling = verify.options_of_check(options, "settling")
    assert (settling.settle_tol, settling.start) == (pytest.approx(1e-6), Start.RAMP)
    assert settling.newton_tol == pytest.approx(options.newton_tol / 10)
    for method in Method:
        assert verify.options_of_check(options._replace(method=int(method)), "method").method != method
    # types of the fields decide which compiled code runs
    finer = verify.options_of_check(options, "finer")
    assert finer == options._replace(steps_per_rev=360, newton_tol=finer.newton_tol, settle_tol=finer.settle_tol)
    assert (finer.newton_tol, finer.settle_tol) == (0.01 * options.newton_tol, 0.01 * options.settle_tol)
    for name in (*verify.QUICK_CHECKS, *verify.ALL_CHECKS):
        assert [type(x) for x in verify.options_of_check(options, name)] == [type(x) for x in options]


def test_the_seed_chooses_the_joints():
    rows = np.arange(100, 200)
    first = verify.choose(rows, 24, 1)
    assert np.isin(first, rows).all()
    assert (np.diff(first) > 0).all()
    assert np.array_equal(first, verify.choose(rows, 24, 1))
    assert not np.array_equal(first, verify.choose(rows, 24, 2))
    assert np.array_equal(verify.choose(rows[:5], 24, 1), rows[:5])
    assert np.array_equal(verify.choose(rows, None, 1), rows)


def test_all_joints_are_those_of_the_production_that_settled(tmp_path):
    campaign.run(study.load(written(tmp_path), n=4), tmp_path / "a.h5", workers=1, check=False)
    with damage.rewritten(tmp_path / "a.h5") as file:
        file["results/status"][2] = Status.NOT_SETTLED
    newton = partial(verify.run_checks, names=("newton",))
    assert verify.check_file(tmp_path / "a.h5", None, make=newton).rows.tolist() == [1, 3, 4]
    assert verify.check_file(tmp_path / "a.h5", 9, make=newton).rows.tolist() == [1, 3, 4]


def test_errors_are_relative_to_the_largest_of_the_kind():
    base = synthetic.results(3)
    other = base.copy()
    other["F_max"][0, 2] += 0.02 * base["F_max"][0].max()
    other["T_max"][1] *= 1.25
    other["status"][2] = Status.NEWTON_FAILED
    found = accuracy.differences(base, other, CARDAN)
    assert found[0, 2] == pytest.approx(-0.02, rel=0.03)
    assert np.count_nonzero(found[0]) == 1
    assert accuracy.by_kind(found, CARDAN)[1] == pytest.approx([0.2 if kind.key == "T" else 0 for kind in LOAD_KINDS])
    assert np.isnan(found[2]).all()
    assert accuracy.spread(accuracy.by_kind(found, CARDAN)[:, 1]) == pytest.approx((2, 0.1, 0.2, 0.2))
    assert accuracy.spread(found[2])[0] == 0


def test_errors_of_a_vanishing_load_are_relative_to_other_joints():
    """At a point without misalignment pins do not slide: what a step changes of the loss there is no error of it."""
    base = synthetic.results(3)
    base["psi_max"][:] = 2e-3, 1e-16, 2e-3
    other = base.copy()
    other["psi_max"][:] += 2e-13
    other["psi_max"][2] = 9.0
    base["status"][2] = Status.NOT_SETTLED
    number = accuracy.observables(CARDAN).index("psi")
    assert accuracy.differences(base, other, CARDAN)[:2, number] == pytest.approx([-1e-10, -1e-8], rel=1e-3)


def test_a_run_checks_joints_at_random_and_the_nearest_of_the_others_and_a_file_gives_them_back(tmp_path):
    path = tmp_path / "a.h5"
    fakes.run(fakes.Study(n=900), path, check=True)
    with ResultFile.open(path) as store:
        found, near = verification.read(store), verification.read(store, verification.NEAR)
        assert found is not None
        assert near is not None
        settled = np.flatnonzero(store.status()[1:] == Status.OK) + 1
        assert found.rows.tolist() == verify.choose(settled, 29, 7).tolist()
        assert np.array_equal(found.base, store.results()[found.rows])
        others = settled[~np.isin(settled, found.rows)]
        distance = np.abs(store.results()["F_max"][others, 0] - 700.0)
        assert near.rows.tolist() == sorted(others[np.argsort(distance, kind="stable")[:29]].tolist())
    assert tuple(found.checks) == verify.QUICK_CHECKS
    for name, check in found.checks.items():
        # the invented solver knows no settings but the number of steps
        expected = found.base.copy()
        expected["steps"] *= 2
        assert np.array_equal(check.results, expected)
        assert from_names(check.options) == verify.options_of_check(Options(steps_per_rev=30), name)
    with Writer.open(path) as store:
        verification.write([(store, verification.VERIFY, found._replace(rows=found.rows[:1], checks={}))])
        again = verification.read(store)
    assert again is not None
    assert (again.rows.tolist(), again.checks) == ([found.rows[0]], {})


@pytest.mark.parametrize(("n", "limits", "at_random", "near"), [(20, 1, 20, 0), (41, 1, 29, 12), (90, 0, 58, 0)])
def test_of_few_joints_all_are_checked_and_without_limits_all_are_chosen_at_random(
    tmp_path, n, limits, at_random, near
):
    plan = fakes.Study(n=n, limits={"cross1.F": 700.0} if limits else {})
    fakes.run(plan, tmp_path / "a.h5", check=True)
    with ResultFile.open(tmp_path / "a.h5") as store:
        found = [verification.read(store, name) for name in (verification.VERIFY, verification.NEAR)]
        settled = np.flatnonzero(store.status()[1:] == Status.OK)
    numbers = [0 if part is None else len(part.rows) for part in found]
    failed = n - len(settled)
    assert numbers == [min(at_random, n - failed), max(near - failed, 0) if n < 58 else near]


def test_workers_share_the_check_at_the_end_of_a_run_and_change_none_of_its_numbers(tmp_path):
    checked = []
    for workers in (1, 3):
        path = tmp_path / f"{workers}.h5"
        fakes.run(fakes.Study(n=200), path, workers, 50, check=True)
        with ResultFile.open(path) as store:
            checked.append(verification.read(store))
    one, three = checked
    assert one.rows.tolist() == three.rows.tolist()
    assert np.array_equal(one.checks["finer"].results, three.checks["finer"].results)


def test_more_joints_are_checked_of_large_campaigns():
    assert [chosen.few(n) for n in (10, 1024, 5900, 29_900, 10**7)] == [29, 29, 59, 299, 299]


def test_the_largest_of_n_joints_is_above_the_share_that_is_said():
    """Of uniform numbers, with the confidence that is said; of one more share it is not."""
    rng = np.random.default_rng(8)
    for n in (1, 20, 59):
        largest = rng.random((20_000, n)).max(axis=1)
        share = accuracy.share_below_largest(n)
        assert np.mean(largest > share) == pytest.approx(0.95, abs=0.006)


def test_the_sentence_says_what_the_largest_error_is_a_bound_of(tmp_path):
    fakes.run(fakes.Study(n=900), tmp_path / "a.h5", check=True)
    with ResultFile.open(tmp_path / "a.h5") as store:
        view = store.view()
        assert view.verification is not None
        words = question.error_of_view(view, view.verification)
        several = verification.together([view.verification, view.verification])  # two operating points, the same joints
    assert "estimated on 29 joints from half the step and smaller tolerances: F median 0.0e+00, largest" in words
    assert "; at least 90 % of the production has smaller ones than the largest (confidence 95 %)" in words
    assert "; largest of the 29 joints nearest to limits: F 0.0e+00" in words
    assert "90 % of the production" in question.error_note(several, CARDAN)
    assert "of the production" not in question.error_note(several, CARDAN, is_sample=False)


def test_a_run_can_do_without(tmp_path):
    fakes.run(fakes.Study(), tmp_path / "a.h5")
    with ResultFile.open(tmp_path / "a.h5") as store:
        assert verification.read(store) is None


def test_a_slice_keeps_the_rows_of_the_campaign(tmp_path, monkeypatch):
    (tmp_path / "plan.toml").write_text(synthetic.WHOLE, encoding="utf-8")
    plan, rows, results = study.load(tmp_path / "plan.toml"), range(20, 30), synthetic.results(61)[20:30]
    with Writer.create(tmp_path / "b.h5", plan, [sampling.draw(plan, rows)], rows=rows) as store:
        store.write(np.arange(10), Simulation(results, {}))
        solve = lambda slots, *_, **__: Simulation(results[slots], {})  # noqa: E731
        monkeypatch.setattr(verify, "parameters", lambda store, slots: slots)
        checked = verify.check_campaign(store, 3, 7, partial(verify.run_checks, names=("newton",), simulate=solve))
        verification.write([(store, verification.VERIFY, checked)])
    with ResultFile.open(tmp_path / "b.h5") as store:
        found = verification.read(store)
    assert set(found.rows.tolist()) <= set(rows)
    np.testing.assert_array_equal(found.base, results[found.rows - 20])


def off_by(path, factor, rows=(5, 9)):
    """Keep a reference in a file that has every load `factor` times as large."""
    with Writer.open(path) as store:
        base = store.results()[list(rows)]
        true = base.copy()
        for name in ("F_max", "T_max", "contact_max", "psi_max"):
            true[name] *= factor
        made = {name: Check("", {}, base) for name in verify.QUICK_CHECKS} | {"reference": Check("", {}, true)}
        verification.write([(store, verification.VERIFY, Verification(1, np.array(rows), base, made))])


@pytest.mark.slow
def test_report_moves_every_load_by_the_numerical_error(tmp_path):
    path = synthetic.store(tmp_path)
    with ResultFile.open(path) as store:
        assert exceedance(store.view()).frame("limits")["numerical_lower"].isna().all()
    off_by(path, 1.25)
    with ResultFile.open(path) as store:
        limits = exceedance(store.view()).frame("limits").set_index("load").loc["cross1.F"]
        results = store.results()[1:]
    assert limits["numerical_error"] == pytest.approx(0.2)
    moved = 0.2 * results["F_max"].max(axis=1)
    for end, sign in (("lower", -1), ("upper", 1)):
        count = np.sum(results["F_max"][:, 0] + sign * moved > 700.0)
        assert limits[f"numerical_{end}"] == pytest.approx(count / 60)
        assert limits[f"total_{end}"] == pytest.approx(accuracy_end(int(count), 60)[0 if end == "lower" else 1])
    assert limits["numerical_lower"] < limits["estimate"] < limits["numerical_upper"]
    done = call("report", path)
    verdict, *lines = done.stdout.splitlines()
    (head,) = (line for line in lines if line.startswith("load "))
    assert verdict.startswith("No verdict")
    assert head.split()[-2:] == ["total", "interval"]
    assert "measured on 2 of 2 joints against a tight reference: F median 2.0e-01, largest 2.0e-01" in " ".join(
        done.stderr.split()
    )


def accuracy_end(count, n):
    from scipy.stats import binomtest

    return binomtest(count, n).proportion_ci(0.95, "exact")


def test_an_error_that_is_not_known_is_null_in_json(tmp_path):
    """As when the rows of all checked joints are damaged."""
    path = synthetic.store(tmp_path)
    with ResultFile.open(path) as store, pytest.raises(NotApplicable, match="holds no checks of the numerical error"):
        question.accuracy(store.view())
    off_by(path, 1.25)
    with ResultFile.open(path) as store:
        view = store.view()
        assert (
            question.accuracy(view).frame("errors").equals(pd.DataFrame(question.error_rows(view.verification, CARDAN)))
        )
        view.numerical_error = {"F": math.nan, "T": 0.01}
        found = question.accuracy(view).values()
    assert json.loads(json.dumps(found, allow_nan=False))["facts"] == {"numerical_error": {"F": None, "T": 0.01}}


def test_checks_that_fail_are_counted_and_not_measured(tmp_path):
    path = synthetic.store(tmp_path)
    off_by(path, 1.25)
    with ResultFile.open(path) as store:
        found = verification.read(store)
    assert found is not None
    found.checks["reference"].results["status"][0] = Status.NOT_SETTLED
    assert "1 not settled in reference" in question.error_note(found, CARDAN)
    # the estimate stands in: invented checks that change nothing
    assert accuracy.by_kind(question.errors(found, CARDAN)[question.TOTAL], CARDAN)[:, 0] == pytest.approx([0.0, 0.2])


def test_parameters_and_settings_come_back_from_the_file_alone(tmp_path):
    text = REAL.partition("[tolerances]")[0] + (
        '[sampling]\nmethod = "cases"\n[[case]]\nname = "a"\nerrors.hole4.offset_t = "0.1 mm"\n'
        '[[variant]]\nname = "plain"\n[[variant]]\nname = "tight"\njoint.contact.D_P = "76.1 mm"\n'
        '[variant.solver]\nmethod = "tr_bdf2"\nsteps_per_rev = 48\n[variant.operation]\nspeed = "300 rpm"\n'
    )
    listed = study.load(written(tmp_path, text))
    errors = sampling.draw(listed)
    with Writer.create(tmp_path / "a.h5", listed, [errors]) as store:
        found = recorded.parameters(store, np.array([0, 3]))
        settings = [recorded.options_of(store, row, attempt=0) for row in (0, 3)]
    for k, row in enumerate((0, 3)):
        variant = listed.design["variant"][row]
        own = joint.perturb(listed.joints[variant], listed.operations[variant], errors[row : row + 1])
        assert found[k] == own[0]
    assert (found["clearance"][0] != found["clearance"][1]).all()
    assert settings == [solver.options() for solver in listed.solvers]
    assert settings[1] == settings[0]._replace(method=int(Method.TR_BDF2), steps_per_rev=48)


@pytest.mark.slow
def test_lower_fidelity_is_measured_against_the_dynamic_joint(tmp_path):
    text = REAL.replace("steps_per_rev = 12", 'fidelity = "quasistatic"\nsteps_per_rev = 180').replace(
        "500 rpm", "1000 rpm"
    )
    without_method = partial(verify.run_checks, names=("half_step", "reference"))
    found = verify.check_study(study.load(written(tmp_path, text)), joints=1, make=without_method)
    true = force_and_torque(found.base, found.checks["reference"].results)
    seen = force_and_torque(found.base, found.checks["fidelity"].results)
    assert true.min() > 5e-4  # the inertia of bodies that deviate from the ideal motion
    np.testing.assert_allclose(seen, true, rtol=0.3)
    assert force_and_torque(found.base, found.checks["half_step"].results).max() < 0.1 * true.min()
    assert "error of numerics and fidelity, measured" in question.error_note(found, CARDAN)
    auto = study.load(written(tmp_path, REAL.replace("steps_per_rev = 12", 'fidelity = "auto"')))
    with pytest.raises(InputError, match="auto"):
        verify.check_study(auto)


def test_what_cannot_be_verified_is_exit_code_2(tmp_path, monkeypatch):
    pending = synthetic.store(tmp_path, simulated=0)
    bad = written(tmp_path, REAL.replace("[solver]", "[solver]\nstep = 3"))
    for arguments, words in (
        ((tmp_path / "none.h5",), ["does not exist"]),
        ((pending,), ["has no settled joint", "tolstat run"]),
        ((pending, "--joints", 0), ["0 is not a whole number of at least one"]),
        ((pending, "--joints", "most"), ["joints: most is not a whole number", "--joints all"]),
        ((bad, "--joints", 0), ["0 is not a whole number", "solver.step"]),
        ((pending, "--out", pending / "a.csv"), ["is no folder"]),
    ):
        done = call("verify", *arguments)
        assert (done.exit_code, done.stdout) == (2, "")
        for word in [*words, "hint: "]:
            assert word in done.stderr
    with pytest.raises(InputError, match="at least one"):
        verify.check(written(tmp_path), joints=-1)
    other = synthetic.store(tmp_path, name="other")
    monkeypatch.setattr(metadata, "source_hash", lambda: "0")
    with pytest.raises(StoreError, match="was made by another version of the code"):
        verify.check_file(other, 24)
