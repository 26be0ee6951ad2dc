"""Memory of the joints that go in lock-step: everything in a few records, whose floats are lanes.

Joints come into a lane and leave it through the State of one joint.
"""

from typing import NamedTuple

import numpy as np

from tolstat.kernel._jit import njit
from tolstat.kernel.integrate import UNLIMITED
from tolstat.kernel.lane import WIDTH
from tolstat.kernel.lane_memory import aligned_zeros, lane_dtype
from tolstat.kernel.settle import make_samples
from tolstat.kernel.state import AHEAD, ATTEMPTS_LEFT, FACTORISATIONS, H_OLD, HALVINGS, ITERATIONS, STEPS
from tolstat.kernel.topology import N_DOF
from tolstat.kernel.trail import make_notes
from tolstat.kernel.work import WORK
from tolstat.tables import PARAM, Options

MOTION = np.dtype(
    [(name, "f8", N_DOF) for name in ("q", "v", "a", "q0", "v0", "a0", "q1", "v1", "residual", "weight", "ahead")]
    + [("memory", "f8", 3)]
)
"""What `state.State` is to one joint."""

CONTROL = np.dtype(
    [(name, "f8") for name in ("t", "h", "cv", "ca", "before", "iteration", "factorised", "at_roundoff")]
    + [(name, "f8") for name in ("live", "fresh", "steps", "iterations", "halvings", "factorisations")]
    + [(name, "i8", WIDTH) for name in ("joint", "k")]
)
"""Where a lane is in its joint: Newton's iteration; whether it has a joint (1 or 0) and is to begin a step; counters as
of State; row of the joint, grid point it is on the way to."""


class Batch(NamedTuple):
    """Memory of all lanes; the same bytes are records of lanes and, through ``[..., lane]``, of single joints."""

    par: np.record
    par_words: np.ndarray  # the same memory as doubles
    work: np.record
    kept: np.record  # of the fields of the tangent, those in use: a lane renews its own only
    motion: np.record
    control: np.record
    samples: np.recarray  # (WIDTH, steps_per_rev) SAMPLE
    notes: np.recarray  # (WIDTH,) NOTES


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
    return Batch(pars[0], words, work, kept, motion, control, samples, make_notes(WIDTH))


@njit
def put_joint(lane, words, batch):
    """Copy a row of PARAM, as doubles, to a lane."""
    for i in range(PLACE.size):
        if PLACE[i] >= 0:
            batch.par_words[PLACE[i] + lane] = words[i]


@njit
def put_motion(lane, state, batch):
    """Copy the last accepted points of a joint to a lane."""
    motion, control = batch.motion, batch.control
    for i in range(N_DOF):
        motion.q0[i, lane], motion.v0[i, lane], motion.a0[i, lane] = state.q0[i], state.v0[i], state.a0[i]
        motion.q1[i, lane], motion.v1[i, lane] = state.q1[i], state.v1[i]
        motion.weight[i, lane], motion.ahead[i, lane] = state.weight[i], state.ahead[i]
    motion.memory[H_OLD, lane], motion.memory[AHEAD, lane] = state.memory[H_OLD], state.memory[AHEAD]
    control.steps[lane], control.iterations[lane] = state.counters[STEPS], state.counters[ITERATIONS]
    control.halvings[lane], control.factorisations[lane] = state.counters[HALVINGS], state.counters[FACTORISATIONS]


@njit
def get_motion(lane, batch, state):
    """Copy the last accepted points of a lane's joint, without a tangent."""
    motion = batch.motion
    for i in range(N_DOF):
        state.q0[i], state.v0[i], state.a0[i] = motion.q0[i, lane], motion.v0[i, lane], motion.a0[i, lane]
        state.q1[i], state.v1[i] = motion.q1[i, lane], motion.v1[i, lane]
        state.weight[i] = motion.weight[i, lane]
    state.memory[:] = 0.0
    state.counters[ATTEMPTS_LEFT] = UNLIMITED
    state.memory[H_OLD] = motion.memory[H_OLD, lane]
    get_counters(lane, batch, state.counters)


@njit
def get_counters(lane, batch, counters):
    """Copy the counters of a lane's joint."""
    control = batch.control
    counters[STEPS], counters[ITERATIONS] = int(control.steps[lane]), int(control.iterations[lane])
    counters[HALVINGS], counters[FACTORISATIONS] = int(control.halvings[lane]), int(control.factorisations[lane])
