"""Zones in questions: other zones by reweighting, scaled entries, causes by component."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from tests.support import synthetic
from tests.support.synthetic import HEAD
from tolstat import sampling, study
from tolstat.common.errors import InputError
from tolstat.common.tables import Simulation
from tolstat.questions.causes.errors import causes
from tolstat.store import View, Writer
from tolstat.study import scaling
from tolstat.study.scaling import changed
from tolstat.study.tolerances.density_ratio import log_ratios

ENTRIES = (
    HEAD
    + """[tolerances]
"pin[12].position" = { zone = "⌀0.1 mm", over = "36 mm", distribution = "normal" }
"hole[12].position" = { zone = "⌀0.1 mm", over = "22 mm", distribution = "uniform" }
"hole[12].perpendicularity" = { zone = "⌀0.05 mm", over = "22 mm", distribution = "normal" }
"output_holes.position" = { zone = "dia 0.1 mm", over = "180 mm", distribution = "normal", truncate = false }
"output_holes.coaxiality" = { zone = "⌀0.02 mm", over = "22 mm", distribution = "uniform" }
"pin3.angularity" = { zone = "0.04 mm", over = "20 mm", distribution = "normal", about = "z" }
[sampling]
n = 20000
"""
)
NARROWER = [
    *("pin[12].position.zone=⌀0.09 mm", "hole[12].perpendicularity.zone=⌀0.04 mm"),
    *("output_holes.position.zone=dia 0.09 mm", "output_holes.coaxiality.zone=⌀0.018 mm"),
    "pin3.angularity.zone=0.036 mm",
]


def load(folder, text=ENTRIES):
    (folder / "plan.toml").write_text(text, encoding="utf-8")
    return study.load(folder / "plan.toml")


def test_reweighted_joints_have_the_moments_of_narrower_zones(tmp_path):
    plan = load(tmp_path)
    new = changed(plan, NARROWER)
    assert sum(new[name] != plan.tolerances[name] for name in new) == 11
    assert sum(name.startswith("hole") and new[name] == plan.tolerances[name] for name in new) == 2
    errors = sampling.draw(plan)[1:]
    values = partial(sampling.values, plan, errors)
    ratios = np.exp(log_ratios(new, plan.tolerances, plan.copula, values, len(errors)))
    assert ratios.mean() == pytest.approx(1.0, abs=0.08)
    text = ENTRIES
    for old, narrow in (("0.05 mm", "0.04 mm"), ("0.02 mm", "0.018 mm"), ('"0.04 mm"', '"0.036 mm"')):
        text = text.replace(f"⌀{old}" if '"' not in old else old, f"⌀{narrow}" if '"' not in old else narrow)
    text = text.replace('⌀0.1 mm", over = "36', '⌀0.09 mm", over = "36').replace("dia 0.1", "dia 0.09")
    fresh = sampling.draw(load(tmp_path, text + "seed = 5\n"))[1:]
    for name in ("pin1.offset_t", "pin2.tilt_z", "hole1.offset_z", "hole1.tilt_t", "hole4.offset_t", "hole3.tilt_t"):
        moment = np.average(errors[name] ** 2, weights=ratios)
        plain = np.mean(errors[name] ** 2)
        assert moment == pytest.approx(np.mean(fresh[name] ** 2), rel=0.1), name
        if name != "hole1.offset_z":
            assert moment < 0.95 * plain, name


@pytest.mark.parametrize(
    ("setting", "found"),
    [
        ("pin1.position.over=30 mm", "another shape"),
        ("hole1.position.zone=⌀0.09 mm", "shares its room"),
        ("hole1.perpendicularity.zone=⌀0.2 mm", "larger than the position's zone"),
        ("pin3.angularity.about=t", "another shape"),
        ("pin1.position.zone=0.09 mm", "must say that it is a diameter"),
    ],
)
def test_changes_that_no_weight_can_make(tmp_path, setting, found):
    with pytest.raises(InputError, match=found):
        changed(load(tmp_path), [setting])


def test_zones_are_scaled_as_written(tmp_path):
    plan = load(tmp_path)
    found = {t.pattern: t for t in scaling.tolerances(plan)}
    assert "hole[12].position" not in found  # its direction has a zone, too
    assert len(found) == 5
    assert found["output_holes.position"].width == pytest.approx(1e-4)
    new = scaling.rewritten(plan, {pattern: t.scaled(0.5, 3) for pattern, t in found.items()}, 3)
    assert '"pin[12].position" = { zone = "⌀0.05 mm", over = "36 mm", distribution = "normal" }' in new
    half = load(tmp_path, new)
    for entry in found.values():
        for name in entry.names:
            radii = [s.tolerances[name].ppf(np.array([0.3, 0.9])) for s in (half, plan)]
            np.testing.assert_allclose(radii[0], 0.5 * radii[1])


def test_causes_name_the_components_of_a_zone(tmp_path):
    path = synthetic.store(tmp_path, ENTRIES.replace("n = 20000", "n = 500"), simulated=0)
    with Writer.open(path) as store:
        results, errors = synthetic.results(store.n), store.errors()
        results["F_max"][:, 0] = 640.0 + 1e6 * (errors["pin1.offset_t"] - 0.018 * errors["pin1.tilt_z"])
        store.write(np.arange(store.n), Simulation(results, {}))
        found = causes(View(store), "cross1.F").frame("errors").set_index("error")
    assert len(found) == 25
    # the load follows the inner end along t, and nothing else
    assert found.index[0] == "pin1.position_inner_t"
    assert found["first"].iloc[0] > 0.9
    assert found["first_upper"].iloc[1:].max() < 0.2
