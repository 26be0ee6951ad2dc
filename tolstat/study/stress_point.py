"""``[fatigue.point]``: points of the parts whose stress follows from the load of a bushing, with their S–N lines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from tolstat.analysis.strength import Line
from tolstat.common import strict, units
from tolstat.common.errors import Fault, InputError, gather
from tolstat.common.load_kinds import BUSHINGS
from tolstat.common.strict import Strict, did_you_mean, refuse
from tolstat.study.selection import select

Positive = Annotated[units.Number, AfterValidator(units.positive)]
Exponent = Annotated[units.Number, Field(ge=1, le=30)]
PerForce = Annotated[float, units.Quantity("1/m^2")]
PerTorque = Annotated[float, units.Quantity("1/m^3")]
PositiveStress = Annotated[units.Stress, AfterValidator(units.positive)]
COMPONENTS = ("F_e", "F_t", "F_z", "T_e", "T_t", "T_z")
ROUND = {"T_et": ("T_e", "T_t"), "T_tz": ("T_t", "T_z")}
"""Moments that bend a round section, by the key that gives their stress at its surface: of an arm and of a pin."""
PLACES = 24
"""Places around a round section: the stress between two of them is at most 1 - cos(7.5 deg), 0.9 %, above theirs."""


def _found(name: str, other: str, value: float | None) -> str:
    return f"has neither {name} nor {other}" if value is None else f"has both {name} and {other}"


class StressPointEntry(Strict):
    """Point of a part: its stress is a sum of the bushing's load components, each times a factor.

    A round section has no one point where bending about two axes is largest: it is evaluated all around.
    """

    bushing: str = Field(examples=["fork*"])
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
        if (self.S_D is None) == (self.S_aD is None):
            raise refuse(_found("S_D", "S_aD", self.S_D), "give one of them: S_D is a range, S_aD an amplitude")
        if (self.T_S is None) == (self.T_N is None):
            raise refuse(
                _found("T_S", "T_N", self.T_S), "give one of them; T_S = 1 is a strength that does not scatter"
            )
        return self

    @property
    def per_load(self) -> tuple[tuple[float, ...], ...]:
        """Stress per load component at each place, in the order of `COMPONENTS`, 1/m^2 and 1/m^3."""
        factors = np.array([float(getattr(self, name)) for name in COMPONENTS])
        bent = {pair: value for name, pair in ROUND.items() if (value := float(getattr(self, name)))}
        places = []
        for angle in 2.0 * np.pi * np.arange(PLACES if bent else 1) / PLACES:
            own = factors.copy()
            for (first, second), value in bent.items():
                own[COMPONENTS.index(first)] += value * np.cos(angle)
                own[COMPONENTS.index(second)] += value * np.sin(angle)
            places.append(tuple(own.tolist()))
        return tuple(places)

    @property
    def line(self) -> Line:
        """S–N line with all that follows from other keys."""
        k_2 = 2.0 * self.k - 1.0 if self.k_2 is None else self.k_2
        size = 2.0 * self.S_aD if self.S_aD is not None else self.S_D
        scatter = self.T_N ** (1.0 / self.k) if self.T_N is not None else self.T_S
        assert size is not None
        assert scatter is not None
        return Line(self.k, k_2, self.N_D, size, scatter, self.D_c, self.M, self.R)


class StressPoint(NamedTuple):
    """A point of a part.

    Attributes
    ----------
    name : str
        Name in the study; with the bushing where the study names several.
    bushing : str
        One of `load_kinds.BUSHINGS`.
    per_load : tuple of tuple of float
        Stress per load component along e, t, z, three forces, 1/m^2, and three torques, 1/m^3: at one place or, of a
        round section, at several around it, of which the part fails at the worst.
    line : Line
        S–N line.
    """

    name: str
    bushing: str
    per_load: tuple[tuple[float, ...], ...]
    line: Line


def read(table: Mapping[str, Any], place: str) -> tuple[StressPoint, ...]:
    """Read ``[fatigue.point]``.

    Raises
    ------
    InputError
        With every fault.
    """
    points, faults = list[StressPoint](), list[Fault]()
    for name, value in table.items():
        prefix = ("fatigue", "point", name)
        with gather(faults):
            entry = strict.validate(StressPointEntry, value, place, prefix=prefix)
            bushings = select(entry.bushing, BUSHINGS)
            if not bushings:
                where = f"{place}: {strict.dotted((*prefix, 'bushing'))}"
                found = f"{entry.bushing!r} is not a bushing"
                raise InputError([Fault(where, found, did_you_mean(entry.bushing, BUSHINGS))])
            for bushing in bushings:
                own = name if len(bushings) == 1 else f"{name}, {bushing}"
                points.append(StressPoint(own, bushing, entry.per_load, entry.line))
    if faults:
        raise InputError(faults)
    return tuple(points)
