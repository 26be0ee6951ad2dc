"""Closer look: finer integration of load peaks at which a contact switches, or sliding reverses.

When a contact or a face opens or closes, the bodies ring at kilohertz. The steps of the output grid do not resolve the
ringing, and need not: it decays within a few degrees. On top of a load's peak, however, it decides the largest load.
There the steps from the switch on are integrated again in smaller parts, from the recorded motion, as long as a load
rings near its largest value. The trapezoidal rule takes them in place of BDF2, which damps the ringing, if the parts
resolve it. They count among the largest and smallest loads; the recorded samples stay as they are.
"""

import math

from tolstat.kernel.codes import H_OLD, LAST_ITERATION_BELOW, TRAPEZOIDAL
from tolstat.kernel.mechanics.dynamics import mass_of
from tolstat.kernel.mechanics.loads import size_of
from tolstat.kernel.mechanics.scale import stiffness
from tolstat.kernel.revolution.settle import grid_step, is_sharp, peak
from tolstat.kernel.simd.jit import njit

KINK = 2e-4
"""Third difference of a load's samples, in units of its measure, up to which ringing is too weak to count."""
SHARP_KINK = 1e-3
"""The same where only sliding reverses: a smaller kink does not ring, but the trapezoidal rule would make it ring."""
REACH = 7.0
"""Distance of a load from its largest value, in units of the third difference of its samples, that ringing may
bridge."""
STEPS = 2
"""Least number of steps of the grid that are integrated again: the one in which the contact switches, and the next."""
MORE = 2
"""Factor by which the first step has more parts with faces or friction: a hit lasts a tenth of a degree."""
FEWER = 4
"""Factor by which later steps have fewer parts: the ringing has decayed by then."""
LONGEST = 4 * math.pi
"""Longest part that the trapezoidal rule takes, in units of sqrt(m/k) of a pin on its bushing: two periods. In longer
ones ringing dies away, but the trapezoidal rule would go on with it."""
LAST_ITERATION_FACTOR = 150.0
"""Residual, in units of `newton_tol`, up to which one more iteration with the same tangent is the last, in parts that
the trapezoidal rule takes: they are so short that it takes off all but a hundredth."""


@njit
def switches(s, samples):
    """Whether a contact station or a face opened or closed between samples `s - 1` and `s`."""
    switched = False
    for pin in range(samples[s].pressed.shape[0]):
        switched |= samples[s].pressed[pin] != samples[s - 1].pressed[pin]
    return switched


@njit
def reverses(s, samples):
    """Whether a contact station began or ceased to stick between samples `s - 1` and `s`: sliding reverses there."""
    changed = False
    for pin in range(samples[s].stuck.shape[0]):
        changed |= samples[s].stuck[pin] != samples[s - 1].stuck[pin]
    return changed


@njit
def on_a_peak(s, least, par, samples, out):
    """Whether a load that decides has a kink about samples `s - 1` and `s` and is near its largest value there.

    `least`: third difference above which there is a kink, as `KINK`.
    """
    n = samples.size
    for measure in range(par.of_measure.shape[0]):
        size = size_of(measure, out.largest, par)
        for j in range(par.of_measure[measure, 0], par.of_measure[measure, 1]):
            i = par.deciding[j]
            m0, m1 = samples[s - 2].loads[i], samples[s - 1].loads[i]
            m2, m3, m4 = samples[s].loads[i], samples[(s + 1) % n].loads[i], samples[(s + 2) % n].loads[i]
            kink = max(abs(m3 - m0 - 3 * (m2 - m1)), abs(m4 - m1 - 3 * (m3 - m2)))
            if kink > least * size and max(m1, m2, m3) > out.largest[i] - REACH * kink:
                return True
    return False


@njit
def extend(load, top, span):
    """Return largest value and range of a curve, formerly `top` and `span`, after adding the value `load`."""
    low = min(top - span, load)
    top = max(top, load)
    return top, top - low


@njit
def height(before, here, ahead):
    """Return the interpolated height of a peak if the middle sample is a local maximum, else that sample."""
    return peak(before, here, ahead) if here >= before and here >= ahead else here


@njit
def count_in(j, fine, par, out):
    """Update the extremes in `out` with sample `j` of the finer integration and the peak at sample `j - 1`, if any."""
    here, before, first = fine[j % 3], fine[(j - 1) % 3], fine[(j - 2) % 3]
    for i in range(here.shape[0]):
        load = here[i]
        if j > 1 and par.interpolated[i] == 1:
            load = max(load, height(first[i], before[i], load))
        if i < out.average.shape[0]:
            out.largest[i], out.range[i] = extend(load, out.largest[i], out.range[i])
        else:
            out.largest[i] = max(out.largest[i], load)


@njit
def recall(s, lane, par, options, samples, motion):
    """Restore recorded sample `s` as the last accepted point of a lane.

    `motion`: record of MOTION. Accelerations are those of BDF2's formula for equal steps.
    """
    h, here, before, first = grid_step(par, options), samples[s], samples[s - 1], samples[s - 2]
    for i in range(motion.q.shape[0]):
        motion.q0[i, lane], motion.v0[i, lane] = here.q[i], here.v[i]
        motion.q1[i, lane], motion.v1[i, lane] = before.q[i], before.v[i]
        motion.a0[i, lane] = (3 * here.v[i] - 4 * before.v[i] + first.v[i]) / (2 * h)
    motion.memory[H_OLD, lane] = h


@njit
def divide(lane, par, options, control, motion):
    """Divide the step of a lane that is integrated again in parts, and choose the rule that takes them.

    `control`, `motion`: records of the batch; ``left`` of `control`: steps left, at most 0 in later steps.
    """
    h, parts = grid_step(par, options), options.peak_substeps
    if control.left[lane] <= 0:
        parts = max(1, parts // FEWER)
    elif control.left[lane] == STEPS and is_sharp(par):
        parts *= MORE
    pin = par.pin[0]
    resolved = h / parts <= LONGEST * math.sqrt(mass_of(pin, par)[0] / stiffness(pin, par)[0])
    control.until[lane], control.grid[lane] = parts, h / parts
    motion.memory[TRAPEZOIDAL, lane] = resolved
    motion.memory[LAST_ITERATION_BELOW, lane] = LAST_ITERATION_FACTOR * options.newton_tol if resolved else 0.0
