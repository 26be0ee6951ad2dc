"""Which cycles does a load go through in a revolution? Mixtures, spectra, and fatigue damage.

Cycles are those of one periodic revolution: all numbers are per revolution. `sample.Sample` has the distribution of
these values over the *joints*.

S is a range, twice an amplitude. S–N lines have no knee and no endurance limit (Miner's rule in its elementary form);
there is no mean-load correction.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.common.loads import FloatArray


class Cycles(NamedTuple):
    """Rainflow cycles of joints, one revolution or a mixture of revolutions under several operating points.

    Attributes
    ----------
    channels : tuple of str
        Names of the loads, keys of `channels.CHANNELS`.
    ranges, means : ndarray, shape (n, channels, k)
        Range and mean of each cycle, N or N m; a range of 0 marks an empty place, NaN a joint without results.
    number : ndarray, shape (n, channels)
        Cycles per revolution, including those not stored among the k; NaN for joints without results.
    repeats : ndarray, shape (n, channels, k)
        Occurrences per revolution of the cycle in each place: 1, or the share of its operating point.
    omitted : ndarray, shape (n, channels, points)
        Cycles per revolution at each operating point that are not stored.
    ceiling : ndarray, shape (n, channels, points)
        Range that none of these exceeds, N or N m.
    """

    channels: tuple[str, ...]
    ranges: NDArray[Any]
    means: NDArray[Any]
    number: FloatArray
    repeats: FloatArray
    omitted: FloatArray
    ceiling: FloatArray

    @classmethod
    def of_revolution(
        cls, channels: tuple[str, ...], ranges: NDArray[Any], means: NDArray[Any], number: FloatArray
    ) -> Cycles:
        """Cycles of one revolution, of which the largest k are stored."""
        stored = ranges > 0
        omitted = np.maximum(number - stored.sum(axis=2), 0.0)[..., None]
        ceiling = np.min(ranges, axis=2, initial=np.inf, where=stored)[..., None].astype(float)
        return cls(channels, ranges, means, number, np.ones(ranges.shape), omitted, ceiling)

    def of(self, channel: str) -> Cycles:
        """Select one channel; the axis of channels stays, with length 1."""
        c = self.channels.index(channel)
        return self._picked((slice(None), slice(c, c + 1)))._replace(channels=(channel,))

    def rows(self, joints: slice) -> Cycles:
        """Select joints."""
        return self._picked((joints,))

    def _picked(self, part: tuple[slice, ...]) -> Cycles:
        names = ("ranges", "means", "number", "repeats", "omitted", "ceiling")
        return self._replace(**{name: getattr(self, name)[part] for name in names})


class Transitions(NamedTuple):
    """Cycles that going from one operating point to another closes, one place for each pair of points.

    Attributes
    ----------
    ranges, means : ndarray, shape (n, channels, k)
        Range and mean, N or N m; a range of 0 marks an empty place.
    repeats : ndarray, shape (n, channels, k)
        Occurrences per revolution.
    """

    ranges: FloatArray
    means: FloatArray
    repeats: FloatArray


def duty_cycle(parts: Sequence[Cycles], shares: Sequence[float], transitions: Transitions | None = None) -> Cycles:
    """Duty cycle: the same joints under several operating points, each for a share of the revolutions.

    Parameters
    ----------
    parts : sequence of Cycles
        Row i is the same joint in each.
    shares : sequence of float
        Shares of the revolutions, positive, with the sum 1.
    transitions : Transitions, optional
        Cycles beside those at the points.

    Returns
    -------
    Cycles
        A joint without results at one operating point has none.
    """
    tables = [(part.ranges, part.means, share * part.repeats) for part, share in zip(parts, shares, strict=True)]
    number = np.sum([share * part.number for part, share in zip(parts, shares, strict=True)], axis=0)
    if transitions is not None:
        tables.append(transitions)
        number = number + transitions.repeats.sum(axis=2)
    ranges, means, repeats = (np.concatenate(table, axis=2) for table in zip(*tables, strict=True))
    omitted = np.concatenate([share * part.omitted for part, share in zip(parts, shares, strict=True)], axis=2)
    ceiling = np.concatenate([part.ceiling for part in parts], axis=2)
    return Cycles(parts[0].channels, ranges, means, number, repeats, omitted, ceiling)


def spectrum(cycles: Cycles, numbers: ArrayLike) -> FloatArray:
    """Cumulative load spectrum: the range that given numbers of cycles per revolution reach or exceed.

    Parameters
    ----------
    cycles : Cycles
        Cycles of one revolution, or of a mixture.
    numbers : array_like, shape (q,)
        Cycles per revolution, positive.

    Returns
    -------
    ndarray, shape (n, channels, q)
        Largest range that at least `numbers` cycles per revolution reach or exceed, 0 where there are fewer; N or
        N m, NaN for joints without results.
    """
    wanted = np.atleast_1d(np.asarray(numbers, dtype=float)) * (1.0 - 1e-6)  # slack for rounded sums of shares
    order = np.argsort(-cycles.ranges, axis=2)
    ranges = np.take_along_axis(cycles.ranges, order, axis=2).astype(float)
    reached = np.cumsum(np.take_along_axis(cycles.repeats, order, axis=2), axis=2)
    values = np.empty((*cycles.number.shape, wanted.size))
    for q, number in enumerate(wanted):
        index = np.minimum((reached < number).sum(axis=2, keepdims=True), reached.shape[2] - 1)
        here = np.take_along_axis(ranges, index, axis=2)[..., 0]
        values[..., q] = np.where(reached[..., -1] >= number, here, 0.0)
    values[np.isnan(cycles.number)] = np.nan
    return values


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
        sums[:, c] = np.einsum("nk,nk->n", cycles.ranges[:, c].astype(float) ** m, cycles.repeats[:, c])
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
    return np.asarray((revolutions / reference_cycles * moment(cycles, m)) ** (1.0 / m))


def damage(cycles: Cycles, line: Line, revolutions: float) -> FloatArray:
    """Damage sum of `revolutions` (Palmgren 1924, Miner 1945), shape (n, channels); failure is expected at 1."""
    return np.asarray(revolutions / line.N0 * moment(cycles, line.m) / line.S0**line.m)


def truncation_bound(cycles: Cycles, m: float) -> FloatArray:
    """Upper bound of the relative increase of `moment` by cycles that were not stored, shape (n, channels).

    None of them is larger than the smallest stored cycle of its operating point.
    """
    some = cycles.omitted > 1e-9  # NaN for joints without results
    with np.errstate(invalid="ignore"):
        most = np.sum(cycles.omitted * cycles.ceiling**m, axis=2, where=some)
        return np.asarray(np.where(some.any(axis=2), most / moment(cycles, m), 0.0))
