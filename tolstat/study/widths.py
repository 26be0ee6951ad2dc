"""Change the width of lines of the drawing: entries of ``[tolerances]``, and groups of what they draw.

A distribution is narrowed or widened about the middle of its band, so its shape and Cpk stay: 0 to +30 um becomes +7.5
to +22.5 um if it is half as wide, and exactly +15 um if it is exact. An entry without a band (a standard deviation,
measured parts) is narrowed about its mean, a zone about the ideal axis. Random numbers belong to names, so the joints
of a changed study have the same scores as those of the study.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from tolstat.common import units
from tolstat.common.errors import Fault, InputError, gather
from tolstat.common.strict import did_you_mean
from tolstat.joint import HOLE_OF_PIN
from tolstat.study import scaling, selection
from tolstat.study.axes import is_zone
from tolstat.study.study import Study
from tolstat.study.tolerances import fits, iso286, iso2768
from tolstat.study.tolerances.distributions import Array, Distribution
from tolstat.study.tolerances.entry import SingleEntry, Site, Toleranced, ToleranceEntry

HALF, EXACT, FINER, COARSER = STEPS = ("half", "exact", "finer", "coarser")
"""Changes of a width: by one half, to zero, and by one class of ISO 286 or ISO 2768, finer or coarser."""
FACTORS = {HALF: 0.5, EXACT: 0.0, FINER: 0.63, COARSER: 1.6}
"""Factor of each step; of a class where the entry has none: neighbouring grades of ISO 286 differ by 10^(1/5)."""
CLASSES = ("f", "m")
"""Classes of ISO 2768-1 that the tables have, the finer one first."""


@dataclass(frozen=True)
class Rescaled(Distribution):
    """Distribution made `factor` times as wide about `middle`, then moved by `shift`.

    Attributes
    ----------
    every : Distribution
        Distribution as drawn.
    middle, shift : float
        SI.
    factor : float
        Zero for an exact value.
    """

    every: Distribution
    middle: float
    factor: float
    shift: float = 0.0

    def ppf(self, u: Array) -> Array:
        """See `Distribution.ppf`."""
        return self.middle + self.shift + self.factor * (self.every.ppf(u) - self.middle)

    def cdf(self, x: Array) -> Array:
        """See `Distribution.cdf`."""
        off = x - self.shift - self.middle
        if self.factor == 0.0:
            return np.where(off >= 0.0, 1.0, 0.0)
        return self.every.cdf(self.middle + off / self.factor)

    def logpdf(self, x: Array) -> Array:
        """See `Distribution.logpdf`."""
        off = x - self.shift - self.middle
        if self.factor == 0.0:
            return np.where(off == 0.0, 0.0, -np.inf)
        return self.every.logpdf(self.middle + off / self.factor) - (0.0 if self.discrete else math.log(self.factor))

    @property
    def discrete(self) -> bool:
        """See `Distribution.discrete`."""
        return self.factor == 0.0 or self.every.discrete

    def describe(self) -> dict[str, Any]:
        """See `Distribution.describe`."""
        own = {"middle": self.middle, "factor": self.factor, "shift": self.shift}
        return {"distribution": "rescaled", "every": self.every.describe(), **own}


class Line(NamedTuple):
    """What is changed together.

    Attributes
    ----------
    label : str
        Pattern of the entry, name of a group, feature or error.
    names : tuple of str
        Quantities that the study draws.
    """

    label: str
    names: tuple[str, ...]


class Width(NamedTuple):
    """Width of one quantity after a step.

    Attributes
    ----------
    factor, shift : float
        As in `Rescaled`.
    words : str
        ``"half"``, ``"exact"``, ``"× 0.63"``, ``"class m"``,
        ``"f8 (mean clearance +8 µm)"``: of a fit with the change of the mean radial clearance.
    """

    factor: float
    shift: float
    words: str


def lines(study: Study) -> list[Line]:
    """Entries of ``[tolerances]`` whose width can be changed, in their order."""
    return [Line(entry.pattern, tuple(entry.quantities)) for entry in study.entries if _free(study, entry)]


def features(study: Study) -> list[Line]:
    """Each pin with its hole: all that is drawn of the two."""
    pairs = [(pin, hole, f"{pin} and {hole}") for pin, hole in HOLE_OF_PIN.items()]
    return [
        Line(label, names)
        for pin, hole, label in pairs
        if (names := tuple(n for n in _names(study) if n.partition(".")[0] in (pin, hole)))
    ]


def errors(study: Study) -> list[Line]:
    """Each quantity that the study draws, by itself."""
    return [Line(name, (name,)) for name in _names(study)]


def named(study: Study, texts: Sequence[str]) -> list[Line]:
    """Groups that a user names.

    Parameters
    ----------
    study : Study
        The study.
    texts : sequence of str
        ``"tilts = pin*.tilt_*, hole*.tilt_*"``: name, and patterns of what the study draws.

    Raises
    ------
    InputError
        With every fault of the texts.
    """
    found, faults, known = [], list[Fault](), _names(study)
    for text in texts:
        label, equals, patterns = (part.strip() for part in text.partition("="))
        names: dict[str, None] = {}
        with gather(faults):
            if not (label and equals and patterns):
                remedy = 'write --group "tilts = pin*.tilt_*, hole*.tilt_*"'
                raise InputError([Fault(f"--group {text!r}", "is not a name with patterns", remedy)])
            for pattern in (one.strip() for one in patterns.split(",")):
                own = selection.select(pattern, known)
                if not own:
                    entries = [line.label for line in lines(study)]
                    remedy = did_you_mean(pattern, [*entries, *known])
                    raise InputError([Fault(f"--group {text!r}", f"{pattern!r} selects no line", remedy)])
                names |= dict.fromkeys(own)
            found.append(Line(label, tuple(names)))
    if faults:
        raise InputError(faults)
    return found


def left_out(study: Study) -> list[str]:
    """Entries whose width is not changed: zones that depend on another zone, or on a bonus, and their diameters."""
    return [entry.pattern for entry in study.entries if not _free(study, entry)]


def changed(study: Study, line: Line, step: str) -> dict[str, Distribution]:
    """Distributions of a line after a step, by name of the quantity.

    Parameters
    ----------
    study : Study
        The study.
    line : Line
        What is changed.
    step : str
        One of `STEPS`.
    """
    every = {name: (entry, site, model) for entry, name, site, model in _drawn(study)}
    found: dict[str, Distribution] = {}
    for name in line.names:
        entry, site, model = every[name]
        own = width(study, entry, site, model, step)
        base = study.tolerances[name]
        found[name] = Rescaled(base, _middle(name, site, model, base), own.factor, own.shift)
    return found


def applied(study: Study, distributions: Mapping[str, Distribution]) -> Study:
    """Return the study with other distributions, whose joints are drawn at random with the same seed.

    The sampling is ``random`` whatever the study's: joint i is independent of the others, and has the same scores with
    any distributions.
    """
    sampling = study.sampling.model_copy(update={"method": "random", "joints_per_lot": 1})
    tolerances = study.tolerances | dict(distributions)
    return replace(study, sampling=sampling, tolerances=tolerances, proposals=(), groups=())


def words(study: Study, line: Line, step: str) -> str:
    """What a step does to a line, in words: ``"half"``, ``"class m"``; several are joined by commas."""
    every = {name: (entry, site, model) for entry, name, site, model in _drawn(study)}
    return ", ".join(dict.fromkeys(width(study, *every[name], step).words for name in line.names))


def size(study: Study, line: Line, factor: float = 1.0) -> str:
    """Tolerance of a line, made `factor` times as wide: ``"±0.5 deg"``; empty if its quantities have several."""
    found = set()
    for entry, name, site, model in _drawn(study):
        if name in line.names:
            if entry.keys["distribution"] not in scaling.SCALED:
                return ""
            size = units.shown(factor * scaling.width(entry.keys, site), site.unit)
            found.add(scaling.marked(scaling.mark(model), size))
    return found.pop() if len(found) == 1 else ""


def width(study: Study, entry: Toleranced, site: Site, model: ToleranceEntry, step: str) -> Width:
    """Width of one quantity of an entry after a step."""
    factor, side = FACTORS[step], {FINER: -1, COARSER: 1}.get(step, 0)
    if side and study.fit is not None and entry.pattern in (fits.HOLE, fits.PIN):
        return _graded(study.fit, entry.pattern == fits.HOLE, side) or Width(factor, 0.0, f"× {factor:g}")
    if side and (found := _classed(entry, site, side)) is not None:
        return found
    return Width(factor, 0.0, f"× {factor:g}" if side else step)


def _graded(fit: fits.Fit, is_hole: bool, side: int) -> Width | None:
    """Width of the diameters of a fit in the neighbouring grade, with the shift of the middle of the zone."""
    code = iso286.parse(fit.entry.code)
    letter, grade = (code.hole, code.hole_grade) if is_hole else (code.shaft, code.shaft_grade)
    place = iso286.GRADE_NAMES.index(grade) + side
    if not 0 <= place < len(iso286.GRADE_NAMES):
        return None
    other = iso286.GRADE_NAMES[place]
    moved = code._replace(**{"hole_grade" if is_hole else "shaft_grade": other})
    zones = fit.entry.zones, iso286.zones(moved, round(1e3 * fit.entry.basic, 9))
    old, new = (zone.hole if is_hole else zone.shaft for zone in zones)
    moved_by = new.middle - old.middle
    looser = 0.5 * (moved_by if is_hole else -moved_by)
    said = f"{letter}{other} (mean clearance {looser:+.3g} µm)".replace("-", "−")
    return Width(new.half / old.half, 1e-6 * moved_by, said)


def _classed(entry: Toleranced, site: Site, side: int) -> Width | None:
    """Width in the neighbouring class of ISO 2768; None without a class, or where the tables have no other width."""
    own = entry.keys.get("iso2768")
    if own not in CLASSES or not 0 <= CLASSES.index(own) + side < len(CLASSES):
        return None
    other, kind = CLASSES[CLASSES.index(own) + side], "angular" if site.unit == "rad" else "linear"
    nominal = units.to_si(entry.keys["nominal"], "m")
    old, new = (iso2768.deviation(kind, one, nominal) for one in (own, other))
    return None if new == old else Width(new / old, 0.0, f"class {other}")


def _middle(name: str, site: Site, model: ToleranceEntry, distribution: Distribution) -> float:
    """Value that a quantity is narrowed about."""
    if is_zone(name):
        return 0.0
    band = model.band(site) if isinstance(model, SingleEntry) else None
    return distribution.moments.mean if band is None else 0.5 * (band[0] + band[1])


def _free(study: Study, entry: Toleranced) -> bool:
    """Whether the width of an entry can be changed without regard to other entries."""
    return not any(site.shared or study.has_bonus(site.name) for site, _ in entry.models)


def _drawn(study: Study) -> Iterator[tuple[Toleranced, str, Site, ToleranceEntry]]:
    for entry in study.entries:
        if _free(study, entry):
            for site, model in entry.models:
                for name in model.quantities(site):
                    yield entry, name, site, model


def _names(study: Study) -> list[str]:
    return [name for _, name, _, _ in _drawn(study)]
