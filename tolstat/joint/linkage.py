"""A closed chain of members that pins join, from a file: members, pairs, and what drives it (docs/mechanisms.md)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Field, field_validator

from tolstat.common import units
from tolstat.common.strict import Strict, refuse
from tolstat.joint import chain
from tolstat.joint.chain import GROUND, Chain, Joined
from tolstat.joint.material import Array
from tolstat.joint.sections import Length, Triple

ENDS = {"outer": (1,), "inner": (-1,), "both": (1, -1), "none": ()}
"""Ends of a pin that have a thrust face, by the word of `PairOf.faces`."""
ACROSS = 1e-3
"""Least sine of the angle between an axis and a direction that tells t, rad."""
GRAVITY = 9.81
"""Acceleration by gravity, m/s^2."""


def _direction(value: tuple[float, float, float]) -> tuple[float, float, float]:
    if not np.linalg.norm(value) > 0.0:
        raise refuse("{input} is no direction", "give the components of a vector, such as [0, 0, 1]")
    return value


Place = Annotated[tuple[units.Length, units.Length, units.Length], Field(examples=[["0 mm", "0 mm", "120 mm"]])]
Direction = Annotated[
    tuple[units.Number, units.Number, units.Number], AfterValidator(_direction), Field(examples=[[0, 0, 1]])
]


class MemberOf(Strict):
    """A member: a rigid body between its pins and eyes, in ground axes as the mechanism stands at the angle zero."""

    mass: units.Mass = Field(examples=["4 kg"])
    """mass, without the lumps of its pins and eyes"""
    centre: Place
    """mass centre"""
    inertia: Triple = Field(examples=[["0.003 kg*m^2", "0.05 kg*m^2", "0.05 kg*m^2"]])
    """principal moments of inertia through the mass centre, about `axis` and the two directions that follow from it"""
    axis: Direction = (1.0, 0.0, 0.0)
    """first principal axis; the second is the ground's x made perpendicular to it, or y where `axis` lies along x"""


class PairOf(Strict):
    """A pin of one member in the eye of another."""

    pin: str = Field(examples=["crank"])
    """member that carries the pin, or `ground`"""
    eye: str = Field(examples=["coupler"])
    """member that carries the eye, or `ground`"""
    point: Place
    """middle of pin and eye, in ground axes at the angle zero"""
    axis: Direction
    """direction e of the pin, outwards, in ground axes at the angle zero"""
    t: Direction | None = Field(default=None, examples=[[1, 0, 0]])
    """direction t of errors and bushings of the pin, made perpendicular to `axis`; when left out: the ground's x, or y
    where `axis` lies along x"""
    eye_t: Direction | None = Field(default=None, examples=[[1, 0, 0]])
    """the same of the eye, whose beam lies along z = e x t; when left out: `t`"""
    clearance: Length | None = Field(default=None, examples=["0.02 mm"])
    """radial clearance; when left out: that of the joint's contact"""
    joint: Annotated[dict[str, Any], Field(json_schema_extra={"x-table": "keys"})] = Field(
        default={}, examples=[{"pin": {"d": "20 mm", "l": "35 mm"}, "contact": {"D_P": "20 mm"}}]
    )
    """keys of pin and eye in place of those of the study's joint"""
    faces: Literal["outer", "inner", "both", "none"] = "both"
    """ends of the pin that have a thrust face, where the joint has `thrust`"""


class Drive(Strict):
    """What moves the mechanism: a member that turns in the ground, or swings.

    A driven member without a pair in the ground is held like the end of a motor's shaft; else its turn alone is given.
    """

    member: str = Field(examples=["crank"])
    """the driven member"""
    point: Place | None = None
    """a point of its axis; when left out: that of its first pair in the ground"""
    axis: Direction | None = None
    """its axis, about which it turns to the right for a positive speed; when left out: that of this pair"""
    swing: tuple[units.Angle, units.Angle] | None = Field(default=None, examples=[["-30 deg", "60 deg"]])
    """the angles between which it swings once to and fro in each period, from the first one; the angle zero is the one
    that the file describes. When left out: it turns"""

    @field_validator("swing")
    @classmethod
    def _apart(cls, value: tuple[float, float] | None) -> tuple[float, float] | None:
        if value and value[0] == value[1]:
            raise refuse("both angles are the same", "give two, or leave it out: the member turns")
        return value


class ForceOn(Strict):
    """A force on a member."""

    member: str = Field(examples=["rocker"])
    """the member"""
    point: Place
    """where it acts, in ground axes at the angle zero"""
    force: tuple[units.Force, units.Force, units.Force] = Field(examples=[["0 N", "-500 N", "0 N"]])
    """its components, in ground axes at the angle zero"""
    turns: bool = False
    """whether it turns with the member; when left out it keeps its direction in the ground"""


class Linkage(Strict):
    """A mechanism: members that pins join to a closed chain. Pins and eyes are those of the study's joint."""

    description: str = Field(default="", examples=["flap, drawing 815"])
    """text about the mechanism"""
    member: dict[str, MemberOf] = Field(default={}, examples=[{}])
    """Members that move, by name, without a driven one that is held"""
    pair: dict[str, PairOf] = Field(min_length=1, examples=[{}])
    """Pairs of a pin and an eye, by name"""
    drive: Drive
    """What moves it"""
    force: dict[str, ForceOn] = Field(default={}, examples=[{}])
    """Forces on members, by name"""
    loaded: str = Field(default="", examples=["rocker"])
    """member that `operation.torque` acts on, about the axis of its first pair in the file and against its direction;
    when left out: there is no torque"""
    down: Direction | None = Field(default=None, examples=[[0, 0, -1]])
    """direction of gravity; when left out: no weight"""

    @field_validator("member")
    @classmethod
    def _names(cls, value: dict[str, MemberOf]) -> dict[str, MemberOf]:
        if GROUND in value:
            raise refuse("ground does not move", "remove it")
        return value

    def faults(self) -> Iterator[tuple[str, str, str]]:
        """Key, what was found and remedy of what does not go together: of members, pairs, the drive and the load."""
        in_pairs = dict.fromkeys(name for pair in self.pair.values() for name in (pair.pin, pair.eye))
        for name, pair in self.pair.items():
            if pair.pin == pair.eye:
                yield f"pair.{name}", f"pin and eye are both of {pair.pin}", "give two members"
            for key in ("t", "eye_t"):
                across = getattr(pair, key)
                if across and np.linalg.norm(np.cross(unit(across), unit(pair.axis))) < ACROSS:
                    yield f"pair.{name}.{key}", "lies along the axis of the pin", "give a direction across it"
        driven = self.drive.member
        if driven == GROUND or driven not in in_pairs:
            others = ", ".join(name for name in in_pairs if name != GROUND)
            yield "drive.member", f"{driven!r} is in no pair", f"write one of {others}"
            return
        held = "" if self.turns_alone else driven
        for name in self.member:
            if name not in in_pairs:
                yield f"member.{name}", "is in no pair", "add a pair, or remove it"
            elif name == held:
                remedy = "remove it, or give it a pair in the ground"
                yield f"member.{name}", "has no effect: the drive holds it, like the end of a motor's shaft", remedy
        for name in in_pairs:
            if name not in (GROUND, held, *self.member):
                yield (
                    f"member.{name}",
                    "missing table: a pair names it",
                    "give mass, centre and inertia, or mend the pair",
                )
        if held and None in (self.drive.point, self.drive.axis):
            found = f"has no axis: {driven} has no pair in the ground"
            yield "drive", found, 'give point = ["0 mm", "0 mm", "0 mm"] and axis = [0, 0, 1], of yours'
        elif driven in self.member and not self._along_a_principal_axis:
            found = "has no principal axis along the axis of the drive"
            yield f"member.{driven}.axis", found, "give the axis of the drive"
        acted_on = {f"force.{name}.member": of.member for name, of in self.force.items()}
        for key, name in (acted_on | {"loaded": self.loaded} if self.loaded else acted_on).items():
            if name not in self.member:
                yield key, f"{name!r} is no member that moves freely", f"write one of {', '.join(self.member)}"

    @property
    def turns_alone(self) -> bool:
        """Whether the turn alone of the driven member is given: it has pairs in the ground."""
        return bool(self._in_ground)

    @property
    def drive_axis(self) -> Array:
        """Unit vector of the axis of the drive."""
        given = [self.drive.axis] if self.drive.axis else [pair.axis for pair in self._in_ground]
        return unit(given[0])

    @property
    def _in_ground(self) -> list[PairOf]:
        both = {GROUND, self.drive.member}
        return [pair for pair in self.pair.values() if {pair.pin, pair.eye} == both]

    @property
    def _along_a_principal_axis(self) -> bool:
        axes = triad(unit(self.member[self.drive.member].axis))
        return bool(np.abs(axes @ self.drive_axis).max() > 1.0 - 1e-6)

    @property
    def chain(self) -> Chain:
        """Its ideal motion.

        Raises
        ------
        InputError
            Where it does not move, or moves in more than one way.
        """
        return _chain_of(self.model_dump_json())

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> Linkage:
        """Linkage from its values in SI units, as result files hold them."""
        return cls.model_validate(values, context={"si": True})

    @property
    def in_words(self) -> str:
        """``"4 members, 3 pairs, crank turns"``."""
        members = {name for pair in self.pair.values() for name in (pair.pin, pair.eye)}
        how = "swings" if self.drive.swing else "turns"
        return f"{len(members)} members, {len(self.pair)} pairs, {self.drive.member} {how}"


@lru_cache(maxsize=64)
def _chain_of(text: str) -> Chain:
    linkage = Linkage.model_validate_json(text)
    pairs = {
        name: Joined(pair.pin, pair.eye, np.array(pair.point), unit(pair.axis)) for name, pair in linkage.pair.items()
    }
    points = [linkage.drive.point] if linkage.drive.point else [pair.point for pair in linkage._in_ground]
    drive = Joined(GROUND, linkage.drive.member, np.array(points[0]), linkage.drive_axis)
    return chain.solve(pairs, drive, linkage.drive.swing)


def unit(direction: tuple[float, float, float]) -> Array:
    """Unit vector."""
    return np.asarray(np.array(direction) / np.linalg.norm(direction))


def triad(axis: Array, t: tuple[float, float, float] | None = None) -> Array:
    """Rows e, t, z of the triad of an axis: t the given direction, or x, made perpendicular; y where e is along x."""
    for other in (t, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)):
        along = np.zeros(3) if other is None else unit(other)
        across = along - axis @ along * axis
        if np.linalg.norm(across) > ACROSS:
            across /= np.linalg.norm(across)
            return np.array([axis, across, np.cross(axis, across)])
    raise AssertionError("one of x and y is across")
