"""The contact section of a joint file: damping of a pin in its hole, and the registry of contact laws.

A contact law is a set of stations (model, section 5): places along the pin, each with its own force
f(delta) = k1 delta^2 + k2 delta + k3 delta^(9/8) sqrt(delta/(delta + b c)) and its own weight of damping and film.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field, ValidationInfo, field_validator

from tolstat.common import units
from tolstat.common.parameters import MAX_STATIONS
from tolstat.common.strict import Strict, refuse
from tolstat.common.units import NOT_NEGATIVE, Damping, Diameter, QuadraticStiffness
from tolstat.joint.bearing import Bearing, fit_needles
from tolstat.joint.material import Array
from tolstat.joint.sections import Force, Length, Number, Ratio, Stiffness, follows


class Stations(NamedTuple):
    """Contact stations of a pin, the outermost first.

    Attributes
    ----------
    s : ndarray, shape (n,)
        Signed distance from P along the pin's axis, m.
    k1, k2 : ndarray, shape (n,)
        Quadratic (N/m^2) and linear (N/m) coefficient of the force, eq. (5).
    k3 : ndarray, shape (n,)
        Coefficient of the force of needles (N/m^(9/8)).
    weight : ndarray, shape (n,)
        Weight of damping c_d and film c_t.
    b : float
        Share of the clearance in the force of needles.
    """

    s: Array
    k1: Array
    k2: Array
    k3: Array
    weight: Array
    b: float = 0.0


class Law(NamedTuple):
    """A contact law.

    Attributes
    ----------
    stations : callable
        Sections contact and bearing -> stations, at the material's nominal Young's modulus.
    needs : tuple of str
        Keys of the contact section that the law needs, without those of the coefficients.
    of_bearing : tuple of str
        Keys of the bearing section that the law needs.
    from_coefficients : bool
        Whether the stations follow from the coefficients of uniform and point contact.
    middle : bool
        Whether a station has what two ends in point contact leave of uniform contact; it must not be negative.
    """

    stations: Callable[[Contact, Bearing | None], Stations]
    needs: tuple[str, ...] = ()
    of_bearing: tuple[str, ...] = ()
    from_coefficients: bool = True
    middle: bool = False


def _mode(contact: Contact, bearing: Bearing | None) -> Stations:
    k1u, k2u, k1p, k2p = contact.coefficients()
    x = np.array([1.0, 0.0, -1.0])
    k1 = np.array([k1p, max(k1u - 2.0 * k1p, 0.0), k1p])
    k2 = np.array([k2p, max(k2u - 2.0 * k2p, 0.0), k2p])
    return Stations(0.5 * contact.z * x, k1, k2, np.zeros(3), np.abs(x))


def _uniform(contact: Contact, bearing: Bearing | None) -> Stations:
    k1u, k2u, _, _ = contact.coefficients()
    return _weighted(contact.ends(), np.ones(2), 0.5 * k1u, 0.5 * k2u)


def _point(contact: Contact, bearing: Bearing | None) -> Stations:
    _, _, k1p, k2p = contact.coefficients()
    return _weighted(contact.ends(), np.ones(2), k1p, k2p)


def _weighted(s: Array, weight: Array, k1: float, k2: float) -> Stations:
    """Stations that share the coefficients by their weights."""
    return Stations(s, k1 * weight, k2 * weight, 0.0 * weight, weight)


def _slices(contact: Contact) -> tuple[Array, Array]:
    """Places of the slices from -1 to 1, the outermost first, and their weights, which sum to 2."""
    assert contact.n_stations is not None
    x, weight = np.polynomial.legendre.leggauss(contact.n_stations)
    return x[::-1], weight[::-1]


def _sliced(contact: Contact, bearing: Bearing | None) -> Stations:
    k1u, k2u, _, _ = contact.coefficients()
    x, weight = _slices(contact)
    return _weighted(0.5 * contact.z * x, weight, 0.5 * k1u, 0.5 * k2u)


def _needles(contact: Contact, bearing: Bearing | None) -> Stations:
    assert bearing is not None
    assert bearing.needle_length is not None
    assert contact.fit_load is not None
    k3, b = fit_needles(contact.fit_load, contact.clearance, bearing.needles, bearing.needle_length)
    x, weight = _slices(contact)
    return Stations(0.5 * bearing.needle_length * x, 0.0 * weight, 0.0 * weight, 0.5 * k3 * weight, weight, b)


DEFAULT = "mode"
LAWS = {
    DEFAULT: Law(_mode, middle=True),
    "uniform": Law(_uniform),
    "point": Law(_point),
    "sliced": Law(_sliced, ("n_stations",)),
    "needles": Law(_needles, ("n_stations", "fit_load"), ("needles", "needle_length"), from_coefficients=False),
}
"""Registry of the contact laws, by the word for ``contact.law``."""
COEFFICIENTS = ("k1u", "k2u", "k1p", "k2p", "H", "fit_load", "n_stations")
"""Keys that define the stations."""
if TYPE_CHECKING:
    LawName = str
else:
    LawName = Literal[tuple(LAWS)]


def _has_middle(info: ValidationInfo) -> bool:
    return "law" in info.data and LAWS[info.data["law"]].middle


class Contact(Strict):
    """Contact of the pins in their holes.

    Of `D_H`, `D_P` and `clearance` two define the third.
    """

    law: LawName
    """set of contact stations, see the contact laws of the joint model"""
    n_stations: Annotated[int, Field(strict=True, ge=1, le=MAX_STATIONS)] | None = Field(
        default=None, validate_default=True
    )
    """stations of a pin, for laws `sliced` and `needles`"""
    D_H: Diameter = follows("contact.D_H", "diameter of the hole")
    D_P: Diameter = follows("contact.D_P", "diameter of the pin in the hole, not above `D_H`")
    clearance: Annotated[units.Length, NOT_NEGATIVE] = follows(
        "contact.clearance", "radial clearance of the pin in its hole", "0.1 mm"
    )
    z: Length
    """length of the contact"""
    k1u: QuadraticStiffness = follows("contact.k1u", "quadratic coefficient of uniform contact")
    k2u: Stiffness = follows("contact.k2u", "linear coefficient of uniform contact")
    k1p: QuadraticStiffness = follows("contact.k1p", "quadratic coefficient of point contact")
    k2p: Stiffness = follows("contact.k2p", "linear coefficient of point contact")
    H: Number | None = Field(default=None, validate_default=True)
    """displacement in point contact over that in uniform contact at the same force"""
    fit_load: Force | None = Field(default=None, validate_default=True)
    """largest load of the fit of k1u and k2u, or of that to needles"""
    c_d: Damping = follows("contact.c_d", "damping of a station")
    xi: Ratio | None = None
    """damping ratio of the contact, from which c_d follows"""
    c_t: Damping
    """damping by the lubricant across the clearance; without it a pin whirls for ever"""
    delta_d: Length
    """penetration over which contact damping rises to its full value"""

    @field_validator("D_P")
    @classmethod
    def _fits(cls, value: float, info: ValidationInfo) -> float:
        hole = info.data.get("D_H")
        if hole is not None and value > hole:
            raise refuse("a pin of {D_P} does not fit into a hole of {D_H}", "give D_P <= D_H", "D_P", "D_H")
        return value

    @field_validator(*COEFFICIENTS)
    @classmethod
    def _of_law(cls, value: object, info: ValidationInfo) -> object:
        """Refuse to lack a key that the law needs; an invalid law has a fault of its own."""
        law, key = info.data.get("law"), str(info.field_name)
        if law is not None and value is None and key in LAWS[law].needs:
            raise refuse(f'missing key, needed with law = "{law}"', f'add {key}, or write law = "{DEFAULT}"')
        return value

    @field_validator("k1p", "k2p")
    @classmethod
    def _leaves_a_middle(cls, value: float | None, info: ValidationInfo) -> float | None:
        """Refuse a negative middle station: uniform less twice the point coefficient."""
        point = str(info.field_name)
        uniform = {"k1p": "k1u", "k2p": "k2u"}[point]
        whole = info.data.get(uniform)
        if _has_middle(info) and value is not None and whole is not None and 2.0 * value > whole:
            found = f"2 {point} exceeds {uniform} = {{{uniform}}}: the middle station would be negative"
            raise refuse(found, f"give {point} <= {uniform} / 2, or another law", uniform)
        return value

    @field_validator("H")
    @classmethod
    def _point(cls, value: float | None, info: ValidationInfo) -> float | None:
        k1p, k2p = info.data.get("k1p"), info.data.get("k2p")
        law = LAWS[info.data.get("law", DEFAULT)]
        if not law.from_coefficients or (k1p is not None and k2p is not None):
            return value
        if value is None:
            raise refuse("missing key, needed where k1p and k2p are not given", "add H, or both k1p and k2p")
        least = 2.0 if k2p is None else math.sqrt(2.0)  # k2p = k2u/H, k1p = k1u/H^2
        if _has_middle(info) and value < least:
            found = f"{value:g} makes two ends stiffer than uniform contact: the middle station would be negative"
            raise refuse(found, f"give at least {least:.4g}, or another law")
        return value

    def coefficients(self) -> tuple[float, float, float, float]:
        """k1u (N/m^2), k2u (N/m), k1p (N/m^2), k2p (N/m); NaN with a law that does not use them."""
        if not LAWS[self.law].from_coefficients:
            return (math.nan,) * 4
        return self.k1u, self.k2u, self.k1p, self.k2p

    def springs(self, bearing: Bearing | None) -> Stations:
        """Contact stations of the law (model, section 5), at the nominal Young's modulus of the material."""
        return LAWS[self.law].stations(self, bearing)

    def ends(self) -> Array:
        """Distance of the pin's ends from P along its axis, m, the outer one first."""
        return 0.5 * self.z * np.array([1.0, -1.0])
