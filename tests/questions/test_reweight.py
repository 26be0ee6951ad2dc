"""Other tolerances by likelihood ratio: against closed forms, fresh draws, and where it must not be trusted."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.stats import norm
from typer.testing import CliRunner

from tests.support import synthetic
from tolstat import sampling, study
from tolstat.analysis import reweight
from tolstat.cli import app
from tolstat.common.errors import InputError
from tolstat.common.tables import Simulation, Status
from tolstat.questions.reweight import query as campaigns
from tolstat.store import Reader, ResultStore
from tolstat.study.change import changed
from tolstat.study.tolerances.distributions import (
    Beta,
    LogNormal,
    Measured,
    Normal,
    Triangular,
    TruncatedNormal,
    Uniform,
)
from tolstat.study.tolerances.radial import Rayleigh

SEEDS = 600
LEVEL, NARROW = 2.0, 0.8
TRUTH = float(norm.sf(LEVEL / NARROW))


@pytest.mark.parametrize(
    ("own", "theirs"),
    [
        (Normal(1.0, 0.5), norm(1.0, 0.5)),
        (TruncatedNormal(0.0, 1.0, -0.5, 2.0), stats.truncnorm(-0.5, 2.0)),
        (TruncatedNormal(0.0, 1.0, 5.0, 6.0), stats.truncnorm(5.0, 6.0)),
        (Uniform(-1.0, 3.0), stats.uniform(-1.0, 4.0)),
        (Triangular(0.0, 3.0, 1.0), stats.triang(1 / 3, 0.0, 3.0)),
        (Triangular(0.0, 3.0, 3.0), stats.triang(1.0, 0.0, 3.0)),
        (LogNormal(0.2, Normal(-0.3, 0.4)), stats.lognorm(0.4, 0.2, np.exp(-0.3))),
        (Beta(2.0, 1.0, -1.0, 2.0), stats.beta(2.0, 1.0, -1.0, 3.0)),
        (Rayleigh(0.7), stats.rayleigh(scale=0.7)),
    ],
)
def test_densities_are_scipys(own, theirs):
    x = np.concatenate([np.linspace(-3.0, 6.5, 40), [0.0, 1.0, 3.0, 5.0]])
    np.testing.assert_allclose(own.logpdf(x), theirs.logpdf(x), rtol=1e-9)


def test_densities_of_rejected_radii_and_measured_values():
    inside = np.array([0.1, 0.9])
    cut = Rayleigh(0.7, 1.0)
    np.testing.assert_allclose(cut.logpdf(inside), Rayleigh(0.7).logpdf(inside) - np.log(stats.rayleigh.cdf(1 / 0.7)))
    assert cut.logpdf(np.array([1.1, -0.1])).tolist() == [-np.inf, -np.inf]
    np.testing.assert_allclose(np.exp(Measured.of([1, 2, 2, 5]).logpdf(np.array([2.0, 5.0, 3.0]))), [0.5, 0.25, 0.0])


def drawn(n, seeds, seed=1):
    """Standard normal loads, and the logarithm of their density for the deviation `NARROW` over that for 1."""
    x = np.random.default_rng(seed).standard_normal((seeds, n))
    return x, norm.logpdf(x, 0, NARROW) - norm.logpdf(x)


def test_shares_and_quantiles_cover_over_seeds_and_unweighted_variance_does_not():
    covered, naive, q90 = [], [], norm.ppf(0.9) * NARROW
    for x, logs in zip(*drawn(400, SEEDS), strict=True):
        weights = reweight.smooth(logs)
        found = reweight.share_above(x, weights, LEVEL)
        _, low, high = reweight.quantile(x, weights, 0.9)
        covered.append([found.lower <= TRUTH <= found.upper, low <= q90 <= high])
        plain = np.mean(x > LEVEL)  # the joints as drawn, as though they were of the new tolerances
        naive.append(abs(plain - TRUTH) <= 1.96 * np.sqrt(max(plain * (1 - plain), 1 / 400) / 400))
    least = 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / SEEDS)
    assert np.all(np.mean(covered, axis=0) >= least)
    assert np.mean(naive) < least


def test_weights_of_the_same_tolerances_are_equal_and_usable():
    weights = reweight.smooth(np.zeros(200))
    assert weights.values == pytest.approx(1 / 200)
    assert (weights.ess, weights.k, weights.usable) == (pytest.approx(200), -np.inf, True)
    found = reweight.share_above(np.arange(200.0), weights, 179.5)
    assert found.estimate == pytest.approx(0.1)
    assert found.ess == pytest.approx(200)
    assert reweight.quantile(np.arange(200.0), weights, 0.9)[0] == 179.0


def test_verdict_is_against_what_the_joints_cannot_tell():
    x = np.random.default_rng(5).standard_normal((2000, 16))
    # all sixteen errors twice as wide
    wide = reweight.smooth((norm.logpdf(x, 0, 2) - norm.logpdf(x)).sum(axis=1))
    assert wide.k > wide.allowed
    assert not wide.usable
    # two of them a little narrower
    near = reweight.smooth((norm.logpdf(x[:, :2], 0, 0.9) - norm.logpdf(x[:, :2])).sum(axis=1))
    assert near.usable
    assert near.ess > 1500
    assert not reweight.smooth(np.where(np.arange(2000) < 8, 0.0, -np.inf)).usable
    for ratios, text in (([-np.inf] * 3, "none"), ([np.nan, 0.0], "not a number")):
        with pytest.raises(ValueError, match=text):
            reweight.smooth(ratios)


def test_settings_replace_keys_of_the_errors_they_select(tmp_path):
    plan = load(tmp_path)
    found = changed(plan, ["pin*.offset_t.plus_minus=0.05 mm", "pin2.offset_t.cpk = 1.5"])
    assert found["pin1.offset_t"] == Normal(0.0, pytest.approx(5e-5 / 3))
    assert found["pin2.offset_t"] == Normal(0.0, pytest.approx(5e-5 / 4.5))
    general = changed(plan, ["pin1.offset_t.iso2768=m", "pin1.offset_t.nominal=10 mm"] * 2)
    assert general["pin1.offset_t"] == Normal(0.0, pytest.approx(2e-4 / 3))
    assert plan.tolerances["pin1.offset_t"] == Normal(0.0, pytest.approx(1e-4 / 3))


def test_every_fault_of_the_settings_is_told_once(tmp_path):
    bad = ["pin1.tilt_t.cpk=2", "nonsense", "pin[123].offset_t.plus_minus=0.1", "pin4.offset_t.colour=red"]
    with pytest.raises(InputError) as found:
        changed(load(tmp_path), bad)
    text = str(found.value)
    assert "selects no error that has a tolerance" in text
    assert "is not a setting" in text
    assert text.count("0.1 has no unit") == 1
    assert "colour" in text


def load(folder, text=synthetic.STUDY, name="plan"):
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return study.load(path)


CORRELATED = synthetic.STUDY.replace("n = 60", "n = 4000") + (
    '\n[[correlation]]\nbetween = ["pin1.offset_t", "pin2.offset_t"]\nrho = 0.6\n'
)


LIMITS = '"cross1.F" = "700 N"\n"fork*.T" = "40 N*m"\n"pin1.contact" = "800 N"\n"psi" = 0.01\n'


def campaign(folder, text=CORRELATED, name="many"):
    """Campaign whose load cross1.F follows the errors by a formula."""
    path = synthetic.store(folder, text, name, simulated=0)
    from tolstat.common.tables import Simulation

    with ResultStore.open_to_write(path) as store:
        results = synthetic.results(store.n)
        results["F_max"][:, 0] = load_of(store.errors())
        store.write(np.arange(store.n), Simulation(results, None))
    return path


def load_of(errors):
    return 600.0 + 1.5e6 * np.abs(errors["pin1.offset_t"] + errors["pin2.offset_t"])


def test_reweighted_campaign_agrees_with_a_fresh_one(tmp_path):
    path = campaign(tmp_path)
    settings = ["pin[12].offset_t.plus_minus=0.08 mm"]
    with Reader.open(path) as store:
        found = campaigns.reweighted(store.view(), settings)
    plan = load(tmp_path, CORRELATED.replace("n = 4000", "n = 40000").replace("seed = 2021", "seed = 5"))
    fresh = load_of(sampling.draw(replace(plan, tolerances=changed(plan, settings)))[1:])
    row = found.table.set_index("load").loc["cross1.F"]
    assert found.weights.usable
    assert found.changed == ["pin1.offset_t", "pin2.offset_t"]
    assert row["lower"] <= np.mean(fresh > 700.0) <= row["upper"]
    assert not row["lower"] <= row["before"] <= row["upper"]
    assert row["bound_lower"] == pytest.approx(row["estimate"])


def test_errors_where_no_joint_was_drawn_need_new_runs(tmp_path):
    path = campaign(tmp_path, synthetic.STUDY.replace('"normal", cpk = 1.0', '"uniform"'), "band")
    with Reader.open(path) as store:
        with pytest.raises(InputError, match=r"0\.17 of the new errors lie where the study draws none") as found:
            campaigns.reweighted(store.view(), ["pin*.offset_t.plus_minus=0.12 mm"])
        assert len(found.value.faults) == 4
        campaigns.reweighted(store.view(), ["pin*.offset_t.plus_minus=0.08 mm"])


def test_command_prints_a_table_and_json(tmp_path):
    path = campaign(tmp_path)
    command = ["reweight", str(path), "--set", "pin1.offset_t.plus_minus=0.09 mm"]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0
    assert done.stdout.splitlines()[1].startswith("cross1.F")
    assert "1 errors changed; 4000 joints count as" in done.stderr
    found = json.loads(CliRunner().invoke(app, [*command, "--json"]).stdout)
    assert found["usable"] is True
    assert found["loads"][0]["estimate"] < found["loads"][0]["before"]
    refused = CliRunner().invoke(app, ["reweight", str(path), "--set", "pin9.offset_t.cpk=1"])
    assert refused.exit_code == 2
    assert "selects no error" in refused.stderr


def test_a_campaign_without_a_valid_load_is_refused(tmp_path):
    path = campaign(tmp_path)
    with ResultStore.open_to_write(path) as store:
        results = store.results()
        results["status"] = Status.NEWTON_FAILED
        store.write(np.arange(store.n), Simulation(results, {}))
    done = CliRunner().invoke(app, ["reweight", str(path), "--set", "pin1.offset_t.plus_minus=0.09 mm"])
    assert done.exit_code == 2
    assert "holds no joint with a valid load: cross1.F" in done.stderr
    assert f"hint: see why: tolstat status {path}" in done.stderr
    assert done.stdout == ""


def test_a_study_without_limits_has_quantiles(tmp_path):
    path = campaign(tmp_path, CORRELATED.replace("[limits]", "[errors]").replace(LIMITS, ""), "free")
    with Reader.open(path) as store:
        found = campaigns.reweighted(store.view(), ["pin1.offset_t.plus_minus=0.08 mm"])
    row = found.table.query("load == 'cross1.F' and share == 0.9").iloc[0]
    assert row["lower"] <= row["estimate"] <= row["upper"] < row["before"] + 20.0
    assert row["estimate"] < row["before"]


def test_a_table_that_needs_new_runs_has_no_estimates(tmp_path):
    text = synthetic.STUDY.replace("n = 60", "n = 400")
    path = campaign(tmp_path, text, "few")
    with Reader.open(path) as store:
        found = campaigns.reweighted(store.view(), ["pin*.offset_t.plus_minus=0.01 mm"])
    assert not found.weights.usable
    assert found.table[["estimate", "lower", "upper", "bound_lower", "bound_upper"]].isna().all(axis=None)
    assert found.table["before"].notna().all()
    assert found.verdict.startswith("needs new runs, no estimates: ")
