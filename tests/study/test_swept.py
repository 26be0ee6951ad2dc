"""Sweeps of dimensions of the joint, and clearance beside diameters."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.conftest import joint_with_law
from tests.support import synthetic
from tolstat import sampling, study
from tolstat.common.errors import InputError
from tolstat.common.tables import Simulation
from tolstat.joint.derived import DERIVED
from tolstat.joint.perturbation import perturb
from tolstat.questions.sweep import swept_axes
from tolstat.store import ResultFile, Writer, recorded
from tolstat.study import design
from tolstat.study.design import KEYS

TEXT = """
[joint]
base = "cirelli2021"
pin = { d = "20 mm", l = "18 mm" }
cross.R = "40 mm"
contact = { clearance = "0.03 mm", z = "16 mm" }
[operation]
alpha = "30 deg"
speed = "1200 rpm"
torque = "250 N*m"
[errors]
pin1.tilt_z = "0.1 deg"
[sampling]
method = "sweep"
[sweep]
"pin.d" = { from = "16 mm", to = "24 mm", points = 3 }
"pin*.clearance" = { from = "-0.02 mm", to = "0.02 mm", points = 5 }
cross.R = { from = "40 mm", to = "50 mm", points = 2 }
"""


def load(folder: Path, *changes: tuple[str, str]) -> study.Study:
    text = TEXT
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    (folder / "sweep.toml").write_text(text, encoding="utf-8")
    return study.load(folder / "sweep.toml")


def faults(folder: Path, *changes: tuple[str, str]) -> list[str]:
    with pytest.raises(InputError) as caught:
        load(folder, *changes)
    return [f"{fault.place.rpartition('sweep.toml')[2]}: {fault.found}" for fault in caught.value.faults]


def test_a_row_has_the_dimensions_and_errors_of_its_point(tmp_path: Path) -> None:
    s = load(tmp_path)
    assert (s.rows, len(s.joints), len(s.variants), s.case_names) == (31, 7, 7, ())
    own = [s.joints[number] for number in s.design["variant"]]
    assert own[0] == s.joint
    np.testing.assert_allclose([j.pin.d for j in own[1:]], np.repeat([0.016, 0.020, 0.024], 10))
    np.testing.assert_allclose([j.cross.R for j in own[1:]], np.tile([0.04, 0.05], 15))
    for j in own:
        assert (j.contact.D_P, j.contact.clearance) == (j.pin.d, 3e-5)
        assert all(getattr(j.pin, key) == DERIVED[f"pin.{key}"].value(j) for key in ("A", "J", "mass"))
        assert j.cross.r_b == pytest.approx(j.cross.R - 0.018)
    errors = sampling.draw(s)
    for pin in ("pin1.clearance", "pin4.clearance"):
        expected = np.tile(np.repeat(np.linspace(-2e-5, 2e-5, 5), 2), 3)
        np.testing.assert_allclose(errors[pin], np.concatenate([[0.0], expected]), atol=1e-20)
    np.testing.assert_allclose(errors["pin1.tilt_z"][1:], np.radians(0.1))


def test_keys_that_are_errors_too_are_swept_as_values_of_the_joint(tmp_path: Path) -> None:
    axes = '[sweep]\n"friction.mu" = { from = 0.002, to = 0.1, points = 3 }\n'
    axes += '"thrust.end_play" = { from = "0 mm", to = "0.1 mm", points = 2 }\n'
    s = load(tmp_path, ('base = "cirelli2021"', 'base = "pin25"'), (TEXT[TEXT.index("[sweep]") :], axes))
    drawn = sampling.draw(s)
    made = [perturb(joint, s.operation, drawn[i : i + 1]) for i, joint in enumerate(s.joints)]
    assert [row["mu"][0, 0] for row in made] == pytest.approx([0.004, 0.002, 0.002, 0.051, 0.051, 0.1, 0.1])
    assert [joint.thrust.end_play for joint in s.joints if joint.thrust] == pytest.approx([2e-5, *(0.0, 1e-4) * 3])
    assert not drawn["thrust.end_play"].any()


def test_without_the_nominal_joint(tmp_path: Path) -> None:
    s = load(tmp_path, ('method = "sweep"', 'method = "sweep"\nnominal_first = false'))
    assert s.design["variant"].tolist() == load(tmp_path).design["variant"][1:].tolist()


def test_joints_of_a_sweep_have_each_operating_point(tmp_path: Path) -> None:
    point = '[operation]\nalpha = "30 deg"\nspeed = "1200 rpm"\ntorque = "250 N*m"\n'
    low = point.replace("[operation]", '[[operation]]\nname = "low"')
    high = low.replace("low", "high").replace("30 deg", "10 deg").replace("250 N*m", "400 N*m")
    s = load(tmp_path, (point, low + high))
    errors, rows = sampling.draw(s), np.arange(s.rows)
    with Writer.create(tmp_path / "a.h5", s, [errors]) as store:
        store.finish()
    with ResultFile.open(tmp_path / "a.h5") as store:
        for name, torque, alpha in (("low", 250.0, 30.0), ("high", 400.0, 10.0)):
            params = recorded.perturbed(s.at(name), rows, errors)
            np.testing.assert_array_equal(params["torque"], torque)
            np.testing.assert_array_equal(params["alpha"], np.radians(alpha))
            assert recorded.parameters(store.at(name), rows).tobytes() == params.tobytes()


@pytest.mark.slow
def test_a_file_replays_its_sweep(tmp_path: Path) -> None:
    s = load(tmp_path)
    errors, rows = sampling.draw(s), np.arange(s.rows)
    with Writer.create(tmp_path / "a.h5", s, [errors]) as store:
        store.write(rows, Simulation(synthetic.results(s.rows), {}))
    with ResultFile.open(tmp_path / "a.h5") as store:
        again = recorded.parameters(store, rows)
        assert again.tobytes() == recorded.perturbed(s, rows, errors).tobytes()
        assert recorded.recall(store).identity() == s.identity()
        frame = store.to_pandas(nominal=True)
        axes = swept_axes(store.view())
    np.testing.assert_array_equal(frame["variant"], s.design["variant"])
    np.testing.assert_allclose(frame["pin.d"], [s.joints[v].pin.d for v in s.design["variant"]])
    assert [(axis.label, axis.unit) for axis in axes] == [("pin.d", "mm"), ("pin*.clearance", "mm"), ("cross.R", "mm")]
    np.testing.assert_allclose(axes[0].values, np.repeat([16.0, 20.0, 24.0], 10))


@pytest.mark.parametrize("change", [('to = "24 mm"', 'to = "25 mm"'), ('l = "18 mm"', 'l = "17 mm"'), ("0.03", "0.04")])
def test_identity_tells_sweeps_apart(tmp_path: Path, change: tuple[str, str]) -> None:
    assert load(tmp_path).identity() != load(tmp_path, change).identity()


def test_axes_of_deviations_are_told(tmp_path: Path) -> None:
    s = load(tmp_path)
    assert design.meaning(s.sweep, s.joint) == [
        "sweep of pin1.clearance and 3 others: deviations from -0.02 to 0.02 mm,",
        "  the clearance is 0.01 to 0.05 mm; to sweep it itself: contact.clearance",
    ]
    s = load(tmp_path, ('"pin*.clearance"', '"hole2.diameter"'))
    assert design.meaning(s.sweep, s.joint)[1] == "  the diameter is 20.04 to 20.08 mm; to sweep it itself: contact.D_H"


RIGID = ("shaft.axial", "shaft.lateral")


def test_every_quantity_of_a_joint_can_be_swept() -> None:
    assert {"pin.d", "pin.chi", "bushing.cross.k_x", "contact.clearance", "material.nu", "arm.width"} <= KEYS.keys()
    assert "bearing.needle_length" in KEYS
    assert "bearing.C" not in KEYS
    of = joint_with_law("needles").model_dump()
    parts = ("pin.root", "thrust", "shaft.unbalance", "shaft.input", "shaft.output", "shaft.spline")
    absent = tuple(f"{name}." for name in parts)
    for key in KEYS:
        inner = of
        if key.startswith(absent):
            continue
        for part in key.split("."):
            inner = inner[part]
        assert inner is None or isinstance(inner, float) or (key in RIGID and inner == "rigid"), key


FAULTS = {
    "unknown": (('"pin.d"', '"pin.dd"'), ":16: sweep.pin.dd: selects nothing"),
    "unit": (('from = "16 mm"', 'from = "16 kg"'), ":16: sweep.pin.d.from: '16 kg' cannot be a value in m"),
    "invalid": (('to = "50 mm"', 'to = "17 mm"'), ":18: sweep.cross: R is not larger than pin.l"),
    "twice": (("cross.R = { from", '"pi[n].d" = { from'), ":18: sweep.pi[n].d: pin.d is set by sweep.pin.d already"),
    "many": (("points = 2", "points = 5000"), ":15: sweep: gives 15000 joints with dimensions of their own"),
}


@pytest.mark.parametrize(("change", "found"), FAULTS.values(), ids=FAULTS)
def test_sweep_faults(tmp_path: Path, change: tuple[str, str], found: str) -> None:
    assert faults(tmp_path, change) == [found]


TILT = 'pin1.tilt_z = "0.1 deg"'
BOTH = {
    "errors": (
        (TILT, 'hole4.diameter = "0.01 mm"'),
        "sweep.pin*.clearance: pin1.clearance is given beside hole4.diameter",
    ),
    "sweep": (("cross.R = { from", "pin2.diameter = { from"), "pin2.diameter is given beside pin2.clearance"),
    "one pattern": (('"pin*.clearance"', '"pin*.[cd]*"'), "pin1.clearance is given beside pin1.diameter"),
}


@pytest.mark.parametrize(("change", "found"), BOTH.values(), ids=BOTH)
def test_of_a_pair_either_clearance_or_diameters_are_given(tmp_path: Path, change: tuple[str, str], found: str) -> None:
    told = faults(tmp_path, change)
    assert any(found in text for text in told), told
    load(tmp_path, (TILT, 'hole4.offset_t = "0.01 mm"'))
