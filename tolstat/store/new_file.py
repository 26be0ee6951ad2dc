"""Layout of a new result file (docs/result_format.md): attributes, tables with their meanings, all rows pending."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
from h5py import h5d, h5ds, h5p, h5s, h5t
from numpy.typing import NDArray

from tolstat.common import draw_records, selected_results
from tolstat.common.columns import DESIGN_COLUMNS, ERROR_COLUMNS, LEDGER_COLUMNS, Column
from tolstat.common.solver_options import to_names
from tolstat.common.tables import SCHEMA_VERSION, HistorySpec, Options
from tolstat.store import meanings
from tolstat.store.integrity import attempt_hash, errors_hash
from tolstat.store.meanings import Meanings
from tolstat.store.provenance import git_commit, versions
from tolstat.store.result_file import (
    BLOCK,
    FILETYPE,
    check_column,
    descriptions,
    link_rows,
    place_of,
    put,
    put_attributes,
    put_text,
    text,
)

if TYPE_CHECKING:
    from tolstat.study import Study

COLUMN_OVERHEAD = 800
"""Bytes that HDF5 needs per column beside its values."""
ABOUT = "Monte Carlo campaign of Cardan joints: row i is joint i in every dataset, SI units throughout"
"""Description of the whole file."""
GROUPS = {
    "design": "which of the listed joints each row is",
    "origin": "how each joint was drawn, where not from the tolerances alone",
    "errors": "errors of each joint, those of the operating point among them, drawn before anything was simulated",
    "points": "results of the same joints at each operating point",
    "results": "status, diagnostics and loads of each joint; NaN where there are none",
    "ledger": "what gave the results of each joint, and checksums of its rows",
    "session": "the run under way",
    "what_if": "largest loads of joints with other tolerances, drawn with the seed of the campaign",
}
"""Description of each group; `what_if` comes later, the others are in a new file if it needs them."""
SESSION = {
    "started": ("f8", "seconds since 1970-01-01 00:00:00", "start of the run under way; NaN where none is"),
    "done": ("i8", "1", "joints that were done when it started"),
}
"""Type, unit and description of each dataset of the group ``session``."""


def study_attributes(study: Study) -> dict[str, str]:
    """Return the attributes of a study that do not affect results and may change between runs of a campaign."""
    points = {point.name: point.values() for point in study.points}
    structured = {"limits": study.limits, "points": points, "joint": study.joint.given("json")}
    texts = {name: json.dumps(value, allow_nan=False) for name, value in structured.items()}
    return {"study": study.text, "study_name": study.name} | texts


def attributes(
    study: Study,
    specs: Mapping[str, HistorySpec],
    dimensions: Mapping[str, int],
    options: Options | None = None,
    fidelity: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Return the attributes of a new file: all that a reader needs beyond the tables.

    Parameters
    ----------
    study : Study
        The study.
    specs : mapping of str to HistorySpec
        Histories that the campaign keeps.
    dimensions : mapping of str to int
        Dimension of the sampling sequence that each error is drawn from.
    options, fidelity : Options and mapping, optional
        Settings that ``solver.fidelity = "auto"`` chose, and the record of that choice.
    """
    sampling = study.sampling.model_dump(mode="json")
    structured = {
        "identity": study.identity(),
        "options": to_names(options or study.solver.options()),
        "fidelity": dict(fidelity or {}),
        "design": {"cases": study.case_names, "variants": [variant._asdict() for variant in study.variants]},
        "sampling": sampling | {"dimensions": dict(dimensions)},
        "versions": versions(),
        "histories": specs,
        "retries": [],
    }
    plain = {
        "filetype": FILETYPE,
        "description": ABOUT,
        "schema_version": SCHEMA_VERSION,
        "campaign_rows": study.rows,
        "git_commit": git_commit(),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    plain |= study_attributes(study)
    return plain | {name: json.dumps(value, allow_nan=False) for name, value in structured.items()}


def size_of_new(n: int, results: tuple[Column, ...], points: int) -> int:
    """Approximate upper bound on the size of a new file of `n` rows, bytes, without long attributes."""
    groups = (DESIGN_COLUMNS, ERROR_COLUMNS, *(results, LEDGER_COLUMNS) * points)
    columns = [np.dtype(c.dtype).itemsize for group in groups for c in group]
    return n * sum(columns) + COLUMN_OVERHEAD * len(columns)


def fill(
    file: h5py.File,
    attrs: Mapping[str, str | int | float],
    rows: range,
    errors: Iterable[NDArray[np.void]],
    design: NDArray[np.void] | None,
    origin: Iterable[NDArray[np.void]] | None = None,
) -> None:
    """Fill an empty file with everything but histories, all rows pending; who calls seals it (`integrity`).

    Parameters
    ----------
    file : h5py.File
        The file.
    attrs : mapping
        See `attributes`.
    rows : range
        Rows of the campaign that the file holds.
    errors : iterable of table ERROR
        Errors of these rows, in consecutive blocks.
    design : (len(rows),) table DESIGN, optional
        Variant, case and group of each row, for a study that lists its joints.
    origin : iterable of tables, optional
        How each row was drawn, in consecutive blocks, for methods that have `draw_records.columns`.
    """
    n = len(rows)
    put_attributes(file, dict(attrs) | {"first_row": rows.start})
    scale = file.create_dataset("row", (n,), "i8", dcpl=_allocated(None))
    for first in range(0, n, BLOCK):
        last = min(first + BLOCK, n)
        scale[first:last] = np.arange(rows.start + first, rows.start + last)
    scale.make_scale("row")
    put_attributes(scale, {"units": "1", "description": "row of the campaign: the joint's number"})
    sampling, codes = json.loads(str(attrs["sampling"])), meanings.of_file(attrs)
    _mark_nominal(file, bool(sampling["nominal_first"]) and rows.start == 0)
    if design is not None:
        create_table(file, "design", DESIGN_COLUMNS, n, [design], codes)
    drawn = draw_records.columns(sampling)
    if bool(drawn) != (origin is not None):
        raise ValueError("how the joints were drawn must be given for the methods that have columns for it, only")
    if drawn:
        create_table(file, "origin", drawn, n, origin, codes)
    columns = selected_results.columns(json.loads(str(attrs["identity"])))
    at_points = [file.require_group(place_of(point)) for point in json.loads(str(attrs["points"]))]
    for group in at_points:
        create_table(group, "results", columns, n, codes=codes)
        create_table(group, "ledger", (*LEDGER_COLUMNS, *history_check_columns(attrs)), n)
    _create_session(file)
    create_table(file, "errors", ERROR_COLUMNS, n, _checked(file, rows, errors))
    for group in dict.fromkeys((file, *at_points)):
        for name in GROUPS.keys() & group.keys():
            put_attributes(group[name], {"description": GROUPS[name]})


def _mark_nominal(file: h5py.File, first: bool) -> None:
    """Create the column that marks the nominal joint, the `first` row or none."""
    marks = file.create_dataset("nominal", data=np.arange(len(file["row"])) < int(first), dtype="u1")
    marks.dims[0].attach_scale(file["row"])
    put_attributes(marks, {"units": "1", "description": "1 for the nominal joint, which is no sample"})
    meanings.put(marks, meanings.FIXED["nominal"])


def _create_session(file: h5py.File) -> None:
    group = file.create_group("session")
    for name, (dtype, unit, description) in SESSION.items():
        blank = np.nan if dtype == "f8" else 0
        dataset = group.create_dataset(name, data=np.array(blank, dtype))  # written now, so that its place is fixed
        put_attributes(dataset, {"units": unit, "description": description})


def history_check_columns(attrs: Mapping[str, Any]) -> tuple[Column, ...]:
    """Columns of the ledger with the checksums of the kept histories."""
    return tuple(check_column(name) for name in json.loads(attrs["histories"]))


def _checked(file: h5py.File, rows: range, errors: Iterable[NDArray[np.void]]) -> Iterator[NDArray[np.void]]:
    """Yield the blocks of `errors` unchanged, after writing their checksums."""
    first = 0
    for block in errors:
        here = slice(first, first + len(block))
        described = []
        for group, (columns, dtype) in descriptions(file).items():
            table = np.empty(len(block), dtype)
            for c in columns:
                c.of(table)[:] = file[group][c.name][here]
            described.append((columns, table))
        checks = errors_hash(rows.start + first, block, described)
        attempts = attempt_hash(checks, np.zeros(len(block), np.int32))
        for point in json.loads(text(file.attrs, "points")):
            ledger = file[place_of(point)]["ledger"]
            ledger["errors_check"][here], ledger["attempt_check"][here] = checks, attempts
        yield block
        first = here.stop


def create_table(
    file: h5py.Group,
    name: str,
    columns: tuple[Column, ...],
    n: int,
    blocks: Iterable[NDArray[np.void]] | None = None,
    codes: Mapping[str, Meanings] = meanings.FIXED,
    scale: h5py.Dataset | None = None,
) -> None:
    """Create a table: one contiguous dataset per column, which can be overwritten in place.

    Parameters
    ----------
    file : h5py.Group
        Group that the table is made in, of a file with ``row`` and ``nominal``.
    name : str
        Group of the datasets.
    columns : tuple of Column
        Columns of the table.
    n : int
        Number of rows.
    blocks : iterable of structured array, optional
        Values, in consecutive blocks of rows; without them floats are NaN and integers 0.
    codes : mapping of str to Meanings, optional
        Meanings of the columns that hold codes, by name.
    scale : h5py.Dataset, optional
        Dimension scale of the rows; ``row`` of the file without it, which the group then has with ``nominal``.
    """
    group, row = file.create_group(name), scale or file.file["row"]
    if scale is None:
        link_rows(file, group)
    else:
        group[scale.name.rpartition("/")[2]] = scale
    extent = h5s.create_simple((n,))
    kinds = {dtype: _kind(dtype, blank=blocks is None) for dtype in {c.dtype for c in columns}}
    for c in columns:
        held = h5d.create(group.id, c.name.encode(), kinds[c.dtype][0], extent, kinds[c.dtype][1])
        h5ds.attach_scale(held, row.id, 0)
        put_text(held, "units", c.unit)
        put_text(held, "description", c.description)
        if c.name in codes:
            meanings.put(h5py.Dataset(held), codes[c.name])
    first = 0
    for block in blocks or ():
        put(group, np.arange(first, first + len(block)), {c.name: c.of(block) for c in columns})
        first += len(block)
    if blocks is not None and first != n:
        raise ValueError(f"{first} rows of {name} given, {n} expected")


def _kind(dtype: str, blank: bool) -> tuple[h5t.TypeID, h5p.PropDCID]:
    """HDF5 type and creation properties of a column; with `blank`, floats are NaN and integers 0 when it is created."""
    missing = np.nan if np.dtype(dtype).kind == "f" else 0
    return h5t.py_create(np.dtype(dtype), logical=True), _allocated(dtype, missing if blank else None)


def _allocated(dtype: str | None, fill: float | None = None) -> h5p.PropDCID:
    """Creation properties of a dataset that is allocated, and filled with `fill` if given, when it is created."""
    properties = h5p.create(h5p.DATASET_CREATE)
    properties.set_obj_track_times(False)  # as h5py has it: the same file has the same bytes
    properties.set_alloc_time(h5d.ALLOC_TIME_EARLY)
    properties.set_fill_time(h5d.FILL_TIME_NEVER if fill is None else h5d.FILL_TIME_ALLOC)
    if fill is not None:
        properties.set_fill_value(np.array(fill, dtype))
    return properties
