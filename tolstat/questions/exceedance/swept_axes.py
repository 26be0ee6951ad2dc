"""Quantities that a sweep varies, with display units."""

from __future__ import annotations

from collections.abc import Mapping
from fnmatch import fnmatchcase
from typing import Any, NamedTuple

import numpy as np

from tolstat.common.loads import FloatArray
from tolstat.common.strict import read_section
from tolstat.common.tables import ERROR_FIELDS
from tolstat.common.units import DISPLAY_UNITS
from tolstat.store import recorded
from tolstat.store.view import View
from tolstat.study.selection import UNITS
from tolstat.study.swept import KEYS


class Axis(NamedTuple):
    """One independently swept quantity.

    Attributes
    ----------
    label : str
        The study's pattern, such as ``pin*.diameter``, or the error's name.
    unit : str
        Display unit, such as ``mm``.
    values : ndarray, shape (n,)
        Value at each joint, in `unit`.
    """

    label: str
    unit: str
    values: FloatArray


def swept_axes(view: View) -> list[Axis]:
    """Quantities that a sweep varies, in the study's order.

    Errors and dimensions with equal values in every joint are swept together and form one axis.

    Parameters
    ----------
    view : View
        A campaign with the sampling method ``sweep``.

    Returns
    -------
    list of Axis
        Empty when nothing varies.
    """
    patterns = _patterns(read_section(view.store.path, view.store.study_text, "sweep"))
    errors = view.errors(np.arange(view.n))
    columns = {(field.name, field.unit): errors[field.name] for field in ERROR_FIELDS}
    if len(view.parts) == 1:  # of several operating points none is swept
        own = recorded.operating_points(view.store, slice(view.store.first_sample, None))
        columns |= {(f"operation.{key}", UNITS[f"operation.{key}"]): values for key, values in own.items()}
    if view.store.variants:
        columns |= {(key, KEYS[key]): of[view.store.first_sample :] for key, of in recorded.swept(view.store).items()}
    groups: dict[bytes, list[tuple[str, str]]] = {}
    for key, column in columns.items():
        if column.size and np.ptp(column) > 0:
            groups.setdefault(column.tobytes(), []).append(key)
    axes = []
    for keys in groups.values():
        names = [name for name, _ in keys]
        unit, factor = DISPLAY_UNITS.get(keys[0][1], (keys[0][1], 1.0))
        values = columns[keys[0]] * factor
        values[np.abs(values) < 1e-12 * np.abs(values).max()] = 0.0  # rounding error of a sweep through zero
        axes.append(Axis(_label(names, patterns), unit, values))
    rank = {pattern: i for i, pattern in enumerate(patterns)}
    return sorted(axes, key=lambda axis: rank.get(axis.label, len(rank)))


def _patterns(table: Mapping[str, Any], before: str = "") -> list[str]:
    """Key paths of the entries of ``[sweep]``, whether quoted or dotted."""
    found = []
    for key, value in table.items():
        nested = isinstance(value, Mapping) and "from" not in value
        found += _patterns(value, f"{before}{key}.") if nested else [f"{before}{key}"]
    return found


def _label(names: list[str], patterns: list[str]) -> str:
    for pattern in patterns:
        if all(fnmatchcase(name, pattern) for name in names):
            return pattern
    return names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"
