"""One joint from its start to a settled, recorded revolution (model, section 7)."""

import math
from typing import NamedTuple

import numpy as np

from tolstat.kernel import dynamics, integrate, linsolve, tangent
from tolstat.kernel._jit import njit
from tolstat.kernel.equilibrium import build_equilibrium
from tolstat.kernel.settle import Ring, closure_error, make_ring, record, summarise
from tolstat.kernel.state import HALVINGS, ITERATIONS, STEPS, State, make_state
from tolstat.kernel.topology import N_DOF, N_LUMPS, PSI
from tolstat.kernel.work import make_work
from tolstat.tables import Options, Start, Status

OK, NOT_SETTLED, NEWTON_FAILED = int(Status.OK), int(Status.NOT_SETTLED), int(Status.NEWTON_FAILED)
NOT_FINITE, OUTSIDE_MODEL = int(Status.NOT_FINITE), int(Status.OUTSIDE_MODEL)
RAMP = int(Start.RAMP)
CHECKS_PER_REV = 12
"""How often a revolution the closure error is looked at, once two revolutions are recorded."""
MAX_ITERATIONS = 40
"""Bound on the work of a joint, in Newton iterations per step of the longest run allowed: no joint can hang a
campaign. Joints that never settle take some 8 to 10."""
SMALLEST_FORCE = 1e-3
"""Scale (N) of the stopping test of a joint that neither turns nor carries."""

residual, acceleration = dynamics.residual, dynamics.acceleration
assemble, eliminate, solve = tangent.assemble, linsolve.factorise, linsolve.solve


@njit
def factorise(t, q, v, a, cv, ca, par, options, work):
    """Tangent at the state that the residual was last evaluated at, factorised."""
    assemble(cv, ca, par, work)
    return eliminate(work)


newton, advance = integrate.build_integrator(residual, factorise, solve)
equilibrium = build_equilibrium(residual, newton, integrate.scaled_size)
reset = integrate.reset


@njit
def inside_model(par):
    """Whether the model has a meaning for a joint; written so that NaN has none."""
    good = abs(par.alpha) < 0.5 * math.pi and 0 < abs(par.omega) < 1e300 and abs(par.torque) < 1e300
    good = good and par.k_cross[0] > 0 and par.k_fork[0] > 0 and par.k2u > 0 and par.k2p > 0
    for pin in range(4):
        good = good and par.clearance[pin] >= 0
    return good


@njit
def set_scale(par, state):
    """Scale of the residuals: the pins' tangential force T_r/(2R) or a pin's centrifugal force, times R for torques."""
    force = max(abs(par.torque) / (2 * par.R), par.pin_mass * par.omega**2 * par.R, SMALLEST_FORCE)
    for body in range(N_LUMPS):
        for k in range(3):
            state.scale[6 * body + k] = force
            state.scale[6 * body + 3 + k] = force * par.R
    state.scale[PSI] = force * par.R


@njit
def clear_results(out):
    """NaN in everything that may not be computed."""
    nan = np.nan
    out.settled, out.steps, out.newton_iterations, out.halvings = 0, 0, 0, 0
    out.closure = out.revolutions = out.psi_max = nan
    for b in range(8):
        out.F_max[b] = out.F_mean[b] = out.F_range[b] = nan
        out.T_max[b] = out.T_mean[b] = out.T_range[b] = nan
    for pin in range(4):
        for k in range(2):
            out.contact_max[pin, k] = nan
        for k in range(4):
            out.mode_share[pin, k] = nan


@njit
def run(par, options, work, state, ring, out):
    """Integrate until settled; return a status. ``out.closure`` and ``out.revolutions`` are written."""
    if not inside_model(par):
        return OUTSIDE_MODEL
    set_scale(par, state)
    state.q0[:] = 0.0
    state.v0[:] = 0.0
    state.a0[:] = 0.0
    reset(state)
    if options.start == RAMP:
        acceleration(0.0, state.q0, state.v0, par, options, work, state.a0)
    else:
        equilibrium(par, options, work, state)
    iterations = state.counters[ITERATIONS]
    reset(state)
    state.counters[ITERATIONS] = iterations

    n = options.steps_per_rev
    h = 2 * math.pi / (abs(par.omega) * n)
    ring.modulus[:] = np.nan
    for k in range(1, options.max_revs * n + 1):
        if not advance((k - 1) * h, h, par, options, work, state):
            return NEWTON_FAILED
        record(k, par, work, state, ring)
        out.revolutions = k / n
        if k >= 2 * n and (k * CHECKS_PER_REV) % n < CHECKS_PER_REV:
            out.closure = closure_error(ring)
            if out.closure <= options.settle_tol:
                return OK
        if state.counters[ITERATIONS] > MAX_ITERATIONS * n * options.max_revs:
            return NEWTON_FAILED
    return NOT_SETTLED


@njit
def simulate_joint(par, options, work, state, ring, out):
    """Simulate one joint.

    Parameters
    ----------
    par : record of PARAM
        The joint.
    options : Options
        Numerical settings.
    work, state : record of WORK, State
        Scratch; nothing is carried over from one joint to the next.
    ring : Ring
        Samples of the last revolution.
    out : record of RESULT
        Written: status, and NaN in what was not computed.
    """
    clear_results(out)
    status = run(par, options, work, state, ring, out)
    if status in (OK, NOT_SETTLED):
        summarise(ring, out)
        for b in range(8):
            if not (out.F_max[b] < 1e300 and out.T_max[b] < 1e300):
                status = NOT_FINITE
    if status not in (OK, NOT_SETTLED):
        clear_results(out)
    out.status = status
    out.settled = status == OK
    out.steps = state.counters[STEPS]
    out.newton_iterations = state.counters[ITERATIONS]
    out.halvings = state.counters[HALVINGS]


class Scratch(NamedTuple):
    """Everything a process needs to simulate one joint after the other."""

    work: np.record
    state: State
    ring: Ring


def make_scratch(options: Options) -> Scratch:
    """Allocate the work arrays of a process."""
    return Scratch(make_work(), make_state(N_DOF), make_ring(options.steps_per_rev))
