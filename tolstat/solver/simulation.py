"""From parameters to results, row by row: the stage between `joint.perturb` and the store."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tolstat.common import tables
from tolstat.common.cardan import CARDAN
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import SIMULATED, Fidelity, Options, Simulation, Start, Status
from tolstat.joint import ideal
from tolstat.solver import refinement, stationary
from tolstat.solver.histories import Histories, extracted, history_specs

if TYPE_CHECKING:
    from tolstat.kernel.lanes.batch import Batch, Queue

Table = np.recarray[Any, np.dtype[np.void]]

MAX_KEPT_SAMPLES = 12_000
"""Maximum number of samples in memory at a time, some 1.7 kB each: the last revolution of 66 joints at 180 steps."""

NEARLY_REVERSING = 0.8
"""Torque that reverses the load (`ideal.reversal_torque`), relative to a joint's own, above which explicit steps cost
less than error-controlled ones."""

UNIFORM_REVS = 4
"""Revolutions with uniform steps of a joint that explicit steps suit: what uniform steps resolve settles sooner."""

LOOSER = 2.0
"""Factor on ``newton_tol`` of joints with faces or friction: their loads err by more than that leaves. With a larger
one joints settle later."""


def lanes(options: Options, width: int, mechanism: Mechanism = CARDAN) -> Batch:
    """Work arrays of this thread for `width` joints at a time: kernels of several threads run at the same time."""
    return _lanes(options, width, mechanism, threading.get_ident())


@cache
def _lanes(options: Options, width: int, mechanism: Mechanism, thread: int) -> Batch:
    from tolstat.kernel.lanes.batch import make_batch  # here: importing the kernel would make light commands slow

    return make_batch(options, width, mechanism)


def blank_results(shape: int | tuple[int, ...], mechanism: Mechanism = CARDAN) -> Table:
    """Table RESULT of zeros; as statistics of single revolutions that are not needed, of shape (0, 0)."""
    return np.zeros(shape, tables.tables(mechanism).RESULT).view(np.recarray)


def width() -> int:
    """Number of lanes: those of a register; without compilation, one joint at a time."""
    from tolstat.kernel.simd.lane import WIDTH

    return WIDTH if os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0") else 1


def simulate_rows(
    params: NDArray[np.void],
    options: Options,
    histories: Histories = "none",
    n_harmonics: int = 16,
    mechanism: Mechanism = CARDAN,
) -> Simulation:
    """Simulate joints; row i of the result is joint i, and depends on no other row.

    Parameters
    ----------
    params : ndarray of PARAM, shape (n,)
        The joints.
    options : Options
        Numerical settings.
    mechanism : Mechanism
        What the joints are.
    histories : {"none", "cycles", "harmonics", "harmonics+cycles", "full", "bearings"}
        Load histories to keep, see `history_specs`.
    n_harmonics : int
        Highest harmonic kept.

    Returns
    -------
    Simulation
        Results, and histories; NaN (mode: 0) where a joint has none.

    Raises
    ------
    InputError
        When closed forms are asked for and a joint has none, see `ideal.check`.
    """
    if options.fidelity == Fidelity.IDEAL:
        ideal.check(params)
    if mechanism.faces or mechanism.friction:
        options = options._replace(newton_tol=LOOSER * options.newton_tol)
    specs = history_specs(options, histories, n_harmonics, mechanism)
    recorded = {name: spec.blank(len(params)) for name, spec in specs.items()}
    allowed = tables.iterations_allowed(options.steps_per_rev, options.max_revs)
    left = np.full(len(params), allowed)

    def simulate(rows: NDArray[np.intp], settings: Options) -> tuple[NDArray[np.void], NDArray[np.void]]:
        out, follows = blank_results(len(rows), mechanism), tables.follows_error(settings)
        blocks = blank_results((len(rows), settings.max_revs) if follows else (0, 0), mechanism)
        still_allowed, of_rows = left[rows], steps[rows] if follows else None
        run = simulate_together(params[rows], settings, still_allowed, bool(specs), out, blocks, of_rows, mechanism)
        for i, samples in run:
            if out[i].status in SIMULATED:
                on_grid = samples[:: settings.steps_per_rev // options.steps_per_rev]
                for name, values in extracted(on_grid, histories, specs, mechanism).items():
                    recorded[name][rows[i]] = values
        left[rows] = still_allowed
        return out.view(np.ndarray), blocks.view(np.ndarray)

    steps = explicit_steps(params, options, mechanism)
    results = np.zeros(len(params), tables.tables(mechanism).RESULT)
    explicit = np.flatnonzero(steps)
    if len(explicit):
        results[explicit], _ = simulate(explicit, options._replace(max_revs=min(options.max_revs, UNIFORM_REVS)))
    others = np.flatnonzero((steps == 0) | (results["status"] == Status.NEWTON_FAILED))
    if len(others):
        results[others], _ = simulate(others, options)
    refinement.refine(results, options, simulate, mechanism)
    results["newton_iterations"][(results["status"] == Status.NEWTON_FAILED) & (left <= 0)] = allowed
    stationary.fill_intervals(results, mechanism)
    results["clearance"] = params["clearance"]
    return Simulation(results, recorded)


def simulate_together(
    params: NDArray[np.void],
    options: Options,
    left: NDArray[np.int64],
    keep: bool,
    results: NDArray[np.void],
    blocks: NDArray[np.void] | None = None,
    steps: NDArray[np.int64] | None = None,
    mechanism: Mechanism = CARDAN,
) -> Iterator[tuple[int, NDArray[np.void]]]:
    """Simulate joints in lanes by numbers of contact stations and orders; yield index and samples of each if `keep`.

    `left`: Newton iterations still allowed to each joint, (n,), reduced by those taken. `steps`: number of explicit
    steps of the first revolution, (n,); joints with 0, all without it, are simulated in lock-step, as are those that
    turn out too stiff for explicit steps.
    """
    blocks = blank_results((0, 0), mechanism) if blocks is None else blocks
    if options.fidelity == Fidelity.IDEAL:
        yield from _ideal(params, options, keep, results, mechanism)
        return
    from tolstat.kernel.lanes.explicit import explicit
    from tolstat.kernel.lanes.lockstep import START_ONLY
    from tolstat.kernel.revolution.settle import make_samples

    steps = np.zeros(len(params), np.int64) if steps is None else steps.copy()
    max_size = max(1, MAX_KEPT_SAMPLES // options.steps_per_rev) if keep else len(params)
    memory = make_samples(min(max_size, len(params)) if keep else 0, options.steps_per_rev, mechanism)
    for is_explicit in (True, False):
        for here in _groups(params, (steps > 0) == is_explicit, max_size):
            allowed, shape = left[here], (len(here) if len(blocks) else 0, blocks.shape[1])
            statistics = tables.for_kernels(blank_results(shape, mechanism), mechanism)
            queue = make_queue(
                params[here], options, allowed, memory[: len(here)].view(np.recarray), statistics, mechanism
            )
            if is_explicit:
                none = tables.for_kernels(blank_results((0, 0), mechanism), mechanism)
                alone = queue._replace(left=allowed.copy(), blocks=none)
                run_lanes(alone, options._replace(max_revs=START_ONLY), mechanism)
                explicit(steps[here], options, lanes_for(queue, options, mechanism), queue)
                steps[here[queue.results.status == Status.NEWTON_FAILED]] = 0
            else:
                run_lanes(queue, options, mechanism)
            left[here] = allowed
            tables.for_kernels(results, mechanism)[here] = queue.results
            if len(blocks):
                tables.for_kernels(blocks, mechanism)[here] = statistics
            yield from zip(here.tolist(), memory, strict=False)


def make_queue(
    params: NDArray[np.void],
    options: Options,
    left: NDArray[np.int64],
    samples: Table,
    blocks: Table,
    mechanism: Mechanism = CARDAN,
) -> Queue:
    """Make a queue of joints, see `kernel.lanes.batch.Queue`; their starts are computed."""
    from tolstat.kernel.lanes.batch import Queue

    rows, out = np.ascontiguousarray(params).view(np.recarray), blank_results(len(params), mechanism)
    words = rows.view(np.float64).view(np.ndarray).reshape(len(rows), -1)
    found = starts(rows, options, mechanism)
    return Queue(rows, words, found, left, samples, blocks, tables.for_kernels(out, mechanism))


def run_lanes(queue: Queue, options: Options, mechanism: Mechanism = CARDAN) -> NDArray[np.int64]:
    """Simulate the joints of a queue in lock-step; return the counts of `kernel.lanes.lockstep.lockstep`."""
    from tolstat.kernel.lanes.lockstep import PATIENCE, lockstep

    tally = np.zeros(3, np.int64)
    lockstep(options, PATIENCE if width() > 1 else 1, lanes_for(queue, options, mechanism), queue, tally)
    return tally


def lanes_for(queue: Queue, options: Options, mechanism: Mechanism = CARDAN) -> Batch:
    """Lanes for the joints of a queue, with what all of these share."""
    batch = lanes(options, width(), mechanism)
    batch.par.n_stations[:], batch.par.n_orders = queue.rows.n_stations[0], queue.rows.n_orders[0]
    return batch


def equilibrium(params: NDArray[np.void], options: Options, mechanism: Mechanism = CARDAN) -> NDArray[np.float64]:
    """Unknowns of a joint, (1,), in static equilibrium at the input angle zero, (dof,)."""
    from tolstat.kernel.lanes.lockstep import START_ONLY
    from tolstat.kernel.revolution.settle import make_samples

    dynamic = options._replace(fidelity=int(Fidelity.DYNAMIC), start=int(Start.STATIC))
    settings = dynamic._replace(max_revs=START_ONLY)
    none = tables.for_kernels(blank_results((0, 0), mechanism), mechanism)
    samples = make_samples(0, options.steps_per_rev, mechanism)
    queue = make_queue(params, settings, np.full(1, 2**31), samples, none, mechanism)
    run_lanes(queue, settings, mechanism)
    return np.asarray(queue.starts[0])


def _ideal(
    params: NDArray[np.void], options: Options, keep: bool, results: NDArray[np.void], mechanism: Mechanism
) -> Iterator[tuple[int, NDArray[np.void]]]:
    """Evaluate the closed forms of ideal joints; arguments as of `simulate_together`."""
    from tolstat.kernel.revolution.ideal import ideal_revolution

    batch, out = lanes(options, 1, mechanism), tables.for_kernels(results, mechanism)
    rows, at_rest = params.view(np.recarray), np.zeros(mechanism.dof)
    for i in range(len(params)):
        ideal_revolution(rows[i], options, at_rest, batch.scratch, batch.samples[0], batch.notes[0], out[i])
        if keep:
            yield i, batch.samples[0]


def starts(rows: NDArray[np.void], options: Options, mechanism: Mechanism = CARDAN) -> NDArray[np.float64]:
    """Where the search for the start of each joint begins, (n, dof), see `kernel.revolution.starts`.

    The kernel is not called, and so not compiled, for joints with negative clearance alone: these end at once.
    """
    from tolstat.kernel.revolution.starts import write_starts

    out, at_rest = np.zeros((len(rows), mechanism.dof)), np.zeros(mechanism.dof)
    if (rows["clearance"] >= 0).all(axis=1).any():
        write_starts(rows, options, lanes(options, 1, mechanism).scratch, at_rest, out)
    return out


def explicit_steps(params: NDArray[np.void], options: Options, mechanism: Mechanism = CARDAN) -> NDArray[np.int64]:
    """Least stable number of explicit steps a revolution of joints that are refined with them, (n,); 0 for others.

    These are joints whose torque reverses, or nearly does, unless a revolution takes too many stable steps: where
    contacts hit, error-controlled steps are hardly longer, and each costs five times as much.
    """
    steps = np.zeros(len(params), np.int64)
    these = hitting(params, options, mechanism)
    if not len(these):
        return steps
    from tolstat.kernel.lanes.explicit import count_steps
    from tolstat.kernel.revolution.explicit import MOST_STEPS

    fewest = np.zeros(len(these), np.int64)
    count_steps(params[these].view(np.recarray), options, lanes(options, 1, mechanism).scratch, fewest)
    steps[these] = np.where(fewest <= MOST_STEPS, fewest, 0)
    return steps


def hitting(params: NDArray[np.void], options: Options, mechanism: Mechanism = CARDAN) -> NDArray[np.intp]:
    """Indices of the Cardan joints whose torque reverses, or nearly does, if they are to be refined."""
    if not refinement.may_refine(options) or mechanism != CARDAN:
        return np.zeros(0, np.intp)
    return np.flatnonzero(ideal.reversal_torque(params) > NEARLY_REVERSING * np.abs(params["torque"]))


def _groups(params: NDArray[np.void], among: NDArray[np.bool_], max_size: int) -> Iterator[NDArray[np.intp]]:
    """Yield the indices of joints with equal numbers of contact stations and orders, at most `max_size` at a time."""
    shared = np.column_stack([params["n_stations"], params["n_orders"]])
    for counts in np.unique(shared[among], axis=0):
        rows = np.flatnonzero(among & (shared == counts).all(axis=1))
        for first in range(0, len(rows), max_size):
            yield rows[first : first + max_size]
