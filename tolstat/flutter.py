"""Flutter of the contacts: motions that settle at the steps taken and in truth do not.

The law ``mode`` is not the gradient of a potential: the force of one end of a pin changes with the penetration of the
other in another way than the reverse. Where damping does not hold that, pins, arms and hub flutter at 2 to 50 kHz,
which the method damps at any step that a revolution needs. So it is looked for where it begins: in the eigenvalues of
the equations of motion, linearised about the recorded revolution. There are two kinds: the whole cross swings on its
contacts, at some 2 kHz, which a condensed model shows (`kernel.cross_growth`), and contacts that are pressed deep.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.tables import PARAM, Law, Mode, Options

LEAST_GROWTH = 1.0
"""Estimated growth of the cross on its contacts (``cross_growth``, an exponent) above which eigenvalues are taken."""
LEAST_DEPTH = 0.6
"""Force of a contact along both ends of a pin above which they are, in units of k2u^2/k1u: there the quadratic term of
the contact's law approaches the linear one, and contacts stiffen to the frequencies of bushings."""
ANGLES = 36
"""Input angles of a revolution at which eigenvalues are looked at, besides those where the skew stiffness peaks."""
CLEAR = 10.0
"""Exponent at which the angles between would not change the verdict."""
FOLLOWED = 0.2
"""Phase of an oscillation in a step (rad) below which the integration itself shows whether it grows."""

FloatArray = NDArray[np.float64]
Angles = NDArray[np.intp]


def exponent(params: NDArray[np.void], options: Options, samples: NDArray[np.void], deep: bool) -> float:
    """Largest growth of a small disturbance along the recorded revolution, at frequencies that the steps damp.

    Parameters
    ----------
    params : ndarray of PARAM, shape (1,)
        The joint.
    options : Options
        Settings that it was simulated with.
    samples : ndarray of SAMPLE, shape (steps_per_rev,)
        Its last revolution.
    deep : bool
        Whether contacts are, see `is_deep`. Where they are not, eigenvalues are taken only where the condensed model
        shows growth on one side.

    Returns
    -------
    float
        Logarithm of the growth over at most two revolutions; 0 where every disturbance decays. At each angle it grows
        as the fastest eigenvector there: at these frequencies the recorded motion is slow.
    """
    n, period = len(samples), 2 * np.pi / abs(float(params["omega"][0]))

    def rates_at(angles: Angles) -> FloatArray:
        rates = np.full(len(angles), np.inf) if deep else _of_cross(samples, angles)
        open_ = angles[rates > 0]
        matrices = _jacobians(params, options, samples, open_)
        rates[rates > 0] = _rates(matrices, samples["mode"][open_], FOLLOWED * n / period)
        return rates

    chosen = np.union1d(np.arange(ANGLES) * n // ANGLES, _peaks(samples["skew"]))
    rates = rates_at(chosen)
    found = _growth(rates, chosen, n, period)
    between = _between(rates > 0, chosen, n)
    if not 0 < found < CLEAR or not between.size:
        return found
    rates = np.append(rates, rates_at(between))
    chosen = np.append(chosen, between)
    order = np.argsort(chosen)
    return _growth(rates[order], chosen[order], n, period)


def _peaks(skew: FloatArray) -> Angles:
    """Angles at which a closed curve has a maximum above zero."""
    return np.flatnonzero((skew > np.roll(skew, 1)) & (skew >= np.roll(skew, -1)))


def _growth(rates: FloatArray, chosen: Angles, n: int, period: float) -> float:
    """Largest sum of rates times time from any angle on; each of those `chosen`, of `n`, stands until the next."""
    steps = np.diff(np.append(chosen, n)) * period / n
    worst = grown = 0.0
    for growth in np.tile(rates * steps, 2).tolist():
        grown = max(0.0, grown + growth)
        worst = max(worst, grown)
    return worst


def _between(unstable: NDArray[np.bool_], chosen: Angles, n: int) -> Angles:
    """Angles between two that are `chosen` of `n` and of which one at least is unstable."""
    ends = np.append(chosen[1:], n)
    either = unstable | np.roll(unstable, -1)
    inner = [np.arange(a + 1, b) for a, b in zip(chosen[either], ends[either], strict=True)]
    return np.concatenate(inner) if inner else np.empty(0, np.intp)


def _of_cross(samples: NDArray[np.void], chosen: Angles) -> FloatArray:
    """Growth of the cross on its contacts at each angle, 1/s: the larger of what the kernel found on its two sides."""
    from tolstat.kernel.cross_growth import ANGLES as LOOKED_AT

    angles = np.arange(LOOKED_AT) * len(samples) // LOOKED_AT
    before = np.searchsorted(angles, chosen, side="right") - 1
    found = samples["growth"][angles]
    return np.asarray(np.maximum(found[before], found[(before + 1) % LOOKED_AT]))


def _jacobians(params: NDArray[np.void], options: Options, samples: NDArray[np.void], chosen: Angles) -> FloatArray:
    """Equations of motion, linearised about the recorded revolution: (angles, 110, 110), 1/s."""
    from tolstat.kernel import first_order as kernel
    from tolstat.kernel.topology import N_DOF
    from tolstat.kernel.work import WORK

    works, column = np.zeros(1, WORK), np.empty((3, 2 * N_DOF))
    matrices = np.empty((len(chosen), 2 * N_DOF, 2 * N_DOF))
    period = 2 * np.pi / abs(float(params["omega"][0]))
    for matrix, s in zip(matrices, chosen.tolist(), strict=True):
        state = np.concatenate([samples["q"][s], samples["v"][s]])
        t = period * (1 + s / len(samples))
        kernel.jacobian_of_row(t, state, params.view(np.recarray), options, works, column, matrix)
    return matrices


def _rates(matrices: FloatArray, modes: NDArray[np.uint8], least: float) -> FloatArray:
    """Largest growth of an oscillation faster than `least` rad/s at each angle, 1/s.

    It is -inf where no pin touches with both ends: all stiffness is symmetric then.
    """
    touching = (modes == Mode.UNIFORM).any(axis=1)
    values = np.linalg.eigvals(matrices[touching])
    rates = np.full(len(matrices), -np.inf)
    rates[touching] = np.where(np.abs(values.imag) > least, values.real, -np.inf).max(axis=1, initial=-np.inf)
    return rates


def is_deep(params: NDArray[np.void], results: NDArray[np.void]) -> NDArray[np.bool_]:
    """Whether a contact along both ends of a pin is pressed deep enough to stiffen, (n,)."""
    both_ends = results["mode_share"][:, :, Mode.UNIFORM] > 0
    force = np.where(both_ends, results["contact_max"].max(axis=2), 0.0).max(axis=1)
    return np.asarray(force * params["k1u"] > LEAST_DEPTH * params["k2u"] ** 2)


def may_flutter(params: NDArray[np.void], results: NDArray[np.void]) -> NDArray[np.bool_]:
    """Which joints are worth looking at, (n,), by their parameters and results."""
    swings = results["cross_growth"] > LEAST_GROWTH
    return np.asarray((params["law"] == Law.MODE) & (swings | is_deep(params, results)))


def warm_up(options: Options) -> None:
    """Compile what is needed here, or load it from the cache."""
    from tolstat.kernel.settle import make_samples

    params = np.zeros(1, PARAM)
    params["omega"] = 1.0
    _jacobians(params, options, make_samples(1, 1)[0], np.zeros(1, np.intp))
