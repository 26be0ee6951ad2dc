"""Joints one by one, such as measured ones: loads against limits, loads of the shafts, lives of the bearings."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tolstat.common.loads import FloatArray, loads_of
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import VALID
from tolstat.display import text
from tolstat.display.answer import Column, Part, Row, Sentence, Table
from tolstat.joint import Bearing
from tolstat.joint.bearing import FOR_LIFE
from tolstat.questions.bearing_life.lives import HOUR, bearing_of, rated, turning_of
from tolstat.store.view import View

OF_SHAFTS = ("axial", "lateral", "moment", "bearing_a", "bearing_b")
"""Kinds of loads of shafts that are shown, with limits or without."""
SIDE_BY_SIDE = 4
"""Maximum number of joints that are shown beside each other; of more the worst one is shown."""


@dataclass(frozen=True, eq=False)
class Quantity:
    """A load or a life of n joints.

    Attributes
    ----------
    name, unit : str
        Its name and unit.
    limit : float
        What loads must not exceed, and lives must reach; NaN where none is given.
    values : ndarray, shape (n,)
        NaN without a valid result.
    is_life : bool
        Whether less is worse.
    """

    name: str
    unit: str
    limit: float
    values: FloatArray
    is_life: bool = False

    @property
    def beyond(self) -> NDArray[np.bool_]:
        """Joints that exceed the limit, or do not reach it, bool (n,)."""
        return self.values < self.limit if self.is_life else self.values > self.limit

    @property
    def worst(self) -> int:
        """Joint with the largest load or the shortest life; -1 where none has any."""
        if np.isnan(self.values).all():
            return -1
        return int(np.nanargmin(self.values) if self.is_life else np.nanargmax(self.values))


def names_of(limits: Mapping[str, float], mechanism: Mechanism) -> list[str]:
    """Loads that are shown: those with limits, and those of the shafts."""
    of_shafts = [name for name, load in loads_of(mechanism).items() if load.kind.key in OF_SHAFTS]
    return list(dict.fromkeys([*limits, *of_shafts]))


def lives(bearing: Bearing | None, turning: Mapping[str, FloatArray]) -> list[Quantity]:
    """Rating lives of the pins' bearings and of the joint; none without what they need.

    Parameters
    ----------
    bearing : Bearing or None
        Bearing of each pin.
    turning : mapping
        See `lives.turning_of`.
    """
    if bearing is None or bearing.lacking(FOR_LIFE):
        return []
    _, hours, _ = rated(bearing, np.ones(1), [turning])
    required = np.nan if bearing.required_life is None else bearing.required_life / HOUR
    pins = hours.shape[1] - 1
    names = [*(f"life of pin{number + 1}" for number in range(pins)), f"life of all {text.in_words(pins)}"]
    limits = [*[np.nan] * pins, required]
    return [
        Quantity(name, "h", limit, values, True) for name, limit, values in zip(names, limits, hours.T, strict=True)
    ]


def of_listed(view: View) -> list[Part]:
    """Parts of an answer on the joints that a study lists: where it has limits, or a joint has a rating life.

    Parameters
    ----------
    view : View
        A file of a study whose method is ``cases``.
    """
    store, design = view.store, view.store.design()
    valid = np.isin(view.status, VALID)
    bearing = bearing_of(view)
    kept = {column.field for column in view.columns}
    has_life = bearing is not None and not bearing.lacking(FOR_LIFE) and "equivalent_load" in kept
    if not (view.limits or has_life):
        return []
    names = [name for name in names_of(view.limits, view.mechanism) if name in view.kept_loads]
    loads = {name: view.load(name) for name in names}
    found = [
        Quantity(name, load.unit, load.limit or np.nan, np.where(valid, load.values, np.nan))
        for name, load in loads.items()
    ]
    if has_life:
        turning = turning_of(store)
        turning["equivalent_load"] = np.where(valid[:, None], turning["equivalent_load"], np.nan)
        found += lives(bearing, turning)
    labels = [store.case_names[number] for number in design["case"]]
    if len(set(design["group"])) > 1:
        labels = [f"{label} ({number})" for number, label in enumerate(labels)]
    return list(parts(found, labels))


def parts(found: Sequence[Quantity], labels: Sequence[str]) -> Iterator[Part]:
    """Sentence on the limits, and a table of all loads and lives.

    Parameters
    ----------
    found : sequence of Quantity
        Loads and lives of n joints.
    labels : sequence of str
        Name of each joint, (n,).
    """
    limited = [quantity for quantity in found if not np.isnan(quantity.limit)]
    if limited:
        yield Sentence(_verdict(limited, labels), "lead")
    rows = [
        {
            "joint": label,
            "quantity": quantity.name,
            "unit": quantity.unit,
            "limit": quantity.limit,
            "value": float(value),
            "beyond": bool(beyond),
        }
        for quantity in found
        for label, value, beyond in zip(labels, quantity.values, quantity.beyond, strict=True)
    ]
    columns = [
        Column("load or life", lambda row: str(row["quantity"].name)),
        Column("limit", lambda row: _text(row["quantity"].limit, row["quantity"].unit)),
        *(_beside(labels) if len(labels) <= SIDE_BY_SIDE else _worst(labels)),
    ]
    seen = [{"quantity": quantity} for quantity in found]
    yield Table("joints", "Loads and lives of the joints", columns, rows, seen=seen)


def _text(value: float, unit: str) -> str:
    return "no limit" if np.isinf(value) else text.value(value, unit)


def _cell(number: int) -> Callable[[Row], str]:
    def cell(row: Row) -> str:
        of: Quantity = row["quantity"]
        if number < 0:
            return "-"
        mark = (" short" if of.is_life else " above") if of.beyond[number] else ""
        return f"{_text(float(of.values[number]), of.unit)}{mark}"

    return cell


def _beside(labels: Sequence[str]) -> list[Column]:
    """A column for each joint."""
    return [Column(label, _cell(number)) for number, label in enumerate(labels)]


def _worst(labels: Sequence[str]) -> list[Column]:
    """Columns of the worst joint, and of how many are beyond the limit."""

    def beyond(row: Row) -> str:
        of: Quantity = row["quantity"]
        return "" if np.isnan(of.limit) else f"{int(of.beyond.sum())} of {int((~np.isnan(of.values)).sum())}"

    def joint(row: Row) -> str:
        return labels[row["quantity"].worst] if row["quantity"].worst >= 0 else "-"

    return [
        Column("worst", lambda row: _cell(row["quantity"].worst)(row)),
        Column("joint", joint, words=True),
        Column("beyond the limit", beyond),
    ]


def _verdict(limited: Sequence[Quantity], labels: Sequence[str]) -> str:
    """Joints beyond limits: ``Beyond a limit: 2 of 5 joints: line 2 (cross1.F, psi), line 5 (psi).``."""
    beyond = np.array([quantity.beyond for quantity in limited])
    out = np.flatnonzero(beyond.any(axis=0))
    named = [
        ", ".join(quantity.name for quantity, is_out in zip(limited, beyond[:, k], strict=True) if is_out) for k in out
    ]
    each = [f"{labels[k]} ({names})" for k, names in zip(out[:SIDE_BY_SIDE], named, strict=False)]
    listed = f": {', '.join(each)}{' and others' * (len(out) > SIDE_BY_SIDE)}" if each else ""
    lacking = int(np.isnan([quantity.values for quantity in limited]).any(axis=0).sum())
    without = f"; {lacking} without a valid result" if lacking else ""
    return f"Beyond a limit: {len(out) or 'none'} of {len(labels)} joints{listed}{without}."
