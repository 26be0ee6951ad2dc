"""Which joints are simulated, when they have settled, and how their results are written (docs/model.md, Results)."""

import math

import numpy as np

from tolstat.common.tables import MAX_ITERATIONS, MAX_SHIFT, MAX_TILT
from tolstat.kernel.codes import DYNAMIC, NEWTON_FAILED, NOT_SETTLED, OK
from tolstat.kernel.mechanics.triad import from_triad
from tolstat.kernel.mechanics.vector import dot, row
from tolstat.kernel.revolution.settle import ALL_LOADS, closure_error, step_error
from tolstat.kernel.revolution.trail import closure_trend, note_closure, with_slow_decay
from tolstat.kernel.simd.jit import njit

CHECKS_PER_REV = 12
"""Checks of the closure error per revolution, from the second one on."""
EARLY_CLOSURE, EARLY_STEP_ERROR = 0.2, 0.02
"""A smooth joint has settled in its second revolution once the later half of what it has repeated of the first one is
the same: it has forgotten its start. The first number is the closure error there, in units of ``settle_tol``, the
second the step error, up to which that holds (docs/notes/steps.md)."""


@njit
def is_near(body, point, axis, par):
    """Whether the axis of a pin or hole, vectors `point` and `axis`, is near its ideal one; a NaN is not."""
    e = from_triad(body, (1.0, 0.0, 0.0), par)
    return dot(point, point) <= (MAX_SHIFT * par.R) ** 2 and dot(axis, e) >= math.cos(MAX_TILT)


@njit
def bears(kind, par):
    """Whether the stations of a kind of pair stiffen under load, as those of the model do."""
    good, stiff = par.needle_b[kind] >= 0, False
    for j in range(par.n_stations[kind]):
        k1, k2, k3 = par.station_k1[kind, j], par.station_k2[kind, j], par.station_k3[kind, j]
        good = good and k1 >= 0 and k2 >= 0 and k3 >= 0 and (par.needle_b[kind] > 0 or k3 == 0)
        stiff = stiff or k2 > 0 or k3 > 0
    return good and stiff


@njit
def inside_model(par):
    """Whether a joint lies within the scope of the model; written so that NaN does not."""
    good = 0 < abs(par.omega) < 1e300 and abs(par.torque) < 1e300
    for joint in range(par.alpha.shape[0]):
        good = good and abs(par.alpha[joint]) < 0.5 * math.pi
    swing = 0.0
    for i in range(par.n_orders):
        swing += par.order[i] * math.hypot(par.speed_order[i, 0], par.speed_order[i, 1])
        good = good and math.hypot(par.torque_order[i, 0], par.torque_order[i, 1]) < 1e300
    good = good and swing < 1
    for kind in range(par.k.shape[0]):
        total = 0.0
        for k in range(6):
            total += par.k[kind, k]
        good = good and total > 0
    for kind in range(par.n_stations.shape[0]):
        good = good and bears(kind, par) and par.mu[kind] >= 0 and par.face_k[kind] >= 0
    for face in range(par.face_pair.shape[0]):
        good = good and abs(par.face_at[face, 1] - par.face_at[face, 0]) <= MAX_SHIFT * par.R
    for pin in range(par.pin.shape[0]):
        good = good and 0 <= par.clearance[pin] <= MAX_SHIFT * par.R
        good = good and is_near(par.pin[pin], row(par.pin_point, pin), row(par.pin_axis, pin), par)
        good = good and is_near(par.hole[pin], row(par.hole_point, pin), row(par.hole_axis, pin), par)
    return good


@njit
def clear_results(out):
    """Reset a row of KERNEL_RESULT: NaN in what may not be computed, zero in the counters."""
    nan = np.nan
    out.settled, out.steps, out.newton_iterations, out.halvings, out.factorisations = 0, 0, 0, 0, 0
    out.period, out.failed_step = 0, -1
    out.closure = out.closure_trend = out.failed_theta = out.revolutions = nan
    out.step_error = out.refinement_change = nan
    for i in range(out.largest.shape[0]):
        out.largest[i] = nan
    for i in range(out.average.shape[0]):
        out.average[i] = out.range[i] = nan
    for pin in range(out.mode_share.shape[0]):
        for k in range(out.mode_share.shape[1]):
            out.mode_share[pin, k] = nan
        out.equivalent_load[pin] = out.tilt[pin] = out.line_load[pin] = nan


@njit
def clear_samples(samples, notes):
    """Reset samples and notes for another joint."""
    for s in range(samples.size):
        for i in range(samples[s].loads.shape[0]):
            samples[s].loads[i] = np.nan
        samples[s].s = np.nan
    notes.count = 0


@njit
def is_smooth(par, samples, out):
    """Whether the step error of a joint, written to `out` when this is first asked, lets it settle early."""
    if not out.step_error >= 0:
        out.step_error = step_error(par, samples)
    return out.step_error <= EARLY_STEP_ERROR


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
        As in all kernels; the closure error is noted.
    out : record of KERNEL_RESULT
        ``closure`` and ``revolutions`` are written, and in the second revolution ``step_error``.
    """
    n = options.steps_per_rev
    due = (k * CHECKS_PER_REV) % n < CHECKS_PER_REV
    out.revolutions = k / n
    if due and n < k < 2 * n and is_smooth(par, samples, out):
        first, last = (k - n) // 2 + 1, k - n + 1
        closure = closure_error(first, last, ALL_LOADS, par, samples)
        out.closure = with_slow_decay(closure, out.revolutions, par, notes)
        if out.closure <= EARLY_CLOSURE * options.settle_tol:
            return OK
    if due and k >= 2 * n:
        closure = closure_error(0, n, ALL_LOADS, par, samples)
        note_closure(out.revolutions, closure, notes)
        out.closure = with_slow_decay(closure, out.revolutions, par, notes)
        if out.closure <= options.settle_tol:
            return OK
    return NEWTON_FAILED if iterations > MAX_ITERATIONS * n * options.max_revs else NOT_SETTLED


@njit
def is_finite(out):
    """Whether the statistics of the bushing loads of a joint are finite."""
    good = True
    for i in range(out.average.shape[0]):
        good = good and out.largest[i] < 1e300 and out.average[i] < 1e300
    return good


@njit
def finish(status, failed, steps_per_rev, options, out):
    """Write how a joint ended; one without results is reset, with its failed step and angle.

    `failed` is the step of the output grid at which the joint failed, -1 if at none; `steps_per_rev` counts those of
    the last revolution.
    """
    if status not in (OK, NOT_SETTLED):
        clear_results(out)
        if failed > 0:
            out.failed_step = failed
            out.failed_theta = 2 * math.pi * ((failed - 1) % options.steps_per_rev) / options.steps_per_rev
    out.status, out.settled, out.steps_per_rev = status, status == OK, steps_per_rev


@njit
def write_diagnostics(status, par, options, notes, samples, out):
    """Write step error, closure trend and period, unless steps are error-controlled.

    The closure trend of a joint that has not settled is fitted over the second half of ``max_revs``.
    """
    if options.fidelity == DYNAMIC and not (out.step_error >= 0 and out.revolutions < 2):  # see `is_smooth`
        out.step_error = step_error(par, samples)
    since = 0.0 if status == OK else 0.5 * options.max_revs
    out.closure_trend, _ = closure_trend(since, notes)
    if status == OK:
        out.period = 1
