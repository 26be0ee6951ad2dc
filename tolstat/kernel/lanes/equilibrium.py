"""Static equilibrium of the loaded joint at one input angle: Newton's iteration, or pseudo-transient continuation.

Newton's iteration starts from the pose in which all pins just touch, and needs some nine iterations for three joints of
four. The others take pseudo-transient continuation (Kelley, Keyes 1998): implicit Euler steps at fixed theta, each from
rest, with a step that grows while Newton converges. Until contacts carry, the inertia terms bound each step; then the
steps become Newton steps for the equilibrium. Where there is no equilibrium (no torque), the number of steps is
bounded, and the simulation continues from the last iterate.
"""

from tolstat.kernel.lanes.batch import RELAX, start_newton
from tolstat.kernel.simd.jit import njit

CV_STATIC = 1e-200
"""cv = dv/dq of an equilibrium: so small that rate terms vanish, but not zero, which would mean that no tangent is
stored."""
CV_REGULAR, CA_REGULAR = 10.0, 100.0
"""cv (1/s) and ca (1/s^2) in the tangent of an equilibrium, ca also in that of a step without inertia; those of an
implicit step of 0.1 s: damping and inertia regularise directions without stiffness, and are a thousandth of the
stiffness of a loaded contact. The residual contains neither."""

FAR = 1.0
"""Size of an unknown, m or rad, above which Newton's iteration for an equilibrium has diverged."""

FIRST, LARGEST, SMALLEST = 3e-4, 1e-1, 1e-9
"""First, largest and smallest step of pseudo-time, s."""
GROWTH, SHRINK = 3.0, 0.3
"""Factors on the step of pseudo-time after a converged and after a failed step."""
MAX_STEPS = 60
ENOUGH = 1e-4
"""Scaled static residual below which pseudo-transient continuation ends: good enough as a start."""

FROM_GUESS, FROM_ZERO, AT_ANGLE = range(3)
"""Levels of pseudo-transient continuation: from the guess; from zero; from the solution at the previous angle, as the
third attempt at an input angle."""


@njit
def relax(lane, control, motion):
    """Set up the next step of pseudo-time in a lane: first from the guess, then from zero.

    Return False after `MAX_STEPS`, or at the smallest step: the last iterate is kept.
    """
    if control.tries[lane] == MAX_STEPS or control.pseudo[lane] < SMALLEST:
        control.factorised[lane] = 0.0
        if control.level[lane] > FROM_GUESS:
            return False
        for i in range(motion.q.shape[0]):
            motion.q0[i, lane] = 0.0
        start_relaxing(lane, FROM_ZERO, control)
    control.phase[lane] = RELAX
    control.tries[lane] += 1
    step = control.pseudo[lane]
    start_newton(lane, 1 / step, 1 / (step * step), control, motion)
    return True


@njit
def start_relaxing(lane, level, control):
    """Start pseudo-transient continuation in a lane at a level, `FROM_GUESS` to `AT_ANGLE`."""
    control.level[lane], control.tries[lane], control.pseudo[lane] = level, 0, FIRST
