"""Other tolerances by likelihood ratio: against closed forms, fresh draws, and where it must not be trusted."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.stats import norm
from typer.testing import CliRunner

from tests.support import exceedance, synthetic
from tolstat import sampling, study
from tolstat.analysis import binomial, reweight, weighted
from tolstat.analysis.reweight import Ratios
from tolstat.analysis.sample import Sample
from tolstat.cli import app
from tolstat.common.errors import InputError
from tolstat.common.tables import Simulation, Status
from tolstat.display.answer import Document, Sentence
from tolstat.questions import reweight as question
from tolstat.store import ResultFile, Writer
from tolstat.study.scaling import changed, rewritten_with
from tolstat.study.tolerances import density_ratio
from tolstat.study.tolerances.distributions import Normal

ERRORS, SEEDS = 10, 300


def ratios_of(x, factor):
    """Density ratios of ten standard normal errors, (n, ERRORS), for deviations `factor` times as large."""
    exact = density_ratio.exact([(Normal(0.0, factor), Normal(0.0, 1.0))] * ERRORS)
    logs = 0.5 * (1.0 - factor**-2) * (x**2).sum(axis=1) - ERRORS * np.log(factor)
    return Ratios(np.exp(logs), exact.mean_square, exact.unbounded, float(np.exp(exact.largest)))


def misses(factor, n=1024, share=0.05):
    """Share of seeds whose number is usable; of these, shares whose interval is above the truth, and below it."""
    level, rng = norm.isf(share) * factor * np.sqrt(ERRORS), np.random.default_rng(1)
    found, plain = [], []
    for _ in range(SEEDS):
        x = rng.standard_normal((n, ERRORS))
        ratios, loads = ratios_of(x, factor), x.sum(axis=1)
        own = reweight.share_above(Sample.of(loads, np.ones(n, int)), ratios, level)
        found.append([own.support.usable, own.lower > share, own.upper < share, own.upper - own.lower])
        drawn = exceedance.exceedance(loads, np.ones(n, int), level)  # as though they were of the new tolerances
        plain.append(drawn.lower <= share <= drawn.upper)
    usable, above, below, width = np.array(found, dtype=float).T
    fresh = np.subtract(*binomial.clopper_pearson(share * n, n)[::-1])
    some = usable > 0
    return usable.mean(), above[some].mean(), below[some].mean(), width[some].mean() / fresh, np.mean(plain)


@pytest.mark.parametrize("factor", [0.8, 1.1])
@pytest.mark.slow
def test_shares_cover_over_seeds_and_unweighted_ones_do_not(factor):
    usable, above, below, width, unweighted = misses(factor)
    slack = 3.0 * np.sqrt(0.025 * 0.975 / SEEDS)
    assert usable >= 0.9
    assert max(above, below) <= 0.025 + slack
    assert width <= 1.5
    assert unweighted < 0.5


@pytest.mark.slow
def test_quantiles_cover_over_seeds():
    truth, missed, rng = norm.ppf(0.9) * 1.1 * np.sqrt(ERRORS), [], np.random.default_rng(2)
    for _ in range(SEEDS):
        x = rng.standard_normal((1024, ERRORS))
        ratios = ratios_of(x, 1.1)
        found = reweight.quantile(Sample.of(x.sum(axis=1), np.ones(1024, int)), ratios, 0.9)
        missed += [[found.lower > truth, found.upper < truth]] * found.usable
    assert len(missed) >= 0.9 * SEEDS
    assert np.mean(missed, axis=0).max() <= 0.025 + 3.0 * np.sqrt(0.025 * 0.975 / SEEDS)


def test_shares_of_the_same_tolerances_are_those_of_the_joints():
    ratios, loads = Ratios(np.ones(200), heaviest=1.0), np.arange(200.0)
    sample = Sample.of(loads, np.ones(200, int))
    for level in (179.5, 199.5, -1.0):  # twenty joints, none and all above
        found, plain = (
            reweight.share_above(sample, ratios, level),
            exceedance.exceedance(loads, np.ones(200, int), level),
        )
        assert found[:3] == pytest.approx((plain.estimate, plain.lower, plain.upper))
        assert found.support.usable
    assert reweight.quantile(sample, ratios, 0.9)[0] == 179.0


def test_wider_tolerances_are_refused_however_many_joints_happen_to_be_above():
    x = np.random.default_rng(5).standard_normal((4096, ERRORS))
    wide, loads = ratios_of(x, 1.3), x.sum(axis=1)
    assert wide.effective > reweight.LEAST_ESS  # 162 of 4096 joints, and yet a few decide
    found = reweight.share_above(Sample.of(loads, np.ones(4096, int)), wide, 0.0)
    assert min(found.support.above, found.support.below) > 20
    assert not found.support.usable


@pytest.mark.parametrize(("mean_square", "needed"), [(1.5, 50), (2.0, 50), (4.0, 100), (8.0, 200)])
def test_the_more_ratios_scatter_the_more_effective_joints_are_needed(mean_square, needed):
    for effective, usable in ((needed - 1, False), (needed + 1, True)):
        ratios = Ratios(np.ones(round(effective * mean_square)), np.log(mean_square), heaviest=100.0)
        assert ratios.usable == usable


def test_a_level_that_no_joint_is_above_needs_a_bound_of_the_ratio():
    x = np.random.default_rng(6).standard_normal((1024, ERRORS))
    level, status = x.sum(axis=1).max(), np.ones(1024, int)
    for factor, usable in ((1.1, False), (0.8, True)):
        ratios = ratios_of(x, factor)
        found = reweight.share_above(Sample.of(x.sum(axis=1), status), ratios, level)
        assert (found.estimate, found.lower, found.support.usable) == (0.0, 0.0, usable)
    # the joint that could have been drawn has the weight of the middle of all tolerances
    assert found.upper > 0.9 * binomial.clopper_pearson(0, 1024 / 0.8**-ERRORS)[1]


def test_an_end_of_a_quantile_beyond_the_joints_is_refused():
    x = np.random.default_rng(7).standard_normal((1024, ERRORS))
    ratios = ratios_of(x, 1.1)
    sample = Sample.of(x.sum(axis=1), np.ones(1024, int))
    assert reweight.quantile(sample, ratios, 0.9).usable
    far = reweight.quantile(sample, ratios, 0.98)
    assert reweight.support(sample, ratios, far.estimate).above >= reweight.LEAST_BESIDE
    assert not far.usable  # fewer than ten effective joints are above the upper end


def test_lower_ends_are_those_of_shares_that_are_given():
    """Ten or more of 1000 joints: the lower end is where as many as found have 2.5 % of the probability of these."""
    for count in (12, 40):
        split = weighted.Split.by(np.arange(1000) < count, np.ones(1000))
        lower = split.interval(0.95, 10.0)[0][0]
        given = stats.binom.sf(count - 1, 1000, lower) / stats.binom.sf(9, 1000, lower)
        assert given == pytest.approx(0.025, rel=1e-6)
        assert lower < binomial.clopper_pearson(count, 1000)[0]


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


FIT = 'fit = { basic = "76 mm", code = "H7/f7", distribution = "normal", cpk = 1.0 }'
LIMITS = '"cross1.F" = "700 N"\n"fork*.T" = "40 N*m"\n"pin1.contact" = "800 N"\n"psi" = 0.01\n'


def campaign(folder, text=CORRELATED, name="many"):
    """Campaign whose load cross1.F follows the errors by a formula."""
    path = synthetic.store(folder, text, name, simulated=0)
    from tolstat.common.tables import Simulation

    with Writer.open(path) as store:
        results = synthetic.results(store.n)
        results["F_max"][:, 0] = load_of(store.errors())
        store.write(np.arange(store.n), Simulation(results, {}))
    return path


def load_of(errors):
    return 600.0 + 1.5e6 * np.abs(errors["pin1.offset_t"] + errors["pin2.offset_t"])


def test_reweighted_campaign_agrees_with_a_fresh_one(tmp_path):
    path = campaign(tmp_path)
    settings = ["pin[12].offset_t.plus_minus=0.08 mm"]
    with ResultFile.open(path) as store:
        found = question.reweight(store.view(), settings)
    plan = load(tmp_path, CORRELATED.replace("n = 4000", "n = 40000").replace("seed = 2021", "seed = 5"))
    fresh = load_of(sampling.draw(replace(plan, tolerances=changed(plan, settings)))[1:])
    row = found.frame("loads").set_index("load").loc["cross1.F"]
    assert row["usable"]
    assert found.facts["changed"] == ["pin1.offset_t", "pin2.offset_t"]
    assert row["lower"] <= np.mean(fresh > 700.0) <= row["upper"]
    assert not row["lower"] <= row["before"] <= row["upper"]
    assert row["bound_lower"] == pytest.approx(row["estimate"])


def test_a_law_of_scipy_is_reweighted_as_ours_is(tmp_path):
    """The same joints and shares with a normal law of scipy and with ours: weights by its density."""
    ours = campaign(tmp_path, synthetic.STUDY.replace("n = 60", "n = 4000"))
    band = 'plus_minus = "0.1 mm", distribution = "normal", cpk = 1.0'
    law = 'distribution = "scipy:norm(scale=0.03333333333333333)", unit = "mm"'
    theirs = campaign(tmp_path, synthetic.STUDY.replace("n = 60", "n = 4000").replace(band, law), "theirs")
    rows = []
    for path, setting in ((ours, "plus_minus=0.09 mm"), (theirs, "distribution=scipy:norm(scale=0.03)")):
        with ResultFile.open(path) as store:
            rows.append(question.reweight(store.view(), [f"pin[12].offset_t.{setting}"]).frame("loads"))
    names = ["before", "estimate", "lower", "upper"]
    np.testing.assert_allclose(rows[0][names], rows[1][names], rtol=1e-6)


def test_errors_where_no_joint_was_drawn_need_new_runs(tmp_path):
    path = campaign(tmp_path, synthetic.STUDY.replace('"normal", cpk = 1.0', '"uniform"'), "band")
    with ResultFile.open(path) as store:
        with pytest.raises(InputError, match=r"0\.17 of the new errors lie where the study draws none") as found:
            question.reweight(store.view(), ["pin*.offset_t.plus_minus=0.12 mm"])
        assert len(found.value.faults) == 4
        question.reweight(store.view(), ["pin*.offset_t.plus_minus=0.08 mm"])


def test_command_prints_a_table_and_json(tmp_path):
    path = campaign(tmp_path)
    command = ["reweight", str(path), "--set", "pin1.offset_t.plus_minus=0.09 mm"]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0
    assert done.stdout.splitlines()[1].startswith("cross1.F")
    assert "1 errors changed; 4000 joints count as" in done.stderr
    found = json.loads(CliRunner().invoke(app, [*command, "--json"]).stdout)
    assert found["tables"]["loads"]["rows"][0]["usable"] is True
    assert found["tables"]["loads"]["rows"][0]["estimate"] < found["tables"]["loads"]["rows"][0]["before"]
    refused = CliRunner().invoke(app, ["reweight", str(path), "--set", "pin9.offset_t.cpk=1"])
    assert refused.exit_code == 2
    assert "selects no error" in refused.stderr


def test_a_campaign_without_a_valid_load_is_refused(tmp_path):
    path = campaign(tmp_path)
    with Writer.open(path) as store:
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
    with ResultFile.open(path) as store:
        found = question.reweight(store.view(), ["pin1.offset_t.plus_minus=0.08 mm"])
    row = found.frame("loads").query("load == 'cross1.F' and share == 0.9").iloc[0]
    assert row["lower"] <= row["estimate"] <= row["upper"] < row["before"] + 20.0
    assert row["estimate"] < row["before"]


def test_a_table_that_needs_new_runs_has_no_estimates(tmp_path):
    text = synthetic.STUDY.replace("n = 60", "n = 400")
    path = campaign(tmp_path, text, "few")
    with ResultFile.open(path) as store:
        found = question.reweight(store.view(), ["pin*.offset_t.plus_minus=0.01 mm"])
    table = found.frame("loads")
    assert not found.facts["usable"]
    assert table[["estimate", "lower", "upper", "bound_lower", "bound_upper"]].isna().all(axis=None)
    assert table["before"].notna().all()
    assert found.facts["verdict"].startswith("needs new runs, no estimates: ")
    remedy = f'tolstat reweight {path} --set "pin*.offset_t.plus_minus=0.01 mm" --out changed'
    last = [part.text for part in found.parts if isinstance(part, Sentence)][-1]
    assert last == f"fresh joints, same seeds: {remedy} && tolstat run changed/few_reweight.toml"
    assert [part for part in found.parts if isinstance(part, Document)]


def test_the_study_with_the_changes_is_written_where_the_remedy_says(tmp_path):
    path, setting = campaign(tmp_path), "pin1.offset_t.plus_minus=0.09 mm"
    done = CliRunner().invoke(app, ["reweight", str(path), "--set", setting, "--out", str(tmp_path / "changed")])
    assert done.exit_code == 0
    names = [f"many_reweight{end}" for end in (".toml", "_loads.csv")]
    assert sorted(file.name for file in (tmp_path / "changed").iterdir()) == names
    assert f"wrote {tmp_path / 'changed' / names[0]}" in done.stderr
    new = study.load(tmp_path / "changed" / names[0])
    assert new.tolerances == changed(study.load(tmp_path / "many.toml"), [setting])


@pytest.mark.parametrize(
    "setting", ["pin1.offset_t.plus_minus=0.09 mm", "pin*.offset_t.plus_minus=0.09 mm", "pin[12].offset_t.cpk=2"]
)
def test_the_study_written_has_the_changed_tolerances_and_the_same_seed(tmp_path, setting):
    old = load(tmp_path)
    new = load(tmp_path, rewritten_with(old, [setting]), "new")
    assert new.tolerances == changed(old, [setting])
    assert (new.sampling, new.limits) == (old.sampling, old.limits)
    fresh, drawn = sampling.draw(new), sampling.draw(old)
    ratio = new.tolerances["pin1.offset_t"].sigma / old.tolerances["pin1.offset_t"].sigma
    np.testing.assert_allclose(fresh["pin1.offset_t"], ratio * drawn["pin1.offset_t"])


def test_the_study_written_parts_a_fit(tmp_path):
    text = synthetic.STUDY.replace("[tolerances]", "[tolerances]\n" + f"{FIT}")
    old = load(tmp_path, text)
    new = load(tmp_path, rewritten_with(old, ["hole1.diameter.plus_minus=5 um"]), "new")
    assert new.tolerances == changed(old, ["hole1.diameter.plus_minus=5 um"])
    assert new.joint.contact == old.joint.contact
