"""Loads that the steps of a revolution do not resolve: looked at closer, refined, or said not to be resolved."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from tests.support.environment import ROOT
from tests.support.held import FACES, FRICTION, held
from tests.support.of_cardan import LOAD_KINDS, RESULT
from tolstat import joint, sampling, study
from tolstat.campaign.remedy import remedy
from tolstat.common.cardan import CARDAN
from tolstat.common.load_kinds import measure_of
from tolstat.common.tables import Method, Options, Status, tables
from tolstat.kernel.lanes.batch import make_batch
from tolstat.kernel.revolution.closeup import STEPS, divide, reverses, switches
from tolstat.kernel.revolution.settle import make_samples
from tolstat.solver import refinement
from tolstat.solver.simulation import simulate_rows

STUDIES = ROOT / "studies"
PLAIN = Options(peak_substeps=1, max_refinements=0)
RINGING = (163, 293, 594, 844, 883)
"""Rows of rigid_shafts.toml whose largest load is ringing after a contact switches: 5 in 1000 low at 180 steps."""
WRONG, FINE = 644, 142
"""Rows of fuzz.toml: a third low at 180 steps; the same at any number of steps."""
DAMPED = (302, 519, 1189)
"""Rows of fuzz.toml: 2 to 3 % off at 180 steps, which damp what rings."""
DEEP = (145, 320, 964, 1155, 1413)
"""Rows of fuzz.toml whose pins are pressed deep with both ends: contacts as stiff as bushings."""


def changes(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Largest change of any largest |F| or |T|, relative to the largest of the kind."""
    worst = np.zeros(len(after))
    for name in ("F_max", "T_max"):
        worst = np.maximum(worst, np.abs(after[name] - before[name]).max(axis=1) / after[name].max(axis=1))
    return worst


def assert_same(first: np.ndarray, second: np.ndarray) -> None:
    """Tables of joints with the same numbers; the bytes between fields are anything."""
    for name in RESULT.names:
        np.testing.assert_array_equal(first[name], second[name], err_msg=name)


def parameters(name: str, *rows: int) -> np.ndarray:
    plan = study.load(STUDIES / name, n=max(rows))
    return joint.perturb(plan.joint, plan.operation, sampling.draw(plan)[list(rows)])


def test_ringing_on_a_peak_is_met_by_a_closer_look() -> None:
    params = parameters("rigid_shafts.toml", *RINGING)
    true = simulate_rows(params, PLAIN._replace(steps_per_rev=5760)).results
    plain = simulate_rows(params, PLAIN).results
    near = simulate_rows(params, Options())
    assert (changes(plain, true) > 5e-3).all()
    assert (changes(near.results, true) < 1.5e-3).all()
    assert (near.results["steps_per_rev"] == 180).all()
    for name in ("F", "T"):
        for largest in (f"{name}_max", "contact_max"):
            assert (near.results[largest] >= plain[largest]).all()
        low = [row[f"{name}_max"] - row[f"{name}_range"] for row in (near.results, plain)]
        assert (low[0] <= low[1] * (1 + 1e-12)).all()
        np.testing.assert_array_equal(near.results[f"{name}_mean"], plain[f"{name}_mean"])


def test_a_closer_look_at_a_slow_joint_adds_no_ringing() -> None:
    """At 20 rpm what rings dies away within a part; the trapezoidal rule would end 0.4 and 1.2 % high."""
    params = parameters("rigid_shafts.toml", 165, 166)
    params["omega"] = 20 * 2 * np.pi / 60
    true = simulate_rows(params, PLAIN._replace(steps_per_rev=1440)).results
    assert (changes(simulate_rows(params, Options()).results, true) < 5e-4).all()


def test_later_steps_of_a_closer_look_have_a_quarter_of_the_parts() -> None:
    par = parameters("rigid_shafts.toml", 163)
    par["omega"] = 2 * np.pi / 180  # a step of two degrees takes a second
    batch = make_batch(Options(), 1)
    for left, parts in ((STEPS, 40), (1, 40), (0, 10), (-1, 10)):
        batch.control.left[0] = left
        divide(0, par.view(np.recarray)[0], Options(), batch.control, batch.motion)
        assert (batch.control.until[0], batch.control.grid[0]) == (parts, pytest.approx(1 / parts))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["iso2768_f", "rigid_shafts"])
def test_loads_are_within_a_thousandth_in_99_of_100_joints(name: str) -> None:
    """At the default steps, against TR-BDF2 with 5760, relative to what a load is measured against."""
    plan = study.load(STUDIES / f"{name}.toml")
    first = plan.first_sample + 1000
    params = joint.perturb(plan.joint, plan.operation, sampling.draw(plan, range(first, first + 200)))
    rows = simulate_rows(params, Options()).results
    fine = PLAIN._replace(steps_per_rev=5760, method=int(Method.TR_BDF2))
    expected = simulate_rows(params, fine).results
    assert (rows["status"] == Status.OK).all()
    assert (expected["status"] == Status.OK).all()
    for kind in (kind for kind in LOAD_KINDS if kind.decides):
        largest, correct = (table[f"{kind.key}_max"].reshape(200, -1) for table in (rows, expected))
        size = expected[f"{measure_of(kind).key}_max"].reshape(200, -1).max(axis=1)
        assert np.quantile(np.abs(largest - correct).max(axis=1) / size, 0.99) < 1e-3, kind.key


def test_a_joint_that_is_wrong_at_180_steps_is_refined() -> None:
    params = parameters("fuzz.toml", FINE, WRONG)
    plain = simulate_rows(params, PLAIN).results
    assert (plain["status"] == Status.OK).all()
    assert plain["step_error"][0] < refinement.STEP_ERROR < plain["step_error"][1]
    fine, wrong = simulate_rows(params, Options()).results
    assert (fine["status"], fine["steps_per_rev"]) == (Status.OK, 180)
    assert np.isnan(fine["refinement_change"])
    assert wrong["steps_per_rev"] != 180
    assert wrong["F_max"].max() > 1.2 * plain["F_max"][1].max()
    assert refinement.work(wrong) > 4 * refinement.work(plain[1])


@pytest.mark.slow
def test_lively_joints_are_right_or_not_ok() -> None:
    params = parameters("fuzz.toml", *DAMPED, *DEEP)
    plain = simulate_rows(params, PLAIN).results
    found = simulate_rows(params, Options()).results
    true = simulate_rows(params, PLAIN._replace(max_revs=6, steps_per_rev=11520, settle_tol=1e-3)).results
    off = changes(found, true)
    assert (plain["status"] == Status.OK).all()
    assert (changes(plain, true)[: len(DAMPED)] > 1e-2).all()
    assert (found["status"] == Status.OK).all()
    assert (off < 1e-2).all()


def test_no_refined_joint_depends_on_others() -> None:
    params = parameters("fuzz.toml", 254, FINE, 1857)
    options = Options(max_revs=8, max_refinements=1)
    together = simulate_rows(params, options, "full")
    assert ((together.results["steps_per_rev"] == 180) == [False, True, False]).all()
    assert together.histories["loads"].shape[1] == 180
    for i in range(3):
        alone = simulate_rows(params[i : i + 1], options, "full")
        assert alone.results.tobytes() == together.results[i : i + 1].tobytes()
        np.testing.assert_array_equal(alone.histories["loads"][0], together.histories["loads"][i])


@pytest.mark.parametrize(
    ("before", "after", "change", "status"),
    [
        (Status.OK, Status.OK, 0.001, Status.OK),
        (Status.OK, Status.OK, 0.2, Status.NOT_RESOLVED),
        (Status.NOT_SETTLED, Status.OK, 0.001, Status.OK),
        (Status.OK, Status.NOT_SETTLED, np.nan, Status.NOT_SETTLED),
        (Status.OK, Status.NEWTON_FAILED, np.nan, Status.NOT_RESOLVED),
        (Status.NEWTON_FAILED, Status.OK, 0.001, Status.NEWTON_FAILED),
    ],
)
def test_what_becomes_of_a_joint(before: Status, after: Status, change: float, status: Status) -> None:
    """A joint whose steps err by too much, and one beside it whose steps do not."""
    asked: list[tuple[list[int], Options]] = []

    def simulate(rows: np.ndarray, options: Options) -> tuple[np.ndarray, np.ndarray]:
        asked.append((rows.tolist(), options))
        made = np.zeros(len(rows), RESULT)
        made["status"], made["refinement_change"], made["newton_iterations"] = after, change, 10
        return made, np.zeros((len(rows), 4), RESULT)

    results = np.zeros(2, RESULT)
    results["refinement_change"] = np.nan
    results["status"], results["newton_iterations"] = (before, Status.OK), 1
    results["step_error"] = 2 * refinement.STEP_ERROR, 0.5 * refinement.STEP_ERROR
    untouched = results.copy()
    refinement.refine(untouched, Options(max_refinements=0), simulate)
    assert_same(untouched, results)
    smooth = results[1:].copy()
    refinement.refine(results, Options(), simulate)
    assert results["status"][0] == status
    assert_same(results[1:], smooth)
    if before == Status.NEWTON_FAILED:
        assert asked == []
        return
    (rows, options), *rest = asked
    assert rows == [0]
    assert rest == []
    assert (options.method, options.rtol, options.max_revs) == (Method.TR_BDF2, refinement.TOLERANCE, 48)
    assert results["newton_iterations"][0] == (1 if after == Status.NEWTON_FAILED else 11)
    said = remedy(results[0], Options()._asdict())
    assert ("solver.max_refinements = 4" in said) == (status == Status.NOT_RESOLVED and after == Status.OK)


@pytest.mark.parametrize(("steps", "factor"), [(360, 1), (180, 1), (90, 8), (60, 27), (45, 64)])
def test_with_fewer_steps_larger_errors_are_allowed_as_the_third_power_of_the_step(steps: int, factor: int) -> None:
    asked: list[int] = []

    def simulate(rows: np.ndarray, options: Options) -> tuple[np.ndarray, np.ndarray]:
        asked.extend(rows)
        made = np.zeros(len(rows), RESULT)
        made["status"] = Status.OK
        return made, np.zeros((len(rows), 4), RESULT)

    results = np.zeros(4, RESULT)
    results["status"], results["psi_max"] = Status.OK, np.array([1, 1, 1.01, 1.01]) * refinement.SWINGING_PSI
    allowed = [refinement.STEP_ERROR, refinement.SWINGING_STEP_ERROR]
    results["step_error"] = factor * np.repeat(allowed, 2) * np.array([0.99, 1.01, 0.99, 1.01])
    refinement.refine(results, Options(steps_per_rev=steps), simulate)
    assert asked == [1, 3]


@pytest.mark.parametrize("sections", [{"thrust": FACES}, {"friction": FRICTION}])
def test_joints_with_faces_or_friction_get_finer_steps_first(sections: dict) -> None:
    """Whatever |Psi|: three joints of which one errs too little to be refined, one by too much in finer steps, too."""
    mechanism, asked = held(**sections)[1], []
    results = np.zeros(3, tables(mechanism).RESULT)
    results["status"], results["psi_max"] = Status.OK, 2 * refinement.SWINGING_PSI
    results["step_error"] = np.array([0.99, 1.01, 1.01]) * refinement.SHARP_STEP_ERROR

    def simulate(rows: np.ndarray, options: Options) -> tuple[np.ndarray, np.ndarray]:
        asked.append((rows.tolist(), options.method, options.steps_per_rev, options.peak_substeps))
        made = results[rows]
        made["step_error"][rows == 1] = 0.99 * refinement.SHARP_STEP_ERROR
        made["steps_per_rev"] = options.steps_per_rev
        return made, np.zeros((len(rows), 48), results.dtype)

    refinement.refine(results, Options(), simulate, mechanism)
    assert asked == [([1, 2], Method.BDF2, 720, 20), ([2], Method.TR_BDF2, 180, 40)]
    assert results["steps_per_rev"].tolist() == [0, 720, 180]


@pytest.mark.parametrize(("field", "begins"), [("pressed", switches), ("stuck", reverses)])
def test_a_closer_look_begins_where_a_contact_switches_or_sliding_reverses(field: str, begins: Callable) -> None:
    samples = make_samples(1, 6, CARDAN)[0]
    samples[field] = 0
    samples[field][3:5, 2] = 1 << 3
    assert [s for s in range(1, 6) if begins(s, samples)] == [3, 5]


@pytest.mark.parametrize(
    ("load", "spread", "status"),
    [(5.02, 0.005, Status.OK), (5.2, 0.01, Status.STATIONARY), (5.2, 0.1, Status.STATIONARY)],
)
def test_a_motion_that_all_but_repeats_is_taken_as_it_was(load: float, spread: float, status: Status) -> None:
    """Ok with uniform steps, never repeating with others: the largest loads of 48 revolutions decide."""

    def simulate(rows: np.ndarray, options: Options) -> tuple[np.ndarray, np.ndarray]:
        made = np.zeros(len(rows), RESULT)
        if options.method != Method.TR_BDF2:
            made["F_max"] = made["T_max"] = load
            made["status"], made["newton_iterations"] = Status.OK, 3
            return made, np.zeros((0, 0), RESULT)
        made["status"], made["revolutions"], made["newton_iterations"] = Status.NOT_SETTLED, 48, 40
        made["F_max"] = made["T_max"] = 5.0
        blocks = np.zeros((len(rows), 48), RESULT)
        for field in ("F_max", "T_max"):
            blocks[field] = 5.0 * (1 + spread * (np.random.default_rng(1).random((1, 48, 1)) - 0.5))
        return made, blocks

    results, _ = simulate(np.arange(1), Options())
    results["step_error"] = 2 * refinement.STEP_ERROR
    refinement.refine(results, Options(), simulate)
    assert results["status"] == status
    assert results["newton_iterations"] == 43  # of all steps, whichever are kept
    assert results["F_max"].max() == pytest.approx(load if status == Status.OK else 5.0 * (1 + spread / 2), rel=1e-2)
