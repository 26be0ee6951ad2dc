"""Memory of the joints simulated in lock-step: a few records whose float fields have one value per lane."""

from typing import NamedTuple

import numpy as np

from tolstat.common.cardan import CARDAN
from tolstat.common.load_kinds import sizes
from tolstat.common.mechanism import Mechanism
from tolstat.common.parameters import numbers
from tolstat.common.tables import Options, tables
from tolstat.kernel.codes import MEMORY
from tolstat.kernel.lanes.lane_memory import aligned_zeros, lane_dtype
from tolstat.kernel.mechanics.scale import set_weight, typical_force
from tolstat.kernel.mechanics.work import factors_dtype, work_dtype
from tolstat.kernel.revolution.peaks import peaks_dtype
from tolstat.kernel.revolution.resolve import Pasts, make_pasts
from tolstat.kernel.revolution.settle import make_samples
from tolstat.kernel.revolution.trail import make_notes
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import WIDTH

POINTS = ("q", "v", "a", "q0", "v0", "a0", "q1", "v1", "a1", "aux", "residual", "weight", "ahead")
"""Motion of a joint, in the unknowns: fields of a batch's ``motion``, beside ``memory``.

- ``q``, ``v``, ``a``: trial point; ``q0``, ``v0``, ``a0``: last accepted point; ``q1``, ``v1``, ``a1``: the one before
- ``aux``: acceleration at the first stage of a part; at input angles, the third last solution
- ``residual``; ``weight``: factors that make residuals dimensionless
- ``ahead``: expected change of q in the next step, where a better prediction than a Taylor series is known
- ``memory``: see `kernel.codes`
"""

HOLD, RELAX, CHECK, STEP, LOOK, ANGLE, PART = range(7)
"""Phases of a lane. Equilibrium: Newton's iteration (`HOLD`), step of pseudo-time (`RELAX`), test of the static
residual after it (`CHECK`). Dynamics: sub-step of the output grid (`STEP`), step of the recorded revolution again, in
parts (`LOOK`, see `closeup`), part of a cell of the `mesh` (`PART`). Quasi-statics: input angle (`ANGLE`)."""

NUMBERS = (
    *("t", "h", "cv", "ca", "before", "iteration", "factorised", "t_tangent", "at_roundoff"),
    *("phase", "live", "fresh", "passed", "origin", "grid", "pseudo", "stage", "error", "worst"),
    *("count", "until", "steps", "iterations", "halvings", "factorisations"),
)
INTEGERS = ("joint", "k", "level", "done", "tries", "left", "part", "looked", "began")
"""State machine of one lane: phase, step, Newton iteration. Fields of a batch's ``control``.

- ``t``, ``h``: time that the trial point belongs to, length of the step or part, s
- ``cv``, ``ca``: dv/dq (1/s) and da/dq (1/s^2); ``factorised``, ``t_tangent``: cv and time (s) of the tangent in
  use, cv 0 if there is none
- ``before``, ``iteration``: last residual, number of iterations; ``at_roundoff``: 1 if the last change was rounding
- ``phase``: `HOLD` to `PART`; ``live``: 1 if the lane has a joint; ``fresh``: 1 if it is to begin a step or angle;
  ``passed``: 1 if its trial point is accepted then
- ``origin``, ``grid``: start and length of the step of the output grid, cell, or part of a closer look, s
- ``pseudo``: step of pseudo-time, s; ``tries``: number of such steps
- ``stage``: of a step or part of TR-BDF2, 0 or 1; ``error``: of a part; ``worst``: of the cell's worst part
- ``count``, ``until``: explicit steps of the revolution that are done; steps up to the next point of the output grid,
  of a closer look: parts of its step
- ``steps``, ``iterations``, ``halvings``, ``factorisations``: work so far
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
    word_index: np.ndarray  # (words,) where among them a row of PARAM has its words, in lane 0; -1: shared by all lanes
    work: np.record
    tangent: np.record  # factorised tangents in use; each lane replaces only its own
    motion: np.record
    control: np.record
    peaks: np.record
    samples: np.recarray  # (width, steps_per_rev) SAMPLE
    fine: np.ndarray  # (width, 3, n) loads of the last parts of a closer look, or of a cell, part j at j % 3
    notes: np.recarray  # (width,) NOTES
    pasts: Pasts
    scratch: np.record  # WORK: scratch of an evaluation of one joint


class Queue(NamedTuple):
    """Joints that are simulated together, with equal numbers of contact stations and orders; n > 0."""

    rows: np.recarray  # (n,) PARAM
    words: np.ndarray  # (n, words) the same memory as doubles
    starts: np.ndarray  # (n, dof) where the search for each joint's start begins, see `revolution.starts`
    left: np.ndarray  # (n,) work still allowed to each joint, in Newton iterations; reduced by that done
    samples: np.recarray  # (n, steps_per_rev) SAMPLE: the last revolution of each joint; not written if empty
    blocks: np.recarray  # (n, revolutions) KERNEL_RESULT, revolution r at r modulo their number; not written if empty
    results: np.recarray  # (n,) KERNEL_RESULT


def make_batch(options: Options, width: int = WIDTH, mechanism: Mechanism = CARDAN) -> Batch:
    """Allocate `width` lanes for joints of a mechanism."""
    control = np.dtype([(name, "f8") for name in NUMBERS] + [(name, "i8", width) for name in INTEGERS])
    motion = np.dtype([(name, "f8", mechanism.dof) for name in POINTS] + [("memory", "f8", MEMORY)])
    dtypes = work_dtype(mechanism), factors_dtype(mechanism), motion, control, peaks_dtype(mechanism)
    pars = aligned_zeros(1, lane_dtype(tables(mechanism).PARAM, width)).view(np.recarray)
    records = (aligned_zeros(1, lane_dtype(dtype, width)).view(np.recarray)[0] for dtype in dtypes)
    for name, values in numbers(mechanism).items():
        pars[0][name] = values
    words = pars.view(np.float64).view(np.ndarray)
    return Batch(
        pars[0],
        words,
        _word_index(tables(mechanism).PARAM, width),
        *records,
        make_samples(width, options.steps_per_rev, mechanism),
        np.zeros((width, 3, sizes(mechanism).instant)),
        make_notes(width),
        make_pasts(width, options, mechanism),
        np.zeros(1, work_dtype(mechanism)).view(np.recarray)[0],
    )


def _word_index(dtype, width):
    """Values of `Batch.word_index` for rows of `dtype`, PARAM: its integers are shared by all lanes."""
    lanes = lane_dtype(dtype, width)
    index = np.full(dtype.itemsize // 8, -1)
    for name in dtype.names:
        if dtype[name].base == np.float64:
            first, size = dtype.fields[name][1] // 8, dtype[name].itemsize // 8
            index[first : first + size] = lanes.fields[name][1] // 8 + width * np.arange(size)
    return index


@njit
def samples_of(lane, joint, of_lanes, of_joints):
    """Samples of the lane's joint: `of_joints`, those of the queue, if the caller keeps them, else `of_lanes`."""
    return of_joints[joint] if len(of_joints) > 0 else of_lanes[lane]


@njit
def put_joint(lane, words, batch):
    """Copy a row of PARAM, as doubles, to a lane."""
    for i in range(batch.word_index.size):
        if batch.word_index[i] >= 0:
            batch.par_words[batch.word_index[i] + lane] = words[i]


@njit
def put_start(lane, par, q, control, motion):
    """Put the joint `par` to rest at the unknowns `q` in a lane, and reset its counters."""
    for i in range(motion.q.shape[0]):
        motion.q0[i, lane] = motion.q1[i, lane] = q[i]
        motion.v0[i, lane] = motion.a0[i, lane] = motion.v1[i, lane] = motion.aux[i, lane] = 0.0
    set_weight(typical_force(par), par, motion.weight[:, lane])
    forget_steps(lane, control, motion)
    control.live[lane], control.fresh[lane] = 1.0, 0.0
    control.steps[lane] = control.iterations[lane] = control.halvings[lane] = control.factorisations[lane] = 0.0


@njit
def forget_steps(lane, control, motion):
    """Mark tangent and earlier steps of a lane as missing."""
    for i in range(MEMORY):
        motion.memory[i, lane] = 0.0
    control.passed[lane] = control.factorised[lane] = control.stage[lane] = 0.0


@njit
def start_newton(lane, cv, ca, control, motion):
    """Start Newton's iteration in a lane from its last accepted point, at rest.

    `cv` (1/s) and `ca` (1/s^2) are dv/dq and da/dq of the iteration.
    """
    for i in range(motion.q.shape[0]):
        motion.q[i, lane] = motion.q0[i, lane]
        motion.v[i, lane] = motion.a[i, lane] = 0.0
    control.cv[lane], control.ca[lane] = cv, ca
    control.iteration[lane] = control.at_roundoff[lane] = 0.0


@njit
def empty(lane, batch):
    """Mark a lane as empty."""
    motion, control = batch.motion, batch.control
    control.live[lane] = control.fresh[lane] = control.passed[lane] = 0.0
    for i in range(motion.q.shape[0]):  # no NaN: it would send all lanes through the branch for large rotations
        motion.q[i, lane] = motion.v[i, lane] = motion.a[i, lane] = 0.0
