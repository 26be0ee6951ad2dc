"""``[fatigue]``: settings for the evaluation of load cycles. Like limits they do not affect a campaign's results."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, Field, WithJsonSchema, model_validator

from tolstat.common import json_schema, strict, units
from tolstat.common.channels import UNIT_OF_CHANNEL
from tolstat.common.errors import Fault, InputError, gather
from tolstat.common.strict import Strict, did_you_mean, read_section, refuse
from tolstat.study import stress_point
from tolstat.study.selection import Assignments, Entry, entries, quantity, resolve
from tolstat.study.stress_point import Exponent, Positive, StressPoint


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
        examples=[{"cross*.T": {"m": 5, "S0": "150 N*m", "N0": 2e6}}],
    )
    """S–N lines by channel or pattern"""
    starts: Annotated[units.Number, AfterValidator(units.not_negative)] = Field(default=0.0, examples=[2e4])
    """starts from standstill in the service life, for points"""
    sequence: SequenceEntry | None = Field(
        default=None, examples=[{"points": "drive start drive climb", "revolutions": 9e4}]
    )
    """order in which the operating points are visited, whose changes of load are counted, too"""
    point: dict[str, Any] = Field(
        default_factory=dict,
        json_schema_extra={"x-table": "points"},
        examples=[
            {"pin root": {"bushing": "cross*", "T_t": "0.2 MPa/Nm", "k": 5, "N_D": 2e6, "S_D": "360 MPa", "T_S": 1.25}}
        ],
    )
    """points of the parts by name, with stress per load and S–N line"""

    @model_validator(mode="after")
    def _starts_take_revolutions(self) -> Settings:
        if self.revolutions is not None and self.starts > self.revolutions:
            raise refuse(
                "{starts} starts in {revolutions} revolutions", "give at most one for each", "starts", "revolutions"
            )
        return self


class LineEntry(Strict):
    """S–N line N = N0 (S/S0)^-m, S the range of a load cycle."""

    m: Exponent = Field(examples=[5])
    """exponent"""
    S0: Annotated[Any, WithJsonSchema(json_schema.positive(json_schema.quantity("", "150 N*m")))] = Field(
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
        Name of a channel to (m, S0, N0) of its S–N line; S0 a range, N or N m.
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
    lines: dict[str, tuple[float, float, float]] = field(default_factory=dict)
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
        found = self
        if not (self.required or math.isnan(hours)):
            found = replace(self, revolutions=hours * hourly, required=True, hours=hours)
        if found.starts > found.revolutions:
            what = f"{found.starts:g} starts in {found.revolutions:g} revolutions"
            raise InputError(
                [Fault(f"{place}: fatigue.starts", what, "give at most one for each, or more revolutions")]
            )
        return found

    @property
    def service_life(self) -> str:
        """The service life in words."""
        if math.isnan(self.hours):
            return f"{self.revolutions:g} revolutions"
        return f"{self.hours:g} h ({self.revolutions:.4g} revolutions)"


def read(table: object, place: str, names: Sequence[str] = ()) -> Fatigue:
    """Read ``[fatigue]``.

    Parameters
    ----------
    table : object
        The section as parsed.
    place : str
        File name shown in faults.
    names : sequence of str
        Operating points of the study, if they are known.

    Raises
    ------
    InputError
        With every fault.
    """
    settings = Settings()
    lines: dict[str, tuple[float, float, float]] = {}
    claims, faults = Assignments(place), list[Fault]()
    with gather(faults):
        settings = strict.validate(Settings, table, place, prefix=("fatigue",))
    points: tuple[StressPoint, ...] = ()
    visits = tuple(settings.sequence.points.split()) if settings.sequence else ()
    if unknown := sorted(set(visits) - set(names)) if names else []:
        found = f"no operating point {unknown[0]!r}"
        faults.append(Fault(f"{place}: fatigue.sequence.points", found, did_you_mean(unknown[0], names)))
    for entry in entries(_inner(table, "line"), "fatigue", "line"):
        with gather(faults):
            names = resolve(entry, UNIT_OF_CHANNEL, place)
            claims.claim(entry, names)
            lines |= dict.fromkeys(names, _line(entry, UNIT_OF_CHANNEL[names[0]], place))
    with gather(faults):
        points = stress_point.read(_inner(table, "point"), place)
    if faults:
        raise InputError(faults)
    revolutions = {} if settings.revolutions is None else {"revolutions": settings.revolutions, "required": True}
    return Fatigue(
        tuple(settings.exponents),
        reference_cycles=settings.reference_cycles,
        lines=lines,
        starts=settings.starts,
        points=points,
        visits=visits,
        turns=settings.sequence.revolutions if settings.sequence else 1.0,
        **revolutions,  # type: ignore[arg-type]
    )


def of_text(text: str, place: str) -> Fatigue:
    """Read ``[fatigue]`` of the text of a study; the defaults where it has none.

    Raises
    ------
    InputError
        With every fault.
    """
    return read(read_section(Path(place), text, "fatigue"), place)


def _inner(table: object, key: str) -> Mapping[str, Any]:
    """Table inside the section; empty where it has none, or something else that validation refuses."""
    inner = table.get(key, {}) if isinstance(table, Mapping) else {}
    return inner if isinstance(inner, Mapping) else {}


def _line(entry: Entry, unit: str, place: str) -> tuple[float, float, float]:
    read = strict.validate(LineEntry, entry.value, place, prefix=entry.path)
    where = (*entry.path, "S0")
    size = quantity(Entry(entry.pattern, where, read.S0), unit, place)
    if size <= 0:
        found = f"{read.S0!r} is not positive"
        raise InputError([Fault(f"{place}: {strict.dotted(where)}", found, "give a range above zero")])
    return read.m, size, read.N0
