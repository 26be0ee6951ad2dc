"""A spline, which holds an axial force by the friction of its flanks."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field, ValidationInfo

from tolstat.common import units
from tolstat.common.strict import Strict, refuse
from tolstat.common.units import NOT_NEGATIVE, POSITIVE
from tolstat.joint.material import Array

SMALLEST, LARGEST = 1e-3, 1.0
"""Pitch diameters, m, beyond which a unit is wrong."""


def _pitch(diameter: float) -> float:
    if not SMALLEST <= diameter <= LARGEST:
        raise refuse(
            "{diameter} is no pitch diameter of a spline", 'check its unit; write for example "40 mm"', "diameter"
        )
    return diameter


def _friction(mu: float, info: ValidationInfo) -> float:
    if mu > 1.0:
        key = str(info.field_name)
        raise refuse(f"{{{key}}} is above 1", "give the coefficient of friction, such as 0.05", key)
    return mu


Coefficient = Annotated[units.Number, NOT_NEGATIVE, AfterValidator(_friction)]
Pitch = Annotated[units.Length, POSITIVE, AfterValidator(_pitch)]


class Spline(Strict):
    """Spline of the output shaft, which sticks with any axial force up to 2 mu T/d, T the torque of the joint."""

    mu: Coefficient = Field(examples=[0.1])
    """coefficient of friction of its flanks"""
    diameter: Pitch = Field(examples=["40 mm"])
    """pitch diameter d"""

    def largest_force(self, torque: Array) -> Array:
        """Axial force (N) that its friction can hold at a torque (N m): 2 mu T/d."""
        return abs(torque) * (2.0 * self.mu / self.diameter)
