"""The nominal joint: what a joint file holds, and keys that a case, study or variant has in place of its own."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from operator import attrgetter
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, Field, ValidationInfo, field_validator

from tolstat.common.cardan import CARDAN, MECHANISMS, PARTS, SHAFT, named
from tolstat.common.errors import Fault
from tolstat.common.loads import loads_of
from tolstat.common.strict import Strict, refuse
from tolstat.common.tables import MAX_SHIFT, tables
from tolstat.joint import derived
from tolstat.joint.bearing import AFFECT_LOADS, Bearing
from tolstat.joint.contact import COEFFICIENTS, LAWS, Contact
from tolstat.joint.derived import DERIVED
from tolstat.joint.material import Array
from tolstat.joint.sections import RIGID, Arm, Bushing, Cross, Friction, Hub, Material, Pin, Shaft, Thrust

GIVEN_BY = dict(
    zip(
        PARTS,
        (
            *("thrust", "friction.mu", "shaft.input", "shaft.output"),
            *("shaft.unbalance", "shaft.lateral", "shaft.spline", "pin.root"),
        ),
        strict=True,
    )
)
"""Key of the joint that gives it each of `cardan.PARTS`."""
TOLD = ("description", "assumed")
"""Keys of a joint file that are about the joint and no part of it."""
NO_FIT = "the pin does not fit into the hole: D_P, by default pin.d, is not above zero and up to D_H", "give D_P <= D_H"


def giving(pattern: str) -> str:
    """Key of the joint that gives it an error or load of this name or pattern; empty where none of `GIVEN_BY` does."""

    def names(parts: Collection[str]) -> set[str]:
        every = [MECHANISMS[named(base, parts)] for base in (CARDAN, SHAFT)]
        return {name for one in every for name in (*loads_of(one), *(f.name for f in tables(one).error_fields))}

    of_parts = ((key, names([part]) - names([])) for part, key in GIVEN_BY.items())
    return next((key for key, own in of_parts if any(fnmatchcase(name, pattern) for name in own)), "")


def affects_results(key: str) -> bool:
    """Whether a dotted key of a joint affects results of its simulation."""
    section, _, name = key.partition(".")
    return section not in TOLD and (section != "bearing" or name in AFFECT_LOADS)


def affecting_results(given: Mapping[str, Any]) -> dict[str, Any]:
    """Values of a joint by dotted key, of sections as `Joint.given` returns them, that affect results."""
    return {key: value for key, value in leaves(given).items() if affects_results(key)}


class Assumed(Strict):
    """Keys of the joint whose values are assumed, and other values that they may have; affects no result."""

    name: str = Field(min_length=1, examples=["contact law"])
    """what is assumed, as a noun"""
    values: tuple[Annotated[dict[str, Any], Field(min_length=1, json_schema_extra={"x-table": "keys"})], ...] = Field(
        min_length=1, examples=[[{"contact": {"law": "sliced"}}, {"contact": {"law": "uniform"}}]]
    )
    """other values, each some keys of the joint, with those that follow from them and are to stay"""
    because: str = Field(min_length=1, examples=["no drawing gives it"])
    """why the value is not known"""
    varied: bool = Field(default=True, strict=True, examples=[False])
    """whether it is varied unless it is asked for by name"""


class Joint(Strict):
    """A nominal Cardan joint: the sections of a joint file in SI units.

    Arrays of three or six values that the properties return refer to the local axes (e, t, z) of a pin or arm.
    """

    description: str = Field(default="", examples=["gearbox A, drawing 4711"])
    """text about the joint, copied to result files"""
    material: Material
    pin: Pin
    arm: Arm
    cross: Cross
    hub: Hub = Field(default=Hub(), validate_default=True)
    shaft: Shaft
    thrust: Thrust | None = Field(default=None, validate_default=True)
    """Thrust faces, which hold the cross along its pins; without this table pins slide freely along their holes"""
    friction: Friction = Friction()
    bushing: Bushing
    contact: Contact
    bearing: Bearing | None = Field(default=None, validate_default=True)
    """Needle bearing of each pin: with `law = "needles"` and `n_stations` of the contact, `needles` and `needle_length`
    say how stiff it is; other keys are for its rating life"""
    assumed: tuple[Assumed, ...] = Field(
        default=(), examples=[[{"name": "H", "values": [{"contact": {"H": 3.0}}], "because": "no drawing gives it"}]]
    )
    """values of the joint that nobody measured, a table `[[assumed]]` each"""
    _inherited: tuple[Fault, ...] = ()
    _replaced: Mapping[str, str] = {}

    @field_validator("material", "pin", "arm", "cross", "hub", "bushing", "contact")
    @classmethod
    def _complete(cls, value: BaseModel, info: ValidationInfo) -> BaseModel:
        """Fill in the keys that follow from others; refuse a section that lacks one which does not."""
        name = str(info.field_name)
        section = derived.completed(name, value, info.data)
        without_coefficients = isinstance(section, Contact) and not LAWS[section.law].from_coefficients
        exempt = [f"contact.{key}" for key in COEFFICIENTS] if without_coefficients else []
        lacking = derived.missing(name, section, info.data, exempt)
        if lacking:
            raise refuse(*_lacking(lacking, section))
        return section

    @field_validator("thrust")
    @classmethod
    def _holds_the_shaft(cls, value: Thrust | None, info: ValidationInfo) -> Thrust | None:
        shaft = info.data.get("shaft")
        if value is None and shaft is not None and shaft.lateral != RIGID:
            found = "missing, and shaft.lateral is not rigid: pins that slide freely hold no shaft across its axis"
            raise refuse(found, 'give [joint.thrust] with end_play and k, or shaft.lateral = "rigid"')
        return value

    @field_validator("cross")
    @classmethod
    def _holds_the_pins(cls, value: Cross, info: ValidationInfo) -> Cross:
        if value.r_b is not None and not value.r_b > 0.0:
            raise refuse("R is not larger than pin.l", "give cross.R > pin.l, or cross.r_b")
        return value

    @field_validator("thrust")
    @classmethod
    def _faces_are_near(cls, value: Thrust | None, info: ValidationInfo) -> Thrust | None:
        """Refuse faces farther from the ends of their pins than the model holds for."""
        cross = info.data.get("cross")
        most = math.inf if cross is None else 2.0 * MAX_SHIFT * cross.R
        if value is not None and abs(value.end_play) > most:
            found = f"end_play = {{thrust.end_play}} is more than {2.0 * MAX_SHIFT:g} cross.R = {1e3 * most:.4g} mm"
            raise refuse(found, f"check its unit; give -{1e3 * most:.4g} mm to {1e3 * most:.4g} mm", "thrust.end_play")
        return value

    @field_validator("contact")
    @classmethod
    def _bears(cls, value: Contact, info: ValidationInfo) -> Contact:
        """Refuse a pin that does not bear in its hole, or contact that does not stiffen up to any load.

        Record the load up to which eq. (3) was fitted.
        """
        cross = info.data.get("cross")
        if "pin" in info.data and abs(0.5 * (value.D_H - value.D_P) - value.clearance) > 1e-9:
            raise refuse("D_H, D_P and clearance contradict each other", "remove one of the three")
        if "pin" in info.data and not 0.0 < value.D_P <= value.D_H:
            raise refuse(*NO_FIT)
        if cross is not None and value.z >= 2.0 * cross.R:
            remedy = "give contact.z < 2 cross.R, where cross.R = {cross.R}"
            raise refuse("z = {contact.z} reaches past the joint centre", remedy, "contact.z", "cross.R")
        if not LAWS[value.law].from_coefficients or not info.data.keys() >= {"material", "pin"}:
            return value
        k1u, k2u, k1p, k2p = value.coefficients()
        if not (k1u >= 0.0 and k2u > 0.0):
            found = "the fit to eq. (3) gives no stiffening contact, not even up to a thousandth of fit_load"
            raise refuse(found, "give a smaller contact.fit_load, a larger clearance, or k1u and k2u")
        if not value.model_fields_set >= {"k1u", "k2u"}:
            value = value.model_copy(update={"fit_load": derived.fitted_load(info.data["material"], value)})
        if LAWS[value.law].middle and (2.0 * k1p > k1u or 2.0 * k2p > k2u):
            found = "two ends are stiffer than uniform contact: the middle station would be negative"
            raise refuse(found, "give smaller k1p and k2p, or another law")
        return value

    @field_validator("bearing")
    @classmethod
    def _has_needles(cls, value: Bearing | None, info: ValidationInfo) -> Bearing | None:
        """Refuse a bearing that lacks what the contact law needs, or whose needles reach past the joint centre."""
        contact, cross = info.data.get("contact"), info.data.get("cross")
        if contact is None:
            return value
        needed = LAWS[contact.law].of_bearing
        lacking = list(needed) if value is None else value.lacking(needed)
        if lacking:
            found = f'missing {_keys(lacking)}, needed with contact.law = "{contact.law}"'
            raise refuse(found, f"add {' and '.join(f'bearing.{key}' for key in lacking)}, or write another law")
        if needed and cross is not None and value is not None and value.needle_length >= 2.0 * cross.R:
            found = "needles of {bearing.needle_length} reach past the joint centre"
            remedy = "give bearing.needle_length < 2 cross.R, where cross.R = {cross.R}"
            raise refuse(found, remedy, "bearing.needle_length", "cross.R")
        if value is not None and value.needle_length is None:
            value = value.model_copy(update={"needle_length": contact.z})
            value.model_fields_set.discard("needle_length")  # it follows from the contact
        return value

    def warnings(self) -> list[Fault]:
        """Settings that can be simulated but are probably not intended, by key path in the joint file."""
        overlap = []
        if 2.0 * self.cross.r_b < self.pin.d:
            found = f"{1e3 * self.cross.r_b:.4g} mm is less than half of pin.d: the pins overlap in the hub"
            overlap = [Fault("cross.r_b", found, "give pin.l, from the hub to the middle of the hole, or cross.r_b")]
        return [*self._inherited, *self._anisotropic(), *overlap]

    def remember(self, inherited: Iterable[Fault], replaced: Mapping[str, str]) -> None:
        """Keep the warnings about values that overrides leave, and the diameters that overrides replace."""
        self._inherited, self._replaced = tuple(inherited), replaced

    def _anisotropic(self) -> Iterator[Fault]:
        steel, expected = self.material, DERIVED["material.G"].value(self)
        if not math.isclose(steel.G, expected, rel_tol=derived.ISOTROPIC):
            found = f"{1e-9 * steel.G:.4g} GPa does not agree with E and nu: E/(2 (1 + nu)) = {1e-9 * expected:.4g} GPa"
            yield Fault("material.G", found, "leave G out, or check E and nu")

    @property
    def replaced_bearing(self) -> Mapping[str, str]:
        """Diameters and clearance of the joint file, as written, that overrides replace, by dotted key."""
        return self._replaced

    def given(self, mode: Literal["json", "python"] = "python") -> dict[str, Any]:
        """Sections with the keys that were given, without those that follow from them.

        Parameters
        ----------
        mode : str
            ``python``: SI values; ``json``: quantities as a file writes them.
        """
        return self.model_dump(mode=mode, exclude_unset=True)

    @property
    def parts(self) -> tuple[str, ...]:
        """What the joint has beside lumps, bushings and pairs: those of `GIVEN_BY` whose key it has."""
        return tuple(part for part, key in GIVEN_BY.items() if attrgetter(key)(self) not in (None, RIGID))

    @property
    def k_cross(self) -> Array:
        """Stiffness of a cross bushing (N/m, N*m/rad), shape (6,): the beam's z, x, y are e, t, z."""
        k = self.bushing.cross
        return np.array([k.k_z, k.k_x, k.k_y, k.k_tz, k.k_bx, k.k_by])

    @property
    def k_fork(self) -> Array:
        """Stiffness of a fork bushing (N/m, N*m/rad), shape (6,): the beam's y, x, z are e, t, z."""
        k = self.bushing.fork
        return np.array([k.k_y, k.k_x, k.k_z, k.k_by, k.k_bx, k.k_tz])


def _lacking(keys: list[str], section: BaseModel) -> tuple[str, str]:
    """Fault and remedy of a section without `keys`, which cannot be derived."""
    if isinstance(section, Hub):
        found = "the pins overlap in the hub: its mass and inertia do not follow from pin.d and cross.r_b"
        return found, "give pin.l, from the hub to the middle of the hole, or hub.mass and hub.inertia"
    if isinstance(section, Contact):
        if section.D_H is None:
            return "missing key", 'give D_H, or the radial clearance, for example clearance = "0.03 mm"'
        if not 0.0 < section.D_P <= section.D_H:
            return NO_FIT
        if section.D_H == section.D_P:
            return "eq. (3) has no value without clearance", "give a clearance above zero, or k1u and k2u"
    names = [key.rpartition(".")[2] for key in keys]
    ways = dict.fromkeys(way for key in keys for way in DERIVED[key].enough or (DERIVED[key].follows,))
    begun = [way for way in ways if any(derived.get(section, key.partition(".")[2]) is not None for key in way)]
    them = "it" if len(names) == 1 else "them"
    instead = "".join(f", or {' and '.join(left)}" for way in begun or ways if (left := _left_out(way, keys, section)))
    return f"missing {_keys(names)}", f"give {them}{instead}"


def _keys(names: Sequence[str]) -> str:
    return f"key{'s' * (len(names) > 1)} {', '.join(names)}"


def _left_out(way: tuple[str, ...], keys: list[str], section: BaseModel) -> list[str]:
    """Names of the keys of `way`, without `keys`, that a section has but that are not given."""
    names = [key.partition(".")[2] for key in way if key not in keys]
    return [name for name in names if name in type(section).model_fields and derived.get(section, name) is None]


def overridden(data: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Replace keys of a joint file by those of `over`; remove what follows from these and is not in `over`, too."""
    given = leaves(over).keys()
    outdated = derived.changed(given, leaves(data)) - given
    return laid_over(_without(data, outdated), over)


def laid_over(below: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Replace keys of a joint by those of `over`, and remove a third of a bearing."""
    return merged(_without(below, derived.replaced(leaves(over), leaves(below))), over)


def merged(data: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Replace keys of `data` by those of `over`, table by table."""
    result = dict(data)
    for key, value in over.items():
        below = result.get(key)
        if isinstance(below, Mapping) and isinstance(value, Mapping):
            value = merged(below, value)
        result[key] = value
    return result


def leaves(table: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Values of nested tables by dotted key; tuples become lists, as in JSON."""
    values: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            values |= leaves(value, f"{before}{key}.")
        else:
            values[f"{before}{key}"] = list(value) if isinstance(value, tuple) else value
    return values


def nested(values: Mapping[str, Any]) -> dict[str, Any]:
    """Nested tables from dotted keys: the inverse of `leaves`."""
    result: dict[str, Any] = {}
    for key, value in values.items():
        *tables, name = key.split(".")
        inner: Any = value if not tables else {name: value}
        for part in reversed(tables[1:]):
            inner = {part: inner}
        result = merged(result, {tables[0] if tables else name: inner})
    return result


def _without(table: Mapping[str, Any], away: Collection[str], before: str = "") -> dict[str, Any]:
    return {
        key: _without(value, away, f"{before}{key}.") if isinstance(value, Mapping) else value
        for key, value in table.items()
        if f"{before}{key}" not in away
    }
