"""Equivalent load of needles under tilt, by laminae after ISO/TS 16281:2008 (docs/model.md, Bearing life).

A pin lies in its bearing by r, the displacement of its middle, and by what its ends are displaced beyond: `along` r and
`across` it. At the place x, from -1 to 1, a needle at the angle phi to the displacement is pressed by
g(x) cos(phi) - c - relief(x), with g = |(r + x along, x across)|.
"""

import math

from tolstat.common.parameters import (
    ACROSS_NEEDLES,
    EDGES,
    IN_LINE,
    LAMINAE,
    LEAST_DAMAGE,
    OF_DAMAGE,
    OF_FORCE,
    OF_POWER,
    PLACE,
    RELIEF,
)
from tolstat.kernel.simd.jit import njit

CLOSE = 0.01
"""Relative error of the force up to which the rest of Newton's iteration is one step along the slopes."""
TRIES = 40
"""Maximum number of displacements that are tried."""
NOTHING = 1e-12
"""Approach of a lamina without load, m."""
FORCE, SLOPE, DAMAGE, RISE, DEEPEST = range(5)


@njit
def fit_of(row, kind, par):
    """Coefficients of the polynomial in a row of `needle_fit`."""
    fit = par.needle_fit[kind, row]
    return fit[0], fit[1], fit[2], fit[3], fit[4]


@njit
def polynomial(fit, x):
    """Value of the polynomial with coefficients `fit` at x."""
    return (((fit[4] * x + fit[3]) * x + fit[2]) * x + fit[1]) * x + fit[0]


@njit
def root(delta, fit):
    """Approach (m) to the power 1/9: the fit is that of t^(8/9), t^8 the approach in units of `ACROSS_NEEDLES`."""
    return polynomial(fit, math.sqrt(math.sqrt(math.sqrt(delta * (1 / ACROSS_NEEDLES)))))


@njit
def press_needles(r, along, across, clearance, kind, par, work):
    """Force on a pin (N) and damage, each with its slope by r, and largest approach of a needle (m).

    The damage is the sum over the laminae of that of both rings, in proportion to L10r^(-9/8), eq. (65).

    Parameters
    ----------
    r, along, across : float
        Displacement of the pin's middle, m; what a needle's end is displaced beyond it, along and across it, m.
    clearance, kind, par
        As in `lamina_load`.
    work : ndarray, shape (6, LAMINAE)
        Scratch: without sums and branches the loop over the laminae is compiled to SIMD.
    """
    fit, along_pin, worn = fit_of(OF_POWER, kind, par), fit_of(OF_FORCE, kind, par), fit_of(OF_DAMAGE, kind, par)
    for lamina in range(LAMINAE):
        x = par.lamina[kind, PLACE, lamina]
        a, b = r + x * along, x * across
        g = math.sqrt(a * a + b * b)
        delta = g - clearance - par.lamina[kind, RELIEF, lamina]
        delta = delta if delta > NOTHING else NOTHING
        u, cosine, sine = delta / g, a / g, b / g
        v = math.sqrt(u)
        secant = v * root(delta, fit) * polynomial(along_pin, u)
        force, square = delta * secant, delta * delta
        rising = (10 / 9 + 0.5 * (1 - u)) * cosine * cosine + u * sine * sine  # more needles are loaded, too
        damage = par.lamina[kind, EDGES, lamina] * square * square * v * polynomial(worn, v)
        work[0, lamina], work[1, lamina], work[2, lamina] = force * cosine, force * sine, secant * rising
        work[3, lamina], work[4, lamina] = damage * delta, damage * (5 + 0.5 * (1 - u)) * cosine
        work[5, lamina] = delta
    force = aside = slope = damage = rise = deepest = 0.0
    for lamina in range(LAMINAE):
        force, aside, slope = force + work[0, lamina], aside + work[1, lamina], slope + work[2, lamina]
        damage, rise, deepest = damage + work[3, lamina], rise + work[4, lamina], max(deepest, work[5, lamina])
    k = par.needle_k[kind] * par.needles[kind] / LAMINAE
    return k * math.sqrt(force * force + aside * aside), k * slope, damage, rise, deepest


@njit
def displaced(force, start, along, across, clearance, kind, par, work):
    """Displacement r, m, at which needles carry a force, and what `press_needles` returns there; Newton's iteration.

    The force rises with r, and so does its slope.

    Parameters
    ----------
    force, start : float
        The force, N; a first r, m.
    along, across, clearance, kind, par, work
        As in `press_needles`.
    """
    r, low, high = start, 0.0, math.inf
    found = press_needles(r, along, across, clearance, kind, par, work)
    for _ in range(TRIES):
        off = found[FORCE] - force
        if abs(off) <= CLOSE * force:
            break
        low, high = (low, r) if off > 0 else (r, high)
        r = r - off / found[SLOPE] if found[FORCE] > 1e-3 * force else 2 * r + ACROSS_NEEDLES
        if r <= low or r >= high:
            r = 0.5 * (low + high) if high < math.inf else 2 * low
        found = press_needles(r, along, across, clearance, kind, par, work)
    return r, found


@njit
def in_line(damage, kind, par):
    """Force, N, with which the bearing has a damage when pin and bearing are in line and there is no clearance."""
    place = math.log(damage) - LEAST_DAMAGE
    k = min(max(int(place), 0), IN_LINE - 2)
    low, high = par.in_line[kind, k], par.in_line[kind, k + 1]
    return par.needle_k[kind] * math.exp(low + (place - k) * (high - low))


@njit
def lamina_load(force, ends, before, clearance, kind, par, work):
    """Dynamic equivalent load of a bearing, N, and the largest load of a needle's lamina, N/m.

    The first is the load with which the same bearing has the same L10r when pin and bearing are in line and there is no
    clearance.

    Parameters
    ----------
    force : float
        Resultant force of the pin, N.
    ends : tuple of 3 float
        Displacement of the pin's middle, m; what a needle's end is displaced beyond it, along and across it, m.
    before : float
        By how much needles were displaced more than the contact law has it, at the sample before, m.
    clearance, kind, par
        Radial clearance, m; kind of the pair; the joint.
    work : ndarray, shape (6, LAMINAE)
        Scratch.

    Returns
    -------
    load, line, more : float
        Both loads, and `before` of the next sample. Of an ideal joint, whose pins are not displaced: force and NaN.
    """
    if not (force > 0 and ends[0] >= 0):
        return force, 0.0 if force == 0 else math.nan, before
    r, found = displaced(force, max(ends[0] + before, 0.0), ends[1], ends[2], clearance, kind, par, work)
    rest = (force - found[FORCE]) / found[SLOPE]
    deepest = found[DEEPEST] + rest
    line = par.needle_k[kind] * deepest * root(deepest, fit_of(OF_POWER, kind, par)) / (2 * par.needle_half[kind])
    return in_line(found[DAMAGE] + rest * found[RISE], kind, par), line, r + rest - ends[0]
