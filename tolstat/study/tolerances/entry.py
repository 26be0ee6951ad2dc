"""Common base of the entries of ``[tolerances]``: the error that an entry is for, and its band.

A band is ``plus_minus`` about the nominal value, ``lower`` and ``upper``, or ``iso2768`` and ``nominal``.
Limits and means are deviations from nominal; of ``material.*`` the values themselves.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, WithJsonSchema, model_validator

from tolstat.common import strict, units
from tolstat.common.late import pandas as pd
from tolstat.common.notation import PLUS_MINUS, schema_of_quantity
from tolstat.common.strict import refuse
from tolstat.study.axes import columns_of
from tolstat.study.tolerances import iso
from tolstat.study.tolerances.distributions import Distribution


class Diameter(NamedTuple):
    """Tolerance of the diameter of a pin or hole.

    Attributes
    ----------
    band : tuple of float, optional
        Lower and upper limit, m.
    distribution : Distribution
        Distribution of the error.
    """

    band: tuple[float, float] | None
    distribution: Distribution


class Site(NamedTuple):
    """What an entry is for.

    Attributes
    ----------
    name : str
        Name of the error, ``"pin1.offset_t"``, or of the zone, ``"pin1.position"``.
    unit : str
        Its SI unit.
    center : float
        Its nominal value.
    folder : Path
        Folder that the path of a CSV file is relative to.
    reach : float
        Distance of the middle of pins and holes from the joint's centre, m; for pairs only.
    shared : bool
        For a zone: whether the axis has a position and a zone of direction.
    direction : ToleranceEntry, optional
        For the position of such an axis: the entry for its direction.
    diameter : Diameter, optional
        For the position of a pin or hole: the tolerance of its diameter.
    """

    name: str
    unit: str
    center: float
    folder: Path
    reach: float = math.nan
    shared: bool = False
    direction: ToleranceEntry | None = None
    diameter: Diameter | None = None


class Meaning(NamedTuple):
    """What an entry says of some of the errors that it sets.

    Attributes
    ----------
    number : str
        What the number of the entry is, with its value: a half width, a radius, a diameter.
    errors : tuple of str
        Names of errors, columns of the table ERROR, all with the same deviation.
    unit : str
        Their SI unit.
    sigma : float
        Standard deviation of each of them, SI.
    outside : float
        Share of the parts outside the band or zone of the entry; NaN if the entry has none.
    """

    number: str
    errors: tuple[str, ...]
    unit: str
    sigma: float
    outside: float


def _reader(mark: str) -> BeforeValidator:
    """What reads a quantity in the unit of the error that the entry is for; `mark`: sign that it may have."""
    return BeforeValidator(lambda value, info: units.to_si(value, info.context["site"].unit, mark))


OF_ERROR = WithJsonSchema(schema_of_quantity("error", units.EXAMPLES["m"]))
Value = Annotated[float, _reader(""), OF_ERROR]
"""Quantity in the unit of the error that the entry is for."""


_NEARLY_ALL = np.array([1e-3, 1.0 - 1e-3])
"""Probabilities between which an error of the operating point must be zero; ends of a distribution without a band."""


Positive = Annotated[Value, AfterValidator(units.positive)]
HalfWidth = Annotated[float, _reader(PLUS_MINUS), AfterValidator(units.positive), OF_ERROR]
PositiveNumber = Annotated[units.Number, AfterValidator(units.positive)]
Truncate = Annotated[
    bool, Field(strict=True, description="whether parts outside the band are sorted out", examples=[True])
]
PositiveLength = Annotated[units.Length, AfterValidator(units.positive)]


class ToleranceEntry(strict.Strict):
    """Base of the entries: what an entry draws, and what it means."""

    scales: ClassVar[bool] = True
    """Whether a factor on its widths gives an entry of the same shape."""

    @abstractmethod
    def quantities(self, site: Site) -> dict[str, Distribution]:
        """Return the quantities that the entry draws, by name; refuse keys that contradict each other."""

    @abstractmethod
    def meaning(self, site: Site) -> list[Meaning]:
        """Return what the entry says of the errors that it sets."""

    def measured_parts(self, site: Site) -> int:
        """Return the number of parts that mean and deviation were estimated from; 0 if they are taken as exact."""
        return 0

    @model_validator(mode="after")
    def _can_be_built(self, info: ValidationInfo) -> Self:
        self.quantities((info.context or {})["site"])
        return self


class LotEntry(strict.Strict):
    """Key ``lot`` of an entry: parts of one lot deviate together."""

    share: Annotated[units.Number, Field(gt=0, lt=1)] = Field(examples=[0.3])
    """share of the variance of the normal score that is between lots"""
    shared: bool = Field(default=False, strict=True, examples=[True])
    """whether all errors that the pattern selects have one score of the lot, so that they are correlated in each
    joint; else each error has its own"""


class SingleEntry(ToleranceEntry):
    """Entry for one error: one model for each distribution."""

    lot: LotEntry | None = Field(default=None, examples=[{"share": 0.3}])
    """parts of one lot deviate together"""

    @abstractmethod
    def build(self, site: Site) -> Distribution:
        """Return the distribution of the error; refuse keys that contradict each other."""

    @abstractmethod
    def number(self, site: Site) -> str:
        """Return what the number of the entry is, with its value."""

    @abstractmethod
    def band(self, site: Site) -> tuple[float, float] | None:
        """Lower and upper limit; None where none is given."""

    def ends(self, site: Site) -> tuple[float, float]:
        """Limits; where none are given, what one part in a thousand is below, and above."""
        low, high = self.band(site) or self.build(site).ppf(_NEARLY_ALL)
        return float(low), float(high)

    def quantities(self, site: Site) -> dict[str, Distribution]:
        """See `ToleranceEntry.quantities`."""
        distribution = self.build(site)
        if site.name.startswith("operation."):
            low, high = distribution.ppf(_NEARLY_ALL)
            if not low <= site.center <= high:
                values = " to ".join(units.shown(float(end), site.unit) for end in (low, high))
                remedy = "give deviations from [operation], and change a value there that is another on average"
                raise refuse(f"deviations of {values} leave out the operating point itself", remedy)
        return {site.name: distribution}

    def meaning(self, site: Site) -> list[Meaning]:
        """See `ToleranceEntry.meaning`."""
        distribution = self.build(site)
        band = self.band(site)
        share = math.nan if band is None else distribution.outside(*band)
        columns, moments = columns_of(site.name), distribution.moments
        # of a radius, standard deviation of each of its two coordinates
        sigma = moments.deviation if len(columns) == 1 else math.sqrt(0.5 * moments.mean_square)
        return [Meaning(self.number(site), columns, site.unit, sigma, share)]


class Toleranced(NamedTuple):
    """An entry of ``[tolerances]`` with what it selects.

    Attributes
    ----------
    pattern : str
        Pattern as written in the study.
    keys : dict
        Keys of the entry, as written.
    models : tuple of (Site, ToleranceEntry)
        The errors or zones that the pattern selects, and the entry as read for each.
    """

    pattern: str
    keys: Mapping[str, Any]
    models: tuple[tuple[Site, ToleranceEntry], ...]

    @property
    def quantities(self) -> dict[str, Distribution]:
        """Distribution of each quantity that the entry draws."""
        return {name: d for site, model in self.models for name, d in model.quantities(site).items()}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the quantities that the entry draws."""
        return tuple(self.quantities)

    @property
    def parts(self) -> int:
        """Number of parts that mean and deviation were estimated from; 0 if they are taken as exact."""
        site, model = self.models[0]
        return model.measured_parts(site)


class HalfBand(SingleEntry):
    """Entry with a band that may be given by its half width."""

    plus_minus: HalfWidth | None = Field(default=None, examples=["0.1 mm"])
    """half width of the band about the nominal value"""
    iso2768: Literal["f", "m"] | None = Field(default=None, examples=["f"])
    """band of this class of ISO 2768-1, for the size `nominal`"""
    nominal: PositiveLength | None = Field(default=None, examples=["72.8 mm"])
    """size for `iso2768`; for an angle its shorter leg"""

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
            return iso.deviation(kind, self.iso2768, self.nominal)
        except ValueError as error:
            raise refuse(f"nominal = {{nominal}}: {error}", "give plus_minus", "nominal") from error

    def number(self, site: Site) -> str:
        """See `SingleEntry.number`."""
        half = self.half_width(site)
        if half is None:
            return "no band"
        return f"half width {units.shown(half, site.unit)}"


class Banded(HalfBand):
    """Entry with a band."""

    lower: Value | None = Field(default=None, examples=["0 mm"])
    """lower limit of the band"""
    upper: Value | None = Field(default=None, examples=["0.030 mm"])
    """upper limit of the band"""

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

    def number(self, site: Site) -> str:
        """See `SingleEntry.number`."""
        if self.lower is None or self.upper is None:
            return super().number(site)
        ends = [units.shown(end, site.unit) for end in (self.lower, self.upper)]
        numbers = [end.partition(" ")[0] for end in ends]
        return f"{numbers[0]} to {ends[1]}" if numbers[0] != ends[0] else " to ".join(ends)


def meanings(entries: Sequence[Toleranced]) -> pd.DataFrame:
    """Make one row for each entry and kind of error that it sets.

    Parameters
    ----------
    entries : sequence of Toleranced
        Entries of a study.

    Returns
    -------
    DataFrame
        ``entry``, its pattern; ``number``, what its number is; ``errors``, keys of the errors as a pattern; ``unit``
        and ``sigma``, standard deviation of each of these errors, SI (where several entries set an error, the part of
        this one); ``outside``, share of the parts outside the band or zone, NaN without either.
    """
    rows: dict[tuple[Any, ...], dict[str, None]] = {}
    for entry in entries:
        for site, model in entry.models:
            for meaning in model.meaning(site):
                sigma = float(f"{meaning.sigma:.6g}")
                key = (entry.pattern, meaning.number, meaning.unit, sigma, f"{meaning.outside:.6g}")
                rows.setdefault(key, {}).update(dict.fromkeys(name.rpartition(".")[2] for name in meaning.errors))
    columns = ["entry", "number", "unit", "sigma", "outside", "errors"]
    cells = [(*key[:4], float(key[4]), _pattern(list(keys))) for key, keys in rows.items()]
    table = pd.DataFrame(cells, columns=columns)
    return table[["entry", "number", "errors", "unit", "sigma", "outside"]]


def _pattern(keys: Sequence[str]) -> str:
    """Keys as one pattern where they have the same kind: ``offset_[tz]``."""
    kinds: dict[str, str] = {}
    for key in keys:
        kind, dash, part = key.rpartition("_")
        name = f"{kind}{dash}" if len(part) == 1 else key
        kinds[name] = kinds.get(name, "") + (part if len(part) == 1 else "")
    return ", ".join(f"{kind}[{parts}]" if len(parts) > 1 else f"{kind}{parts}" for kind, parts in kinds.items())
