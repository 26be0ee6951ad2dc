"""The loads of a mechanism: name, where its values are, place, kind.

They follow from `load_kinds.kinds`: each place of a kind has one load, or one for each order. Limits, reports, checks
of the numerical error, selection of results and export read them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.load_kinds import Kind, Place, kinds, places, spans
from tolstat.common.mechanism import Mechanism

FloatArray = NDArray[np.float64]
Results = NDArray[np.void] | Mapping[str, NDArray[Any]]
"""Results of n joints: a table RESULT, or some of its columns, (n, ...) each."""

AT = " at "
"""What stands between a load and the operating points that it is taken at: ``"cross1.F at cruise+start"``."""


class Load(NamedTuple):
    """One load: its largest value over the revolution. Higher is worse for every load.

    Attributes
    ----------
    name : str
        As studies and reports name it, ``cross1.F``.
    kind : Kind
        What it is, and what its errors are relative to.
    place : Place
        Where it acts.
    element : int
        Position among the loads of the kind, the columns of `of_kind`.
    columns : tuple of str
        Columns of the result file that the load is computed from.
    """

    name: str
    kind: Kind
    place: Place
    element: int
    columns: tuple[str, ...]

    @property
    def unit(self) -> str:
        """SI unit."""
        return self.kind.unit

    def of(self, results: Results) -> FloatArray:
        """Values of the joints, (n,), SI."""
        return of_kind(results, self.kind)[:, self.element]

    def ends(self, results: Results) -> tuple[FloatArray, FloatArray]:
        """Interval of the load in each joint, (n,) each, SI: the load itself unless the joint is stationary."""
        values, key = self.of(results), self.kind.key
        return values * results[f"{key}_lower"], values * results[f"{key}_upper"]


def split(name: str) -> tuple[str, str]:
    """Load and operating points of a name: of ``"cross1.F at cruise"`` ``("cross1.F", "cruise")``; ``""`` are all."""
    load, _, points = name.partition(AT)
    return load, points


@cache
def loads_of(mechanism: Mechanism) -> dict[str, Load]:
    """Every load of a mechanism by name, by place in the order in which the kinds first name the places."""
    found = []
    for kind in kinds(mechanism).values():
        columns, parts = kind.columns("max"), len(kind.parts or ("",))
        for i, (place, name) in enumerate(kind.loads()):
            found.append(Load(name, kind, places(mechanism)[place], i, columns[i * parts : (i + 1) * parts]))
    first = [load.place.name for load in found]
    groups = [kind.places for kind in kinds(mechanism).values()]
    found.sort(key=lambda load: (groups.index(load.kind.places), first.index(load.place.name)))
    return {load.name: load for load in found}


def load_of(name: str, mechanism: Mechanism) -> Load:
    """Load that a name is about, whatever operating points it names."""
    return loads_of(mechanism)[split(name)[0]]


@cache
def shown_loads(mechanism: Mechanism) -> tuple[str, ...]:
    """Loads that every report shows if the study keeps them: force and bending moment of each bushing."""
    return tuple(load.name for load in loads_of(mechanism).values() if load.kind.shown)


@cache
def units_of_loads(mechanism: Mechanism) -> dict[str, str]:
    """SI unit of each load."""
    return {load.name: load.unit for load in loads_of(mechanism).values()}


@cache
def units_of_limits(mechanism: Mechanism) -> dict[str, str]:
    """SI unit of each load that can have a limit: all but the amplitudes of Psi by order."""
    return {load.name: load.unit for load in loads_of(mechanism).values() if load.kind.key != "psi_orders"}


class Limit(NamedTuple):
    """Levels that loads may not exceed: of one load, of the largest of several, or all limits of a study together.

    Attributes
    ----------
    name : str
        ``cross1.F``, the pattern ``cross*.F``, or `ANY_LIMIT`.
    loads : tuple of str
        Names of the loads; a joint is above the limit if any of them is above its level.
    levels : tuple of float
        Level of each load, SI.
    mechanism : Mechanism
        Whose loads they are.
    """

    name: str
    loads: tuple[str, ...]
    levels: tuple[float, ...]
    mechanism: Mechanism

    @property
    def has_one_level(self) -> bool:
        """Whether all loads have the same level, of the same kind."""
        return self.name != ANY_LIMIT and len(set(self.levels)) == 1

    @property
    def level(self) -> float:
        """Level of `of`: that of all loads, SI; 1 if they differ, and `of` is the largest ratio of load to level."""
        return self.levels[0] if self.has_one_level else 1.0

    @property
    def unit(self) -> str:
        """SI unit of `level`."""
        return load_of(self.loads[0], self.mechanism).unit if self.has_one_level else "1"

    def __str__(self) -> str:
        """``cross*.F > 700 N``, or `ANY_LIMIT`."""
        return f"{self.name} > {self.level:g} {unit_text(self.unit)}".rstrip() if self.has_one_level else ANY_LIMIT

    def of(self, results: NDArray[np.void]) -> FloatArray:
        """Largest of the loads in each joint, (n,), to be compared with `level`; NaN if any of them is."""
        parts = [load_of(name, self.mechanism).of(results) for name in self.loads]
        if not self.has_one_level:
            parts = [part / level for part, level in zip(parts, self.levels, strict=True)]
        return np.asarray(np.maximum.reduce(parts))


def of_kind(results: Results, kind: Kind) -> FloatArray:
    """All loads of a kind, (n, m), SI: of a pin's contact forces the largest."""
    values: FloatArray = results[f"{kind.key}_max"]
    if kind.parts:
        values = values.max(axis=-1)
    return values.reshape(len(values), len(kind.loads()))


def largest(results: NDArray[np.void], mechanism: Mechanism) -> FloatArray:
    """Largest values of all kinds, (n, values), SI, in the order of `load_kinds.spans`."""
    return np.concatenate([results[f"{key}_max"].reshape(len(results), -1) for key in kinds(mechanism)], axis=1)


def put_largest(values: FloatArray | float, results: NDArray[np.void], mechanism: Mechanism) -> None:
    """Write largest values, ordered as `largest` returns them, or one value for all, to a table RESULT."""
    values = np.broadcast_to(values, (len(results), max(span.stop for span in spans(mechanism).values())))
    for key, span in spans(mechanism).items():
        field = results[f"{key}_max"]
        field[...] = values[:, span].reshape(field.shape)


def names_of(group: str, kind: Kind, mechanism: Mechanism) -> tuple[str, ...]:
    """Names of the loads of a kind at the places of a group, ``"cross"``."""
    found = loads_of(mechanism).items()
    return tuple(name for name, load in found if load.kind == kind and load.place.group == group)


@cache
def panels(mechanism: Mechanism) -> tuple[tuple[str, Kind], ...]:
    """Groups of bushings and kinds of loads; figures of a whole campaign have a panel for each."""
    shown = [kind for kind in kinds(mechanism).values() if kind.shown]
    groups = dict.fromkeys(bushing.group for bushing in mechanism.bushings)
    return tuple((group, kind) for group in groups for kind in shown)


class LoadPanel(NamedTuple):
    """Loads that a figure of a whole campaign shows in one panel.

    Attributes
    ----------
    key : str
        ``cross-F``; of loads that limits name, ``loss at cruise``.
    title, words : str
        ``Cross bushings, force``; ``forces of the cross bushings``.
    quantity : str
        What an axis calls them.
    unit : str
        SI unit.
    names : tuple of str
        Names of the loads.
    """

    key: str
    title: str
    words: str
    quantity: str
    unit: str
    names: tuple[str, ...]


def load_panels(limited: Iterable[str], mechanism: Mechanism) -> list[LoadPanel]:
    """Panels for groups of bushings, and for other loads that have limits, by kind and operating points."""
    found, others = list[LoadPanel](), dict[tuple[str, str], list[str]]()
    for group, kind in panels(mechanism):
        quantity, names = QUANTITY[kind.unit], names_of(group, kind, mechanism)
        title, words = f"{group.capitalize()} bushings, {quantity}", f"{quantity}s of the {group} bushings"
        if group == "spline":  # T is the modulus about all axes, and a spline carries the torque
            quantity = "force" if kind.unit == "N" else "torque and bending moment"
            title, words = f"Spline, {quantity}", f"{quantity} of the spline"
        found.append(LoadPanel(f"{group}-{kind.symbol}", title, words, f"|{kind.symbol}|", kind.unit, names))
    for name in limited:
        if name not in shown_loads(mechanism):
            others.setdefault((load_of(name, mechanism).kind.key, split(name)[1]), []).append(name)
    for (key, points), limited_names in others.items():
        kind, where = kinds(mechanism)[key], f"{AT}{points}" if points else ""
        title, words = f"{kind.noun[:1].upper()}{kind.noun[1:]}{where}", f"{kind.noun}{where}"
        found.append(LoadPanel(f"{key}{where}", title, words, kind.noun, kind.unit, tuple(limited_names)))
    return found


def unit_text(unit: str) -> str:
    """Unit of a load for people: ``"N m"`` for ``"N*m"``, nothing for a pure number."""
    return {"N*m": "N m", "1": ""}.get(unit, unit)


def limits_in_words(limits: Mapping[str, float], mechanism: Mechanism) -> str:
    """Limits by name, SI, as one text: loads of the same limit together."""
    loads: dict[str, list[str]] = {}
    for name, limit in limits.items():
        loads.setdefault(f"{limit:g} {unit_text(load_of(name, mechanism).unit)}".rstrip(), []).append(name)
    return "; ".join(f"{', '.join(names)}: {limit}" for limit, names in loads.items()) or "none"


QUANTITY = {"N": "force", "N*m": "bending moment at the root"}
"""What the loads of a bushing are called, by unit; the root is that of the pin or arm."""
ANY_LIMIT = "any limit"
"""Name of all limits of a study together: a joint is above it if it is above at least one of them."""


@cache
def load_fields(mechanism: Mechanism) -> tuple[str, ...]:
    """Fields of the results that loads and their intervals are read from, and the status."""
    return ("status", *(f"{key}_{of}" for key in kinds(mechanism) for of in ("max", "lower", "upper")))
