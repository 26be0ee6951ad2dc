"""Rating life of the needle bearings of a campaign's joints (docs/model.md, Bearing life)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tolstat.analysis import accuracy
from tolstat.analysis.exceedance import FloatArray
from tolstat.analysis.rating_life import basic_life, system_life, turns_per_revolution
from tolstat.common.errors import Fault, StoreError
from tolstat.common.shown import shown
from tolstat.common.tables import LIFE_EXPONENT, PINS, VALID, Mode
from tolstat.display import text
from tolstat.joint import Bearing
from tolstat.store.error_budget import total_interval
from tolstat.store.recorded import joint_of
from tolstat.store.sample_load import SampleLoad
from tolstat.store.view import View

JOINT = "joint"
PLACES = (*PINS, JOINT)
"""Bearings, named by their pins, and the joint: it lasts until the first of its four bearings fails."""
SHARES = (0.5, 0.9, 0.99)
"""Shares of the joints that reach a life."""
HOUR = 3600.0
ANY = "any"
"""At least one of the four bearings."""
MOSTLY = 0.5
"""Share of a revolution above which a bearing counts as loaded in a mode."""
LOADED = {"one_end": Mode.ONE_POINT, "opposite_ends": Mode.TWO_POINT, "along": Mode.UNIFORM}
"""Contact mode of each way to load a bearing."""


@shown
@dataclass(frozen=True, eq=False)
class Lives:
    """Rating lives of n joints.

    Attributes
    ----------
    name : str
        Name of the study.
    bearing : Bearing
        Section ``[bearing]`` of the joint.
    loads : ndarray, shape (n, 4)
        Dynamic equivalent load of each pin's bearing, N; NaN without a result.
    hours : ndarray, shape (n, 5)
        Life of each bearing and of the joint, as in `PLACES`, h; NaN without a result or without a rating.
    nominal_loads, nominal_hours : ndarray, shape (4,) and (5,)
        The same of the nominal joint; NaN if there is none.
    unrated : int
        Valid joints without a rating: their misalignment is below ``bearing.critical_amplitude``.
    load_error : float
        Relative numerical error of an equivalent load that 95 % of the checked joints stay below; NaN if unknown.
    status : ndarray, shape (n,)
        `tables.Status` of each joint.
    weights : ndarray, shape (n,), optional
        Weight of each joint; without it all joints count equally.
    iid : bool
        Whether the joints are independent samples.
    """

    name: str
    bearing: Bearing
    loads: FloatArray
    hours: FloatArray
    nominal_loads: FloatArray
    nominal_hours: FloatArray
    unrated: int
    load_error: float
    status: NDArray[np.uint8]
    weights: FloatArray | None
    iid: bool

    @property
    def valid(self) -> int:
        """Number of joints with a valid result."""
        return int(np.isin(self.status, VALID).sum())

    @property
    def required(self) -> float:
        """Required life, h; NaN if none is given."""
        return np.nan if self.bearing.required_life is None else self.bearing.required_life / HOUR

    def rate(self, place: str) -> SampleLoad:
        """Reciprocal of the life of a bearing or of the joint, 1/h: as with a load, higher is worse."""
        k = PLACES.index(place)
        with np.errstate(divide="ignore"):
            return self._load(place, "1/h", 1.0 / self.nominal_hours[k], 1.0 / self.hours[:, k])

    def load(self, pin: str) -> SampleLoad:
        """Dynamic equivalent load of a pin's bearing, N."""
        k = PINS.index(pin)
        return self._load(pin, "N", float(self.nominal_loads[k]), self.loads[:, k])

    def _load(self, name: str, unit: str, nominal: float, values: FloatArray) -> SampleLoad:
        return SampleLoad(name, unit, None, nominal, values, (values, values), self.status, self.weights, self.iid)


def bearing_of(view: View) -> Bearing | None:
    """Section ``[bearing]`` of the joint of a file, if it has one."""
    return joint_of(view.store, 0).bearing


def keeps_loads(view: View) -> bool:
    """Whether the study keeps the equivalent loads of all pins."""
    return sum(column.field == "equivalent_load" for column in view.columns) == len(PINS)


def lives_of(view: View) -> Lives:
    """Rating lives of the joints of a campaign.

    Parameters
    ----------
    view : View
        Joints drawn from tolerances, of a study whose joint has a section ``[bearing]``.

    Raises
    ------
    StoreError
        When the joint has no such section, the equivalent loads are not kept, or the joints are no sample.
    """
    view.check_sample()
    bearing = bearing_of(view)
    if bearing is None:
        remedy = (
            "add the section [bearing] to the joint file or [joint.bearing] to the study, then repeat tolstat run: "
            "no joint is simulated again"
        )
        raise StoreError(str(Fault(str(view.path), "holds a joint without bearings", remedy)))
    if not keeps_loads(view):
        remedy = 'add "pin*.equivalent_load" to [output] results of the study'
        raise StoreError(str(Fault(str(view.path), "does not keep the equivalent loads of the bearings", remedy)))
    loads = view.read_results(("equivalent_load",))["equivalent_load"]
    operation = view.errors(np.arange(view.n), ("operation.alpha", "operation.speed"))
    nominal_loads, nominal_hours = np.full(len(PINS), np.nan), np.full(len(PLACES), np.nan)
    if len(view.nominal):
        nominal_loads = view.nominal["equivalent_load"][0]
        nominal_hours = _hours(view.nominal["equivalent_load"], view.store.errors(slice(0, 1)), bearing)[0]
    unrated = np.isin(view.status, VALID) & _unrated(operation, bearing)
    return Lives(
        name=view.name,
        bearing=bearing,
        loads=loads,
        hours=_hours(loads, operation, bearing),
        nominal_loads=nominal_loads,
        nominal_hours=nominal_hours,
        unrated=int(unrated.sum()),
        load_error=load_error(view),
        status=view.status,
        weights=view.weights,
        iid=view.iid,
    )


def _unrated(operation: NDArray[np.void], bearing: Bearing) -> NDArray[np.bool_]:
    return np.asarray(np.abs(operation["operation.alpha"]) < bearing.critical_amplitude * (1.0 - 1e-9))


def _hours(loads: FloatArray, operation: NDArray[np.void], bearing: Bearing) -> FloatArray:
    """Lives of bearings and joint, (m, 5), h, from equivalent loads (m, 4) and a table with the columns of ERROR."""
    turns = turns_per_revolution(operation["operation.alpha"])
    hourly = np.abs(operation["operation.speed"]) / (2.0 * np.pi) * turns * HOUR
    with np.errstate(divide="ignore"):
        pins = bearing.factor * basic_life(loads, bearing.C) / hourly[:, None]
    hours = np.column_stack([pins, system_life(pins)])
    hours[_unrated(operation, bearing)] = np.nan
    return hours


def load_error(view: View) -> float:
    """Relative numerical error of an equivalent load, `analysis.accuracy.USUAL` of the checked joints; NaN if unknown.

    It is estimated as that of largest loads (`analysis.accuracy.estimate`); the largest of the four bearings counts.
    """
    if view.verification is None:
        return np.nan
    base = view.verification.base
    changes = {
        name: np.where(
            np.isin(base["status"], VALID)[:, None],
            base["equivalent_load"] / check.results["equivalent_load"] - 1.0,
            np.nan,
        )
        for name, check in view.verification.checks.items()
    }
    return accuracy.spread(accuracy.estimate(changes).max(axis=1)).usual


def quantiles(lives: Lives, shares: Sequence[float] = SHARES, confidence: float = 0.95) -> pd.DataFrame:
    """Life that a share of the joints reaches, and the equivalent load that it stays below.

    Parameters
    ----------
    lives : Lives
        Lives of the joints.
    shares : sequence of float
        Shares of the joints, each between 0 and 1.
    confidence : float
        Confidence level of the intervals.

    Returns
    -------
    DataFrame
        One row per place of `PLACES` and share: ``place``, ``share``; lives in h: ``nominal``, ``estimate``, ``lower``,
        ``upper``, ``bound_lower``, ``bound_upper`` (joints without a life among the shortest, the longest); ``rating``
        (N, load rating C with which the share reaches the required life) with ``_lower`` and ``_upper``;
        ``nominal_load`` and ``load`` (N, equivalent load that the share of the joints stays at or below; NaN for the
        joint); ``n``, ``n_failed`` (those without a rating included), ``n_unsettled``, ``confidence``. Ends are 0 or
        infinite where the joints are too few.
    """
    rows = []
    for place in PLACES:
        rate = lives.rate(place)
        for share in shares:
            q = rate.quantile(share, confidence)
            load = lives.load(place) if place in PINS else None
            rows.append(
                {
                    "place": place,
                    "share": share,
                    "nominal": _life(rate.nominal),
                    "estimate": _life(q.estimate),
                    "lower": _life(q.upper),
                    "upper": _life(q.lower),
                    "bound_lower": _life(q.bound_upper),
                    "bound_upper": _life(q.bound_lower),
                    "rating": _rating(q.estimate, lives),
                    "rating_lower": _rating(q.lower, lives),
                    "rating_upper": _rating(q.upper, lives),
                    "nominal_load": load.nominal if load else np.nan,
                    "load": load.quantile(share).estimate if load else np.nan,
                    "n": q.n,
                    "n_failed": q.n_failed,
                    "n_unsettled": q.n_unsettled,
                    "confidence": confidence,
                }
            )
    return pd.DataFrame(rows)


def _rating(rate: float, lives: Lives) -> float:
    """Load rating, N, of bearings with which a life of so many 1/h becomes the required one."""
    return float(lives.bearing.C * (max(rate, 0.0) * lives.required) ** (1.0 / LIFE_EXPONENT))


def _life(rate: float) -> float:
    """Reciprocal, h; a rate of zero or of no joint (-inf) is an infinite life."""
    return np.inf if rate <= 0.0 else 1.0 / rate


def below(lives: Lives, confidence: float = 0.95) -> pd.DataFrame:
    """Share of the joints whose life is below the required one.

    Returns
    -------
    DataFrame
        One row per place of `PLACES`: ``place``, ``required`` (h), the fields of `analysis.exceedance.Exceedance` but
        its level (``count`` are the joints below the required life; bounds have joints without a life above and
        below), ``total_lower`` and ``total_upper`` (cover sampling, joints without a life and, if known, the numerical
        error), ``confidence``. No rows without a required life.
    """
    rows = []
    for place in PLACES if np.isfinite(lives.required) else ():
        rate, level = lives.rate(place), 1.0 / lives.required
        found = asdict(rate.above(level, confidence))
        low, high = total_interval(rate, _with_error(rate, lives.load_error), level, confidence)
        del found["level"]
        head = {"place": place, "required": lives.required}
        rows.append(head | found | {"total_lower": low, "total_upper": high, "confidence": confidence})
    return pd.DataFrame(rows)


def _with_error(rate: SampleLoad, error: float) -> tuple[SampleLoad, SampleLoad] | None:
    """Rates with equivalent loads reduced and increased by their numerical error; None if it is unknown."""
    if np.isnan(error):
        return None
    factors = (max(0.0, 1.0 - error) ** LIFE_EXPONENT, (1.0 + error) ** LIFE_EXPONENT)
    low, high = (replace(rate, values=f * rate.values, ends=(f * rate.ends[0], f * rate.ends[1])) for f in factors)
    return low, high


def contacts(view: View, confidence: float = 0.95) -> pd.DataFrame:
    """Share of the joints in which a bearing is mostly loaded at one end, at opposite ends, or along its length.

    Returns
    -------
    DataFrame
        One row per pin, and one for `ANY` of them: ``place``; ``one_end``, ``opposite_ends`` and ``along``, shares of
        the joints in which this holds for more than `MOSTLY` of a revolution, with ``_lower`` and ``_upper``.
        No rows if the study does not keep the contact modes.
    """
    if sum(column.field == "mode_share" for column in view.columns) < len(PINS) * len(Mode):
        return pd.DataFrame()
    spent = view.read_results(("mode_share",))["mode_share"]
    rows = []
    for place in (*PINS, ANY):
        own = spent[:, [PINS.index(place)]] if place in PINS else spent
        row: dict[str, Any] = {"place": place}
        for name, mode in LOADED.items():
            values = own[:, :, mode].max(axis=1)
            load = SampleLoad(name, "1", None, np.nan, values, (values, values), view.status, view.weights, view.iid)
            found = load.above(MOSTLY, confidence)
            row |= {name: found.estimate, f"{name}_lower": found.lower, f"{name}_upper": found.upper}
        rows.append(row)
    return pd.DataFrame(rows)


def summary(view: View, confidence: float) -> dict[str, Any]:
    """JSON value ``bearing_life`` with the rows of `quantiles`, `below` and `contacts`; empty without bearings."""
    if not (view.sampled and bearing_of(view) is not None and keeps_loads(view)):
        return {}
    lives = lives_of(view)
    return {
        "bearing_life": {
            "symbol": lives.bearing.symbol,
            "critical_amplitude": lives.bearing.critical_amplitude,
            "unrated": lives.unrated,
            "load_error": None if np.isnan(lives.load_error) else lives.load_error,
            "lives": text.records(quantiles(lives, confidence=confidence)),
            "below_required": text.records(below(lives, confidence)),
            "contacts": text.records(contacts(view, confidence)),
        }
    }
