"""The loads of a joint: name, where its values are, place, kind.

They follow from the registry `load_kinds.LOAD_KINDS`: each place of a kind has one load, or one for each order. Limits,
reports, checks of the numerical error, selection of results and export read them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.load_kinds import LOAD_KINDS, PLACES, SPAN, Kind, Place

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


def load_of(name: str) -> Load:
    """Load that a name is about, whatever operating points it names."""
    return LOADS[split(name)[0]]


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
    """

    name: str
    loads: tuple[str, ...]
    levels: tuple[float, ...]

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
        return load_of(self.loads[0]).unit if self.has_one_level else "1"

    def __str__(self) -> str:
        """``cross*.F > 700 N``, or `ANY_LIMIT`."""
        return f"{self.name} > {self.level:g} {unit_text(self.unit)}".rstrip() if self.has_one_level else ANY_LIMIT

    def of(self, results: NDArray[np.void]) -> FloatArray:
        """Largest of the loads in each joint, (n,), to be compared with `level`; NaN if any of them is."""
        parts = [load_of(name).of(results) for name in self.loads]
        if not self.has_one_level:
            parts = [part / level for part, level in zip(parts, self.levels, strict=True)]
        return np.asarray(np.maximum.reduce(parts))


def of_kind(results: Results, kind: Kind) -> FloatArray:
    """All loads of a kind, (n, m), SI: of a pin's contact forces the largest."""
    values: FloatArray = results[f"{kind.key}_max"]
    if kind.parts:
        values = values.max(axis=-1)
    return values.reshape(len(values), len(kind.loads()))


def largest(results: NDArray[np.void]) -> FloatArray:
    """Largest values of all kinds, (n, values), SI, in the order of `load_kinds.SPAN`."""
    return np.concatenate([results[f"{key}_max"].reshape(len(results), -1) for key in SPAN], axis=1)


def put_largest(values: FloatArray | float, results: NDArray[np.void]) -> None:
    """Write largest values, ordered as `largest` returns them, or one value for all, to a table RESULT."""
    values = np.broadcast_to(values, (len(results), max(span.stop for span in SPAN.values())))
    for key, span in SPAN.items():
        field = results[f"{key}_max"]
        field[...] = values[:, span].reshape(field.shape)


def _entries() -> list[Load]:
    """Loads by place, in the order in which the registry of kinds first names the places."""
    loads = []
    for kind in LOAD_KINDS:
        columns, parts = kind.columns("max"), len(kind.parts or ("",))
        for i, (place, name) in enumerate(kind.loads()):
            loads.append(Load(name, kind, PLACES[place], i, columns[i * parts : (i + 1) * parts]))
    first = [load.place.name for load in loads]
    groups = [kind.places for kind in LOAD_KINDS]
    return sorted(loads, key=lambda load: (groups.index(load.kind.places), first.index(load.place.name)))


def names_of(group: str, kind: Kind) -> tuple[str, ...]:
    """Names of the loads of a kind at the places of a group, ``"cross"``."""
    return tuple(name for name, load in LOADS.items() if load.kind == kind and load.place.group == group)


def unit_text(unit: str) -> str:
    """Unit of a load for people: ``"N m"`` for ``"N*m"``, nothing for a pure number."""
    return {"N*m": "N m", "1": ""}.get(unit, unit)


def limits_in_words(limits: Mapping[str, float]) -> str:
    """Limits by name, SI, as one text: loads of the same limit together."""
    loads: dict[str, list[str]] = {}
    for name, limit in limits.items():
        loads.setdefault(f"{limit:g} {unit_text(load_of(name).unit)}".rstrip(), []).append(name)
    return "; ".join(f"{', '.join(names)}: {limit}" for limit, names in loads.items()) or "none"


LOADS = {load.name: load for load in _entries()}
"""Every load, by name."""
UNIT_OF_LOAD = {load.name: load.unit for load in LOADS.values()}
"""SI unit of each load."""
UNIT_OF_LIMIT = {load.name: load.unit for load in LOADS.values() if load.kind.key != "psi_orders"}
"""SI unit of each load that can have a limit: all but the amplitudes of Psi by order."""
SHOWN_LOADS = tuple(load.name for load in LOADS.values() if load.kind.shown)
"""Loads that every report shows if the study keeps them: force and bending moment of each bushing."""
PANELS = tuple((group, kind) for group in ("cross", "fork") for kind in LOAD_KINDS if kind.shown)
"""Groups of bushings and kinds of loads; figures of a whole campaign have a panel for each."""
QUANTITY = {"N": "force", "N*m": "bending moment at the root"}
"""What the loads of a bushing are called, by unit; the root is that of the pin or arm."""
ANY_LIMIT = "any limit"
"""Name of all limits of a study together: a joint is above it if it is above at least one of them."""
LOAD_FIELDS = ("status", *(f"{key}_{of}" for key in SPAN for of in ("max", "lower", "upper")))
"""Fields of the results that loads and their intervals are read from, and the status."""
