"""Reports: tables against hand-counted shares, files of every kind of campaign, pictures that can be read."""

import json
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from matplotlib.text import Text

from tests.support import reports, synthetic
from tests.support.environment import ROOT
from tests.support.views import at_points, swept, view
from tolstat import joint
from tolstat.common.cardan import CARDAN
from tolstat.common.errors import InputError, StoreError
from tolstat.common.load_kinds import kinds
from tolstat.common.tables import Status
from tolstat.display import style
from tolstat.display.table import alike, fitted
from tolstat.joint.derived import DERIVED
from tolstat.questions import sweep
from tolstat.questions.exceedance import answer as exceedance
from tolstat.questions.exceedance import curves, rows
from tolstat.questions.sweep import swept_axes
from tolstat.report.answer import write_report
from tolstat.report.page import joint_values
from tolstat.store import ResultFile


def sheet(made):
    return curves.sheet(made, [made.head(), exceedance.note(made)])


def texts(figure):
    return [t.get_text() for t in figure.findobj(Text) if t.get_text()]


def test_every_limit_has_a_row_with_its_share_and_the_nominal_load():
    made = view(limits={"fork3.T": 18.0, "pin2.contact": 650.0, "psi": 1.1e-4})
    table = pd.DataFrame(rows.limit_rows(made))
    assert list(table["load"]) == ["fork3.T", "pin2.contact", "psi"]
    assert list(table["unit"]) == ["N*m", "N", "1"]
    assert list(table["count"]) == [
        int((made.results["T_max"][:, kinds(CARDAN)["T"].places.index("fork3")] > 18.0).sum()),
        int((made.results["contact_max"][:, 1].max(axis=1) > 650.0).sum()),
        int((made.results["psi_max"] > 1.1e-4).sum()),
    ]
    assert table["nominal"][0] == made.nominal["T_max"][0, kinds(CARDAN)["T"].places.index("fork3")]


def test_failed_and_unsettled_joints_are_counted_both_ways():
    table = exceedance.limits(view(failed=7, unsettled=5)).frame("limits")
    row = table.iloc[0]
    assert (row["n"], row["n_failed"], row["n_unsettled"]) == (200, 7, 5)
    assert row["bound_upper"] - row["bound_lower"] == pytest.approx(12 / 200)
    assert "with unresolved joints" in fitted(exceedance.LIMITS, table.to_dict("records"), None)[0]
    assert "with unresolved joints" not in fitted(exceedance.LIMITS, rows.limit_rows(view()), None)[0]


def test_loads_share_a_row_only_where_all_numbers_agree_as_printed():
    first = rows.limit_rows(view())[0]
    near, more = {**first, "nominal": first["nominal"] * (1.0 + 1e-7)}, {**first, "count": first["count"] + 1}
    far = {**first, "nominal": 1.01 * first["nominal"]}
    named = [{**row, "load": load} for row, load in zip((first, near, more, far), "abcd", strict=True)]
    shown = alike(named, exceedance.LIMITS)
    assert [row["load"] for row in shown] == ["a, b", "c", "d"]
    assert shown[0]["nominal"] == first["nominal"]


def test_dependent_samples_have_no_interval_and_the_note_says_why():
    made = view(method="cases", failed=2)
    assert pd.DataFrame(rows.limit_rows(made))[["lower", "upper", "outer_upper"]].isna().all(axis=None)
    assert pd.DataFrame(rows.limit_rows(made))["bound_upper"].notna().all()
    assert "no sample of a production" in exceedance.note(made)
    assert "95 % band" not in texts(curves.sheet(made, []))


def test_quantiles_rise_with_the_share():
    table = pd.DataFrame(rows.quantile_rows(view()))
    assert len(table) == 16 * len(rows.SHARES)
    for _, part in table.groupby("load"):
        assert part["estimate"].is_monotonic_increasing


def test_curves_fall_from_every_load_to_none_and_are_thinned():
    table = pd.DataFrame(rows.curve_rows(view(4001)))
    assert table["load"].nunique() == 16
    for _, part in table.groupby("load"):
        assert len(part) <= rows.MAX_LEVELS
        assert part["level"].is_monotonic_increasing
        assert part["estimate"].is_monotonic_decreasing
        assert part["estimate"].iloc[-1] == 0.0
        assert list(part["count"].iloc[-10:]) == list(range(9, -1, -1))


def test_unknown_load_names_what_there_is():
    with pytest.raises(InputError, match=r"cross9\.F.*\n.*cross"):
        view().load("cross9.F")


def test_picture_states_study_numbers_units_and_limits():
    made = view(failed=3, unsettled=2, limits={"cross1.F": 700.0, "cross2.F": 705.0, "fork1.T": 500.0})
    figure = sheet(made)
    said = texts(figure)
    assert any(t.startswith("made up") for t in said)
    assert any("200 joints (random sampling), 3 failed, 2 not settled" in t for t in said)
    assert {"limit 700 N (1)", "limit 705 N (2)"} <= set(said)
    assert "limit 500 N m (1) →" in said  # far off: an arrow, so that the curves keep their width
    assert sum("[N]" in t for t in said) == 2
    assert sum("[N m]" in t for t in said) == 2
    floors = {ax.get_ylim()[0] for ax in figure.axes}
    assert floors == {0.5 / 200}
    assert {ax.get_yscale() for ax in figure.axes} == {"log"}


def test_pictures_show_all_loads_with_limits():
    """Loads of one kind at the same operating points share a panel."""
    limits = {"pin2.contact": 650.0, "psi": 1.1e-4, "pin3.contact": 650.0}
    for draw, made in ((curves.sheet, view(limits=limits)), (sweep.sheet, swept(limits=limits))):
        figure = draw(made, []) if draw is curves.sheet else draw(made)
        titles = [ax.get_title("left") for ax in figure.axes]
        assert titles[4:] == ["Contact force", "|Psi|"]
        assert {"limit 650 N", "pin2.contact", "pin3.contact", "psi"} <= set(texts(figure))
    one = at_points({"a": synthetic.results(21), "b": synthetic.results(21)}, {"cross1.F at b": 650.0})
    assert [ax.get_title("left") for ax in curves.sheet(one, []).axes][4:] == ["Bushing force at b"]


def _not_drawn(figure):
    """Labels of ticks outside of their axis, which matplotlib keeps but does not draw."""
    hidden = []
    for axis in (axis for ax in figure.axes for axis in (ax.xaxis, ax.yaxis)):
        low, high = sorted(axis.get_view_interval())
        for tick in axis.get_major_ticks() + axis.get_minor_ticks():
            if not low <= tick.get_loc() <= high:
                hidden += [tick.label1, tick.label2]
    return hidden


def overlapping(figure):
    """Pairs of texts on a page whose boxes overlap."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer, page = canvas.get_renderer(), figure.bbox
    boxes = []
    hidden = _not_drawn(figure)
    for item in figure.findobj(Text):
        if not item.get_text().strip() or not item.get_visible() or item in hidden:
            continue
        box = item.get_window_extent(renderer)
        if box.xmin < 0 or box.ymin < 0 or box.xmax > page.xmax or box.ymax > page.ymax:
            return [(item.get_text(), "the page's edge")]
        boxes.append((item.get_text(), box.shrunk(0.96, 0.9)))
    return [(a, b) for i, (a, x) in enumerate(boxes) for b, y in boxes[i + 1 :] if x.overlaps(y)]


@pytest.mark.parametrize(
    "draw",
    [
        lambda: sheet(view(failed=3, unsettled=2, limits={f"{b}.F": 700.0 for b in kinds(CARDAN)["F"].places})),
        lambda: sheet(view(limits={f"cross{i}.T": 16.0 + i for i in (1, 2, 3, 4)})),
        lambda: sweep.sheet(swept(limits={"cross1.F": 800.0})),
        lambda: sweep.sheet(swept(9)),
    ],
)
def test_no_text_lies_on_another_or_leaves_the_page(draw):
    assert overlapping(draw()) == []


@pytest.mark.parametrize("status", [Status.PENDING, Status.NEWTON_FAILED])
def test_a_campaign_without_a_valid_joint_still_gets_a_page(status):
    def change(results):
        results["status"] = status

    made = view(21, change=change)
    assert texts(curves.sheet(made, [])).count("no joint with a valid result") == 4
    assert not rows.curve_rows(made)
    share = pd.DataFrame(rows.limit_rows(made))["estimate"]
    assert share.isna().all()
    assert "-" in fitted(exceedance.LIMITS, rows.limit_rows(made))[0]


def test_joints_that_are_all_alike_can_be_drawn():
    def change(results):
        results["F_max"] = 640.0

    made = view(21, change=change)
    assert len(curves.sheet(made, []).axes) == 4


def test_sweep_finds_its_axes_and_their_units():
    diameter, tilt = swept_axes(swept(3))
    assert (diameter.label, diameter.unit) == ("pin*.diameter", "mm")
    assert (diameter.values.min(), diameter.values.max()) == pytest.approx((-0.1, 0.1))
    assert (tilt.label, tilt.unit) == ("pin1.tilt_z", "deg")
    assert np.unique(tilt.values) == pytest.approx([0.5, 0.75, 1.0])
    assert swept_axes(swept(1, named=False))[0].label == "pin1.diameter and 3 more"


def two_without_load(results):
    results["status"][[2, 5]] = [Status.OUTSIDE_MODEL, Status.NOT_SETTLED]
    results["F_max"][2] = np.nan


def test_sweep_table_keeps_every_joint_with_its_status():
    made = swept(change=two_without_load)
    found = sweep.sweep(made)
    table = found.frame("sweep")
    assert len(table) == 11
    assert list(table["status"][[2, 5]]) == ["outside_model", "not_settled"]
    np.testing.assert_array_equal(table["cross1.F [N]"], made.results["F_max"][:, 0])
    short = found.tables["sweep"].for_people
    assert [row["fork.T [N*m]"] for row in short] == list(made.results["T_max"][:, 4:].max(axis=1))


def test_sweep_table_has_the_loads_with_limits():
    made = swept(limits={"pin2.contact": 650.0})
    found = sweep.sweep(made)
    np.testing.assert_array_equal(
        found.frame("sweep")["pin2.contact [N]"], made.results["contact_max"][:, 1].max(axis=1)
    )
    shown = fitted(found.tables["sweep"].columns, found.tables["sweep"].for_people, 50)[0]
    assert "pin2.contact [N]" in shown
    assert "fork.T [N m]" not in shown


def test_sweep_page_shows_unsettled_and_failed_joints():
    made = swept(change=two_without_load)
    said = texts(sweep.sheet(made))
    assert "not settled" in said
    assert "no result" in said
    assert said.count("pin*.diameter [mm]") == 4


@pytest.mark.slow
def test_numbers_need_neither_pandas_nor_matplotlib(tmp_path):
    path = synthetic.store(tmp_path)
    code = (
        "import sys; from tolstat.cli import app; app([*sys.argv[1:]], standalone_mode=False)\n"
        "print('pandas' in sys.modules, 'matplotlib' in sys.modules, file=sys.stderr)"
    )
    argv = [sys.executable, "-c", code, "report", path, "--json"]
    done = subprocess.run(argv, capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stderr.split() == ["False", "False"]
    assert len(json.loads(done.stdout)["tables"]) == 3


@pytest.mark.slow
def test_report_without_limits_prints_quantiles(tmp_path):
    plain = synthetic.STUDY.partition("[limits]")[0]
    made = reports.build(synthetic.store(tmp_path, plain))
    assert "95 % interval of 99 %" in made.table
    assert len(made.table.splitlines()) == 3 + 1 + 16
    assert not (tmp_path / "small_limits.csv").exists()


def test_report_of_a_sweep_into_another_folder(tmp_path):
    elsewhere = tmp_path / "pictures"
    elsewhere.mkdir()
    files = write_report(synthetic.store(tmp_path, synthetic.SWEEP, "clearance"), elsewhere)
    assert [f.name for f in files] == [f"clearance_sweep.{kind}" for kind in ("png", "svg", "csv")]
    table = pd.read_csv(elsewhere / "clearance_sweep.csv")
    assert table["pin*.diameter [mm]"].iloc[[0, -1]].tolist() == pytest.approx([-0.1, 0.1])


@pytest.mark.slow
def test_same_file_same_bytes(tmp_path):
    path = synthetic.store(tmp_path)
    first = [file.read_bytes() for file in write_report(path)]
    assert [file.read_bytes() for file in write_report(path)] == first
    with ResultFile.open(path) as store:
        for source in (store, store.view()):
            assert [file.read_bytes() for file in write_report(source)] == first


@pytest.mark.slow
def test_folder_that_cannot_be_made_and_file_that_is_not_ours(tmp_path):
    path = synthetic.store(tmp_path)
    assert write_report(path, tmp_path / "new")[0].parent == tmp_path / "new"
    with pytest.raises(InputError, match="another folder"):
        write_report(path, path / "nowhere")
    (tmp_path / "other.h5").write_text("not HDF5")
    with pytest.raises(StoreError):
        write_report(tmp_path / "other.h5")


@pytest.mark.slow
def test_drawing_leaves_the_callers_settings_alone_and_needs_no_pyplot():
    code = (
        "import sys, matplotlib as m; before = m.rcParams.copy();"
        "from tests.report import test_report as t;"
        "t.sheet(t.view(21));"
        "print(dict.__eq__(before, m.rcParams), 'matplotlib.pyplot' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.split() == ["True", "False"]


def test_colours_differ_for_dichromats():
    """Distances of the four colours in a simulation of protan and deutan vision (Viénot et al. 1999)."""
    from matplotlib.colors import to_rgb

    linear = np.array([to_rgb(c) for c in style.COLOURS]) ** 2.2
    to_lms = np.array([[17.8824, 43.5161, 4.11935], [3.45565, 27.1554, 3.86714], [0.0299566, 0.184309, 1.46709]])
    protan = np.array([[0.0, 2.02344, -2.52581], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    deutan = np.array([[1.0, 0.0, 0.0], [0.494207, 0.0, 1.24827], [0.0, 0.0, 1.0]])
    for loss in (protan, deutan):
        seen = np.clip(linear @ (np.linalg.inv(to_lms) @ loss @ to_lms).T, 0, 1) ** (1 / 2.2)
        apart = [np.linalg.norm(seen[i] - seen[j]) for i in range(4) for j in range(i)]
        assert min(apart) > 0.25


def test_values_of_the_joint_that_differ_from_the_one_that_comes_along():
    file = SimpleNamespace(path="x.h5", points={}, joint=joint.load("cirelli2021", {}, "x").given("json"))
    assert joint_values(file).text == "none: it is cirelli2021"
    file.joint = joint.load("cirelli2021", {"contact": {"clearance": "0.05 mm", "law": "point"}}, "x").given("json")
    rows = [line.split("  ") for line in joint_values(file).text.splitlines()]
    rows = {row[0]: [cell.strip() for cell in row[1:] if cell.strip()] for row in rows}
    assert rows["contact.clearance"] == ["0.05 mm", "0.1 mm", "given"]
    assert rows["contact.law"] == ["point", "mode", "given"]
    assert rows["contact.D_P"][:2] == ["76.1 mm", "76 mm"]
    assert rows["contact.k1p"][2] == DERIVED["contact.k1p"].formula
    assert "pin.d" not in rows
    file.joint = joint.load("pin25", {}, "x").given("json")
    (radius,) = [line.split() for line in joint_values(file).text.splitlines() if line.startswith("friction.radius")]
    assert radius[1:4] == ["12.5", "mm", "-"]  # the other joint has a radius in its file, but no friction
