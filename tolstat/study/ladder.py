"""Steps of a tolerance that a drawing knows: classes of ISO 2768, grades of ISO 286, else the series R10 (ISO 3)."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from tolstat.common import units
from tolstat.common.units import DISPLAY_UNITS
from tolstat.study import rewriting, scaling, widths
from tolstat.study.costs import Cost, features
from tolstat.study.scaling import Tolerance
from tolstat.study.study import Study
from tolstat.study.tolerances import fits, iso
from tolstat.study.tolerances.correlation import Group

R10 = (1.0, 1.25, 1.6, 2.0, 2.5, 3.15, 4.0, 5.0, 6.3, 8.0)
"""Preferred numbers, each 10^(1/10) = 1.26 times the one before."""
LEAST_STEP = 1.12
"""Smallest ratio of a step: from a width that is no preferred number the next one may be nearer."""
DIGITS = 4
"""Significant digits of a width."""


class Rung(NamedTuple):
    """A width of a line.

    Attributes
    ----------
    words : str
        ``±0.4 deg``, ``class m``, ``H7/f7``.
    factors : tuple of float
        How many times as wide each tolerance of the line is as on the drawing.
    entries : dict
        Keys of the entry of each tolerance that changes, by its pattern; of a fit by ``fit``.
    """

    words: str
    factors: tuple[float, ...]
    entries: Mapping[str, Mapping[str, Any]]


class Ladder(NamedTuple):
    """The widths that a line of the drawing may have.

    Attributes
    ----------
    line : Group
        The line, and what it draws.
    tolerances : tuple of Tolerance
        Its entry; the two diameters of a fit.
    costs : tuple of Cost
        Cost of each.
    rungs : tuple of Rung
        From the finest to the coarsest.
    drawn : int
        That of the drawing.
    """

    line: Group
    tolerances: tuple[Tolerance, ...]
    costs: tuple[Cost, ...]
    rungs: tuple[Rung, ...]
    drawn: int

    @property
    def features(self) -> int:
        """Number of features that it applies to."""
        return sum(len(features(tolerance)) for tolerance in self.tolerances)

    def cost(self, rung: int) -> float:
        """Cost of the line at one of its rungs."""
        return sum(cost.at(f) for cost, f in zip(self.costs, self.rungs[rung].factors, strict=True))


def ladders(study: Study, tolerances: Sequence[Tolerance], costs: Sequence[Cost]) -> list[Ladder]:
    """Ladder of each line that may change, in the order of the study; the two diameters of a fit are one line."""
    found, of_fit = [], set(fits.patterns(study.mechanism)) if study.fit is not None else set()
    lines = {line.label for line in widths.lines(study)}
    for tolerance, cost in zip(tolerances, costs, strict=True):
        if tolerance.pattern in lines - of_fit and cost.reach[0] < cost.reach[1]:
            finer = list(_rungs(tolerance, cost.reach[0], -1))[::-1]
            coarser = list(_rungs(tolerance, cost.reach[1], 1))
            rungs = (*finer, Rung(_words(tolerance, tolerance.width), (1.0,), {}), *coarser)
            group = Group(tolerance.pattern, tolerance.names)
            found.append(Ladder(group, (tolerance,), (cost,), rungs, len(finer)))
    both = [(t, c) for t, c in zip(tolerances, costs, strict=True) if t.pattern in of_fit]
    if len(both) == len(of_fit) == 2 and all(cost.reach[0] < cost.reach[1] for _, cost in both):
        found.append(_of_fit(study, both))
    return found


def kept(study: Study, free: Sequence[Ladder]) -> list[str]:
    """Labels of the lines of a study that are not among those that may change."""
    every = dict.fromkeys(widths.label(study, entry) for entry in study.entries)
    return [label for label in every if label not in {own.line.label for own in free}]


def text_of(study: Study, chosen: Sequence[tuple[Ladder, int]], seed: int) -> str:
    """Text of a study with each of some lines at one of its rungs, and another seed."""
    entries = entries_of(chosen)
    text, fit = scaling.rewritten(study, entries, seed), entries.get(fits.KEY)
    return text if fit is None else rewriting.with_keys(text, {fits.PATH: fit}, f"{study.name}.toml")


def entries_of(chosen: Sequence[tuple[Ladder, int]]) -> dict[str, dict[str, Any]]:
    """Keys of each changed entry of ``[tolerances]`` by its pattern, with each of some lines at one of its rungs."""
    rungs = [ladder.rungs[step] for ladder, step in chosen]
    return {pattern: dict(keys) for rung in rungs for pattern, keys in rung.entries.items()}


def _rungs(tolerance: Tolerance, reach: float, side: int) -> Iterator[Rung]:
    """Rungs from the drawing on to the finer (-1) or coarser (1) side, down or up to a factor."""
    factor, grade = 1.0, tolerance.entry.get("iso2768")
    while grade in widths.CLASSES and 0 <= (number := widths.CLASSES.index(grade) + side) < len(widths.CLASSES):
        grade = widths.CLASSES[number]
        entry = tolerance.entry | {"iso2768": grade}
        factor = scaling.width(entry, tolerance.site) / tolerance.width
        if factor != 1.0 and side * factor <= side * reach:
            words = f"class {grade} ({_words(tolerance, factor * tolerance.width)})"
            yield Rung(words, (factor,), {tolerance.pattern: entry})
    # a band between two limits is written by its whole width
    whole = 2.0 if "lower" in tolerance.entry else 1.0
    scale = whole * tolerance.width * DISPLAY_UNITS.get(tolerance.site.unit, ("", 1.0))[1]
    while side * (factor := preferred(scale * factor, side) / scale) <= side * reach * (1.0 + side * 1e-9):
        entry = tolerance.scaled(factor, DIGITS)
        yield Rung(_words(tolerance, factor * tolerance.width), (factor,), {tolerance.pattern: entry})


def preferred(value: float, side: int) -> float:
    """Next preferred number below (-1) or above (1) a value, at least `LEAST_STEP` away."""
    decade = math.floor(math.log10(value))
    numbers = [number * 10.0**k for k in (decade - 1, decade, decade + 1) for number in R10]
    if side > 0:
        return next(number for number in numbers if number >= LEAST_STEP * value)
    return next(number for number in reversed(numbers) if number <= value / LEAST_STEP)


def _words(tolerance: Tolerance, width: float) -> str:
    return scaling.marked(tolerance.mark, units.shown(width, tolerance.site.unit, DIGITS))


def _of_fit(study: Study, both: Sequence[tuple[Tolerance, Cost]]) -> Ladder:
    """Ladder of a fit: grades of hole and pin, one after the other, with the fundamental deviations of the drawing."""
    assert study.fit is not None
    tolerances, costs = zip(*both, strict=True)
    entry = study.fit.entry
    drawn, written = iso.parse(entry.code), tomllib.loads(study.text)["tolerances"][fits.KEY]

    def rungs(side: int) -> Iterator[Rung]:
        code = drawn
        while True:
            grades = [iso.GRADE_NAMES.index(grade) + side for grade in (code.hole_grade, code.shaft_grade)]
            if not 0 <= min(grades) <= max(grades) < len(iso.GRADE_NAMES):
                return
            code = code._replace(hole_grade=iso.GRADE_NAMES[grades[0]], shaft_grade=iso.GRADE_NAMES[grades[1]])
            try:
                zones = iso.zones(code, entry.size)
            except ValueError:  # the tables end here
                return
            halves = (new.half / old.half for new, old in zip(zones, entry.zones, strict=True))
            of = dict(zip(fits.patterns(study.mechanism), halves, strict=True))
            factors = tuple(of[t.pattern] for t in tolerances)
            reached = all(c.reach[0] <= f <= c.reach[1] for c, f in zip(costs, factors, strict=True))
            if zones.least < 0.0 or not reached:
                return
            yield Rung(str(code), factors, {fits.KEY: written | {"code": str(code)}})

    finer = list(rungs(-1))[::-1]
    every = (*finer, Rung(entry.code, (1.0, 1.0), {}), *rungs(1))
    line = next(line for line in widths.lines(study) if entry.code in line.label)
    return Ladder(line, tolerances, costs, every, len(finer))
