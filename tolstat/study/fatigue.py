"""``[fatigue]``: settings for the evaluation of load cycles. Like limits they do not affect a campaign's results."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import AfterValidator, Field, ValidationInfo, WithJsonSchema, field_validator, model_validator

from tolstat.analysis.strength import SNLine
from tolstat.common import units
from tolstat.common.channels import FORCES_AND_TORQUES, WORST, Channel, channels, components, planes, unit_of
from tolstat.common.errors import gather, input_error
from tolstat.common.load_kinds import kinds as kinds_of
from tolstat.common.loads import loads_of
from tolstat.common.mechanism import Mechanism
from tolstat.common.notation import schema_of_positive, schema_of_quantity
from tolstat.common.strict import Strict, did_you_mean, dotted, read_section, read_toml, refuse
from tolstat.study.selection import Assignments, Entry, Reading, entries, quantity, select, suggestion

Positive = Annotated[units.Number, AfterValidator(units.positive)]
Exponent = Annotated[units.Number, Field(ge=1, le=30)]
PerForce = Annotated[float, units.Quantity("1/m^2")]
PerTorque = Annotated[float, units.Quantity("1/m^3")]
PositiveStress = Annotated[units.Stress, AfterValidator(units.positive)]
ROUND = {"T_et": ("T_e", "T_t"), "T_tz": ("T_t", "T_z")}
"""Moments that bend a round section, by the key that gives their stress at its surface: of an arm and of a pin."""
PLACES = 24
"""Places around a round section: the stress between two of them is at most 1 - cos(7.5 deg), 0.9 %, above theirs."""


def _check_bushing(bushing: str, info: ValidationInfo) -> str:
    places = kinds_of((info.context or {})["mechanism"])["F"].places
    if not select(bushing, places):
        raise refuse(f"{bushing!r} is not a bushing", did_you_mean(bushing, places))
    return bushing


class StressPointEntry(Strict):
    """Point of a part: its stress is a sum of the bushing's load components, each times a factor.

    A round section has no one point where bending about two axes is largest: it is evaluated all around.
    """

    bushing: Annotated[str, AfterValidator(_check_bushing)] = Field(examples=["fork*"])
    """bushing whose load stresses the point, or pattern of several"""
    F_e: PerForce = Field(default=0.0, examples=["2.5 MPa/kN"])
    """stress at the point by the force along e of the bushing"""
    F_t: PerForce = Field(default=0.0, examples=["0.8 MPa/kN"])
    """stress at the point by the force along t of the bushing"""
    F_z: PerForce = Field(default=0.0, examples=["2.5 MPa/kN"])
    """stress at the point by the force along z of the bushing"""
    T_e: PerTorque = Field(default=0.0, examples=["0.2 MPa/(N*m)"])
    """stress at the point by the torque about e of the bushing"""
    T_t: PerTorque = Field(default=0.0, examples=["-0.2 MPa/(N*m)"])
    """stress at the point by the torque about t of the bushing"""
    T_z: PerTorque = Field(default=0.0, examples=["0.1 MPa/(N*m)"])
    """stress at the point by the torque about z of the bushing"""
    T_et: PerTorque = Field(default=0.0, examples=["0.2 MPa/(N*m)"])
    """bending of a round arm: as T_e and T_t, all around it"""
    T_tz: PerTorque = Field(default=0.0, examples=["0.2 MPa/(N*m)"])
    """bending of a round pin: as T_t and T_z, all around it"""
    k: Exponent = Field(examples=[3])
    """exponent of the S–N line above the knee"""
    k_2: Annotated[units.Number | None, Field(ge=1, le=100)] = Field(default=None, examples=[5])
    """exponent below the knee; 2k - 1 (Haibach) by default"""
    N_D: Positive = Field(examples=[1e7])
    """cycles at the knee"""
    S_D: PositiveStress | None = Field(default=None, examples=["29 MPa"])
    """range of the stress at the knee that half of the parts survive"""
    S_aD: PositiveStress | None = Field(default=None, examples=["14.5 MPa"])
    """amplitude of the stress at the knee, half of S_D; instead of S_D"""
    T_S: Annotated[units.Number | None, Field(ge=1)] = Field(default=None, examples=[1.5])
    """scatter of the strength: 90 % quantile over 10 % quantile; 1: none"""
    T_N: Annotated[units.Number | None, Field(ge=1)] = Field(default=None, examples=[3.4])
    """scatter of the life at one range, T_S^k; instead of T_S"""
    D_c: Positive = Field(default=1.0, examples=[0.3])
    """damage sum at which a part fails"""
    M: Annotated[units.Number, Field(ge=0, le=1)] = Field(default=0.0, examples=[0.3])
    """mean-stress sensitivity; 0: the mean has no effect"""
    R: Annotated[units.Number, Field(ge=-1, lt=1)] = Field(default=-1.0, examples=[0.0])
    """stress ratio, smallest over largest stress, of the S–N line"""

    @model_validator(mode="after")
    def _complete(self) -> StressPointEntry:
        if not any(map(any, self.per_load)):
            raise refuse("no load stresses the point", 'give a stress per load, for example T_e = "0.2 MPa/(N*m)"')
        for name, other, remedy in (
            ("S_D", "S_aD", "give one of them: S_D is a range, S_aD an amplitude"),
            ("T_S", "T_N", "give one of them; T_S = 1 is a strength that does not scatter"),
        ):
            first, second = (getattr(self, key) is None for key in (name, other))
            if first == second:
                raise refuse(f"has neither {name} nor {other}" if first else f"has both {name} and {other}", remedy)
        return self

    @property
    def per_load(self) -> tuple[tuple[float, ...], ...]:
        """Stress per load component at each place, in the order of `FORCES_AND_TORQUES`, 1/m^2 and 1/m^3."""
        names = FORCES_AND_TORQUES
        factors = np.array([float(getattr(self, name)) for name in names])
        bent = {pair: value for name, pair in ROUND.items() if (value := float(getattr(self, name)))}
        places = []
        for angle in 2.0 * np.pi * np.arange(PLACES if bent else 1) / PLACES:
            at_place = factors.copy()
            for (first, second), value in bent.items():
                at_place[names.index(first)] += value * np.cos(angle)
                at_place[names.index(second)] += value * np.sin(angle)
            places.append(tuple(at_place.tolist()))
        return tuple(places)

    @property
    def line(self) -> SNLine:
        """S–N line with all that follows from other keys."""
        k_2 = 2.0 * self.k - 1.0 if self.k_2 is None else self.k_2
        size = 2.0 * self.S_aD if self.S_aD is not None else self.S_D
        scatter = self.T_N ** (1.0 / self.k) if self.T_N is not None else self.T_S
        assert size is not None
        assert scatter is not None
        return SNLine(self.k, k_2, self.N_D, size, scatter, self.D_c, self.M, self.R)


class StressPoint(NamedTuple):
    """A point of a part.

    Attributes
    ----------
    name : str
        Name in the study; with the bushing where the study names several.
    bushing : str
        Name of a bushing.
    per_load : tuple of tuple of float
        Stress per load component along e, t, z, three forces, 1/m^2, and three torques, 1/m^3: at one place or, of a
        round section, at several around it, of which the part fails at the worst.
    line : SNLine
        S–N line.
    """

    name: str
    bushing: str
    per_load: tuple[tuple[float, ...], ...]
    line: SNLine


class SequenceEntry(Strict):
    """Order in which the operating points of a duty cycle are visited; it repeats."""

    points: str = Field(examples=["drive start drive climb"])
    """operating points in the order of their visits, with blanks between them"""
    revolutions: Positive = Field(examples=[90000])
    """revolutions of the input shaft in it"""


class Settings(Strict):
    """Evaluation of load cycles; affects no result."""

    exponents: list[Exponent] = Field(default_factory=lambda: [3.0, 5.0, 10.0], min_length=1, examples=[[5.0]])
    """Wöhler exponents of the damage-equivalent loads"""
    revolutions: Positive | None = Field(default=None, examples=[2e7])
    """service life in revolutions of the input shaft; left out: the `required_life` of the bearings at the speeds of
    the study, without it 1e6"""
    reference_cycles: Positive = Field(default=1e6, examples=[2e6])
    """number of cycles that the damage-equivalent loads refer to"""
    line: dict[str, Any] = Field(
        default_factory=dict,
        json_schema_extra={"x-table": "lines"},
        examples=[{"cross*.T at worst": {"m": 5, "S0": "150 N*m", "N0": 2e6}}],
    )
    """S–N lines by load component or direction, or pattern"""
    starts: Annotated[units.Number, AfterValidator(units.not_negative)] = Field(default=0.0, examples=[2e4])
    """starts from standstill in the service life"""
    sequence: SequenceEntry | None = Field(
        default=None, examples=[{"points": "drive start drive climb", "revolutions": 9e4}]
    )
    """order in which the operating points are visited, whose changes of load are counted, too"""
    point: dict[str, StressPointEntry] = Field(
        default_factory=dict,
        json_schema_extra={"x-table": "points"},
        examples=[
            {"pin root": {"bushing": "cross*", "T_t": "0.2 MPa/Nm", "k": 5, "N_D": 2e6, "S_D": "360 MPa", "T_S": 1.25}}
        ],
    )
    """points of the parts by name, with stress per load and S–N line"""

    @field_validator("starts")
    @classmethod
    def _take_revolutions(cls, starts: float, info: ValidationInfo) -> float:
        revolutions = info.data.get("revolutions")
        if revolutions is not None and starts > revolutions:
            raise refuse(*_too_many(starts, revolutions))
        return starts


def _too_many(starts: float, revolutions: float) -> tuple[str, str]:
    return f"{starts:g} starts in {revolutions:g} revolutions", "give at most one for each, or more revolutions"


class LineEntry(Strict):
    """S–N line N = N0 (S/S0)^-m, S the range of a load cycle."""

    m: Exponent = Field(examples=[5])
    """exponent"""
    S0: Annotated[Any, WithJsonSchema(schema_of_positive(schema_of_quantity("", "150 N*m")))] = Field(
        examples=["150 N*m"]
    )
    """range of the load that is borne for N0 cycles, a force or torque"""
    N0: Positive = Field(examples=[2e6])
    """number of cycles at the range S0"""


@dataclass(frozen=True)
class Fatigue:
    """Settings for the evaluation of load cycles.

    Attributes
    ----------
    exponents : tuple of float
        Wöhler exponents of the damage-equivalent loads.
    revolutions : float
        Service life, in revolutions of the input shaft.
    required : bool
        Whether a service life is required: by the section or, see `within`, by the bearings.
    hours : float
        Required life of the bearings that `revolutions` follow from, h; NaN where the section gives them.
    reference_cycles : float
        Number of cycles that the damage-equivalent loads refer to.
    lines : dict
        S–N lines by name of a component or direction.
    starts : float
        Starts from standstill in the service life.
    points : tuple of StressPoint
        Points of the parts.
    visits : tuple of str
        Operating points in the order of their visits, which repeats; empty if it is not given.
    turns : float
        Revolutions of the input shaft in it.
    """

    exponents: tuple[float, ...] = (3.0, 5.0, 10.0)
    revolutions: float = 1e6
    required: bool = False
    hours: float = math.nan
    reference_cycles: float = 1e6
    lines: dict[str, SNLine] = field(default_factory=dict)
    starts: float = 0.0
    points: tuple[StressPoint, ...] = ()
    visits: tuple[str, ...] = ()
    turns: float = 1.0

    def within(self, hours: float, hourly: float, place: str) -> Fatigue:
        """Settings with the service life that bearings require, unless the section gives one.

        Parameters
        ----------
        hours : float
            Required life of the bearings, h; NaN if there is none.
        hourly : float
            Revolutions of the input shaft in an hour, over the duty cycle.
        place : str
            File name shown in faults.

        Raises
        ------
        InputError
            When the service life has more starts than revolutions.
        """
        within = self
        if not (self.required or math.isnan(hours)):
            within = replace(self, revolutions=hours * hourly, required=True, hours=hours)
        if within.starts > within.revolutions:
            raise input_error(f"{place}: fatigue.starts", *_too_many(within.starts, within.revolutions))
        return within

    @property
    def service_life(self) -> str:
        """The service life in words."""
        if math.isnan(self.hours):
            return f"{self.revolutions:g} revolutions"
        return f"{self.hours:g} h ({self.revolutions:.4g} revolutions)"


def read(file: Reading) -> Fatigue:
    """Read ``[fatigue]``."""
    table, settings = file.data.get("fatigue", {}), Settings()
    of_channels = table.get("line") if isinstance(table, Mapping) else None
    lines: dict[str, SNLine] = {}
    claims, names = Assignments(file.place, file.mechanism), [point.name for point in file.points or ()]
    with gather(file.faults):
        settings = file.model(Settings, table, "fatigue", mechanism=file.mechanism)
    visits = tuple(settings.sequence.points.split()) if settings.sequence else ()
    if unknown := sorted(set(visits) - set(names)) if names else []:
        file.fault("fatigue.sequence.points", f"no operating point {unknown[0]!r}", did_you_mean(unknown[0], names))
    _check_visits(file, visits, settings.sequence)
    for entry in entries(of_channels if isinstance(of_channels, Mapping) else {}, file.mechanism, "fatigue", "line"):
        with gather(file.faults):
            selected = counted_names(entry, file.place, file.mechanism)
            claims.claim(entry, selected)
            if len(kinds := sorted({unit_of(name, file.mechanism) for name in selected})) > 1:
                found = f"selects quantities of different kinds ({', '.join(kinds)})"
                raise input_error(f"{file.place}: {dotted(entry.path)}", found, "write one entry for each kind")
            line = file.model(LineEntry, entry.value, *entry.path)
            size = Entry(entry.pattern, (*entry.path, "S0"), line.S0)
            value = quantity(size, unit_of(selected[0], file.mechanism), file.place)
            if value <= 0:
                file.fault(size.path, f"{line.S0!r} is not positive", "give a range above zero")
            lines |= dict.fromkeys(selected, SNLine(line.m, line.m, line.N0, value))
    points = []
    for name, point in settings.point.items():
        bushings = select(point.bushing, kinds_of(file.mechanism)["F"].places)
        for bushing in bushings:
            own = name if len(bushings) == 1 else f"{name}, {bushing}"
            points.append(StressPoint(own, bushing, point.per_load, point.line))
    given = settings.model_dump(include={"revolutions", "reference_cycles", "starts"}, exclude_none=True)
    return Fatigue(
        tuple(settings.exponents),
        required=settings.revolutions is not None,
        lines=lines,
        points=tuple(points),
        visits=visits,
        turns=settings.sequence.revolutions if settings.sequence else 1.0,
        **given,
    )


def _check_visits(file: Reading, visits: Sequence[str], sequence: SequenceEntry | None) -> None:
    """Note operating points that have fewer revolutions in the sequence than visits; both are rounded in studies."""
    points = file.points or ()
    rates = np.array([point.share * abs(point.operation.speed) for point in points])
    if sequence is None or not np.isfinite(rates).all():
        return
    for point, turns in zip(points, sequence.revolutions * rates / (rates.sum() or 1.0), strict=True):
        if (visited := visits.count(point.name)) > 1.001 * turns:
            share = f"its share of {sequence.revolutions:g}"
            found = f"{visited} visits of {point.name} in {turns:.3g} revolutions, {share}"
            remedy = "a visit is at least one revolution: give more of them, or fewer visits"
            file.fault("fatigue.sequence.revolutions", found, remedy)


def counted_names(entry: Entry, place: str, mechanism: Mechanism) -> list[str]:
    """Names that an entry selects of what cycles are counted of: components, or directions of a force or moment.

    Parameters
    ----------
    entry : Entry
        Its pattern is ``cross*.F_t``, ``cross1.F at 30 deg`` or ``output.moment at worst``, see `channels.signals_of`.
    place : str
        File name shown in faults.
    mechanism : Mechanism
        Whose loads they are.

    Raises
    ------
    InputError
        When it selects nothing, or a modulus.
    """
    plane, at, direction = (part.strip() for part in entry.pattern.partition(" at "))
    where, names = f"{place}: {dotted(entry.path)}", planes(mechanism) if at else components(mechanism)
    selected, every = select(plane, names), channels(mechanism)
    unsigned = [channel for name in select(plane, every) if (channel := every[name]).is_modulus]
    if not selected and unsigned and not at:
        found = f"{unsigned[0].name} has no sign: its cycles are not those of the load"
        raise input_error(where, found, _signed(unsigned[0], mechanism))
    if not selected and select(plane, loads_of(mechanism)):
        raise input_error(where, "its cycles are not counted", 'write components, or "input.lateral at worst"')
    if not selected:
        raise input_error(where, "selects nothing", suggestion(plane, list(names)))
    if not at:
        return selected
    if direction != WORST:
        angle = quantity(entry._replace(value=direction), "rad", place)
        direction = f"{math.degrees(angle):.9g} deg"
    return [f"{name} at {direction}" for name in selected]


def _signed(modulus: Channel, mechanism: Mechanism) -> str:
    """Remedy for a modulus: its components, and directions where it has several."""
    components = [f"{modulus.place}.{name}" for name in modulus.history.components[modulus.components]]
    directions = (
        f', or "{modulus.name} at 30 deg", "{modulus.name} at {WORST}"' if modulus.name in planes(mechanism) else ""
    )
    return f"write {', '.join(components)}{directions}"


def of_text(text: str, place: str) -> Fatigue:
    """Read ``[fatigue]`` of the text of a study; the defaults where it has none.

    Raises
    ------
    InputError
        With every fault.
    """
    read_section(Path(place), text, "fatigue")
    file = Reading(Path(place), text, read_toml(Path(place), text))
    settings = read(file)
    file.finish()
    return settings
