"""How much fatigue damage do the cycles of a revolution cause? Equivalent loads and damage sums of each joint.

S is a range, twice an amplitude. S–N lines have no knee and no endurance limit (Miner's rule in its elementary form);
there is no mean-load correction. `exceedance` and `quantile` evaluate the distribution of these values over the joints.
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
        Range with a life of `N0` cycles, N or N m.
    N0 : float
        Cycles to failure at `S0`.
    """

    m: float
    S0: float
    N0: float


def moment(cycles: Cycles, m: float) -> FloatArray:
    """Sum of S^m over the cycles of a revolution, shape (n, channels); NaN for joints without results."""
    sums = np.empty(cycles.number.shape)
    for c in range(len(cycles.channels)):
        sums[:, c] = cycles.ranges[:, c].astype(float) ** m @ cycles.repeats
    return sums


def equivalent_load(cycles: Cycles, m: float, revolutions: float = 1.0, reference_cycles: float = 1.0) -> FloatArray:
    """Damage-equivalent load: the range that causes the damage of `revolutions` in `reference_cycles` cycles.

    Parameters
    ----------
    cycles : Cycles
        Cycles of one revolution.
    m : float
        Wöhler exponent, positive.
    revolutions, reference_cycles : float
        Service life, and number of cycles of the equivalent range.

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


def truncation_bound(cycles: Cycles, m: float) -> FloatArray:
    """Upper bound of the relative increase of `moment` by cycles that were not stored, shape (n, channels).

    None of them is larger than the smallest stored cycle of its operating point.
    """
    some = cycles.omitted > 1e-9  # NaN for joints without results
    with np.errstate(invalid="ignore"):
        most = np.sum(cycles.omitted * cycles.ceiling**m, axis=2, where=some)
        bound: FloatArray = np.where(some.any(axis=2), most / moment(cycles, m), 0.0)
    return bound
