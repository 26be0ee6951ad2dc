"""Error-controlled steps, on a mesh over the revolution that is kept from one revolution to the next.

A revolution has about `CELLS` cells, a whole number of them per step of the output grid. TR-BDF2 takes a cell in
2^level equal parts. Where the estimated error of a part is above the tolerance, the cell is repeated with twice as many
parts. The next revolution starts with the levels of this one, or with lower ones where the error was far below the
tolerance; a cell that was refused after the first two revolutions never gets a lower level again. The mesh of a
periodic motion thus becomes constant, and has fine parts at once where impacts recur at the same angles.

The error of a part is expressed as a load: that of a displacement times the stiffness k of the lump's bushing, that of
a velocity times sqrt(k m), both relative to the joint's largest load.
"""

import math

import numpy as np

from tolstat.kernel.codes import FORCE, LAST_ITERATION_BELOW, TOLERANCE, TORQUE
from tolstat.kernel.integrators import trbdf2
from tolstat.kernel.mechanics.dynamics import mass_of
from tolstat.kernel.mechanics.scale import set_weight, stiffness, typical_force
from tolstat.kernel.simd.jit import njit

CELLS = 720
"""Approximate number of cells of a revolution: an impact and its ringing take a degree or two."""
CELL = np.dtype([("level", "u1"), ("pinned", "u1"), ("worst", "f8")], align=True)
"""How a cell was taken last: its level, whether that may not be lowered, and the largest error of its parts."""
COARSEN_BELOW = 1 / 16
"""Largest error of a cell's parts, in units of the tolerance, below which half as many parts suffice: the error of a
part grows with the third power of its length, or less where contacts switch."""
FIRST_LEVEL = 2
"""Level of the first cell of the first revolution."""
COARSENING_REVS = 3
"""Revolutions with one tolerance after which levels only rise: a changing mesh disturbs a settling motion."""
UNKNOWN = 255
"""Level of a cell that has not been taken yet."""
NEWTON_SHARE, SETTLE_SHARE = 0.01, 0.3
"""Residual that ends Newton's iteration, relative to the joint's largest force: the smaller one of `NEWTON_SHARE` times
the tolerance and `SETTLE_SHARE` times the closure error that is to be detected."""
LAST_ITERATION_FACTOR = 10.0
"""Residual, in units of the one above, up to which one more iteration with the same tangent is the last."""


@njit
def load_error(h, par, motion):
    """Estimated error of a part of length `h` (s) as a load, in units of the tolerance; the largest of all unknowns."""
    force = 1 / (motion.memory[TOLERANCE] * motion.memory[FORCE])
    torque = 1 / (motion.memory[TOLERANCE] * motion.memory[TORQUE])
    worst = 0.0 * force
    k = 0.0 * force
    lumps, rotations = par.lump_kind.shape[0], par.Js.shape[0]
    for body in range(lumps):
        mass, inertia = mass_of(body, par)
        k, k_turn = stiffness(body, par)
        mean_inertia = (inertia[0] + inertia[1] + inertia[2]) / 3
        factors = (force * k, force * math.sqrt(k * mass), torque * k_turn, torque * math.sqrt(k_turn * mean_inertia))
        for j in range(6):
            error_q, error_v = trbdf2.errors(6 * body + j, h, motion)
            kind = 0 if j < 3 else 2
            worst = max(worst, max(factors[kind] * abs(error_q), factors[kind + 1] * abs(error_v)))
    for u in range(motion.q.shape[0] - 6 * lumps):
        error_q, error_v = trbdf2.errors(6 * lumps + u, h, motion)
        arm = par.R if u < rotations else 1.0
        inertia_of_shaft = par.Js[u] if u < rotations else par.m_s
        by_rate = force * math.sqrt(k * inertia_of_shaft)
        worst = max(worst, max(force * k * arm * abs(error_q), by_rate * abs(error_v)))
    return worst


@njit
def cells_of(steps_per_rev):
    """Number of cells per step of the output grid."""
    return max(1, CELLS // steps_per_rev)


@njit
def next_level(revolutions, cell, before):
    """Level to start `cell` with, after `revolutions` with this tolerance; `before`: the preceding cell."""
    known = before if cell.level == UNKNOWN else cell
    if known.level == UNKNOWN:
        return FIRST_LEVEL
    level, error = int(known.level), known.worst
    while level > 0 and error < COARSEN_BELOW and known.pinned == 0 and revolutions < COARSENING_REVS:
        level, error = level - 1, 8 * error
    return level


@njit
def note_cell(level, refused, worst, revolution, cell):
    """Store the outcome of a cell, and pin it if it was refused.

    Parameters
    ----------
    level : int
        Level at which it was accepted.
    refused : bool
        Whether it was refused at a lower level.
    worst : float
        Largest error of its parts, in units of the tolerance.
    revolution : int
        Completed revolutions; cells are pinned after the second.
    cell : record of CELL
        Written.
    """
    cell.level, cell.worst = level, worst
    if refused and revolution > 1:
        cell.pinned = 1


@njit
def refine_mesh(mesh):
    """Halve the length of the parts of all cells."""
    for c in range(mesh.size):
        mesh[c].level += 1


@njit
def forget_mesh(mesh):
    """Mark all cells as not taken yet."""
    for c in range(mesh.size):
        mesh[c].level, mesh[c].pinned, mesh[c].worst = UNKNOWN, 0, 0.0


@njit
def parts_of(mesh):
    """Number of parts of the revolution."""
    total = 0
    for c in range(mesh.size):
        if mesh[c].level != UNKNOWN:
            total += 1 << mesh[c].level
    return total


@njit
def set_scale(closure, turns, options, par, memory, weight):
    """Set the loads that errors are relative to, and the weights of residuals for a given closure error.

    Parameters
    ----------
    closure : float
        Closure error that is to be detected.
    turns : record
        Holds the largest loads of the joint, ``force`` (N) and ``torque`` (N m).
    options, par
        Settings and record of PARAM.
    memory, weight : ndarray
        Those of the joint's motion, with the tolerance in `memory`; written.
    """
    memory[FORCE], memory[TORQUE] = turns.force, turns.torque
    share = min(NEWTON_SHARE * memory[TOLERANCE], SETTLE_SHARE * closure)
    small = max(options.newton_tol * typical_force(par), share * turns.force)
    set_weight(small / options.newton_tol, par, weight)
    memory[LAST_ITERATION_BELOW] = LAST_ITERATION_FACTOR * options.newton_tol
