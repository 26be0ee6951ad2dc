"""Coverage of intervals: a wrong estimator is found, every statistic is there, and the package's intervals pass."""

from __future__ import annotations

import numpy as np
import pytest

from tests.measure.coverage import page, run
from tests.measure.coverage.__main__ import main
from tests.measure.coverage.statistics import CONTROL, STATISTICS
from tests.measure.coverage.trial import Asked, Experiment, Found, Row
from tolstat.common.errors import InputError


def coin(above: float, below: float) -> Experiment:
    """An interval about 0 that is above it, and below it, with these probabilities; refused in one of ten seeds."""

    def once(rng):
        u, given = rng.random(), rng.random() > 0.1
        at = 2.0 if u < above else -2.0 if u > 1.0 - below else 0.0
        return [Found(at - 1.0, at + 1.0, 0.0, given)]

    return Experiment((Asked("share", "a coin", 10, fresh=4.0),), once)


def test_misses_are_counted_by_side_and_refusals_apart():
    row = run.measure(400, among=(coin(0.2, 0.05),)).rows[0]
    assert row.seeds == 400
    assert 340 <= row.given <= 380
    assert row.above / row.given == pytest.approx(0.2, abs=0.06)
    assert row.below / row.given == pytest.approx(0.05, abs=0.035)
    assert row.width == 0.5
    covered, lower, upper = row.covered
    assert lower < covered == 1.0 - (row.above + row.below) / row.given < upper


def test_what_is_done_is_kept_after_every_chunk_of_seeds():
    kept = []
    found = run.measure(120, among=(coin(0.2, 0.05),), keep=kept.append)
    assert [part.rows[0].seeds for part in kept] == [50, 100, 120]
    assert kept[-1] == found


def test_a_side_that_misses_too_often_is_found_and_chance_is_not():
    judged = [run.measure(200, among=(coin(*sides),)) for sides in ((0.2, 0.0), (0.0, 0.15), (0.025, 0.025))]
    assert [len(found.failed) for found in judged] == [1, 1, 0]


def test_an_interval_without_ends_is_refused():
    nothing = Experiment((Asked("share", "none", 1),), lambda rng: [Found(np.nan, np.nan, 0.0)])
    row = run.measure(20, among=(nothing,)).rows[0]
    assert (row.given, np.isnan(row.covered[0])) == (0, True)
    assert "-" in page.text(run.Coverage([row]))


def test_every_statistic_is_asked_and_every_case_once():
    asked = [own for one in run.experiments() for own in one.asked]
    assert {own.statistic for own in asked} == set(STATISTICS)
    assert len({own[:3] for own in asked}) == len(asked)


def test_the_estimator_that_is_wrong_on_purpose_is_found_and_shares_pass():
    found = run.measure(run.QUICK, only=CONTROL)
    assert found.rows
    assert found.controls_pass == []
    right = tuple(one for one in run.experiments() if one.asked[0].statistic == "share" and one.asked[0].n == 64)[:1]
    assert run.measure(run.QUICK, among=right).failed == []


@pytest.mark.slow
def test_every_interval_covers_in_one_experiment():
    first = {one.asked[0].statistic: one for one in reversed(run.experiments())}
    found = run.measure(25, among=tuple(dict.fromkeys(first.values())))
    assert {row.asked.statistic for row in found.rows} == set(STATISTICS)
    assert found.failed == []


def test_the_program_prints_tables_and_writes_them_into_a_document(tmp_path, capsys):
    file = tmp_path / "page.md"
    file.write_text("# Page\n\n<!-- coverage -->\n<!-- end of coverage -->\n", encoding="utf-8")
    call = ["--only", "on purpose", "--seeds", "200", "--workers", "1"]
    assert main([*call, "--into", str(file), "--cases"]) == 0
    shown = capsys.readouterr().out
    assert "found in every case" in shown
    assert "lognormal, 0.05" in shown
    text = file.read_text(encoding="utf-8")
    widths = {line.count("|") for line in text.splitlines() if line.startswith("| ")}
    assert widths == {9}


def test_a_statistic_that_is_not_there_is_refused():
    with pytest.raises(InputError, match="--only"):
        main(["--only", "quantil of"])


def test_the_program_fails_where_an_interval_misses(monkeypatch, capsys):
    found = run.Coverage([Row(Asked("share", "made up", 10), 100, 100, 20, 0, np.nan)])
    monkeypatch.setattr(run, "measure", lambda *_, **__: found)
    assert main([]) == 1
    assert "made up" in capsys.readouterr().err
    known = run.Coverage([found.rows[0]._replace(asked=Asked("share", "made up", 10, known="a coin"))])
    monkeypatch.setattr(run, "measure", lambda *_, **__: known)
    assert main([]) == 0
    assert "(a coin)" in capsys.readouterr().out
