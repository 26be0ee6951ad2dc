"""Tolerances with the sign of their width."""

import pytest

from tests.support import synthetic
from tolstat import study
from tolstat.study import scaling

ENTRIES = {
    '"pin1.offset_t" = { plus_minus = "0.1 mm", distribution = "normal" }': "±0.1 mm",
    '"pin1.position" = { zone = "⌀0.2 mm", over = "22 mm", distribution = "normal" }': "⌀0.2 mm",
    '"pin1.perpendicularity" = { zone = "0.05 mm", over = "22 mm", about = "t", distribution = "normal" }': (
        "0.05 mm wide"
    ),
}


@pytest.mark.parametrize(("entry", "shown"), ENTRIES.items())
def test_a_width_is_half_a_band_a_diameter_or_the_distance_of_two_planes(tmp_path, entry, shown):
    head, _, rest = synthetic.STUDY.partition("[tolerances]\n")
    source = tmp_path / "one.toml"
    source.write_text(f"{head}[tolerances]\n{entry}\n[sampling]{rest.partition('[sampling]')[2]}", encoding="utf-8")
    (tolerance,) = scaling.tolerances(study.load(source))
    assert scaling.marked(tolerance.mark, f"{1e3 * tolerance.width:.4g} mm") == shown
