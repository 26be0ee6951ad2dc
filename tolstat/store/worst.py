"""The same joints at several operating points, taken together: largest loads and the worst status of each joint."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.estimates import Column, Inexact, frozen, largest
from tolstat.analysis.sample import Sample, is_valid
from tolstat.common.loads import FloatArray, Load, Results, load_fields
from tolstat.common.tables import FAILED, UNSETTLED, VALID, Status, deciding, tables, without_results, worst_status
from tolstat.store.reader import Reader

AT_ONCE = 16_384
"""Rows read at once. They are written to a table column by column, faster where it fits the processor's cache."""
MAX_LISTED = 12
"""Number of joints without a valid load whose complete results are kept."""


def together(parts: Sequence[Results]) -> Columns:
    """Largest loads of the joints over some operating points.

    Parameters
    ----------
    parts : sequence of Results
        Results at each operating point, with `loads.load_fields` at least.

    Returns
    -------
    Columns
        Arrays of shape (n, ...). A load is NaN if it is at one of the points. Ends of intervals are 1, and NaN for
        stationary joints: loads of one kind may have theirs from different points, see `load_of`.
    """
    return Columns(partial(_largest, parts))


def _largest(parts: Sequence[Results], name: str) -> NDArray[Any]:
    if name.endswith("_max"):
        return np.asarray(np.maximum.reduce([part[name] for part in parts]))
    status = worst_status([part["status"] for part in parts])
    return status if name == "status" else np.where(status == Status.STATIONARY, np.nan, 1.0)


def load_of(parts: Sequence[Results], load: Load) -> tuple[Column, NDArray[np.uint8], Inexact]:
    """One load of the joints over some operating points, in arrays that cannot be written to.

    Parameters
    ----------
    parts : sequence of Results
        Results at each operating point, with `loads.load_fields` at least.
    load : Load
        The load.

    Returns
    -------
    values : Column
        Largest value, SI; NaN unless the joint is valid at all points. Of one point it shares the memory of `parts`.
    status : ndarray, shape (n,)
        See `tables.worst_status`.
    inexact : Inexact
        Joints that are stationary, failed or unsettled at a point: the largest of the lower ends, and of the upper
        ones.
    """
    each = [_at_point(part, load) for part in parts]
    value, inexact = each[0] if len(each) == 1 else largest(each)
    for array in inexact:
        frozen(array)
    return value, worst_status([part["status"] for part in parts]), inexact


def _at_point(part: Results, load: Load) -> tuple[Column, Inexact]:
    values, status = frozen(load.of(part)), part["status"]
    valid = is_valid(values, status)
    others = np.flatnonzero(~valid & np.isfinite(values))
    joints = np.flatnonzero((~valid & (status != Status.PENDING)) | (status == Status.STATIONARY))
    lost, exact = ~valid[joints], values[joints]
    names = [f"{load.kind.key}_{of}" for of in ("max", "lower", "upper")]
    ends = load.ends({name: part[name][joints] for name in names})
    lower, upper = (np.where(np.isfinite(end), end, exact) for end in ends)
    inexact = Inexact(joints, np.where(lost, -np.inf, lower), np.where(lost, np.inf, upper))
    return Column(values).replaced(others, np.full(others.size, np.nan)), inexact


def rank(load: Sample, limit: float | None) -> tuple[float, float]:
    """Share of the joints above a limit, and the load that 99 % do not exceed, relative to the limit if any."""
    if not load.valid.size:
        return 0.0, 0.0
    share = 0.0 if limit is None else float(np.nan_to_num(load.above(limit).estimate))
    return share, float(load.valid[int(0.99 * (load.valid.size - 1))]) / (1.0 if limit is None else limit)


class Columns(dict[str, NDArray[Any]]):
    """Columns of results that loads are read from, each made when it is first asked for, and not writeable."""

    def __init__(self, make: Callable[[str], NDArray[Any]]) -> None:
        super().__init__()
        self._make = make

    def __missing__(self, name: str) -> NDArray[Any]:
        return self.setdefault(name, frozen(self._make(name)))


def columns_of(store: Reader) -> Columns:
    """Columns of the results of the samples of a file at one operating point; values of one load lie side by side."""
    return Columns(partial(_column, store))


def _column(store: Reader, name: str) -> NDArray[Any]:
    """Column of the results of the samples of a file at one operating point."""
    skip = store.first_sample
    dtype = tables(store.mechanism).RESULT[name]
    values = np.empty((store.n - skip, *dtype.shape), dtype.base, "F")
    for slots in _slots(store):
        values[slots.start - skip : slots.stop - skip] = store.results(slots, (name,))[name]
    return values


def _slots(store: Reader) -> Iterator[slice]:
    """File slots of the samples, in blocks of those that have checksums together."""
    for first in range(0, store.n, AT_ONCE):
        yield slice(max(first, store.first_sample), first + AT_ONCE)


def nominal(stores: Sequence[Reader]) -> NDArray[np.void]:
    """The nominal joint over the operating points of `stores`, RESULT (1,); (0,) unless it is valid at all of them."""
    at_each = [store.results(slice(0, store.first_sample)) for store in stores]
    at_each = [table[np.isin(table["status"], VALID)] for table in at_each]
    if len(stores) == 1:
        return frozen(at_each[0])
    mechanism = stores[0].mechanism
    joint = without_results(int(all(map(len, at_each))), Status.OK, mechanism)
    for name in load_fields(mechanism) if joint.size else ():
        joint[name] = together(at_each)[name]
    return frozen(joint)


def without_load(status: Sequence[NDArray[np.uint8]], stores: Sequence[Reader]) -> NDArray[np.void]:
    """Results of the first `MAX_LISTED` joints that failed or did not settle, RESULT (m,), at the point that decides.

    Parameters
    ----------
    status : sequence of ndarray, shape (n,)
        Status of the samples at each operating point.
    stores : sequence of Reader
        The file at each operating point.
    """
    samples = np.flatnonzero(np.isin(worst_status(status), (*FAILED, *UNSETTLED)))[:MAX_LISTED]
    points = deciding([at_point[samples] for at_point in status]).tolist()
    slots = (samples + stores[0].first_sample).tolist()
    each = [stores[point].results(slice(slot, slot + 1)) for point, slot in zip(points, slots, strict=True)]
    return frozen(np.concatenate([np.empty(0, tables(stores[0].mechanism).RESULT), *each]))


def mode_share(store: Reader) -> FloatArray:
    """Mean over the valid joints at one operating point, (pins, modes); NaN if none is valid or it is not kept."""
    shape = tables(store.mechanism).RESULT["mode_share"].shape
    total, shares = 0, np.zeros(shape)
    for slots in _slots(store):
        block = store.results(slots, ("status", "mode_share"))
        valid = np.isin(block["status"], VALID)
        shares += block["mode_share"][valid].sum(axis=0)
        total += int(valid.sum())
    return frozen(shares / total if total else np.full(shape, np.nan))
