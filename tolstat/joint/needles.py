"""Stiffness of a needle bearing: line contact of its needles (ISO/TS 16281), and the formula that kernels use."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tolstat.common.bisection import first
from tolstat.joint.material import Array

LOADS = 41
"""Number of displacements at which the fit samples the force."""
RANGE = 100.0
"""Largest load of the fit over the smallest."""
LEAST = 0.1
"""Smallest clearance of the fit, in units of the displacement at the largest load: without clearance b is free."""
_x, _w = np.polynomial.legendre.leggauss(24)
NODES, WEIGHTS = 0.5 * (_x + 1.0), 0.5 * _w
"""Gauss-Legendre quadrature from 0 to 1; over the loaded needles it is exact to 2e-7."""
NARROW = 1e-6
"""Width of the interval of log b at which its search ends."""


class Fit(NamedTuple):
    """Coefficients of F = k3 delta^(9/8) sqrt(delta/(delta + b c)) for a whole bearing.

    Attributes
    ----------
    k3 : float
        N/m^(9/8).
    b : float
        Share of the radial clearance c.
    """

    k3: float
    b: float


def needle_force(delta: Array, clearance: float, needles: int, length: float) -> Array:
    """Force of a bearing whose pin is displaced by ``clearance + delta``, the mean over positions of the cage.

    A needle at the angle phi to the displacement is pressed by x = (c + delta) cos phi - c and takes
    q = 35948 L^(8/9) x^(10/9) (N, mm): steel on both sides, ISO/TS 16281.

    Parameters
    ----------
    delta : ndarray, shape (n,)
        Displacement beyond first touch (m), above zero.
    clearance : float
        Radial clearance c (m).
    needles : int
        Number of needles.
    length : float
        Length of a needle (m).

    Returns
    -------
    ndarray, shape (n,)
        Force (N) along the displacement.
    """
    last = 2.0 * np.arcsin(np.sqrt(0.5 * delta / (clearance + delta)))[:, None]  # the last needle that is loaded
    phi = last * NODES
    pressed = delta[:, None] - 2.0 * (clearance + delta)[:, None] * np.sin(0.5 * phi) ** 2
    load = 35948.0 * (1e3 * length) ** (8.0 / 9.0) * (1e3 * np.maximum(pressed, 0.0)) ** (10.0 / 9.0)
    return np.asarray(needles / math.pi * last[:, 0] * ((load * np.cos(phi)) @ WEIGHTS))


def formula(delta: Array, clearance: float, k3: float, b: float) -> Array:
    """Force (N) of `Fit` at displacements `delta` (m) beyond first touch, shape (n,)."""
    return np.asarray(k3 * delta**1.125 * np.sqrt(delta / (delta + b * clearance)))


def fit_needles(load: float, clearance: float, needles: int, length: float) -> Fit:
    """Fit of the kernels' formula to `needle_force` from ``load / 100`` to `load`.

    Least squares of the relative error of force at displacements whose logarithms are equally spaced. From clearances
    of a tenth of the largest displacement on, force is within 1.2 % and slope within 2.5 % at this clearance. Smaller
    ones have the fit of that tenth, by which they are within 5 and 4 % without clearance.

    Parameters
    ----------
    load : float
        Largest load (N) of the bearing.
    clearance, needles, length
        As in `needle_force`; the clearance is that of the nominal joint.
    """
    c = max(clearance, LEAST * displacement(load, 0.0, needles, length))
    low, high = (displacement(one, c, needles, length) for one in (load / RANGE, load))
    delta = np.geomspace(low, high, LOADS)
    force = needle_force(delta, c, needles, length)

    def ratio(log_b: float) -> Array:
        return formula(delta, c, 1.0, math.exp(log_b)) / force

    def misfit(log_b: float) -> float:
        own = ratio(log_b)
        return float(1.0 - own.sum() ** 2 / (own @ own) / LOADS)  # with the best k3

    log_b = _least(misfit, math.log(1e-3), math.log(10.0))
    own = ratio(log_b)
    return Fit(float(own.sum() / (own @ own)), math.exp(log_b))


def displacement(load: float, clearance: float, needles: int, length: float) -> float:
    """Displacement (m) beyond first touch at which a bearing takes `load` (N); see `needle_force`."""

    def exceeded(log_delta: float) -> bool:
        return bool(needle_force(np.array([math.exp(log_delta)]), clearance, needles, length)[0] > load)

    return math.exp(float(first(exceeded, math.log(1e-12), 0.0, halvings=25)))  # 1e-12 m to 1 m, to 1e-6 of itself


def _least(function: Callable[[float], float], low: float, high: float) -> float:
    """Place of the minimum between `low` and `high` of a function with one minimum, by golden sections."""
    share = 0.5 * (math.sqrt(5.0) - 1.0)
    while high - low > NARROW:
        one, other = high - share * (high - low), low + share * (high - low)
        if function(one) < function(other):
            high = other
        else:
            low = one
    return 0.5 * (low + high)
