"""`tolstat status`: the pace of a run that goes on with a file, shares of joints that share lots."""

import json
import subprocess
import sys
import time

import pytest
from typer.testing import CliRunner

import tolstat
from tests.support import synthetic
from tests.support.environment import environment
from tolstat import cli, study
from tolstat.analysis.binomial import clopper_pearson

EARLIER, BLOCK, WAIT_S = 300, 5, 0.5


@pytest.mark.slow
def test_pace_is_that_of_this_run_and_counts_no_joint_of_an_earlier_one(tmp_path):
    """300 joints are there; the run that goes on has simulated some blocks of 5 when it is asked."""
    source, path = tmp_path / "plan.toml", tmp_path / "plan.h5"
    source.write_text(synthetic.REAL.replace("n = 60", "n = 400"), encoding="utf-8")
    plan, seen = study.load(source), []
    tolstat.run(plan, path, workers=1, until_row=EARLIER, check=False)

    def ask(counts):
        begun.append(time.monotonic())
        if counts.done > EARLIER and not seen:
            time.sleep(WAIT_S)
            least = time.monotonic() - begun[0]
            command = [sys.executable, "-m", "tolstat", "status", str(path), "--json"]
            done = subprocess.run(command, capture_output=True, text=True, env=environment(), check=True)
            seen.append((json.loads(done.stdout), counts.done - EARLIER, least, time.monotonic() - before))

    begun, before = [], time.monotonic()
    tolstat.run(plan, path, workers=1, block=BLOCK, progress=ask, check=False)
    ((found, joints, least, most),) = seen
    assert found["running"]
    assert found["pending"] == 401 - EARLIER - joints
    assert 0.99 * joints / most <= found["joints_per_s"] <= 1.01 * joints / least
    assert found["s_to_go"] == pytest.approx(found["pending"] / found["joints_per_s"], rel=0.02, abs=1)


@pytest.mark.parametrize("lot", ["", "joints_per_lot = 5\n"])
def test_shares_so_far_have_the_interval_of_the_joints_design(tmp_path, lot):
    text = synthetic.STUDY.replace("n = 60\n", f"n = 200\n{lot}")
    text = text.replace("cpk = 1.0 }", "cpk = 1.0, lot = { share = 0.5 } }") if lot else text
    path = synthetic.store(tmp_path, text)
    asked = CliRunner().invoke(cli.app, ["status", str(path), "--json"])
    shares = json.loads(asked.stdout)["exceedance"]
    assert len(shares) == 7
    for share in shares:
        assert share["estimate"] is not None
        valid = share["n"] - share["n_failed"] - share["n_unsettled"]
        independent = [float(end) for end in clopper_pearson(share["count"], valid)]
        assert ([share["lower"], share["upper"]] == pytest.approx(independent)) == (not lot)
