"""Memory of the joints simulated in lock-step: a few records whose float fields have one value per lane.

The start of a joint is computed in the State of a single joint and copied to a lane.
"""

from typing import NamedTuple

import numpy as np

from tolstat.common.tables import PARAM, Options
from tolstat.kernel.integrators.state import (
    AHEAD,
    FACTORISATIONS,
    H_OLD,
    HALVINGS,
    ITERATIONS,
    LAST_ITERATION_BELOW,
    MEMORY,
    STAGED_STEP,
    STEPS,
    TRAPEZOIDAL,
)
from tolstat.kernel.lanes.lane_memory import aligned_zeros, lane_dtype
from tolstat.kernel.mechanics.topology import N_DOF
from tolstat.kernel.mechanics.work import WORK
from tolstat.kernel.revolution.peaks import PEAKS
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
"""The arrays of `state.State`, for all lanes."""

HOLD, RELAX, CHECK, STEP, LOOK, ANGLE, PART = range(7)
"""Phases of a lane. Equilibrium: Newton's iteration (`HOLD`), step of pseudo-time (`RELAX`), test of the static
residual after it (`CHECK`). Dynamics: sub-step of the output grid (`STEP`), step of the recorded revolution again, in
parts (`LOOK`, see `closeup`), part of a cell of the `mesh` (`PART`). Quasi-statics: input angle (`ANGLE`)."""

CONTROL = np.dtype(
    [(name, "f8") for name in ("t", "h", "cv", "ca", "before", "iteration", "factorised", "at_roundoff")]
    + [
        (name, "f8")
        for name in ("phase", "live", "fresh", "passed", "origin", "grid", "pseudo", "stage", "error", "worst")
    ]
    + [(name, "f8") for name in ("count", "until")]
    + [(name, "f8") for name in ("steps", "iterations", "halvings", "factorisations")]
    + [(name, "i8", WIDTH) for name in ("joint", "k", "level", "done", "tries", "left", "part", "looked", "began")]
)
"""State machine of one lane: phase, step, Newton iteration.

- ``t``, ``h``: time that the trial point belongs to, length of the step or part, s
- ``cv``, ``ca``: dv/dq (1/s) and da/dq (1/s^2); ``factorised``: cv of the tangent in use, 0 if there is none
- ``before``, ``iteration``: last residual, number of iterations; ``at_roundoff``: 1 if the last change was rounding
- ``phase``: `HOLD` to `PART`; ``live``: 1 if the lane has a joint; ``fresh``: 1 if it is to begin a step or angle;
  ``passed``: 1 if its trial point is accepted then
- ``origin``, ``grid``: start and length of the step of the output grid, cell, or part of a closer look, s
- ``pseudo``: step of pseudo-time, s; ``tries``: number of such steps
- ``stage``: of a part of a cell, 0 or 1; ``error``: of that part; ``worst``: of the cell's worst part
- ``count``, ``until``: explicit steps of the revolution that are done; steps up to the next point of the output grid
- ``steps``, ``iterations``, ``halvings``, ``factorisations``: counters as of State
- ``joint``: index of the joint; ``k``: grid point, cell or angle that is being solved
- ``level``: halvings of the sub-step or part; at an angle, attempts that failed; in pseudo-time, as `course.FROM_GUESS`
- ``done``: smallest sub-steps that are done of the step; for angles, revolutions that are done
- ``left``, ``looked``: closer look, steps left and parts recorded; ``part``: current part of its step, or of a cell
- ``began``: level that the cell began with
"""


class Batch(NamedTuple):
    """Memory of all lanes, read as records of lanes or, through ``[..., lane]``, as those of single joints."""

    par: np.record
    par_words: np.ndarray  # the same memory as doubles
    work: np.record
    kept: np.record  # factorised tangents in use; each lane replaces only its own
    motion: np.record
    control: np.record
    peaks: np.record
    samples: np.recarray  # (WIDTH, steps_per_rev) SAMPLE
    fine: np.recarray  # (WIDTH, 3) SAMPLE, as in `settle.Ring`
    notes: np.recarray  # (WIDTH,) NOTES
    pasts: Pasts


def _places():
    """Index of each word of a row of PARAM among the words of its lanes; -1 for integers, which all lanes share."""
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
    work, kept, motion, control, peaks = (
        aligned_zeros(1, lane_dtype(dtype)).view(np.recarray)[0] for dtype in (WORK, WORK, MOTION, CONTROL, PEAKS)
    )
    motion.weight[:] = 1.0
    words = pars.view(np.float64).view(np.ndarray)
    samples = make_samples(WIDTH, options.steps_per_rev)
    fine = make_samples(WIDTH, 3)
    notes, pasts = make_notes(WIDTH), make_pasts(WIDTH, options)
    return Batch(pars[0], words, work, kept, motion, control, peaks, samples, fine, notes, pasts)


@njit
def samples_of(lane, batch, samples):
    """Samples of the lane's joint: its row of `samples` if the caller keeps them, else those of the batch."""
    return samples[batch.control.joint[lane]] if len(samples) > 0 else batch.samples[lane]


@njit
def put_joint(lane, words, batch):
    """Copy a row of PARAM, as doubles, to a lane."""
    for i in range(PLACE.size):
        if PLACE[i] >= 0:
            batch.par_words[PLACE[i] + lane] = words[i]


@njit
def put_points(lane, state, control, motion):
    """Copy the last accepted points of a joint to a lane, and mark its tangent as missing."""
    for i in range(N_DOF):
        motion.q0[i, lane], motion.v0[i, lane], motion.a0[i, lane] = state.q0[i], state.v0[i], state.a0[i]
        motion.q1[i, lane], motion.v1[i, lane] = state.q1[i], state.v1[i]
    motion.memory[H_OLD, lane], motion.memory[AHEAD, lane] = state.memory[H_OLD], state.memory[AHEAD]
    motion.memory[TRAPEZOIDAL, lane] = state.memory[TRAPEZOIDAL]
    motion.memory[LAST_ITERATION_BELOW, lane] = motion.memory[STAGED_STEP, lane] = 0.0
    control.passed[lane] = control.factorised[lane] = control.stage[lane] = 0.0


@njit
def put_start(lane, state, control, motion):
    """Copy the start of a joint to a lane, and reset its counters."""
    put_points(lane, state, control, motion)
    for i in range(N_DOF):
        motion.weight[i, lane] = state.weight[i]
    control.live[lane], control.fresh[lane] = 1.0, 0.0
    control.steps[lane] = control.iterations[lane] = control.halvings[lane] = control.factorisations[lane] = 0.0


@njit
def start_newton(lane, cv, ca, control, motion):
    """Start Newton's iteration in a lane from its last accepted point, at rest.

    `cv` (1/s) and `ca` (1/s^2) are dv/dq and da/dq of the iteration.
    """
    for i in range(N_DOF):
        motion.q[i, lane] = motion.q0[i, lane]
        motion.v[i, lane] = motion.a[i, lane] = 0.0
    control.cv[lane], control.ca[lane] = cv, ca
    control.iteration[lane] = control.at_roundoff[lane] = 0.0


@njit
def empty(lane, batch):
    """Mark a lane as empty."""
    motion, control = batch.motion, batch.control
    control.live[lane] = control.fresh[lane] = control.passed[lane] = 0.0
    for i in range(N_DOF):  # no NaN: it would send all lanes through the branch for large rotations
        motion.q[i, lane] = motion.v[i, lane] = motion.a[i, lane] = 0.0


@njit
def get_counters(lane, batch, counters):
    """Copy the counters of a lane's joint."""
    control = batch.control
    counters[STEPS], counters[ITERATIONS] = int(control.steps[lane]), int(control.iterations[lane])
    counters[HALVINGS], counters[FACTORISATIONS] = int(control.halvings[lane]), int(control.factorisations[lane])
