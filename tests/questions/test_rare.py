"""Subset simulation against known probabilities; in a campaign: the same numbers stopped or not, in blocks or not."""

import json
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.stats import norm
from typer.testing import CliRunner

import tolstat
from tests.campaign.test_campaign import datasets
from tests.support import fakes, synthetic
from tolstat import sampling, study
from tolstat.analysis import subset
from tolstat.analysis.subset import Walk
from tolstat.campaign import run as campaign
from tolstat.campaign import subset as simulation
from tolstat.campaign.work import Work
from tolstat.cli import app
from tolstat.common.cardan import CARDAN
from tolstat.common.errors import InputError, StoreError
from tolstat.common.tables import Simulation, Status, tables
from tolstat.display.answer import Sentence
from tolstat.questions import rare as module
from tolstat.questions.rare import rare, seed_row
from tolstat.store import ResultFile, Writer, metadata
from tolstat.store.recorded import recall

SEEDS = 500
RHO = 0.6
PLAN = synthetic.WHOLE.replace("[limits]", "[output]\nresults = ['cross*.F_max']\n[limits]").replace(
    '"fork*.T" = "40 N*m"\n"pin1.contact" = "800 N"\n"psi" = 0.01\n', ""
) + (f'\n[[correlation]]\nbetween = ["pin1.offset_t", "pin2.offset_t"]\nrho = {RHO}\n')
FAILING = -2.0
SIGMA = np.sqrt(4.0 + 2.0 * RHO)
"""Standard deviation of the sum of the study's four errors, in sigma of one."""


def walk_of(load, n, limit, seed, dimensions=6):
    streams = {}

    def noise(level, first, count):
        stream = streams.setdefault(level, np.random.default_rng([seed, level]))
        return stream.standard_normal((count, dimensions))

    walk = Walk(n, 0.1, limit, noise)
    while not walk.done:
        walk.take(load(walk.next.scores))
    return walk


def linear(z):
    return z.sum(axis=1) / np.sqrt(z.shape[1])


def four_branches(z):
    return np.maximum(np.abs(z[:, 0] + z[:, 1]), np.abs(z[:, 0] - z[:, 1])) / np.sqrt(2.0)


@pytest.mark.parametrize(
    ("load", "limit", "truth"),
    [(linear, 4.75, norm.sf(4.75)), (four_branches, 4.0, 4 * norm.sf(4.0) - 4 * norm.sf(4.0) ** 2)],
)
@pytest.mark.slow
def test_intervals_cover_over_seeds_and_those_of_independent_states_do_not(load, limit, truth):
    covered, naive, estimates = [], [], []
    for seed in range(SEEDS):
        walk = walk_of(load, 1000, limit, seed)
        found = walk.estimate()
        covered.append(found.lower <= truth <= found.upper)
        deviation = np.sqrt(sum((1 - level.share) / (1000 * level.share) for level in walk.levels))
        naive.append(abs(np.log(found.probability / truth)) <= 1.96 * deviation)
        estimates.append(found.probability)
    least = 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / SEEDS)
    assert np.mean(covered) >= least
    assert np.mean(naive) < least
    assert np.mean(estimates) == pytest.approx(truth, rel=0.08)


def test_intervals_of_few_joints_are_centred_at_the_truth_though_the_logarithm_is_biased_low():
    truth, found = norm.sf(4.0), [walk_of(linear, 200, 4.0, seed).estimate() for seed in range(300)]
    centre = np.array([0.5 * np.log(one.lower * one.upper) for one in found])
    plain = np.log([one.probability for one in found])
    np.testing.assert_allclose(centre - plain, [0.5 * one.deviation**2 for one in found], rtol=1e-6)
    error = 3.0 * plain.std() / np.sqrt(plain.size)
    assert abs(centre.mean() - np.log(truth)) < error
    assert plain.mean() + error < np.log(truth)


def test_a_limit_within_level_0_is_a_count_and_one_beyond_reach_a_bound():
    easy = walk_of(linear, 200, 0.5, 1)
    found = easy.estimate()
    assert len(easy.levels) == 1
    assert found.probability == pytest.approx(easy.levels[0].share)
    assert found.lower < norm.sf(0.5) < found.upper
    bounded = walk_of(lambda z: np.minimum(linear(z), 2.0), 500, 3.0, 1)
    assert bounded.done
    assert not bounded.reached
    found = bounded.estimate()
    assert np.isnan(found.probability)
    assert norm.sf(2.0) < found.upper < 0.2
    assert walk_of(linear, 200, 9.0, 1).probability < subset.LEAST


def load(folder, text=PLAN, name="plan"):
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return study.load(path)


def asked(plan, beta=2.5, **more):
    above = 700.0 + 100.0 * beta
    question = {"load": "cross1.F", "levels": {"cross1.F": above}, "per_level": 100, "p0": 0.2}
    return study.subset_of(plan, question | more)


def perturb(joint, operation, errors):
    params = np.zeros(len(errors), tables(CARDAN).PARAM)
    params["R"] = sum(errors[f"pin{i}.offset_t"] for i in (1, 2, 3, 4)) * 3e4 / SIGMA
    params["alpha"][:, 0] = errors["pin1.offset_t"] * 3e4
    return params


def simulate(params, options, **given):
    """A load that is linear in the errors; joints far on the other side fail."""
    results = np.zeros(len(params), tables(CARDAN).RESULT)
    results["status"] = np.where(params["R"] < FAILING, Status.NEWTON_FAILED, Status.OK)
    results["F_max"][:, 0] = np.where(params["R"] < FAILING, np.nan, 700.0 + 100.0 * params["R"])
    return Simulation(results, {})


INVENTED = fakes.SOLVER | {"perturb": perturb, "simulate_rows": simulate}
"""Functions in place of the solver's."""
RUN = campaign.run
SEEN = []
"""Counts that `once` reports."""


def run_to_end(plan, path, **options):
    """Result of a simulation, run or resumed: the row of its seed, and the rows of its levels."""
    simulation.run(plan, path, Work(**options))
    return result_of(path)


def result_of(path):
    with ResultFile.open(path) as store:
        return seed_row(store.view(), 1000)


@pytest.fixture(autouse=True)
def _invented(monkeypatch):
    """Put a solver in place that knows a formula."""
    fakes.replace_functions(monkeypatch, **INVENTED)


@pytest.fixture(scope="module")
def once(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rare")
    plan, path = asked(load(folder)), folder / "whole.h5"
    with pytest.MonkeyPatch.context() as patch:
        fakes.replace_functions(patch, **INVENTED)
        return plan, run_to_end(plan, path, display=SEEN.append), path


@pytest.fixture
def whole(once, tmp_path):
    plan, found, path = once
    return plan, found, Path(shutil.copy(path, tmp_path))


@pytest.mark.slow
def test_a_campaign_finds_the_probability_of_correlated_errors(whole):
    plan, (found, levels), path = whole
    assert found["lower"] < norm.sf(2.5) < found["upper"]
    assert found["reached"]
    assert found["joints"] == sum(level["joints"] for level in levels)
    with ResultFile.open(path) as store:
        errors, origin, loads = store.errors(), store.origin(), store.results()["F_max"][:, 0]
        assert recall(store).identity() == simulation._sized(plan, store.n).identity()
    assert origin["level"][:101].tolist() == [-1, *[0] * 100]
    last = origin["level"] == len(levels) - 1
    # chains start from joints beyond the threshold, and moves are neither nothing nor anything
    assert (loads[origin["parent"][last]] > levels[-1]["threshold"]).all()
    moved = np.corrcoef(errors["pin3.offset_t"][last], errors["pin3.offset_t"][origin["parent"][last]])[0, 1]
    assert 0.3 < moved < 0.95


@pytest.mark.slow
def test_progress_counts_joints_of_all_levels(whole):
    _, (found, _), _ = whole
    seen = [(counts.done, counts.total) for counts in SEEN]
    assert seen[0] == (0, 101)
    assert seen[-1] == (found["joints"] + 1, found["joints"] + 1)
    assert sorted(seen) == seen
    assert len({total for _, total in seen}) > 2


@pytest.mark.slow
def test_the_answer_is_about_the_files_of_all_seeds(tmp_path):
    """The load is normal: 700 N, standard deviation 100 N."""
    work, words = Work(folder=tmp_path, tell=lambda text: None), "cross1.F > 850 N"
    files = module.simulate(load(tmp_path), work, words, n=100, p0=0.5, repeats=2)
    assert [path.name for path in files] == ["plan_rare.h5", "plan_rare_2.h5"]
    with ResultFile.open(files[0]) as a, ResultFile.open(files[1]) as b:
        both, one = rare(a.view(), b.view()), rare(b.view())
        assert tolstat.rare(b.view()).facts == one.facts
    assert both.facts["agree"]
    assert both.facts["lower"] < norm.sf(1.5) < both.facts["upper"]
    assert one.facts["probability"] == both.tables["seeds"].rows[1]["probability"]
    assert [row["seed"] for row in both.tables["seeds"].rows] == [2021, 2022]
    assert {row["seed"] for row in both.tables["levels"].rows} == {2021, 2022}
    assert {row["seed"] for row in both.tables["levels"].for_people} == {2021}
    other = module.simulate(load(tmp_path, name="other"), work, "cross1.F > 860 N", n=100, p0=0.5, repeats=1)
    with (
        ResultFile.open(files[0]) as a,
        ResultFile.open(*other) as b,
        pytest.raises(InputError, match="several limits"),
    ):
        rare(a.view(), b.view())


@pytest.mark.slow
def test_level_0_is_the_random_campaign(whole):
    plan, _, path = whole
    drawn = load(plan.path.parent, PLAN.replace("n = 60", "n = 100"), "random")
    with ResultFile.open(path) as store:
        np.testing.assert_array_equal(store.errors(slice(0, 101)), sampling.draw(drawn))


@pytest.mark.slow
def test_stopped_and_gone_on_with_it_is_the_same_in_any_blocks(tmp_path, whole, monkeypatch):
    plan, found, path = whole
    calls = []

    def stop_at_times(params, options, **given):
        calls.append(len(params))
        if len(calls) % 5 == 0:
            raise KeyboardInterrupt
        return simulate(params, options)

    def in_small_blocks(study, out, workers, block, **kwargs):
        return RUN(study, out, 1, 30, **kwargs)

    monkeypatch.setattr(campaign, "run", in_small_blocks)
    fakes.replace_functions(monkeypatch, simulate_rows=stop_at_times)
    other, stops = tmp_path / "other.h5", 0
    while True:
        try:
            again = run_to_end(plan, other)
            break
        except campaign.Interrupted:
            stops += 1
    assert stops > 1
    assert json.dumps(again) == json.dumps(found).replace("whole.h5", "other.h5")
    assert datasets(other) == datasets(path)
    with h5py.File(other) as a, h5py.File(path) as b:
        for group in ("errors", "origin", "results"):
            for name in a[group]:
                np.testing.assert_array_equal(a[group][name][:], b[group][name][:], err_msg=name)


@pytest.mark.slow
def test_joints_without_a_load_are_counted_on_the_side_asked_for(tmp_path, whole):
    _, (below, _), _ = whole
    above, _ = run_to_end(asked(load(tmp_path), unresolved="above"), tmp_path / "above.h5")
    assert below["unresolved_first"] > 0
    assert below["upper_if_above"] == pytest.approx(below["upper"] + below["unresolved_first"] / 100)
    assert above["lower"] < norm.sf(2.5) + norm.cdf(FAILING) < above["upper"]
    assert above["lower"] > below["probability"]


@pytest.mark.slow
def test_a_file_of_another_question_or_other_loads_is_refused(tmp_path, whole):
    plan, _, path = whole
    with pytest.raises(StoreError, match=r"sampling.levels.cross1.F: 950.0 in the file, 960.0 in the study"):
        run_to_end(asked(load(tmp_path), 2.6), path)
    with Writer.open(path) as store:
        results = store.results()
        results["F_max"][:, 0] *= -1.0
        store.write(np.arange(store.n), Simulation(results, {}))
    with pytest.raises(StoreError, match="do not follow from the loads before them"):
        run_to_end(plan, path)
    with pytest.raises(StoreError, match="do not follow from the loads before them"):
        result_of(path)


@pytest.mark.slow
def test_a_study_of_several_operating_points_is_simulated_at_one_of_them(tmp_path):
    before, after = PLAN.split("[operation]")
    own, rest = after.split("[", 1)
    points = "".join(f'[[operation]]\nname = "{name}"{own}' for name in ("low", "high"))
    path = load(tmp_path, f"{before}{points}[{rest}").path
    command = ["rare", str(path), "--limit", "cross1.F > 850 N", "--n", "100", "--p0", "0.5", "--repeats", "1"]
    command += ["--out", str(tmp_path / "out")]
    assert "has several operating points" in CliRunner().invoke(app, command).stderr
    done = CliRunner().invoke(app, [*command, "--point", "low"])
    assert done.exit_code == 0, done.stderr
    assert "P(cross1.F > 850 N) = " in done.stdout


@pytest.mark.slow
def test_a_file_that_lacks_joints_is_resumed_by_its_own_command(whole):
    _, (found, _), path = whole
    with h5py.File(path, "r+") as file:
        file["results/status"][3] = Status.PENDING
    with (
        ResultFile.open(path) as store,
        pytest.raises(StoreError, match=r"is not finished\n  hint: resume it: tolstat rare"),
    ):
        rare(store.view())
    done = CliRunner().invoke(app, ["rare", str(path), "--run", "--json"])
    assert done.exit_code == 0, done.stderr
    assert json.loads(done.stdout)["facts"]["probability"] == found["probability"]


@pytest.mark.slow
def test_a_finished_file_of_other_code_is_shown_and_an_unfinished_one_refused(whole, monkeypatch):
    plan, found, path = whole
    monkeypatch.setattr(metadata, "source_hash", lambda: "other")
    assert run_to_end(plan, path) == found
    done = CliRunner().invoke(app, ["rare", str(path)])
    assert done.exit_code == 0, done.stderr
    refused = CliRunner().invoke(app, ["rare", str(path), "--n", "300"])
    assert (refused.exit_code, "--n: is about a simulation" in refused.stderr) == (2, True)
    with h5py.File(path, "r+") as file:
        file["results/status"][3] = Status.PENDING
    done = CliRunner().invoke(app, ["rare", str(path), "--run"])
    assert done.exit_code == 2
    assert "run the study into another file (--out OTHER.h5), or resume with" in done.stderr


def test_every_fault_of_a_question_is_told(tmp_path):
    path = load(tmp_path).path
    for options, text in (
        ([], "--limit: is missing"),
        (["--limit", "cross1.F"], "'cross1.F' is not a limit"),
        (["--limit", "all limits"], 'write "any limit"'),
        (["--limit", "cross9.F > 1 N"], "'cross9.F' is not a load"),
        (["--limit", "cross1.F > 1 mm"], "--limit: cross1.F"),
        (["--limit", "fork1.T > 1 N*m"], "leaves out fork1.T"),
        (["--limit", "cross1.F > 1 N", "--n", "55"], "5.5 seeds"),
    ):
        done = CliRunner().invoke(app, ["rare", str(path), "--out", str(tmp_path / "no"), *options])
        assert (done.exit_code, text in done.stderr) == (2, True), done.stderr
    assert not list(tmp_path.rglob("*.h5"))
    with pytest.raises(InputError, match="is set by tolstat rare"):
        load(tmp_path, PLAN.replace("seed = 2021", 'seed = 2021\nmethod = "subset"'))


def test_limits_by_pattern_and_all_limits_together(tmp_path, monkeypatch):
    plan, plans = load(tmp_path), []
    monkeypatch.setattr(simulation, "run", lambda own, *_: plans.append(own))
    for words in ("cross*.F > 950 N", "any limit"):
        module.simulate(plan, Work(tell=lambda text: None), words, 100, 0.5, repeats=1)
    several, every = (own.sampling.limit(CARDAN) for own in plans)
    assert several.loads == ("cross1.F", "cross2.F", "cross3.F", "cross4.F")
    assert dict(zip(every.loads, every.levels, strict=True)) == plan.limits


def seeds_of(load, limit, n=200, seeds=4):
    return [walk_of(load, n, limit, seed, dimensions=2) for seed in range(seeds)]


def test_ancestors_are_the_joints_of_level_0_that_the_last_descend_from():
    walk = walk_of(linear, 200, 3.5, 1)
    assert 1 <= walk.ancestors <= 200 * 0.1
    assert walk_of(linear, 200, 0.5, 1).ancestors == round(200 * walk_of(linear, 200, 0.5, 1).levels[0].share)


def test_seeds_that_miss_a_way_disagree_and_their_interval_holds_both():
    """A way by error 0 that all seeds see; a steep one by error 1, more probable, that few take."""

    def two_ways(z):
        return np.maximum(z[:, 0], np.where(z[:, 1] > 2.6, 3.0 * z[:, 1] - 1.0, -9.0))

    walks = [walk_of(two_ways, 100, 4.2, seed, dimensions=2) for seed in range(8)]
    found, agree = module.together([walk.estimate() for walk in walks])
    truth = 1.0 - norm.cdf(4.2) * norm.cdf(2.6)
    assert not agree
    assert found.lower < truth < found.upper
    same, agree = module.together([walk.estimate() for walk in seeds_of(linear, 3.5)])
    assert agree
    assert same.lower < norm.sf(3.5) < same.upper


def test_intervals_of_four_seeds_cover():
    found = [
        module.together([walk_of(linear, 100, 2.5, 4 * k + i, 3).estimate() for i in range(4)])[0] for k in range(60)
    ]
    assert np.mean([one.lower < norm.sf(2.5) < one.upper for one in found]) > 0.95 - 3 * np.sqrt(0.95 * 0.05 / 60)


@pytest.mark.slow
def test_a_note_of_several_seeds_is_told_once(whole):
    with ResultFile.open(whole[2]) as store:
        said = [part.text for part in rare(store.view(), store.view()).parts if isinstance(part, Sentence)]
    assert len([note for note in said if note.startswith("numerical error at the limit: not known")]) == 1
    assert len([note for note in said if note.startswith("the estimate is as precise as")]) == 1
    assert sum(note.startswith(f"{whole[2]}: ") for note in said) == 2
