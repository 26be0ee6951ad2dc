"""Comparison of two campaigns: differences between their studies and between their loads."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from tolstat.analysis import difference
from tolstat.analysis.exceedance import FloatArray
from tolstat.common import selected_results
from tolstat.common.errors import Fault, InputError, StoreError
from tolstat.common.loads import LOAD_FIELDS, UNIT_OF_LOAD
from tolstat.common.strict import did_you_mean
from tolstat.common.tables import VALID, Status
from tolstat.store import ResultStore, view

SHARES = (0.5, 0.9, 0.99)
"""Quantiles that are compared."""
DRAWN = ("random", "sobol", "lhs")


class Change(NamedTuple):
    """What differs between two studies.

    Attributes
    ----------
    keys : list of str
        Dotted keys of their identity; all change from value `a` to value `b`.
    a, b : object
        The values, JSON; None where the study has no such key.
    """

    keys: list[str]
    a: Any
    b: Any


class Sides(NamedTuple):
    """The joints of two campaigns A and B; if paired, both have the same length and order.

    Attributes
    ----------
    a, b : Campaign
        The campaigns, cut to the joints that are compared.
    rows : ndarray of int, shape (n,)
        Row of each joint of A in its campaign.
    paired : bool
        Whether joint i of both was drawn with the same random numbers.
    """

    a: view.Campaign
    b: view.Campaign
    rows: np.ndarray[tuple[int], np.dtype[np.intp]]
    paired: bool

    @property
    def iid(self) -> bool:
        """Whether the joints of both are independent samples."""
        return self.a.iid and self.b.iid

    def load(self, name: str) -> tuple[FloatArray, FloatArray, str]:
        """Load of each joint of A and of B, NaN if not valid, and its unit."""
        (a, unit), (b, _) = (_valid(side, name) for side in (self.a, self.b))
        return a, b, unit


class Comparison(NamedTuple):
    """Differences between two campaigns.

    Attributes
    ----------
    sides : Sides
        The joints.
    changes : list of Change
        What differs between the studies.
    shares : DataFrame
        One row per limit of either study: ``load``, ``unit``, ``level`` (SI), fields of `difference.ShareDifference`.
    loads : DataFrame
        One row per load and ``statistic`` (``mean``, ``50 %`` ...): ``load``, ``unit``, ``statistic``, then the fields
        of `analysis.difference.Difference`.
    switched : DataFrame
        One row per pair and limit if only one joint of the pair is above the limit: ``row`` (of A), ``load``, ``unit``,
        ``level``, ``a``, ``b``. Empty without pairs.
    """

    sides: Sides
    changes: list[Change]
    shares: pd.DataFrame
    loads: pd.DataFrame
    switched: pd.DataFrame


def of_stores(a: ResultStore, b: ResultStore, by: Sequence[str] = (), confidence: float = 0.95) -> Comparison:
    """Compare two campaigns.

    Parameters
    ----------
    a, b : ResultStore
        Result files. Joints are paired if both studies draw them by the same method from the same seed: an error then
        has the same random number in both, whatever its tolerance. Joints without a partner are then left out.
    by : sequence of str
        Loads whose quantiles and means are compared; by default those with a limit or, without limits, all kept.
    confidence : float
        Confidence level of the intervals.

    Returns
    -------
    Comparison
        Differences are B minus A.

    Raises
    ------
    InputError
        When a name is not a load, or a load is not kept by both files.
    StoreError
        When a file holds joints that are not drawn from tolerances, or no joint with a valid load.

    Examples
    --------
    >>> with tolstat.open(path) as a, tolstat.open(other) as b:
    ...     found = tolstat.compared(a, b, ["cross1.F"])
    >>> found.sides.paired, [change.keys[0] for change in found.changes]
    (True, ['sampling.n'])
    >>> int(found.shares["only_a"].iloc[0]), int(found.shares["only_b"].iloc[0])
    (0, 0)
    """
    for store in (a, b):
        if store.sampling["method"] not in DRAWN:
            remedy = 'compare files of studies with sampling.method "random", "sobol" or "lhs"'
            raise StoreError(str(Fault(str(store.path), "holds joints that are not drawn from tolerances", remedy)))
    sides = _sides(a, b)
    limits = [*sides.a.limits.items(), *(item for item in sides.b.limits.items() if item not in sides.a.limits.items())]
    names = _names(sides, by, [name for name, _ in limits])
    try:
        shares = [_share(sides, name, level, confidence) for name, level in limits]
        loads = [row for name in names for row in _load(sides, name, confidence)]
    except ValueError as error:
        raise StoreError(str(Fault(f"{a.path}, {b.path}", str(error), "run both campaigns on"))) from error
    switched = [_switched(sides, name, level) for name, level in limits] if sides.paired else []
    empty = pd.DataFrame(columns=["row", "load", "unit", "level", "a", "b"])
    return Comparison(
        sides,
        changes(a, b),
        pd.DataFrame(shares),
        pd.DataFrame(loads),
        pd.concat(switched, ignore_index=True) if switched else empty,
    )


def changes(a: ResultStore, b: ResultStore) -> list[Change]:
    """List what differs between the studies of two files, limits and code included; equal changes are grouped."""
    one, other = (_identity(store) for store in (a, b))
    found: dict[str, Change] = {}
    for key in sorted(one.keys() | other.keys()):
        pair = (one.get(key), other.get(key))
        if pair[0] != pair[1]:
            found.setdefault(json.dumps(pair), Change([], *pair)).keys.append(key)
    return list(found.values())


def _identity(store: ResultStore) -> dict[str, Any]:
    limits = {f"limits.{name}": level for name, level in store.limits.items()}
    return store.identity | limits | {key: store.versions.get(key) for key in ("tolstat", "sources")}


def _sides(a: ResultStore, b: ResultStore) -> Sides:
    one, other = (view.read(store, LOAD_FIELDS, ()) for store in (a, b))
    same = [a.sampling[key] == b.sampling[key] for key in ("method", "seed")]
    same.append(a.sampling["method"] != "sobol" or a.sampling["dimensions"] == b.sampling["dimensions"])
    same.append(a.sampling["method"] != "lhs" or a.sampling["n"] == b.sampling["n"])
    first = [max(0, store.rows.start - int(store.sampling["nominal_first"])) for store in (a, b)]
    begin = max(first)
    end = min(at + len(side.results) for at, side in zip(first, (one, other), strict=True))
    rows = first[0] + int(a.sampling["nominal_first"]) + np.arange(len(one.results))
    paired = all(same) and begin < end
    here = [
        np.arange(begin - at, end - at) if paired else np.arange(len(side.results))
        for at, side in zip(first, (one, other), strict=True)
    ]
    done = [side.results["status"][i] != Status.PENDING for side, i in zip((one, other), here, strict=True)]
    if paired:
        done = [done[0] & done[1]] * 2
    here = [i[simulated] for i, simulated in zip(here, done, strict=True)]
    return Sides(_cut(one, here[0]), _cut(other, here[1]), rows[here[0]], paired)


def _cut(side: view.Campaign, rows: np.ndarray[tuple[int], np.dtype[np.intp]]) -> view.Campaign:
    if len(rows) == len(side.results):
        return side  # tables of a million joints are not copied
    return replace(side, errors=side.errors[rows], results=side.results[rows])


def _valid(side: view.Campaign, name: str) -> tuple[FloatArray, str]:
    values, unit = view.load(side.results, name)
    return np.where(np.isin(side.results["status"], VALID), values, np.nan), unit


def _names(sides: Sides, by: Sequence[str], limited: Sequence[str]) -> list[str]:
    held = [
        name for name in UNIT_OF_LOAD if all(selected_results.holds(side.columns, name) for side in (sides.a, sides.b))
    ]
    asked = {**dict.fromkeys(by, "--by"), **{name: f"limits.{name}" for name in limited}}
    lacking = {name: place for name, place in asked.items() if name not in held}
    if lacking:
        found = "is not a load that both files keep"
        raise InputError(
            [Fault(place, f"{name!r} {found}", did_you_mean(name, held)) for name, place in lacking.items()]
        )
    return list(by) or list(dict.fromkeys(limited)) or [name for name in sides.a.listed if name in held]


def _share(sides: Sides, name: str, level: float, confidence: float) -> dict[str, object]:
    a, b, unit = sides.load(name)
    found = difference.shares(a, b, [level], sides.paired, confidence, sides.iid)
    values = {key: value if key == "n" else value[0] for key, value in found._asdict().items()}
    return {"load": name, "unit": unit, "level": level, **values}


def _load(sides: Sides, name: str, confidence: float) -> list[dict[str, object]]:
    a, b, unit = sides.load(name)
    found = {"mean": difference.means(a, b, sides.paired, confidence, sides.iid)}
    for share in SHARES:
        found[f"{100 * share:g} %"] = difference.quantiles(a, b, share, sides.paired, confidence, sides.iid)
    return [{"load": name, "unit": unit, "statistic": key, **value._asdict()} for key, value in found.items()]


def _switched(sides: Sides, name: str, level: float) -> pd.DataFrame:
    a, b, unit = sides.load(name)
    here = np.isfinite(a) & np.isfinite(b) & ((a > level) != (b > level))
    table = pd.DataFrame({"row": sides.rows[here], "load": name, "unit": unit, "level": level})
    return table.assign(a=a[here], b=b[here])
