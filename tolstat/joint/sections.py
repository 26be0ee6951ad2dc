"""The sections of a joint file for its bodies and bushings, and the quantities derived from a single section.

`data/joints/cirelli2021.toml` says where the value of each key comes from. An optional key that is left
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

    E: Annotated[Stress, Field(description="Young's modulus")]
    G: Annotated[Stress, Field(description="shear modulus")]
    nu: Annotated[
        Annotated[units.Number, AfterValidator(_poisson)], Field(description="Poisson's ratio, from 0 to below 0.5")
    ]
    rho: Annotated[Density, Field(description="density")]


class Pin(Strict):
    """Each of the four pins: a round beam along its axis e, clamped at the hub, its mass lumped at its end."""

    l: Annotated[Length, Field(description="length of the beam, from the hub to the middle of the contact")]  # noqa: E741
    A: Annotated[Area, Field(description="area of the section")]
    J: Annotated[AreaMoment, Field(description="area moment of the section")]
    Jp: Annotated[
        AreaMoment | None, Field(description="polar moment of the section; when left out: 2 J, that of a circle")
    ] = None
    chi: Annotated[Number, Field(description="shear factor of the section, 1.11 for a circle")]
    d: Annotated[Diameter, Field(description="diameter of the solid cylinder whose inertia the pin has")]
    mass: Annotated[Mass | None, Field(description="mass; when left out: rho A l")] = None
    inertia: Annotated[
        Triple | None,
        Field(
            description="moments of inertia about e, t, z; when left out: those of a solid cylinder of this "
            "diameter, length and mass",
            examples=[["5.78e-5 kg*m^2", "6.42e-5 kg*m^2", "6.42e-5 kg*m^2"]],
        ),
    ] = None

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
    """Each of the four arms: a beam along the shaft, clamped at its fork, its mass lumped at the hole's centre."""

    l_f: Annotated[Length, Field(description="length of the beam, from its fork to the hole's centre")]
    A: Annotated[Area, Field(description="area of the section")]
    Jx: Annotated[AreaMoment, Field(description="area moment about x, the local t")]
    Jy: Annotated[AreaMoment, Field(description="area moment about y, the local e")]
    Jp: Annotated[AreaMoment, Field(description="polar moment of the section")]
    chi: Annotated[Number, Field(description="shear factor of the section, 1.2 for a rectangle")]
    mass: Annotated[Mass | None, Field(description="mass; when left out: rho A l_f")] = None
    inertia: Annotated[
        Triple | None,
        Field(
            description="moments of inertia about e, t, z; when left out: those of a box with the area moments "
            "of the section, l_f long along z",
            examples=[["1.40e-4 kg*m^2", "5.31e-5 kg*m^2", "1.11e-4 kg*m^2"]],
        ),
    ] = None

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
    """Middle of the cross, to which the four pins are attached."""

    mass: Annotated[Mass, Field(description="mass")]
    inertia: Annotated[Triple, Field(description="moments of inertia about x, y, z of the cross")]


class Shaft(Strict):
    """Output shaft."""

    Js: Annotated[Inertia, Field(description="inertia of the output shaft about its axis")]


class Cross(Strict):
    """Main dimensions of the cross."""

    R: Annotated[Length, Field(description="distance from the centre of the joint to the middle of pin and hole")]
    r_b: Annotated[Length, Field(description="distance from the centre of the joint to the marker of a cross bushing")]


class BeamAxes(Strict):
    """Stiffness of a bushing in beam axes: z along the beam, x the local t, y the third, of a pin z, of an arm e."""

    k_x: Annotated[Stiffness, Field(description="shear along x")]
    k_y: Annotated[Stiffness, Field(description="shear along y")]
    k_z: Annotated[Stiffness, Field(description="tension")]
    k_bx: Annotated[RotaryStiffness, Field(description="bending about x")]
    k_by: Annotated[RotaryStiffness, Field(description="bending about y")]
    k_tz: Annotated[RotaryStiffness, Field(description="torsion")]


class Bushing(Strict):
    """Bushings, the elasticity of pins and arms: three springs and three torsion springs each, eq. (8)."""

    stiffness: Annotated[
        Literal["given", "beam"],
        Field(
            description="`given`: by the tables `cross` and `fork`, whatever material and dimensions are; "
            "`beam`: by material and sections of pin and arm, eqs. (9)-(11)"
        ),
    ]
    xi: Annotated[Ratio, Field(description="damping ratio: damping is 2 xi sqrt(k m), of rotations 2 xi sqrt(k J)")]
    cross: BeamAxes | None = Field(
        default=None, validate_default=True, description="Stiffness of a pin's bushing, needed with `given`"
    )
    fork: BeamAxes | None = Field(
        default=None, validate_default=True, description="Stiffness of an arm's bushing, needed with `given`"
    )

    @field_validator("cross", "fork")
    @classmethod
    def _given(cls, value: BeamAxes | None, info: ValidationInfo) -> BeamAxes | None:
        require(value, info, "stiffness", ("given",), "beam")
        return value
