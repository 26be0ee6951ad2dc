"""Closed forms of the ideal joint: no errors, clearance or elasticity; inertia in `loads` and `reversal_torque` only.

Source: Seherr-Thoss, Schmelz, Aucktor (2006), Universal Joints and Driveshafts, ch. 4; Cirelli et al. (2021), eq. (2).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.common.cardan import CARDAN
from tolstat.common.errors import Fault, InputError
from tolstat.joint.material import Array

ARM = CARDAN.lump_kinds.index("arm")
NO_CLOSED_FORM = (
    "'ideal' does not hold with an axial force on an output shaft that is not rigid: its joint carries none",
    'write fidelity = "quasistatic", or leave the axial force out',
)
"""Fault of joints that have no closed form, and the remedy."""


def speed_ratio(theta: ArrayLike, alpha: ArrayLike) -> Array:
    """Speed ratio of output to input shaft (Cirelli et al. 2021, eq. 2).

    Parameters
    ----------
    theta, alpha : array_like
        Input angle and misalignment, rad; shapes that go together.

    Returns
    -------
    ndarray
    """
    return np.asarray(np.cos(alpha) / (1 - (np.sin(alpha) * np.cos(theta)) ** 2))


def steepness(theta: ArrayLike, alpha: ArrayLike) -> Array:
    """Derivative of `speed_ratio` with respect to the input angle."""
    below = 1 - (np.sin(alpha) * np.cos(theta)) ** 2
    return np.asarray(-np.cos(alpha) * np.sin(alpha) ** 2 * np.sin(2 * np.asarray(theta)) / below**2)


def output_angle(theta: ArrayLike, alpha: ArrayLike) -> Array:
    """Angle of the output shaft, tan(theta_o) = tan(theta) / cos(alpha), continuous in theta.

    Parameters and returned value in rad, as in `speed_ratio`.
    """
    theta = np.asarray(theta, float)
    advance = np.sin(theta) * np.cos(theta) * (1 - np.cos(alpha))
    return np.asarray(theta + np.arctan2(advance, np.cos(theta) ** 2 * np.cos(alpha) + np.sin(theta) ** 2))


def ratio_of_all(theta: ArrayLike, par: NDArray[np.void]) -> Array:
    """Speed ratio of the last output shaft to the first input shaft, of a joint or of drive shafts.

    Parameters
    ----------
    theta : array_like
        Input angle of the first joint, rad.
    par : row of PARAM
        The joints.

    Returns
    -------
    ndarray
    """
    ratio, angle = np.ones(np.shape(theta)), np.asarray(theta, float)
    for joint, alpha in enumerate(par["alpha"]):
        if joint:
            angle = output_angle(angle, par["alpha"][joint - 1]) + par["ahead"][joint]
        ratio *= speed_ratio(angle, alpha)
    return ratio


def reversal_torque(params: NDArray[np.void]) -> Array:
    """Mean torque below which orders, or the inertia of the output shaft, reverse the load within a revolution.

    The shaft and the two arms on it, moment of inertia J, are accelerated by w^2 dr/dtheta, r being the speed ratio
    (eq. 2). Where J w^2 max|dr/dtheta| exceeds the resisting torque, the transmitted torque changes its sign: the pins
    cross their clearances and impact. With orders the least of T_r + J d2theta_o/dt2 over the revolution decides.

    Parameters
    ----------
    params : ndarray of PARAM, shape (n,)
        Joints.

    Returns
    -------
    ndarray, shape (n,)
        N m.
    """
    inertia = params["Js"][:, 0] + 2 * (params["mass"][:, ARM] * params["R"] ** 2 + params["inertia"][:, ARM, 2])
    if (params["n_orders"] > 0).any():
        return _reversal_with_orders(params, inertia)
    theta = np.linspace(0, np.pi, 361)
    sine, cosine = np.sin(params["alpha"]), np.cos(params["alpha"])
    with np.errstate(divide="ignore", invalid="ignore"):  # an angle of 90 deg is outside the model
        steepest = np.abs(cosine * sine**2 * np.sin(2 * theta) / (1 - (sine * np.cos(theta)) ** 2) ** 2).max(axis=1)
    return np.asarray(inertia * params["omega"] ** 2 * steepest)


def input_motion(phase: ArrayLike, params: NDArray[np.void]) -> tuple[Array, Array, Array, Array]:
    """Input angle and resisting torque of joints with orders (docs/model.md, "Drive and load").

    Parameters
    ----------
    phase : array_like, shape (m,)
        Mean input angle, rad.
    params : ndarray of PARAM, shape (n,)
        Joints.

    Returns
    -------
    theta, slope, bend : ndarray, shape (n, m)
        Input angle (rad), its first and second derivative with respect to the phase.
    torque : ndarray, shape (n, m)
        Resisting torque, N m.
    """
    phase = np.asarray(phase, float)
    n = params["order"][:, :, None]
    waves = np.stack([np.cos(n * phase), np.sin(n * phase)], axis=2)
    slopes = np.stack([-n * waves[:, :, 1], n * waves[:, :, 0]], axis=2)
    turned = np.einsum("nok,nokm->nm", params["speed_order"], waves)
    slope = 1 + np.einsum("nok,nokm->nm", params["speed_order"], slopes)
    bend = -np.einsum("nok,nokm->nm", params["speed_order"], n[:, :, None] ** 2 * waves)
    torque = params["torque"][:, None] + np.einsum("nok,nokm->nm", params["torque_order"], waves)
    return phase + turned, slope, bend, torque


def _reversal_with_orders(params: NDArray[np.void], inertia: Array) -> Array:
    """`reversal_torque` of joints with orders; `inertia` of the output shaft and its arms, kg m^2, (n,)."""
    theta, slope, bend, torque = input_motion(np.linspace(0, 2 * np.pi, 721), params)
    alpha = params["alpha"]
    with np.errstate(divide="ignore", invalid="ignore"):
        bending = steepness(theta, alpha) * slope**2 + speed_ratio(theta, alpha) * bend
        turning = params["omega"][:, None] ** 2 * bending
    mean = params["torque"][:, None]
    swing = torque - mean + inertia[:, None] * turning
    return np.asarray(-(np.where(mean < 0, -1.0, 1.0) * swing).min(axis=1))


def check(params: NDArray[np.void]) -> None:
    """Refuse joints whose output shaft an axial force moves: they have no closed form.

    Parameters
    ----------
    params : ndarray of PARAM, shape (n,)
        Joints.

    Raises
    ------
    InputError
        When there is such a joint.
    """
    if np.any((params["slides"] != 0.0) & (params["F_a"] != 0.0)):
        raise InputError([Fault("fidelity", *NO_CLOSED_FORM)])


def loads(theta: ArrayLike, par: NDArray[np.void]) -> tuple[Array, Array]:
    """Loads of all bushings and contact forces of the ideal joint at its operating point.

    Each pin touches the outer end of its hole, R + z/2 from the centre (R + the outermost station's distance with the
    law ``sliced``), as it does once the cross has turned through its clearance; without clearance both ends touch and
    the force acts closer to the centre. The inertial loads of the ideal motion are included: centrifugal loads, the
    couple that moves the cross, inertia of the output shaft and its arms. Without them each pin takes M / (2 R) of the
    couple M = T / cos(gamma), sin(gamma) = sin(alpha) cos(theta); in the forks' axes there are secondary couples, up to
    T sin(alpha) on the input side and T tan(alpha) on the output side.

    Parameters
    ----------
    theta : array_like, shape (n,)
        Input angle, rad.
    par : ndarray of PARAM, shape (1,)
        The joint; its errors and clearances are ignored.

    Returns
    -------
    loads : ndarray, shape (n, 8, 6)
        Force e, t, z (N) and torque e, t, z (N m) of the bushings cross 1-4, fork 1-4 on the lump, at the base
        marker and in its axes.
    contact : ndarray, shape (n, 4)
        Force between each pin and its hole, N.

    Raises
    ------
    InputError
        See `check`.
    """
    from tolstat.kernel.cardan.ideal_loads import ideal_loads
    from tolstat.kernel.mechanics.work import work_dtype

    check(par)
    angles = np.atleast_1d(np.asarray(theta, float))
    row: Any = par.view(np.recarray)[0]
    work, at_rest = np.zeros(1, work_dtype()).view(np.recarray)[0], np.zeros(CARDAN.dof)
    load, contact = np.empty((angles.size, 8, 6)), np.empty((angles.size, 4))
    for i, angle in enumerate(angles):
        ideal_loads(angle, at_rest, row, work)
        load[i], contact[i] = work.load, work.contact[:, 0]
    return load, contact
