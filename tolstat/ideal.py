"""Closed forms of the ideal joint: no errors, no clearance, no elasticity, no inertia.

Truth for tests and baseline of reports. Source: Seherr-Thoss, Schmelz, Aucktor (2006), Universal Joints and
Driveshafts, ch. 4; Cirelli et al. (2021), eq. (2).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def speed_ratio(theta: ArrayLike, alpha: float) -> Array:
    """Speed ratio of output to input shaft (Cirelli et al. 2021, eq. 2).

    Parameters
    ----------
    theta : array_like
        Input angle, rad.
    alpha : float
        Misalignment, rad.

    Returns
    -------
    ndarray
        Same shape as `theta`.
    """
    return np.asarray(np.cos(alpha) / (1 - (np.sin(alpha) * np.cos(theta)) ** 2))


def output_angle(theta: ArrayLike, alpha: float) -> Array:
    """Angle of the output shaft, tan(theta_o) = tan(theta) / cos(alpha), following theta without jumps.

    Parameters and returned value in rad, as in `speed_ratio`.
    """
    theta = np.asarray(theta, float)
    advance = np.sin(theta) * np.cos(theta) * (1 - np.cos(alpha))
    return np.asarray(theta + np.arctan2(advance, np.cos(theta) ** 2 * np.cos(alpha) + np.sin(theta) ** 2))


def cross_angle(theta: ArrayLike, alpha: float) -> Array:
    """Rotation beta of the cross in the input fork, tan(beta) = tan(alpha) sin(theta), rad."""
    return np.asarray(np.arctan(np.tan(alpha) * np.sin(theta)))


def cross_couple(theta: ArrayLike, alpha: float, torque: float) -> Array:
    """Couple that the forks exert on the cross about its normal when the output carries a constant torque.

    Frictionless pins transmit no moment about their own axes, so input and output couples both lie along the normal
    of the cross; its component along the output shaft is the torque: M = T / cos(gamma), sin(gamma) = sin(alpha)
    cos(theta). It runs between T and T / cos(alpha).

    Parameters
    ----------
    theta : array_like
        Input angle, rad.
    alpha : float
        Misalignment, rad.
    torque : float
        Output torque, N m.

    Returns
    -------
    ndarray
        N m, same shape as `theta`.
    """
    return np.asarray(torque / np.sqrt(1 - (np.sin(alpha) * np.cos(theta)) ** 2))


def pin_force(theta: ArrayLike, alpha: float, torque: float, radius: float) -> Array:
    """Force on each pin when the couple acts at `radius` (m) from the centre: M / (2 radius), N.

    Other parameters as in `cross_couple`.
    """
    return cross_couple(theta, alpha, torque) / (2 * radius)
