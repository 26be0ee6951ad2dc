"""Rating life of roller bearings that swing to and fro, on plain arrays (ISO 281; docs/model.md, Bearing life).

The life of a bearing is counted in equivalent revolutions: a swing counts for its travel over a whole turn. This is the
oscillation factor of Harris, which takes no account of how the load moves over the rings (Houpert and Menck 2022, Menck
and Stammler 2024). Small swings count for more, since they stress parts of the rings only (Rumbarger and Jones 1968).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.analysis.estimates import Estimate
from tolstat.common.bisection import first
from tolstat.common.late import special
from tolstat.common.loads import FloatArray
from tolstat.common.tables import LIFE_EXPONENT

WEIBULL_SLOPE = 9 / 8
"""Slope e of the lives of bearings with line contact (Lundberg and Palmgren 1952): combines bearings of a joint."""
STEEL = 206e9 / (1.0 - 0.3**2)
"""Young's modulus of steel over 1 - nu^2, Pa."""
FRETTING = 0.5
"""Part of the critical amplitude below which fretting is to be expected (Harris, Rumbarger and Butterfield 2009)."""
_RELIABILITY = (0.9, 0.95, 0.96, 0.97, 0.98, 0.99, 0.992, 0.994, 0.996, 0.998, 0.999, 0.9992, 0.9994, 0.9995)
_FACTOR = (1.0, 0.64, 0.55, 0.47, 0.37, 0.25, 0.22, 0.19, 0.16, 0.12, 0.093, 0.087, 0.080, 0.077)
A1 = dict(zip(_RELIABILITY, _FACTOR, strict=True))
"""Life modification factor a_1 by reliability (ISO 281:2007, Table 12)."""


def basic_life(load: ArrayLike, rating: ArrayLike) -> FloatArray:
    """Basic rating life L10 of a roller bearing.

    Parameters
    ----------
    load : array_like
        Dynamic equivalent load P, N.
    rating : array_like
        Basic dynamic load rating C, N.

    Returns
    -------
    ndarray
        Equivalent revolutions, shape of `load`; infinite without load.

    Examples
    --------
    >>> round(float(basic_life(1000.0, 10e3)) / 1e6, 1)  # million
    2154.4
    """
    with np.errstate(divide="ignore"):
        return np.asarray(1e6 * (np.asarray(rating, float) / np.asarray(load, float)) ** LIFE_EXPONENT)


def line_pressure(line_load: ArrayLike, needle: ArrayLike, pin: ArrayLike) -> FloatArray:
    """Largest pressure between a needle and a pin of steel (Hertz 1882).

    Parameters
    ----------
    line_load : array_like
        Force by length, N/m.
    needle, pin : array_like
        Diameters, m.

    Returns
    -------
    ndarray
        Pa.

    Examples
    --------
    >>> round(float(line_pressure(100e3, 4e-3, 38e-3)) / 1e6)  # MPa
    1411
    """
    curvature = 2.0 / np.asarray(needle, float) + 2.0 / np.asarray(pin, float)
    return np.asarray(np.sqrt(np.asarray(line_load, float) * STEEL / (2.0 * np.pi) * curvature))


def turns_per_revolution(alpha: ArrayLike, critical: ArrayLike = 0.0) -> FloatArray:
    """Equivalent revolutions of a pin's bearing in a revolution of the shaft.

    Below the critical amplitude each needle stresses a part of the raceway of its own: the stressed volume V is in
    proportion to the swing, and each point of it is passed twice a revolution of the shaft, however small the swing is.
    With ln(1/S) in proportion to N^e V (Lundberg and Palmgren 1952) the life goes with the swing to the power -1/e, not
    -1. At the critical amplitude both are equal.

    Parameters
    ----------
    alpha : array_like
        Misalignment, rad. Each pin swings from -alpha to alpha and back once a revolution.
    critical : array_like
        Critical amplitude, rad, see `critical_amplitude`.

    Examples
    --------
    >>> round(float(turns_per_revolution(np.deg2rad(90.0))), 12)
    1.0
    >>> round(float(turns_per_revolution(0.1, 0.2) / turns_per_revolution(0.1)), 12) == round(2 ** (1 / 9), 12)
    True
    """
    swing = np.abs(np.asarray(alpha, float))
    with np.errstate(divide="ignore", invalid="ignore"):
        part = np.where(swing < critical, critical / swing, 1.0)
        return np.where(swing > 0.0, 4.0 * swing / (2.0 * np.pi) * part ** (1.0 - 1.0 / WEIBULL_SLOPE), 0.0)


def system_life(lives: ArrayLike) -> FloatArray:
    """Life, of the same reliability, until the first of several bearings fails.

    Parameters
    ----------
    lives : array_like, shape (..., m)
        Lives of m bearings with independent Weibull distributions of slope `WEIBULL_SLOPE`, any unit.

    Returns
    -------
    ndarray, shape (...)
        In the unit of `lives`.

    Examples
    --------
    >>> round(float(system_life([100.0, 100.0])), 2)
    54.0
    """
    with np.errstate(divide="ignore"):
        return np.asarray((np.asarray(lives, float) ** -WEIBULL_SLOPE).sum(axis=-1) ** (-1.0 / WEIBULL_SLOPE))


def population_life(
    lives: ArrayLike, reliability: float, groups: NDArray[np.intp] | None, confidence: float = 0.95
) -> Estimate[float]:
    """Life that a share of a population reaches whose members have different loads: both scatter, load and life itself.

    The interval is Student's t over groups of the mean survival at the estimate, taken to the log of the life by the
    derivative of the survival (delta method; Serfling 1980, section 7.2).

    Parameters
    ----------
    lives : array_like, shape (n,)
        Life of each member's load, which a share `reliability` of members with this load reaches: quantiles of Weibull
        distributions of slope `WEIBULL_SLOPE`; any unit.
    reliability : float
        The share, of the population, too.
    groups : ndarray of int, shape (n,), or None
        Number of the independent group of each member; None: no interval.
    confidence : float
        Confidence level of the interval.

    Returns
    -------
    Estimate
        In the unit of `lives`; ends are NaN without at least two groups.

    Examples
    --------
    >>> round(population_life([100.0, 100.0], 0.9, None).estimate, 6)
    100.0
    """
    known = np.asarray(lives, float)

    def survival(log_time: float) -> FloatArray:
        return np.asarray(reliability ** ((np.exp(log_time) / known) ** WEIBULL_SLOPE))

    def failed(log_time: float) -> bool:
        return bool(np.mean(survival(log_time)) <= reliability)

    log_time = float(first(failed, np.log(known.min()), np.log(known.max())))
    own = survival(log_time)
    sums = np.zeros(0) if groups is None else np.bincount(np.unique(groups, return_inverse=True)[1], own - own.mean())
    if sums.size < 2:
        return Estimate(float(np.exp(log_time)), np.nan, np.nan)
    error = np.sqrt((sums**2).sum() * sums.size / (sums.size - 1)) / own.size
    t = special.stdtrit(sums.size - 1, 0.5 + 0.5 * confidence)
    half = t * error / abs(WEIBULL_SLOPE * np.mean(own * np.log(own)))
    return Estimate(*(float(np.exp(log_time + off)) for off in (0.0, -half, half)))


def critical_amplitude(needles: int, needle_diameter: float, pitch_diameter: float) -> float:
    """Amplitude of a swing from which on the tracks of neighbouring needles overlap on both raceways.

    When one ring turns by an angle, a needle travels (1 - gamma)/2 of it on the outer raceway and (1 + gamma)/2 on the
    inner one, gamma the ratio of the diameters. Tracks overlap where the travel reaches the pitch of the needles.

    Parameters
    ----------
    needles : int
        Number of needles.
    needle_diameter, pitch_diameter : float
        Of a needle, and of the circle of their axes; one unit.

    Returns
    -------
    float
        Half the swing from end to end, rad.

    Examples
    --------
    >>> round(float(np.rad2deg(critical_amplitude(32, 4.0, 42.0))), 2)
    12.43
    """
    return float(2.0 * np.pi / (needles * (1.0 - needle_diameter / pitch_diameter)))
