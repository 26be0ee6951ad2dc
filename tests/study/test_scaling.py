"""Tolerances with the sign of their width; tolerances changed by settings, and the study written with them."""

import numpy as np
import pytest

from tests.support import synthetic
from tolstat import sampling, study
from tolstat.common.errors import InputError
from tolstat.study import scaling
from tolstat.study.scaling import changed, rewritten_with
from tolstat.study.tolerances.distributions import Normal

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


FIT = 'fit = { basic = "76 mm", code = "H7/f7", distribution = "normal", cpk = 1.0 }'


def load(folder, text=synthetic.STUDY, name="plan"):
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return study.load(path)


def test_settings_replace_keys_of_the_errors_they_select(tmp_path):
    plan = load(tmp_path)
    found = changed(plan, ["pin*.offset_t.plus_minus=0.05 mm", "pin2.offset_t.cpk = 1.5"])
    assert found["pin1.offset_t"] == Normal(0.0, pytest.approx(5e-5 / 3))
    assert found["pin2.offset_t"] == Normal(0.0, pytest.approx(5e-5 / 4.5))
    general = changed(plan, ["pin1.offset_t.iso2768=m", "pin1.offset_t.nominal=10 mm"] * 2)
    assert general["pin1.offset_t"] == Normal(0.0, pytest.approx(2e-4 / 3))
    assert plan.tolerances["pin1.offset_t"] == Normal(0.0, pytest.approx(1e-4 / 3))


def test_every_fault_of_the_settings_is_told_once(tmp_path):
    bad = ["pin1.tilt_t.cpk=2", "nonsense", "pin[123].offset_t.plus_minus=0.1", "pin4.offset_t.colour=red"]
    with pytest.raises(InputError) as found:
        changed(load(tmp_path), bad)
    text = str(found.value)
    assert "selects no error that has a tolerance" in text
    assert "is not a setting" in text
    assert text.count("0.1 has no unit") == 1
    assert "colour" in text


@pytest.mark.parametrize(
    "setting", ["pin1.offset_t.plus_minus=0.09 mm", "pin*.offset_t.plus_minus=0.09 mm", "pin[12].offset_t.cpk=2"]
)
def test_the_study_written_has_the_changed_tolerances_and_the_same_seed(tmp_path, setting):
    old = load(tmp_path)
    new = load(tmp_path, rewritten_with(old, [setting]), "new")
    assert new.tolerances == changed(old, [setting])
    assert (new.sampling, new.limits) == (old.sampling, old.limits)
    fresh, drawn = sampling.draw(new), sampling.draw(old)
    ratio = new.tolerances["pin1.offset_t"].sigma / old.tolerances["pin1.offset_t"].sigma
    np.testing.assert_allclose(fresh["pin1.offset_t"], ratio * drawn["pin1.offset_t"])


def test_the_study_written_parts_a_fit(tmp_path):
    text = synthetic.STUDY.replace("[tolerances]", "[tolerances]\n" + f"{FIT}")
    old = load(tmp_path, text)
    new = load(tmp_path, rewritten_with(old, ["hole1.diameter.plus_minus=5 um"]), "new")
    assert new.tolerances == changed(old, ["hole1.diameter.plus_minus=5 um"])
    assert new.joint.contact == old.joint.contact
