"""Studies of joints at and beyond the edge: every one ends in a result or an honest status."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.support import synthetic
from tests.support.environment import ROOT
from tests.support.of_cardan import LOAD_KINDS, RESULT, RESULT_FIELDS
from tests.support.reports import build
from tolstat import joint, sampling, study
from tolstat.campaign import run as campaign
from tolstat.campaign import verify
from tolstat.campaign.remedy import remedy
from tolstat.common.errors import InputError
from tolstat.common.tables import FAILED, SIMULATED, Options, Status
from tolstat.questions.sweep import cases
from tolstat.solver.simulation import simulate_rows
from tolstat.store import ResultFile, Writer, verification
from tolstat.store.verification import Check, Verification
from tolstat.store.view import View

pytestmark = pytest.mark.slow

STUDIES = ROOT / "studies"
FLOATS = [f.name for f in RESULT_FIELDS if f.dtype == "f8"]
ENDS = {field.name for kind in LOAD_KINDS for field in kind.ends()}
MAY_BE_NAN = {"closure_trend", "failed_theta", "refinement_change", "step_error", "line_load"} | ENDS


def assert_honest(results: np.ndarray) -> None:
    """No NaN in a joint with results, no number in one without."""
    simulated, failed = np.isin(results["status"], SIMULATED), np.isin(results["status"], FAILED)
    assert (simulated | failed).all()
    assert np.isfinite(results["clearance"]).all()  # known before the simulation
    for name in set(FLOATS) - MAY_BE_NAN - {"clearance"}:
        assert np.isfinite(results[name][simulated]).all(), name
        assert np.isnan(results[name][failed]).all(), name
    ok = results["status"] == Status.OK
    assert (results["period"][ok] == 1).all()
    unresolved = results["status"] == Status.NOT_RESOLVED
    assert (results["period"][~ok & ~unresolved] != 1).all()
    assert ((results["failed_step"] > 0) == (results["status"] == Status.NEWTON_FAILED)).all()


DEAREST = (
    "0 N m",
    "1 N m",
    "70 deg",
    "85 deg, 720 steps",
    "5000 rpm",
    "Js x 1e4",
)
"""Variants whose joints rattle or ring for ever; their classes are in docs/notes/hard_cases.md."""


@pytest.fixture(scope="module")
def hard(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Result file of the study, without the dearest variants."""
    folder = tmp_path_factory.mktemp("hard")
    head, *blocks = (STUDIES / "hard_cases.toml").read_text(encoding="utf-8").split("[[variant]]")
    kept = [block for block in blocks if not any(f'name = "{name}"\n' in block for name in DEAREST)]
    assert len(kept) == len(blocks) - len(DEAREST)
    (folder / "hard.toml").write_text("[[variant]]".join([head, *kept]), encoding="utf-8")
    campaign.run(study.load(folder / "hard.toml"), folder / "hard.h5", workers=1)
    return folder / "hard.h5"


def test_all_hard_cases_end_in_a_result_or_a_status(hard: Path) -> None:
    with ResultFile.open(hard) as store:
        results, design = store.results(), store.design
        family = np.array([v.family for v in store.variants])[design["variant"]]
        case = np.array(store.case_names)[design["case"]]
    assert_honest(results)
    rings = case == "tilt of 5 deg"  # for ever, by a few thousandths of the loads
    assert (results["status"][rings] == Status.STATIONARY).all()
    assert (results["closure"][rings] < 1e-2).all()
    results, family = results[~rings], family[~rings]
    ended = {name: {Status(s).label for s in results["status"][family == name]} for name in family}
    assert ended.pop("85 deg") <= {"not_resolved", "newton_failed"}  # moves chaotically to its last iteration
    assert ended.pop("85 deg, 5 revolutions") == {"newton_failed"}
    for name in (
        "20000 rpm",
        "20000 rpm, 60 revolutions",
    ):  # the same every three revolutions, with a tilt nearly in each
        assert ended.pop(name) == {"stationary", "ok"}
    assert set().union(*ended.values()) == {"ok"}, ended


def test_the_setting_that_the_message_names_solves_the_case(hard: Path) -> None:
    with ResultFile.open(hard) as store:
        results, design = store.results(), store.design
        family = [store.variants[i].family for i in design["variant"]]
    for dear in results[np.array(family) == "85 deg, 5 revolutions"]:
        assert dear["status"] == Status.NEWTON_FAILED
        assert "solver.steps_per_rev = 720" in remedy(dear, Options()._asdict())
        assert 0 <= dear["failed_theta"] < 2 * np.pi


def test_the_report_has_a_row_for_each_joint(hard: Path) -> None:
    report = build(hard)
    rows = pd.read_csv(hard.parent / "hard_cases.csv")
    assert len(rows) == 44
    assert rows["note"][0].startswith("what the others are compared with")
    assert rows["cost"][0] == 1.0
    assert re.search("^85 deg, .*: 40 iterations a step were spent at", report.notes, flags=re.MULTILINE)


def test_a_fuzz_of_joints_far_outside_tolerance(tmp_path: Path) -> None:
    s = study.load(STUDIES / "fuzz.toml", n=24)
    params = joint.perturb(s.joint, s.operation, sampling.draw(s))
    results = simulate_rows(params, Options(max_revs=10)).results
    assert_honest(results)
    assert (results["status"] == Status.OK).any()


TEXT = (
    synthetic.HEAD.replace("15 deg", "5 deg")
    + """[solver]
steps_per_rev = 36
[sampling]
method = "cases"
[[case]]
name = "a"
errors.hole4.offset_t = "0.1 mm"
[[variant]]
name = "plain"
[[variant]]
name = "own"
operation = { alpha = "10 deg" }
solver = { steps_per_rev = 24, settle_tol = 1e-3 }
note = "other settings"
[[variant]]
name = "last"
"""
)


def load(folder: Path, *changes: tuple[str, str]) -> study.Study:
    text = TEXT
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "s.toml").write_text(text, encoding="utf-8")
    return study.load(folder / "s.toml")


def test_a_variant_has_its_own_operating_point_and_settings(tmp_path: Path) -> None:
    s = load(tmp_path)
    own = {"operation.alpha": np.radians(10), "solver.steps_per_rev": 24, "solver.settle_tol": 1e-3}
    assert [v.values for v in s.variants] == [{}, own, {}]
    assert not sampling.draw(s)["operation.alpha"].any()
    np.testing.assert_allclose(np.degrees([one.alpha for one in s.operations]), [5, 10, 5])
    assert [o.steps_per_rev for o in s.solvers] == [36, 24, 36]
    assert s.solvers[1].settle_tol == 1e-3
    changed = load(tmp_path, ("settle_tol = 1e-3", "settle_tol = 1e-4"))
    assert changed.identity() != s.identity()
    assert load(tmp_path, ("other settings", "others")).identity() == s.identity()


def test_rows_are_simulated_with_the_settings_of_their_variant(tmp_path: Path) -> None:
    s = load(tmp_path)
    counts = campaign.run(s, tmp_path / "s.h5", workers=1, block=4)
    assert counts.done == 6
    rows = np.split(sampling.draw(s), 6)
    params = np.concatenate([joint.perturb(s.joint, s.operations[i // 2], row) for i, row in enumerate(rows)])
    with ResultFile.open(tmp_path / "s.h5") as store:
        results = store.results()
        assert store.variants == s.variants
    for i in range(6):
        alone = simulate_rows(params[i : i + 1], s.solvers[i // 2].options()).results
        for name in RESULT.names:
            np.testing.assert_array_equal(alone[name][0], results[name][i])


def test_joints_are_verified_with_the_settings_of_their_variant(tmp_path: Path) -> None:
    s = load(tmp_path)
    campaign.run(s, tmp_path / "s.h5", workers=1)
    assert joint.varied(s.joint, s.variants[1].values) == s.joint
    halved = partial(verify.run_checks, names=("half_step",))
    for found in (
        verify.check_file(tmp_path / "s.h5", joints=6, make=halved),
        verify.check_study(s, joints=6, make=halved),
    ):
        assert found.rows.tolist() == [0, 1, 2, 3, 4, 5]
        (check,) = found.checks.values()
        assert (check.results["status"] == Status.OK).all()
        assert (check.results["steps_per_rev"] == 2 * found.base["steps_per_rev"]).all()


def test_the_table_holds_the_errors_against_the_reference(tmp_path: Path) -> None:
    campaign.run(load(tmp_path), tmp_path / "s.h5", workers=1, check=False)
    with Writer.open(tmp_path / "s.h5") as store:
        before = cases(View(store))
        rows = np.array([0, 1, 2, 3, 4])
        true = store.results()[rows]
        worst = true["F_max"][0].max()
        true["F_max"][0, 5] += 1e-3 * worst
        true["T_max"][1] *= 1.25
        true["status"][3:] = Status.NOT_SETTLED, Status.NEWTON_FAILED
        true["closure"][3] = 2e-4
        verification.write(
            [(store, verification.VERIFY, Verification(4, rows, true, {"reference": Check("", {}, true)}))]
        )
        checked = cases(View(store))
    table = checked.frame("cases")
    largest = max(worst, true["F_max"][0].max())
    assert table["error_F"][0] == pytest.approx(1e-3 * worst / largest)
    assert table["error_T"][:4].tolist() == pytest.approx([0, 0.2, 0, 0])
    assert table["error_F"].isna().tolist() == 4 * [False] + 2 * [True]
    assert "reference" not in before.frame("cases")
    assert table["reference"].tolist() == [*(["ok"] * 3), "not_settled", "newton_failed", ""]
    assert table["reference_change"][3] == pytest.approx(2e-4)


@pytest.mark.parametrize(
    ("change", "found"),
    [
        (('alpha = "10 deg"', 'alpha = "95 deg"'), "variant[1].operation.alpha"),
        (('alpha = "10 deg"', 'aplha = "10 deg"'), "did you mean 'alpha'"),
        (("steps_per_rev = 24", "steps_per_rev = 2"), "variant[1].solver.steps_per_rev"),
        (("steps_per_rev = 24", "steps = 24"), "variant[1].solver.steps: unknown key"),
        (("[[case]]", '[grid]\n"operation.alpha" = ["1 deg"]\n[[case]]'), "is set by grid already"),
        (("[[case]]", '[output]\nhistories = "full"\n[[case]]'), "different steps per revolution: 24, 36"),
    ],
)
def test_faults_of_a_variant_name_their_place(tmp_path: Path, change: tuple[str, str], found: str) -> None:
    with pytest.raises(InputError) as caught:
        load(tmp_path, change)
    assert found in str(caught.value)
    assert len(caught.value.faults) == 1
