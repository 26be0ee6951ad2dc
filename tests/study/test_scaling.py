"""Tolerances with the sign of their width; tolerances changed by settings, and the study written with them."""

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


def _loaded(folder, text, name="one"):
    source = folder / f"{name}.toml"
    source.write_text(text, encoding="utf-8")
    return study.load(source)


def test_a_mean_off_centre_moves_with_its_band(tmp_path):
    mean = '"pin*.offset_t" = { plus_minus = "0.1 mm", mean = "0.045 mm", distribution = "normal", cpk = 0.8 }\n#'
    plan = _loaded(tmp_path, synthetic.STUDY.replace('"pin*.offset_t" =', mean))
    (tolerance,) = scaling.tolerances(plan)
    for factor in (0.25, 0.8, 2.0):
        text = scaling.rewritten(plan, {tolerance.pattern: tolerance.scaled(factor)}, 1)
        found = _loaded(tmp_path, text, "scaled").tolerances["pin1.offset_t"]
        assert (found.mean, found.sigma) == pytest.approx((factor * 4.5e-5, factor * 5.5e-5 / 2.4))


def test_entries_are_scaled_about_the_middle_and_texts_keep_their_comments(tmp_path):
    text = synthetic.STUDY.replace(
        '"pin*.offset_t" =',
        '"pin*.tilt_t" = { iso2768 = "f", nominal = "20 mm", distribution = "normal" }\n'
        "# above nominal\n"
        '"hole*.diameter" = { lower = "0 mm", upper = "30 um", peak = "10 um", distribution = "triangular" }\n'
        'hole1.offset_radial = { sigma = "0.03 mm", distribution = "rayleigh" }\n'
        '"pin*.offset_t" =',
    ).replace("seed = 2021\n", "")
    plan = _loaded(tmp_path, text)
    tilt, hole, radial, offset = scaling.tolerances(plan)
    assert tilt.scaled(0.5, 3)["plus_minus"] == "0.25 deg"
    # a limit at zero stays there, as that of H7
    assert hole.scaled(0.5) == hole.entry | {"upper": "15.0 um", "peak": "5.0 um"}
    hole = hole._replace(entry=hole.entry | {"lower": "-10 um"})
    assert hole.scaled(0.5) == hole.entry | {"lower": "0.0 um", "upper": "20.0 um"}
    hole = hole._replace(entry=hole.entry | {"lower": "0 mm"})
    assert radial.width == pytest.approx(9e-5)
    new = scaling.rewritten(plan, {t.pattern: t.scaled(0.5) for t in (hole, radial)}, 7)
    assert "# above nominal" in new
    again = _loaded(tmp_path, new, "again")
    assert again.sampling.seed == 7
    changed = {name for name, d in again.tolerances.items() if d.describe() != plan.tolerances[name].describe()}
    assert changed == {*hole.names, *radial.names}
    table = text.replace('"pin*.offset_t" = {', '[tolerances."pin*.offset_t"]\n')
    table = table.replace('", distribution = "normal", cpk = 1.0 }', '"\ndistribution = "normal"')
    new = scaling.rewritten(_loaded(tmp_path, table, "table"), {offset.pattern: offset.scaled(0.5)}, 1)
    assert _loaded(tmp_path, new, "new").tolerances["pin1.offset_t"].sigma == pytest.approx(0.5e-4 / 3)
