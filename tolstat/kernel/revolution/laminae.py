"""Equivalent load of needles under tilt, by laminae after ISO/TS 16281:2008 (docs/model.md, Bearing life).

A pin lies in its bearing by r, the displacement of its middle, and by what its ends are displaced beyond: `along` r and
`across` it. At the place x, from -1 to 1, a needle at the angle phi to the displacement is pressed by
g(x) cos(phi) - c - relief(x), with g = |(r + x along, x across)|.
"""

import math

from tolstat.common.parameters import ACROSS_NEEDLES, EDGES, LAMINAE, OF_DAMAGE, OF_FORCE, OF_POWER, PLACE, RELIEF
from tolstat.kernel.simd.jit import njit

CLOSE = 0.003
"""Relative error of force or damage up to which a displacement is a solution."""
TRIES = 40
"""Maximum number of displacements that are tried."""
FORCE, FORCE_SLOPE, DAMAGE, DAMAGE_SLOPE, DEEPEST = range(5)


@njit
def polynomial(coefficients, x):
    """Value of a polynomial at x, coefficients (n,) rising."""
    total = 0.0
    for k in range(coefficients.shape[0] - 1, -1, -1):
        total = total * x + coefficients[k]
    return total


@njit
def power(delta, kind, par):
    """Approach (m) to the power 10/9: the fit is that of t^(8/9), t^8 in units of `ACROSS_NEEDLES`."""
    t = math.sqrt(math.sqrt(math.sqrt(delta * (1 / ACROSS_NEEDLES))))
    return delta * polynomial(par.needle_fit[kind, OF_POWER], t)


@njit
def press_needles(r, along, across, clearance, kind, par):
    """Force on a pin (N), damage, their slopes by r, and largest approach of a needle (m).

    The damage is the sum over laminae and rings of (f q_ke)^(9/2), in proportion to that of L10r^(-9/8), eq. (65).
    """
    force = aside = force_slope = damage = damage_slope = deepest = 0.0
    for lamina in range(LAMINAE):
        x = par.lamina[kind, lamina, PLACE]
        a, b = r + x * along, x * across
        g = math.sqrt(a * a + b * b)
        delta = g - clearance - par.lamina[kind, lamina, RELIEF]
        if delta <= 0:
            continue
        u, cosine = delta / g, a / g
        v = math.sqrt(u)
        f = power(delta, kind, par) * v * polynomial(par.needle_fit[kind, OF_FORCE], u)
        wear = par.lamina[kind, lamina, EDGES] * delta**5 * v * polynomial(par.needle_fit[kind, OF_DAMAGE], v)
        force, aside, damage, deepest = force + f * cosine, aside + f * b / g, damage + wear, max(deepest, delta)
        more = 0.5 * (1 - u)  # the exponents of delta: the loaded needles become more, too
        force_slope += f * ((10 / 9 + more) / delta * cosine**2 + b * b / g**3)
        damage_slope += wear / delta * cosine * (5 + more)
    k = par.needle_k[kind] * par.needles[kind] / LAMINAE
    return k * math.sqrt(force * force + aside * aside), k * force_slope, damage, damage_slope, deepest


@njit
def displaced(which, target, start, along, across, clearance, kind, par):
    """What `press_needles` returns at the displacement r where the value `which` is `target`, by Newton's iteration.

    Force and damage rise with r, and so do their slopes. `start`: a first r, m.
    """
    r, low, high = start, 0.0, math.inf
    found = press_needles(r, along, across, clearance, kind, par)
    for _ in range(TRIES):
        off = found[which] - target
        if abs(off) <= CLOSE * target:
            break
        low, high = (low, r) if off > 0 else (r, high)
        slope = found[which + 1]
        r = r - off / slope if slope > 0 else 2 * r + ACROSS_NEEDLES
        if r <= low or r >= high:
            r = 0.5 * (low + high) if high < math.inf else 2 * low
        found = press_needles(r, along, across, clearance, kind, par)
    return found


@njit
def lamina_load(force, ends, clearance, kind, par):
    """Dynamic equivalent load of a bearing, N, and the largest load of a needle's lamina, N/m.

    The first is the load with which the same bearing has the same L10r when pin and bearing are in line and there is no
    clearance.

    Parameters
    ----------
    force : float
        Resultant force of the pin, N.
    ends : tuple of 3 float
        Displacement of the pin's middle, m; what a needle's end is displaced beyond it, along and across it, m.
    clearance, kind, par
        Radial clearance, m; kind of the pair; the joint.
    """
    r, along, across = ends
    if not (force > 0 and r >= 0):
        return force, 0.0
    found = displaced(FORCE, force, r, along, across, clearance, kind, par)
    even = press_needles(found[DEEPEST], 0.0, 0.0, 0.0, kind, par)
    start = found[DEEPEST] * (found[DAMAGE] / even[DAMAGE]) ** (1 / 5)
    same = displaced(DAMAGE, found[DAMAGE], start, 0.0, 0.0, 0.0, kind, par)
    off = force / found[FORCE]
    line = off * par.needle_k[kind] * power(found[DEEPEST], kind, par) / (2 * par.needle_half[kind])
    return off * same[FORCE] * (found[DAMAGE] / same[DAMAGE]) ** (2 / 9), line
