"""Views of several operating points: the worst of them, and each of them."""

import numpy as np
import pytest

from tests.support import synthetic, views
from tests.support.cells import body, head
from tolstat.common.tables import Status
from tolstat.questions.causes.worst import _largest, joint_rows
from tolstat.questions.exceedance.answer import exceedance
from tolstat.report import page
from tolstat.report.headline import headline
from tolstat.solver import stationary
from tolstat.store import worst


@pytest.fixture
def tables():
    """Results of 200 joints and the nominal one at two points; the second load is larger in every other joint."""
    one, two = synthetic.results(201), synthetic.results(201)
    two["F_max"][::2] *= 1.5
    two["F_max"][1::2] *= 0.5
    one["status"][3], two["status"][5] = Status.NEWTON_FAILED, Status.NOT_SETTLED
    one["status"][7], two["status"][7] = Status.NOT_SETTLED, Status.CRASHED
    two["status"][9] = Status.STATIONARY
    two["F_max"][9], two["F_lower"][9], two["F_upper"][9] = 2 * one["F_max"][9], 0.4, 1.5
    return {"one": one, "two": two}


@pytest.fixture
def view(tables):
    return views.at_points(tables, {"cross1.F": 700.0, "cross1.F at two": 900.0, "fork1.T at one": 50.0})


def test_a_load_is_the_largest_over_the_points(view, tables):
    load = view.load("cross1.F")
    expected = np.maximum(tables["one"]["F_max"][1:, 0], tables["two"]["F_max"][1:, 0])
    valid = np.isin(load.status, (Status.OK, Status.STATIONARY))
    np.testing.assert_array_equal(load.values, np.where(valid, expected, np.nan))
    np.testing.assert_array_equal(view.simulated("cross1.F"), expected)
    assert load.nominal == max(tables[name]["F_max"][0, 0] for name in tables)


def test_a_joint_is_resolved_only_if_it_is_at_all_points(view):
    status = view.load("cross1.F").status
    expected = {2: Status.NEWTON_FAILED, 4: Status.NOT_SETTLED, 6: Status.CRASHED, 8: Status.STATIONARY}
    assert {k: Status(status[k]) for k in np.flatnonzero(status != Status.OK).tolist()} == expected
    assert view.load("cross1.F at one").status[4] == Status.OK
    row = exceedance(view).frame("limits").iloc[0]
    assert (row["n_failed"], row["n_unsettled"]) == (2, 1)
    assert view.first_without_load["status"].tolist() == [Status.NEWTON_FAILED, Status.NOT_SETTLED, Status.CRASHED]


def test_a_pending_joint_is_pending_at_the_worst(tables):
    tables["two"]["status"][11] = Status.PENDING
    tables["one"]["status"][11] = Status.NEWTON_FAILED
    assert views.at_points(tables).status[10] == Status.PENDING


def test_the_interval_of_a_stationary_joint_covers_both_points(view, tables):
    load = view.load("cross1.F")
    lower, upper = load.lower.values, load.upper.values
    at_one, at_two = (tables[name]["F_max"][9, 0] for name in ("one", "two"))
    assert lower[8] == max(at_one, 0.4 * at_two) == at_one
    assert upper[8] == 1.5 * at_two


def test_limits_hold_at_the_points_that_they_name(view, tables):
    table = exceedance(view).frame("limits").set_index("load")
    counts = {
        "cross1.F": ((tables["one"]["F_max"][1:, 0] > 700) | (tables["two"]["F_max"][1:, 0] > 700), 3),
        "cross1.F at two": (tables["two"]["F_max"][1:, 0] > 900, 2),
        "fork1.T at one": (tables["one"]["T_max"][1:, 4] > 50, 2),
    }
    for name, (above, lost) in counts.items():
        points = ["one", "two"] if name == "cross1.F" else [name[-3:]]
        valid = np.all([np.isin(tables[p]["status"][1:], (Status.OK, Status.STATIONARY)) for p in points], axis=0)
        assert table.loc[name, "count"] == np.count_nonzero(above & valid), name
        assert table.loc[name, ["n_failed", "n_unsettled"]].sum() == lost, name
    assert view.at("two").limits == {"cross1.F": 700.0}
    assert views.at_points(tables, {"cross1.F at two": 900.0}).at("one").limits == {}


def test_shares_at_each_point(view, tables):
    found = exceedance(view).frame("at_points").set_index("load")
    assert found.index.tolist() == ["cross1.F"]  # the other limits hold at one point
    for name, table in tables.items():
        own = table[1:][np.isin(table["status"][1:], (Status.OK, Status.STATIONARY))]
        assert found.loc["cross1.F", name] == np.mean(own["F_max"][:, 0] > 700)
    assert "at_points" not in exceedance(view.at("one")).tables


def test_the_worst_joints_name_their_point(view, monkeypatch):
    monkeypatch.setattr("tolstat.questions.causes.worst._scores", lambda view, samples: {})
    samples = _largest(view, "cross1.F", 20)[0]
    parts = np.stack([view.load(f"cross1.F at {name}").values[samples] for name in ("one", "two")])
    found = [joint["point"] for joint in joint_rows(view, "cross1.F", 20)]
    assert found == [("one", "two")[k] for k in parts.argmax(axis=0)]
    assert {joint["point"] for joint in joint_rows(view, "cross1.F at one", 20)} == {"one"}


def test_the_verdict_names_the_point(tables, view):
    for table in tables.values():
        table["status"][1:] = Status.OK
        stationary.fill_intervals(table)
    view = views.at_points(tables, {"cross1.F": 700.0})
    shares = {name: np.mean(table["F_max"][1:, 0] > 700) for name, table in tables.items()}
    assert shares["two"] != shares["one"]
    most = max(shares, key=shares.__getitem__)
    assert view.point_of("cross1.F") == most
    assert f" exceed 700 N on cross1.F (most often at {most}) (" in headline(view, 0.01).sentence
    assert "most often" not in headline(views.at_points(tables, {"cross1.F at one": 700.0}), 0.01).sentence
    assert view.head() == "200 joints (random sampling), each at one and two, 0 failed, 0 not settled"


def test_without_a_limit_the_point_of_the_largest_loads(tables):
    view = views.at_points(tables)
    high = {name: np.nanquantile(view.load(f"cross1.F at {name}").valid, 0.99) for name in tables}
    assert view.point_of("cross1.F") == max(high, key=high.__getitem__)


def test_a_limit_of_all_points_holds_at_each(view):
    assert view.load("cross1.F at one").limit == 700.0
    assert view.load("cross1.F at two").limit == 900.0
    assert view.load("fork1.T").limit is None


def test_the_page_names_a_point_without_a_valid_joint(tables):
    """All joints are pending there, as after damage of their only block."""
    tables["two"]["status"] = Status.PENDING
    view = views.at_points(tables, {"cross1.F": 700.0})
    (table,) = page._points(view)
    kept = head(table).index("keep all limits there")
    assert body(table)[1][kept] == "no verdict"
    assert body(table)[0][kept] != "no verdict"


def test_contact_modes_of_several_points_are_not_averaged(view):
    assert np.isnan(view.mode_share).all()
    assert np.isfinite(view.at("one").mode_share).all()


def test_revolutions_follow_from_time_and_speed(view):
    points = view.store.points
    fast = points["two"].operation.model_copy(update={"speed": -3 * points["one"].operation.speed})
    points["two"] = points["two"]._replace(operation=fast)
    assert view.shares_of_revolutions == pytest.approx([0.25, 0.75])


def test_one_point_alone_is_the_worst_of_itself(tables):
    found = worst.together([tables["two"]])
    np.testing.assert_array_equal(found["F_max"], tables["two"]["F_max"])
    np.testing.assert_array_equal(found["status"], tables["two"]["status"])
