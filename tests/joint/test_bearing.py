"""``[bearing]`` of a joint: what it gives, and every fault of it."""

from __future__ import annotations

import numpy as np
import pytest

from tolstat import joint
from tolstat.common.errors import InputError

BEARING = {"C": "22 kN", "needles": 32, "needle_diameter": "4 mm", "pitch_diameter": "42 mm"}


def bearing(**changes):
    return joint.load("cirelli2021", {"bearing": BEARING | changes}, "x.toml").bearing


def test_a_joint_has_no_bearing_unless_it_is_given():
    assert joint.load("cirelli2021", {}, "x.toml").bearing is None


def test_values_are_si():
    found = bearing(required_life="2 h")
    assert (found.C, found.needle_diameter, found.pitch_diameter, found.required_life) == (22e3, 4e-3, 42e-3, 7200.0)
    assert np.degrees(found.critical_amplitude) == pytest.approx(360 / (32 * (1 - 4 / 42)))


@pytest.mark.parametrize(
    ("given", "factor", "symbol"),
    [
        ({}, 1.0, "L10"),
        ({"reliability": "95 %"}, 0.64, "L5"),
        ({"reliability": 0.999, "a_iso": 0.5}, 0.0465, "L0.1m"),
        ({"a_iso": 2.0}, 2.0, "L10m"),
    ],
)
def test_factor_on_the_basic_rating_life(given, factor, symbol):
    found = bearing(**given)
    assert found.factor == pytest.approx(factor)
    assert found.symbol == symbol


def test_all_faults_are_reported_together_as_written():
    with pytest.raises(InputError) as error:
        bearing(C="-1 kN", needles=33, reliability=0.93, required_life="5000", a_iso=0)
    places = {fault.place: fault for fault in error.value.faults}
    keys = ("C", "pitch_diameter", "reliability", "required_life", "a_iso")
    assert set(places) == {f"x.toml: joint.bearing.{key}" for key in keys}
    room = places["x.toml: joint.bearing.pitch_diameter"]
    assert room.found == "no circle of 42 mm has room for 33 needles of 4 mm"
    assert room.remedy.startswith("give needles <= 32")
    assert "95 %" in places["x.toml: joint.bearing.reliability"].remedy
