"""Validation of a result file before its contents are used: damaged and hostile files are rejected here.

Its layout comes first (`layout`), then the checksum of its attributes, their contents (`metadata`), and its tables.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from h5py import h5t

from tolstat.common.columns import ERROR_COLUMNS, LEDGER_COLUMNS, Column
from tolstat.common.loads import split
from tolstat.common.tables import SCHEMA_VERSION, HistorySpec
from tolstat.joint import Operation, affecting_results
from tolstat.store import integrity, layout, metadata
from tolstat.store.layout import Stored
from tolstat.store.result_file import FILETYPE, check_column, descriptions, place_of, store_error, text
from tolstat.study.design import flat
from tolstat.study.points import Point

DAMAGE_ERRORS = (KeyError, ValueError, TypeError, AttributeError, IndexError, RecursionError, RuntimeError, OSError)
"""Exceptions that reading a damaged file raises, in h5py or in code that relies on the file's attributes."""
ONE_EACH = ("random", "sobol", "lhs", "importance", "subset")
"""Sampling methods whose number of joints is ``sampling.n``."""
MAX_SAMPLES = 50_000_000
"""Largest number of values in a history of one joint: more than the finest solution of all loads has."""


def check_schema(path: Path, file: h5py.File) -> Mapping[str, Stored]:
    """Check that an HDF5 file is a result file that this version can read; return its datasets by path.

    Raises
    ------
    StoreError
        When it is another kind of file, or has another schema version.
    ValueError
        When its attributes do not match their checksum.
    """
    filetype = text(file.attrs, "filetype") if "filetype" in file.attrs else None
    if filetype != FILETYPE:
        found = f"is HDF5, but of type {filetype!r} instead of {FILETYPE!r}"
        raise store_error(path, found, "give a result file made by tolstat run")
    version = integer(file, "schema_version")
    if version != SCHEMA_VERSION:
        remedy = (
            "use a newer tolstat"
            if version > SCHEMA_VERSION
            else "run its study again: tolstat run STUDY --out OTHER.h5"
        )
        raise store_error(path, f"has schema version {version}, this tolstat reads {SCHEMA_VERSION}", remedy)
    laid_out = layout.check(file)
    if not integrity.is_sealed(file, laid_out.values):
        raise ValueError("its attributes do not match their checksum")
    return laid_out.datasets


def integer(file: h5py.File, name: str, default: int | None = None) -> int:
    """Read an attribute that must be a non-negative integer.

    Raises
    ------
    KeyError
        When it is missing and there is no default.
    ValueError
        When it has any other value.
    """
    if default is not None and name not in file.attrs:
        return default
    value = file.attrs[name]
    if not isinstance(value, (int, np.integer)) or value < 0:
        raise ValueError(f"attribute {name} is {value!r}, not a whole number of at least 0")
    return int(value)


def history_specs(file: h5py.File) -> dict[str, HistorySpec]:
    """Read the attribute ``histories``.

    Raises
    ------
    KeyError, ValueError, TypeError
        When it does not describe histories that a campaign can keep.
    """
    specs = {}
    for name, (shape, dtype, unit, description, *axes) in metadata.read(file, "histories").items():
        spec = HistorySpec(tuple(shape), dtype, unit, description, *(tuple(names) for names in axes))
        if not name.isidentifier():  # a dataset of this name lies in the group of the histories
            raise ValueError(f"histories has the name {name!r}")
        if not all(isinstance(size, int) and size > 0 for size in spec.shape) or math.prod(spec.shape) > MAX_SAMPLES:
            raise ValueError(f"history {name} has the shape {shape}")
        if spec.dtype not in ("f4", "f8", "u1", "u2"):
            raise ValueError(f"history {name} has the type {spec.dtype}")
        specs[name] = spec
    return specs


def points(file: h5py.File) -> dict[str, Point]:
    """Read the attribute ``points``: the operating points by name.

    Raises
    ------
    KeyError, ValueError, TypeError
        When it does not describe operating points, or others than the campaign has.
    """
    found = {}
    for name, values in metadata.read(file, "points").items():
        share = values.pop("share")
        _check_identity(file, f"operation.{name}." if name else "operation.", values)
        own = {key: float(value) for key, value in values.items()}
        found[name] = Point(name, Operation.model_construct(None, **own), math.nan if share is None else float(share))
    return found


def joint(file: h5py.File) -> dict[str, Any]:
    """Read the attribute ``joint``: the nominal joint, as a study gives it.

    Raises
    ------
    KeyError, ValueError, TypeError
        When it is not the joint of the campaign.
    """
    held: dict[str, Any] = metadata.read(file, "joint")
    _check_identity(file, "joint.", affecting_results(held))
    return held


def _check_identity(file: h5py.File, place: str, held: Mapping[str, Any]) -> None:
    """Check that the settings of an attribute are those of the campaign below the key `place`."""
    identity = metadata.read(file, "identity")
    for key, value in flat(held, place):
        if identity[key] != value:
            raise ValueError(f"{key} is {identity[key]} in the attribute identity and {value} beside it")


def limits(file: h5py.File, points: Mapping[str, Point]) -> dict[str, float]:
    """Read the attribute ``limits``: the limit of each load, SI.

    Raises
    ------
    KeyError, ValueError
        When it does not describe limits of loads at the operating points of the file.
    """
    held: dict[str, float] = metadata.read(file, "limits")
    for selection in filter(None, (split(name)[1] for name in held)):
        if not {name.strip() for name in selection.split("+")} <= points.keys():
            raise ValueError("attribute limits names an operating point that the file does not have")
    return held


def check_number(sampling: Mapping[str, Any], rows: int) -> None:
    """Check that a sampling method whose number of joints is ``sampling.n`` has them in a campaign of `rows`.

    Raises
    ------
    ValueError
        When it has not.
    """
    if sampling["method"] in ONE_EACH and sampling["n"] + sampling["nominal_first"] != rows:
        raise ValueError(f"sampling.n is {sampling['n']} in a campaign of {rows} rows")


def check_tables(
    file: h5py.File, held: Mapping[str, Stored], results: tuple[Column, ...], specs: Mapping[str, HistorySpec]
) -> int:
    """Check that every kept column is present with the type and length that its table defines.

    Parameters
    ----------
    file : h5py.File
        The file.
    held : mapping of str to Stored
        Its datasets by path.
    results : tuple of Column
        Columns of the results that the campaign keeps.
    specs : mapping of str to HistorySpec
        Histories that the campaign keeps, if the file includes them.

    Returns
    -------
    int
        Number of rows.

    Raises
    ------
    KeyError, ValueError
        With the dataset that is missing or wrong.
    """
    places = [place_of(point).rstrip("/") for point in points(file)]
    path = f"{places[0]}/results/status"
    shape = _dataset(held, path).shape
    n = shape[0] if len(shape) == 1 else 0
    if n < 1:
        raise ValueError(f"{path} has the shape {shape}")
    groups = {
        "/errors": ERROR_COLUMNS,
        **{f"{place}/results": results for place in places},
        **{f"{place}/ledger": (*LEDGER_COLUMNS, *map(check_column, specs)) for place in places},
        **{f"/{name}": columns for name, (columns, _) in descriptions(file).items()},
    }
    for group, columns in groups.items():
        for c in columns:
            _check(held, f"{group}/{c.name}", (n,), c.dtype)
    for place, (name, spec) in product(places, specs.items()):
        if f"{place}/histories" in file:
            _check(held, f"{place}/histories/{name}", (n, *spec.shape), spec.dtype)
    return n


def _dataset(held: Mapping[str, Stored], path: str) -> Stored:
    if path not in held:
        raise ValueError(f"{path} is missing, or not a dataset")
    return held[path]


def _check(held: Mapping[str, Stored], path: str, shape: tuple[int, ...], dtype: str) -> None:
    found = _dataset(held, path)
    if found.shape != shape or not found.type.equal(_stored_type(dtype)):
        raise ValueError(f"{path} is {found}, not {shape} of {np.dtype(dtype)}")


@cache
def _stored_type(dtype: str) -> h5t.TypeID:
    return h5t.py_create(np.dtype(dtype))
