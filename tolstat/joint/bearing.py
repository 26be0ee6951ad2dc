"""``[bearing]`` of a joint file: the needle bearings of the pins, for the contact law `needles` and the rating life."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Annotated, Any

from pydantic import AfterValidator, Field, ValidationInfo, field_validator

from tolstat.analysis.rating_life import A1, critical_amplitude
from tolstat.common import units
from tolstat.common.strict import Strict, refuse
from tolstat.joint.sections import POSITIVE, Force, Length, Number

Time = Annotated[units.Time, POSITIVE]
FOR_LIFE = ("C", "needle_diameter", "pitch_diameter")
"""Keys without which a bearing has no rating life."""
LEFT_OUT: Any = None
"""Default of a key that one purpose needs and another does not; `Bearing.lacking` is asked before it is read."""


def _tabulated(reliability: float) -> float:
    if min(abs(reliability - one) for one in A1) > 1e-9:
        known = ", ".join(f"{100.0 * one:g} %" for one in A1)
        raise refuse(f"ISO 281 has no factor for a reliability of {100.0 * reliability:g} %", f"give one of: {known}")
    return min(A1, key=lambda one: abs(one - reliability))


class Bearing(Strict):
    """Needle bearing of each of the four pins.

    With the contact law `needles` its `needles` and `needle_length` say how stiff it is; the other keys affect no load.
    """

    needles: Annotated[int, Field(strict=True, ge=3, le=1000, description="needles of one bearing", examples=[32])]
    needle_length: Annotated[
        Length, Field(description="length of a needle, needed with law `needles`", examples=["22 mm"])
    ] = LEFT_OUT
    C: Annotated[
        Force,
        Field(
            description="basic dynamic load rating of one bearing (ISO 281), needed for the life", examples=["30 kN"]
        ),
    ] = LEFT_OUT
    needle_diameter: Annotated[
        Length, Field(description="diameter of a needle, needed for the life", examples=["4 mm"])
    ] = LEFT_OUT
    pitch_diameter: Annotated[
        Length,
        Field(description="diameter of the circle of the needles' axes, needed for the life", examples=["42 mm"]),
    ] = LEFT_OUT
    required_life: Annotated[
        Time | None, Field(description="life that all four bearings of a joint must reach", examples=["5000 h"])
    ] = None
    reliability: Annotated[
        Annotated[units.Number, AfterValidator(_tabulated)],
        Field(description="share of equal joints that reach their rating life", examples=["95 %"]),
    ] = 0.9
    a_iso: Annotated[
        Number | None,
        Field(description="life modification factor for lubrication and contamination (ISO 281)", examples=[0.8]),
    ] = None

    @field_validator("pitch_diameter")
    @classmethod
    def _has_room(cls, value: float, info: ValidationInfo) -> float:
        needles, diameter = info.data.get("needles"), info.data.get("needle_diameter")
        if needles and diameter and needles * math.asin(min(1.0, diameter / value)) > math.pi * (1.0 + 1e-9):
            room = int(math.pi / math.asin(min(1.0, diameter / value)))
            found = f"no circle of {{pitch_diameter}} has room for {needles} needles of {{needle_diameter}}"
            raise refuse(found, f"give needles <= {room}, or other diameters", "pitch_diameter", "needle_diameter")
        return value

    def lacking(self, keys: Iterable[str]) -> list[str]:
        """Those of `keys` that are left out."""
        return [key for key in keys if getattr(self, key) is None]

    @property
    def critical_amplitude(self) -> float:
        """Smallest misalignment with a rating life, rad; see `analysis.rating_life.critical_amplitude`."""
        return critical_amplitude(self.needles, self.needle_diameter, self.pitch_diameter)

    @property
    def factor(self) -> float:
        """Life at `reliability` and `a_iso` over the basic rating life."""
        return A1[self.reliability] * (1.0 if self.a_iso is None else self.a_iso)

    @property
    def symbol(self) -> str:
        """Symbol of the life of `factor`: ``L10``, ``L5`` for a reliability of 95 %, ``L5m`` with `a_iso`."""
        return f"L{100.0 * (1.0 - self.reliability):.3g}{'' if self.a_iso is None else 'm'}"
