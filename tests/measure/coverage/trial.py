"""An experiment: joints are drawn from a known law, estimators give intervals, and the truth is known."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from tolstat.analysis.binomial import clopper_pearson
from tolstat.analysis.design import Design
from tolstat.analysis.sample import Sample
from tolstat.common.loads import FloatArray
from tolstat.common.tables import Status

NUMBERS = 64, 256, 1024
"""Numbers of joints."""
SURE = 0.9999
"""Confidence level at which an interval is said to miss: hundreds of cases are judged, by both sides."""
Rng = np.random.Generator


class Asked(NamedTuple):
    """An interval that an experiment asks for.

    Attributes
    ----------
    statistic : str
        A key of `statistics.STATISTICS`.
    case : str
        Law and setting.
    n : int
        Number of joints.
    fresh : float
        Width of the interval of the same quantity from `n` independent joints of equal weight; NaN where the estimator
        is that one, or the quantity cannot be estimated from such joints.
    known : str
        Why the interval covers less than it claims; empty where it should cover.
    """

    statistic: str
    case: str
    n: int
    fresh: float = np.nan
    known: str = ""


class Found(NamedTuple):
    """An interval of one sample, and the truth; `given`: False where the estimator refuses."""

    lower: float
    upper: float
    truth: float
    given: bool = True


def found(own: Any, truths: Iterable[float]) -> list[Found]:
    """Intervals with ends `lower` and `upper`, (m,) or a single one, and the truths."""
    return [Found(*each) for each in zip(np.atleast_1d(own.lower), np.atleast_1d(own.upper), truths, strict=True)]


def shares_at(sample: Sample, truths: Mapping[float, float]) -> list[Found]:
    """Shares of the joints above levels, with the true share of each level."""
    rows = sample.curve(list(truths))
    return [Found(r["lower"], r["upper"], truths[r["level"]]) for r in rows]


def quantiles_at(sample: Sample, truths: Mapping[float, float]) -> list[Found]:
    """Loads that shares of the joints stay at or below, with the true load of each share."""
    return [own for share, truth in truths.items() for own in found(sample.quantile(share), [truth])]


class Experiment(NamedTuple):
    """Intervals that are asked of the same samples.

    Attributes
    ----------
    asked : tuple of Asked
        What is asked.
    once : callable
        Maps a random generator to what an estimator finds from one sample: `Found`, in the order of `asked`.
    most : int
        Largest number of seeds; less than the default for samples that take a second.
    refusal : tuple of type
        Exceptions with which the estimators refuse a sample.
    """

    asked: tuple[Asked, ...]
    once: Callable[[np.random.Generator], Sequence[Found]]
    most: int = 1_000_000
    refusal: tuple[type[Exception], ...] = ()

    def run(self, seeds: range) -> FloatArray:
        """Repeat with samples of several seeds.

        Parameters
        ----------
        seeds : range
            Seeds; the random numbers of two experiments with one seed are independent.

        Returns
        -------
        ndarray, shape (seeds, asked, 4)
            1 where an interval is given, 1 where it is above the truth, 1 where it is below, and its width.
        """
        own = zlib.crc32(f"{self.asked[0].statistic}, {self.asked[0].case}, {self.asked[0].n}".encode())
        rows = []
        for seed in seeds:
            try:
                found = self.once(np.random.default_rng([seed, own]))
            except self.refusal:
                found = [Found(np.nan, np.nan, np.nan)] * len(self.asked)
            if len(found) != len(self.asked):
                raise ValueError(f"{len(found)} intervals for {len(self.asked)} that are asked")
            rows.append([_judged(one) for one in found])
        return np.array(rows, dtype=float)


def _judged(found: Found) -> tuple[bool, bool, bool, float]:
    given = found.given and not (np.isnan(found.lower) or np.isnan(found.upper))
    if not given:
        return False, False, False, np.nan
    return True, found.lower > found.truth, found.upper < found.truth, found.upper - found.lower


class Row(NamedTuple):
    """What was measured of one interval over the seeds.

    Attributes
    ----------
    asked : Asked
        What was asked.
    seeds, given : int
        Number of samples, and of those with an interval.
    above, below : int
        Number of intervals above the truth, and below it.
    width : float
        Median width over that of fresh joints; NaN if there is none to compare with.
    """

    asked: Asked
    seeds: int
    given: int
    above: int
    below: int
    width: float

    @classmethod
    def of(cls, asked: Asked, judged: FloatArray) -> Row:
        """Count; `judged` is (seeds, 4), see `Experiment.run`."""
        given, above, below = (int(column.sum()) for column in judged.T[:3])
        width = float(np.median(judged[judged[:, 0] > 0, 3])) / asked.fresh if given else np.nan
        return cls(asked, len(judged), given, above, below, width)

    @property
    def covered(self) -> tuple[float, float, float]:
        """Share of the intervals that contain the truth, with its own Clopper–Pearson interval; NaN without any."""
        if not self.given:
            return np.nan, np.nan, np.nan
        hits = self.given - self.above - self.below
        lower, upper = clopper_pearson(hits, self.given)
        return hits / self.given, float(lower), float(upper)

    def misses_surely(self, most: float) -> bool:
        """Whether the interval of the share of misses on one side lies above `most`, with the confidence `SURE`."""
        return bool(max(clopper_pearson([self.above, self.below], self.given, SURE)[0]) > most)


class Law(NamedTuple):
    """A distribution of a load.

    Attributes
    ----------
    name : str
        As in the table.
    ppf, sf : callable
        Quantile of a share, and share above a level, elementwise.
    """

    name: str
    ppf: Callable[[Any], Any]
    sf: Callable[[Any], Any]

    def draw(self, rng: np.random.Generator, n: int) -> FloatArray:
        """N independent loads."""
        return np.asarray(self.ppf(rng.random(n)), dtype=float)

    def fresh_quantile(self, n: int, share: float) -> float:
        """Typical width of the interval of a quantile from n joints: that of its share, through the law."""
        lower, upper = clopper_pearson(n * share, n)
        return float(self.ppf(upper) - self.ppf(lower))


def fresh_share(n: int, share: float) -> float:
    """Width of the Clopper–Pearson interval of n joints, of which `share` are above the level."""
    lower, upper = clopper_pearson(n * share, n)
    return float(upper - lower)


@cache
def laws() -> dict[str, Law]:
    """Laws by name: symmetric, skew, bounded, with a heavy tail, and with ties."""
    own = {
        "normal": stats.norm(),
        "lognormal": stats.lognorm(1.0),
        "uniform": stats.uniform(),
        "exponential": stats.expon(),
        "gamma of shape 3": stats.gamma(3.0),
        "Pareto tail, k = 0.2": stats.genpareto(0.2),
        "slightly skew": stats.lognorm(0.25),
    }
    found = {name: Law(name, law.ppf, law.sf) for name, law in own.items()}
    # loads that are rounded to half a standard deviation: many joints have the same
    found["rounded"] = Law(
        "rounded",
        lambda p: np.round(2.0 * stats.norm.ppf(p)) / 2.0,
        lambda x: stats.norm.sf((np.floor(2.0 * np.asarray(x) + 1e-9) + 0.5) / 2.0),
    )
    return found


def sample_of(loads: FloatArray | NDArray[np.bool_], design: Design | None = None) -> Sample:
    """Valid joints with these loads; by default independent."""
    return Sample.of(loads, np.full(len(loads), int(Status.OK)), design)
