"""Lots: shares of lots and deliveries, what refuses joints that share lots, and a campaign from TOML to page."""

import json
from functools import partial

import numpy as np
import pytest
from typer.testing import CliRunner

import tolstat
from tests.support import fakes, synthetic
from tests.support.views import view
from tolstat import sampling
from tolstat.analysis import allocation, clustered, exceedance
from tolstat.campaign import stop_rule
from tolstat.campaign.extend import merge
from tolstat.cli import app
from tolstat.common.errors import InputError, StoreError
from tolstat.common.loads import ANY_LIMIT
from tolstat.common.tables import Status
from tolstat.display import drawing
from tolstat.display.asked import Asked
from tolstat.display.table import as_text
from tolstat.questions.capability import capability
from tolstat.questions.lots import query, rendering, section

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
    found = query.lots_of(made, delivery=100, accepted=0.1)
    above = made.load(ANY_LIMIT).values > 1.0
    by_lot = above.reshape(-1, 20).sum(axis=1)
    row = found.table.iloc[-1]
    assert (found.shares[ANY_LIMIT] == by_lot).all()
    assert (row["lots"], row["n"], row["count"]) == (40, 800, above.sum())
    assert row["without"] == np.mean(by_lot == 0)
    assert row["worst"] == by_lot.max() / 20
    assert row["lower"] < row["estimate"] == above.mean() < row["upper"]
    law = clustered.law_of(by_lot, np.full(40, 20)).delivery(100)
    assert (row["next_lower"], row["next_upper"]) == law.ends()
    assert row["bad"] == law.more_than(0.1)
    assert "more than 10 %" in rendering.note(found, 0.1)
    assert "bad deliveries" in as_text(rendering.COLUMNS, found.table)
    assert "bad deliveries" not in as_text(rendering.COLUMNS, query.lots_of(made).table)


def test_joints_without_a_load_count_both_ways():
    def lose(table):
        table["status"][:60] = Status.NEWTON_FAILED
        for name in table.dtype.names:
            if table.dtype[name].base.kind == "f":
                table[name][:60] = np.nan

    whole, lossy = (query.lots_of(of_lots(change=change)).table.iloc[-1] for change in (None, lose))
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
    plan = query.study_of(_study(tmp_path), 30, 2)
    rule = stop_rule.parse("P(cross1.F > 700 N) width < 0.1", {})
    with pytest.raises(InputError, match="share lots"):
        stop_rule.run_until(plan, tmp_path / "a.h5", rule, print)
    assert query.study_of(plan.path).sampling.joints_per_lot == query.JOINTS


def test_halves_are_of_whole_lots():
    lot = np.repeat(np.arange(7), 5)[3:]
    searched, checked = allocation.halves(lot, 100)
    assert set(lot[searched]) == {0, 2, 4, 6}
    assert set(lot[checked]) == {1, 3, 5}


def test_fewer_than_thirty_lots_and_joints_on_their_own_are_refused():
    with pytest.raises(StoreError, match="joints of 29 lots"):
        query.lots_of(of_lots(n=29 * 20 + 1))
    assert np.isnan(of_lots(n=29 * 20 + 1).load("cross1.F").above(700.0).lower)
    with pytest.raises(StoreError, match="its own lot"):
        query.lots_of(view(limits=LIMIT))
    assert section.sections(view(limits=LIMIT), None) == []


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
    plan = query.study_of(_study(tmp_path), 30, 4)
    whole, merged, stopped = (tmp_path / f"{name}.h5" for name in ("whole", "merged", "stopped"))
    run = partial(fakes.run, plan, block=None, draw_blocks=sampling.draw_blocks, perturb=_perturb)
    run(whole)
    parts = [tmp_path / "a.h5", tmp_path / "b.h5"]
    for part, rows in zip(parts, (range(24), range(24, 121)), strict=True):  # a lot is cut
        run(part, block=30, rows=rows)
    merge(parts, merged)
    run(stopped, until_row=17)
    with pytest.raises(StoreError, match="joints of 4 lots"), tolstat.open(stopped) as store:
        tolstat.lots_of(store.view())
    run(stopped, block=50)
    assert [_bytes(path) == _bytes(whole) for path in (merged, stopped)] == [True, True]
    done = CliRunner().invoke(app, ["lots", str(whole), "--json"])
    assert len(json.loads(done.stdout)["lots"]) == 30
    with tolstat.open(whole) as store:
        assert store.view().study.sampling.joints_per_lot == 4
        shown = section.sections(store.view(), Asked(whole))
    panel = shown[0].blocks[0].panels[0]
    assert panel.title == "30 lots: which share of their joints is bad"
    assert "path" in drawing.svg(panel)[0]
