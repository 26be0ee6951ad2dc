"""View of a result file for reports: joints of the statistics, nominal joint, limits, swept errors."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.analysis import exceedance, quantile, weighted
from tolstat.analysis.exceedance import Exceedance
from tolstat.analysis.quantile import Quantile
from tolstat.common import selected_results
from tolstat.common.columns import RESULT_COLUMNS, Column
from tolstat.common.draw_records import check_equal_weights
from tolstat.common.errors import Fault, InputError
from tolstat.common.loads import BUSHING_LOADS, LOADS
from tolstat.common.tables import ERROR_FIELDS, VALID, Status
from tolstat.store import Counts, verification
from tolstat.store.reader import BLOCK
from tolstat.store.verification import Verification

if TYPE_CHECKING:
    from tolstat.store import ResultStore

FloatArray = NDArray[np.float64]
METHODS = {
    "random": "random sampling",
    "sobol": "Sobol' points",
    "lhs": "Latin hypercube",
    "sweep": "sweep",
    "importance": "importance sampling",
    "pick_freeze": "pick-freeze design",
}
_ERROR_UNITS = {field.name: field.unit for field in ERROR_FIELDS}
_DISPLAY = {
    "m": ("mm", 1e3),
    "rad": ("deg", 180.0 / np.pi),
    "rad/s": ("rpm", 30.0 / np.pi),
    "N*m": ("N m", 1.0),
    "1": ("", 1.0),
}


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


Ends = tuple[FloatArray, FloatArray]
"""Lower and upper end of the interval of each joint's largest load."""


@dataclass(frozen=True)
class Campaign:
    """A campaign for reports; row i of `errors` and row i of `results` are the same joint.

    Attributes
    ----------
    name : str
        Name of the study.
    method : str
        Sampling method, a key of `METHODS`.
    limits : mapping of str to float
        Allowed load in SI units by name (``"cross1.F"``).
    errors, results : ndarray of ERROR and RESULT, shape (n,)
        All joints in the file except the nominal joint.
    nominal : ndarray of RESULT, shape (1,) or (0,)
        The nominal joint, if the file has one and its results are valid.
    patterns : tuple of str
        Key paths of what the study sweeps; empty without a sweep.
    verification : Verification, optional
        The verification that the file holds, if any.
    columns : tuple of Column
        Columns of the results that the study keeps; the others are NaN.
    weights : ndarray, shape (n,), optional
        Weight of each joint, if joints were not drawn from the tolerances alone.
    """

    name: str
    method: str
    limits: Mapping[str, float]
    errors: NDArray[np.void]
    results: NDArray[np.void]
    nominal: NDArray[np.void]
    patterns: tuple[str, ...] = ()
    verification: Verification | None = None
    columns: tuple[Column, ...] = RESULT_COLUMNS
    weights: FloatArray | None = None

    def curve(
        self, values: FloatArray, levels: ArrayLike | None, confidence: float, ends: Ends | None = None
    ) -> NDArray[np.void]:
        """Share of the joints above each level, see `exceedance.curve`; weighted by `weights` if any."""
        status = self.results["status"]
        if self.weights is None:
            return exceedance.curve(values, status, levels, confidence, self.iid, ends)
        return weighted.curve(values, status, self.weights, levels, confidence, ends)

    def above(self, values: FloatArray, level: float, confidence: float, ends: Ends | None = None) -> Exceedance:
        """Share of the joints above one level; see `curve`."""
        return Exceedance(*self.curve(values, [level], confidence, ends)[0].tolist())

    def quantile(self, values: FloatArray, share: float, confidence: float) -> Quantile:
        """Load that a share of the joints stays at or below, see `quantile.at`; weighted by `weights` if any."""
        status = self.results["status"]
        if self.weights is None:
            return quantile.at(values, status, share, confidence, self.iid)
        return weighted.quantile(values, status, self.weights, share, confidence)

    def done(self) -> Campaign:
        """Return the campaign without its pending joints."""
        here = self.results["status"] != Status.PENDING
        if here.all():
            return self  # avoids a copy of large tables
        weights = None if self.weights is None else self.weights[here]
        return replace(self, errors=self.errors[here], results=self.results[here], weights=weights)

    @property
    def drawn(self) -> tuple[str, ...]:
        """Loads of `loads.BUSHING_LOADS` that the study keeps."""
        return tuple(name for name in BUSHING_LOADS if selected_results.holds(self.columns, name))

    @property
    def listed(self) -> tuple[str, ...]:
        """Loads that tables show: those of `drawn` or, if there are none, all others that the study keeps."""
        return self.drawn or tuple(name for name in LOADS if selected_results.holds(self.columns, name))

    @property
    def iid(self) -> bool:
        """Whether the joints are independent samples."""
        return self.method in ("random", "importance")

    def count(self, *states: Status) -> int:
        """Number of joints in any of the given states."""
        return int(np.isin(self.results["status"], [int(state) for state in states]).sum())

    def head(self) -> str:
        """Sentence with the number of joints and of those without a valid result."""
        counts = Counts.of(self.results["status"])
        pending = counts.total - counts.done
        text = f"{counts.done} joints ({METHODS.get(self.method, self.method)}), {counts.shortfall}"
        return text + (f", {pending} still pending" if pending else "")

    def missing(self) -> str:
        """Sentence that names the bushing loads that the study does not keep; empty if it keeps all."""
        names = [name for name in BUSHING_LOADS if name not in self.drawn]
        return f"not kept, see [output] results of the study: {', '.join(names)}" if names else ""


def read(
    store: ResultStore,
    fields: Sequence[str] | None = None,
    errors_of: Sequence[str] | None = None,
    weighted: bool = False,
) -> Campaign:
    """Read what a report needs from a result file; row 0 is separated if it is the nominal joint.

    Parameters
    ----------
    store : ResultStore
        The file.
    fields : sequence of str, optional
        Fields of the results to load, including ``status``, such as `loads.LOAD_FIELDS`; all without it. The complete
        tables of a million joints take 1.2 GB.
    errors_of : sequence of str, optional
        Columns of the errors to load; all without it.
    weighted : bool
        Whether the caller uses `Campaign.weights`; unweighted statistics would be wrong for joints that were not
        drawn from the tolerances alone.

    Returns
    -------
    Campaign
        With tables of these fields.

    Raises
    ------
    StoreError
        When the joints have weights that the caller does not use, or belong to a subset simulation.
    """
    check_equal_weights(store.sampling, store.path, weighted)
    errors, results = store.errors(fields=errors_of), store.results(fields=fields)
    nominal, weights = results[:0], store.origin()["weight"] if store.sampling["method"] == "importance" else None
    if store.sampling["nominal_first"] and store.rows.start == 0:
        nominal = results[:1][np.isin(results["status"][:1], VALID)]
        errors, results = errors[1:], results[1:]
        weights = None if weights is None else weights[1:]
    method = str(store.sampling["method"])
    return Campaign(
        store.study_name,
        method,
        store.limits,
        errors,
        results,
        nominal,
        patterns(store.study_text),
        verification.read(store),
        store.columns,
        weights,
    )


def patterns(text: str) -> tuple[str, ...]:
    """Key paths of what a study, given as TOML, sweeps; empty without a sweep."""
    return tuple(_patterns(tomllib.loads(text).get("sweep", {})))


def error_blocks(store: ResultStore, columns: Sequence[str]) -> Iterator[NDArray[np.void]]:
    """Yield the errors of the joints that `read` returns, without the nominal joint, in consecutive blocks.

    Parameters
    ----------
    store : ResultStore
        The file.
    columns : sequence of str
        Columns of the errors to load.
    """
    begin = int(store.sampling["nominal_first"] and store.rows.start == 0)
    for first in range(begin, store.n, BLOCK):
        yield store.errors(slice(first, first + BLOCK), columns)


def errors_at(store: ResultStore, columns: Sequence[str], samples: NDArray[np.intp]) -> NDArray[np.void]:
    """Errors of selected joints, by their ascending indices among the joints of `read`; see `error_blocks`."""
    parts, first = [], 0
    for block in error_blocks(store, columns):
        parts.append(block[samples[(samples >= first) & (samples < first + len(block))] - first])
        first += len(block)
    return np.concatenate(parts)


def _patterns(table: Mapping[str, Any], before: str = "") -> Iterator[str]:
    """Key paths of the entries of ``[sweep]``, whether quoted or dotted."""
    for key, value in table.items():
        if isinstance(value, Mapping) and "from" not in value:
            yield from _patterns(value, f"{before}{key}.")
        else:
            yield f"{before}{key}"


def load(results: NDArray[np.void], name: str) -> tuple[FloatArray, str]:
    """Largest load over the last revolution, by its name.

    Parameters
    ----------
    results : ndarray of RESULT, shape (n,)
        Results of the joints.
    name : str
        ``cross1.F``, ``fork3.T``, ``pin1.contact`` or ``psi``.

    Returns
    -------
    values : ndarray, shape (n,)
        The load of each joint, SI.
    unit : str
        ``N``, ``N*m`` or ``1``.

    Raises
    ------
    InputError
        When there is no such load.
    """
    if name not in LOADS:
        raise InputError([Fault(f"limits.{name}", "is not a load", "name cross1.F .. fork4.T, pin1.contact or psi")])
    return LOADS[name].of(results), LOADS[name].unit


def ends(results: NDArray[np.void], name: str) -> Ends:
    """Interval of the largest load of each joint; both ends are the load itself unless the joint is stationary.

    Returns
    -------
    lower, upper : ndarray, shape (n,)
        SI; NaN for joints without results.
    """
    values, _ = load(results, name)
    kind = LOADS[name].kind
    return values * results[f"{kind}_lower"], values * results[f"{kind}_upper"]


def swept_axes(campaign: Campaign) -> list[Axis]:
    """Quantities that a sweep varies, in the study's order.

    Errors with equal values in every joint are swept together and form one axis.

    Parameters
    ----------
    campaign : Campaign
        A campaign with the sampling method ``sweep``.

    Returns
    -------
    list of Axis
        Empty when nothing varies.
    """
    groups: dict[bytes, list[str]] = {}
    for field in ERROR_FIELDS:
        column = np.ascontiguousarray(campaign.errors[field.name])
        if column.size and np.ptp(column) > 0:
            groups.setdefault(column.tobytes(), []).append(field.name)
    axes = []
    for names in groups.values():
        unit, factor = _DISPLAY[_ERROR_UNITS[names[0]]]
        values = campaign.errors[names[0]] * factor
        values[np.abs(values) < 1e-12 * np.abs(values).max()] = 0.0  # rounding error of a sweep through zero
        axes.append(Axis(_label(names, campaign.patterns), unit, values))
    rank = {pattern: i for i, pattern in enumerate(campaign.patterns)}
    return sorted(axes, key=lambda axis: rank.get(axis.label, len(rank)))


def _label(names: list[str], patterns: tuple[str, ...]) -> str:
    for pattern in patterns:
        if all(fnmatchcase(name, pattern) for name in names):
            return pattern
    return names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"
