"""Registry of the loads of a joint that can have a limit: name, where its values are, unit, kind.

Limits, reports, checks of the numerical error, selection of results and export read it. Each element of the field of a
kind is one load.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.tables import BUSHINGS, CONTACTS, LARGEST, PINS

FloatArray = NDArray[np.float64]


class Load(NamedTuple):
    """One load: its largest value over the revolution. Higher is worse for every load.

    Attributes
    ----------
    name : str
        As studies and reports name it, ``cross1.F``.
    kind : str
        Key of `tables.LARGEST`: loads of one kind are compared with the largest of them.
    unit : str
        SI unit.
    element : int
        Position among the loads of the kind, the columns of `of_kind`.
    columns : tuple of str
        Columns of the result file that the load is computed from.
    """

    name: str
    kind: str
    unit: str
    element: int
    columns: tuple[str, ...]

    def of(self, results: NDArray[np.void]) -> FloatArray:
        """Values of the joints in a table RESULT, (n,), SI."""
        return of_kind(results, self.kind)[:, self.element]

    def ends(self, results: NDArray[np.void]) -> tuple[FloatArray, FloatArray]:
        """Interval of the load in each joint, (n,) each, SI: the load itself unless the joint is stationary."""
        values = self.of(results)
        return values * results[f"{self.kind}_lower"], values * results[f"{self.kind}_upper"]


def of_kind(results: NDArray[np.void], kind: str) -> FloatArray:
    """All loads of a kind, (n, m), SI: of a pin's contact forces the largest."""
    values: FloatArray = results[f"{kind}_max"]
    if values.ndim == 1:
        return values[:, None]
    return values.max(axis=2) if values.ndim == 3 else values


def _entries() -> list[Load]:
    found = [
        Load(f"{bushing}.{kind}", kind, unit, index, (f"{bushing}.{kind}_max",))
        for index, bushing in enumerate(BUSHINGS)
        for kind, unit in (("F", "N"), ("T", "N*m"))
    ]
    for index, pin in enumerate(PINS):
        columns = tuple(f"{pin}.contact_{part}_max" for part in CONTACTS)
        found.append(Load(f"{pin}.contact", "contact", "N", index, columns))
    return [*found, Load("psi", "psi", "1", 0, ("psi_max",))]


LOADS = {load.name: load for load in _entries()}
"""Every load that can have a limit, by name."""
KINDS = tuple(LARGEST)
"""Kinds of loads, in the order of reports."""
UNIT_OF_LOAD = {load.name: load.unit for load in LOADS.values()}
"""SI unit of each load."""
BUSHING_LOADS = tuple(load.name for load in LOADS.values() if load.kind in ("F", "T"))
"""Force and torque of each bushing: what every report shows if the study keeps it."""
LOAD_FIELDS = ("status", *(f"{kind}_{of}" for kind in KINDS for of in ("max", "lower", "upper")))
"""Fields of the results that loads and their intervals are read from, and the status."""
