"""Rating life of the bearings of each joint of a campaign (docs/model.md, Bearing life)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import accuracy
from tolstat.analysis.design import Design
from tolstat.analysis.rating_life import basic_life, system_life, turns_per_revolution
from tolstat.analysis.sample import Sample
from tolstat.common.errors import Fault, NotApplicable, StoreError
from tolstat.common.load_kinds import PINS
from tolstat.common.loads import FloatArray
from tolstat.common.tables import LIFE_EXPONENT, VALID
from tolstat.joint import Bearing, operating
from tolstat.joint.bearing import FOR_LIFE
from tolstat.store import points
from tolstat.store.recorded import joint_of
from tolstat.store.view import View

JOINT = "joint"
PLACES = (*PINS, JOINT)
"""Bearings, named by their pins, and the joint: it lasts until the first of its four bearings fails."""
HOUR = 3600.0
OPERATION = ("operation.alpha", "operation.speed", "operation.torque")


@dataclass(frozen=True, eq=False)
class Lives:
    """Rating lives of n joints.

    Attributes
    ----------
    bearing : Bearing
        Section ``[bearing]`` of the joint.
    duty : dict of str to float
        Share of the service time at each operating point; their sum is 1.
    loads : ndarray, shape (n, 4)
        Dynamic equivalent load of each pin's bearing over the duty cycle, N; NaN without a result.
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
    design : Design
        How the joints were drawn.
    """

    bearing: Bearing
    duty: Mapping[str, float]
    loads: FloatArray
    hours: FloatArray
    nominal_loads: FloatArray
    nominal_hours: FloatArray
    unrated: int
    load_error: float
    status: NDArray[np.uint8]
    design: Design

    @property
    def valid(self) -> int:
        """Number of joints with a valid result."""
        return int(np.isin(self.status, VALID).sum())

    @property
    def required(self) -> float:
        """Required life, h; NaN if none is given."""
        return np.nan if self.bearing.required_life is None else self.bearing.required_life / HOUR

    def rate(self, place: str) -> Sample:
        """Reciprocal of the life of a bearing or of the joint, 1/h: as with a load, higher is worse."""
        k = PLACES.index(place)
        with np.errstate(divide="ignore"):
            nominal, values = 1.0 / self.nominal_hours[k], 1.0 / self.hours[:, k]
        return Sample.of(values, self.status, self.design, name=place, unit="1/h", nominal=nominal)

    def load(self, pin: str) -> Sample:
        """Dynamic equivalent load of a pin's bearing, N."""
        k = PINS.index(pin)
        nominal, values = float(self.nominal_loads[k]), self.loads[:, k]
        return Sample.of(values, self.status, self.design, name=pin, unit="N", nominal=nominal)


def lives_of(view: View) -> Lives:
    """Rating lives of the joints of a campaign.

    Parameters
    ----------
    view : View
        Joints drawn from tolerances, of a study whose joint has a section ``[bearing]``; its operating points are a
        duty cycle.

    Raises
    ------
    NotApplicable
        When the joint has no such section.
    StoreError
        When the section lacks a key, the equivalent loads are not kept, or the joints are no sample.
    InputError
        When the view has several operating points, and the study does not give their shares of the time.
    """
    view.check("quantile")
    bearing = _bearing(view)
    duty = points.shares_of_time(view).tolist()
    samples = np.arange(view.n)
    operation = [operating(part.store.operation, part.errors(samples, OPERATION)) for part in view.parts]
    results = [part.read_results(("equivalent_load",)) for part in view.parts]
    loads, hours = _lives(duty, results, operation, bearing)
    nominal_loads, nominal_hours = np.full(len(PINS), np.nan), np.full(len(PLACES), np.nan)
    if len(view.nominal):
        ideal = [operating(part.store.operation, part.store.errors(slice(0, 1))) for part in view.parts]
        found = _lives(duty, [part.nominal for part in view.parts], ideal, bearing)
        nominal_loads, nominal_hours = found[0][0], found[1][0]
    return Lives(
        bearing=bearing,
        duty=dict(zip(view.points, duty, strict=True)),
        loads=loads,
        hours=hours,
        nominal_loads=nominal_loads,
        nominal_hours=nominal_hours,
        unrated=int((np.isin(view.status, VALID) & _unrated(operation, bearing)).sum()),
        load_error=_load_error(view),
        status=view.status,
        design=view.design,
    )


def _bearing(view: View) -> Bearing:
    """Section ``[bearing]`` of the joint of a file, with all that a life needs."""
    bearing, place = joint_of(view.store, 0).bearing, str(view.path)
    again = "then repeat tolstat run: no joint is simulated again"
    if bearing is None:
        remedy = f"add the section [bearing] to the joint file or [joint.bearing] to the study, {again}"
        raise NotApplicable(str(Fault(place, "holds a joint without bearings", remedy)))
    if lacking := bearing.lacking(FOR_LIFE):
        found = f"holds bearings without {', '.join(lacking)}, which a rating life needs"
        raise StoreError(str(Fault(place, found, f"add to [bearing] of the joint, {again}")))
    if sum(column.field == "equivalent_load" for column in view.columns) < len(PINS):
        remedy = 'add "pin*.equivalent_load" to [output] results of the study'
        raise StoreError(str(Fault(place, "does not keep the equivalent loads of the bearings", remedy)))
    return bearing


def _unrated(operation: Sequence[Mapping[str, FloatArray]], bearing: Bearing) -> NDArray[np.bool_]:
    """Whether a joint swings too little for a rating, at one operating point at least, (m,)."""
    least = np.min([np.abs(own["alpha"]) for own in operation], axis=0)
    return np.asarray(least < bearing.critical_amplitude * (1.0 - 1e-9))


def _lives(
    duty: Sequence[float],
    results: Sequence[NDArray[np.void]],
    operation: Sequence[Mapping[str, FloatArray]],
    bearing: Bearing,
) -> tuple[FloatArray, FloatArray]:
    """Equivalent loads, (m, 4), N, and lives of bearings and joint, (m, 5), h, over a duty cycle.

    Operating points count by the turns that the bearings make there (Palmgren 1924, Miner 1945; ISO 281).

    Parameters
    ----------
    duty : sequence of float
        Share of the time at each operating point; the sum is 1.
    results : sequence of ndarray, shape (m,)
        Tables with ``equivalent_load``, (m, 4), N, at each point.
    operation : sequence of mapping
        ``alpha`` (rad) and ``speed`` (rad/s) of the joints at each point, (m,).
    bearing : Bearing
        The bearings.
    """
    loads = np.stack([table["equivalent_load"] for table in results])
    hourly = np.stack(
        [
            share * np.abs(own["speed"]) / (2.0 * np.pi) * turns_per_revolution(own["alpha"]) * HOUR
            for share, own in zip(duty, operation, strict=True)
        ]
    )
    turns = hourly.sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        weights = np.where(turns > 0.0, hourly / turns, np.array(duty)[:, None])[:, :, None]
        largest = loads.max(axis=0)
        relative = np.where(largest > 0.0, loads / largest, 0.0 * loads)
        load = largest * (weights * relative**LIFE_EXPONENT).sum(axis=0) ** (1.0 / LIFE_EXPONENT)
        pins = bearing.factor * basic_life(load, bearing.C) / turns[:, None]
    hours = np.column_stack([pins, system_life(pins)])
    hours[_unrated(operation, bearing)] = np.nan
    return load, hours


def _load_error(view: View) -> float:
    """Relative numerical error of an equivalent load, `analysis.accuracy.USUAL` of the checked joints; NaN if unknown.

    It is estimated as that of largest loads (`analysis.accuracy.estimate`); the largest of the four bearings counts.
    """
    if view.verification is None:
        return np.nan
    base = view.verification.base
    valid = np.isin(base["status"], VALID)[:, None]
    changes = {
        name: np.where(valid, base["equivalent_load"] / check.results["equivalent_load"] - 1.0, np.nan)
        for name, check in view.verification.checks.items()
    }
    return accuracy.spread(accuracy.estimate(changes).max(axis=1)).usual
