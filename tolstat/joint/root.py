"""The root of a pin, where it is clamped at the hub: nominal stress of its section, with the factors of its fillet."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field, ValidationInfo, field_validator

from tolstat.common import units
from tolstat.common.strict import Strict, refuse
from tolstat.common.units import NOT_NEGATIVE, POSITIVE

Factor = Annotated[units.Number, POSITIVE]


class Root(Strict):
    """Section of each pin at the hub, where the stress of its bushing's moments is a load, `cross1.stress`."""

    diameter: Annotated[units.Length, POSITIVE] = Field(examples=["24 mm"])
    """diameter at the foot of the fillet"""
    bore: Annotated[units.Length, NOT_NEGATIVE] = Field(default=0.0, examples=["4 mm"])
    """diameter of a hole along the axis, for lubricant"""
    K_bending: Factor = Field(default=1.0, examples=[1.6])
    """stress concentration factor of the fillet in bending, on the nominal stress of the section"""
    K_torsion: Factor = Field(default=1.0, examples=[1.3])
    """the same in torsion"""

    @field_validator("bore")
    @classmethod
    def _leaves_a_wall(cls, value: float, info: ValidationInfo) -> float:
        if value >= info.data.get("diameter", math.inf):
            raise refuse("a bore of {bore} leaves nothing of {diameter}", "give bore < diameter", "bore", "diameter")
        return value

    @property
    def factors(self) -> tuple[float, float]:
        """Stress by bending moment, and shear stress by torsional moment, 1/m^3, with the fillet's factors."""
        modulus = math.pi * (self.diameter**4 - self.bore**4) / (32.0 * self.diameter)
        return self.K_bending / modulus, 0.5 * self.K_torsion / modulus
