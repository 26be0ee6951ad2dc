"""The drive shaft of two joints: joint 2, and the tubes between the joints (docs/model.md, "Drive shaft")."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import (
    AfterValidator,
    Field,
    SerializationInfo,
    ValidationInfo,
    WithJsonSchema,
    field_serializer,
    model_validator,
)

from tolstat.common import units
from tolstat.common.cardan import CARDAN, MECHANISMS, PARTS, SHAFT, SPLINED, named
from tolstat.common.mechanism import Mechanism
from tolstat.common.strict import Strict, refuse, validate
from tolstat.common.units import POSITIVE
from tolstat.joint.material import Array
from tolstat.joint.model import Joint
from tolstat.joint.sections import Length, Stiffness, Unbalance
from tolstat.joint.spline import Spline

PLANES = {"Z": math.pi, "W": 0.0}
"""Angle of the plane of joint 2 ahead of that of joint 1, of arrangements by their names."""
OF_FIRST, OF_SECOND = {"thrust", "friction", "input_bearings", "root"}, {*PARTS} - {"input_bearings"}
"""Parts that joint 1 gives a drive shaft, and those that joint 2 gives it."""
STEEL = 7850.0
"""Density of a tube that is given by its section, kg/m^3."""


def check_misalignment(alpha: float, info: ValidationInfo) -> float:
    """Refuse an angle at which a joint cannot turn, as a `PydanticCustomError`."""
    if not abs(alpha) < np.pi / 2:
        key = str(info.field_name)
        raise refuse(f"a Cardan joint cannot turn at {{{key}}}", "give less than 90 deg", key)
    return alpha


class Tube(Strict):
    """A tube with its forks: its section, of steel, or its mass and moments of inertia."""

    diameter: Length | None = Field(default=None, examples=["76 mm"])
    """outer diameter"""
    wall: Length | None = Field(default=None, examples=["2.5 mm"])
    """thickness of the wall"""
    mass: Annotated[units.Mass, POSITIVE] | None = Field(default=None, examples=["5 kg"])
    """mass"""
    inertia: Annotated[units.Inertia, POSITIVE] | None = Field(default=None, examples=["0.005 kg*m^2"])
    """moment of inertia about its axis"""
    inertia_across: Annotated[units.Inertia, POSITIVE] | None = Field(default=None, examples=["0.15 kg*m^2"])
    """moment of inertia about an axis across it, through its mass centre"""
    centre: Length | None = Field(default=None, examples=["0.3 m"])
    """distance of its mass centre from the joint that it carries, of a single tube from joint 1; when left out: half of
    its length"""

    unbalance: Unbalance | None = None
    """Unbalance of the tube"""

    @model_validator(mode="after")
    def _one_of_two(self) -> Tube:
        ways = ("diameter", "wall"), ("mass", "inertia", "inertia_across")
        given = [[key for key in way if getattr(self, key) is not None] for way in ways]
        section, mass = (" and ".join(keys) for keys in given)
        if all(given):
            raise refuse(f"has {section} beside {mass}", f"remove {section}, or {mass}")
        if not any(given):
            raise refuse("has neither a section nor a mass", 'give diameter = "76 mm" and wall = "2.5 mm", of yours')
        way = ways[0] if given[0] else ways[1]
        if lacking := [key for key in way if getattr(self, key) is None]:
            raise refuse(f"has {section or mass} without {' and '.join(lacking)}", f"add {' and '.join(lacking)}")
        if self.wall is not None and self.diameter is not None and self.wall > 0.5 * self.diameter:
            raise refuse("its wall is thicker than half of its diameter", "check wall and diameter")
        return self

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> Tube:
        """Tube from its values in SI units."""
        made = {"unbalance": Unbalance.model_construct(**values["unbalance"])} if values.get("unbalance") else {}
        return cls.model_construct(**{**values, **made})

    def body(self, length: float) -> tuple[float, Array]:
        """Mass (kg) and moments of inertia about x, y, z (kg m^2) of a tube of a length (m)."""
        if self.diameter is None or self.wall is None:
            across, about = self.inertia_across or 0.0, self.inertia or 0.0
            return self.mass or 0.0, np.array([across, across, about])
        outer, inner = 0.5 * self.diameter, 0.5 * self.diameter - self.wall
        mass = STEEL * math.pi * (outer**2 - inner**2) * length
        about = 0.5 * mass * (outer**2 + inner**2)
        across = 0.5 * about + mass * length**2 / 12
        return mass, np.array([across, across, about])


class SplineOfTubes(Spline):
    """Spline between the tubes: they slide in one another, unless it sticks."""

    at: Length = Field(examples=["0.6 m"])
    """distance from joint 1"""
    k_lateral: Stiffness = 2e8
    """stiffness across"""
    k_bending: Annotated[units.RotaryStiffness, POSITIVE] = 1e6
    """stiffness against bending"""
    k_torsion: Annotated[units.RotaryStiffness, POSITIVE] = 1e5
    """stiffness against torsion"""
    axial_damping: units.Damping = 2e3
    """damping of the motion along it"""


def of_joints(first: Collection[str], second: Collection[str]) -> set[str]:
    """Parts of a drive shaft by those of its joints: its first shaft is that of joint 1, its last that of joint 2."""
    return OF_FIRST.intersection(first) | OF_SECOND.intersection(second)


def by_keys(shaft: object, first: Collection[str], second: Collection[str]) -> Mechanism:
    """What is simulated with a `[shaft]` as a study writes it, None without, with the parts of its joints."""
    if shaft is None:
        return MECHANISMS[named(CARDAN, first)]
    keys = shaft if isinstance(shaft, Mapping) else {}
    tubes = [keys.get(name) for name in ("tube", "tube2")]
    unbalanced = {"unbalance"} if any(isinstance(tube, Mapping) and "unbalance" in tube for tube in tubes) else set()
    parts = of_joints(first, second if "joint2" in keys else first) | unbalanced
    return MECHANISMS[named(SPLINED if "spline" in keys else SHAFT, parts)]


class Lumped(NamedTuple):
    """A tube as a lump: its mass centre's distance from joint 1 (m), mass (kg), moments of inertia (kg m^2)."""

    at: float
    mass: float
    inertia: Array
    unbalance: Unbalance | None


class DriveShaft(Strict):
    """Drive shaft of two joints: the second one, and what is between them. Joint 1 is that of [joint]."""

    alpha: Annotated[units.Angle, AfterValidator(check_misalignment)] = Field(examples=["6 deg"])
    """misalignment of joint 2, below 90 deg; that of joint 1 is `operation.alpha`"""
    arrangement: Annotated[float | str, units.Quantity("rad", words=tuple(PLANES))] = Field(examples=["Z"])
    """`Z`: the outer shafts point the same way, at equal misalignments they are parallel; `W`: both bend the same way;
    or the angle of the plane of joint 2 ahead of that of joint 1, about the tube"""
    offset: units.Angle = Field(default=0.0, examples=["5 deg"])
    """angle of the input fork of joint 2 ahead of where, at equal misalignments, the output turns evenly: the fault of
    the forks' phase"""
    length: Length = Field(examples=["1.2 m"])
    """distance of the centres of the two joints"""
    tube: Tube
    """The tube; with a spline, that of joint 1"""
    tube2: Tube | None = None
    """The tube of joint 2, where a spline is; when left out: like that of joint 1"""
    spline: SplineOfTubes | None = None
    """Spline between two tubes; without it there is one tube"""
    joint2: Annotated[Joint | None, WithJsonSchema({"type": "object", "x-table": "overrides"})] = Field(
        default=None, examples=[{"base": "pin25", "contact": {"clearance": "0.02 mm"}}]
    )
    """joint 2, as `[joint]` is joint 1, with a `base` of its own; when left out: like joint 1"""

    @field_serializer("joint2")
    def _as_given(self, joint2: Joint | None, info: SerializationInfo) -> dict[str, Any] | None:
        return None if joint2 is None else joint2.given("json" if info.mode == "json" else "python")

    @model_validator(mode="after")
    def _fits(self) -> DriveShaft:
        if self.spline is None and self.tube2 is not None:
            raise refuse("has tube2 without a spline", "remove tube2, or add [shaft.spline]")
        if self.spline is not None and self.spline.at >= self.length:
            raise refuse("spline.at = {spline.at} is not between the joints", "give less than length", "spline.at")
        for key, tube in (("tube", self.tube), ("tube2", self.tube2)):
            outer = math.inf if tube is None or tube.diameter is None else tube.diameter
            if self.spline is not None and self.spline.diameter > outer:
                found = f"spline.diameter = {{spline.diameter}} is larger than {key}.diameter = {{{key}.diameter}}"
                raise refuse(found, "give the pitch diameter of the spline", "spline.diameter", f"{key}.diameter")
        return self

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> DriveShaft:
        """Drive shaft from its values in SI units, as result files hold them."""
        made: dict[str, Strict] = {key: Tube.of(values[key]) for key in ("tube", "tube2") if values.get(key)}
        if values.get("spline"):
            made["spline"] = SplineOfTubes.model_construct(**values["spline"])
        if values.get("joint2"):
            made["joint2"] = validate(Joint, values["joint2"], "shaft.joint2", context={"si": True})
        return cls.model_construct(**{**values, **made})

    @property
    def in_words(self) -> str:
        """``"Z arrangement, joint 2 of 6 deg, offset 5 deg"``."""
        turned = f", offset {math.degrees(self.offset):.4g} deg" if self.offset else ""
        how = self.arrangement if isinstance(self.arrangement, str) else f"{math.degrees(self.arrangement):.4g} deg"
        return f"{how} arrangement, joint 2 of {math.degrees(self.alpha):.4g} deg{turned}"

    @property
    def mechanism(self) -> Mechanism:
        """What is simulated, without what its joints have beside."""
        return SHAFT if self.spline is None else SPLINED

    def parts(self, first: Joint) -> set[str]:
        """Those of `cardan.PARTS` that joint 1, `first`, joint 2 and the tubes give it."""
        of_tubes = {"unbalance"} if any(tube.unbalance for tube in self.tubes.values()) else set()
        return of_joints(first.parts, (self.joint2 or first).parts) | of_tubes

    @property
    def plane(self) -> float:
        """Angle of the plane of joint 2 ahead of that of joint 1, about the tube, rad."""
        return PLANES[self.arrangement] if isinstance(self.arrangement, str) else self.arrangement

    @property
    def tubes(self) -> dict[str, Lumped]:
        """The tubes by name of their lump."""
        if self.spline is None:
            at = 0.5 * self.length if self.tube.centre is None else self.tube.centre
            return {"tube": Lumped(at, *self.tube.body(self.length), self.tube.unbalance)}
        first, second = self.tube, self.tube2 or self.tube
        lengths = self.spline.at, self.length - self.spline.at
        before = 0.5 * lengths[0] if first.centre is None else first.centre
        behind = 0.5 * lengths[1] if second.centre is None else second.centre
        return {
            "tube1": Lumped(before, *first.body(lengths[0]), first.unbalance),
            "tube2": Lumped(self.length - behind, *second.body(lengths[1]), second.unbalance),
        }
