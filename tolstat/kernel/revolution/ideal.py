"""The ideal joint over a revolution, in closed form (`mechanics.ideal_loads`)."""

import math

from tolstat.kernel.cardan.ideal_loads import ideal_loads
from tolstat.kernel.codes import NOT_FINITE, OK, OUTSIDE_MODEL
from tolstat.kernel.mechanics.loads import complete_loads, write_loads
from tolstat.kernel.revolution.outcome import clear_results, clear_samples, finish, inside_model, is_finite
from tolstat.kernel.revolution.settle import record, summarise
from tolstat.kernel.simd.jit import njit


@njit
def ideal_revolution(par, options, at_rest, work, samples, notes, out):
    """Write loads and results of the ideal joint.

    Parameters
    ----------
    par, options, work, samples, notes, out
        As in all kernels.
    at_rest : ndarray, shape (56,)
        Zeros.
    """
    clear_results(out)
    if not inside_model(par):
        finish(OUTSIDE_MODEL, -1, options.steps_per_rev, options, out)
        return
    clear_samples(samples, notes)
    n = samples.size
    for k in range(n):
        ideal_loads(math.copysign(2 * math.pi * k / n, par.omega), at_rest, par, work)
        write_loads(at_rest, par, work)
        complete_loads(par, work)
        record(k, 0, par, work, samples)
    out.closure, out.revolutions, out.period, out.steps = 0.0, 1.0, 1, n
    summarise(par, samples, out)
    finish(OK if is_finite(out) else NOT_FINITE, n, n, options, out)
