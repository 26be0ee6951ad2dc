"""Which cycles does a load go through in a revolution? Mixtures, starts, spectra, and fatigue damage.

Cycles are those of one periodic revolution: all numbers are per revolution. `sample.Sample` has the distribution of
these values over the *joints*.

S is a range, twice an amplitude. S–N lines of loads have no knee and no endurance limit (Miner's rule in its elementary
form); there is no mean-load correction.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.analysis.strength import SNLine
from tolstat.common.loads import FloatArray


class Cycles(NamedTuple):
    """Rainflow cycles of joints, one revolution or a mixture of revolutions under several operating points.

    Attributes
    ----------
    channels : tuple of str
        Names of the signals, `channels.Signal.name`. Of several with one name the worst counts, see `worst`.
    ranges, means : ndarray, shape (n, channels, k)
        Range and mean of each cycle, in the unit of the signal; a range of 0 marks an empty place, NaN a joint without
        results.
    number : ndarray, shape (n, channels)
        Cycles per revolution, including those not stored among the k; NaN for joints without results.
    repeats : ndarray, shape (n, channels, k)
        Occurrences per revolution of the cycle in each place: 1, or the share of its operating point.
    omitted : ndarray, shape (n, channels, points)
        Cycles per revolution at each operating point that are not stored.
    ceiling : ndarray, shape (n, channels, points)
        Range that none of these exceeds.
    low, high : ndarray, shape (n, channels)
        Smallest and largest value at all operating points together.
    """

    channels: tuple[str, ...]
    ranges: NDArray[Any]
    means: NDArray[Any]
    number: FloatArray
    repeats: FloatArray
    omitted: FloatArray
    ceiling: FloatArray
    low: FloatArray
    high: FloatArray

    @classmethod
    def of_revolution(
        cls, channels: tuple[str, ...], ranges: NDArray[Any], means: NDArray[Any], number: FloatArray
    ) -> Cycles:
        """Cycles of one revolution, of which the largest k are stored, descending.

        The first is from the smallest to the largest value, also where `number` is 0: then it does not count.
        """
        low, high = (means[..., 0] + end * ranges[..., 0].astype(float) for end in (-0.5, 0.5))
        ranges = np.where(number[..., None] == 0, 0.0, ranges)
        stored = ranges > 0
        omitted = np.maximum(number - stored.sum(axis=2), 0.0)[..., None]
        ceiling = np.min(ranges, axis=2, initial=np.inf, where=stored)[..., None].astype(float)
        return cls(channels, ranges, means, number, np.ones(ranges.shape), omitted, ceiling, low, high)

    def of(self, channel: str) -> Cycles:
        """Select the signals of one name; the axis of channels stays."""
        c = [i for i, name in enumerate(self.channels) if name == channel]
        return self._picked((slice(None), c))._replace(channels=(channel,) * len(c))

    def rows(self, joints: slice) -> Cycles:
        """Select joints."""
        return self._picked((joints,))

    def spread(self, rows: NDArray[np.intp], n: int) -> Cycles:
        """Put the joints in `rows` of a table of n joints; NaN in the others."""

        def spread(values: NDArray[Any]) -> NDArray[Any]:
            table = np.full((n, *values.shape[1:]), np.nan, values.dtype)
            table[rows] = values
            return table

        return self._each(spread)

    def worst(self, m: float) -> Cycles:
        """Of signals with one name, those of the one that is damaged most in each joint by the exponent m."""
        names = tuple(dict.fromkeys(self.channels))
        if names == self.channels:
            return self
        damaged = np.nan_to_num(moment(self, m), posinf=np.inf)
        index = np.empty((len(self.number), len(names)), np.intp)
        for c, name in enumerate(names):
            same = np.array([i for i, other in enumerate(self.channels) if other == name])
            index[:, c] = same[np.argmax(damaged[:, same], axis=1)]
        return self._picked((np.arange(len(index))[:, None], index))._replace(channels=names)

    def with_starts(self, starts: float) -> Cycles:
        """Add starts from standstill, so many per revolution.

        Each goes from zero to the extremes and back; its cycle takes the place of the largest of one revolution.
        """
        if not starts:
            return self
        largest = np.argmax(np.nan_to_num(self.ranges), axis=2)[..., None]
        repeats, there = self.repeats.copy(), np.take_along_axis(self.repeats, largest, axis=2)
        left = np.maximum(there - starts, 0.0)
        np.put_along_axis(repeats, largest, left, axis=2)
        replaced = (there - left)[..., 0] * (np.take_along_axis(self.ranges, largest, axis=2)[..., 0] > 0)
        low, high = np.minimum(self.low, 0.0), np.maximum(self.high, 0.0)
        started = high - low, 0.5 * (high + low), np.full(low.shape, starts)
        tables = zip((self.ranges, self.means, repeats), started, strict=True)
        ranges, means, repeats = (np.concatenate([table, new[..., None]], axis=2) for table, new in tables)
        return self._replace(ranges=ranges, means=means, repeats=repeats, number=self.number + starts - replaced)

    def _picked(self, part: tuple[Any, ...]) -> Cycles:
        return self._each(lambda values: values[part])

    def _each(self, function: Callable[[NDArray[Any]], NDArray[Any]]) -> Cycles:
        return Cycles(self.channels, *map(function, self[1:]))


class Transitions(NamedTuple):
    """Cycles that going from one operating point to another closes, one place for each pair of points.

    Attributes
    ----------
    ranges, means : ndarray, shape (n, channels, k)
        Range and mean; a range of 0 marks an empty place.
    repeats : ndarray, shape (n, channels, k)
        Occurrences per revolution.
    replaced : ndarray, shape (n, channels, points)
        Largest cycles of revolutions at each point that these take the place of, per revolution.
    """

    ranges: FloatArray
    means: FloatArray
    repeats: FloatArray
    replaced: FloatArray


def duty_cycle(parts: Sequence[Cycles], shares: Sequence[float], transitions: Transitions | None = None) -> Cycles:
    """Duty cycle: the same joints under several operating points, each for a share of the revolutions.

    Parameters
    ----------
    parts : sequence of Cycles
        Of one revolution; row i is the same joint in each.
    shares : sequence of float
        Shares of the revolutions, positive, with the sum 1.
    transitions : Transitions, optional
        Cycles between the points.

    Returns
    -------
    Cycles
        A joint without results at one operating point has none.
    """
    tables = [(part.ranges, part.means, share * part.repeats) for part, share in zip(parts, shares, strict=True)]
    number = np.sum([share * part.number for part, share in zip(parts, shares, strict=True)], axis=0)
    if transitions is not None:
        for p, (part, (_, _, repeats)) in enumerate(zip(parts, tables, strict=True)):
            replaced = np.where(part.number > 0, np.minimum(transitions.replaced[..., p], repeats[..., 0]), 0.0)
            repeats[..., 0] -= replaced
            number -= replaced
        tables.append(transitions[:3])
        number += transitions.repeats.sum(axis=2)
    ranges, means, repeats = (np.concatenate(table, axis=2) for table in zip(*tables, strict=True))
    omitted = np.concatenate([share * part.omitted for part, share in zip(parts, shares, strict=True)], axis=2)
    ceiling = np.concatenate([part.ceiling for part in parts], axis=2)
    low, high = np.min([part.low for part in parts], axis=0), np.max([part.high for part in parts], axis=0)
    return Cycles(parts[0].channels, ranges, means, number, repeats, omitted, ceiling, low, high)


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


def damage(cycles: Cycles, line: SNLine, revolutions: float) -> FloatArray:
    """Damage sum of `revolutions` by a line without knee, shape (n, channels); failure is expected at 1."""
    return np.asarray(revolutions / line.N_D * moment(cycles, line.k) / line.S_D**line.k)


def truncation_bound(cycles: Cycles, m: float) -> FloatArray:
    """Upper bound of the relative increase of `moment` by cycles that were not stored, shape (n, channels).

    None of them is larger than the smallest stored cycle of its operating point.
    """
    some = cycles.omitted > 1e-9  # NaN for joints without results
    with np.errstate(invalid="ignore"):
        most = np.sum(cycles.omitted * cycles.ceiling**m, axis=2, where=some)
        return np.asarray(np.where(some.any(axis=2), most / moment(cycles, m), 0.0))
