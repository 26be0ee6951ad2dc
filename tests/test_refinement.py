"""Loads that the steps of a revolution do not resolve: looked at closer, refined, or said not to be resolved."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tolstat import joint, refinement, sampling, study
from tolstat.remedy import remedy
from tolstat.simulation import simulate_rows
from tolstat.tables import RESULT, Options, Status

STUDIES = Path(__file__).parent.parent / "studies"
PLAIN = Options(peak_substeps=1, max_refinements=0)
RINGING = (163, 293, 594, 844, 883)
"""Rows of iso2768_f.toml whose largest load is ringing after a contact switches: 5 in a thousand low at 180 steps."""
WRONG, FINE = 644, 142
"""Rows of fuzz.toml: a third low at 180 steps; the same at any number of steps."""
DAMPED = (302, 519, 1189)
"""Rows of fuzz.toml: 2 to 3 % off at 180 steps, which damp what rings."""
DEEP = (145, 320, 964, 1155, 1413)
"""Rows of fuzz.toml whose pins are pressed deep with both ends: contacts as stiff as bushings."""


def parameters(name: str, *rows: int) -> np.ndarray:
    plan = study.load(STUDIES / name, n=max(rows))
    return joint.perturb(plan.joint, sampling.draw(plan)[list(rows)])


def test_ringing_on_a_peak_is_met_by_a_closer_look() -> None:
    params = parameters("iso2768_f.toml", *RINGING)
    true = simulate_rows(params, PLAIN._replace(steps_per_rev=5760)).results
    plain = simulate_rows(params, PLAIN).results
    near = simulate_rows(params, Options())
    assert (refinement.changes(plain, true) > 5e-3).all()
    assert (refinement.changes(near.results, true) < 1.5e-3).all()
    assert (near.results["steps_per_rev"] == 180).all()
    for name in ("F", "T"):
        for largest in (f"{name}_max", "contact_max"):
            assert (near.results[largest] >= plain[largest]).all()
        low = [row[f"{name}_max"] - row[f"{name}_range"] for row in (near.results, plain)]
        assert (low[0] <= low[1] * (1 + 1e-12)).all()
        np.testing.assert_array_equal(near.results[f"{name}_mean"], plain[f"{name}_mean"])


def test_a_joint_that_is_wrong_at_180_steps_is_not_ok() -> None:
    params = parameters("fuzz.toml", FINE, WRONG)
    options = Options(max_revs=8)
    plain = simulate_rows(params, options._replace(peak_substeps=1, max_refinements=0)).results
    assert (plain["status"] == Status.OK).all()
    fine, wrong = simulate_rows(params, options).results
    assert (fine["status"], fine["steps_per_rev"]) == (Status.OK, 180)
    assert np.isnan(fine["refinement_change"])
    assert wrong["status"] != Status.OK
    assert wrong["steps_per_rev"] > 180
    assert wrong["F_max"].max() > 1.2 * plain["F_max"][1].max()
    assert wrong["newton_iterations"] > 4 * plain["newton_iterations"][1]


def test_lively_joints_are_right_or_not_ok() -> None:
    params = parameters("fuzz.toml", *DAMPED, *DEEP)
    plain = simulate_rows(params, PLAIN).results
    found = simulate_rows(params, Options()).results
    true = simulate_rows(params, PLAIN._replace(max_revs=6, steps_per_rev=11520, settle_tol=1e-3)).results
    off = refinement.changes(found, true)
    assert (plain["status"] == Status.OK).all()
    (ringing, deep), (ringing_off, deep_off) = (np.split(x, [len(DAMPED)]) for x in (found, off))
    assert (refinement.changes(plain, true)[: len(DAMPED)] > 1e-2).all()
    ok = ringing["status"] == Status.OK
    assert ok.any()
    assert (ringing["steps_per_rev"][ok] == 2880).all()
    assert (ringing_off[ok] < 2e-3).all()
    assert (deep["status"] == Status.OK).all()
    assert (deep_off < 3e-3).all()


def test_no_refined_joint_depends_on_others() -> None:
    params = parameters("fuzz.toml", 254, FINE, 1857)
    options = Options(max_revs=8, max_refinements=1)
    together = simulate_rows(params, options, "full")
    assert (together.results["steps_per_rev"] == [720, 180, 720]).all()
    assert together.histories["loads"].shape[1] == 180
    for i in range(3):
        alone = simulate_rows(params[i : i + 1], options, "full")
        assert alone.results.tobytes() == together.results[i : i + 1].tobytes()
        np.testing.assert_array_equal(alone.histories["loads"][0], together.histories["loads"][i])


@pytest.mark.parametrize(
    ("loads", "last", "status", "steps"),
    [
        ([1.0, 1.001], Status.OK, Status.OK, 720),
        ([1.0, 1.1, 1.101], Status.OK, Status.OK, 2880),
        ([1.0, 1.1, 1.2], Status.OK, Status.NOT_RESOLVED, 2880),
        ([1.0, 1.1], Status.NOT_SETTLED, Status.NOT_SETTLED, 720),
        ([1.0, np.nan], Status.NEWTON_FAILED, Status.NOT_RESOLVED, 180),
    ],
)
def test_what_becomes_of_a_rough_joint(loads: list[float], last: Status, status: Status, steps: int) -> None:
    """`loads` of one joint at 180, 720 and 2880 steps, and what became of it at the last of them that are given."""

    def simulate(rows: np.ndarray, options: Options) -> np.ndarray:
        made = np.zeros(len(rows), RESULT)
        level = {180: 0, 720: 1, 2880: 2}[options.steps_per_rev]
        made["F_max"] = made["T_max"] = loads[level]
        made["status"] = last if level == len(loads) - 1 else Status.OK
        made["steps_per_rev"], made["newton_iterations"], made["roughness"] = (
            options.steps_per_rev,
            1,
            0.1 * (level == 0),
        )
        return made

    results = np.concatenate([simulate(np.arange(1), Options()), simulate(np.arange(1), Options())])
    results["roughness"][1] = 0.01
    smooth = results[1].copy()
    refinement.refine(results, Options(), simulate)
    assert (results["status"][0], results["steps_per_rev"][0]) == (status, steps)
    assert results["newton_iterations"][0] == (steps // 180).bit_length() // 2 + 1
    assert results[1] == smooth
    said = remedy(results[0], Options()._asdict())
    assert ("solver.max_refinements = 3" in said) == (status == Status.NOT_RESOLVED and np.isfinite(loads[-1]))
    untouched = np.concatenate([simulate(np.arange(1), Options())])
    refinement.refine(untouched, Options(max_refinements=0), simulate)
    assert untouched["steps_per_rev"] == 180


@pytest.mark.parametrize(
    ("psi", "loads", "middle", "status", "steps"),
    [
        (0.01, [1.0, 1.0, 1.001], Status.OK, Status.OK, 2880),
        (0.01, [1.0, 1.0, 1.1], Status.OK, Status.NOT_RESOLVED, 2880),
        (0.01, [1.0, 1.0, 1.0], Status.NOT_PERIODIC, Status.OK, 2880),
        (1e-4, [1.0, 1.0, 1.1], Status.OK, Status.OK, 180),
    ],
)
def test_what_becomes_of_a_smooth_joint(
    psi: float, loads: list[float], middle: Status, status: Status, steps: int
) -> None:
    """`loads` at 180, 720 and 2880 steps of a joint without roughness, and what became of it at 720."""

    def simulate(rows: np.ndarray, options: Options) -> np.ndarray:
        made = np.zeros(len(rows), RESULT)
        level = {180: 0, 720: 1, 2880: 2}[options.steps_per_rev]
        made["F_max"] = made["T_max"] = loads[level]
        made["status"] = middle if level == 1 else Status.OK
        made["steps_per_rev"], made["psi_max"], made["roughness"] = options.steps_per_rev, psi, 0.01
        return made

    results = simulate(np.arange(2), Options())
    results["roughness"][1] = 1e-4
    refinement.refine(results, Options(), simulate)
    assert (results["status"] == [status, Status.OK]).all()
    assert results["steps_per_rev"].tolist() == [steps, 180]
    fine = simulate(np.arange(1), Options(steps_per_rev=2880))
    refinement.refine(fine, Options(steps_per_rev=2880), simulate)
    assert fine["steps_per_rev"] == 2880
