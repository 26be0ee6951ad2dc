"""The sections of a joint file for its bodies and bushings.

`data/joints/cirelli2021.toml` says where the value of each key comes from. A key with the default `FOLLOWS` may be left
out: `Joint` fills it in by the formula of `derived.DERIVED`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Self, get_args, get_origin

from pydantic import AfterValidator, BaseModel, Field, ValidationInfo, field_validator, model_validator

from tolstat.common import units
from tolstat.common.strict import Strict, refuse
from tolstat.common.units import NOT_NEGATIVE, POSITIVE
from tolstat.joint.derived import DERIVED, PIN_CHI
from tolstat.joint.root import Root
from tolstat.joint.spline import Coefficient, Spline

Length = Annotated[units.Length, POSITIVE]
Stress = Annotated[units.Stress, POSITIVE]
Force = Annotated[units.Force, POSITIVE]
Stiffness = Annotated[units.Stiffness, POSITIVE]
Number = Annotated[units.Number, POSITIVE]
Ratio = Annotated[units.Number, NOT_NEGATIVE]


def _modulus(E: float) -> float:
    if E < LEAST_E:
        raise refuse("{E} is not Young's modulus of a metal", "check its unit; steel has 210 GPa", "E")
    return E


def _poisson(nu: float) -> float:
    if not 0.0 <= nu < 0.5:
        raise refuse(f"{nu:g} is not a Poisson's ratio of a metal", "give a number from 0 to below 0.5")
    return nu


def _grade(grade: float) -> float:
    if grade > LARGEST_GRADE:
        raise refuse("{grade} is above G 4000, the largest grade", 'write its number in mm/s: "16 mm/s"', "grade")
    return grade


def _body(inertia: tuple[float, float, float]) -> tuple[float, float, float]:
    """Refuse moments of inertia that no body has: one exceeds the sum of the two others."""
    if 2.0 * max(inertia) > sum(inertia) * (1.0 + 1e-9):
        found = "no body has the moments of inertia {inertia}"
        raise refuse(found, "give none above the sum of the others", "inertia")
    return inertia


LEAST_E = 1e9
"""Young's modulus (Pa) below that of any metal."""
LARGEST_GRADE = 4.0
"""Largest balance quality grade of ISO 21940-11, m/s."""
Triple = Annotated[tuple[units.Inertia, units.Inertia, units.Inertia], AfterValidator(_body)]


PIN_INERTIA = ["5.78e-5 kg*m^2", "6.42e-5 kg*m^2", "6.42e-5 kg*m^2"]
ARM_INERTIA = ["1.40e-4 kg*m^2", "5.31e-5 kg*m^2", "1.11e-4 kg*m^2"]
"""Examples: those of the joint of Cirelli et al. (2021)."""


def follows(key: str, meaning: str, *examples: Any) -> Any:
    """Field of a key of `DERIVED`, which may be left out: its meaning, and the formula that it follows by."""
    meaning = f"{meaning}; when left out: {DERIVED[key].formula}"
    return Field(default=None, description=meaning, examples=list(examples) or None)


def quantities(model: type[BaseModel], before: str = "") -> dict[str, str]:
    """SI unit of each quantity of a model, by dotted key; lists of quantities are left out."""
    units_of_keys: dict[str, str] = {}
    for key, field in model.model_fields.items():
        kinds = [field.annotation, *field.metadata]
        while kinds:
            kind = kinds.pop()
            if isinstance(kind, type) and issubclass(kind, BaseModel):
                units_of_keys |= quantities(kind, f"{before}{key}.")
            elif isinstance(kind, units.Quantity):
                units_of_keys[f"{before}{key}"] = kind.unit
            elif get_origin(kind) is not tuple:
                kinds += [*get_args(kind), *getattr(kind, "__metadata__", ())]
    return units_of_keys


class Material(Strict):
    """Material of all parts."""

    E: Annotated[Stress, AfterValidator(_modulus)]
    """Young's modulus"""
    nu: Annotated[units.Number, AfterValidator(_poisson)]
    """Poisson's ratio, from 0 to below 0.5"""
    G: Stress = follows("material.G", "shear modulus")
    rho: units.Density
    """density"""


class Pin(Strict):
    """Each of the four pins: a round beam along its axis e, clamped at the hub, its mass lumped at its end."""

    l: Length  # noqa: E741
    """length of the beam, from the hub to the middle of the contact; know it to 1 mm: the torque of the bushing is the
    force times l, or up to l + z/2"""
    d: units.Diameter
    """diameter of the beam"""
    chi: Number = PIN_CHI
    """shear factor of the section"""
    A: units.Area = follows("pin.A", "area of the section")
    J: units.AreaMoment = follows("pin.J", "area moment of the section")
    Jp: units.AreaMoment = follows("pin.Jp", "polar moment of the section")
    mass: units.Mass = follows("pin.mass", "mass")
    inertia: Triple = follows("pin.inertia", "moments of inertia about e, t, z", PIN_INERTIA)
    root: Root | None = None
    """Section of each pin at the hub, where stress is a load"""


class Arm(Strict):
    """Each of the four arms: a beam along the shaft, clamped at its fork, its mass lumped at the hole's centre.

    A rectangular section needs only its `width` and `depth`, a round one `d`; for another give `A`, `Jx` and `Jy`.
    """

    l_f: Length
    """length of the beam, from its fork to the hole's centre"""
    width: Length | None = Field(default=None, examples=["58 mm"])
    """side of a rectangular section along t"""
    depth: Length | None = Field(default=None, examples=["21 mm"])
    """side of a rectangular section along e, the hole's axis"""
    d: units.Diameter | None = Field(default=None, examples=["40 mm"])
    """diameter of a round section"""
    chi: Number = follows("arm.chi", "shear factor of the section")
    A: units.Area = follows("arm.A", "area of the section")
    Jx: units.AreaMoment = follows("arm.Jx", "area moment about x, the local t")
    Jy: units.AreaMoment = follows("arm.Jy", "area moment about y, the local e")
    Jp: units.AreaMoment = follows("arm.Jp", "polar moment of the section")
    mass: units.Mass = follows("arm.mass", "mass", "0.3516 kg")
    inertia: Triple = follows("arm.inertia", "moments of inertia about e, t, z", ARM_INERTIA)

    @field_validator("d")
    @classmethod
    def _one_section(cls, value: float | None, info: ValidationInfo) -> float | None:
        """Refuse a diameter beside the sides of a rectangle."""
        sides = [key for key in ("width", "depth") if info.data.get(key) is not None]
        if value is not None and sides:
            raise refuse(f"a round section has no {' and '.join(sides)}", f"remove d, or {' and '.join(sides)}")
        return value


class Hub(Strict):
    """Middle of the cross, to which the four pins are attached."""

    mass: units.Mass = follows("hub.mass", "mass")
    inertia: Triple = follows("hub.inertia", "moments of inertia about x, y, z of the cross")


RIGID, FREE = "rigid", "free"
"""Words of ``shaft.axial``."""


class Ends(Strict):
    """What carries a shaft."""

    bearings: tuple[Length, Length] = Field(examples=[["80 mm", "240 mm"]])
    """distances of the shaft's two bearings from the joint's centre, along the shaft; the nearer one is bearing a"""

    @field_validator("bearings")
    @classmethod
    def _in_order(cls, value: tuple[float, float]) -> tuple[float, float]:
        if value[0] == value[1]:
            raise refuse("{bearings}: both bearings are at one place", "give the distance of each", "bearings")
        if value[0] > value[1]:
            raise refuse("{bearings} are not in order", "give the nearer bearing first", "bearings")
        return value


class Thrust(Strict):
    """Thrust faces: the bottoms of the bearing cups, held by snap rings, which hold the cross along its pins."""

    end_play: units.Length = Field(examples=["0.02 mm"])
    """play of the cross along a pair of pins, from one face to the other; negative: preload; up to a fifth of cross.R
    either way"""
    k: Stiffness = Field(examples=["1e8 N/m"])
    """stiffness of one face, its cup and its ring"""
    c: units.Damping = Field(default=2e3)
    """damping of one face"""


class Friction(Strict):
    """Friction of the pins in their bearings."""

    mu: Coefficient | None = Field(default=None, examples=[0.05])
    """coefficient of friction around the pins, up to 1: rolling needles 0.002 to 0.005, plain bushes 0.05 to 0.15;
    when left out: no friction"""
    mu_along: Coefficient | None = Field(default=None, examples=[0.05])
    """coefficient of friction along the pins, up to 1: needles roll around a pin and slide along it, 0.05 to 0.1; when
    left out: as around"""
    radius: Length | None = Field(default=None, examples=["12.5 mm"])
    """distance from the pin's axis at which surfaces slide; when left out: contact.D_P/2"""
    slip_speed: Annotated[units.Velocity, POSITIVE] = Field(default=1e-2, examples=["0.01 m/s"])
    """sliding speed over which friction rises"""

    @model_validator(mode="after")
    def _check_along(self) -> Self:
        if self.mu == 0.0 and self.mu_along:
            remedy = "give mu above zero, such as 1e-3, or mu_along = 0, too"
            raise refuse(f"{self.mu_along:g} is friction along pins that have none around", remedy, "mu_along")
        return self

    @property
    def ratio(self) -> float:
        """Coefficient along the pins over that around them."""
        return self.mu_along / self.mu if self.mu and self.mu_along is not None else 1.0


class Unbalance(Strict):
    """Unbalance of the output shaft in the plane of the joint's centre, or of a tube at its mass centre."""

    amount: units.Unbalance | None = Field(default=None, examples=["1e-3 kg*m"])
    """unbalance: mass times distance of its centre from the axis"""
    grade: Annotated[units.Velocity, POSITIVE, AfterValidator(_grade)] | None = Field(
        default=None, examples=["16 mm/s"]
    )
    """balance quality grade G of ISO 21940-11: distance times angular velocity; its number is in mm/s, up to 4000"""
    mass: units.Mass | None = Field(default=None, examples=["5 kg"])
    """mass that the grade is for; when left out: that of shaft or tube"""
    speed: Annotated[units.Speed, POSITIVE] | None = Field(default=None, examples=["3000 rpm"])
    """highest speed, which the grade is for"""
    angle: units.Angle | None = Field(default=None, examples=["30 deg"])
    """direction, from x of the body's frame towards y; errors `output.unbalance_angle`, `tube.unbalance_angle` are
    deviations from it"""

    @model_validator(mode="after")
    def _one_of_two(self) -> Unbalance:
        given = " and ".join(key for key in ("grade", "mass", "speed") if getattr(self, key) is not None)
        lacking = " and ".join(key for key in ("grade", "speed") if getattr(self, key) is None)
        if self.amount is not None and given:
            raise refuse(f"has amount beside {given}", f"remove amount, or {given}")
        if self.amount is None and not given:
            remedy = 'give amount = "1e-3 kg*m", or grade = "16 mm/s" and speed = "3000 rpm", of yours'
            raise refuse("has neither amount nor grade and speed", remedy)
        if self.amount is None and lacking:
            raise refuse(f"has {given} without {lacking}", f"add {lacking}, or give amount instead")
        return self

    def size(self, mass: float | None) -> float:
        """Unbalance, kg m, of a body of this mass (kg)."""
        if self.grade is None or self.speed is None:
            return self.amount or 0.0
        return self.grade * (self.mass or mass or 0.0) / self.speed


class Shaft(Strict):
    """Output shaft, and what holds it along its axis; bearings of both shafts.

    A shaft that is not rigid along its axis needs the mass that moves and the damping of its motion.
    """

    Js: units.Inertia
    """inertia of the output shaft about its axis"""
    mass: units.Mass | None = None
    """mass that moves along and across the axis; needed unless `axial` and `lateral` are rigid"""
    axial_damping: units.Damping | None = None
    """damping of the motion along the axis, as by grease; needed unless `axial` is rigid"""
    axial: Annotated[float | str, units.Quantity("N/m", words=(RIGID, FREE)), POSITIVE] = Field(
        default=RIGID, examples=[FREE]
    )
    """what holds the shaft along its axis: `rigid`, nothing gives way; `free`, a spline or a loose bearing; or the
    stiffness of the bearings of both shafts in series"""
    lateral: Annotated[float | str, units.Quantity("N/m", words=(RIGID, FREE)), POSITIVE] = Field(
        default=RIGID, examples=[FREE]
    )
    """what holds the output shaft across its axis, which does not tilt: `rigid`; `free`, as one that only the joint
    carries; or the stiffness of its bearings. Needs thrust faces: without them pins slide, and nothing holds it"""
    input: Ends | None = None
    """Bearings of the input shaft, whose loads become known"""
    output: Ends | None = None
    """Bearings of the output shaft, whose loads become known"""
    unbalance: Unbalance | None = None
    """Unbalance of the output shaft"""
    spline: Spline | None = None
    """Spline that sticks with a force of the error `shaft.spline`, from -1 to 1, times 2 mu T/d. In a study with
    tolerances this error is uniform unless they say otherwise"""

    @field_validator("unbalance")
    @classmethod
    def _mass_of_grade(cls, value: Unbalance | None, info: ValidationInfo) -> Unbalance | None:
        if value is not None and value.grade and value.mass is None and info.data.get("mass", 0.0) is None:
            raise refuse("has grade without mass", 'add mass = "5 kg" with your value, or give amount instead')
        return value

    @field_validator("lateral")
    @classmethod
    def _has_mass(cls, value: float | str, info: ValidationInfo) -> float | str:
        if value != RIGID and info.data.get("mass", 0.0) is None:
            raise refuse("a shaft that moves across its axis needs mass", 'give mass = "5 kg" with your value')
        return value

    @field_validator("axial")
    @classmethod
    def _can_move(cls, value: float | str, info: ValidationInfo) -> float | str:
        lacking = [key for key in ("mass", "axial_damping") if key in info.data and info.data[key] is None]
        if value != RIGID and lacking:
            found = f"a shaft that is not rigid along its axis needs {' and '.join(lacking)}"
            given = {"mass": 'mass = "5 kg"', "axial_damping": 'axial_damping = "2e4 N*s/m"'}
            raise refuse(found, f'give {", ".join(given[key] for key in lacking)} with your values, or axial = "rigid"')
        return value

    @property
    def slides(self) -> bool:
        """Whether the shaft may move along its axis."""
        return self.axial != RIGID

    @property
    def k_l(self) -> float:
        """Lateral stiffness of the output shaft's bearings, N/m; 0 where the shaft is free, and where it is rigid."""
        return 0.0 if isinstance(self.lateral, str) else self.lateral

    @property
    def k_a(self) -> float:
        """Axial stiffness of the shafts' bearings, N/m; 0 where the shaft is free, and where it is rigid."""
        return 0.0 if isinstance(self.axial, str) else self.axial


class Cross(Strict):
    """Main dimensions of the cross."""

    R: Length
    """distance from the centre of the joint to the middle of pin and hole"""
    r_b: Length = follows("cross.r_b", "distance from the centre of the joint to the marker of a cross bushing")


class PinBushing(Strict):
    """Stiffness of a pin in beam axes: z along the beam (local e), x the local t, y the local z."""

    k_x: Stiffness = follows("bushing.cross.k_x", "shear along x")
    k_y: Stiffness = follows("bushing.cross.k_y", "shear along y")
    k_z: Stiffness = follows("bushing.cross.k_z", "tension")
    k_bx: units.RotaryStiffness = follows("bushing.cross.k_bx", "bending about x")
    k_by: units.RotaryStiffness = follows("bushing.cross.k_by", "bending about y")
    k_tz: units.RotaryStiffness = follows("bushing.cross.k_tz", "torsion")


class ArmBushing(Strict):
    """Stiffness of an arm in beam axes: z along the shaft, x the local t, y the local e."""

    k_x: Stiffness = follows("bushing.fork.k_x", "shear along x")
    k_y: Stiffness = follows("bushing.fork.k_y", "shear along y")
    k_z: Stiffness = follows("bushing.fork.k_z", "tension")
    k_bx: units.RotaryStiffness = follows("bushing.fork.k_bx", "bending about x")
    k_by: units.RotaryStiffness = follows("bushing.fork.k_by", "bending about y")
    k_tz: units.RotaryStiffness = follows("bushing.fork.k_tz", "torsion")


class Bushing(Strict):
    """Bushings, the elasticity of pins and arms: three springs and three torsion springs each, eq. (8)."""

    xi: Ratio
    """damping ratio: damping is 2 xi sqrt(k m), of rotations 2 xi sqrt(k J)"""
    cross: PinBushing = PinBushing()
    """Stiffness of a pin's bushing"""
    fork: ArmBushing = ArmBushing()
    """Stiffness of an arm's bushing"""


RIGID_SHAFTS = "shafts rigid along their axes"
FREE_SHAFT = "output shaft free along its axis"


def mounting_and_law(axial: Sequence[float | str], laws: Sequence[str]) -> str:
    """Mounting and contact law of a joint, or of several variants.

    Parameters
    ----------
    axial : sequence of float or str
        ``shaft.axial`` of each variant: ``"rigid"``, ``"free"``, or a stiffness, N/m.
    laws : sequence of str
        ``contact.law`` of each variant.

    Returns
    -------
    str
        ``"output shaft free along its axis; contact law mode"``.
    """
    stiffness = [value for value in axial if not isinstance(value, str)]
    rigid, free = (list(axial).count(word) for word in (RIGID, FREE))
    kinds = {RIGID_SHAFTS: rigid, FREE_SHAFT: free, _stiffness_range(stiffness): len(stiffness)}
    numbers = {text: number for text, number in kinds.items() if number}
    each = numbers if len(numbers) == 1 else [f"{text} in {n} of {len(axial)} variants" for text, n in numbers.items()]
    distinct = list(dict.fromkeys(laws))
    return f"{', '.join(each)}; contact law{'' if len(distinct) == 1 else 's'} {', '.join(distinct)}"


def _stiffness_range(stiffness: Sequence[float]) -> str:
    if not stiffness:
        return ""
    ends = dict.fromkeys(f"{end:.4g}" for end in (min(stiffness), max(stiffness)))
    return f"output shaft held with {' to '.join(ends)} N/m along its axis"
