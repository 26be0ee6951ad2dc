"""Parts that are scrapped, and joints that are rejected at assembly, by what a gauge measures of them.

Neither is drawn otherwise: a joint counts by the probability that its parts and itself are accepted, so that one
campaign tells the shares before and after.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from tolstat.common.errors import gather
from tolstat.common.load_kinds import PINS
from tolstat.common.strict import Strict, refuse
from tolstat.common.tables import HOLES
from tolstat.joint import HOLE_OF_PIN, Joint
from tolstat.study import selection
from tolstat.study.selection import UNITS, Reading
from tolstat.study.tolerances.distributions import share_between
from tolstat.study.tolerances.entry import NotNegative, Site, Toleranced, Value

MEASURABLE = {name: unit for name, unit in UNITS.items() if name.startswith(("pin", "hole"))}
"""Errors that can be measured at assembly, and their units; of ``pin1.clearance`` the radial clearance itself."""
CROSS, INPUT, OUTPUT = PARTS = ("cross", "input fork", "output fork")
"""Parts of a joint. The four pins are of one part: the worst of them scraps the cross."""


class RejectEntry(Strict):
    """Joints that are rejected at assembly by a measured value."""

    below: Value | None = Field(default=None, examples=["0.06 mm"])
    """smaller measured values are rejected"""
    above: Value | None = Field(default=None, examples=["0.14 mm"])
    """larger measured values are rejected"""
    gauge: NotNegative = Field(default=0.0, examples=["0.005 mm"])
    """standard deviation of the measurement; exact by default"""

    @model_validator(mode="after")
    def _has_a_limit(self) -> Self:
        if self.below is None and self.above is None:
            raise refuse("rejects nothing", "add below or above")
        if self.below is not None and self.above is not None and not self.below < self.above:
            raise refuse("below is not smaller than above: every joint is rejected", "give below < above")
        return self


class Gauge(NamedTuple):
    """What is measured, and which values are accepted.

    Attributes
    ----------
    name : str
        An error, or ``pin1.clearance``, the radial clearance of a pin.
    lower, upper : float
        Accepted values, SI.
    deviation : float
        Standard deviation of the gauge, SI.
    """

    name: str
    lower: float
    upper: float
    deviation: float

    @property
    def part(self) -> str:
        """Part that the error is of."""
        return part_of(self.name)

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of the errors that it measures."""
        pin, _, key = self.name.partition(".")
        return (self.name, f"{pin}.diameter", f"{HOLE_OF_PIN[pin]}.diameter") if key == "clearance" else (self.name,)

    def accepted(self, errors: NDArray[np.void], joint: Joint) -> NDArray[np.float64]:
        """Probability that each joint is accepted, (n,), from its errors.

        The error of the gauge is normal with mean zero; without deviation the gauge is exact.
        """
        values = np.asarray(errors[self.name])
        if self.name.endswith(".clearance"):
            _, pin, hole = self.columns
            nominal = joint.contact.D_H - joint.contact.D_P
            values = values + 0.5 * (nominal + np.asarray(errors[hole]) - np.asarray(errors[pin]))
        if self.deviation == 0.0:
            return ((values >= self.lower) & (values <= self.upper)).astype(float)
        low, high = (self.lower - values) / self.deviation, (self.upper - values) / self.deviation
        return share_between(low, high)


def part_of(name: str) -> str:
    """Part that an error or zone is of; empty for operating point and material."""
    feature = name.partition(".")[0]
    if feature in PINS or feature.endswith("_pins"):
        return CROSS
    if feature in (*HOLES[:2], "input_holes"):
        return INPUT
    return OUTPUT if feature in (*HOLES[2:], "output_holes") else ""


def of_parts(entries: Sequence[Toleranced]) -> list[Gauge]:
    """Gauges that scrap parts: those of the entries of ``[tolerances]``."""
    each = ((site, model.gauge_of(site)) for entry in entries for site, model in entry.models)
    return [Gauge(site.name, *band) for site, band in each if band is not None]


def read(file: Reading) -> tuple[Gauge, ...]:
    """Read ``[reject]``: what is measured of assembled joints."""
    gauges: list[Gauge] = []
    for entry in file.entries("reject"):
        with gather(file.faults):
            names = selection.resolve(entry, MEASURABLE, file.place)
            site = Site(names[0], MEASURABLE[names[0]], 0.0, file.folder)
            limits = file.model(RejectEntry, entry.value, *entry.path, site=site)
            lower = -math.inf if limits.below is None else limits.below
            upper = math.inf if limits.above is None else limits.above
            gauges += [Gauge(name, lower, upper, limits.gauge) for name in names]
    return tuple(gauges)
