"""Memory of the joints that go in lock-step: everything in a few records, whose floats are lanes.

Joints come into a lane through the State of one joint.
"""

from typing import NamedTuple

import numpy as np

from tolstat.common.tables import PARAM, Options
from tolstat.kernel.integrators.state import (
    AHEAD,
    CLOSE,
    FACTORISATIONS,
    H_OLD,
    HALVINGS,
    ITERATIONS,
    MEMORY,
    STAGED,
    STEPS,
)
from tolstat.kernel.lanes.lane_memory import aligned_zeros, lane_dtype
from tolstat.kernel.mechanics.topology import N_DOF
from tolstat.kernel.mechanics.work import WORK
from tolstat.kernel.revolution.resolve import Pasts, make_pasts
from tolstat.kernel.revolution.settle import make_samples
from tolstat.kernel.revolution.trail import make_notes
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import WIDTH

MOTION = np.dtype(
    [(name, "f8", N_DOF) for name in ("q", "v", "a", "q0", "v0", "a0", "q1", "v1", "a1", "aux")]
    + [(name, "f8", N_DOF) for name in ("residual", "weight", "ahead")]
    + [("memory", "f8", MEMORY)]
)
"""What `state.State` is to one joint."""

HOLD, RELAX, CHECK, STEP, LOOK, ANGLE, PART = range(7)
"""What a lane is at: equilibrium by Newton's iteration; in pseudo-time; whether it is there; a step; a step of the
recorded revolution once more, in parts (`closeup`); the next angle; a part of a cell of the `mesh`."""

CONTROL = np.dtype(
    [(name, "f8") for name in ("t", "h", "cv", "ca", "before", "iteration", "factorised", "at_roundoff")]
    + [
        (name, "f8")
        for name in ("phase", "live", "fresh", "passed", "origin", "grid", "pseudo", "stage", "error", "worst")
    ]
    + [(name, "f8") for name in ("steps", "iterations", "halvings", "factorisations")]
    + [(name, "i8", WIDTH) for name in ("joint", "k", "level", "done", "tries", "left", "part", "looked", "began")]
)
"""Where a lane is in its joint.

Time and step, Newton's iteration; what it is at; whether it has a joint (1 or 0), is to begin a step or angle, and has
its trial point accepted then; time at which the step of the output grid began, its length, and the step of pseudo-time,
s; stage of a part of a cell (0 or 1), its error, and that of the cell's worst part; counters as of State. Row of the
joint; grid point, cell or angle that it is on the way to, and there the level of its sub-step (of an angle or an
equilibrium: ways that have failed) and what is done: parts of a step, revolutions of angles; steps in pseudo-time. Of a
closer look: steps left to take, the part of the step it is at, and parts recorded. Level that a cell began with.
"""


class Batch(NamedTuple):
    """Memory of all lanes; the same bytes are records of lanes and, through ``[..., lane]``, of single joints."""

    par: np.record
    par_words: np.ndarray  # the same memory as doubles
    work: np.record
    kept: np.record  # of the fields of the tangent, those in use: a lane renews its own only
    motion: np.record
    control: np.record
    samples: np.recarray  # (WIDTH, steps_per_rev) SAMPLE
    fine: np.recarray  # (WIDTH, 3) SAMPLE, as in `settle.Ring`
    notes: np.recarray  # (WIDTH,) NOTES
    pasts: Pasts


def _places():
    """Where each word of a row of PARAM goes among the words of its lanes; -1 for integers, which all lanes share."""
    lanes = lane_dtype(PARAM)
    places = np.full(PARAM.itemsize // 8, -1)
    for name in PARAM.names:
        if PARAM[name].base == np.float64:
            first, size = PARAM.fields[name][1] // 8, PARAM[name].itemsize // 8
            places[first : first + size] = lanes.fields[name][1] // 8 + WIDTH * np.arange(size)
    return places


PLACE = _places()


def make_batch(options: Options) -> Batch:
    """Allocate."""
    pars = aligned_zeros(1, lane_dtype(PARAM)).view(np.recarray)
    work, kept, motion, control = (
        aligned_zeros(1, lane_dtype(dtype)).view(np.recarray)[0] for dtype in (WORK, WORK, MOTION, CONTROL)
    )
    motion.weight[:] = 1.0
    words = pars.view(np.float64).view(np.ndarray)
    samples = make_samples(WIDTH, options.steps_per_rev)
    fine = make_samples(WIDTH, 3)
    notes, pasts = make_notes(WIDTH), make_pasts(WIDTH, options)
    return Batch(pars[0], words, work, kept, motion, control, samples, fine, notes, pasts)


@njit
def put_joint(lane, words, batch):
    """Copy a row of PARAM, as doubles, to a lane."""
    for i in range(PLACE.size):
        if PLACE[i] >= 0:
            batch.par_words[PLACE[i] + lane] = words[i]


@njit
def put_points(lane, state, control, motion):
    """Copy the last accepted points of a joint to a lane, without a tangent."""
    for i in range(N_DOF):
        motion.q0[i, lane], motion.v0[i, lane], motion.a0[i, lane] = state.q0[i], state.v0[i], state.a0[i]
        motion.q1[i, lane], motion.v1[i, lane] = state.q1[i], state.v1[i]
    motion.memory[H_OLD, lane], motion.memory[AHEAD, lane] = state.memory[H_OLD], state.memory[AHEAD]
    motion.memory[CLOSE, lane] = motion.memory[STAGED, lane] = 0.0
    control.passed[lane] = control.factorised[lane] = control.stage[lane] = 0.0


@njit
def put_start(lane, state, control, motion):
    """Copy the start of a joint to a lane."""
    put_points(lane, state, control, motion)
    for i in range(N_DOF):
        motion.weight[i, lane] = state.weight[i]
    control.live[lane], control.fresh[lane] = 1.0, 0.0
    control.steps[lane] = control.iterations[lane] = control.halvings[lane] = control.factorisations[lane] = 0.0


@njit
def rest(lane, cv, ca, control, motion):
    """Let a lane begin Newton's iteration from its last accepted point, at rest."""
    for i in range(N_DOF):
        motion.q[i, lane] = motion.q0[i, lane]
        motion.v[i, lane] = motion.a[i, lane] = 0.0
    control.cv[lane], control.ca[lane] = cv, ca
    control.iteration[lane] = control.at_roundoff[lane] = 0.0


@njit
def empty(lane, batch):
    """Leave a lane without a joint."""
    motion, control = batch.motion, batch.control
    control.live[lane] = control.fresh[lane] = control.passed[lane] = 0.0
    for i in range(N_DOF):  # no NaN: it would take all lanes to the paths of large rotations
        motion.q[i, lane] = motion.v[i, lane] = motion.a[i, lane] = 0.0


@njit
def get_counters(lane, batch, counters):
    """Copy the counters of a lane's joint."""
    control = batch.control
    counters[STEPS], counters[ITERATIONS] = int(control.steps[lane]), int(control.iterations[lane])
    counters[HALVINGS], counters[FACTORISATIONS] = int(control.halvings[lane]), int(control.factorisations[lane])
