"""``fit`` of ``[tolerances]``: the diameters of all pins and holes by one fit of ISO 286, such as H7/f7.

The nominal diameters are the middles of the two tolerance zones, so that half of a zone is the tolerance on both sides.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import AfterValidator, Field, ValidationInfo, field_validator

from tolstat.common import strict
from tolstat.common.errors import Fault, InputError, gather, input_error
from tolstat.common.mechanism import Mechanism
from tolstat.common.strict import Strict
from tolstat.display.text import percent
from tolstat.study import selection
from tolstat.study.axes import alike
from tolstat.study.selection import Entry, Reading
from tolstat.study.tolerances import iso, kinds
from tolstat.study.tolerances.distributions import Distribution
from tolstat.study.tolerances.entry import PositiveLength, PositiveNumber, Site

KEY = "fit"
PATH = ("tolerances", KEY)
"""Key of ``[tolerances]``, and its path."""
BESIDE = ("is set by tolerances.fit already", "remove one of the two")
"""Fault and remedy of a diameter."""
STAND_IN = {"basic": "20 mm", "code": "H7/f7", "distribution": "normal"}
EXAMPLE = 'fit = { basic = "76 mm", code = "H7/f7", distribution = "normal", cpk = 1.0 }'
_KEYS_OF = {"cpk": "normal", "truncate": "normal", "a": "beta", "b": "beta"}
"""Keys of one distribution, which others do not have."""
NEGLIGIBLE = 1e-8
"""Probability of a misfit of one pair that is not told."""


def _check_size(basic: float) -> float:
    if not 0.0 < 1e3 * basic <= iso.LARGEST:
        raise strict.refuse("{input} is outside the tables of ISO 286", f"give at most {iso.LARGEST:g} mm")
    return basic


def _check_code(code: str) -> str:
    try:
        iso.parse(code)
    except ValueError as error:
        remedy = 'write for example "H7/f7", or give tolerances of hole*.diameter and pin*.diameter in place of fit'
        raise strict.refuse(str(error), remedy) from error
    return code


class FitEntry(Strict):
    """``fit`` of ``[tolerances]``: basic size and classes of a fit, and how diameters scatter in their zones."""

    basic: Annotated[PositiveLength, AfterValidator(_check_size)] = Field(examples=["76 mm"])
    """basic size of the fit"""
    code: Annotated[str, AfterValidator(_check_code)] = Field(examples=["H7/f7"])
    """class of hole and pin by ISO 286"""
    distribution: Literal["normal", "uniform", "triangular", "beta"] = Field(examples=["normal"])
    """distribution of the diameters, centred in their zones"""
    cpk: PositiveNumber | None = Field(default=None, examples=[1.33])
    """Cpk of both diameters, for normal; 1 unless given"""
    truncate: bool | None = Field(default=None, strict=True, examples=[True])
    """whether parts outside the zone are sorted out, for normal"""
    a: PositiveNumber | None = Field(default=None, examples=[2.0])
    """shape, for beta"""
    b: PositiveNumber | None = Field(default=None, examples=[4.0])
    """shape, for beta"""

    @field_validator(*_KEYS_OF)
    @classmethod
    def _has_effect(cls, value: object, info: ValidationInfo) -> object:
        kind = info.data.get("distribution")
        if value is not None and kind is not None and kind != _KEYS_OF[str(info.field_name)]:
            raise strict.refuse(f'has no effect with distribution = "{kind}"', "remove it")
        return value

    @property
    def size(self) -> float:
        """Basic size, mm."""
        return round(1e3 * self.basic, 9)

    @property
    def zones(self) -> iso.Zones:
        """Tolerance zones of hole and pin, um."""
        return iso.zones(iso.parse(self.code), self.size)

    def scatter(self, zone: iso.Zone) -> dict[str, Any]:
        """Return the entry of a diameter: half of its zone on both sides of the nominal diameter."""
        return {"plus_minus": _written(zone.half)} | self.model_dump(exclude={"basic", "code"}, exclude_none=True)


def patterns(mechanism: Mechanism) -> tuple[str, str]:
    """Errors that a fit gives tolerances to: diameters of the holes, and of the pins."""
    pair = mechanism.pairs[0]
    return f"{alike(pair.hole)}.diameter", f"{alike(pair.pin)}.diameter"


class Fit(NamedTuple):
    """A fit that goes together.

    Attributes
    ----------
    entry : FitEntry
        As written.
    misfit : float
        Probability that a pin is larger than its hole; above zero for a distribution that reaches beyond its zone.
    pairs : int
        Number of pins.
    """

    entry: FitEntry
    misfit: float
    pairs: int

    @property
    def diameters(self) -> dict[str, str]:
        """Nominal diameters, as keys of ``joint.contact``."""
        middles = (zone.middle for zone in self.entry.zones)
        sizes = (_written(1e6 * self.entry.basic + middle) for middle in middles)
        return dict(zip(("D_H", "D_P"), sizes, strict=True))

    @property
    def meaning(self) -> list[str]:
        """Lines of text: zones of the fit, and the share of joints that do not go together if there are any."""
        zones = self.entry.zones
        hole, pin = (f"{_signed(zone.lower)} to {_signed(zone.upper)} um" for zone in zones)
        lines = [
            f"fit {self.entry.code} at {1e3 * self.entry.basic:g} mm: hole {hole}, pin {pin}",
            f"fit: hole less pin {zones.least:g} to {zones.largest:g} um, "
            f"radial clearance {zones.least / 2:g} to {zones.largest / 2:g} um",
        ]
        if self.misfit > NEGLIGIBLE:
            lines.append(f"fit: {percent(any_pair(self.misfit, self.pairs))} of the joints do not go together")
        return lines


def read(file: Reading) -> Fit | None:
    """Read the fit of ``[tolerances]``, of all drive shafts; None where the table has none.

    A fit with faults is replaced by another one, so that other faults of the file are those of the file: without
    diameters those of the joint, correlations of diameters and bonuses would seem to lack them.
    """
    table = file.data.get("tolerances")
    if not isinstance(table, Mapping):
        return None
    for joint in sorted(selection.joints(file.mechanism)):
        if isinstance(table.get(joint), Mapping) and KEY in table[joint]:
            remedy = "write tolerances.fit, or the tolerances of the diameters of each joint"
            file.fault(("tolerances", joint, KEY), "is the fit of one joint: a fit is of all", remedy)
    if KEY not in table:
        return None
    data = table[KEY]
    with gather(file.faults):
        return of(data, file.place, file.mechanism)
    sizes = [data.get("basic"), STAND_IN["basic"]] if isinstance(data, Mapping) else [STAND_IN["basic"]]
    for basic in sizes:
        with suppress(InputError):
            return of(STAND_IN | {"basic": basic}, "", file.mechanism)
    return None


def of(data: object, place: str, mechanism: Mechanism) -> Fit:
    """Read a fit.

    Parameters
    ----------
    data : object
        Value of the key ``fit``.
    place : str
        File name shown in faults.
    mechanism : Mechanism
        Whose pins and holes have the fit.

    Raises
    ------
    InputError
        With the faults of the entry; for a transition or interference fit, with the share of joints that would not go
        together.
    """
    where = f"{place}: {strict.dotted(PATH)}"
    if not isinstance(data, Mapping):
        raise input_error(where, f"{data!r} is not a fit", f"write {EXAMPLE}")
    entry = strict.validate(FitEntry, data, place, prefix=PATH)
    zones = entry.zones
    deviations = []
    for name, zone in zip(patterns(mechanism), zones, strict=True):
        site = Site(name, "m", 0.0, Path())
        deviations.append(kinds.entry(entry.scatter(zone), site, place, PATH).quantities(site)[site.name])
    hole, pin = deviations
    share = larger(pin, hole, 1e-6 * (zones.hole.middle - zones.shaft.middle))
    if zones.kind != "clearance":
        raise InputError([_refusal(Fit(entry, share, len(mechanism.pairs)), zones, f"{where}.code")])
    return Fit(entry, share, len(mechanism.pairs))


def _refusal(fit: Fit, zones: iso.Zones, where: str) -> Fault:
    kind = f"{'an' if zones.kind == 'interference' else 'a'} {zones.kind} fit"
    found = f"{fit.entry.code} is {kind}, clearance {_signed(zones.least)} to {_signed(zones.largest)} um: "
    joints = percent(any_pair(fit.misfit, fit.pairs))
    found += f"{joints} of the joints do not go together ({percent(fit.misfit)} of the pairs)"
    return Fault(where, found, "give a clearance fit, such as H7/g6, H7/f7 or H8/e8")


def _signed(value: float) -> str:
    return f"{value:+g}" if value else "0"


def any_pair(share: float, pairs: int) -> float:
    """Share of joints of which at least one of `pairs` does not go together, if the diameters are independent."""
    return -math.expm1(pairs * math.log1p(-share)) if share < 1.0 else 1.0


def entries(table: Mapping[str, Any], fit: Fit | None, mechanism: Mechanism) -> Iterator[Entry]:
    """Entries of ``[tolerances]``, with those of the holes' and of the pins' diameters in place of the fit.

    Parameters
    ----------
    table : mapping
        ``[tolerances]`` as parsed from TOML.
    fit : Fit or None
        The fit that `read` found in it; without one, the key is left out.
    mechanism : Mechanism
        Whose errors they are of.
    """
    for key, value in table.items():
        if key != KEY:
            if key in selection.joints(mechanism) and isinstance(value, Mapping):
                value = {name: of_joint for name, of_joint in value.items() if name != KEY}
            yield from selection.entries({key: value}, mechanism, "tolerances")
        elif fit is not None:
            for pattern, zone in zip(patterns(mechanism), fit.entry.zones, strict=True):
                yield Entry(pattern, PATH, fit.entry.scatter(zone))


def larger(pin: Distribution, hole: Distribution, clearance: float) -> float:
    """Probability that a pin is larger than its hole.

    Parameters
    ----------
    pin, hole : Distribution
        Independent deviations of the two diameters (m).
    clearance : float
        Difference of the nominal diameters, hole less pin (m).

    Returns
    -------
    float
        By quadrature over the hole's diameters.
    """
    return 1.0 - hole.expect(lambda deviation: pin.cdf(deviation + clearance))


def _written(value: float) -> str:
    """Length in um as a quantity in mm."""
    return f"{round(1e-3 * value, 9):.12g} mm"
