"""Laws of scipy.stats: ``distribution = "scipy:weibull_min(c=1.8, scale=0.012)"``, a call with literal numbers.

The text is parsed, never evaluated; scipy.stats is imported for studies that have such an entry only.
"""

from __future__ import annotations

import ast
import math
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from typing import Any

import numpy as np
from pydantic import Field

from tolstat.common import units
from tolstat.common.late import stats
from tolstat.common.strict import did_you_mean, refuse
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
        own = self.whole.cdf(x) - below if below < 0.5 else self.whole.sf(self.ends[0]) - self.whole.sf(x)
        return np.asarray(np.clip(own / self.share, 0.0, 1.0))

    def logpdf(self, x: Array) -> Array:
        """See `Distribution.logpdf`."""
        x = np.asarray(x) / self.unit
        inside = (x >= self.ends[0]) & (x <= self.ends[1])
        return np.where(inside, self.whole.logpdf(x) - math.log(self.unit * self.share), -np.inf)

    def describe(self) -> dict[str, Any]:
        """See `Distribution.describe`."""
        band = {key: end for key, end in (("lower", self.lower), ("upper", self.upper)) if end is not None}
        return {"distribution": f"{PREFIX}{self.name}", **dict(self.parameters), "unit": self.unit, **band}


class ScipyEntry(SingleEntry):
    """Continuous law of scipy.stats with literal numbers, such as `"scipy:weibull_min(c=1.8, scale=0.012)"`.

    `loc` and `scale` have the unit `unit`. Parts outside `lower` and `upper` are sorted out.
    """

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
        if self.unit is None and site.unit != "1":
            raise refuse("missing key unit", 'add the unit of loc and scale, for example unit = "mm"')
        unit = units.to_si(1.0 if self.unit is None else f"1 {self.unit}", site.unit)
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


def _parsed(text: str) -> tuple[str, tuple[tuple[str, float], ...]]:
    """Name and parameters of a law from a call with literal numbers."""
    try:
        call = ast.parse(text.strip() if len(text) <= MAX_LENGTH else "", mode="eval").body
        if not (isinstance(call, ast.Call) and isinstance(call.func, ast.Name)):
            raise ValueError("no call of a name")
        given = [(str(keyword.arg), ast.literal_eval(keyword.value)) for keyword in call.keywords]
        placed = [ast.literal_eval(value) for value in call.args]
        name = call.func.id
        if any(type(value) not in (int, float) for value in (*placed, *(value for _, value in given))):
            raise ValueError("not only numbers")
    except (SyntaxError, ValueError, TypeError, MemoryError, RecursionError) as error:
        raise refuse(f"{text[:MAX_LENGTH]!r} is no law with numbers", EXAMPLE) from error
    laws = {key: law for key, law in vars(import_module("scipy.stats")).items() if isinstance(law, stats.rv_continuous)}
    if name not in laws:
        raise refuse(f"scipy.stats has no continuous law {name!r}", did_you_mean(name, sorted(laws)))
    shapes = laws[name].shapes.split(", ") if laws[name].shapes else []
    allowed = [*shapes, "loc", "scale"]
    pairs = [*zip(allowed, placed, strict=False), *given]
    names = [key for key, _ in pairs]
    if len(placed) > len(allowed) or len(set(names)) < len(names) or not set(shapes) <= set(names) <= set(allowed):
        raise refuse(f"{text!r} does not give each parameter once", f"{name} has {', '.join(allowed)}")
    return name, tuple(
        (str(key), float(value)) for key, value in sorted(pairs, key=lambda pair: allowed.index(pair[0]))
    )
