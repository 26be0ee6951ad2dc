"""Share of the joints above a level where tolerances are known from measured parts: three intervals.

The joints of one campaign are reweighted to each likely process (`process.draws`). That of the joints is the interval
at the tolerances as they are stated; that of the parts are quantiles of the share over the processes; in that of both,
the share has, for each process, the distribution whose quantiles are the ends of the interval of weighted joints
(`weighted.Split.far`), and the ends are quantiles of the mixture of these. A process that the joints do not support
counts with the share 0 at lower ends and 1 at upper ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tolstat.analysis import process
from tolstat.analysis.estimates import Mask
from tolstat.analysis.process import Draws, Known, Sums
from tolstat.analysis.reweight import LARGEST_SPREAD, LEAST_ESS
from tolstat.analysis.weighted import Split
from tolstat.common.bisection import first
from tolstat.common.late import special
from tolstat.common.loads import FloatArray

BLOCK = 1 << 20
"""Number of weights that are held at a time."""
STEPS = 34
"""Number of halvings of the share in which an end is searched."""


class Mixture(NamedTuple):
    """A part of the distribution that joints were drawn from.

    Attributes
    ----------
    share : float
        Its share of the joints.
    parts : tuple of int or None
        For each entry, the posterior predictive of so many parts; None: the tolerances.
    """

    share: float
    parts: tuple[int | None, ...]


class KnownShare(NamedTuple):
    """Share of the joints above a level.

    Attributes
    ----------
    expected : float
        Mean of the share over the likely processes.
    parts_lower, parts_upper : float
        Interval that covers what the parts leave unknown of the process.
    lower, upper : float
        Interval that covers both that and the sampling of joints.
    unsupported : float
        Share of the likely processes that the joints do not support.
    """

    expected: float
    parts_lower: float
    parts_upper: float
    lower: float
    upper: float
    unsupported: float


def supported(n: int, drawn: Draws, known: tuple[Known, ...], mixture: Sequence[Mixture]) -> Mask:
    """Tell which processes n joints support, (K,), by the exact mean square of their density ratio.

    `LEAST_ESS` joints must remain effective; where the ratio has no bound, that of the tolerances, its mean square must
    not exceed `LARGEST_SPREAD`.

    Parameters
    ----------
    n : int
        Number of joints.
    drawn, known
        The processes and their entries.
    mixture : sequence of Mixture
        What the joints were drawn from; parts of it may be left out.
    """
    is_supported = np.zeros(len(drawn.mean), dtype=bool)
    for part in mixture:
        logs = process.log_mean_square(drawn, known, part.parts) - np.log(part.share)
        bounded = None not in part.parts
        is_supported |= (logs <= np.log(n / LEAST_ESS)) & (bounded | (logs <= np.log(LARGEST_SPREAD)))
    return is_supported


def tallies(
    sums: Sequence[Sums],
    known: Sequence[Known],
    drawn: Draws,
    weights: FloatArray,
    events: Sequence[tuple[Mask, Mask]],
    heaviest: float = 0.0,
) -> list[Split]:
    """Weights above and below, of each event, for each process.

    Parameters
    ----------
    sums : sequence of Sums
        Scores of the errors of each entry in n joints.
    known, drawn
        The entries and the processes.
    weights : ndarray, (n,)
        Density of each joint under the tolerances over that which it was drawn from.
    events : sequence of pairs of ndarray of bool, (n,)
        Joints that are above a level, and joints that count.
    heaviest : float
        Largest weight that a joint can have at the tolerances as stated; 0 if no bound is known. Where few joints are
        on a side, the joint added there has at least this weight, as in the interval of the joints alone.

    Returns
    -------
    list of Split
        One of each event, with arrays (K,).
    """
    base = np.log(weights)
    sides = [side & counted for above, counted in events for side in (above, ~above)]
    members = np.stack(sides).astype(float)
    tables: list[list[FloatArray]] = []
    step = max(1, BLOCK // len(base))
    for begin in range(0, len(drawn.mean), step):
        here = slice(begin, begin + step)
        logs = base[:, None] + sum(
            process.log_ratios(scores, entry.errors, drawn.mean[here, k], drawn.deviation[here, k])
            for k, (scores, entry) in enumerate(zip(sums, known, strict=True))
        )
        block = np.exp(logs - logs.max(axis=0))  # weights, up to a factor of each process
        largest = np.stack([block[mask].max(axis=0, initial=0.0) for mask in sides])
        heaviest_of_any = np.broadcast_to(
            np.maximum(block.max(axis=0), heaviest * np.exp(-logs.max(axis=0))), largest.shape
        )
        tables.append([members @ block, members @ np.square(block), largest, heaviest_of_any])
    *tallied, heaviest_of_any = (np.concatenate(parts, axis=1) for parts in zip(*tables, strict=True))
    return [
        Split.of([tally[k : k + 2] for tally in tallied], heaviest_of_any[k : k + 2]) for k in range(0, len(sides), 2)
    ]


def intervals(
    plain: Split, low: Sequence[Split], high: Sequence[Split], supported: Mask, confidence: float = 0.95
) -> KnownShare:
    """Make the intervals of a share.

    Parameters
    ----------
    plain : Split
        Joints with a valid load, for each of K processes.
    low, high : sequence of Split
        The same, and with joints without a valid load below or above, loads shifted by their numerical error: the
        lower end is the least of `low`, the upper end the largest of `high`.
    supported : ndarray of bool, (K,)
        Processes that the joints support.
    confidence : float
        Confidence level.
    """
    tail = 0.5 * (1.0 - confidence)
    share = plain.share
    usable = supported & np.isfinite(share)
    least, most = np.where(usable, share, 0.0), np.where(usable, share, 1.0)
    lower = 1.0 - max(_upper_end(split, 1, usable, tail) for split in low)
    upper = max(_upper_end(split, 0, usable, tail) for split in high)
    expected = float(share[usable].mean()) if usable.any() else np.nan
    ends = float(np.quantile(least, tail)), float(np.quantile(most, 1.0 - tail))
    return KnownShare(expected, *ends, lower, upper, float(np.mean(~usable)))


def _upper_end(split: Split, side: int, usable: Mask, tail: float) -> float:
    """Largest share of a side, above (0) or below (1), that is exceeded with the probability `tail`."""
    inside, outside = (parameter[side] for parameter in split.far())
    inner = usable & (split.total[1 - side] > 0.0) & np.isfinite(inside) & (inside > 0.0) & (outside > 0.0)

    def covers(share: FloatArray) -> bool:
        below = special.betainc(np.where(inner, inside, 1.0), np.where(inner, outside, 1.0), share)
        return bool(np.where(inner, below, 0.0).mean() >= 1.0 - tail)

    return float(first(covers, 0.0, 1.0, STEPS))
