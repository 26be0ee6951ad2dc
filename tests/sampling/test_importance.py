"""Importance sampling: what is drawn, what it weighs, and shares of one in a million against known answers."""

import json

import h5py
import numpy as np
import pytest
from scipy.stats import norm
from typer.testing import CliRunner

import tolstat
from tests.cli.test_cli import simulate
from tests.support import exceedance, fakes, synthetic
from tolstat import sampling, study
from tolstat.analysis import binomial
from tolstat.analysis.sample import Sample
from tolstat.analysis.weighted import Weighted
from tolstat.campaign import extend
from tolstat.cli import app
from tolstat.common.errors import InputError, StoreError
from tolstat.common.tables import Simulation, Status
from tolstat.questions.exceedance import answer as exceeded
from tolstat.questions.reweight import reweight
from tolstat.report import headline
from tolstat.store import ResultFile, Writer
from tolstat.study.proposal import Proposal, component, weights

SEEDS = 500
BETA = 4.75

PLAN = (
    synthetic.WHOLE.replace("[sampling]\nn = 60", '[sampling]\nmethod = "importance"\nn = 4000')
    + """
[[proposal]]
share = 0.5
widen = { "pin[12].offset_t" = 1.7 }
shift = { "pin3.offset_t" = -1.0 }

[[proposal]]
share = 0.25
widen = 1.2
"""
)
CORRELATED = '\n[[correlation]]\nbetween = ["pin1.offset_t", "pin2.offset_t"]\nrho = 0.6\n'


def load(folder, text=PLAN, name="plan", **kwargs):
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return study.load(path, **kwargs)


def weight_of(plan, rows=None):
    blocks = sampling.origin_blocks(plan, range(plan.rows) if rows is None else rows)
    return np.concatenate(list(blocks))


def test_a_joint_depends_on_its_number_only_and_is_the_random_one_where_no_proposal_made_it(tmp_path):
    plan = load(tmp_path)
    errors, origin = sampling.draw(plan), weight_of(plan)
    np.testing.assert_array_equal(errors[:50], sampling.draw(load(tmp_path, n=49)))
    np.testing.assert_array_equal(errors[70:90], sampling.draw(plan, range(70, 90)))
    np.testing.assert_array_equal(origin[70:90], weight_of(plan, range(70, 90)))
    assert origin[0].tolist() == (-1, 0.0)
    plain = sampling.draw(load(tmp_path, synthetic.STUDY.replace("n = 60", "n = 4000")))
    own = origin["component"] <= 0
    np.testing.assert_array_equal(errors[own], plain[own])
    assert np.bincount(origin["component"][1:]) / 4000 == pytest.approx([0.25, 0.5, 0.25], abs=0.03)
    third = errors["pin3.offset_t"][origin["component"] == 1] * 3e4
    assert (third.mean(), third.std()) == (pytest.approx(-1.0, abs=0.1), pytest.approx(1.0, abs=0.1))


def test_weights_are_ratios_of_the_densities_of_the_errors(tmp_path):
    plan = load(tmp_path)
    errors, w = sampling.draw(plan)[1:], weight_of(plan)["weight"][1:]
    x = {name: errors[name] * 3e4 for name in plan.tolerances}
    tolerances = np.prod([norm.pdf(v) for v in x.values()], axis=0)
    first = np.prod([norm.pdf(x[n], m, s) for n, m, s in zip(x, (0, 0, -1, 0), (1.7, 1.7, 1, 1), strict=True)], axis=0)
    second = np.prod([norm.pdf(v, 0, 1.2) for v in x.values()], axis=0)
    mixture = 0.25 * tolerances + 0.5 * first + 0.25 * second
    np.testing.assert_allclose(w, tolerances / mixture, rtol=1e-6)
    assert w.max() < 4.0


@pytest.mark.parametrize(
    "entry",
    ['distribution = "uniform"', 'distribution = "triangular"', 'distribution = "normal", cpk = 0.5, truncate = true'],
)
def test_weighted_moments_are_those_of_the_tolerances(tmp_path, entry):
    text = PLAN.replace('distribution = "normal", cpk = 1.0', entry).replace("n = 4000", "n = 40000") + CORRELATED
    drawn = load(tmp_path, text)
    errors, w = sampling.draw(drawn)[1:], weight_of(drawn)["weight"][1:]
    assert w.mean() == pytest.approx(1.0, abs=5 * w.std() / 200)
    exact = load(tmp_path, text.replace('"importance"', '"random"').partition("[[proposal]]")[0] + CORRELATED)
    truth = sampling.draw(exact)[1:]
    a, b = "pin1.offset_t", "pin2.offset_t"
    for moment in (lambda e: e[a] ** 2, lambda e: e[a] * e[b], lambda e: e["pin3.offset_t"]):
        scale = np.sqrt((moment(truth) ** 2).mean())
        assert (w * moment(errors)).mean() == pytest.approx(moment(truth).mean(), abs=0.04 * scale)


def linear_limit_state(seed, n, dimensions=8):
    """Sum of standard normal errors, drawn about its design point but for a tenth, and the weights."""
    rng = np.random.default_rng(seed)
    unit = dimensions**-0.5
    proposals = [Proposal(0.9, {f"x{i}": (BETA * unit, 1.0) for i in range(dimensions)})]
    z = rng.standard_normal((n, dimensions))
    z[component(proposals, rng.random(n)) == 1] += BETA * unit
    return z.sum(axis=1) * unit, weights(proposals, {f"x{i}": column for i, column in enumerate(z.T)})


def test_one_in_a_million_is_covered_over_seeds_and_unweighted_it_is_not():
    truth, covered, naive, estimates = norm.sf(BETA), [], [], []
    for seed in range(SEEDS):
        g, w = linear_limit_state(seed, 500)
        found = exceedance.weighted_exceedance(g, np.full(500, Status.OK), w, BETA)
        covered.append(found.lower <= truth <= found.upper)
        estimates.append(found.estimate)
        plain = exceedance.exceedance(g, np.full(500, Status.OK), BETA)
        naive.append(plain.lower <= truth <= plain.upper)
    least = 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / SEEDS)
    assert np.mean(covered) >= least
    assert np.mean(naive) < least
    assert np.mean(estimates) == pytest.approx(truth, rel=0.03)


def test_equal_weights_give_what_joints_that_count_alike_give():
    rng = np.random.default_rng(3)
    values, status = rng.gamma(2.0, 1.0, 300), np.ones(300, int)
    status[[5, 9, 17]] = Status.NOT_SETTLED, Status.NEWTON_FAILED, Status.PENDING
    levels = [-1.0, 0.3, 2.0, 30.0]
    own, theirs = (Sample.of(values, status, design).curve(levels) for design in (Weighted(np.ones(300)), None))
    for name in theirs.dtype.names:
        np.testing.assert_allclose(own[name], theirs[name], atol=1e-12, err_msg=name)
    # a level that no joint is above: a joint as heavy as the heaviest could have been
    heavy = np.where(np.arange(300) == 0, 20.0, 1.0)
    assert exceedance.weighted_exceedance(values, status, heavy, 30.0).upper > 15 * theirs["upper"][-1]
    assert Sample.of(values, status, Weighted(heavy)).doubt(30.0)
    assert not Sample.of(values, status, Weighted(np.ones(300))).doubt(1.0)


def run(*given, **choices):
    """Run a campaign with a stand-in for the solver."""
    with pytest.MonkeyPatch.context() as patch:
        fakes.replace_functions(patch, **fakes.SOLVER | {"simulate_rows": simulate})
        tolstat.run(*given, workers=1, check=False, **choices)


def campaign(folder, text=PLAN, name="plan", n=None):
    """Campaign whose load cross1.F is a sum of its errors, in sigma."""
    plan, path = load(folder, text, name, n=n), folder / f"{name}.h5"
    run(plan, path)
    with Writer.open(path) as store:
        results = synthetic.results(store.n)
        results["F_max"][:, 0] = 700.0 + 100.0 * (3e4 * (store.errors()["pin1.offset_t"]) - 3.0)
        store.write(np.arange(store.n), Simulation(results, {}))
    return path


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    return campaign(tmp_path_factory.mktemp("importance"))


def test_the_file_keeps_weights_and_reports_go_by_them(stored):
    with ResultFile.open(stored) as store:
        view = store.view()
        found = view.load("cross1.F").above(700.0)
        frame = store.to_pandas()
        shares = reweight(view, ["pin4.offset_t.plus_minus=0.09 mm"]).tables["loads"].rows[0]
    assert found.lower < norm.sf(3.0) < found.upper
    assert found.upper < 2.0 * norm.sf(3.0)
    assert frame["weight"].iloc[1:].mean() == pytest.approx(1.0, abs=0.05)
    assert shares["lower"] < norm.sf(3.0) < shares["upper"]
    done = CliRunner().invoke(app, ["status", "--json", str(stored)])
    assert json.loads(done.stdout)["exceedance"][0]["estimate"] == pytest.approx(found.estimate, rel=1e-2)


def test_shares_of_contact_modes_count_joints_by_their_weights(tmp_path):
    path = synthetic.store(tmp_path, PLAN.replace("n = 4000", "n = 400"), "small", failed=20)
    shares = np.random.default_rng(2).dirichlet(np.ones(4), (401, 4))
    with Writer.open(path) as store:
        results = store.results()
        results["mode_share"] = shares
        store.write(np.arange(store.n), Simulation(results, {}))
        weights = store.origin()["weight"][1:381]
    with ResultFile.open(path) as store:
        found = store.view().mode_share
    np.testing.assert_allclose(found, np.average(shares[1:381], axis=0, weights=weights), rtol=1e-12)


def test_statistics_that_count_joints_alike_are_refused(stored):
    for command in ("capability", "causes"):
        done = CliRunner().invoke(app, [command, str(stored)])
        assert done.exit_code == 2
        assert "importance sampling" in done.stderr


@pytest.mark.slow
def test_slices_and_extensions_have_the_weights_of_one_run(tmp_path, stored):
    few = campaign(tmp_path, name="few", n=1000)
    extend.extend(few, 1200)
    with ResultFile.open(stored) as whole, ResultFile.open(few) as grown:
        np.testing.assert_array_equal(grown.origin(), whole.origin(slice(0, 1201)))
    parts = []
    for rows in (range(600), range(600, 1201)):
        parts.append(tmp_path / f"part{rows.start}.h5")
        run(load(tmp_path, n=1200), parts[-1], rows=rows)
    extend.merge(parts, tmp_path / "merged.h5")
    with ResultFile.open(stored) as whole, ResultFile.open(tmp_path / "merged.h5") as merged:
        np.testing.assert_array_equal(merged.origin(), whole.origin(slice(0, 1201)))
    with h5py.File(parts[0], "r+") as file:
        file["origin/weight"][7] *= 2.0
    with (
        ResultFile.open(parts[0]) as store,
        pytest.raises(StoreError, match="origin/weight of rows 0:600 does not match"),
    ):
        store.origin()


def test_every_fault_of_the_proposals_is_told(tmp_path):
    bad = PLAN.replace('"pin[12].offset_t" = 1.7', '"pin[12].offset_t" = 0, "hole1.tilt_t" = 2').replace("0.25", "0.49")
    with pytest.raises(InputError) as found:
        load(tmp_path, bad)
    text = str(found.value)
    for part in ("0 is not a valid widen", "proposal[0].widen.hole1.tilt_t: has no tolerance"):
        assert part in text
    with pytest.raises(InputError, match=r"leave 0\.01 of the joints"):
        load(tmp_path, PLAN.replace("0.25", "0.49"))
    with pytest.raises(InputError, match="proposal: has no effect with 'random'"):
        load(tmp_path, PLAN.replace('method = "importance"', ""))
    with pytest.raises(InputError, match="does not differ from the tolerances"):
        load(tmp_path, PLAN.replace("widen = 1.2", ""))
    with pytest.raises(InputError, match="proposal: missing table"):
        load(tmp_path, PLAN.partition("[[proposal]]")[0])


def two_ways(seeds, n, beta=3.0):
    """Loads of joints of which the proposals know one of two equally probable ways to the limit `beta`, and weights.

    The ways are errors 0 and 1; a fifth of the joints is drawn from the tolerances, the others with error 0 shifted.
    """
    rng = np.random.default_rng(seeds)
    own = rng.random((seeds, n)) < 0.2
    x = rng.standard_normal((2, seeds, n))
    x[0] += np.where(own, 0.0, beta)
    weight = 1.0 / (0.2 + 0.8 * np.exp(beta * x[0] - 0.5 * beta**2))
    return np.maximum(x[0], x[1]), weight, own


def loads_of(values, w, own):
    status = np.full(values.size, Status.OK)
    return Sample.of(values, status, Weighted(w, 5.0, own))


def test_an_upper_end_covers_a_way_that_the_proposals_do_not_know_and_that_of_the_weights_does_not():
    truth = 1.0 - norm.cdf(3.0) ** 2
    values, weight, own = two_ways(400, 400)
    made = [loads_of(*one) for one in zip(values, weight, own, strict=True)]
    found = [(load.above(3.0).upper >= truth, load.upper_if_missed(3.0) >= truth, not load.doubt(3.0)) for load in made]
    of_weights, whatever, supported = np.mean(found, axis=0)
    assert supported > 0.8  # the weights look as if all were well
    assert of_weights < 0.8
    assert whatever >= 0.975 - 3.0 * np.sqrt(0.975 * 0.025 / 400)


def test_a_verdict_is_kept_only_if_nothing_that_is_missed_could_change_it():
    row = dict.fromkeys(("total_lower", "total_upper"), np.nan) | {"outer_lower": 0.0, "outer_upper": 0.001}
    row |= {"n": 1000, "bound_lower": 0.0, "bound_upper": 0.0, "unsearched_upper": 0.02}
    assert [headline.verdict(row, share) for share in (0.0005, 0.01, 0.05)] == ["open", "searched", "yes"]
    assert headline.verdict(row | {"unsearched_upper": np.nan}, 0.01) == "yes"


def test_joints_without_a_load_count_above_for_the_end_whatever_the_proposals_miss(tmp_path):
    path = synthetic.store(tmp_path, PLAN.replace("n = 4000", "n = 400"), "small", failed=60, unsettled=20)
    with ResultFile.open(path) as store:
        row = exceeded.exceedance(store.view()).frame("limits").iloc[0]
        own, results = store.origin()["component"][1:] == 0, store.results()[1:]
    lost = results["status"] != Status.OK
    count = ((results["F_max"][:, 0] > 700.0) | lost)[own].sum()
    assert (own & lost).sum() > 10
    assert row["unsearched_upper"] == pytest.approx(binomial.clopper_pearson(count, own.sum())[1])


@pytest.mark.slow
def test_the_report_of_importance_sampling_has_both_ends(stored):
    with ResultFile.open(stored) as store:
        row = exceeded.exceedance(store.view()).frame("limits").iloc[0]
        own = store.origin()["component"][1:] == 0
        count = (store.results()["F_max"][1:, 0][own] > 700.0).sum()
    assert row["unsearched_upper"] == pytest.approx(binomial.clopper_pearson(count, own.sum())[1])
    assert row["unsearched_upper"] > row["upper"]
    done = CliRunner().invoke(app, ["report", str(stored), "--wide", "--out", str(stored.parent)])
    assert done.exit_code == 0, done.output
    assert "at most, if ways are missed" in done.output
