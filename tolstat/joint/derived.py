"""Which keys of a joint follow from which others, and by what formula: the one table of it, `DERIVED`.

A joint file may leave out each of these keys. Where a key of a joint file is overridden, all that follows from it is
computed anew unless it is given, too: what the file has for it no longer counts. Hub and bearing diameters stay as they
are, with a warning: a hub may have any form, and a bearing need not have the pin's diameter.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Set
from types import SimpleNamespace
from typing import Any, NamedTuple, TypeVar

from pydantic import BaseModel

from tolstat.joint import material

ModelT = TypeVar("ModelT", bound=BaseModel)

WIDE = 0.05
"""Clearance, or difference of two diameters, relative to a diameter, that no bearing has by intention."""
ISOTROPIC = 0.1
"""Difference between G and E/(2 (1 + nu)), relative to the latter, that no metal has."""
PIN_CHI, ARM_CHI = 1.11, 1.2
"""Shear factors of a circular and of a rectangular section, Cirelli et al. (2021), above Table 3."""
BEARING = ("contact.D_H", "contact.D_P", "contact.clearance")
"""Keys any two of which define the third."""
HALVINGS = 10
"""Maximum number of times that the largest load of the fit to eq. (3) is halved."""
ROUND, RECTANGULAR = ("arm.d",), ("arm.width", "arm.depth")
"""Keys of a round and of a rectangular section of the arms; a joint has one of the two, or neither."""


class Rule(NamedTuple):
    """How a key follows from others.

    Attributes
    ----------
    follows : tuple of str
        Keys that it follows from; those of a bearing follow from each other, too.
    formula : str
        The formula in words.
    value : callable
        The sections of the joint as attributes -> SI value; None where the formula has none.
    unit : str
        SI unit.
    stays : bool
        Whether the value of a joint file stays when a key that it follows from is overridden.
    enough : tuple of tuple of str
        Sets of keys of `follows`, of which one suffices for the formula; without any, all of `follows` are needed.
    """

    follows: tuple[str, ...]
    formula: str
    value: Callable[[Any], Any]
    unit: str
    stays: bool = False
    enough: tuple[tuple[str, ...], ...] = ()

    def applies(self, joint: Any) -> bool:
        """Whether a joint has the keys that the formula needs."""
        return any(all(get(joint, key) is not None for key in keys) for keys in self.enough or (self.follows,))


def _beam(body: str, modulus: str, section: str, length: str) -> Rule:
    """Rule of a stiffness of a bushing: that of a pin or arm as a beam along z, lumped at its end, eqs. (9)-(11)."""
    is_shear = (modulus, section) == ("G", "A")

    def value(joint: Any) -> float:
        part = getattr(joint, body)
        factor = part.chi * getattr(part, length) if is_shear else getattr(part, length)
        return float(getattr(joint.material, modulus) * getattr(part, section) / factor)

    keys = (f"material.{modulus}", f"{body}.{section}", *([f"{body}.chi"] if is_shear else []), f"{body}.{length}")
    formula = f"{modulus} {section}/{f'(chi {length})' if is_shear else length}, eqs. (9)-(11)"
    return Rule(keys, formula, value, "N/m" if section == "A" else "N*m/rad")


def _section(name: str, unit: str, of_round: str, of_rectangular: str) -> Rule:
    """Rule of a property of the arms' section, that of a circle or that of a rectangle: `A`, `Jx` or `Jy`."""
    index = ("A", "Jx", "Jy").index(name)

    def value(joint: Any) -> float:
        arm = joint.arm
        if arm.d is None:
            w, d = float(arm.width), float(arm.depth)
            return (w * d, w * d**3 / 12.0, d * w**3 / 12.0)[index]
        A, J = material.circle(arm.d)
        return (A, J, J)[index]

    formula = f"{of_rectangular}, of a round arm {of_round}"
    return Rule((*ROUND, *RECTANGULAR), formula, value, unit, enough=(ROUND, RECTANGULAR))


def _pin_diameter(joint: Any) -> float:
    contact = joint.contact
    one_left_out = contact.D_H is None or contact.clearance is None
    return float(joint.pin.d if one_left_out else contact.D_H - 2.0 * contact.clearance)


def _hub(joint: Any) -> tuple[float | None, tuple[float, ...]]:
    """Mass and inertia of the hub; None where its pins overlap."""
    if not 2.0 * joint.cross.r_b > joint.pin.d:
        return None, ()
    return material.crossed_cylinders(joint.material.rho, joint.pin.d, 2.0 * joint.cross.r_b)


def _hub_inertia(joint: Any) -> tuple[float, ...] | None:
    mass, inertia = _hub(joint)
    return None if mass is None else tuple(joint.hub.mass / mass * moment for moment in inertia)


def fitted_load(steel: Any, contact: Any) -> float:
    """Largest load (N) of the fit of k1u and k2u: `fit_load`, or what has to be taken in its place.

    It is halved until the fit stiffens, at most `HALVINGS` times.
    """
    load = float(contact.fit_load)
    for _ in range(HALVINGS):
        k1, k2 = material.fit_contact(load, contact.z, contact.D_H, contact.D_P, steel.E, steel.nu)
        if k1 >= 0.0 and k2 > 0.0:
            break
        load *= 0.5
    return load


def _fitted(joint: Any) -> tuple[float, float] | tuple[None, None]:
    contact, steel = joint.contact, joint.material
    if not contact.D_H > contact.D_P > 0.0:
        return None, None
    return material.fit_contact(fitted_load(steel, contact), contact.z, contact.D_H, contact.D_P, steel.E, steel.nu)


def _contact_damping(joint: Any) -> float:
    pin, steel = joint.pin, joint.material
    return material.contact_damping(
        joint.contact.xi, pin.mass, length=pin.l, A=pin.A, J=pin.J, E=steel.E, rho=steel.rho
    )


_FIT = ("material.E", "material.nu", *BEARING, "contact.z", "contact.fit_load")
_CYLINDERS = "two crossed cylinders of diameter pin.d, 2 r_b long"

DERIVED: dict[str, Rule] = {
    "material.G": Rule(
        ("material.E", "material.nu"),
        "E/(2 (1 + nu))",
        lambda j: 0.5 * j.material.E / (1.0 + j.material.nu),
        "Pa",
    ),
    "pin.A": Rule(("pin.d",), "pi d^2/4", lambda j: material.circle(j.pin.d)[0], "m^2"),
    "pin.J": Rule(("pin.d",), "pi d^4/64", lambda j: material.circle(j.pin.d)[1], "m^4"),
    "pin.Jp": Rule(("pin.J",), "2 J", lambda j: 2.0 * j.pin.J, "m^4"),
    "pin.mass": Rule(("material.rho", "pin.A", "pin.l"), "rho A l", lambda j: j.material.rho * j.pin.A * j.pin.l, "kg"),
    "pin.inertia": Rule(
        ("pin.mass", "pin.d", "pin.l"),
        "solid cylinder of this mass, d and l",
        lambda j: material.cylinder_inertia(j.pin.mass, j.pin.d, j.pin.l),
        "kg*m^2",
    ),
    "arm.chi": Rule(
        (*ROUND, *RECTANGULAR),
        f"{ARM_CHI}, of a round arm {PIN_CHI}",
        lambda j: ARM_CHI if j.arm.d is None else PIN_CHI,
        "1",
        enough=((),),
    ),
    "arm.A": _section("A", "m^2", "pi d^2/4", "width depth"),
    "arm.Jx": _section("Jx", "m^4", "pi d^4/64", "width depth^3/12"),
    "arm.Jy": _section("Jy", "m^4", "pi d^4/64", "depth width^3/12"),
    "arm.Jp": Rule(("arm.Jx", "arm.Jy"), "Jx + Jy", lambda j: j.arm.Jx + j.arm.Jy, "m^4"),
    "arm.mass": Rule(
        ("material.rho", "arm.A", "arm.l_f"), "rho A l_f", lambda j: j.material.rho * j.arm.A * j.arm.l_f, "kg"
    ),
    "arm.inertia": Rule(
        ("arm.mass", "arm.A", "arm.Jx", "arm.Jy", "arm.l_f"),
        "box of this mass, l_f long, with the area moments of the section",
        lambda j: material.box_inertia(j.arm.mass, j.arm.A, j.arm.Jx, j.arm.Jy, j.arm.l_f),
        "kg*m^2",
    ),
    "cross.r_b": Rule(("cross.R", "pin.l"), "R - pin.l", lambda j: j.cross.R - j.pin.l, "m"),
    "hub.mass": Rule(("material.rho", "pin.d", "cross.r_b"), _CYLINDERS, lambda j: _hub(j)[0], "kg", stays=True),
    "hub.inertia": Rule(
        ("hub.mass", "pin.d", "cross.r_b"), f"{_CYLINDERS}, of this mass", _hub_inertia, "kg*m^2", stays=True
    ),
    "bushing.cross.k_x": _beam("pin", "G", "A", "l"),
    "bushing.cross.k_y": _beam("pin", "G", "A", "l"),
    "bushing.cross.k_z": _beam("pin", "E", "A", "l"),
    "bushing.cross.k_bx": _beam("pin", "E", "J", "l"),
    "bushing.cross.k_by": _beam("pin", "E", "J", "l"),
    "bushing.cross.k_tz": _beam("pin", "G", "Jp", "l"),
    "bushing.fork.k_x": _beam("arm", "G", "A", "l_f"),
    "bushing.fork.k_y": _beam("arm", "G", "A", "l_f"),
    "bushing.fork.k_z": _beam("arm", "E", "A", "l_f"),
    "bushing.fork.k_bx": _beam("arm", "E", "Jx", "l_f"),
    "bushing.fork.k_by": _beam("arm", "E", "Jy", "l_f"),
    "bushing.fork.k_tz": _beam("arm", "G", "Jp", "l_f"),
    "contact.D_P": Rule(
        ("pin.d",), "D_H - 2 clearance, or pin.d where D_H or clearance is left out", _pin_diameter, "m", stays=True
    ),
    "contact.D_H": Rule(
        ("contact.D_P", "contact.clearance"),
        "D_P + 2 clearance",
        lambda j: j.contact.D_P + 2.0 * j.contact.clearance,
        "m",
        stays=True,
    ),
    "contact.clearance": Rule(
        ("contact.D_H", "contact.D_P"),
        "(D_H - D_P)/2",
        lambda j: 0.5 * (j.contact.D_H - j.contact.D_P),
        "m",
        stays=True,
    ),
    "contact.k1u": Rule(_FIT, "fit of eq. (5) to eq. (3) up to fit_load", lambda j: _fitted(j)[0], "N/m^2"),
    "contact.k2u": Rule(_FIT, "fit of eq. (5) to eq. (3) up to fit_load", lambda j: _fitted(j)[1], "N/m"),
    "contact.k1p": Rule(
        ("contact.k1u", "contact.H"), "k1u/H^2, eq. (4)", lambda j: j.contact.k1u / j.contact.H**2, "N/m^2"
    ),
    "contact.k2p": Rule(("contact.k2u", "contact.H"), "k2u/H, eq. (4)", lambda j: j.contact.k2u / j.contact.H, "N/m"),
    "contact.c_d": Rule(
        ("contact.xi", "pin.mass", "pin.l", "pin.A", "pin.J", "material.E", "material.rho"),
        "2 xi m omega, eqs. (6)-(7)",
        _contact_damping,
        "N*s/m",
    ),
}
"""Keys that follow from others, each after those that it follows from (but for a bearing's)."""


def changed(given: Set[str], in_file: Collection[str]) -> set[str]:
    """Keys with another value than before when a joint file with the keys `in_file` is overridden by the keys `given`.

    They contain `given`; the others follow from them.
    """
    keys = set(given)
    for key, rule in DERIVED.items():
        if key not in keys and not (rule.stays and key in in_file) and keys.intersection(rule.follows):
            keys.add(key)
    return keys


def replaced(given: Collection[str], in_file: Collection[str]) -> set[str]:
    """Keys among `in_file` that give way to `given` ones of the same bearing or section.

    Of a bearing two of three keys define it; the section of an arm is round or rectangular.
    """
    new = set(given).intersection(BEARING)
    hole, pin, clearance = BEARING
    third = {clearance: pin, pin: clearance} if hole in in_file else {hole: clearance}
    away = {third[key] for key in new & third.keys()}
    if len(new) > 1 or (new == {clearance} and "pin.d" in given):
        away = set(BEARING)
    for section, other in ((ROUND, RECTANGULAR), (RECTANGULAR, ROUND)):
        if set(section).intersection(given):
            away.update(other)
    return (away - set(given)).intersection(in_file)


UNITS = {key: rule.unit for key, rule in DERIVED.items()} | {"pin.d": "m"}
"""SI unit of each key that a warning can be about."""


def completed(name: str, section: ModelT, others: Mapping[str, Any]) -> ModelT:
    """Copy of a section with the keys that were left out filled in, as far as they follow from others.

    Only keys that were given stay in ``model_fields_set``: a dump that leaves out unset keys holds what was given.

    Parameters
    ----------
    name : str
        Its name.
    section : BaseModel
        The section.
    others : mapping
        The sections before it, completed.
    """
    copy = section.model_copy()
    joint = SimpleNamespace(**others, **{name: copy})
    for key, rule in DERIVED.items():
        path = key.split(".")
        if path[0] == name and get(joint, key) is None and rule.applies(joint):
            for table in path[1:-1]:
                copy.__dict__[table] = get(joint, f"{name}.{table}").model_copy()
            holder = get(joint, ".".join(path[:-1]))
            holder.__dict__[path[-1]] = rule.value(joint)
    return copy


def missing(name: str, section: BaseModel, others: Mapping[str, Any], exempt: Collection[str]) -> list[str]:
    """Keys of a completed section that neither are given nor follow from others, but for those `exempt`.

    Keys that follow from such a key are left out.
    """
    joint = SimpleNamespace(**others, **{name: section})
    lacking: dict[str, tuple[str, ...]] = {}
    unknown: set[str] = set()
    for key, rule in DERIVED.items():
        if not key.startswith(f"{name}.") or key in exempt or get(joint, key) is not None:
            continue
        if unknown.intersection(rule.follows) or not all(
            hasattr(joint, other.partition(".")[0]) for other in rule.follows
        ):
            unknown.add(key)  # a section that it follows from has faults of its own
        else:
            lacking[key] = rule.follows
    return [key for key, follows in lacking.items() if not lacking.keys() & set(follows)] or list(lacking)


def get(joint: Any, key: str) -> Any:
    """Value of a dotted key; None if it, or a section on the way to it, is missing."""
    for part in key.split("."):
        joint = getattr(joint, part, None)
    return joint


def expected(joint: Any, given: Set[str], changed: Set[str], stay: Set[str]) -> dict[str, Any]:
    """Values that hub and bearing would have by their formulas, where those of a joint file stay and do not agree.

    Parameters
    ----------
    joint : Joint
        The joint.
    given, changed, stay : collection of str
        Keys of the override, keys that have other values by it, and keys that have those of the joint file.

    Returns
    -------
    dict
        Key to SI value, words that say what gives it, and the key that may be given instead, or nothing.
    """
    disagreeing: dict[str, Any] = {}
    mass, inertia = _hub(joint)
    if mass is not None and changed & {*DERIVED["hub.mass"].follows, "hub.mass"}:
        ratio = joint.hub.mass / mass if "hub.mass" in changed else 1.0
        values = {"hub.mass": mass, "hub.inertia": tuple(ratio * moment for moment in inertia)}
        disagreeing |= {key: (value, f"{_CYLINDERS}, give", "") for key, value in values.items() if key in stay}
    contact, d = joint.contact, joint.pin.d
    hole, pin, clearance = BEARING
    if "pin.d" in changed and pin in stay and not math.isclose(contact.D_P, d, rel_tol=1e-6):
        disagreeing[pin] = d, "pin.d gives", clearance
        if hole in stay:
            disagreeing[hole] = d + 2.0 * contact.clearance, "pin.d and the clearance of these two give", clearance
    elif changed & {"pin.d", pin} and hole in stay and contact.clearance > WIDE * contact.D_P:
        disagreeing[hole] = contact.D_P, "that is much clearance; without any contact.D_P gives", clearance
    if pin in given and {hole, clearance} & given and "pin.d" in stay and abs(contact.D_P - d) > WIDE * d:
        disagreeing["pin.d"] = contact.D_P, "contact.D_P gives", ""
    return disagreeing
