"""Lives of bearings from what joints have at each operating point (Palmgren 1924, Miner 1945; ISO 281)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import rating_life
from tolstat.common.load_kinds import RESULTANT
from tolstat.common.loads import FloatArray
from tolstat.common.tables import LIFE_EXPONENT
from tolstat.joint import Bearing
from tolstat.store import Reader, recorded

HOUR = 3600.0


OF_BEARINGS = ("equivalent_load", "tilt", "line_load", "contact_max")
"""Fields of the results on bearings."""


def turning_of(store: Reader) -> dict[str, FloatArray]:
    """Fields `OF_BEARINGS` (n, pins, ...), ``omega`` (n,), of Cardan joints ``alpha`` (n, joints), of a file."""
    operation = recorded.operating_points(store)
    alpha = [operation["alpha"]] if "alpha" in operation else []
    if store.mechanism.is_shaft:
        alpha.append(store.operation.alphas[1] + store.errors(slice(None), ("shaft.alpha",))["shaft.alpha"])
    results = store.results(slice(None), OF_BEARINGS)
    of_bearings = {name: results[name] for name in OF_BEARINGS}
    return of_bearings | {"omega": operation["speed"], "alpha": np.transpose(alpha)}


def largest(bearings: Sequence[Bearing], turning: Sequence[Mapping[str, FloatArray]]) -> dict[str, FloatArray]:
    """Largest ``tilt`` (rad) and ``pressure`` (Pa), and static ``safety`` C0/P0, over the operating points, (n, pins).

    The pressure is Hertz's of the most loaded lamina on the pin, without the stress at the ends of a needle (ISO/TS
    16281:2008). P0 is the largest resultant force (ISO 76).
    """
    tilt, line = (np.max([each[name] for each in turning], axis=0) for name in ("tilt", "line_load"))
    force = np.max([each["contact_max"][:, :, RESULTANT] for each in turning], axis=0)
    pins = force.shape[1] // len(bearings)
    C0, D, d = (
        np.repeat(values, pins)
        for values in np.transpose([(b.static_rating, b.needle_diameter, b.pitch_diameter) for b in bearings])
    )
    with np.errstate(divide="ignore"):
        return {"tilt": tilt, "pressure": rating_life.line_pressure(line, D, d - D), "safety": C0 / force}


class Rated(NamedTuple):
    """Lives of n joints, and where they are used up.

    Attributes
    ----------
    load : ndarray, shape (n, pins)
        Equivalent load over the duty cycle, N.
    hours : ndarray, shape (n, places)
        Life of each bearing, of each joint of a drive shaft, and of the whole, h; NaN without a rating.
    used : ndarray, shape (points, n)
        Share of the life of the whole that each operating point uses up: of each bearing by Miner's rule, and of all by
        what they contribute to the rate of failures, L^-e; NaN without a rating.
    small : list of ndarray, shape (points, n, pins)
        Whether a bearing swings by less than its critical amplitude, and by less than `rating_life.FRETTING` of it.
    """

    load: FloatArray
    hours: FloatArray
    used: FloatArray
    small: list[NDArray[np.bool_]]


def rated(bearings: Sequence[Bearing], duty: FloatArray, turning: Sequence[Mapping[str, FloatArray]]) -> Rated:
    """Lives of joints by what they have at each operating point.

    Parameters
    ----------
    bearings : sequence of Bearing
        Bearing of the pins of each joint.
    duty : ndarray, shape (points,)
        Share of the service time at each operating point.
    turning : sequence of mapping
        Loads, speeds and misalignments at each operating point, see `turning_of`.
    """
    loads = np.stack([each["equivalent_load"] for each in turning])
    speeds = np.abs([each["omega"] for each in turning])[:, :, None]
    joints = np.abs([each["alpha"] for each in turning])
    pins = loads.shape[2] // joints.shape[2]
    swings = np.repeat(joints, pins, axis=2)
    critical, factor, C = (
        np.repeat(np.array([getattr(bearing, name) for bearing in bearings], float), pins)
        for name in ("critical_amplitude", "factor", "dynamic_rating")
    )
    hourly = duty[:, None, None] * speeds / (2.0 * np.pi) * rating_life.turns_per_revolution(swings, critical) * HOUR
    turns = hourly.sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        turned = np.where(turns > 0.0, hourly / turns, duty[:, None, None])
        largest = loads.max(axis=0)
        relative = np.where(largest > 0.0, loads / largest, 0.0 * loads)
        damage = turned * relative**LIFE_EXPONENT
        load = largest * damage.sum(axis=0) ** (1.0 / LIFE_EXPONENT)
        of_pins = factor * rating_life.basic_life(load, C) / turns
    small = [np.asarray(swings < part * critical * (1.0 - 1e-9)) for part in (1.0, rating_life.FRETTING)]
    of_pins[small[1].all(axis=0)] = np.nan
    of_joints = np.split(of_pins, joints.shape[2], axis=1) if joints.shape[2] > 1 else []
    hours = np.column_stack([of_pins, *map(rating_life.system_life, (*of_joints, of_pins))])
    with np.errstate(divide="ignore", invalid="ignore"):
        rates = of_pins**-rating_life.WEIBULL_SLOPE
        used = (damage / damage.sum(axis=0).clip(1e-300) * rates).sum(axis=2) / rates.sum(axis=1)
    return Rated(load, hours, used, small)
