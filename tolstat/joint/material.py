"""Closed forms of material and geometry: lumped inertia, contact stiffness, damping.

Equation and table numbers are those of Cirelli, Rossi, Valentini and Pennestrì, "A dynamic model of a
Cardan joint to evaluate the effect of elasticity and manufacturing errors" (2021). SI units throughout.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FIT_LOADS = 100
"""Number of loads at which the fit samples eq. (3); ten times as many change k1 by 0.2 % and k2 by 0.05 %."""


def bushing_damping(k: Array, mass: float, inertia: Array, xi: float) -> Array:
    """Damping of a bushing from its stiffness, eq. (12): c = 2 xi sqrt(k m) or 2 xi sqrt(k J).

    Parameters
    ----------
    k : ndarray, shape (6,)
        Stiffness along and about (e, t, z) (N/m, N*m/rad).
    mass : float
        Mass of the lump (kg).
    inertia : ndarray, shape (3,)
        Inertia of the lump about (e, t, z) (kg*m^2).
    xi : float
        Damping ratio.

    Returns
    -------
    ndarray, shape (6,)
        Damping (N*s/m, N*m*s/rad).
    """
    lumped = np.concatenate([np.full(3, mass), inertia])
    return np.asarray(2.0 * xi * np.sqrt(k * lumped))


def cylinder_inertia(mass: float, diameter: float, length: float) -> tuple[float, float, float]:
    """Inertia (kg*m^2) of a solid cylinder along e about (e, t, z) through its centre."""
    across = mass * (diameter**2 / 16.0 + length**2 / 12.0)
    return mass * diameter**2 / 8.0, across, across


def box_inertia(mass: float, A: float, Jx: float, Jy: float, length: float) -> tuple[float, float, float]:
    """Inertia (kg*m^2) about (e, t, z) of a box along z whose section has the area moments of the beam.

    The beam's x is t and its y is e: Jy = A (width along t)^2 / 12, Jx = A (width along e)^2 / 12.
    """
    wide_t, wide_e = Jy / A, Jx / A  # a twelfth of the squared widths
    long_z = length**2 / 12.0
    return mass * (wide_t + long_z), mass * (wide_e + long_z), mass * (wide_e + wide_t)


def diameter_factor(D_H: float, D_P: float) -> float:
    """K_D = D_H D_P / (D_H - D_P) (m) of hole and pin diameters (m); eq. (3)."""
    return D_H * D_P / (D_H - D_P)


def compliance_factor(E: float, nu: float) -> float:
    """C_E = 2 (1 - nu^2) / E (1/Pa) of two bodies of the same material; eq. (3)."""
    return 2.0 * (1.0 - nu**2) / E


def contact_displacement(load: Array, D_H: float, D_P: float, E: float, nu: float) -> Array:
    """Approach of the axes of a pin and its hole in uniform contact, eq. (3) (Hertz; Young 2011).

    Parameters
    ----------
    load : ndarray, shape (n,)
        Contact load per unit length F_c (N/m), above zero.
    D_H, D_P : float
        Diameters of hole and pin (m), ``D_H > D_P``.
    E, nu : float
        Young's modulus (Pa), Poisson's ratio.

    Returns
    -------
    ndarray, shape (n,)
        Displacement delta (m) beyond first touch.
    """
    C_E = compliance_factor(E, nu)
    b = 1.6 * np.sqrt(load * diameter_factor(D_H, D_P) * C_E)  # width of the contact area, m
    logs = 2.0 / 3.0 + np.log(2.0 * D_H / b) + np.log(2.0 * D_P / b)
    return np.asarray(C_E * load / math.pi * logs)


def fit_contact(load_range: float, z: float, D_H: float, D_P: float, E: float, nu: float) -> tuple[float, float]:
    """Fit F = k1 delta^2 + k2 delta, eq. (5), to eq. (3) over loads up to `load_range`.

    Least squares of the force at `FIT_LOADS` equally spaced loads above zero.

    Parameters
    ----------
    load_range : float
        Largest load of the fit (N) on the whole contact length.
    z : float
        Length of the contact (m): F_c = F / z.
    D_H, D_P, E, nu : float
        See `contact_displacement`.

    Returns
    -------
    k1u, k2u : float
        Quadratic (N/m^2) and linear (N/m) coefficient of uniform contact; NaN where eq. (3) stops rising before
        `load_range`, because the logarithms of 2 D / b become too small.
    """
    force = np.linspace(0.0, load_range, FIT_LOADS + 1)[1:]
    delta = contact_displacement(force / z, D_H, D_P, E, nu)
    if not (np.diff(delta) > 0.0).all():
        return math.nan, math.nan
    scale = delta[-1]
    x = delta / scale
    (k1, k2), *_ = np.linalg.lstsq(np.column_stack([x * x, x]), force, rcond=None)
    return float(k1 / scale**2), float(k2 / scale)


def contact_damping(xi: float, mass: float, *, length: float, A: float, J: float, E: float, rho: float) -> float:
    """Damping of a contact, eqs. (6)-(7): c = 2 xi m omega, with omega of the pin as a cantilever.

    Parameters
    ----------
    xi, mass : float
        Damping ratio; mass of the pin (kg).
    length, A, J : float
        Length (m), section area (m^2) and area moment (m^4) of the pin.
    E, rho : float
        Young's modulus (Pa) and density (kg/m^3).

    Returns
    -------
    float
        Damping (N*s/m).
    """
    omega = (math.pi / length) ** 2 * math.sqrt(E * J / (rho * A))
    return 2.0 * xi * mass * omega


def circle(d: float) -> tuple[float, float]:
    """Area pi d^2/4 (m^2) and area moment pi d^4/64 (m^4) of a circle of diameter `d` (m)."""
    squared = d * d
    return math.pi / 4.0 * squared, math.pi / 64.0 * squared * squared


def crossed_cylinders(rho: float, d: float, length: float) -> tuple[float, tuple[float, float, float]]:
    """Mass and inertia of two equal cylinders along x and y that cross at their middles.

    Parameters
    ----------
    rho : float
        Density (kg/m^3).
    d, length : float
        Diameter and length of each (m).

    Returns
    -------
    mass : float
        kg.
    inertia : tuple of float
        About x, y, z through the middle (kg*m^2).
    """
    r = 0.5 * d
    cylinder = rho * circle(d)[0] * length
    along, across, _ = cylinder_inertia(cylinder, d, length)
    # the part that both have in common: |x| and |y| up to sqrt(r^2 - z^2)
    common, flat, upright = rho * 16.0 / 3.0 * r**3, rho * 112.0 / 45.0 * r**5, rho * 128.0 / 45.0 * r**5
    in_plane = along + across - flat
    return 2.0 * cylinder - common, (in_plane, in_plane, 2.0 * across - upright)
