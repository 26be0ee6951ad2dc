"""Thrust faces and friction: reference joints, closed forms of loss and preload, power balance, axial forces."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tests.conftest import REFERENCE
from tests.support.held import FACES, FREE, FRICTION, RPM, held
from tests.support.mechanisms import bushing_kind
from tolstat import study
from tolstat.common.tables import Method, Options, Start, Status
from tolstat.solver.simulation import simulate_rows

pytestmark = pytest.mark.slow
"""Kernels of three mechanisms are compiled."""
OPTIONS = Options()
FINE = Options(method=int(Method.TR_BDF2), steps_per_rev=5760, settle_tol=1e-6, max_revs=5, max_refinements=0)
SPEED, TORQUE = 500 * RPM, 100.0
CASES = {
    "th_ideal": {"shaft": FREE, "thrust": FACES},
    "th_shift": {"shaft": FREE, "thrust": FACES},
    "thmu_ideal": {"shaft": FREE, "thrust": FACES, "friction": FRICTION},
    "thmu_random": {"shaft": FREE, "thrust": FACES, "friction": FRICTION},
    "mu_rigid_random": {"friction": FRICTION},
}
WITH_FRICTION = [name for name in CASES if "mu" in name]


def case(name: str):
    """Parameters and mechanism of a reference joint."""
    if name == "th_shift":
        return held({"pin1.offset_e": 1e-4, "pin2.offset_e": -1e-4}, **CASES[name])
    errors = study.load_case(REFERENCE / "random_00.toml").errors if "random" in name else {}
    return held(errors, **CASES[name])


def reference(name: str) -> dict[str, np.ndarray]:
    """Loads, thrust and mean powers of a reference joint."""
    with np.load(REFERENCE / "thrust.npz") as file:
        return {key.partition("__")[2]: file[key] for key in file.files if key.startswith(f"{name}__")}


@cache
def fine(name: str):
    """Result and histories in steps that are small beside the reversal of sliding.

    The shifted joint starts as the reference does, from the ideal pose: its output shaft creeps along its axis, 1 um in
    a revolution, and after 40 from equilibrium is still 20 um away.
    """
    rows, mechanism = case(name)
    start = Start.RAMP if name == "th_shift" else Start.STATIC
    found = simulate_rows(rows, FINE._replace(start=int(start)), "full", 0, mechanism)
    return found.results[0], {history: values[0] for history, values in found.histories.items()}


@pytest.mark.parametrize("name", CASES)
def test_every_sample_is_that_of_the_reference(name: str) -> None:
    result, histories = fine(name)
    expected = reference(name)
    assert result["status"] == (Status.NOT_SETTLED if name == "th_shift" else Status.OK)
    loads = histories["loads"][::16]
    for components in (slice(0, 3), slice(3, 6)):
        own = expected["loads"][..., components]
        largest = np.linalg.norm(own, axis=-1).max()
        np.testing.assert_allclose(loads[..., components], own, rtol=0, atol=1e-3 * largest)
    if "thrust" in expected:
        np.testing.assert_allclose(result["thrust_max"], expected["thrust"].max(axis=0), rtol=1e-3, atol=1e-3)
    if name in WITH_FRICTION:
        assert result["loss_max"][-1] == pytest.approx(expected["powers"][0], rel=1e-6)


@pytest.mark.parametrize("name", CASES)
def test_largest_loads_and_loss_at_the_steps_of_a_study(name: str) -> None:
    rows, mechanism = case(name)
    result, exact = simulate_rows(rows, OPTIONS, "none", 0, mechanism).results[0], fine(name)[0]
    assert result["status"] == (Status.STATIONARY if name == "th_shift" else Status.OK)
    for kind in ("F", "T"):
        largest = exact[f"{kind}_max"].max()
        np.testing.assert_allclose(result[f"{kind}_max"], exact[f"{kind}_max"], rtol=0, atol=2e-3 * largest)
    if mechanism.faces:
        np.testing.assert_allclose(result["thrust_max"], exact["thrust_max"], rtol=2e-3, atol=1e-3)
    if mechanism.friction:
        np.testing.assert_allclose(result["loss_max"], exact["loss_max"], rtol=2e-4)


@pytest.mark.parametrize("name", WITH_FRICTION)
def test_what_the_drive_gives_beyond_output_and_loss_is_the_damping(name: str) -> None:
    """Mean powers over a revolution; damping of bushings, contacts, faces and shaft is the reference's."""
    rows, mechanism = case(name)
    options = OPTIONS._replace(steps_per_rev=720, max_refinements=0)
    found = simulate_rows(rows, options, "full", 0, mechanism)
    drive = -SPEED * found.histories["shafts"][0, :, 0, 5].mean(dtype=float)
    output = TORQUE * SPEED * found.histories["tau"][0].mean(dtype=float)
    loss, (_, damping) = found.results["loss_max"][0, -1], reference(name)["powers"]
    rest = drive - output - loss
    assert 0 < rest < 1e-4 * loss + 1e-6 * drive
    assert rest == pytest.approx(damping, abs=1e-3)
    assert loss == found.results["loss_max"][0, :-1].sum()


def test_loss_is_that_of_pins_that_turn_to_and_fro() -> None:
    """Each revolution a pin slides by 4 alpha r under its force, where sliding reverses within little of the angle."""
    alpha, friction = np.radians(4.0), FRICTION | {"slip_speed": "1e-4 m/s"}
    rows, mechanism = held(alpha=alpha, speed=50 * RPM, friction=friction)
    result = simulate_rows(rows, OPTIONS, "none", 0, mechanism).results[0]
    of_pins = 0.1 * 0.019 * result["contact_max"][:, -1] * 4 * alpha * 50 / 60
    np.testing.assert_allclose(result["loss_max"][:-1], of_pins, rtol=0.02)


def test_preload_is_shared_by_faces_and_bushings() -> None:
    """Negative end play of straight, slow shafts: face, cross and fork bushing of each pin in series; arms bend."""
    rows, mechanism = held(alpha=0.0, speed=RPM, shaft=FREE, thrust=FACES | {"end_play": "-0.02 mm"})
    result = simulate_rows(rows, OPTIONS, "none", 0, mechanism).results[0]
    cross, fork = (rows["k"][0, bushing_kind(kind)] for kind in ("cross", "input fork"))
    l_f = rows["marker"][0, bushing_kind("input fork"), 0, 2]
    compliance = 1 / 1e8 + 1 / cross[0] + 1 / fork[0] + l_f**2 / fork[4]
    np.testing.assert_allclose(result["thrust_max"], 1e-5 / compliance, rtol=1e-2)  # arms that bend tilt holes, too


def test_faces_hold_an_axial_force_across_the_input_shaft() -> None:
    """F sin(alpha): without faces only where the input pins lie across it, with faces, once reached, throughout."""
    force, least = 2000.0, {}
    across = force * np.sin(np.radians(15.0))
    for name, sections in {"free": {}, "held": {"thrust": FACES}}.items():
        rows, mechanism = held(axial_force=force, shaft=FREE, **sections)
        f = simulate_rows(rows, OPTIONS, "full", 0, mechanism).histories["shafts"][0, :, 0, :2]
        lateral = np.hypot(*f.T) / across
        assert lateral.max() == pytest.approx(1.0, abs=0.02)
        least[name] = lateral.min()
    assert least["free"] < 0.1
    assert least["held"] > 0.75


def test_a_shaft_that_only_the_joint_carries_hands_an_axial_force_on() -> None:
    """Faces with preload hold it across: nothing else does, and the input shaft has F sin(alpha) throughout."""
    force, shaft = 2000.0, FREE | {"lateral": "free", "mass": "5 kg"}
    rows, mechanism = held(axial_force=force, shaft=shaft, thrust=FACES | {"end_play": "-0.02 mm"})
    found = simulate_rows(rows, OPTIONS, "full", 0, mechanism)
    assert found.results["status"] == Status.OK
    on_input, on_output = np.linalg.norm(found.histories["shafts"][0, :, :, :2], axis=-1).T
    np.testing.assert_allclose(on_input, force * np.sin(np.radians(15.0)), rtol=0.02)
    assert (on_output == 0).all()
