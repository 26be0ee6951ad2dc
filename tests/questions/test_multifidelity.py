"""Two fidelities together: coverage over seeds, published allocation, "no gain", two files of the same joints."""

import json
import math

import numpy as np
import pytest
from scipy.stats import norm
from typer.testing import CliRunner

from tests.support import fakes, synthetic
from tolstat import study
from tolstat.analysis import multifidelity as analysis
from tolstat.analysis.multifidelity import Pairs
from tolstat.cli import app
from tolstat.common.errors import InputError
from tolstat.common.tables import RESULT, Fidelity, Simulation, Status
from tolstat.questions.multifidelity import query as multifidelity
from tolstat.store import ResultFile
from tolstat.store.recorded import recall

SEEDS, M, N = 500, 120, 1500
SIGMA = math.hypot(2.2, 0.5)
LEAST = 0.95 - 3.0 * math.sqrt(0.95 * 0.05 / SEEDS)
PLAN = synthetic.STUDY.replace('"fork*.T" = "40 N*m"\n"pin1.contact" = "800 N"\n"psi" = 0.01\n', "")


def drawn(seed):
    """Normal loads of mean 11 that the cheap simulation has with a bias, another scale and some noise."""
    rng = np.random.default_rng(seed)
    z = rng.standard_normal(N)
    return Pairs(11.0 + 2.2 * z[:M] + 0.5 * rng.standard_normal(M), 10.0 + 2.0 * z, 1.0, 0.02)


def test_intervals_cover_over_seeds_and_the_cheap_simulation_alone_does_not():
    covered, naive, narrower = [], [], []
    level = 11.0 + SIGMA
    for seed in range(SEEDS):
        pairs = drawn(seed)
        found = analysis.mean(pairs), analysis.share_above(pairs, level)
        truth = 11.0, norm.sf(1.0)
        covered.append([f.lower <= t <= f.upper for f, t in zip(found, truth, strict=True)])
        narrower.append([(f.upper - f.lower) / (f.alone_upper - f.alone_lower) for f in found])
        half = 1.96 * pairs.low.std() / math.sqrt(N)
        naive.append(abs(pairs.low.mean() - 11.0) <= half)
    assert (np.mean(covered, axis=0) >= LEAST).all()
    assert np.mean(naive) < LEAST
    assert np.mean(narrower, axis=0) == pytest.approx([0.37, 0.66], abs=0.06)


def test_quantiles_cover_over_seeds():
    truth, covered = 11.0 + SIGMA * norm.ppf(0.9), []
    for seed in range(100):
        found = analysis.quantile(drawn(seed), 0.9)
        assert found.lower <= found.estimate <= found.upper
        covered.append(found.lower <= truth <= found.upper)
    assert np.mean(covered) >= 0.95 - 3.0 * math.sqrt(0.95 * 0.05 / 100)


def test_allocation_is_the_published_one_and_meets_the_variance_that_it_promises():
    rng = np.random.default_rng(1)
    z, e = rng.standard_normal((2, 4000))
    high, low = z + 0.3 * e, z
    found = analysis.allocate(high, low, 1.0, 0.01)
    rho = np.corrcoef(high, low)[0, 1]
    assert found.ratio == pytest.approx(math.sqrt(rho**2 / (0.01 * (1 - rho**2))))
    m, n = found.joints(300.0, 1.0, 0.01)
    assert 290 < m + 0.01 * n <= 300
    # variance of the estimate at these numbers, beside that of as many joints as the same cost buys
    variance = (1 - rho**2) / m + rho**2 / n
    assert (1.0 / 300.0) / variance == pytest.approx(found.gain, rel=0.02)


@pytest.mark.parametrize(("noise", "cost"), [(0.01, 1.1), (3.0, 0.3), (0.0, 0.9)])
def test_no_gain_where_there_is_none(noise, cost):
    rng = np.random.default_rng(1)
    z, e = rng.standard_normal((2, 500))
    found = analysis.allocate(z + noise * e, z, 1.0, cost)
    assert found.gain <= 1.0 or (noise, cost) == (0.0, 0.9)
    assert found.ratio == 1.0 or found.gain > 1.0
    assert analysis.allocate(z, np.ones(500), 1.0, 0.01).gain == 1.0


def test_joints_without_a_load_widen_the_ends():
    pairs = drawn(3)
    high = pairs.high.copy()
    high[:6] = np.nan
    lost = analysis.share_above(pairs._replace(high=high), 12.0)
    whole = analysis.share_above(pairs, 12.0)
    assert lost.lower < whole.lower
    assert lost.upper > whole.upper
    assert analysis.share_above(pairs, 40.0).upper > 0.0
    assert np.isnan(analysis.share_above(pairs, 40.0).estimate)
    with pytest.raises(ValueError, match="3 joints with both loads"):
        analysis.mean(pairs._replace(high=high[:9]))


simulated: list[int] = []
stop_at: list[int] = []


def simulate(params, options, histories="none", n_harmonics=0):
    """Loads by a formula; the quasistatic ones lack the part that is dynamic."""
    simulated.append(len(params))
    if len(simulated) in stop_at:
        stop_at.clear()
        raise KeyboardInterrupt
    results = np.zeros(len(params), RESULT)
    results["status"] = Status.OK
    x = params["pin_point"].sum(axis=(1, 2)) * 1e5
    dynamic = 20.0 * np.sin(3.0 * x) if options.fidelity == Fidelity.DYNAMIC else 0.0
    results["F_max"] = (700.0 + 30.0 * x + dynamic)[:, None]
    results["T_max"] = 30.0
    return Simulation(results, {})


@pytest.fixture
def plan(tmp_path, monkeypatch):
    fakes.replace_functions(monkeypatch, **fakes.SOLVER | {"simulate_rows": simulate})
    costs = {"dynamic": 5e-3, "quasistatic": 4e-4}
    monkeypatch.setattr(multifidelity, "_cost", lambda plan: costs[plan.study.solver.fidelity])
    path = tmp_path / "plan.toml"
    path.write_text(PLAN, encoding="utf-8")
    return path


@pytest.mark.slow
def test_two_files_of_the_same_joints_stopped_and_gone_on_with(tmp_path, plan):
    command = ["multifidelity", str(plan), "--out", str(tmp_path), "--budget", "1 s", "--workers", "1", "--json"]
    stop_at.append(9)  # blocks into the joints that come after the pilots
    stopped = CliRunner().invoke(app, command)
    assert stopped.exit_code == 130
    assert "to resume" in stopped.stderr
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.stderr
    said = json.loads(done.stdout)
    assert said["low"] > said["high"] >= 128
    assert said["high"] * 5e-3 + said["low"] * 4e-4 == pytest.approx(1.0, abs=1e-3)
    rows = {(row["load"], row["statistic"]): row for row in said["statistics"]}
    found = rows["cross1.F", "mean"]
    assert found["gain"] > 1.5
    assert found["upper"] - found["lower"] < found["alone_upper"] - found["alone_lower"]
    with ResultFile.open(tmp_path / "plan_high.h5") as high, ResultFile.open(tmp_path / "plan_low.h5") as low:
        np.testing.assert_array_equal(high.errors(), low.errors(slice(0, high.n)))
        assert recall(low).solver.fidelity == "quasistatic"
    simulated.clear()
    assert json.loads(CliRunner().invoke(app, command).stdout) == said
    assert simulated == []


@pytest.mark.slow
def test_progress_names_the_fidelity_and_counts_its_joints(tmp_path, plan):
    seen, names = [], []
    multifidelity.two_fidelities(
        study.load(plan),
        *("quasistatic:36", "dynamic", tmp_path, 0.05),
        pilot=16,
        workers=1,
        tell=lambda _: None,
        stage=names.append,
        progress=lambda c: seen.append((names[-1], c.done, c.total)),
    )
    assert names[:3] == ["high fidelity", "low fidelity", "cost of a joint"]
    assert {("high fidelity", 17, 17), ("low fidelity", 17, 17)} <= set(seen)


def test_every_fault_is_told(tmp_path, plan):
    done = CliRunner().invoke(app, ["multifidelity", str(plan), "--low", "auto", "--high", "dynamic:x"])
    assert done.exit_code == 2
    for part in ("low: 'auto' is not a fidelity", "high: 'dynamic:x' is not a fidelity"):
        assert part in done.stderr
    assert (
        "--budget: '1' is not a time" in CliRunner().invoke(app, ["multifidelity", str(plan), "--budget", "1"]).stderr
    )
    same = CliRunner().invoke(app, ["multifidelity", str(plan), "--low", "dynamic"])
    assert "low: 'dynamic' is the same as 'dynamic'" in same.stderr
    solver = multifidelity.solver_of(study.load(plan), "quasistatic:36", "--low")
    assert (solver.fidelity, solver.steps_per_rev) == ("quasistatic", 36)
    with pytest.raises(InputError, match=r"--by: 'fork1.F' is not a load that the study asks for"):
        multifidelity.two_fidelities(study.load(plan), "quasistatic:36", "dynamic", tmp_path, 1.0, by="fork1.F")
