"""Elastic force of a contact station (docs/model.md, Contacts), its slope and its inverse, for all kernels.

The force is (k1 delta + k2) delta, eq. (5), plus that of needles, k3 delta^(9/8) sqrt(delta/(delta + b c)), with c the
radial clearance of the pin. It rises with the penetration, and so does its slope.
"""

import math

from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import any_of, where

TRIES = 50
"""Maximum number of iterations of `penetration`."""
ACCURATE = 1e-12
"""Relative change of the force up to which `penetration` is exact."""


@njit
def has_needles(kind, par):
    """Whether pins of a kind of pair turn on needles in any lane."""
    return any_of(par.needle_b[kind] > 0)


@njit
def elastic(kind, j, delta, clearance, needles, par):
    """Force (N) of station `j` at a penetration above zero, and its slope (N/m); no numbers at others.

    Parameters
    ----------
    kind, j : int
        Kind of the pair, and number of the station.
    delta : float or lanes
        Penetration, m.
    clearance : float or lanes
        Radial clearance of the pin, m.
    needles : bool
        `has_needles`: asked once for many stations, it costs nothing where there are none.
    par : record of PARAM
        The joint.
    """
    force = (par.station_k1[kind, j] * delta + par.station_k2[kind, j]) * delta
    slope = 2 * par.station_k1[kind, j] * delta + par.station_k2[kind, j]
    if needles:
        lost = par.needle_b[kind] * clearance
        share = 1 / (delta + lost)
        secant = par.station_k3[kind, j] * math.sqrt(math.sqrt(math.sqrt(delta))) * math.sqrt(delta * share)
        on_needles = par.station_k3[kind, j] > 0
        force += where(on_needles, secant * delta, 0.0)
        slope += where(on_needles, secant * (1.125 + 0.5 * lost * share), 0.0)
    return force, slope


@njit
def penetration(force, kind, j, clearance, par):
    """Penetration (m) at which station `j` carries a force; 0 for a station without stiffness.

    Parameters
    ----------
    force : float
        Force, N.
    kind, j, clearance, par
        As in `elastic`.
    """
    k1, k2 = par.station_k1[kind, j], par.station_k2[kind, j]
    slope = k2 + math.sqrt(k2 * k2 + 4 * k1 * force)
    delta = 2 * force / slope if slope > 0 else 0.0
    if not (par.station_k3[kind, j] > 0 and force > 0):
        return delta
    if delta == 0:
        delta = (force / par.station_k3[kind, j]) ** (8 / 9)
    for _ in range(TRIES):  # Newton's iteration in the logarithms, in which the force is nearly straight
        reached, rise = elastic(kind, j, delta, clearance, True, par)
        delta *= (force / reached) ** (reached / (rise * delta))
        if abs(reached - force) <= ACCURATE * force:
            break
    return delta
