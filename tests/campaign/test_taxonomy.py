"""Every state that a joint can end in, reached by whole campaigns, and what the commands then say of it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.support.synthetic import HEAD
from tolstat import cli, study
from tolstat.campaign import run as campaign
from tolstat.campaign.remedy import parse_retry
from tolstat.common.errors import InputError
from tolstat.common.tables import FAILED, Status
from tolstat.store import ResultFile

STUDY = (
    HEAD
    + """[solver]
steps_per_rev = 60
[sampling]
method = "cases"

[[case]]
name = "pin larger than its hole"
errors.pin1.diameter = "0.3 mm"

[[case]]
name = "beyond the largest number"
errors.material.E_factor = 1e305

[[variant]]
name = "ok"
cases = []

[[variant]]
name = "not_settled"
cases = []
solver = { start = "ramp", max_revs = 2, max_refinements = 0 }

[[variant]]
name = "stationary"
cases = []
operation = { alpha = "30 deg", speed = "1000 rpm", torque = "4.5 N*m" }
solver = { steps_per_rev = 180 }

[[variant]]
name = "newton_failed"
cases = []
operation = { alpha = "85 deg" }
solver = { max_halvings = 0 }

[[variant]]
name = "outside_model"
cases = ["pin larger than its hole"]

[[variant]]
name = "not_finite"
cases = []
operation = { torque = "1e200 N*m" }
solver = { fidelity = "ideal" }

[[variant]]
name = "invalid_input"
cases = ["beyond the largest number"]
"""
)


HERE = (Status.CRASHED, Status.NOT_RESOLVED)
"""States that are reached elsewhere: one that the kernel has no part in, see test_survival.py, and one that only few of
the joints that rattle end in, see test_refinement.py and test_rattle.py."""


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Result file of a campaign, by the kernel itself, in which the last joint of each variant ends as it is named."""
    folder = tmp_path_factory.mktemp("taxonomy")
    (folder / "t.toml").write_text(STUDY, encoding="utf-8")
    with np.errstate(over="ignore"):
        campaign.run(study.load(folder / "t.toml"), folder / "t.h5", 1, check=False)
    return folder / "t.h5"


@pytest.mark.slow
def test_a_campaign_reaches_every_state_of_the_kernel(path: Path) -> None:
    with ResultFile.open(path) as store:
        variant = store.design["variant"]
        family = [store.variants[number].family for number in variant]
        ended = {name: Status(s).label for name, s in zip(family, store.status(), strict=True)}  # the last one counts
        results = store.results()
        frame = store.to_pandas()
    assert ended == {name: name for name in ended}
    assert set(ended) == {s.label for s in Status} - {s.label for s in HERE} - {"pending"}
    assert set(frame["status"]) == set(ended)
    failed = np.isin(results["status"], FAILED)
    assert np.isnan(results["F_max"][failed]).all()
    assert np.isfinite(results["F_max"][~failed]).all()
    at_a_step = np.isin(results["status"], [Status.NEWTON_FAILED, Status.NOT_FINITE])
    assert (results["failed_step"][at_a_step] >= 1).all()
    steps = np.array([solver.steps_per_rev for solver in study.load(path.with_suffix(".toml")).solvers])[variant]
    begin = 2 * np.pi * ((results["failed_step"] - 1) % steps) / steps  # a step leads from one grid point to the next
    np.testing.assert_allclose(results["failed_theta"][at_a_step], begin[at_a_step], rtol=1e-12)
    assert (results["failed_step"][~at_a_step] == -1).all()
    assert np.isnan(results["failed_theta"][~at_a_step]).all()


@pytest.mark.slow
def test_status_counts_each_state(path: Path) -> None:
    done = CliRunner().invoke(cli.app, ["status", str(path), "--json"])
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    assert {name: told[name] for name in ("joints", "ok", "pending")} == {"joints": 9, "ok": 3, "pending": 0}
    others = {s.label for s in Status} - {"ok", "pending"} - {s.label for s in HERE}
    assert {name: told[name] for name in others} == dict.fromkeys(others, 1)


@pytest.mark.slow
def test_each_state_can_be_asked_for_again(path: Path) -> None:
    made = study.load(path.with_suffix(".toml"))
    for state in Status:
        if state == Status.PENDING:
            with pytest.raises(InputError, match="'pending' is not a status"):
                parse_retry(state.label, (), made)
        else:
            assert parse_retry(state.label, (), made).status == (state,)
