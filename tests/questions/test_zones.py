"""Zones in questions: other zones, scaled entries, causes by component."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support import synthetic
from tests.support.synthetic import HEAD
from tolstat import study
from tolstat.common.tables import Simulation
from tolstat.questions.causes.errors import causes
from tolstat.store import View, Writer
from tolstat.study import scaling

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


def load(folder, text=ENTRIES):
    (folder / "plan.toml").write_text(text, encoding="utf-8")
    return study.load(folder / "plan.toml")


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
