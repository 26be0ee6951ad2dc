"""Parts that are scrapped and joints that are rejected: against counts, closed forms, and prices."""

import json

import numpy as np
import pytest
from scipy.stats import norm
from typer.testing import CliRunner

from tests.support import synthetic
from tolstat import study
from tolstat.analysis import binomial
from tolstat.cli import app
from tolstat.common.errors import InputError, NotApplicable
from tolstat.display.answer import Asked
from tolstat.joint import nominal_errors
from tolstat.questions import parts as question
from tolstat.report import page
from tolstat.store import ResultFile
from tolstat.study.selective import Gauge

ENTRY = '"pin*.offset_t" = { plus_minus = "0.1 mm", distribution = "normal", cpk = 0.4, gauge = "GAUGE" }'
PLAN = (
    synthetic.STUDY.partition('"fork*.T"')[0]
    .replace('"pin*.offset_t" = { plus_minus = "0.1 mm", distribution = "normal", cpk = 1.0 }', ENTRY)
    .replace("n = 60", "n = 500")
    + '[reject]\n"pin1.offset_t" = { above = "0.05 mm" }\n"pin*.clearance" = { below = "0.09 mm", gauge = "0.01 mm" }\n'
)


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    return synthetic.store(tmp_path_factory.mktemp("sorting"), PLAN.replace("GAUGE", "0 mm"))


def load(folder, text):
    (folder / "plan.toml").write_text(text, encoding="utf-8")
    return study.load(folder / "plan.toml")


def accepted(values, lower, upper, deviation):
    errors = nominal_errors(len(values))
    errors["pin1.offset_t"] = values
    return Gauge("pin1.offset_t", lower, upper, deviation).accepted(errors, None)


def test_a_gauge_accepts_what_it_measures_inside():
    rng = np.random.default_rng(1)
    x = np.array([-0.9, 0.0, 0.7, 1.2])
    measured = x[:, None] + 0.3 * rng.standard_normal((4, 100_000))
    found = accepted(x, -1.0, 1.0, 0.3)
    np.testing.assert_allclose(found, (abs(measured) < 1.0).mean(axis=1), atol=0.006)
    np.testing.assert_array_equal(accepted(x, -1.0, 1.0, 0.0), [1.0, 1.0, 1.0, 0.0])
    np.testing.assert_allclose(accepted(x, -np.inf, 1.0, 0.3), norm.cdf((1.0 - x) / 0.3))


def test_an_exact_gauge_gives_what_counting_the_joints_that_are_kept_gives(stored):
    with ResultFile.open(stored) as store:
        view = store.view()
        answer = question.sorting(view)
        errors, force = view.errors(np.arange(view.n)), view.load("cross1.F").values
    stages, parts = answer.frame("stages").set_index("stage"), answer.frame("parts").set_index("part")
    kept = np.all([abs(errors[f"pin{i}.offset_t"]) <= 1e-4 for i in (1, 2, 3, 4)], axis=0)
    count = ((force > 700.0) & kept).sum()
    row = stages.loc[question.SCRAPPED]
    assert row["estimate"] == pytest.approx(count / kept.sum())
    ends = binomial.clopper_pearson(count, kept.sum())
    assert (row["lower"], row["upper"]) == (pytest.approx(ends[0], abs=2e-3), pytest.approx(ends[1], abs=2e-3))
    # all clearances are 0.1 mm, and the gauge of each pin rejects the same share
    passed = norm.cdf(1.0) ** 4 * (errors["pin1.offset_t"] <= 5e-5)[kept].mean()
    assert stages.loc[question.INSPECTED, "rejected"] == pytest.approx(1.0 - passed)
    assert stages.loc[question.MADE, "rejected"] == 0.0
    assert parts.loc["cross", "scrapped"] == pytest.approx(1.0 - kept.mean())
    assert parts.loc["input fork", "scrapped"] == 0.0


def test_a_cost_table_prices_parts_and_joints(stored, tmp_path):
    table = tmp_path / "costs.toml"
    table.write_text('"pin*.offset_t" = { cost = 5.0, fixed = 1.0, at = "0.2 mm" }\n', encoding="utf-8")
    with ResultFile.open(stored) as store:
        answer = question.sorting(store.view(), table)
    cross = answer.tables["parts"].rows[0]
    assert cross["cost"] == pytest.approx(4 * (1.0 + 4.0 * 2.0))
    assert cross["cost_used"] == pytest.approx(cross["cost"] / (1.0 - cross["scrapped"]))
    last = answer.tables["stages"].rows[-1]
    assert last["cost"] == pytest.approx(cross["cost_used"] / (1.0 - last["rejected"]))
    assert last["cost_good"] == pytest.approx(last["cost"] / (1.0 - last["estimate"]))
    done = CliRunner().invoke(app, ["sorting", str(stored), "--costs", str(table), "--json"])
    assert json.loads(done.stdout)["tables"]["parts"]["rows"][0]["cost"] == pytest.approx(cross["cost"])


def test_a_wide_gauge_sorts_less_and_neither_is_part_of_the_identity(tmp_path):
    exact, wide = (load(tmp_path, PLAN.replace("GAUGE", size)) for size in ("0 mm", "0.1 mm"))
    plain = load(tmp_path, PLAN.partition("[reject]")[0].replace(', gauge = "GAUGE"', ""))
    assert exact.identity() == wide.identity() == plain.identity()
    assert [gauge.deviation for gauge in wide.rejects] == [0.0, 1e-5, 1e-5, 1e-5, 1e-5]


@pytest.mark.parametrize(
    ("changed", "found"),
    [
        (('gauge = "GAUGE"', 'gauge = "-1 um"'), "must not be negative"),
        (('gauge = "GAUGE"', 'gauge = "1 um", truncate = true'), "none are left to scrap"),
        (('{ above = "0.05 mm" }', '{ gauge = "0.05 mm" }'), "rejects nothing"),
        (('{ above = "0.05 mm" }', '{ above = "0.05 mm", below = "0.06 mm" }'), "every joint is rejected"),
        (('"pin1.offset_t" = { above', '"operation.alpha" = { above'), "selects nothing"),
    ],
)
def test_every_fault_is_told(tmp_path, changed, found):
    with pytest.raises(InputError, match=found):
        load(tmp_path, PLAN.replace(*changed).replace("GAUGE", "0 mm"))


def test_a_study_that_sorts_nothing_has_no_section_and_no_answer(tmp_path):
    with ResultFile.open(synthetic.store(tmp_path)) as store:
        view = store.view()
        with pytest.raises(NotApplicable):
            question.sorting_on_page(view, Asked(view.path))
        with pytest.raises(NotApplicable, match="sorts nothing"):
            question.sorting(view)


@pytest.mark.slow
def test_the_page_has_yield_and_cost(stored, tmp_path):
    text = page.write_page(stored, tmp_path / "page.html", accepted=0.5, replay=0).read_text(encoding="utf-8")
    assert "Parts scrapped, joints rejected" in text
    assert "a good joint costs" in text
