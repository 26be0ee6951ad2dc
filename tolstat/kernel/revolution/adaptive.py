"""Simulation of one joint with error-controlled steps (`mesh`); `resolve` decides after each revolution."""

from tolstat.kernel.integrators import integrate
from tolstat.kernel.integrators.mesh import (
    cells_of,
    forget_mesh,
    load_error,
    next_level,
    note_cell,
    refine_mesh,
    set_scale,
)
from tolstat.kernel.integrators.state import CV_FACTORISED, HALVINGS, STAGED_STEP, TOLERANCE
from tolstat.kernel.revolution.closeup import count_in
from tolstat.kernel.revolution.resolve import (
    NEWTON_FAILED,
    NOT_SETTLED,
    after_revolution,
    begin_turns,
    clear_extremes,
    closure_target,
    merge_extremes,
)
from tolstat.kernel.revolution.settle import grid_step, predict_increment, record
from tolstat.kernel.simd.jit import njit, njit_inner

predict, accept, stages = integrate.predict, integrate.accept, integrate.stages
REFUSED = 1e300
"""Error of a cell in which Newton's iteration failed."""


TIGHTER = 8
"""Factor from one tolerance to the next tighter one: it halves the steps."""


@njit
def begin_mesh(par, options, memory, weight, past):
    """Initialise `past`, and `memory` and `weight` of State, for a joint at its start."""
    begin_turns(par, options, past)
    forget_mesh(past.mesh)
    memory[TOLERANCE] = options.rtol
    set_scale(closure_target(options, past.turns), past.turns, options, par, memory, weight)


@njit
def adapt_mesh(halved, par, options, memory, weight, past):
    """Prepare the next revolution; `halved`: number of times that steps had been halved before this one.

    `memory` and `weight`, those of State, are written.
    """
    if past.turns.halved > halved:
        memory[TOLERANCE] /= TIGHTER
        refine_mesh(past.mesh)
    memory[STAGED_STEP] = 0.0  # the stage may belong to the other motion
    set_scale(closure_target(options, past.turns), past.turns, options, par, memory, weight)


def build_resolve(newton, begin):
    """Bind Newton's iteration for the joint, and its start, to the integration over cells.

    Parameters
    ----------
    newton : jitted function
        As `integrate.build_newton` returns it.
    begin : jitted function (par, options, work, state) -> None
        Initialises the joint at theta = 0.

    Returns
    -------
    resolve : jitted function (par, options, work, state, ring, past, out) -> status
        Simulates a joint and fills the ring with its last revolution; writes `out` if the joint has results, and
        ``out.failed_step`` if a step failed.
    """

    @njit_inner
    def parts(origin, length, level, par, options, work, state, fine, extremes):
        """Integrate a cell in 2^level parts; return the error of the worst part, above 1 if a part was rejected.

        Parameters
        ----------
        origin, length : float
            Time at the start of the cell, and its duration, s.
        level : int
            Number of halvings of the cell.
        fine : ndarray of SAMPLE, shape (3,)
            Scratch: the last parts.
        extremes : record of KERNEL_RESULT
            Written: largest and smallest loads of the cell.
        """
        whole = 1 << options.max_halvings
        h, share = length / (1 << level), whole >> level
        worst, done, j = 0.0, 0, 0
        clear_extremes(extremes)
        while done < whole:
            for stage in range(stages(options)):
                cv, ca, reach = predict(h, stage, state, options)
                if not newton(origin + length * (done / whole) + reach * h, cv, ca, par, options, work, state):
                    return REFUSED
            error = load_error(h, par, state)
            worst = max(worst, error)
            if not error <= 1:
                return max(2.0, worst)
            record(j, 0, par, work, state.v, fine)
            count_in(j, fine, extremes)
            accept(h, state, options)
            done += share
            j += 1
        return worst

    @njit_inner
    def cell(c, length, par, options, work, state, ring, past):
        """Integrate cell `c` (from 1), in smaller parts until accepted; return False if the smallest parts failed.

        `length` is the duration of a cell, s.
        """
        mesh, begun, turns = past.mesh, past.begun, past.turns
        own, before = mesh[c % mesh.size], mesh[(c - 1) % mesh.size]
        for i in range(state.q0.size):
            begun[0, i], begun[1, i], begun[2, i] = state.q0[i], state.v0[i], state.a0[i]
        first = level = next_level(turns.revolution - turns.since, own, before)
        while True:
            origin = (c - 1) * length
            worst = parts(origin, length, level, par, options, work, state, ring.fine, past.extremes[0])
            if worst <= 1:
                break
            level += 1
            state.counters[HALVINGS] += 1
            state.memory[CV_FACTORISED] = state.memory[STAGED_STEP] = 0.0
            if level > options.max_halvings:
                return False
            for i in range(state.q0.size):
                state.q0[i], state.v0[i], state.a0[i] = begun[0, i], begun[1, i], begun[2, i]
        note_cell(level, level > first, worst, turns.revolution, own)
        merge_extremes(past.extremes[0], past.extremes[1])
        return True

    @njit_inner
    def resolve(par, options, work, state, ring, past, out):
        begin(par, options, work, state)
        begin_mesh(par, options, state.memory, state.weight, past)
        cells = cells_of(options.steps_per_rev)
        length = grid_step(par, options) / cells
        c = 0
        status = NOT_SETTLED
        goes_on = True
        while goes_on:
            c += 1
            k = (c + cells - 1) // cells
            if not cell(c, length, par, options, work, state, ring, past):
                out.failed_step = k
                return NEWTON_FAILED
            if c % cells == 0:
                record(k, 0, par, work, state.v0, ring.samples)
                predict_increment(k, state.q0, state.v0, state.ahead, ring.samples)
            if c % past.mesh.size == 0:
                halved = past.turns.halved
                status, goes_on = after_revolution(par, options, ring.samples, past, out)
                adapt_mesh(halved, par, options, state.memory, state.weight, past)
        return status

    return resolve
