"""Operating point, nominal errors, and `perturb`, which alone turns manufacturing errors into model parameters."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema

from tolstat.common import units
from tolstat.common.fields import MAX_STATIONS
from tolstat.common.load_kinds import PINS
from tolstat.common.loads import split
from tolstat.common.strict import Strict
from tolstat.common.tables import ERROR, FACTORS, HOLES, PARAM
from tolstat.joint import material, orders
from tolstat.joint.contact import Contact
from tolstat.joint.material import Array
from tolstat.joint.model import Joint
from tolstat.joint.orders import Partner, add_partner, check_misalignment
from tolstat.joint.sections import Arm, Bushing, Pin
from tolstat.kernel.mechanics.topology import ARM, ARM_OF_PIN, PIN, TRIAD

Table = NDArray[np.void]


PIN_TRIADS: Array = TRIAD[PIN : PIN + 4]
"""Rows e, t, z of pins 1 to 4 in axes of the cross frame C; shape (4, 3, 3)."""

HOLE_OF_PIN: dict[str, str] = {pin: HOLES[arm] for pin, arm in zip(PINS, ARM_OF_PIN, strict=True)}
"""Hole in which each pin turns."""

ARM_TRIADS: Array = TRIAD[ARM : ARM + 4]
"""Rows e, t, z of arms 1, 2 (input frame I) and 3, 4 (output frame F); shape (4, 3, 3)."""


class Operation(Strict):
    """Operating point of the joint."""

    alpha: Annotated[units.Angle, AfterValidator(check_misalignment)] = Field(examples=["15 deg"])
    """misalignment of the shafts, below 90 deg"""
    speed: Annotated[units.Speed, AfterValidator(units.not_zero)] = Field(examples=["500 rpm"])
    """speed of the input shaft, with orders { mean, orders }, or measured { file }; negative: turns the other way"""
    torque: units.Torque = Field(examples=["100 N*m"])
    """resisting torque on the output shaft, with orders { mean, orders }, or measured { file }; negative: drives the
    output shaft"""
    axial_force: units.Force = Field(default=0.0, examples=["500 N"])
    """axial force on an output shaft that is not rigid along its axis; above zero: pulls it away from the joint"""
    speed_orders: Annotated[orders.SpeedOrders, Field(alias="speed.orders")] = ()
    """orders of the speed, { n, amplitude, phase } each"""
    torque_orders: Annotated[orders.TorqueOrders, Field(alias="torque.orders")] = ()
    """orders of the resisting torque, { n, amplitude, phase } each"""
    partner: Partner | None = Field(
        default=None, examples=[{"position": "after", "alpha": "12 deg", "inertia": "0.02 kg*m^2"}]
    )
    """the other joint of a drive shaft; speed and torque are then those of the shaft's ends"""

    _split = model_validator(mode="before")(orders.split)

    @model_validator(mode="after")
    def _check_torsion(self) -> Operation:
        if self.partner is not None:
            numbers = (2, *(order.n for order in (*self.speed_orders, *self.torque_orders)))
            self.partner.check_torsion(self.speed, max(numbers))
        return self

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Return the JSON schema of the table as a file writes it."""
        schema = super().__get_pydantic_json_schema__(core, handler)
        orders.join_schemas(handler.resolve_ref_schema(schema)["properties"])
        return schema


MEANS = ("alpha", "speed", "torque", "axial_force")
"""Numbers of an operating point; errors of it are deviations from them."""


def nominal_errors(n: int) -> Table:
    """Table of `n` joints without errors.

    Returns
    -------
    ndarray, shape (n,), dtype ERROR
        Zero deviations, factors 1.
    """
    errors = np.zeros(n, ERROR)
    for name in FACTORS:
        errors[name] = 1.0
    return errors


def operating(operation: Operation, errors: Table) -> dict[str, Array]:
    """Values that joints have at an operating point: those of the point, and each joint's deviations from them.

    Returns
    -------
    dict of str to ndarray, shape (n,)
        ``alpha`` (rad), ``speed`` (rad/s), ``torque`` (N m) and ``axial_force`` (N).
    """
    return {name: getattr(operation, name) + errors[f"operation.{name}"] for name in MEANS}


def perturb(joint: Joint, operation: Operation, errors: Table) -> Table:
    """Turn a table of errors into a table of parameters of the mechanical model.

    Position errors, tilts, diameters and clearances affect the contacts only: they change no marker, mass, inertia or
    stiffness. The factor on E scales stiffness and contact coefficients in proportion and bushing damping by its
    square root, eq. (12); it does not change contact damping, nor what holds the output shaft along its axis.

    Parameters
    ----------
    joint : Joint
        The nominal joint.
    operation : Operation
        The operating point; errors of it are deviations that are added.
    errors : ndarray, shape (n,), dtype ERROR
        Row i holds the errors of joint i.

    Returns
    -------
    ndarray, shape (n,), dtype PARAM
        Row i holds the parameters of joint i.
    """
    params = np.zeros(len(errors), PARAM)
    for name, value in _constants(joint).items():
        params[name] = value
    point = operating(operation, errors)
    params["alpha"], params["omega"], params["torque"] = point["alpha"], point["speed"], point["torque"]
    if joint.shaft.slides:
        params["F_a"] = point["axial_force"]
    swings = [errors[f"operation.{name}_swing"] for name in ("speed", "torque")]
    for name, value in orders.parameters(operation.speed_orders, operation.torque_orders, *swings).items():
        params[name] = value
    if operation.partner is not None:
        add_partner(operation.partner, params)
    factor = errors["material.E_factor"]
    for name in ("k_cross", "k_fork", "station_k1", "station_k2", "station_k3"):
        params[name] *= factor[:, None]
    with np.errstate(invalid="ignore"):  # a negative modulus gives NaN, which the kernel reports
        for name in ("c_cross", "c_fork"):
            params[name] *= np.sqrt(factor)[:, None]
    for i in range(4):
        params["pin_point"][:, i], params["pin_axis"][:, i] = _axis(errors, PINS[i], PIN_TRIADS[i])
        params["hole_point"][:, i], params["hole_axis"][:, i] = _axis(errors, HOLES[i], ARM_TRIADS[i])
        hole = errors[f"{HOLE_OF_PIN[PINS[i]]}.diameter"]
        pin, clearance = errors[f"{PINS[i]}.diameter"], errors[f"{PINS[i]}.clearance"]
        params["clearance"][:, i] = _clearance(joint.contact, hole, pin, clearance)
    return params


def _constants(joint: Joint) -> dict[str, Any]:
    """Parameters that do not depend on the errors, at factor 1 on E."""
    contact, shaft, stations = joint.contact, joint.shaft, joint.contact.springs(joint.bearing)
    unused = (0, MAX_STATIONS - len(stations.s))
    return {
        "R": joint.cross.R,
        "r_b": joint.cross.r_b,
        "l_f": joint.arm.l_f,
        "hub_mass": joint.hub.mass,
        "hub_inertia": joint.hub.inertia,
        "pin_mass": joint.pin.mass,
        "pin_inertia": joint.pin.inertia,
        "arm_mass": joint.arm.mass,
        "arm_inertia": joint.arm.inertia,
        "k_cross": joint.k_cross,
        "k_fork": joint.k_fork,
        "c_cross": _bushing_damping(joint.k_cross, joint.pin, joint.bushing),
        "c_fork": _bushing_damping(joint.k_fork, joint.arm, joint.bushing),
        "Js": shaft.Js,
        "slides": shaft.slides,
        "m_s": shaft.mass if shaft.slides else 0.0,
        "k_a": shaft.k_a,
        "c_a": shaft.axial_damping if shaft.slides else 0.0,
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


def _bushing_damping(k: Array, body: Pin | Arm, bushing: Bushing) -> Array:
    return material.bushing_damping(k, body.mass, np.array(body.inertia), bushing.xi)


def _axis(errors: Table, feature: str, triad: Array) -> tuple[Array, Array]:
    """Shift and direction of a feature's axis in its frame, both of shape (n, 3).

    The direction is exp(epsilon x) e, epsilon = tilt_t t + tilt_z z, as a finite rotation; as epsilon is
    normal to e, Rodrigues' formula leaves cos|epsilon| e + sin|epsilon|/|epsilon| (epsilon x e). Angles beyond half a
    turn count as half a turn: 6.28 deg taken for 6.28 rad, nearly a whole turn, must not pass for a small tilt.
    """
    e, t, z = triad
    point = sum(
        np.multiply.outer(errors[f"{feature}.offset_{name}"], axis) for name, axis in zip("etz", triad, strict=True)
    )
    about_t, about_z = errors[f"{feature}.tilt_t"], errors[f"{feature}.tilt_z"]
    angle = np.minimum(np.hypot(about_t, about_z), np.pi)
    ratio = np.sinc(angle / np.pi)
    axis = np.multiply.outer(np.cos(angle), e)
    axis += np.multiply.outer(ratio * about_z, t) - np.multiply.outer(ratio * about_t, z)
    return np.asarray(point), axis


def _clearance(contact: Contact, hole: Array, pin: Array, deviation: Array) -> Array:
    """Radial clearance (m) from deviations (m) of both diameters and of the clearance, shape (n,).

    Rounding errors about zero become zero: otherwise a pin meant to fit exactly could have an interference fit of
    1e-17 m.
    """
    clearance = 0.5 * ((contact.D_H + hole) - (contact.D_P + pin)) + deviation
    clearance[np.abs(clearance) < 4.0 * np.finfo(float).eps * contact.D_H] = 0.0
    return np.asarray(clearance)


PIN_OF_LOAD = {
    name: pin
    for pin, arm in enumerate(ARM_OF_PIN, 1)
    for name in (f"cross{pin}.F", f"fork{arm + 1}.F", f"pin{pin}.contact")
}
"""Pin of each load that is its force; the three of a pin differ by the inertia of its lumped bodies alone."""


def one_force(rows: Iterable[Mapping[str, Any]], level: str, size: str) -> list[dict[str, Any]]:
    """Rows of limits for people: one for all loads that are the same force and have the same limit.

    Parameters
    ----------
    rows : iterable of mapping
        Rows with ``load``, the key `level` of the limit, and the key `size`.
    level, size : str
        Of the rows of one force, that of the largest `size` is shown, with the names of all in ``load``.
    """
    by_force: dict[Any, list[Mapping[str, Any]]] = {}
    for row in rows:
        name, points = split(row["load"])
        force = (PIN_OF_LOAD[name], points, row[level]) if name in PIN_OF_LOAD else row["load"]
        by_force.setdefault(force, []).append(row)
    return [
        {**max(same, key=lambda row: row[size]), "load": ", ".join(row["load"] for row in same)}
        for same in by_force.values()
    ]
