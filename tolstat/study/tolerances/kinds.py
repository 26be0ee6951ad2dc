"""Entries of ``[tolerances]``, one model for each distribution: the entry's keys, and the distribution they define.

No statistics of the errors of Cardan crosses are published: the distribution is an assumption of the study.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Literal, NamedTuple

from pydantic import Field

from tolstat.analysis.measured import LEAST_PARTS, MOST_PARTS
from tolstat.common import strict
from tolstat.common.errors import gather, input_error
from tolstat.common.strict import refuse
from tolstat.common.tables import FACTORS
from tolstat.joint.operation import having
from tolstat.study.axes import ORIENTATIONS, REJECT, Axis, Bonus
from tolstat.study.selection import Entry, Reading, toleranced_units
from tolstat.study.tolerances import distributions as tolerance
from tolstat.study.tolerances.correlation import Lot
from tolstat.study.tolerances.distributions import Distribution
from tolstat.study.tolerances.entry import (
    Banded,
    Diameter,
    HalfBand,
    Positive,
    PositiveNumber,
    SingleEntry,
    Site,
    Toleranced,
    ToleranceEntry,
    Truncate,
    Value,
)
from tolstat.study.tolerances.external import PREFIX, MeasuredEntry, ScipyEntry
from tolstat.study.tolerances.zone_laws import Accepted, Rayleigh
from tolstat.study.tolerances.zones import CoaxialityEntry, OrientationEntry, PositionEntry, axes_of

CPK = "capability index Cpk of the process: sigma is the distance from the mean to the nearer limit over 3 Cpk"
Cpk = Annotated[PositiveNumber | None, Field(description=f"{CPK}; 1 unless given", examples=[1.33])]


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

    def measured_parts(self, site: Site) -> int:
        """See `ToleranceEntry.measured_parts`."""
        return self.known_from or 0

    def build(self, site: Site) -> tolerance.Normal | tolerance.TruncatedNormal:
        """See `ToleranceEntry.build`."""
        if self.known_from is not None and self.truncate:
            found = "known_from is of parts as they are made, truncate of parts that are sorted"
            raise refuse(found, "remove one of them")
        band = self.needed_band(site) if self.std is None else self.band(site)
        if self.std is not None and self.cpk is not None:
            raise refuse("std and cpk both define the standard deviation", "remove one of them")
        if self.std is not None and self.truncate != (band is not None):
            found = "with std, a band and truncate need each other"
            raise refuse(found, "give a band and truncate = true, or neither")
        mean = self.mean
        if mean is None:
            mean = site.center if band is None else 0.5 * sum(band)
        if band is not None and not band[0] < mean < band[1]:
            why = ", so that Cpk would not be positive" if self.std is None else ""
            raise refuse(f"mean is outside the band{why}", "give lower < mean < upper")
        if band is None:
            return tolerance.Normal(mean, self.std or 0.0)
        sigma = self.std or tolerance.sigma_of(*band, mean, 1.0 if self.cpk is None else self.cpk)
        return tolerance.TruncatedNormal(mean, sigma, *band) if self.truncate else tolerance.Normal(mean, sigma)


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

    scales = False
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
            remedy = "give one of the two; mean and std are those of the error, not of its logarithm"
            raise refuse("needs either a band or mean and std", remedy)
        if band is not None:
            if not band[0] > self.threshold:
                raise refuse("the band is not above threshold", "give threshold < lower")
            low, high = (math.log(end - self.threshold) for end in band)
            mean = 0.5 * (low + high)
            sigma = tolerance.sigma_of(low, high, mean, 1.0 if self.cpk is None else self.cpk)
            log = tolerance.TruncatedNormal(mean, sigma, low, high) if self.truncate else tolerance.Normal(mean, sigma)
            return tolerance.LogNormal(self.threshold, log)
        if self.mean is None or self.std is None:
            raise refuse("mean without std, or std without mean", "give both")
        if self.cpk is not None or self.truncate:
            raise refuse("cpk and truncate need a band", "give a band instead of mean and std")
        if not self.mean > self.threshold:
            raise refuse("mean is not above threshold", "give mean > threshold")
        variance = math.log1p((self.std / (self.mean - self.threshold)) ** 2)
        normal = tolerance.Normal(math.log(self.mean - self.threshold) - 0.5 * variance, math.sqrt(variance))
        return tolerance.LogNormal(self.threshold, normal)


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
    return ZONE_KINDS.get(name.rpartition(".")[2], KINDS)


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
        raise input_error(where, f"{data!r} is not a tolerance", remedy)
    kind = data.get("distribution")
    if kind is None:
        raise input_error(f"{where}.distribution", "missing key", f"add distribution, one of {', '.join(kinds)}")
    if isinstance(kind, str) and kind.startswith(PREFIX):
        kind = PREFIX.rstrip(":")
    if not isinstance(kind, str) or kind not in kinds:
        also = " (rayleigh is for offset_radial)" if kind == "rayleigh" else ""
        remedy = strict.did_you_mean(str(kind), list(kinds))
        raise input_error(f"{where}.distribution", f"{kind!r} is not allowed here{also}", remedy)
    return strict.validate(kinds[kind], data, place, prefix=path, context={"site": site})


class Tolerances(NamedTuple):
    """``[tolerances]`` as read.

    Attributes
    ----------
    entries : tuple of Toleranced
        In the order of the file.
    axes : dict of str to Axis
        Features and pairs that have zones.
    drawn : sequence of str
        Quantities that are drawn, those of entries with faults included.
    """

    entries: tuple[Toleranced, ...] = ()
    axes: Mapping[str, Axis] = {}
    drawn: Sequence[str] = ()

    @property
    def distributions(self) -> dict[str, Distribution]:
        """Distribution of each quantity that is drawn: of the diameters of pins and holes that are accepted."""
        of_quantities = {name: law for entry in self.entries for name, law in entry.quantities.items()}
        accepted = {bonus.diameter: Accepted(of_quantities[bonus.diameter], bonus) for bonus in self.rejecting}
        return of_quantities | accepted

    @property
    def lots(self) -> dict[str, Lot]:
        """Lot of each error that has one, in the order of the entries."""
        lots: dict[str, Lot] = {}
        for entry in self.entries:
            first = entry.models[0][0].name
            for site, model in entry.models:
                if (lot := getattr(model, "lot", None)) is not None:
                    lots[site.name] = Lot(lot.share, first if lot.shared else site.name)
        return lots

    @property
    def rejecting(self) -> list[Bonus]:
        """Maximum material requirements by which parts are rejected."""
        return [axis.bonus for axis in self.axes.values() if axis.bonus is not None and axis.bonus.rule == REJECT]


def read(table: Sequence[tuple[Entry, list[str]]], file: Reading) -> Tolerances:
    """Read all entries.

    Parameters
    ----------
    table : sequence of (Entry, list of str)
        Entries of the file, and the errors and zones that each selects.
    file : Reading
        The file, to which faults are added.

    Returns
    -------
    Tolerances
        Entries without fault.
    """
    every, units = {name for _, names in table for name in names}, toleranced_units(file.mechanism)
    shared = {name for name in every if _partners(name) & every}
    directions: dict[str, ToleranceEntry] = {}
    diameters: dict[str, Diameter] = {}
    read: dict[int, Toleranced] = {}
    known = file.joint, file.operation
    for number in sorted(range(len(table)), key=lambda i: _is_position(table[i][1])):  # what they depend on comes first
        item, names = table[number]
        models = []
        with gather(file.faults):
            for name in names:
                reach = having(name, *known).cross.R if None not in known else math.nan
                site = Site(name, units[name], 1.0 if name in FACTORS else 0.0, file.folder, reach, name in shared)
                if _is_position([name]):
                    direction = next((directions[zone] for zone in _partners(name) if zone in directions), None)
                    site = site._replace(direction=direction, diameter=diameters.get(name))
                model = entry(item.value, site, file.place, item.path)
                models.append((site, model))
                feature, _, key = name.rpartition(".")
                if key == "diameter" and isinstance(model, SingleEntry):
                    diameters[f"{feature}.position"] = Diameter(model.band(site), model.build(site))
                if key in ORIENTATIONS:
                    directions[name] = model
        if models and len(models) == len(names):
            read[number] = Toleranced(item.pattern, item.value, tuple(models))
    entries = tuple(read[number] for number in sorted(read))
    axes: dict[str, Axis] = {}
    if file.joint is not None:
        with gather(file.faults):
            axes = axes_of(entries, file.place)
    # those with faults stand for what they would draw, so that others do not seem to lack them
    drawn = [quantity for i, (_, names) in enumerate(table) for quantity in (read[i].names if i in read else names)]
    return Tolerances(entries, axes, list(dict.fromkeys(drawn)))


def _is_position(names: list[str]) -> bool:
    return any(name.endswith(".position") for name in names)


def _partners(name: str) -> set[str]:
    """Names of the zones that share position and direction of an axis with this one."""
    feature, _, key = name.rpartition(".")
    if key == "position":
        return {f"{feature}.{other}" for other in ORIENTATIONS}
    return {f"{feature}.position"} if key in ORIENTATIONS else set()
