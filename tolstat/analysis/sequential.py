"""Sequential estimation of a share: look at fixed numbers of joints, stop when the interval is narrow enough.

An interval that is inspected repeatedly covers less than its confidence. Here the looks are at numbers of joints fixed
beforehand, so that the distribution over the pairs (look, count above) at which a campaign stops is known for every
share p: the probability of a pair is the number of paths to it that stop nowhere before, times p^count (1 - p)^others.
From it follow the coverage of Clopper and Pearson's interval at the stop, for every p, hence the confidence of one look
for which that coverage is at least what is asked for (Chen and Chen 2013); the expected number of joints; and the
unbiased estimate, the mean share of the first look among the paths to the pair (Girshick, Mosteller and Savage 1946).
All of this is computed, not sampled. A path more than `REACH` standard deviations from its mean is left out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.binomial import clopper_pearson
from tolstat.common.loads import FloatArray

GROWTH = 1.05
"""Ratio of the numbers of joints of two looks."""
LEAST_BESIDE = 10
"""Minimum number of joints on each side of the level at a stop."""
CONFIDENCES = (0.95, 0.9525, 0.955, 0.9575, 0.96, 0.965, 0.97, 0.975, 0.98, 0.985, 0.99)
"""Confidence levels of a look that are tried."""
SHARES_TRIED, MARGIN = 160, 5e-4
"""Number of shares at which the coverage is computed while a confidence level is chosen, and what is kept in reserve
for those between them."""
REACH = 7.5
PLAUSIBLE = 1e-3
"""Probability of a stop below which a look is not waited for; see `Scheme.next_look`."""


class Performance(NamedTuple):
    """What a scheme does if a share `p` of all joints is above the level; computed from the distribution at the stop.

    Attributes
    ----------
    too_high, too_low : float
        Probability that the interval at the stop lies above `p`, and below it.
    joints : float
        Expected number of joints at the stop.
    plain, unbiased : float
        Relative bias of count over joints at the stop, and of `Scheme.estimate`.
    """

    too_high: float
    too_low: float
    joints: float
    plain: float
    unbiased: float

    @property
    def coverage(self) -> float:
        """Probability that the interval at the stop contains `p`."""
        return 1.0 - self.too_high - self.too_low


class Stops(NamedTuple):
    """Pairs at which paths stop at one look.

    Attributes
    ----------
    look : int
        Index of the look.
    counts : ndarray of int, shape (m,)
        Joints above the level.
    probability, first : ndarray, shape (m,)
        Probability of each pair, and the same times the mean share of the first look among its paths.
    """

    look: int
    counts: NDArray[np.intp]
    probability: FloatArray
    first: FloatArray


class Scheme:
    """Looks, and when to stop at them.

    Parameters
    ----------
    width : float
        Width of the interval at which to stop.
    looks : sequence of int
        Numbers of joints at the looks, ascending; the last one always ends the campaign.
    confidence : float
        Confidence level of Clopper and Pearson's interval at a look.
    """

    def __init__(self, width: float, looks: Sequence[int], confidence: float) -> None:
        self.width, self.looks, self.confidence = width, list(looks), confidence
        self._stops = [self._stopping(n) for n in self.looks]
        self._stops[-1] = range(self.looks[-1] + 1), range(0)

    def _stopping(self, n: int) -> tuple[range, range]:
        """Counts of n joints at which to stop: few are above the level, or few are not."""
        low, high = LEAST_BESIDE - 1, n // 2 + 1  # the width grows with the count up to one half
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if _width(middle, n, self.confidence) < self.width else (low, middle)
        if low > n - low:
            return range(LEAST_BESIDE, n - LEAST_BESIDE + 1), range(0)
        return range(LEAST_BESIDE, low + 1), range(n - low, n - LEAST_BESIDE + 1)

    def _stop(self, look: int, counts: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Whether to stop at a look, for each of the counts."""
        few, many = self._stops[look]
        return ((counts >= few.start) & (counts < few.stop)) | ((counts >= many.start) & (counts < many.stop))

    def narrow(self, look: int, count: int, others: int = 0) -> bool:
        """Whether to stop at a look with `count` joints above and `others` without a valid load."""
        low, high = self.interval(look, count, others)
        return LEAST_BESIDE <= count <= self.looks[look] - others - LEAST_BESIDE and high - low < self.width

    def interval(self, look: int, count: int, others: int = 0) -> tuple[float, float]:
        """Interval at a look; `others` count as below the level for its lower end, as above it for its upper end."""
        low, _ = clopper_pearson(count, self.looks[look], self.confidence)
        _, high = clopper_pearson(count + others, self.looks[look], self.confidence)
        return float(low), float(high)

    def next_look(self, look: int, count: int) -> int:
        """Index of the next look, or of a later one if a stop before it is improbable.

        The looks between are not skipped, only looked at later: whether the campaign stops at them depends on the first
        joints alone.
        """
        n = self.looks[look]
        p = (count + 0.5) / (n + 1.0)
        for later in range(look + 1, len(self.looks)):
            more, pmf = _binomial(self.looks[later] - n, p)
            if pmf[self._stop(later, count + more)].sum() > PLAUSIBLE:
                return later
        return len(self.looks) - 1

    def paths(self, p: float) -> Iterator[Stops]:
        """Yield the pairs at which paths stop, look by look, if a share p of all joints is above the level."""
        counts, mass, first, seen = np.empty(0, np.intp), np.empty(0), np.empty(0), 0
        for look, n in enumerate(self.looks):
            more, pmf = _binomial(n - seen, p)
            if not counts.size:
                if not self._stop(look, more).any():
                    continue  # nobody stops here: the next look is the first
                counts, mass, first = more, pmf, pmf * more / n
            else:
                counts = np.arange(counts[0] + more[0], counts[-1] + more[-1] + 1)
                mass, first = np.convolve(mass, pmf), np.convolve(first, pmf)
            seen = n
            stop = self._stop(look, counts)
            yield Stops(look, counts[stop], mass[stop], first[stop])
            mass[stop] = first[stop] = 0.0
            kept = np.flatnonzero(mass > 1e-18)
            if not kept.size or mass.sum() < 1e-12:
                return
            here = slice(kept[0], kept[-1] + 1)
            counts, mass, first = counts[here], mass[here], first[here]

    def performance(self, p: float) -> Performance:
        """Coverage, expected joints and bias for a share p between 0 and 1; at an end of an interval the smaller."""
        total = np.zeros(5)
        for stop in self.paths(p):
            n, mass, counts = self.looks[stop.look], stop.probability, stop.counts
            below, above = (_last_missing(n, share, self.confidence) for share in (p, 1.0 - p))
            plain = float((mass * counts).sum()) / n
            total += (
                mass[n - counts <= above].sum(),
                mass[counts <= below].sum(),
                n * mass.sum(),
                plain,
                stop.first.sum(),
            )
        too_high, too_low, joints, plain, first = (float(value) for value in total)
        return Performance(too_high, too_low, joints, plain / p - 1.0, first / p - 1.0)

    def estimate(self, look: int, count: int) -> float:
        """Unbiased estimate of the share after a stop at a look with `count` joints above."""
        n = self.looks[look]
        if count in (0, n):
            return count / n
        for stop in self.paths(count / n):
            here = np.flatnonzero(stop.counts == count)
            if stop.look == look and here.size and stop.probability[here[0]] > 0:
                return float(stop.first[here[0]] / stop.probability[here[0]])
        return count / n  # stopped by joints without a valid load where paths of valid joints do not

    def critical_shares(self, most: int = SHARES_TRIED) -> FloatArray:
        """Ends of the intervals at which paths can stop: between two of them each miss is monotone in the share.

        Of more than `most`, those of the smallest and largest few counts, and of others spread evenly.
        """
        pairs, least, largest = [], 0, 0
        for look, n in enumerate(self.looks):
            counts = np.arange(least, largest + n - (self.looks[look - 1] if look else 0) + 1)
            stop = self._stop(look, counts)
            pairs.append(np.column_stack([counts[stop], np.full(int(stop.sum()), n)]))
            if stop.all():
                break
            least, largest = int(counts[~stop][0]), int(counts[~stop][-1])
        every = np.concatenate(pairs)
        every = every[np.argsort(every[:, 0] / every[:, 1], kind="stable")]
        if len(every) > most // 2:
            edge = most // 8
            ranks = np.linspace(edge, len(every) - edge - 1, most // 2 - 2 * edge).round().astype(int)
            every = np.concatenate([every[:edge], every[ranks], every[-edge:]])
        ends = np.unique(clopper_pearson(every[:, 0], every[:, 1], self.confidence))
        return ends[(ends > 0.0) & (ends < 1.0)]

    def covers(self, coverage: float, shares: FloatArray) -> bool:
        """Whether the interval at the stop has at least this coverage at each of the shares."""
        return all(self.performance(float(p)).coverage >= coverage for p in shares)


def looks(width: float, n: int, taken: Sequence[int] = ()) -> list[int]:
    """Return the numbers of joints at which to look: each `GROWTH` times the one before; the last is `n`.

    Parameters
    ----------
    width : float
        Width of the interval at which to stop.
    n : int
        Number of joints of the campaign.
    taken : sequence of int
        Looks that were taken before, when the campaign was shorter; those below `n` are looks again.

    Returns
    -------
    list of int
        Ascending. With fewer joints than at the first look the interval is never narrow enough: with no joint above the
        level it ends at 1 - ((1 - 0.95) / 2)^(1 / joints).
    """
    own, joints = set(), max(float(LEAST_BESIDE), math.log(0.025) / math.log1p(-width))
    while joints < n:
        number = math.ceil(joints)
        own.add(number)
        low, high = clopper_pearson(number // 2, number, CONFIDENCES[-1])
        if high - low < 0.5 * width:  # narrow enough for any share, with half of the width for unresolved joints
            break
        joints *= GROWTH
    return [*sorted({number for number in (*own, *taken) if number < n}), n]


def scheme(width: float, planned: Sequence[int], coverage: float = 0.95) -> Scheme:
    """Choose the confidence level of a look so that the interval at the stop has a coverage for every share.

    Parameters
    ----------
    width : float
        Width of the interval at which to stop.
    planned : sequence of int
        See `looks`.
    coverage : float
        Coverage required of the interval at the stop.

    Returns
    -------
    Scheme
        The first of `CONFIDENCES` at which the coverage suffices.

    Examples
    --------
    >>> found = scheme(0.2, looks(0.2, 200))
    >>> found.looks[:4], found.confidence
    ([17, 18, 19, 20], 0.9525)
    >>> round(found.performance(0.25).coverage, 3), round(found.performance(0.25).joints)
    (0.976, 82)
    """
    for confidence in CONFIDENCES:
        made = Scheme(width, planned, confidence)
        if made.covers(coverage + MARGIN, made.critical_shares()):
            break
    return made


def fixed(p: float, width: float, confidence: float = 0.95) -> int:
    """Number of joints of a plan without looks: the interval is narrow enough with exactly a share p of them above."""
    low, high = 1, 2
    while _width(p * high, high, confidence) >= width:
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if _width(p * middle, middle, confidence) < width else (middle, high)
    return high


def _width(count: float, n: int, confidence: float) -> float:
    low, high = clopper_pearson(count, n, confidence)
    return float(high - low)


def _last_missing(n: int, p: float, confidence: float) -> int:
    """Largest count of n joints whose interval ends at the share p or below; -1 if there is none."""
    from scipy.special import bdtrik

    tail = 0.5 * (1.0 - confidence)
    return -1 if math.log(tail) < n * math.log1p(-p) * (1.0 - 1e-9) else math.floor(bdtrik(tail, n, p) + 1e-6)


def _binomial(n: int, p: float) -> tuple[NDArray[np.intp], FloatArray]:
    """Counts of n trials within `REACH` standard deviations of their mean, and their probabilities."""
    from scipy.special import gammaln, xlog1py, xlogy

    reach = REACH * math.sqrt(n * p * (1.0 - p)) + REACH**2 / 3.0
    k = np.arange(max(0, math.floor(n * p - reach)), min(n, math.ceil(n * p + reach)) + 1)
    logs = gammaln(n + 1) - gammaln(k + 1) - gammaln(n - k + 1) + xlogy(k, p) + xlog1py(n - k, -p)
    return k, np.exp(logs)
