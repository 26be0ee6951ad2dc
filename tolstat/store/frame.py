"""Export of a campaign to a pandas DataFrame or an xarray Dataset."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tolstat.common import draw_records
from tolstat.common.columns import ERROR_COLUMNS
from tolstat.common.errors import Fault, InputError
from tolstat.common.tables import Status
from tolstat.store import recorded

if TYPE_CHECKING:
    import pandas as pd
    import xarray

    from tolstat.store.reader import Reader

LABELS = np.array([s.label for s in Status], dtype=object)


def to_pandas(store: Reader, units: bool = False) -> pd.DataFrame:
    """Export a campaign to one DataFrame, see `ResultStore.to_pandas`."""
    import pandas as pd

    errors, results = store.errors(), store.results()
    data: dict[tuple[str, str], NDArray[Any]] = _design(store) if store.case_names else {}
    if store.variants and not store.case_names:
        data |= recorded.swept(store)
    drawn = draw_records.columns(store.sampling)
    if drawn:
        origin = store.origin()
        data |= {(c.name, c.unit): c.of(origin) for c in drawn}
    data |= {(c.name, c.unit): c.of(errors) for c in ERROR_COLUMNS}
    data |= {(c.name, c.unit): c.of(results) for c in store.columns}
    if store.retries:
        data["attempt", "1"] = store.attempt()
    data["status", "1"] = LABELS[results["status"]]
    index = pd.RangeIndex(store.rows, name="row")
    if units:
        return pd.DataFrame(data, index=index)
    return pd.DataFrame({name: values for (name, _), values in data.items()}, index=index)


def to_xarray(store: Reader) -> xarray.Dataset:
    """Export a campaign to one Dataset, see `ResultStore.to_xarray`."""
    try:
        import xarray
    except ImportError as error:
        fault = Fault(
            str(store.path), "xarray is not installed", "install it with: pip install xarray, or use to_pandas()"
        )
        raise InputError([fault]) from error
    frame = to_pandas(store)
    columns = (*draw_records.columns(store.sampling), *ERROR_COLUMNS, *store.columns)
    described = {c.name: {"units": c.unit, "description": c.description} for c in columns}
    data = {name: ("row", frame[name].to_numpy(), described.get(str(name), {})) for name in frame}
    return xarray.Dataset(data, coords={"row": frame.index.to_numpy()}, attrs={"study": store.study_name})


def _design(store: Reader) -> dict[tuple[str, str], NDArray[Any]]:
    """Case, variant, family and group of each row; case and family by name, variant and group by index."""
    design = store.design()
    families = np.array([variant.family for variant in store.variants], dtype=object)
    return {
        ("case", "1"): np.array(store.case_names, dtype=object)[design["case"]],
        ("variant", "1"): design["variant"],
        ("family", "1"): families[design["variant"]],
        ("group", "1"): design["group"],
    }
