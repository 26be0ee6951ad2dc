"""Fatigue of the parts: stress cycles at their points, damage, life, and the share that fails in the service life."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import prediction, strength
from tolstat.analysis.cycles import Cycles, duty_cycle
from tolstat.analysis.sample import Sample
from tolstat.common import bisection, channels
from tolstat.common.errors import Fault, InputError
from tolstat.common.loads import FloatArray
from tolstat.common.tables import FAILED, Status
from tolstat.display.table import Rows
from tolstat.questions.fatigue import duty
from tolstat.solver import histories
from tolstat.store import reader, revolutions
from tolstat.store.view import View
from tolstat.study.fatigue import Fatigue, StressPoint

SHARE = 0.1
"""Share of the parts that have failed at the end of the life given, B10."""
LONGEST = 1e12
"""Lives beyond so many service lives are given as infinite."""


class Stresses(NamedTuple):
    """Stresses of joints at the p places of all points over a revolution, or over a mixture of revolutions.

    Attributes
    ----------
    cycles : Cycles
        Rainflow cycles, Pa; its channels are the name of the point of each place. NaN for a joint that has not settled.
    low, high : ndarray, shape (n, p)
        Smallest and largest stress, Pa, at all operating points together.
    """

    cycles: Cycles
    low: FloatArray
    high: FloatArray

    def rows(self, joints: slice) -> Stresses:
        """Select joints."""
        return Stresses(self.cycles.rows(joints), self.low[joints], self.high[joints])


@dataclass(frozen=True)
class Stressed(duty.Joints):
    """Stresses of joints.

    Attributes
    ----------
    own : Stresses
        Stresses of the n samples.
    nominal : Stresses
        Stresses of the nominal joint; no rows if there is none that settled.
    apart : float
        As in `revolutions.Revolutions`.
    """

    own: Stresses
    nominal: Stresses
    apart: float


def load_stresses(views: Sequence[View], shares: Sequence[float] | None = None, samples: int | None = None) -> Stressed:
    """Stress cycles of a campaign, or of the same joints in several campaigns that make up a duty cycle.

    The stress of each point is formed from the load components at each input angle before cycles are counted. Where a
    file holds no load histories, its joints are simulated again.

    Parameters
    ----------
    views : sequence of View
        One campaign, or the same joints in several, see `duty.members`. The study of the first has
        ``[fatigue.point]``.
    shares : sequence of float, optional
        Share of the revolutions in each of several campaigns; the sum is 1.
    samples : int, optional
        Number of samples, from the first; by default all.

    Raises
    ------
    InputError
        When the study has no points, the shares are not shares, or the campaigns have different joints.
    StoreError
        When a file holds joints that are no sample of a production.
    """
    views, shares = duty.members(views, shares)
    joints = duty.joints_of(views, shares, samples)
    if not joints.settings.points:
        remedy = 'add [fatigue.point."NAME"] to the study, and run it again; no joint is simulated anew'
        raise InputError([Fault(str(views[0].path), "its study names no point of a part", remedy)])
    # row 0 is the nominal joint of a duty cycle, if it has settled at all operating points
    both = int(all((view.nominal["status"] == Status.OK).any() for view in views))
    rows = np.append(np.zeros(both, np.intp), 1 + np.flatnonzero(joints.valid))
    slots = [np.append(view.nominal_slots[:both], view.slots(rows[both:] - 1)) for view in views]
    settled = [stresses_of(view.store, those, joints.settings.points) for view, those in zip(views, slots, strict=True)]
    parts = [_spread(stresses, rows, 1 + joints.status.size) for stresses, _ in settled]
    low, high = (np.stack([getattr(part, end) for part in parts], axis=2) for end in ("low", "high"))
    mixed = duty_cycle([part.cycles for part in parts], shares, joints.transitions(low, high))
    whole = Stresses(mixed, low.min(axis=2), high.max(axis=2))
    apart = max(difference for _, difference in settled)
    return Stressed(**vars(joints), own=whole.rows(slice(1, None)), nominal=whole.rows(slice(both)), apart=apart)


def stresses_of(store: reader.Reader, slots: NDArray[np.intp], points: Sequence[StressPoint]) -> tuple[Stresses, float]:
    """Stresses of settled joints over one revolution, and `Revolutions.apart`.

    Parameters
    ----------
    store : ResultFile
        The campaign.
    slots : ndarray of int, shape (m,)
        File slots, ascending.
    points : sequence of StressPoint
        Points of the parts.
    """
    places = [(point, np.array(factors)) for point in points for factors in point.per_load]
    low, high = np.zeros((2, len(slots), len(places)))
    counted: list[tuple[FloatArray, FloatArray]] = []
    apart = 0.0
    for part, components, difference in revolutions.of_components(store, slots, [channels.BUSHING_LOADS]):
        apart, loads = max(apart, difference), components[channels.BUSHING_LOADS.name]
        signals, noise = zip(*(_signal(loads, *place) for place in places), strict=True)
        low[part], high[part] = (np.stack([end(s, axis=1) for s in signals], axis=1) for end in (np.min, np.max))
        for joint in range(len(loads)):
            counted += [histories.periodic(s[joint], gate[joint]) for s, gate in zip(signals, noise, strict=True)]
    number = np.array([len(ranges) for ranges, _ in counted], float).reshape(low.shape)
    table = np.zeros((2, len(counted), max(1, int(number.max(initial=0.0)))))
    for i, joint_cycles in enumerate(counted):
        table[:, i, : len(joint_cycles[0])] = joint_cycles
    names = tuple(point.name for point, _ in places)
    ranges, means = table.reshape(2, *low.shape, -1)
    return Stresses(Cycles.of_revolution(names, ranges, means, number), low, high), apart


def _signal(loads: NDArray[np.floating], point: StressPoint, factors: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Stress over the revolution, (m, samples), and the range up to which cycles may be numerical noise, (m,), Pa."""
    at_bushing = loads[:, :, channels.BUSHING_LOADS.places.index(point.bushing)].astype(float)
    return at_bushing @ factors, histories.GATE * np.max(np.abs(at_bushing) @ np.abs(factors), axis=1)


def _spread(part: Stresses, rows: NDArray[np.intp], n: int) -> Stresses:
    """Put joints in rows of a table of n joints; NaN in the others."""

    def spread(values: FloatArray) -> FloatArray:
        table = np.full((n, *values.shape[1:]), np.nan)
        table[rows] = values
        return table

    cycles = part.cycles
    ranges, means, number = map(spread, (cycles.ranges, cycles.means, cycles.number))
    return Stresses(Cycles.of_revolution(cycles.channels, ranges, means, number), spread(part.low), spread(part.high))


class Evaluated(NamedTuple):
    """Stress cycles of the joints at one point in the service life, and its S–N line."""

    collective: strength.Collective
    line: strength.Line


def part_failures(stressed: Stressed, delivery: int = prediction.DELIVERY) -> Rows:
    """Damage, life and probability of failure at each point of the parts.

    Parameters
    ----------
    stressed : Stressed
        Stress cycles of the joints, from `load_stresses`.
    delivery : int
        Number of joints of the next delivery.

    Returns
    -------
    sequence of mapping
        One row per point, and one for all of them if there are several (the strengths of two points are independent):
        ``point``, ``bushing``, fields of `analysis.strength.Line` (S_D in Pa); ``nominal``, ``median``, ``upper_99``
        (damage sum at the median strength: of the nominal joint, and not exceeded by half and by 99 % of the joints);
        ``life`` (revolutions after which a tenth of the parts has failed), ``life_lower``, ``life_upper`` (joints
        without a valid load counted both ways); ``nominal_failures`` (share of the parts that fail in the nominal
        joint); the fields of `analysis.strength.Failures`, ``confidence``, ``next_lower`` and
        ``next_upper`` (prediction interval for the failures in the next delivery).
    """
    points, nominal = (evaluated(stresses, stressed.settings) for stresses in (stressed.own, stressed.nominal))
    heads = [_damage(stressed, p, points[p], nominal[p]) for p in range(len(points))]
    groups = [slice(p, p + 1) for p in range(len(points))]
    if len(points) > 1:
        heads.append({"point": duty.ANY, "bushing": ""} | dict.fromkeys(list(heads[0])[2:], np.nan))
        groups.append(slice(None))
    rows = []
    for head, group in zip(heads, groups, strict=True):
        wide = failures(stressed, points[group], confidence=prediction.half(duty.CONFIDENCE))
        following = prediction.of_share(wide.outer_lower, wide.outer_upper, delivery, duty.CONFIDENCE)
        head |= prediction.columns(following, delivery) | _life(stressed, points[group])
        head |= {"nominal_failures": duty.only(_chances(nominal[group]))} | failures(stressed, points[group])._asdict()
        rows.append(head | {"confidence": duty.CONFIDENCE})
    return rows


def failures_over_life(stressed: Stressed, revolutions: Sequence[float]) -> list[strength.Failures]:
    """Share of the joints with a failed part at any point after numbers of revolutions."""
    points = evaluated(stressed.own, stressed.settings)
    return [failures(stressed, points, number / stressed.settings.revolutions) for number in revolutions]


def failures(
    stressed: Stressed, points: Sequence[Evaluated], lives: float = 1.0, confidence: float = duty.CONFIDENCE
) -> strength.Failures:
    """Share of the joints of which a part has failed at any of some points after so many service lives.

    Joints that are not settled, or never repeat, have no stresses.
    """
    done = stressed.status != Status.PENDING
    n_failed, n_without = int(np.isin(stressed.status, FAILED).sum()), int((done & ~stressed.valid).sum())
    has_interval = stressed.design.has_interval("mean")
    return strength.failures(_chances(points, lives)[done], n_failed, n_without - n_failed, confidence, has_interval)


def _chances(points: Sequence[Evaluated], lives: float = 1.0) -> FloatArray:
    """Probability of each joint that a part has failed after so many service lives, (n,); NaN without stresses."""
    survive = np.zeros(len(points[0].collective.knots))  # logarithm of the probability
    with np.errstate(divide="ignore"):
        for collective, line in points:
            factor = strength.critical_factor(collective, line, lives)
            survive += np.log1p(-strength.probability(factor, line.T_S))
    return -np.expm1(survive)


def evaluated(stresses: Stresses, settings: Fatigue) -> list[Evaluated]:
    """Cycles in the service life at each point, each at the stress ratio of the point's S–N line.

    Of several places around a section each joint has those of the one at which it fails first.
    """
    collectives, begin = [], 0
    for point in settings.points:
        end = begin + len(point.per_load)
        places = [_in_service(stresses, place, point.line, settings) for place in range(begin, end)]
        collectives.append(Evaluated(strength.weakest(places, point.line), point.line))
        begin = end
    return collectives


def _in_service(stresses: Stresses, place: int, line: strength.Line, settings: Fatigue) -> strength.Collective:
    """Cycles of the joints at one place in the service life.

    A start goes from the unstressed joint to the extremes of the revolution and back; its cycle, between the extremes
    and zero, takes the place of the largest cycle of one revolution.
    """
    cycles = stresses.cycles
    ranges, means = cycles.ranges[:, place], cycles.means[:, place]
    numbers = cycles.repeats[:, place] * settings.revolutions
    if settings.starts:
        joints = np.arange(len(ranges))
        numbers[joints, np.argmax(np.nan_to_num(ranges), axis=1)] -= settings.starts
        numbers = np.maximum(numbers, 0.0)
        low, high = np.minimum(stresses.low[:, place], 0.0), np.maximum(stresses.high[:, place], 0.0)
        ranges, means = np.column_stack([ranges, high - low]), np.column_stack([means, 0.5 * (high + low)])
        numbers = np.column_stack([numbers, np.full(len(ranges), settings.starts)])
    return strength.sort_out(strength.at_ratio(ranges, means, line.M, line.R), numbers, line)


def _damage(stressed: Stressed, p: int, joints: Evaluated, nominal: Evaluated) -> dict[str, Any]:
    """Damage sums at a point, of the nominal joint and over the joints."""
    point = stressed.settings.points[p]
    sample = Sample.of(strength.damage_at(*joints), stressed.status, stressed.design)
    head = {"point": point.name, "bushing": point.bushing, **point.line._asdict()}
    head["nominal"] = duty.only(strength.damage_at(*nominal))
    return head | {name: sample.quantile(share).estimate for name, share in (("median", 0.5), ("upper_99", 0.99))}


def _life(stressed: Stressed, points: Sequence[Evaluated]) -> dict[str, float]:
    """Revolutions after which a share `SHARE` of the parts has failed, with the ends of an interval."""
    some, ends = stressed.valid.any(), stressed.design.has_interval("mean")
    shares: dict[str, tuple[bool, Callable[[float], float]]] = {
        "life": (True, lambda lives: float(np.nanmean(_chances(points, lives)))),
        "life_lower": (ends, lambda lives: failures(stressed, points, lives).outer_upper),
        "life_upper": (ends, lambda lives: failures(stressed, points, lives).outer_lower),
    }
    service = stressed.settings.revolutions
    return {name: service * _reaches(share) if some and known else np.nan for name, (known, share) in shares.items()}


def _reaches(share: Callable[[float], float]) -> float:
    """Number of service lives at which a share that grows with them reaches `SHARE`; 0 or infinite beyond `LONGEST`."""
    longest = np.log(LONGEST)
    if share(np.exp(-longest)) >= SHARE:
        return 0.0
    if share(np.exp(longest)) < SHARE:
        return np.inf
    return float(np.exp(bisection.first(lambda log: share(float(np.exp(log))) >= SHARE, -longest, longest, 30)))
