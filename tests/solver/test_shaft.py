"""Drive shafts of two joints: reference shafts, statics of a shaft that turns slowly (docs/model.md, "Drive shaft")."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import REFERENCE, with_orders
from tests.support.held import RPM, TUBE, drive_shaft, held
from tests.support.statics import on_shafts
from tolstat import joint, sampling, study
from tolstat.common.loads import loads_of
from tolstat.common.tables import SIMULATED, VALID, Options, Status
from tolstat.joint import perturb
from tolstat.solver.reference import reference_rows
from tolstat.solver.simulation import simulate_rows

pytestmark = pytest.mark.slow  # compiles the kernels for another mechanism
SECTIONS = {
    "thrust": {"end_play": "0.05 mm", "k": "1e8 N/m"},
    "friction": {"mu": 0.05, "radius": "19 mm"},
    "shaft": {"Js": "0.01 kg*m^2"},
}
EIGHT, SIX = np.radians([8.0, 6.0])
SHAFTS = {
    "shaft_Z": drive_shaft(EIGHT, "Z"),
    "shaft_W": drive_shaft(EIGHT, "W"),
    "shaft_Z_force": drive_shaft(SIX, "Z", spline={"at": "0.6 m", "mu": 0.08, "diameter": "40 mm"}),
}
"""The reference's spline pushes the last of them apart with 400 N: 2 mu T/d."""


@cache
def simulated(name: str):
    """Result, histories and mechanism of a reference shaft in 720 steps."""
    errors = {"shaft.spline": 1.0} if name == "shaft_Z_force" else {}
    rows, mechanism = held(errors, alpha=EIGHT, speed=500 * RPM, drive_shaft=SHAFTS[name], **SECTIONS)
    options = Options(steps_per_rev=720, max_refinements=0)
    found = simulate_rows(rows, options, "full", mechanism=mechanism)
    assert found.results["status"][0] in SIMULATED
    return found.results[0], {key: values[0] for key, values in found.histories.items()}, mechanism


def order(n: int, values: np.ndarray) -> np.ndarray:
    """Complex amplitude of an order of loads over a revolution, (revolution, ...)."""
    turned = np.exp(-2j * np.pi * n * np.arange(len(values)) / len(values))
    return np.tensordot(turned, values, 1) / len(values)


@pytest.mark.parametrize("name", SHAFTS)
def test_means_and_second_orders_of_loads_are_those_of_the_reference(name: str) -> None:
    """Within 1e-3 of the largest of a kind; crosses that strike their faces ring, and no two revolutions are alike."""
    with np.load(REFERENCE / "shafts.npz") as file:
        parts, largest = file["parts"].tolist(), file[f"{name}__largest"]
        orders = {n: file[f"{name}__order{n}"] for n in (0, 2)}
    _, histories, mechanism = simulated(name)
    rows = [parts.index(bushing.name) for bushing in mechanism.bushings]
    for n, expected in orders.items():
        off = np.abs(order(n, histories["loads"]) - expected[rows])
        assert off[:, :3].max() < 1e-3 * largest[0], n
        assert off[:, 3:].max() < 1e-3 * largest[1], n


@pytest.mark.parametrize("name", SHAFTS)
def test_loss_and_loads_of_the_outer_shafts_are_those_of_the_reference(name: str) -> None:
    result, _, _ = simulated(name)
    with np.load(REFERENCE / "shafts.npz") as file:
        loss, moment, lateral = (file[f"{name}__{key}"] for key in ("loss", "moment", "lateral"))
    assert result["loss_max"][-1] == pytest.approx(loss, rel=1e-3)
    assert result["moment_orders_max"][0, 1] == pytest.approx(moment[2], rel=1e-3)
    if name == "shaft_W":  # large enough to be told from the ringing
        assert result["lateral_orders_max"][:, 1] == pytest.approx(lateral[:, 2], rel=1e-2)


PRELOADED = SECTIONS | {"thrust": {"end_play": "-0.002 mm", "k": "1e8 N/m"}, "friction": {}}
WIDER = PRELOADED | {
    "thrust": {"end_play": "-0.004 mm", "k": "6e7 N/m"},
    "cross": {"R": "95 mm"},
    "contact": {"law": "point", "z": "30 mm", "clearance": "0.05 mm"},
}
"""Sections of two joints whose crosses a light preload holds; the second is wider and touches at two stations."""


def of_file(sections) -> joint.Joint:
    return joint.load("cirelli2021", sections, "case.toml")


@pytest.mark.parametrize(
    ("alphas", "arrangement", "plane", "offset", "own"),
    [
        ((8, 8), "W", 0.0, 0.0, {}),
        ((8, 6), "Z", np.pi, 0.0, {}),
        ((12, 5), "50 deg", np.radians(50), 0.2, {}),
        ((12, 5), "50 deg", np.radians(50), 0.2, {"joint2": of_file(WIDER)}),
    ],
)
def test_slow_shafts_without_errors_obey_statics(alphas, arrangement, plane: float, offset: float, own) -> None:
    """Forces and moments across the outer shafts, forces of pins at 20 rpm, within 1 %; a light preload holds crosses.

    Each pin takes M / 2 R' across it, with the couple M of its joint and R' the distance of the outer ends of holes.
    """
    first, second = np.radians(alphas)
    shaft = drive_shaft(second, arrangement, offset=f"{offset} rad", **own)
    rows, mechanism = held(alpha=first, speed=20 * RPM, drive_shaft=shaft, **PRELOADED)
    found = simulate_rows(rows, Options(max_refinements=0), "full", mechanism=mechanism)
    assert found.results["status"][0] in SIMULATED
    loads = found.histories["shafts"][0]
    expected = on_shafts(np.arange(180) * np.radians(2), (first, second), plane, offset, 1.2, 100.0)
    names = [bushing.name for bushing in mechanism.bushings]
    for k, couple in enumerate(expected.couples.T):
        kind = mechanism.lump_kinds.index(f"joint{k + 1}.pin")
        radius = rows.at[0, kind, 0] + rows.station_s[0, k].max()
        of_pins = [names.index(f"joint{k + 1}.cross{pin}") for pin in (1, 2, 3, 4)]
        pins = np.linalg.norm(found.histories["loads"][0][:, of_pins, 1:3], axis=2)
        np.testing.assert_allclose(pins.mean(axis=1), couple / (2 * radius), rtol=0.005)
    for k, (force, moment) in enumerate((expected[:2], expected[2:4])):
        largest = np.linalg.norm(moment, axis=1).max()
        off = np.linalg.norm(loads[:, k, :2], axis=1) - np.linalg.norm(force, axis=1)
        assert np.abs(off).max() < 0.01 * largest / 1.2  # forces are moments over the shaft's length
        off = np.linalg.norm(loads[:, k, 3:5], axis=1) - np.linalg.norm(moment, axis=1)
        assert np.abs(off).max() < 0.01 * largest


def test_a_shaft_turned_round_loads_its_joints_the_same() -> None:
    """Slow shafts without friction at equal angles: joint 1 of one is joint 2 of the other, seen from the other end."""
    found = []
    for one, two in ((PRELOADED, WIDER), (WIDER, PRELOADED)):
        shaft = drive_shaft(EIGHT, "W", joint2=of_file(two))
        rows, mechanism = held(alpha=EIGHT, speed=20 * RPM, drive_shaft=shaft, **one)
        result = simulate_rows(rows, Options(max_refinements=0), mechanism=mechanism).results
        assert result["status"][0] in SIMULATED
        found.append({name: load.of(result)[0] for name, load in loads_of(mechanism).items()})
    forward, back = found
    turned = {"1": "3", "2": "4", "3": "1", "4": "2"}  # pins in the input fork are in the output fork from there
    for pin, other in turned.items():
        for place, opposite in ((f"cross{pin}.F", f"cross{other}.F"), (f"pin{pin}.contact", f"pin{other}.contact")):
            for a, b in (("joint1", "joint2"), ("joint2", "joint1")):
                assert forward[f"{a}.{place}"] == pytest.approx(back[f"{b}.{opposite}"], rel=2e-3), place
    for name in ("moment", "lateral"):
        assert forward[f"input.{name}"] == pytest.approx(back[f"output.{name}"], rel=5e-3)
        assert forward[f"output.{name}"] == pytest.approx(back[f"input.{name}"], rel=5e-3)
    assert forward["joint1.cross1.F"] > 1.1 * forward["joint2.cross1.F"], "the test wants unlike joints"


def test_two_unlike_joints_have_the_loads_of_another_integrator() -> None:
    """Radau's method on a shaft with errors, one of whose joints turns in needles and rubs; its faces are pressed."""
    own = {"thrust": PRELOADED["thrust"], "friction": {"mu": 0.02, "radius": "12 mm"}, "shaft": {"axial": "rigid"}}
    shaft = drive_shaft(SIX, "Z", joint2=joint.load("pin25", own, "case.toml"))
    errors = {"joint1.pin1.offset_t": 3e-5, "joint2.hole3.offset_t": -2e-5, "joint2.pin2.tilt_z": 5e-4}
    rows, mechanism = held(errors, alpha=EIGHT, speed=500 * RPM, drive_shaft=shaft, **PRELOADED)
    ours = simulate_rows(rows, Options(steps_per_rev=720), mechanism=mechanism).results
    assert ours["status"][0] in SIMULATED
    theirs = reference_rows(rows, Options(steps_per_rev=180), closure_tol=1e-4, mechanism=mechanism)
    assert theirs["status"][0] == Status.OK
    for field in ("F_max", "T_max", "contact_max", "thrust_max"):
        largest = np.abs(theirs[field]).max()
        np.testing.assert_allclose(ours[field], theirs[field], atol=2e-4 * largest, err_msg=field)


@pytest.mark.parametrize("speed", [500.0, 1000.0])
def test_unbalance_of_a_tube_loads_both_outer_shafts_once_a_revolution(speed: float) -> None:
    """U w^2 at a quarter of the length from joint 1: three quarters on the input shaft, one on the output shaft.

    The tube on its elastic joints adds 0.1 % of U w^2 at 500 rpm, 1.3 % at 1000 rpm, 7.9 % at 2000 rpm.
    """
    sections = SECTIONS | {"thrust": {"end_play": "-0.002 mm", "k": "1e8 N/m"}, "friction": {}}
    tubes = {"tube": TUBE | {"unbalance": {"amount": "2e-3 kg*m", "angle": "30 deg"}}, "tube2": TUBE}
    drive = drive_shaft(np.radians(3.0), **tubes)
    rows, mechanism = held(alpha=np.radians(3.0), speed=speed * RPM, drive_shaft=drive, **sections)
    result = simulate_rows(rows, Options(), mechanism=mechanism).results[0]
    assert result["status"] in SIMULATED
    expected = 2e-3 * (speed * RPM) ** 2 * np.array([0.75, 0.25])
    np.testing.assert_allclose(result["lateral_orders_max"][:, 0], expected, rtol=0.03)


@pytest.mark.parametrize(("plane", "sign"), [(0.0, 1), (np.pi, -1)])
def test_statics_have_closed_forms_at_two_positions(plane: float, sign: int) -> None:
    """Those of docs/drive.md, which are the largest loads of a revolution, too."""
    first, second = np.radians((12.0, 5.0))
    found = on_shafts(np.arange(360) * np.radians(1), (first, second), plane, 0.0, 1.2, 100.0)
    force = 100.0 * np.sin(first + sign * second) / (1.2 * np.cos(first))
    moments = 100.0 * np.sin(first) / np.cos(second), 100.0 * np.tan(second)
    expected = ((force, 0.0), (0.0, moments[0]), (force, 0.0), (0.0, moments[1]))
    for loads, (at_start, later) in zip(found[:4], expected, strict=True):
        size = np.linalg.norm(loads, axis=1)
        np.testing.assert_allclose(size[[0, 90]], [at_start, later], rtol=1e-12, atol=1e-12)
        assert size.max() == pytest.approx(max(at_start, later), rel=1e-12)


def test_an_order_of_the_speed_turns_the_inertia_of_the_whole_shaft() -> None:
    """Order 3 of the driving torque, of equal joints: moment of inertia of all parts times 9 a omega^2, within 2 %."""
    sections = SECTIONS | {"thrust": {"end_play": "-0.002 mm", "k": "1e8 N/m"}, "friction": {}}
    rows, mechanism = held(alpha=EIGHT, speed=500 * RPM, drive_shaft=drive_shaft(EIGHT, "W"), **sections)
    with_orders(rows, speed=[(3, 0.004, 0.3)])
    found = simulate_rows(rows, Options(max_refinements=0), "full", mechanism=mechanism)
    assert found.results["status"][0] in SIMULATED
    kinds = [mechanism.lump_kinds.index(lump.kind) for lump in mechanism.lumps]
    of_lumps = rows.mass[0, kinds] * rows.at[0, kinds, 0] ** 2 + rows.inertia[0, kinds, 2]
    drive = 2 * abs(order(3, found.histories["shafts"][0][:, 0, 5]))
    assert drive == pytest.approx((rows.Js[0, -1] + of_lumps.sum()) * 9 * 0.004 * (500 * RPM) ** 2, rel=0.02)


HARD = """
[joint]
base = "pin25"
thrust.end_play = "0.05 mm"
shaft.axial = "rigid"
[operation]
alpha = "10.5 deg"
speed = "2050 rpm"
torque = "600 N*m"
[shaft]
alpha = "10.5 deg"
arrangement = "Z"
length = "1.2 m"
tube = { diameter = "76 mm", wall = "2.5 mm" }
spline = { at = "0.4 m", mu = 0.1, diameter = "40 mm" }
[tolerances]
"operation.alpha" = { plus_minus = "9.5 deg", distribution = "uniform" }
"operation.speed" = { plus_minus = "1950 rpm", distribution = "uniform" }
"joint*.thrust.end_play" = { plus_minus = "0.05 mm", distribution = "uniform" }
"joint*.*.offset_[etz]" = { plus_minus = "0.03 mm", distribution = "normal", cpk = 1.0 }
"joint*.*.tilt_[tz]" = { plus_minus = "0.05 deg", distribution = "normal", cpk = 1.0 }
"shaft.alpha" = { plus_minus = "9.5 deg", distribution = "uniform" }
"shaft.offset" = { plus_minus = "20 deg", distribution = "uniform" }
[sampling]
n = 48
method = "random"
seed = 8
"""


def test_hard_shafts_settle_or_are_stationary() -> None:
    """End play to 0.1 mm, 100 to 4000 rpm, 1 to 20 degrees, needles that roll around pins and slide along them."""
    hard = study.load(Path("hard.toml"), text=HARD)
    rows = perturb(hard.joint, hard.operations[0], sampling.draw(hard, range(1, 49)))
    status = simulate_rows(rows, hard.solver.options(), "none", mechanism=hard.mechanism).results["status"]
    assert np.isin(status, VALID).all()
