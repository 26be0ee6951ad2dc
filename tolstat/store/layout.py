"""Layout of a result file (docs/result_format.md): its datasets, which follow from the metadata, and a new file."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from enum import IntEnum
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
from h5py import h5d, h5p
from numpy.typing import NDArray

from tolstat.common.channels import LoadHistory, components, followed, load_histories
from tolstat.common.columns import DESIGN_COLUMNS, LEDGER_COLUMNS, Column, drawn_columns, error_columns, kept_columns
from tolstat.common.fields import HistorySpec
from tolstat.common.load_kinds import CONTACTS, kinds
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import SCHEMA_VERSION, Mode, Status
from tolstat.store import metadata as documents
from tolstat.store.hdf5 import BLOCK, put, put_attributes, put_scale, store_error
from tolstat.store.metadata import Metadata

FILETYPE = "tolstat campaign"
COLUMN_OVERHEAD = 800
"""Approximate number of bytes that HDF5 needs per column beside its values."""
ABOUT = "Monte Carlo campaign: row i is joint i in every dataset, SI units throughout"
"""Description of the whole file."""
GROUPS = {
    "design": "which of the listed joints each row is",
    "origin": "how each joint of a subset simulation was drawn",
    "errors": "errors of each joint, those of the operating point among them, drawn before anything was simulated",
    "points": "results of the same joints at each operating point",
    "results": "status, diagnostics and loads of each joint; NaN where there are none",
    "ledger": "what gave the results of each joint",
    "histories": "loads of each joint over its last revolution, or what follows from them; NaN where there are none",
    "session": "the run under way",
    "what_if": "largest loads of joints with other tolerances, drawn with the seed of the campaign",
}
"""Description of each group; `what_if` comes later, the others are in a new file if it needs them."""
AT_POINTS = ("results", "ledger", "histories")
"""Groups that a file has once for each operating point."""
SESSION = {
    "number": ("i8", "1", "odd from the first write of a run until it has written the checksums of the results"),
    "started": ("f8", "seconds since 1970-01-01 00:00:00", "start of the run under way; NaN where none is"),
    "done": ("i8", "1", "joints that were done when it started"),
}
"""Type, unit and description of each dataset of the group ``session``."""
OF_POINT = {"share": "1", "alpha": "rad", "speed": "rad/s", "torque": "N*m", "axial_force": "N"}
"""Unit of each value of an operating point that is an attribute of its group."""
LINKED = ("row", "nominal")
"""Datasets of the file that every group with joints has as links: number of each row, mark of the nominal joint."""

Tables = Mapping[str, Iterable[NDArray[np.void]]]
"""Tables of a new file that are complete from the beginning, each in consecutive blocks of rows, by group."""
NAMES = {*GROUPS, *LINKED, "metadata", "checksums", "verify", "near"}
"""All names that a file may have at its top and at each operating point."""


class Stored(NamedTuple):
    """A dataset with a row for each joint: its path in the file, type and shape."""

    path: str
    dtype: np.dtype[Any]
    shape: tuple[int, ...]

    @property
    def row_bytes(self) -> int:
        """Bytes of a row."""
        return self.dtype.itemsize * math.prod(self.shape[1:])


def place_of(point: str) -> str:
    """Path of the group that holds `AT_POINTS` of an operating point: the root for the one without a name."""
    return f"points/{point}" if point else ""


def path_of(point: str, group: str, name: str) -> str:
    """Path of a dataset; `point` matters for the groups `AT_POINTS` only."""
    place = place_of(point) if group in AT_POINTS else ""
    return "/".join(part for part in (place, group, name) if part)


def is_at_point(path: str) -> bool:
    """Whether a dataset belongs to an operating point: to results, ledger or histories."""
    return path.split("/")[-2] in AT_POINTS


def columns(metadata: Metadata) -> dict[str, tuple[Column, ...]]:
    """Columns of each group that a file has, by group."""
    mechanism = metadata.simulated
    groups = {"errors": error_columns(mechanism)}
    if metadata.design.variants:
        groups["design"] = DESIGN_COLUMNS
    if drawn := drawn_columns(metadata.sampling):
        groups["origin"] = drawn
    return groups | {"results": kept_columns(metadata.identity, mechanism), "ledger": LEDGER_COLUMNS}


def datasets(metadata: Metadata) -> list[Stored]:
    """All datasets with a checksum: first those that are complete in a new file, then those of each operating point."""
    n, groups = metadata.n, columns(metadata)
    at_points = {group: groups.pop(group) for group in AT_POINTS if group in groups}
    stored = [Stored(path_of("", g, c.name), np.dtype(c.dtype), (n,)) for g, each in groups.items() for c in each]
    for point in metadata.points:
        for group, each in at_points.items():
            stored += [Stored(path_of(point, group, c.name), np.dtype(c.dtype), (n,)) for c in each]
        for name, spec in metadata.histories.items():
            stored.append(Stored(path_of(point, "histories", name), np.dtype(spec.dtype), (n, *spec.shape)))
    return stored


def check_names(file: h5py.File, metadata: Metadata) -> None:
    """Refuse a file with an unknown name: a damaged name of ``verify``, ``near`` or ``what_if`` would hide that group.

    Raises
    ------
    ValueError
        With the name.
    """
    for place in ("", *filter(None, metadata.points)):
        unknown = set(file[place_of(place) or "/"]) - NAMES
        if unknown:
            raise ValueError(f"{min(unknown)!r} is not the name of a group or dataset of this schema")


def describe(file: h5py.File, metadata: Metadata) -> None:
    """Write the metadata, and as attributes what is asked for without them, of the campaign and of each point."""
    documents.write(file, metadata)
    put_attributes(file, metadata.about)
    for point, values in metadata.points.items():
        holder = file.require_group(place_of(point) or "/")
        for name, unit in OF_POINT.items():
            if values.get(name) is not None:
                put_attributes(holder, {name: values[name], f"{name}_units": unit})
            else:
                holder.attrs.pop(name, None)
                holder.attrs.pop(f"{name}_units", None)


def size_of(metadata: Metadata, checked: int = 0) -> int:
    """Approximate size of a file, bytes, with `checked` joints at each point that are simulated again."""
    stored = datasets(metadata)
    values = sum(dataset.shape[0] * dataset.row_bytes for dataset in stored)
    values += 8 * checked * sum(is_at_point(dataset.path) for dataset in stored)
    return values + COLUMN_OVERHEAD * len(stored) + len(metadata.model_dump_json())


def create(file: h5py.File, metadata: Metadata, tables: Tables) -> None:
    """Fill an empty file, all rows pending; the checksums are not in it yet.

    Parameters
    ----------
    file : h5py.File
        The file.
    metadata : Metadata
        What it says of itself.
    tables : Tables
        ``errors``; ``design`` of a study that lists its joints; ``origin`` for methods with `columns.drawn_columns`.
    """
    n, first, codes, groups = metadata.n, metadata.first_row, meanings_of(metadata), columns(metadata)
    about: dict[str, str | int | float] = {"filetype": FILETYPE, "schema_version": SCHEMA_VERSION}
    put_attributes(file, about | {"mechanism": metadata.mechanism, "description": ABOUT})
    describe(file, metadata)
    row = file.create_dataset("row", (n,), "i8", dcpl=_allocated(None))
    for begin in range(0, n, BLOCK):
        row[begin : begin + BLOCK] = np.arange(first + begin, first + min(begin + BLOCK, n))
    row.make_scale("row")
    put_attributes(row, {"units": "1", "description": "row of the campaign: the joint's number"})
    marked = int(bool(metadata.sampling["nominal_first"]) and first == 0)
    nominal = file.create_dataset("nominal", data=np.arange(n) < marked, dtype="u1")
    nominal.dims[0].attach_scale(row)
    put_attributes(nominal, {"units": "1", "description": "1 for the nominal joint, which is no sample"})
    put_meanings(nominal, MEANINGS["nominal"])
    for group, blocks in tables.items():
        create_table(file, group, groups[group], n, blocks, codes)
    for point in metadata.points:
        holder = file.require_group(place_of(point) or "/")
        for group in ("results", "ledger"):
            create_table(holder, group, groups[group], n, codes=codes)
        if metadata.histories:  # at full size: a full disk is told before the first joint
            histories = _linked(holder, "histories")
            for name, spec in metadata.histories.items():
                dataset = _create(histories, name, (n, *spec.shape), spec, row, MEANINGS)
                attach_scales(dataset, spec, metadata.simulated)
    session = file.create_group("session")
    for name, (dtype, unit, description) in SESSION.items():
        blank = np.nan if dtype == "f8" else int(name == "number")
        dataset = session.create_dataset(name, data=np.array(blank, dtype))  # written now, so that its place is fixed
        put_attributes(dataset, {"units": unit, "description": description})
    for group in (file, *(file[place_of(point) or "/"] for point in metadata.points)):
        for name in GROUPS.keys() & group.keys():
            put_attributes(group[name], {"description": GROUPS[name]})


def create_table(
    holder: h5py.Group,
    name: str,
    columns: tuple[Column, ...],
    n: int,
    blocks: Iterable[NDArray[np.void]] | None = None,
    codes: Mapping[str, Mapping[int, str]] | None = None,
) -> None:
    """Create a table: one contiguous dataset per column, which can be overwritten in place.

    Parameters
    ----------
    holder : h5py.Group
        Group that the table is made in, of a file with ``row`` and ``nominal``.
    name : str
        Group of the datasets.
    columns : tuple of Column
        Columns of the table.
    n : int
        Number of rows.
    blocks : iterable of structured array, optional
        Values, in consecutive blocks of rows; without them floats are NaN and integers 0.
    codes : mapping, optional
        Meanings of the columns that hold codes, by name; `MEANINGS` without it.
    """
    group = _linked(holder, name)
    for c in columns:
        _create(group, c.name, (n,), c, holder.file["row"], codes or MEANINGS, blocks is None)
    first = 0
    for block in blocks or ():
        put(group, np.arange(first, first + len(block)), {c.name: c.of(block) for c in columns})
        first += len(block)
    if blocks is not None and first != n:
        raise ValueError(f"{first} rows of {name} given, {n} expected")


def _linked(holder: h5py.Group, name: str) -> h5py.Group:
    """Create a group with links to `LINKED` datasets of the file."""
    group = holder.create_group(name)
    for link in LINKED:
        group[link] = holder.file[link]
    return group


def _create(
    group: h5py.Group,
    name: str,
    shape: tuple[int, ...],
    about: Column | HistorySpec,
    row: h5py.Dataset,
    codes: Mapping[str, Mapping[int, str]],
    blank: bool = True,
) -> h5py.Dataset:
    """Create a dataset with a row for each joint; see `_allocated` for its values."""
    dataset = group.create_dataset(name, shape, about.dtype, dcpl=_allocated(about.dtype, blank))
    dataset.dims[0].attach_scale(row)
    put_attributes(dataset, {"units": about.unit, "description": about.description})
    if name in codes:
        put_meanings(dataset, codes[name])
    return dataset


def _allocated(dtype: str | None, blank: bool = False) -> h5p.PropDCID:
    """Creation properties of a dataset that takes its space at once; with `blank`, floats are NaN and integers 0."""
    properties = h5p.create(h5p.DATASET_CREATE)
    properties.set_obj_track_times(False)  # as h5py has it: the same file has the same bytes
    properties.set_alloc_time(h5d.ALLOC_TIME_EARLY)
    properties.set_fill_time(h5d.FILL_TIME_ALLOC if blank else h5d.FILL_TIME_NEVER)
    if blank:
        properties.set_fill_value(np.array(np.nan if np.dtype(dtype).kind == "f" else 0, dtype))
    return properties


def axes_of(mechanism: Mechanism) -> dict[str, tuple[tuple[str, ...], str]]:
    """Names along an axis of a history, and what they name, by axis."""
    bushings, shafts = load_histories(mechanism).values()
    measuring = tuple(kind.key for kind in followed(mechanism) if not kind.measure)
    return {
        "bushing": (bushings.places, "bushing"),
        "component": (bushings.components, "force F (N) and torque T (N m) along e, t and z"),
        "pin": (kinds(mechanism)["contact"].places, "pin"),
        "contact_force": (CONTACTS, "contact force of the outermost station, of the innermost one, resultant of all"),
        "shaft": (shafts.places, "shaft"),
        "shaft_component": (shafts.components, "force f (N) and moment m (N m) about O, in axes that do not turn"),
        "load": (measuring, "force and torque"),
        "channel": (_names(bushings, mechanism), "load whose cycles are counted: a component"),
        "shaft_channel": (_names(shafts, mechanism), "load of a shaft whose cycles are counted: a component"),
        "of_cycle": (("range", "mean"), "range and mean of a cycle"),
    }


def _names(history: LoadHistory, mechanism: Mechanism) -> tuple[str, ...]:
    return tuple(signal.name for signal in components(mechanism).values() if signal.history == history)


def attach_scales(dataset: h5py.Dataset, spec: HistorySpec, mechanism: Mechanism) -> None:
    """Attach dimension scales to a history: those named in `spec` to all axes but the first."""
    name = dataset.name.rpartition("/")[2]
    axes = spec.axes or tuple(f"{name}_axis{k}" for k in range(1, dataset.ndim))
    for k, (axis, size) in enumerate(zip(axes, spec.shape, strict=True), 1):
        if axis not in dataset.parent:
            put_scale(dataset.parent, axis, *scale_of(axis, size, mechanism))
        dataset.dims[k].attach_scale(dataset.parent[axis])


def scale_of(axis: str, size: int, mechanism: Mechanism) -> tuple[NDArray[Any], str, str]:
    """Values along an axis of a history, their unit and their description."""
    names, meaning = axes_of(mechanism).get(axis, ((), ""))
    if len(names) == size:
        return np.array(names, dtype=object), "1", meaning
    if axis == "theta":
        return 2.0 * np.pi * np.arange(size) / size, "rad", "input angle"
    if axis == "harmonic":
        return np.arange(size, dtype="i4"), "1", "multiple of the input speed"
    return np.arange(size, dtype="i4"), "1", "index along this axis, from 0"


def _labels(codes: type[IntEnum]) -> dict[int, str]:
    return {code.value: code.name.lower() for code in codes}


MAX_MEANINGS = 1000
"""Largest number of meanings that a column carries: attributes of HDF5 are small."""
MEANINGS: dict[str, Mapping[int, str]] = {
    "status": _labels(Status),
    "settled": {0: "not_settled", 1: "settled"},
    "nominal": {0: "joint_with_errors", 1: "nominal_joint"},
    "mode": _labels(Mode),
}
"""Meanings of codes that are the same in every file, by column or history; CF has them as ``flag_meanings``."""


def meanings_of(metadata: Metadata) -> dict[str, Mapping[int, str]]:
    """Meanings of all columns of a file that hold codes."""
    families = [variant.family for variant in metadata.design.variants]
    shared = {family for family, number in Counter(families).items() if number > 1}
    return MEANINGS | {
        "case": dict(enumerate(metadata.design.cases)),
        "variant": {k: f"{name}_{k}" if name in shared else name for k, name in enumerate(families)},
    }


def put_meanings(dataset: h5py.Dataset, meanings: Mapping[int, str]) -> None:
    """Write the meanings of a column's codes to its attributes; blanks inside a meaning become underscores."""
    if len(meanings) <= MAX_MEANINGS:
        dataset.attrs["flag_values"] = np.array([*meanings], dataset.dtype)
        words = (re.sub(r"[^\w.+@-]+", "_", meaning) or "_" for meaning in meanings.values())
        put_attributes(dataset, {"flag_meanings": " ".join(words)})


def check_schema(path: Path, file: h5py.File) -> None:
    """Refuse another kind of file, or another version of it, in one sentence.

    Raises
    ------
    StoreError
        With what it is.
    """
    filetype = file.attrs.get("filetype")
    filetype = filetype.decode(errors="replace") if isinstance(filetype, bytes) else filetype
    if filetype != FILETYPE:
        found = f"is HDF5, but of type {filetype!r} instead of {FILETYPE!r}"
        raise store_error(path, found, "give a result file made by tolstat run")
    version = int(file.attrs["schema_version"])
    if version != SCHEMA_VERSION:
        newer = version > SCHEMA_VERSION
        remedy = "use a newer tolstat" if newer else "run its study again: tolstat run STUDY --out OTHER.h5"
        raise store_error(path, f"has schema version {version}, this tolstat reads {SCHEMA_VERSION}", remedy)
