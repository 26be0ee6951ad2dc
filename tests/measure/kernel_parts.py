"""Parts of a joint's simulation, timed one by one: for one joint and for all lanes, beside dense linear algebra.

Each part is timed many times at states of the last revolution, and multiplied by its executions per joint. The rest is
the time of a whole joint less these parts: predictor, norms, records of grid points, results.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple
from unittest import mock

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgetrf, dgetrs

from studies.precision.measuring import in_turn
from tests.measure.operations import count_apart
from tests.support.kernel_states import UNLIMITED, Sample, Snapshot, dense, into_lanes, snapshots, tally
from tests.support.mechanisms import N_DOF
from tests.support.of_cardan import RESULT
from tests.support.stepping import make_state
from tolstat.common.tables import Options
from tolstat.kernel.lanes.lane_memory import as_lanes
from tolstat.kernel.lanes.lockstep import START_ONLY
from tolstat.kernel.mechanics import dynamics, linsolve, tangent
from tolstat.kernel.mechanics.contact import contact_load
from tolstat.kernel.mechanics.work import make_work
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import WIDTH, fma
from tolstat.solver import simulation

residual, assemble = dynamics.residual, tangent.assemble
eliminate, solve = linsolve.factorise, linsolve.solve
TIMES = 1000
"""Executions of a part in one measurement of one joint or of all lanes, some 1 to 10 ms."""
PEAK_TIMES = 2_000_000
STATES = 8
"""Number of joints at whose states the parts are timed: enough to fill the lanes."""
RESIDUAL, CONTACT, ASSEMBLY, ELIMINATION, SUBSTITUTION = range(5)
"""Parts for `repeat`: residual with contacts; contacts; tangent; tangent and its factors; a solution with them."""
CHAINS = 10
"""Independent sums in `multiply_add`: as many as keep both multiply-add units of present cores busy."""


@njit
def repeat(part, times, t, cv, ca, motion, par, options, work):
    """Execute a part `times` times at the state ``motion.q``, ``v``, ``a`` of time `t`; cv, ca as from `predict`."""
    residual(t, motion.q, motion.v, motion.a, par, options, work, motion.residual)
    assemble(cv, ca, cv, par, work)
    eliminate(par, work)
    for _ in range(times):
        if part == RESIDUAL:
            residual(t, motion.q, motion.v, motion.a, par, options, work, motion.residual)
        elif part == CONTACT:
            for pin in range(par.pin.shape[0]):
                contact_load(pin, par, work)
        elif part == ASSEMBLY:
            assemble(cv, ca, cv, par, work)
        elif part == ELIMINATION:
            assemble(cv, ca, cv, par, work)
            eliminate(par, work)
        else:
            for i in range(N_DOF):
                work.solution[i] = -motion.residual[i]
            solve(motion.q, par, work)


@njit
def repeat_in_lanes(part, times, options, batch):
    """Execute `repeat` for all lanes of `batch` at once, at their motion and control."""
    par, work, motion = as_lanes(batch.par), as_lanes(batch.work), as_lanes(batch.motion)
    control = as_lanes(batch.control)
    repeat(part, times, control.t, control.cv, control.ca, motion, par, options, work)


@njit
def multiply_add(times, batch):
    """Do `times` fused multiply-adds in each of `CHAINS` independent lane registers: measures the core's peak rate."""
    motion = as_lanes(batch.motion)
    x, y = motion.q[0], motion.q[1]
    a, b, c, d, e = motion.v[0], motion.v[1], motion.v[2], motion.v[3], motion.v[4]
    f, g, h, i, j = motion.v[5], motion.v[6], motion.v[7], motion.v[8], motion.v[9]
    for _ in range(times):
        a, b, c, d, e = fma(a, x, y), fma(b, x, y), fma(c, x, y), fma(d, x, y), fma(e, x, y)
        f, g, h, i, j = fma(f, x, y), fma(g, x, y), fma(h, x, y), fma(i, x, y), fma(j, x, y)
    motion.a[0] = a + b + c + d + e + f + g + h + i + j


def alone(params: NDArray[np.void], options: Options) -> NDArray[np.void]:
    """Simulate joints one after the other, without lanes; results, (n,) RESULT."""
    results, left = np.zeros(len(params), RESULT), np.full(len(params), UNLIMITED)
    with mock.patch.object(simulation, "width", return_value=1):
        list(simulation.simulate_together(params, options, left, False, results.view(np.recarray)))
    return results


def begin(params: NDArray[np.void], options: Options) -> NDArray[np.void]:
    """Find the start of joints, one after the other; results with the work done, (n,)."""
    return alone(params, options._replace(max_revs=START_ONLY))


class Once(NamedTuple):
    """Time of one execution of each part for a joint, s; in lanes, the time of all lanes over their number."""

    residual: float
    contact: float
    assembly: float
    elimination: float
    substitution: float

    def iteration(self, residuals: float = 1.0, tangents: float = 1.0, solutions: float = 1.0) -> float:
        """Time of a Newton iteration with these numbers of executions."""
        return residuals * self.residual + tangents * self.elimination + solutions * self.substitution


def split(whole: float, start: float, once: Once, counts: NDArray[np.float64]) -> dict[str, tuple[float, float]]:
    """Split the time of a joint into its parts.

    Parameters
    ----------
    whole, start : float
        Time of a joint, and of its initial equilibrium; in lanes of its guess only, since the lanes do the iterations.
    once : Once
        Time of one execution of each part.
    counts : ndarray, shape (3,)
        Residuals, tangents and solutions executed per joint.

    Returns
    -------
    dict
        Time per joint and time of one execution of each part: contacts are part of a residual, ``bodies`` its rest;
        ``factor`` is the elimination without the assembly, ``rest`` all else.
    """
    residuals, tangents, solutions = map(float, counts)
    found = {
        "start": (start, start),
        "contact": (residuals * once.contact, once.contact),
        "bodies": (residuals * (once.residual - once.contact), once.residual - once.contact),
        "assembly": (tangents * once.assembly, once.assembly),
        "factor": (tangents * (once.elimination - once.assembly), once.elimination - once.assembly),
        "solve": (solutions * once.substitution, once.substitution),
    }
    rest = whole - sum(spent for spent, _ in found.values())
    return found | {"rest": (rest, rest)}


def measure(these: Sample, rounds: int) -> Iterator[tuple[str, list[list[str]]]]:
    """Time whole joints and their parts in turn, and count operations; yields two tables, see `cost.Table`."""
    n = len(these.params)
    snaps = list(snapshots(these, STATES))
    times = in_turn(_tasks(these, snaps), rounds)
    lanes, one = (
        Once(*(times.least(f"{way} {part}") / (TIMES * count) for part in Once._fields))
        for way, count in (("lanes", WIDTH), ("alone", len(snaps)))
    )
    results = times.returned["lanes"].results
    steps, iterations, tangents, halvings = (
        float(results[name].mean()) for name in ("steps", "newton_iterations", "factorisations", "halvings")
    )
    rounds_done, filled, renewals = (int(x) for x in tally(these))
    of_start = _start_counts(these)
    after = iterations - of_start[0]
    counts = np.array([after + steps + halvings, tangents - of_start[1], after])
    # in lanes the initial equilibrium is solved like a step: its iterations, and the residual that ends them
    useful = counts + np.array([of_start[0] + 1, of_start[1], of_start[0]])
    executed = WIDTH / n * np.array([rounds_done, renewals, rounds_done])
    start = {way: times.least(f"{way} start") / n for way in ("lanes", "alone")}
    whole = {way: times.least(way) / n for way in ("lanes", "alone")}
    parts = split(whole["lanes"], start["lanes"], lanes, executed), split(whole["alone"], start["alone"], one, counts)
    yield "Where the time of a joint goes, µs", _parts(parts, [whole["lanes"], whole["alone"]], iterations)
    found = count_apart(snaps)
    operations = {part: float(np.mean([own[part] for own in found])) for part in found[0]}
    work = [operations["residual"], operations["assembly"] + operations["elimination"], operations["substitution"]]
    speeds = [
        float(own @ work) / sum(spent for name, (spent, _) in part.items() if name not in ("start", "rest"))
        for own, part in zip((useful, counts), parts, strict=True)
    ]
    peak = 2 * WIDTH * CHAINS * PEAK_TIMES / times.least("peak")
    count = TIMES // 10 * len(snaps)
    lapack, lapack_solve = times.least("lapack") / count, times.least("lapack solve") / count
    theirs = one._replace(elimination=one.assembly + lapack - lapack_solve, substitution=lapack_solve)
    ours = one.elimination - one.assembly + one.substitution
    kept = counts / after
    yield (
        "Rate of operations, and ratios to dense linear algebra",
        [
            ["", "in lanes", "alone"],
            ["operations a second, 1e9", *(f"{1e-9 * speed:.3g}" for speed in speeds)],
            [
                f"share of the core's peak rate, {1e-9 * peak:.4g}e9",
                *(f"{100 * speed / peak:.1f} %" for speed in speeds),
            ],
            [f"lanes filled, of {WIDTH}", f"{100 * filled / (WIDTH * rounds_done):.1f} %", ""],
            [
                f"Newton iteration with LAPACK ({1e6 * lapack:.3g} µs a system), time over ours",
                *(f"{theirs.iteration() / own.iteration():.3g}" for own in (lanes, one)),
            ],
            [
                "the same, tangents reused as in a joint",
                *(f"{theirs.iteration(*kept) / own.iteration(*kept):.3g}" for own in (lanes, one)),
            ],
            [f"LAPACK's factorisation and solution, time over ours ({1e6 * ours:.3g} µs)", "", f"{lapack / ours:.3g}"],
        ],
    )


def _parts(parts: tuple[dict[str, tuple[float, float]], ...], whole: list[float], iterations: float) -> list[list[str]]:
    """Rows of the parts of a joint, in lanes and alone."""
    rows = [["part", "in lanes", "share", "one execution", "alone", "share", "one execution"]]
    for name in parts[0]:
        row = [name]
        for own, total in zip(parts, whole, strict=True):
            spent, once = own[name]
            row += [f"{1e6 * spent:.1f}", f"{100 * spent / total:.0f} %", f"{1e6 * once:.3f}"]
        rows.append(row)
    rows.append(["all", *(cell for total in whole for cell in (f"{1e6 * total:.1f}", "100 %", ""))])
    each = (cell for total in whole for cell in (f"{1e6 * total / iterations:.2f}", "", ""))
    return [*rows, ["a Newton iteration", *each]]


def _start_counts(these: Sample) -> NDArray[np.float64]:
    """Newton iterations and tangents of a joint's initial equilibrium, mean."""
    results = begin(*these)
    return np.array([results[name].mean() for name in ("newton_iterations", "factorisations")])


def _systems(snaps: list[Snapshot], options: Options) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Yield the dense tangent and the right-hand side of each state."""
    work, out = make_work(), np.empty(N_DOF)
    for snap in snaps:
        par = snap.params.view(np.recarray)[0]
        residual(snap.t, snap.q, snap.v, snap.a, par, options, work, out)
        assemble(snap.cv, snap.ca, snap.cv, par, work)
        yield np.asfortranarray(dense(work)), -out


def _tasks(these: Sample, snaps: list[Snapshot]) -> dict[str, Callable[[], object]]:
    """Functions to be timed, by name."""
    params, options = these
    work, motion = make_work(), make_state(N_DOF)
    batch = into_lanes(snaps, options)
    rows = [snap.params.view(np.recarray)[0] for snap in snaps]
    tangents = list(_systems(snaps, options))

    def one_by_one(part: int) -> None:
        for snap, par in zip(snaps, rows, strict=True):
            motion.q[:], motion.v[:], motion.a[:] = snap.q, snap.v, snap.a
            repeat(part, TIMES, snap.t, snap.cv, snap.ca, motion, par, options, work)

    def in_lanes(part: int) -> None:
        repeat_in_lanes(part, TIMES, options, batch)

    def lapack(factor: bool, kept: list[Any]) -> None:
        for _ in range(TIMES // 10):
            for k, (matrix, right) in enumerate(tangents):
                if factor:
                    kept[k] = dgetrf(matrix)[:2]
                dgetrs(*kept[k], right)

    tasks: dict[str, Callable[[], object]] = {
        "lanes": lambda: simulation.simulate_rows(params, options),
        "alone": lambda: alone(params, options),
        "lanes start": lambda: simulation.starts(params.view(np.recarray), options),
        "alone start": lambda: begin(params, options),
        "peak": lambda: multiply_add(PEAK_TIMES, batch),
    }
    for part, name in enumerate(Once._fields):
        tasks[f"lanes {name}"], tasks[f"alone {name}"] = partial(in_lanes, part), partial(one_by_one, part)
    factors = [dgetrf(matrix)[:2] for matrix, _ in tangents]
    return tasks | {"lapack": partial(lapack, True, factors), "lapack solve": partial(lapack, False, factors)}
