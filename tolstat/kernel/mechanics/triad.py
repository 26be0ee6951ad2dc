"""Components along the lumps' triads (e, t, z): frame axes after quarter turns, where nothing is multiplied, or any."""

from tolstat.common.mechanism import ALONG_Z, OBLIQUE
from tolstat.kernel.mechanics.vector import turn, turn_back
from tolstat.kernel.simd.jit import njit


@njit
def to_triad(body, a, par):
    """Components along e, t and z of a vector in axes of the body's frame."""
    quarters = par.quarters[body]
    if quarters == ALONG_Z:
        return (a[2], a[0], a[1])
    if quarters == OBLIQUE:
        return turn(par.triad, body, a)
    x, y = a[0], a[1]
    if quarters % 2 == 1:
        x, y = y, -x
    if quarters >= 2:
        x, y = -x, -y
    return (x, y, a[2])


@njit
def from_triad(body, a, par):
    """Components in axes of the body's frame of a vector given along e, t and z."""
    quarters = par.quarters[body]
    if quarters == ALONG_Z:
        return (a[1], a[2], a[0])
    if quarters == OBLIQUE:
        return turn_back(par.triad, body, a)
    x, y = a[0], a[1]
    if quarters % 2 == 1:
        x, y = -y, x
    if quarters >= 2:
        x, y = -x, -y
    return (x, y, a[2])
