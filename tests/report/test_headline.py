"""The verdict on campaigns built to mislead: the same sentence in page, text and JSON, no more than the file tells."""

import re

import numpy as np
import pytest

import tolstat
from tests.support import reports, synthetic
from tests.support.views import view
from tolstat import sampling
from tolstat.analysis import prediction
from tolstat.analysis.binomial import clopper_pearson, needed
from tolstat.campaign import remedy
from tolstat.common.cardan import CARDAN
from tolstat.common.tables import Simulation, Status, tables
from tolstat.display import text as texts
from tolstat.display.answer import Asked
from tolstat.display.blocks import Decision
from tolstat.display.verdict import WORDS
from tolstat.questions import shares
from tolstat.questions.exceedance import rows as exceedance
from tolstat.questions.exceedance.rows import ends, verdict
from tolstat.report import headline, page
from tolstat.report.answer import statistics
from tolstat.store import ResultFile, Writer
from tolstat.study import load

ONE = synthetic.STUDY.partition("[limits]")[0] + '[limits]\n"cross1.F" = "1500 N"\n'


def study(n=60, method="random", text=ONE):
    return text.replace("n = 60", f'n = {n}\nmethod = "{method}"')


def interfering(folder, errors=""):
    """36 of 61 joints outside the model; none of the others is above the limit."""
    path = synthetic.store(folder, study(61) + errors, simulated=0)
    results = synthetic.results(62)
    for name in tables(CARDAN).RESULT.names:
        if tables(CARDAN).RESULT[name].base.kind == "f":
            results[name][1:37] = np.nan
    results["status"][1:37], results["settled"][1:37] = Status.OUTSIDE_MODEL, 0
    with Writer.open(path) as store:
        store.write(np.arange(62), Simulation(results, {}))
    return path


def failed_at_one_point(folder):
    """60 joints at two points: at the first all keep the limit, at the second 40 have failed."""
    _, _, keys = synthetic.HEAD.partition("[operation]")
    text = ONE.replace("[operation]", '[[operation]]\nname = "cruise"')
    text = text.replace("[tolerances]", f'[[operation]]\nname = "start"{keys}[tolerances]')
    source = folder / "points.toml"
    source.write_text(text, encoding="utf-8")
    plan = load(source)
    with Writer.create(folder / "points.h5", plan, [sampling.draw(plan)]) as store:
        for name, failed in (("cruise", 0), ("start", 40)):
            store.at(name).write(np.arange(61), Simulation(synthetic.results(61, failed=failed), {}))
    return folder / "points.h5"


MISLEADING = {
    "all failed": (lambda d: synthetic.store(d, study(), failed=60), "none", "100 % of the joints have no result"),
    "half interfering": (interfering, "none", "59 % of the joints have no result (36 of 61)"),
    "failed at one point": (failed_at_one_point, "none", "66.7 % of the joints have no result (40 of 60)"),
    "interrupted": (
        lambda d: synthetic.store(d, study(600), simulated=300), "open",
        "open: 0 % exceed 1500 N on cross1.F (0 .. 1.23 %); 1 % is accepted; 368 joints decide it in 90 % of campaigns "
        "if 0 % is the true share",
    ),
    "not begun": (lambda d: synthetic.store(d, study(), simulated=0), "none", "no joint has been simulated"),
    "three joints": (lambda d: synthetic.store(d, study(3)), "open", "3 joints are too few to say how many would"),
}  # fmt: skip
pytestmark = pytest.mark.usefixtures("without_pictures")


@pytest.fixture(autouse=True)
def _without_assumptions(monkeypatch):
    """Verdicts from the joints as drawn; what they stand on is the subject of another file."""
    monkeypatch.setattr("tolstat.questions.assumptions.variations.applicable", lambda view, accepted: None)


def everywhere(path, accepted):
    """Sentence of the verdict in text, JSON and first card of the page."""
    text = reports.build(path, *([] if np.isnan(accepted) else ["--accept", str(accepted)]))
    with ResultFile.open(path) as store:
        made = store.view()
        json_ = statistics(made, accepted=accepted)["verdict"]
        first = page.compose(made, Asked(path, accepted)).sections[0]
    decision = next(block for block in first.blocks if isinstance(block, Decision))
    card, place = decision.verdicts[0], decision.picture.title.partition(":")[0]
    assert place == "The joint" if card.value == "no verdict" else f" on {place}." in card.words or "keep" in card.words
    separator = ":" if card.shade else ""
    assert text.table.splitlines()[0].lower() == f"{json_['sentence']}.".lower()
    assert f"{card.value}{separator} {card.words}" == json_["sentence"]
    assert all(note in text.notes for note in json_["notes"])
    return json_, card


@pytest.mark.parametrize("name", MISLEADING)
def test_no_verdict_says_more_than_the_file(tmp_path, name):
    make, answer, words = MISLEADING[name]
    said, card = everywhere(make(tmp_path), 0.01)
    assert said["answer"] == WORDS[answer]
    assert words in said["sentence"]
    assert card.shade == "open"
    assert "100 % of the joints keep" not in said["sentence"]


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("all failed", "no verdict: 100 % of the joints have no result (60 of 60)"),
        ("half interfering", "no verdict: 59 % of the joints have no result (36 of 61)"),
        ("interrupted", "100 % of the joints keep the limit (299 of 299; total interval 98.8 .. 100 %)"),
        ("three joints", "no verdict: 3 joints are too few"),
    ],
)
def test_without_an_accepted_share_the_yield_leads_where_its_interval_tells_something(tmp_path, name, sentence):
    said, _ = everywhere(MISLEADING[name][0](tmp_path), np.nan)
    assert said["sentence"] == sentence


def test_joints_that_cannot_be_assembled_are_scrap_in_the_yield(tmp_path):
    with ResultFile.open(interfering(tmp_path, '[errors]\n"pin1.diameter" = "1 mm"\n')) as store:
        made = store.view()
        row = shares.good(made)
        assert (row["n"], row["count"], row["scrap"], row["n_failed"]) == (61, 36, 36, 0)
        low, high = (float(end) for end in clopper_pearson(36, 61))
        assert (row["good"], row["good_lower"], row["good_upper"]) == pytest.approx((25 / 61, 1.0 - high, 1.0 - low))
        found, judged = headline.headline(made), headline.headline(made, 0.01)
        assert found.sentence.startswith(
            "41 % of the joints keep the limit (25 of 61, 36 cannot be assembled; total interval "
        )
        assert judged.words == "59 % of the joints have no result (36 of 61: a pin is larger than its hole)"
        assert judged.notes[0].startswith("36 of 61: a pin is larger than its hole. Row 1: ")
        (told,) = remedy.in_words(remedy.reasons(store, {"": store.status()}))
        assert told.startswith("36 joints outside_model: a pin is larger than its hole: scrap in the yield\n  hint")
        assert "36 of 61 joints cannot be assembled: scrap in yield" in str(tolstat.capability(made).parts)


def test_a_verdict_that_holds_begins_with_what_holds_and_each_sentence_with_a_capital():
    def change(results):
        results["F_max"][:, 0] -= 100.0

    made = view(limits={"cross1.F": 630.0}, change=change)  # the joint without errors exceeds it
    kept, missed = (headline.headline(made, accepted) for accepted in (0.5, 0.001))
    first, second = r"at most 50 % exceed 630 N on cross1\.F .*", "The joint without errors exceeds 630 N"
    assert (kept.answer, missed.answer) == ("yes", "no")
    assert re.match(rf"{first}\. {second}", kept.words)
    assert missed.words.startswith("the joint without errors exceeds 630 N on cross1.F (640 N). ")


def test_joints_without_a_result_have_a_cause_and_a_remedy(tmp_path):
    said, card = everywhere(interfering(tmp_path), 0.01)
    assert said["notes"][0].startswith("36 outside_model: ")
    assert "Row 1: check the units" in said["notes"][0]
    assert card.notes == tuple(said["notes"])


def test_pending_joints_are_told(tmp_path):
    said, _ = everywhere(synthetic.store(tmp_path, study(600), simulated=300), 0.05)
    assert said["answer"] == "kept"
    assert said["notes"] == ["301 of 600 joints are still pending"]


@pytest.mark.parametrize(("simulated", "mark"), [(31, "open"), (None, "")])
def test_the_number_of_joints_is_marked_as_open_while_joints_are_pending(tmp_path, simulated, mark):
    path = synthetic.store(tmp_path, simulated=simulated)
    page.write_page(path, tmp_path / "page.html", accepted=0.05, replay=0)
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    (found,) = re.findall(r'<li( class="\w+")?><b>(\d+)</b><span>joints simulated</span>', text)
    assert found == (f' class="{mark}"' if mark else "", "30" if simulated else "60")


def test_a_limit_that_is_not_kept_leads_with_its_share(tmp_path):
    said, card = everywhere(synthetic.store(tmp_path), 0.05)
    low, high = clopper_pearson(20, 60)
    interval = f"{100 * low:.3g} .. {100 * high:.3g} %"
    assert said["sentence"] == (f"not kept: 33.3 % ({interval}); 5 % is accepted. Most often 700 N on cross1.F: 33.3 %")
    assert said["notes"] == ["of 7 limits, each by itself: 1 not kept, 6 open"]
    assert card.shade == "no"


def test_the_page_predicts_the_next_delivery(tmp_path):
    path = synthetic.store(tmp_path)
    with ResultFile.open(path) as store:
        cards = page.compose(store.view(), Asked(path, 0.05)).sections[0].blocks[0].cards
    low, high = prediction.of_counts(20, 20, 60, 1000)
    (found,) = (card for card in cards if card.words.startswith("of the next"))
    assert found.value == f"{low:.0f} .. {high:.0f}"
    assert found.words == "of the next 1000 joints exceed at least one limit"


def apart(each):
    """Campaign of 2000 joints: as many of them, others for each of two limits, are above it."""

    def change(results):
        results["F_max"][:] = 600.0
        for k, (above, place) in enumerate(((each, 0), (each, 3))):
            results["F_max"][k * each : k * each + above, place] = 900.0

    return view(2001, limits={"cross1.F": 700.0, "cross4.F": 800.0}, change=change)


def test_the_verdict_is_on_the_joints_that_exceed_any_limit():
    made = apart(60)
    assert [verdict(row, 0.04) for row in exceedance.limit_rows(made)] == ["yes", "yes"]
    found = headline.headline(made, 0.04)
    low, high = clopper_pearson(120, 2000)
    assert found.answer == "no"
    assert found.words == (
        f"6 % ({100 * low:.3g} .. {100 * high:.3g} %); "
        "4 % is accepted. Most often 700 N on cross1.F: 3 %, 1 other limit as often"
    )
    assert found.notes == ("of 2 limits, each by itself: 2 kept",)


def test_joints_that_would_decide_are_given_for_the_joint_verdict_only():
    settled = headline.headline(apart(60), 0.031)  # each limit is open by itself
    assert settled.notes == ("of 2 limits, each by itself: 2 open",)
    still = headline.headline(apart(60), 0.055)
    assert still.answer == "open"
    number = texts.number(needed(0.06, 0.055))
    words = f"; 5.5 % is accepted; {number} joints decide it in 90 % of campaigns if 6 % is the true share. Most often"
    assert words in still.words
    assert headline.headline(apart(60), 0.08).words.startswith("at most 8 % exceed at least one limit (6 %, ")


def test_the_joint_verdict_covers_joints_without_a_load():
    row = exceedance.all_limits(view(failed=3, limits={"cross1.F": 2000.0, "cross2.F": 3000.0}))
    assert (row["count"], row["n_failed"]) == (0, 3)
    assert ends(row)[1] == pytest.approx(clopper_pearson(3, 200)[1])


def test_of_limits_that_are_exceeded_equally_often_the_leading_load_is_named_and_marked():
    def alike(results):
        results["F_max"][:, 2] = 1.2 * results["F_max"][:, 1]

    made = view(limits={"cross2.F": 700.0, "cross3.F": 840.0, "fork1.F": 5000.0}, change=alike)
    above = [made.load(name).above(made.limits[name]).count for name in made.limits]
    assert above[0] == above[1] > 0
    assert made.leading == ("cross2.F",) or made.leading == ("cross3.F",)
    found = headline.headline(made, 0.01)
    assert found.load == made.leading[0]
    assert f"on {found.load}: " in found.words


@pytest.mark.parametrize(("failed", "shown"), [(0, "100 %"), (9, r"\d.* \.\. 100 %")])
def test_a_share_that_joints_without_a_result_decide_is_shown_as_its_interval(failed, shown):
    made = headline.headline(view(failed=failed, limits={"cross1.F": 2000.0}))
    assert made.answer == ""
    assert re.fullmatch(shown, made.value)


def test_joints_that_would_decide_count_those_without_a_result():
    made = view(failed=2, limits={"cross1.F": 2000.0})
    row = exceedance.limit_rows(made)[0]
    proviso = "in 90 % of campaigns if 1 %, joints without a valid load included, is the true share"
    assert headline._deciding(row, 0.02) == f"{needed(2 / 200, 0.02):.0f} joints decide it {proviso}"
    assert needed(2 / 200, 0.02) > needed(0.0, 0.02)
    near = exceedance.limit_rows(view(failed=1, limits={"cross1.F": 2000.0}))[0]
    assert headline._deciding(near, 0.003) == "no number of joints would decide it"
