"""Nominal errors, and `perturb`, which alone turns manufacturing errors into model parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.common.cardan import ARM_QUARTERS, PIN_QUARTERS
from tolstat.common.mechanism import OBLIQUE, Mechanism, prefixes
from tolstat.common.parameters import MAX_STATIONS
from tolstat.common.tables import FACTORS, blank_params, tables
from tolstat.joint import material, orders
from tolstat.joint.contact import Contact
from tolstat.joint.material import Array
from tolstat.joint.model import Joint
from tolstat.joint.operation import MEANS, SPLINE, Operation, joints_of, mechanism_of, shaft_of, unbalances
from tolstat.joint.sections import RIGID, Arm, Hub, Pin
from tolstat.joint.shaft import DriveShaft, Lumped
from tolstat.joint.spline import Spline

Table = NDArray[np.void]
Place = tuple[float, float, float]


def _triads(quarters: Sequence[int]) -> Array:
    """Rows e, t, z of triads after quarter turns about z, (n, 3, 3)."""
    e = np.array([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0)])[list(quarters)]
    z = np.tile((0.0, 0.0, 1.0), (len(e), 1))
    return np.stack([e, np.cross(z, e), z], axis=1)


PIN_TRIADS: Array = _triads(PIN_QUARTERS)
"""Rows e, t, z of pins 1 to 4 in axes of the cross frame C; shape (4, 3, 3)."""

ARM_TRIADS: Array = _triads(ARM_QUARTERS)
"""Rows e, t, z of arms 1, 2 (input frame I) and 3, 4 (output frame F); shape (4, 3, 3)."""


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
    values = {name: getattr(operation, name) + errors[f"operation.{name}"] for name in MEANS}
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
    shaft, own = shaft_of(operation), dict(zip(prefixes(mechanism), joints_of(joint, operation), strict=True))
    last = own[prefixes(mechanism)[-1]]
    for name, value in _constants(joint, last).items():
        params[name] = value
    params["R"] = min(each.cross.R for each in own.values())
    for name, of_kinds in _of_kinds(own, shaft).items():
        kinds = mechanism.lump_kinds if name in OF_LUMPS else mechanism.bushing_kinds
        params[name] = [of_kinds[kind] for kind in kinds]
    for k, each in enumerate(own.values()):
        for name, value in _of_pairs(each).items():
            params[name][:, k] = value
        if each.friction.mu is not None:
            params["mu"][:, k] = each.friction.mu + errors["friction.mu"]
    point = operating(operation, errors, last.shaft.spline)
    params["alpha"][:, 0], params["omega"], params["torque"] = point["alpha"], point["speed"], point["torque"]
    lumps = mechanism.lumps
    triads = dict(zip([lump.name for lump in lumps], _triads([lump.quarters % OBLIQUE for lump in lumps]), strict=True))
    if shaft is not None:
        params["plane"][:, 1], params["span"][:, 1] = shaft.plane, shaft.length
        params["alpha"][:, 1] = shaft.alpha + errors["shaft.alpha"]
        params["ahead"][:, 1] = 0.5 * np.pi + shaft.offset + errors["shaft.offset"]
        triads |= _on_tube(params["ahead"][:, 1] + shaft.plane)
        params["triad"] = np.stack(np.broadcast_arrays(*(triads[lump.name] for lump in lumps)), axis=1)
    if last.shaft.slides:
        params["F_a"] = point["axial_force"]
    swings = [errors[f"operation.{name}_swing"] for name in ("speed", "torque")]
    for name, value in orders.parameters(operation.speed_orders, operation.torque_orders, *swings).items():
        params[name] = value
    factor = errors["material.E_factor"]
    params["k"] *= factor[:, None, None]
    for name in ("station_k1", "station_k2", "station_k3"):
        params[name] *= factor[:, None, None]
    with np.errstate(invalid="ignore"):  # a negative modulus gives NaN, which the kernel reports
        params["c"] *= np.sqrt(factor)[:, None, None]
    for i, (pin, hole, _, kind) in enumerate(mechanism.pairs):
        params["pin_point"][:, i], params["pin_axis"][:, i] = _axis(errors, pin, triads[pin])
        params["hole_point"][:, i], params["hole_axis"][:, i] = _axis(errors, hole, triads[hole])
        deviations = (errors[f"{hole}.diameter"], errors[f"{pin}.diameter"], errors[f"{pin}.clearance"])
        params["clearance"][:, i] = _clearance(own[kind.removesuffix("bearing")].contact, *deviations)
    for i, face in enumerate(mechanism.faces):
        name = face.name.rstrip("1234")
        each = own[name.removesuffix("thrust")]
        half, play = 0.5 * each.contact.z, (each.thrust.end_play if each.thrust else 0.0) + errors[f"{name}.end_play"]
        params["face_at"][:, i] = np.stack(np.broadcast_arrays(half, half + 0.5 * play), axis=-1)
    if shaft is not None and shaft.spline is not None:
        params["push"] = _sticking(errors, shaft.spline, point["torque"])
    of_bodies = unbalances(joint, operation)
    for i, body in enumerate(mechanism.unbalanced):
        unbalance, mass = of_bodies[body]
        size = (unbalance.size(mass) if unbalance else 0.0) + errors[f"{body}.unbalance"]
        angle = (unbalance.angle or 0.0 if unbalance else 0.0) + errors[f"{body}.unbalance_angle"]
        params["unbalance"][:, i] = (size * np.array([np.cos(angle), np.sin(angle)])).T
    return params


def _constants(first: Joint, last: Joint) -> dict[str, Any]:
    """Parameters of the outer shafts, which do not depend on the errors."""
    shaft = last.shaft
    return {
        "Js": shaft.Js,
        "bearing_at": np.reshape(
            [
                sign * np.array(ends.bearings)
                for sign, ends in ((-1.0, first.shaft.input), (1.0, shaft.output))
                if ends is not None
            ],
            (-1, 2),
        ),
        "slides": shaft.slides,
        "m_s": shaft.mass if shaft.slides or shaft.lateral != RIGID else 0.0,
        "k_l": shaft.k_l,
        "c_l": 2 * last.bushing.xi * math.sqrt(shaft.k_l * (shaft.mass or 0.0)),
        "k_a": shaft.k_a,
        "c_a": shaft.axial_damping if shaft.slides else 0.0,
    }


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
    }


OF_LUMPS = ("mass", "inertia", "at")
"""Parameters of kinds of lumps; others of `_of_kinds` are of kinds of bushings."""


def _of_kinds(own: Mapping[str, Joint], shaft: DriveShaft | None) -> dict[str, dict[str, Any]]:
    """Parameters of lumps and bushings by kind, at factor 1 on E; `own`: joints by what stands before their parts."""
    *_, last = own.values()
    of: dict[str, dict[str, Any]] = {name: {} for name in (*OF_LUMPS, "k", "c", "marker")}

    def lump(kind: str, body: Hub | Pin | Arm | Lumped, at: Place) -> None:
        of["mass"][kind], of["inertia"][kind], of["at"][kind] = body.mass, body.inertia, at

    def bushing(kind: str, k: Array, body: Pin | Arm | Lumped, markers: Sequence[Place], joint: Joint) -> None:
        damping = material.bushing_damping(k, body.mass, np.array(body.inertia), joint.bushing.xi)
        of["k"][kind], of["c"][kind], of["marker"][kind] = k, damping, markers

    tubes = {} if shaft is None else shaft.tubes
    # distance of the base's reference point from the joint's centre, along the base
    ends = {"input": 0.0, "output": 0.0}
    if shaft is not None:
        at = [tube.at for tube in tubes.values()]
        ends = {
            "joint1.input": 0.0,
            "joint1.output": at[0],
            "joint2.input": at[-1] - shaft.length,
            "joint2.output": 0.0,
        }
    for end, base in ends.items():
        prefix = end.removesuffix("input").removesuffix("output")
        side, joint = -1.0 if end.endswith("input") else 1.0, own[prefix]
        R, r_b, l_f = joint.cross.R, joint.cross.r_b, joint.arm.l_f
        lump(f"{prefix}hub", joint.hub, (0.0, 0.0, 0.0))
        lump(f"{prefix}pin", joint.pin, (R, 0.0, 0.0))
        lump(f"{prefix}arm", joint.arm, (R, 0.0, 0.0))
        bushing(f"{prefix}cross", joint.k_cross, joint.pin, [(r_b - R, 0.0, 0.0), (r_b, 0.0, 0.0)], joint)
        fork = [(0.0, 0.0, side * l_f), (R, 0.0, side * l_f - base)]
        bushing(f"{end} fork", joint.k_fork, joint.arm, fork, joint)
    if shaft is not None:
        lump("joint2.arm of tube", last.arm, (last.cross.R, 0.0, shaft.length))
        for name, tube in tubes.items():
            lump(name, tube, (0.0, 0.0, tube.at))
        if spline := shaft.spline:
            k = np.array([*[spline.k_lateral] * 2, 0.0, *[spline.k_bending] * 2, spline.k_torsion])
            places = [(0.0, 0.0, spline.at - tubes[name].at) for name in ("tube2", "tube1")]
            bushing("spline", k, tubes["tube2"], places, last)
            of["c"]["spline"][2] = spline.axial_damping
    return of


def _on_tube(turned: Array) -> dict[str, Array]:
    """Triads, (n, 3, 3) each, of the arms of joint 2 in axes of the tube; `turned`: about the tube, rad, (n,)."""
    zero, one = np.zeros_like(turned), np.ones_like(turned)
    cosine, sine = np.cos(turned), np.sin(turned)
    attitude = np.moveaxis(np.array([[cosine, -sine, zero], [sine, cosine, zero], [zero, zero, one]]), -1, 0)
    return {f"joint2.hole{i}": np.einsum("nij,aj->nai", attitude, ARM_TRIADS[i - 1]) for i in (1, 2)}


def _axis(errors: Table, feature: str, triad: Array) -> tuple[Array, Array]:
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
