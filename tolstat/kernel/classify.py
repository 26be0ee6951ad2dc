"""Class of the motion of a joint that has not settled (`Motion`): what it is, so that it is not averaged away.

In this order: the closure error falls, the joint is still settling; the motion repeats after p revolutions; else a copy
of the joint, set beside it by a small amount, is carried along and brought back to that distance after each revolution:
the mean logarithm of the growth is the largest Lyapunov exponent (Benettin et al. 1980). The input angle is prescribed,
so that no exponent is zero for the time's sake: negative belongs to a motion that repeats, zero to a quasi-periodic and
positive to a chaotic one.
"""

import math

from tolstat.kernel._jit import closure, njit
from tolstat.kernel.integrate import reset
from tolstat.kernel.settle import closure_error, keep, record, summarise
from tolstat.kernel.state import CV_FACTORISED, H_OLD, ITERATIONS
from tolstat.kernel.topology import N_LUMPS
from tolstat.kernel.trail import closure_trend, combine, lag_closure
from tolstat.tables import MAX_ITERATIONS, Motion, Status

PERIODIC, SLOW, SUBHARMONIC = int(Motion.PERIODIC), int(Motion.SLOW), int(Motion.SUBHARMONIC)
QUASI_PERIODIC, CHAOTIC = int(Motion.QUASI_PERIODIC), int(Motion.CHAOTIC)
OK, NOT_SETTLED, NOT_PERIODIC = int(Status.OK), int(Status.NOT_SETTLED), int(Status.NOT_PERIODIC)
FEWEST_REVS = 10
"""Of a joint with less than these no class is told."""
LONGEST_PERIOD = 8
FALLS, CLEARLY, BARELY = 0.1, 10.0, 4.0
"""Fall of log10(closure) over the revolutions kept that counts, at least; in units of its scatter, where it needs no
other sign (closure errors of chaotic joints wander, and fell by four to five times their scatter in some), and where
it needs one."""
APART = 1e-8
"""Distance of the neighbour, m: above what Newton leaves of a step, below the micrometres of a contact."""
REVOLUTIONS, ALIGNING = 16, 4
"""That the neighbour is carried along, and the first of them, in which it turns to the direction that grows."""
EXPONENT = 0.25
"""Size of an exponent (per revolution) that tells it from zero."""


@njit
def set_apart(state, shadow, R):
    """Choose the first difference of the two states: `APART`, in all unknowns."""
    share = APART / math.sqrt(state.q0.size)
    for i in range(state.q0.size):
        lever = 1.0 if i < 6 * N_LUMPS and i % 6 < 3 else R
        shadow.q0[i] = state.q0[i] + (share if i % 2 == 0 else -share) / lever
        shadow.v0[i], shadow.a0[i], shadow.weight[i] = state.v0[i], state.a0[i], state.weight[i]
    reset(shadow)


@njit
def draw_near(state, shadow, factor):
    """Scale the difference of the two states; the neighbour's past follows from the joint's and from it."""
    h = state.memory[H_OLD]
    for i in range(state.q0.size):
        dq, dv = factor * (shadow.q0[i] - state.q0[i]), factor * (shadow.v0[i] - state.v0[i])
        da = factor * (shadow.a0[i] - state.a0[i])
        shadow.q0[i], shadow.v0[i], shadow.a0[i] = state.q0[i] + dq, state.v0[i] + dv, state.a0[i] + da
        shadow.q1[i] = state.q1[i] + dq - h * (dv - 0.5 * h * da)
        shadow.v1[i] = state.v1[i] + dv - h * da
        shadow.a1[i], shadow.aux[i] = state.a1[i] + da, state.aux[i] + da
    shadow.memory[H_OLD] = h


@njit
def distance(state, shadow, h, R):
    """Distance of two states, m: positions, and what their speeds add in a step; rotations at the radius R."""
    square = 0.0
    for i in range(state.q0.size):
        lever = 1.0 if i < 6 * N_LUMPS and i % 6 < 3 else R
        dq, dv = shadow.q0[i] - state.q0[i], h * (shadow.v0[i] - state.v0[i])
        square += lever * lever * (dq * dq + dv * dv)
    return math.sqrt(square)


def build_classify(advance):
    """Bind a stepping scheme; returns a jitted function (par, options, work, state, ring, out) -> status.

    It writes ``motion``, ``period`` and ``closure_trend``, and the statistics of the revolutions that count.
    """

    @closure
    def revolution(begin, par, options, work, one, ring, recorded):
        n = options.steps_per_rev
        h = 2 * math.pi / (abs(par.omega) * n)
        one.memory[CV_FACTORISED] = 0.0  # the tangent at hand is the other one's
        for k in range(begin + 1, begin + n + 1):
            if not advance((k - 1) * h, h, par, options, work, one):
                return False
            if recorded:
                record(k, 0, True, par, work, one.v0, ring.samples)
                keep(k, ring)
            if one.counters[ITERATIONS] > MAX_ITERATIONS * n * (options.max_revs + REVOLUTIONS):
                return False
        return True

    @closure
    def exponent(par, options, work, state, ring):
        n, shadow = options.steps_per_rev, ring.shadow
        h = 2 * math.pi / (abs(par.omega) * n)
        set_apart(state, shadow, par.R)
        growth, factor = 0.0, 1.0
        for r in range(REVOLUTIONS):
            draw_near(state, shadow, factor)
            begin = (options.max_revs + r) * n
            for i, one in enumerate((state, shadow)):
                if not revolution(begin, par, options, work, one, ring, i == 0):
                    return math.nan
            apart = max(distance(state, shadow, h, par.R), APART * 1e-6)
            factor = APART / apart
            if r >= ALIGNING:
                growth -= math.log(factor)
        return growth / (REVOLUTIONS - ALIGNING)

    @closure
    def repeats(last, longest, options, ring, out):
        for lag in range(2, longest + 1):
            if lag_closure(last, lag, ring.trail) <= options.settle_tol:
                out.motion, out.period = SUBHARMONIC, lag
                combine(last, lag, ring.trail, out)
                return True
        return False

    @closure
    def classify(par, options, work, state, ring, out):
        kept = min(ring.trail.revolution.size, options.max_revs // 2)
        slope, scatter = closure_trend(options.max_revs - kept, ring.trail.notes)
        out.closure_trend = slope
        if options.max_revs < FEWEST_REVS:
            return NOT_SETTLED
        fall = -slope * kept
        longest, last = min(LONGEST_PERIOD, kept - 1), options.max_revs - 1
        if fall > max(FALLS, CLEARLY * scatter):
            out.motion = SLOW
            return NOT_SETTLED
        if repeats(last, longest, options, ring, out):
            return NOT_PERIODIC
        growth = exponent(par, options, work, state, ring)
        state.counters[ITERATIONS] += ring.shadow.counters[ITERATIONS]
        if not abs(growth) < 1e300:
            return NOT_SETTLED
        last += REVOLUTIONS
        out.lyapunov, out.revolutions = growth, last + 1
        out.closure = closure_error(ring.samples)
        if growth < -EXPONENT and out.closure <= options.settle_tol:  # settled since
            out.motion, out.period = PERIODIC, 1
            summarise(ring.samples, out)
            return OK
        if growth < -EXPONENT and repeats(last, longest, options, ring, out):
            return NOT_PERIODIC
        if growth < -EXPONENT or (growth < EXPONENT and fall > max(FALLS, BARELY * scatter)):
            out.motion = SLOW
            summarise(ring.samples, out)
            return NOT_SETTLED
        out.motion = CHAOTIC if growth > EXPONENT else QUASI_PERIODIC
        combine(last, kept, ring.trail, out)
        return NOT_PERIODIC

    return classify
