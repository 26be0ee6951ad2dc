"""Flutter of the contacts: motions that settle at the steps taken and in truth do not.

The law ``mode`` is not the gradient of a potential: the force of one end of a pin changes with the penetration of the
other in another way than the reverse. Where contact damping does not hold that, pin and arm flutter at 5 to 50 kHz,
which the method damps at any step that a revolution needs. So it is looked for where it begins: in the eigenvalues of
the equations of motion, linearised about the recorded revolution.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.tables import PARAM, Law, Mode, Options

LEAST_SKEW = 0.7
"""Antisymmetric stiffness, in units of what damping holds (``skew``), above which eigenvalues are looked at."""
ANGLES = 36
"""Input angles of a revolution at which they are."""

FloatArray = NDArray[np.float64]


def exponent(params: NDArray[np.void], options: Options, samples: NDArray[np.void]) -> float:
    """Largest growth of a small disturbance of a pin and its arm along the recorded revolution.

    Parameters
    ----------
    params : ndarray of PARAM, shape (1,)
        The joint.
    options : Options
        Settings that it was simulated with.
    samples : ndarray of SAMPLE, shape (steps_per_rev,)
        Its last revolution.

    Returns
    -------
    float
        Logarithm of the growth over at most two revolutions; 0 where every disturbance decays. Each pin is taken with
        its arm alone, all other bodies moving as recorded: at these frequencies the bushings part them.
    """
    period = 2 * np.pi / abs(float(params["omega"][0]))
    chosen = np.unique(np.arange(ANGLES) * len(samples) // ANGLES)
    rates = _rates(params, options, samples, chosen, period)
    steps = np.diff(np.append(chosen, len(samples))) * period / len(samples)
    worst = 0.0
    for pin in rates.T:
        grown = 0.0
        for growth in np.tile(pin * steps, 2).tolist():
            grown = max(0.0, grown + growth)
            worst = max(worst, grown)
    return worst


def _rates(
    params: NDArray[np.void], options: Options, samples: NDArray[np.void], chosen: NDArray[np.intp], period: float
) -> FloatArray:
    """Largest real part of an eigenvalue of each pin with its arm, (angles, 4), 1/s; -inf but for uniform contact."""
    from tolstat.kernel import first_order as kernel
    from tolstat.kernel.topology import ARM, ARM_OF_PIN, N_DOF, PIN
    from tolstat.kernel.work import WORK

    works, column, whole = np.zeros(1, WORK), np.empty((3, 2 * N_DOF)), np.empty((2 * N_DOF, 2 * N_DOF))
    rows = params.view(np.recarray)
    rates = np.full((len(chosen), 4), -np.inf)
    for i, s in enumerate(chosen.tolist()):
        touching = np.flatnonzero(samples["mode"][s] == Mode.UNIFORM)
        if not touching.size:
            continue
        t = period * (1 + s / len(samples))
        state = np.concatenate([samples["q"][s], samples["v"][s]])
        kernel.jacobian_of_row(t, state, rows, options, works, column, whole)
        for pin in touching.tolist():
            own = np.concatenate([6 * body + np.arange(6) for body in (PIN + pin, ARM + ARM_OF_PIN[pin])])
            own = np.concatenate([own, N_DOF + own])
            rates[i, pin] = np.linalg.eigvals(whole[np.ix_(own, own)]).real.max()
    return rates


def may_flutter(params: NDArray[np.void], results: NDArray[np.void]) -> NDArray[np.bool_]:
    """Which joints are worth looking at, (n,), by their parameters and results."""
    return np.asarray((params["law"] == Law.MODE) & (results["skew"] > LEAST_SKEW))


def warm_up(options: Options) -> None:
    """Compile what is needed here, or load it from the cache."""
    from tolstat.kernel.first_order import jacobian_of_row
    from tolstat.kernel.topology import N_DOF
    from tolstat.kernel.work import WORK

    n = 2 * N_DOF
    params = np.zeros(1, PARAM).view(np.recarray)
    params.omega = 1.0
    jacobian_of_row(0.0, np.zeros(n), params, options, np.zeros(1, WORK), np.empty((3, n)), np.empty((n, n)))
