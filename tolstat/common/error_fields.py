"""Errors of a mechanism: the fields of the table ERROR."""

from __future__ import annotations

from functools import cache

from tolstat.common.fields import Field
from tolstat.common.mechanism import Mechanism, features, with_play


def error_fields(mechanism: Mechanism) -> tuple[Field, ...]:
    """Manufacturing errors and errors of the operating point: deviations from nominal, zero for the nominal joint."""
    fields = []
    pins, hole = [pair.pin for pair in mechanism.pairs], "hole" if mechanism.cardan else "eye"
    for feature in features(mechanism):
        kind = "pin" if feature in pins else hole
        for axis in "etz":
            text = f"position error of the {kind} axis along {axis}"
            fields.append(Field(f"{feature}.offset_{axis}", "m", text))
        for axis in "tz":
            fields.append(Field(f"{feature}.tilt_{axis}", "rad", f"angular error of the {kind} axis about {axis}"))
        fields.append(Field(f"{feature}.diameter", "m", f"deviation of the {kind}'s diameter from nominal"))
    alpha = Field("operation.alpha", "rad", "deviation of the shafts' misalignment from that of the operating point")
    force = Field("operation.axial_force", "N", "deviation of the axial force on the output shaft")
    fields += [
        *[alpha] * bool(mechanism.cardan),
        Field("operation.speed", "rad/s", "deviation of the input shaft's angular velocity"),
        Field("operation.torque", "N*m", "deviation of the resisting torque on the output shaft"),
        Field("material.E_factor", "1", "factor on Young's modulus: bushings, their damping, contact coefficients"),
        *(Field(f"{pin}.clearance", "m", f"deviation of the pin's radial clearance in its {hole}") for pin in pins),
        *[force] * bool(mechanism.cardan),
        Field("operation.speed_swing", "1", "factor on the amplitudes of the orders of the input speed"),
        Field("operation.torque_swing", "1", "factor on the amplitudes of the orders of the resisting torque"),
    ]
    of_parts = (
        (mechanism.is_shaft, "shaft.alpha", "rad", "deviation of the misalignment of joint 2"),
        (mechanism.is_shaft, "shaft.offset", "rad", "deviation of the phase of the forks on the tube"),
        (mechanism.spline, "shaft.spline", "1", "axial force of the sticking spline over 2 mu T/d, from -1 to 1"),
        (mechanism.friction, "friction.mu", "1", "deviation of the coefficient of friction"),
    )
    fields += [Field(name, unit, text) for there, name, unit, text in of_parts if there]
    for body in mechanism.unbalanced:
        owner = "output shaft" if body == "output" else body
        fields.append(Field(f"{body}.unbalance", "kg*m", f"deviation of the {owner}'s unbalance"))
        fields.append(Field(f"{body}.unbalance_angle", "rad", "deviation of its direction"))
    text = "deviation of the cross's play along its pins" if mechanism.cardan else "deviation of the pin's end play"
    for name in dict.fromkeys(with_play(mechanism, face) for face in mechanism.faces):
        fields.append(Field(f"{name}.end_play", "m", text))
    return tuple(fields)


@cache
def error_units(mechanism: Mechanism) -> dict[str, str]:
    """SI unit of every error, in the order of the table."""
    return {field.name: field.unit for field in error_fields(mechanism)}


@cache
def given_units(mechanism: Mechanism) -> dict[str, str]:
    """SI unit of the errors that ``[errors]`` and a case can give."""
    return {name: unit for name, unit in error_units(mechanism).items() if not name.startswith("operation.")}
