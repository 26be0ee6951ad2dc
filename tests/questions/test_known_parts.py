"""Tolerances known from measured parts, from TOML to page: one campaign, any number of parts, the same joints."""

import numpy as np
import pytest

from tests.sampling.test_importance import load, weight_of
from tests.support import synthetic
from tolstat import sampling
from tolstat.analysis.process import Known
from tolstat.campaign import extend, run
from tolstat.common.errors import NotApplicable
from tolstat.questions.parts import known_parts
from tolstat.report import headline, page
from tolstat.store import ResultFile

PLAN = (
    synthetic.STUDY.replace("[sampling]\nn = 60", '[sampling]\nmethod = "importance"\nn = 400')
    .replace("cpk = 1.0 }", "cpk = 1.0, known_from = 30 }")
    .partition('"fork*.T"')[0]
    .replace("[limits]", '[solver]\nfidelity = "ideal"\n[limits]')
    + '"pin1.contact" = "800 N"\n[[proposal]]\nshare = 0.8\nparts = { "pin*.offset_t" = 30 }\n'
)
RANDOM = PLAN.partition("[[proposal]]")[0].replace('method = "importance"\n', "")


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    return synthetic.store(tmp_path_factory.mktemp("known"), PLAN)


def test_weights_are_ratios_to_the_mixture_and_rows_depend_on_their_number_only(tmp_path):
    plan = load(tmp_path, PLAN)
    errors, origin = sampling.draw(plan), weight_of(plan)
    np.testing.assert_array_equal(errors[70:90], sampling.draw(plan, range(70, 90)))
    np.testing.assert_array_equal(origin[70:90], weight_of(plan, range(70, 90)))
    w = origin["weight"][1:]
    z = np.stack([errors[name][1:] for name in plan.tolerances]) * 3e4
    assert w.mean() == pytest.approx(1.0, abs=4 * w.std() / np.sqrt(w.size))
    assert (w * np.square(z)).mean() == pytest.approx(1.0, abs=0.1)
    assert plan.proposals[0].processes[0].known == Known(30, 4)
    assert plan.identity()["proposal"][0][1]["parts"] == [[30, list(plan.tolerances)]]


def test_more_parts_later_narrow_the_verdict_and_too_few_are_refused(stored, tmp_path):
    spans, answers = [], []
    with ResultFile.open(stored) as store:
        own = stored.with_suffix(".toml")
        for parts in (6, 30, 3000):
            text = PLAN.replace("known_from = 30", f"known_from = {parts}")
            view = store.view(own)
            own.write_text(text, encoding="utf-8")
            row = known_parts(view).tables["intervals"].rows[0]
            spans.append(row["both_upper"] - row["both_lower"])
            answers.append(headline.headline(view, 0.9).answer)
            assert row["lower"] <= row["estimate"] <= row["upper"]
    assert np.isnan(spans[0])
    assert spans[2] < spans[1]
    assert answers[0] == "none"


def test_random_joints_do_not_support_what_few_parts_leave_open_and_the_remedy_is_told(tmp_path):
    with ResultFile.open(synthetic.store(tmp_path, RANDOM.replace("known_from = 30", "known_from = 8"))) as store:
        found, answer = headline.headline(store.view(), 0.5), known_parts(store.view())
    assert found.answer == "none"
    table, words = answer.parts
    assert np.isnan(table.rows[0]["both_upper"])
    assert words.text.startswith("The joints do not support ")
    assert 'parts = { "pin*.offset_t" = 8 }' in words.text
    assert 'parts = { "pin*.offset_t" = 8 }' in found.words


def test_tolerances_that_are_exact_leave_nothing_open(tmp_path):
    exact = synthetic.store(tmp_path, RANDOM.replace(", known_from = 30", ""))
    with ResultFile.open(exact) as store, pytest.raises(NotApplicable, match="no share that measured parts leave open"):
        known_parts(store.view())


@pytest.mark.slow
def test_the_page_has_the_three_intervals(stored, tmp_path):
    stored.with_suffix(".toml").write_text(PLAN, encoding="utf-8")
    text = page.write_page(stored, tmp_path / "page.html", accepted=0.5, replay=0).read_text(encoding="utf-8")
    assert "Tolerances known from measured parts" in text
    assert "pin*.offset_t from 30" in text


@pytest.mark.slow
def test_the_file_is_the_same_for_blocks_slices_and_interruptions(tmp_path):
    plan = load(tmp_path, PLAN, n=40)
    whole = tmp_path / "whole.h5"
    run.run(plan, whole, workers=1, block=40, check=False)
    parts = []
    for rows in (range(17), range(17, 41)):
        parts.append(tmp_path / f"part{rows.start}.h5")
        run.run(plan, parts[-1], workers=1, rows=rows, check=False)
    extend.merge(parts, tmp_path / "merged.h5")
    run.run(plan, tmp_path / "stopped.h5", workers=1, block=7, until_row=20, check=False)
    other = load(tmp_path, PLAN.replace("known_from = 30", "known_from = 300"), n=40)  # the same study: it resumes
    run.run(other, tmp_path / "stopped.h5", workers=2, block=5, check=False)
    with ResultFile.open(whole) as first:
        for name in ("merged", "stopped"):
            with ResultFile.open(tmp_path / f"{name}.h5") as second:
                for read in ("errors", "results", "origin"):
                    assert getattr(first, read)().tobytes() == getattr(second, read)().tobytes(), (name, read)
