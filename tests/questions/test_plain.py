"""Plain picture of mechanisms: frames against the naive twin, places that are drawn, labels, what stands out."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Annotation

import tolstat
from tests.kernel.test_bearing_line import LINE
from tests.kernel.test_bearing_line import parameters as of_line
from tests.support import linkages, naive
from tests.support.environment import ROOT
from tests.support.mechanisms import triads
from tolstat import study
from tolstat.common.cardan import CARDAN
from tolstat.common.mechanism import (
    ALONG_Z,
    DRIVEN,
    HELD,
    Bushing,
    Hinge,
    Lump,
    Mechanism,
    Member,
    Pair,
    Shaft,
    Z,
)
from tolstat.common.tables import blank_params
from tolstat.display import drawing
from tolstat.joint import nominal_errors, perturb
from tolstat.questions.drawings import plain
from tolstat.questions.drawings.plain import MARKED, VIEWS, Frame

LINKS = {"A": ("ground", "crank"), "B": ("crank", "coupler"), "C": ("rocker", "coupler"), "D": ("ground", "rocker")}
"""Members that have the hole and the pin of each hinge of a four-bar linkage."""
ENDS = {"A": (0.0, 0.0, 0.0), "B": (0.05, 0.08, 0.0), "C": (0.3, 0.2, 0.0), "D": (0.28, 0.0, 0.0)}
FOUR_BAR = Mechanism(
    "four-bar linkage",
    members=(
        Member("ground", HELD, True),
        Member("crank", DRIVEN, True),
        Member("coupler", DRIVEN),
        Member("rocker", DRIVEN),
    ),
    lumps=tuple(
        Lump(f"{what}{name}", LINKS[name][side], f"{what}{name}", ALONG_Z)
        for side, what in ((1, "pin"), (0, "hole"))
        for name in LINKS
    ),
    shafts=tuple(Shaft(f"of_{member}", member) for member in ("ground", "crank", "coupler", "rocker")),
    bushings=tuple(
        Bushing(f"carry_{what}{name}", f"{what}{name}", f"of_{LINKS[name][side]}", f"{what}{name}", "bushing")
        for side, what in ((1, "pin"), (0, "hole"))
        for name in LINKS
    ),
    hinges=tuple(Hinge(name, pin, hole, Z) for name, (hole, pin) in LINKS.items()),
    pairs=tuple(Pair(f"pin{name}", f"hole{name}", name) for name in LINKS),
)


def of_four_bar():
    """Parameters, and frames with translations: the origin of each member is its first hinge, its x axis points on."""
    par = blank_params(1, FOUR_BAR).view(np.recarray)
    par.R = 0.03
    on = {"ground": ("A", "D"), "crank": ("A", "B"), "coupler": ("B", "C"), "rocker": ("D", "C")}
    group = {}
    for member, (first, second) in on.items():
        x, y, _ = np.subtract(ENDS[second], ENDS[first])
        group[member] = Frame(np.array(ENDS[first]), naive.turn((0, 0, 1), np.arctan2(y, x)))
    for i, (lump, triad) in enumerate(zip(FOUR_BAR.lumps, triads(FOUR_BAR), strict=True)):
        origin, attitude = group[lump.member]
        par.at[0, i] = triad @ attitude.T @ (ENDS[lump.name[-1]] - origin)
        par.marker[0, FOUR_BAR.bushing_kinds.index(lump.kind), 1] = par.at[0, i]
    return par, group


def drawn(panel):
    """Points of what is drawn, by name, and the figure."""
    figure = Figure(figsize=panel.size)
    with drawing.style.settings(drawing._SETTINGS):
        panel.draw(figure.add_axes((0, 0, 1, 1)))
        FigureCanvasAgg(figure).draw()
    return {line.get_gid(): line for line in figure.findobj(Line2D) if line.get_gid()}, figure


def test_frames_are_those_of_the_naive_twin(params) -> None:
    row = params(0.3)[0]
    found = plain.frames(CARDAN, row)
    for member, expected in zip(CARDAN.members, naive.frames(0.0, row), strict=True):
        np.testing.assert_allclose(found[member.name].attitude, expected, atol=1e-14)
        assert not found[member.name].origin.any()


def test_pins_forks_and_shafts_of_a_cardan_joint(params, cirelli) -> None:
    """A fork's line goes from the hole along the arm to its bushing and from there to the axis of the shaft."""
    row, alpha = params(0.3)[0], 0.3
    found, _ = drawn(plain.views(CARDAN, row, plain.frames(CARDAN, row)))
    R, l_f = 1e3 * cirelli.cross.R, 1e3 * cirelli.arm.l_f
    places = np.array([(0, R, 0), (0, -R, 0), (R, 0, 0), (-R, 0, 0)])
    output = np.array([np.sin(alpha), 0.0, np.cos(alpha)])
    arm = np.array([(0.0, R, 0.0), (0.0, R, 0.0) + l_f * output, l_f * output])
    for view, axes in VIEWS.items():
        for i, place in enumerate(places, 1):
            np.testing.assert_allclose(found[f"{view}.pin{i}"].get_xydata()[0], place[list(axes)], atol=1e-9)
        np.testing.assert_allclose(found[f"{view}.fork4.line"].get_xydata(), arm[:, axes], atol=1e-9)
        inner, outer = found[f"{view}.input.line"].get_xydata()
        np.testing.assert_allclose(inner, np.array((0.0, 0.0, -l_f))[list(axes)], atol=1e-9)
        np.testing.assert_allclose(outer, np.array((0.0, 0.0, -l_f - R))[list(axes)], atol=1e-9)


def test_a_shaft_in_three_bearings_lies_along_its_pins() -> None:
    row = of_line(0.0)[0]
    found, _ = drawn(plain.views(LINE, row, plain.frames(LINE, row)))
    for i, z in enumerate((-200.0, 0.0, 200.0), 1):
        np.testing.assert_allclose(found[f"side.pin{i}"].get_xydata(), [(z, 0.0)], atol=1e-9)
    for shaft in ("shaft", "bearings"):
        assert sorted(found[f"top.{shaft}.line"].get_xydata()[:, 0]) == pytest.approx([-250.0, 250.0])


def test_members_stand_where_their_frames_have_them() -> None:
    par, group = of_four_bar()
    found, figure = drawn(plain.views(FOUR_BAR, par[0], group))
    for name, place in ENDS.items():
        for view, axes in VIEWS.items():
            np.testing.assert_allclose(
                found[f"{view}.pin{name}"].get_xydata()[0], 1e3 * np.array(place)[list(axes)], atol=1e-9
            )
    coupler = found["front.carry_pinC.line"].get_xydata()
    np.testing.assert_allclose(coupler[[0, -1]], 1e3 * np.array([ENDS["C"], ENDS["B"]])[:, :2], atol=1e-9)
    for view in figure.axes[0].child_axes:
        box = view.get_window_extent()
        scales = box.width / np.ptp(view.get_xlim()), box.height / np.ptp(view.get_ylim())
        assert scales == pytest.approx((scales[0], scales[0]))
        assert scales[0] == pytest.approx(
            figure.axes[0].child_axes[0].get_window_extent().width / np.ptp(figure.axes[0].child_axes[0].get_xlim())
        )


def test_views_have_one_scale_and_axes_with_their_unit(params) -> None:
    row = params(0.3)[0]
    _, figure = drawn(plain.views(CARDAN, row, plain.frames(CARDAN, row)))
    views = figure.axes[0].child_axes
    labels = [(view.get_title(loc="left"), view.get_xlabel(), view.get_ylabel()) for view in views]
    assert labels == [("side", "z [mm]", "x [mm]"), ("top", "z [mm]", "y [mm]"), ("front", "x [mm]", "y [mm]")]
    scales = [view.get_window_extent().width / np.ptp(view.get_xlim()) for view in views]
    assert scales == pytest.approx([scales[0]] * 3)


def test_what_is_marked_stands_out(params) -> None:
    row, marked = params(0.3)[0], ["cross2", "output"]
    panel = plain.views(CARDAN, row, plain.frames(CARDAN, row), marked)
    assert panel.description.endswith("Marked: cross2, output.")
    found, figure = drawn(panel)
    looks = {name.partition(".")[2].removesuffix(".line") for name, line in found.items() if is_marked(line)}
    assert looks == set(marked)
    bold = [text.get_text() for text in figure.findobj(Annotation) if text.get_fontweight() == "bold"]
    assert sorted(bold) == sorted(marked * 3)
    words = {text.get_text() for text in figure.axes[0].get_legend().get_texts()}
    assert words == {"input", "cross", "output", "bushing", "pin"}


def is_marked(line) -> bool:
    return MARKED.lower() in (to_hex(line.get_color()), to_hex(line.get_markeredgecolor()))


@pytest.mark.parametrize("which", ["line", "four-bar"])
def test_views_and_names_are_inside_the_picture_and_apart(which: str) -> None:
    par, group = of_four_bar()
    line = of_line(0.0)[0]
    mechanism, row, frames, pins = {
        "line": (LINE, line, plain.frames(LINE, line), {"pin1", "pin2", "pin3"}),
        "four-bar": (FOUR_BAR, par[0], group, {"pinA", "pinB", "pinC", "pinD"}),
    }[which]
    _, figure = drawn(plain.views(mechanism, row, frames))
    views, legend = figure.axes[0].child_axes, figure.axes[0].get_legend()
    boxes = [view.get_tightbbox(figure.canvas.get_renderer()) for view in views]
    boxes.append(legend.get_window_extent())
    for box in boxes:
        assert figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1
        assert figure.bbox.y0 <= box.y0 < box.y1 <= figure.bbox.y1
    assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))
    for view in views:
        named = {name for text in view.texts for name in text.get_text().split(", ")}
        assert named == pins


def test_a_figure_of_the_package() -> None:
    figure = tolstat.draw_mechanism(LINE, of_line(0.0))
    assert figure.texts[0].get_text() == "shaft in three bearings"
    assert len(figure.axes[0].child_axes) == 3


def test_members_of_a_linkage_lie_where_the_twin_has_them() -> None:
    mechanism = linkages.mechanism_of("bennett")
    row = linkages.parameters("bennett", mechanism)[0]
    attitudes, origins = naive.placed(0.0, row, mechanism)
    group = plain.frames(mechanism, row)
    for i, member in enumerate(mechanism.members):
        np.testing.assert_allclose(group[member.name].attitude, attitudes[i], atol=1e-12)
        np.testing.assert_allclose(group[member.name].origin, origins[i], atol=1e-12)
    found, _ = drawn(plain.views(mechanism, row, group))
    assert found


def test_a_linkage_is_drawn_as_it_is_and_as_it_moves() -> None:
    """Lines go from the pins to the mass centre of their member; the crank's pin goes round in steps of 45 degrees."""
    one = study.load(ROOT / "studies" / "four_bar.toml")
    row = perturb(one.joint, one.operation, nominal_errors(1, one.mechanism)).view(np.recarray)[0]
    found, figure = drawn(plain.views(one.mechanism, row, plain.frames(one.mechanism, row)))
    for pin, ends in {"B_pin": [(80, 0), (0, 0)], "C_pin": [(400, 240), (490, 120)]}.items():
        np.testing.assert_allclose(found[f"front.{pin}.line"].get_xydata()[[0, -1]], ends, atol=1e-6)
    lines = [
        line.get_xydata() for line in figure.axes[0].child_axes[2].lines if line.get_alpha() == plain.PALE["alpha"]
    ]
    ends = np.array([line[0] for line in lines if np.hypot(*line[-1]) < 1e-6 and np.hypot(*line[0]) > 1.0])
    angles = np.degrees(np.arctan2(*ends.T[::-1])) % 360
    np.testing.assert_allclose(np.sort(angles), np.arange(45, 360, 45), atol=1e-6)
    np.testing.assert_allclose(np.hypot(*ends.T), 80, atol=1e-6)
