"""Newton's iteration with the tangent as a dense matrix, solved by LAPACK."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tolstat.benchmarks.cost.flops import Snapshot
from tolstat.benchmarks.cost.split import Once
from tolstat.benchmarks.timing import Times
from tolstat.common.tables import Options
from tolstat.solver import simulation


@dataclass(frozen=True)
class Dense:
    """Newton iteration with tolstat's structured solver compared with LAPACK's dense one, one joint at a time.

    Attributes
    ----------
    lapack_us, structured_us : float
        Factorisation and one solution, µs.
    lapack_solve_us : float
        The solution alone, µs.
    solver_ratio, iteration_ratio, iteration_ratio_lanes : float
        Time of LAPACK over ours: factorisation and solution; a whole iteration with a new tangent (residual, tangent,
        factorisation, solution); that iteration with ours in lanes.
    kept_ratio, kept_ratio_lanes : float
        Ratios of the mean iteration of a joint, in which both reuse tangents: one joint at a time, and ours in lanes.
    """

    lapack_us: float
    lapack_solve_us: float
    structured_us: float
    solver_ratio: float
    iteration_ratio: float
    iteration_ratio_lanes: float
    kept_ratio: float
    kept_ratio_lanes: float


def dense(work: np.record) -> NDArray[np.float64]:
    """Tangent as one matrix, (56, 56): the blocks of ``work`` after assembly and before elimination."""
    from tolstat.kernel.mechanics.topology import ARM, ARM_OF_PIN, N_DOF, PIN, PSI, S
    from tolstat.kernel.mechanics.work import ARM_PIN, ARM_SHAFT, HUB_PIN, OF_PSI, OF_S, PIN_ARM, PIN_HUB, SHAFT_ARM

    s = np.zeros((N_DOF, N_DOF))
    m, e = work.block, work.edge
    s[:6, :6] = m[0]
    for p in range(4):
        pin, arm = 6 * (PIN + p), 6 * (ARM + ARM_OF_PIN[p])
        i, j = slice(pin, pin + 6), slice(arm, arm + 6)
        s[i, i], s[j, j] = m[PIN + p], m[ARM + ARM_OF_PIN[p]]
        s[:6, i], s[i, :6] = m[HUB_PIN + p], m[PIN_HUB + p]
        s[i, j], s[j, i] = m[PIN_ARM + p], m[ARM_PIN + p]
    for a in range(4):
        rows = slice(6 * (ARM + a), 6 * (ARM + a) + 6)
        for unknown, of in ((PSI, OF_PSI), (S, OF_S)):
            s[rows, unknown], s[unknown, rows] = e[of, ARM_SHAFT + a], e[of, SHAFT_ARM + a]
    s[PSI : S + 1, PSI : S + 1] = work.corner
    return s


def systems(snaps: Sequence[Snapshot], options: Options) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Yield the dense tangent and the right-hand side of each state."""
    from tolstat.kernel.revolution.simulate import assemble, residual

    work, state, *_ = simulation.scratch(options)
    for snap in snaps:
        par = snap.params.view(np.recarray)[0]
        state.q[:], state.v[:], state.a[:] = snap.q, snap.v, snap.a
        residual(snap.t, state.q, state.v, state.a, par, options, work, state.residual)
        assemble(snap.cv, snap.ca, snap.cv, par, work)
        yield np.asfortranarray(dense(work)), -state.residual


def against(times: Times, once: dict[str, Once], count: int, per_iteration: NDArray[np.float64]) -> Dense:
    """Compute the ratios of LAPACK's times to ours.

    Parameters
    ----------
    times : Times
        ``lapack`` factorises and solves `count` times, ``lapack solve`` solves.
    once : dict of str to Once
        Time of each part in ``lanes`` and ``alone``.
    count : int
        Number of systems in a measurement of LAPACK.
    per_iteration : ndarray, shape (3,)
        Residuals, tangents and solutions per Newton iteration of a joint, mean.

    Returns
    -------
    Dense
    """
    lapack, lapack_solve = times.least("lapack") / count, times.least("lapack solve") / count
    alone, lanes = once["alone"], once["lanes"]

    def fresh(of: Once) -> float:
        return of.residual + of.elimination + of.substitution

    def kept(residual: float, tangent: float, solution: float) -> float:
        return float(per_iteration @ [residual, tangent, solution])

    ours = alone.elimination - alone.assembly + alone.substitution
    theirs_kept = kept(alone.residual, alone.assembly + lapack - lapack_solve, lapack_solve)
    return Dense(
        lapack_us=1e6 * lapack,
        lapack_solve_us=1e6 * lapack_solve,
        structured_us=1e6 * ours,
        solver_ratio=lapack / ours,
        iteration_ratio=(alone.residual + alone.assembly + lapack) / fresh(alone),
        iteration_ratio_lanes=(alone.residual + alone.assembly + lapack) / fresh(lanes),
        kept_ratio=theirs_kept / kept(alone.residual, alone.elimination, alone.substitution),
        kept_ratio_lanes=theirs_kept / kept(lanes.residual, lanes.elimination, lanes.substitution),
    )
