"""Needle bearings of the pins: ``[bearing]`` of a joint file, and their stiffness for the contact law `needles`.

The stiffness is the line contact of the needles (ISO/TS 16281), fitted by the formula that kernels use.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from functools import cache
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import AfterValidator, Field, ValidationInfo, field_validator

from tolstat.analysis.rating_life import A1, critical_amplitude
from tolstat.common import units
from tolstat.common.bisection import first
from tolstat.common.strict import Strict, refuse
from tolstat.joint.material import Array
from tolstat.joint.sections import Force, Length, Number

DIAMETERS = ("needle_diameter", "pitch_diameter")
"""Keys without which loads are not distributed over laminae."""
FOR_LIFE = ("C", *DIAMETERS)
"""Keys without which a bearing has no rating life."""
AFFECT_LOADS = ("needles", "needle_length", *DIAMETERS, "profile", "end_relief")
"""Keys that affect loads or equivalent loads of a joint; others may be edited after it is simulated."""
LEFT_OUT: Any = None
"""Default of a key that one purpose needs and another does not; `Bearing.lacking` is asked before it is read."""


def _tabulated(reliability: float) -> float:
    if min(abs(reliability - tabulated) for tabulated in A1) > 1e-9:
        known = ", ".join(f"{100.0 * tabulated:g} %" for tabulated in A1)
        raise refuse(f"ISO 281 has no factor for a reliability of {100.0 * reliability:g} %", f"give one of: {known}")
    return min(A1, key=lambda tabulated: abs(tabulated - reliability))


class Bearing(Strict):
    """Needle bearing of each of the four pins.

    With the contact law `needles` its `needles` and `needle_length` say how stiff it is. Equivalent loads follow from
    its dimensions; the other keys affect no load.
    """

    needles: int = Field(strict=True, ge=3, le=1000, examples=[32])
    """needles of one bearing"""
    needle_length: Length = Field(default=LEFT_OUT, examples=["22 mm"])
    """length of a needle, needed with law `needles`; by default that of the contact"""
    C: Force = Field(default=LEFT_OUT, examples=["30 kN"])
    """basic dynamic load rating of one bearing; left out: by ISO 281 from the dimensions"""
    C0: Force | None = Field(default=None, examples=["45 kN"])
    """basic static load rating of one bearing; left out: by ISO 76 from the dimensions"""
    rings: Literal["drawn", "machined"] = Field(default="drawn", examples=["machined"])
    """drawn cup or machined rings, for C by ISO 281: b_m = 1 or 1.1"""
    needle_diameter: Length = Field(default=LEFT_OUT, examples=["4 mm"])
    """diameter of a needle, needed for the life"""
    pitch_diameter: Length = Field(default=LEFT_OUT, examples=["42 mm"])
    """diameter of the circle of the needles' axes, needed for the life"""
    profile: Literal["crowned", "logarithmic"] = Field(default="logarithmic", examples=["crowned"])
    """profile of a needle along its length, with `end_relief`"""
    end_relief: Length | None = Field(default=None, examples=["5 um"])
    """by how much the profile is lower in the middle of the outermost of 30 laminae; left out: needles are cylinders"""
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
        """Those of `keys` that are left out; `C` counts where it does not follow from the dimensions."""
        return [key for key in keys if getattr(self, key) is None and (key != "C" or self.needle_length is None)]

    @property
    def dynamic_rating(self) -> float:
        """C, N: the one that is given, or that of ISO 281."""
        return self.C or ratings(self)[0]

    @property
    def static_rating(self) -> float:
        """C0, N: the one that is given, or that of ISO 76; NaN without the length of the needles."""
        return self.C0 or (ratings(self)[1] if self.needle_length else math.nan)

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


def ratings(bearing: Bearing) -> tuple[float, float]:
    """Ratings C and C0, N, of a bearing from its dimensions: ISO 281:2007, 7.1, and ISO 76:2006, 6.1.

    The factor f_c of Table 7 is written out as Lundberg and Palmgren (1952) have it, with lambda nu = 0.83
    (ISO/TR 1281-1:2008).
    """
    Z, D, L = bearing.needles, 1e3 * bearing.needle_diameter, 1e3 * bearing.needle_length
    gamma = bearing.needle_diameter / bearing.pitch_diameter
    narrow = (1.0 - gamma) / (1.0 + gamma)
    f_c = 0.83 * 207.9 * gamma ** (2.0 / 9.0) * (1.0 - gamma) ** (29.0 / 27.0) / (1.0 + gamma) ** 0.25
    f_c *= (1.0 + (1.04 * narrow ** (143.0 / 108.0)) ** 4.5) ** (-2.0 / 9.0)
    b_m = 1.1 if bearing.rings == "machined" else 1.0
    C = b_m * f_c * L ** (7.0 / 9.0) * Z**0.75 * D ** (29.0 / 27.0)
    return C, 44.0 * (1.0 - gamma) * Z * L * D


LINE_CONTACT = 35948.0
"""Spring constant of a needle between both rings, N/mm^2; times length^(8/9) approach^(10/9) (ISO/TS 16281:2008)."""
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
    load = LINE_CONTACT * (1e3 * length) ** (8.0 / 9.0) * (1e3 * delta) ** (10.0 / 9.0)
    return np.asarray(
        needles * load * loaded(delta / (clearance + delta), lambda x, cosine: x ** (10.0 / 9.0) * cosine)
    )


def loaded(share: Array, function: Callable[[Array, Array], Array]) -> Array:
    """Mean over all needles of a function of the approach, in units of the largest one, and of the cosine of the angle.

    Parameters
    ----------
    share : ndarray, shape (n,)
        Largest approach over the displacement of the pin.
    function : callable
        Of arrays (n, m); 0 for needles without load.
    """
    last = 2.0 * np.arcsin(np.sqrt(0.5 * share))[:, None]  # the last needle that is loaded
    nodes, weights = _quadrature()
    phi = last * nodes
    pressed = np.maximum(1.0 - 2.0 / share[:, None] * np.sin(0.5 * phi) ** 2, 0.0)
    return np.asarray(last[:, 0] / math.pi * (function(pressed, np.cos(phi)) @ weights))


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
