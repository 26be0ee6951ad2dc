"""Joints whose torque reverses: against solutions not written here, finer steps, and themselves."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import REFERENCE
from tests.solver.test_refinement import assert_same
from tests.support import exceedance
from tests.support.environment import ROOT
from tests.support.mechanisms import lump_kind
from tests.support.of_cardan import CARDAN, PARAM, RESULT
from tolstat import joint, sampling, study
from tolstat.analysis.estimates import Inexact
from tolstat.analysis.sample import Sample
from tolstat.campaign import plan
from tolstat.common.tables import Method, Options, Status, iterations_allowed
from tolstat.joint import ideal
from tolstat.kernel.integrators.mesh import CELL, COARSEN_BELOW, COARSENING_REVS, FIRST_LEVEL, UNKNOWN, next_level
from tolstat.solver import simulation, stationary
from tolstat.solver.simulation import simulate_rows

STUDIES = ROOT / "studies"
RPM = np.pi / 30
FOLLOWING = Options(method=int(Method.TR_BDF2), rtol=0.04, max_revs=48)
UNIFORM = Options(method=int(Method.TR_BDF2), steps_per_rev=20_000, max_refinements=0)


def joints(alpha: float, rpm: float, torque: float, rows: list[int]) -> np.ndarray:
    """Joints of rigid_shafts.toml at another operating point (deg, 1/min, N m)."""
    made = study.load(STUDIES / "rigid_shafts.toml", n=max(rows) + 1)
    params = joint.perturb(made.joint, made.operation, sampling.draw(made)[1:])[rows]
    params["alpha"][:, 0], params["omega"], params["torque"] = np.radians(alpha), rpm * RPM, torque
    return params


def test_an_independent_solution() -> None:
    """Radau at rtol 1e-6 of another implementation, 7200 angles of the sixth revolution."""
    case = study.load_case(REFERENCE / "rattling" / "rattle_30.toml")
    errors = joint.nominal_errors(1, CARDAN)
    for key, value in case.errors.items():
        errors[key] = value
    row = simulate_rows(joint.perturb(case.joint, case.operation, errors), Options()).results[0]
    with (REFERENCE / "rattling" / "rattle_30_largest.csv").open() as file:
        lines = list(csv.DictReader(file))
    assert (row["status"], row["period"]) == (Status.OK, 1)
    for column, name in (("F_N", "F_max"), ("T_Nm", "T_max")):
        expected = np.array([float(line[column]) for line in lines])
        np.testing.assert_allclose(row[name], expected, atol=0.02 * expected.max())


@pytest.mark.parametrize(
    ("point", "rows", "within"),
    [((30, 1500, 100), [3, 10], 0.02), ((15, 3000, 100), [0, 13], 0.02), ((15, 500, 10), [112, 451], 0.01)],
)
@pytest.mark.slow
def test_largest_loads_are_those_of_fine_uniform_steps(
    point: tuple[float, float, float], rows: list[int], within: float
) -> None:
    params = joints(*point, rows)
    found, fine = simulate_rows(params, Options()).results, simulate_rows(params, UNIFORM).results
    assert (found["status"] == Status.OK).all()
    assert (fine["status"] == Status.OK).all()
    assert (found["refinement_change"] < 0.05).all()
    for name in ("F_max", "T_max"):
        size = fine[name].max(axis=1, keepdims=True)
        assert (np.abs(found[name] - fine[name]) < within * size).all()


@pytest.mark.slow
def test_a_joint_has_the_same_bits_in_lanes_alone_and_in_any_order(monkeypatch: pytest.MonkeyPatch) -> None:
    params = np.concatenate([joints(15, 3000, 100, [0, 7, 10, 13, 19]), joints(30, 1500, 100, [10, 13])])
    options = FOLLOWING._replace(max_revs=24)

    def run(these: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        results = np.zeros(len(these), RESULT).view(np.recarray)
        blocks = np.zeros((len(these), options.max_revs), RESULT).view(np.recarray)
        left = np.full(len(these), iterations_allowed(options.steps_per_rev, options.max_revs))
        list(simulation.simulate_together(these, options, left, False, results, blocks))
        return results.view(np.ndarray), blocks.view(np.ndarray)

    together, blocks = run(params)
    backwards, _ = run(params[::-1].copy())
    monkeypatch.setattr(simulation, "width", lambda: 1)
    alone, own = run(params)
    assert_same(together, alone)
    for i, made in enumerate(together["revolutions"].astype(int)):
        assert_same(blocks[i, :made], own[i, :made])
    assert_same(backwards[::-1], together)


EXPLICIT = FOLLOWING._replace(max_refinements=1, max_revs=10)


def with_explicit_steps(params: np.ndarray, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Results of joints that start with these numbers of steps a revolution, and statistics of their revolutions."""
    results = np.zeros(len(params), RESULT).view(np.recarray)
    blocks = np.zeros((len(params), EXPLICIT.max_revs), RESULT).view(np.recarray)
    left = np.full(len(params), iterations_allowed(EXPLICIT.steps_per_rev, EXPLICIT.max_revs))
    list(simulation.simulate_together(params, EXPLICIT, left, False, results, blocks, steps))
    return results.view(np.ndarray), blocks.view(np.ndarray)


@pytest.mark.slow
def test_with_explicit_steps_a_joint_has_the_same_bits_beside_any_others() -> None:
    params = np.concatenate([joints(15, 3000, 100, [0, 7, 10]), joints(30, 1500, 100, [10, 13, 5])])
    steps = simulation.explicit_steps(params, EXPLICIT)
    assert (steps > 0).all()
    together, blocks = with_explicit_steps(params, steps)
    backwards, _ = with_explicit_steps(params[::-1].copy(), steps[::-1].copy())
    assert_same(backwards[::-1], together)
    for i in (0, 4):
        alone, own = with_explicit_steps(params[i : i + 1], steps[i : i + 1])
        assert_same(alone, together[i : i + 1])
        made = int(together["revolutions"][i])
        assert_same(blocks[i, :made], own[0, :made])


def test_unstable_steps_are_found_out_and_shortened() -> None:
    params = joints(30, 1500, 100, [2, 5])
    steps = simulation.explicit_steps(params, EXPLICIT)
    right, _ = with_explicit_steps(params, steps)
    for share in (0.4, 0.7):  # two thirds of the bound is past the limit
        few = EXPLICIT.steps_per_rev * (share * steps // EXPLICIT.steps_per_rev).astype(np.int64)
        found, _ = with_explicit_steps(params, few)
        assert (found["halvings"] > 0).all()
        assert (found["status"] == right["status"]).all()
        np.testing.assert_allclose(found["F_max"].max(axis=1), right["F_max"].max(axis=1), rtol=0.03)


def test_which_joints_get_explicit_steps() -> None:
    rattling, calm = joints(30, 1500, 100, [0]), joints(15, 500, 100, [0])
    slow, stiff = joints(15, 20, 0, [0]), joints(30, 1500, 100, [0])
    for name in ("k", "station_k1", "station_k2"):
        stiff[name] *= 1000
    found = simulation.explicit_steps(np.concatenate([rattling, calm, slow, stiff]), EXPLICIT)
    assert found[0] > 0
    assert (found[1:] == 0).all()


def cell(level: int, worst: float = 0.0, pinned: int = 0) -> np.recarray:
    made = np.zeros(1, CELL).view(np.recarray)
    made.level, made.worst, made.pinned = level, worst, pinned
    return made[0]


def test_levels_go_from_one_revolution_to_the_next() -> None:
    new = cell(UNKNOWN)
    assert next_level(0, new, new) == FIRST_LEVEL
    assert next_level(0, new, cell(5, 0.5)) == 5
    assert next_level(1, cell(5, 0.5), cell(2, 0.5)) == 5
    assert next_level(1, cell(5, 0.9 * COARSEN_BELOW), new) == 4
    assert next_level(1, cell(5, 1e-12), new) == 0
    assert next_level(1, cell(5, 1e-12, pinned=1), new) == 5
    assert next_level(COARSENING_REVS, cell(5, 1e-12), new) == 5


def watched(series: np.ndarray) -> np.ndarray:
    """Statistics of revolutions with these largest forces of the first bushing."""
    made = np.zeros(len(series), RESULT)
    made["F_max"] = series[:, None] * np.linspace(1, 0.5, 8)
    made["T_max"] = made["F_max"] / 10
    return made


def ended(revolutions: int, period: int = 0) -> np.ndarray:
    made = np.zeros(1, RESULT)
    made["status"], made["period"], made["revolutions"] = Status.NOT_SETTLED, period, revolutions
    made["F_max"] = 5.0
    return made


def test_what_becomes_stationary() -> None:
    rng = np.random.default_rng(1)
    steady = 100 + 10 * rng.random(48)
    drift = steady + np.linspace(0, 30, 48)
    wild = np.concatenate([np.full(32, 100.0), steady[32:]]) + 0.01 * rng.random(48)
    for series, status in ((steady, Status.STATIONARY), (drift, Status.NOT_SETTLED), (wild, Status.NOT_SETTLED)):
        result = ended(48)
        stationary.classify(result, watched(series)[None], 100)
        assert result["status"][0] == status
    result = ended(48)
    stationary.classify(result, watched(steady)[None], 100)
    stationary.fill_intervals(result)
    assert 0.9 < result["F_lower"][0] < 1 < result["F_upper"][0] < 1.2
    assert 105 < result["F_max"][0, 0] < 111
    rolled = ended(50)  # revolution r lies at r modulo 48
    stationary.classify(rolled, np.roll(watched(steady), 2)[None], 100)
    assert rolled["F_max"].tobytes() == result["F_max"].tobytes()
    twice = ended(48, period=2)
    stationary.classify(twice, watched(drift)[None], 100)
    stationary.fill_intervals(twice)
    assert (twice["status"][0], twice["F_lower"][0], twice["F_upper"][0]) == (Status.STATIONARY, 1.0, 1.0)


def test_ends_of_other_joints() -> None:
    results = np.zeros(2, RESULT)
    results["status"], results["F_max"] = (Status.OK, Status.NOT_SETTLED), 7.0
    stationary.fill_intervals(results)
    assert (results["F_lower"][0], results["contact_upper"][0]) == (1.0, 1.0)
    assert np.isnan(results["F_lower"][1])


@pytest.mark.parametrize("power", [2.0, 1.0, 0.5])
def test_the_largest_of_many_lies_in_the_interval(power: float) -> None:
    """Bounded loads whose density ends with a peak, a step, or gently at the largest; 95 % asked for."""
    rng = np.random.default_rng(2)
    inside = []
    for _ in range(60):
        found = stationary.largest(1 - rng.random((32, 12)) ** power, 100)
        truth = (1 - rng.random((100, 12)) ** power).max(axis=0)
        inside.append((found.lower <= truth) & (truth <= found.upper))
    assert 0.90 <= np.mean(inside) <= 0.999  # some more than asked for: intervals are widened for the steps' error


@pytest.mark.slow
@pytest.mark.parametrize("revolutions", [16, 32, 64])
def test_the_largest_of_loads_without_a_bound_lies_in_the_interval(revolutions: int) -> None:
    """Exponential and normal loads, whose largest of 100 or 1000 revolutions is far above those watched."""
    rng = np.random.default_rng(3)
    for draw in (rng.standard_exponential, rng.standard_normal):
        for duration in (100, 1000):
            found = stationary.largest(10.0 + draw((revolutions, 400)), duration)
            truth = 10.0 + draw((duration, 400)).max(axis=0)
            assert (found.lower > truth).mean() < 0.035
            assert (found.upper < truth).mean() < 0.035 + 2.0 * np.sqrt(0.025 * 0.975 / 400)


def test_loads_that_stay_close_to_a_bound_have_a_short_interval() -> None:
    loads = 100.0 + 10.0 * np.sin(2.0 * np.pi * np.random.default_rng(4).random((64, 20)))
    found = stationary.largest(loads, 100)
    assert np.median(found.upper) < 112.0 + 2.0 * stationary.STEP_ERROR * 100.0


def test_a_stationary_joint_counts_on_both_sides_of_a_limit_inside_its_interval() -> None:
    values, status = [5.0, 7.0, 9.0, 8.0], [Status.OK, Status.STATIONARY, Status.OK, Status.STATIONARY]
    ends = Inexact(np.array([1, 3]), np.array([6.0, 7.9]), np.array([8.0, 8.1]))
    for level, least, count, most in ((5.5, 3, 3, 3), (6.5, 2, 3, 3), (7.5, 2, 2, 3), (8.0, 1, 1, 2), (8.5, 1, 1, 1)):
        found = replace(Sample.of(values, status), inexact=ends).above(level)
        assert (found.bound_lower, found.estimate, found.bound_upper) == (least / 4, count / 4, most / 4)
    assert exceedance.exceedance(values, status, 6.5).bound_lower == 0.75


def test_torque_reverses_where_the_inertia_of_the_output_shaft_says() -> None:
    params = joints(15, 3000, 100, [0, 1])
    theta = np.linspace(0, 2 * np.pi, 100_001)
    steepest = np.gradient(ideal.speed_ratio(theta, np.radians(15)), theta).max()
    arm = lump_kind("arm")
    own = 0.01 + 2 * (params["mass"][0, arm] * params["R"][0] ** 2 + params["inertia"][0, arm, 2])
    assert ideal.reversal_torque(params)[0] == pytest.approx(own * (3000 * RPM) ** 2 * steepest, rel=1e-3)
    assert params.dtype == PARAM


@pytest.mark.slow
def test_the_plan_tells_of_joints_that_rattle(tmp_path: Path) -> None:
    text = (STUDIES / "rigid_shafts.toml").read_text()
    calm = tmp_path / "calm.toml"
    calm.write_text(text)
    rattling = tmp_path / "rattling.toml"
    rattling.write_text(text.replace('speed = "500 rpm"', 'speed = "1500 rpm"').replace('"100 N*m"', '"10 N*m"'))
    assert plan.plan(study.load(calm), 1, 2).reversals.joints == 0
    found = plan.plan(study.load(rattling), 1, 2).reversals
    assert found.joints == 2
    assert found.torque > 10
    assert found.cost > 2
