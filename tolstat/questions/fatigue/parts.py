"""Fatigue of the parts: damage and life at points, and the share of the parts that fail in the service life."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import prediction, strength
from tolstat.analysis.cycles import FloatArray
from tolstat.analysis.prediction import DELIVERY
from tolstat.analysis.sample import Sample
from tolstat.analysis.strength import Collective, Failures, Line
from tolstat.common.bisection import first
from tolstat.common.tables import FAILED, Status
from tolstat.display.table import Rows
from tolstat.questions.fatigue.stress import Stressed, Stresses
from tolstat.study.fatigue import Fatigue

SHARE = 0.1
"""Share of the parts that have failed at the end of the life given, B10."""
ANY = "any of them"
"""Name of the row for all points together."""
CONFIDENCE = 0.95
LONGEST = 1e12
"""Lives beyond so many service lives are given as infinite."""


class Evaluated(NamedTuple):
    """Stress cycles of the joints at one point in the service life, and its S–N line."""

    collective: Collective
    line: Line


class Course(NamedTuple):
    """Joints of one campaign at some points that fail together: the share of failures after any time.

    Attributes
    ----------
    points : sequence of Evaluated
        The points; the joint fails at the weakest.
    done : ndarray of bool, shape (n,)
        Which joints were simulated; those without stresses among them have NaN.
    n_failed, n_unsettled : int
        Joints without stresses.
    has_interval : bool
        Whether means over the joints have an interval.
    """

    points: Sequence[Evaluated]
    done: NDArray[np.bool_]
    n_failed: int
    n_unsettled: int
    has_interval: bool

    def chances(self, lives: float = 1.0) -> FloatArray:
        """Probability for each simulated joint that a part has failed after so many service lives, (m,)."""
        survive = np.zeros(int(self.done.sum()))  # logarithm of the probability
        with np.errstate(divide="ignore"):
            for collective, line in self.points:
                factor = strength.critical_factor(collective, line, lives)[self.done]
                survive += np.log1p(-strength.probability(factor, line.T_S))
        return -np.expm1(survive)

    def failures(self, lives: float = 1.0, confidence: float = CONFIDENCE) -> Failures:
        """Share of the parts that have failed after so many service lives."""
        return strength.failures(self.chances(lives), self.n_failed, self.n_unsettled, confidence, self.has_interval)


def part_failures(stressed: Stressed, delivery: int = DELIVERY) -> Rows:
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
    own, nominal = (evaluated(stresses, stressed.settings) for stresses in (stressed.own, stressed.nominal))
    heads = [_damage(stressed, p, own[p], nominal[p]) for p in range(len(own))]
    groups = [[p] for p in range(len(own))]
    if len(own) > 1:
        heads.append({"point": ANY, "bushing": ""} | dict.fromkeys(list(heads[0])[2:], np.nan))
        groups.append(list(range(len(own))))
    rows = []
    for head, group in zip(heads, groups, strict=True):
        course = course_of(stressed, [own[p] for p in group])
        ideal = Course([nominal[p] for p in group], np.ones(len(stressed.nominal.low), bool), 0, 0, False)
        wide = course.failures(1.0, prediction.half(CONFIDENCE))
        following = prediction.of_share(wide.outer_lower, wide.outer_upper, delivery, CONFIDENCE)
        head |= prediction.columns(following, delivery) | _life(course, stressed.settings.revolutions)
        head |= {"nominal_failures": ideal.failures().estimate} | course.failures()._asdict()
        rows.append(head | {"confidence": CONFIDENCE})
    return rows


def service_failures(stressed: Stressed) -> Failures:
    """Share of the joints with a failed part at any point in the service life."""
    return course_of(stressed, evaluated(stressed.own, stressed.settings)).failures()


def failures_over_life(stressed: Stressed, revolutions: Sequence[float]) -> list[Failures]:
    """Share of the joints with a failed part at any point after numbers of revolutions."""
    course = course_of(stressed, evaluated(stressed.own, stressed.settings))
    return [course.failures(number / stressed.settings.revolutions) for number in revolutions]


def evaluated(stresses: Stresses, settings: Fatigue) -> list[Evaluated]:
    """Cycles in the service life at each point, each at the stress ratio of the point's S–N line.

    Of several places around a section each joint has those of the one at which it fails first.
    """
    found, first = [], 0
    for point in settings.points:
        last = first + len(point.per_load)
        places = [_in_service(stresses, place, point.line, settings) for place in range(first, last)]
        found.append(Evaluated(strength.weakest(places, point.line), point.line))
        first = last
    return found


def _in_service(stresses: Stresses, place: int, line: Line, settings: Fatigue) -> Collective:
    """Cycles of the joints at one place in the service life.

    A start goes from the unstressed joint to the extremes of the revolution and back; its cycle, between the extremes
    and zero, takes the place of the largest cycle of one revolution.
    """
    cycles = stresses.cycles
    ranges, means = cycles.ranges[:, place], cycles.means[:, place]
    numbers = np.broadcast_to(cycles.repeats * settings.revolutions, ranges.shape).copy()
    if settings.starts:
        joints = np.arange(len(ranges))
        numbers[joints, np.argmax(np.nan_to_num(ranges), axis=1)] -= settings.starts
        numbers = np.maximum(numbers, 0.0)
        low, high = np.minimum(stresses.low[:, place], 0.0), np.maximum(stresses.high[:, place], 0.0)
        ranges, means = np.column_stack([ranges, high - low]), np.column_stack([means, 0.5 * (high + low)])
        numbers = np.column_stack([numbers, np.full(len(ranges), settings.starts)])
    return strength.sort_out(strength.at_ratio(ranges, means, line.M, line.R), numbers, line)


def course_of(stressed: Stressed, points: Sequence[Evaluated]) -> Course:
    """Failures of the joints at some points; joints that are not settled, or never repeat, have no stresses."""
    done = stressed.status != Status.PENDING
    n_failed, n_without = int(np.isin(stressed.status, FAILED).sum()), int((done & ~stressed.valid).sum())
    return Course(points, done, n_failed, n_without - n_failed, stressed.design.has_interval("mean"))


def _damage(stressed: Stressed, p: int, own: Evaluated, nominal: Evaluated) -> dict[str, Any]:
    point = stressed.settings.points[p]
    sums, ideal = strength.damage_at(*own), strength.damage_at(*nominal)
    sample = Sample.of(sums, stressed.status, stressed.design)
    ends = [sample.quantile(share).estimate for share in (0.5, 0.99)]
    return {
        "point": point.name,
        "bushing": point.bushing,
        **point.line._asdict(),
        "nominal": float(ideal[0]) if ideal.size else np.nan,
        "median": ends[0],
        "upper_99": ends[1],
    }


def _life(course: Course, revolutions: float) -> dict[str, float]:
    """Revolutions after which a share `SHARE` of the parts has failed, with the ends of an interval."""
    shares: dict[str, Callable[[float], float]] = {
        "life": lambda lives: float(np.nanmean(course.chances(lives))),
        "life_lower": lambda lives: course.failures(lives).outer_upper,
        "life_upper": lambda lives: course.failures(lives).outer_lower,
    }
    some = course.done.sum() > course.n_failed + course.n_unsettled
    known = {"life": some, "life_lower": some and course.has_interval, "life_upper": some and course.has_interval}
    return {name: revolutions * _reaches(share) if known[name] else np.nan for name, share in shares.items()}


def _reaches(share: Callable[[float], float]) -> float:
    """Number of service lives at which a share that grows with them reaches `SHARE`; 0 or infinite beyond `LONGEST`."""
    longest = np.log(LONGEST)
    if share(np.exp(-longest)) >= SHARE:
        return 0.0
    if share(np.exp(longest)) < SHARE:
        return np.inf
    return float(np.exp(first(lambda log: share(float(np.exp(log))) >= SHARE, -longest, longest, 30)))
