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
from tolstat.campaign import stop_rule
from tolstat.campaign.extend import merge
from tolstat.cli import app
from tolstat.common.cardan import CARDAN
from tolstat.common.errors import InputError
from tolstat.common.loads import ANY_LIMIT
from tolstat.common.tables import Status
from tolstat.display.answer import Sentence
from tolstat.questions.capability import LOTS, capability
from tolstat.questions.capability import of_lots as of_lots_in
from tolstat.report.page import write_page

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


def of_lots(n=801, size=20, limits=LIMIT, **kwargs):
    made = view(n, limits=limits, **kwargs)
    made.store.sampling["joints_per_lot"] = size
    return made


def lots_of(made, **kwargs):
    return capability(made, **kwargs).tables["lots"].rows[-1]


def test_table_has_the_shares_of_the_lots_and_the_next_delivery():
    made = of_lots()
    above = made.load(ANY_LIMIT).values > 1.0
    row, best = lots_of(made, delivery=100), np.sort(above.reshape(-1, 20).mean(axis=1))
    assert (row["load"], row["lots"]) == (ANY_LIMIT, 40)
    assert (row["median"], row["high"], row["worst"]) == (best[[19, 20]].mean(), best[35], best[39])
    assert (row["next_lower"], row["next_upper"]) == made.load(ANY_LIMIT).delivery(1.0, 100)
    assert row["next_lower"] < 100 * above.mean() < row["next_upper"]
    said = [part.text for part in capability(made, delivery=100).parts if isinstance(part, Sentence)]
    assert said[0] == "40 lots of 20 joints; delivery: 100 joints of one new lot, 95 % prediction interval"


@pytest.mark.parametrize(("high", "shown"), [(0.0, "0 %"), (0.05, "≥ 5 %")])
def test_the_share_of_one_lot_in_ten_is_reached_not_exceeded(high, shown):
    (column,) = [column for column in LOTS if column.head == "one lot in ten"]
    assert column.cell({"high": high}) == shown


def test_joints_without_a_load_count_both_ways():
    def lose(table):
        table["status"][:60] = Status.NEWTON_FAILED
        for name in table.dtype.names:
            if table.dtype[name].base.kind == "f":
                table[name][:60] = np.nan

    whole, lossy = (of_lots(change=change) for change in (None, lose))
    assert capability(lossy).frame("limits")["n_failed"].iloc[-1] == 60
    assert lots_of(lossy)["next_upper"] > lots_of(whole)["next_upper"]
    good = [capability(made).frame("limits").iloc[-1] for made in (whole, lossy)]
    assert good[1]["ppm_upper"] > good[0]["ppm_upper"]


def test_joints_that_share_lots_are_not_independent_anywhere():
    made = of_lots()
    assert not made.design.independent
    assert made.design.is_sample
    load = made.load("cross1.F")
    independent = exceedance.exceedance(load.values, load.status, 700.0)
    assert load.above(700.0).lower != independent.lower
    alone = view(801, limits=LIMIT).load("cross1.F")
    assert load.delivery(700.0, 1000)[1] > alone.delivery(700.0, 1000)[1]
    assert capability(made).frame("limits")["ppk_lower"].isna().all()
    assert np.isfinite(capability(made).frame("limits")["ppm_lower"]).all()
    assert load.quantile(0.5).lower < load.quantile(0.5).estimate


def test_what_needs_independent_joints_is_refused(tmp_path):
    rule = stop_rule.parse("P(cross1.F > 700 N) width < 0.1", {}, CARDAN)
    with pytest.raises(InputError, match="share lots"):
        stop_rule.run_until(_study(tmp_path, 2), tmp_path / "a.h5", rule, print)


def test_fewer_than_thirty_lots_and_joints_on_their_own_have_no_table():
    few = of_lots(n=29 * 20 + 1)
    (said,) = of_lots_in(few)
    assert said.text == "no shares of lots: joints of 29 lots simulated, 30 are needed"
    assert np.isnan(few.load("cross1.F").above(700.0).lower)
    assert np.isnan(few.load("cross1.F").delivery(700.0, 100)).all()
    assert of_lots_in(view(limits=LIMIT)) == []
    assert of_lots_in(of_lots(limits={})) == []


def _study(folder, size):
    """Study of thirty lots."""
    path = folder / "small.toml"
    path.write_text(STUDY.replace("n = 60", f"n = {30 * size}\njoints_per_lot = {size}"), encoding="utf-8")
    return tolstat.load(path)


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
    plan = _study(tmp_path, 4)
    whole, merged, stopped = (tmp_path / f"{name}.h5" for name in ("whole", "merged", "stopped"))
    run = partial(fakes.run, plan, block=None, draw_blocks=sampling.draw_blocks, perturb=_perturb)
    run(whole)
    parts = [tmp_path / "a.h5", tmp_path / "b.h5"]
    for part, rows in zip(parts, (range(24), range(24, 121)), strict=True):  # a lot is cut
        run(part, block=30, rows=rows)
    merge(parts, merged)
    run(stopped, until_row=17)
    with tolstat.open(stopped) as store:
        assert "lots" not in tolstat.capability(store.view()).tables
    run(stopped, block=50)
    assert [_bytes(path) == _bytes(whole) for path in (merged, stopped)] == [True, True]
    done = CliRunner().invoke(app, ["capability", str(whole), "--json"])
    row = json.loads(done.stdout)["tables"]["lots"]["rows"][-1]
    assert row["lots"] == 30
    done = CliRunner().invoke(app, ["export", str(whole), "--statistics", "-"])
    assert json.loads(done.stdout)["capability"]["tables"]["lots"]["rows"][-1] == row
    report = CliRunner().invoke(app, ["report", str(whole), "--out", str(tmp_path)])
    assert "Which share of a lot is above each limit" in report.stdout
    assert (tmp_path / "whole_lots.csv").exists()
    page = write_page(whole, tmp_path / "page.html", replay=0).read_text(encoding="utf-8")
    assert "of one new lot exceed" in page
