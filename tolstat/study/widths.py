"""Change lines of the drawing: entries of ``[tolerances]``, and groups of what they draw.

A distribution is narrowed or widened about the middle of its band, so its shape and Cpk stay: 0 to +30 um becomes +7.5
to +22.5 um if it is half as wide, and exactly +15 um if it is exact. An entry without a band (a standard deviation,
measured parts) is narrowed about its mean, a zone about the ideal axis. A fit gets another code in the text of the
study, so that the nominal diameters change, too. Random numbers belong to names, so the joints of a changed study have
the same scores as those of the study.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tolstat.common import units
from tolstat.common.errors import collected, gather, input_error
from tolstat.common.strict import did_you_mean
from tolstat.joint import varied
from tolstat.study import rewriting, scaling, selection
from tolstat.study.axes import is_pin, is_zone
from tolstat.study.file import load
from tolstat.study.study import Study
from tolstat.study.tolerances import fits, iso
from tolstat.study.tolerances.correlation import Group
from tolstat.study.tolerances.distributions import Array, Distribution
from tolstat.study.tolerances.entry import SingleEntry, Site, Toleranced, ToleranceEntry

HALF, EXACT, FINER, COARSER = STEPS = ("half", "exact", "finer", "coarser")
"""Changes of a width: by one half, to zero, and by one class of ISO 2768, finer or coarser."""
FACTORS = {HALF: 0.5, EXACT: 0.0, FINER: 0.63, COARSER: 1.6}
"""Factor of each step; of a class where the entry has none: neighbouring grades of ISO 286 differ by 10^(1/5)."""
CLASSES = ("f", "m")
"""Classes of ISO 2768-1 that the tables have, the finer one first."""


@dataclass(frozen=True)
class Rescaled(Distribution):
    """Distribution made `factor` times as wide about `middle`.

    Attributes
    ----------
    every : Distribution
        Distribution as drawn.
    middle : float
        SI.
    factor : float
        Zero for an exact value.
    """

    every: Distribution
    middle: float
    factor: float

    def ppf(self, u: Array) -> Array:
        """See `Distribution.ppf`."""
        return self.middle + self.factor * (self.every.ppf(u) - self.middle)

    def cdf(self, x: Array) -> Array:
        """See `Distribution.cdf`."""
        off = x - self.middle
        if self.factor == 0.0:
            return np.where(off >= 0.0, 1.0, 0.0)
        return self.every.cdf(self.middle + off / self.factor)

    def describe(self) -> dict[str, Any]:
        """See `Distribution.describe`."""
        parameters = {"middle": self.middle, "factor": self.factor}
        return {"distribution": "rescaled", "every": self.every.describe(), **parameters}


def lines(study: Study) -> list[Group]:
    """Entries of ``[tolerances]`` that can be changed, in their order; the diameters of a fit are one of them."""
    names_of: dict[str, tuple[str, ...]] = {}
    for entry in study.entries:
        if _free(study, entry):
            line = label(study, entry)
            names_of[line] = (*names_of.get(line, ()), *entry.names)
    return [Group(line, names) for line, names in names_of.items()]


def label(study: Study, entry: Toleranced) -> str:
    """Label of the line that an entry is: its pattern, or the fit that it belongs to."""
    return _fit_label(study) if _is_of_fit(study, entry) else entry.pattern


def features(study: Study) -> list[Group]:
    """Each pin with its hole: all that is drawn of the two."""
    groups = [
        Group(f"{pin} and {hole}", tuple(name for name in _drawn(study) if name.rpartition(".")[0] in (pin, hole)))
        for pin, hole, *_ in study.mechanism.pairs
    ]
    return [group for group in groups if group.names]


def errors(study: Study) -> list[Group]:
    """Each quantity that the study draws, by itself."""
    return [Group(name, (name,)) for name in _drawn(study)]


def named(study: Study, texts: Sequence[str]) -> list[Group]:
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
    groups, known = [], list(_drawn(study))
    with collected() as faults:
        for text in texts:
            label, equals, patterns = (part.strip() for part in text.partition("="))
            names: dict[str, None] = {}
            with gather(faults):
                if not (label and equals and patterns):
                    remedy = 'write --group "tilts = pin*.tilt_*, hole*.tilt_*"'
                    raise input_error(f"--group {text!r}", "is not a name with patterns", remedy)
                for pattern in map(str.strip, patterns.split(",")):
                    selected = selection.select(pattern, known)
                    if not selected:
                        remedy = did_you_mean(pattern, [*(line.label for line in lines(study)), *known])
                        raise input_error(f"--group {text!r}", f"{pattern!r} selects no line", remedy)
                    names |= dict.fromkeys(selected)
                groups.append(Group(label, tuple(names)))
    return groups


def left_out(study: Study) -> list[str]:
    """Entries whose width is not changed: zones that depend on another zone, or on a bonus, and their diameters."""
    return [entry.pattern for entry in study.entries if not _free(study, entry)]


def steps(study: Study, line: Group) -> tuple[str, ...]:
    """Changes of a line: `STEPS`; of a fit the codes of `other_fits`."""
    return STEPS if study.fit is None or line.label != _fit_label(study) else tuple(other_fits(study.fit))


def other_fits(fit: fits.Fit) -> dict[str, iso.Zones]:
    """Fits next to that of the drawing, with their zones.

    They have the hole's fundamental deviation or grade that follows in the tables, on either side. In the system of
    the basic hole, H, the hole keeps its deviation, and the shaft's deviation and grade are changed, too. Fits are left
    out with which a pin of its zone may be larger than a hole of its zone.
    """
    code = iso.parse(fit.entry.code)
    is_basis = code.hole == "H"
    changes = [] if is_basis else [("hole", iso.HOLES)]
    changes += [("hole_grade", iso.GRADE_NAMES)]
    changes += [("shaft", iso.SHAFTS), ("shaft_grade", iso.GRADE_NAMES)] if is_basis else []
    fits_beside = {}
    for part, names in changes:
        index = names.index(getattr(code, part))
        for name in names[max(index - 1, 0) : index + 2]:
            other = code._replace(**{part: name})
            zones = iso.zones(other, fit.entry.size)
            if other != code and zones.least >= 0.0:
                fits_beside[str(other)] = zones
    return fits_beside


def after(study: Study, line: Group, step: str) -> Study:
    """Study with a line after one of its `steps`, with joints as `applied` draws them."""
    if step in STEPS:
        return applied(study, changed(study, line, step))
    text = rewriting.with_keys(study.text, {fits.PATH: {"code": step}}, f"{study.name}.toml")
    assert study.fit is not None
    fit = study.fit._replace(entry=study.fit.entry.model_copy(update={"code": step}))
    diameters = {f"contact.{key}": units.to_si(value, "m") for key, value in fit.diameters.items()}
    # the joint file need not be there any more: the joint in hand has all that it gave
    joints = [varied(joint, diameters) for joint in (study.joint, study.operation.joint2) if joint]
    return applied(load(study.path, study.sampling.n, text, *joints), {})


def changed(study: Study, line: Group, step: str) -> dict[str, Distribution]:
    """Distributions of a line with another width, by name of the quantity.

    Parameters
    ----------
    study : Study
        The study.
    line : Group
        What is changed.
    step : str
        One of `STEPS`.
    """
    drawn, distributions = _drawn(study), dict[str, Distribution]()
    for name, factor in factors(study, line, step).items():
        _, site, model = drawn[name]
        band = model.band(site) if isinstance(model, SingleEntry) else None
        base = study.tolerances[name]
        middle = 0.0 if is_zone(name) else base.moments.mean if band is None else 0.5 * (band[0] + band[1])
        distributions[name] = Rescaled(base, middle, factor)
    return distributions


def factors(study: Study, line: Group, step: str) -> dict[str, float]:
    """How many times as wide each quantity of a line is after one of its `steps`."""
    if step in STEPS:
        drawn = _drawn(study)
        return {name: _width(*drawn[name][:2], step)[0] for name in line.names}
    assert study.fit is not None
    pairs = zip(other_fits(study.fit)[step], study.fit.entry.zones, strict=True)
    hole, pin = (new.half / old.half for new, old in pairs)
    return {name: pin if is_pin(name) else hole for name in line.names}


def applied(study: Study, distributions: Mapping[str, Distribution]) -> Study:
    """Return the study with other distributions, whose joints are drawn at random with the same seed.

    The sampling is ``random`` whatever the study's: joint i is independent of the others, and has the same scores with
    any distributions.
    """
    sampling = study.sampling.model_copy(update={"method": "random", "joints_per_lot": 1})
    tolerances = study.tolerances | dict(distributions)
    return replace(study, sampling=sampling, tolerances=tolerances)


def words(study: Study, line: Group, step: str) -> str:
    """What a step does to a line: ``"half"``, ``"class m"``, ``"mean radial clearance +15 µm"``; several in a row."""
    if step not in STEPS:
        assert study.fit is not None
        old, new = study.fit.entry.zones, other_fits(study.fit)[step]
        looser = 0.25 * (new.least + new.largest - old.least - old.largest)  # of the radius, half of each middle
        return f"mean radial clearance {looser:+.3g} µm".replace("-", "−")
    drawn = _drawn(study)
    return ", ".join(dict.fromkeys(_width(*drawn[name][:2], step)[1] for name in line.names))


def size(study: Study, line: Group) -> str:
    """Tolerance of a line, ``"±0.5 deg"``, or code of its fit; empty if its quantities have several."""
    if study.fit is not None and line.label == _fit_label(study):
        return study.fit.entry.code
    sizes, drawn = set(), _drawn(study)
    for entry, site, model in map(drawn.__getitem__, line.names):
        if not model.scales:
            return ""
        size = units.shown(scaling.width(entry.keys, site), site.unit)
        sizes.add(scaling.marked(scaling.mark(model), size))
    return sizes.pop() if len(sizes) == 1 else ""


def _width(entry: Toleranced, site: Site, step: str) -> tuple[float, str]:
    """Factor of the width of a quantity after one of `STEPS`, and the step in words."""
    side = {FINER: -1, COARSER: 1}.get(step, 0)
    grade = entry.keys.get("iso2768")
    if side and grade in CLASSES and 0 <= CLASSES.index(grade) + side < len(CLASSES):
        other, kind = CLASSES[CLASSES.index(grade) + side], "angular" if site.unit == "rad" else "linear"
        nominal = units.to_si(entry.keys["nominal"], "m")
        old, new = (iso.deviation(kind, name, nominal) for name in (grade, other))
        if new != old:
            return new / old, f"class {other}"
    return FACTORS[step], f"× {FACTORS[step]:g}" if side else step


def _fit_label(study: Study) -> str:
    assert study.fit is not None
    return f"fit {study.fit.entry.code}"


def _is_of_fit(study: Study, entry: Toleranced) -> bool:
    return study.fit is not None and entry.pattern in fits.patterns(study.mechanism)


def _free(study: Study, entry: Toleranced) -> bool:
    """Whether an entry, or the fit that it belongs to, can be changed without regard to other entries."""
    is_of_fit = _is_of_fit(study, entry)
    together = [other for other in study.entries if other is entry or (is_of_fit and _is_of_fit(study, other))]
    return not any(site.shared or study.has_bonus(site.name) for other in together for site, _ in other.models)


def _drawn(study: Study) -> dict[str, tuple[Toleranced, Site, ToleranceEntry]]:
    """Entry, place and model of each quantity of the entries that can be changed, by its name."""
    return {
        name: (entry, site, model)
        for entry in study.entries
        if _free(study, entry)
        for site, model in entry.models
        for name in model.quantities(site)
    }
