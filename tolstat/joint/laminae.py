"""Needles in laminae for the equivalent load of a pin's bearing (ISO/TS 16281:2008; docs/model.md, Bearing life)."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from tolstat.common.parameters import ACROSS_NEEDLES, IN_LINE, LAMINAE, LEAST_DAMAGE, TERMS
from tolstat.joint.bearing import DIAMETERS, LINE_CONTACT, Bearing, loaded
from tolstat.joint.material import Array

OF_RINGS = 9 / 2
"""Exponent of the loads of laminae, that of a life and of Weibull's distribution together: 4 times 9/8."""
LEAST_SHARE = 0.002
"""Approach of the most loaded needle over displacement, from which on the fits hold."""


def places(laminae: int = LAMINAE) -> Array:
    """Middles of the laminae from -1 to 1, shape (laminae,)."""
    return (2.0 * np.arange(1, laminae + 1) - 1.0) / laminae - 1.0


def stress_riser(laminae: int = LAMINAE) -> Array:
    """Factor f on the load of each lamina for the stress at the ends of a needle, ISO/TS 16281:2008, eq. (60)."""
    k = np.arange(1, laminae + 1)
    with np.errstate(divide="ignore"):
        across = np.log(1.985 * np.abs(2 * k - laminae - 1) / max(2 * laminae - 2, 1))
    return np.asarray(1.0 - 0.01 / across)


def relief(bearing: Bearing, length: float, x: Array) -> Array:
    """Approach (m) that the profile of a needle takes off at places `x` from -1 to 1: that of both its contacts.

    It is twice `end_relief` in the middle of the outermost lamina. A crowned needle is an arc along its length; a
    logarithmic one is straight but for the ends, eqs. (43) and (44).
    """
    if bearing.end_relief is None:
        return 0.0 * x

    def depth(x: Array) -> Array:
        if bearing.profile == "crowned":
            return x**2
        end = min(1.0, 2.5 * bearing.needle_diameter / length)
        return -np.log1p(-((np.maximum(np.abs(x) - (1.0 - end), 0.0) / end) ** 2))

    return np.asarray(2.0 * bearing.end_relief * depth(x) / depth(places()[-1:]))


def rings(gamma: float) -> tuple[float, float]:
    """Q_ci and Q_ce, loads of a needle for the rating of inner and outer ring, in units of C/Z, eqs. (47) to (57).

    `gamma`: diameter of a needle over that of the circle of their axes.
    """
    ratio = (1.038 * ((1.0 - gamma) / (1.0 + gamma)) ** (143.0 / 108.0)) ** OF_RINGS
    inner, outer = (1.0 + ratio) ** (2.0 / 9.0), (1.0 + 1.0 / ratio) ** (2.0 / 9.0)
    return inner / (0.83 * 0.378), outer / (0.83 * 0.364)


@cache
def parameters(bearing: Bearing | None, contact: float) -> dict[str, Any]:
    """Fields of PARAM on the laminae of the needles of a bearing; zeros without its diameters.

    `contact`: length of the contact, m, that of the needles where the bearing gives none.
    """
    if bearing is None or bearing.lacking(DIAMETERS):
        return dict.fromkeys(("needle_k", "needles", "needle_half", "lamina", "needle_fit", "in_line"), 0.0)
    length = bearing.needle_length or contact
    Q_ci, Q_ce = rings(bearing.needle_diameter / bearing.pitch_diameter)
    outer = (Q_ci / Q_ce) ** OF_RINGS
    return {
        "needle_k": LINE_CONTACT * 1e3 ** (10.0 / 9.0) * (1e3 * length) ** (8.0 / 9.0),
        "needles": bearing.needles,
        "needle_half": 0.5 * length,
        "lamina": (places(), relief(bearing, length, places()), stress_riser() ** OF_RINGS),
        "needle_fit": _fits(outer),
        "in_line": _in_line(bearing, length, outer),
    }


def _in_line(bearing: Bearing, length: float, outer: float) -> Array:
    """Log of the force in line and without clearance, over `needle_k`, at equidistant logs of damage, (IN_LINE,)."""
    half = LAMINAE // 2  # the other half is its mirror image
    lost = relief(bearing, length, places()[:half])
    r = np.geomspace(1e-9, 1e-2, 100)[:, None] + lost.min()
    delta = np.maximum(r - lost, 1e-300)
    share = (delta / r).ravel()
    force = (delta.ravel() ** (10.0 / 9.0) * loaded(share, _along)).reshape(delta.shape).mean(axis=1)
    damage = (delta.ravel() ** 5 * _damage(share, outer)).reshape(delta.shape) @ (
        2.0 * stress_riser()[:half] ** OF_RINGS
    )
    wanted = LEAST_DAMAGE + np.arange(IN_LINE)
    return np.asarray(np.interp(wanted, np.log(damage), np.log(bearing.needles * force)))


def _along(x: Array, cosine: Array) -> Array:
    return np.asarray(x ** (10.0 / 9.0) * cosine)


def _damage(share: Array, outer: float) -> Array:
    """Damage of both rings, in units of that of a lamina's load: inner 4 in the mean, outer 9/2, by weight `outer`."""
    inner = loaded(share, lambda x, _: x ** (40.0 / 9.0)) ** (9.0 / 8.0)
    return np.asarray(inner + outer * loaded(share, lambda x, _: x**5))


@cache
def _fits(outer: float) -> Array:
    """Coefficients of force, damage and power of the approach, shape (3, TERMS); `outer`: weight of the outer ring."""
    v = np.linspace(LEAST_SHARE**0.5, 1.0, 400)
    u, t = v**2, np.linspace(0.45, 1.3, 400)
    return np.array(
        [
            _fit(u, loaded(u, _along) / v, 5),
            _fit(v, _damage(u, outer) / v, TERMS),
            _fit(t, t ** (8.0 / 9.0) * ACROSS_NEEDLES ** (1.0 / 9.0), 5),
        ]
    )


def _fit(x: Array, values: Array, terms: int) -> Array:
    """Coefficients of the polynomial with the least relative errors, padded to `TERMS`."""
    powers = np.vander(x, terms, increasing=True) / values[:, None]
    return np.pad(np.linalg.lstsq(powers, np.ones_like(x), rcond=None)[0], (0, TERMS - terms))
