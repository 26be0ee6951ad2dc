"""Axes of load histories: the names or values along each, which the result file holds as dimension scales."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.common.channels import BUSHING_LOADS, MEASURING, SHAFT_LOADS, LoadHistory, channels_of
from tolstat.common.load_kinds import BUSHINGS, CONTACTS, PINS, SHAFTS
from tolstat.common.tables import HistorySpec
from tolstat.store.result_file import put_attributes


def _names(history: LoadHistory) -> tuple[str, ...]:
    return tuple(channel.name for channel in channels_of(history))


NAMES: dict[str, tuple[tuple[str, ...], str]] = {
    "bushing": (BUSHINGS, "bushing"),
    "component": (BUSHING_LOADS.components, "force F (N) and torque T (N m) along e, t and z"),
    "pin": (PINS, "pin"),
    "contact_force": (CONTACTS, "contact force of the outermost station, of the innermost one, resultant of all"),
    "shaft": (SHAFTS, "shaft"),
    "shaft_component": (SHAFT_LOADS.components, "force f (N) and moment m (N m) about O, in axes that do not turn"),
    "load": (tuple(kind.key for kind in MEASURING), "force and torque"),
    "channel": (_names(BUSHING_LOADS), "load whose cycles are counted: component or modulus"),
    "shaft_channel": (_names(SHAFT_LOADS), "load of a shaft whose cycles are counted: component or modulus"),
    "of_cycle": (("range", "mean"), "range and mean of a cycle"),
}
"""Names along an axis, and what they name, by axis."""


def attach_scales(dataset: h5py.Dataset, row: h5py.Dataset, spec: HistorySpec) -> None:
    """Attach dimension scales to a history: `row` to the first axis, those named in `spec` to the others."""
    dataset.dims[0].attach_scale(row)
    name = dataset.name.rpartition("/")[2]
    given = spec.axes or tuple(f"{name}_axis{k}" for k in range(1, dataset.ndim))
    for k, (axis, size) in enumerate(zip(given, spec.shape, strict=True), 1):
        if axis not in dataset.parent:
            values, unit, description = scale_of(axis, size)
            text = h5py.string_dtype() if values.dtype.kind == "O" else None
            scale = dataset.parent.create_dataset(axis, data=values, dtype=text)
            scale.make_scale(axis)
            put_attributes(scale, {"units": unit, "description": description})
        dataset.dims[k].attach_scale(dataset.parent[axis])


def scale_of(axis: str, size: int) -> tuple[NDArray[Any], str, str]:
    """Values along an axis, their unit and their description."""
    if axis in NAMES and len(NAMES[axis][0]) == size:
        return np.array(NAMES[axis][0], dtype=object), "1", NAMES[axis][1]
    if axis == "theta":
        return 2.0 * np.pi * np.arange(size) / size, "rad", "input angle"
    if axis == "harmonic":
        return np.arange(size, dtype="i4"), "1", "multiple of the input speed"
    return np.arange(size, dtype="i4"), "1", "index along this axis, from 0"
