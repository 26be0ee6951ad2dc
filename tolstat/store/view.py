"""What a report needs of a result file: the statistics' rows, the nominal joint, limits, swept errors."""

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
from tolstat.common import selected_results as kept
from tolstat.common.columns import RESULT_COLUMNS, Column
from tolstat.common.draw_records import check_counted
from tolstat.common.errors import Fault, InputError
from tolstat.common.tables import BUSHINGS, ERROR_FIELDS, PINS, VALID, Status
from tolstat.store import Counts, verification
from tolstat.store.reader import BLOCK
from tolstat.store.verification import Verification
from tolstat.study.selection import LIMIT_UNITS

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
LOADS = tuple(f"{bushing}.{letter}" for bushing in BUSHINGS for letter in "FT")
"""The loads that every report shows, where they are kept: force and torque of each bushing."""
LOAD_FIELDS = ("status", *(f"{load}_{of}" for load in ("F", "T", "contact", "psi") for of in ("max", "lower", "upper")))
"""Fields of the results that every load with a limit is read from, and the joints' status."""
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
        Unit for the reader, such as ``mm``.
    values : ndarray, shape (n,)
        Value at each joint, in `unit`.
    """

    label: str
    unit: str
    values: FloatArray


Ends = tuple[FloatArray, FloatArray]
"""Lower and upper end of the largest load of each joint."""


@dataclass(frozen=True)
class Campaign:
    """A campaign as reports see it; row i of both tables is one joint.

    Attributes
    ----------
    name : str
        Name of the study.
    method : str
        Sampling method, a key of `METHODS`.
    limits : mapping of str to float
        Allowed load in SI units by name (``"cross1.F"``).
    errors, results : ndarray of ERROR and RESULT, shape (n,)
        The joints that count; the nominal joint is not among them.
    nominal : ndarray of RESULT, shape (1,) or (0,)
        The joint without errors, where the campaign has one and it settled.
    patterns : tuple of str
        What the study sweeps; empty for a random campaign.
    verification : Verification, optional
        Some of the joints simulated in other ways, where the file holds that.
    columns : tuple of Column
        Columns of the results that the study keeps; the others are NaN.
    weights : ndarray, shape (n,), optional
        What each joint counts for, where joints were not drawn from the tolerances alone.
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
        """Share of the joints above each level, see `exceedance.curve`, each joint counted by its weight."""
        status = self.results["status"]
        if self.weights is None:
            return exceedance.curve(values, status, levels, confidence, self.iid, ends)
        return weighted.curve(values, status, self.weights, levels, confidence, ends)

    def above(self, values: FloatArray, level: float, confidence: float, ends: Ends | None = None) -> Exceedance:
        """Share of the joints above one level; see `curve`."""
        return Exceedance(*self.curve(values, [level], confidence, ends)[0].tolist())

    def quantile(self, values: FloatArray, share: float, confidence: float) -> Quantile:
        """Load that a share of the joints stays at or below, see `quantile.at`, each joint counted by its weight."""
        status = self.results["status"]
        if self.weights is None:
            return quantile.at(values, status, share, confidence, self.iid)
        return weighted.quantile(values, status, self.weights, share, confidence)

    def done(self) -> Campaign:
        """The same without the joints that are still pending."""
        here = self.results["status"] != Status.PENDING
        if here.all():
            return self  # tables of a million joints are not copied
        weights = None if self.weights is None else self.weights[here]
        return replace(self, errors=self.errors[here], results=self.results[here], weights=weights)

    @property
    def drawn(self) -> tuple[str, ...]:
        """Those of `LOADS` that the study keeps."""
        return tuple(name for name in LOADS if kept.holds(self.columns, name))

    @property
    def listed(self) -> tuple[str, ...]:
        """Loads that tables show: those of `drawn`, and all others that a study keeps which keeps none of these."""
        return self.drawn or tuple(name for name in LIMIT_UNITS if kept.holds(self.columns, name))

    @property
    def iid(self) -> bool:
        """Whether the joints are independent samples."""
        return self.method in ("random", "importance")

    def count(self, *states: Status) -> int:
        """Joints in any of the given states."""
        return int(np.isin(self.results["status"], [int(state) for state in states]).sum())

    def head(self) -> str:
        """Sentence with the number of joints and of those without a valid result."""
        counts = Counts.of(self.results["status"])
        pending = counts.total - counts.done
        text = f"{counts.done} joints ({METHODS.get(self.method, self.method)}), {counts.shortfall}"
        return text + (f", {pending} still pending" if pending else "")

    def missing(self) -> str:
        """Sentence on the loads that a report would show and the study does not keep; empty where it keeps them all."""
        names = [name for name in LOADS if name not in self.drawn]
        return f"not kept, see [output] results of the study: {', '.join(names)}" if names else ""


def read(
    store: ResultStore,
    fields: Sequence[str] | None = None,
    errors_of: Sequence[str] | None = None,
    weighted: bool = False,
) -> Campaign:
    """Take from a result file what a report needs; row 0 goes apart where it is the nominal joint.

    Parameters
    ----------
    store : ResultStore
        The file.
    fields : sequence of str, optional
        Fields of the results to hold, ``status`` among them, such as `LOAD_FIELDS`; all without it. The tables of a
        million joints take 1.2 GB when whole.
    errors_of : sequence of str, optional
        Columns of the errors to hold; all without it.
    weighted : bool
        Whether the caller counts joints by their `Campaign.weights`; others would be wrong on joints that were not
        drawn from the tolerances alone.

    Returns
    -------
    Campaign
        With tables of these fields.

    Raises
    ------
    StoreError
        When the joints count differently, and the caller does not go by that.
    """
    check_counted(store.sampling, store.path, weighted)
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
    """Key paths of what the text of a study sweeps; empty for one that does not."""
    return tuple(_patterns(tomllib.loads(text).get("sweep", {})))


def error_blocks(store: ResultStore, columns: Sequence[str]) -> Iterator[NDArray[np.void]]:
    """Errors of the joints that `read` gives, without the nominal one: tables of a part of the joints, in their order.

    Parameters
    ----------
    store : ResultStore
        The file.
    columns : sequence of str
        Columns of the errors that the tables have.
    """
    begin = int(store.sampling["nominal_first"] and store.rows.start == 0)
    for first in range(begin, store.n, BLOCK):
        yield store.errors(slice(first, first + BLOCK), columns)


def errors_at(store: ResultStore, columns: Sequence[str], samples: NDArray[np.intp]) -> NDArray[np.void]:
    """Errors of some of the joints that `read` gives, by their places in ascending order; see `error_blocks`."""
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
    part, _, letter = name.partition(".")
    if part in BUSHINGS and letter in ("F", "T"):
        return results[f"{letter}_max"][:, BUSHINGS.index(part)], "N" if letter == "F" else "N*m"
    if part in PINS and letter == "contact":
        return results["contact_max"][:, PINS.index(part)].max(axis=1), "N"
    if name == "psi":
        return results["psi_max"], "1"
    raise InputError([Fault(f"limits.{name}", "is not a load", "name cross1.F .. fork4.T, pin1.contact or psi")])


def ends(results: NDArray[np.void], name: str) -> Ends:
    """Interval of the largest load of each joint, by its name as in `load`: a doubt that stationary joints have.

    Returns
    -------
    lower, upper : ndarray, shape (n,)
        SI; NaN for joints without.
    """
    values, _ = load(results, name)
    kind = name.rpartition(".")[2]
    return values * results[f"{kind}_lower"], values * results[f"{kind}_upper"]


def swept_axes(campaign: Campaign) -> list[Axis]:
    """Quantities that a sweep moves, in the study's order.

    Errors that are equal in every joint move together and make one axis.

    Parameters
    ----------
    campaign : Campaign
        A campaign of the method ``sweep``.

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
        values[np.abs(values) < 1e-12 * np.abs(values).max()] = 0.0  # a sweep through zero misses it by rounding
        axes.append(Axis(_label(names, campaign.patterns), unit, values))
    rank = {pattern: i for i, pattern in enumerate(campaign.patterns)}
    return sorted(axes, key=lambda axis: rank.get(axis.label, len(rank)))


def _label(names: list[str], patterns: tuple[str, ...]) -> str:
    for pattern in patterns:
        if all(fnmatchcase(name, pattern) for name in names):
            return pattern
    return names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"
