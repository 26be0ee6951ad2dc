"""Nominal errors, and `perturb`, which alone turns manufacturing errors into model parameters."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.common.mechanism import Mechanism, with_play
from tolstat.common.parameters import MAX_STATIONS
from tolstat.common.tables import FACTORS, blank_params, tables
from tolstat.joint import bodies, laminae, linked, orders
from tolstat.joint.contact import Contact
from tolstat.joint.material import Array
from tolstat.joint.model import Joint
from tolstat.joint.operation import (
    MEANS,
    SPLINE,
    Operation,
    OperationOfLinkage,
    joints_of,
    mechanism_of,
    shaft_of,
    unbalances,
)
from tolstat.joint.spline import Spline

Table = NDArray[np.void]


def nominal_errors(n: int, mechanism: Mechanism) -> Table:
    """Table of `n` joints without errors.

    Returns
    -------
    ndarray, shape (n,), dtype ERROR
        Zero deviations, factors 1.
    """
    errors = np.zeros(n, tables(mechanism).ERROR)
    for name in FACTORS:
        errors[name] = 1.0
    return errors


def operating(operation: Operation, errors: Table, spline: Spline | None = None) -> dict[str, Array]:
    """Values that joints have at an operating point: those of the point, and each joint's deviations from them.

    The axial force includes that of the `spline`, which follows each joint's torque.

    Returns
    -------
    dict of str to ndarray, shape (n,)
        ``alpha`` (rad), ``speed`` (rad/s), ``torque`` (N m) and ``axial_force`` (N).
    """
    values = {name: np.full(errors.shape, float(getattr(operation, name))) for name in MEANS}
    for name in MEANS:
        if f"operation.{name}" in (errors.dtype.names or ()):
            values[name] += errors[f"operation.{name}"]
    if spline is not None:
        values["axial_force"] = values["axial_force"] + _sticking(errors, spline, values["torque"])
    return values


def _sticking(errors: Table, spline: Spline, torque: Array) -> Array:
    """Force of a spline that sticks, N, (n,); NaN where it is above the largest one."""
    share = errors[SPLINE]
    return np.where(abs(share) <= 1.0, share, np.nan) * spline.largest_force(torque)


def perturb(joint: Joint, operation: Operation, errors: Table) -> Table:
    """Turn a table of errors into a table of parameters of the mechanical model.

    Position errors, tilts, diameters and clearances affect the contacts only: they change no marker, mass, inertia or
    stiffness. The factor on E scales stiffness and contact coefficients in proportion and bushing damping by its
    square root, eq. (12); it does not change contact damping, nor what holds the output shaft along its axis.

    Parameters
    ----------
    joint : Joint
        The nominal joint; of a drive shaft joint 1.
    operation : Operation
        The operating point, which has joint 2 if that differs; errors of it are deviations that are added.
    errors : ndarray, shape (n,), dtype ERROR
        Row i holds the errors of joint i.

    Returns
    -------
    ndarray, shape (n,), dtype PARAM
        Row i holds the parameters of joint i.
    """
    mechanism = mechanism_of(joint, operation)
    params = blank_params(len(errors), mechanism)
    own = dict(zip(mechanism.pair_kinds, joints_of(joint, operation), strict=True))
    for k, each in enumerate(own.values()):
        for name, value in _of_pairs(each).items():
            params[name][:, k] = value
        if each.friction.mu is not None:
            params["mu"][:, k] = each.friction.mu + errors["friction.mu"]
    *_, last = own.values()
    shaft, slack = shaft_of(operation), [0.0] * len(mechanism.pairs)
    if isinstance(operation, OperationOfLinkage):
        point, slack = operating(operation, errors), linked.added_clearances(operation.linkage, joint)
        triads = linked.write(params, operation.linkage, joint, mechanism)
    else:
        point = operating(operation, errors, last.shaft.spline)
        triads = bodies.write(params, own, shaft, errors, mechanism)
        params["alpha"][:, 0] = point["alpha"]
        if last.shaft.slides:
            params["F_a"] = point["axial_force"]
    params["omega"], params["torque"] = point["speed"], point["torque"]
    swings = [errors[f"operation.{name}_swing"] for name in ("speed", "torque")]
    for name, value in orders.parameters(operation.speed_orders, operation.torque_orders, *swings).items():
        params[name] = value
    factor = errors["material.E_factor"]
    params["k"] *= factor[:, None, None]
    for name in ("station_k1", "station_k2", "station_k3"):
        params[name] *= factor[:, None, None]
    params["needle_k"] *= factor[:, None]
    with np.errstate(invalid="ignore"):  # a negative modulus gives NaN, which the kernel reports
        params["c"] *= np.sqrt(factor)[:, None, None]
    held = {}
    for i, (pin, hole, _, kind) in enumerate(mechanism.pairs):
        held[pin] = own[kind]
        params["pin_point"][:, i], params["pin_axis"][:, i] = axis(errors, pin, triads[pin])
        params["hole_point"][:, i], params["hole_axis"][:, i] = axis(errors, hole, triads[hole])
        deviations = (errors[f"{hole}.diameter"], errors[f"{pin}.diameter"], errors[f"{pin}.clearance"] + slack[i])
        params["clearance"][:, i] = _clearance(held[pin].contact, *deviations)
    for i, face in enumerate(mechanism.faces):
        half, thrust = 0.5 * held[face.pin].contact.z, held[face.pin].thrust
        play = (thrust.end_play if thrust else 0.0) + errors[f"{with_play(mechanism, face)}.end_play"]
        params["face_at"][:, i] = face.end * np.stack(np.broadcast_arrays(half, half + 0.5 * play), axis=-1)
    if shaft is not None and shaft.spline is not None:
        params["push"] = _sticking(errors, shaft.spline, point["torque"])
    of_bodies = unbalances(joint, operation)
    for i, body in enumerate(mechanism.unbalanced):
        unbalance, mass = of_bodies[body]
        size = (unbalance.size(mass) if unbalance else 0.0) + errors[f"{body}.unbalance"]
        angle = (unbalance.angle or 0.0 if unbalance else 0.0) + errors[f"{body}.unbalance_angle"]
        params["unbalance"][:, i] = (size * np.array([np.cos(angle), np.sin(angle)])).T
    return params


def _of_pairs(joint: Joint) -> dict[str, Any]:
    """Parameters of the pins of a joint in their holes, at factor 1 on E."""
    contact, stations = joint.contact, joint.contact.springs(joint.bearing)
    unused = (0, MAX_STATIONS - len(stations.s))
    return {
        "face_k": joint.thrust.k if joint.thrust else 0.0,
        "face_c": joint.thrust.c if joint.thrust else 0.0,
        "friction_radius": joint.friction.radius or 0.5 * contact.D_P,
        "mu_ratio": joint.friction.ratio,
        "slip_speed": joint.friction.slip_speed,
        "c_d": contact.c_d,
        "c_t": contact.c_t,
        "delta_d": contact.delta_d,
        "n_stations": len(stations.s),
        "station_s": np.pad(stations.s, unused),
        "station_k1": np.pad(stations.k1, unused),
        "station_k2": np.pad(stations.k2, unused),
        "station_k3": np.pad(stations.k3, unused),
        "station_weight": np.pad(stations.weight, unused),
        "needle_b": stations.b,
        **laminae.parameters(joint.bearing, contact.z),
    }


def axis(errors: Table, feature: str, triad: Array) -> tuple[Array, Array]:
    """Shift and direction of a feature's axis in its frame, both of shape (n, 3).

    The direction is exp(epsilon x) e, epsilon = tilt_t t + tilt_z z, as a finite rotation; as epsilon is
    normal to e, Rodrigues' formula leaves cos|epsilon| e + sin|epsilon|/|epsilon| (epsilon x e). Angles beyond half a
    turn count as half a turn: 6.28 deg taken for 6.28 rad, nearly a whole turn, must not pass for a small tilt.
    """
    e, t, z = (triad[..., k, :] for k in range(3))
    point = sum(errors[f"{feature}.offset_{name}"][:, None] * axis for name, axis in zip("etz", (e, t, z), strict=True))
    about_t, about_z = errors[f"{feature}.tilt_t"], errors[f"{feature}.tilt_z"]
    angle = np.minimum(np.hypot(about_t, about_z), np.pi)
    ratio = np.sinc(angle / np.pi)
    axis = np.cos(angle)[:, None] * e + (ratio * about_z)[:, None] * t - (ratio * about_t)[:, None] * z
    return np.asarray(point), axis


def _clearance(contact: Contact, hole: Array, pin: Array, deviation: Array) -> Array:
    """Radial clearance (m) from deviations (m) of both diameters and of the clearance, shape (n,).

    Rounding errors about zero become zero: otherwise a pin meant to fit exactly could have an interference fit of
    1e-17 m.
    """
    clearance = 0.5 * ((contact.D_H + hole) - (contact.D_P + pin)) + deviation
    clearance[np.abs(clearance) < 4.0 * np.finfo(float).eps * contact.D_H] = 0.0
    return np.asarray(clearance)
