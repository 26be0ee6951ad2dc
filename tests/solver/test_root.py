"""Stress at the roots of the pins: formulas of a round bar, by the bushings' moments over a revolution."""

from __future__ import annotations

import numpy as np
import pytest

import tolstat
from tolstat import joint as joints
from tolstat.common.channels import BUSHING_LOADS
from tolstat.common.errors import InputError
from tolstat.common.loads import loads_of
from tolstat.common.tables import Options
from tolstat.joint import Operation
from tolstat.joint.operation import mechanism_of
from tolstat.solver.simulation import simulate_rows

ROOT = {"diameter": "38 mm", "bore": "6 mm", "K_bending": 1.6, "K_torsion": 1.3}
OPERATION = Operation.model_construct(alpha=np.radians(15), speed=50.0, torque=300.0)


def test_stress_is_that_of_a_round_bar_by_the_moments_of_its_bushing():
    joint = joints.load("cirelli2021", {"pin": {"root": ROOT}}, "x")
    mechanism = mechanism_of(joint, OPERATION)
    errors = joints.nominal_errors(1, mechanism)
    errors["pin1.tilt_z"], errors["hole3.offset_t"] = np.radians(0.1), 5e-5
    found = simulate_rows(joints.perturb(joint, OPERATION, errors), Options(), histories="full", mechanism=mechanism)
    moments = found.histories[BUSHING_LOADS][0, :, :4, 3:].astype(float)  # of cross1 to cross4 about e, t, z
    D, d = 0.038, 0.006
    bending = 1.6 * np.hypot(moments[:, :, 1], moments[:, :, 2]) * 32 * D / (np.pi * (D**4 - d**4))
    torsion = 1.3 * moments[:, :, 0] * 16 * D / (np.pi * (D**4 - d**4))
    stress = np.sqrt(bending**2 + 3 * torsion**2).max(axis=0)
    np.testing.assert_allclose(found.results["stress_max"][0], stress, rtol=2e-3)
    assert (found.results["stress_max"] > 1.59 * found.results["T_max"][:, :4] * 32 / (np.pi * D**3)).all()
    assert loads_of(mechanism)["cross1.stress"].unit == "Pa"


def test_a_root_without_wall_is_refused():
    with pytest.raises(InputError, match="a bore of 40 mm leaves nothing of 38 mm"):
        joints.load("cirelli2021", {"pin": {"root": ROOT | {"bore": "40 mm"}}}, "x")


STUDY = """
[joint]
base = "cirelli2021"
pin.root = { diameter = "38 mm" }
[operation]
alpha = "15 deg"
speed = "500 rpm"
torque = "100 N*m"
[solver]
fidelity = "ideal"
[tolerances]
"operation.torque" = { plus_minus = "40 N*m", distribution = "uniform" }
[sampling]
n = 40
seed = 1
[limits]
"cross*.stress" = "4 MPa"
"""


def test_it_has_limits_as_other_loads(tmp_path):
    """The ideal joint: forces at R + z/2 on a pin clamped at r_b, in proportion to the torque."""
    path = tmp_path / "root.toml"
    path.write_text(STUDY, encoding="utf-8")
    tolstat.run(tolstat.load(path), tmp_path / "root.h5", workers=1)
    with tolstat.open(tmp_path / "root.h5") as store:
        view = store.view()
        load, moment = view.load("cross3.stress"), view.load("cross3.T")
        assert load.limit == pytest.approx(4e6)
        np.testing.assert_allclose(load.valid, moment.valid * 32 / (np.pi * 0.038**3), rtol=0.02)
        assert 0.0 < load.above(load.limit).estimate < 1.0
