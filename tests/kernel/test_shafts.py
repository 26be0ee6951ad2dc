"""What the shafts carry: closed forms of the ideal joint, the naive twin, orders of known curves and of joints."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support import naive
from tests.support.mechanisms import N_DOF, S, body
from tests.support.of_cardan import CHANNELS, COMPONENTS, LOADS, RESULT, SHAFT_LOADS, SPAN, for_kernels
from tolstat.common.load_kinds import ORDERS
from tolstat.common.tables import Options, Status
from tolstat.kernel.mechanics import dynamics, loads
from tolstat.kernel.mechanics.work import make_work
from tolstat.kernel.revolution.orders import write_orders
from tolstat.kernel.revolution.settle import make_samples
from tolstat.solver.histories import restore
from tolstat.solver.simulation import simulate_rows

RPM = np.pi / 30
TORQUE = 100.0
SLIDING = {"slides": 1.0, "m_s": 5.0, "k_a": 3e6, "c_a": 2e4, "F_a": 150.0}


def of(name: str, results: np.ndarray) -> float:
    (value,) = LOADS[name].of(results)
    return float(value)


@pytest.mark.parametrize("fidelity", range(3))
@pytest.mark.parametrize("sense", [1, -1])
def test_ideal_joint_carries_secondary_couples_and_no_force(params, fidelity: int, sense: int) -> None:
    """Seherr-Thoss, Schmelz, Aucktor (2006), ch. 4: couples up to T sin(alpha), T tan(alpha), driving torque T tau."""
    alpha = np.radians(25.0)
    found = simulate_rows(params(alpha=alpha, speed=sense * RPM), Options(fidelity=fidelity)).results
    assert found["status"] == Status.OK
    assert of("input.moment", found) == pytest.approx(TORQUE * np.sin(alpha), rel=1e-4)
    assert of("output.moment", found) == pytest.approx(TORQUE * np.tan(alpha), rel=1e-4)
    assert of("input.drive", found) == pytest.approx(TORQUE / np.cos(alpha), rel=1e-4)
    for shaft in ("input", "output"):
        assert of(f"{shaft}.axial", found) < 1e-3
        assert of(f"{shaft}.lateral", found) < 1e-3


@pytest.mark.parametrize("fidelity", range(3))
def test_channels_of_the_ideal_joint_are_its_closed_form_over_the_angle(params, fidelity: int) -> None:
    """Couple T |tan gamma| and driving torque T tau at each angle; their cycles."""
    alpha = np.radians(25.0)
    rows, options = params(alpha=alpha, speed=RPM), Options(fidelity=fidelity)
    histories = {name: own[0] for name, own in simulate_rows(rows, options, "full").histories.items()}
    sine = np.sin(alpha) * np.cos(2 * np.pi * np.arange(180) / 180)
    moment, drive = (CHANNELS[name].of(histories) for name in ("output.moment", "input.drive"))
    np.testing.assert_allclose(moment, TORQUE * np.abs(sine) / np.sqrt(1 - sine**2), atol=1e-3)
    np.testing.assert_allclose(drive, TORQUE * np.cos(alpha) / (1 - sine**2), rtol=5e-4)
    np.testing.assert_allclose(CHANNELS["output.m_z"].of(histories), TORQUE, rtol=5e-4)

    kept = simulate_rows(rows, options, "harmonics+cycles", 89).histories
    m_z = [signal.name for signal in COMPONENTS.values() if signal.history == SHAFT_LOADS].index("input.m_z")
    assert kept["shaft_cycle_count"][0, m_z] == 2
    swing = TORQUE * (1 / np.cos(alpha) - np.cos(alpha))
    assert kept["shaft_cycles"][0, m_z, :2, 0] == pytest.approx(swing, rel=2e-4)
    parts = (kept[f"shaft_coefficients_{part}"][0] for part in ("real", "imag"))
    np.testing.assert_allclose(restore(*parts, 180), histories["shafts"], atol=2e-3)
    assert kept["shaft_harmonics_error"].max() < 1e-5


@pytest.mark.parametrize("fidelity", range(3))
def test_orders_of_the_ideal_joint_are_those_of_its_closed_form(params, fidelity: int) -> None:
    """Couples of the ideal joint, slowly turned, by FFT in axes that do not turn; odd orders vanish."""
    alpha = np.radians(25.0)
    found = simulate_rows(params(alpha=alpha, speed=RPM), Options(fidelity=fidelity)).results
    theta = 2 * np.pi * np.arange(720) / 720
    beta, sine = np.arctan(np.tan(alpha) * np.sin(theta)), np.sin(alpha) * np.cos(theta)
    ratio = np.cos(alpha) / (1 - sine**2)
    output = np.arctan2(np.sin(theta), np.cos(theta) * np.cos(alpha))
    curves = {
        "input.moment": TORQUE * np.sin(beta) / np.sqrt(1 - sine**2) * 1j * np.exp(1j * theta),
        "output.moment": TORQUE * sine / np.sqrt(1 - sine**2) * np.exp(1j * output),
        "input.drive": TORQUE * ratio,
    }
    for name, curve in curves.items():
        spectrum = np.fft.fft(curve) / theta.size
        for n in ORDERS:
            expected = abs(spectrum[n]) + abs(spectrum[-n])
            assert of(f"{name}_{n}x", found) == pytest.approx(expected, abs=2e-4 * TORQUE), f"{name}_{n}x"
        assert of(f"{name}_1x", found) < 1e-4 * TORQUE


def test_a_force_that_turns_and_one_that_swings_have_the_same_amplitude(params) -> None:
    """At order 2 both ways round and to and fro, beside a constant force and other orders."""
    theta = 2 * np.pi * np.arange(90) / 90
    turning = 22 * np.exp(2j * theta) + 500 + 3 * np.exp(1j * theta)
    for curve in (turning, turning.conj(), 22 * np.exp(0.7j) * np.cos(2 * theta + 0.4) + 500 + 3 * np.exp(1j * theta)):
        samples, result = make_samples(1, 90)[0], for_kernels(np.zeros(1, RESULT))[0]
        samples.shafts[:], samples.psi[:] = 0.0, 1e-3 * np.cos(3 * theta - 1)
        samples.shafts[:, 1, 0], samples.shafts[:, 1, 1] = curve.real, curve.imag
        samples.shafts[:, 0, 5] = 100 + 7 * np.sin(4 * theta)
        write_orders(params()[0], samples, result)
        largest = {key: result.largest[span] for key, span in SPAN.items()}
        assert largest["lateral_orders"] == pytest.approx([0, 0, 0, 0, 3, 22, 0, 0], abs=1e-10)
        assert largest["drive_orders"] == pytest.approx([0, 0, 0, 7], abs=1e-10)
        assert largest["psi_orders"] == pytest.approx([0, 0, 1e-3, 0], abs=1e-14)
        assert largest["moment_orders"] == pytest.approx(np.zeros(8))


@pytest.mark.parametrize("speed", [500 * RPM, -500 * RPM])
@pytest.mark.parametrize("slides", [False, True])
def test_shafts_carry_what_the_naive_twin_says(params, random_errors, speed: float, slides: bool) -> None:
    """Forces and moments about O in axes that do not turn, from world coordinates, at a state far from rest."""
    par = params(alpha=0.3, speed=speed, **random_errors(4))[0]
    for name, value in SLIDING.items() if slides else ():
        par[name] = value
    rng = np.random.default_rng(8)
    q, v, t = 1e-4 * rng.normal(size=N_DOF), 1e-2 * rng.normal(size=N_DOF), 0.019
    q[S] = 3e-4
    work = make_work()
    dynamics.forces(t, q, v, par, work)
    loads.write_loads(v, par, work)
    loads.complete_loads(par, work)
    force, places = naive.forces(t, q, v, par).force, naive.bodies(t, q, par).position
    output = naive.turn((0, 1, 0), par.alpha[0])
    for shaft, (name, axes) in enumerate((("input", np.eye(3)), ("output", output))):
        f, about = force[body(name), :3], places[body(name)]
        m = force[body(name), 3:] + np.cross(about, f)
        f, m = axes.T @ f, axes.T @ m
        if name == "output" and slides:
            f[2] = par.k_a * q[S] + par.c_a * v[S] - par.F_a
        np.testing.assert_allclose(work.shafts[shaft], [*f, *m], rtol=1e-6, atol=1e-5 * np.abs(f).max())
        assert work.loads[par.begin[loads.LATERAL] + shaft] == pytest.approx(np.hypot(*f[:2]), rel=1e-5)
        assert work.loads[par.begin[loads.MOMENT] + shaft] == pytest.approx(np.hypot(*m[:2]), rel=1e-4)
        assert work.loads[par.begin[loads.AXIAL] + shaft] == pytest.approx(abs(f[2]), rel=1e-6)
    assert work.pos[body("input"), 2] == 0


@pytest.mark.parametrize(("speed", "fidelity"), [(500 * RPM, 0), (-500 * RPM, 0), (500 * RPM, 1)])
def test_loads_of_a_joint_follow_from_its_history(params, random_errors, speed: float, fidelity: int) -> None:
    """Largest values and orders of the recorded revolution by NumPy; with the phase of the motion, also backwards."""
    row = params(alpha=0.25, speed=speed, **random_errors(3))
    made = simulate_rows(row, Options(fidelity=fidelity, peak_substeps=1), "full")
    shafts, tau = made.histories["shafts"][0].astype(float), made.histories["tau"][0]
    phase = np.sign(speed) * 2 * np.pi * np.arange(len(shafts)) / len(shafts)
    sine = np.sin(0.25) * np.cos(phase)
    curves = {
        f"{shaft}.{load}": shafts[:, s, k] + 1j * shafts[:, s, k + 1]
        for s, shaft in enumerate(("input", "output"))
        for load, k in (("lateral", 0), ("moment", 3))
    }
    curves |= {"input.drive": shafts[:, 0, 5], "psi": 1 - np.cos(0.25) / (1 - sine**2) / tau}
    for name, curve in curves.items():
        assert of(name, made.results) == pytest.approx(np.abs(curve).max(), rel=3e-3), name
        for n in ORDERS:
            plus, minus = (np.mean(z * np.exp(-1j * n * phase)) for z in (curve, curve.conj()))
            value = of(f"{name}_{n}x", made.results)
            assert value == pytest.approx(abs(plus) + abs(minus), rel=1e-4, abs=1e-6 * np.abs(curve).max()), name
    for s, shaft in enumerate(("input", "output")):
        assert of(f"{shaft}.axial", made.results) == pytest.approx(np.abs(shafts[:, s, 2]).max(), rel=3e-3)


def test_a_joint_that_is_refined_has_all_loads(params) -> None:
    """Explicit steps: peaks are followed at every step, orders come from the samples of each revolution."""
    found = simulate_rows(params(alpha=0.3, speed=3000 * RPM, torque=5.0, pin1__offset_t=1e-4), Options()).results
    assert found["steps_per_rev"] > 180
    for name in LOADS:
        assert of(name, found) > 0, name
    for name in ("input.lateral", "output.lateral", "input.moment", "output.moment", "psi"):
        parts = [of(f"{name}_{n}x", found) for n in ORDERS]
        assert max(parts) < 1.3 * of(name, found)
