"""Lots: shares of lots and deliveries, what refuses joints that share lots, and a campaign from TOML to page."""

import json
from functools import partial

import numpy as np
import pytest
from typer.testing import CliRunner

import tolstat
from tests.support import exceedance, fakes, synthetic
from tests.support.views import view
from tolstat import sampling
from tolstat.analysis import clustered
from tolstat.campaign import stop_rule
from tolstat.campaign.extend import merge
from tolstat.cli import app
from tolstat.common.errors import InputError, NotApplicable, StoreError
from tolstat.common.loads import ANY_LIMIT
from tolstat.common.tables import Status
from tolstat.display import drawing
from tolstat.display.answer import Asked
from tolstat.display.table import fitted
from tolstat.questions import lots as question
from tolstat.questions.capability import capability

LIMIT = {"cross1.F": 700.0, "fork1.T": 40.0}
STUDY = (
    synthetic.HEAD
    + """[solver]
fidelity = "quasistatic"
steps_per_rev = 12
[tolerances]
"pin*.tilt_z" = { plus_minus = "0.5 deg", distribution = "normal", lot = { share = 0.6 } }
"pin*.diameter" = { plus_minus = "0.015 mm", distribution = "normal", lot = { share = 0.5, shared = true } }
[limits]
"cross*.F" = "0.9 N"
[sampling]
seed = 3
n = 60
"""
)


def of_lots(n=801, size=20, **kwargs):
    made = view(n, limits=LIMIT, **kwargs)
    made.store.sampling["joints_per_lot"] = size
    return made


def test_table_counts_lots_and_predicts_the_next_delivery():
    made = of_lots()
    answer = question.lots(made, delivery=100, accepted=0.1)
    above = made.load(ANY_LIMIT).values > 1.0
    by_lot = above.reshape(-1, 20).sum(axis=1)
    row = answer.tables["limits"].rows[-1]
    assert (answer.frame("lots")[ANY_LIMIT] == by_lot).all()
    assert answer.facts == {"joints_per_lot": 20}
    assert (row["lots"], row["n"], row["count"]) == (40, 800, above.sum())
    assert row["without"] == np.mean(by_lot == 0)
    best = np.sort(by_lot) / 20
    assert (row["median"], row["high"], row["worst"]) == (best[[19, 20]].mean(), best[35], best[39])
    assert row["lower"] < row["estimate"] == above.mean() < row["upper"]
    predicted = clustered.delivery(by_lot, np.full(40, 20), 100)
    assert (row["next_lower"], row["next_upper"]) == predicted.ends()
    assert row["bad"] == predicted.more_than(0.1)
    assert "bad deliveries: more than 10 % of the joints above" in [getattr(part, "text", "") for part in answer.parts]
    table, plain = answer.tables["limits"], question.lots(made).tables["limits"]
    assert "bad deliveries" in fitted(table.columns, table.rows)[0]
    assert "bad deliveries" not in fitted(plain.columns, plain.rows)[0]


def test_joints_without_a_load_count_both_ways():
    def lose(table):
        table["status"][:60] = Status.NEWTON_FAILED
        for name in table.dtype.names:
            if table.dtype[name].base.kind == "f":
                table[name][:60] = np.nan

    whole, lossy = (question.lots(of_lots(change=change)).tables["limits"].rows[-1] for change in (None, lose))
    assert lossy["n_failed"] == 60
    assert lossy["next_upper"] > whole["next_upper"]
    assert lossy["upper"] > whole["upper"]


def test_joints_that_share_lots_are_not_independent_anywhere():
    made = of_lots()
    assert not made.design.has_interval("mean")
    assert made.design.has_interval("share")
    load = made.load("cross1.F")
    independent = exceedance.exceedance(load.values, load.status, 700.0)
    assert load.above(700.0).lower != independent.lower
    assert np.isnan(load.delivery(700.0, 1000)).all()
    assert capability(made).frame("limits")["cpk_lower"].isna().all()
    assert np.isfinite(capability(made).frame("limits")["ppm_lower"]).all()
    assert load.quantile(0.5).lower < load.quantile(0.5).estimate


def test_what_needs_independent_joints_is_refused(tmp_path):
    plan = question.study_of(tolstat.load(_study(tmp_path)), 30, 2)
    rule = stop_rule.parse("P(cross1.F > 700 N) width < 0.1", {})
    with pytest.raises(InputError, match="share lots"):
        stop_rule.run_until(plan, tmp_path / "a.h5", rule, print)
    assert question.study_of(tolstat.load(plan.path)).sampling.joints_per_lot == question.JOINTS


def test_fewer_than_thirty_lots_and_joints_on_their_own_are_refused():
    with pytest.raises(StoreError, match="joints of 29 lots"):
        question.lots(of_lots(n=29 * 20 + 1))
    assert np.isnan(of_lots(n=29 * 20 + 1).load("cross1.F").above(700.0).lower)
    with pytest.raises(NotApplicable, match="its own lot"):
        question.lots(view(limits=LIMIT))
    with pytest.raises(NotApplicable):
        question.lots_on_page(view(limits=LIMIT), Asked("a.h5"))
    (few,) = question.lots_on_page(of_lots(n=29 * 20 + 1), Asked("a.h5")).parts
    assert few.text == "No lots: has joints of 29 lots simulated, and fewer than 30 have no interval."
    with pytest.raises(InputError, match="600 lots of 500 joints"):
        question.lots(of_lots(), from_lots=600)


def test_a_delivery_of_more_lots_than_joints_is_refused_before_anything_is_simulated(tmp_path):
    words = ["lots", str(_study(tmp_path)), "--delivery", "5", "--from-lots", "6", "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(app, words)
    assert (done.exit_code, (tmp_path / "out").exists()) == (2, False)
    assert "6 lots of 5 joints" in done.stderr


def _study(folder):
    path = folder / "small.toml"
    path.write_text(STUDY, encoding="utf-8")
    return path


def _bytes(path):
    with tolstat.open(path) as store:
        return store.errors().tobytes(), store.results().tobytes()


def _perturb(joint, operation, errors):
    """Parameters of the fake joints: their load depends on the scores of two errors."""
    params = fakes.perturb(joint, operation, errors)
    params["R"] = errors["pin1.tilt_z"] / np.radians(0.5) + errors["pin2.diameter"] / 1.5e-5
    return params


@pytest.mark.slow
def test_from_toml_to_page_with_the_same_bytes_however_it_is_run(tmp_path):
    plan = question.study_of(tolstat.load(_study(tmp_path)), 30, 4)
    whole, merged, stopped = (tmp_path / f"{name}.h5" for name in ("whole", "merged", "stopped"))
    run = partial(fakes.run, plan, block=None, draw_blocks=sampling.draw_blocks, perturb=_perturb)
    run(whole)
    parts = [tmp_path / "a.h5", tmp_path / "b.h5"]
    for part, rows in zip(parts, (range(24), range(24, 121)), strict=True):  # a lot is cut
        run(part, block=30, rows=rows)
    merge(parts, merged)
    run(stopped, until_row=17)
    with pytest.raises(StoreError, match="joints of 4 lots"), tolstat.open(stopped) as store:
        tolstat.lots(store.view())
    run(stopped, block=50)
    assert [_bytes(path) == _bytes(whole) for path in (merged, stopped)] == [True, True]
    done = CliRunner().invoke(app, ["lots", str(whole), "--json"])
    assert len(json.loads(done.stdout)["tables"]["lots"]["rows"]) == 30
    with tolstat.open(whole) as store:
        assert store.view().study.sampling.joints_per_lot == 4
        answer = question.lots_on_page(store.view(), Asked(whole))
    panel = answer.parts[0].panels[0]
    assert panel.title == "30 lots: which share of their joints is bad"
    assert "path" in drawing.svg(panel)[0]


@pytest.mark.slow
def test_command_simulates_a_study_into_a_folder_and_options_of_a_simulation_need_a_study(tmp_path, monkeypatch):
    fakes.replace_functions(monkeypatch, **fakes.FUNCTIONS | {"draw_blocks": sampling.draw_blocks, "perturb": _perturb})
    words = ["lots", str(_study(tmp_path)), "--lots", "30", "--joints", "3", "--workers", "1"]
    out = tmp_path / "out"
    done = CliRunner().invoke(app, [*words, "--out", str(out)])
    assert done.exit_code == 0, done.stderr
    names = ["small_lots.h5", *(f"small_lots_{name}" for name in ("limits.csv", "lots.csv", "lots.png", "lots.svg"))]
    assert sorted(path.name for path in out.iterdir()) == names
    again = CliRunner().invoke(app, ["lots", str(out / "small_lots.h5"), "--delivery", "60"])
    assert "of 60" in again.stdout
    refused = CliRunner().invoke(app, ["lots", str(out / "small_lots.h5"), "--lots", "40"])
    assert refused.exit_code == 2
    assert "hint: give a study (TOML)" in refused.stderr
