"""Lives of bearings: closed forms, joints without a life, bearings that are edited after the run, page and JSON."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import tolstat
from tests.support import synthetic, views
from tolstat import joint
from tolstat.analysis.binomial import clopper_pearson, needed
from tolstat.common.cardan import CARDAN
from tolstat.common.columns import result_columns
from tolstat.common.errors import InputError, NotApplicable, StoreError
from tolstat.common.tables import Mode, Status
from tolstat.display import text
from tolstat.display.answer import Asked, Sentence, Table
from tolstat.joint import Operation
from tolstat.questions import quantity
from tolstat.questions.bearing_life import answer as question
from tolstat.questions.bearing_life.lives import LOADED, below_rows, lives_of
from tolstat.store.recorded import operating_points
from tolstat.study.points import Point

BEARING = {"C": "22 kN", "C0": "40 kN", "needles": 32, "needle_diameter": "4 mm", "pitch_diameter": "42 mm"}
BEARING |= {"required_life": "8e6 h"}


def held(**changes):
    """Sections of a joint with bearings, as a result file holds them."""
    bearing = {key: value for key, value in (BEARING | changes).items() if value is not None}
    return joint.load("cirelli2021", {"bearing": bearing}, "x.toml").given("json")


def view(n=201, alpha=None, **kwargs):
    return views.view(n, joint=kwargs.pop("joint", None) or held(), alpha=alpha, **kwargs)


def said(made, place=None):
    """Sentences of the answer, the first is the verdict; those of one place."""
    parts = tolstat.bearing_life(made).parts
    return [part.text for part in parts if isinstance(part, Sentence) and part.place == (place or part.place)]


def below(lives):
    """Rows on the required life, as a frame."""
    return pd.DataFrame(below_rows(lives))


def contacts(made):
    return tolstat.bearing_life(made).frame("contacts")


def test_lives_in_hours():
    made = view()
    lives, loads = lives_of(made), made.read_results(("equivalent_load",))["equivalent_load"]
    rpm, angle = 52.36 * 30 / np.pi, np.degrees(views.OPERATION.alpha)
    pins = 1.5e6 / (angle * rpm) * (22e3 / loads) ** (10 / 3)  # the formula of catalogues
    np.testing.assert_allclose(lives.hours[:, :4], pins, rtol=1e-12)
    np.testing.assert_allclose(lives.hours[:, 4], (pins**-1.125).sum(axis=1) ** (-1 / 1.125), rtol=1e-12)
    assert lives.nominal_hours[0] == pytest.approx(1.5e6 / (angle * rpm) * (22e3 / 600.0) ** (10 / 3))
    assert lives.required == pytest.approx(8e6)


def duty(shares=(0.75, 0.25), change=None, loads=(1000.0, 2000.0)):
    """Bearings at two points: 15 deg and 600 rpm; 30 deg and 100 rpm. A constant equivalent load at each."""
    tables = {"cruise": synthetic.results(4), "climb": synthetic.results(4)}
    for table, load in zip(tables.values(), loads, strict=True):
        table["equivalent_load"] = load
    if change:
        change(tables)
    points = [
        Point(name, Operation.model_construct(alpha=np.radians(angle), speed=rpm * np.pi / 30, torque=100.0), share)
        for name, angle, rpm, share in zip(tables, (15.0, 30.0), (600.0, -100.0), shares, strict=True)
    ]
    return views.at_points(tables, joint=held(), points=points)


def test_a_duty_cycle_is_a_miner_sum_over_its_points():
    """By hand: L10 at a point is (C/P)^(10/3) million turns, 4 alpha/2 pi of them a revolution of the shaft.

    Cruise: 600 rpm and 15 deg are 600*60/6 = 6000 turns an hour, 22^(10/3) = 29 836.11 million last 4 972 686 h.
    Climb: 100 rpm and 30 deg are 2000 turns an hour, 11^(10/3) = 2960.1175 million last 1 480 059 h.
    An hour uses 0.75/4 972 686 + 0.25/1 480 059 = 3.197362e-7 of a bearing, which so lasts 3 127 579 h.
    """
    lives = lives_of(duty())
    cruise, climb = 1e6 * 22 ** (10 / 3) / 6000, 1e6 * 11 ** (10 / 3) / 2000
    expected = 1.0 / (0.75 / cruise + 0.25 / climb)
    assert (cruise, climb, expected) == pytest.approx((4_972_686, 1_480_059, 3_127_579), rel=1e-6)
    np.testing.assert_allclose(lives.hours[:, :4], expected, rtol=1e-12)
    np.testing.assert_allclose(lives.hours[:, 4], expected * 4 ** (-8 / 9), rtol=1e-12)
    # the mean load of 4500 turns at 1000 N and 500 at 2000 N
    np.testing.assert_allclose(lives.loads, (0.9 * 1000 ** (10 / 3) + 0.1 * 2000 ** (10 / 3)) ** 0.3, rtol=1e-12)
    np.testing.assert_allclose(lives.nominal_hours[0], expected)
    assert lives.duty == {"cruise": 0.75, "climb": 0.25}
    # turns an hour 0.75 600 60 4 15/360 and 0.25 100 60 4 30/360, twice the load at the second point
    damage = np.array([4500.0, 500.0 * 2.0 ** (10 / 3)])
    np.testing.assert_allclose(list(lives.used.values()), damage / damage.sum())
    used = "share of the life of all bearings that each operating point uses up, mean of the joints: 52.8 % at climb"
    assert any(n.startswith(used) for n in said(duty()))
    assert any(n.startswith("over a duty cycle: 75 % at cruise, 25 % at climb") for n in said(duty()))


def test_one_point_of_a_duty_cycle_alone():
    made = duty()
    np.testing.assert_allclose(lives_of(made.at("climb")).hours[:, 0], 1e6 * 11 ** (10 / 3) / 2000)
    assert lives_of(made.at("climb")).duty == {"climb": 1.0}


def test_a_selected_point_is_said_to_count_as_all_of_the_service():
    words = "as though all of the service were at climb"
    assert words in said(duty().at("climb"))
    assert words in question.life_verdicts(duty().at("climb"))[0].notes
    assert not any("as though" in note for note in said(duty()))


def test_a_bearing_without_load_at_one_point_lasts_by_the_other():
    np.testing.assert_allclose(lives_of(duty(loads=(1000.0, 0.0))).hours[:, 0], 1e6 * 22 ** (10 / 3) / 6000 / 0.75)
    assert np.isinf(lives_of(duty(loads=(0.0, 0.0))).hours).all()
    assert lives_of(duty(loads=(1000.0, 0.0))).used == {"cruise": 1.0, "climb": 0.0}
    assert not any("uses up" in note for note in said(duty(loads=(0.0, 0.0))))


def swinging(**angles):
    """Bearings at points with these angles, in deg, of the same speed and for the same time."""
    points = [
        Point(name, Operation.model_construct(alpha=np.radians(angle), speed=50.0, torque=100.0), 1.0 / len(angles))
        for name, angle in angles.items()
    ]
    tables = {name: synthetic.results(4) for name in angles}
    for table in tables.values():
        table["equivalent_load"] = 1000.0
    return views.at_points(tables, joint=held(), points=points)


def test_a_point_with_a_small_swing_is_rated_and_named():
    """10 deg to either side is below the critical amplitude of 12.43 deg: a ninth root shortens the life there."""
    made, critical = swinging(cruise=10.0, climb=30.0), 360.0 / 32 / (1 - 4 / 42)
    lives, hourly = lives_of(made), 50.0 / (2 * np.pi) * 3600
    turns = 0.5 * hourly * (4 * 10 / 360 * (critical / 10.0) ** (1 / 9) + 4 * 30 / 360)
    np.testing.assert_allclose(lives.hours[:, 0], 1e6 * 22 ** (10 / 3) / turns)
    assert (lives.unrated, lives.short, lives.fretting) == (0, {"cruise": 3}, {})
    notes = [note for note in said(made, "note") if "by less than" in note]
    assert [note.split(":")[0] for note in notes] == [
        "at cruise, 50 % of the time, every joint swings by less than 12.4 deg to either side"
    ]


def test_points_with_small_swings_are_named_together():
    notes = [note for note in said(swinging(cruise=10.0, start=11.0, climb=30.0), "note") if "by less than" in note]
    assert [note.split(":")[0] for note in notes] == [
        "at cruise, start, 66.7 % of the time, every joint swings by less than 12.4 deg to either side"
    ]


def test_a_point_below_half_the_critical_amplitude_counts_and_is_told_to_fret():
    made = swinging(cruise=3.0, climb=30.0)
    lives = lives_of(made)
    assert (lives.unrated, lives.fretting) == (0, {"cruise": 3})
    assert np.all(lives.hours < lives_of(made.at("climb")).hours * 2.0)  # climb alone, for half of the time
    (note,) = (note for note in said(made, "note") if "by less than 12.4" in note)
    assert note.startswith("at cruise, 50 % of the time, every joint swings")
    assert "As they swing by less than half of this, fretting, which no rating covers, may end it earlier" in note


def test_without_a_point_above_half_the_critical_amplitude_there_is_no_rating():
    made = swinging(cruise=3.0, climb=6.0)
    assert lives_of(made).unrated == 3
    assert said(made)[0].startswith("No rating: every joint swings by less than 6.22 deg to either side at each of its")
    assert not any("by less than 12.4" in note for note in said(made, "note"))
    assert lives_of(duty()).unrated == 0


def test_shares_of_the_time_are_needed():
    with pytest.raises(InputError, match=r"without a share of the time\n.*--point cruise"):
        lives_of(duty(shares=(np.nan, np.nan)))


def test_a_joint_that_fails_at_one_point_has_no_life():
    def failing(tables):
        tables["climb"]["status"][2] = Status.NEWTON_FAILED
        tables["climb"]["equivalent_load"][2] = np.nan

    made = duty(change=failing)
    assert np.isnan(lives_of(made).hours).all(axis=1).tolist() == [False, True, False]
    assert below(lives_of(made)).iloc[-1]["n_failed"] == 1


def test_contact_modes_count_by_the_revolutions_of_a_point():
    """Revolutions are 0.75*600 to 0.25*100, so climb has a nineteenth of them."""

    def at_one_end(tables):
        for table, mode in zip(tables.values(), (Mode.UNIFORM, LOADED["one_end"]), strict=True):
            table["mode_share"] = 0.0
            table["mode_share"][:, :, mode] = 1.0

    assert contacts(duty(change=at_one_end))["one_end"].tolist() == [0.0] * 5
    assert contacts(duty((0.1, 0.9), at_one_end))["one_end"].tolist() == [1.0] * 5  # 90 to 60 of 150


def test_shares_and_quantiles_are_those_of_the_lives():
    lives = lives_of(view())
    table, hours = below(lives).set_index("place"), lives.hours[:, 4]
    count = int((hours < 8e6).sum())
    assert 20 < count < 180
    assert (table.loc["joint", "count"], table.loc["joint", "n"]) == (count, 200)
    assert (table.loc["joint", "lower"], table.loc["joint", "upper"]) == clopper_pearson(count, 200)
    assert list(table.index) == ["pin1", "pin2", "pin3", "pin4", "joint"]
    row = tolstat.bearing_life(view()).frame("lives").set_index(["place", "share"]).loc[("joint", 0.9)]
    assert (hours >= row["estimate"]).mean() == pytest.approx(0.9)
    assert row["lower"] < row["estimate"] < row["upper"]
    # with the load rating given, this share reaches the required life
    better = lives_of(view(joint=held(C=f"{row['rating']} N")))
    assert (better.hours[:, 4] >= 8e6 * (1 - 1e-9)).mean() == pytest.approx(0.9)


def test_joints_without_a_life_are_counted_both_ways():
    lives = lives_of(view(failed=6, unsettled=4))
    row = below(lives).iloc[-1]
    count = int((lives.hours[:190, 4] < 8e6).sum())
    assert (row["n_failed"], row["n_unsettled"], row["count"]) == (6, 4, count)
    assert (row["bound_lower"], row["bound_upper"]) == (count / 200, (count + 10) / 200)
    assert row["total_lower"] < row["lower"]
    assert row["total_upper"] > row["upper"]


def test_the_numerical_error_widens_the_total_interval():
    lives = lives_of(view())
    wide = below(replace(lives, load_error=0.05)).iloc[-1]
    plain = below(lives).iloc[-1]
    # loads 5 % smaller and larger; a life goes with the load to the power -10/3
    few, many = ((lives.hours[:, 4] * factor ** (-10 / 3) < 8e6).sum() for factor in (0.95, 1.05))
    assert few < plain["count"] < many
    assert wide["total_lower"] == clopper_pearson(few, 200)[0] < plain["total_lower"]
    assert wide["total_upper"] == clopper_pearson(many, 200)[1] > plain["total_upper"]
    assert (wide["estimate"], wide["lower"]) == (plain["estimate"], plain["lower"])


def test_half_of_the_joints_failed_gives_no_verdict():
    made = view(failed=100)
    assert said(made, "lead")[0].startswith("No verdict: 100 of 200 joints have no life")
    assert not any("reach it with C" in words for words in said(made))
    assert question.BELOW[1].cell(tolstat.bearing_life(made).tables["below_required"].rows[-1]) == "-"


@pytest.mark.parametrize("alpha", [0.0, np.radians(6.2), -np.radians(3)])
def test_below_half_the_critical_amplitude_there_is_no_rating(alpha):
    made = view(alpha=alpha)
    lives = lives_of(made)
    assert (np.isnan(lives.hours).all(), lives.unrated) == (True, 200)
    assert said(made)[0].startswith("No rating: every joint swings by less than 6.22 deg")
    titles = [part.title for part in tolstat.bearing_life(made).parts if isinstance(part, Table)]
    assert not any("L10" in title or "reach" in title for title in titles)
    assert any(title.startswith("Bearings in 99 %") for title in titles)


def test_some_joints_without_a_rating():
    alpha = np.full(201, np.radians(15))
    alpha[1:5], alpha[5:7] = np.radians(6), np.radians(12)
    found = tolstat.bearing_life(view(alpha=alpha))
    assert (found.facts["unrated"], int(found.frame("below_required")["n_failed"].iloc[-1])) == (4, 4)
    notes = said(view(alpha=alpha))
    assert any(
        note.startswith("4 of 200 joints have no rating: each of them swings by less than 6.22") for note in notes
    )
    assert any(note.startswith("6 of 200 joints swing by less than 12.4 deg to either side") for note in notes)


def lasting(hours, accepted, **kwargs):
    """Verdict on a required life, given in h."""
    (found,) = question.life_verdicts(view(joint=held(required_life=f"{hours} h"), **kwargs), accepted)
    return found


def test_verdicts_on_the_required_life():
    hours = np.sort(lives_of(view()).hours[:, 4])
    required = round(hours[10] + 1.0)  # eleven of 200 joints last shorter
    low, high = (float(end) for end in clopper_pearson(11, 200))
    interval = text.span(low, high)
    kept = lasting(required, 0.1)
    assert (kept.answer, kept.share, kept.lower, kept.upper) == ("yes", 11 / 200, low, high)
    what = f"of the joints have a bearing life below {text.number(required)} h"
    assert kept.sentence == f"Kept: at most 10 % {what} (5.5 %, {interval})"
    assert lasting(required, 0.02).sentence == f"Not kept: 5.5 % {what} ({interval}); 2 % is accepted"
    joints = text.number(needed(11 / 200, 0.05))
    assert lasting(required, 0.05).sentence == (
        f"Open: 5.5 % {what} ({interval}); 5 % is accepted; {joints} joints decide it in 90 % of campaigns "
        "if 5.5 % is the true share"
    )
    plain = lasting(required, np.nan)
    assert (plain.answer, plain.sentence) == ("", f"5.5 % {what} ({interval})")
    values = lasting(required, 0.1).values()
    assert (values["about"], values["answer"], values["share"]) == ("bearing life", "kept", 11 / 200)


def test_no_verdict_on_the_required_life():
    found = lasting(8e6, 0.5, failed=100)
    assert found.sentence.startswith("No verdict: 100 of 200 joints have no life; shorter than required are")
    assert found.values()["share"] is None
    assert lasting(1.0, 0.6, failed=100).answer == "yes"  # even if all joints without a life last shorter
    assert lasting(8e6, 0.1, alpha=0.01).sentence.startswith("No verdict: no bearing has a rating: every joint swings")
    bearing = {key: value for key, value in BEARING.items() if key != "required_life"}
    made = view(joint=joint.load("cirelli2021", {"bearing": bearing}, "x.toml").given("json"))
    assert question.life_verdicts(made) == []
    assert question.life_verdicts(views.view(joint=joint.load("cirelli2021", {}, "x.toml").given("json"))) == []


def test_reliability_and_lubrication_shorten_the_life():
    plain, strict = (lives_of(view(joint=held(**more))) for more in ({}, {"reliability": 0.99, "a_iso": 0.8}))
    np.testing.assert_allclose(strict.hours, 0.25 * 0.8 * plain.hours)


def test_no_required_life():
    bearing = {key: value for key, value in BEARING.items() if key != "required_life"}
    made = view(joint=joint.load("cirelli2021", {"bearing": bearing}, "x.toml").given("json"))
    assert said(made)[0] == "No required life is given: bearing.required_life."
    assert "below_required" not in tolstat.bearing_life(made).tables


def test_joints_loaded_at_one_end():
    def change(results):
        results["mode_share"] = 0.0
        results["mode_share"][:, :, Mode.UNIFORM] = 1.0
        results["mode_share"][:30, 2] = [0.0, 0.6, 0.4, 0.0]
        results["mode_share"][20:50, 3] = [0.0, 0.4, 0.6, 0.0]

    table = contacts(view(change=change)).set_index("place")
    assert table["one_end"].tolist() == [0.0, 0.0, 0.15, 0.0, 0.15]
    assert table["opposite_ends"].tolist() == [0.0, 0.0, 0.0, 0.15, 0.15]
    assert table.loc["any", "along"] == 1.0
    notes = said(view(change=change), "note")
    assert any(
        note.startswith("in 15 % of the joints at least one bearing is loaded at one end only") for note in notes
    )


def test_the_bearing_is_that_of_the_study_given_in_place_of_the_stored_one(tmp_path):
    path, edited, other = synthetic.store(tmp_path, STUDY), tmp_path / "edited.toml", tmp_path / "other.toml"
    edited.write_text(STUDY.replace("20000 h", "10000 h").replace("10 kN", "20 kN"), encoding="utf-8")
    other.write_text(STUDY.replace("40 N*m", "30 N*m"), encoding="utf-8")
    with tolstat.open(path) as store:
        stored, given = lives_of(store.view()), lives_of(store.view(edited))
        assert (stored.required, given.required) == (20000.0, 10000.0)
        np.testing.assert_allclose(given.hours, 2 ** (10 / 3) * stored.hours)
        with pytest.raises(StoreError, match="does not match the study"):
            lives_of(store.view(other))


def test_refused_files():
    with pytest.raises(StoreError, match="joint without bearings"):
        lives_of(views.view(joint=joint.load("cirelli2021", {}, "x.toml").given("json")))
    some = tuple(column for column in result_columns(CARDAN) if column.name != "pin2.equivalent_load")
    with pytest.raises(StoreError, match="does not keep the equivalent loads"):
        lives_of(view(columns=some))
    with pytest.raises(StoreError, match="no sample"):
        lives_of(view(method="sweep"))


def test_a_bearing_for_the_contact_alone_has_no_life():
    bearing = {"needles": 32, "needle_length": "22 mm", "pitch_diameter": "42 mm", "required_life": "5000 h"}
    made = views.view(joint=joint.load("cirelli2021", {"bearing": bearing}, "x.toml").given("json"))
    with pytest.raises(StoreError, match="bearings without needle_diameter, which a rating life needs") as caught:
        lives_of(made)
    assert "run it into another file" in str(caught.value)
    with pytest.raises(StoreError, match="needle_diameter") as caught:
        question.bearing_life_on_page(made, Asked(Path(made.path)))
    assert not isinstance(caught.value, NotApplicable)  # a life is required: the page says what lacks
    del bearing["required_life"]
    made = views.view(joint=joint.load("cirelli2021", {"bearing": bearing}, "x.toml").given("json"))
    with pytest.raises(NotApplicable, match="needle bearings without needle_diameter"):
        question.bearing_life_on_page(made, Asked(Path(made.path)))


STUDY = (
    synthetic.HEAD
    + """
[joint.bearing]
C = "10 kN"
needles = 32
needle_diameter = "4 mm"
pitch_diameter = "42 mm"
required_life = "20000 h"
[solver]
fidelity = "ideal"
[tolerances]
"operation.torque" = { plus_minus = "40 N*m", distribution = "uniform" }
[sampling]
n = 40
seed = 1
"""
)


def test_dimensions_of_the_bearing_belong_to_the_campaign(tmp_path):
    """Its ratings and the required life may be edited after the run."""
    file = tmp_path / "study.toml"

    def identity(old, new):
        file.write_text(STUDY.replace(old, new), encoding="utf-8")
        return tolstat.load(file).identity()

    first = identity("", "")
    assert identity("10 kN", "20 kN") == identity("20000 h", "1 h") == identity('C = "10 kN"', "a_iso = 0.9") == first
    for change in (("= 32", "= 31"), ("42 mm", "43 mm"), ("[joint.bearing]", '[joint.bearing]\nend_relief = "5 um"')):
        assert identity(*change) != first


def test_each_bearing_by_itself():
    """Quantiles of what results hold, pressure and static safety by hand."""
    made = view(400)
    table = tolstat.bearing_life(made).frame("bearings").set_index(["place", "share"])
    results = made.read_results(("equivalent_load", "tilt", "line_load", "contact_max"))
    row, rank = table.loc["pin2", 0.99], 399 - 1 - int(0.01 * 399)

    def largest(values):
        return np.sort(values)[rank]

    assert row.load == largest(results["equivalent_load"][:, 1])
    assert row.tilt == largest(results["tilt"][:, 1])
    assert row.life == pytest.approx(np.sort(lives_of(made).hours[:, 1])[398 - rank])
    assert row.safety == pytest.approx(40e3 / largest(results["contact_max"][:, 1, 2]))
    line = largest(results["line_load"][:, 1])
    assert row.pressure == pytest.approx(np.sqrt(line * 206e9 / 0.91 / (2 * np.pi) * (2 / 0.004 + 2 / 0.038)))
    assert table.loc["pin2", 0.99].nominal_tilt == 1e-3


def test_needles_are_as_long_as_the_contact_unless_their_length_is_given():
    length = f"{1e3 * joint.load('cirelli2021', {}, 'x').contact.z} mm"
    left_out, given = (
        tolstat.bearing_life(views.view(joint=held(C=None, C0=None, needle_length=own))).frame("bearings")
        for own in (None, length)
    )
    pd.testing.assert_frame_equal(left_out, given)
    assert np.isfinite(left_out["safety"]).all()


@pytest.mark.slow
def test_bearings_may_be_edited_after_the_run(tmp_path):
    file, target = tmp_path / "study.toml", tmp_path / "study.h5"
    file.write_text(STUDY, encoding="utf-8")
    tolstat.run(tolstat.load(file), target, workers=1)
    with tolstat.open(target) as store:
        first, created = lives_of(store.view()), store.created
        torque = operating_points(store)["torque"][1:]
    assert (first.view.status == Status.OK).all()
    # without inertia to speak of, forces and equivalent loads are in proportion to the torque
    np.testing.assert_allclose(
        first.loads / torque[:, None], (first.loads / torque[:, None])[:1].repeat(40, 0), rtol=0.02
    )
    file.write_text(STUDY.replace("10 kN", "20 kN"), encoding="utf-8")
    tolstat.run(tolstat.load(file), target, workers=1)
    with tolstat.open(target) as store:
        second = lives_of(store.view())
        assert store.created == created
    np.testing.assert_allclose(second.hours, 2 ** (10 / 3) * first.hours)
    assert np.isfinite(second.hours[:, : len(CARDAN.pairs)]).all()


def test_what_shortens_a_life_is_asked_as_of_a_load():
    made = view()
    found = quantity(made, "life pin2")
    np.testing.assert_allclose(1.0 / found.values, lives_of(made).hours[:, lives_of(made).places.index("pin2")])
    assert (found.name, found.unit) == ("1/life of pin2", "1/h")
    assert quantity(made, "life").name == "1/life"
    with pytest.raises(InputError, match="is not the life of a bearing"):
        quantity(made, "life pin9")
