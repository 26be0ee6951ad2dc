"""Fatigue of the parts: stress cycles at their points, damage, life, and the share that fails in the service life."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from tolstat.analysis import prediction, strength
from tolstat.analysis.cycles import Cycles
from tolstat.analysis.sample import Sample
from tolstat.common import bisection
from tolstat.common.channels import BUSHING_LOADS, Signal, load_histories
from tolstat.common.errors import Fault, InputError
from tolstat.common.loads import FloatArray
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import FAILED, Status
from tolstat.display.table import Rows
from tolstat.questions.fatigue import counting
from tolstat.questions.fatigue.counting import ANY, CONFIDENCE, Counted, only
from tolstat.store.view import View
from tolstat.study.fatigue import Fatigue, StressPoint

SHARE = 0.1
"""Share of the parts that have failed at the end of the life given, B10."""
LONGEST = 1e12
"""Lives beyond so many service lives are given as infinite."""


def load_stresses(view: View, samples: int | None = None) -> Counted:
    """Stress cycles of a campaign, over the duty cycle of its operating points if it has several.

    The stress of each point is formed from the load components at each input angle before cycles are counted. Where a
    file holds no load histories, its joints are simulated again.

    Parameters
    ----------
    view : View
        The campaign; its study has ``[fatigue.point]``.
    samples : int, optional
        Number of samples, from the first; by default all.

    Returns
    -------
    Counted
        Its channels are the name of the point of each place, its unit Pa. NaN for a joint that has not settled.

    Raises
    ------
    InputError
        When the study has no points, or the shares of its operating points are not known.
    """
    joints = counting.joints_of(view, samples)
    points = joints.settings.points
    if not points:
        remedy = 'add [fatigue.point."NAME"] to the study, and run it again; no joint is simulated anew'
        raise InputError([Fault(str(view.path), "its study names no point of a part", remedy)])
    every = 1 + max(int(part.store.options["steps_per_rev"]) for part in view.parts) // 2
    return counting.count(view, joints, stresses_at(points, view.mechanism), joints.valid, every)


def stresses_at(points: Sequence[StressPoint], mechanism: Mechanism) -> list[Signal]:
    """Stress at each place of each point, Pa."""
    history = load_histories(mechanism)[BUSHING_LOADS]
    places = [(point, factors) for point in points for factors in point.per_load]
    return [Signal(point.name, "Pa", history, point.bushing, factors) for point, factors in places]


class Evaluated(NamedTuple):
    """Stress cycles of the joints at one point in the service life, and its S–N line."""

    collective: strength.Collective
    line: strength.SNLine


def part_failures(stressed: Counted, delivery: int = prediction.DELIVERY) -> Rows:
    """Damage, life and probability of failure at each point of the parts.

    Parameters
    ----------
    stressed : Counted
        Stress cycles of the joints, from `load_stresses`.
    delivery : int
        Number of joints of the next delivery.

    Returns
    -------
    sequence of mapping
        One row per point, and one for all of them if there are several (the strengths of two points are independent):
        ``point``, ``bushing``, fields of `analysis.strength.SNLine` (S_D in Pa); ``nominal``, ``median``, ``upper_99``
        (damage sum at the median strength: of the nominal joint, and not exceeded by half and by 99 % of the joints);
        ``life`` (revolutions after which a tenth of the parts has failed), ``life_lower``, ``life_upper`` (joints
        without a valid load counted both ways); ``nominal_failures`` (share of the parts that fail in the nominal
        joint); the fields of `analysis.strength.Failures`, ``confidence``, ``next_lower`` and
        ``next_upper`` (prediction interval for the failures in the next delivery).
    """
    points, nominal = (evaluated(cycles, stressed.settings) for cycles in (stressed.cycles, stressed.nominal))
    heads = [_damage(stressed, p, points[p], nominal[p]) for p in range(len(points))]
    groups = [slice(p, p + 1) for p in range(len(points))]
    if len(points) > 1:
        heads.append({"point": ANY, "bushing": ""} | dict.fromkeys(list(heads[0])[2:], np.nan))
        groups.append(slice(None))
    rows = []
    for head, group in zip(heads, groups, strict=True):
        wide = failures(stressed, points[group], confidence=prediction.half(CONFIDENCE))
        following = prediction.of_share(wide.outer_lower, wide.outer_upper, delivery, CONFIDENCE)
        head |= prediction.columns(following, delivery) | _life(stressed, points[group])
        head |= {"nominal_failures": only(_chances(nominal[group]))} | failures(stressed, points[group])._asdict()
        rows.append(head | {"confidence": CONFIDENCE})
    return rows


def failures_over_life(stressed: Counted, revolutions: Sequence[float]) -> list[strength.Failures]:
    """Share of the joints with a failed part at any point after numbers of revolutions."""
    points = evaluated(stressed.cycles, stressed.settings)
    return [failures(stressed, points, number / stressed.settings.revolutions) for number in revolutions]


def failures(
    stressed: Counted, points: Sequence[Evaluated], lives: float = 1.0, confidence: float = CONFIDENCE
) -> strength.Failures:
    """Share of the joints of which a part has failed at any of some points after so many service lives.

    Joints that are not settled, or never repeat, have no stresses.
    """
    done = stressed.status != Status.PENDING
    n_failed, n_without = int(np.isin(stressed.status, FAILED).sum()), int((done & ~stressed.valid).sum())
    level, has_interval = stressed.design.level(confidence), stressed.design.independent
    return strength.failures(_chances(points, lives)[done], n_failed, n_without - n_failed, level, has_interval)


def _chances(points: Sequence[Evaluated], lives: float = 1.0) -> FloatArray:
    """Probability of each joint that a part has failed after so many service lives, (n,); NaN without stresses."""
    survive = np.zeros(len(points[0].collective.knots))  # logarithm of the probability
    with np.errstate(divide="ignore"):
        for collective, line in points:
            factor = strength.critical_factor(collective, line, lives)
            survive += np.log1p(-strength.probability(factor, line.T_S))
    return -np.expm1(survive)


def evaluated(cycles: Cycles, settings: Fatigue) -> list[Evaluated]:
    """Cycles in the service life at each point, each at the stress ratio of the point's S–N line.

    Of several places around a section each joint has those of the one at which it fails first.
    """
    collectives, begin = [], 0
    for point in settings.points:
        end = begin + len(point.per_load)
        places, line = [], point.line
        for place in range(begin, end):
            ranges = strength.at_ratio(cycles.ranges[:, place], cycles.means[:, place], line.M, line.R)
            places.append(strength.sort_out(ranges, cycles.repeats[:, place] * settings.revolutions, line))
        collectives.append(Evaluated(strength.weakest(places, line), line))
        begin = end
    return collectives


def _damage(stressed: Counted, p: int, joints: Evaluated, nominal: Evaluated) -> dict[str, Any]:
    """Damage sums at a point, of the nominal joint and over the joints."""
    point = stressed.settings.points[p]
    sample = Sample.of(strength.damage_at(*joints), stressed.status, stressed.design)
    head = {"point": point.name, "bushing": point.bushing, **point.line._asdict()}
    head["nominal"] = only(strength.damage_at(*nominal))
    return head | {name: sample.quantile(share).estimate for name, share in (("median", 0.5), ("upper_99", 0.99))}


def _life(stressed: Counted, points: Sequence[Evaluated]) -> dict[str, float]:
    """Revolutions after which a share `SHARE` of the parts has failed, with the ends of an interval."""
    some, ends = stressed.valid.any(), stressed.design.independent
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
