"""Read ``[tolerances]``: what each entry selects, draws and means; zones of one axis are read together."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from tolstat.common.errors import gather
from tolstat.common.tables import FACTORS
from tolstat.study.axes import ORIENTATIONS, REJECT, Axis, Bonus
from tolstat.study.selection import TOLERANCED, Entry, Reading
from tolstat.study.tolerances.correlation import Lot, of_entries
from tolstat.study.tolerances.distributions import Distribution
from tolstat.study.tolerances.entry import Diameter, SingleEntry, Site, Toleranced, ToleranceEntry
from tolstat.study.tolerances.kinds import entry
from tolstat.study.tolerances.zone_laws import Accepted
from tolstat.study.tolerances.zones import axes_of


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
        made = {name: law for entry in self.entries for name, law in entry.quantities.items()}
        return made | {bonus.diameter: Accepted(made[bonus.diameter], bonus) for bonus in self.rejecting}

    @property
    def lots(self) -> dict[str, Lot]:
        """Lot of each error that has one."""
        return of_entries(self.entries)

    @property
    def accepted(self) -> set[str]:
        """Diameters by which parts are accepted."""
        return {bonus.diameter for bonus in self.rejecting}

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
    every = {name for _, names in table for name in names}
    shared = {name for name in every if _partners(name) & every}
    directions: dict[str, ToleranceEntry] = {}
    diameters: dict[str, Diameter] = {}
    read: dict[int, Toleranced] = {}
    reach = math.nan if file.joint is None else file.joint.cross.R
    for number in sorted(range(len(table)), key=lambda i: _is_position(table[i][1])):  # what they depend on comes first
        item, names = table[number]
        models = []
        with gather(file.faults):
            for name in names:
                site = Site(name, TOLERANCED[name], 1.0 if name in FACTORS else 0.0, file.folder, reach, name in shared)
                if _is_position([name]):
                    direction = next((directions[zone] for zone in _partners(name) if zone in directions), None)
                    site = site._replace(direction=direction, diameter=diameters.get(name))
                model = entry(item.value, site, file.place, item.path)
                models.append((site, model))
                feature, _, key = name.partition(".")
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
            axes = axes_of(entries, reach, file.place)
    return Tolerances(entries, axes)


def _is_position(names: list[str]) -> bool:
    return any(name.endswith(".position") for name in names)


def _partners(name: str) -> set[str]:
    """Names of the zones that share position and direction of an axis with this one."""
    feature, _, key = name.partition(".")
    if key == "position":
        return {f"{feature}.{other}" for other in ORIENTATIONS}
    return {f"{feature}.position"} if key in ORIENTATIONS else set()
