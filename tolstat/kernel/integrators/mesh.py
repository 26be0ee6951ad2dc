"""Steps that follow the error, on a mesh that one revolution leaves to the next.

A revolution has some `CELLS` cells, whole numbers of which make a step of the output grid. A cell is taken in 2^level
equal parts by TR-BDF2. Where the estimated error of a part is above the tolerance, the cell is begun anew with twice as
many. The next revolution begins with the levels of this one, or with lower ones where the error was far below the
tolerance; a cell that has once been refused keeps its level. So the mesh of a motion that repeats comes to rest, and
impacts that happen at the same angles meet fine parts there at once.

The error of a part is told as a load: that of a displacement by the stiffness k of the lump's bushing, that of a
velocity by sqrt(k m), both relative to the joint's largest load.
"""

import math

import numpy as np

from tolstat.kernel.integrators import trbdf2
from tolstat.kernel.integrators.state import CLOSE, FORCE, TOLERANCE, TORQUE
from tolstat.kernel.mechanics.dynamics import mass_of
from tolstat.kernel.mechanics.scale import set_weight, stiffness, typical_force
from tolstat.kernel.mechanics.topology import N_LUMPS, PSI
from tolstat.kernel.simd.jit import njit

errors = trbdf2.errors
CELLS = 720
"""Of a revolution, about: an impact and its ringing take a degree or two."""
CELL = np.dtype([("level", "u1"), ("pinned", "u1"), ("worst", "f8")], align=True)
"""How a cell was taken last: its level, whether it keeps it, and the error of its worst part."""
LOW = 1 / 16
"""Error of a cell's worst part, in units of the tolerance, below which half as many parts will do: the error of a part
goes with the third power of its length, or less where contacts switch."""
FIRST_LEVEL = 2
"""Of the first cell of the first revolution."""
SHAPING = 3
"""Revolutions with one tolerance after which cells get finer only: a mesh that changes disturbs a settling motion."""
UNKNOWN = 255
"""Level of a cell that has not been taken yet."""
NEWTON_SHARE, SETTLE_SHARE = 0.01, 0.3
"""Residual that ends Newton's iteration relative to the joint's largest force, the smaller one: in units of the
tolerance, and of the closure error that is to be seen."""
LAST = 3.0
"""Residual, in units of that one, from which one more iteration is the last."""


@njit
def load_error(h, par, state):
    """Estimated error of a part of length `h` as a load, in units of the tolerance; the largest of all unknowns."""
    force = 1 / (state.memory[TOLERANCE] * state.memory[FORCE])
    torque = 1 / (state.memory[TOLERANCE] * state.memory[TORQUE])
    worst = 0.0 * force
    k = 0.0 * force
    for body in range(N_LUMPS):
        mass, inertia = mass_of(body, par)
        k, k_turn = stiffness(body, par)
        mean_inertia = (inertia[0] + inertia[1] + inertia[2]) / 3
        of = (force * k, force * math.sqrt(k * mass), torque * k_turn, torque * math.sqrt(k_turn * mean_inertia))
        for j in range(6):
            of_q, of_v = errors(6 * body + j, h, state)
            kind = 0 if j < 3 else 2
            worst = max(worst, max(of[kind] * abs(of_q), of[kind + 1] * abs(of_v)))
    of_q, of_v = errors(PSI, h, state)
    return max(worst, max(force * k * par.R * abs(of_q), force * math.sqrt(k * par.Js) * abs(of_v)))


@njit
def cells_of(steps_per_rev):
    """Cells of a step of the output grid."""
    return max(1, CELLS // steps_per_rev)


@njit
def next_level(revolutions, own, before):
    """Level to begin a cell with, after so many `revolutions` with this tolerance; `before` is the cell before it."""
    one = before if own.level == UNKNOWN else own
    if one.level == UNKNOWN:
        return FIRST_LEVEL
    level, error = int(one.level), one.worst
    while level > 0 and error < LOW and one.pinned == 0 and revolutions < SHAPING:
        level, error = level - 1, 8 * error
    return level


@njit
def note_cell(level, refused, worst, revolution, cell):
    """Keep how a cell has gone; from the second `revolution` on a refused one is pinned."""
    cell.level, cell.worst = level, worst
    if refused and revolution > 1:
        cell.pinned = 1


@njit
def refine_mesh(mesh):
    """Halve the parts of all cells."""
    for c in range(mesh.size):
        mesh[c].level += 1


@njit
def forget_mesh(mesh):
    """Know nothing of any cell."""
    for c in range(mesh.size):
        mesh[c].level, mesh[c].pinned, mesh[c].worst = UNKNOWN, 0, 0.0


@njit
def parts_of(mesh):
    """Parts of the revolution."""
    total = 0
    for c in range(mesh.size):
        if mesh[c].level != UNKNOWN:
            total += 1 << mesh[c].level
    return total


@njit
def set_scale(largest_force, largest_torque, closure, options, par, memory, weight):
    """Let errors be relative to these loads (N, N m), and residuals as small as it takes to see a `closure` error."""
    memory[FORCE], memory[TORQUE] = largest_force, largest_torque
    share = min(NEWTON_SHARE * memory[TOLERANCE], SETTLE_SHARE * closure)
    small = max(options.newton_tol * typical_force(par), share * largest_force)
    set_weight(small / options.newton_tol, par, weight)
    memory[CLOSE] = LAST * options.newton_tol
