"""The fidelity ladder: the ideal joint's loads, equilibria, and the choice between them."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tests.support import fakes
from tests.support.closed_forms import pin_force
from tests.support.environment import ROOT
from tests.support.mechanisms import bushing_kind
from tests.support.of_cardan import RESULT, blank_params
from tolstat import joint, sampling, study
from tolstat.campaign import run as campaign
from tolstat.common.errors import InputError
from tolstat.common.tables import Fidelity, Options, Simulation, Status
from tolstat.joint import ideal
from tolstat.solver import fidelity
from tolstat.solver.fidelity import Rung
from tolstat.solver.simulation import simulate_rows
from tolstat.store import ResultFile

IDEAL = Options(fidelity=int(Fidelity.IDEAL))
STATIC = Options(fidelity=int(Fidelity.QUASISTATIC))
DYNAMIC = Options()
ALPHA, SLOW, FAST = np.radians(15), 20 * np.pi / 30, 500 * np.pi / 30
STUDIES = ROOT / "studies"


def solve(par, options):
    """Results row and load histories (steps, 8, 6) of one joint."""
    found = simulate_rows(par, options, "full")
    return found.results[0], {name: values[0].astype(float) for name, values in found.histories.items()}


def relative(found, expected):
    """Largest difference of forces and of torques, each relative to the largest load of the kind."""
    parts = (slice(0, 3), slice(3, 6))
    return [np.abs(found[..., k] - expected[..., k]).max() / np.abs(expected[..., k]).max() for k in parts]


@pytest.fixture(scope="module")
def campaign_joints():
    """Parameters of 24 joints of the study rigid_shafts, the nominal one first."""
    plan = study.load(STUDIES / "rigid_shafts.toml", n=23)
    return joint.perturb(plan.joint, plan.operation, sampling.draw(plan))


class TestIdeal:
    """Against statics, against Newton and Euler for rigid bodies, and against the elastic joint."""

    def test_slow_joint_is_the_statics_of_the_handbook(self, params):
        par = params(alpha=ALPHA, speed=1e-3)
        theta = np.linspace(0, 2 * np.pi, 73)
        loads, contact = ideal.loads(theta, par)
        radius = par.R[0] + 0.011
        expected = pin_force(theta, ALPHA, 100.0, radius)
        np.testing.assert_allclose(contact, np.tile(expected, (4, 1)).T, rtol=1e-9)
        np.testing.assert_allclose(np.linalg.norm(loads[..., :3], axis=-1), np.tile(expected, (8, 1)).T, rtol=1e-9)

    def test_secondary_couples_on_the_forks(self, params):
        """What the two fork bushings of a side give about their shaft is T tau or T; across it up to T sin, T tan."""
        theta = np.linspace(0, 2 * np.pi, 73)
        par = params(alpha=ALPHA, speed=1e-3)
        loads, _ = ideal.loads(theta, par)
        couples = [self.couple(loads[:, first : first + 2], par, first) for first in (4, 6)]
        tau = ideal.speed_ratio(theta, ALPHA)
        for couple, torque, largest in zip(couples, (100 * tau, 100.0), (np.sin(ALPHA), np.tan(ALPHA)), strict=True):
            np.testing.assert_allclose(np.abs(couple[:, 2]), torque, rtol=1e-9)
            assert np.hypot(couple[:, 0], couple[:, 1]).max() == pytest.approx(100 * largest, rel=1e-9)

    @staticmethod
    def couple(loads, par, first):
        """Moment about O of two opposite fork bushings, in axes of their frame."""
        total = 0.0
        for k, e in enumerate(((1.0, 0, 0), (-1.0, 0, 0)) if first == 4 else ((0, -1.0, 0), (0, 1.0, 0))):
            triad = np.array([e, np.cross((0, 0, 1.0), e), (0, 0, 1.0)])
            force, torque = loads[:, k, :3] @ triad, loads[:, k, 3:] @ triad
            kind = bushing_kind("input fork" if first == 4 else "output fork")
            marker = par.marker[0, kind, 1] @ triad
            total = total + torque + np.cross(marker, force)
        return total

    def test_power_in_is_power_out(self, params):
        """Torque on the input shaft times omega is the load's power and what moves the bodies; mean over a turn."""
        theta = np.arange(180) * 2 * np.pi / 180
        par = params(alpha=ALPHA, speed=FAST)
        loads, _ = ideal.loads(theta, par)
        on_input = -self.couple(loads[:, 4:6], par, 4)[:, 2]
        assert abs(on_input.mean()) == pytest.approx(100.0, rel=1e-9)  # tau is 1 in the mean
        assert np.ptp(on_input) > 5.0

    @pytest.mark.parametrize("speed", [SLOW, FAST, -FAST])
    @pytest.mark.parametrize("options", [STATIC, DYNAMIC])
    def test_elastic_joint_without_errors(self, params, speed, options):
        """Every component at every angle: a clearance of 30 um when slow, 0.1 mm where inertia moves pins along z."""
        small = {f"hole{k}__diameter": -0.14e-3 for k in (1, 2, 3, 4)} if speed == SLOW else {}
        par = params(alpha=ALPHA, speed=speed, **small)
        _, found = solve(par, options._replace(steps_per_rev=36))
        row, closed = solve(par, IDEAL._replace(steps_per_rev=36))
        assert row["status"] == Status.OK
        assert max(relative(closed["loads"], found["loads"])) < (5e-4 if speed == SLOW else 3e-3)

    def test_joint_of_the_paper(self, params):
        """At the clearance of 0.1 mm and 500 rpm: largest loads of the dynamic joint within 5e-4."""
        par = params(alpha=ALPHA)
        row, closed = solve(par, IDEAL)
        dynamic, _ = solve(par, DYNAMIC)
        np.testing.assert_allclose(row["F_max"], dynamic["F_max"], rtol=5e-4)
        np.testing.assert_allclose(row["T_max"], dynamic["T_max"], atol=5e-4 * dynamic["T_max"].max())
        np.testing.assert_allclose(closed["tau"], ideal.speed_ratio(np.arange(180) * np.pi / 90, ALPHA), rtol=1e-12)
        assert row["psi_max"] == pytest.approx(0, abs=1e-15)

    def test_torque_of_the_other_sign_and_none(self, params):
        loads = [ideal.loads([0.3], params(alpha=ALPHA, speed=1e-3, torque=t))[0] for t in (100.0, -100.0, 0.0)]
        np.testing.assert_allclose(loads[0], -loads[1], rtol=1e-6, atol=1e-6)
        assert np.abs(loads[2]).max() < 1e-6


class TestQuasistatic:
    def test_is_the_slow_joint(self, campaign_joints):
        """At 20 rpm the largest loads are those of the dynamic joint, on the same grid of angles."""
        slow = campaign_joints.copy()
        slow["omega"] = SLOW
        options = {"steps_per_rev": 90}
        static = simulate_rows(slow, STATIC._replace(**options)).results
        dynamic = simulate_rows(slow, DYNAMIC._replace(peak_substeps=1, **options)).results
        assert (static["status"] == Status.OK).all()
        assert (static["revolutions"] == 1).all()
        for kind in ("F_max", "T_max"):
            error = np.abs(static[kind] - dynamic[kind]).max(axis=1) / dynamic[kind].max(axis=1)
            assert np.median(error) < 1e-5
            assert error.max() < 5e-4

    def test_leaves_out_transients_only(self, campaign_joints):
        """At 500 rpm the inertial loads of the ideal motion are in; without them errors would be some 2 %."""
        static = simulate_rows(campaign_joints, STATIC).results
        dynamic = simulate_rows(campaign_joints, DYNAMIC).results
        slow = campaign_joints.copy()
        slow["omega"] = SLOW
        without = simulate_rows(slow, STATIC).results

        def error(found):
            return np.abs(found["F_max"] - dynamic["F_max"]).max(axis=1) / dynamic["F_max"].max(axis=1)

        assert error(static).max() < 5e-3
        assert np.median(error(static)) < 5e-4
        assert np.median(error(without)) > 5e-3

    def test_speed_ratio_of_the_joint_that_turns_slowly(self, campaign_joints):
        """Psi follows from differences of the shaft's angle; its mean over a revolution is zero."""
        slow = campaign_joints[1:2].copy()
        slow["omega"] = SLOW
        _, static = solve(slow, STATIC)
        _, dynamic = solve(slow, DYNAMIC)
        ratio = ideal.speed_ratio(np.arange(180) * np.pi / 90, ALPHA)
        deviation = static["tau"] - ratio
        assert np.abs(deviation).max() > 1e-4
        assert np.sqrt(np.mean((static["tau"] - dynamic["tau"]) ** 2)) < 0.1 * np.sqrt(np.mean(deviation**2))
        assert deviation.mean() == pytest.approx(0, abs=1e-12)

    @pytest.mark.parametrize(
        ("change", "states"),
        [
            ({"torque": 0.0}, {Status.OK, Status.NOT_SETTLED, Status.NEWTON_FAILED}),
            ({"torque": -100.0}, {Status.OK}),
            ({"speed": -FAST}, {Status.OK}),
            ({"alpha": np.radians(70)}, {Status.OK}),
            ({"pin1__tilt_z": np.radians(5)}, {Status.OK, Status.NEWTON_FAILED}),
            ({"hole1__diameter": -0.3e-3}, {Status.OUTSIDE_MODEL}),
        ],
    )
    def test_hard_joints_end_in_a_state(self, params, change, states):
        row = simulate_rows(params(**{"alpha": ALPHA, **change}), STATIC).results[0]
        assert row["status"] in states
        assert np.isfinite(row["F_max"]).all() == (row["status"] in (Status.OK, Status.NOT_SETTLED))
        if row["status"] == Status.OK:
            assert row["closure"] <= STATIC.settle_tol

    def test_start_by_a_ramp_means_nothing(self, campaign_joints):
        ramped = simulate_rows(campaign_joints[:3], STATIC._replace(start=0)).results
        assert ramped.tobytes() == simulate_rows(campaign_joints[:3], STATIC).results.tobytes()


def test_largest_load_lies_between_samples(campaign_joints):
    """The parabola through the largest sample takes most of the grid's error off the median joint."""
    few, many = 36, 720
    row = simulate_rows(campaign_joints, STATIC._replace(steps_per_rev=few), "full")
    truth = simulate_rows(campaign_joints, STATIC._replace(steps_per_rev=many)).results["F_max"]
    sampled = np.linalg.norm(row.histories["loads"][..., :3], axis=-1).max(axis=1)
    found, grid = (np.median(np.abs(v / truth - 1).max(axis=1)) for v in (row.results["F_max"], sampled))
    assert found < 0.2 * grid


def pretend(errors, differing=()):
    """Simulate with a given relative error by rung; `differing` rungs fail at one joint."""

    def simulate(params, options):
        rung = Rung(Fidelity(options.fidelity), options.steps_per_rev)
        results = np.zeros(len(params), RESULT)
        results["status"] = Status.OK
        for name in ("F_max", "T_max"):
            results[name] = 100.0
        results["F_max"][1, 3] *= 1 + errors.get(rung, 0.0)
        per_step = {Fidelity.IDEAL: 0, Fidelity.QUASISTATIC: 1, Fidelity.DYNAMIC: 2}
        results["newton_iterations"] = rung.steps_per_rev * per_step[rung.fidelity]
        if rung in differing:
            results["status"][2] = Status.NEWTON_FAILED
        return Simulation(results, {})

    return simulate


class TestChoice:
    PARAMS = blank_params(4)
    IDEAL, COARSE, FINE = Rung(Fidelity.IDEAL, 90), Rung(Fidelity.QUASISTATIC, 36), Rung(Fidelity.QUASISTATIC, 60)

    def choose(self, budget=0.005, loads=(), least=0, errors=(), differing=()):
        simulate = pretend({self.IDEAL: 0.3} | dict(errors), differing)
        record = fidelity.choose(self.PARAMS, DYNAMIC, budget, loads, simulate, least)
        return Rung(Fidelity[record["fidelity"].upper()], record["steps_per_rev"]), record

    def test_cheapest_that_is_within_the_budget(self):
        assert self.choose()[0] == self.COARSE
        assert self.choose(errors={self.COARSE: 0.004})[0] == self.FINE  # within, but not with the margin
        assert self.choose(budget=0.5)[0] == self.IDEAL

    def test_only_loads_asked_for_count(self):
        errors = {self.COARSE: 0.1}
        assert self.choose(loads=["cross4.F"], errors=errors)[0] == self.FINE
        assert self.choose(loads=["cross3.F", "fork1.T"], errors=errors)[0] == self.IDEAL

    def test_a_rung_that_ends_otherwise_is_refused(self):
        assert self.choose(differing=(self.COARSE,))[0] == self.FINE

    def test_steps_that_histories_need(self):
        assert self.choose(least=50)[0] == self.FINE

    def test_none_is_good_enough(self):
        rung, record = self.choose(errors=dict.fromkeys(fidelity.RUNGS, 0.1))
        assert (record["met"], rung) == (False, fidelity.RUNGS[-1])
        assert "warning" in record["reason"]
        assert "hint" in record["reason"]

    def test_record_is_json_and_text(self):
        _, record = self.choose()
        assert json.loads(json.dumps(record, allow_nan=False)) == record
        assert len(fidelity.describe(record).splitlines()) == 2 + len(fidelity.RUNGS)
        assert fidelity.apply(DYNAMIC, record)[:2] == DYNAMIC[:2]

    def test_pilot(self):
        rows = fidelity.pilot(1000, 1, seed=3)
        assert rows[0] == 0
        assert len(set(rows)) == 1 + fidelity.JOINTS
        assert (rows == fidelity.pilot(1000, 1, seed=3)).all()
        assert list(fidelity.pilot(3, 0, seed=3)) == [0, 1, 2]


AUTO = """
[joint]
base = "cirelli2021"
[operation]
alpha = "15 deg"
speed = "100 rpm"
torque = "100 N*m"
[solver]
fidelity = "auto"
error_budget = 0.01
[tolerances]
"pin*.tilt_z" = { plus_minus = "0.2 deg", distribution = "normal", cpk = 1.0 }
[sampling]
n = 6
[limits]
"cross*.F" = "700 N"
"""


def test_campaign_keeps_its_choice(tmp_path, monkeypatch):
    """Chosen once, told, stored, shown in the report, and the same when the campaign goes on."""
    source, path = tmp_path / "auto.toml", tmp_path / "auto.h5"
    source.write_text(AUTO, encoding="utf-8")
    plan, said = study.load(source), []

    def stop(counts):
        if counts.done >= 3:
            raise KeyboardInterrupt

    with pytest.raises(campaign.Interrupted):
        campaign.run(plan, path, 1, 3, progress=stop, tell=said.append)
    assert said[0].startswith("auto: quasistatic at ")
    monkeypatch.setattr(fidelity, "choose", lambda *args: pytest.fail("chosen again"))
    campaign.run(plan, path, 1, 3, tell=said.append)
    assert len(said) == 1
    with ResultFile.open(path) as store:
        assert store.fidelity["met"]
        assert store.options["fidelity"] == "quasistatic"
        assert store.options["steps_per_rev"] == store.fidelity["steps_per_rev"]
        assert store.identity["solver.fidelity"] == "auto"
        assert (store.results()["revolutions"] == 1).all()
        assert fidelity.sentence(store.options, store.fidelity) == store.fidelity["reason"]


@pytest.mark.parametrize(("kind", "least"), [("harmonics", 41), ("harmonics+cycles", 90)])
@pytest.mark.slow
def test_histories_have_the_steps_that_were_chosen(tmp_path, kind, least):
    text = AUTO + f'[output]\nhistories = "{kind}"\nharmonics = 20\n'
    (tmp_path / "auto.toml").write_text(text, encoding="utf-8")
    plan = study.load(tmp_path / "auto.toml")
    campaign.run(plan, tmp_path / "auto.h5", 1)
    with ResultFile.open(tmp_path / "auto.h5") as store:
        assert store.options["steps_per_rev"] >= least
        assert store.histories("coefficients_real").shape == (7, 8, 6, 21)


def test_other_fidelities_choose_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(fidelity, "choose", lambda *args: pytest.fail("chosen"))
    fakes.run(fakes.Study(), tmp_path / "a.h5", check=True)
    with ResultFile.open(tmp_path / "a.h5") as store:
        assert store.fidelity == {}


@pytest.mark.parametrize(
    ("solver", "found"),
    [
        ('fidelity = "dynamic"\nerror_budget = 0.01', "error_budget is given with fidelity 'dynamic'"),
        ("error_budget = 0.01", "error_budget is given with fidelity 'dynamic'"),
        ('fidelity = "auto"\nsteps_per_rev = 90', "steps_per_rev is given with fidelity 'auto'"),
        ('fidelity = "rigid"', "'rigid' is not allowed"),
    ],
)
def test_what_does_not_go_together_is_a_fault(tmp_path, solver, found):
    text = AUTO.replace('fidelity = "auto"\nerror_budget = 0.01', solver)
    (tmp_path / "auto.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        study.load(tmp_path / "auto.toml")
    assert found in str(caught.value)
    assert len(caught.value.faults) == 1


def test_one_joint_is_no_campaign(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(AUTO[: AUTO.index("[tolerances]")], encoding="utf-8")
    with pytest.raises(InputError, match="needs the joints of a campaign"):
        study.load_case(case)
