"""Verdicts on required lives: the same in text, JSON and on the page, beside the one on limits or in its place."""

from __future__ import annotations

import json

import pytest

import tolstat
from tests.questions.test_bearing_life import STUDY
from tests.support import synthetic, views
from tests.support.reports import call
from tolstat.display import text
from tolstat.display.answer import Asked
from tolstat.display.blocks import Decision
from tolstat.display.verdict import on_share
from tolstat.questions.bearing_life import answer as bearing_life
from tolstat.report import page
from tolstat.report.headline import life_verdicts
from tolstat.store import ResultFile

LIMITED = STUDY.replace("[sampling]", '[limits]\n"cross1.F" = "700 N"\n[sampling]')


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.parametrize(("study", "place"), [(STUDY, 0), (LIMITED, 1)])
def test_report_json_and_page_give_the_same_verdict(tmp_path, study, place):
    path = synthetic.store(tmp_path, study)
    with ResultFile.open(path) as store:
        (found,) = life_verdicts(store.view(), 0.1)
        assert (found,) == tuple(bearing_life.life_verdicts(store.view(), 0.1))
        section = page.decision(store.view(), Asked(path, 0.1))
        assert tolstat.statistics(store.view(), 0.1)["lives"] == [found.values()]
    done = call("report", path, "--accept", "10 %")
    assert text.sentence(found.sentence) in " ".join(done.stdout.split())
    assert json.loads(call("report", path, "--accept", "10 %", "--json").stdout)["facts"]["lives"] == [found.values()]
    (head,) = (block for block in section.blocks if isinstance(block, Decision))
    card = head.verdicts[place]
    assert (f"{card.value}: {card.words}", card.shade) == (found.sentence, found.answer)


def test_an_interval_up_to_the_accepted_share_is_kept_and_one_from_it_on_is_open():
    row = {"estimate": 0.05, "n": 100, "n_failed": 0, "n_unsettled": 0}
    for ends, answer in (((0.01, 0.05), "yes"), ((0.05, 0.09), "open"), ((0.06, 0.09), "no")):
        assert on_share("life", "fail", row, ends, 0.05, lambda share: 200.0).answer == answer


def test_a_life_that_cannot_be_rated_is_told_with_the_reason(tmp_path):
    with ResultFile.open(synthetic.store(tmp_path, STUDY.replace('needle_diameter = "4 mm"\n', ""))) as store:
        (found,) = life_verdicts(store.view(), 0.1)
    lacking = "small.h5: holds needle bearings without needle_diameter, which a rating life needs"
    assert found.sentence == f"No verdict: bearing life: {lacking}"


def test_no_verdict_on_what_is_not_required_or_no_sample(tmp_path):
    with ResultFile.open(synthetic.store(tmp_path, STUDY.replace('required_life = "20000 h"\n', ""))) as store:
        assert life_verdicts(store.view(), 0.1) == []
        assert "lives" not in tolstat.statistics(store.view(), 0.1)
    assert life_verdicts(views.swept(), 0.1) == []
