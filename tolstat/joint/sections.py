"""The sections of a joint file for its bodies and bushings, and the quantities derived from a single section.

`data/joints/cirelli2021.toml` says what each key means and where its value comes from. An optional key that is left
out is ``None``; the section's methods give the resolved value.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, ValidationInfo, field_validator

from tolstat.common import units
from tolstat.common.strict import Strict, refuse
from tolstat.joint import material

Array = NDArray[np.float64]

POSITIVE = AfterValidator(units.positive)
NOT_NEGATIVE = AfterValidator(units.not_negative)

Length = Annotated[units.Length, POSITIVE]
Diameter = Annotated[units.Diameter, POSITIVE]
Area = Annotated[units.Area, POSITIVE]
AreaMoment = Annotated[units.AreaMoment, POSITIVE]
Stress = Annotated[units.Stress, POSITIVE]
Mass = Annotated[units.Mass, POSITIVE]
Inertia = Annotated[units.Inertia, POSITIVE]
Density = Annotated[units.Density, POSITIVE]
Stiffness = Annotated[units.Stiffness, POSITIVE]
RotaryStiffness = Annotated[units.RotaryStiffness, POSITIVE]
Number = Annotated[units.Number, POSITIVE]
Ratio = Annotated[units.Number, NOT_NEGATIVE]


def _poisson(nu: float) -> float:
    if not 0.0 <= nu < 0.5:
        raise refuse(f"{nu:g} is not a Poisson's ratio of a metal", "give a number from 0 to below 0.5")
    return nu


def _body(inertia: tuple[float, float, float]) -> tuple[float, float, float]:
    """Refuse moments of inertia that no body has: one exceeds the sum of the two others."""
    if 2.0 * max(inertia) > sum(inertia) * (1.0 + 1e-9):
        found = "no body has the moments of inertia {inertia}"
        raise refuse(found, "give none above the sum of the others", "inertia")
    return inertia


Triple = Annotated[tuple[Inertia, Inertia, Inertia], AfterValidator(_body)]


def require(value: object, info: ValidationInfo, selector: str, words: tuple[str, ...], instead: str) -> None:
    """Raise when a key is missing although the key `selector` of its section has one of the values `words`."""
    word = info.data.get(selector)
    if value is None and word in words:
        remedy = f'add {info.field_name}, or write {selector} = "{instead}"'
        raise refuse(f'missing key, needed with {selector} = "{word}"', remedy)


class Material(Strict):
    """Material of all parts."""

    E: Stress
    G: Stress
    nu: Annotated[units.Number, AfterValidator(_poisson)]
    rho: Density


class Pin(Strict):
    """A pin of the cross as a round beam along its axis."""

    l: Length  # noqa: E741
    A: Area
    J: AreaMoment
    Jp: AreaMoment | None = None
    chi: Number
    d: Diameter
    mass: Mass | None = None
    inertia: Triple | None = None

    def body(self, rho: float) -> tuple[float, Array]:
        """Mass (kg) and inertia about (e, t, z) (kg*m^2, shape (3,)) at density `rho` (kg/m^3).

        Values that are not given follow from rho A l and from a solid cylinder of diameter d.
        """
        mass = rho * self.A * self.l if self.mass is None else self.mass
        return mass, np.array(self.inertia or material.cylinder_inertia(mass, self.d, self.l))

    def beam(self, of: Material) -> material.BeamStiffness:
        """Stiffness from geometry, eqs. (9)-(11)."""
        Jp = 2.0 * self.J if self.Jp is None else self.Jp
        return material.beam_stiffness(of.E, of.G, length=self.l, A=self.A, Jx=self.J, Jy=self.J, Jp=Jp, chi=self.chi)


class Arm(Strict):
    """An arm of a fork as a beam along the shaft."""

    l_f: Length
    A: Area
    Jx: AreaMoment
    Jy: AreaMoment
    Jp: AreaMoment
    chi: Number
    mass: Mass | None = None
    inertia: Triple | None = None

    def body(self, rho: float) -> tuple[float, Array]:
        """Mass (kg) and inertia about (e, t, z) (kg*m^2, shape (3,)) at density `rho` (kg/m^3).

        Values that are not given follow from rho A l_f and from a box with the section's area moments.
        """
        mass = rho * self.A * self.l_f if self.mass is None else self.mass
        box = material.box_inertia(mass, self.A, self.Jx, self.Jy, self.l_f)
        return mass, np.array(self.inertia or box)

    def beam(self, of: Material) -> material.BeamStiffness:
        """Stiffness from geometry, eqs. (9)-(11)."""
        return material.beam_stiffness(
            of.E, of.G, length=self.l_f, A=self.A, Jx=self.Jx, Jy=self.Jy, Jp=self.Jp, chi=self.chi
        )


class Hub(Strict):
    """Centre of the cross."""

    mass: Mass
    inertia: Triple


class Shaft(Strict):
    """Output shaft."""

    Js: Inertia


class Cross(Strict):
    """Main dimensions of the cross."""

    R: Length
    r_b: Length


class BeamAxes(Strict):
    """Stiffness of one bushing in the axes of Table 3: z along the beam, b bending, t torsion."""

    k_x: Stiffness
    k_y: Stiffness
    k_z: Stiffness
    k_bx: RotaryStiffness
    k_by: RotaryStiffness
    k_tz: RotaryStiffness


class Bushing(Strict):
    """Elasticity of the pins and arms."""

    stiffness: Literal["given", "beam"]
    xi: Ratio
    cross: BeamAxes | None = Field(default=None, validate_default=True)
    fork: BeamAxes | None = Field(default=None, validate_default=True)

    @field_validator("cross", "fork")
    @classmethod
    def _given(cls, value: BeamAxes | None, info: ValidationInfo) -> BeamAxes | None:
        require(value, info, "stiffness", ("given",), "beam")
        return value
