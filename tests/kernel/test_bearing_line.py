"""A third mechanism in one file: a shaft in three bearings, each a pin of the shaft in an eye of the ground."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.support import naive
from tolstat.common.mechanism import ALONG_Z, DRIVEN, HELD, Bushing, Hinge, Lump, Mechanism, Member, Pair, Shaft, Z
from tolstat.common.tables import VALID, Options, blank_params
from tolstat.kernel.integrators.first_order import rate
from tolstat.kernel.mechanics.work import make_work
from tolstat.solver import simulation

pytestmark = pytest.mark.slow  # compiles the kernels for another mechanism
NUMBERS = (1, 2, 3)
LINE = Mechanism(
    "shaft in three bearings",
    members=(Member("ground", HELD, True), Member("shaft", DRIVEN, True)),
    lumps=(
        *(Lump(f"pin{i}", "shaft", f"at {i}", ALONG_Z) for i in NUMBERS),
        *(Lump(f"eye{i}", "ground", f"at {i}", ALONG_Z) for i in NUMBERS),
    ),
    shafts=(Shaft("bearings", "ground"), Shaft("shaft", "shaft", driven=True)),
    bushings=(
        *(Bushing(f"of_pin{i}", f"pin{i}", "shaft", f"at {i}", "pin") for i in NUMBERS),
        *(Bushing(f"of_eye{i}", f"eye{i}", "bearings", f"at {i}", "eye") for i in NUMBERS),
    ),
    hinges=(Hinge("bearing", "shaft", "ground", Z),),
    pairs=tuple(Pair(f"pin{i}", f"eye{i}", "bearing") for i in NUMBERS),
)


def parameters(offset: float) -> np.recarray:
    """The shaft at 60 rad/s, a pin every 0.2 m along z; the eye in the middle is off by `offset` (m) along x."""
    par = blank_params(1, LINE).view(np.recarray)
    par.omega, par.torque, par.R, par.mass, par.inertia = 60.0, 1.0, 0.05, 0.3, 1e-4
    par.at[0] = par.marker[0, :, 1] = [(0.2 * (i - 2), 0.0, 0.0) for i in NUMBERS]
    par.k[0, :, :3], par.k[0, :, 3:], par.c[0, :, :3], par.c[0, :, 3:] = 1e8, 1e5, 500.0, 1.0
    par.c_d, par.c_t, par.delta_d, par.clearance = 500.0, 5.0, 1e-6, 1e-5
    par.n_stations, par.station_s[0, 0, :2], par.station_weight[0, 0, :2] = 2, (0.01, -0.01), 0.5
    par.station_k1[0, 0, :2], par.station_k2[0, 0, :2] = 1e13, 2e8
    par.pin_axis[:] = par.hole_axis[:] = (0.0, 0.0, 1.0)
    par.hole_point[0, 1, 0] = offset
    return par


def test_the_middle_bearing_is_pressed_by_its_offset() -> None:
    """A pin on its bushing, two stations and the eye on its bushing are springs in series behind the clearance."""
    offset = 6e-5
    found = simulation.simulate_rows(parameters(offset), Options(), mechanism=LINE).results
    assert found["status"][0] in VALID  # without moments, theirs are rounding and need not settle
    compression = offset - 1e-5

    def force(depth: float) -> float:
        return 2 * (1e13 * depth**2 + 2e8 * depth)

    low, high = 0.0, compression
    for _ in range(60):
        depth = 0.5 * (low + high)
        low, high = (depth, high) if force(depth) * 2 / 1e8 + depth < compression else (low, depth)
    np.testing.assert_allclose(found["F_max"][0, [1, 4]], force(depth), rtol=1e-3)
    np.testing.assert_allclose(found["F_max"][0, [0, 2]], 0.0, atol=1e-6 * force(depth))


def test_its_motion_is_that_of_the_naive_twin() -> None:
    """From rest, both by Radau: the kernel's accelerations, and the twin's equations in world coordinates."""
    par, work, end = parameters(6e-5)[0], make_work(LINE), 1e-4
    q = np.zeros(LINE.dof)

    def of_kernel(t: float, y: np.ndarray) -> np.ndarray:
        out = np.empty_like(y)
        rate(t, y, par, Options(), work, out)
        return out

    ours = solve_ivp(of_kernel, (0, end), np.zeros(2 * LINE.dof), "Radau", rtol=1e-6, atol=1e-11).y[: LINE.dof, -1]
    world = naive.World(par, LINE)
    theirs = solve_ivp(world.rate, (0, end), world.state(0.0, q, q), "Radau", rtol=1e-6, atol=1e-11).y[:, -1]
    np.testing.assert_allclose(ours, world.deviations(end, theirs), atol=1e-5 * np.abs(ours).max())
