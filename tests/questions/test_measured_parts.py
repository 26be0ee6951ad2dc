"""Tolerances known from measured parts: what the parts leave open is simulated, and the verdict tells it."""

import numpy as np
import pytest
from scipy.stats import norm

from tests.questions.test_assumptions import TEXT, made, simulated, stand_in_with
from tolstat.questions.assumptions.answer import assumptions
from tolstat.report import headline
from tolstat.store import ResultFile

KNOWN = TEXT.replace("cpk = 1.0 }", "cpk = 1.0, known_from = 10 }")
OPEN = "10 parts of pin*.offset_z measured: their spread is known to −27 … +65 %"


@pytest.fixture
def file(tmp_path, monkeypatch):
    stand_in_with(monkeypatch)
    return made(tmp_path, KNOWN)


def verdict(path, accepted=np.nan):
    with ResultFile.open(path) as store:
        return headline.headline(store.view(), accepted)


def test_spread_and_mean_at_both_ends_are_variations_of_the_same_joints(file):
    simulated(file)
    with ResultFile.open(file) as store:
        table = assumptions(store.view(), 0.2).frame("assumptions").set_index("label")
    # the load is above the limit where the offset is beyond 1.5 deviations of the study
    for spread, mean, label in (
        (0.729, 0.0, "spread of pin*.offset_z × 0.729"),
        (1.645, 0.0, "spread of pin*.offset_z × 1.65"),
        (1.0, -0.58, "mean of pin*.offset_z −0.58 σ"),
        (1.0, 0.58, "mean of pin*.offset_z +0.58 σ"),
    ):
        truth = norm.sf((1.5 - mean) / spread) + norm.cdf((-1.5 - mean) / spread)
        row = table.loc[label]
        assert row["share_lower"] < truth < row["share_upper"], label
        assert row["because"] == "10 parts measured"
    assert table.loc["spread of pin*.offset_z × 1.65", "turns"]
    assert "spread of pin*.offset_z × 1.65" in table.loc["all at worse values", "because"]


def test_the_verdict_has_a_sentence_on_the_parts_and_stays_one(file):
    assert f". {OPEN}" in verdict(file).words
    assert "with the larger one" not in verdict(file).words
    simulated(file)
    with ResultFile.open(file) as store:
        table = assumptions(store.view()).frame("assumptions").set_index("label")
    share = table.loc["spread of pin*.offset_z × 1.65", "share"]
    assert verdict(file).words.endswith(f"{OPEN}; with the larger one {100 * share:.3g} %")
    turned = verdict(file, 0.2)
    assert turned.sentence.startswith("kept as drawn")
    assert "find out the spread of pin*.offset_z" in turned.words
    assert turned.words.endswith(f"with the larger one {100 * share:.3g} %")


def test_more_parts_later_narrow_what_is_open_and_exact_tolerances_leave_nothing(file):
    source = file.with_suffix(".toml")
    source.write_text(KNOWN.replace("known_from = 10", "known_from = 200"), encoding="utf-8")
    with ResultFile.open(file) as store:
        assert "200 parts of pin*.offset_z measured: their spread is known to −8 … +9 %" in (
            headline.headline(store.view(source)).words
        )
        source.write_text(TEXT, encoding="utf-8")
        assert "measured" not in headline.headline(store.view(source)).words
