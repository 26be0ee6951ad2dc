"""Read ``[tolerances]``: what each entry selects, draws and means; zones of one axis are read together."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from tolstat.common.errors import Fault, gather
from tolstat.common.tables import FACTORS
from tolstat.joint import Joint
from tolstat.study.axes import ORIENTATIONS, REJECT, Axis, Bonus
from tolstat.study.selection import TOLERANCED, Entry
from tolstat.study.tolerances.correlation import Lot, of_entries
from tolstat.study.tolerances.distributions import Distribution
from tolstat.study.tolerances.entry import Diameter, SingleEntry, Site, Toleranced, ToleranceEntry
from tolstat.study.tolerances.kinds import entry
from tolstat.study.tolerances.zone_laws import Accepted
from tolstat.study.tolerances.zones import axes_of


class Nominal(NamedTuple):
    """What errors deviate from.

    Attributes
    ----------
    joint : Joint, optional
        None if it could not be read.
    folder : Path
        Folder of the study file.
    """

    joint: Joint | None
    folder: Path


class Tolerances(NamedTuple):
    """``[tolerances]`` as read.

    Attributes
    ----------
    entries : tuple of Toleranced
        In the order of the file.
    axes : dict of str to Axis
        Features and pairs that have zones.
    """

    entries: tuple[Toleranced, ...] = ()
    axes: Mapping[str, Axis] = {}

    @property
    def distributions(self) -> dict[str, Distribution]:
        """Distribution of each quantity that is drawn: of the diameters of pins and holes that are accepted."""
        found = {name: own for entry in self.entries for name, own in entry.quantities.items()}
        for bonus in self.rejecting:
            found[bonus.diameter] = Accepted(found[bonus.diameter], bonus)
        return found

    @property
    def lots(self) -> dict[str, Lot]:
        """Lot of each error that has one."""
        return of_entries(self.entries)

    @property
    def rejecting(self) -> list[Bonus]:
        """Maximum material requirements by which parts are rejected."""
        return [axis.bonus for axis in self.axes.values() if axis.bonus is not None and axis.bonus.rule == REJECT]


def read(written: Iterable[tuple[Entry, list[str]]], nominal: Nominal, place: str, faults: list[Fault]) -> Tolerances:
    """Read all entries.

    Parameters
    ----------
    written : iterable of (Entry, list of str)
        Entries of the file, and the errors and zones that each selects.
    nominal : Nominal
        What they deviate from.
    place : str
        File name shown in faults.
    faults : list of Fault
        Faults are added to it.

    Returns
    -------
    Tolerances
        Entries without fault.
    """
    table = list(written)
    every = {name for _, names in table for name in names}
    shared = {name for name in every if _partners(name) & every}
    directions: dict[str, ToleranceEntry] = {}
    diameters: dict[str, Diameter] = {}
    found: dict[int, Toleranced] = {}
    for number in sorted(range(len(table)), key=lambda i: _is_position(table[i][1])):  # what they depend on comes first
        one, names = table[number]
        models = []
        with gather(faults):
            for name in names:
                site = site_of(name, nominal)
                direction = next((directions[own] for own in _partners(name) if own in directions), None)
                site = site._replace(shared=name in shared, direction=direction if _is_position([name]) else None)
                site = site._replace(diameter=diameters.get(name) if _is_position([name]) else None)
                models.append((site, entry(one.value, site, place, one.path)))
                diameters |= _diameter(*models[-1])
                directions |= {name: models[-1][1]} if name.endswith(ORIENTATIONS) else {}
        if models and len(models) == len(names):
            found[number] = Toleranced(one.pattern, one.value, tuple(models))
    entries = tuple(found[number] for number in sorted(found))
    axes: dict[str, Axis] = {}
    if nominal.joint is not None:
        with gather(faults):
            axes = axes_of(entries, nominal.joint.cross.R, place)
    return Tolerances(entries, axes)


def site_of(name: str, nominal: Nominal) -> Site:
    """What an entry for an error or zone is for."""
    reach = math.nan if nominal.joint is None else nominal.joint.cross.R
    return Site(name, TOLERANCED[name], nominal_value(name), nominal.folder, reach)


def nominal_value(name: str) -> float:
    """Value of an error in the nominal joint (SI)."""
    return 1.0 if name in FACTORS else 0.0


def _diameter(site: Site, model: ToleranceEntry) -> dict[str, Diameter]:
    """Tolerance of a diameter, by the name of the position that its bonus is for; empty for other errors."""
    feature, _, key = site.name.partition(".")
    if key != "diameter" or not isinstance(model, SingleEntry):
        return {}
    return {f"{feature}.position": Diameter(model.band(site), model.build(site))}


def _is_position(names: list[str]) -> bool:
    return any(name.endswith(".position") for name in names)


def _partners(name: str) -> set[str]:
    """Names of the zones that share position and direction of an axis with this one."""
    feature, _, key = name.partition(".")
    if key == "position":
        return {f"{feature}.{other}" for other in ORIENTATIONS}
    return {f"{feature}.position"} if key in ORIENTATIONS else set()
