"""Closed forms of the ideal joint without inertia: couple and forces that its pins transmit."""

import numpy as np


def cross_couple(theta, alpha, torque):
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


def pin_force(theta, alpha, torque, radius):
    """Force on each pin when the couple acts at `radius` (m) from the centre: M / (2 radius), N.

    Other parameters as in `cross_couple`.
    """
    return cross_couple(theta, alpha, torque) / (2 * radius)
