"""Commands `causes` and `capability` on a campaign whose causes are known."""

import shutil
from contextlib import suppress
from shlex import quote

import numpy as np
import pytest
from scipy.stats import norm

from tests.support import synthetic
from tests.support.cells import body
from tests.support.reports import call
from tolstat.analysis import sensitivity
from tolstat.common.errors import NotApplicable
from tolstat.common.tables import SIMULATED, Simulation
from tolstat.display.answer import Asked, Sentence, Table
from tolstat.display.text import value
from tolstat.questions import QUESTIONS, Question
from tolstat.questions.capability import capability
from tolstat.questions.causes import errors as module
from tolstat.questions.causes import worst
from tolstat.questions.causes.errors import causes
from tolstat.questions.shares import ChangedJoints
from tolstat.store import ResultFile, Writer, view

N = 3000
TEXT = synthetic.STUDY.replace("n = 60", f"n = {N}").replace('"pin*.offset_t"', '"pin*.offset_[tz]"')


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return made(tmp_path_factory.mktemp("causes"), TEXT)


def made(folder, text, name="known"):
    """Campaign in which cross1.F rises with one error, and with the size of another."""
    file = synthetic.store(folder, text, name, simulated=0)
    with Writer.open(file) as store:
        results, errors = synthetic.results(store.n, failed=3, unsettled=2), store.errors()
        sigma = 1e-4 / 3
        load = 640.0 + 20.0 * errors["pin1.offset_t"] / sigma + 10.0 * (errors["pin2.offset_z"] / sigma) ** 2
        results["F_max"][:-5, 0] = load[:-5]
        store.write(np.arange(store.n), Simulation(results, {}))
    return file


def test_known_causes_are_found_with_their_shares(path):
    with ResultFile.open(path) as store:
        found = causes(store.view(), "cross1.F")
    assert [found.facts[key] for key in ("joints", "without_load", "level")] == [N - 5, 5, 700.0]
    table = found.frame("errors").set_index("error")
    assert set(table.index[:2]) == {"pin1.offset_t", "pin2.offset_z"}
    # variances 20² and 2 · 10²
    assert table.loc["pin1.offset_t", "first"] == pytest.approx(2 / 3, abs=0.05)
    assert table.loc["pin2.offset_z", "first"] == pytest.approx(1 / 3, abs=0.05)
    assert table.loc["pin1.offset_t", "direction_p"] < 1e-6 < 0.05 < table.loc["pin2.offset_z", "direction_p"]
    assert table.loc["pin2.offset_z", "size_p"] < 1e-6
    with ResultFile.open(path) as store:
        relative = causes(store.view(), "cross1.F", logarithm=True)
    assert relative.facts["std"] == pytest.approx(found.facts["std"] / 650, rel=0.05)
    others = table.drop(["pin1.offset_t", "pin2.offset_z"])
    assert others[["direction_p", "size_p"]].min(axis=None) > 0.05
    assert others["first"].max() < 0.02


def test_intervals_are_wider_after_looks_and_shares_of_changed_joints_are_those_of_the_file(path, tmp_path):
    looked = shutil.copy(path, tmp_path / "looked.h5")
    with Writer.open(looked) as store:
        store.change(stop={"reached": True, "looks": [20, N]})
    tables, ends = [], []
    for file in (path, looked):
        with ResultFile.open(file) as store:
            own = store.view()
            tables.append(causes(own, "cross1.F").frame("errors").set_index("error"))
            joints = ChangedJoints(own, "cross1.F", {})
            ends.append(joints.share(joints.base)[1:])
            above = own.load("cross1.F").above(joints.level)
            assert ends[-1] == (above.outer_lower, above.outer_upper)
    assert ends[1][0] < ends[0][0] < ends[0][1] < ends[1][1]
    one, other = (table.loc["pin2.offset_z"] for table in tables)
    assert one["first"] == other["first"]
    widths = [row["first_upper"] - row["first_lower"] for row in (one, other)]
    assert widths[1] / widths[0] == pytest.approx(norm.ppf(0.9875) / norm.ppf(0.975))
    assert other["size_lower"] < one["size_lower"] < one["size_upper"] < other["size_upper"]


def test_of_many_joints_the_first_are_taken_and_all_of_a_thin_tail(path, monkeypatch):
    monkeypatch.setattr(module, "MAX_JOINTS", 1000)
    monkeypatch.setattr(view, "BLOCK", 700)
    with ResultFile.open(path) as store:
        found = causes(store.view(), "cross1.F")
        errors, loads = store.errors()[1:1001], store.results()["F_max"][1:-5, 0]
    assert (found.facts["joints"], found.facts["used"]) == (N - 5, 1000)
    table = found.frame("errors").set_index("error")
    row = table.loc["pin1.offset_t"]
    x = np.column_stack([errors[name] for name in table.index])
    here = list(table.index).index("pin1.offset_t")
    assert row["first"] == pytest.approx(sensitivity.first_order(x, loads[:1000]).estimate[here])
    assert found.facts["above"] == np.sum(found.facts["level"] < loads)
    assert row["direction_p"] < 1e-6
    assert any("first 1000 joints" in part.text for part in found.parts if isinstance(part, Sentence))


def test_shares_in_all_are_offered_until_they_are_simulated(path, monkeypatch):
    with ResultFile.open(path) as store:
        known = store.view()
        before = [part.text for part in causes(known, "cross2.F").parts if isinstance(part, Sentence)]
        known.altered = {"a change": None}
        monkeypatch.setattr(module.lines, "lines", refuses)
        after = [part.text for part in causes(known, "cross2.F").parts if isinstance(part, Sentence)]
    assert f"shares in all, with interactions: tolstat causes {quote(str(path))} --run" in before
    assert not any("--run" in text for text in after)


def refuses(view, load, costs):
    raise NotApplicable("no joints with other widths")


def test_correlated_errors_have_no_total_and_dependent_samples_no_interval(tmp_path):
    lot = '"hole1.tilt_t" = { plus_minus = "0.1 deg", distribution = "normal", lot = { share = 0.5 } }'
    text = TEXT.replace("seed = 2021", "seed = 2021\njoints_per_lot = 10").replace("3000", "400")
    text = text.replace("[tolerances]", f"[tolerances]\n{lot}")
    text += '\n[[correlation]]\nbetween = ["pin1.offset_t", "pin3.offset_t"]\nrho = 0.5\n'
    done = call("causes", made(tmp_path, text))
    assert done.exit_code == 0
    assert "correlated" in done.stderr
    assert "independent samples only" in done.stderr
    assert ".." not in done.stdout


def test_what_has_no_causes_is_refused(tmp_path, path):
    few = synthetic.store(tmp_path)
    sweep = synthetic.store(tmp_path, synthetic.SWEEP, "sweep")
    before = few.read_bytes()
    for arguments, text in (
        ((few,), "60 joints with a valid load on all limits"),
        ((few, "--run", "--budget", "9 s"), f"200 are needed: tolstat extend {few} --n 200"),  # before it simulates
        ((sweep,), "not drawn from tolerances"),
        ((path, "--by", "cross9.F"), "is not a load"),
    ):
        done = call("causes", *arguments)
        assert done.exit_code == 2
        assert text in done.stderr
        assert "hint:" in done.stderr
    assert few.read_bytes() == before


PAGE = synthetic.STUDY.replace("n = 60", "n = 400").replace("40 N*m", "18 N*m").replace("offset_t", "offset_[tz]")


def shown(path):
    """Blocks of the page by question, the notes, and the leading loads of a result file."""
    asked = Asked(path)
    with ResultFile.open(path) as store:
        view = store.view()
        found = {}
        for question in QUESTIONS:
            if isinstance(question, Question) and question.name in ("causes", "worst"):
                with suppress(NotApplicable):
                    found[question.name] = question.on_page(view, asked).blocks()
        return found, asked.notes, view.loads(view.leading)


def tables(blocks):
    return [block for block in blocks if isinstance(block, Table)]


def test_page_has_causes_and_worst_joints_of_the_leading_loads(tmp_path):
    found, notes, leading = shown(synthetic.store(tmp_path, PAGE, failed=15, unsettled=12))
    assert (list(found), notes) == (["causes", "worst"], [])
    assert leading[0].name == "cross1.F"
    assert [table.title.split()[2] for table in tables(found["causes"])] == [load.name for load in leading]
    assert [len(table.for_people) for table in tables(found["causes"])] == [8] * len(leading)
    said = [block.text for block in found["causes"] if isinstance(block, Sentence)]
    assert sum(": 373 joints, 27 without a valid load left out" in line for line in said) == len(leading)
    assert [panel.key for panel in found["causes"][1].panels] == [
        f"tornado-{load.name.replace('.', '-')}" for load in leading
    ]
    (table,) = tables(found["worst"])
    assert list(dict.fromkeys(row[0] for row in body(table))) == [load.name for load in leading]
    for load in leading:
        values = np.sort(load.values[np.isin(load.status, SIMULATED) & np.isfinite(load.values)])[::-1]
        own = [row[1] for row in body(table) if row[0] == load.name]
        assert own == [value(x, load.unit) for x in values[: worst.ON_PAGE]]


@pytest.mark.slow
def test_page_leaves_out_what_a_file_cannot_tell(tmp_path):
    found, notes, leading = shown(synthetic.store(tmp_path))
    assert list(found) == ["worst"]
    assert [note.partition(":")[0] for note in notes] == [
        *(f"no causes of {x.name}" for x in leading),
    ]
    for path in (
        synthetic.store(tmp_path, synthetic.SWEEP, "sweep"),
        synthetic.store(tmp_path, name="no_valid_joint", failed=40, unsettled=20),
    ):
        assert shown(path)[:2] == ({}, [])


def test_capability_without_limits_and_one_joint_in_one_are_refused(tmp_path):
    sweep, few = synthetic.store(tmp_path, synthetic.SWEEP, "sweep"), synthetic.store(tmp_path)
    for arguments, text in (((sweep,), "has no limits"), ((few, "--one-in", 1), "--one-in: 1 is not above one")):
        done = call("capability", *arguments)
        assert done.exit_code == 2
        assert text in done.stderr


def test_one_in_n_is_a_quantile_as_far_as_the_joints_reach_and_beyond_rare_is_named(path):
    with ResultFile.open(path) as store:
        known = store.view()
        answer = capability(known, one_in=[4.0, 200.0, 1e4])
        load = known.load("cross1.F")
    table = answer.frame("one_in").query("load == 'cross1.F'")
    for (_, row), share in zip(table.iterrows(), (0.75, 0.995), strict=False):
        quantile = load.quantile(share)
        assert (row["estimate"], row["lower"], row["upper"]) == quantile[4:7]
        assert row["lower"] < np.quantile(load.valid, share) < row["upper"]
    assert table.iloc[-1][["estimate", "lower", "upper"]].isna().all()
    (said,) = (part.text for part in answer.parts if isinstance(part, Sentence) and "tolstat rare" in part.text)
    assert said.endswith('tolstat rare known.toml --limit "cross1.F > 700 N"')
