"""The contact section of a joint file: coefficients, damping and stations of a pin in its hole."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, ValidationInfo, field_validator

from tolstat import units
from tolstat.joint import material
from tolstat.joint.sections import (
    NOT_NEGATIVE,
    POSITIVE,
    Array,
    Length,
    Material,
    Number,
    Pin,
    Ratio,
    Stiffness,
    needed,
)
from tolstat.schema import Strict, refuse
from tolstat.tables import MAX_STATIONS

QuadraticStiffness = Annotated[units.QuadraticStiffness, NOT_NEGATIVE]
Damping = Annotated[units.Damping, NOT_NEGATIVE]
Force = Annotated[float, units.Quantity("N"), POSITIVE]


NEEDED = {
    "k1u": ("coefficients", "printed", "fitted"),
    "k2u": ("coefficients", "printed", "fitted"),
    "fit_load": ("coefficients", "fitted", "printed"),
    "c_d": ("damping", "given", "beam"),
    "xi": ("damping", "beam", "given"),
}
"""Keys that a selector asks for: the selector, the word that needs the key, the word that does without."""


class Contact(Strict):
    """Contact of the pins in their holes.

    Which of the keys that may be ``None`` are needed is validated; methods assert it for the type checker.
    """

    law: Literal["mode", "uniform", "point", "sliced"]
    n_stations: Annotated[int, Field(strict=True, ge=1, le=MAX_STATIONS)]
    D_H: Length
    D_P: Length
    z: Length
    coefficients: Literal["printed", "fitted"]
    k1u: QuadraticStiffness | None = Field(default=None, validate_default=True)
    k2u: Stiffness | None = Field(default=None, validate_default=True)
    k1p: QuadraticStiffness | None = None
    k2p: Stiffness | None = None
    H: Number | None = Field(default=None, validate_default=True)
    fit_load: Force | None = Field(default=None, validate_default=True)
    damping: Literal["given", "beam"]
    c_d: Damping | None = Field(default=None, validate_default=True)
    xi: Ratio | None = Field(default=None, validate_default=True)
    c_t: Damping
    delta_d: Length

    @field_validator("D_P")
    @classmethod
    def _fits(cls, value: float, info: ValidationInfo) -> float:
        hole = info.data.get("D_H")
        if hole is not None and value > hole:
            raise refuse(f"a pin of {value:g} m does not go into a hole of {hole:g} m", "give D_P <= D_H")
        return value

    @field_validator("coefficients")
    @classmethod
    def _clearance(cls, value: str, info: ValidationInfo) -> str:
        if value == "fitted" and "D_P" in info.data and info.data["D_P"] == info.data.get("D_H"):
            raise refuse("eq. (3) has no value at D_H = D_P", 'give a clearance, or write "printed"')
        return value

    @field_validator(*NEEDED)
    @classmethod
    def _needed(cls, value: float | None, info: ValidationInfo) -> float | None:
        needed(value, info, *NEEDED[str(info.field_name)])
        return value

    @field_validator("H")
    @classmethod
    def _point(cls, value: float | None, info: ValidationInfo) -> float | None:
        given = info.data.get("k1p", 0.0) is not None and info.data.get("k2p", 0.0) is not None
        if value is None and (info.data.get("coefficients") == "fitted" or not given):
            raise refuse("missing key, needed where k1p and k2p are not given", "add H, or both k1p and k2p")
        return value

    def stiffness(self, of: Material) -> tuple[float, float, float, float]:
        """Coefficients k1u (N/m^2), k2u (N/m), k1p (N/m^2), k2p (N/m): as printed, or fitted to eq. (3).

        Point coefficients follow from the uniform ones by H where they are not given, and always where the
        uniform ones are fitted.
        """
        k1u, k2u, k1p, k2p = self.k1u, self.k2u, self.k1p, self.k2p
        if self.coefficients == "fitted":
            assert self.fit_load is not None
            k1u, k2u = material.fit_contact(self.fit_load, self.z, self.D_H, self.D_P, of.E, of.nu)
            k1p = k2p = None
        assert k1u is not None
        assert k2u is not None
        if k1p is None:
            assert self.H is not None
            k1p, _ = material.point_coefficients(k1u, k2u, self.H)
        if k2p is None:
            assert self.H is not None
            _, k2p = material.point_coefficients(k1u, k2u, self.H)
        return k1u, k2u, k1p, k2p

    def normal_damping(self, pin: Pin, of: Material) -> float:
        """Damping c_d (N*s/m): as given, or of the pin as a cantilever, eqs. (6)-(7)."""
        if self.damping == "given":
            assert self.c_d is not None
            return self.c_d
        assert self.xi is not None
        mass, _ = pin.body(of.rho)
        return material.contact_damping(self.xi, mass, length=pin.l, A=pin.A, J=pin.J, E=of.E, rho=of.rho)

    def stations(self) -> tuple[Array, Array]:
        """Signed distance from P along the pin (m) and weight of each contact station, the outermost first.

        Two stations of weight 1 at the ends; ``law = "sliced"``: Gauss-Legendre points on the length z.
        """
        if self.law != "sliced":
            return np.array([0.5, -0.5]) * self.z, np.ones(2)
        x, weight = np.polynomial.legendre.leggauss(self.n_stations)
        return 0.5 * self.z * x[::-1], weight[::-1]
