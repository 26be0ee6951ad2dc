"""``python -m tests.measure.stability``: does any joint's motion grow from a disturbance that the steps damp?

Two looks at joints of a study, each at torques and contact laws of one's own. Frozen eigenvalues: the equations of
motion, 110 or 112 of first order, linearised at angles of the settled revolution. Exponents: a neighbour of the joint
is carried along at fine steps and brought back to its distance after each revolution (Benettin et al. 1980), which
shows parametric growth, too.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tests.conftest import joint_with_law
from tests.support import trajectory
from tests.support.mechanisms import N_DOF, N_LUMPS, S
from tests.support.of_cardan import RESULT
from tests.support.stepping import CV_FACTORISED, H_OLD, advance, make_state, reset
from tolstat import joint, sampling, study
from tolstat.common.tables import SIMULATED, Options, Status, iterations_allowed
from tolstat.joint.contact import LAWS
from tolstat.kernel.integrators import first_order
from tolstat.kernel.mechanics.work import make_work, work_dtype
from tolstat.kernel.revolution.settle import grid_step
from tolstat.kernel.simd.jit import njit, njit_inner
from tolstat.solver import simulation

Table = np.ndarray[tuple[int], np.dtype[np.void]]

ANGLES = 36
"""Angles of a revolution at which eigenvalues are taken."""
ALIGNING = 4
"""Revolutions in which the neighbour turns to the direction that grows."""
APART = 1e-8
"""Distance of the neighbour, m: above the residual error of Newton's iteration, below the micrometres of a contact."""


@njit
def radius_of(i, R):
    """Radius (m) that makes unknown `i` a displacement: 1 if it is one."""
    return 1.0 if (i < 6 * N_LUMPS and i % 6 < 3) or i == S else R


class Growth(NamedTuple):
    """What the eigenvalues of one joint show.

    Attributes
    ----------
    rate : float
        Largest real part at any angle, 1/s.
    frequency : float
        Its frequency, Hz.
    exponent : float
        Logarithm of the largest growth along the revolution if at each angle the fastest eigenvector grew.
    """

    rate: float
    frequency: float
    exponent: float


def rows_of(path: Path, n: int, law: str, torque: float | None) -> Table:
    """The first `n` joints of a study, all with one contact law, at a torque (N m) or their own."""
    plan = study.load(path, n=n)
    params = joint.perturb(joint_with_law(law), plan.operation, sampling.draw(plan)[1:])
    if torque is not None:
        params["torque"] = torque
    return params


def growths(params: Table, options: Options) -> list[Growth | None]:
    """Eigenvalues along the last revolution of each joint; None of those without results."""
    found: list[Growth | None] = []
    works, column = np.zeros(1, work_dtype()), np.empty((3, 2 * N_DOF))
    matrices = np.empty((ANGLES, 2 * N_DOF, 2 * N_DOF))
    results = np.zeros(len(params), RESULT).view(np.recarray)
    left = np.full(len(params), iterations_allowed(options.steps_per_rev, options.max_revs))
    for i, samples in simulation.simulate_together(params, options, left, True, results):
        if results[i].status not in SIMULATED:
            found.append(None)
            continue
        period, n = 2 * math.pi / abs(float(params["omega"][i])), len(samples)
        for matrix, s in zip(matrices, np.arange(ANGLES) * n // ANGLES, strict=True):
            state = np.concatenate([samples["q"][s], samples["v"][s]])
            row = params[i : i + 1].view(np.recarray)
            first_order.jacobian_of_row(period * (1 + s / n), state, row, options, works, column, matrix)
        moving = np.delete(np.arange(2 * N_DOF), [] if params["slides"][i] else [S, N_DOF + S])
        found.append(_growth(np.linalg.eigvals(matrices[:, moving][:, :, moving]), period))
    return found


def _growth(values: np.ndarray, period: float) -> Growth:
    k, i = np.unravel_index(np.argmax(values.real), values.shape)
    fastest = values.real.max(axis=1)
    largest = grown = 0.0
    for rate in np.tile(fastest, 2).tolist():
        grown = max(0.0, grown + rate * period / len(fastest))
        largest = max(largest, grown)
    return Growth(float(fastest.max()), float(abs(values[k, i].imag) / (2 * math.pi)), largest)


@njit_inner
def _revolution(first, par, options, work, state):
    """Integrate from grid point `first` on over a revolution; False where a step fails."""
    h = grid_step(par, options)
    state.memory[CV_FACTORISED] = 0.0  # the tangent at hand may be another state's
    good = True
    for k in range(first, first + options.steps_per_rev):
        good = good and advance(k * h, h, par, options, work, state)
    return good


@njit
def set_apart(state, shadow, par):
    """Choose the first difference of the two states: `APART`, in all unknowns; a shaft that is held has none."""
    share = APART / math.sqrt(state.q0.size)
    for i in range(state.q0.size):
        radius = radius_of(i, par.R)
        shadow.q0[i] = state.q0[i] + (share if i % 2 == 0 else -share) / radius
        shadow.v0[i], shadow.a0[i], shadow.weight[i] = state.v0[i], state.a0[i], state.weight[i]
    if par.slides == 0:
        shadow.q0[S] = state.q0[S]
    reset(shadow)


@njit
def draw_near(state, shadow, factor):
    """Scale the difference of the two states; the neighbour's past follows from the joint's and from it."""
    h = state.memory[H_OLD]
    for i in range(state.q0.size):
        dq, dv = factor * (shadow.q0[i] - state.q0[i]), factor * (shadow.v0[i] - state.v0[i])
        da = factor * (shadow.a0[i] - state.a0[i])
        shadow.q0[i], shadow.v0[i], shadow.a0[i] = state.q0[i] + dq, state.v0[i] + dv, state.a0[i] + da
        shadow.q1[i] = state.q1[i] + dq - h * (dv - 0.5 * h * da)
        shadow.v1[i] = state.v1[i] + dv - h * da
    shadow.memory[H_OLD] = h


@njit
def distance(state, shadow, h, R):
    """Distance of two states, m: positions, and what their speeds add in a step; rotations at the radius R."""
    square = 0.0
    for i in range(state.q0.size):
        radius = radius_of(i, R)
        dq, dv = shadow.q0[i] - state.q0[i], h * (shadow.v0[i] - state.v0[i])
        square += radius * radius * (dq * dq + dv * dv)
    return math.sqrt(square)


def exponent(params: Table, options: Options, settling: int, revolutions: int) -> float:
    """Largest Lyapunov exponent of one joint, per revolution, after `settling` of them; NaN where a step fails."""
    work, state, shadow = make_work(), trajectory.begin(params, options), make_state(N_DOF)
    par, n = params.view(np.recarray)[0], options.steps_per_rev
    for r in range(settling):
        if not _revolution(r * n, par, options, work, state):
            return math.nan
    set_apart(state, shadow, par)
    growth, factor = 0.0, 1.0
    for r in range(revolutions):
        draw_near(state, shadow, factor)
        if not all(_revolution((settling + r) * n, par, options, work, one) for one in (state, shadow)):
            return math.nan
        apart = max(distance(state, shadow, grid_step(par, options), par.R), APART * 1e-6)
        factor = APART / apart
        if r >= ALIGNING:
            growth -= math.log(factor)
    return growth / (revolutions - ALIGNING)


def main() -> None:
    """Print a line for each torque and law: eigenvalues of all joints, exponents of some that are ok and all others."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("study", type=Path)
    parser.add_argument("--joints", type=int, default=128)
    parser.add_argument("--torque", type=float, nargs="*", default=[None], metavar="N_M")
    parser.add_argument("--law", nargs="*", default=["mode"], choices=list(LAWS))
    parser.add_argument("--exponents", type=int, default=0, metavar="K", help="of K joints that are ok, all others too")
    parser.add_argument("--steps", type=int, default=2880, help="steps a revolution of the exponents")
    given = parser.parse_args()
    for law in given.law:
        for torque in given.torque:
            params = rows_of(given.study, given.joints, law, torque)
            results = simulation.simulate_rows(params, Options()).results
            ok = results["status"] == Status.OK
            found = growths(params[ok], Options(max_refinements=0, peak_substeps=1))
            rate, frequency, largest = np.array([one for one in found if one is not None]).T
            worst = int(np.argmax(rate))
            print(
                f"{law:8} {torque or 'own'} N m: {ok.sum()} of {len(ok)} ok; real parts above 0 in {(rate > 0).sum()}, "
                f"largest {rate[worst]:.3g} /s at {frequency[worst]:.4g} Hz (row {1 + np.flatnonzero(ok)[worst]}); "
                f"exponent of a revolution at most {largest.max():.3g}",
                flush=True,
            )
            fine = Options(steps_per_rev=given.steps)
            if given.exponents:
                others = np.isin(results["status"], SIMULATED) & ~ok
                for name, rows in (("ok", np.flatnonzero(ok)[: given.exponents]), ("others", np.flatnonzero(others))):
                    values = np.array([exponent(params[i : i + 1], fine, 6, 16) for i in rows])
                    print(f"  {name}: {len(rows)} exponents, {(values > 0).sum()} above 0, ", end="")
                    print(f"largest {np.nanmax(values, initial=-np.inf):.3g} a revolution", flush=True)


if __name__ == "__main__":
    main()
