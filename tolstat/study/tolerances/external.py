"""Distributions from outside the study: laws of scipy.stats, and measured parts in a CSV file.

A law is a call with literal numbers, ``distribution = "scipy:weibull_min(c=1.8, scale=0.012)"``: its text is parsed,
never evaluated. scipy.stats is imported for studies that have such an entry only.
"""

from __future__ import annotations

import ast
import math
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from typing import Any, Literal

import numpy as np
from pydantic import Field

from tolstat.analysis.measured import LEAST_PARTS
from tolstat.common import units
from tolstat.common.late import stats
from tolstat.common.strict import did_you_mean, refuse
from tolstat.common.text_table import TextTable
from tolstat.study.tolerances import distributions as tolerance
from tolstat.study.tolerances.distributions import Array, Distribution
from tolstat.study.tolerances.entry import SingleEntry, Site, Value

PREFIX = "scipy:"
EXAMPLE = 'write "scipy:weibull_min(c=1.8, scale=0.012)", numbers only'
MAX_LENGTH = 200
"""Maximum length of the text of a law, characters."""


@dataclass(frozen=True)
class ScipyLaw(Distribution):
    """Law of scipy.stats, with parts outside a band rejected.

    Attributes
    ----------
    name : str
        Its name there.
    parameters : tuple of (str, float)
        Shapes, and ``loc`` and ``scale`` in units of `unit`.
    unit : float
        SI.
    lower, upper : float, optional
        Ends of the band, SI.
    """

    name: str
    parameters: tuple[tuple[str, float], ...]
    unit: float
    lower: float | None = None
    upper: float | None = None

    @cached_property
    def whole(self) -> Any:
        """The law of scipy.stats before parts are rejected, in units of `unit`."""
        return getattr(stats, self.name)(**dict(self.parameters))

    @cached_property
    def ends(self) -> Array:
        """Ends of the band in units of `unit`."""
        lower, upper = self.lower, self.upper
        return np.array([-math.inf if lower is None else lower, math.inf if upper is None else upper]) / self.unit

    @cached_property
    def share(self) -> float:
        """Share of the parts that is not rejected; from the upper tail if the band lies there."""
        (below, up_to), (above, beyond) = self.whole.cdf(self.ends), self.whole.sf(self.ends)
        return float(up_to - below if below < 0.5 else above - beyond)

    def ppf(self, u: Array) -> Array:
        """See `Distribution.ppf`."""
        below, beyond = self.whole.cdf(self.ends[0]), self.whole.sf(self.ends[1])
        # each half from its own tail: probabilities near 1 have fewer significant digits than those near 0
        low, high = below + u * self.share, beyond + (1.0 - u) * self.share
        x = np.where(low <= 0.5, self.whole.ppf(np.minimum(low, 1.0)), self.whole.isf(np.minimum(high, 1.0)))
        return np.asarray(self.unit * np.clip(x, *self.ends))

    def cdf(self, x: Array) -> Array:
        """See `Distribution.cdf`."""
        x, below = np.clip(x / self.unit, *self.ends), self.whole.cdf(self.ends[0])
        share = self.whole.cdf(x) - below if below < 0.5 else self.whole.sf(self.ends[0]) - self.whole.sf(x)
        return np.asarray(np.clip(share / self.share, 0.0, 1.0))

    def describe(self) -> dict[str, Any]:
        """See `Distribution.describe`."""
        band = {key: end for key, end in (("lower", self.lower), ("upper", self.upper)) if end is not None}
        return {"distribution": f"{PREFIX}{self.name}", **dict(self.parameters), "unit": self.unit, **band}

    def openturns(self, ot: Any) -> Any:
        """See `Distribution.openturns`."""
        ends = [self.ends[0]], [self.ends[1]], [self.lower is not None], [self.upper is not None]
        whole = ot.Distribution(ot.SciPyDistribution(self.whole))
        inside = ot.TruncatedDistribution(whole, ot.Interval(*ends))
        return ot.CompositeDistribution(ot.SymbolicFunction("x", f"{self.unit!r} * x"), inside)


class ScipyEntry(SingleEntry):
    """Continuous law of scipy.stats with literal numbers, such as `"scipy:weibull_min(c=1.8, scale=0.012)"`.

    `loc` and `scale` have the unit `unit`. Parts outside `lower` and `upper` are sorted out.
    """

    scales = False
    distribution: str = Field(pattern=f"^{PREFIX}", examples=["scipy:weibull_min(c=1.8, scale=0.012)"])
    """name and parameters of the law"""
    unit: str | None = Field(default=None, examples=["mm"])
    """unit of `loc` and `scale`; needed unless the error is a pure number"""
    lower: Value | None = Field(default=None, examples=["0 mm"])
    """parts below are sorted out"""
    upper: Value | None = Field(default=None, examples=["0.030 mm"])
    """parts above are sorted out"""

    def build(self, site: Site) -> ScipyLaw:
        """See `SingleEntry.build`."""
        name, parameters = _parsed(self.distribution.removeprefix(PREFIX))
        unit = _factor(self.unit, site, "loc and scale")
        law = ScipyLaw(name, parameters, unit, self.lower, self.upper)
        if not np.isfinite(law.whole.ppf(0.5)):
            raise refuse(f"{self.distribution!r} has a parameter that the law does not allow", "see scipy.stats")
        if not law.ends[0] < law.ends[1] or not law.share > 0.0:
            raise refuse("no part lies between lower and upper", "give lower < upper, where the law has parts")
        if not np.isfinite(law.ends).all() and not np.isfinite(law.whole.std()):
            raise refuse("the law has no finite standard deviation", "add lower and upper")
        return law

    def number(self, site: Site) -> str:
        """See `SingleEntry.number`."""
        return f"{self.distribution.removeprefix(PREFIX)} {self.unit or ''}".rstrip()

    def band(self, site: Site) -> tuple[float, float] | None:
        """See `SingleEntry.band`."""
        return None if self.lower is None or self.upper is None else (self.lower, self.upper)


def _factor(unit: str | None, site: Site, of: str) -> float:
    """SI value of the unit that numbers have; needed unless the error is a pure number."""
    if unit is None and site.unit != "1":
        raise refuse("missing key unit", f'add the unit of {of}, for example unit = "mm"')
    return units.to_si(1.0 if unit is None else f"1 {unit}", site.unit)


def _parsed(text: str) -> tuple[str, tuple[tuple[str, float], ...]]:
    """Name and parameters of a law from a call with literal numbers."""
    try:
        call = ast.parse(text.strip() if len(text) <= MAX_LENGTH else "", mode="eval").body
        if not (isinstance(call, ast.Call) and isinstance(call.func, ast.Name)):
            raise ValueError("no call of a name")
        by_name = [(str(keyword.arg), ast.literal_eval(keyword.value)) for keyword in call.keywords]
        by_position = [ast.literal_eval(value) for value in call.args]
        name = call.func.id
        if any(type(value) not in (int, float) for value in (*by_position, *(value for _, value in by_name))):
            raise ValueError("not only numbers")
    except (SyntaxError, ValueError, TypeError, MemoryError, RecursionError) as error:
        raise refuse(f"{text[:MAX_LENGTH]!r} is no law with numbers", EXAMPLE) from error
    laws = {key: law for key, law in vars(import_module("scipy.stats")).items() if isinstance(law, stats.rv_continuous)}
    if name not in laws:
        raise refuse(f"scipy.stats has no continuous law {name!r}", did_you_mean(name, sorted(laws)))
    shapes = laws[name].shapes.split(", ") if laws[name].shapes else []
    allowed = [*shapes, "loc", "scale"]
    pairs = [*zip(allowed, by_position, strict=False), *by_name]
    names = [key for key, _ in pairs]
    if len(by_position) > len(allowed) or len(set(names)) < len(names) or not set(shapes) <= set(names) <= set(allowed):
        raise refuse(f"{text!r} does not give each parameter once", f"{name} has {', '.join(allowed)}")
    values = dict(pairs)
    return name, tuple((key, float(values[key])) for key in allowed if key in values)


RARE = 0.005
"""Share of the parts beyond a value that a reader of a tail asks about."""


class MeasuredEntry(SingleEntry):
    """Measured parts of a text file with a header, drawn with equal probability; or, with `law`, its sample.

    With `law` mean and deviation of the sample are those of the parts, and the study knows that they are estimates.
    """

    scales = False
    distribution: Literal["measured"]
    file: str | None = Field(default=None, examples=["rattle.csv"])
    """path of the text file, from the study's folder"""
    column: str | None = Field(default=None, examples=["speed_rpm"])
    """name of the column in the header, without its unit"""
    values: list[float] | None = Field(default=None, examples=[[0.012, -0.004, 0.007]])
    """the measured values, in place of a file; needs `law`"""
    unit: str | None = Field(default=None, examples=["rpm"])
    """unit of the values; needed unless the file has it or the error is a pure number"""
    law: Literal["normal", "lognormal"] | None = Field(default=None, examples=["normal"])
    """law that the parts are a sample of, for shares far out; without it each joint has one of the measured values"""

    def measured_parts(self, site: Site) -> int:
        """See `ToleranceEntry.measured_parts`."""
        return len(self._values(site)) if self.law else 0

    def build(self, site: Site) -> tolerance.Measured | tolerance.Normal | tolerance.LogNormal:
        """See `ToleranceEntry.build`."""
        values = self._values(site)
        if self.values is not None and self.law is None:
            beyond = f"a value that {100 * RARE:g} % of the parts exceed lies beyond all of them with probability"
            found = f"a sample of {len(values)} has no tail: {beyond} {100 * (1.0 - RARE) ** len(values):.0f} %"
            raise refuse(found, 'add law = "normal" or "lognormal"')
        return tolerance.Measured.of(values.tolist()) if self.law is None else _fitted(self.law, values)

    def number(self, site: Site) -> str:
        """See `SingleEntry.number`."""
        return f"{len(self._values(site))} measured parts"

    def band(self, site: Site) -> None:
        """See `SingleEntry.band`."""

    def _values(self, site: Site) -> Array:
        """The values, SI."""
        if (self.values is None) == (self.file is None):
            raise refuse("needs either file and column, or values", "give one of the two")
        if self.values is not None:
            if self.column is not None:
                raise refuse("column without file", "remove it")
            if not all(map(math.isfinite, self.values)):
                raise refuse("a value is not a finite number", "give finite numbers")
            return _factor(self.unit, site, "the values") * np.array(self.values)
        if self.file is None or self.column is None:
            raise refuse("file without column", "add the name of the column")
        given = {} if self.unit is None else {self.column: self.unit}
        for unit in given.values():
            _factor(unit, site, "the values")  # refused here, where it stands
        table = TextTable(site.folder / self.file)
        values = table.numbers({self.column: site.unit}, [self.column], 2, given, ", or name another column")
        table.check()
        if (unit := table.units[self.column]) and unit != (self.unit or unit):
            raise refuse(f"unit is {self.unit!r}, but {table.path} has {unit!r}", "remove one of them")
        return values[self.column]


def _fitted(law: str, values: tolerance.Array) -> tolerance.Normal | tolerance.LogNormal:
    """Law with the mean and deviation of the sample; of its logarithms for the lognormal law."""
    if len(values) < LEAST_PARTS:
        raise refuse(f"{len(values)} parts are too few for a law", f"give at least {LEAST_PARTS} parts")
    if law == "lognormal":
        if not values.min() > 0.0:
            raise refuse("a value is not above zero, which a lognormal law needs", 'write law = "normal"')
        values = np.log(values)
    normal = tolerance.Normal(float(values.mean()), float(values.std(ddof=1)))
    if not normal.sigma > 0.0:
        raise refuse("all measured values are equal", "give the values as they were measured")
    return normal if law == "normal" else tolerance.LogNormal(0.0, normal)
