"""Entries of ``[tolerances]``, one model for each distribution: the entry's keys, and the distribution they define.

No statistics of the errors of Cardan crosses are published: the distribution is an assumption of the study.
"""

from __future__ import annotations

import json
import math
from typing import Annotated, Literal

from pydantic import Field

from tolstat.analysis.process import LEAST_PARTS, MOST_PARTS
from tolstat.common import strict
from tolstat.common.errors import Fault, InputError
from tolstat.common.strict import described, refuse
from tolstat.study.axes import ORIENTATIONS, columns_of
from tolstat.study.tolerances import distributions as tolerance
from tolstat.study.tolerances.entry import (
    Banded,
    HalfBand,
    Meaning,
    NotNegative,
    Positive,
    PositiveNumber,
    Site,
    ToleranceEntry,
    Truncate,
    Value,
)
from tolstat.study.tolerances.external import PREFIX, MeasuredEntry, ScipyEntry
from tolstat.study.tolerances.zone_laws import Rayleigh
from tolstat.study.tolerances.zones import CoaxialityEntry, OrientationEntry, PositionEntry

CPK = "capability index Cpk of the process: sigma is the distance from the mean to the nearer limit over 3 Cpk"
Cpk = Annotated[PositiveNumber | None, described(f"{CPK}; 1 unless given", 1.33)]


class NormalEntry(Banded):
    """Mean in the middle of the band, sigma by `cpk`: 0.27 % of the parts are outside at Cpk 1."""

    distribution: Literal["normal"]
    cpk: Cpk = None
    mean: Value | None = Field(default=None, examples=["0.01 mm"])
    """mean; the middle of the band unless given"""
    std: Positive | None = Field(default=None, examples=["0.05 mm"])
    """standard deviation, in place of `cpk`"""
    truncate: Truncate = False
    known_from: int | None = Field(default=None, strict=True, ge=LEAST_PARTS, le=MOST_PARTS, examples=[50])
    """number of measured parts that mean and sigma were estimated from; affects no result"""

    gauge: NotNegative | None = Field(default=None, examples=["0.01 mm"])
    """parts outside the band are scrapped, by a gauge of this standard deviation; affects no result"""

    def measured_parts(self, site: Site) -> int | None:
        """See `ToleranceEntry.measured_parts`."""
        return self.known_from

    def gauge_of(self, site: Site) -> tuple[float, float, float] | None:
        """See `ToleranceEntry.gauge_of`."""
        return None if self.gauge is None else (*self.needed_band(site), self.gauge)

    def build(self, site: Site) -> tolerance.Normal | tolerance.TruncatedNormal:
        """See `ToleranceEntry.build`."""
        if self.known_from is not None and self.truncate:
            raise refuse(
                "known_from is of parts as they are made, truncate of parts that are sorted", "remove one of them"
            )
        if self.gauge is not None and self.truncate:
            raise refuse("gauge scraps parts, with truncate none are left to scrap", "remove one of them")
        self.gauge_of(site)
        if self.std is not None:
            return self._from_std(self.std, site)
        lower, upper = self.needed_band(site)
        mean = 0.5 * (lower + upper) if self.mean is None else self.mean
        if not lower < mean < upper:
            raise refuse("mean is outside the band, so that Cpk would not be positive", "give lower < mean < upper")
        sigma = tolerance.sigma_of(lower, upper, mean, 1.0 if self.cpk is None else self.cpk)
        if self.truncate:
            return tolerance.TruncatedNormal(mean, sigma, lower, upper)
        return tolerance.Normal(mean, sigma)

    def _from_std(self, std: float, site: Site) -> tolerance.Normal | tolerance.TruncatedNormal:
        band = self.band(site)
        if self.cpk is not None:
            raise refuse("std and cpk both define the standard deviation", "remove one of them")
        if (self.truncate or self.gauge is not None) != (band is not None):
            raise refuse(
                "with std, a band and truncate or gauge need each other",
                "give a band and truncate = true or a gauge, or neither",
            )
        middle = site.center if band is None else 0.5 * sum(band)
        mean = middle if self.mean is None else self.mean
        if band is None:
            return tolerance.Normal(mean, std)
        if not band[0] < mean < band[1]:
            raise refuse("mean is outside the band", "give lower < mean < upper")
        return tolerance.TruncatedNormal(mean, std, *band) if self.truncate else tolerance.Normal(mean, std)


class UniformEntry(Banded):
    """All values of the band are equally probable, none is outside."""

    distribution: Literal["uniform"]

    def build(self, site: Site) -> tolerance.Uniform:
        """See `ToleranceEntry.build`."""
        return tolerance.Uniform(*self.needed_band(site))


class TriangularEntry(Banded):
    """Most likely at `peak`, none is outside the band."""

    distribution: Literal["triangular"]
    peak: Value | None = Field(default=None, examples=["0 mm"])
    """most likely value; the middle of the band unless given"""

    def build(self, site: Site) -> tolerance.Triangular:
        """See `ToleranceEntry.build`."""
        lower, upper = self.needed_band(site)
        peak = 0.5 * (lower + upper) if self.peak is None else self.peak
        if not lower <= peak <= upper:
            raise refuse("peak is outside the band", "give lower <= peak <= upper")
        return tolerance.Triangular(lower, upper, peak)


class LogNormalEntry(Banded):
    """The logarithm of the value above `threshold` is normal: by band and Cpk of the logarithm, or by mean and std."""

    distribution: Literal["lognormal"]
    threshold: Value = Field(default=0.0, examples=["-0.01 mm"])
    """least possible value; 0 unless given"""
    cpk: Cpk = None
    mean: Value | None = Field(default=None, examples=["0.02 mm"])
    """mean of the value, with `std` in place of a band"""
    std: Positive | None = Field(default=None, examples=["0.01 mm"])
    """standard deviation of the value, with `mean` in place of a band"""
    truncate: Truncate = False

    def build(self, site: Site) -> tolerance.LogNormal:
        """See `ToleranceEntry.build`."""
        band = self.band(site)
        by_moments = self.mean is not None or self.std is not None
        if by_moments == (band is not None):
            raise refuse(
                "needs either a band or mean and std",
                "give one of the two; mean and std are those of the error, not of its logarithm",
            )
        if band is not None:
            return self._from_band(*band)
        if self.mean is None or self.std is None:
            raise refuse("mean without std, or std without mean", "give both")
        if self.cpk is not None or self.truncate:
            raise refuse("cpk and truncate need a band", "give a band instead of mean and std")
        if not self.mean > self.threshold:
            raise refuse("mean is not above threshold", "give mean > threshold")
        variance = math.log1p((self.std / (self.mean - self.threshold)) ** 2)
        log = tolerance.Normal(math.log(self.mean - self.threshold) - 0.5 * variance, math.sqrt(variance))
        return tolerance.LogNormal(self.threshold, log)

    def _from_band(self, lower: float, upper: float) -> tolerance.LogNormal:
        if not lower > self.threshold:
            raise refuse("the band is not above threshold", "give threshold < lower")
        low, high = math.log(lower - self.threshold), math.log(upper - self.threshold)
        mean = 0.5 * (low + high)
        sigma = tolerance.sigma_of(low, high, mean, 1.0 if self.cpk is None else self.cpk)
        log = tolerance.TruncatedNormal(mean, sigma, low, high) if self.truncate else tolerance.Normal(mean, sigma)
        return tolerance.LogNormal(self.threshold, log)


class BetaEntry(Banded):
    """Beta distribution with shapes `a`, `b`, stretched over the band."""

    distribution: Literal["beta"]
    a: PositiveNumber = Field(examples=[2.0])
    """shape at the lower limit"""
    b: PositiveNumber = Field(examples=[5.0])
    """shape at the upper limit"""

    def build(self, site: Site) -> tolerance.Beta:
        """See `ToleranceEntry.build`."""
        return tolerance.Beta(self.a, self.b, *self.needed_band(site))


class RayleighEntry(HalfBand):
    """Radius of an offset in a random direction; its two coordinates are normal with sigma = band / (3 Cpk) each."""

    distribution: Literal["rayleigh"]
    cpk: Cpk = None
    sigma: Positive | None = Field(default=None, examples=["0.03 mm"])
    """standard deviation of each coordinate, in place of `cpk`"""
    truncate: Truncate = False

    def build(self, site: Site) -> Rayleigh:
        """See `ToleranceEntry.build`."""
        if self.lot is not None:
            raise refuse("a radius and direction have no lot", "give offset_t and offset_z tolerances with lots")
        radius = self.half_width(site)
        if self.sigma is None and radius is None:
            raise refuse("no band", "add plus_minus, or iso2768 and nominal, or sigma")
        if self.sigma is not None and self.cpk is not None:
            raise refuse("sigma and cpk both define the standard deviation", "remove one of them")
        if radius is None:
            if self.truncate:
                raise refuse("truncate needs a band", "add plus_minus")
            return Rayleigh(self.sigma or 0.0)
        if self.sigma is not None and not self.truncate:
            raise refuse("the band has no effect beside sigma", "remove it, or add truncate = true")
        sigma = self.sigma or tolerance.sigma_of(-radius, radius, 0.0, self.cpk or 1.0)
        return Rayleigh(sigma, radius if self.truncate else None)

    def number(self, site: Site) -> str:
        """See `SingleEntry.number`."""
        return super().number(site).replace("half width", "radius")

    def band(self, site: Site) -> tuple[float, float] | None:
        """See `SingleEntry.band`."""
        radius = self.half_width(site)
        return None if radius is None else (-1.0, radius)

    def meaning(self, site: Site) -> list[Meaning]:
        """See `ToleranceEntry.meaning`."""
        found, band = self.build(site), self.band(site)
        share = math.nan if band is None else found.outside(*band)
        sigma = math.sqrt(0.5 * found.moments.mean_square)
        return [Meaning(self.number(site), columns_of(site.name), site.unit, sigma, share)]


KINDS: dict[str, type[ToleranceEntry]] = {
    "normal": NormalEntry,
    "uniform": UniformEntry,
    "triangular": TriangularEntry,
    "lognormal": LogNormalEntry,
    "beta": BetaEntry,
    "measured": MeasuredEntry,
    "scipy": ScipyEntry,
}
ZONE_KINDS: dict[str, dict[str, type[ToleranceEntry]]] = {
    "offset_radial": {"rayleigh": RayleighEntry},
    "position": dict.fromkeys(("normal", "uniform"), PositionEntry),
    **{key: dict.fromkeys(("normal", "uniform"), OrientationEntry) for key in ORIENTATIONS},
    "coaxiality": dict.fromkeys(("normal", "uniform"), CoaxialityEntry),
}
"""Entries for zones, by the key after the feature's name."""
ZONE_EXAMPLE = 'write { zone = "⌀0.1 mm", over = "22 mm", distribution = "normal", cp = 1.0 }'


def kinds_of(name: str) -> dict[str, type[ToleranceEntry]]:
    """Entries that an error or a zone can have, by the word for ``distribution``."""
    return ZONE_KINDS.get(name.partition(".")[2], KINDS)


def entry(data: object, site: Site, place: str, path: tuple[int | str, ...]) -> ToleranceEntry:
    """Read an entry for one of the errors or zones that it selects.

    Parameters
    ----------
    data : object
        The entry as parsed from TOML.
    site : Site
        What it is for.
    place, path : str, tuple of str
        File name, and key path in the file, shown in faults.

    Returns
    -------
    ToleranceEntry
        What it draws and means.

    Raises
    ------
    InputError
        With the faults of the entry.
    """
    where, kinds = f"{place}: {strict.dotted(path)}", kinds_of(site.name)
    if not isinstance(data, dict):
        half = json.dumps(data, ensure_ascii=False) if isinstance(data, str) else "..."
        remedy = f'write {{ plus_minus = {half}, distribution = "normal", cpk = 1.0 }}'
        if "normal" in kinds and kinds is not KINDS:
            remedy = ZONE_EXAMPLE
        raise InputError([Fault(where, f"{data!r} is not a tolerance", remedy)])
    kind = data.get("distribution")
    if kind is None:
        remedy = f"add distribution, one of {', '.join(kinds)}"
        raise InputError([Fault(f"{where}.distribution", "missing key", remedy)])
    if isinstance(kind, str) and kind.startswith(PREFIX):
        kind = PREFIX.rstrip(":")
    if not isinstance(kind, str) or kind not in kinds:
        also = " (rayleigh is for offset_radial)" if kind == "rayleigh" else ""
        remedy = strict.did_you_mean(str(kind), list(kinds))
        raise InputError([Fault(f"{where}.distribution", f"{kind!r} is not allowed here{also}", remedy)])
    return strict.validate(kinds[kind], data, place, prefix=path, context={"site": site})
