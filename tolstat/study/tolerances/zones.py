"""Entries for zones of an axis: position, perpendicularity, angularity, coaxiality.

``position`` is a cylinder around the ideal axis that holds the whole axis over a length. Both ends are drawn in the
circle, independently of each other; where the direction has a zone, too, that zone gives the slope, and the middle is
drawn. A zone of direction has no place of its own: it bounds the slope to zone / over.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Iterator, Sequence
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BeforeValidator, Field, ValidationInfo, WithJsonSchema
from pydantic_core import PydanticCustomError

from tolstat.common import notation, units
from tolstat.common.errors import Fault, InputError
from tolstat.common.notation import schema_of_quantity
from tolstat.common.strict import dotted, refuse
from tolstat.study import axes
from tolstat.study.axes import ORIENTATIONS, REJECT, Axis, Bonus, alike, is_pair, is_pin, members, own
from tolstat.study.tolerances.distributions import Distribution, Normal, TruncatedNormal, Uniform, sigma_of
from tolstat.study.tolerances.entry import (
    Meaning,
    PositiveLength,
    PositiveNumber,
    Site,
    Toleranced,
    ToleranceEntry,
    Truncate,
)
from tolstat.study.tolerances.zone_laws import Accepted, Disc, Rayleigh


class Zone(NamedTuple):
    """Size of a zone: width or diameter, m, whether it is a diameter, and whether it grows by a bonus (Ⓜ)."""

    size: float
    round: bool
    grows: bool = False


MARKS = ("Ⓜ", "(M)")
"""Sign of the maximum material requirement behind the size of a zone."""


def _read(value: object, info: ValidationInfo) -> Zone:
    grown = next((mark for mark in MARKS if isinstance(value, str) and value.rstrip().endswith(mark)), None)
    if grown is not None:
        value = str(value).rstrip().removesuffix(grown)
    written = notation.read(value) if isinstance(value, str) else None
    mark = "" if written is None else written.mark
    if written is not None and mark == notation.PLUS_MINUS:
        raise _band(written, (info.context or {})["site"].name)
    size = units.to_si(value, "m", notation.DIAMETER)
    return Zone(units.positive(size), mark == notation.DIAMETER, grown is not None)


def _band(written: notation.Written, name: str) -> PydanticCustomError:
    """Fault of a half width in place of a zone."""
    size = f"{written.number:g} {written.unit}"
    of, sign, errors = "width", "", "tilt_t and tilt_z"
    if not name.endswith(ORIENTATIONS):
        of, sign, errors = "diameter", notation.DIAMETER, "offset_t and offset_z"
    remedy = f'write the {of} of the zone: "{sign}{size}", or give {errors} with plus_minus in place of a zone'
    return refuse(f"{{input}} is a band, and a zone has a {of}", remedy)


class ZoneEntry(ToleranceEntry):
    """Entry with a zone that the axis lies in over a length."""

    zone: Annotated[Zone, BeforeValidator(_read), WithJsonSchema(schema_of_quantity("m", "⌀0.1 mm"))] = Field(
        examples=["⌀0.1 mm"]
    )
    """size of the zone; ⌀ or dia before the number say that it is a diameter"""
    over: PositiveLength = Field(examples=["22 mm"])
    """length over which the zone holds: of a pin or hole; of the common axis of a pair from face to face, with the
    joint's centre in the middle, such as 2 (R + z/2) (coaxiality: of each pin or hole)"""
    distribution: Literal["normal", "uniform"] = Field(examples=["normal"])
    """`uniform`: by area in a circle; `normal`: in a circle bivariate"""
    cp: PositiveNumber | None = Field(default=None, examples=[1.33])
    """for normal: sigma of a coordinate is zone / (6 Cp); 1 unless given"""
    truncate: Truncate | None = Field(default=None, examples=[False])
    """for normal: whether parts outside the zone are sorted out; true unless given"""

    @abstractmethod
    def names(self, site: Site) -> tuple[str, ...]:
        """Names of the quantities that the entry draws."""

    @property
    def band(self) -> float:
        """Largest value that the zone allows to a quantity: slope, or radius in m."""
        return self.zone.size / self.over

    def build(self) -> Distribution:
        """Return the distribution of each quantity: of a radius, for one plane of a component."""
        if self.distribution == "uniform":
            if self.cp is not None or self.truncate is not None:
                raise refuse("cp and truncate have no effect on a uniform distribution", "remove them")
            return Disc(self.band) if self.zone.round else Uniform(-self.band, self.band)
        sigma = sigma_of(-self.band, self.band, 0.0, 1.0 if self.cp is None else self.cp)
        if self.zone.round:
            return Rayleigh(sigma, self.band if self.bounded else None)
        return TruncatedNormal(0.0, sigma, -self.band, self.band) if self.bounded else Normal(0.0, sigma)

    @property
    def bounded(self) -> bool:
        """Whether no part is outside the zone."""
        return self.truncate is not False

    def quantities(self, site: Site) -> dict[str, Distribution]:
        """See `ToleranceEntry.quantities`."""
        self.bonus(site)
        return dict.fromkeys(self.names(site), self.build())

    def bonus(self, site: Site) -> Bonus | None:
        """Return the bonus of the zone; None if it has none."""
        if self.zone.grows:
            raise refuse("a bonus is modelled for the position of a pin or hole only", "remove Ⓜ")
        return None

    def number(self) -> str:
        """Return what the number of the entry is, with its value."""
        size = units.shown(self.zone.size, "m")
        return f"{'diameter' if self.zone.round else 'width'} {size}"

    def _deviation(self) -> float:
        """Standard deviation of a component of a quantity."""
        return math.sqrt(self.build().moments.mean_square / (2.0 if self.zone.round else 1.0))

    def _outside(self) -> float:
        """Share of one quantity outside the zone."""
        return self.build().outside(-1.0 if self.zone.round else -self.band, self.band)


def _round(entry: ZoneEntry) -> None:
    if not entry.zone.round:
        size = units.shown(entry.zone.size, "m")
        raise refuse(f"the zone is round: its number {size} must say that it is a diameter", f'write "⌀{size}"')


class PositionEntry(ZoneEntry):
    """Position: a cylinder around the ideal axis, in which both of its ends lie."""

    material_condition: Literal["reject", "fills"] | None = Field(default=None, examples=["fills"])
    """bonus by maximum material: parts outside the grown zone are rejected (`reject`, also where `zone` ends in Ⓜ), or
    the process fills it (`fills`)"""

    def bonus(self, site: Site) -> Bonus | None:
        """See `ZoneEntry.bonus`."""
        rule = self.material_condition or (REJECT if self.zone.grows else None)
        if rule is None:
            return None
        feature = site.name.rpartition(".")[0]
        if is_pair(feature):
            remedy = 'give the positions of single features a bonus, "pin*.position"'
            raise refuse("the common axis of a pair has no diameter, and no bonus", remedy)
        if site.shared:
            raise refuse("a bonus beside a zone of direction is not modelled", "remove one of the two")
        if self.truncate is not None:
            raise refuse("truncate has no effect beside a bonus: no part is outside the grown zone", "remove it")
        if site.diameter is None or site.diameter.band is None:
            remedy = f'add fit, or "{alike(feature)}.diameter" with plus_minus, or lower and upper'
            raise refuse(f"the bonus needs the limits of {feature}.diameter", remedy)
        lower, upper = site.diameter.band
        sigma = math.inf if self.distribution == "uniform" else sigma_of(-self.band, self.band, 0.0, self.cp or 1.0)
        return Bonus(rule, f"{feature}.diameter", upper if is_pin(f"{feature}.diameter") else lower, self.band, sigma)

    @property
    def band(self) -> float:
        """See `ZoneEntry.band`."""
        return 0.5 * self.zone.size

    def names(self, site: Site) -> tuple[str, ...]:
        """See `ZoneEntry.names`."""
        _round(self)
        feature = site.name.rpartition(".")[0]
        return (site.name,) if site.shared else tuple(f"{feature}.{end}" for end in axes.ends(feature))

    def meaning(self, site: Site) -> list[Meaning]:
        """See `ToleranceEntry.meaning`."""
        end, share = self._deviation(), self._outside()
        feature, number = site.name.rpartition(".")[0], self.number()
        if (bonus := self.bonus(site)) is not None and site.diameter is not None:
            parts = Accepted(site.diameter.distribution, bonus)
            end = math.sqrt(0.5 * parts.expect(bonus.mean_square))
            rule = f"{100 * (1 - parts.share):.2g} % rejected" if bonus.rule == REJECT else "filled"
            number = f"⌀{units.shown(self.zone.size, 'm')} Ⓜ, {rule}"
        if isinstance(site.direction, OrientationEntry):
            middle, slope = end * self._room_left(site.direction), site.direction._deviation()
        else:
            middle, slope = end / math.sqrt(2.0), math.sqrt(2.0) * end / self.over
            share = 1.0 - (1.0 - share) ** 2
        offset = math.hypot(middle, site.reach * slope) if is_pair(feature) else middle
        meanings = [Meaning(number, _columns(feature, "offset"), "m", offset, share)]
        return meanings if site.shared else [*meanings, Meaning(number, _columns(feature, "tilt"), "rad", slope, share)]

    def _room_left(self, direction: ZoneEntry) -> float:
        """Root mean square of the share of the zone's radius that the tilt leaves to the middle."""
        if not self.bounded:
            return 1.0
        slope, taken = direction.build().moments, 0.5 * self.over / self.band
        return math.sqrt(1.0 - 2.0 * taken * slope.mean + taken**2 * slope.mean_square)


class OrientationEntry(ZoneEntry):
    """Perpendicularity or angularity: a cylinder, or the space between two planes, along the ideal direction."""

    about: Literal["t", "z"] | None = Field(default=None, examples=["z"])
    """for two planes (`zone` without ⌀): axis of the rotation that they bound"""

    def names(self, site: Site) -> tuple[str, ...]:
        """See `ZoneEntry.names`."""
        if self.zone.round and self.about is not None:
            raise refuse("a round zone bounds tilts about t and z: about has no effect", "remove about, or the ⌀")
        if not self.zone.round and self.about is None:
            remedy = 'add about = "t" or "z", the rotation that two planes bound; or write "⌀..." for a round zone'
            raise refuse("the zone is neither round nor says which tilt it bounds", remedy)
        return (site.name if self.about is None else f"{site.name}_{self.about}",)

    def meaning(self, site: Site) -> list[Meaning]:
        """See `ToleranceEntry.meaning`."""
        slope, share = self._deviation(), self._outside()
        feature = site.name.rpartition(".")[0]
        meanings = [Meaning(self.number(), _columns(feature, "tilt", self.about or "tz"), "rad", slope, share)]
        if is_pair(feature) and not site.shared:
            moved = {"t": "z", "z": "t"}[self.about] if self.about else "tz"
            offset = Meaning(self.number(), _columns(feature, "offset", moved), "m", site.reach * slope, share)
            return [offset, *meanings]
        return meanings


class CoaxialityEntry(ZoneEntry):
    """Coaxiality of a pair: a cylinder around the common axis, for each of the two features."""

    def names(self, site: Site) -> tuple[str, ...]:
        """See `ZoneEntry.names`."""
        _round(self)
        return tuple(f"{site.name}_{own(feature)}" for feature in members(site.name.rpartition(".")[0]))

    def meaning(self, site: Site) -> list[Meaning]:
        """See `ToleranceEntry.meaning`."""
        slope, share = self._deviation(), self._outside()
        return [Meaning(self.number(), _columns(site.name.rpartition(".")[0], "tilt"), "rad", slope, share)]


def _columns(feature: str, kind: str, parts: str = "tz") -> tuple[str, ...]:
    return tuple(f"{member}.{kind}_{part}" for member in members(feature) for part in parts)


def axes_of(entries: Sequence[Toleranced], place: str) -> dict[str, Axis]:
    """Axes that have zones, from the entries of ``[tolerances]``.

    Parameters
    ----------
    entries : sequence of Toleranced
        All entries of a study.
    place : str
        File name shown in faults.

    Raises
    ------
    InputError
        For zones of one axis that contradict each other.
    """
    zones: dict[str, dict[str, tuple[ToleranceEntry, str]]] = {}
    reach: dict[str, float] = {}
    bonus: dict[str, Bonus | None] = {}
    for entry in entries:
        for site, model in entry.models:
            if axes.is_zone(site.name):
                feature, _, key = site.name.rpartition(".")
                reach[feature] = site.reach
                zones.setdefault(feature, {})[key] = (model, dotted(("tolerances", entry.pattern)))
                if isinstance(model, PositionEntry):
                    bonus[feature] = model.bonus(site)
    axis_of, faults = {}, []
    for name, of_axis in zones.items():
        position = of_axis.get("position", (None, ""))[0]
        room, over = math.inf, math.nan
        if isinstance(position, PositionEntry):
            over = position.over
            for key in ORIENTATIONS:
                if key in of_axis:
                    model, where = of_axis[key]
                    room = position.band if position.bounded else math.inf
                    faults += _contradictions(model, position, f"{place}: {where}")
        axis_of[name] = Axis(name, over, room, reach[name] if is_pair(name) else math.nan, bonus.get(name))
    if faults:
        raise InputError(list(dict.fromkeys(faults)))
    return axis_of


def short_axes(entries: Sequence[Toleranced], length_of: Callable[[str], float]) -> Iterator[tuple[str, str, str]]:
    """Common axes that are toleranced over less than the distance of their two features.

    Parameters
    ----------
    entries : sequence of Toleranced
        All entries of a study.
    length_of : callable
        Length of a pin or hole, m, of a name that is about it.

    Yields
    ------
    tuple of str
        Key, what is wrong with it, and the remedy.
    """
    for entry in entries:
        for site, model in entry.models:
            if not isinstance(model, PositionEntry | OrientationEntry) or not is_pair(site.name.rpartition(".")[0]):
                continue
            apart = 2.0 * site.reach
            if model.over < apart * (1.0 - 1e-9):
                over, between = units.shown(model.over, "m"), units.shown(apart, "m")
                found = f"{over} is shorter than the {between} between the bearings"
                remedy = (
                    "for a common axis over is the length from face to face with the joint's centre in the middle, "
                )
                remedy += f"here 2 (R + z/2) = {units.shown(apart + length_of(site.name), 'm')}"
                yield f"tolerances.{entry.pattern}.over", found, remedy
                break


def _contradictions(direction: Any, position: PositionEntry, where: str) -> list[Fault]:
    """Faults of a zone of direction that does not refine the position of the same axis."""
    allowed, larger = position.zone.size / position.over, units.shown(direction.zone.size, "m")
    if not direction.zone.round:
        remedy = 'write a round zone, "⌀...", or remove the position'
        return [Fault(where, "is between planes beside a position", remedy)]
    if direction.zone.size > position.zone.size * (1 + 1e-12):
        other = units.shown(position.zone.size, "m")
        found = f"⌀{larger} is larger than the position's zone, ⌀{other}: it refines nothing"
        return [Fault(where, found, "give a smaller zone, or remove it: the position bounds the tilt, too")]
    if direction.band > allowed * (1 + 1e-12):
        tilt, most = units.shown(direction.band, "rad"), units.shown(allowed, "rad")
        found = f"allows a tilt of {tilt}, the position only {most}"
        return [Fault(where, found, f"give at most ⌀{units.shown(allowed * direction.over, 'm')}, or remove it")]
    if position.bounded and not direction.bounded:
        found = "has parts outside its zone, the position has none"
        return [Fault(where, found, "remove truncate = false, or add it to the position, too")]
    return []
