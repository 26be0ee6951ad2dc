"""Drive shafts: what differs from one joint in the questions."""

from __future__ import annotations

import re

import numpy as np
import pytest

import tolstat
from tests.support.environment import ROOT
from tests.support.views import FakeStore
from tolstat import joint, study
from tolstat.campaign.plan import Reversals, _reversals
from tolstat.common.columns import result_columns
from tolstat.common.errors import InputError
from tolstat.common.loads import load_panels
from tolstat.common.tables import Status, tables, without_results
from tolstat.display import drawing
from tolstat.display.answer import Panels, Sentence, Sheet, Table
from tolstat.joint import nominal_errors, perturb
from tolstat.questions.bearing_life import answer as bearing_life
from tolstat.questions.bearing_life.lives import lives_of
from tolstat.questions.drawings import answer as drawings
from tolstat.questions.drawings import dimensions
from tolstat.questions.drawings import shaft as picture
from tolstat.questions.exceedance import curves
from tolstat.report.answer import report
from tolstat.solver import stationary
from tolstat.store.view import View
from tolstat.study import changes
from tolstat.study.assumptions import assumptions
from tolstat.study.points import Point

WEIBULL = 9 / 8
BEARING = {"C": "22 kN", "needles": 32, "needle_diameter": "4 mm", "pitch_diameter": "42 mm", "required_life": "100 h"}


@pytest.fixture(scope="module")
def of_study():
    return study.load(ROOT / "studies" / "shaft.toml")


@pytest.fixture
def view(of_study):
    """Make a view of joints whose bearings carry 600 N each; `angles` are the misalignments, deg."""

    def make(angles=(15.0, 30.0), n=40):
        mechanism = of_study.mechanism
        results = without_results(n, Status.OK, mechanism)
        rise = np.random.default_rng(1).gamma(3.0, 0.1, n)
        for name in (name for name in results.dtype.names if name.endswith("_max")):
            results[name] = (500.0 * (1.0 + rise)).reshape(-1, *(1 for _ in results[name].shape[1:]))
        results["settled"], results["equivalent_load"], results["mode_share"] = 1, 600.0, 0.25
        stationary.fill_intervals(results, mechanism)
        held = joint.load("cirelli2021", {"bearing": BEARING}, "x.toml").given("json")
        errors = np.repeat(nominal_errors(1, mechanism), n)
        store = FakeStore("random", of_study.limits, errors, results, columns=result_columns(mechanism), joint=held)
        first, second = np.radians(angles)
        shaft = of_study.operation.shaft.model_copy(update={"alpha": second})
        operation = of_study.operation.model_copy(update={"alpha": first, "shaft": shaft})
        store.mechanism, store.points = mechanism, {"": Point("", operation, 1.0)}
        return View(store)

    return make


def test_each_bearing_swings_by_the_misalignment_of_its_joint(view):
    """Twice the angle is half the life; joints and shaft last until the first of their bearings fails."""
    lives = lives_of(view())
    hours = lives.hours
    assert lives.places[8:] == ("joint1", "joint2", "shaft")
    np.testing.assert_allclose(hours[:, :4], 2.0 * hours[:, 4:8], rtol=1e-12)
    for place, bearings in ((8, slice(0, 4)), (9, slice(4, 8)), (10, slice(0, 8))):
        together = (hours[:, bearings] ** -WEIBULL).sum(axis=1) ** (-1.0 / WEIBULL)
        np.testing.assert_allclose(hours[:, place], together, rtol=1e-12)


def test_a_bearing_swings_by_the_misalignment_of_its_own_shaft(view):
    """The deviation of joint 2's misalignment counts: half the angle is twice the life."""
    plain, straighter = view(), view()
    straighter.store._errors["shaft.alpha"] = np.radians(-15.0)
    np.testing.assert_allclose(lives_of(straighter).hours[:, 4:8], 2.0 * lives_of(plain).hours[:, 4:8], rtol=1e-12)
    np.testing.assert_allclose(lives_of(straighter).hours[:, :4], lives_of(plain).hours[:, :4], rtol=1e-12)


def test_bearings_are_those_of_the_joint_that_they_are_in(view):
    """Twice the load rating is 2^(10/3) times the life; no rating of both is told where they differ."""
    plain, unlike = view(), view()
    held = joint.load("cirelli2021", {"bearing": BEARING | {"C": "44 kN", "required_life": "100 h"}}, "x.toml")
    operation = unlike.store.operation
    shaft = operation.shaft.model_copy(update={"joint2": held})
    unlike.store.points = {"": Point("", operation.model_copy(update={"shaft": shaft}), 1.0)}
    before, after = lives_of(plain), lives_of(unlike)
    np.testing.assert_array_equal(after.hours[:, :4], before.hours[:, :4])
    np.testing.assert_allclose(after.hours[:, 4:8], 2 ** (10 / 3) * before.hours[:, 4:8], rtol=1e-12)
    assert [after.rating_of(place) for place in ("joint1.pin2", "joint1", "joint2")] == [22e3, 22e3, 44e3]
    assert np.isnan(after.rating_of("shaft"))
    assert before.rating_of("shaft") == 22e3
    texts = list(shown(bearing_life.bearing_life(unlike)))
    assert any("C = 22 and 44 kN" in text for text in texts)


def test_a_shaft_has_no_rating_where_one_of_its_bearings_frets(view):
    lives = lives_of(view((15.0, 2.0)))
    rated = lives.hours[:, [0, 1, 2, 3, lives.places.index("joint1")]]
    assert np.isfinite(rated).all()
    assert np.isnan(lives.hours).sum() == lives.hours.size - rated.size
    assert lives.unrated == 39
    (verdict,) = bearing_life.life_verdicts(view((15.0, 2.0)), np.nan)
    assert "in every joint a bearing of joint2 swings by less than" in verdict.words


def test_no_reversals_are_counted(of_study):
    params = perturb(of_study.joint, of_study.operation, nominal_errors(3, of_study.mechanism))
    params["torque"] = 1e-6
    assert _reversals(params, np.zeros(3, tables(of_study.mechanism).RESULT), of_study.mechanism) == Reversals(
        0, None, None
    )


def test_limits_of_the_picture_name_the_joint(view):
    axes = curves.sheet(view(), ()).axes
    labels = axes[3].get_legend_handles_labels()[1]
    assert "limit 275 N m (joint2: 1, 2, 3, 4)" in labels  # the loads are all above it
    assert "joint1.fork4.T" in labels


def test_a_change_may_set_joint_2(of_study):
    text = changes.with_settings(of_study, ["shaft.alpha=8 deg"])
    assert changes.read(of_study, text).operation.alphas == pytest.approx(np.radians([8.0, 8.0]))
    assert changes.words(of_study, text) == "changed: shaft.alpha 6 deg → 8 deg"
    alone = study.load(ROOT / "studies" / "rigid_shafts.toml")
    with pytest.raises(InputError, match="is in section 'shaft', which changes no joint"):
        changes.with_settings(alone, ["shaft.alpha=8 deg"])


def test_the_mounting_of_shafts_is_not_assumed(of_study):
    assert "mounting" in {each.name for each in assumptions(study.load(ROOT / "studies" / "rigid_shafts.toml"))}
    assert "mounting" not in {each.name for each in assumptions(of_study)}


def test_the_page_has_a_picture_of_the_shaft_before_those_of_its_joints(view):
    whole, drawn, *_ = drawings.drawings(view()).parts
    assert [panel.key for panel in whole.panels] == ["drive-shaft"]
    assert "joint 1 of 15 deg, Z arrangement, joint 2 of 30 deg" in whole.panels[0].description
    assert [panel.key for panel in drawn.panels[:2]] == ["joint-front-joint1", "joint-side-joint1"]


@pytest.mark.parametrize(
    ("arrangement", "end"),
    [
        ("Z", (np.sin(np.radians(2)), 0.0, np.cos(np.radians(2)))),  # 8 deg up, 6 deg down again
        ("W", (np.sin(np.radians(14)), 0.0, np.cos(np.radians(14)))),
    ],
)
def test_shafts_are_drawn_as_they_are_arranged(of_study, arrangement, end):
    shaft = of_study.operation.shaft.model_copy(update={"arrangement": arrangement})
    ends, bearings = picture.points_of(of_study.joint, of_study.operation.model_copy(update={"shaft": shaft}))
    first, second = np.radians(8), 1e3 * shaft.length
    np.testing.assert_allclose(ends[2], (second * np.sin(first), 0.0, second * np.cos(first)), atol=1e-9)
    np.testing.assert_allclose(ends[3] - ends[2], np.linalg.norm(ends[3] - ends[2]) * np.array(end), atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(bearings[:2], axis=1), (70.0, 190.0))


def shown(answer):
    """All words of an answer that people see: sentences, tables, and the pictures with their titles."""
    for part in answer.parts:
        if isinstance(part, Sentence):
            yield part.text
        elif isinstance(part, Table):
            yield part.title
            yield from (text for column in part.shown for text in (column.head, *map(column.cell, part.for_people)))
        elif isinstance(part, Panels | Sheet):
            panels = part.panels if isinstance(part, Panels) else ()
            yield from (text for panel in panels for text in (panel.title, panel.description))
            figure = drawing.sheet(panels) if panels else part.draw()
            yield from (artist.get_text() for artist in figure.findobj(lambda artist: hasattr(artist, "get_text")))


@pytest.mark.parametrize("answer_of", [report, tolstat.exceedance, tolstat.bearing_life, tolstat.quantiles])
def test_a_row_is_called_a_shaft(view, answer_of):
    texts = list(shown(answer_of(view((15.0, 2.0)))))
    assert any("shafts" in text for text in texts)
    assert [text for text in texts if re.search(r"\b[Jj]oints?\b(?! [12]\b|[.*])", text)] == []
    assert any("joint2" in text for text in texts)


def test_the_table_has_the_shaft(of_study):
    """Masses of the tubes: steel, 400 and 800 mm of 76 x 2.5 mm."""
    rows = dimensions.dimensions(of_study.joint, of_study.points)
    values = {row["dimension"]: row["value"] for row in rows}
    meanings = {row["dimension"]: row["meaning"] for row in rows}
    assert [meanings[key] for key in ("operation.alpha", "shaft.alpha")] == [
        f"misalignment of joint {i}" for i in (1, 2)
    ]
    mass = 7850 * np.pi / 4 * (0.076**2 - 0.071**2) * 0.4
    assert values["shaft.alpha"] == "6 deg"
    assert (values["shaft.arrangement"], values["shaft.offset"], values["shaft.length"]) == ("Z", "0 deg", "1200 mm")
    assert (values["shaft.tube"], values["shaft.tube2"]) == tuple(f"76 x 2.5 mm, {m:.4g} kg" for m in (mass, 2 * mass))
    assert (values["shaft.spline.at"], values["spline force"]) == ("400 mm", "3000 N")  # 2 mu T/d


@pytest.mark.parametrize(
    ("update", "expected"),
    [
        ({"alpha": np.radians(6)}, np.radians(8) ** 2 - np.radians(6) ** 2),
        ({"alpha": np.radians(6), "arrangement": "W"}, np.radians(8) ** 2 - np.radians(6) ** 2),
        ({"alpha": np.radians(8)}, 0.0),
        ({"alpha": np.radians(8), "offset": np.pi / 2}, 2 * np.radians(8) ** 2),
    ],
)
def test_second_order_of_the_output_speed(of_study, update, expected):
    """Half of the difference of the squares of the angles; of their sum with forks a quarter turn out of phase."""
    shaft = of_study.operation.shaft.model_copy(update=update)
    operation = of_study.operation.model_copy(update={"shaft": shaft})
    assert dimensions.second_order(of_study.joint, operation) == pytest.approx(0.5 * expected, rel=0.02, abs=1e-12)


def test_a_shaft_is_drawn_as_a_whole(of_study):
    titles = [ax.get_title("left") for ax in drawings.draw_joint(of_study.joint, of_study.operation).axes]
    assert titles[:2] == ["The drive shaft, to scale", "The cross, seen from the output shaft"]
    assert titles[2:] == ["joint1: Both shafts", "joint2: Both shafts"]


def test_a_joint_2_of_its_own_is_drawn_and_told(of_study):
    held = joint.load("cirelli2021", {"thrust": {"end_play": "0.1 mm", "k": "1e8 N/m"}}, "x.toml")
    shaft = of_study.operation.shaft.model_copy(update={"joint2": held})
    operation = of_study.operation.model_copy(update={"shaft": shaft})
    rows = dimensions.dimensions(of_study.joint, [Point("", operation, 1.0)])
    values = {row["dimension"]: row["value"] for row in rows}
    assert (values["joint1.cross.R"], values["joint2.cross.R"]) == ("43 mm", f"{1e3 * held.cross.R:.5g} mm")
    assert (values["joint1.thrust.end_play"], values["joint2.thrust.end_play"]) == ("0.02 mm", "0.1 mm")
    assert "joint1.shaft.input.bearings" in values
    assert not {"cross.R", "joint1.shaft.output.bearings", "joint2.shaft.input.bearings"} & values.keys()
    errors = nominal_errors(1, joint.mechanism_of(of_study.joint, operation))
    errors["joint2.pin1.diameter"] = 1e-4
    told = {row["feature"]: row for row in drawings.errors_in_numbers(of_study.joint, operation, errors)}
    assert list(told["joint2.pin1"].values())[-1] == pytest.approx(1e3 * (held.contact.clearance - 5e-5))
    assert len(drawings.draw_row(of_study.joint, operation, errors).axes) >= 2
    titles = [axes.get_title(loc="left") for axes in drawings.draw_joint(of_study.joint, operation).axes]
    assert len(titles) == 5
    assert [title.partition(":")[0] for title in titles if "The cross" in title] == ["joint1", "joint2"]


def test_the_spline_carries_torque_and_not_only_bending(of_study):
    titles = [panel.title for panel in load_panels((), of_study.mechanism)]
    assert {"Spline, force", "Spline, torque and bending moment"} <= {*titles}
    assert "Fork bushings, bending moment at the root" in titles
