"""Growth of the cross swinging on its contacts: which joints may flutter.

The law ``mode`` has stiffness that is not symmetric. It can feed the 2 kHz oscillation of the whole cross in its four
holes, which steps that a revolution needs damp. Of the unknowns those of the hub remain, pins and arms condensed onto
them at a frequency w near that oscillation (Leung 1978): with D(cv, ca) the Schur complement of the tangent
K + cv C + ca M on the hub's block, the condensed C and M are its derivatives at cv = 0, ca = -w^2. The output shaft is
held: it is heavy. Cayley's transform G = (w + A) / (w - A), A being the system of first order, has a spectral radius
above 1 where an oscillation grows; its repeated squares give it (Gelfand's formula).
"""

import math
from typing import NamedTuple

import numpy as np

from tolstat.kernel._jit import njit
from tolstat.kernel.dynamics import forces
from tolstat.kernel.linsolve import column, factorise, invert, less, product, put_row, row
from tolstat.kernel.tangent import assemble
from tolstat.kernel.topology import HUB

ANGLES = 12
"""Angles of a revolution that are looked at."""
LEAST_SKEW = 0.1
"""Skew stiffness of the pins together, in units of what a contact's damping holds, where the cross may flutter."""
LEAST_DAMPING = 1e-3
"""Of a contact, in units of the root of its stiffness times the pin's mass, where it has none."""
MARGIN = 0.003
"""Damping ratio by which the estimate may err on the safe side."""
ENOUGH = 0.012
"""Damping ratio that nobody needs to know more of."""
STEP = 1e-3
"""Differences of D, relative to w and w^2."""
SQUARINGS = 12
"""A power of G is its radius's but for a condition number: here its 4096th root remains."""
LOG_SIZE = math.log(12)
"""Of G's size, which times the largest entry bounds the radius."""
STIFFNESS, DAMPING, MASS, SUM = range(4)


class CrossScratch(NamedTuple):
    """What `cross_growth` works in."""

    hub: np.ndarray  # (4, 6, 6)
    power: np.ndarray  # (2, 12, 2, 6): two 12 x 12 matrices, their rows in halves


def make_cross_scratch() -> CrossScratch:
    """Allocate, filled with NaN."""
    return CrossScratch(np.full((4, 6, 6), np.nan), np.full((2, 12, 2, 6), np.nan))


@njit
def skew_held(par):
    """Skew stiffness of a contact that its damping holds at a pin's frequency, N/m."""
    size = math.sqrt(par.k2u * par.pin_mass)
    return 2 * max(par.c_d, LEAST_DAMPING * size) * size / par.pin_mass


@njit
def onto_hub(cv, ca, par, work, hub, i):
    """Write the Schur complement of K + cv C + ca M to ``hub[i]``, after ``dynamics.forces``; returns whether it is."""
    assemble(cv, ca, par, work)
    good = factorise(work) & invert(work.lump_block, HUB)
    for j in range(6):
        for k in range(6):
            hub[i, j, k] = work.lump_block[HUB, j, k]
    return good


@njit
def condense(par, work, hub):
    """Write the condensed K / w^2, C / w and M, scaled to unit masses, to `hub`.

    Returns
    -------
    float
        w, that of a rigid cross on the condensed static stiffness (rad/s), or 0 where there is none.
    """
    good = onto_hub(0.0, 0.0, par, work, hub, STIFFNESS)
    stiffness = (hub[STIFFNESS, 0, 0] + hub[STIFFNESS, 1, 1] + hub[STIFFNESS, 2, 2]) / 3
    square = max(stiffness, 0.0) / (par.hub_mass + 4 * par.pin_mass)
    w = math.sqrt(square)
    good = good & onto_hub(0.0, -square, par, work, hub, STIFFNESS)
    good = good & onto_hub(STEP * w, -square, par, work, hub, DAMPING)
    good = good & onto_hub(0.0, (STEP - 1) * square, par, work, hub, MASS)
    for i in range(6):
        for j in range(6):
            here = hub[STIFFNESS, i, j]
            hub[DAMPING, i, j] = (hub[DAMPING, i, j] - here) / (STEP * square)
            hub[MASS, i, j] = (hub[MASS, i, j] - here) / (STEP * square)
            hub[STIFFNESS, i, j] = here / square + hub[MASS, i, j]
    for i in range(6):
        good = good & (hub[MASS, i, i] > 0)
        hub[SUM, 0, i] = 1 / math.sqrt(hub[MASS, i, i])
    for i in range(6):
        for j in range(6):
            unit = hub[SUM, 0, i] * hub[SUM, 0, j]
            for k in (STIFFNESS, DAMPING, MASS):
                hub[k, i, j] *= unit
    return w if good else 0.0


@njit
def transform(hub, power):
    """Write G of the condensed system to ``power[0]``; returns whether there is one."""
    for i in range(6):
        for j in range(6):
            hub[SUM, i, j] = hub[STIFFNESS, i, j] + hub[DAMPING, i, j] + hub[MASS, i, j]
    good = invert(hub, SUM)
    for j in range(6):
        by_place = product(hub, SUM, column(hub, STIFFNESS, j))
        by_rate = product(hub, SUM, column(hub, MASS, j))
        for i in range(6):
            one = 1.0 if i == j else 0.0
            power[0, i, 0, j], power[0, i, 1, j] = one - 2 * by_place[i], 2 * by_rate[i]
            power[0, 6 + i, 0, j], power[0, 6 + i, 1, j] = -2 * by_place[i], 2 * by_rate[i] - one
    return good


@njit
def square(here, scale, out):
    """Write scale times the square of a 12 x 12 matrix to `out`."""
    for i in range(12):
        for half in range(2):
            total = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
            for m in range(12):
                total = less(total, -scale * here[i, m // 6, m % 6], row(here, m, half))
            put_row(out, i, half, total)


@njit
def log_radius(power):
    """Natural logarithm of the spectral radius of ``power[0]``, which is overwritten.

    Where a norm shows early that it is below -`ENOUGH`, that bound is returned.
    """
    found, share = 0.0, 1.0
    for k in range(SQUARINGS + 1):
        here = power[k % 2]
        largest = 0.0
        for i in range(12):
            for half in range(2):
                for j in range(6):
                    largest = max(largest, abs(here[i, half, j]))
        found += share * math.log(largest)
        if found + share * LOG_SIZE < -ENOUGH:
            return found + share * LOG_SIZE
        share /= 2
        square(here, 1 / largest**2, power[(k + 1) % 2])
    return found


@njit
def fastest(s, par, work, samples, scratch):
    """Rate at which the cross's oscillations grow at most at sample `s`, 1/s; plus `MARGIN`.

    It is an estimate, best for oscillations near w, and infinite where the cross cannot be condensed.
    """
    t = 2 * math.pi / abs(par.omega) * (1 + s / samples.size)
    forces(t, samples[s].q, samples[s].v, par, work)
    w = condense(par, work, scratch.hub)
    if not (w > 0 and transform(scratch.hub, scratch.power)):
        return math.inf
    rate = w * (log_radius(scratch.power) + MARGIN)
    return rate if rate < 1e300 else math.inf


@njit
def cross_growth(par, work, samples, scratch):
    """Estimate the largest growth of the cross's oscillations along a revolution.

    Parameters
    ----------
    par, work : records of PARAM and WORK
        The joint; scratch.
    samples : ndarray of SAMPLE
        Its last revolution; ``growth`` is written at the angles looked at, sample k n // `ANGLES` of n being angle k.
    scratch : CrossScratch
        Overwritten.

    Returns
    -------
    float
        Logarithm of the growth over at most two revolutions.
    """
    n, period, floor = samples.size, 2 * math.pi / abs(par.omega), LEAST_SKEW * skew_held(par)
    for k in range(ANGLES):
        s = k * n // ANGLES
        samples[s].growth = fastest(s, par, work, samples, scratch) if samples[s].skew > floor else -math.inf
    largest = grown = 0.0
    for k in range(2 * ANGLES):
        grown = max(0.0, grown + samples[(k % ANGLES) * n // ANGLES].growth * period / ANGLES)
        largest = max(largest, grown)
    return largest
