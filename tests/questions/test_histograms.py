"""Histograms against counts by hand: errors of each entry with their band, loads in linear and logarithmic bins."""

import numpy as np
import pytest

from tests.support import synthetic
from tests.support.views import view
from tolstat.common.errors import NotApplicable
from tolstat.questions import histograms
from tolstat.store import ResultFile

TOLERANCES = """
"pin[12].offset_t" = { plus_minus = "0.1 mm", distribution = "normal", cpk = 0.5 }
"hole*.diameter" = { lower = "0 mm", upper = "0.03 mm", distribution = "uniform" }
"pin3.position" = { zone = "⌀0.1 mm", over = "20 mm", distribution = "uniform" }
"""


def drawn(folder, change=lambda text: text):
    text = synthetic.STUDY.replace(
        '"pin*.offset_t" = { plus_minus = "0.1 mm", distribution = "normal", cpk = 1.0 }\n', ""
    )
    text = change(text.replace("[tolerances]", f"[tolerances]{TOLERANCES}"))
    with ResultFile.open(synthetic.store(folder, text)) as store:
        made = store.view()
        return histograms.drawn(made), made.errors(np.arange(made.n))


def test_errors_of_an_entry_are_counted_together_against_their_band(tmp_path):
    found, errors = drawn(tmp_path)
    assert [own.entry for own in found] == ["pin[12].offset_t", "hole*.diameter", "pin3.position", "pin3.position"]
    offsets = np.concatenate([errors["pin1.offset_t"], errors["pin2.offset_t"]])
    first, holes, *zones = found
    assert first.band == pytest.approx((-1e-4, 1e-4))
    assert first.outside == np.mean(np.abs(offsets) > 1e-4) > 0.05
    assert first.share == pytest.approx(np.histogram(offsets, first.edges)[0] / offsets.size)
    assert holes.errors == tuple(f"hole{k}.diameter" for k in (1, 2, 3, 4))
    assert holes.outside == 0.0
    assert holes.edges[[0, -1]] == pytest.approx([0.0, 3e-5])
    assert [(own.band, own.unit) for own in zones] == [(None, "m"), (None, "rad")]
    assert all(own.share.sum() == pytest.approx(1.0) for own in found)


@pytest.mark.parametrize(("factor", "logarithmic"), [(1.0, False), (9.0, True)])
def test_loads_with_a_long_tail_have_bins_of_equal_ratio(factor, logarithmic):
    def change(results):
        results["F_max"][0] *= factor

    load = view(failed=5, change=change).load("cross1.F")
    edges, share = histograms.of_load(load)
    steps = np.diff(np.log(edges) if logarithmic else edges)
    assert steps == pytest.approx(steps[0])
    assert share == pytest.approx(np.histogram(load.valid, edges)[0] / load.valid.size)
    assert share.sum() == pytest.approx(1.0)


def test_a_picture_says_which_other_entries_its_errors_include(tmp_path):
    """The tilt of a common axis moves both of its features; coaxiality adds to their tilt, and not to their place."""
    zones = """
"input_pins.position" = { zone = "⌀0.1 mm", over = "80 mm", distribution = "uniform" }
"input_pins.perpendicularity" = { zone = "⌀0.05 mm", over = "80 mm", distribution = "uniform" }
"input_pins.coaxiality" = { zone = "⌀0.02 mm", over = "20 mm", distribution = "uniform" }
"""
    found, *_ = drawn(tmp_path, lambda text: text.replace(TOLERANCES, zones))
    tilt, relative = "input_pins.perpendicularity", "input_pins.coaxiality"
    assert {own.entry: own.others for own in found} == {
        "input_pins.position": (tilt,), tilt: (relative,), relative: (tilt,)
    }  # fmt: skip
    titles = [histograms._drawn_panel(own, k, found).title for k, own in enumerate(found)]
    assert titles[0] == f"input_pins.position: diameter 0.1 mm; includes {tilt}"


def test_joints_that_are_no_sample_have_no_histograms():
    with pytest.raises(NotApplicable, match="no errors or loads of a random sample"):
        histograms.histograms(view(method="sweep"))
