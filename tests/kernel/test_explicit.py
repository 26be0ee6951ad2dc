"""Explicit steps: order, stability limit and its bound, loads that are followed at every step."""

from __future__ import annotations

import numpy as np
import pytest

from tests.conftest import sliding, with_law
from tests.support.mechanisms import N_DOF, N_LUMPS, PSI, S, body, bushing_kind, lump_kind, triads
from tests.support.stepping import make_state
from tolstat.common.cardan import CARDAN
from tolstat.common.tables import Options
from tolstat.kernel.integrators.stability import depth_at, eigenvalue, fewest_steps, largest_force
from tolstat.kernel.integrators.verlet import correct, predict
from tolstat.kernel.mechanics.work import make_work
from tolstat.kernel.revolution.peaks import follow_value, forget, peaks_dtype


def oscillator(steps: int, stiffness: float, damping: float, end: float = 1.0) -> float:
    """Displacement at `end` of an oscillator of mass 1 that starts from 1, at rest."""
    state, h = make_state(N_DOF), end / steps
    state.q[:], state.v[:], state.a[:] = 1.0, 0.0, -stiffness
    for _ in range(steps):
        predict(h, state)
        state.a[:] = -stiffness * state.q - damping * state.v
        correct(h, state)
    return float(state.q[0])


def test_order_is_two() -> None:
    stiffness, damping = 50.0, 3.0
    omega = np.sqrt(stiffness - damping**2 / 4)
    true = np.exp(-damping / 2) * (np.cos(omega) + damping / (2 * omega) * np.sin(omega))
    errors = [abs(oscillator(n, stiffness, damping) - true) for n in (40, 80, 160, 320, 640, 1280)]
    assert np.abs(np.log2(np.divide(errors[:-1], errors[1:])) - 2).max() < 0.2


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 0.99])
def test_steps_are_stable_up_to_the_limit(share: float) -> None:
    """h^2/4 k + h c just below and just above 1, of which `share` is damping."""
    for limit, bounded in ((0.97, True), (1.03, False)):
        stiffness, damping = 4 * (1 - share) * limit, share * limit
        assert (abs(oscillator(2000, stiffness, damping, 2000.0)) < 10) == bounded


def of_needles(par: np.record, pin: int, j: int, depth: float) -> float:
    """Force (N) of the needles at a station."""
    return float(par.station_k3[0, j] * depth**1.625 / np.sqrt(depth + par.needle_b[0] * par.clearance[pin] + 1e-30))


def force_of(par: np.record, pin: int, j: int, depth: float) -> float:
    """Force (N) of a station."""
    return float(par.station_k1[0, j] * depth**2 + par.station_k2[0, j] * depth) + of_needles(par, pin, j, depth)


def slope_of(par: np.record, pin: int, j: int, depth: float) -> float:
    """Slope of the force of a station, N/m; of needles by differences."""
    h = 1e-4 * depth + 1e-12
    rise = of_needles(par, pin, j, depth + h) - of_needles(par, pin, j, max(depth - h, 0.0))
    return float(2 * par.station_k1[0, j] * depth + par.station_k2[0, j]) + rise / (h + min(h, depth))


def dense(h: float, depth: float, par: np.record) -> np.ndarray:
    """M^-1/2 (h^2/4 K + h C) M^-1/2, (56, 56), spring by spring."""
    found, mass = np.zeros((N_DOF, N_DOF)), np.zeros(N_DOF)

    def add(one: int, other: int, on_one: np.ndarray, on_other: np.ndarray, k: float, c: float) -> None:
        row = np.zeros(N_DOF)
        row[6 * one : 6 * one + 6] = on_one
        if other < N_LUMPS:
            row[6 * other : 6 * other + 6] -= on_other
        elif other == body("output"):
            row[PSI], row[S] = -on_other[5], -par.slides * on_other[2]
        found[:] += (h * h / 4 * k + h * c) * np.outer(row, row)

    for bushing in CARDAN.bushings:
        lump, base, kind = body(bushing.lump), body(bushing.base), bushing_kind(bushing.kind)
        on_lump, on_base = par.marker[kind] @ triads()[lump]
        k, c = par.k[kind], par.c[kind]
        for i, axis in enumerate(triads()[lump]):
            forces = np.r_[axis, np.cross(on_lump, axis)], np.r_[axis, np.cross(on_base, axis)]
            torques = np.r_[0 * axis, axis], np.r_[0 * axis, axis]
            add(lump, base, *forces, k[i], c[i])
            add(lump, base, *torques, k[3 + i], c[3 + i])
    for pin, pair in enumerate(CARDAN.pairs):
        e, *across = triads()[body(pair.pin)]
        for j in range(par.n_stations[0]):
            slope, c = slope_of(par, pin, j, depth), par.c_d[0] * par.station_weight[0, j]
            for axis in across:
                along = np.r_[axis, np.cross(par.station_s[0, j] * e, axis)]
                add(body(pair.pin), body(pair.hole), along, along, slope, c)
    for i, lump in enumerate(CARDAN.lumps):
        kind = lump_kind(lump.kind)
        mass[6 * i : 6 * i + 3] = par.mass[kind]
        mass[6 * i + 3 : 6 * i + 6] = np.abs(triads()[i].T @ par.inertia[kind])
    mass[PSI], mass[S] = par.Js[0], par.m_s if par.slides else 1.0
    found[S, S] += h * h / 4 * par.k_a + h * par.c_a
    return found / np.sqrt(np.outer(mass, mass))


@pytest.mark.parametrize("mass", [None, 5.0, 0.05])
@pytest.mark.parametrize("law", ["mode", "needles"])
def test_the_largest_eigenvalue_is_that_of_the_matrices(params, random_errors, law, mass) -> None:
    """With rigid shafts, and with an output shaft that slides: its mass matters where it is light."""
    par = with_law(params(**random_errors(4)), law)[0]
    if mass:
        sliding(par).m_s = mass
    work = make_work()
    for h in (2e-6, 5e-6, 1e-4):
        for depth in (0.0 if law == "mode" else 1e-9, 2e-5, 2e-4):
            true = np.linalg.eigvalsh(dense(h, depth, par))[-1]
            exact = 1e-12 if law == "mode" else 1e-6  # slopes of needles by differences
            assert 0.98 * true < eigenvalue(h, depth, par, work) <= true * (1 + exact)


@pytest.mark.parametrize("law", ["mode", "needles"])
def test_steps_are_stable_and_not_many_more_than_needed(params, random_errors, law) -> None:
    par = with_law(params(**random_errors(4)), law)[0]
    work, options = make_work(), Options()
    steps = fewest_steps(par, options, work)
    assert steps % options.steps_per_rev == 0
    period, force = 2 * np.pi / par.omega, largest_force(steps, par, work)
    depth = depth_at(force, par)
    assert force_of(par, int(np.argmax(par.clearance)), 0, depth) == pytest.approx(
        force, rel=1e-12 if law == "mode" else 1e-11
    )
    assert np.linalg.eigvalsh(dense(period / steps, depth, par))[-1] < 1
    assert np.linalg.eigvalsh(dense(period / (0.9 * steps), depth, par))[-1] > 0.95
    assert largest_force(2 * steps, par, work) > force


def test_peaks_between_steps_are_met(params) -> None:
    peaks, par = np.zeros(1, peaks_dtype(CARDAN)).view(np.recarray)[0], params()[0]
    forget(True, peaks)
    curve = 3 + np.sin(0.3 * np.arange(25) + 0.2)
    for value in curve:
        follow_value(2, value, par, peaks)
    assert curve.max() < 4 - 1e-3
    assert peaks.top[2] == pytest.approx(4, abs=2e-4)
    assert (peaks.last[2], peaks.before[2]) == (curve[-1], curve[-2])
    forget(True, peaks)
    for value in (5.0, 4.0, 3.0):
        follow_value(2, value, par, peaks)
    assert peaks.top[2] == 5.0
