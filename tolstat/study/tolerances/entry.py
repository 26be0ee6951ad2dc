"""Common base of the entries of ``[tolerances]``: the error that an entry is for, and its band.

A band is ``plus_minus`` about the nominal value, ``lower`` and ``upper``, or ``iso2768`` and ``nominal``.
Limits and means are deviations for geometry, the values themselves for ``operation.*`` and ``material.*``.
"""

from __future__ import annotations

from abc import abstractmethod
from pathlib import Path
from typing import Annotated, Literal, NamedTuple, Self

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, WithJsonSchema, model_validator

from tolstat.common import strict, units
from tolstat.common.files import data_dir
from tolstat.common.strict import refuse
from tolstat.study.tolerances import distributions
from tolstat.study.tolerances.distributions import Distribution


class Site(NamedTuple):
    """The error that an entry is for.

    Attributes
    ----------
    name : str
        Name of the error, ``"pin1.offset_t"``.
    unit : str
        Its SI unit.
    center : float
        Its nominal value.
    folder : Path
        Folder that the path of a CSV file is relative to.
    """

    name: str
    unit: str
    center: float
    folder: Path


def _read(value: object, info: ValidationInfo) -> float:
    """Read a quantity in the unit of the error that the entry is for."""
    site: Site = (info.context or {})["site"]
    return units.to_si(value, site.unit)


Value = Annotated[float, BeforeValidator(_read), WithJsonSchema({"x-unit": "error"})]
"""Quantity in the unit of the error that the entry is for."""
Positive = Annotated[Value, AfterValidator(units.positive)]
PositiveNumber = Annotated[units.Number, AfterValidator(units.positive)]
PositiveLength = Annotated[units.Length, AfterValidator(units.positive)]


class ToleranceEntry(strict.Strict):
    """Base of the entries: one model for each distribution."""

    @abstractmethod
    def build(self, site: Site) -> Distribution:
        """Return the distribution of the entry; refuse keys that contradict each other."""

    @model_validator(mode="after")
    def _can_be_built(self, info: ValidationInfo) -> Self:
        self.build((info.context or {})["site"])
        return self


class HalfBand(ToleranceEntry):
    """Entry with a band that may be given by its half width."""

    plus_minus: Annotated[
        Positive | None, Field(description="half width of the band about the nominal value", examples=["0.1 mm"])
    ] = None
    iso2768: Annotated[
        Literal["f", "m"] | None,
        Field(description="band of this class of ISO 2768-1, for the size `nominal`", examples=["f"]),
    ] = None
    nominal: Annotated[
        PositiveLength | None,
        Field(description="size for `iso2768`; for an angle its shorter leg", examples=["72.8 mm"]),
    ] = None

    def half_width(self, site: Site) -> float | None:
        """Half width of the band; None where none is given."""
        if (self.iso2768 is None) != (self.nominal is None):
            lacking, given = ("nominal", "iso2768") if self.nominal is None else ("iso2768", "nominal")
            raise refuse(f"{given} without {lacking}", 'write for example iso2768 = "f", nominal = "50 mm"')
        if self.iso2768 is None or self.nominal is None:
            return self.plus_minus
        if self.plus_minus is not None:
            raise refuse("the band is given by plus_minus and by iso2768", "remove one of them")
        if site.name.startswith(("operation.", "material.")):
            raise refuse(f"ISO 2768 has no tolerance for {site.name}", "give plus_minus")
        kind = "angular" if site.unit == "rad" else "linear"
        try:
            return distributions.iso2768(data_dir() / "iso2768.csv", kind, self.iso2768, self.nominal)
        except ValueError as error:
            raise refuse(f"nominal: {error}", "give plus_minus") from error


class Banded(HalfBand):
    """Entry with a band."""

    lower: Annotated[
        Value | None,
        Field(
            description="lower limit of the band",
            examples=["0 mm"],
        ),
    ] = None
    upper: Annotated[Value | None, Field(description="upper limit of the band", examples=["0.030 mm"])] = None

    def band(self, site: Site) -> tuple[float, float] | None:
        """Lower and upper limit; None where none is given."""
        half = self.half_width(site)
        if self.lower is None and self.upper is None:
            return None if half is None else (site.center - half, site.center + half)
        if self.lower is None or self.upper is None:
            given, lacking = ("upper", "lower") if self.lower is None else ("lower", "upper")
            raise refuse(f"{given} without {lacking}", f"add {lacking}")
        if half is not None:
            raise refuse("the band is given by lower and upper and by its width", "remove one of them")
        if not self.lower < self.upper:
            raise refuse("lower is not below upper", "give lower < upper")
        return self.lower, self.upper

    def needed_band(self, site: Site) -> tuple[float, float]:
        """Lower and upper limit, which must be given."""
        band = self.band(site)
        if band is None:
            raise refuse("no band", "add plus_minus, or lower and upper, or iso2768 and nominal")
        return band
