"""Change entries of ``[tolerances]`` by a factor or by ``--set``; the text of a study with changed entries."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from tolstat.common import units
from tolstat.common.errors import Fault, InputError, collected, gather, input_error
from tolstat.common.notation import DIAMETER, PLUS_MINUS
from tolstat.common.strict import did_you_mean
from tolstat.study import rewriting, selection
from tolstat.study.study import Study
from tolstat.study.tolerances import fits, kinds, zones
from tolstat.study.tolerances.distributions import Distribution
from tolstat.study.tolerances.entry import Site, Toleranced, ToleranceEntry
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
                moved = fixed + factor * (value - fixed)
                entry[key] = (
                    entry[key] if moved == value else units.written(moved, self.site.unit, entry[key], digits + 1)
                )
        return entry

    def distribution(self, entry: Mapping[str, Any]) -> Distribution:
        """Distribution that `entry` gives each of the quantities."""
        read = kinds.entry(dict(entry), self.site, "scaled", ("tolerances", self.pattern))
        return next(iter(read.quantities(self.site).values()))


def tolerances(study: Study) -> list[Tolerance]:
    """Entries of a study that can be scaled, in its order; not those of operating point and material.

    Left out are entries with correlated errors, which cannot be scaled independently; the position of an axis whose
    direction has a zone, too: that zone must stay the smaller one, and bounds where the middle is; and positions with a
    bonus with their diameters.
    """
    scalable = []
    for entry in study.entries:
        site, model = entry.models[0]
        of_parts = not site.name.startswith(("operation.", "material."))
        refined = any(place.shared and place.name.endswith(".position") for place, _ in entry.models)
        refined |= any(study.has_bonus(place.name) for place, _ in entry.models)
        if of_parts and not refined and model.scales and not set(entry.names) & set(study.copula.names):
            scalable.append(
                Tolerance(entry.pattern, entry.names, dict(entry.keys), site, width(entry.keys, site), mark(model))
            )
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
    return f"{json.dumps(pattern)} = {rewriting.inline(entry)}"


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
    every = list(fits.entries(data["tolerances"], study.fit))
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
EXAMPLE = 'write --set "pin*.offset_t.plus_minus=0.05 mm"'


def changed(study: Study, settings: Sequence[str]) -> dict[str, Distribution]:
    """Tolerances of a study with some keys changed.

    Parameters
    ----------
    study : Study
        The study, which is not modified.
    settings : sequence of str
        ``"pin*.offset_t.plus_minus=0.05 mm"``: name or pattern of errors that the study scatters, key of their
        tolerances, value as in TOML; quotes may be left out. Later settings override earlier ones. A band given one
        way replaces a band given another way, and ``cpk`` replaces ``std``.

    Returns
    -------
    dict
        Error name to distribution, of all errors that the study scatters.

    Raises
    ------
    InputError
        With every fault of the settings.
    """
    sites = {site.name: site for entry in study.entries for site, _ in entry.models}
    distributions = dict(study.tolerances)
    read: dict[str, tuple[Site, ToleranceEntry]] = {}
    by_setting: dict[tuple[str, str], Fault] = {}  # a fault is reported once for all errors of a pattern
    with collected() as faults:
        entries, touched = _keys(study, settings, faults)
        for name, text in touched.items():
            site, place = sites[name], f"--set {text!r}"
            try:
                _check_bonus(study, name, place)
                read[name] = site, kinds.entry(entries[name], site, place, ("tolerances", name))
                _check_zone(study, site, read[name][1], place)
                distributions |= read[name][1].quantities(site)
            except InputError as error:
                for fault in error.faults:
                    by_setting.setdefault((text, fault.found), fault)
        faults += by_setting.values()
    new = [e._replace(models=tuple(read.get(m[0].name, m) for m in e.models)) for e in study.entries]
    zones.axes_of(new, study.joint.cross.R, "--set")
    return distributions


def rewritten_with(study: Study, settings: Sequence[str]) -> str:
    """Text of a study with some keys of its tolerances changed, see `changed`; comments and seed are kept.

    An entry whose settings are for some of its errors only becomes one entry for each of its errors.

    Returns
    -------
    str
        TOML.

    Raises
    ------
    InputError
        With the faults of the settings; see `rewriting.with_keys`.
    """
    with collected() as faults:
        keys, touched = _keys(study, settings, faults)
    alike: dict[str, dict[str, Any]] = {}
    parted: list[Toleranced] = []
    for entry in study.entries:
        names = [site.name for site, _ in entry.models]
        if touched.keys() & set(names):
            first, *others = (keys[name] for name in names)
            alike[entry.pattern] = first if all(other == first for other in others) else dict(entry.keys)
            parted += [entry] * any(other != first for other in others)
    text = rewritten(study, alike, study.sampling.seed)
    paths = {entry.pattern: entry.path for entry in fits.entries(tomllib.loads(text)["tolerances"], None)}
    changes: dict[tuple[int | str, ...], dict[str, Any]] = {("tolerances",): {}}
    for entry in parted:
        *table, key = paths[entry.pattern]
        changes.setdefault(tuple(table), {})[str(key)] = None
        changes["tolerances",] |= {site.name: keys[site.name] for site, _ in entry.models}
    return rewriting.with_keys(text, changes, f"{study.name}.toml")


def _keys(
    study: Study, settings: Sequence[str], faults: list[Fault]
) -> tuple[dict[str, dict[str, Any]], dict[str, str]]:
    """Keys of the entry of each error with the settings; and the setting that changes them, of those changed."""
    keys = {site.name: dict(entry.keys) for entry in study.entries for site, _ in entry.models}
    touched: dict[str, str] = {}
    for text in settings:
        with gather(faults):
            path, equals, value = text.partition("=")
            pattern, dot, key = path.strip().rpartition(".")
            if not (equals and dot and pattern and key and value.strip()):
                raise input_error(f"--set {text!r}", "is not a setting", EXAMPLE)
            names = selection.select(pattern, keys)
            if not names:
                remedy = did_you_mean(pattern, list(keys))
                raise input_error(f"--set {text!r}", "selects no error that has a tolerance", remedy)
            for name in names:
                kept = {k: v for k, v in keys[name].items() if k not in REPLACED_KEYS.get(key, ())}
                keys[name] = kept | {key: rewriting.given(value)}
                touched[name] = text
    return keys, touched


def _check_bonus(study: Study, name: str, place: str) -> None:
    """Refuse changes of a position with a bonus and of its diameter: they move what a part's zone is."""
    if study.has_bonus(name):
        found = "a position with a bonus by maximum material cannot be changed, nor its diameter"
        raise input_error(place, found, "run a study of its own")


def _check_zone(study: Study, site: Site, new: ToleranceEntry, place: str) -> None:
    """Refuse changes of a zone for which the density of the errors is no function of radius and direction alone."""
    if not isinstance(new, zones.ZoneEntry):
        return
    old: Any = next(model for entry in study.entries for other, model in entry.models if other.name == site.name)
    changed_length = site.name.endswith(".position") and new.over != old.over
    if changed_length or new.quantities(site).keys() != old.quantities(site).keys():
        found = f"{site.name} gets another shape, not another size"
        raise input_error(place, found, "change zone, cp, truncate or distribution only, or run a study of its own")
    if site.shared and isinstance(new, zones.PositionEntry) and new.build() != old.build():
        found = f"{site.name} cannot be changed: the axis has a zone of direction, too, which shares its room"
        raise input_error(place, found, "run a study of its own")
