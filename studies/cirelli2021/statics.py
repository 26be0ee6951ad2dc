"""Which printed forces contradict the equilibrium of the cross.

At alpha = 0 the joint stands still in the turning frame, so the forces on the cross balance, centrifugal ones apart. A
pin that turns and slides freely in its hole takes neither a force along its axis nor a moment about it. Of the x
axis along pins 3 and 4 and the y axis along pins 1 and 2 that leaves, with t the tangential and a the axial force
(along the shafts) of each pin,

    t1 = t2,    t3 = t4,    a1 + a2 + a3 + a4 = 0,    r_b (t1 + t2) + T1z + T2z = r_b (t3 + t4) + T3z + T4z = T_r.

Equal tangential forces leave it to axial ones to make F1 and F2 differ. How large they can be follows from what
the paper prints of the four pins itself: F^2 = t^2 + a^2 + f^2, f the centrifugal force, and |Tz| <= T. The bound
refers to the loads of an ideal joint, hence to r_b and R, which the paper does not print: `exclusions` runs it over
many.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studies.cirelli2021.tables import printed

Array = NDArray[np.float64]

ROUNDING = 0.05
"""Half of the last digit printed, percentage points: what a printed value leaves open."""


class Loads(NamedTuple):
    """The ideal joint at alpha = 0, and what ties its loads together.

    Attributes
    ----------
    force, torque : float
        Largest modulus at a cross bushing, N and N m.
    resisting : float
        Torque of the output shaft T_r, N m.
    arm : float
        Distance r_b of a cross bushing's marker from the joint's centre, m.
    """

    force: float
    torque: float
    resisting: float
    arm: float

    @property
    def tangential(self) -> float:
        """Tangential force of a pin (N): ``2 (r_b t + T) = T_r``."""
        return (0.5 * self.resisting - self.torque) / self.arm


class Contradiction(NamedTuple):
    """Printed Gamma_F of cross bushings 1 and 2 at alpha = 0.

    Attributes
    ----------
    case : str
        Printed case.
    low, high : float
        The smaller and the larger Gamma_F of the two, per cent.
    axial : float
        Axial force that the pin with the larger one needs at least, as a share of the ideal bushing force.
    allowed : float
        Largest Gamma_F of that bushing that all other printed values of the case allow, per cent.
    """

    case: str
    low: float
    high: float
    axial: float
    allowed: float

    @property
    def possible(self) -> bool:
        """Whether the printed pair can be in equilibrium."""
        return self.high - ROUNDING <= self.allowed


def contradictions(ideal: Loads) -> list[Contradiction]:
    """Test Table 4 case by case.

    Parameters
    ----------
    ideal : Loads
        Loads of the joint without errors at alpha = 0, which Gamma refers to.
    """
    table = printed()
    return [_test(name, table.gamma[c, 0, :4], ideal) for c, name in enumerate(table.cases)]


class Exclusion(NamedTuple):
    """The bound of one printed line over joints that differ in what the paper does not print.

    Attributes
    ----------
    case : str
        Printed case.
    high : float
        Larger printed Gamma_F of cross bushings 1 and 2, per cent.
    allowed : tuple of float
        Smallest and largest bound of all joints, per cent.
    excluded, joints : int
        How many joints exclude the printed pair; how many there are.
    out, room : tuple of float
        Range of ``r_b / R`` of the joints that exclude it, and of those that leave room; NaN for none.
    """

    case: str
    high: float
    allowed: tuple[float, float]
    excluded: int
    joints: int
    out: tuple[float, float]
    room: tuple[float, float]


def exclusions(ideals: list[Loads], ratio: Array) -> list[Exclusion]:
    """Test Table 4 with each of several joints.

    Parameters
    ----------
    ideals : list of Loads
        The joints, without errors at alpha = 0.
    ratio : ndarray, shape (k,)
        ``r_b / R`` of each: the share of the contact's lever that the bushing sees.
    """
    found = [contradictions(ideal) for ideal in ideals]
    lines = []
    for c, name in enumerate(printed().cases):
        own = [joint[c] for joint in found]
        out = np.array([not line.possible for line in own])
        bounds = [line.allowed for line in own]
        span = (min(bounds), max(bounds))
        ranges = (_range(ratio[out]), _range(ratio[~out]))
        lines.append(Exclusion(name, own[0].high, span, int(out.sum()), len(own), *ranges))
    return lines


def _range(values: Array) -> tuple[float, float]:
    return (float(values.min()), float(values.max())) if values.size else (float("nan"), float("nan"))


def _test(case: str, gamma: Array, ideal: Loads) -> Contradiction:
    """`gamma`, (4, 2): Gamma_F and Gamma_T of the four cross bushings, per cent."""
    force = ideal.force * (1.0 + (gamma[:, 0] + ROUNDING) / 100.0)
    low, high = sorted(gamma[:2, 0])
    needed = np.sqrt(max((1.0 + high / 100.0) ** 2 - (1.0 + low / 100.0) ** 2, 0.0))
    radial = max(ideal.force**2 - ideal.tangential**2, 0.0)
    a3, a4 = _axial(force[2:], _tangential(gamma[2:, 1], ideal), radial)
    weaker = force[int(np.argmin(gamma[:2, 0]))]
    a2 = float(_axial(np.array([weaker]), _tangential(gamma[:2, 1], ideal), radial)[0])
    squared = weaker**2 - a2**2 + (a2 + a3 + a4) ** 2
    allowed = 100.0 * (float(np.sqrt(squared)) / ideal.force - 1.0)
    return Contradiction(case, float(low), float(high), float(needed), allowed)


def _tangential(gamma_T: Array, ideal: Loads) -> float:
    """Least tangential force (N) of two opposite pins whose bushing torques have grown by `gamma_T`, (2,) per cent."""
    grown = float(np.mean(gamma_T) + ROUNDING) / 100.0
    return max(ideal.tangential - grown * ideal.torque / ideal.arm, 0.0)


def _axial(force: Array, tangential: float, radial: float) -> Array:
    """Largest axial part (N) of forces (N), shape (k,); `radial` is the square of the centrifugal force (N^2)."""
    return np.asarray(np.sqrt(np.maximum(force**2 - tangential**2 - radial, 0.0)))
