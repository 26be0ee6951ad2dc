"""Simulation of one joint from its start to a settled, recorded revolution (docs/model.md, Results)."""

import math
from typing import NamedTuple

import numpy as np

from tolstat.common.tables import MAX_ITERATIONS, Fidelity, Options, Start, Status
from tolstat.kernel.integrators import integrate
from tolstat.kernel.integrators.mesh import parts_of
from tolstat.kernel.integrators.state import (
    AHEAD,
    ALLOWED,
    FACTORISATIONS,
    HALVINGS,
    ITERATIONS,
    STEPS,
    make_state_record,
)
from tolstat.kernel.mechanics import dynamics, linsolve, tangent
from tolstat.kernel.mechanics.guess import rigid_guess
from tolstat.kernel.mechanics.ideal_loads import ideal_loads
from tolstat.kernel.mechanics.loads import DECIDING, N_AVERAGED, N_LOADS
from tolstat.kernel.mechanics.scale import set_weight, typical_force
from tolstat.kernel.mechanics.topology import N_DOF
from tolstat.kernel.mechanics.work import make_work
from tolstat.kernel.revolution.adaptive import build_resolve
from tolstat.kernel.revolution.closeup import build_closeup
from tolstat.kernel.revolution.equilibrium import CA_REGULAR, CV_REGULAR, build_equilibrium, near
from tolstat.kernel.revolution.quasistatic import angle_time, build_quasistatic, speed_ratios
from tolstat.kernel.revolution.resolve import Past, follows_error, make_past
from tolstat.kernel.revolution.settle import (
    ALL_LOADS,
    OWN,
    Ring,
    closure_error,
    grid_step,
    make_ring,
    predict_increment,
    record,
    step_error,
    summarise,
)
from tolstat.kernel.revolution.trail import closure_trend, note_closure, with_slow_decay
from tolstat.kernel.simd.jit import njit

OK, NOT_SETTLED, NEWTON_FAILED = int(Status.OK), int(Status.NOT_SETTLED), int(Status.NEWTON_FAILED)
AGAIN_ALONE = int(Status.PENDING)
"""Status of a joint that lanes leave to be simulated again, alone."""
NOT_FINITE, OUTSIDE_MODEL = int(Status.NOT_FINITE), int(Status.OUTSIDE_MODEL)
RAMP = int(Start.RAMP)
DYNAMIC, QUASISTATIC, IDEAL = int(Fidelity.DYNAMIC), int(Fidelity.QUASISTATIC), int(Fidelity.IDEAL)
CHECKS_PER_REV = 12
"""Checks of the closure error per revolution, once two revolutions are recorded."""
EARLY_CLOSURE, EARLY_SUMS, EARLY_STEP_ERROR = 0.1, 0.2, 0.02
"""A joint whose motion at one twelfth to two twelfths of a revolution is repeated a revolution later has settled: the
start is forgotten within the first twelfth. The first number is the closure error of bushing loads there, in units of
``settle_tol``, the second that of all loads, since a shaft carries the sum of two of them, the third the step error, up
to which that holds. Of 12 000 joints none was settled by bushing loads alone that would not have been at the end of the
second revolution (docs/notes/steps.md)."""

residual, acceleration = dynamics.residual, dynamics.acceleration
assemble, eliminate, solve = tangent.assemble, linsolve.factorise, linsolve.solve


@njit
def factorise(t, q, v, a, cv, ca, par, options, work):
    """Assemble and factorise the tangent at the state of the last residual, see `integrate.build_integrator`."""
    assemble(cv, ca, cv, par, work)
    return eliminate(work)


@njit
def factorise_static(t, q, v, a, cv, ca, par, options, work):
    """Assemble and factorise the regularised tangent of an equilibrium."""
    assemble(CV_REGULAR, CA_REGULAR, 0.0, par, work)
    return eliminate(work)


newton = integrate.build_newton(residual, factorise, solve)
advance = integrate.build_advance(newton)
static_newton = integrate.build_newton(residual, factorise_static, solve, small=near)
hold, relax, equilibrium = build_equilibrium(residual, newton, static_newton, integrate.scaled_size, rigid_guess)
revolution = build_quasistatic(hold, relax, record)
look_closer = build_closeup(advance, acceleration)
reset = integrate.reset


@njit
def inside_model(par):
    """Whether a joint lies within the scope of the model; written so that NaN does not."""
    good = abs(par.alpha) < 0.5 * math.pi and 0 < abs(par.omega) < 1e300 and abs(par.torque) < 1e300
    swing = 0.0
    for i in range(par.n_orders):
        swing += par.order[i] * math.hypot(par.speed_order[i, 0], par.speed_order[i, 1])
        good = good and math.hypot(par.torque_order[i, 0], par.torque_order[i, 1]) < 1e300
    good = good and swing < 1
    good = good and par.k_cross[0] > 0 and par.k_fork[0] > 0
    good = good and par.needle_b >= 0
    bears = False
    for j in range(par.n_stations):
        good = good and par.station_k1[j] >= 0 and par.station_k2[j] >= 0 and par.station_k3[j] >= 0
        good = good and (par.needle_b > 0 or par.station_k3[j] == 0)
        bears = bears or par.station_k2[j] > 0 or par.station_k3[j] > 0
    good = good and bears
    for pin in range(4):
        good = good and par.clearance[pin] >= 0
    return good


@njit
def clear_results(out):
    """Reset a row of KERNEL_RESULT: NaN in what may not be computed, zero in the counters."""
    nan = np.nan
    out.settled, out.steps, out.newton_iterations, out.halvings, out.factorisations = 0, 0, 0, 0, 0
    out.period, out.failed_step = 0, -1
    out.closure = out.closure_trend = out.failed_theta = out.revolutions = nan
    out.step_error = out.refinement_change = nan
    for i in range(N_LOADS):
        out.largest[i] = nan
    for i in range(N_AVERAGED):
        out.average[i] = out.range[i] = nan
    for pin in range(4):
        for k in range(4):
            out.mode_share[pin, k] = nan
        out.equivalent_load[pin] = nan


@njit
def clear(par, state, samples, notes):
    """Reset state, samples and notes for another joint."""
    set_weight(typical_force(par), par, state.weight)
    state.q0[:] = 0.0
    state.v0[:] = 0.0
    state.a0[:] = 0.0
    reset(state)
    for s in range(samples.size):
        for i in DECIDING:
            samples[s].loads[i] = np.nan
        samples[s].s = np.nan
    notes.count = 0


@njit
def run(par, options, alone, out):
    """Simulate a joint at the fidelity of `options`; fill the ring; return a status.

    ``out.closure`` and ``out.revolutions`` are written, and ``out.failed_step`` if a step failed.
    """
    work, state, ring, past = alone
    if not inside_model(par):
        return OUTSIDE_MODEL
    clear(par, state, ring.samples, ring.notes)
    if options.fidelity == IDEAL:
        return run_ideal(par, work, state, ring, out)
    if options.fidelity == QUASISTATIC:
        return run_quasistatic(par, options, work, state, ring, out)
    if follows_error(options):
        return resolve(par, options, work, state, ring, past, out)
    return run_dynamic(par, options, work, state, ring, out)


@njit
def run_ideal(par, work, state, ring, out):
    """Fill the ring with the loads of the ideal joint."""
    n = ring.samples.size
    for k in range(n):
        ideal_loads(math.copysign(2 * math.pi * k / n, par.omega), par, state, work)
        record(k, 0, par, work, state.v0, ring.samples)
    out.closure, out.revolutions = 0.0, 1.0
    state.counters[STEPS] = n
    return OK


@njit
def run_quasistatic(par, options, work, state, ring, out):
    """Solve quasi-static revolutions until one ends where it began; return a status."""
    n = ring.samples.size
    equilibrium(angle_time(0, n, par), par, options, work, state)
    for revolutions in range(options.max_revs):
        if not revolution(revolutions == 0, par, options, work, state, ring):
            return NEWTON_FAILED
        out.closure, out.revolutions = closure_error(0, 1, ALL_LOADS, ring.samples), revolutions + 1.0
        if out.closure <= options.settle_tol:
            break
        if state.counters[ITERATIONS] > MAX_ITERATIONS * n * options.max_revs:
            return NEWTON_FAILED
    speed_ratios(par, ring.samples)
    return OK if out.closure <= options.settle_tol else NOT_SETTLED


@njit
def begin(par, options, work, state):
    """Initialise a joint at theta = 0: in the ideal pose for a torque ramp, else in static equilibrium."""
    if options.start == RAMP:
        acceleration(0.0, state.q0, state.v0, par, options, work, state.a0)
    else:
        equilibrium(0.0, par, options, work, state)
    iterations, factorisations = state.counters[ITERATIONS], state.counters[FACTORISATIONS]
    reset(state)
    state.counters[ITERATIONS], state.counters[FACTORISATIONS] = iterations, factorisations


resolve = build_resolve(newton, begin)


@njit
def check_settled(k, iterations, par, options, samples, notes, out):
    """Check closure error and work at grid point `k`; return `NOT_SETTLED` while the joint is to continue.

    Parameters
    ----------
    k : int
        Number of the grid point, counted from the start.
    iterations : int
        Newton iterations so far.
    par : record of PARAM
        The joint.
    options : Options
        Numerical settings.
    samples, notes
        As in `settle.Ring`; the closure error is noted.
    out : record of KERNEL_RESULT
        ``closure`` and ``revolutions`` are written.
    """
    n, twelfth = options.steps_per_rev, options.steps_per_rev // CHECKS_PER_REV
    out.revolutions = k / n
    if k == n + 2 * twelfth:
        first, last, bound = twelfth + 1, 2 * twelfth + 1, options.settle_tol
        own, closure = closure_error(first, last, OWN, samples), closure_error(first, last, ALL_LOADS, samples)
        out.closure = with_slow_decay(closure, out.revolutions, par, notes)
        small = with_slow_decay(own, out.revolutions, par, notes) <= EARLY_CLOSURE * bound
        small = small and out.closure <= EARLY_SUMS * bound
        if small and step_error(par, samples) <= EARLY_STEP_ERROR:
            return OK
    if k >= 2 * n and (k * CHECKS_PER_REV) % n < CHECKS_PER_REV:
        closure = closure_error(0, n, ALL_LOADS, samples)
        note_closure(out.revolutions, closure, notes)
        out.closure = with_slow_decay(closure, out.revolutions, par, notes)
        if out.closure <= options.settle_tol:
            return OK
    return NEWTON_FAILED if iterations > MAX_ITERATIONS * n * options.max_revs else NOT_SETTLED


@njit
def run_dynamic(par, options, work, state, ring, out):
    """Integrate until settled."""
    begin(par, options, work, state)
    n, h = options.steps_per_rev, grid_step(par, options)
    for k in range(1, options.max_revs * n + 1):
        if not advance((k - 1) * h, h, par, options, work, state):
            out.failed_step = k
            return NEWTON_FAILED
        record(k, 0, par, work, state.v0, ring.samples)
        state.memory[AHEAD] = predict_increment(k, state.q0, state.v0, state.ahead, ring.samples)
        status = check_settled(k, state.counters[ITERATIONS], par, options, ring.samples, ring.notes, out)
        if status == NEWTON_FAILED:
            out.failed_step = k
        if status != NOT_SETTLED:
            return status
    return NOT_SETTLED


@njit
def is_finite(out):
    """Whether the statistics of the bushing loads of a joint are finite."""
    good = True
    for i in range(N_AVERAGED):
        good = good and out.largest[i] < 1e300 and out.average[i] < 1e300
    return good


@njit
def write_counters(status, steps_per_rev, counters, out):
    """Write status, step numbers and counters of a joint that has ended; `steps_per_rev`: of its last revolution."""
    out.status = status
    out.settled = status == OK
    out.steps_per_rev = steps_per_rev
    out.steps, out.newton_iterations = counters[STEPS], counters[ITERATIONS]
    out.halvings, out.factorisations = counters[HALVINGS], counters[FACTORISATIONS]


@njit
def finish(status, failed, steps_per_rev, options, counters, out):
    """Write how a joint ended; one without results is reset, with its failed step and angle.

    `failed` is the step of the output grid at which the joint failed, -1 if at none; `steps_per_rev` counts those of
    the last revolution.
    """
    if status not in (OK, NOT_SETTLED):
        clear_results(out)
        if failed > 0:
            out.failed_step = failed
            out.failed_theta = 2 * math.pi * ((failed - 1) % options.steps_per_rev) / options.steps_per_rev
    write_counters(status, steps_per_rev, counters, out)


@njit
def write_diagnostics(status, par, options, notes, samples, out):
    """Write step error, closure trend and period, unless steps are error-controlled.

    The closure trend of a joint that has not settled is fitted over the second half of ``max_revs``.
    """
    if options.fidelity == DYNAMIC:
        out.step_error = step_error(par, samples)
    since = 0.0 if status == OK else 0.5 * options.max_revs
    out.closure_trend, _ = closure_trend(since, notes)
    if status == OK:
        out.period = 1


@njit
def simulate_joint(par, options, allowed, alone, out):
    """Simulate one joint.

    Parameters
    ----------
    par : record of PARAM
        The joint.
    options : Options
        Numerical settings.
    allowed : int
        Newton iterations at which the joint is given up.
    alone : Scratch
        Work arrays; nothing is carried over from one joint to the next. The ring holds the last revolution.
    out : record of KERNEL_RESULT
        Written: status, and NaN in what was not computed.
    """
    work, state, ring, past = alone
    clear_results(out)
    state.counters[:] = 0
    state.counters[ALLOWED] = allowed
    controlled = follows_error(options)
    status = run(par, options, alone, out)
    failed = out.failed_step
    if status in (OK, NOT_SETTLED) and not controlled:
        summarise(par, ring.samples, out)
        if not is_finite(out):
            status, failed = NOT_FINITE, state.counters[STEPS]
    if status in (OK, NOT_SETTLED) and not controlled:
        write_diagnostics(status, par, options, ring.notes, ring.samples, out)
        if status == OK and options.fidelity == DYNAMIC and options.peak_substeps > 1:
            look_closer(par, options, work, state, ring.samples, ring.fine, out)
    taken = parts_of(past.mesh) if controlled else options.steps_per_rev
    if status in (OK, NOT_SETTLED, NEWTON_FAILED) and state.counters[ITERATIONS] >= allowed:
        status, failed, taken = NEWTON_FAILED, max(1, failed), options.steps_per_rev
    finish(status, failed, taken, options, state.counters, out)


class Scratch(NamedTuple):
    """Work arrays of a process that simulates joints one after the other."""

    work: np.record
    state: np.record
    ring: Ring
    past: Past


def make_scratch(options: Options) -> Scratch:
    """Allocate the work arrays of a process."""
    return Scratch(make_work(), make_state_record(N_DOF), make_ring(options.steps_per_rev), make_past(options))
