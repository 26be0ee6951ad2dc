"""Parts that are measured: matched class to class, scrapped, or their joints rejected at assembly by a gauge.

Selective assembly matches pins and holes class to class. A cross is one part with four pins, a fork one with two holes.
A part is in the class of its worst measured diameter: that of the largest pin, of the smallest hole. Classes are
numbered from small to large diameters; crosses of class c go with forks of class c. Of the parts of a class as many are
matched as the rarest of the three kinds has.

Parts that are scrapped, and joints that are rejected, are drawn all the same: a joint counts by the probability that
its parts and itself are accepted, so that one campaign tells the shares before and after.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, model_validator

from tolstat.common import units
from tolstat.common.bisection import first
from tolstat.common.errors import gather
from tolstat.common.late import special
from tolstat.common.load_kinds import PINS
from tolstat.common.strict import Strict, refuse
from tolstat.common.tables import HOLES
from tolstat.joint import HOLE_OF_PIN, Joint
from tolstat.study import selection
from tolstat.study.selection import UNITS, Reading
from tolstat.study.tolerances.distributions import Array, Distribution, probability, share_between
from tolstat.study.tolerances.entry import NotNegative, Site, Toleranced, Value
from tolstat.study.tolerances.kinds import Tolerances
from tolstat.study.tolerances.zone_laws import scores_among

MAX_CLASSES = 20
ROUNDING = 1e-8
"""Unmatched share below which it is the rounding of classes of equally many parts."""
LEAST = 1e-300
"""Smallest probability of a diameter."""


class SelectiveEntry(Strict):
    """Pins and holes are sorted by their measured diameters, and crosses and forks of equal class matched."""

    classes: int = Field(strict=True, ge=1, le=MAX_CLASSES, examples=[3])
    """number of classes; 1: not sorted"""
    gauge: Annotated[units.Length, AfterValidator(units.not_negative)] = Field(default=0.0, examples=["2 um"])
    """standard deviation of the error with which a diameter is measured"""
    split: Literal["width", "count"] = Field(default="width", examples=["count"])
    """`width`: classes are equal parts of the tolerance bands, those at the ends are open; `count`: each class has as
    many crosses, and as many forks, as any other"""


class Kind(NamedTuple):
    """A kind of parts.

    Attributes
    ----------
    name : str
        In words.
    errors : tuple of str
        Diameters that are measured.
    worst : int
        1 where the largest diameter decides, -1 where the smallest does.
    """

    name: str
    errors: tuple[str, ...]
    worst: int


KINDS = (
    Kind("cross", tuple(f"{pin}.diameter" for pin in PINS), 1),
    Kind("input fork", ("hole1.diameter", "hole2.diameter"), -1),
    Kind("output fork", ("hole3.diameter", "hole4.diameter"), -1),
)
DIAMETERS = tuple(name for kind in KINDS for name in kind.errors)


_Diameters = tuple[Distribution, tuple[float, float] | None]
"""Distribution and band of all diameters of a kind."""


class Range(NamedTuple):
    """Parts whose measured diameter is between two values.

    Attributes
    ----------
    distribution : Distribution
        Of the diameter of all parts, deviation in m.
    gauge : float
        Standard deviation of the gauge error, m.
    low, high : float
        Values between which the measured deviation is, m; may be infinite.
    """

    distribution: Distribution
    gauge: float
    low: float
    high: float

    @property
    def share(self) -> float:
        """Share of the parts."""
        if self.gauge:
            return _among(self)[2]
        return float(np.diff(self._ends)[0])

    def scores(self, u: Array) -> Array:
        """Score, among all parts, of the diameter that is exceeded with probability 1 - u in the range; both (n,)."""
        if self.gauge:
            z, among, _ = _among(self)
            return np.asarray(np.interp(special.ndtri(u), among, z))
        low, high = self._ends
        return np.asarray(special.ndtri(np.clip(low + u * (high - low), LEAST, 1.0 - 2.0**-53)))

    @property
    def _ends(self) -> Array:
        """Probabilities that a diameter without gauge error is below each end."""
        return probability(self.distribution, np.array([self.low, self.high]))


@lru_cache(maxsize=512)
def _among(of: Range) -> tuple[Array, Array, float]:
    def inside(deviation: Array) -> Array:
        d = np.clip(deviation, -1.0, 1.0)  # beyond the largest score an unbounded one is infinite
        return np.asarray(special.ndtr((of.high - d) / of.gauge) - special.ndtr((of.low - d) / of.gauge))

    return scores_among(of.distribution, inside)


class Matching(NamedTuple):
    """Classes, and the parts in them.

    Attributes
    ----------
    edges : ndarray, shape (kinds, classes + 1)
        Edges of the classes of each of `KINDS`, measured deviations, m; infinite at both ends.
    shares : ndarray, shape (kinds, classes)
        Share of the parts of a kind that are in a class.
    matched : ndarray, shape (classes,)
        Share of the parts that are in a class and matched: the least of `shares`.
    near, within : tuple of tuple of Range
        By kind and class: diameters on the harmless side of the class, and inside it.
    """

    edges: Array
    shares: Array
    matched: Array
    near: tuple[tuple[Range, ...], ...]
    within: tuple[tuple[Range, ...], ...]

    @property
    def unmatched(self) -> float:
        """Share of the parts that remain without a partner of their class."""
        share = float(1.0 - self.matched.sum())
        return share if share > ROUNDING else 0.0

    def probabilities(self, u_class: Array, u: Mapping[str, Array]) -> dict[str, Array]:
        """Probabilities of the diameters of assembled joints.

        Parameters
        ----------
        u_class : ndarray, shape (n,)
            Probabilities from which the class of each joint follows.
        u : mapping of str to ndarray, shape (n,)
            Independent probabilities of `DIAMETERS`.

        Returns
        -------
        dict of str to ndarray, (n,)
            Probabilities of the same diameters in their distributions among all parts.
        """
        upto = np.cumsum(self.matched) / self.matched.sum()
        number = np.searchsorted(upto[:-1], u_class, side="right")
        scores: dict[str, Array] = {}
        for kind, near, within in zip(KINDS, self.near, self.within, strict=True):
            for c in np.unique(number):
                here = np.flatnonzero(number == c)
                drawn = _in_class([u[name][here] for name in kind.errors], near[c], within[c])
                for name, z in zip(kind.errors, drawn, strict=True):
                    scores.setdefault(name, np.empty(len(number)))[here] = z
        low, high = np.finfo(float).tiny, 1.0 - np.finfo(float).epsneg
        return {name: np.clip(special.ndtr(z), low, high) for name, z in scores.items()}


def _in_class(u: list[Array], near: Range, within: Range) -> list[Array]:
    """Scores of the diameters of parts whose worst measured diameter is inside a class.

    One diameter after the other, each from its own probability: of those before either one was inside the class, and
    the next is anywhere but beyond it; or all were on the harmless side, and one of the others must be inside.
    """
    low, inside = near.share, within.share
    either = Range(near.distribution, near.gauge, min(near.low, within.low), max(near.high, within.high))
    drawn, decided = [], np.zeros(len(u[0]), dtype=bool)
    for k, probabilities in enumerate(u):
        remaining = len(u) - k
        q = inside * (low + inside) ** (remaining - 1) / ((low + inside) ** remaining - low**remaining)
        hit = ~decided & (probabilities >= 1.0 - q)
        z = np.empty(len(probabilities))
        for of, here, v in (
            (either, decided, probabilities),
            (within, hit, (probabilities - (1.0 - q)) / q),
            (near, ~decided & ~hit, probabilities / max(1.0 - q, LEAST)),
        ):
            if here.any():
                z[here] = of.scores(np.clip(v[here], 2.0**-54, 1.0 - 2.0**-53))
        decided |= hit
        drawn.append(z)
    return drawn


def matching(
    settings: SelectiveEntry, entries: Iterable[Toleranced], distributions: Mapping[str, Distribution]
) -> Matching:
    """Classes of a study's diameters.

    Parameters
    ----------
    settings : SelectiveEntry
        ``sampling.selective``.
    entries : iterable of Toleranced
        Entries of the study, for the bands of the diameters.
    distributions : mapping of str to Distribution
        Distribution of each quantity.
    """
    bands = _bands(entries)
    first = [kind.errors[0] for kind in KINDS]
    diameters = tuple((distributions[name], bands.get(name)) for name in first)
    return _matching(settings.classes, settings.gauge, settings.split, diameters)


@lru_cache(maxsize=32)
def _matching(classes: int, gauge: float, split: str, diameters: tuple[_Diameters, ...]) -> Matching:
    edges = np.array([_edges(classes, gauge, split, *each) for each in zip(KINDS, diameters, strict=True)])
    near, within, shares = [], [], np.empty((len(KINDS), classes))
    for number, (kind, (distribution, _)) in enumerate(zip(KINDS, diameters, strict=True)):
        pairs = list(zip(edges[number][:-1].tolist(), edges[number][1:].tolist(), strict=True))
        within.append(tuple(Range(distribution, gauge, low, high) for low, high in pairs))
        harmless = [(-np.inf, low) if kind.worst > 0 else (high, np.inf) for low, high in pairs]
        near.append(tuple(Range(distribution, gauge, *ends) for ends in harmless))
        for c in range(classes):
            low = 0.0 if harmless[c][0] == harmless[c][1] else near[-1][c].share
            count = len(kind.errors)
            shares[number, c] = (low + within[-1][c].share) ** count - low**count
    return Matching(edges, shares, shares.min(axis=0), tuple(near), tuple(within))


def _edges(classes: int, gauge: float, split: str, kind: Kind, diameters: _Diameters) -> NDArray[np.float64]:
    """Edges of the classes of a kind, (classes + 1,)."""
    (distribution, band), parts = diameters, np.arange(1, classes) / classes
    if split == "width":
        assert band is not None
        inner = band[0] + (band[1] - band[0]) * parts
    else:
        count = len(kind.errors)
        below = parts ** (1.0 / count) if kind.worst > 0 else 1.0 - (1.0 - parts) ** (1.0 / count)
        inner = distribution.ppf(below)
        if gauge:  # of the measured deviations
            reach = distribution.ppf(np.array([1e-12, 1.0 - 1e-12])) + 9.0 * gauge * np.array([-1.0, 1.0])
            upto = np.vectorize(lambda end: Range(distribution, gauge, -np.inf, float(end)).share, otypes=[float])
            inner = first(lambda ends: upto(ends) >= below, reach[0], reach[1], halvings=40)
    return np.concatenate([[-np.inf], inner, [np.inf]])


def _bands(entries: Iterable[Toleranced]) -> dict[str, tuple[float, float] | None]:
    models: list[tuple[Any, Any]] = [pair for entry in entries for pair in entry.models if pair[0].name in DIAMETERS]
    return {site.name: model.band(site) for site, model in models}


def faults(settings: SelectiveEntry, scatter: Tolerances, depending: Collection[str]) -> Iterator[tuple[str, str]]:
    """Faults of ``sampling.selective`` with their remedies; `depending`: errors that depend on others."""
    distributions, bands = scatter.distributions, _bands(scatter.entries)
    missing = [name for name in DIAMETERS if name not in distributions]
    if missing:
        yield f"{missing[0]} has no tolerance", 'add "pin*.diameter" and "hole*.diameter" to [tolerances], or fit'
        return
    for kind in KINDS:
        if len({(str(distributions[name].describe()), bands[name]) for name in kind.errors}) > 1:
            remedy = "give the diameters of one part one tolerance"
            yield f"the diameters of the {kind.name} have different tolerances", remedy
        if settings.split == "width" and bands[kind.errors[0]] is None:
            yield f"{kind.errors[0]} has no band", 'add plus_minus, or write split = "count"'
    both = sorted(set(DIAMETERS) & set(depending))
    if both:
        found = f"{both[0]} depends on other parts or errors: by a correlation, a lot or a bonus with reject"
        yield found, "remove that, or selective"


MEASURABLE = {name: unit for name, unit in UNITS.items() if name.startswith(("pin", "hole"))}
"""Errors that can be measured at assembly, and their units; of ``pin1.clearance`` the radial clearance itself."""
CROSS, INPUT, OUTPUT = PARTS = ("cross", "input fork", "output fork")
"""Parts of a joint. The four pins are of one part: the worst of them scraps the cross."""


class RejectEntry(Strict):
    """Joints that are rejected at assembly by a measured value."""

    below: Value | None = Field(default=None, examples=["0.06 mm"])
    """smaller measured values are rejected"""
    above: Value | None = Field(default=None, examples=["0.14 mm"])
    """larger measured values are rejected"""
    gauge: NotNegative = Field(default=0.0, examples=["0.005 mm"])
    """standard deviation of the measurement; exact by default"""

    @model_validator(mode="after")
    def _has_a_limit(self) -> Self:
        if self.below is None and self.above is None:
            raise refuse("rejects nothing", "add below or above")
        if self.below is not None and self.above is not None and not self.below < self.above:
            raise refuse("below is not smaller than above: every joint is rejected", "give below < above")
        return self


class Gauge(NamedTuple):
    """What is measured, and which values are accepted.

    Attributes
    ----------
    name : str
        An error, or ``pin1.clearance``, the radial clearance of a pin.
    lower, upper : float
        Accepted values, SI.
    deviation : float
        Standard deviation of the gauge, SI.
    """

    name: str
    lower: float
    upper: float
    deviation: float

    @property
    def part(self) -> str:
        """Part that the error is of."""
        return part_of(self.name)

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of the errors that it measures."""
        pin, _, key = self.name.partition(".")
        return (self.name, f"{pin}.diameter", f"{HOLE_OF_PIN[pin]}.diameter") if key == "clearance" else (self.name,)

    def accepted(self, errors: NDArray[np.void], joint: Joint) -> NDArray[np.float64]:
        """Probability that each joint is accepted, (n,), from its errors.

        The error of the gauge is normal with mean zero; without deviation the gauge is exact.
        """
        values = np.asarray(errors[self.name])
        if self.name.endswith(".clearance"):
            _, pin, hole = self.columns
            nominal = joint.contact.D_H - joint.contact.D_P
            values = values + 0.5 * (nominal + np.asarray(errors[hole]) - np.asarray(errors[pin]))
        if self.deviation == 0.0:
            return ((values >= self.lower) & (values <= self.upper)).astype(float)
        low, high = (self.lower - values) / self.deviation, (self.upper - values) / self.deviation
        return share_between(low, high)


def part_of(name: str) -> str:
    """Part that an error or zone is of; empty for operating point and material."""
    feature = name.partition(".")[0]
    if feature in PINS or feature.endswith("_pins"):
        return CROSS
    if feature in (*HOLES[:2], "input_holes"):
        return INPUT
    return OUTPUT if feature in (*HOLES[2:], "output_holes") else ""


def of_parts(entries: Sequence[Toleranced]) -> list[Gauge]:
    """Gauges that scrap parts: those of the entries of ``[tolerances]``."""
    each = ((site, model.gauge_of(site)) for entry in entries for site, model in entry.models)
    return [Gauge(site.name, *band) for site, band in each if band is not None]


def read(file: Reading) -> tuple[Gauge, ...]:
    """Read ``[reject]``: what is measured of assembled joints."""
    gauges: list[Gauge] = []
    for entry in file.entries("reject"):
        with gather(file.faults):
            names = selection.resolve(entry, MEASURABLE, file.place)
            site = Site(names[0], MEASURABLE[names[0]], 0.0, file.folder)
            limits = file.model(RejectEntry, entry.value, *entry.path, site=site)
            lower = -math.inf if limits.below is None else limits.below
            upper = math.inf if limits.above is None else limits.above
            gauges += [Gauge(name, lower, upper, limits.gauge) for name in names]
    return tuple(gauges)
