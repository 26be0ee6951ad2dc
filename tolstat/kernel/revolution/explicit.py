"""One joint with explicit steps (`verlet`): equal steps over each revolution; `resolve` decides after it.

The first number of steps is the least that is stable while no end station presses harder than expected (`stability`).
A revolution in which one does is repeated with as many steps as that force needs. In place of a tighter tolerance the
steps are halved.
"""

import math

from tolstat.kernel.integrators.stability import largest_force, steps_for
from tolstat.kernel.integrators.verlet import correct, predict
from tolstat.kernel.mechanics.dynamics import acceleration
from tolstat.kernel.revolution.peaks import follow
from tolstat.kernel.revolution.resolve import SETTLING, begin_turns
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import any_of

AMPLE = 2.0
"""Contact force that a revolution is repeated for, in units of the one that it was not stable for."""
MOST_STEPS = 40_000
"""Number of steps of a revolution above which a joint is given up as too stiff, before its steps are halved to estimate
their error."""


@njit
def steps_of(turns):
    """Number of steps of a revolution in use."""
    return turns.steps << turns.halved


@njit
def step_length(par, turns):
    """Length of a step, s."""
    return 2 * math.pi / (abs(par.omega) * steps_of(turns))


@njit
def begin_explicit(steps, par, options, work, past):
    """Initialise `past` for a joint at its start, with `steps` a revolution."""
    begin_turns(par, options, past)
    past.turns.steps = steps
    past.turns.bearable = largest_force(steps, par, work)


@njit
def begin_revolution(point, before, par, work, past):
    """Keep `point` (q, v, a) at the start of a revolution; `before`: steps of the last one."""
    turns = past.turns
    for i in range(past.begun.shape[1]):
        past.begun[0, i], past.begun[1, i], past.begun[2, i] = point[0][i], point[1][i], point[2][i]
    if steps_of(turns) != before:
        turns.bearable = largest_force(steps_of(turns), par, work)


@njit
def is_stable(force, q, turns):
    """Whether the steps were stable so far; `force`: largest one of an end station, N."""
    good = force <= turns.bearable
    for i in range(q.shape[0]):
        good = good and abs(q[i]) < 1
    return good


@njit
def repeat_finer(force, point, par, options, work, past):
    """Return to the start of the revolution with more steps, at most twice as many; return False if there are too many.

    Parameters
    ----------
    force : float
        Largest contact force of an end station that was met, N; where it is a consequence of instability, twice as many
        steps will do.
    point : tuple of 3 ndarray
        Written: q, v, a at the start of the revolution.
    par, options, work, past
        As in all kernels.
    """
    turns, n = past.turns, options.steps_per_rev
    wanted = min(steps_for(AMPLE * force, par, options, work), 2 * steps_of(turns))
    turns.steps = max(turns.steps, n * ((wanted >> turns.halved) // n)) + n
    if turns.steps > MOST_STEPS:
        return False
    turns.since = turns.revolution
    turns.limit = max(turns.limit, turns.revolution + SETTLING)
    turns.bearable = largest_force(steps_of(turns), par, work)
    for i in range(past.begun.shape[1]):
        point[0][i], point[1][i], point[2][i] = past.begun[0, i], past.begun[1, i], past.begun[2, i]
    return True


@njit
def walk(par, options, work, motion, control, peaks):
    """Take steps in all lanes until one of them reaches a point of the output grid; `peaks` follows the loads.

    `motion` and `control` are read as lanes, as in `lanes`.
    """
    h, origin = control.h, control.origin
    while not any_of(control.until <= 0):
        control.count, control.until = control.count + 1, control.until - 1
        control.t = origin + control.count * h
        predict(h, motion)
        acceleration(control.t, motion.q, motion.v, par, options, work, motion.a)
        follow(par, work, motion.v, peaks)
        correct(h, motion)
