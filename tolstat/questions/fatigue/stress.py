"""Stress cycles of the joints at points of their parts, from the load components over a revolution."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.cycles import Cycles, FloatArray, duty_cycle
from tolstat.common.channels import BUSHING_LOADS
from tolstat.common.errors import Fault, InputError
from tolstat.common.tables import Status
from tolstat.questions.fatigue import duty
from tolstat.questions.fatigue.duty import Joints
from tolstat.solver import rainflow
from tolstat.store import revolutions
from tolstat.store.view import View
from tolstat.study.stress_point import StressPoint

if TYPE_CHECKING:
    from tolstat.store.reader import Reader


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
class Stressed(Joints):
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
    points = joints.settings.points
    if not points:
        remedy = 'add [fatigue.point."NAME"] to the study, and run it again; no joint is simulated anew'
        raise InputError([Fault(str(views[0].path), "its study names no point of a part", remedy)])
    settled = np.flatnonzero(joints.valid)
    # the nominal joint of a duty cycle has settled at all operating points, or it has no row
    both = all(_nominal(view).size for view in views)
    nominal, own, apart = [], [], 0.0
    for view in views:
        first = _nominal(view)
        found, difference = stresses_of(view.store, np.concatenate([first, view.slots(settled)]), points)
        nominal.append(found.rows(slice(first.size if both else 0)))
        own.append(_spread(found.rows(slice(first.size, None)), settled, joints.status.size))
        apart = max(apart, difference)
    return Stressed(**vars(joints), own=_mixed(own, shares), nominal=_mixed(nominal, shares), apart=apart)


def stresses_of(store: Reader, slots: NDArray[np.intp], points: Sequence[StressPoint]) -> tuple[Stresses, float]:
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
    for part, found, difference in revolutions.of_components(store, slots, [BUSHING_LOADS]):
        apart, loads = max(apart, difference), found[BUSHING_LOADS.name]
        signals, noise = zip(*(_signal(loads, *place) for place in places), strict=True)
        low[part], high[part] = (np.stack([end(s, axis=1) for s in signals], axis=1) for end in (np.min, np.max))
        for joint in range(len(loads)):
            counted += [rainflow.periodic(s[joint], gate[joint]) for s, gate in zip(signals, noise, strict=True)]
    number = np.array([len(ranges) for ranges, _ in counted], float).reshape(low.shape)
    table = np.zeros((len(counted), max(1, int(number.max(initial=0.0))), 2))
    for i, (ranges, means) in enumerate(counted):
        table[i, : len(ranges), 0], table[i, : len(ranges), 1] = ranges, means
    table = table.reshape(*low.shape, *table.shape[1:])
    names = tuple(point.name for point, _ in places)
    return Stresses(Cycles.of_revolution(names, table[..., 0], table[..., 1], number), low, high), apart


def _signal(loads: NDArray[np.floating], point: StressPoint, factors: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Stress over the revolution, (m, samples), and the range up to which cycles may be numerical noise, (m,), Pa."""
    own = loads[:, :, BUSHING_LOADS.places.index(point.bushing)].astype(float)
    return own @ factors, rainflow.GATE * np.max(np.abs(own) @ np.abs(factors), axis=1)


def _nominal(view: View) -> NDArray[np.intp]:
    """File slots of the nominal joint if it settled, (1,) or (0,)."""
    return np.asarray(view.nominal_slots[view.nominal["status"] == Status.OK])


def _spread(part: Stresses, settled: NDArray[np.intp], n: int) -> Stresses:
    """Put the joints `settled` in their rows of a table of n joints; NaN in the others."""

    def rows(values: FloatArray) -> FloatArray:
        table = np.full((n, *values.shape[1:]), np.nan)
        table[settled] = values
        return table

    cycles = part.cycles
    spread = Cycles.of_revolution(cycles.channels, rows(cycles.ranges), rows(cycles.means), rows(cycles.number))
    return Stresses(spread, rows(part.low), rows(part.high))


def _mixed(parts: Sequence[Stresses], shares: Sequence[float]) -> Stresses:
    cycles = duty_cycle([part.cycles for part in parts], shares)
    low, high = np.min([part.low for part in parts], axis=0), np.max([part.high for part in parts], axis=0)
    return Stresses(cycles, low, high)
