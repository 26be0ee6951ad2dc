"""Closer look: finer integration of load peaks at which a contact switches.

When a contact opens or closes, the bodies ring at kilohertz. The steps of the output grid do not resolve the ringing,
and need not: it decays within a few degrees. On top of a load's peak, however, it decides the largest load. There the
step with the switch and the next one are integrated again in smaller parts, from the recorded motion; in place of BDF2,
which damps the ringing, by the trapezoidal rule. The parts count among the largest and smallest loads; the recorded
samples stay as they are.
"""

import math

from tolstat.kernel.integrators.integrate import BDF2
from tolstat.kernel.integrators.state import ATTEMPTS_LEFT, H_OLD, TRAPEZOIDAL, UNLIMITED
from tolstat.kernel.mechanics.loads import (
    DECIDING,
    INTERPOLATED,
    N_AVERAGED,
    N_INSTANT,
    N_MEASURES,
    OF_MEASURE,
    size_of,
)
from tolstat.kernel.mechanics.vector import copy
from tolstat.kernel.revolution.settle import peak, record
from tolstat.kernel.simd.jit import njit, njit_inner

NEAR = 0.01
"""Distance of a load from its largest value, in units of its measure, that ringing may bridge."""
KINK = 5e-4
"""Third difference of a load's samples, in the units of `NEAR`, up to which ringing is too weak to bridge that
distance."""
STEPS = 2
"""Steps of the grid that are integrated again: the one in which the contact switches, and the next."""


@njit
def switches(s, samples):
    """Whether any contact station opened or closed between samples `s - 1` and `s`."""
    switched = False
    for pin in range(4):
        switched |= samples[s].pressed[pin] != samples[s - 1].pressed[pin]
    return switched


@njit
def on_a_peak(s, samples, out):
    """Whether a load that decides has a kink between samples `s - 1` and `s` and is near its largest value there."""
    n = samples.size
    for measure in range(N_MEASURES):
        size = size_of(measure, out.largest)
        for j in range(OF_MEASURE[measure, 0], OF_MEASURE[measure, 1]):
            i = DECIDING[j]
            m0, m1 = samples[s - 2].loads[i], samples[s - 1].loads[i]
            m2, m3, m4 = samples[s].loads[i], samples[(s + 1) % n].loads[i], samples[(s + 2) % n].loads[i]
            kink = max(abs(m3 - m0 - 3 * (m2 - m1)), abs(m4 - m1 - 3 * (m3 - m2)))
            if max(m1, m2, m3) > out.largest[i] - NEAR * size and kink > KINK * size:
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
def count_in(j, fine, out):
    """Update the extremes in `out` with sample `j` of the finer integration and the peak at sample `j - 1`, if any."""
    here, before, first = fine[j % 3], fine[(j - 1) % 3], fine[(j - 2) % 3]
    for i in range(N_INSTANT):
        load = here.loads[i]
        if j > 1 and INTERPOLATED[i]:
            load = max(load, height(first.loads[i], before.loads[i], load))
        if i < N_AVERAGED:
            out.largest[i], out.range[i] = extend(load, out.largest[i], out.range[i])
        else:
            out.largest[i] = max(out.largest[i], load)


@njit
def recall(s, h, state, samples):
    """Restore recorded sample `s` as the last accepted point; `h` is the step of the output grid, s.

    Accelerations are those of BDF2's formula for equal steps; other methods need those of the equations of motion.
    """
    here, before, first = samples[s], samples[s - 1], samples[s - 2]
    for i in range(state.q0.size):
        state.q0[i], state.v0[i] = here.q[i], here.v[i]
        state.q1[i], state.v1[i] = before.q[i], before.v[i]
        state.a0[i] = (3 * here.v[i] - 4 * before.v[i] + first.v[i]) / (2 * h)
        state.a1[i] = state.aux[i] = state.a0[i]
    state.memory[:] = 0.0
    state.memory[H_OLD], state.counters[ATTEMPTS_LEFT] = h, UNLIMITED
    state.memory[TRAPEZOIDAL] = 1.0


def build_closeup(advance, acceleration):
    """Bind a stepping scheme and the equations of motion.

    Parameters
    ----------
    advance : jitted function
        As `integrate.build_advance` returns it.
    acceleration : jitted function (t, q, v, par, options, work, out) -> None
        Writes the accelerations that meet the equations of motion.

    Returns
    -------
    look_closer : jitted function (par, options, work, state, samples, fine, out) -> None
        Integrates the steps around switches on peaks of the recorded revolution again, each in
        ``options.peak_substeps`` parts, and extends the extremes in `out`, a row of KERNEL_RESULT. The work is added to
        ``state.counters``.
    """

    @njit_inner
    def look_closer(par, options, work, state, samples, fine, out):
        n = samples.size
        h = 2 * math.pi / (abs(par.omega) * n)
        part = h / options.peak_substeps
        left = j = 0
        for k in range(n + 1):
            if k < n and switches(k, samples) and on_a_peak(k, samples, out):
                if left == 0:
                    recall(k - 1, h, state, samples)
                    if options.method != BDF2:
                        acceleration((n + k - 1) * h, state.q0, state.v0, par, options, work, state.a0)
                        copy(state.a0, state.a1)
                        copy(state.a0, state.aux)
                    j = 0
                left = STEPS
            if left == 0:
                continue
            left -= 1
            for i in range(options.peak_substeps):
                if not advance((n + k - 1) * h + i * part, part, par, options, work, state):
                    left = 0
                    break
                record(j, 0, par, work, state.v0, fine)
                count_in(j, fine, out)
                j += 1

    return look_closer
