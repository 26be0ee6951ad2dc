"""A result file as users open it: loads by name as pandas Series, tables for pandas and xarray."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tolstat.common.columns import Column, drawn_columns, error_columns
from tolstat.common.errors import input_error
from tolstat.common.late import pandas as pd
from tolstat.common.loads import loads_of
from tolstat.common.tables import Status
from tolstat.common.wording import row_of
from tolstat.store import recorded
from tolstat.store.layout import MEANINGS, scale_of
from tolstat.store.reader import Reader
from tolstat.store.view import View

if TYPE_CHECKING:
    import xarray

AT_ONCE = 8192
"""Maximum number of rows of a block of `in_blocks`."""
OPERATING = tuple(
    Column(name, unit, f"{meaning} of the joint: operating point plus deviation", "f8", name, ())
    for name, unit, meaning in (
        ("alpha", "rad", "misalignment of the shafts"),
        ("speed", "rad/s", "angular velocity of the input shaft"),
        ("torque", "N*m", "resisting torque on the output shaft"),
        ("axial_force", "N", "axial force on the output shaft"),
    )
)
"""Columns that an export has beside errors and results; the deviations are errors, ``operation.alpha`` and so on."""


class ResultFile(Reader):
    """A result file that is open for reading, as `tolstat.open` gives it; close it, or use a ``with`` block."""

    def __repr__(self) -> str:
        if not self.is_open:
            return f"<result file {self.path.name!r}, closed>"
        joints = f"{self.n - self.first_sample} {row_of(self.mechanism)}s"
        progress = []
        for store in self.each():
            codes, numbers = np.unique(store.status(slice(self.first_sample, None)), return_counts=True)
            words = ", ".join(f"{n} {Status(code).label}" for code, n in zip(codes.tolist(), numbers, strict=True))
            progress.append(f"{store.point}: {words}" if store.point else words)
        return f"<result file {self.path.name!r}: {joints} ({'; '.join(progress)})>"

    def view(self, study_path: Path | None = None) -> View:
        """View of the file that questions read, while the file is open.

        Parameters
        ----------
        study_path : Path, optional
            Study file to read if the text in the result file can no longer be read.
        """
        return View(self, study_path)

    @cached_property
    def loads(self) -> NamedLoads:
        """Largest loads of the joints by name, as pandas Series: ``store.loads["cross1.F"]``.

        They are read when first used, and kept: open the file anew to see more of a campaign under way.
        """
        return NamedLoads(self.view())

    @property
    def nominal(self) -> pd.Series[float]:
        """Largest loads of the nominal joint by name, SI; NaN where the file has none or its results are not valid."""
        names, results, every = list(self.loads), self.loads.view.nominal, loads_of(self.mechanism)
        values = [float(every[name].of(results)[0]) if len(results) else np.nan for name in names]
        series = pd.Series(values, pd.Index(names, name="load"), dtype=float, name="nominal")
        series.attrs["units"] = {name: every[name].unit for name in names}
        return series

    def to_pandas(self, nominal: bool = False) -> pd.DataFrame:
        """Export errors and results as one DataFrame, one row per joint, pending and failed joints included.

        Parameters
        ----------
        nominal : bool
            Include the nominal joint, and a column ``nominal`` that marks it.

        Returns
        -------
        pandas.DataFrame
            Index ``row``: row of the campaign. Columns: ``point`` of a file with several operating points, with all
            rows at the first one first; case, variant, family and group for a study that lists its
            joints; how each joint was drawn, where that is recorded; errors; ``alpha``, ``speed``, ``torque`` and
            ``axial_force`` of each joint: the operating point plus the errors ``operation.alpha`` and so on; kept
            results, ``status`` as text. ``attrs["units"]`` has the SI unit of each column.
        """
        frames = list(in_blocks(self, nominal, max(self.n, 1)))
        whole = pd.concat(frames)
        whole.attrs = frames[0].attrs
        return whole

    def to_xarray(self, nominal: bool = False, histories: str | Sequence[str] = ()) -> xarray.Dataset:
        """Export errors and results along ``row``, with units and descriptions.

        Parameters
        ----------
        nominal : bool
            As in `to_pandas`.
        histories : str or sequence of str
            Histories of the file, such as ``cycles``, which are added with their axes.

        Returns
        -------
        xarray.Dataset
            The columns of `to_pandas`; of several operating points what depends on them has the dimension ``point``
            before ``row``. Coordinates along it, SI: ``share`` of the time, and the values that the point has,
            ``point_alpha`` (of a drive shaft that of joint 1), ``point_speed``, ``point_torque``,
            ``point_axial_force``. Attributes: title, version, date, seed, study.

        Raises
        ------
        InputError
            Without xarray.
        StoreError
            When the file does not hold these histories.
        """
        try:
            import xarray
        except ImportError as error:
            remedy = "install it with: pip install xarray, or use to_pandas()"
            raise input_error(self.path, "xarray is not installed", remedy) from error
        frames, columns = list(in_blocks(self, nominal, max(self.n, 1))), described(self)
        units = {name: {"units": c.unit, "description": c.description} for name, c in columns.items()}
        first, coords = frames[0], {"row": ("row", frames[0].index.to_numpy(), {})} | self._coordinates
        of_points = {c.name for c in (*OPERATING, *self.each()[0].columns)} | {"attempt"}
        data: dict[str, tuple[Any, ...]] = {}
        for name in map(str, first.drop(columns="point", errors="ignore")):
            at_each = [frame[name].to_numpy() for frame in frames]
            of_point = "point" in first and name in of_points
            values = (("point", "row"), np.stack(at_each)) if of_point else ("row", at_each[0])
            data[name] = (*values, units.get(name, {}))
        slots = np.arange(0 if nominal else self.first_sample, self.n)
        for name in [histories] if isinstance(histories, str) else histories:
            each = [part.histories(name, slots) for part in self.each()]
            spec = self.history_specs[name]
            about = {"units": spec.unit, "description": spec.description}
            whole = (("point", "row"), np.stack(each)) if "point" in first else (("row",), each[0])
            data[name] = ((*whole[0], *spec.axes), whole[1], about)
            for axis, size in zip(spec.axes, spec.shape, strict=True):
                along, unit, meaning = scale_of(axis, size, self.mechanism)
                coords[axis] = (axis, along, {"units": unit, "description": meaning})
        return xarray.Dataset(data, coords, self.metadata.about)

    @property
    def _coordinates(self) -> dict[str, tuple[Any, ...]]:
        """Coordinates along the operating points of a file with several, for `to_xarray`."""
        points = [store.points[store.point or ""] for store in self.each()]
        if len(points) == 1:
            return {}
        known = recorded.operating_points(self.each()[0], slice(0, 1))
        values = {
            f"point_{c.name}": (
                [float(getattr(point.operation, c.name)) for point in points],
                {
                    "units": c.unit,
                    "description": f"{c.description.partition(' of the joint')[0]} at the operating point",
                },
            )
            for c in OPERATING
            if c.name in known
        }
        of_time = [point.share for point in points], {"units": "1", "description": "share of the time"}
        names = [point.name for point in points], {"description": "operating point"}
        return {key: ("point", *both) for key, both in ({"point": names, "share": of_time} | values).items()}


class NamedLoads(Mapping[str, "pd.Series[float]"]):
    """Loads of the joints by name: ``loads["cross1.F"]``, ``list(loads)``, ``dict(loads)``, ``"psi" in loads``.

    Parameters
    ----------
    view : View
        The file.
    """

    def __init__(self, view: View) -> None:
        self.view = view

    def __repr__(self) -> str:
        return f"<loads of {self.view.path.name!r}: {', '.join(self)}>"

    def __getitem__(self, name: str) -> pd.Series[float]:
        """Largest load over the revolution of each joint, SI.

        Parameters
        ----------
        name : str
            ``cross1.F``; one that the study keeps.

        Returns
        -------
        pandas.Series
            Index ``row``: row of the campaign; the nominal joint is not among them. NaN for a joint without a valid
            load: pending, failed or not settled. ``attrs["units"]`` is the SI unit.

        Raises
        ------
        InputError, StoreError
            When the file has no such load for a sample of joints; see `View.load`.
        """
        load, store = self.view.load(name), self.view.store
        index = pd.RangeIndex(store.rows[store.first_sample :], name="row")
        series = pd.Series(load.values, index, name=name)
        series.attrs["units"] = load.unit
        return series

    def __iter__(self) -> Iterator[str]:
        return iter(self.view.kept_loads)

    def __len__(self) -> int:
        return len(self.view.kept_loads)

    def __contains__(self, name: object) -> bool:
        return name in self.view.kept_loads

    def _ipython_key_completions_(self) -> tuple[str, ...]:
        return self.view.kept_loads


def described(store: Reader) -> dict[str, Column]:
    """Columns with unit and description that an export has, by name; see `ResultFile.to_pandas` for the others."""
    of_errors, results = error_columns(store.mechanism), store.each()[0].columns
    return {c.name: c for c in (*drawn_columns(store.sampling), *of_errors, *OPERATING, *results)}


def in_blocks(store: Reader, nominal: bool, at_once: int = AT_ONCE) -> Iterator[pd.DataFrame]:
    """Yield the rows of `ResultFile.to_pandas` in blocks of at most `at_once`, of each operating point one at least."""
    first, listed = 0 if nominal else store.first_sample, _listed(store)
    parts = store.each()
    for part in parts:
        for begin in range(first, max(store.n, first + 1), at_once):
            frame = _frame(part, slice(begin, min(begin + at_once, store.n)), nominal, listed)
            if len(parts) > 1:
                frame.insert(0, "point", part.point)
                frame.attrs["units"] = {"point": "1"} | frame.attrs["units"]
            yield frame


def _frame(store: Reader, rows: slice, nominal: bool, listed: Mapping[str, NDArray[Any]]) -> pd.DataFrame:
    """Rows of a campaign; `listed` as from `_listed`."""
    errors, results = store.errors(rows), store.results(rows)
    data: dict[str, NDArray[Any]] = {}
    if nominal:
        data["nominal"] = np.arange(rows.start, rows.stop) < store.first_sample
    data |= {name: values[rows] for name, values in listed.items()}
    drawn = drawn_columns(store.sampling)
    if drawn:
        origin = store.origin(rows)
        data |= {c.name: c.of(origin) for c in drawn}
    data |= {c.name: c.of(errors) for c in error_columns(store.mechanism)}
    data |= recorded.operating_points(store, rows)
    data |= {c.name: c.of(results) for c in store.columns}
    if store.retries:
        data["attempt"] = store.attempt(rows)
    data["status"] = np.array([MEANINGS["status"][code] for code in data["status"].tolist()], dtype=object)
    frame = pd.DataFrame(data, index=pd.RangeIndex(store.rows[rows], name="row"))
    columns = described(store)
    frame.attrs["units"] = {name: columns[name].unit if name in columns else "1" for name in data}
    return frame


def _listed(store: Reader) -> dict[str, NDArray[Any]]:
    """Columns of joints that the study lists: case and family by name, variant and group by index; or of a sweep."""
    if not store.case_names:
        return recorded.swept(store) | {"variant": store.design["variant"]} if store.variants else {}
    design = store.design
    families = np.array([variant.family for variant in store.variants], dtype=object)
    return {
        "case": np.array(store.case_names, dtype=object)[design["case"]],
        "variant": design["variant"],
        "family": families[design["variant"]],
        "group": design["group"],
    }


@contextmanager
def viewed(source: str | Path | Reader | View) -> Iterator[View]:
    """View of a result file: of its path, which is opened and closed, or of the open file; a view stays as it is."""
    if isinstance(source, View):
        yield source
    elif isinstance(source, Reader):
        yield View(source)
    else:
        with Reader.open(source) as store:
            yield View(store)
