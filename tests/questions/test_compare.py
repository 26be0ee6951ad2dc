"""Two campaigns side by side: coverage of the differences, and a known difference found joint by joint."""

import numpy as np
import pytest
from scipy.stats import binomtest, norm

from tests.support import synthetic
from tests.support.reports import call
from tolstat.analysis import difference
from tolstat.analysis.binomial import clopper_pearson
from tolstat.analysis.design import Listed
from tolstat.analysis.sample import Sample
from tolstat.common.errors import InputError, NotApplicable
from tolstat.common.tables import Simulation, Status
from tolstat.display.answer import Sentence
from tolstat.questions import compare as question
from tolstat.store import ResultFile, Writer

SEEDS = 500
LEAST = 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / SEEDS)


def pairs(n, seeds=SEEDS):
    """Lognormal loads of A, and those of B, correlated with them and a tenth larger."""
    z = np.random.default_rng(3).standard_normal((seeds, 2, n))
    return zip(np.exp(z[:, 0]), 1.1 * np.exp(0.8 * z[:, 0] + 0.6 * z[:, 1]), strict=True)


def loads(values, design=None):
    """Sample of loads; a joint with NaN has failed."""
    return Sample.of(values, np.ones(len(values)), design)


def truth(share=None, level=None):
    if share is not None:
        return 0.1 * np.exp(norm.ppf(share))
    return norm.sf(np.log(level / 1.1)) - norm.sf(np.log(level))


@pytest.mark.slow
def test_paired_differences_cover_over_seeds_and_a_walds_interval_of_rare_shares_does_not(monkeypatch):
    monkeypatch.setattr(difference, "RESAMPLES", 200)
    level, covered, wald = 16.0, [], []  # one in some 300 joints
    for a, b in pairs(200):
        one, other = loads(a), loads(b)
        share, q = difference.shares(one, other, [level], True), difference.quantiles(one, other, 0.7, True)
        covered.append(
            [
                share.lower[0] <= truth(level=level) <= share.upper[0],
                q.lower <= truth(share=0.7) <= q.upper,
            ]
        )
        d = (b > level) * 1.0 - (a > level)
        wald.append(abs(d.mean() - truth(level=level)) <= 1.96 * d.std() / np.sqrt(d.size))
    assert (np.mean(covered, axis=0) >= LEAST).all()
    assert np.mean(wald) < LEAST


def test_pairs_that_often_change_sides_are_covered_and_independent_changes_are_not():
    """No pair changes both ways, so the two numbers of changes are negatively correlated (multinomial)."""
    n, up, down, rng = 100, 0.5, 0.4, np.random.default_rng(13)
    covered, as_known, other = [], [], []
    for numbers in rng.multinomial(n, [up, down, 1.0 - up - down], SEEDS):
        a = np.repeat([1.0, 3.0, 1.0], numbers)
        b = np.repeat([3.0, 1.0, 1.0], numbers)
        found = difference.shares(loads(a), loads(b), [2.0], True)
        covered.append(found.lower[0] <= up - down <= found.upper[0])
        p, q = numbers[1] / n, numbers[0] / n
        length = float(found.upper[0] - found.lower[0])
        as_known.append(length / (2 * 1.96 * np.sqrt((p + q - (p - q) ** 2) / n)))
        other.append(abs(q - p - (up - down)) <= 1.96 * np.sqrt((p * (1 - p) + q * (1 - q)) / n))
    assert np.mean(covered) >= LEAST
    assert np.mean(as_known) == pytest.approx(1.0, abs=0.06)  # Wald's length with the variance of a multinomial
    assert np.mean(other) < LEAST


def test_unpaired_differences_cover_and_neglecting_one_side_does_not():
    level, covered, half = 3.0, [], []
    for (a, _), (_, b) in zip(pairs(200), [*pairs(200)][1:], strict=False):
        one, other = loads(a), loads(b)
        share, q = difference.shares(one, other, [level], False), difference.quantiles(one, other, 0.8, False)
        covered.append([share.lower[0] <= truth(level=level) <= share.upper[0], q.lower <= truth(share=0.8) <= q.upper])
        low, high = clopper_pearson(np.sum(b > level), b.size)
        half.append(low - np.mean(a > level) <= truth(level=level) <= high - np.mean(a > level))
    assert (np.mean(covered, axis=0) >= LEAST).all()
    assert np.mean(half) < LEAST


def test_tests_are_scipys():
    a, b = next(pairs(400))
    share = difference.shares(loads(a), loads(b), [2.0, 5.0], True)
    for i, level in enumerate((2.0, 5.0)):
        only = (int(np.sum((b > level) & (a <= level))), int(np.sum((a > level) & (b <= level))))
        assert (share.only_b[i], share.only_a[i]) == only
        assert share.p[i] == pytest.approx(binomtest(only[0], sum(only)).pvalue)
        assert share.estimate[i] == pytest.approx(np.mean(b > level) - np.mean(a > level))


def test_joints_without_a_load_are_bounds_and_dependent_samples_have_no_interval():
    a, b = np.array([1.0, 2.0, np.nan, 4.0]), np.array([1.0, 3.0, 3.0, np.nan])
    found = difference.shares(loads(a), loads(b), [2.5], True)
    assert (found.n, found.estimate[0]) == (2, 0.5)
    assert (found.bound_lower[0], found.bound_upper[0]) == (0.5 - 0.5, 0.75 - 0.25)
    assert found.outer_lower[0] < 0.0 < found.bound_upper[0] < found.outer_upper[0]
    one, other = (loads(values, Listed("cases")) for values in (a, b))
    assert np.isnan(difference.shares(one, other, [2.5], True).outer_upper[0])
    assert np.isnan(difference.quantiles(one, other, 0.5, True).lower)
    with pytest.raises(ValueError, match="no joint with a valid load"):
        difference.quantiles(loads(a[2:3]), loads(b), 0.5, False)


def campaign(folder, name, text=synthetic.STUDY, n=400, factor=1.0):
    """Campaign whose load cross1.F follows one error; its last joint has failed."""
    path = synthetic.store(folder, text.replace("n = 60", f"n = {n}"), name, simulated=0)
    with Writer.open(path) as store:
        results = synthetic.results(store.n, failed=1)
        results["F_max"][:-1, 0] = 640.0 + factor * 1e6 * np.abs(store.errors()["pin1.offset_t"][:-1])
        store.write(np.arange(store.n), Simulation(results, {}))
    return path


def test_joints_of_one_seed_are_paired_by_sample_and_changes_are_put_together(tmp_path):
    wide = synthetic.STUDY.replace("0.1 mm", "0.12 mm").replace("n = 60", "n = 60\nnominal_first = false")
    a, b = campaign(tmp_path, "a"), campaign(tmp_path, "b", wide, n=300)
    with ResultFile.open(a) as one, ResultFile.open(b) as other:
        answer = question.compare(one.view(), other.view(), ["cross1.F"])
        pairs, differing = question.sides(one.view(), other.view()), question.changes(one.view(), other.view())
        loads = [source_of(store)[k : k + 299] for store, k in ((one, 1), (other, 0))]
    assert answer.facts == {"paired": True}
    assert pairs.rows[[0, -1]].tolist() == [1, 300]
    row = answer.frame("shares").set_index("load").loc["cross1.F"]
    above = [load > 700.0 for load in loads]
    assert (row["only_a"], row["only_b"]) == (0, np.sum(above[1] & ~above[0]))
    assert row["lower"] > 0
    assert (
        answer.frame("switched").query("load == 'cross1.F'")["row"].tolist()
        == (1 + np.flatnonzero(above[0] != above[1])).tolist()
    )
    sigmas = [f"tolerances.pin{i}.offset_t.sigma" for i in (1, 2, 3, 4)]
    assert [keys for keys, *_ in differing if "tolerances" in keys[0]] == [sigmas]
    assert set(sigmas) < set(answer.frame("changes")["key"])
    assert any(note.startswith(f"  {sigmas[0]} and 3 more: ") for note in notes_of(answer))
    assert answer.frame("loads")["statistic"].tolist() == ["50 %", "90 %", "99 %"]


def notes_of(answer):
    return [part.text for part in answer.parts if isinstance(part, Sentence)]


def source_of(store):
    return store.results()["F_max"][:, 0]


def test_other_seeds_are_not_paired(tmp_path):
    a, b = (
        campaign(tmp_path, "a"),
        campaign(tmp_path, "b", synthetic.STUDY.replace("seed = 2021", "seed = 5"), factor=1.2),
    )
    with ResultFile.open(a) as one, ResultFile.open(b) as other:
        answer = question.compare(one.view(), other.view())
    assert not answer.facts["paired"]
    assert answer.frame("switched").empty
    row = answer.frame("shares").set_index("load").loc["cross1.F"]
    assert row["lower"] < row["estimate"] < row["upper"]
    assert np.isnan(row["p"])


@pytest.mark.slow
def test_what_cannot_be_compared_is_refused(tmp_path):
    a, sweep = campaign(tmp_path, "a"), synthetic.store(tmp_path, synthetic.SWEEP, "sweep")
    done = call("compare", a, sweep)
    assert done.exit_code == 2
    assert "not drawn from tolerances" in done.stderr
    blocked = tmp_path / "a_a_compare_shares.csv"
    blocked.mkdir()
    done = call("compare", a, a, "--out", tmp_path)
    assert done.exit_code == 2
    assert f"{blocked.name}: cannot be written: Is a directory\n  hint: " in done.stderr
    with ResultFile.open(a) as one, pytest.raises(InputError, match=r"did you mean 'cross1\.F'") as refused:
        question.compare(one.view(), one.view(), ["cros1.F", "nothing"])
    assert len(refused.value.faults) == 2
    with ResultFile.open(sweep) as one, pytest.raises(NotApplicable):
        question.compare(one.view(), one.view())


def test_loads_by_a_pattern_and_where_test_and_interval_disagree(tmp_path):
    """Five pairs of 64 above a limit in B alone: p = 2^-4 of the exact test, and an interval that excludes zero."""
    a = campaign(tmp_path, "a", n=64, factor=0.0)
    b = synthetic.store(tmp_path, synthetic.STUDY.replace("n = 60", "n = 64"), "b", simulated=0)
    with Writer.open(b) as store:
        results = synthetic.results(store.n)
        results["F_max"][:, 0] = np.where(np.arange(store.n) % 12 == 5, 900.0, 640.0)
        store.write(np.arange(store.n), Simulation(results, {}))
    with ResultFile.open(a) as one, ResultFile.open(b) as other:
        answer = question.compare(one.view(), other.view(), ["cross[12].T", "psi"])
    assert answer.frame("loads")["load"].unique().tolist() == ["cross1.T", "cross2.T", "psi"]
    row = answer.frame("shares").set_index("load").loc["cross1.F"]
    assert (row["only_a"], row["only_b"], row["p"]) == (0, 5, 0.0625)
    assert row["lower"] > 0.0
    told = [note for note in notes_of(answer) if "disagree at" in note]
    assert told == ["they disagree at cross1.F > 700 N and 1 more: whether there is a difference, the exact test says"]
    pairs = {row["row"] for row in answer.frame("switched").to_dict("records")}
    assert f"{len(pairs)} pairs have a limit that only one of their joints exceeds; " in "\n".join(notes_of(answer))


def test_loads_that_were_not_asked_for_need_not_be_in_both_files(tmp_path):
    kept = "[output]\nresults = ['fork*.F_max']\n"
    text = synthetic.WHOLE.partition("[limits]")[0] + kept + '[limits]\n"fork1.F" = "700 N"\n'
    a, b = synthetic.store(tmp_path), synthetic.store(tmp_path, text, "b")
    with ResultFile.open(a) as one, ResultFile.open(b) as other:
        answer = question.compare(one.view(), other.view(), ["fork2.F"])
        assert answer.frame("loads")["load"].unique().tolist() == ["fork2.F"]
        assert answer.frame("shares")["load"].tolist() == ["fork1.F", "any limit"]
        (told,) = [note for note in notes_of(answer) if note.startswith("limits left out: ")]
        assert told.endswith("pin1.contact, psi, which only one file keeps")
        assert {"cross1.F,", "fork4.T,"} <= set(told.split())
        with pytest.raises(InputError, match=r"limits\.cross1\.F: 'cross1\.F' is not a load that both files keep"):
            question.compare(one.view(), other.view())


def test_pending_joints_are_not_compared(tmp_path):
    a, b = campaign(tmp_path, "a", n=60), synthetic.store(tmp_path, simulated=31, name="b")
    with ResultFile.open(a) as one, ResultFile.open(b) as other:
        found = question.sides(one.view(), other.view())
        assert "30 pairs of joints with the same random numbers" in notes_of(question.compare(*found.views))
        assert len(found.rows) == 30
        assert (found.load("cross1.F")[1].status == Status.OK).all()


def test_units_of_a_study_are_written_for_people(tmp_path):
    stiff = synthetic.STUDY.replace('base = "cirelli2021"', 'base = "cirelli2021"\nbushing.cross.k_bx = "6e5 N*m/rad"')
    with ResultFile.open(campaign(tmp_path, "a")) as one, ResultFile.open(campaign(tmp_path, "b", stiff)) as other:
        answer = question.compare(one.view(), other.view())
    assert "  joint.bushing.cross.k_bx: 590000.0 N m/rad -> 600000.0 N m/rad" in notes_of(answer)
    assert answer.frame("changes").set_index("key").loc["joint.bushing.cross.k_bx", "b"] == "600000.0 N*m/rad"
