"""Change entries of ``[tolerances]`` by a factor or by ``--set``; the text of a study with changed entries."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from typing import Any, NamedTuple

from tolstat.common import units
from tolstat.common.notation import DIAMETER, PLUS_MINUS
from tolstat.joint import SPLINE
from tolstat.study import rewriting
from tolstat.study.study import Study
from tolstat.study.tolerances import fits, kinds
from tolstat.study.tolerances.entry import Site
from tolstat.study.tolerances.zones import ZoneEntry

_WIDTHS = ("plus_minus", "std", "sigma", "zone")
_PLACES = {"lower", "upper", "peak", "mean"}


class Tolerance(NamedTuple):
    """One entry of ``[tolerances]``: one tolerance on the drawing for all features that it selects.

    Attributes
    ----------
    pattern : str
        Pattern as written in the study.
    names : tuple of str
        Quantities that it draws, all with the same distribution.
    entry : dict
        Keys of the entry.
    site : Site
        Unit and middle of the errors.
    width : float
        The tolerance t, SI: half the band, or 3 standard deviations for an entry without a band; of a zone its size.
    mark : str
        What the width is: see `mark`.
    """

    pattern: str
    names: tuple[str, ...]
    entry: dict[str, Any]
    site: Site
    width: float
    mark: str

    @property
    def fixed(self) -> float | None:
        """Value that stays where it is when the tolerance is scaled, SI; None for an entry without a band.

        It is the middle of the band, or zero where one limit is zero, as for H7.
        """
        if "lower" not in self.entry:
            return self.site.center if {"plus_minus", "iso2768"} & self.entry.keys() else None
        ends = [units.to_si(self.entry[key], self.site.unit) for key in ("lower", "upper")]
        return 0.0 if 0.0 in ends else 0.5 * sum(ends)

    def scaled(self, factor: float, digits: int = 12) -> dict[str, Any]:
        """Entry with the tolerance `factor` times as wide; Cpk is unchanged.

        Limits, peak and mean keep their place in the band, which is scaled about the value `fixed`.

        Parameters
        ----------
        factor : float
            Above zero.
        digits : int
            Significant digits that lengths are rounded to.

        Returns
        -------
        dict
            Keys of the entry; a band after ISO 2768 becomes ``plus_minus``.
        """
        entry = dict(self.entry)
        if "iso2768" in entry:
            like = "1 deg" if self.site.unit == "rad" else "1 mm"
            entry = {"plus_minus": units.written(self.width, self.site.unit, like)} | entry
            del entry["iso2768"], entry["nominal"]
        for key in _WIDTHS:
            if key in entry:
                value = factor * units.to_si(entry[key], self.site.unit, DIAMETER if key == "zone" else PLUS_MINUS)
                entry[key] = units.written(value, self.site.unit, entry[key], digits)
        if (fixed := self.fixed) is not None:
            for key in _PLACES & entry.keys():
                value = units.to_si(entry[key], self.site.unit)
                if (moved := fixed + factor * (value - fixed)) != value:
                    entry[key] = units.written(moved, self.site.unit, entry[key], digits + 1)
        return entry


def tolerances(study: Study) -> list[Tolerance]:
    """Entries of a study that can be scaled, in its order; not those of operating point, material and spline.

    Left out are the position of an axis whose direction has a zone, too: that zone must stay the smaller one, and
    bounds where the middle is; and positions with a bonus with their diameters.
    """
    scalable = []
    for entry in study.entries:
        site, model = entry.models[0]
        of_parts = not site.name.startswith(("operation.", "material.", SPLINE))
        refined = any(place.shared and place.name.endswith(".position") for place, _ in entry.models)
        refined |= any(study.has_bonus(place.name) for place, _ in entry.models)
        if of_parts and not refined and model.scales:
            size = width(entry.keys, site)
            scalable.append(Tolerance(entry.pattern, entry.names, dict(entry.keys), site, size, mark(model)))
    return scalable


def mark(model: object) -> str:
    """Sign of a width on a drawing: ``"⌀"`` of a round zone, ``"wide"`` of a zone between planes, else ``"±"``."""
    return ("⌀" if model.zone.round else "wide") if isinstance(model, ZoneEntry) else "±"


def marked(mark: str, width: str) -> str:
    """Width with its sign: ``"±0.5 deg"``, ``"⌀0.1 mm"``, ``"0.05 mm wide"``."""
    return f"{width} wide" if mark == "wide" else f"{mark}{width}"


def width(entry: Mapping[str, Any], site: Site) -> float:
    """Tolerance t of an entry, SI; see `Tolerance.width`."""
    model: Any = kinds.entry(dict(entry), site, "scaled", ("tolerances", site.name))
    if isinstance(model, ZoneEntry):
        return model.zone.size
    half: float | None = model.half_width(site)
    if half is None and getattr(model, "lower", None) is not None:
        half = 0.5 * (model.upper - model.lower)
    return half if half is not None else 3.0 * float(getattr(model, "std", None) or model.sigma)


def line(pattern: str, entry: Mapping[str, Any]) -> str:
    """Entry as a line of a study file."""
    key = pattern if pattern.isidentifier() else json.dumps(pattern)
    return f"{key} = {rewriting.inline(entry)}"


def rewritten(study: Study, entries: Mapping[str, Mapping[str, Any]], seed: int, text: str | None = None) -> str:
    """Text of a study with other entries and another seed, comments kept.

    Parameters
    ----------
    study : Study
        The study.
    entries : mapping
        Pattern to keys of its entry.
    seed : int
        Seed of the sampling.
    text : str, optional
        Text of the study with other changes; that of the study unless given.

    Returns
    -------
    str
        TOML.

    Raises
    ------
    InputError
        See `rewriting.with_keys`.
    """
    text = study.text if text is None else text
    data = tomllib.loads(text)
    every = list(fits.entries(data["tolerances"], study.fit, study.mechanism))
    changes: dict[tuple[int | str, ...], dict[str, Any]] = {("sampling",): {"seed": seed}}
    for entry in every:
        if entry.pattern in entries and entry.path != fits.PATH:
            changes[entry.path] = dict.fromkeys(entry.value) | dict(entries[entry.pattern])
    diameters = {entry.pattern: entry.value for entry in every if entry.path == fits.PATH}
    if study.fit is not None and diameters.keys() & entries.keys():
        # the zones of a fit have changed: state what it stood for
        changes["tolerances",] = {fits.KEY: None} | {key: entries.get(key, diameters[key]) for key in diameters}
        if "contact" in data["joint"]:
            changes["joint", "contact"] = dict(study.fit.diameters)
        else:
            changes["joint",] = {"contact": study.fit.diameters}
    return rewriting.with_keys(text, changes, f"{study.name}.toml")


REPLACED_KEYS = {
    **dict.fromkeys(("plus_minus",), ("lower", "upper", "iso2768", "nominal")),
    **dict.fromkeys(("lower", "upper"), ("plus_minus", "iso2768", "nominal")),
    **dict.fromkeys(("iso2768", "nominal"), ("plus_minus", "lower", "upper")),
    "cpk": ("std", "sigma"),
    "std": ("cpk",),
    "sigma": ("cpk",),
}
"""Keys of a tolerance entry that each key replaces."""
