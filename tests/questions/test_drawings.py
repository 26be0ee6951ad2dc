"""Drawings of a joint: drawn places against the kernel's axes, senses of errors against `perturb`, the command."""

import re
from inspect import unwrap
from itertools import combinations

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from matplotlib.text import Annotation
from typer.testing import CliRunner

from tests.support import naive, synthetic
from tests.support.environment import ROOT
from tests.support.mechanisms import triads
from tolstat import joint as joints
from tolstat.cli import app
from tolstat.common.cardan import CARDAN, HOLE_OF_PIN
from tolstat.common.loads import loads_of
from tolstat.common.mechanism import features
from tolstat.display import drawing
from tolstat.display.answer import Asked
from tolstat.joint import nominal_errors, perturb
from tolstat.kernel.mechanics import bushing
from tolstat.questions.drawings import answer, dimensions, views
from tolstat.questions.drawings.views import FRONT, MEANINGS, SIDE
from tolstat.store import ResultFile
from tolstat.study.points import Point

ALPHA = 0.3
OPERATION = joints.Operation.model_construct(alpha=ALPHA, speed=50.0, torque=100.0)
PINS, HOLES = features(CARDAN)[:4], features(CARDAN)[4:]
SLIM = {
    "cross": {"R": "40 mm", "r_b": "20 mm"},
    "pin": {"l": "25 mm", "d": "18 mm"},
    "contact": {"D_P": "20 mm", "D_H": "20.05 mm", "z": "16 mm"},
    "arm": {"l_f": "30 mm"},
}
"""A joint with pins a quarter as thick as those of the paper's."""
SHORT = {"pin": {"l": "15 mm"}}
"""A joint whose hub reaches nearly to the holes."""


def drawn(panel):
    """Names of what is drawn, with its points: corners of parts, tail and tip of arrows, middles of bushings."""
    figure = Figure(figsize=panel.size)
    with drawing.style.settings():
        panel.draw(figure.add_axes((0, 0, 1, 1)))
        FigureCanvasAgg(figure).draw()
    found = {}
    for artist in figure.findobj(lambda one: one.get_gid() is not None):
        if isinstance(artist, Annotation):
            tail = artist.xy if artist.anncoords == "data" else (0.0, 0.0)
            found[artist.get_gid()] = np.array([tail, artist.xyann])
        elif isinstance(artist, Polygon):
            found[artist.get_gid()] = artist.get_xy()[:-1]
        elif isinstance(artist, Line2D):
            found[artist.get_gid()] = artist.get_xydata()
    return found, figure


def along(arrow):
    """Unit vector from the tail to the tip of an arrow."""
    way = arrow[1] - arrow[0]
    return way / np.hypot(*way)


TRIAD = dict(zip(CARDAN.bodies, triads(), strict=False))
"""Axes e, t, z of each lump in axes of its member, as the kernel has them."""


def attitudes(params):
    """Attitudes of all bodies in ground axes at the input angle 0, by name."""
    return dict(zip(CARDAN.bodies, naive.ideal_attitudes(0.0, params(ALPHA)[0], CARDAN), strict=True))


def test_front_view_has_pins_in_the_holes_of_the_kernels_arms(cirelli):
    found, _ = drawn(views.views(cirelli, ALPHA)[0])
    for k, arm in enumerate(HOLE_OF_PIN):
        e, t, _ = TRIAD[PINS[k]]
        middle = found[f"front.pin{k + 1}"].mean(axis=0)
        assert middle == pytest.approx(cirelli.cross.R * e[:2])
        hole = np.mean([found[f"front.arm{arm}.{i}"].mean(axis=0) for i in (1, 2)], axis=0)
        assert hole == pytest.approx(middle)
        for letter, axis in (("e", e), ("t", t)):
            assert along(found[f"front.pin{k + 1}.{letter}"]) == pytest.approx(axis[:2])
        assert found[f"cross{k + 1}"].mean(axis=0) == pytest.approx(cirelli.cross.r_b * e[:2])
    assert np.cross(*FRONT) == pytest.approx(TRIAD["pin1"][2])


def test_side_view_has_the_output_fork_at_the_misalignment(cirelli, params):
    found, _ = drawn(views.views(cirelli, ALPHA)[1])
    axes = {name: TRIAD[name] @ attitude.T for name, attitude in attitudes(params).items() if name in TRIAD}
    for k in (0, 1):
        e, _, z = axes[HOLES[k]]
        assert along(found[f"side.pin{k + 3}.e"]) == pytest.approx(SIDE @ e)
        marker = cirelli.cross.R * e - cirelli.arm.l_f * z
        assert found[f"fork{k + 1}"].mean(axis=0) == pytest.approx(SIDE @ marker)
    output = np.array([np.sin(ALPHA), 0.0, np.cos(ALPHA)])  # docs/model.md, Frames
    assert found["fork4"].mean(axis=0) == pytest.approx(SIDE @ (cirelli.arm.l_f * output))
    towards = np.cross(*SIDE)
    assert towards == pytest.approx(axes["pin1"][0])  # pin 1 is in front
    # on the near side a shaft that turns forward moves the way of its axis times the direction towards the reader
    for name, sense in (("turning.input", 1.0), ("turning.output", -1.0)):
        shaft = np.array([0.0, 0.0, 1.0]) if name == "turning.input" else output
        assert along(found[name]) @ SIDE @ np.cross(shaft, towards) * sense > 0.8


def test_markers_are_those_of_the_kernels_bushings(cirelli, params):
    """`bushing.markers` gives places in axes of the base: hub, input shaft, output shaft."""
    base_at, (front, side) = attitudes(params), (drawn(panel)[0] for panel in views.views(cirelli, ALPHA))
    for i, own in enumerate(CARDAN.bushings):
        _, on_base = bushing.markers(i, params(ALPHA)[0])
        place = base_at[own.base] @ np.array(on_base)
        if own.name != "fork3":  # behind fork4
            found, view = (front, FRONT) if own.base == "hub" else (side, SIDE)
            assert found[own.name].mean(axis=0) == pytest.approx(view @ place, abs=1e-12)


@pytest.fixture(scope="module")
def kinds(cirelli):
    return drawn(views.kinds_of_errors(cirelli))[0]


@pytest.mark.parametrize("kind", MEANINGS)
@pytest.mark.parametrize("name", ["pin", "hole"])
def test_an_error_is_drawn_in_the_sense_that_perturb_gives_it(cirelli, kinds, kind, name):
    """A small positive error of pin 1 or hole 4, in axes of its frame, against the drawing with and without it."""
    feature = {"pin": "pin1", "hole": "hole4"}[name]
    errors = nominal_errors(1, CARDAN)
    errors[f"{feature}.{kind}"] = 1e-5
    row, before = (perturb(cirelli, OPERATION, table)[0] for table in (errors, nominal_errors(1, CARDAN)))
    part = f"{feature}.2" if name == "hole" else feature
    moved, ideal = (kinds[f"{kind}.{state}.{part}"] for state in ("moved", "ideal"))
    if kind == "diameter":
        wider = (row["clearance"][0] - before["clearance"][0]) * (1.0 if name == "hole" else -1.0)
        assert np.sign(moved[2, 0] - ideal[2, 0]) == -np.sign(wider) if name == "pin" else np.sign(wider)
        return
    field = f"{name}_{'axis' if kind.startswith('tilt') else 'point'}"
    change = row[field][0] - before[field][0]
    e, t, z = TRIAD[feature]
    right, up = (z, e) if kind in ("offset_z", "tilt_t") else (-t, e)
    expected = np.array([change @ right, change @ up])
    axis = (moved[1] - moved[0]) - (ideal[1] - ideal[0]) if kind.startswith("tilt") else moved[0] - ideal[0]
    assert axis @ expected / np.hypot(*axis) / np.hypot(*expected) == pytest.approx(1.0, abs=0.02)
    assert np.cross(right, up) == pytest.approx(z if right is not z else t)


def test_gaps_of_a_joint_are_its_clearances_and_errors_enlarged(cirelli, random_errors):
    errors = nominal_errors(1, CARDAN)
    for name, value in random_errors(5).items():
        errors[name.replace("__", ".")] = value
    par, z = perturb(cirelli, OPERATION, errors)[0], cirelli.contact.z
    (panel,) = views.errors_of(cirelli, OPERATION, errors, "", "row")
    (factor,) = map(float, re.findall(r"enlarged (\S+) times", panel.description))
    found, _ = drawn(panel)
    for i, number in enumerate(HOLE_OF_PIN):
        e, t, own_z = TRIAD[PINS[i]]
        for way, right in (("along_z", -t), ("along_t", own_z)):
            inner_left, outer_left, outer_right, inner_right = found[f"{way}.{PINS[i]}"]
            left, other = (found[f"{way}.{HOLES[number - 1]}.{k}"] for k in (1, 2))
            for end, s in ((0, -0.5 * z), (1, 0.5 * z)):
                apart = par["pin_point"][i] + s * par["pin_axis"][i] - par["hole_point"][i] - s * par["hole_axis"][i]
                drawn_left = (inner_left, outer_left)[end][0] - left[end][0]
                drawn_right = other[end][0] - (inner_right, outer_right)[end][0]
                assert drawn_left == pytest.approx(factor * (par["clearance"][i] + apart @ right), abs=2e-8 * factor)
                assert drawn_right == pytest.approx(factor * (par["clearance"][i] - apart @ right), abs=2e-8 * factor)
            shift = found[f"{way}.{PINS[i]}"].mean(axis=0) - 0.5 * (left + other).mean(axis=0)
            assert shift[1] == pytest.approx(factor * (par["pin_point"][i] - par["hole_point"][i]) @ e, abs=1e-9)


def test_a_joint_without_errors_and_clearance_is_drawn_as_it_is(cirelli):
    contact = {"D_H": "76 mm", "k1u": "7.5e7 N/mm^2", "k2u": "1.2e6 N/mm"}
    fitting = joints.load("cirelli2021", {"contact": contact}, "test")
    (panel,) = views.errors_of(fitting, OPERATION, nominal_errors(1, CARDAN), "", "row")
    assert "enlarged 1 times" in panel.description
    assert drawn(panel)


def test_sizes_are_written_beside_the_drawing(cirelli):
    front, side = views.views(cirelli, ALPHA)
    words = [{text.get_text().strip() for text in drawn(panel)[1].findobj(mpl.text.Text)} for panel in (front, side)]
    sizes = "pin ⌀ 76 mm\nhole ⌀ 76.2 mm\nradial clearance 0.1 mm"
    assert {"R = 72.82 mm", "r_b = 36.41 mm", "z = 22 mm", sizes} <= words[0]
    assert f"α = {np.degrees(ALPHA):.4g}°" in words[1]


def table(joint, *points):
    return {row["dimension"]: row["value"] for row in dimensions.dimensions(joint, points or [Point("", OPERATION)])}


def test_the_table_has_what_a_joint_has_beside(cirelli):
    keys = {"input": {"bearings": ["70 mm", "190 mm"]}, "unbalance": {"amount": "400 g*mm", "angle": "0 deg"}}
    values = table(joints.load("pin25", {"shaft": keys}, "x.toml"))
    expected = {"thrust.end_play": "0.02 mm", "friction.mu": "0.004", "shaft.input.bearings": "70, 190 mm"}
    assert (expected | {"shaft.unbalance": "400 g*mm"}).items() <= values.items()
    assert not table(cirelli).keys() & (expected.keys() | {"shaft.output.bearings", "shaft.unbalance"})


@pytest.mark.parametrize(
    ("friction", "along"), [({"mu": 0.1}, "0.05"), ({"mu": 0.1, "mu_along": 0.2}, "0.2"), ({}, "0.05")]
)
def test_the_table_has_both_coefficients_of_friction(friction, along):
    values = table(joints.load("pin25", {"friction": friction}, "x.toml"))
    assert values["friction.mu"] == str(friction.get("mu", 0.004))
    assert values["friction.mu_along"] == along


def test_without_a_coefficient_along_the_pins_that_around_them_is_shown(cirelli):
    joint = joints.load("cirelli2021", {"friction": {"mu": 0.08}}, "x.toml")
    assert table(joint)["friction.mu_along"] == "0.08"


def test_the_table_has_the_operating_points(cirelli):
    slow = OPERATION.model_copy(update={"speed": 10.0 * np.pi, "torque": -75.0})
    values = table(cirelli, Point("fast", OPERATION, 0.9), Point("slow", slow, 0.1))
    assert values["operation.fast"] == "17.189 deg, 477.46 rpm, 100 N m"
    assert values["operation.slow"] == "17.189 deg, 300 rpm, -75 N m"
    assert "operation.alpha" not in values


@pytest.mark.parametrize("alpha", [-20.0, 0.0, 15.0, 32.0])
@pytest.mark.parametrize("over", [{}, SLIM, SHORT], ids=["paper", "slim", "short"])
def test_labels_are_inside_and_apart(over, alpha):
    joint = joints.load("cirelli2021", over, "test")
    for panel in views.views(joint, np.radians(alpha), ("cross1", "cross3", "fork4", "pin1")):
        _, figure = drawn(panel)
        renderer = figure.canvas.get_renderer()
        texts = [text for text in figure.findobj(mpl.text.Text) if text.get_text() and text.get_visible()]
        boxes = {
            text.get_text() + str(i): mpl.text.Text.get_window_extent(text, renderer) for i, text in enumerate(texts)
        }
        assert len(boxes) > 15
        for name, box in boxes.items():
            assert figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1, name
            assert figure.bbox.y0 <= box.y0 < box.y1 <= figure.bbox.y1, name
        over_each_other = [(a, b) for a, b in combinations(boxes, 2) if boxes[a].overlaps(boxes[b])]
        assert over_each_other == []


@pytest.mark.parametrize("over", [{}, SLIM], ids=["paper", "slim"])
def test_labels_of_errors_are_inside_and_apart(over, random_errors):
    joint = joints.load("cirelli2021", over, "test")
    errors = nominal_errors(1, CARDAN)
    for name, value in random_errors(6).items():
        errors[name.replace("__", ".")] = value
    for panel in (
        views.kinds_of_errors(joint),
        *views.errors_of(joint, OPERATION, errors, "", "row"),
    ):
        _, figure = drawn(panel)
        renderer = figure.canvas.get_renderer()
        texts = [text for text in figure.findobj(mpl.text.Text) if text.get_text() and text.get_visible()]
        boxes = [mpl.text.Text.get_window_extent(text, renderer) for text in texts]
        assert all(figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1 for box in boxes)
        assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def call(*args):
    return CliRunner().invoke(app, ["show", *map(str, args)])


def texts_and_outlines(path):
    """Texts of an SVG in their order, and the numbers of the outlines that have a name with a dot."""
    text = path.read_text(encoding="utf-8")
    named = re.findall(r'<g id="([\w]+\.[\w.]+)">\s*<path d="([^"]*)"', text)
    return re.findall(r"<!-- (.*?) -->", text), {
        name: np.array(re.findall(r"-?[\d.]+", path), float) for name, path in named
    }


@pytest.mark.parametrize(
    ("name", "options"), [("joint", ()), ("joint_narrow", ("--columns", 1)), ("errors", ("--errors",))]
)
def test_drawings_in_the_documents_are_up_to_date(here, name, options):
    """If this fails: ``tolstat show cirelli2021 --out docs/joint.svg``, and as parametrized the others."""
    assert call("cirelli2021", "--out", f"{name}.svg", *options).exit_code == 0
    made, kept = (texts_and_outlines(folder / f"{name}.svg") for folder in (here, ROOT / "docs"))
    assert made[0] == kept[0]
    assert len(made[0]) > 20
    assert made[1].keys() == kept[1].keys()
    assert len(kept[1]) > 10
    for outline, points in made[1].items():
        assert points == pytest.approx(kept[1][outline], abs=0.05), outline


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (("cirelli", "--row", 3), "cirelli: has no rows"),
        (("cirelli",), "did you mean 'cirelli2021'"),
        (("none.toml",), "none.toml: cannot be read"),
        (("none.h5",), "no joint is named 'none.h5'"),
        (("small.h5", "--row", 1000), "has rows 0 to 60, not 1000"),
        (("cirelli2021", "--alpha", "3"), "--alpha: alpha: '3' has no unit"),
        (("cirelli2021", "--alpha", "95 deg"), "--alpha: alpha: a Cardan joint cannot turn"),
        (("cirelli2021", "--out", "joint.txt"), "--out joint.txt: is not a picture"),
        (("small.h5", "--errors", "--row", 2), "--errors: cannot be used together with --row"),
    ],
)
def test_what_cannot_be_drawn_is_exit_code_2_and_writes_nothing(here, args, said):
    synthetic.store(here)
    before = sorted(here.iterdir())
    done = call(*args)
    assert (done.exit_code, done.stdout) == (2, "")
    assert said in done.stderr
    assert sorted(here.iterdir()) == before


def test_page_marks_the_leading_loads_and_draws_the_worst_joints(tmp_path):
    with ResultFile.open(synthetic.store(tmp_path)) as store:
        view, asked = store.view(), Asked(store.path)
        marked = answer.place_of(view, "fork2.T", asked)
        joint, _, part, _ = answer.drawings(view).parts
        worst = {int(view.rows(int(np.argmax(loads_of(CARDAN)[name].of(view.results))))) for name in view.leading}
    places = {name.partition(".")[0] for name in view.leading} - {"psi"}
    assert (marked.key, marked.title) == ("joint-worst", "fork2: nearest to its limit")
    assert "Marked: fork2." in marked.description
    panels = joint.panels
    assert [panel.key for panel in panels] == ["joint-front", "joint-side", "error-kinds"]
    assert f"Marked: {', '.join(sorted(places))}." in panels[0].description
    assert {panel.key for panel in part.panels} == {f"drawn-{row}" for row in worst}
    assert asked.notes == []


def test_figures_of_the_package(cirelli):
    import tolstat

    figure = tolstat.draw_joint(cirelli, ALPHA)
    assert figure.texts[0].get_text() == cirelli.description
    assert unwrap(tolstat.draw_errors) is answer.draw_errors
    assert len(tolstat.draw_row(cirelli, OPERATION, nominal_errors(1, CARDAN), "one").axes) == 1
