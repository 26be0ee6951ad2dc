"""Parts of a joint's simulation, repeated for one joint or for all lanes so that each can be timed separately."""

from tolstat.kernel.lanes.lane_memory import as_lanes
from tolstat.kernel.mechanics.contact import contact_load
from tolstat.kernel.mechanics.topology import N_DOF
from tolstat.kernel.revolution.simulate import assemble, begin, clear, eliminate, residual, rigid_guess, solve
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import fma

RESIDUAL, CONTACT, ASSEMBLY, ELIMINATION, SUBSTITUTION = range(5)
"""Parts for `repeat`: residual with contacts; contacts; tangent; tangent and its factors; a solution with them."""
CHAINS = 10
"""Independent sums in `multiply_add`: as many as keep both multiply-add units of present cores busy."""


@njit
def repeat(part, times, t, cv, ca, motion, par, options, work):
    """Execute a part `times` times at the state ``motion.q``, ``v``, ``a`` of time `t`; cv, ca as from `predict`."""
    residual(t, motion.q, motion.v, motion.a, par, options, work, motion.residual)
    assemble(cv, ca, cv, par, work)
    eliminate(work)
    for _ in range(times):
        if part == RESIDUAL:
            residual(t, motion.q, motion.v, motion.a, par, options, work, motion.residual)
        elif part == CONTACT:
            for pin in range(4):
                contact_load(pin, par, work)
        elif part == ASSEMBLY:
            assemble(cv, ca, cv, par, work)
        elif part == ELIMINATION:
            assemble(cv, ca, cv, par, work)
            eliminate(work)
        else:
            for i in range(N_DOF):
                work.solution[i] = -motion.residual[i]
            solve(motion.q, work)


@njit
def repeat_in_lanes(part, times, options, batch):
    """Execute `repeat` for all lanes of `batch` at once, at their motion and control."""
    par, work, motion = as_lanes(batch.par), as_lanes(batch.work), as_lanes(batch.motion)
    control = as_lanes(batch.control)
    repeat(part, times, control.t, control.cv, control.ca, motion, par, options, work)


@njit
def start(rows, options, alone):
    """Compute the initial state of every joint of `rows`."""
    work, state, ring, _ = alone
    for i in range(len(rows)):
        clear(rows[i], state, ring.samples, ring.notes)
        begin(rows[i], options, work, state)


@njit
def guess(rows, alone):
    """Compute the rigid-body guess of every joint of `rows`, the part of the start that is not done in lanes."""
    work, state, ring, _ = alone
    for i in range(len(rows)):
        clear(rows[i], state, ring.samples, ring.notes)
        rigid_guess(0.0, rows[i], work, state)


@njit
def multiply_add(times, batch):
    """Do `times` fused multiply-adds in each of `CHAINS` independent lane registers: measures the core's peak rate."""
    motion = as_lanes(batch.motion)
    x, y = motion.q[0], motion.q[1]
    a, b, c, d, e = motion.v[0], motion.v[1], motion.v[2], motion.v[3], motion.v[4]
    f, g, h, i, j = motion.v[5], motion.v[6], motion.v[7], motion.v[8], motion.v[9]
    for _ in range(times):
        a, b, c, d, e = fma(a, x, y), fma(b, x, y), fma(c, x, y), fma(d, x, y), fma(e, x, y)
        f, g, h, i, j = fma(f, x, y), fma(g, x, y), fma(h, x, y), fma(i, x, y), fma(j, x, y)
    motion.a[0] = a + b + c + d + e + f + g + h + i + j
