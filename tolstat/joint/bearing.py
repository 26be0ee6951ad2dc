"""Needle bearings of the pins: ``[bearing]`` of a joint file, and their stiffness for the contact law `needles`.

The stiffness is the line contact of the needles (ISO/TS 16281), fitted by the formula that kernels use.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from functools import cache
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import AfterValidator, Field, ValidationInfo, field_validator

from tolstat.analysis.rating_life import A1, critical_amplitude
from tolstat.common import units
from tolstat.common.bisection import first
from tolstat.common.strict import Strict, refuse
from tolstat.joint.material import Array
from tolstat.joint.sections import Force, Length, Number

FOR_LIFE = ("C", "needle_diameter", "pitch_diameter")
"""Keys without which a bearing has no rating life."""
LEFT_OUT: Any = None
"""Default of a key that one purpose needs and another does not; `Bearing.lacking` is asked before it is read."""


def _tabulated(reliability: float) -> float:
    if min(abs(reliability - tabulated) for tabulated in A1) > 1e-9:
        known = ", ".join(f"{100.0 * tabulated:g} %" for tabulated in A1)
        raise refuse(f"ISO 281 has no factor for a reliability of {100.0 * reliability:g} %", f"give one of: {known}")
    return min(A1, key=lambda tabulated: abs(tabulated - reliability))


class Bearing(Strict):
    """Needle bearing of each of the four pins.

    With the contact law `needles` its `needles` and `needle_length` say how stiff it is; the other keys affect no load.
    """

    needles: int = Field(strict=True, ge=3, le=1000, examples=[32])
    """needles of one bearing"""
    needle_length: Length = Field(default=LEFT_OUT, examples=["22 mm"])
    """length of a needle, needed with law `needles`"""
    C: Force = Field(default=LEFT_OUT, examples=["30 kN"])
    """basic dynamic load rating of one bearing (ISO 281), needed for the life"""
    needle_diameter: Length = Field(default=LEFT_OUT, examples=["4 mm"])
    """diameter of a needle, needed for the life"""
    pitch_diameter: Length = Field(default=LEFT_OUT, examples=["42 mm"])
    """diameter of the circle of the needles' axes, needed for the life"""
    required_life: units.Time | None = Field(default=None, examples=["5000 h"])
    """life that all four bearings of a joint must reach"""
    reliability: Annotated[units.Number, AfterValidator(_tabulated)] = Field(default=0.9, examples=["95 %"])
    """share of equal joints that reach their rating life"""
    a_iso: Number | None = Field(default=None, examples=[0.8])
    """life modification factor for lubrication and contamination (ISO 281)"""

    @field_validator("pitch_diameter")
    @classmethod
    def _has_room(cls, value: float, info: ValidationInfo) -> float:
        needles, diameter = info.data.get("needles"), info.data.get("needle_diameter")
        if needles and diameter and needles * math.asin(min(1.0, diameter / value)) > math.pi * (1.0 + 1e-9):
            room = int(math.pi / math.asin(min(1.0, diameter / value)))
            found = f"no circle of {{pitch_diameter}} has room for {needles} needles of {{needle_diameter}}"
            raise refuse(found, f"give needles <= {room}, or other diameters", "pitch_diameter", "needle_diameter")
        return value

    def lacking(self, keys: Iterable[str]) -> list[str]:
        """Those of `keys` that are left out."""
        return [key for key in keys if getattr(self, key) is None]

    @property
    def critical_amplitude(self) -> float:
        """Smallest misalignment with a rating life, rad; see `analysis.rating_life.critical_amplitude`."""
        return critical_amplitude(self.needles, self.needle_diameter, self.pitch_diameter)

    @property
    def factor(self) -> float:
        """Life at `reliability` and `a_iso` over the basic rating life."""
        return A1[self.reliability] * (1.0 if self.a_iso is None else self.a_iso)

    @property
    def symbol(self) -> str:
        """Symbol of the life of `factor`: ``L10``, ``L5`` for a reliability of 95 %, ``L5m`` with `a_iso`."""
        return f"L{100.0 * (1.0 - self.reliability):.3g}{'' if self.a_iso is None else 'm'}"


LOADS = 41
"""Number of displacements at which the fit samples the force."""
RANGE = 100.0
"""Largest load of the fit over the smallest."""
LEAST = 0.1
"""Smallest clearance of the fit, in units of the displacement at the largest load: without clearance b is free."""
POINTS = 24
"""Number of points of the quadrature over the loaded needles: exact to 2e-7."""
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
    nodes, weights = _quadrature()
    phi = last * nodes
    pressed = delta[:, None] - 2.0 * (clearance + delta)[:, None] * np.sin(0.5 * phi) ** 2
    load = 35948.0 * (1e3 * length) ** (8.0 / 9.0) * (1e3 * np.maximum(pressed, 0.0)) ** (10.0 / 9.0)
    return np.asarray(needles / math.pi * last[:, 0] * ((load * np.cos(phi)) @ weights))


@cache  # at the first use: numpy.polynomial takes long to import
def _quadrature() -> tuple[Array, Array]:
    """Nodes and weights of the Gauss-Legendre quadrature from 0 to 1."""
    x, weights = np.polynomial.legendre.leggauss(POINTS)
    return 0.5 * (x + 1.0), 0.5 * weights


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
    low, high = (displacement(end, c, needles, length) for end in (load / RANGE, load))
    delta = np.geomspace(low, high, LOADS)
    force = needle_force(delta, c, needles, length)

    def ratio(log_b: float) -> Array:
        return formula(delta, c, 1.0, math.exp(log_b)) / force

    def misfit(log_b: float) -> float:
        ratios = ratio(log_b)
        return float(1.0 - ratios.sum() ** 2 / (ratios @ ratios) / LOADS)  # with the best k3

    log_b = _least(misfit, math.log(1e-3), math.log(10.0))
    ratios = ratio(log_b)
    return Fit(float(ratios.sum() / (ratios @ ratios)), math.exp(log_b))


def displacement(load: float, clearance: float, needles: int, length: float) -> float:
    """Displacement (m) beyond first touch at which a bearing takes `load` (N); see `needle_force`."""

    def exceeded(log_delta: float) -> bool:
        return bool(needle_force(np.array([math.exp(log_delta)]), clearance, needles, length)[0] > load)

    return math.exp(float(first(exceeded, math.log(1e-12), 0.0, halvings=25)))  # 1e-12 m to 1 m, to 1e-6 of itself


def _least(function: Callable[[float], float], low: float, high: float) -> float:
    """Place of the minimum between `low` and `high` of a function with one minimum, by golden sections."""
    share = 0.5 * (math.sqrt(5.0) - 1.0)
    while high - low > NARROW:
        left, right = high - share * (high - low), low + share * (high - low)
        if function(left) < function(right):
            high = right
        else:
            low = left
    return 0.5 * (low + high)
