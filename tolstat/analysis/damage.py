"""What do the cycles of a revolution do to the parts? Equivalent loads and damage sums of each joint.

S is a range, twice an amplitude. S–N lines have no knee and no endurance limit (Miner's rule in its elementary form);
mean loads are not corrected for. What a share of the joints exceeds is asked of these values by `exceedance` and
`quantile`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tolstat.analysis.cycles import Cycles, FloatArray


class Line(NamedTuple):
    """S–N line N = N0 (S / S0)^-m.

    Attributes
    ----------
    m : float
        Wöhler exponent.
    S0 : float
        Range that is borne `N0` times, N or N m.
    N0 : float
        Cycles.
    """

    m: float
    S0: float
    N0: float


def moment(cycles: Cycles, m: float) -> FloatArray:
    """Sum of S^m over the cycles of a revolution, shape (n, channels); NaN for joints without results."""
    sums = np.empty(cycles.number.shape)
    for c in range(len(cycles.channels)):
        sums[:, c] = cycles.ranges[:, c].astype(float) ** m @ cycles.weights
    return sums


def equivalent_load(cycles: Cycles, m: float, revolutions: float = 1.0, reference_cycles: float = 1.0) -> FloatArray:
    """Damage-equivalent load: the range whose `reference_cycles` do the damage of `revolutions`.

    Parameters
    ----------
    cycles : Cycles
        Of one revolution.
    m : float
        Wöhler exponent, positive.
    revolutions, reference_cycles : float
        Service life, and cycles that the range is for.

    Returns
    -------
    ndarray, shape (n, channels)
        Range, N or N m; NaN for joints without results.
    """
    equivalent: FloatArray = (revolutions / reference_cycles * moment(cycles, m)) ** (1.0 / m)
    return equivalent


def damage(cycles: Cycles, line: Line, revolutions: float) -> FloatArray:
    """Damage sum of `revolutions` (Palmgren 1924, Miner 1945), shape (n, channels); failure is expected at 1."""
    total: FloatArray = revolutions / line.N0 * moment(cycles, line.m) / line.S0**line.m
    return total


def shortfall(cycles: Cycles, m: float) -> FloatArray:
    """Upper bound of the part of `moment` that the cycles without a place would add, shape (n, channels).

    None of them is larger than the smallest that has a place.
    """
    placed = ((cycles.ranges > 0) * cycles.weights).sum(axis=2)
    without = np.maximum(cycles.number - placed, 0.0)
    least = np.min(cycles.ranges, axis=2, initial=np.inf, where=cycles.ranges > 0).astype(float)
    with np.errstate(invalid="ignore"):
        bound: FloatArray = np.where(without > 1e-9, without * least**m / moment(cycles, m), 0.0)
    return bound
