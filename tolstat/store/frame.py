"""Export of a campaign to a pandas DataFrame or an xarray Dataset."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tolstat.common import draw_records
from tolstat.common.columns import ERROR_COLUMNS, Column
from tolstat.common.errors import Fault, InputError
from tolstat.store import recorded
from tolstat.store.meanings import LABELS

if TYPE_CHECKING:
    import pandas as pd
    import xarray

    from tolstat.store.reader import Reader

AT_ONCE = 8192
"""Maximum number of rows of a block of `in_blocks`."""
OPERATING = {
    "operation.alpha": "misalignment of the shafts",
    "operation.speed": "angular velocity of the input shaft",
    "operation.torque": "resisting torque on the output shaft",
    "operation.axial_force": "axial force on the output shaft",
}
"""Meaning of the columns that an export holds as the joint's own values instead of deviations."""


def described(store: Reader) -> dict[str, Column]:
    """Columns with unit and description that an export has, by name; see `to_pandas` for the others."""
    own = [c._replace(description=OPERATING.get(c.name, c.description)) for c in ERROR_COLUMNS]
    return {c.name: c for c in (*draw_records.columns(store.sampling), *own, *store.columns)}


def to_pandas(store: Reader, nominal: bool) -> pd.DataFrame:
    """Export a campaign to one DataFrame, see `Reader.to_pandas`."""
    first = 0 if nominal else store.first_sample
    return _frame(store, slice(first, store.n), nominal, _listed(store))


def in_blocks(store: Reader, nominal: bool) -> Iterator[pd.DataFrame]:
    """Yield the rows of `to_pandas` in blocks of at most `AT_ONCE`, one at least."""
    first, listed = 0 if nominal else store.first_sample, _listed(store)
    for begin in range(first, max(store.n, first + 1), AT_ONCE):
        yield _frame(store, slice(begin, min(begin + AT_ONCE, store.n)), nominal, listed)


def _frame(store: Reader, rows: slice, nominal: bool, listed: Mapping[str, NDArray[Any]]) -> pd.DataFrame:
    """Rows of a campaign; `listed` as from `_listed`."""
    import pandas as pd

    errors, results = store.errors(rows), store.results(rows)
    data: dict[str, NDArray[Any]] = {}
    if nominal:
        data["nominal"] = np.arange(rows.start, rows.stop) < store.first_sample
    data |= {name: values[rows] for name, values in listed.items()}
    drawn = draw_records.columns(store.sampling)
    if drawn:
        origin = store.origin(rows)
        data |= {c.name: c.of(origin) for c in drawn}
    data |= {c.name: c.of(errors) for c in ERROR_COLUMNS}
    data |= {f"operation.{name}": values for name, values in recorded.operating_points(store, rows).items()}
    data |= {c.name: c.of(results) for c in store.columns}
    if store.retries:
        data["attempt"] = store.attempt(rows)
    data |= {name: labels[data[name]] for name, labels in LABELS.items()}
    frame = pd.DataFrame(data, index=pd.RangeIndex(store.rows[rows], name="row"))
    columns = described(store)
    frame.attrs["units"] = {name: columns[name].unit if name in columns else "1" for name in data}
    return frame


def to_xarray(store: Reader, nominal: bool) -> xarray.Dataset:
    """Export a campaign to one Dataset, see `Reader.to_xarray`."""
    try:
        import xarray
    except ImportError as error:
        fault = Fault(
            str(store.path), "xarray is not installed", "install it with: pip install xarray, or use to_pandas()"
        )
        raise InputError([fault]) from error
    frame, columns = to_pandas(store, nominal), described(store)
    attrs = {name: {"units": c.unit, "description": c.description} for name, c in columns.items()}
    data = {name: ("row", frame[name].to_numpy(), attrs.get(str(name), {})) for name in frame}
    return xarray.Dataset(data, coords={"row": frame.index.to_numpy()}, attrs={"study": store.study_name})


def _listed(store: Reader) -> dict[str, NDArray[Any]]:
    """Columns of joints that the study lists: case and family by name, variant and group by index; or of a sweep."""
    if not store.case_names:
        return recorded.swept(store) if store.variants else {}
    design = store.design()
    families = np.array([variant.family for variant in store.variants], dtype=object)
    return {
        "case": np.array(store.case_names, dtype=object)[design["case"]],
        "variant": design["variant"],
        "family": families[design["variant"]],
        "group": design["group"],
    }
